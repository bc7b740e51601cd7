//! Every instruction of general scenes through packing, unpacking and the interpreter on a device: programs of a few records, each
//! evaluated for all channels by the renderer's own kernel, against what `device::instructions` says that they mean, in f64.

use std::collections::BTreeSet;

use glam::DVec3;
use spectile::device::evaluator::EvaluateShape;
use spectile::device::example::with_everything;
use spectile::device::instructions::*;
use spectile::device::part::OnDevice;
use spectile::device::parts::surfaces::Kind;
use spectile::device::prepared::Prepared;
use spectile::device::windows::Windows;
use spectile::device::words::{Lobe, VOLUME_GRID, VOLUME_WORDS, VOLUMES_HEAD, Wave};
use spectile::gpu::adapter::Gpu;
use spectile::gpu::buffer::{self, WARM_UP};
use spectile::gpu::pass::Pass;
use spectile::render::worker::{device_limits, upload};
use spectile::scene::{Evaluator, Wavelengths};
use spectile::spectral::hemisphere::fresnel;
use spectile::spectral::{Channels, planck};

use crate::scene_builder::{Builder, sphere};

const CHANNELS: usize = 6;
/// A place in every channel, in units of 2^-32: 0.3125, exact as f32.
const MU: u32 = 0x5000_0000;
const W: f32 = 0.75;

/// Values of constant spectra, which tables hold exactly.
const A: f64 = 0.5;
const B: f64 = 0.25;
const INDEX: f64 = 1.5;
const ETA: f64 = 0.25;
const K: f64 = 3.5;

/// Some records, and the radiance that they must leave in a channel at a wavelength in nm.
struct Program {
    what: &'static str,
    records: Vec<[u32; 4]>,
    radiance: Box<dyn Fn(usize, f64) -> f64>,
}

fn program(what: &'static str, records: &[[u32; 4]], radiance: impl Fn(usize, f64) -> f64 + 'static) -> Program {
    Program { what, records: records.to_vec(), radiance: Box::new(radiance) }
}

fn record(operation: u32, ab: u32, weight: f32, parameter: f32) -> [u32; 4] {
    [operation, ab, weight.to_bits(), parameter.to_bits()]
}

fn raw(words: [f32; 4]) -> [u32; 4] {
    words.map(f32::to_bits)
}

/// Where a scene with everything has what the programs name.
struct Names {
    a: u32,
    b: u32,
    index: u32,
    metal: u32,
    again: Lobe,
    glass: u32,
    texel: u32,
    coefficients: [f64; 3],
    grid: u32,
    table: Vec<f64>,
}

impl Names {
    fn of(scene: &Prepared) -> Names {
        let surfaces = scene.surfaces.as_ref().expect("a general scene");
        let first = |material: usize| surfaces.lobes[surfaces.materials[material].first_lobe as usize];
        let again =
            surfaces.lobes.iter().find(|lobe| lobe.kind & 0xff == Kind::BoundaryAgain as u32).expect("rough glass");
        let textures = surfaces.textures.as_ref().expect("textures");
        // The first texture is one of colours.
        let texel = textures.words[0];
        let coefficients = std::array::from_fn(|i| f64::from(textures.texels[texel as usize + i]));
        let volumes = &scene.media.as_ref().expect("media").volumes;
        let has_grid = |n: &u32| volumes[(VOLUMES_HEAD + n * VOLUME_WORDS) as usize] & VOLUME_GRID != 0;
        Names {
            a: first(0).ab,
            b: first(1).ab,
            index: first(2).ab,
            metal: first(3).ab,
            again: *again,
            glass: again.ab & 0xffff,
            texel,
            coefficients,
            grid: (0..8).find(has_grid).expect("voxels"),
            table: surfaces.tables.iter().map(|v| f64::from(*v)).collect(),
        }
    }
}

/// The table over index and cosine position that `lobe` names, as `device::parts::surfaces` lays it out: bilinear.
fn eta_table(names: &Names, row: usize, at: f64, eta: f64) -> f64 {
    let head = 128 * (names.again.ab >> 16) as usize;
    let columns = names.table[head + 2];
    let x = ((eta.ln() - names.table[head]) * names.table[head + 1]).clamp(0.0, columns - 1.0);
    let (column, node) = (x.floor(), at.floor());
    let value = |column: f64| {
        let first = head + 128 * (1 + 4 * column as usize + row) + node as usize;
        names.table[first] + (at - node) * (names.table[first + 1] - names.table[first])
    };
    let (low, high) = (value(column), value((column + 1.0).min(columns - 1.0)));
    low + (x - column) * (high - low)
}

/// D(h) |o h| |i h| / (o h + n i h)² (1 - F) with GGX's D (Walter et al. 2007), o in the plane of x and z.
fn rough_transmit(eta: f64, alpha: f64, cos_o: f64, i: DVec3) -> f64 {
    let o = DVec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
    let h = -(o + eta * i).normalize();
    let h = if h.z < 0.0 { -h } else { h };
    let slope = (h.x * h.x + h.y * h.y) / (alpha * alpha) + h.z * h.z;
    let distribution = 1.0 / (std::f64::consts::PI * alpha * alpha * slope * slope);
    let sum = o.dot(h) + eta * i.dot(h);
    distribution * o.dot(h) * i.dot(h).abs() / (sum * sum) * (1.0 - fresnel::dielectric(o.dot(h), eta))
}

/// The index of the glass that the scene with everything adds.
fn glass(nm: f64, channels: &Channels) -> f64 {
    let low = channels.bounds.iter().map(|b| b[0]).fold(f64::INFINITY, f64::min);
    let high = channels.bounds.iter().map(|b| b[1]).fold(0.0, f64::max);
    1.6 - 0.1 * (nm - low) / (high - low)
}

fn programs(names: Names, channels: &Channels) -> Vec<Program> {
    let w = f64::from(W);
    let (a, b, index, metal, glass_id) = (names.a, names.b, names.index, names.metal, names.glass);
    let (texel, grid, again) = (names.texel, names.grid, names.again.ab);
    // Gathers what F is, times S_b.
    let gather = MODE_GATHER | b << 16;
    let alone = MODE_SINGLE | gather;
    let one = |mode: u32| record(OP_ONE | mode, 0, 1.0, 0.0);
    let cosine = 0.625f32;
    let c = f64::from(cosine);
    let (reflected, behind) = (fresnel::dielectric(c, INDEX), fresnel::dielectric(0.875, 1.0 / INDEX));
    let of_metal = fresnel::conductor(c, ETA, K);
    let towards = DVec3::new(-0.4, 0.2, -0.9).normalize().as_vec3();
    let through = rough_transmit(INDEX, f64::from(0.4f32), c, towards.as_dvec3());
    let [c0, c1, c2] = names.coefficients;
    let smooth = move |nm: f64| {
        let t = (nm - 360.0) / (830.0 - 360.0);
        let x = (c0 * t + c1) * t + c2;
        0.5 + 0.5 * x / (1.0 + x * x).sqrt()
    };
    // Rows of tables over index and cosine: what is lost from before, and what is reflected before.
    let at = 40.25f32;
    let of_glass = {
        let channels = channels.clone();
        move |nm: f64| glass(nm, &channels)
    };
    let (lost_in, loss) = (of_glass.clone(), std::rc::Rc::new(names));
    let entering = std::rc::Rc::clone(&loss);
    let metres = 2.0f32;
    let thinned = (-f64::from(metres) * A).exp();
    vec![
        program("OP_PLAIN", &[record(OP_PLAIN | b << 16, a, W, 0.0)], move |_, _| A * w * B),
        program("OP_PLAIN", &[record(OP_PLAIN, a, 0.0, 0.0), record(OP_PLAIN | b << 16, b, W, 0.0)], move |_, _| {
            A * B * w * B
        }),
        program("OP_ONE", &[record(OP_ONE | alone, 0, W, 0.0)], move |_, _| w * B),
        program("OP_SPECTRUM", &[record(OP_SPECTRUM | alone, a, W, 0.0)], move |_, _| w * A * B),
        // A product, and a sum of two.
        program(
            "OP_SPECTRUM",
            &[record(OP_SPECTRUM | MODE_START, a, W, 0.0), record(OP_SPECTRUM | MODE_ADD | gather, b, 3.0, 0.0)],
            move |_, _| w * A * 3.0 * B * B,
        ),
        program(
            "OP_SPECTRUM",
            &[record(OP_SPECTRUM | MODE_SINGLE, a, W, 0.0), record(OP_SPECTRUM | alone, b, 3.0, 0.0)],
            move |_, _| (w * A + 3.0 * B) * B,
        ),
        // A factor on what is there, and throughput.
        program(
            "OP_SPECTRUM",
            &[record(OP_SPECTRUM | MODE_SINGLE, a, W, 0.0), record(OP_SPECTRUM | MODE_ON_F | gather, b, 3.0, 0.0)],
            move |_, _| w * A * 3.0 * B * B,
        ),
        program(
            "OP_SPECTRUM",
            &[record(OP_SPECTRUM | MODE_SINGLE | MODE_ADVANCE, a, W, 0.0), one(alone)],
            move |_, _| w * A * B,
        ),
        program("OP_FRESNEL", &[record(OP_FRESNEL | alone, index, W, cosine)], move |_, _| w * reflected * B),
        program("OP_FRESNEL", &[record(OP_FRESNEL | MODE_BEHIND | alone, index, W, 0.875)], move |_, _| w * behind * B),
        program("OP_TRANSMIT", &[record(OP_TRANSMIT | alone, index, W, cosine)], move |_, _| w * (1.0 - reflected) * B),
        program(
            "OP_TRANSMIT",
            &[record(OP_TRANSMIT | MODE_SQUARE | MODE_BEHIND | alone, index, W, 0.875)],
            move |_, _| w * (1.0 - behind) * INDEX * INDEX * B,
        ),
        program("OP_CONDUCTOR", &[record(OP_CONDUCTOR | alone, metal, W, cosine)], move |_, _| w * of_metal * B),
        program("OP_EMITTANCE", &[record(OP_EMITTANCE | alone, metal, W, cosine)], move |_, _| {
            w * (1.0 - of_metal) * B
        }),
        program("OP_ETA_TABLE", &[record(OP_ETA_TABLE | alone, again, W, at)], move |_, nm| {
            w * eta_table(&loss, 1, f64::from(at), lost_in(nm)) * B
        }),
        program("OP_ETA_TABLE", &[record(OP_ETA_TABLE | MODE_SQUARE | alone, again, W, at)], move |_, nm| {
            w * (1.0 - eta_table(&entering, 0, f64::from(at), of_glass(nm))) * B
        }),
        program("OP_ONLY", &[record(OP_ONLY | alone, 3, W, 0.0)], move |k, _| if k == 3 { w * B } else { 0.0 }),
        // The scene's map is the same in all directions and bands.
        program("OP_MAP", &[[OP_MAP | alone, 1 | 1 << 16, (1e30f32).to_bits(), 0x4000 | 0x8000 << 16]], move |_, _| {
            1e30 * f64::from(1e-30f32) * B
        }),
        program("OP_SMOOTH", &[record(OP_SMOOTH | alone, texel, W, 0.0)], move |_, nm| w * smooth(nm) * B),
        program(
            "OP_INNER",
            &[record(OP_SPECTRUM | MODE_KEEP, a, W, 0.0), record(OP_INNER | alone, b, 2.0, 0.0)],
            move |_, _| 2.0 * w * A / (1.0 - w * A * B) * B,
        ),
        program(
            "OP_ABSORBED",
            &[record(OP_SPECTRUM | MODE_KEEP, a, W, 0.0), record(OP_ABSORBED | alone, b, 2.0, 0.5)],
            move |_, _| 2.0 * (1.0 - w * A) / (1.0 - w * A * 0.5 * B) * B,
        ),
        program("OP_MEDIUM", &[record(OP_MEDIUM | b << 16, a, W, metres), one(alone)], move |_, _| {
            w * (1.0 - thinned) * B + thinned * B
        }),
        program("OP_EXTINCTION", &[record(OP_EXTINCTION | alone, a, W, metres)], move |_, _| w * thinned * B),
        // Across voxels of absorption 1e-30 and almost no temperature, for so many metres: the whole way is one optical depth.
        program(
            "OP_MARCH",
            &[record(OP_MARCH, grid, W, 1e30), raw([0.25, 0.5, 0.5, 0.0]), raw([1.75, 0.75, 0.5, 0.0]), one(alone)],
            move |_, _| (-1e30f64 * 1e-30).exp() * B,
        ),
        // On T, and on F.
        program("OP_AMOUNTS", &[record(OP_AMOUNTS, a | b << 16, metres, 3.0), one(alone)], move |_, _| {
            (-2.0 * A - 3.0 * B).exp() * B
        }),
        program(
            "OP_AMOUNTS",
            &[
                record(OP_ONE | MODE_SINGLE, 0, W, 0.0),
                record(OP_AMOUNTS | MODE_ON_F | gather, a | b << 16, metres, 3.0),
                one(alone),
            ],
            move |_, _| w * (-2.0 * A - 3.0 * B).exp() * B + B,
        ),
        program(
            "OP_SAVE",
            &[
                record(OP_SPECTRUM | MODE_SINGLE | MODE_ADVANCE, a, 1.0, 0.0),
                record(OP_SAVE, 0, 0.0, 0.0),
                record(OP_AMOUNTS, a | b << 16, metres, 3.0),
                record(OP_RESTORE, 0, 0.0, 0.0),
                one(alone),
            ],
            move |_, _| A * B,
        ),
        program("OP_RESTORE", &[record(OP_RESTORE, 0, 0.0, 0.0), one(alone)], |_, _| 0.0),
        // 0.375 is 1 - the cosine.
        program("OP_HENYEY_GREENSTEIN", &[record(OP_HENYEY_GREENSTEIN | alone, a | b << 16, W, 0.375)], move |_, _| {
            w * A * (1.0 - B * B) / (1.0 + B * B - 2.0 * B * 0.625).powf(1.5) * B
        }),
        // The scene's table is the same in all directions; a place between its columns is one.
        program("OP_PHASE_TABLE", &[record(OP_PHASE_TABLE | alone, a, W, 40.25)], move |_, _| w * B),
        program("OP_PLANCK", &[record(OP_PLANCK | alone, 0, W, 5000.0)], move |_, nm| {
            w * planck::radiance(nm, 5000.0) * B
        }),
        program(
            "OP_HOLD",
            &[
                record(OP_SPECTRUM | MODE_SINGLE, a, W, 0.0),
                record(OP_HOLD, 0, 0.0, 0.0),
                record(OP_ONE | MODE_SINGLE, 0, 3.0, 0.0),
                record(OP_HELD | MODE_ON_F | gather, 0, 1.0, 0.0),
            ],
            move |_, _| 3.0 * w * A * B,
        ),
        program("OP_HELD", &[record(OP_HELD | alone, 0, W, 0.0)], |_, _| 0.0),
        program(
            "OP_ROUGH_TRANSMIT",
            &[
                record(OP_ROUGH_TRANSMIT | alone, index, W, 0.4),
                raw([cosine, towards.x, towards.y, towards.z]),
                record(OP_ONE | alone, 0, W, 0.0),
            ],
            move |_, _| w * through * B + w * B,
        ),
        // The index of glass that disperses differs from channel to channel.
        program("OP_SPECTRUM", &[record(OP_SPECTRUM | alone, glass_id, W, 0.0)], {
            let channels = channels.clone();
            move |_, nm| w * glass(nm, &channels) * B
        }),
    ]
}

/// Rounding of some fifty f32 operations, amplified by exponents of up to 8; linear spectra are lines in their tables.
const BOUND: f64 = 2e-5;

#[test]
fn every_instruction_means_what_it_says() {
    let mut scene = Builder::new()
        .channels(Channels::equal(400.0, 700.0, CHANNELS))
        .diffuse(sphere(DVec3::ZERO, 0.1), A)
        .diffuse(sphere(DVec3::X, 0.1), B)
        .dielectric(sphere(DVec3::Y, 0.1), INDEX, 0.0)
        .conductor(sphere(DVec3::Z, 0.1), ETA, K, [0.0; 2])
        .build();
    scene.integrator.wavelengths = Wavelengths::Uniform;
    scene.integrator.max_bounces = 4;
    let scene = with_everything(&scene);
    for evaluator in [Evaluator::DpeptSpectral, Evaluator::DpeptPixel] {
        let prepared = Prepared::for_evaluator(&scene, 0, evaluator).expect("a scene that fits");
        let gpu = Gpu::open().expect("a device");
        let windows = Windows::of(&prepared.accel, device_limits(&gpu).binding).expect("windows");
        let on_device = OnDevice { prepared: &prepared, windows };
        let kernels = on_device.kernels(EvaluateShape::of(&prepared, gpu.is_software));
        let pass = Pass::new(&gpu, kernels.evaluate.as_ref().expect("channels are evaluated")).expect("a kernel");
        let buffers = upload(&gpu, &on_device).expect("buffers");

        let programs = programs(Names::of(&prepared), &scene.channels);
        let walked: BTreeSet<&str> = programs.iter().map(|program| program.what).collect();
        let all: BTreeSet<&str> = INSTRUCTIONS.iter().map(|instruction| instruction.name).collect();
        assert_eq!(walked, all);

        // A pixel and a path for each.
        let count = programs.len() as u32;
        let most = prepared.max_records() as usize;
        let mut records = vec![[0u32; 4]; most * programs.len()];
        let sequence = 7;
        let mut heads = Vec::new();
        for (n, program) in programs.iter().enumerate() {
            records[n * most..][..program.records.len()].copy_from_slice(&program.records);
            heads.push([MU, program.records.len() as u32 | sequence << 16]);
        }
        let wave = Wave {
            path_count: count,
            pixel_count: count,
            samples: 1,
            tile_width: count,
            tile_pixels: count,
            sequence,
            ..Wave::default()
        };
        let uniform = |name: &str, bytes: &[u8]| buffer::uniform(&gpu, name, bytes);
        let (wave, step) = (uniform("wave", bytemuck::bytes_of(&wave)), uniform("step", &[0; 16]));
        let records = buffer::storage(&gpu, "records", &records).expect("records");
        let heads = buffer::storage(&gpu, "heads", &heads).expect("heads");
        let counters = buffer::output(&gpu, "counters", 64);
        let size = u64::from(count) * CHANNELS as u64 * 4;
        let means = buffer::output(&gpu, "means", size);
        pass.run(&gpu, [count, 1], |name| match name {
            "wave" => Some(wave.as_entire_buffer_binding()),
            "step" => Some(step.as_entire_buffer_binding()),
            "records" => Some(records.as_entire_buffer_binding()),
            "heads" => Some(heads.as_entire_buffer_binding()),
            "counters" => Some(counters.as_entire_buffer_binding()),
            "means" => Some(means.as_entire_buffer_binding()),
            _ => buffers.find(name),
        })
        .expect("a run");
        let means: Vec<f32> = buffer::read(&gpu, &means, size, WARM_UP).expect("means");
        for (n, program) in programs.iter().enumerate() {
            for k in 0..CHANNELS {
                let nm = scene.channels.wavelength(k, f64::from(MU) / 4_294_967_296.0);
                let (got, expected) = (f64::from(means[n * CHANNELS + k]), (program.radiance)(k, nm));
                assert!(
                    (got - expected).abs() <= BOUND * expected.abs().max(1e-6),
                    "{evaluator:?}: {} {:x?}: {got} instead of {expected} in channel {k}",
                    program.what,
                    program.records
                );
            }
        }
    }
}
