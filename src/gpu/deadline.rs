//! Until when a thread must have come back from its device's driver: published before it may block there, so that
//! another thread can tell that it is stuck.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// No deadline: the thread is not in the driver.
const NONE: u64 = u64::MAX;

/// The deadline of one device.
pub struct Deadline {
    origin: Instant,
    /// Milliseconds after `origin`.
    at: AtomicU64,
}

/// The time in which a deadline stands; ends with the one before it.
pub struct Watched {
    deadline: Arc<Deadline>,
    before: u64,
}

impl Default for Deadline {
    fn default() -> Self {
        Deadline { origin: Instant::now(), at: AtomicU64::new(NONE) }
    }
}

impl Deadline {
    /// From now on until the result is dropped, what this thread does in the driver should take no longer than `limit`; the
    /// deadline is twice that.
    pub fn watch(self: &Arc<Self>, limit: Duration) -> Watched {
        let at = self.origin.elapsed().saturating_add(limit.saturating_mul(2));
        let at = at.as_millis().min(u128::from(NONE - 1)) as u64;
        Watched { deadline: Arc::clone(self), before: self.at.swap(at, Ordering::SeqCst) }
    }

    /// Whether the thread should have been back by now.
    pub fn has_passed(&self) -> bool {
        self.at.load(Ordering::SeqCst) < self.origin.elapsed().as_millis() as u64
    }

    /// Lets the deadline pass, until the result is dropped.
    #[cfg(test)]
    pub fn let_pass(self: &Arc<Self>) -> Watched {
        std::thread::sleep(Duration::from_millis(2));
        Watched { deadline: Arc::clone(self), before: self.at.swap(0, Ordering::SeqCst) }
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.deadline.at.store(self.before, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_stand_while_watched() {
        let deadline = Arc::new(Deadline::default());
        assert!(!deadline.has_passed());
        {
            let _long = deadline.watch(Duration::MAX);
            assert!(!deadline.has_passed());
            {
                let _passed = deadline.let_pass();
                assert!(deadline.has_passed());
            }
            assert!(!deadline.has_passed());
        }
        assert_eq!(deadline.at.load(Ordering::SeqCst), NONE);
    }
}
