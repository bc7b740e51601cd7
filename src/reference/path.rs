//! One path: from the camera, surface to surface, carrying all K channels.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::ops::Range;

use glam::{DAffine3, DVec3};

use super::bsdf::{Bsdf, SpectralValues, Vertex};
use super::camera;
use super::flight::Flight;
use super::gas::{self, Piece};
use super::lights::{LightPoint, Lights, Target, disk_solid_angle, emits, sample_disk, spot_share};
use super::primitive::{Ray, SurfacePoint};
use super::rng::Rng;
use super::shading::Shading;
use super::sky::Sky;
use super::texture;
use super::world::{Hit, World};
use crate::scene::{Bsdf as Description, Environment, Interior, Light, Projection, Scene, SpectrumId, Weight};

/// What tracing needs of a scene, prepared once and shared by all threads.
pub struct Tracer<'a> {
    pub(super) scene: &'a Scene,
    world: World,
    /// The environment, where it is a map.
    sky: Option<Sky<'a>>,
    lights: Lights,
    /// One for each material of the scene.
    materials: Vec<Bsdf>,
    /// Of all media, and of the bodies of glass that they fill.
    gas_spectra: Vec<SpectrumId>,
    /// Indices of bodies with a dielectric surface and an interior.
    glass: HashMap<usize, (SpectrumId, Option<f64>)>,
    /// The interiors around the camera, the innermost last.
    around_camera: Vec<Interior>,
    /// Whether some surface lets rays pass.
    masked: bool,
    /// Whether some matter scatters: then every channel has paths of its own.
    scatters: bool,
}

/// The K-channel state of the path under way; reused from path to path.
pub struct Path<'a> {
    pub(super) spectra: SpectralValues<'a>,
    /// Product of what the surfaces did so far.
    pub(super) throughput: Vec<f64>,
    /// The channels that have not stopped: all, or the one that ideal dispersive refraction left.
    pub(super) alive: Range<usize>,
    /// Radiance gathered so far, W m⁻² sr⁻¹ nm⁻¹.
    pub radiance: Vec<f64>,
    /// What one vertex does to each channel.
    factor: Vec<f64>,
    /// Radiance of what is aimed at or met, or what takes its place.
    pub(super) emitted: Vec<f64>,
    /// The interiors that the path is in, the innermost last.
    pub(super) interiors: Vec<Interior>,
}

/// A way to some light, chosen at a vertex.
pub(super) struct Aim {
    pub(super) direction: DVec3,
    /// Where the light is; `None` at infinity.
    target: Option<DVec3>,
    /// Density by solid angle of the choice; `None` for lights without extent, which are never met.
    pub(super) density: Option<f64>,
    pub(super) emitted: Emitted,
}

/// Radiance in all channels; of lights without extent, irradiance over the probability of their choice.
pub(super) enum Emitted {
    Spectrum {
        spectrum: SpectrumId,
        scale: f64,
    },
    Sky(DVec3),
    /// What a point of a surface sends the other way.
    Surface {
        primitive: usize,
        point: SurfacePoint,
        towards: DVec3,
    },
}

impl<'a> Path<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let channels = scene.channels.len();
        Path {
            spectra: SpectralValues::new(scene),
            throughput: vec![0.0; channels],
            alive: 0..channels,
            radiance: vec![0.0; channels],
            factor: vec![0.0; channels],
            emitted: vec![0.0; channels],
            interiors: Vec::new(),
        }
    }

    /// Starts a path with wavelength coordinate `mu` (Eq. 4 of Hoarau et al. 2018: one for all channels).
    fn begin(&mut self, mu: f64) {
        self.spectra.begin(mu);
        for (k, throughput) in self.throughput.iter_mut().enumerate() {
            *throughput = self.spectra.response(k);
        }
        self.radiance.fill(0.0);
        self.alive = 0..self.throughput.len();
    }

    /// Radiance += throughput · spectrum · weight.
    fn gather(&mut self, spectrum: SpectrumId, weight: f64) {
        let values = self.spectra.get(spectrum);
        for k in self.alive.clone() {
            self.radiance[k] += self.throughput[k] * values[k] * weight;
        }
    }

    /// Sets `emitted`.
    fn look_up(&mut self, emitted: &Emitted, sky: Option<&Sky>) {
        match (emitted, sky) {
            (Emitted::Spectrum { spectrum, scale }, _) => {
                let values = self.spectra.get(*spectrum);
                self.emitted.iter_mut().zip(values).for_each(|(e, value)| *e = scale * value);
            }
            (Emitted::Sky(direction), Some(sky)) => {
                sky.radiance(*direction, self.spectra.wavelengths(), &mut self.emitted);
                if let Some(daylight) = sky.daylight() {
                    let values = self.spectra.get(daylight);
                    self.emitted.iter_mut().zip(values).for_each(|(e, value)| *e *= value);
                }
            }
            (Emitted::Sky(_), None) | (Emitted::Surface { .. }, _) => self.emitted.fill(0.0),
        }
    }
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let world = World::new(&scene.objects);
        let sky = scene.environment.as_ref().and_then(|environment| environment.map()).map(|map| Sky::new(scene, map));
        let materials: Vec<Bsdf> = (0..scene.materials.len()).map(|material| Bsdf::new(scene, material)).collect();
        let lights = Lights::new(scene, &world, sky.as_ref(), &materials);
        let glass = glass(scene);
        let mut gas_spectra = gas::spectra(scene);
        gas_spectra.extend(glass.values().map(|(eta, _)| *eta));
        let masked = scene.materials.iter().any(|material| material.opacity.is_some());
        let scatters = scene.media.iter().any(|medium| medium.scatters());
        let around_camera = Vec::new();
        let mut tracer =
            Tracer { scene, world, sky, lights, materials, gas_spectra, glass, around_camera, masked, scatters };
        tracer.around_camera = tracer.interiors_around(scene.camera.position);
        tracer
    }

    /// Traces one path through `pixel` and leaves its radiance in `path`.
    ///
    /// Emission is found in two ways, by aiming at lights and by meeting them, which are combined by the balance
    /// heuristic (Veach 1997, section 9.2.2). The uniform environment is only met.
    pub fn trace(&self, pixel: [u32; 2], rng: &mut Rng, path: &mut Path) {
        path.begin(rng.uniform());
        if !self.scatters {
            return self.trace_channels(pixel, rng, path);
        }
        // Where matter scatters, decisions are those of one wavelength.
        for k in 0..path.throughput.len() {
            path.alive = k..k + 1;
            self.trace_channels(pixel, rng, path);
        }
    }

    /// One path of the channels that are alive.
    fn trace_channels(&self, pixel: [u32; 2], rng: &mut Rng, path: &mut Path) {
        let integrator = &self.scene.integrator;
        let mut ray = camera::ray(&self.scene.camera, &self.scene.film, pixel, rng);
        // Density by solid angle with which the ray was chosen; none where lights could not have been aimed at instead:
        // for camera rays, mirrors and ideal refraction.
        let mut ray_density = None;
        path.spectra.fill(&self.gas_spectra);
        match self.scene.camera.projection {
            Projection::Perspective { .. } | Projection::Latlong => path.interiors.clone_from(&self.around_camera),
            _ => path.interiors = self.interiors_around(ray.origin),
        }

        for event in 0..=integrator.max_bounces {
            let mut pieces = Vec::new();
            let hit = self.follow(&ray, &mut path.interiors, &mut pieces, rng);
            let before = path.throughput[path.alive.start];
            let Path { spectra, throughput, alive, radiance, .. } = &mut *path;
            // What arrives from infinity has been measured at the scene.
            let counts = |piece: &&Piece| hit.is_some() || !piece.outer;
            let counting = pieces.iter().filter(counts);
            counting.for_each(|piece| piece.pass(spectra, alive.clone(), throughput, Some(radiance)));
            match &hit {
                None => self.gather_from_afar(ray.direction, ray_density, path),
                Some(hit) => self.gather_emission(&ray, hit, ray_density, path),
            }
            if event == integrator.max_bounces {
                return;
            }
            if self.scatters {
                path.throughput[path.alive.start] = before;
                match self.scatter(&pieces, ray.direction, event, rng, path) {
                    Flight::Scattered { next, density } => {
                        (ray, ray_density) = (next, Some(density));
                        continue;
                    }
                    Flight::Ended => return,
                    Flight::Passed => {}
                }
            }
            let Some(hit) = hit else { return };

            let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
            let bsdf = &self.materials[object.material.expect("paths pass null boundaries")];
            let aim = self.aim(hit.point.position, rng);
            path.spectra.fill(bsdf.spectra());
            if let Some(aim) = &aim {
                self.look_up(&aim.emitted, path);
            }

            let inside = hit.point.normal.dot(ray.direction) > 0.0;
            let geometric = if inside { -hit.point.normal } else { hit.point.normal };
            let shading = Shading::new(&object.attributes, &self.world.primitives[hit.primitive], &hit.point);
            path.spectra.look_up(bsdf.textures(), shading.uv);
            let frame = shading.frame(geometric, inside, -ray.direction);
            let o = frame.transpose() * -ray.direction;
            if o.z <= 0.0 {
                // Along the surface to the last bit.
                return;
            }
            let Path { spectra, throughput, alive, radiance, factor, emitted, interiors } = &mut *path;
            let Some(scattering) = bsdf.at(Vertex { o, inside, spectra, alive: alive.clone() }) else { return };
            let kept = aim.filter(|aim| shading.keeps_side(geometric, &frame, aim.direction));
            let pieces = kept.as_ref().and_then(|aim| self.way_from_surface(&hit, inside, aim, interiors, rng));
            if let Some((aim, pieces)) = kept.zip(pieces) {
                pieces.iter().for_each(|piece| piece.pass(spectra, alive.clone(), emitted, None));
                let scattered = scattering.evaluate(frame.transpose() * aim.direction, factor);
                // The balance heuristic leaves f cosθ over the sum of both densities by solid angle.
                let weight = aim.density.map_or(1.0, |density| 1.0 / (density + scattered));
                for k in alive.clone() {
                    radiance[k] += throughput[k] * factor[k] * emitted[k] * weight;
                }
            }

            if integrator.russian_roulette_start > 0 && event + 1 >= integrator.russian_roulette_start {
                let survival = scattering.survival();
                if rng.uniform() >= survival {
                    return;
                }
                throughput.iter_mut().for_each(|t| *t /= survival);
            }

            let Some(next) = scattering.sample(std::array::from_fn(|_| rng.uniform()), factor) else { return };
            for k in alive.clone() {
                throughput[k] *= factor[k];
            }
            if let Some(channel) = next.channel {
                *alive = channel..channel + 1;
            }
            if throughput[alive.clone()].iter().all(|t| *t == 0.0) {
                return;
            }
            ray_density = next.density;
            let direction = (frame * next.direction).normalize();
            if !shading.keeps_side(geometric, &frame, direction) {
                return;
            }
            let goes_inside = hit.point.normal.dot(direction) < 0.0;
            if goes_inside != inside {
                cross(interiors, object.interior, goes_inside);
            }
            ray = Ray { origin: self.world.leave(hit.primitive, &hit.point, direction), direction };
        }
    }

    /// Emission of the surface that a ray meets.
    fn gather_emission(&self, ray: &Ray, hit: &Hit, ray_density: Option<f64>, path: &mut Path) {
        if !self.emit(hit.primitive, &hit.point, -ray.direction, path) {
            return;
        }
        let cosine = hit.point.normal.dot(ray.direction);
        let weight = match ray_density {
            None => 1.0,
            Some(density) => {
                let light_density = self.lights.density(hit.primitive) * hit.t * hit.t / cosine.abs();
                density / (density + light_density)
            }
        };
        for k in path.alive.clone() {
            path.radiance[k] += path.throughput[k] * path.emitted[k] * weight;
        }
    }

    /// Sets `path.emitted` to what a point of a surface sends along `towards`; `false` where it sends nothing.
    fn emit(&self, primitive: usize, point: &SurfacePoint, towards: DVec3, path: &mut Path) -> bool {
        let object = &self.scene.objects[self.world.primitives[primitive].object];
        let inside = point.normal.dot(towards) < 0.0;
        let lamp = object.emission.as_ref().filter(|e| emits(e, !inside));
        let (emission, picture) = (lamp.map(|lamp| lamp.radiance), lamp.and_then(|lamp| lamp.texture));
        let bsdf = object.material.map(|material| &self.materials[material]).filter(|bsdf| bsdf.is_hot());
        if emission.is_none() && bsdf.is_none() {
            return false;
        }
        path.spectra.fill(emission.as_slice());
        path.spectra.fill(bsdf.map_or(&[], |bsdf| bsdf.spectra()));
        let geometric = if inside { -point.normal } else { point.normal };
        let shading = Shading::new(&object.attributes, &self.world.primitives[primitive], point);
        path.spectra.look_up(bsdf.map_or(&[], |bsdf| bsdf.textures()), shading.uv);
        path.spectra.look_up(picture.as_slice(), shading.uv);
        let Path { spectra, alive, emitted, .. } = path;
        for k in alive.clone() {
            emitted[k] = match (picture, emission) {
                (Some(texture), _) => spectra.textured(texture, k),
                (None, Some(spectrum)) => spectra.value(spectrum, k),
                (None, None) => 0.0,
            };
        }
        if let Some(bsdf) = bsdf {
            let o = shading.frame(geometric, inside, towards).transpose() * towards;
            bsdf.emit(&Vertex { o, inside, spectra, alive: alive.clone() }, emitted);
        }
        true
    }

    /// Sets `path.emitted`.
    pub(super) fn look_up(&self, emitted: &Emitted, path: &mut Path) {
        match emitted {
            Emitted::Surface { primitive, point, towards } => {
                if !self.emit(*primitive, point, *towards, path) {
                    path.emitted.fill(0.0);
                }
                // What is aimed at may let the ray pass.
                let opacity = self.opacity(*primitive, point);
                path.emitted.iter_mut().for_each(|emitted| *emitted *= opacity);
            }
            other => path.look_up(other, self.sky.as_ref()),
        }
    }

    /// What arrives from beyond all surfaces: the environment and the suns in that direction.
    fn gather_from_afar(&self, direction: DVec3, ray_density: Option<f64>, path: &mut Path) {
        // The balance heuristic, for light that could have been aimed at with density `other`.
        let weight = |other: f64| ray_density.map_or(1.0, |density| density / (density + other));
        match (&self.scene.environment, &self.sky) {
            (Some(Environment::Uniform(radiance)), _) => path.gather(*radiance, 1.0),
            (Some(Environment::Map(_)), Some(sky)) => {
                path.look_up(&Emitted::Sky(direction), Some(sky));
                let weight = weight(self.lights.sky * sky.density(direction));
                for k in path.alive.clone() {
                    path.radiance[k] += path.throughput[k] * path.emitted[k] * weight;
                }
            }
            _ => {}
        }
        for (i, light) in self.scene.lights.iter().enumerate() {
            if let Light::Sun { direction: travel, angular_radius, irradiance } = light
                && direction.dot(-*travel) >= angular_radius.cos()
            {
                let density = self.lights.probability(i) / disk_solid_angle(*angular_radius);
                path.gather(*irradiance, weight(density) * radiance_of_disk(*angular_radius));
            }
        }
    }

    /// Chooses a light and a way to it; `None` where it sends nothing there.
    pub(super) fn aim(&self, from: DVec3, rng: &mut Rng) -> Option<Aim> {
        match self.lights.sample(&self.world, rng)? {
            Target::Surface(light) => self.aim_at_surface(from, &light),
            Target::Light(light) => {
                let probability = self.lights.probability(light);
                match self.scene.lights[light] {
                    Light::Point { position, intensity } => {
                        let towards = position - from;
                        let distance2 = towards.length_squared();
                        let emitted = Emitted::Spectrum { spectrum: intensity, scale: 1.0 / (distance2 * probability) };
                        let direction = towards.try_normalize()?;
                        Some(Aim { direction, target: Some(position), density: None, emitted })
                    }
                    Light::Spot { position, direction: axis, intensity, cone } => {
                        let towards = position - from;
                        let direction = towards.try_normalize()?;
                        let share = spot_share(&cone, axis.angle_between(-direction));
                        let scale = share / (towards.length_squared() * probability);
                        let emitted = Emitted::Spectrum { spectrum: intensity, scale };
                        (share > 0.0).then_some(Aim { direction, target: Some(position), density: None, emitted })
                    }
                    Light::Directional { direction, irradiance } => {
                        let emitted = Emitted::Spectrum { spectrum: irradiance, scale: 1.0 / probability };
                        Some(Aim { direction: -direction, target: None, density: None, emitted })
                    }
                    Light::Sun { direction, angular_radius, irradiance } => {
                        let density = probability / disk_solid_angle(angular_radius);
                        let scale = radiance_of_disk(angular_radius);
                        let emitted = Emitted::Spectrum { spectrum: irradiance, scale };
                        let direction = sample_disk(-direction, angular_radius, rng);
                        Some(Aim { direction, target: None, density: Some(density), emitted })
                    }
                }
            }
            Target::Sky => {
                let (direction, density) = self.sky.as_ref()?.sample(rng);
                let density = Some(self.lights.sky * density);
                Some(Aim { direction, target: None, density, emitted: Emitted::Sky(direction) })
            }
        }
    }

    fn aim_at_surface(&self, from: DVec3, light: &LightPoint) -> Option<Aim> {
        let towards = light.point.position - from;
        let distance = towards.length();
        if distance == 0.0 {
            return None;
        }
        let direction = towards / distance;
        let light_cosine = light.point.normal.dot(direction);
        if light_cosine == 0.0 {
            return None;
        }
        Some(Aim {
            direction,
            target: Some(self.world.leave(light.primitive, &light.point, -direction)),
            density: Some(light.density * distance * distance / light_cosine.abs()),
            emitted: Emitted::Surface { primitive: light.primitive, point: light.point, towards: -direction },
        })
    }

    /// The ways through media from a surface to what is aimed at, if nothing but null boundaries stands between.
    fn way_from_surface(
        &self,
        hit: &Hit,
        inside: bool,
        aim: &Aim,
        interiors: &[Interior],
        rng: &mut Rng,
    ) -> Option<Vec<Piece<'_>>> {
        let origin = self.world.leave(hit.primitive, &hit.point, aim.direction);
        let mut interiors = interiors.to_vec();
        let goes_inside = hit.point.normal.dot(aim.direction) < 0.0;
        if goes_inside != inside {
            let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
            cross(&mut interiors, object.interior, goes_inside);
        }
        self.way_to(origin, interiors, aim, rng)
    }

    pub(super) fn way_to(
        &self,
        origin: DVec3,
        mut interiors: Vec<Interior>,
        aim: &Aim,
        rng: &mut Rng,
    ) -> Option<Vec<Piece<'_>>> {
        if self.scene.media.is_empty() && !self.masked {
            let clear = match aim.target {
                Some(target) => !self.world.occluded(origin, target),
                None => self.world.closest_hit(&Ray { origin, direction: aim.direction }).is_none(),
            };
            return clear.then(Vec::new);
        }
        // From just off the surface to the very target: a parallel line would meet a light seen obliquely too early.
        let direction = aim.target.map_or(aim.direction, |target| (target - origin).normalize());
        let (mut ray, mut pieces) = (Ray { origin, direction }, Vec::new());
        loop {
            let left = aim.target.map_or(f64::INFINITY, |target| (target - ray.origin).dot(ray.direction));
            let hit = self.world.closest_hit(&ray).filter(|hit| hit.t < left);
            let Some(hit) = hit else {
                match aim.target {
                    Some(target) => pieces.extend(self.piece(&interiors, ray.origin, target)),
                    None => pieces.retain(|piece: &Piece| !piece.outer),
                }
                return Some(pieces);
            };
            let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
            if object.material.is_some() && !self.lets_pass(&hit, rng) {
                return None;
            }
            pieces.extend(self.piece(&interiors, ray.origin, ray.origin + hit.t * ray.direction));
            cross(&mut interiors, object.interior, hit.point.normal.dot(ray.direction) < 0.0);
            ray.origin += self.world.beyond(&ray, &hit) * ray.direction;
        }
    }

    /// The first surface with a material along `ray`, at its distance from the start; null boundaries on the way change
    /// what is around. `pieces`: the ways through media.
    fn follow<'s>(
        &'s self,
        ray: &Ray,
        interiors: &mut Vec<Interior>,
        pieces: &mut Vec<Piece<'s>>,
        rng: &mut Rng,
    ) -> Option<Hit> {
        let (mut ray, mut passed) = (*ray, 0.0);
        loop {
            // To infinity outside all interiors: nobody is scattered there, and what arrives has been measured at the scene.
            let mut hit = self.world.closest_hit(&ray)?;
            pieces.extend(self.piece(interiors, ray.origin, ray.origin + hit.t * ray.direction));
            let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
            if object.material.is_some() && !self.lets_pass(&hit, rng) {
                hit.t += passed;
                return Some(hit);
            }
            cross(interiors, object.interior, hit.point.normal.dot(ray.direction) < 0.0);
            let beyond = self.world.beyond(&ray, &hit);
            passed += beyond;
            ray.origin += beyond * ray.direction;
        }
    }

    /// Whether a ray goes on through a surface that has a material.
    fn lets_pass(&self, hit: &Hit, rng: &mut Rng) -> bool {
        let opacity = self.opacity(hit.primitive, &hit.point);
        opacity < 1.0 && rng.uniform() >= opacity
    }

    /// The share of rays that a point of a surface is there for.
    fn opacity(&self, primitive: usize, point: &SurfacePoint) -> f64 {
        let primitive = &self.world.primitives[primitive];
        let object = &self.scene.objects[primitive.object];
        match object.material.and_then(|material| self.scene.materials[material].opacity) {
            None => 1.0,
            Some(Weight::Constant(opacity)) => opacity,
            Some(Weight::Texture(texture)) => {
                let uv = Shading::new(&object.attributes, primitive, point).uv;
                texture::channel(&self.scene.textures[texture], uv, 0)
            }
        }
    }

    fn piece(&self, interiors: &[Interior], from: DVec3, to: DVec3) -> Option<Piece<'_>> {
        let innermost = interiors.last();
        let medium = innermost.map(|interior| interior.medium).or(self.scene.camera_medium)?;
        let to_grid = innermost.map_or(DAffine3::IDENTITY, |interior| interior.to_grid);
        let indices = interiors.iter().filter_map(|interior| self.glass.get(&interior.body).copied()).collect();
        let (medium, around) = (&self.scene.media[medium], interiors.to_vec());
        Some(Piece { medium, to_grid, outer: innermost.is_none(), from, to, indices, around })
    }

    /// The interiors around a point: those that a ray from it leaves without having entered, in reverse.
    fn interiors_around(&self, point: DVec3) -> Vec<Interior> {
        let (mut entered, mut around) = (Vec::new(), Vec::new());
        if self.scene.objects.iter().any(|object| object.interior.is_some()) {
            // Along nothing that scenes are made of.
            let direction = DVec3::new(0.537_731, 0.312_649, 0.783_017).normalize();
            let mut ray = Ray { origin: point, direction };
            while let Some(hit) = self.world.closest_hit(&ray) {
                let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
                let inward = hit.point.normal.dot(direction) < 0.0;
                if !cross(&mut entered, object.interior, inward) {
                    around.extend(object.interior);
                }
                ray.origin += self.world.beyond(&ray, &hit) * direction;
            }
        }
        around.reverse();
        around
    }
}

/// The index behind each dielectric surface with an interior, by body, and its mean over channels without dispersion.
fn glass(scene: &Scene) -> HashMap<usize, (SpectrumId, Option<f64>)> {
    let of_object = |object: &crate::scene::Object| match scene.materials[object.material?].bsdf {
        Description::Dielectric { eta, dispersion, .. } => {
            let (curve, bounds) = (&scene.spectra[eta].curve, &scene.channels.bounds);
            let mean = || bounds.iter().map(|b| curve.mean(b[0], b[1])).sum::<f64>() / bounds.len() as f64;
            Some((object.interior?.body, (eta, (!dispersion).then(mean))))
        }
        _ => None,
    };
    scene.objects.iter().filter_map(of_object).collect()
}

/// Goes through the surface of `interior`, if there is one; `false` where it leaves what it was not in.
fn cross(interiors: &mut Vec<Interior>, interior: Option<Interior>, inward: bool) -> bool {
    let Some(interior) = interior else { return true };
    if inward {
        interiors.push(interior);
        return true;
    }
    let inner = interiors.iter().rposition(|other| other.body == interior.body);
    inner.map(|inner| interiors.remove(inner)).is_some()
}

/// Radiance of a disk of angular `radius` that causes a unit irradiance facing it, sr⁻¹: ∫ cosθ over it is π sin².
fn radiance_of_disk(radius: f64) -> f64 {
    1.0 / (PI * radius.sin().powi(2))
}
