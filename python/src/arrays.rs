//! Arrays of numpy, and of whoever else offers buffers, as numbers of a scene. Each is copied once, into what the scene keeps.

use std::sync::Arc;

use pyo3::buffer::{Element, PyBuffer};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyAny;
use spectile::scene::arrays::{self as scene, Corners, Mesh};

/// Numbers that stand in a scene where a file would be named.
#[pyclass(frozen)]
pub struct Data(pub Arc<scene::Data>);

#[pymethods]
impl Data {
    fn __repr__(&self) -> String {
        format!("<{}>", self.0.name())
    }
}

/// A picture or a grid: float32 in any number of dimensions. `name` is what messages call it.
#[pyfunction]
pub fn numbers(name: String, array: &Bound<'_, PyAny>) -> PyResult<Data> {
    let (shape, values) = floats(array, &name)?;
    Ok(Data(Arc::new(scene::Data::Numbers { name, shape, values })))
}

/// A mesh: float64 vertices [vertex, 3], uint32 faces [face, 3], and float64 uv and normals [vertex, 2 or 3] or [face, 3, 2 or 3].
#[pyfunction]
#[pyo3(signature = (name, vertices, faces, uv=None, normals=None))]
pub fn mesh(
    name: String,
    vertices: &Bound<'_, PyAny>,
    faces: &Bound<'_, PyAny>,
    uv: Option<&Bound<'_, PyAny>>,
    normals: Option<&Bound<'_, PyAny>>,
) -> PyResult<Data> {
    let mesh = Mesh {
        vertices: rows::<f64, 3>(vertices, "vertices", "[vertex, 3]")?,
        faces: rows::<u32, 3>(faces, "faces", "[face, 3]")?,
        uv: uv.map(|uv| corners::<2>(uv, "uv")).transpose()?,
        normals: normals.map(|normals| corners::<3>(normals, "normals")).transpose()?,
        name,
    };
    Ok(Data(Arc::new(scene::Data::Mesh(mesh))))
}

/// Shape and numbers of a float32 array, whatever its strides.
pub fn floats(array: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<usize>, Vec<f32>)> {
    read::<f32>(array, what)
}

fn read<T: Element>(array: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<usize>, Vec<T>)> {
    let buffer = PyBuffer::<T>::get(array).map_err(|error| {
        PyValueError::new_err(format!("{what}: not an array of {}: {error}", std::any::type_name::<T>()))
    })?;
    Ok((buffer.shape().to_vec(), buffer.to_vec(array.py())?))
}

fn rows<T: Element, const N: usize>(array: &Bound<'_, PyAny>, what: &str, wanted: &str) -> PyResult<Vec<[T; N]>> {
    let (shape, values) = read::<T>(array, what)?;
    match shape[..] {
        [_, n] if n == N => Ok(values.as_chunks::<N>().0.to_vec()),
        _ => Err(PyValueError::new_err(format!("`{what}` must be {wanted}, but has the shape {shape:?}"))),
    }
}

fn corners<const N: usize>(array: &Bound<'_, PyAny>, what: &str) -> PyResult<Corners<N>> {
    let (shape, values) = read::<f64>(array, what)?;
    let rows = values.as_chunks::<N>().0;
    match shape[..] {
        [_, n] if n == N => Ok(Corners::OfVertices(rows.to_vec())),
        [_, 3, n] if n == N => Ok(Corners::OfFaces(rows.as_chunks::<3>().0.to_vec())),
        _ => Err(PyValueError::new_err(format!(
            "`{what}` must be [vertex, {N}] or [face, 3, {N}], but has the shape {shape:?}"
        ))),
    }
}
