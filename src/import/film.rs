//! Films: filters of pixels by those that Spectile has, and windows beside the axis.

use super::report::Deviation;
use super::scene::Section;
use super::text;

/// How much a place counts by its distance from a pixel's centre along one axis, in pixels; of any sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    Box {
        radius: f64,
    },
    Tent {
        radius: f64,
    },
    /// Less what it is at its radius, where it ends.
    Gaussian {
        stddev: f64,
        radius: f64,
    },
    /// Mitchell and Netravali (1988).
    Cubic {
        b: f64,
        c: f64,
        radius: f64,
    },
    /// sinc(x) times a window of sinc(x / lobes).
    Sinc {
        radius: f64,
        lobes: f64,
    },
}

/// Catmull and Rom's, which is one of Mitchell and Netravali's.
pub const CATMULL_ROM: Filter = Filter::Cubic { b: 0.0, c: 0.5, radius: 2.0 };

/// Half of what two filters do not share below which they count as one: a tenth of a per cent of the contrast.
const SAME: f64 = 1e-3;

fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x.abs() < 1e-9 { 1.0 } else { x.sin() / x }
}

impl Filter {
    fn at(&self, x: f64) -> f64 {
        let x = x.abs();
        match *self {
            Filter::Box { radius } | Filter::Sinc { radius, .. } if x > radius => 0.0,
            Filter::Box { .. } => 1.0,
            Filter::Tent { radius } => (1.0 - x / radius).max(0.0),
            Filter::Gaussian { stddev, radius } => {
                let bell = |x: f64| (-0.5 * (x / stddev).powi(2)).exp();
                (bell(x) - bell(radius)).max(0.0)
            }
            Filter::Cubic { b, c, radius } => {
                let x = 2.0 * x / radius;
                if x < 1.0 {
                    ((12.0 - 9.0 * b - 6.0 * c) * x * x * x + (-18.0 + 12.0 * b + 6.0 * c) * x * x + 6.0 - 2.0 * b)
                        / 6.0
                } else if x < 2.0 {
                    ((-b - 6.0 * c) * x * x * x
                        + (6.0 * b + 30.0 * c) * x * x
                        + (-12.0 * b - 48.0 * c) * x
                        + 8.0 * b
                        + 24.0 * c)
                        / 6.0
                } else {
                    0.0
                }
            }
            Filter::Sinc { lobes, .. } => sinc(x) * sinc(x / lobes),
        }
    }

    fn radius(&self) -> f64 {
        match *self {
            Filter::Box { radius }
            | Filter::Tent { radius }
            | Filter::Gaussian { radius, .. }
            | Filter::Cubic { radius, .. }
            | Filter::Sinc { radius, .. } => radius,
        }
    }
}

/// Half of ∫∫|f - g| for two filters over x and y of sum 1: no pixel differs by more of what is brightest around it less what is darkest.
fn unshared(f: [Filter; 2], g: [Filter; 2]) -> f64 {
    const STEPS: i32 = 100;
    let reach = f.iter().chain(&g).map(Filter::radius).fold(0.0, f64::max);
    let samples = |filter: &Filter| {
        let at = |i: i32| filter.at(reach * (f64::from(i) + 0.5) / f64::from(STEPS));
        let all: Vec<f64> = (-STEPS..STEPS).map(at).collect();
        let sum: f64 = all.iter().sum();
        all.into_iter().map(|v| v / sum).collect::<Vec<f64>>()
    };
    let [fx, fy] = f.each_ref().map(samples);
    let [gx, gy] = g.each_ref().map(samples);
    let rows =
        fy.iter().zip(&gy).map(|(fy, gy)| fx.iter().zip(&gx).map(|(fx, gx)| (fx * fy - gx * gy).abs()).sum::<f64>());
    0.5 * rows.sum::<f64>()
}

/// Spectile's own, as `film.filter` calls them.
const OWN: [(&str, Filter); 2] = [
    ("box", Filter::Box { radius: 0.5 }),
    // It is cut at 2 along each axis, where it is 3e-4 of its peak.
    ("gaussian", Filter::Gaussian { stddev: 0.5, radius: 2.0 }),
];

/// Gives a film the filter nearest to one that is `x` along x and `y` along y; the words on what that is, unless it is the same.
pub fn filter(film: &mut Section, [x, y]: [Filter; 2]) -> Option<(&'static str, Deviation)> {
    let distances = OWN.map(|(name, own)| (name, unshared([x, y], [own; 2])));
    let (name, off) = if distances[0].1 <= distances[1].1 { distances[0] } else { distances[1] };
    if name != "box" {
        film.set("filter", text::quoted(name));
    }
    let reach = x.radius().max(y.radius()).max(2.0);
    let what = format!("{} of the contrast within {} pixels", text::percent(off), text::rounded(reach));
    (off > SAME).then(|| {
        (if name == "box" { "a pixel's square" } else { "a Gaussian of 0.5 pixels" }, Deviation::at_most(what))
    })
}

/// A film around the axis, of which what is to be seen is a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Of the full film, in pixels.
    pub size: [f64; 2],
    /// Columns and rows of it before the window.
    pub first: [f64; 2],
    /// How far the window is from where it was to be, in pixels.
    pub off: f64,
}

/// The window of `size` pixels whose middle is `beside` pixels right of the axis and below it.
pub fn window(size: [f64; 2], beside: [f64; 2]) -> Window {
    // A full film that is wider by 2 |beside| has the axis in its middle.
    let whole = beside.map(|d| (2.0 * d).round());
    let off = [0, 1].map(|i| (beside[i] - 0.5 * whole[i]).abs());
    Window { size: [0, 1].map(|i| size[i] + whole[i].abs()), first: whole.map(|d| d.max(0.0)), off: off[0].max(off[1]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_as_far_apart_as_they_are() {
        let [square, bell] = OWN.map(|(_, own)| [own; 2]);
        assert!(unshared(square, square) == 0.0 && unshared(bell, bell) == 0.0);
        // Boxes of widths 1 and 2: a quarter of the larger one is within the smaller.
        let wide = [Filter::Box { radius: 1.0 }; 2];
        assert!((unshared(square, wide) - 0.75).abs() < 1e-9, "{}", unshared(square, wide));
        // pbrt's Gaussian ends at 1.5 pixels; the number is that of a sum in Python with numpy.
        let pbrts = [Filter::Gaussian { stddev: 0.5, radius: 1.5 }; 2];
        assert!((unshared(pbrts, bell) - 0.022).abs() < 1e-3, "{}", unshared(pbrts, bell));
        let mut film = Section::default();
        assert_eq!(filter(&mut film, bell), None);
        let (what, off) = filter(&mut film, [CATMULL_ROM; 2]).unwrap();
        assert_eq!(
            (what, off.to_string().as_str()),
            ("a Gaussian of 0.5 pixels", "off by at most 33 % of the contrast within 2.0 pixels")
        );
    }

    #[test]
    fn windows_lie_where_they_did() {
        assert_eq!(window([40.0, 20.0], [0.0; 2]), Window { size: [40.0, 20.0], first: [0.0; 2], off: 0.0 });
        // Ten columns to the right: the full film has twenty more, left of the window.
        assert_eq!(window([40.0, 20.0], [10.0, -2.5]), Window { size: [60.0, 25.0], first: [20.0, 0.0], off: 0.0 });
        assert_eq!(window([40.0, 20.0], [0.2, 0.0]).off, 0.2);
    }
}
