//! Where a test lets a writer die or run out of space: between every two steps of the protocol. In the program itself
//! there is nothing here.

/// A place between two steps of a commit or of a recovery.
#[cfg(not(test))]
#[inline(always)]
pub(super) fn step(_: &str) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
pub(super) use injected::step;

#[cfg(test)]
pub(super) mod injected {
    use std::io::{Error, ErrorKind, Result, Write};
    use std::sync::atomic::{AtomicI64, Ordering};

    /// Set in a process that is to die, or to find the disk full, at the step of that number.
    pub const DIE: &str = "SPECTILE_TEST_DIE_AT";
    pub const FULL: &str = "SPECTILE_TEST_FULL_AT";
    /// A file that gets the name of every step, a line each.
    pub const LOG: &str = "SPECTILE_TEST_STEPS";

    static STEPS: AtomicI64 = AtomicI64::new(0);

    pub fn step(name: &str) -> Result<()> {
        let wanted = |variable| std::env::var(variable).ok().and_then(|n| n.parse::<i64>().ok());
        if let Ok(log) = std::env::var(LOG) {
            let mut file = std::fs::OpenOptions::new().create(true).append(true).open(log)?;
            writeln!(file, "{name}")?;
        }
        let number = STEPS.fetch_add(1, Ordering::SeqCst);
        if wanted(DIE) == Some(number) {
            std::process::abort();
        }
        // A full disk stays full.
        if wanted(FULL).is_some_and(|at| at <= number) {
            return Err(Error::new(ErrorKind::StorageFull, "no space left on device"));
        }
        Ok(())
    }
}
