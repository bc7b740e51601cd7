//! What signals ask of work that is under way: to end in order, or to say how far it is.

use std::convert::Infallible;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use crate::{Error, Result};

/// What has been asked. Whoever is busy looks from time to time, with [`Interrupt::check`]; whoever waits for something else
/// too selects over the channels.
pub struct Interrupt {
    /// The number of the signal that asks for an orderly end, or 0.
    signal: AtomicI32,
    /// Nothing is ever sent: that it is closed is what everybody hears, however late.
    open: Mutex<Option<Sender<Infallible>>>,
    end: Receiver<Infallible>,
    /// Holds one message at most: who asks twice before there is an answer gets one.
    ask: Sender<()>,
    inquiries: Receiver<()>,
}

impl Default for Interrupt {
    fn default() -> Self {
        let (open, end) = bounded(0);
        let (ask, inquiries) = bounded(1);
        Interrupt { signal: AtomicI32::new(0), open: Mutex::new(Some(open)), end, ask, inquiries }
    }
}

impl Interrupt {
    /// Asks for an orderly end, as signal number `signal` does. It stays with the first.
    pub fn stop(&self, signal: i32) {
        let _ = self.signal.compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst);
        self.open.lock().unwrap_or_else(PoisonError::into_inner).take();
    }

    /// Asks how far the work is, with everything so far on disk.
    pub fn report(&self) {
        // Full means that it has been asked already.
        let _ = self.ask.try_send(());
    }

    /// Closed from the moment on when the end is asked for.
    pub fn end(&self) -> &Receiver<Infallible> {
        &self.end
    }

    /// Has a message when somebody has asked how far the work is.
    pub fn inquiries(&self) -> &Receiver<()> {
        &self.inquiries
    }

    /// [`Error::Interrupted`] once the end has been asked for.
    pub fn check(&self) -> Result<()> {
        match self.signal.load(Ordering::SeqCst) {
            0 => Ok(()),
            signal => Err(Error::Interrupted { signal }),
        }
    }

    /// Does nothing for so long, or until the end is asked for, which is an error.
    pub fn sleep(&self, duration: Duration) -> Result<()> {
        match self.end.recv_timeout(duration) {
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => self.check(),
            Ok(never) => match never {},
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_wakes_all_who_sleep_and_stays() {
        let interrupt = Interrupt::default();
        let ended = |result| match result {
            Err(Error::Interrupted { signal }) => Some(signal),
            _ => None,
        };
        assert!(interrupt.check().is_ok() && interrupt.sleep(Duration::from_millis(1)).is_ok());
        std::thread::scope(|threads| {
            let sleep = || ended(interrupt.sleep(Duration::MAX));
            let sleeping = [threads.spawn(sleep), threads.spawn(sleep)];
            interrupt.stop(15);
            interrupt.stop(2);
            sleeping.into_iter().for_each(|sleeper| assert_eq!(sleeper.join().expect("no panic"), Some(15)));
        });
        assert_eq!([interrupt.check(), interrupt.sleep(Duration::MAX)].map(ended), [Some(15); 2]);
    }

    #[test]
    fn who_asks_often_is_answered_once() {
        let interrupt = Interrupt::default();
        for _ in 0..2 {
            (0..3).for_each(|_| interrupt.report());
            // Waiting for the end takes nothing away.
            interrupt.sleep(Duration::from_millis(1)).expect("no end");
            assert_eq!(interrupt.inquiries().try_iter().count(), 1);
        }
    }
}
