//! Lights without a surface, environment maps, many lights: closed forms in the f64 reference and on the device, and the device
//! against the reference.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use glam::{DMat3, DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::device::rng::hash;
use spectile::scene::{Environment, Filter, Projection, Scene, Sides, Texels, Wavelengths};
use spectile::spectral::{Channels, Curve, Outside, upsample};

use crate::device::{self, Settings};
use crate::scene_builder::*;
use crate::size;
use crate::statistics::*;
use crate::truth;

/// The mean is `expected` within 1e-7 in the reference (rays of a narrow camera differ by 1e-9, and nothing here is 100 times as
/// steep), and in f32 within `allowance` on the device.
#[track_caller]
fn exact(what: &str, scene: &Scene, expected: &[f64], allowance: f64) {
    let estimate = truth::render_image(scene, 64, 1);
    for (k, (mean, want)) in estimate.mean.iter().zip(expected).enumerate() {
        assert!((mean - want).abs() <= 1e-7 * want, "{what}, reference, value {k}: {mean}, expected {want}");
    }
    let epochs = device::render(scene, 2, 64, Settings::default());
    epochs.assert_clean();
    for (k, (mean, want)) in epochs.means[0].iter().zip(expected).enumerate() {
        let mean = f64::from(*mean);
        assert!((mean - want).abs() <= allowance * want, "{what}, device, value {k}: {mean}, expected {want}");
    }
}

/// Both estimate `expected`, with standard errors of at most `resolution`.
#[track_caller]
fn estimates(what: &str, scene: &Scene, expected: &[f64], resolution: f64) {
    let samples = 40_000;
    let estimate = truth::render_image(scene, samples, 3);
    let freedom = f64::from(samples - 1);
    let values: Vec<Estimate> = (estimate.mean.iter().zip(&estimate.standard_error))
        .map(|(mean, error)| Estimate { mean: *mean, error: *error, freedom })
        .collect();
    assert_estimates(&format!("{what}, reference"), &values, expected, Bound { resolution, allowance: 1e-9 });
    let epochs = device::render(scene, 64, 64, Settings { seed: 4, ..Settings::default() });
    epochs.assert_clean();
    assert_estimates(&format!("{what}, device"), &epochs.values(), expected, Bound { resolution, allowance: 3e-4 });
}

/// A white disk of radius 1 at the origin, facing +z, seen at its middle.
fn patch() -> Builder {
    let camera = look(DVec3::new(0.0, 0.5, 1.0), DVec3::ZERO, DVec3::Y, narrow());
    Builder::new().camera(camera).diffuse(disk(DVec3::ZERO, DVec3::Z, 1.0), 1.0)
}

// ---- Points, directional lights, suns

/// L = ρ I cosθ / (π d²); nothing from below, nothing through a screen.
#[test]
fn a_point_light_on_a_patch() {
    for (position, expected) in [
        (DVec3::new(0.0, 0.0, 2.0), 7.0 / (PI * 4.0)),
        (DVec3::new(1.0, 0.0, 1.0), 7.0 * FRAC_1_SQRT_2 / (PI * 2.0)),
        (DVec3::new(0.0, -30.0, 40.0), 7.0 * 0.8 / (PI * 2500.0)),
    ] {
        // Origins lie 2^-16 of the scene's half size above the surface.
        exact("point", &patch().point(position, 7.0).build(), &[expected], 4.0 * ORIGIN_OFFSET);
        let below = patch().point(-position, 7.0).build();
        assert_eq!(truth::render_image(&below, 16, 1).mean, [0.0]);
        assert_eq!(device::render(&below, 1, 16, Settings::default()).means[0], [0.0]);
        let screen = disk(0.5 * position, position, 0.3);
        let hidden = patch().point(position, 7.0).black(screen).build();
        assert_eq!(truth::render_image(&hidden, 16, 1).mean, [0.0]);
        assert_eq!(device::render(&hidden, 1, 16, Settings::default()).means[0], [0.0]);
    }
}

/// A point at the centre of a sphere, L = ρ I / (π R²) (1 - ρⁿ) / (1 - ρ) after n bounces.
#[test]
fn a_point_light_in_a_sphere() {
    for (rho, bounces, radius) in [(0.5, 60, 1.0), (0.5, 1, 1.0), (0.8, 8, 3.0)] {
        let center = DVec3::new(0.5, -1.0, 0.2);
        let camera = look(center + 0.3 * radius * DVec3::X, center + DVec3::ONE, DVec3::Y, narrow());
        let scene = Builder::new()
            .camera(camera)
            .diffuse(sphere(center, radius), rho)
            .point(center, PI)
            .bounces(bounces)
            .build();
        let expected = rho / (radius * radius) * (1.0 - f64::powi(rho, bounces as i32)) / (1.0 - rho);
        exact("sphere", &scene, &[expected], 8.0 * ORIGIN_OFFSET);
    }
}

/// L = ρ E cosθ / π; and the light itself is not seen.
#[test]
fn directional_lights() {
    for (direction, cosine) in
        [(DVec3::NEG_Z, 1.0), (DVec3::new(1.0, 0.0, -1.0), FRAC_1_SQRT_2), (DVec3::new(0.0, 3.0, -4.0), 0.8)]
    {
        let scene = patch().directional(direction, 2.0).build();
        exact("directional", &scene, &[2.0 * cosine / PI], 1e-5);
        let away = patch().directional(-direction, 2.0).build();
        assert_eq!(device::render(&away, 1, 16, Settings::default()).means[0], [0.0]);
    }
    let camera = look(DVec3::ZERO, DVec3::Z, DVec3::Y, narrow());
    let scene = Builder::new().camera(camera).directional(DVec3::NEG_Z, 2.0).build();
    assert_eq!(truth::render_image(&scene, 16, 1).mean, [0.0]);
    assert_eq!(device::render(&scene, 1, 16, Settings::default()).means[0], [0.0]);
}

/// A sun's irradiance is that of the plane, E cosθ, as long as all of it is up; and the camera sees E / (π sin²α), to its rim.
#[test]
fn suns() {
    for (degrees, direction, cosine) in [
        (0.001f64, DVec3::NEG_Z, 1.0),
        (0.2665, DVec3::new(0.0, 3.0, -4.0), 0.8),
        (10.0, DVec3::new(1.0, 0.0, -1.0), FRAC_1_SQRT_2),
        (90.0, DVec3::NEG_Z, 1.0),
    ] {
        let radius = degrees.to_radians();
        let scene = patch().sun(direction, radius, 3.0).build();
        estimates(&format!("sun of {degrees}°"), &scene, &[3.0 * cosine / PI], 0.01);
        let seen = |off: f64| {
            let across = direction.any_orthogonal_vector().normalize();
            let towards = -direction.normalize() * (off * radius).cos() + across * (off * radius).sin();
            let camera = look(DVec3::ZERO, towards, DVec3::new(0.123, 1.0, 0.3), narrow());
            Builder::new().camera(camera).sun(direction, radius, 3.0).build()
        };
        // f32 directions differ by 6e-8, which is a hundredth of the smallest radius' margin.
        for off in [0.0, 0.98] {
            exact("visible sun", &seen(off), &[3.0 / (PI * radius.sin().powi(2))], 1e-5);
        }
        if degrees < 80.0 {
            assert_eq!(device::render(&seen(1.02), 1, 16, Settings::default()).means[0], [0.0]);
            assert_eq!(truth::render_image(&seen(1.02), 16, 1).mean, [0.0]);
        }
    }
}

// ---- Maps

/// A spectral map that is grey between 300 and 800 nm.
fn grey_map(builder: Builder, size: [u32; 2], values: &[f32]) -> Builder {
    let radiance: Vec<f32> = values.iter().flat_map(|v| [*v, *v]).collect();
    builder.map(size, Texels::Spectral { nm: vec![300.0, 800.0], radiance: radiance.into() })
}

/// The map's value in direction `m` of its own frame (v = 0 is up, u = ½ along -z and growing towards +x), written out again.
fn bilinear(size: [u32; 2], values: &[f32], m: DVec3) -> f64 {
    let [width, height] = size.map(f64::from);
    let u = 0.5 + m.x.atan2(-m.z) / TAU;
    let v = m.y.clamp(-1.0, 1.0).acos() / PI;
    let mut sum = 0.0;
    // Every texel with its hat, the columns repeated.
    for (i, value) in values.iter().enumerate() {
        let (x, y) = (i % size[0] as usize, i / size[0] as usize);
        let hat = |t: f64| (1.0 - t.abs()).max(0.0);
        let by_column: f64 = [-1.0, 0.0, 1.0].map(|turn| hat(u * width - 0.5 - x as f64 - turn * width)).iter().sum();
        let row = (v * height - 0.5).clamp(0.0, height - 1.0);
        sum += by_column * hat(row - y as f64) * f64::from(*value);
    }
    sum
}

/// Directions all over the sphere look up what was written there, turned maps included; the poles and the seam among them.
#[test]
fn maps_are_seen_as_written() {
    let size = [5, 4];
    // At a pole every column meets: its row has one value.
    let value = |i: u32| if (5..15).contains(&i) { i * 7 % 15 } else { i / 5 };
    let values: Vec<f32> = (0..20).map(|i| 1.0 + value(i) as f32).collect();
    let turned = DMat3::from_axis_angle(DVec3::new(2.0, -1.0, 2.0) / 3.0, 1.1);
    for to_map in [DMat3::IDENTITY, turned] {
        for m in [
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::NEG_Z,
            DVec3::Z,
            DVec3::X,
            DVec3::new(0.3, 0.2, -0.7),
            DVec3::new(-0.5, -0.6, 0.1),
            DVec3::new(1e-3, 0.9, 1e-3),
            DVec3::new(-1e-4, 0.1, 1.0),
        ] {
            let m = m.normalize();
            let towards = to_map.transpose() * m;
            let camera = look(DVec3::ZERO, towards, DVec3::new(0.31, -0.2, 0.77), narrow());
            let mut scene = grey_map(Builder::new().camera(camera), size, &values).build();
            if let Some(Environment::Map(map)) = &mut scene.environment {
                map.to_map = to_map;
                map.scale = 3.0;
            }
            // Fractions of 16 bits: in each of two directions 1/131,070 of a difference of at most 14, of values of at least 1.
            exact(&format!("map towards {m}"), &scene, &[3.0 * bilinear(size, &values, m)], 3e-4);
        }
    }
}

/// A constant map is a uniform sky: on a matt ball, a rough metal and through glass, in colours and in spectra.
#[test]
fn a_constant_map_is_the_uniform_sky() {
    let channels = || Channels::equal(400.0, 700.0, 3);
    let base = || {
        Builder::new()
            .camera(look(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, narrow()))
            .channels(channels())
            .diffuse(sphere(DVec3::ZERO, 1.0), 0.5)
    };
    let white = upsample::daylight();
    let expected: Vec<f64> = channels().bounds.iter().map(|b| 0.5 * 2.5 * white.mean(b[0], b[1])).collect();
    estimates("grey RGB map", &base().rgb_map([8, 4], vec![2.5; 96]).build(), &expected, 0.01);
    let Curve::Linear { nm, value, .. } = &white else { unreachable!("D65 is a table") };
    let radiance: Vec<f32> = (0..6).flat_map(|_| value.iter().map(|v| 2.5 * *v as f32)).collect();
    let spectral = base().map([3, 2], Texels::Spectral { nm: nm.clone(), radiance: radiance.into() }).build();
    // Bands of 1 nm are a line in each channel.
    assert!(!Prepared::new(&spectral, 0).unwrap().features.knots);
    estimates("spectral map", &spectral, &expected, 0.01);
}

/// One bright texel on a patch: ∫ L cosθ dω by quadrature of its hat. Aimed at, met, and both.
#[test]
fn one_bright_texel() {
    let size = [16, 8];
    let mut values = vec![0f32; 128];
    // v = 0 is +y; the patch faces +z, the seam of the map (u = 0 and 1).
    values[3 * 16] = 1e3;
    let irradiance: f64 = {
        const STEPS: usize = 480;
        let mut sum = 0.0;
        for i in 0..STEPS * STEPS {
            let (u, v) = ((i % STEPS) as f64 / STEPS as f64, (i / STEPS) as f64 / STEPS as f64);
            let (u, v) = (u + 0.5 / STEPS as f64, v + 0.5 / STEPS as f64);
            let (phi, theta) = (TAU * (u - 0.5), PI * v);
            let m = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            sum += bilinear(size, &values, m) * m.z.max(0.0) * theta.sin();
        }
        sum * TAU * PI / (STEPS * STEPS) as f64
    };
    let scene = grey_map(patch(), size, &values).build();
    // The hat's kinks lie on edges of steps, 15 of which make half a texel: midpoints are good to 1e-5.
    let expected = [irradiance / PI];
    let epochs = device::render(&scene, 64, 64, Settings { seed: 5, ..Settings::default() });
    epochs.assert_clean();
    let bound = Bound { resolution: 0.005, allowance: 3e-4 };
    assert_estimates("one texel, device", &epochs.values(), &expected, bound);
    let estimate = truth::render_image(&scene, 40_000, 6);
    let values = [Estimate { mean: estimate.mean[0], error: estimate.standard_error[0], freedom: 39_999.0 }];
    assert_estimates("one texel, reference", &values, &expected, Bound { resolution: 0.01, allowance: 1e-5 });
}

// ---- The device against the reference

fn compare(what: &str, scene: &Scene, epochs: u32, samples: u32, resolution: f64) {
    let ours = device::render(scene, epochs, 64, Settings { seed: 21, tile: [8, 8], ..Settings::default() });
    ours.assert_clean();
    let theirs = truth::render_image(scene, samples, 22);
    let channels = scene.channels.len();
    let pixels = theirs.mean.len() / channels;
    let freedom = f64::from(samples - 1);
    let images: Vec<Estimate> = (0..channels)
        .map(|k| {
            let of_channel = |values: &[f64]| values.iter().skip(k).step_by(channels).copied().collect::<Vec<_>>();
            let mean = of_channel(&theirs.mean).iter().sum::<f64>() / pixels as f64;
            let square = of_channel(&theirs.standard_error).iter().map(|e| e * e).sum::<f64>();
            Estimate { mean, error: square.sqrt() / pixels as f64, freedom }
        })
        .collect();
    let means: Vec<f64> = images.iter().map(|e| e.mean).collect();
    let bound = Bound { resolution, allowance: 5e-4 };
    assert_agreement(&format!("{what}, image"), &ours.image_means(), &images, &means, bound);
}

/// A floor with a ball of each kind on it.
fn still_life(channels: Channels) -> Builder {
    let ball = |x: f64, z: f64| sphere(DVec3::new(x, 0.5, z), 0.5);
    let slope = |a: f64, b: f64| Curve::Linear { nm: vec![400.0, 700.0], value: vec![a, b], outside: Outside::Hold };
    let projection = Projection::Perspective { tan_half: DVec2::new(0.6, 0.45) };
    Builder::new()
        .camera(look(DVec3::new(0.0, 1.6, 3.2), DVec3::new(0.0, 0.3, 0.0), DVec3::Y, projection))
        .film(8, 6, Filter::Box)
        .channels(channels)
        .bounces(4)
        .diffuse(quad(DVec3::new(-2.0, 0.0, 2.0), 4.0 * DVec3::X, -4.0 * DVec3::Z), slope(0.2, 0.8))
        .diffuse(ball(-1.2, -0.4), 0.7)
        .conductor(ball(0.0, -0.8), slope(0.3, 1.2), 2.5, [0.3, 0.3])
        .plastic(ball(1.2, -0.4), slope(0.7, 0.1), 1.5, 0.2)
        .dielectric(ball(-0.5, 0.7), 1.5, 0.3)
}

fn noise_map(size: [u32; 2], seed: u32) -> Vec<f32> {
    let texels = 3 * size[0] * size[1];
    (0..texels).map(|i| hash(seed << 20 ^ i) as f32 / 4_294_967_296.0).collect()
}

#[test]
fn colours_around_everything() {
    let mut rgb = noise_map([16, 8], 1);
    // A sun of its own in the upper half.
    rgb[3 * (2 * 16 + 5)..][..3].copy_from_slice(&[60.0, 40.0, 15.0]);
    let scene = still_life(Channels::equal(400.0, 700.0, 5)).rgb_map([16, 8], rgb).build();
    compare("RGB map", &scene, 32, 4096, 0.01);
}

/// Bands that light different channels from different sides, lines among them; channels beyond the bands stay dark.
#[test]
fn spectra_around_everything() {
    let nm = vec![420.0, 421.0, 480.0, 481.0, 560.0, 650.0];
    let radiance: Vec<f32> = noise_map([8, 8], 2)
        .chunks(3)
        .take(64)
        .enumerate()
        .flat_map(|(t, c)| {
            let side = t % 8;
            [0.0, if side < 2 { 40.0 } else { 0.1 }, c[0], c[1], c[2], if side > 5 { 5.0 } else { 0.0 }]
        })
        .collect();
    let channels = Channels::from_bounds(vec![[400.0, 440.0], [470.0, 500.0], [540.0, 580.0], [600.0, 660.0]], None);
    let mut scene = still_life(channels).map([8, 8], Texels::Spectral { nm, radiance: radiance.into() }).build();
    if let Some(Environment::Map(map)) = &mut scene.environment {
        map.to_map = DMat3::from_rotation_y(0.7);
    }
    // Bands at any distance are kept exact: by knots, or by strata that end at all bands.
    for (wavelengths, knots) in size::first(1, [(Wavelengths::Emission, false), (Wavelengths::Uniform, true)]) {
        scene.integrator.wavelengths = wavelengths;
        assert_eq!(Prepared::new(&scene, 0).unwrap().features.knots, knots, "{wavelengths:?}");
        compare("spectral map", &scene, 32, 4096, 0.02);
    }
}

/// All at once: a map, a sun, a point, a directional light and a lamp, with roulette.
#[test]
fn every_kind_of_light_together() {
    let blue = Curve::Linear { nm: vec![400.0, 500.0, 700.0], value: vec![3.0, 1.0, 0.0], outside: Outside::Hold };
    let scene = still_life(Channels::equal(400.0, 700.0, 4))
        .rgb_map([8, 4], noise_map([8, 4], 3))
        .sun(DVec3::new(-1.0, -2.0, -0.5), 3f64.to_radians(), 2.0)
        .sun(DVec3::new(1.0, -1.0, 0.3), 10f64.to_radians(), 0.7)
        .point(DVec3::new(0.5, 2.0, 1.0), blue)
        .directional(DVec3::new(0.3, -1.0, 0.2), 0.5)
        .lamp(disk(DVec3::new(-1.0, 2.5, 0.0), DVec3::NEG_Y, 0.3), 8.0, Sides::Front)
        .roulette(3)
        .build();
    compare("every light", &scene, 16, 1024, 0.02);
}

/// The same colours as RGB and, where they must agree, as spectra: greys times D65.
#[test]
fn spectra_and_colours_agree() {
    let channels = || Channels::equal(420.0, 680.0, 4);
    let grey: Vec<f32> = noise_map([8, 4], 4).chunks(3).map(|c| c[0] * c[0] * 4.0).collect();
    let rgb = grey.iter().flat_map(|v| [*v; 3]).collect();
    let Curve::Linear { nm, value, .. } = upsample::daylight() else { unreachable!("D65 is a table") };
    let radiance: Vec<f32> = grey.iter().flat_map(|g| value.iter().map(move |v| g * *v as f32)).collect();
    let colours = still_life(channels()).rgb_map([8, 4], rgb).build();
    let spectra = still_life(channels()).map([8, 4], Texels::Spectral { nm, radiance: radiance.into() }).build();
    let [a, b] = [&colours, &spectra].map(|scene| {
        let epochs = device::render(scene, 32, 64, Settings { seed: 31, tile: [8, 8], ..Settings::default() });
        epochs.assert_clean();
        epochs.image_means()
    });
    let means: Vec<f64> = a.iter().map(|e| e.mean).collect();
    // The same random numbers and nearly the same importance: far closer than independent renders.
    let bound = Bound { resolution: 0.02, allowance: 1e-3 };
    assert_agreement("RGB and spectral maps", &a, &b, &means, bound);
}

// ---- Many lights

/// A sphere of 20,480 emitting triangles and two tiny ones with all of the power of another channel: E = π L (R/d)² in the first;
/// the second as its own closed form. Choosing by share of power finds both.
#[test]
fn thousands_of_emitting_triangles() {
    let red = |value: f64| Curve::Linear { nm: vec![600.0, 700.0], value: vec![value; 2], outside: Outside::Zero };
    let blue = |value: f64| Curve::Linear { nm: vec![400.0, 500.0], value: vec![value; 2], outside: Outside::Zero };
    let side = 1e-3;
    let lamp = quad(DVec3::new(-0.5 * side, -0.5 * side, 1.0), side * DVec3::Y, side * DVec3::X);
    let scene = patch()
        .channels(Channels::from_bounds(vec![[610.0, 690.0], [410.0, 490.0]], None))
        .lamp(icosphere(4.0 * DVec3::Z, 1.0, 5), red(2.0), Sides::Front)
        .lamp(lamp, blue(5.0), Sides::Front)
        .build();
    assert_eq!(Prepared::new(&scene, 0).unwrap().emitters.len(), 20_482);
    // The icosphere's faces lie up to 3e-4 inside the sphere (edges of 1/32 of 63 degrees): its cross-section lacks twice that.
    let expected = [2.0 / 16.0, 5.0 * side * side / PI];
    let epochs = device::render(&scene, 64, 256, Settings { seed: 41, ..Settings::default() });
    epochs.assert_clean();
    assert_estimates("triangles", &epochs.values(), &expected, Bound { resolution: 0.02, allowance: 1e-3 });
}
