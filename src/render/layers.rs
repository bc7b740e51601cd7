//! Layers: what the first surface behind the centre of each pixel is. A device says which primitive a ray meets; all else is worked out
//! here, in f64. Nothing is random, so that a tile's layers are the same whenever they are made.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::cube::{Grid, Layer, LayerNames, Rect, TileLayers};
use crate::device::accel::Accel;
use crate::device::words::{KIND_CYLINDER, KIND_DISK, KIND_SPHERE};
use crate::render::worker::{Met, Question};
use crate::scene::{Camera, Film, Light, Scene};
use crate::{Error, Result};

/// Surfaces that let rays pass, along one: more are a fault of the geometry.
const MOST_PASSED: usize = 10_000;
/// How far a ray starts off a surface, of the largest coordinate (but at least [`LEAST_COORDINATE`]): 256 ulp of f32, as those of paths.
const OFF: f64 = 1.0 / 65_536.0;
const LEAST_COORDINATE: f64 = 1.0 / 32.0;
/// Between a ray and the normal of what it passes, as far as how far it starts off that is a matter of it.
const LEAST_COSINE: f64 = 1e-3;

/// What is asked of a scene's first surfaces.
pub struct Layers {
    layers: Vec<Layer>,
    camera: Camera,
    film: Film,
    /// The number of each object of the scene, and of its material.
    numbers: Vec<[i32; 2]>,
    /// Towards the sun, where that is asked for.
    sun: Option<DVec3>,
}

/// What is seen along a ray, in device units.
struct Seen {
    primitive: u32,
    distance: f64,
    position: DVec3,
    /// Unit, towards where the ray came from.
    normal: DVec3,
}

/// A ray under way, in device units.
struct Ray {
    origin: DVec3,
    direction: DVec3,
    /// How far it has come already.
    passed: f64,
}

/// What rays meet first, as a device says it.
type Meet<'a> = dyn FnMut(&[Question]) -> Result<Vec<Met>> + 'a;

/// Which layers a cube of `scene` has, and what their numbers stand for. Errors: a `sun` of a scene without one, or with several.
pub fn names(scene: &Scene, layers: &[Layer]) -> Result<LayerNames> {
    if layers.contains(&Layer::Sun) {
        sun(scene)?;
    }
    let materials = scene.materials.iter().map(|material| material.name.clone()).collect();
    Ok(LayerNames::new(layers, labels(scene).0, materials))
}

/// Names of the objects of the file, and of each object of the scene, of which a mesh may make several, its place among them.
fn labels(scene: &Scene) -> (Vec<String>, Vec<i32>) {
    let mut names: Vec<String> = Vec::new();
    let mut known = HashMap::new();
    let numbers = scene.objects.iter().map(|object| {
        let label = object.name.split(" (").next().unwrap_or_default();
        *known.entry(label).or_insert_with(|| {
            names.push(label.to_owned());
            names.len() as i32 - 1
        })
    });
    let numbers = numbers.collect();
    (names, numbers)
}

/// The direction to the only light that is infinitely far away.
fn sun(scene: &Scene) -> Result<DVec3> {
    let far = scene.lights.iter().filter_map(|light| match light {
        Light::Sun { direction, .. } | Light::Directional { direction, .. } => Some(-*direction),
        Light::Point { .. } | Light::Spot { .. } => None,
    });
    let far: Vec<DVec3> = far.collect();
    let instead = "leave `sun` out of --layers";
    match far[..] {
        [towards] => Ok(towards),
        [] => Err(Error::Usage(format!("--layers sun: the scene has no `sun` and no `directional` light; {instead}"))),
        _ => Err(Error::Usage(format!(
            "--layers sun: the scene has {} lights that are infinitely far away, and nothing says which is the sun; {instead}",
            far.len()
        ))),
    }
}

impl Layers {
    /// `None` without any.
    pub fn new(scene: &Scene, layers: &[Layer]) -> Result<Option<Layers>> {
        if layers.is_empty() {
            return Ok(None);
        }
        let sun = if layers.contains(&Layer::Sun) { Some(sun(scene)?) } else { None };
        let materials = scene.objects.iter().map(|object| object.material.map_or(-1, |material| material as i32));
        let numbers = labels(scene).1.into_iter().zip(materials).map(|(object, material)| [object, material]).collect();
        let layers = Layer::ALL.into_iter().filter(|layer| layers.contains(layer)).collect();
        Ok(Some(Layers { layers, camera: scene.camera.clone(), film: scene.film.clone(), numbers, sun }))
    }

    /// Those of a tile, whose pixels of the picture are `rect` of the full film.
    pub fn of_tile(&self, accel: &Accel, grid: Grid, rect: Rect, meet: &mut Meet) -> Result<TileLayers> {
        let mut layers = TileLayers::empty(&self.layers, grid);
        let pixels: Vec<[u32; 2]> = (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| [x, y])).collect();
        let space = accel.space;
        let rays = pixels.iter().map(|&[x, y]| {
            let place = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let [origin, direction] = self.camera.ray(&self.film, place, DVec2::ZERO);
            Ray { origin: (origin - space.center) * space.scale, direction, passed: 0.0 }
        });
        let seen = self.follow(accel, rays.collect(), meet)?;
        let lit = self.sun.map(|sun| self.lit(accel, sun, &seen, meet)).transpose()?.unwrap_or_default();
        for (i, (&[x, y], seen)) in pixels.iter().zip(&seen).enumerate() {
            let Some(seen) = seen else { continue };
            // Of the film, of which the cube may be a part.
            let pixel = ((y - rect.y0) * grid.tile[0] + (x - rect.x0)) as usize;
            let [object, material] = self.numbers_of(accel, seen.primitive);
            layers.set(Layer::Depth, pixel, &[seen.distance / space.scale]);
            layers.set(Layer::Normal, pixel, &seen.normal.to_array());
            layers.set(Layer::Object, pixel, &[object.into()]);
            layers.set(Layer::Material, pixel, &[material.into()]);
            layers.set(Layer::Coordinates, pixel, &(seen.position / space.scale + space.center).to_array());
            if let Some(&lit) = lit.get(i) {
                layers.set(Layer::Sun, pixel, &[lit]);
            }
        }
        Ok(layers)
    }

    fn numbers_of(&self, accel: &Accel, primitive: u32) -> [i32; 2] {
        self.numbers[accel.objects[primitive as usize] as usize]
    }

    /// What each ray sees: surfaces without a material, and those that stop less than half of all rays, are passed.
    fn follow(&self, accel: &Accel, mut rays: Vec<Ray>, meet: &mut Meet) -> Result<Vec<Option<Seen>>> {
        let mut seen: Vec<Option<Seen>> = rays.iter().map(|_| None).collect();
        let mut under_way: Vec<usize> = (0..rays.len()).collect();
        for _ in 0..MOST_PASSED {
            if under_way.is_empty() {
                return Ok(seen);
            }
            let question = |&i: &usize| Question {
                origin: rays[i].origin.as_vec3().to_array(),
                direction: rays[i].direction.as_vec3().to_array(),
                limit: f32::MAX,
            };
            let questions: Vec<Question> = under_way.iter().map(question).collect();
            let met = meet(&questions)?;
            let mut further = Vec::new();
            for (&i, met) in under_way.iter().zip(met) {
                let Some(primitive) = met.primitive else { continue };
                let ray = &mut rays[i];
                let (kind, corners) = accel.in_world(primitive, met.instance);
                let (t, normal) = meet_exactly(kind, corners, ray, f64::from(met.distance));
                let position = ray.origin + t * ray.direction;
                let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
                let [_, material] = self.numbers_of(accel, primitive);
                if material < 0 || met.is_open {
                    // On the same line, so that what is behind is seen in its place.
                    let beyond = t + off(position) / normal.dot(ray.direction).abs().max(LEAST_COSINE);
                    ray.passed += beyond;
                    ray.origin += beyond * ray.direction;
                    further.push(i);
                } else {
                    seen[i] = Some(Seen { primitive, distance: ray.passed + t, position, normal });
                }
            }
            under_way = further;
        }
        Err(Error::Usage(format!("a ray met more than {MOST_PASSED} surfaces that let it pass, one after the other")))
    }

    /// Cosines at which the sun shines on what is seen; 0 where something is in the way.
    fn lit(&self, accel: &Accel, sun: DVec3, seen: &[Option<Seen>], meet: &mut Meet) -> Result<Vec<f64>> {
        let cosine = |seen: &Option<Seen>| seen.as_ref().map_or(f64::NAN, |seen| seen.normal.dot(sun).max(0.0));
        let mut cosines: Vec<f64> = seen.iter().map(cosine).collect();
        let facing: Vec<usize> = (0..seen.len()).filter(|&i| cosines[i] > 0.0).collect();
        let rays = facing.iter().filter_map(|&i| {
            let seen = seen[i].as_ref()?;
            Some(Ray { origin: seen.position + off(seen.position) * seen.normal, direction: sun, passed: 0.0 })
        });
        let in_the_way = self.follow(accel, rays.collect(), meet)?;
        for (&i, _) in facing.iter().zip(&in_the_way).filter(|(_, found)| found.is_some()) {
            cosines[i] = 0.0;
        }
        Ok(cosines)
    }
}

/// How far off a surface rays start.
fn off(position: DVec3) -> f64 {
    OFF * position.abs().max_element().max(LEAST_COORDINATE)
}

/// Where a ray meets a primitive that a device has found at about `near`, and the unit normal there.
fn meet_exactly(kind: u32, [a, b, c]: [DVec3; 3], ray: &Ray, near: f64) -> (f64, DVec3) {
    let (o, d) = (ray.origin, ray.direction);
    let plane = |normal: DVec3| (a - o).dot(normal) / d.dot(normal);
    // The root next to the device's.
    let circle = |s: DVec3, d: DVec3, radius: f64| {
        let (half, dd) = (s.dot(d), d.length_squared());
        let root = (half * half - dd * (s.length_squared() - radius * radius)).max(0.0).sqrt();
        let [first, last] = [(-half - root) / dd, (-half + root) / dd];
        if (first - near).abs() <= (last - near).abs() { first } else { last }
    };
    let axis = (b - a).normalize_or_zero();
    let across = |v: DVec3| v - v.dot(axis) * axis;
    let t = match kind {
        KIND_SPHERE => circle(o - a, d, b.x),
        KIND_DISK => plane(b),
        KIND_CYLINDER => circle(across(o - a), across(d), c.x),
        _ => plane((b - a).cross(c - a)),
    };
    // Met all but edge-on, what rounding leaves of a quotient says less than the device does.
    const AGREE: f64 = 1e-4;
    let t = if (t - near).abs() <= AGREE * near.max(1.0) { t } else { near };
    let at = o + t * d;
    let normal = match kind {
        KIND_SPHERE => at - a,
        KIND_DISK => b,
        KIND_CYLINDER => across(at - a),
        _ => (b - a).cross(c - a),
    };
    (t, normal.normalize_or_zero())
}
