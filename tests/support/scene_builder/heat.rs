//! Heat and gases for scenes built in tests, and cases whose answers are known (docs/METHOD.md, Closed forms).

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use spectile::scene::{
    Absorber, Camera, Component, Field, Filter, Grid, Interior, Line, Medium, Mesh, Object, Phase, Projection,
    Scattering, Scene, Shape, Sides, Temperature,
};
use spectile::spectral::{Channels, Curve, Outside, planck as law};

use super::closed_forms::Case;
use super::{Builder, IntoCurve, disk, look, narrow, sphere};

impl Builder {
    /// The last material has a temperature.
    pub fn at_kelvin(mut self, kelvin: f64) -> Self {
        self.0.materials.last_mut().expect("a material").temperature = Some(Temperature::Constant(kelvin));
        self
    }

    /// The last material has the temperatures of a texture.
    pub fn heated_by(mut self, texture: usize) -> Self {
        self.0.materials.last_mut().expect("a material").temperature = Some(Temperature::Texture(texture));
        self
    }

    /// Another medium, m⁻¹ at density 1; fills nothing yet.
    pub fn medium(mut self, absorption: impl IntoCurve, temperature: Option<Field>, density: Field) -> Self {
        let spectrum = self.spectrum(absorption);
        let absorbers = vec![Absorber { strength: 1.0, columns: vec![(0.0, spectrum)] }];
        let name = format!("medium {}", self.0.media.len());
        let components = vec![Component { absorbers, scattering: None, density }];
        self.0.media.push(Medium { name, components, temperature });
        self
    }

    /// The last kind of matter of the last medium scatters, m⁻¹ at density 1.
    pub fn scattering(mut self, coefficient: impl IntoCurve, phase: Phase) -> Self {
        let coefficient = self.spectrum(coefficient);
        let medium = self.0.media.last_mut().expect("a medium");
        let component = medium.components.last_mut().expect("a kind of matter");
        component.scattering = Some(Scattering { coefficient, phase });
        self
    }

    /// Henyey and Greenstein's phase function for [`Builder::scattering`].
    pub fn henyey_greenstein(&mut self, g: impl IntoCurve) -> Phase {
        Phase::HenyeyGreenstein(self.spectrum(g))
    }

    /// Another kind of matter in the last medium.
    pub fn beside(mut self, absorption: impl IntoCurve, density: Field) -> Self {
        let spectrum = self.spectrum(absorption);
        let absorbers = vec![Absorber { strength: 1.0, columns: vec![(0.0, spectrum)] }];
        let medium = self.0.media.last_mut().expect("a medium");
        medium.components.push(Component { absorbers, scattering: None, density });
        self
    }

    /// Another medium of one number, without a temperature.
    pub fn gas(self, absorption: impl IntoCurve) -> Self {
        self.medium(absorption, None, Field::Constant(1.0))
    }

    /// The last object is filled with the last medium; grids fill the unit cube from `low` to `high`.
    pub fn filled_from(mut self, low: DVec3, high: DVec3) -> Self {
        let to_grid = DAffine3::from_scale((high - low).recip()) * DAffine3::from_translation(-low);
        let interior = Interior { body: self.0.objects.len(), medium: self.0.media.len() - 1, to_grid };
        self.0.objects.last_mut().expect("an object").interior = Some(interior);
        self
    }

    pub fn filled(self) -> Self {
        self.filled_from(DVec3::ZERO, DVec3::ONE)
    }

    /// A null boundary around the last medium.
    pub fn null(mut self, shape: Shape) -> Self {
        let name = format!("objects.{}", self.0.objects.len());
        self.0.objects.push(Object {
            name,
            shape,
            material: None,
            emission: None,
            interior: None,
            assembly: None,
            attributes: Default::default(),
        });
        self.filled()
    }

    /// A null boundary from `low` to `high`, the box of the last medium's grids.
    pub fn null_box(self, low: DVec3, high: DVec3) -> Self {
        self.null(cuboid(low, high)).filled_from(low, high)
    }

    /// The last medium fills space outside all interiors.
    pub fn outer(mut self) -> Self {
        self.0.camera_medium = Some(self.0.media.len() - 1);
        self
    }
}

pub fn grid(size: [u32; 3], value: impl Fn([u32; 3]) -> f64) -> Field {
    let [nx, ny, nz] = size;
    let voxels = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    Field::Grid(Arc::new(Grid { size, values: Arc::new(voxels.map(|voxel| value(voxel) as f32).collect()) }))
}

/// A box with outward faces.
pub fn cuboid(low: DVec3, high: DVec3) -> Shape {
    let Shape::Mesh(inward) = super::room(low, high) else { unreachable!("a room is a mesh") };
    let triangles = inward.triangles.iter().map(|&[a, b, c]| [b, a, c]).collect();
    Shape::Mesh(Mesh { positions: inward.positions, triangles })
}

pub fn planck(kelvin: f64) -> Curve {
    Curve::Blackbody { kelvin, scale: 1.0 }
}

/// Mid and long wave infrared, one channel so narrow that it is one wavelength, 10 um.
pub fn infrared() -> Channels {
    Channels::from_bounds(vec![[3e3, 5e3], [8e3, 12e3], [9_999.9, 10_000.1], [14e3, 20e3]], None)
}

pub fn means(curve: &Curve, channels: &Channels) -> Vec<f64> {
    channels.bounds.iter().map(|b| curve.mean(b[0], b[1])).collect()
}

/// Two disks one metre apart that stand for infinite plates of diffuse materials at temperatures. Each
/// case shows one of them.
pub fn hot_plates(radius: f64, bounces: u32) -> Vec<Case> {
    let mut cases = Vec::new();
    for (e, kelvin, published, seed) in [
        ([0.9, 0.8], [400.0, 300.0], [0.03163354, 0.01426593], 310),
        ([0.5, 0.5], [400.0, 300.0], [0.02568353, 0.01780378], 311),
        ([0.1, 0.9], [900.0, 300.0], [0.04199965, 0.01313159], 312),
    ] {
        for (this, published) in published.into_iter().enumerate() {
            let other = 1 - this;
            let both = [0, 1].map(|i| means(&Curve::Blackbody { kelvin: kelvin[i], scale: e[i] }, &infrared()));
            let shown =
                |k: usize| (both[this][k] + (1.0 - e[this]) * both[other][k]) / (1.0 - (1.0 - e[0]) * (1.0 - e[1]));
            let expected: Vec<f64> = (0..4).map(shown).collect();
            assert!((expected[2] - published).abs() < 1e-8, "the published digits at 10 um");
            let scene = Builder::new()
                .camera(look(DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.1, 0.0, this as f64), DVec3::Y, narrow()))
                .channels(infrared())
                .bounces(bounces)
                .diffuse(disk(DVec3::ZERO, DVec3::Z, radius), 1.0 - e[0])
                .at_kelvin(kelvin[0])
                .diffuse(disk(DVec3::Z, DVec3::NEG_Z, radius), 1.0 - e[1])
                .at_kelvin(kelvin[1])
                .build();
            cases.push(Case { scene, expected, seed });
        }
    }
    cases
}

/// A Lorentz line, depth 2 x at its middle at 1 m, as a table of lines between close nodes, in one channel of 200 half
/// widths; and the mean transmittance 1 - W/D there: W the equivalent width less the wings beyond, ∫ τ / (2 x) = 2 a²/(D/2).
pub fn lorentz_line(x: f64, published: f64) -> (Curve, Channels, f64) {
    let (middle, half_width, half) = (10_000.0, 0.5, 50.0);
    let mut offsets: Vec<f64> = (0..=2000).map(|i| half * (f64::from(i) / 2000.0).powi(3)).collect();
    offsets.extend(offsets[1..].to_vec().iter().map(|d| -d));
    offsets.sort_by(f64::total_cmp);
    let value = offsets.iter().map(|d| 2.0 * x / (1.0 + (d / half_width).powi(2))).collect();
    let nm = offsets.iter().map(|d| middle + d).collect();
    let wings = 2.0 * x * 2.0 * half_width * half_width / half;
    let expected = 1.0 - (published * half_width - wings) / (2.0 * half);
    let channels = Channels::from_bounds(vec![[middle - half, middle + half]], None);
    (Curve::Linear { nm, value, outside: Outside::Zero }, channels, expected)
}

/// Straight down from a height, beside the axis.
pub fn down(height: f64) -> Camera {
    look(DVec3::new(0.1, 0.2, height), DVec3::new(0.1, 0.2, -9.0), DVec3::Y, narrow())
}

/// A box of gas before a lamp or a wall; the way through it is a metre.
pub fn slab(depth: f64, kelvin: Option<f64>, wall: impl FnOnce(Builder) -> Builder) -> Builder {
    wall(Builder::new().camera(down(3.0)))
        .medium(depth, kelvin.map(Field::Constant), Field::Constant(1.0))
        .null_box(DVec3::new(-1.0, -1.0, 0.5), DVec3::new(1.0, 1.0, 1.5))
}

/// Optical depths from the thinnest to the thickest.
pub const DEPTHS: [f64; 10] = [1e-9, 1e-6, 1e-3, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0, 1e6];

/// The temperature for which Planck's radiance at 10 um is `radiance`: 1/x = log(1 + c₁/(λ⁵ L)).
pub fn kelvin_of(radiance: f64) -> f64 {
    law::C2 / (1e-5 * (law::C1L / 1e-25 * 1e-9 / radiance).ln_1p())
}

/// A window of four pixels before a lamp of radiance 1, cut by two boxes of gas, one within the other, in a third gas: where each
/// camera ray starts decides what it goes through. Which box is met first in the list of objects should not.
pub fn window_in_gases(inner_first: bool) -> (Scene, Vec<f64>) {
    let window = Projection::Orthographic { half_size: DVec2::new(1.0, 0.25) };
    let b = Builder::new().camera(look(3.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, window)).film(4, 1, Filter::Box).lamp(
        disk(DVec3::ZERO, DVec3::Z, 4.0),
        1.0,
        Sides::Front,
    );
    let outer = |b: Builder| b.gas(0.4).null_box(DVec3::new(-3.0, -2.0, 0.5), DVec3::new(0.0, 2.0, 4.0));
    let inner = |b: Builder| b.gas(0.9).null_box(DVec3::new(-2.0, -1.0, 1.0), DVec3::new(-0.5, 1.0, 3.5));
    let b = if inner_first { outer(inner(b)) } else { inner(outer(b)) };
    let depths: [f64; 4] = [0.9 * 2.0 + 0.4 * 0.5 + 0.1 * 0.5, 0.4 * 2.5 + 0.1 * 0.5, 0.1 * 3.0, 0.1 * 3.0];
    (b.gas(0.1).outer().build(), depths.map(|depth| (-depth).exp()).to_vec())
}

/// A line scanner that dives through two boxes of gas, 0.3 and 0.7 per metre around z = 5, towards a lamp of radiance 1 at z = 0, and looks down: the mean
/// of what each line's exposure sees. It begins where the gases are entered and ends below them.
pub fn scanner_in_gases(inner_first: bool) -> Case {
    let line = |height: f64| Line {
        position: DVec3::new(0.1, 0.2, height),
        forward: DVec3::NEG_Z,
        right: DVec3::X,
        nose: DVec3::Y,
    };
    let heights = [9.0, 7.5, 6.2, 5.3, 4.4, 3.3, 2.0];
    let lines: Arc<[Line]> = heights.into_iter().map(line).collect();
    let projection = Projection::Pushbroom { half_width: 1e-6, half_pixel: 1e-6, lines: lines.clone() };
    let b = Builder::new()
        .camera(look(lines[0].position, DVec3::new(0.1, 0.2, 0.0), DVec3::Y, projection))
        .film(16, heights.len() as u32, Filter::Box)
        .lamp(disk(DVec3::ZERO, DVec3::Z, 4.0), 1.0, Sides::Front);
    let outer = |b: Builder| b.gas(0.3).null_box(DVec3::new(-2.0, -2.0, 3.0), DVec3::new(2.0, 2.0, 7.0));
    let inner = |b: Builder| b.gas(0.7).null_box(DVec3::new(-1.0, -1.0, 4.0), DVec3::new(1.0, 1.0, 6.0));
    let b = if inner_first { outer(inner(b)) } else { inner(outer(b)) };
    // The midpoint rule over the exposure.
    const STEPS: u32 = 100_000;
    let seen = |y: f64| {
        let z = Line::at(&lines, y).position.z;
        let within = |low: f64, high: f64| z.clamp(low, high) - low;
        (-0.1 * z - 0.2 * within(3.0, 7.0) - 0.4 * within(4.0, 6.0)).exp()
    };
    let mean = |row: usize| {
        let moment = |i: u32| row as f64 + (f64::from(i) + 0.5) / f64::from(STEPS);
        (0..STEPS).map(|i| seen(moment(i))).sum::<f64>() / f64::from(STEPS)
    };
    Case { scene: b.gas(0.1).outer().build(), expected: (0..heights.len()).map(mean).collect(), seed: 361 }
}

/// A lens of radius 0.8 at z = 3, half of it in gas, and sharp in one point of a lamp of radiance 1 at z = 0: the mean over the lens of
/// what the straight ways to that point lose.
pub fn lens_in_gas() -> Case {
    let (gas, radius, at) = (1.5, 0.8, 0.25);
    let lens = Projection::ThinLens { tan_half: DVec2::splat(1e-6), aperture_radius: radius, focus_distance: 3.0 };
    // Straight down, and the point beside the axis: the axis itself goes along the boundary.
    let camera = look(DVec3::new(at, 0.0, 3.0), DVec3::new(at, 0.0, 0.0), DVec3::Y, lens);
    let scene = Builder::new()
        .camera(camera)
        .lamp(disk(DVec3::ZERO, DVec3::Z, 4.0), 1.0, Sides::Front)
        .gas(gas)
        .null_box(DVec3::new(-3.0, -3.0, 0.5), DVec3::new(0.0, 3.0, 4.0))
        .build();
    // The midpoint rule over squared radius and angle.
    const STEPS: u32 = 1_000;
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
    let through = |i: u32, j: u32| {
        let (r, angle) = (radius * middle(i).sqrt(), std::f64::consts::TAU * middle(j));
        let [x, y] = [r * angle.cos(), r * angle.sin()];
        // The way from (at + x, y, 3) to (at, 0, 0) leaves the gas through x = 0 or z = 0.5.
        let share = if at + x < 0.0 { (1.0 + at / x).min(5.0 / 6.0) } else { 0.0 };
        (-gas * share * (x * x + y * y + 9.0).sqrt()).exp()
    };
    let sum: f64 = (0..STEPS * STEPS).map(|n| through(n / STEPS, n % STEPS)).sum();
    Case { scene, expected: vec![sum / f64::from(STEPS * STEPS)], seed: 360 }
}

/// A wide lens among bodies: partly in a ball of gas, partly in glass that absorbs and holds a hot gas.
pub fn lens_in_glass() -> Scene {
    let lens = Projection::ThinLens { tan_half: DVec2::splat(0.3), aperture_radius: 0.7, focus_distance: 3.0 };
    Builder::new()
        .camera(look(DVec3::new(0.0, 0.1, 3.0), DVec3::ZERO, DVec3::Y, lens))
        .film(3, 3, Filter::Gaussian)
        .channels(Channels::from_bounds(vec![[3e3, 5e3], [8e3, 12e3]], None))
        .bounces(4)
        .lamp(disk(DVec3::ZERO, DVec3::Z, 3.0), planck(400.0), Sides::Front)
        .gas(0.8)
        .null(sphere(DVec3::new(-0.6, 0.3, 2.8), 0.6))
        .dielectric(cuboid(DVec3::new(0.1, -1.0, 2.2), DVec3::new(1.2, 1.0, 3.3)), 1.5, 0.0)
        .gas(0.5)
        .filled()
        .medium(1.0, Some(Field::Constant(500.0)), Field::Constant(1.0))
        .null(sphere(DVec3::new(0.6, -0.2, 2.9), 0.3))
        .build()
}
