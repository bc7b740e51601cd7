//! Noise of measurements: numbers a little beyond what is possible, in tables and pictures alike.

/// What numbers of a kind may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Range {
    /// [0, 1]: a share. Noise reaches 0.01 beyond.
    Share,
    /// 0 and more. Noise reaches down to 1 % of the largest number below 0.
    NotNegative,
    /// 0 and more, of k beside an n of 1 or more. Noise reaches down to 1 % of the largest number, of n at least.
    Extinction,
}

const TOLERATED: f64 = 0.01;

impl Range {
    /// The largest that is possible.
    fn end(self) -> f64 {
        match self {
            Range::Share => 1.0,
            Range::NotNegative | Range::Extinction => f64::INFINITY,
        }
    }
}

/// What was clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipped {
    pub count: usize,
    /// The number that was furthest outside.
    pub worst: f64,
    /// Whether anything was above the range, and whether anything was below.
    above: bool,
    below: bool,
}

impl Clipped {
    /// In words that go on after "holds".
    pub fn words(&self, range: Range) -> String {
        // A number of f32 has no more digits than these.
        let worst = format!("{:.6e}", self.worst).parse().unwrap_or(self.worst);
        let count = self.count;
        let values = if count == 1 { "value" } else { "values" };
        match range {
            Range::Share => {
                let to = match (self.below, self.above) {
                    (true, true) => "0 and 1",
                    (true, false) => "0",
                    _ => "1",
                };
                format!(
                    "{count} {values} outside of [0, 1] by at most {TOLERATED}, the furthest {worst}: taken as noise, and as {to}"
                )
            }
            Range::NotNegative => {
                format!(
                    "{count} negative {values}, the lowest {worst}, within 1 % of the peak: taken as noise, and as 0"
                )
            }
            Range::Extinction => {
                format!(
                    "{count} negative {values} of k, the lowest {worst}, within 1 % of k or n: taken as noise, and as 0"
                )
            }
        }
    }
}

/// Clips what noise may be. `Err` is the index of the first number that is too far outside, or is not finite; then nothing has
/// changed.
pub fn clip<T: Copy + Into<f64>>(
    values: &mut [T],
    range: Range,
    of: impl Fn(f64) -> T,
) -> Result<Option<Clipped>, usize> {
    let found = find(values, range)?;
    if found.is_some() {
        let end = range.end();
        for value in values {
            let number: f64 = (*value).into();
            if number < 0.0 {
                *value = of(0.0);
            } else if number > end {
                *value = of(1.0);
            }
        }
    }
    Ok(found)
}

/// What [`clip`] would clip, and its error.
pub fn find<T: Copy + Into<f64>>(values: &[T], range: Range) -> Result<Option<Clipped>, usize> {
    let peak = |at_least: f64| values.iter().map(|v| (*v).into()).fold(at_least, f64::max);
    // What is 0.01 beyond as it is written is so in f32 too.
    let in_f32 = |v: f64| f64::from(v as f32);
    let end = range.end();
    let (least, most) = match range {
        Range::Share => (in_f32(-TOLERATED).min(-TOLERATED), in_f32(1.0 + TOLERATED).max(1.0 + TOLERATED)),
        Range::NotNegative => (-TOLERATED * peak(0.0), f64::INFINITY),
        Range::Extinction => (-TOLERATED * peak(1.0), f64::INFINITY),
    };
    let mut found = Clipped { count: 0, worst: 0.0, above: false, below: false };
    let mut furthest = 0.0;
    for (i, value) in values.iter().enumerate() {
        let value: f64 = (*value).into();
        if !(value.is_finite() && value >= least && value <= most) {
            return Err(i);
        }
        let beyond = (-value).max(value - end);
        if beyond > 0.0 {
            found.count += 1;
            found.above |= value > end;
            found.below |= value < 0.0;
            if beyond > furthest {
                (furthest, found.worst) = (beyond, value);
            }
        }
    }
    Ok((found.count > 0).then_some(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_noise_becomes_possible() {
        let mut shares = [0.5, 1.01, -0.01, 1.0, 0.0];
        let clipped = clip(&mut shares, Range::Share, |v| v).unwrap().unwrap();
        assert_eq!((shares, clipped.count), ([0.5, 1.0, 0.0, 1.0, 0.0], 2));
        assert!(clipped.words(Range::Share).contains("0 and 1"));
        let mut floats = [1.01f32, -0.01];
        assert!(clip(&mut floats, Range::Share, |v| v as f32).unwrap().is_some());
        let mut light = [200.0, -1.9, 3.0];
        let clipped = clip(&mut light, Range::NotNegative, |v| v).unwrap().unwrap();
        assert_eq!((light, clipped.worst), ([200.0, 0.0, 3.0], -1.9));
        // A spectrometer's noise about no absorption at all.
        let mut k = [1e-9, -8.1e-10];
        assert!(clip(&mut k, Range::Extinction, |v| v).unwrap().is_some() && k == [1e-9, 0.0]);
        assert_eq!(clip(&mut [0.0, 1.0], Range::Share, |v| v), Ok(None));
    }

    #[test]
    fn what_is_more_than_noise_is_found() {
        for (mut values, range, at) in [
            ([0.5, 1.0101], Range::Share, 1),
            ([-0.0101, 0.5], Range::Share, 0),
            ([f64::NAN, 0.5], Range::Share, 0),
            ([200.0, -2.1], Range::NotNegative, 1),
            ([0.0, -1e-30], Range::NotNegative, 1),
            ([0.5, -0.0101], Range::Extinction, 1),
            ([4.0, -0.0401], Range::Extinction, 1),
            ([f64::INFINITY, 1.0], Range::NotNegative, 0),
        ] {
            let before = values;
            assert_eq!(clip(&mut values, range, |v| v), Err(at));
            assert!(values.iter().zip(before).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }
}
