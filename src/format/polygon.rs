//! Polygons of a mesh, cut into triangles.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// A polygon that is cut.
#[derive(Debug, PartialEq)]
pub struct Outline {
    /// Corners by their place in the outline; all run the same way round as it does.
    pub triangles: Vec<[u32; 3]>,
    /// Whether its corners do not lie in one plane.
    pub bent: bool,
    /// Whether it crosses itself, so that what it covers is not clear.
    pub crossing: bool,
}

/// Of the size of a polygon: distances from its plane, and differences of area, below which there are none.
const FLAT: f64 = 1e-3;
const SAME_AREA: f64 = 1e-6;

/// Cuts a polygon of more than three corners: a convex one as a fan around its first corner, any other by ears, also with holes
/// that bridges (two edges on each other) connect with its outline.
pub fn cut(corners: &[[f64; 3]]) -> Outline {
    let corners: Vec<DVec3> = corners.iter().copied().map(DVec3::from_array).collect();
    let count = corners.len() as u32;
    let fan = || (1..count - 1).map(|i| [0, i, i + 1]).collect::<Vec<_>>();
    let (low, high) = corners.iter().fold((corners[0], corners[0]), |(low, high), c| (low.min(*c), high.max(*c)));
    let (centre, size) = (0.5 * (low + high), (high - low).max_element());
    // A unit long, so that nothing overflows or is lost.
    let unit: Vec<DVec3> = corners.iter().map(|corner| (*corner - centre) / size).collect();
    // Newell: twice the area, projected on the three planes.
    let around = |f: &dyn Fn(DVec3, DVec3) -> DVec3| -> DVec3 {
        (0..unit.len()).map(|i| f(unit[i], unit[(i + 1) % unit.len()])).sum()
    };
    let twice_area = around(&|a, b| a.cross(b));
    let Some(normal) = twice_area.try_normalize() else {
        // No area, or loops that cancel.
        return Outline { triangles: fan(), bent: false, crossing: size > 0.0 && !is_straight(&unit) };
    };
    let middle = unit.iter().sum::<DVec3>() / f64::from(count);
    let bent = unit.iter().any(|corner| (*corner - middle).dot(normal).abs() > FLAT);
    let (u, v) = normal.any_orthonormal_pair();
    let flat: Vec<DVec2> = unit.iter().map(|corner| DVec2::new(corner.dot(u), corner.dot(v))).collect();
    let turn = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - b);
    let at = |i: usize| flat[i % flat.len()];
    let convex = (0..flat.len()).all(|i| turn(at(i), at(i + 1), at(i + 2)) >= 0.0);
    let area_of = |triangles: &[[u32; 3]]| -> (f64, bool) {
        let each = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| flat[i as usize]);
            0.5 * (b - a).perp_dot(c - a)
        });
        each.fold((0.0, true), |(sum, all), area| (sum + area.abs(), all && area >= -SAME_AREA))
    };
    let area = 0.5 * twice_area.length();
    let same = |sum: f64| (sum - area).abs() <= SAME_AREA * area;
    let triangles = fan();
    let (sum, forward) = area_of(&triangles);
    // A star that winds twice has convex corners too.
    if convex && forward && same(sum) {
        return Outline { triangles, bent, crossing: false };
    }
    let mut found: Vec<u32> = Vec::new();
    Earcut::new().earcut(flat.iter().map(|p| p.to_array()), &[], &mut found);
    let mut triangles: Vec<[u32; 3]> = found.as_chunks::<3>().0.to_vec();
    for triangle in &mut triangles {
        let [a, b, c] = triangle.map(|i| flat[i as usize]);
        if (b - a).perp_dot(c - a) < 0.0 {
            triangle.swap(1, 2);
        }
    }
    if triangles.is_empty() {
        return Outline { triangles: fan(), bent, crossing: true };
    }
    let (sum, _) = area_of(&triangles);
    put_back(&mut triangles, count);
    Outline { crossing: !same(sum), triangles, bent }
}

/// Ears leave out corners on a straight edge, which a neighbouring face may have: the triangles along such an edge are split there.
fn put_back(triangles: &mut Vec<[u32; 3]>, count: u32) {
    let mut used = vec![false; count as usize];
    triangles.iter().flatten().for_each(|i| used[*i as usize] = true);
    let Some(first) = used.iter().position(|used| *used) else { return };
    let ring = |i: usize| (first + i) % count as usize;
    let mut from = first as u32;
    let mut skipped: Vec<u32> = Vec::new();
    for i in 1..=count as usize {
        let corner = ring(i) as u32;
        if !used[corner as usize] {
            skipped.push(corner);
            continue;
        }
        if !skipped.is_empty() {
            let along = |t: &[u32; 3]| (0..3).find(|&e| t[e] == from && t[(e + 1) % 3] == corner);
            if let Some((place, edge)) = triangles.iter().enumerate().find_map(|(i, t)| Some((i, along(t)?))) {
                let apex = triangles[place][(edge + 2) % 3];
                triangles.swap_remove(place);
                let chain = std::iter::once(from).chain(skipped.iter().copied());
                let ends = skipped.iter().copied().chain([corner]);
                triangles.extend(chain.zip(ends).map(|(a, b)| [a, b, apex]));
            }
            skipped.clear();
        }
        from = corner;
    }
}

/// Whether all corners lie on one line.
fn is_straight(unit: &[DVec3]) -> bool {
    let Some(far) = unit.iter().map(|corner| *corner - unit[0]).max_by(|a, b| a.length().total_cmp(&b.length())) else {
        return true;
    };
    unit.iter().all(|corner| (*corner - unit[0]).cross(far).length() <= 1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// An L with corners in the middle of its edges, as the faces beside it have them: all are corners of triangles, and every edge
    /// of the outline is one of a triangle.
    #[test]
    fn corners_on_straight_edges_stay() {
        let outline = [[0, 0], [2, 0], [4, 0], [4, 2], [3, 2], [2, 2], [2, 3], [2, 4], [1, 4], [0, 4], [0, 2]];
        let corners: Vec<[f64; 3]> = outline.iter().map(|[x, y]| [f64::from(*x), f64::from(*y), 0.0]).collect();
        let Outline { triangles, crossing, .. } = cut(&corners);
        assert!(!crossing);
        let count = outline.len() as u32;
        for i in 0..count {
            let edge = [i, (i + 1) % count];
            let has = |t: &[u32; 3]| (0..3).any(|e| [t[e], t[(e + 1) % 3]] == edge);
            assert!(triangles.iter().any(has), "{edge:?} of {triangles:?}");
        }
        let sum: f64 = triangles.iter().map(|t| shoelace(&t.map(|i| corners[i as usize]))).sum();
        assert!((sum - 24.0).abs() < 1e-12, "{sum}");
    }

    /// Twice the area of a flat outline, by its corners.
    fn shoelace(corners: &[[f64; 3]]) -> f64 {
        let at = |i: usize| corners[i % corners.len()];
        (0..corners.len()).map(|i| at(i)[0] * at(i + 1)[1] - at(i + 1)[0] * at(i)[1]).sum::<f64>()
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

        /// Stars of any corner radii cross nothing and may be very concave: wherever their list begins, however they lie in space
        /// and which way round they run, triangles have the area of the outline, all the same way round.
        #[test]
        fn stars_are_covered_exactly(
            radii in proptest::collection::vec(0.05f64..1.0, 4..40),
            begin in 0usize..40,
            reversed in any::<bool>(),
            turn in proptest::array::uniform3(-3.0f64..3.0),
            scale in 1e-6f64..1e6,
        ) {
            let count = radii.len();
            let mut flat: Vec<[f64; 3]> = (0..count)
                .map(|i| {
                    let angle = std::f64::consts::TAU * i as f64 / count as f64;
                    [radii[i] * angle.cos(), radii[i] * angle.sin(), 0.0]
                })
                .collect();
            flat.rotate_left(begin % count);
            if reversed {
                flat.reverse();
            }
            let rotation = glam::DQuat::from_euler(glam::EulerRot::XYZ, turn[0], turn[1], turn[2]);
            let placed: Vec<[f64; 3]> =
                flat.iter().map(|p| (scale * (rotation * DVec3::from_array(*p) + DVec3::splat(5.0))).to_array()).collect();
            let outline = cut(&placed);
            prop_assert!(!outline.bent && !outline.crossing, "{outline:?}");
            let twice = |t: &[u32; 3]| shoelace(&t.map(|i| flat[i as usize]));
            let sign = shoelace(&flat).signum();
            let sum: f64 = outline.triangles.iter().map(twice).sum();
            // 1e-10: positions lie at up to 9 times the size of the star, whose corners may be slivers of 0.05².
            prop_assert!((sum - shoelace(&flat)).abs() < 1e-10, "{sum} {}", shoelace(&flat));
            prop_assert!(outline.triangles.iter().all(|t| sign * twice(t) > -1e-10));
        }

        #[test]
        fn anything_is_cut(corners in proptest::collection::vec(proptest::array::uniform3(-3i32..3), 4..12)) {
            let corners: Vec<[f64; 3]> = corners.iter().map(|c| c.map(f64::from)).collect();
            let outline = cut(&corners);
            prop_assert!(outline.triangles.iter().flatten().all(|i| (*i as usize) < corners.len()));
        }
    }
}
