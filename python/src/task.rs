//! A command of Spectile at work beside Python: on a thread of its own, without the GIL, which only the thread that waits for it takes,
//! to pass events on and to see whether Ctrl-C was pressed.

use std::ffi::OsString;
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, unbounded};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyBytes};
use serde_json::Value;
use spectile::cli::{Host, call};
use spectile::cube::reduction;
use spectile::preview::Feed;
use spectile::render::interrupt::Interrupt;
use spectile::{Error, Result, threads};

use crate::Draft;
use crate::errors::raise;
use crate::tree;

/// How often Python's signals are looked for.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Events that may wait for a listener; beyond, `progress` is left out, of which the next says more.
const MOST_WAITING: usize = 64;
/// As Ctrl-C.
const SIGINT: i32 = 2;

/// One command, run once. It may be stopped, and its preview read, from any thread.
#[pyclass(frozen)]
pub struct Task {
    interrupt: Arc<Interrupt>,
    feed: Arc<Feed>,
}

#[pymethods]
impl Task {
    #[new]
    fn new() -> Self {
        Task { interrupt: Arc::default(), feed: Feed::of_render() }
    }

    /// Runs `spectile ARGUMENTS`, with `draft` in the place of the scene that they name, and passes every event to `listener` as a
    /// dict. What the listener raises, or Ctrl-C, ends the command in order and is raised then; a second time, at once.
    #[pyo3(signature = (arguments, draft=None, listener=None))]
    fn run(
        &self,
        py: Python<'_>,
        arguments: Vec<OsString>,
        draft: Option<PyRef<'_, Draft>>,
        listener: Option<Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (send, events) = unbounded::<Value>();
        let event = Box::new(move |event: &Value| {
            if send.len() < MOST_WAITING || event["event"] != "progress" {
                // Nobody listens any more after a second Ctrl-C.
                let _ = send.send(event.clone());
            }
            Ok(())
        });
        let host = Host { event, interrupt: Arc::clone(&self.interrupt), feed: Arc::clone(&self.feed) };
        let draft = draft.map(|draft| Arc::clone(&draft.0));
        let work = move || call(&arguments, draft, host);
        let worker = threads::run("spectile", work)
            .map_err(|error| PyRuntimeError::new_err(format!("no thread can be started: {error}")))?;
        let raised = self.listen(py, &events, listener.as_ref());
        let raised = match raised {
            Heard::End(raised) => raised,
            Heard::Again(error) => return Err(error),
        };
        let result = py.detach(|| worker.join());
        // `call` lets no panic out.
        let result = result.unwrap_or_else(|_| Err(Error::Internal("a thread panicked".into())));
        finish(py, result, raised)
    }

    /// Asks for an orderly end, as Ctrl-C does.
    fn stop(&self) {
        self.interrupt.stop(SIGINT);
    }

    /// The picture that a render has so far, reduced until it has no more than `most_pixels`: width, height, and linear sRGB
    /// [y, x, rgb] as float32, NaN where nothing is rendered. `None` where there is no cube yet.
    fn preview<'py>(&self, py: Python<'py>, most_pixels: u64) -> PyResult<Option<(u32, u32, Bound<'py, PyBytes>)>> {
        let picture = py.detach(|| {
            let mut picture = None;
            if let Some(source) = self.feed.snapshot().source {
                source.with_state(&mut |state| {
                    let factor = reduction(state.cube().header().size, most_pixels.max(1));
                    picture = Some(state.colour(state.cube().grid().whole(), factor));
                });
            }
            picture
        });
        let Some(picture) = picture.transpose().map_err(|error| raise(py, &error))? else { return Ok(None) };
        let bytes = PyBytes::new_with(py, picture.values.len() * 4, |bytes| {
            for (bytes, value) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(&picture.values) {
                *bytes = value.to_le_bytes();
            }
            Ok(())
        })?;
        Ok(Some((picture.size[0], picture.size[1], bytes)))
    }
}

/// How listening ended.
enum Heard {
    /// With the command; what was raised meanwhile.
    End(Option<PyErr>),
    /// By a second Ctrl-C, while the command goes on to its end.
    Again(PyErr),
}

impl Task {
    fn listen(&self, py: Python<'_>, events: &Receiver<Value>, listener: Option<&Bound<'_, PyAny>>) -> Heard {
        let mut raised: Option<PyErr> = None;
        let mut said: Option<String> = None;
        loop {
            let event = py.detach(|| events.recv_timeout(LOOK_EVERY));
            let mut result = py.check_signals();
            match event {
                Ok(event) => {
                    if event["event"] == "message" {
                        said = event["message"].as_str().map(str::to_owned);
                    } else if let (Some(listener), None, Ok(())) = (listener, &raised, &result) {
                        result = tree::event(py, &event).and_then(|event| listener.call1((event,))).map(drop);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    let raised = raised.or(result.err());
                    if let (Some(error), Some(said)) = (&raised, said) {
                        // It is only a note.
                        let _ = error.value(py).call_method1("add_note", (said,));
                    }
                    return Heard::End(raised);
                }
            }
            if let Err(error) = result {
                if raised.is_some() {
                    return Heard::Again(error);
                }
                self.interrupt.stop(SIGINT);
                raised = Some(error);
            }
        }
    }
}

/// What a command ended with, after what was raised while it ran.
fn finish(py: Python<'_>, result: Result<()>, raised: Option<PyErr>) -> PyResult<()> {
    match (raised, result) {
        (None, Ok(())) => Ok(()),
        (None, Err(error)) => Err(raise(py, &error)),
        (Some(raised), Ok(()) | Err(Error::Interrupted { .. })) => Err(raised),
        (Some(raised), Err(error)) => {
            let _ = raised.value(py).call_method1("add_note", (error.to_string(),));
            Err(raised)
        }
    }
}
