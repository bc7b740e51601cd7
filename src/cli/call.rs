//! A command that another program runs within itself, such as Python: its events go to that program, nothing is printed, no signal is
//! watched, and errors are values.

use std::ffi::OsString;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;

use clap::Parser;
use serde_json::Value;

use super::{Cli, Command, Output};
use crate::gpu::kept::keep_devices;
use crate::preview::Feed;
use crate::render::interrupt::Interrupt;
use crate::scene::Draft;
use crate::{Error, Result};

/// Takes an event of docs/json.md; an error ends the command.
pub type Listener = Box<dyn Fn(&Value) -> Result<()> + Send + Sync>;

/// The program around a command.
pub struct Host {
    /// Gets every event, and lines that would go to stderr as events `message`.
    pub event: Listener,
    /// Asks for an orderly end, as Ctrl-C does.
    pub interrupt: Arc<Interrupt>,
    /// Where a render publishes how far it is.
    pub feed: Arc<Feed>,
}

/// Runs `spectile ARGUMENTS`, where the name of a scene stands for `draft`, if there is one.
///
/// # Errors
/// [`Error::Usage`] where the arguments make no sense, [`Error::Internal`] where the command panics, else what it ends with.
pub fn call(arguments: &[OsString], draft: Option<Arc<Draft>>, host: Host) -> Result<()> {
    keep_devices();
    let program = OsString::from("spectile");
    let mut cli = Cli::try_parse_from([program].iter().chain(arguments)).map_err(|usage| {
        let message = usage.render().to_string();
        // Where to find more is another place for who is not at a command line.
        let message = message.split("\n\nFor more information").next().unwrap_or_default();
        Error::Usage(message.trim_start_matches("error: ").trim_end().to_owned())
    })?;
    if let Some(draft) = draft {
        let scene = match &mut cli.command {
            Command::Render(args) => &mut args.scene,
            Command::Plan(args) => &mut args.scene,
            _ => return Err(Error::Usage("only `render` and `plan` take a scene that is in memory".into())),
        };
        scene.given = Some(draft);
    }
    catch(|| cli.run(&Output::of_host(host)))
}

/// Does something for a program that a panic must not reach.
///
/// # Errors
/// [`Error::Internal`] with what a panic said, else what the work ends with.
pub fn catch<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    // What the work has left half done goes with it: whoever called gets nothing but the error.
    std::panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let words = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let words = words.or_else(|| panic.downcast_ref::<String>().cloned());
        Err(Error::Internal(words.unwrap_or_else(|| "a thread panicked".into())))
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    fn host() -> (Host, Arc<Mutex<Vec<Value>>>) {
        let events = Arc::new(Mutex::new(Vec::new()));
        let into = Arc::clone(&events);
        let event: Listener = Box::new(move |event| {
            into.lock().expect("no panic").push(event.clone());
            Ok(())
        });
        (Host { event, interrupt: Arc::default(), feed: Feed::of_render() }, events)
    }

    fn called(arguments: &[&str]) -> (Result<()>, Vec<Value>) {
        let (host, events) = host();
        let result = call(&arguments.iter().map(OsString::from).collect::<Vec<_>>(), None, host);
        let events = events.lock().expect("no panic").clone();
        (result, events)
    }

    #[test]
    fn panics_are_errors() {
        let (mut host, _) = host();
        host.event = Box::new(|event| panic!("no room for {}", event["event"]));
        match call(&["devices".into()], None, host) {
            Err(Error::Internal(what)) => assert!(what.starts_with("no room for"), "{what}"),
            other => panic!("{other:?}"),
        }
        assert!(catch(|| Ok(3)).is_ok_and(|three| three == 3));
    }

    #[test]
    fn errors_are_values_and_events_come_without_being_asked_for() {
        let (usage, events) = called(&["compare", "a.zarr"]);
        assert!(matches!(usage, Err(Error::Usage(what)) if what.contains("required")) && events.is_empty());
        let folder = tempfile::tempdir().expect("a folder");
        let missing = folder.path().join("none.zarr").display().to_string();
        assert!(matches!(called(&["compare", &missing, &missing]).0, Err(Error::Storage { .. })));
        let (list, _) = called(&["stress", "--list"]);
        assert!(list.is_ok());
    }
}
