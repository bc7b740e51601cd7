//! Spectile's errors as exceptions; their classes are in `spectile/_errors.py`.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use spectile::Error;
use spectile::error::Problem;

/// The exception that says what `error` says.
pub fn raise(py: Python<'_>, error: &Error) -> PyErr {
    let made = || -> PyResult<PyErr> {
        let details = PyDict::new(py);
        let kind = match error {
            Error::Input(problems) => {
                let each = problems.iter().map(|problem| describe(py, problem)).collect::<PyResult<Vec<_>>>()?;
                details.set_item("problems", each)?;
                "input"
            }
            Error::Usage(_) => "usage",
            Error::DeviceMemory(_) => "memory",
            Error::NoDevice(_) => "no_device",
            Error::DevicesLost(_) => "devices_lost",
            Error::Storage { path, what } => {
                details.set_item("path", path)?;
                details.set_item("what", what)?;
                "storage"
            }
            Error::Check(_) => "check",
            Error::Interrupted { .. } => "interrupted",
            Error::BrokenPipe | Error::Internal(_) => "internal",
        };
        let exception = py.import("spectile._errors")?.call_method1("make", (kind, error.to_string(), details))?;
        Ok(PyErr::from_value(exception))
    };
    made().unwrap_or_else(|error| error)
}

/// A mistake in `key` of a scene that is in memory.
pub fn mistake(py: Python<'_>, file: &std::path::Path, key: &str, message: String, help: &str) -> PyErr {
    let problem = Problem {
        file: file.to_owned(),
        key: (!key.is_empty()).then(|| key.to_owned()),
        message,
        help: Some(help.to_owned()),
        ..Problem::default()
    };
    raise(py, &Error::Input(vec![problem]))
}

fn describe<'py>(py: Python<'py>, problem: &Problem) -> PyResult<Bound<'py, PyDict>> {
    let Problem { file, line, column, key, message, help, .. } = problem;
    let fields = PyDict::new(py);
    fields.set_item("file", file)?;
    fields.set_item("line", line)?;
    fields.set_item("column", column)?;
    fields.set_item("key", key)?;
    fields.set_item("message", message)?;
    fields.set_item("help", help)?;
    Ok(fields)
}
