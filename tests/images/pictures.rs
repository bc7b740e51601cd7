//! Lamps that are pictures: closed forms in the f64 reference and on the device, and both against each other.

use std::f64::consts::PI;

use glam::DVec3;
use spectile::scene::{Scene, Shape, Sides, TextureFilter, TextureKind};
use spectile::spectral::{Channels, Curve, skylight, upsample};

use crate::device::{self, Settings};
use crate::scene_builder::*;
use crate::statistics::*;
use crate::truth;

/// A black lamp that is a picture of colours.
fn screen(mut b: Builder, shape: Shape, size: [u32; 2], rgb: &[f32], sides: Sides) -> Builder {
    b = b.lamp(shape, upsample::daylight(), sides).attributes(quad_uv());
    let daylight = b.0.spectra.len() - 1;
    let texture = b.texture(size, rgb, TextureKind::Light(daylight));
    b.0.objects.last_mut().and_then(|object| object.emission.as_mut()).expect("a lamp").texture = Some(texture);
    b
}

/// A screen shows the spectra of `rgb` as emission, at its texels and half way between; its back is dark, and so is what is black.
#[test]
fn screens_show_the_spectra_of_their_colours() {
    let rgb: [[f32; 3]; 4] = [[8.0, 1.0, 0.5], [0.02, 0.3, 0.9], [2.5; 3], [0.0; 3]];
    let tints = skylight::tints(rgb.as_flattened());
    let nm = [361.0, 420.0, 530.0, 620.0, 700.0];
    // So narrow that the steepest slope, some 0.01 a nanometre, is nothing within a channel.
    let channels = || Channels::from_bounds(nm.iter().map(|nm| [*nm, nm + 1e-4]).collect(), None);
    let spectrum = |texel: usize, nm: f64| upsample::emission(rgb[texel].map(f64::from)).eval(nm + 5e-5);
    for (u, parts, side) in [
        (0.125, vec![(0, 1.0)], 1.0),
        (0.25, vec![(0, 0.5), (1, 0.5)], 1.0),
        (0.625, vec![(2, 1.0)], 1.0),
        (0.875, vec![(3, 1.0)], 1.0),
        (0.125, vec![], -1.0),
    ] {
        let point = DVec3::new(4.0 * u, 0.3, 0.0);
        let camera = look(point + 2.0 * side * DVec3::Z, point, DVec3::Y, narrow());
        let b = Builder::new().camera(camera).channels(channels()).bounces(0);
        let plate = quad(DVec3::ZERO, 4.0 * DVec3::X, DVec3::Y);
        let scene = screen(b, plate, [4, 1], rgb.as_flattened(), Sides::Front).build();
        let reference = truth::render_image(&scene, 4, 2);
        let device = device::render(&scene, 1, 4, Settings::default());
        device.assert_clean();
        for (k, nm) in nm.iter().enumerate() {
            let want: f64 = parts.iter().map(|(texel, weight)| weight * spectrum(*texel, *nm)).sum();
            // The grid of `upsample::emission` is off by 1e-5 of S; on devices S is that of x = (a t + b) t + c, whose three
            // coefficients and t are f32, and dS/dx is ½ at most.
            let rounding = |texel: usize| {
                let [a, b, c] = tints[texel].smooth.0.map(f64::abs);
                tints[texel].scale * (1e-5 + 0.5 * 3.0 * f64::from(f32::EPSILON) * (2.0 * a + b + c))
            };
            let white = upsample::daylight().eval(*nm);
            let bound = 1e-6 + white * parts.iter().map(|(texel, weight)| weight * rounding(*texel)).sum::<f64>();
            for (who, value) in [("reference", reference.mean[k]), ("device", f64::from(device.means[0][k]))] {
                assert!((value - want).abs() <= bound, "{who}, u {u}, side {side}, {nm} nm: {value} instead of {want}");
            }
        }
    }
}

/// A patch that faces the middle of a square of side 2 at distance 1: E = 4 a/√(1 + a²) atan(a/√(1 + a²)) L with a = 1, for a picture of two
/// halves of 1 and 3 the mean of both; and what a patch sees of lamps whose amounts are above 1.
#[test]
fn pictures_light_by_their_mean_where_all_is_even() {
    let a = 0.5f64.sqrt();
    let irradiance = 4.0 * a * a.atan();
    assert!((irradiance - 1.740840).abs() < 1e-6, "the published digits");
    let camera = look(DVec3::new(0.0, 0.5, 0.7), DVec3::ZERO, DVec3::Y, narrow());
    let b = Builder::new().camera(camera).diffuse(disk(DVec3::ZERO, DVec3::Z, 1.0), 1.0);
    let lamp = quad(DVec3::new(-1.0, -1.0, 1.0), 2.0 * DVec3::Y, 2.0 * DVec3::X);
    let mut b = b.lamp(lamp, 1.0, Sides::Front).attributes(quad_uv());
    let texture = b.mixture([2, 1], &[1.0, 0.5, 0.0, 2.5], &[Curve::Constant(0.5), Curve::Constant(1.0)]);
    b.0.textures[texture].placement.filter = TextureFilter::Nearest;
    b.0.objects.last_mut().and_then(|object| object.emission.as_mut()).expect("a lamp").texture = Some(texture);
    let scene: Scene = b.build();
    // 0.5 + 0.5 on one half, 2.5 on the other.
    let expected = [irradiance * 0.5 * (1.0 + 2.5) / PI];
    let reference = truth::render_image(&scene, 20_000, 3);
    let values = [Estimate { mean: reference.mean[0], error: reference.standard_error[0], freedom: 19_999.0 }];
    assert_estimates("reference", &values, &expected, Bound { resolution: 0.01, allowance: 1e-6 });
    let ours = device::measure(scene, 1, 4);
    assert_estimates("device", &ours, &expected, Bound { resolution: 0.01, allowance: 3e-4 });
}

/// A screen of colours in a room, which reflects too and is warm, against the reference.
#[test]
fn screens_are_those_of_the_reference() {
    let walls = room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0));
    let b = Builder::new()
        .into_room()
        .channels(Channels::equal(400.0, 700.0, 3))
        .bounces(3)
        .roulette(2)
        .diffuse(walls, table(&[400.0, 700.0], &[0.3, 0.7]));
    let rgb = [3.0, 0.2, 0.1, 0.1, 0.4, 2.0, 0.7, 0.7, 0.2, 1.0, 1.0, 1.0];
    let shape = quad(DVec3::new(-0.8, -0.7, -0.8), DVec3::X, 1.5 * DVec3::Y);
    let mut scene = screen(b, shape, [2, 2], &rgb, Sides::Both).build();
    let last = scene.materials.len() - 1;
    scene.materials[last].bsdf = scene.materials[0].bsdf.clone();
    scene.materials[last].temperature = Some(spectile::scene::Temperature::Constant(1500.0));
    device::assert_as_reference("screen", &scene, [16, 256], 6000, Bound { resolution: 0.2, allowance: 4e-3 });
}
