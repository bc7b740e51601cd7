//! The clock of the benchmarks: others' work on the machine does not count.

use nix::time::{ClockId, clock_gettime};

/// CPU time of all threads of this process, seconds.
pub fn cpu_seconds() -> f64 {
    let t = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).expect("a clock");
    t.tv_sec() as f64 + t.tv_nsec() as f64 * 1e-9
}
