//! How the samples of a pixel come in epochs: 1, 1, 2, 4, … then full ones for ever. The first picture comes at once, and
//! a long render spends little on transfers.

/// Samples of epoch `index` when a full one has `full`: 1, 1, 2, 4, … full/2, then `full` for ever.
pub fn epoch_samples(index: u32, full: u32) -> u32 {
    match index {
        0 => 1,
        i if i > full.ilog2() => full,
        i => 1 << (i - 1),
    }
}

/// Samples per pixel before epoch `index`.
pub fn samples_before(index: u32, full: u32) -> u32 {
    if index <= full.ilog2() { (1 << index) >> 1 } else { (index - full.ilog2()) * full }
}

/// Samples per pixel at the end of the first epoch that has `wanted`; `None` where u32 does not count that far.
pub fn whole_epochs(wanted: u32, full: u32) -> Option<u32> {
    if wanted < full { wanted.checked_next_power_of_two() } else { wanted.checked_next_multiple_of(full) }
}

/// The number of epochs that make `samples` samples per pixel, which end with one.
pub fn epochs_in(samples: u32, full: u32) -> u32 {
    match samples {
        0 => 0,
        n if n < full => n.ilog2() + 1,
        n => full.ilog2() + n / full,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn epochs_double_up_to_a_full_one() {
        let sizes = |full, n: u32| (0..n).map(|i| epoch_samples(i, full)).collect::<Vec<_>>();
        assert_eq!(sizes(64, 9), [1, 1, 2, 4, 8, 16, 32, 64, 64]);
        assert_eq!(sizes(1, 3), [1, 1, 1]);
        assert_eq!(sizes(2, 4), [1, 1, 2, 2]);
    }

    #[test]
    fn whole_epochs_end_where_epochs_do() {
        for full in [1, 2, 64, 1024] {
            let mut end = 0;
            for epoch in 0..20 {
                let begin = end;
                assert_eq!(epochs_in(begin, full), epoch, "{begin} samples in epochs of {full}");
                assert_eq!(samples_before(epoch, full), begin, "epoch {epoch} of {full}");
                end += epoch_samples(epoch, full);
                for wanted in begin + 1..=end {
                    assert_eq!(whole_epochs(wanted, full), Some(end), "{wanted} in epochs of {full}");
                }
            }
        }
    }
}
