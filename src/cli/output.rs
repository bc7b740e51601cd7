//! What a command says: text for people, or with `--json` one object a line for programs; or, within another program, to that.

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, Value, json};

use super::call::Host;
use crate::files::shown;
use crate::preview::Feed;
use crate::render::interrupt::Interrupt;
use crate::{Error, Result};

/// Where a command says what it has to say, and hears that it should end.
pub struct Output {
    json: bool,
    started: Instant,
    host: Option<Host>,
}

impl Output {
    /// The standard output. `time_s` of events counts from here.
    pub fn new(json: bool) -> Self {
        Output { json, started: Instant::now(), host: None }
    }

    /// A program that runs the command within itself: it gets every event, and nothing is printed.
    pub(super) fn of_host(host: Host) -> Self {
        Output { json: true, started: Instant::now(), host: Some(host) }
    }

    /// What asks for the end of the command: signals, or the program around it.
    pub(super) fn interrupt(&self) -> Result<Arc<Interrupt>> {
        match &self.host {
            Some(host) => Ok(Arc::clone(&host.interrupt)),
            None => super::interrupt::watch(),
        }
    }

    /// Where the program around a render looks how far it is.
    pub(super) fn feed(&self) -> Option<Arc<Feed>> {
        self.host.as_ref().map(|host| Arc::clone(&host.feed))
    }

    /// Says a line aside: on stderr, or to the program around the command as an event `message`.
    pub(super) fn say(&self, line: &str) {
        match &self.host {
            // It is told, not asked.
            Some(host) => {
                let _ = (host.event)(&json!({ "event": "message", "message": line }));
            }
            None => say(line),
        }
    }

    pub fn json(&self) -> bool {
        self.json
    }

    /// Prints text as it stands, unless the output is JSON.
    pub fn text(&self, text: &str) -> Result<()> {
        if self.json { Ok(()) } else { write(text) }
    }

    /// Prints the object {"event": `event`, "time_s": …, `fields`…} on a line, if the output is JSON. Numbers that are
    /// not finite become null.
    pub fn event(&self, event: &str, fields: Value) -> Result<()> {
        if !self.json {
            return Ok(());
        }
        let mut object = Map::new();
        object.insert("event".into(), json!(event));
        object.insert("time_s".into(), json!(self.started.elapsed().as_secs_f64()));
        if let Value::Object(fields) = fields {
            object.extend(fields);
        }
        let object = Value::Object(object);
        match &self.host {
            Some(host) => (host.event)(&object),
            None => write(&format!("{object}\n")),
        }
    }

    /// Says a warning on stderr, and in JSON as an event on stdout too.
    pub fn warn(&self, text: &str) -> Result<()> {
        if self.host.is_none() {
            say(&format!("warning: {text}"));
        }
        self.event("warning", json!({ "message": text }))
    }

    /// Says why a command ended: on stderr, and in JSON as an event on stdout too.
    pub fn error(&self, error: &Error) {
        match error {
            Error::BrokenPipe => return,
            // The command has said what is kept.
            Error::Interrupted { .. } => {}
            Error::Input(problems) => problems.iter().for_each(|problem| say(&format!("error: {problem}"))),
            error => say(&format!("error: {error}")),
        }
        self.error_event(error);
    }

    /// The event of an error alone.
    pub fn error_event(&self, error: &Error) {
        let mut fields = json!({ "exit_code": error.exit_code(), "message": error.to_string() });
        if let Error::Input(problems) = error {
            let each = problems.iter().map(|problem| {
                json!({
                    "file": shown(&problem.file),
                    "line": problem.line,
                    "column": problem.column,
                    "key": problem.key,
                    "message": problem.message,
                    "help": problem.help,
                })
            });
            fields["problems"] = each.collect();
        }
        // The error itself is what matters now; that stdout has gone too is not worth another.
        let _ = self.event("error", fields);
    }
}

/// Prints a line on stderr; unlike `eprintln!` it does not panic when nobody reads it.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

fn write(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Error::BrokenPipe,
        _ => Error::storage(Path::new("standard output"), error),
    })
}
