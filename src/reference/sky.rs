//! Environment maps: radiance by direction, and choosing a direction by it.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::rng::Rng;
use crate::scene::{EnvironmentMap, Scene, SpectrumId, Texels};
use crate::spectral::skylight::{self, Tint};

/// Share of directions that are chosen uniformly over the sphere, whatever the map says: none is left out.
const UNIFORM: f64 = 0.1;

/// A map of a scene, ready to be looked up and sampled.
pub struct Sky<'a> {
    map: &'a EnvironmentMap,
    /// Per texel, of RGB maps.
    tints: Vec<Tint>,
    /// Probability that one of the texels up to this one is chosen; the last is 1.
    cumulative: Vec<f64>,
    /// ∫ radiance over all directions, W m⁻² nm⁻¹, \[K\].
    pub flux: Vec<f64>,
}

impl<'a> Sky<'a> {
    pub fn new(scene: &Scene, map: &'a EnvironmentMap) -> Self {
        let tints = match &map.texels {
            Texels::Rgb { rgb, .. } => skylight::tints(rgb),
            Texels::Spectral { .. } => Vec::new(),
        };
        let texels = map.size[0] as usize * map.size[1] as usize;
        let mut sky = Sky { map, tints, cumulative: vec![0.0; texels], flux: vec![0.0; scene.channels.len()] };

        // Channel by channel: the flux that comes through each texel's part of the sphere, at a few wavelengths.
        const POINTS: u32 = 4;
        for k in 0..scene.channels.len() {
            let mus = (0..POINTS).map(|i| (f64::from(i) + 0.5) / f64::from(POINTS));
            let nm: Vec<f64> = mus.map(|mu| scene.channels.wavelength(k, mu)).collect();
            let white: Vec<f64> = nm.iter().map(|&nm| sky.white(scene, nm)).collect();
            let mean = |texel: usize| {
                let values = nm.iter().zip(&white).map(|(nm, white)| white * sky.texel(texel, *nm));
                sky.map.scale * values.sum::<f64>() / f64::from(POINTS)
            };
            let means: Vec<f64> = (0..texels).map(mean).collect();
            let fluxes: Vec<f64> =
                (0..texels).map(|texel| sky.solid_angle(texel) * sky.smeared(&means, texel)).collect();
            let total: f64 = fluxes.iter().sum();
            sky.flux[k] = total;
            if total > 0.0 {
                sky.cumulative.iter_mut().zip(&fluxes).for_each(|(sum, flux)| *sum += flux / total);
            }
        }
        let lit = sky.flux.iter().filter(|flux| **flux > 0.0).count();
        let mut sum = 0.0;
        for texel in 0..texels {
            let by_sphere = sky.solid_angle(texel) / (4.0 * PI);
            let by_map = if lit > 0 { sky.cumulative[texel] / lit as f64 } else { by_sphere };
            sum += UNIFORM * by_sphere + (1.0 - UNIFORM) * by_map;
            sky.cumulative[texel] = sum;
        }
        sky.cumulative[texels - 1] = 1.0;
        sky
    }

    /// The spectrum that multiplies all texels, if there is one.
    pub fn daylight(&self) -> Option<SpectrumId> {
        match &self.map.texels {
            Texels::Rgb { daylight, .. } => Some(*daylight),
            Texels::Spectral { .. } => None,
        }
    }

    fn white(&self, scene: &Scene, nm: f64) -> f64 {
        self.daylight().map_or(1.0, |daylight| scene.spectra[daylight].curve.eval(nm))
    }

    /// Radiance of a texel at `nm`, without `scale` and daylight.
    fn texel(&self, texel: usize, nm: f64) -> f64 {
        match &self.map.texels {
            Texels::Rgb { .. } => self.tints[texel].eval(nm),
            Texels::Spectral { nm: bands, radiance } => {
                let values = &radiance[texel * bands.len()..][..bands.len()];
                let above = bands.partition_point(|band| *band <= nm);
                match above {
                    0 => 0.0,
                    i if i < bands.len() => {
                        let t = (nm - bands[i - 1]) / (bands[i] - bands[i - 1]);
                        let (a, b) = (f64::from(values[i - 1]), f64::from(values[i]));
                        a + t * (b - a)
                    }
                    i if nm == bands[i - 1] => f64::from(values[i - 1]),
                    _ => 0.0,
                }
            }
        }
    }

    /// Sets `out` to the radiance from `direction` at the wavelengths `nm`, without daylight.
    pub fn radiance(&self, direction: DVec3, nm: &[f64], out: &mut [f64]) {
        let [u, v] = self.uv(direction);
        let [width, height] = self.map.size;
        let (x, y) = (u * f64::from(width) - 0.5, v * f64::from(height) - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - top);
        let columns = [left, left + 1.0].map(|x| x.rem_euclid(f64::from(width)) as usize);
        let rows = [top, top + 1.0].map(|y| y.clamp(0.0, f64::from(height) - 1.0) as usize);
        let at = |i: usize, j: usize| rows[j] * width as usize + columns[i];
        for (out, &nm) in out.iter_mut().zip(nm) {
            let row = |j: usize| (1.0 - fx) * self.texel(at(0, j), nm) + fx * self.texel(at(1, j), nm);
            *out = self.map.scale * ((1.0 - fy) * row(0) + fy * row(1));
        }
    }

    /// A direction in the world and its density by solid angle.
    pub fn sample(&self, rng: &mut Rng) -> (DVec3, f64) {
        let choice = rng.uniform();
        let texel = self.cumulative.partition_point(|&c| c <= choice);
        let (column, row) = (texel % self.map.size[0] as usize, texel / self.map.size[0] as usize);
        let [top, bottom] = self.edges(row);
        let cosine = top + rng.uniform() * (bottom - top);
        let azimuth = TAU * ((column as f64 + rng.uniform()) / f64::from(self.map.size[0]) - 0.5);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let direction = DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos());
        (self.map.to_map.transpose() * direction, self.texel_density(texel))
    }

    /// The density by solid angle with which [`Sky::sample`] chooses `direction`.
    pub fn density(&self, direction: DVec3) -> f64 {
        let [u, v] = self.uv(direction);
        let [width, height] = self.map.size;
        let index = |t: f64, count: u32| ((t * f64::from(count)) as usize).min(count as usize - 1);
        self.texel_density(index(v, height) * width as usize + index(u, width))
    }

    fn texel_density(&self, texel: usize) -> f64 {
        let before = if texel == 0 { 0.0 } else { self.cumulative[texel - 1] };
        (self.cumulative[texel] - before) / self.solid_angle(texel)
    }

    /// Map coordinates in [0, 1].
    fn uv(&self, direction: DVec3) -> [f64; 2] {
        let m = self.map.to_map * direction;
        [0.5 + m.x.atan2(-m.z) / TAU, m.x.hypot(m.z).atan2(m.y) / PI]
    }

    /// Cosines of the polar angles at a row's edges.
    fn edges(&self, row: usize) -> [f64; 2] {
        [row, row + 1].map(|edge| (PI * edge as f64 / f64::from(self.map.size[1])).cos())
    }

    fn solid_angle(&self, texel: usize) -> f64 {
        let [top, bottom] = self.edges(texel / self.map.size[0] as usize);
        TAU / f64::from(self.map.size[0]) * (top - bottom)
    }

    /// The mean over a texel of the bilinear surface through the `values` at texel centres.
    fn smeared(&self, values: &[f64], texel: usize) -> f64 {
        let [width, height] = self.map.size.map(|side| side as usize);
        let (x, y) = (texel % width, texel / width);
        let around = |i: usize, count: usize| [(i + count - 1) % count, i, (i + 1) % count];
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)];
        const WEIGHT: [f64; 3] = [0.125, 0.75, 0.125];
        let mut sum = 0.0;
        for (row, by_row) in rows.into_iter().zip(WEIGHT) {
            for (column, by_column) in around(x, width).into_iter().zip(WEIGHT) {
                sum += by_row * by_column * values[row * width + column];
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::{DMat3, DVec3};
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    use super::*;
    use crate::reference::lights::{disk_solid_angle, sample_disk};
    use crate::scene;

    /// Probability that right code fails one of the two tests, each of five configurations.
    const ALPHA: f64 = 1e-4;

    fn scene(channels: &str) -> Scene {
        let text = format!(
            "camera.perspective = {{ position = [0, 0, 5], look_at = [0, 0, 0], fov = 60 }}
            film = {{ width = 1, height = 1 }}
            channels.{channels}"
        );
        scene::parse(&text, Path::new("t.toml"), &[]).unwrap_or_else(|e| panic!("{e}"))
    }

    /// p-value of `counts` against probabilities, cells of fewer than 10 expected in one.
    fn p_value(counts: &[u32], probabilities: &[f64]) -> f64 {
        let n = f64::from(counts.iter().sum::<u32>());
        assert!((probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{}", probabilities.iter().sum::<f64>());
        let (mut chi2, mut cells, mut few) = (0.0, 0, [0.0; 2]);
        for (count, probability) in counts.iter().zip(probabilities) {
            let expected = n * probability;
            assert!(*count == 0 || expected > 0.0, "chosen where the density is 0");
            if expected < 10.0 {
                few = [few[0] + f64::from(*count), few[1] + expected];
            } else {
                chi2 += (f64::from(*count) - expected).powi(2) / expected;
                cells += 1;
            }
        }
        if few[1] > 0.0 {
            chi2 += (few[0] - few[1]).powi(2) / few[1];
            cells += 1;
        }
        ChiSquared::new(f64::from(cells - 1)).unwrap().sf(chi2)
    }

    fn sidak(p: f64) {
        let each = -((-ALPHA).ln_1p() / 5.0).exp_m1();
        assert!(p >= each, "p = {p:e} < {each:e}");
    }

    /// Directions of maps against their density, in cells of a quarter of a texel: flat, one bright texel, noise, a single
    /// column, a single row; turned in five ways; and the density given with a direction is that of the direction.
    #[test]
    fn directions_follow_the_map() {
        let scene = scene("equal = { from = 400, to = 700, count = 3 }");
        let mut rng = Rng::from_keys(&[1]);
        for (case, [width, height]) in [[6, 4], [8, 5], [16, 8], [1, 7], [9, 1]].into_iter().enumerate() {
            let texels = (width * height) as usize;
            let value = |t: usize| match case {
                0 => 1.0,
                1 => {
                    if t == 19 {
                        1e4
                    } else {
                        0.0
                    }
                }
                _ => (t * t % 17) as f32,
            };
            let radiance: Vec<f32> = (0..2 * texels).map(|i| value(i / 2) * (1 + i % 2) as f32).collect();
            let map = EnvironmentMap {
                name: "map".into(),
                to_map: DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -2.0) / 3.0, case as f64),
                scale: 1.0,
                size: [width, height],
                texels: Texels::Spectral { nm: vec![300.0, 800.0], radiance: radiance.into() },
            };
            let sky = Sky::new(&scene, &map);
            let (columns, rows) = (2 * width as usize, 2 * height as usize);
            let mut counts = vec![0; columns * rows];
            for _ in 0..40_000 {
                let (direction, density) = sky.sample(&mut rng);
                let [u, v] = sky.uv(direction);
                let index = |t: f64, count: usize| ((t * count as f64) as usize).min(count - 1);
                counts[index(v, rows) * columns + index(u, columns)] += 1;
                assert!((direction.length() - 1.0).abs() < 1e-12);
                // On a texel's edge the neighbour may be found.
                let near = |t: f64, count: usize| (t * count as f64 - (t * count as f64).round()).abs() < 1e-9;
                if !near(u, columns) && !near(v, rows) {
                    assert!((sky.density(direction) / density - 1.0).abs() < 1e-12);
                }
            }
            let probability = |cell: usize| {
                let [top, bottom] =
                    [cell / columns, cell / columns + 1].map(|edge| (PI * edge as f64 / rows as f64).cos());
                let texel = (cell / columns / 2) * width as usize + cell % columns / 2;
                sky.texel_density(texel) * TAU / columns as f64 * (top - bottom)
            };
            sidak(p_value(&counts, &(0..columns * rows).map(probability).collect::<Vec<f64>>()));
        }
    }

    /// Directions of suns against the uniform density over their disks: rings of equal solid angle x sectors.
    #[test]
    fn directions_fill_the_disk_of_a_sun() {
        let mut rng = Rng::from_keys(&[2]);
        for (degrees, axis) in [
            (0.001f64, DVec3::Z),
            (0.2665, DVec3::new(1.0, 2.0, 3.0)),
            (5.0, DVec3::NEG_Y),
            (45.0, DVec3::new(-1.0, 0.1, 0.0)),
            (90.0, DVec3::new(0.3, -0.4, -0.5)),
        ] {
            let (radius, axis) = (degrees.to_radians(), axis.normalize());
            const RINGS: usize = 8;
            const SECTORS: usize = 12;
            let (s, t) = axis.any_orthonormal_pair();
            let mut counts = vec![0; RINGS * SECTORS];
            for _ in 0..40_000 {
                let d = sample_disk(axis, radius, &mut rng);
                // 1 - cos by the chord, without cancellation.
                let share = 0.5 * d.distance_squared(axis) / (2.0 * (0.5 * radius).sin().powi(2));
                assert!(share <= 1.0 + 1e-9, "{degrees}: {share}");
                let turn = 0.5 + d.dot(t).atan2(d.dot(s)) / TAU;
                let ring = ((share * RINGS as f64) as usize).min(RINGS - 1);
                counts[ring * SECTORS + ((turn * SECTORS as f64) as usize).min(SECTORS - 1)] += 1;
            }
            sidak(p_value(&counts, &[1.0 / (RINGS * SECTORS) as f64; RINGS * SECTORS]));
        }
        assert!((disk_solid_angle(0.5 * PI) - TAU).abs() < 1e-12);
    }
}
