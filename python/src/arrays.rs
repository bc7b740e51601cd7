//! Arrays of numpy, and of whoever else offers buffers, as numbers of a scene. Each is copied once, into what the scene keeps: it is
//! read, checked and taken into the digest while other threads go on, which may change an array of theirs at any time.

use std::sync::Arc;

use pyo3::buffer::{Element, PyBuffer};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyAny;
use spectile::scene::arrays::{self as scene, Corners, Mesh, Table, Words};

/// Numbers that stand in a scene where a file would be named.
#[pyclass(frozen)]
pub struct Data(pub Arc<scene::Data>);

#[pymethods]
impl Data {
    fn __repr__(&self) -> String {
        format!("<{}>", self.0.name())
    }

    /// [nm, value] of a spectrum that says no more of itself than a table in a scene; else None.
    fn samples(&self) -> Option<Vec<(f64, f64)>> {
        let (nm, value) = self.0.plain()?;
        Some(nm.iter().copied().zip(value.iter().copied()).collect())
    }
}

/// A picture or a grid: float32 in any number of dimensions. `name` is what messages call it; `units` and `names` are what the array says
/// of its numbers.
#[pyfunction]
#[pyo3(signature = (name, array, units=None, names=Vec::new()))]
pub fn numbers(name: String, array: &Bound<'_, PyAny>, units: Option<String>, names: Vec<String>) -> PyResult<Data> {
    let (shape, values) = floats(array, &name)?;
    let words = Words { units, names };
    Ok(Data(Arc::new(scene::Data::Numbers { name, shape, values: Arc::new(values), words })))
}

/// A spectrum: float64 [n, 2]. `header` is what its columns are called, as in a file; all names after the second are of the values too.
#[pyfunction]
pub fn spectrum(name: String, header: Vec<String>, array: &Bound<'_, PyAny>) -> PyResult<Data> {
    let pairs = rows::<f64, 2>(array, "array", "[n, 2]")?;
    let [axis, names @ ..] = &header[..] else { return Err(PyValueError::new_err("the header is empty")) };
    Ok(Data(Arc::new(scene::Data::of_spectrum(name, axis, names, &pairs))))
}

/// Numbers by name: float64 [row, column].
#[pyfunction]
pub fn table(name: String, columns: Vec<String>, array: &Bound<'_, PyAny>) -> PyResult<Data> {
    let buffer = buffer::<f64>(array, &name)?;
    match buffer.shape() {
        [_, n] if *n == columns.len() && *n > 0 => {}
        shape => return Err(PyValueError::new_err(format!("must be [row, {}], not {shape:?}", columns.len()))),
    }
    let values = buffer.to_vec(array.py())?;
    Ok(Data(Arc::new(scene::Data::Table(Table { name, columns, values }))))
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
    Ok(Data(Arc::new(vertices.py().detach(|| mesh.into()))))
}

/// Shape and numbers of a float32 array, whatever its strides.
pub fn floats(array: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<usize>, Vec<f32>)> {
    let buffer = buffer::<f32>(array, what)?;
    Ok((buffer.shape().to_vec(), buffer.to_vec(array.py())?))
}

fn buffer<T: Element>(array: &Bound<'_, PyAny>, what: &str) -> PyResult<PyBuffer<T>> {
    PyBuffer::<T>::get(array).map_err(|error| {
        PyValueError::new_err(format!("{what}: not an array of {}: {error}", std::any::type_name::<T>()))
    })
}

fn rows<T: Element + Default, const N: usize>(
    array: &Bound<'_, PyAny>,
    what: &str,
    wanted: &str,
) -> PyResult<Vec<[T; N]>> {
    let buffer = buffer::<T>(array, what)?;
    match *buffer.shape() {
        [count, n] if n == N => {
            let mut rows = vec![[T::default(); N]; count];
            buffer.copy_to_slice(array.py(), rows.as_flattened_mut())?;
            Ok(rows)
        }
        _ => Err(PyValueError::new_err(format!("`{what}` must be {wanted}, but has the shape {:?}", buffer.shape()))),
    }
}

fn corners<const N: usize>(array: &Bound<'_, PyAny>, what: &str) -> PyResult<Corners<N>> {
    let buffer = buffer::<f64>(array, what)?;
    match *buffer.shape() {
        [count, n] if n == N => {
            let mut rows = vec![[0.0; N]; count];
            buffer.copy_to_slice(array.py(), rows.as_flattened_mut())?;
            Ok(Corners::OfVertices(rows))
        }
        [count, 3, n] if n == N => {
            let mut faces = vec![[[0.0; N]; 3]; count];
            buffer.copy_to_slice(array.py(), faces.as_flattened_mut().as_flattened_mut())?;
            Ok(Corners::OfFaces(faces))
        }
        _ => Err(PyValueError::new_err(format!(
            "`{what}` must be [vertex, {N}] or [face, 3, {N}], but has the shape {:?}",
            buffer.shape()
        ))),
    }
}
