//! Front and back.

use glam::DVec3;
use spectile::scene::{Scene, Sides};

use crate::device::{Settings, render};
use crate::scene_builder::*;

/// What each side of a surface shows, for a disk and for a pair of triangles: emission and reflection.
#[test]
fn sides() {
    let plates = [disk(DVec3::ZERO, DVec3::Z, 1.0), quad(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y)];
    for (from, front) in [(DVec3::Z, true), (DVec3::NEG_Z, false)] {
        for plate in &plates {
            // Off the quad's diagonal.
            let base = || Builder::new().camera(look(from, DVec3::new(0.1, 0.2, 0.0), DVec3::Y, narrow()));
            let shown = |scene: Scene| {
                let rendered = render(&scene, 1, 64, Settings::default());
                rendered.assert_clean();
                rendered.means[0][0]
            };
            let only_front = |x: f32| if front { x } else { 0.0 };
            let close = |a: f32, b: f32| (a - b).abs() <= 1e-6 * b;
            assert_eq!(shown(base().lamp(plate.clone(), 2.0, Sides::Front).build()), only_front(2.0));
            assert_eq!(shown(base().lamp(plate.clone(), 2.0, Sides::Both).build()), 2.0);
            assert!(close(shown(base().diffuse(plate.clone(), 0.5).sky(3.0).build()), 1.5));
            assert!(close(shown(base().one_sided(plate.clone(), 0.5).sky(3.0).build()), only_front(1.5)));
            assert_eq!(shown(base().black(plate.clone()).sky(3.0).build()), 0.0);
            // No scattering at depth 0: a reflecting surface is black, the sky is seen directly.
            assert_eq!(shown(base().diffuse(plate.clone(), 0.5).sky(3.0).bounces(0).build()), 0.0);
            assert_eq!(shown(base().sky(3.0).bounces(0).build()), 3.0);
        }
    }
}
