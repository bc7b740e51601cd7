//! Spot lights: closed forms in the f64 reference and on the device, and both against each other.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use spectile::scene::{Cone, Filter, Profile, Projection};
use spectile::spectral::{Channels, Curve, Outside};

use crate::device::{self, Settings};
use crate::scene_builder::*;
use crate::statistics::{Bound, ORIGIN_OFFSET};
use crate::truth;

fn cone(half_angle: f64, falloff: f64, profile: Profile) -> Cone {
    Cone { half_angle: half_angle.to_radians(), falloff: falloff.to_radians(), profile }
}

/// A white disk below a spot at height 2 whose axis leaves the vertical by each of some angles: L = I s(θ) / (π d²), s written out
/// by hand.
#[test]
fn spots_fall_off_as_their_profiles_say() {
    let (a, b) = (10f64.to_radians(), 30f64.to_radians());
    let smooth = |degrees: f64| {
        let t = (degrees.to_radians().cos() - b.cos()) / (a.cos() - b.cos());
        t * t * (3.0 - 2.0 * t)
    };
    let cases = [
        // Half way in angle is not half way in cosine.
        (cone(30.0, 10.0, Profile::Linear), 20.0, 0.5),
        (cone(30.0, 10.0, Profile::Linear), 15.0, 0.75),
        (cone(30.0, 10.0, Profile::Smooth), 20.0, smooth(20.0)),
        (cone(30.0, 10.0, Profile::Smooth), 27.0, smooth(27.0)),
        (cone(30.0, 10.0, Profile::Smooth), 0.0, 1.0),
        (cone(30.0, 10.0, Profile::Linear), 9.99, 1.0),
        (cone(30.0, 10.0, Profile::Smooth), 30.01, 0.0),
        (cone(30.0, 10.0, Profile::Linear), 30.01, 0.0),
        // A sharp edge, and one behind the point.
        (cone(30.0, 30.0, Profile::Smooth), 29.99, 1.0),
        (cone(30.0, 30.0, Profile::Linear), 30.01, 0.0),
        (cone(180.0, 0.0, Profile::Linear), 135.0, 0.25),
        (cone(180.0, 90.0, Profile::Smooth), 120.0, 0.5),
        // So narrow that cosines in f32 tell nothing of it.
        (cone(0.02, 0.01, Profile::Linear), 0.015, 0.5),
    ];
    for (number, (cone, off, share)) in cases.into_iter().enumerate() {
        let angle = f64::to_radians(off);
        let scene = Builder::new()
            .camera(look(DVec3::new(0.0, 0.5, 1.0), DVec3::ZERO, DVec3::Y, narrow()))
            .diffuse(disk(DVec3::ZERO, DVec3::Z, 1.0), 1.0)
            .spot(2.0 * DVec3::Z, DVec3::new(angle.sin(), 0.0, -angle.cos()), 7.0, cone)
            .build();
        let expected = 7.0 * share / (4.0 * PI);
        let reference = truth::render_image(&scene, 16, 1).mean[0];
        // The cosine between two unit vectors says the angle to 2e-8.
        let steep = 4e-8 / (cone.half_angle - cone.falloff).max(1e-4);
        assert!(
            (reference - expected).abs() <= (1e-7 + steep) * 7.0 / (4.0 * PI),
            "case {number}, reference: {reference}"
        );
        let epochs = device::render(&scene, 1, 16, Settings::default());
        epochs.assert_clean();
        let device = f64::from(epochs.means[0][0]);
        // Origins lie 2^-16 of the scene's half size, 1, above the surface, and f32 directions differ by 1e-7.
        let wrong = 4.0 * ORIGIN_OFFSET + 4e-7 / (cone.half_angle - cone.falloff).max(1e-4);
        assert!(
            (device - expected).abs() <= wrong * 7.0 / (4.0 * PI),
            "case {number}, device: {device}, not {expected}"
        );
        assert!(share > 0.0 || device == 0.0, "case {number}: light beyond the edge");
    }
}

/// All of what a spot sends out ends in a black box around it, whichever way it is chosen among others: a floor and a ball below two
/// spots and a point, in every channel and pixel.
#[test]
fn spots_are_those_of_the_reference() {
    let slope = |a: f64, b: f64| Curve::Linear { nm: vec![400.0, 700.0], value: vec![a, b], outside: Outside::Hold };
    let scene = Builder::new()
        .camera(look(
            DVec3::new(0.0, 1.6, 3.2),
            DVec3::new(0.0, 0.3, 0.0),
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::new(0.5, 0.4) },
        ))
        .film(3, 3, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 3))
        .bounces(2)
        .roulette(2)
        .diffuse(quad(DVec3::new(-2.0, 0.0, 2.0), 4.0 * DVec3::X, -4.0 * DVec3::Z), slope(0.2, 0.8))
        .diffuse(sphere(DVec3::new(0.3, 0.5, 0.0), 0.5), 0.7)
        .spot(
            DVec3::new(-1.0, 2.0, 1.0),
            DVec3::new(0.8, -2.0, -0.7),
            slope(4.0, 1.0),
            cone(35.0, 10.0, Profile::Smooth),
        )
        .spot(DVec3::new(1.0, 2.5, 0.5), DVec3::new(-0.5, -1.0, 0.0), slope(1.0, 5.0), cone(25.0, 0.0, Profile::Linear))
        .point(DVec3::new(0.0, 1.5, 1.5), 0.3)
        .build();
    device::assert_as_reference("spots", &scene, [16, 256], 6000, Bound { resolution: 0.1, allowance: 1e-3 });
}
