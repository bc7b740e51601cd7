//! Edges of spots by those that Spectile has.

/// How the intensity falls from the axis to where it ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// Degrees from the axis to where the light ends, and to where it begins to fall.
    pub half: f64,
    pub falloff: f64,
    pub profile: &'static str,
    /// Of the intensity on the axis, the most that it is off at any angle.
    pub off: f64,
}

/// Spectile's intensity at an angle of `degrees` to the axis.
fn intensity(edge: &Edge, degrees: f64) -> f64 {
    let within = |x: f64| x.clamp(0.0, 1.0);
    match edge.profile {
        _ if degrees <= edge.falloff => 1.0,
        "linear" => within((edge.half - degrees) / (edge.half - edge.falloff)),
        _ => {
            let [at, start, end] = [degrees, edge.falloff, edge.half].map(|angle| angle.to_radians().cos());
            let t = within((at - end) / (start - end));
            t * t * (3.0 - 2.0 * t)
        }
    }
}

/// The edge nearest to `wanted`, an intensity by the angle in degrees that falls from 1 at `start` to 0 at `end`.
pub fn nearest(wanted: &dyn Fn(f64) -> f64, start: f64, end: f64) -> Edge {
    const STEPS: i32 = 24;
    let angles: Vec<f64> = (0..=200).map(|i| end * f64::from(i) / 200.0).collect();
    let off =
        |edge: &Edge| angles.iter().map(|angle| (intensity(edge, *angle) - wanted(*angle)).abs()).fold(0.0, f64::max);
    let mut best = Edge { half: end, falloff: start, profile: "smooth", off: 0.0 };
    best.off = off(&best);
    // A grid of edges, then finer ones around the best.
    let mut width = end - start.min(0.0);
    for _ in 0..4 {
        let around = best.clone();
        for profile in ["smooth", "linear"] {
            for i in -STEPS..=STEPS {
                for j in -STEPS..=STEPS {
                    let moved = |from: f64, i: i32| from + width * f64::from(i) / f64::from(STEPS);
                    let half = moved(around.half, i).clamp(1e-3, end);
                    let falloff = moved(around.falloff, j).clamp(0.0, half * (1.0 - 1e-6));
                    let edge = Edge { half, falloff, profile, off: 0.0 };
                    let off = off(&edge);
                    if off < best.off {
                        best = Edge { off, ..edge };
                    }
                }
            }
        }
        width /= f64::from(STEPS) / 2.0;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_that_are_spectiles_own_stay() {
        for profile in ["smooth", "linear"] {
            let own = Edge { half: 40.0, falloff: 30.0, profile, off: 0.0 };
            let found = nearest(&|angle| intensity(&own, angle), 30.0, 40.0);
            assert!(found.off < 2e-3, "{found:?}");
        }
    }

    /// A squared ramp in the cosine from the axis on, glTF's default: no profile is further than a tenth from it.
    #[test]
    fn edges_of_gltf_are_near() {
        let end = 45.0f64;
        let squared = |angle: f64| {
            let [at, edge] = [angle, end].map(|angle: f64| angle.to_radians().cos());
            ((at - edge) / (1.0 - edge)).clamp(0.0, 1.0).powi(2)
        };
        let found = nearest(&squared, 0.0, end);
        assert!(found.off < 0.1, "{found:?}");
    }
}
