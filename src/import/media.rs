//! What fills shapes: the same matter all over.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::picture::sampled;
use super::report::Place;
use super::scene::{Scene, Section};
use super::text;
use crate::Result;
use crate::format::{edges, mesh};
use crate::spectral::Curve;

/// Coefficients per unit of length, and where scattered light goes.
pub struct Matter {
    pub absorption: Curve,
    pub scattering: Curve,
    /// Each with its share of what is scattered, all of which are 1 together.
    pub phases: Vec<(f64, Phase)>,
}

pub enum Phase {
    /// Henyey and Greenstein's, by the mean cosine; 0 is the same in all directions.
    HenyeyGreenstein(f64),
    Rayleigh,
}

/// `f` of both at every wavelength.
pub fn both(a: &Curve, b: &Curve, f: impl Fn(f64, f64) -> f64) -> Curve {
    match (a, b) {
        (Curve::Constant(a), Curve::Constant(b)) => Curve::Constant(f(*a, *b)),
        _ => sampled(&|nm| f(a.eval(nm), b.eval(nm))),
    }
}

/// At every 5 nm of the visible.
pub fn is_within(curve: &Curve, range: RangeInclusive<f64>) -> bool {
    (72..=166).all(|i| range.contains(&curve.eval(5.0 * f64::from(i))))
}

/// Adds a medium of the name nearest to `wanted`; gives that.
pub fn put(scene: &mut Scene, wanted: &str, matter: &Matter) -> Result<String> {
    let name = scene.material_name(wanted);
    let is_none = |curve: &Curve| match curve {
        Curve::Constant(value) => *value == 0.0,
        Curve::Linear { value, .. } => value.iter().all(|value| *value == 0.0),
        Curve::Blackbody { .. } => false,
    };
    let phases = if is_none(&matter.scattering) { &[] } else { &matter.phases[..] };
    // Matter that scatters in several ways is as many kinds of it; what it absorbs is the first one's.
    let header = match phases {
        [] | [_] => format!("[media.{}]", text::key(&name)),
        _ => format!("[[media.{}.components]]", text::key(&name)),
    };
    let mut section = Section::new(&header);
    if !is_none(&matter.absorption) || phases.is_empty() {
        section.set("absorption", scene.spectrum(&matter.absorption, &format!("{name}-absorption"))?);
    }
    for (i, (share, phase)) in phases.iter().enumerate() {
        let scattering = match share {
            1.0 => matter.scattering.clone(),
            share => both(&matter.scattering, &Curve::Constant(*share), |all, share| share * all),
        };
        section.set("scattering", scene.spectrum(&scattering, &format!("{name}-scattering"))?);
        match phase {
            Phase::HenyeyGreenstein(0.0) => {}
            Phase::HenyeyGreenstein(g) => section.set("phase", format!("{{ hg = {} }}", text::rounded(*g))),
            Phase::Rayleigh => section.set("phase", "{ rayleigh = 0.0 }"),
        }
        if i + 1 < phases.len() {
            scene.media.push(std::mem::replace(&mut section, Section::new(&header)));
        }
    }
    scene.media.push(section);
    Ok(name)
}

/// What a shape's surface has to do with what is in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    /// No surface at all.
    Invisible,
    /// Glass.
    Clear,
    /// Nothing of the inside is seen.
    Opaque,
}

impl Boundary {
    /// That of a shape with this material of the scene, or with none.
    pub fn of(scene: &Scene, material: Option<&str>) -> Boundary {
        let Some(name) = material else { return Boundary::Invisible };
        let header = format!("[materials.{}.dielectric]", text::key(name));
        let is_glass = scene.materials.iter().any(|section| section.header == header);
        if is_glass { Boundary::Clear } else { Boundary::Opaque }
    }
}

/// Gives `object` its `interior`, where what is in it can be seen and it has an inside; else says that it is left out. Whether it has one now.
pub fn fill(scene: &mut Scene, object: &mut Section, medium: &str, boundary: Boundary, place: Place) -> bool {
    let why = match boundary {
        Boundary::Opaque => Some("nothing passes its surface"),
        Boundary::Invisible | Boundary::Clear if !is_closed(scene, object) => Some("its shape has no inside"),
        Boundary::Invisible | Boundary::Clear => None,
    };
    if let Some(why) = why {
        scene.report.left_out(place, format!("the medium \"{}\" in a shape: {why}", medium.escape_debug()));
        return false;
    }
    object.set("interior", text::quoted(medium));
    true
}

/// Whether a shape has an inside, as scenes ask for it.
fn is_closed(scene: &Scene, object: &Section) -> bool {
    let of = |key: &str| object.entries.iter().find(|(name, _)| name == key).map(|(_, value)| value);
    if of("sphere").or(of("cube")).is_some() {
        return true;
    }
    let Some(written) = of("mesh") else { return false };
    let path = scene.path_of(written.trim_matches('"'));
    let read = mesh::content(&path).and_then(|bytes| mesh::parse(mesh::Format::of(&path, &bytes), &bytes, &path));
    let Ok(read) = read else { return false };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in &read.parts {
        let first = positions.len() as u32;
        positions.extend(part.positions.iter().copied().map(DVec3::from_array));
        triangles.extend(part.triangles.iter().map(|triangle| triangle.map(|corner| first + corner)));
    }
    edges::open(&positions, &triangles).is_empty()
}
