//! Ctrl-C and SIGTERM: the first asks for an orderly end, the second quits at once.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::render::worker::Interrupt;
use crate::{Error, Result};

/// A number that a signal sets to its own; from then on a second signal ends the process at once.
pub fn watch() -> Result<Arc<Interrupt>> {
    let interrupt = Arc::new(Interrupt::new(0));
    let again = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        let failed = |e: std::io::Error| Error::Internal(format!("signals cannot be watched: {e}"));
        // The order matters: the shutdown acts on what an earlier signal has set.
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&again)).map_err(failed)?;
        flag::register(signal, Arc::clone(&again)).map_err(failed)?;
        flag::register_usize(signal, Arc::clone(&interrupt), signal as usize).map_err(failed)?;
    }
    Ok(interrupt)
}
