//! An environment map as devices get it: texels, and tables by which directions are chosen (shaders/parts/sky/map.wgsl).

use std::f64::consts::{PI, TAU};

use crate::device::part::{Part, Place, Records, SceneBuffer};
use crate::device::parts::lights::STEPS;
use crate::device::separable::Separable;
use crate::device::text::module;
use crate::scene::{EnvironmentMap, Scene, Texels};
use crate::spectral::skylight;
use crate::spectral::{Channels, Curve, Outside, upsample};

pub const UNIFORM: Part = Part {
    name: "environment",
    used: |scene| scene.features.environment,
    effect: |_| "one light to choose from".into(),
    is_planned: true,
    modules: &[(Place::Stage, module!("parts/sky/uniform.wgsl"))],
    lines: &[("BEYOND", "arrive_from_uniform_sky(&list, path.scale);")],
    defines: |_, _, defines| _ = defines.set("ENVIRONMENT", true),
    ..Part::NOTHING
};

pub const MAP: Part = Part {
    name: "environment map",
    used: |scene| scene.sky.is_some(),
    effect: |_| "two records a bounce".into(),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/sky/map.wgsl")),
        (Place::Stage, module!("parts/sky/append_map.wgsl")),
        (Place::Evaluate, module!("parts/sky/map_value.wgsl")),
    ],
    lines: &[
        ("BEYOND", "arrive_from_map(&list, path);"),
        ("AIM_AT_MAP", "if (aim_at_map(&aim, choice, u)) { return aim; }"),
        ("LIGHT_TAKES_RECORDS", "if (aim.from_map) { return true; }"),
        ("LIGHT_RECORDS", "if (aim.from_map) { append_map(list, MODE_ON_F, aim.map_place, 1.0); }"),
    ],
    defines: |scene, _, defines| {
        let Some(map) = &scene.sky else { return };
        defines.set("MAP", true).set("OP_MAP", true).constant("MAP_SOURCE", map.source_id);
        defines.constant("MAP_AXIS", map.axis_id);
        defines.constant("MAP_WIDTH", map.size[0]).constant("MAP_HEIGHT", map.size[1]);
        if let Some(bands) = map.bands {
            defines.set("MAP_SPECTRAL", true).constant("MAP_BANDS", bands);
        }
        let separable = scene.separable.as_ref();
        defines.set("MAP_SEPARATES", separable.is_some_and(Separable::has_map));
        defines.set("MAP_LEFT", separable.is_some_and(|separable| separable.left_of_map().is_some()));
    },
    buffers: |scene| {
        let buffers = scene.prepared.sky.as_ref().map(|map| {
            [
                SceneBuffer::new("map_table", &map.table, "the environment map", "a smaller one"),
                SceneBuffer::new("map_texels", &map.texels, "the environment map", "a smaller one"),
            ]
        });
        buffers.into_iter().flatten().collect()
    },
    // A direction in a map is an instruction of its own, and parts a diffuse vertex in two.
    records: |_| Records { vertex: 2, ..Records::NONE },
    example: Some(|exhibit| exhibit.add_map()),
    ..Part::NOTHING
};

/// Wavelengths at which colours are compared: they are smooth.
const RGB_POINTS: usize = 12;

pub struct SkyMap {
    /// Width and height.
    pub size: [u32; 2],
    /// RGB: four numbers a texel, coefficients and scale. Spectral: one for each band; then once more of what sources of products leave.
    pub texels: Vec<f32>,
    /// Bands of a spectral map.
    pub bands: Option<u32>,
    /// Place of a wavelength: t of a smooth spectrum; or among the bands, the first at 1, and 0 outside.
    pub axis: Curve,
    /// Ids of its spectrum, and of the one that multiplies all texels.
    pub axis_id: u32,
    pub source_id: u32,
    /// Rotation, row and column intervals, importance.
    pub table: Vec<f32>,
    /// ∫ radiance over all directions, W m⁻² nm⁻¹; of RGB maps that of their mean colour.
    pub flux: Curve,
}

impl SkyMap {
    pub fn new(scene: &Scene, map: &EnvironmentMap) -> SkyMap {
        let scaled = |value: f32| (f64::from(value) * map.scale) as f32;
        let (texels, bands, axis, flux, importance) = match &map.texels {
            Texels::Rgb { rgb, .. } => {
                let tints = skylight::tints(rgb);
                let words = |t: &skylight::Tint| {
                    let [a, b, c] = t.smooth.0;
                    [a, b, c, t.scale * map.scale].map(|v| v as f32)
                };
                let texels = tints.iter().flat_map(words).collect();
                let [first, last] = [upsample::FIRST_NM, upsample::LAST_NM].map(f64::from);
                let axis = Curve::Linear { nm: vec![first, last], value: vec![0.0, 1.0], outside: Outside::Hold };
                let mean =
                    |i: usize| (0..tints.len()).map(|t| solid_angle(map, t) * f64::from(rgb[3 * t + i])).sum::<f64>();
                let flux = upsample::emission([0, 1, 2].map(|i| mean(i) * map.scale));
                let nm = representative(&scene.channels);
                (texels, None, axis, flux, importance(map, nm.len(), |t, i| tints[t].eval(nm[i])))
            }
            Texels::Spectral { nm, radiance } => {
                let texels: Vec<f32> = radiance.iter().map(|v| scaled(*v)).collect();
                let count = nm.len();
                let axis = Curve::Linear {
                    nm: nm.clone(),
                    value: (1..=count).map(|i| i as f64).collect(),
                    outside: Outside::Zero,
                };
                let total = |band: usize| {
                    let texels = radiance.chunks_exact(count).enumerate();
                    texels.map(|(t, values)| solid_angle(map, t) * f64::from(values[band])).sum::<f64>() * map.scale
                };
                let flux =
                    Curve::Linear { nm: nm.clone(), value: (0..count).map(total).collect(), outside: Outside::Zero };
                let used = bands_in_use(nm, &scene.channels);
                let importance = importance(map, used.len(), |t, i| f64::from(radiance[t * count + used[i]]));
                (texels, Some(count as u32), axis, flux, importance)
            }
        };
        SkyMap { size: map.size, texels, bands, axis, axis_id: 0, source_id: 0, table: table(map, &importance), flux }
    }

    /// Appends what products leave of the map, which is of the remainder.
    pub fn append_left(&mut self, separable: &Separable) {
        let Some((left, scale)) = separable.left_of_map() else { return };
        self.texels.extend(left.iter().map(|v| (f64::from(*v) * scale) as f32));
    }
}

/// Wavelengths spread over the channels.
fn representative(channels: &Channels) -> Vec<f64> {
    let (count, points) = (channels.len(), channels.len().min(RGB_POINTS));
    if count < RGB_POINTS {
        return (0..count).flat_map(|k| [0.25, 0.75].map(|mu| channels.wavelength(k, mu))).collect();
    }
    (0..points).map(|i| channels.wavelength((2 * i + 1) * count / (2 * points), 0.5)).collect()
}

/// Bands that add to some channel.
fn bands_in_use(nm: &[f64], channels: &Channels) -> Vec<usize> {
    let last = nm.len() - 1;
    let adds = |&band: &usize| {
        let (from, to) = (nm[band.saturating_sub(1)], nm[(band + 1).min(last)]);
        channels.bounds.iter().any(|[a, b]| *a <= to && from <= *b)
    };
    (0..nm.len()).filter(adds).collect()
}

/// Cosines of the polar angles at the edges of a row of texels.
fn edges(map: &EnvironmentMap, row: usize) -> [f64; 2] {
    [row, row + 1].map(|edge| (PI * edge as f64 / f64::from(map.size[1])).cos())
}

fn solid_angle(map: &EnvironmentMap, texel: usize) -> f64 {
    let [top, bottom] = edges(map, texel / map.size[0] as usize);
    TAU / f64::from(map.size[0]) * (top - bottom)
}

/// Importance of each texel, 1 at most: ½ mean over the wavelengths of its share + ½ its largest share, the latter normalised over all
/// directions (docs/METHOD.md, Decisions). `radiance(texel, i)` is that at wavelength `i`.
fn importance(map: &EnvironmentMap, wavelengths: usize, radiance: impl Fn(usize, usize) -> f64) -> Vec<f32> {
    let texels = map.size[0] as usize * map.size[1] as usize;
    let total = |i: usize| (0..texels).map(|t| solid_angle(map, t) * radiance(t, i)).sum::<f64>();
    let totals: Vec<f64> = (0..wavelengths).map(total).collect();
    let lit: Vec<usize> = (0..wavelengths).filter(|&i| totals[i] > 0.0).collect();
    if lit.is_empty() {
        return vec![1.0; texels];
    }
    let share = |t: usize, i: usize| radiance(t, i) / totals[i];
    let mean = |t: usize| lit.iter().map(|&i| share(t, i)).sum::<f64>() / lit.len() as f64;
    let largest: Vec<f64> = (0..texels).map(|t| lit.iter().map(|&i| share(t, i)).fold(0.0, f64::max)).collect();
    let largest_total: f64 = largest.iter().enumerate().map(|(t, l)| solid_angle(map, t) * l).sum();
    let all: Vec<f64> = (0..texels).map(|t| 0.5 * mean(t) + 0.5 * largest[t] / largest_total).collect();
    let peak = all.iter().copied().fold(0.0, f64::max);
    // The least of what is above 0 stays above it, with its square, as f32.
    all.into_iter().map(|w| if w > 0.0 { (w / peak).max(1e-18) as f32 } else { 0.0 }).collect()
}

fn table(map: &EnvironmentMap, importance: &[f32]) -> Vec<f32> {
    let [width, height] = map.size.map(|side| side as usize);
    let at = |column: usize, row: usize| f64::from(importance[row * width + column % width]);
    // Rows of cells lie between those of texels, the first and the last half as high.
    let edge = |row: f64| (PI * (row / height as f64).clamp(0.0, 1.0)).cos();
    let mut rows = Vec::with_capacity(height + 1);
    let mut columns = Vec::with_capacity((height + 1) * width);
    for row in 0..=height {
        let (upper, lower) = (row.max(1) - 1, row.min(height - 1));
        let cells: Vec<f64> =
            (0..width).map(|i| at(i, upper) + at(i + 1, upper) + at(i, lower) + at(i + 1, lower)).collect();
        rows.push(cells.iter().sum::<f64>() * (edge(row as f64 - 0.5) - edge(row as f64 + 0.5)));
        columns.extend(intervals(&cells));
    }
    let rotation = [map.to_map.x_axis, map.to_map.y_axis, map.to_map.z_axis];
    let mut table: Vec<f32> = rotation.iter().flat_map(|column| column.to_array()).map(|v| v as f32).collect();
    table.extend([0.0; 3]);
    table.extend(intervals(&rows));
    table.extend(columns);
    table.extend(importance);
    table
}

/// Upper ends of intervals of [0, 1) in proportion to `weights`, in steps of the random numbers; whatever has a weight has at
/// least a step, of which there are enough.
fn intervals(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let mut to_come = weights.iter().filter(|w| **w > 0.0).count() as f64;
    let (mut sum, mut end) = (0.0, 0.0);
    let last = weights.len() - 1;
    let mut ends = Vec::with_capacity(weights.len());
    for (i, weight) in weights.iter().enumerate() {
        if total <= 0.0 {
            end = ((i + 1) as f64 * STEPS / weights.len() as f64).round();
        } else if *weight > 0.0 {
            sum += weight;
            to_come -= 1.0;
            let wanted = (sum / total * STEPS).round();
            end = if to_come == 0.0 { STEPS } else { wanted.clamp(end + 1.0, STEPS - to_come) };
        }
        // Nothing is chosen beyond the last that has a weight.
        ends.push(if i == last { 1.0 } else { (end / STEPS) as f32 });
    }
    ends
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;
    use glam::DMat3;
    use std::path::Path;

    fn scene_of_channels(text: &str) -> Scene {
        let text = format!(
            "camera.perspective = {{ position = [0, 0, 5], look_at = [0, 0, 0], fov = 60 }}
            film = {{ width = 1, height = 1 }}
            {text}"
        );
        scene::parse(&text, Path::new("t.toml"), &[]).unwrap_or_else(|e| panic!("{e}"))
    }

    fn map(size: [u32; 2], texels: Texels) -> EnvironmentMap {
        EnvironmentMap { name: "map".into(), to_map: DMat3::IDENTITY, scale: 2.0, size, texels }
    }

    #[test]
    fn intervals_keep_everything_that_has_a_weight() {
        let weights: Vec<f64> =
            (0..5000).map(|i| [0.0, 1.0, 1e-30, 0.0, 3e5][i % 5] * f64::from(1 + i as u32 % 7)).collect();
        let ends = intervals(&weights);
        let total: f64 = weights.iter().sum();
        let mut before = 0.0;
        for (i, (end, weight)) in ends.iter().zip(&weights).enumerate() {
            let steps = f64::from(end - before) * STEPS;
            assert_eq!(steps, steps.round(), "{i}");
            assert_eq!(steps > 0.0, *weight > 0.0, "{i}: {steps} steps for {weight}");
            // Each of the few that are lifted to a step moves the others by one at most.
            assert!((steps - weight / total * STEPS).abs() <= 3000.0, "{i}: {steps} steps for {weight}");
            before = *end;
        }
        assert_eq!(before, 1.0);
        assert_eq!(intervals(&[0.0; 4]), [0.25, 0.5, 0.75, 1.0]);
        assert_eq!(intervals(&[0.0, 1.0, 0.0]), [0.0, 1.0, 1.0]);
    }

    /// The density that the table describes, integrated over the sphere, is 1, and positive wherever there is radiance:
    /// checked by the same formulas as the shader's, in f64, at points within every cell.
    #[test]
    fn importance_covers_the_sphere_and_every_channel() {
        // Two bands, each bright where the other is dark, one 10^8 times the other.
        let (width, height) = (5, 4);
        let mut radiance = vec![0f32; 2 * width * height];
        radiance[2 * 7] = 1e8;
        radiance[2 * 12 + 1] = 1.0;
        let scene = scene_of_channels("channels.intervals = [[400, 450], [650, 700]]");
        let texels = Texels::Spectral { nm: vec![425.0, 675.0], radiance: radiance.into() };
        let sky = SkyMap::new(&scene, &map([width as u32, height as u32], texels));
        let importance = &sky.table[sky.table.len() - width * height..];
        for (t, w) in importance.iter().enumerate() {
            assert_eq!(*w > 0.0, t == 7 || t == 12, "{t}: {w}");
        }
        // Both own all of a channel: equal shares of the sphere, the same in solid angle.
        let flux = |t: usize| {
            f64::from(importance[t]) * solid_angle(&map([5, 4], Texels::Rgb { rgb: vec![].into(), daylight: 0 }), t)
        };
        assert!((flux(7) / flux(12) - 1.0).abs() < 1e-5, "{} {}", flux(7), flux(12));
        // Flux: radiance x scale x solid angle.
        let omega = TAU / 5.0 * ((PI / 4.0).cos() - (PI / 2.0).cos());
        assert!((sky.flux.eval(425.0) / (2e8 * omega) - 1.0).abs() < 1e-12);
        assert_eq!((sky.axis.eval(425.0), sky.axis.eval(675.0), sky.axis.eval(420.0)), (1.0, 2.0, 0.0));
    }

    #[test]
    fn a_grey_map_has_the_importance_of_the_sphere() {
        let scene = scene_of_channels("channels.equal = { from = 400, to = 700, count = 40 }");
        let rgb = vec![1f32; 3 * 6 * 3];
        let sky = SkyMap::new(&scene, &map([6, 3], Texels::Rgb { rgb: rgb.into(), daylight: 0 }));
        let importance = &sky.table[sky.table.len() - 18..];
        assert!(importance.iter().all(|w| (w - 1.0).abs() < 1e-6), "{importance:?}");
        // Rows of cells by their share of the sphere: edges at 0, 30, 90, 150, 180 degrees.
        let rows = &sky.table[12..16];
        for (row, degrees) in rows.iter().zip([30.0f64, 90.0, 150.0, 180.0]) {
            let share = 0.5 * (1.0 - degrees.to_radians().cos());
            assert!((f64::from(*row) - share).abs() < 1e-6, "{rows:?}");
        }
        // Four coefficients a texel: those of a grey, and twice the colour, times the map's scale of 2.
        assert_eq!(sky.texels[..4], [0.0, 0.0, 0.0, 4.0]);
        assert!((sky.flux.eval(560.0) / (2.0 * 4.0 * PI * upsample::daylight().eval(560.0)) - 1.0).abs() < 1e-9);
    }
}
