//! Ctrl-C and SIGTERM: the first asks for an orderly end, the second quits at once. SIGUSR1 asks how far it is.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::render::interrupt::Interrupt;
use crate::{Error, Result};

/// What signals ask for; from the first that asks for the end on, a second one ends the process at once.
pub fn watch() -> Result<Arc<Interrupt>> {
    let interrupt = Arc::new(Interrupt::default());
    let again = Arc::new(AtomicBool::new(false));
    let failed = |e: std::io::Error| Error::Internal(format!("signals cannot be watched: {e}"));
    for signal in [SIGINT, SIGTERM] {
        // The order matters: the shutdown acts on what an earlier signal has set.
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&again)).map_err(failed)?;
        flag::register(signal, Arc::clone(&again)).map_err(failed)?;
    }
    listen(&interrupt).map_err(failed)?;
    Ok(interrupt)
}

/// Passes signals on, from a thread that sleeps until there is one: a handler itself may not touch a channel.
#[cfg(unix)]
fn listen(interrupt: &Arc<Interrupt>) -> std::io::Result<()> {
    use signal_hook::consts::SIGUSR1;
    use signal_hook::iterator::Signals;

    let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1])?;
    let interrupt = Arc::clone(interrupt);
    let pass_on = move || {
        signals.forever().for_each(|signal| match signal {
            SIGUSR1 => interrupt.report(),
            end => interrupt.stop(end),
        });
    };
    std::thread::Builder::new().name("signals".into()).spawn(pass_on).map(drop)
}

/// Elsewhere nothing wakes a thread when a signal comes: it has to look.
#[cfg(not(unix))]
fn listen(interrupt: &Arc<Interrupt>) -> std::io::Result<()> {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    let end = Arc::new(AtomicUsize::new(0));
    for signal in [SIGINT, SIGTERM] {
        flag::register_usize(signal, Arc::clone(&end), signal as usize)?;
    }
    let interrupt = Arc::clone(interrupt);
    let look = move || {
        while end.load(Ordering::SeqCst) == 0 {
            std::thread::sleep(Duration::from_millis(200));
        }
        interrupt.stop(end.load(Ordering::SeqCst) as i32);
    };
    std::thread::Builder::new().name("signals".into()).spawn(look).map(drop)
}
