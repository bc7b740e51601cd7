//! How long to wait for a device: from how long it took before.

use std::time::Duration;

use crate::gpu::buffer::WARM_UP;

/// A device may take so many times what was measured before a wait for it times out.
const FACTOR: f64 = 10.0;

/// The least that any wait may last before it times out. A GPU that hangs is reset by its driver within 2 to 10 seconds, so
/// that whoever is silent for a minute was forgotten by the driver too. And a software device, or a shared one, may rest for
/// many seconds when others keep the machine busy: to lose a device that works costs more than to wait for one that does not.
const LEAST: Duration = Duration::from_secs(60);

/// How fast a larger measurement is forgotten: by this share of the difference with each that follows.
const FORGET: f64 = 1.0 / 16.0;

/// Seconds that a device takes for a path, as far as known.
#[derive(Debug, Clone, Copy, Default)]
pub struct TimeLimit {
    seconds_per_path: Option<f64>,
}

impl TimeLimit {
    /// A device took `elapsed` for waves of `paths` paths. What is slower than expected counts at once, what is faster bit by
    /// bit.
    pub fn note(&mut self, paths: u64, elapsed: Duration) {
        let now = elapsed.as_secs_f64() / paths.max(1) as f64;
        let known = self.seconds_per_path.unwrap_or(now);
        self.seconds_per_path = Some(now.max(known + FORGET * (now - known)));
    }

    /// How long to wait for `paths` paths that are under way. The first ever also wait for drivers to compile.
    pub fn limit(&self, paths: u64) -> Duration {
        let Some(seconds_per_path) = self.seconds_per_path else { return WARM_UP };
        let predicted = FACTOR * seconds_per_path * paths as f64;
        Duration::try_from_secs_f64(predicted).unwrap_or(Duration::MAX).max(LEAST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_follows_what_was_measured() {
        let mut time_limit = TimeLimit::default();
        assert_eq!(time_limit.limit(1), WARM_UP);
        time_limit.note(1000, Duration::from_secs(1));
        // Ten times the prediction, and never less than a minute.
        assert_eq!(time_limit.limit(1000), LEAST);
        assert_eq!(time_limit.limit(60_000), Duration::from_secs(600));
        // A slow one counts at once, and is forgotten slowly.
        time_limit.note(1000, Duration::from_secs(20));
        assert_eq!(time_limit.limit(1000), Duration::from_secs(200));
        for _ in 0..10 {
            time_limit.note(1000, Duration::from_secs(1));
        }
        let after_ten = time_limit.limit(1000);
        assert!((Duration::from_secs(100)..Duration::from_secs(120)).contains(&after_ten), "{after_ten:?}");
        for _ in 0..200 {
            time_limit.note(1000, Duration::from_secs(1));
        }
        assert_eq!(time_limit.limit(1000), LEAST);
        time_limit.note(0, Duration::MAX);
        assert_eq!(time_limit.limit(u64::MAX), Duration::MAX);
    }
}
