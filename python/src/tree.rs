//! Between nested mappings and the tree of a scene.

use std::path::Path;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple};
use serde_json::Value as Json;
use spectile::scene::dotted_key;
use spectile::scene::tree::{Entry, Node, Origin, Value};

use crate::arrays::Data;
use crate::errors::mistake;

/// Deeper than any scene; a mapping that contains itself has no end.
const DEEPEST: usize = 64;

/// The top level of a scene. `file` stands in messages.
pub fn table(mapping: &Bound<'_, PyAny>, file: &Path) -> PyResult<Vec<Entry>> {
    Reader { file }.entries(mapping, "", 0)
}

struct Reader<'a> {
    file: &'a Path,
}

impl Reader<'_> {
    fn entries(&self, mapping: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Vec<Entry>> {
        let mapping = mapping.cast::<PyMapping>()?;
        let mut entries = Vec::new();
        for pair in mapping.items()?.iter() {
            let (key, value) = pair.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()?;
            let Ok(name) = key.cast::<PyString>() else {
                let message = format!("has a key that is {}", kind(&key));
                return Err(mistake(mapping.py(), self.file, path, message, "keys of a scene are strings"));
            };
            let name = name.to_str()?.to_owned();
            let below = dotted_key(path, &name);
            let node = self.node(&value, &below, depth + 1)?;
            entries.push(Entry { key: name, key_origin: Origin::Whole, node });
        }
        Ok(entries)
    }

    fn node(&self, value: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Node> {
        if depth > DEEPEST {
            let help = "a mapping or list cannot contain itself";
            return Err(mistake(value.py(), self.file, path, "is nested too deeply".to_owned(), help));
        }
        let value = self.value(value, path, depth)?;
        Ok(Node { value, origin: Origin::Whole })
    }

    fn value(&self, value: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Value> {
        // A bool is an int to Python.
        if let Ok(value) = value.cast::<PyBool>() {
            return Ok(Value::Boolean(value.is_true()));
        }
        if let Ok(value) = value.cast::<PyInt>() {
            return match value.extract::<i64>() {
                Ok(whole) => Ok(Value::Integer(whole)),
                // As in a file: nothing in a scene is that large a count.
                Err(_) => Ok(Value::Float(value.extract::<f64>().unwrap_or(f64::INFINITY))),
            };
        }
        if let Ok(value) = value.cast::<PyFloat>() {
            return Ok(Value::Float(value.value()));
        }
        if let Ok(value) = value.cast::<PyString>() {
            return Ok(Value::String(value.to_str()?.to_owned()));
        }
        if let Ok(data) = value.cast::<Data>() {
            return Ok(Value::Data(data.get().0.clone()));
        }
        if value.cast::<PyMapping>().is_ok() {
            return Ok(Value::Table(self.entries(value, path, depth)?));
        }
        if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
            let item =
                |(i, item): (usize, PyResult<Bound<'_, PyAny>>)| self.node(&item?, &format!("{path}.{i}"), depth + 1);
            return Ok(Value::Array(value.try_iter()?.enumerate().map(item).collect::<PyResult<_>>()?));
        }
        if let Some(date) = value.call_method0("isoformat").ok().and_then(|text| text.extract::<String>().ok())
            && let Some(date) = Value::datetime(&date)
        {
            return Ok(date);
        }
        let help = "a scene is made of mappings, lists, strings, numbers, booleans, dates and arrays";
        Err(mistake(value.py(), self.file, path, format!("must not be {}", kind(value)), help))
    }
}

fn kind(value: &Bound<'_, PyAny>) -> String {
    let Ok(name) = value.get_type().name() else { return "an object".to_owned() };
    let name = name.to_string();
    let article = if name.starts_with(['a', 'e', 'i', 'o', 'u', 'A', 'E', 'I', 'O', 'U']) { "an" } else { "a" };
    format!("{article} {name}")
}

/// The tree of a scene file as nested dicts and lists.
pub fn dict<'py>(py: Python<'py>, entries: &[Entry]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for entry in entries {
        dict.set_item(&entry.key, object(py, &entry.node.value)?)?;
    }
    Ok(dict)
}

fn object<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::String(text) => PyString::new(py, text).into_any(),
        Value::Integer(whole) => whole.into_pyobject(py)?.into_any(),
        Value::Float(number) => PyFloat::new(py, *number).into_any(),
        Value::Boolean(value) => PyBool::new(py, *value).to_owned().into_any(),
        Value::Datetime(date) => {
            let class = match (date.date, date.time) {
                (Some(_), Some(_)) => "datetime",
                (Some(_), None) => "date",
                _ => "time",
            };
            let text = date.to_string();
            // What Python has no date for, such as a leap second, stays as it is written.
            match py.import("datetime")?.getattr(class)?.call_method1("fromisoformat", (&text,)) {
                Ok(date) => date,
                Err(_) => PyString::new(py, &text).into_any(),
            }
        }
        Value::Array(nodes) => {
            let items = nodes.iter().map(|node| object(py, &node.value)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, items)?.into_any()
        }
        Value::Table(entries) => dict(py, entries)?.into_any(),
        Value::Data(_) => return Err(PyTypeError::new_err("no file holds numbers in memory")),
    })
}

/// An event of docs/json.md.
pub fn event<'py>(py: Python<'py>, value: &Json) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Json::Null => py.None().into_bound(py),
        Json::Bool(value) => PyBool::new(py, *value).to_owned().into_any(),
        Json::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(whole), _) => whole.into_pyobject(py)?.into_any(),
            (None, Some(whole)) => whole.into_pyobject(py)?.into_any(),
            (None, None) => PyFloat::new(py, number.as_f64().unwrap_or(f64::NAN)).into_any(),
        },
        Json::String(text) => PyString::new(py, text).into_any(),
        Json::Array(items) => {
            let items = items.iter().map(|item| event(py, item)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, items)?.into_any()
        }
        Json::Object(fields) => {
            let dict = PyDict::new(py);
            for (key, value) in fields {
                dict.set_item(key, event(py, value)?)?;
            }
            dict.into_any()
        }
    })
}
