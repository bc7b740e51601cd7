//! `spectile._spectile`: the library of Spectile, as the Python package `spectile` uses it. What users see is in `python/spectile/`.

mod arrays;
mod errors;
mod task;
mod tree;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyAny, PyBytes, PyDict, PyList};
use spectile::cli::catch;
use spectile::scene;
use spectile::spectral::tone::Picture;
use spectile::spectral::{D65, columns};

/// A scene as it is handed over: a tree, and the text that it was before it was edited.
#[pyclass(frozen)]
struct Draft(Arc<scene::Draft>);

#[pymethods]
impl Draft {
    /// `file` locates relative paths and messages, `text` is what `mapping` was read from, or empty.
    #[new]
    fn new(file: PathBuf, text: String, mapping: &Bound<'_, PyAny>) -> PyResult<Self> {
        let root = tree::table(mapping, &file)?;
        Ok(Draft(Arc::new(scene::Draft::new(file, text, root))))
    }

    /// Checks everything that the scene says and names: its digest, warnings, size and wavelengths.
    fn check<'py>(&self, py: Python<'py>, overrides: Vec<(String, String)>) -> PyResult<Bound<'py, PyDict>> {
        let scene = py.detach(|| catch(|| self.0.resolve(&overrides))).map_err(|error| errors::raise(py, &error))?;
        let facts = PyDict::new(py);
        facts.set_item("digest", &scene.digest)?;
        facts.set_item("warnings", &scene.warnings)?;
        facts.set_item("size", scene.film.cube_size())?;
        facts.set_item("bounds_nm", &scene.channels.bounds)?;
        Ok(facts)
    }
}

/// The text of a scene file and its tree as nested dicts and lists.
#[pyfunction]
fn read_scene(py: Python<'_>, file: PathBuf) -> PyResult<(String, Bound<'_, PyDict>)> {
    let (text, root) = catch(|| scene::read(&file)).map_err(|error| errors::raise(py, &error))?;
    Ok((text, tree::dict(py, &root)?))
}

/// 8-bit sRGB of linear sRGB [y, x, rgb], float32, as pictures of `spectile export` are made: the exposure in EV, the one asked for
/// or that which brings the 99th percentile of lit pixels to white, and bytes [y, x, rgb].
#[pyfunction]
#[pyo3(signature = (linear, exposure=None))]
fn tone<'py>(
    py: Python<'py>,
    linear: &Bound<'py, PyAny>,
    exposure: Option<f64>,
) -> PyResult<(f64, Bound<'py, PyBytes>)> {
    let (shape, rgb) = arrays::floats(linear, "the picture")?;
    let [height, width, 3] = shape[..] else {
        return Err(pyo3::exceptions::PyValueError::new_err(format!("a picture is [y, x, 3], not {shape:?}")));
    };
    let side =
        |n: usize| u32::try_from(n).map_err(|_| pyo3::exceptions::PyValueError::new_err("the picture is too large"));
    let picture = Picture { size: [side(width)?, side(height)?], rgb };
    let toned = py.detach(|| {
        catch(|| {
            let ev = exposure.unwrap_or_else(|| picture.auto_exposure());
            Ok((ev, picture.to_srgb8(ev)))
        })
    });
    let (ev, bytes) = toned.map_err(|error| errors::raise(py, &error))?;
    Ok((ev, PyBytes::new(py, &bytes)))
}

/// Runs the program `spectile` with these arguments, the first of which is its own path; its exit code.
#[pyfunction]
fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| spectile::cli::program_of_script(&arguments))
}

#[pymodule]
mod _spectile {
    use super::*;

    #[pymodule_export]
    use super::{Draft, program, read_scene, tone};
    #[pymodule_export]
    use crate::arrays::{Data, mesh, numbers, spectrum, table};
    #[pymodule_export]
    use crate::task::Task;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("D65", daylight(module.py())?)
    }
}

/// [nm, relative power] of the CIE's illuminant D65, 1 at 560 nm.
fn daylight(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let table: Vec<[f64; 2]> = columns::<2>(D65).collect();
    // The table is of 100 there.
    PyList::new(py, table.into_iter().map(|[nm, power]| [nm, power / 100.0]))
}
