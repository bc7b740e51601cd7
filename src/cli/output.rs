//! What a command says: text for people, or with `--json` one object a line for programs.

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::time::Instant;

use serde_json::{Map, Value, json};

use crate::files::shown;
use crate::{Error, Result};

/// The standard output of one command.
#[derive(Debug)]
pub struct Output {
    json: bool,
    started: Instant,
}

impl Output {
    /// `time_s` of events counts from here.
    pub fn new(json: bool) -> Self {
        Output { json, started: Instant::now() }
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
        write(&format!("{}\n", Value::Object(object)))
    }

    /// Says a warning on stderr, and in JSON as an event on stdout too.
    pub fn warn(&self, text: &str) -> Result<()> {
        say(&format!("warning: {text}"));
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
