//! How much of a proof a run makes: `./check` the small twin, `./check --full` all of it.

/// Whether everything is asked for: `scripts/tests.py --full` sets SPECTILE_FULL.
pub fn is_full() -> bool {
    std::env::var_os("SPECTILE_FULL").is_some()
}

/// The first `n` cases, and all of them in `--full`: for cases that each have kernels of their own to compile, which takes far longer
/// than running them. Those come first that nothing else covers.
pub fn first<T>(n: usize, cases: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
    cases.into_iter().take(if is_full() { usize::MAX } else { n })
}

/// A number of its own for `--full`.
pub fn either<T>(small: T, full: T) -> T {
    if is_full() { full } else { small }
}
