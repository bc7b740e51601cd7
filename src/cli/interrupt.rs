//! Ctrl-C and SIGTERM: the first asks for an orderly end, the second quits at once. SIGUSR1 asks how far it is.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::render::worker::Interrupt;
use crate::{Error, Result};

/// What signals set; from the first that asks for the end on, a second one ends the process at once.
pub fn watch() -> Result<Arc<Interrupt>> {
    let interrupt = Interrupt::default();
    let again = Arc::new(AtomicBool::new(false));
    let failed = |e: std::io::Error| Error::Internal(format!("signals cannot be watched: {e}"));
    #[cfg(unix)]
    flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&interrupt.report)).map_err(failed)?;
    for signal in [SIGINT, SIGTERM] {
        // The order matters: the shutdown acts on what an earlier signal has set.
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&again)).map_err(failed)?;
        flag::register(signal, Arc::clone(&again)).map_err(failed)?;
        flag::register_usize(signal, Arc::clone(&interrupt.end), signal as usize).map_err(failed)?;
    }
    Ok(Arc::new(interrupt))
}
