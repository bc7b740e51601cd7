//! Sources of light that cannot be seen: those that shine in no channel, and those that shine at nothing. Nothing is wrong about
//! them, but a picture that stays black is hardly ever meant.

use glam::DVec3;

use super::{
    Bsdf, Environment, Light, Material, Mesh, Object, Projection, Scene, Shape, Sides, Temperature, Texels, TextureId,
};
use crate::spectral::{self, Curve, Outside};

/// A source, and whether it sends anything at all in a channel.
struct Source {
    name: String,
    shines: Vec<bool>,
}

/// What to say of the sources of `scene`.
pub fn warnings(scene: &Scene) -> Vec<String> {
    let mut warnings = Vec::new();
    let sources = sources(scene);
    for source in sources.iter().filter(|source| !source.shines.contains(&true)) {
        warnings.push(format!("{} shines in none of the channels, {}", source.name, hull(scene, |_| true)));
    }
    let lit = |k: usize| sources.iter().any(|source| source.shines[k]);
    let dark = (0..scene.channels.len()).filter(|k| !lit(*k)).count();
    if !sources.is_empty() && dark > 0 && dark < scene.channels.len() {
        warnings.push(format!("no source shines in {dark} channels, between {}", hull(scene, |k| !lit(k))));
    }
    warnings.extend(scene.objects.iter().enumerate().filter_map(|(i, object)| turned_away(scene, i, object)));
    warnings
}

/// The wavelengths from the first to the last of some channels, in words.
fn hull(scene: &Scene, of: impl Fn(usize) -> bool) -> String {
    let bounds = scene.channels.bounds.iter().enumerate().filter(|(k, _)| of(*k)).map(|(_, bounds)| *bounds);
    let [first, last] = spectral::hull(bounds).unwrap_or_default();
    format!("{first} and {last} nm")
}

fn sources(scene: &Scene) -> Vec<Source> {
    let channels = &scene.channels.bounds;
    let by = |shines: &dyn Fn([f64; 2]) -> bool| channels.iter().map(|bounds| shines(*bounds)).collect::<Vec<bool>>();
    // What is less than a device can count is nothing.
    let of_curve = |curve: &Curve| by(&|[a, b]| curve.mean(a, b) >= f64::from(f32::MIN_POSITIVE));
    let of_spectrum = |id: usize| of_curve(&scene.spectra[id].curve);
    let mut sources = Vec::new();
    // Objects of one lamp say the same.
    let mut emissions: Vec<usize> = Vec::new();
    for object in &scene.objects {
        if let Some(emission) = &object.emission
            && !emissions.contains(&emission.radiance)
        {
            emissions.push(emission.radiance);
            let spectrum = &scene.spectra[emission.radiance].name;
            let name = format!("the emission `{spectrum}` of {}", object.name);
            sources.push(Source { name, shines: of_spectrum(emission.radiance) });
        }
    }
    for light in &scene.lights {
        let kind = match light {
            Light::Point { .. } => "point light",
            Light::Spot { .. } => "spot light",
            Light::Directional { .. } => "directional light",
            Light::Sun { .. } => "sun",
        };
        let name = format!("the spectrum `{}` of a {kind}", scene.spectra[light.spectrum()].name);
        sources.push(Source { name, shines: of_spectrum(light.spectrum()) });
    }
    match &scene.environment {
        None => {}
        Some(Environment::Uniform(id)) => {
            let name = format!("the environment, `{}`,", scene.spectra[*id].name);
            sources.push(Source { name, shines: of_spectrum(*id) });
        }
        Some(Environment::Map(map)) => {
            let lit = |values: &[f32]| map.scale > 0.0 && values.iter().any(|v| *v > 0.0);
            let shines = match &map.texels {
                Texels::Rgb { rgb, daylight } if lit(rgb) => of_spectrum(*daylight),
                Texels::Spectral { nm, radiance } if lit(radiance) => of_curve(&brightest(nm, radiance)),
                _ => vec![false; channels.len()],
            };
            sources.push(Source { name: format!("the environment map {}", map.name), shines });
        }
    }
    let glow = |kelvin: f64| of_curve(&Curve::Blackbody { kelvin, scale: 1.0 });
    for material in &scene.materials {
        if let Some(kelvin) = hottest(scene, material) {
            sources.push(Source { name: format!("the heat of material \"{}\"", material.name), shines: glow(kelvin) });
        }
    }
    for medium in &scene.media {
        let Some(field) = &medium.temperature else { continue };
        let kelvin = match field {
            super::Field::Constant(kelvin) => *kelvin,
            super::Field::Grid(grid) => grid.values.iter().copied().fold(0.0, f32::max).into(),
        };
        let absorbs = |[a, b]: [f64; 2]| medium.absorption().any(|id| scene.spectra[id].curve.mean(a, b) > 0.0);
        let shines = glow(kelvin).into_iter().zip(channels).map(|(glows, bounds)| glows && absorbs(*bounds)).collect();
        sources.push(Source { name: format!("the heat of medium \"{}\"", medium.name), shines });
    }
    sources
}

/// The largest values of a map over wavelength.
fn brightest(nm: &[f64], radiance: &[f32]) -> Curve {
    let mut value = vec![0f64; nm.len()];
    for texel in radiance.chunks_exact(nm.len()) {
        value.iter_mut().zip(texel).for_each(|(most, v)| *most = most.max(f64::from(*v)));
    }
    Curve::Linear { nm: nm.to_vec(), value, outside: Outside::Zero }
}

/// The highest temperature that a material has anywhere.
fn hottest(scene: &Scene, material: &Material) -> Option<f64> {
    if matches!(material.bsdf, Bsdf::Dielectric { .. }) {
        return None;
    }
    let of_texture = |id: TextureId| scene.textures[id].texels.iter().copied().fold(0.0, f32::max).into();
    Some(match material.temperature? {
        Temperature::Constant(kelvin) => kelvin,
        Temperature::Texture(id) => of_texture(id),
    })
}

/// Triangles of a lamp that are looked at: enough to know, few enough to cost nothing.
const LOOKED_AT: usize = 256;

/// A lamp that shines from its front only, before which there is neither the camera nor anything else.
fn turned_away(scene: &Scene, index: usize, object: &Object) -> Option<String> {
    let emission = object.emission.as_ref().filter(|emission| emission.sides == Sides::Front)?;
    if object.assembly.is_some() {
        return None;
    }
    if !scene.spectra[emission.radiance].curve.max(1e-3, 1e15).gt(&0.0) {
        return None;
    }
    let before = before(object)?;
    let eye = eyes(scene);
    let inside = |[low, high]: [DVec3; 2]| {
        let holds = |point: DVec3| point.cmpge(low).all() && point.cmple(high).all();
        let others = scene.objects.iter().enumerate().filter(|(other, _)| *other != index);
        eye.iter().any(|point| holds(*point))
            || others.flat_map(|(_, object)| scene.boxes(object)).any(|[a, b]| holds(0.5 * (a + b)))
    };
    if let Shape::Mesh(mesh) = &object.shape
        && volume(mesh) < 0.0
        && super::closed::opening(&object.shape).is_none()
        && !inside(object.shape.bounds())
    {
        return Some(format!(
            "{} is closed and its faces are turned inward, so that it shines into its own inside only: turn them round, or set \
             `emission_sides = \"both\"`",
            object.name
        ));
    }
    let itself = match &object.shape {
        Shape::Mesh(mesh) => mesh.positions.iter().take(4 * LOOKED_AT).any(|point| before(*point)),
        _ => false,
    };
    let seen = itself
        || eye.iter().any(|point| before(*point))
        || scene
            .objects
            .iter()
            .enumerate()
            .any(|(other, object)| other != index && scene.boxes(object).flat_map(corners).any(&before));
    let front = match &object.shape {
        Shape::Sphere { .. } | Shape::Cylinder { .. } => "outward only",
        _ => "from its front only, where the corners of its faces run counter-clockwise",
    };
    let turn = if front == "outward only" { "" } else { "turn it round, or " };
    (!seen).then(|| {
        format!(
            "{} shines {front}, and neither the camera nor any other object lies before it: {turn}set `emission_sides = \"both\"`",
            object.name
        )
    })
}

/// Tells which points lie before a front of an object.
fn before(object: &Object) -> Option<impl Fn(DVec3) -> bool> {
    let [low, high] = object.shape.bounds();
    // What touches the plane of a lamp is not before it.
    let margin = 1e-6 * (high - low).max_element().max(low.abs().max(high.abs()).max_element());
    let round = match object.shape {
        Shape::Sphere { center, radius } => Some((center, DVec3::ZERO, radius)),
        Shape::Cylinder { from, to, radius } => Some((from, (to - from).normalize_or_zero(), radius)),
        _ => None,
    };
    let planes = match round {
        Some(_) => Vec::new(),
        None => fronts(&object.shape)?,
    };
    Some(move |point: DVec3| match round {
        Some((at, axis, radius)) => {
            let from_it = point - at;
            (from_it - from_it.dot(axis) * axis).length() > radius + margin
        }
        None => planes.iter().any(|(at, normal)| (point - *at).dot(*normal) > margin),
    })
}

/// Of a closed mesh, above 0 where its faces are turned outward.
fn volume(mesh: &Mesh) -> f64 {
    let Some(from) = mesh.positions.first() else { return 0.0 };
    let of = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize] - *from);
        a.dot(b.cross(c))
    };
    mesh.triangles.iter().map(of).sum::<f64>() / 6.0
}

/// A point and the normal of pieces of a surface; `None` where some front is always seen from somewhere outside.
fn fronts(shape: &Shape) -> Option<Vec<(DVec3, DVec3)>> {
    match shape {
        Shape::Disk { center, normal, .. } => Some(vec![(*center, *normal)]),
        Shape::Sphere { .. } | Shape::Cylinder { .. } => None,
        Shape::Mesh(Mesh { positions, triangles }) => {
            let step = triangles.len().div_ceil(LOOKED_AT).max(1);
            let plane = |triangle: &[u32; 3]| {
                let [a, b, c] = triangle.map(|i| positions[i as usize]);
                Some((a, (b - a).cross(c - a).try_normalize()?))
            };
            Some(triangles.iter().step_by(step).filter_map(plane).collect())
        }
    }
}

/// Where rays of the camera begin.
fn eyes(scene: &Scene) -> Vec<DVec3> {
    let camera = &scene.camera;
    match camera.projection {
        Projection::Pushbroom { ref lines, .. } => lines.iter().map(|line| line.position).collect(),
        Projection::Perspective { .. } | Projection::ThinLens { .. } | Projection::Latlong => vec![camera.position],
        Projection::Orthographic { half_size } => [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
            .map(|(x, y)| camera.position + camera.right * (x * half_size.x) + camera.up * (y * half_size.y))
            .to_vec(),
    }
}

fn corners([low, high]: [DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
        DVec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
    })
}
