//! Pictures of the f64 reference path tracer, by the clock.

use spectile::reference::{self, Estimate};
use spectile::scene::Scene;

use crate::report::{Part, timed};

/// As [`reference::render`].
pub fn render(scene: &Scene, pixels: &[[u32; 2]], samples: u32, seed: u64) -> Estimate {
    timed(Part::Reference, || reference::render(scene, pixels, samples, seed))
}

/// As [`reference::render_image`].
pub fn render_image(scene: &Scene, samples: u32, seed: u64) -> Estimate {
    timed(Part::Reference, || reference::render_image(scene, samples, seed))
}
