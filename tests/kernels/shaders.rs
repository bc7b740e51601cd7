//! Every shader that a scene can compose, without a device: parsed and validated by naga, made into a pipeline on wgpu's
//! `noop` backend, small, and free of what the scene does not need.

use std::sync::LazyLock;

use glam::{DMat3, DVec2, DVec3};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use spectile::device::evaluator::EvaluateShape;
use spectile::device::example::{with_everything, with_parts};
use spectile::device::part::{OnDevice, PARTS};
use spectile::device::parts::paths::Thinning;
use spectile::device::prepared::{Features, Prepared};
use spectile::device::windows::{WindowList, Windows};
use spectile::gpu::pass::storage_buffers;
use spectile::gpu::source::Source;
use spectile::scene::{
    Attributes, Evaluator, Field, Filter, Projection, Sampler, Scene, Shape, Sides, Texels, TextureKind,
};
use spectile::spectral::{Channels, Curve};

use crate::scene_builder::*;

/// Bytes of a kernel's code, comments and indentation apart: of a plain scene's, and of one that needs everything and spreads its
/// geometry over four windows. More is a sign that something is compiled in twice or without need.
const MAX_PLAIN_BYTES: usize = 18 << 10;
const MAX_BYTES: usize = 32 << 10;
/// Of general scenes, by what their materials need; the largest have the two largest parts.
const MAX_GENERAL_BYTES: usize = 88 << 10;
/// Of the scene with everything, which nobody renders.
const MAX_EVERYTHING_BYTES: usize = 116 << 10;

/// Storage buffers that the fullest scene's largest kernel binds, four windows each of nodes and primitives included; and a plain
/// scene's with one of each. What devices offer: Metal 29 through wgpu-hal 30, Vulkan on GPUs thousands, lavapipe of Mesa 22.3 32.
const MOST_STORAGE_BUFFERS: u32 = 31;
const PLAIN_STORAGE_BUFFERS: u32 = 11;

const EVALUATORS: [Evaluator; 4] =
    [Evaluator::DpeptPixel, Evaluator::DpeptPath, Evaluator::DpeptSpectral, Evaluator::Pt];

fn plain_scene() -> Scene {
    Builder::new()
        .channels(Channels::equal(400.0, 700.0, 10))
        .diffuse(room(DVec3::NEG_ONE, DVec3::ONE), 0.5)
        .lamp(quad(DVec3::new(-0.3, 0.9, -0.3), 0.6 * DVec3::X, 0.6 * DVec3::Z), 1.0, Sides::Front)
        .build()
}

fn windows(nodes: u32, primitives: u32) -> Windows {
    Windows { nodes: WindowList { count: nodes, size: 1000 }, primitives: WindowList { count: primitives, size: 2000 } }
}

/// Roulette on evaluation, whatever a pilot would say.
fn some_paths(prepared: &Prepared) -> Thinning {
    Thinning::new(prepared, 1.0, &vec![1.0; prepared.channels])
}

/// The passes of `prepared`, as the worker composes them.
fn passes(prepared: &Prepared, windows: &Windows, shape: EvaluateShape) -> Vec<Source> {
    let kernels = OnDevice { prepared, windows: *windows }.kernels(shape);
    kernels.all().cloned().collect()
}

/// All combinations of the features that change a pass's text; combinations that no scene has are left out.
fn combinations() -> Vec<Features> {
    let bit = |i: u32, at: u32| i >> at & 1 == 1;
    (0..1u32 << 12)
        .map(|i| Features {
            // One camera of four.
            thin_lens: i & 3 == 1,
            orthographic: i & 3 == 2,
            latlong: i & 3 == 3,
            pushbroom: false,
            gaussian: bit(i, 2),
            independent: bit(i, 3),
            emitters: bit(i, 4),
            environment: bit(i, 5),
            shapes: bit(i, 6),
            roulette: bit(i, 7),
            strata: bit(i, 8),
            knots: bit(i, 9),
            registers: bit(i, 10),
            few_triangles: bit(i, 11),
        })
        .filter(|f| !(f.knots && f.registers || f.shapes && f.few_triangles))
        .collect()
}

/// Every distinct text, with a description of what it was composed for.
fn all_sources() -> &'static [(String, Source)] {
    static ALL: LazyLock<Vec<(String, Source)>> = LazyLock::new(compose_plain);
    &ALL
}

fn compose_plain() -> Vec<(String, Source)> {
    let mut prepared = Prepared::new(&plain_scene(), 0).unwrap();
    let shapes = [(1, true), (3, false), (25, true), (500, true), (1250, false)]
        .map(|(quads, software)| EvaluateShape::new(quads, software));
    let mut found = std::collections::HashMap::new();
    for (i, features) in combinations().into_iter().enumerate() {
        // So do the evaluators; only one has spectra in registers.
        prepared.evaluator = if features.registers { Evaluator::DpeptPixel } else { EVALUATORS[i % EVALUATORS.len()] };
        prepared.features = features;
        prepared.tables.kinks = if features.registers && !features.strata { i as u32 % 3 } else { 0 };
        prepared.wavelengths_per_channel = [1, 1, 4][i % 3];
        prepared.thinning = (i % 5 == 2 && prepared.evaluator != Evaluator::Pt).then(|| some_paths(&prepared));
        // Windows and workgroups take turns among the combinations, and all are seen with all features off and on.
        let windows = windows(1 + i as u32 % 4, 1 + i as u32 / 4 % 4);
        let shape = EvaluateShape { batches: Some(2), ..shapes[i % shapes.len()] };
        for source in passes(&prepared, &windows, shape) {
            found
                .entry(source.text.clone())
                .or_insert_with(|| (format!("{} for {features:?}, {windows:?}", source.label), source));
        }
    }
    found.into_values().collect()
}

fn code_bytes(text: &str) -> usize {
    text.lines().map(|l| l.split("//").next().unwrap_or("").trim()).filter(|l| !l.is_empty()).map(|l| l.len() + 1).sum()
}

fn validate(what: &str, source: &Source) -> naga::Module {
    let module = source.parse().unwrap_or_else(|e| panic!("{what}: {e}"));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(&module).unwrap_or_else(|e| panic!("{what}: {}", e.emit_to_string(&source.text)));
    module
}

/// Every composed text parses, validates with no capability beyond the core, has one entry point called like its file,
/// and stays small.
#[test]
fn every_permutation_is_valid() {
    let sources = all_sources();
    assert!(sources.len() > 200, "{} texts", sources.len());
    let general = general_sources();
    let all = sources.iter().map(|s| (s, MAX_BYTES)).chain(general.iter().map(|s| (s, MAX_GENERAL_BYTES)));
    for ((what, source), most) in all {
        let module = validate(what, source);
        let names: Vec<&str> = module.entry_points.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, [source.label], "{what}");
        let most = if what.ends_with("for everything") { MAX_EVERYTHING_BYTES } else { most };
        assert!(code_bytes(&source.text) <= most, "{what}: {} bytes", code_bytes(&source.text));
    }
}

/// wgpu makes pipelines of them: a sample of all permutations, each feature on and off in each pass.
#[test]
fn pipelines_on_the_noop_backend() {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    descriptor.backend_options.noop.enable = true;
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).expect("noop");
    let (device, _queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits {
            max_storage_buffers_per_shader_stage: MOST_STORAGE_BUFFERS,
            // With the uniforms: scene, wave and step.
            max_buffers_and_acceleration_structures_per_shader_stage: MOST_STORAGE_BUFFERS + 3,
            ..wgpu::Limits::default()
        },
        ..Default::default()
    }))
    .expect("a noop device");
    for (what, source) in all_sources().iter().step_by(3).chain(general_sources()) {
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(source.label),
            source: wgpu::ShaderSource::Wgsl(source.text.as_str().into()),
        });
        let _pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(source.label),
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            cache: None,
        });
        let error = pollster::block_on(scope.pop());
        assert!(error.is_none(), "{what}: {error:?}");
    }
}

/// What scenes ask of devices: no kernel binds more than is said here, and the fullest as many.
#[test]
fn storage_buffers_are_counted() {
    let count = |(what, source): &(String, Source)| (storage_buffers(source).expect("a valid text"), what.clone());
    let all: Vec<_> = general_sources().iter().chain(all_sources()).map(count).collect();
    let full = with_everything(&Builder(plain_scene()).roulette(1).build());
    let full = Prepared::new(&full, 0).expect("a scene that fits");
    let fullest = passes(&full, &windows(4, 4), EvaluateShape::of(&full, true));
    let fullest = fullest.iter().map(|source| storage_buffers(source).expect("a valid text")).max();
    let (most, what) = all.into_iter().max().expect("texts");
    assert!(most <= MOST_STORAGE_BUFFERS, "{most}: {what}");
    assert_eq!(fullest, Some(MOST_STORAGE_BUFFERS));
    let plain = Prepared::new(&Builder(plain_scene()).diffuse(disk(), 0.5).build(), 0).expect("a scene that fits");
    let plain = passes(&plain, &windows(1, 1), EvaluateShape::of(&plain, true));
    let plain = plain.iter().map(|source| storage_buffers(source).expect("a valid text")).max();
    assert_eq!(plain, Some(PLAIN_STORAGE_BUFFERS));
}

/// Every row of the table: a scene with what it adds needs it, a scene without does not; and what it calls in a stage is there.
#[test]
fn parts_are_there_where_they_are_needed() {
    let plain = Prepared::new(&plain_scene(), 0).expect("a scene that fits");
    let used = |prepared: &Prepared, name: &str| {
        let scene = OnDevice { prepared, windows: windows(1, 1) };
        scene.parts().any(|part| part.name == name)
    };
    for part in PARTS {
        if part.example.is_some() {
            let with = Prepared::new(&with_parts(&plain_scene(), &[part]), 0).expect("a scene that fits");
            assert!(used(&with, part.name), "{}", part.name);
            let few = ["area lights"].contains(&part.name);
            assert!(few || !used(&plain, part.name), "{}", part.name);
        }
    }
    let names: std::collections::HashSet<_> = PARTS.iter().map(|part| part.name).collect();
    assert_eq!(names.len(), PARTS.len(), "two rows of one name");

    // Lines of a part for a place that no file has would be lost without a word.
    let texts: String = PARTS.iter().flat_map(|part| part.modules).map(|(_, module)| module.text).collect();
    let texts = texts + include_str!("../../shaders/passes/generate.wgsl");
    for (place, line) in PARTS.iter().flat_map(|part| part.lines) {
        assert!(texts.contains(&format!("#lines {place}\n")), "{place}: {line}");
    }
}

/// Scenes of every kind of material, alone and with others, their shapes and options varied.
fn general_scenes() -> Vec<(String, Scene)> {
    let glass = || surfaces::glass_curve();
    type Add = fn(Builder, Shape) -> Builder;
    let materials: [(&str, Add); 10] = [
        ("metal", |b, s| b.conductor(s, 0.2, 3.4, [0.0; 2])),
        ("rough metal", |b, s| b.conductor(s, 0.2, 3.4, [0.3; 2])),
        ("brushed metal", |b, s| b.conductor(s, 0.2, 3.4, [0.3, 0.1])),
        ("glass", |b, s| b.dielectric(s, 1.5, 0.0)),
        ("dispersive glass", |b, s| b.dielectric(s, surfaces::glass_curve(), 0.0)),
        ("rough glass", |b, s| b.dielectric(s, 1.5, 0.2)),
        ("rough dispersive glass", |b, s| b.dielectric(s, surfaces::glass_curve(), 0.5)),
        ("hardly rough dispersive glass", |b, s| b.dielectric(s, surfaces::glass_curve(), 0.01)),
        ("varnish", |b, s| b.plastic(s, 0.5, 1.5, 0.0)),
        ("plastic", |b, s| b.plastic(s, 0.5, surfaces::glass_curve(), 0.2)),
    ];
    let mut scenes = Vec::new();
    for (i, (name, add)) in materials.iter().enumerate() {
        for (j, (other, add_other)) in materials.iter().enumerate().skip(i).take(2) {
            let mut builder = Builder(plain_scene());
            builder = if (i + j) % 2 == 0 { builder.roulette(2) } else { builder };
            builder = if (i + j) % 3 == 0 { builder.sky(glass()) } else { builder };
            let shape = if i % 2 == 0 { room(-0.5 * DVec3::ONE, 0.5 * DVec3::ONE) } else { disk() };
            let scene = add_other(add(builder, shape), quad(DVec3::ZERO, DVec3::X, DVec3::Y)).build();
            scenes.push((format!("{name} and {other}"), scene));
        }
    }
    scenes.extend(textured_scenes());
    scenes.extend(light_scenes());
    scenes.extend(media_scenes());
    scenes.extend(hot_scenes());
    scenes.extend(pairs_of_parts());
    scenes.push(("everything".to_owned(), with_everything(&plain_scene())));
    scenes
}

/// Each row of the table by itself, and each with every other: all of them in a scene without any light, and those next to each
/// other in one with a lamp.
fn pairs_of_parts() -> Vec<(String, Scene)> {
    let unlit =
        Builder::new().channels(Channels::equal(400.0, 700.0, 4)).diffuse(quad(DVec3::ZERO, DVec3::X, DVec3::Y), 0.5);
    let (unlit, lit) = (unlit.build(), plain_scene());
    let rows: Vec<_> = PARTS.iter().copied().filter(|part| part.example.is_some()).collect();
    let mut scenes = Vec::new();
    for (i, part) in rows.iter().enumerate() {
        scenes.push((part.name.to_owned(), with_parts(&lit, &[*part])));
        scenes.push((format!("{}, unlit", part.name), with_parts(&unlit, &[*part])));
        for (j, other) in rows.iter().enumerate().skip(i + 1) {
            let pair = [*part, *other];
            scenes.push((format!("{} and {}, unlit", part.name, other.name), with_parts(&unlit, &pair)));
            if j == i + 1 {
                scenes.push((format!("{} and {}", part.name, other.name), with_parts(&lit, &pair)));
            }
        }
    }
    scenes
}

/// Every subset of what may light a scene beside a uniform sky, maps of both kinds, before matt and glass.
fn light_scenes() -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for i in 1..24u32 {
        let mut builder = Builder::new().diffuse(room(-DVec3::ONE, DVec3::ONE), 0.5);
        builder = if i & 1 != 0 { builder.point(DVec3::ZERO, 1.0).directional(DVec3::X, 1.0) } else { builder };
        builder = if i & 2 != 0 { builder.sun(DVec3::Y, 0.1, 1.0) } else { builder };
        builder = if i & 4 != 0 { builder.lamp(disk(), surfaces::glass_curve(), Sides::Both) } else { builder };
        builder = match i / 8 {
            0 => builder,
            1 => builder.rgb_map([3, 2], vec![0.5; 18]),
            _ => builder.map([2, 1], Texels::Spectral { nm: vec![500.0, 600.0, 700.0], radiance: vec![1.0; 6].into() }),
        };
        builder = if i % 3 == 0 { builder.dielectric(disk(), surfaces::glass_curve(), 0.5) } else { builder };
        scenes.push((format!("lights {i}"), builder.build()));
    }
    scenes
}

/// Heat by angle and by place: each kind of surface alone, in a gas and in voxels, and all of them at once.
fn hot_scenes() -> Vec<(String, Scene)> {
    type Add = fn(Builder, usize) -> Builder;
    let parts: [(&str, Add); 6] = [
        ("soot as hot as a texture", |b, t| b.black(disk()).heated_by(t)),
        ("a lamp as hot as a texture", |b, t| b.lamp(disk(), 1.0, Sides::Front).heated_by(t)),
        ("hot brushed metal", |b, _| b.conductor(disk(), 0.2, 3.4, [0.3, 0.1]).at_kelvin(300.0)),
        ("a mirror as hot as a texture", |b, t| b.conductor(disk(), 0.2, 3.4, [0.0; 2]).heated_by(t)),
        ("varnish over a hot mixture", |mut b, t| {
            let texture = b.mixture([1, 1], &[0.5], &[Curve::Constant(0.5)]);
            b.coated(disk(), texture, 1.5, 0.0).heated_by(t)
        }),
        ("a mask of hot plastics", |b, t| {
            let b = b.plastic(disk(), 0.5, 1.5, 0.3).plastic(disk(), 0.5, 1.5, 0.1);
            b.masked_last_two(disk(), t).at_kelvin(300.0)
        }),
    ];
    let voxels = || heat::grid([2, 1, 1], |[x, _, _]| 300.0 + f64::from(x));
    let plain = || {
        let mut b = Builder(plain_scene());
        let t = b.texture([2, 1], &[0.3, 0.7], TextureKind::Number);
        (b, t)
    };
    let with = |add: Add| {
        let (b, t) = plain();
        add(b, t)
    };
    let mut scenes: Vec<(String, Scene)> =
        parts.iter().map(|(name, add)| ((*name).to_owned(), with(*add).build())).collect();
    for (name, add) in &parts[..3] {
        scenes.push((format!("{name}, in a gas"), with(*add).gas(0.5).outer().build()));
        let grid = with(*add).medium(0.5, Some(voxels()), Field::Constant(1.0)).null_box(-DVec3::ONE, DVec3::ONE);
        scenes.push((format!("{name}, in voxels"), grid.build()));
    }
    let (b, t) = plain();
    let mut cold = Builder::new();
    let zero = cold.texture([2, 1], &[0.0, 0.0], TextureKind::Number);
    scenes.push(("nothing but soot at 0 K".into(), cold.black(disk()).heated_by(zero).build()));
    let all = parts.iter().fold(b, |b, (_, add)| add(b, t));
    let all = all.plastic(disk(), 0.5, 1.5, 0.2).at_kelvin(300.0).dielectric(disk(), surfaces::glass_curve(), 0.5);
    scenes.push(("everything hot".into(), all.build()));
    scenes
}

/// Media of one number and of voxels, with and without what else shaders have to do on a way.
fn media_scenes() -> Vec<(String, Scene)> {
    let voxels = || heat::grid([2, 1, 1], |[x, _, _]| 300.0 + f64::from(x));
    let one = |add: &dyn Fn(Builder) -> Builder| add(Builder(plain_scene())).build();
    vec![
        ("gas".into(), one(&|b| b.gas(0.5).null(disk()))),
        ("gas that cuts a window".into(), window_in_gas(0.0)),
        ("gas around everything".into(), one(&|b| b.gas(0.5).outer().sky(1.0).directional(DVec3::X, 1.0))),
        (
            "voxels".into(),
            one(&|b| b.medium(0.5, Some(voxels()), Field::Constant(1.0)).null_box(-DVec3::ONE, DVec3::ONE).roulette(1)),
        ),
        (
            "voxels in dispersive glass under a map".into(),
            one(&|b| {
                let b = b.dielectric(disk(), surfaces::glass_curve(), 0.5).medium(0.5, None, voxels());
                b.filled_from(DVec3::ZERO, DVec3::ONE).rgb_map([3, 2], vec![0.5; 18])
            }),
        ),
    ]
}

/// A box of gas behind x, before a window between x = ±1.
fn window_in_gas(x: f64) -> Scene {
    let window = Projection::Orthographic { half_size: DVec2::ONE };
    let low = DVec3::new(x - 6.0, -3.0, -3.0);
    let b = Builder(plain_scene()).camera(look(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, window));
    b.gas(0.5).null_box(low, low + 6.0).build()
}

/// Every kind of texture by itself and with others, what surfaces carry by itself, and all at once.
fn textured_scenes() -> Vec<(String, Scene)> {
    let plate = || quad(DVec3::ZERO, DVec3::X, DVec3::Y);
    let uv = || Attributes { uv: Some(vec![[DVec2::ZERO, DVec2::X, DVec2::ONE]; 2]), ..Attributes::default() };
    let normals = || Attributes { normals: Some(vec![[DVec3::Z, DVec3::Z, DVec3::X]; 2]), ..Attributes::default() };
    let axes = || Attributes { axes: Some(DMat3::IDENTITY), ..Attributes::default() };
    let ball = || Shape::Sphere { center: DVec3::ZERO, radius: 0.2 };
    let colours = |mut b: Builder| {
        let texture = b.texture([1, 1], &[0.5; 3], TextureKind::Colour);
        b.textured(plate(), texture).attributes(uv())
    };
    let mixture = |mut b: Builder| {
        let texture = b.mixture([1, 1], &[0.5; 2], &[Curve::Constant(0.5), surfaces::glass_curve()]);
        b.textured(ball(), texture).attributes(axes())
    };
    let masked = |mut b: Builder| {
        let mask = b.texture([1, 1], &[0.5], TextureKind::Number);
        let b = b.conductor(plate(), 0.2, 3.4, [0.3, 0.1]).dielectric(plate(), surfaces::glass_curve(), 0.2);
        b.masked_last_two(plate(), mask).attributes(uv())
    };
    let coated = |mut b: Builder, roughness: f64| {
        let texture = b.texture([1, 1], &[0.5; 3], TextureKind::Colour);
        b.coated(plate(), texture, 1.5, roughness).attributes(uv())
    };
    let smooth = |b: Builder| b.diffuse(plate(), 0.5).attributes(normals());
    let brushed = |b: Builder| b.conductor(ball(), 0.2, 3.4, [0.3, 0.1]).attributes(axes());
    let plain = || Builder(plain_scene());
    [
        ("colours", colours(plain())),
        ("mixture", mixture(plain().sky(1.0))),
        ("masked", masked(plain().roulette(1))),
        ("coated", coated(plain(), 0.0)),
        ("roughly coated", coated(mixture(plain()), 0.2)),
        ("smooth", smooth(plain())),
        ("brushed ball", brushed(plain())),
        ("all that textures are", smooth(brushed(coated(masked(mixture(colours(plain()))), 0.2))).sky(1.0).roulette(1)),
    ]
    .map(|(name, builder)| (name.to_owned(), builder.build()))
    .into()
}

fn disk() -> Shape {
    Shape::Disk { center: DVec3::ZERO, normal: DVec3::Z, radius: 0.5 }
}

fn general_sources() -> &'static [(String, Source)] {
    static ALL: LazyLock<Vec<(String, Source)>> = LazyLock::new(compose_general);
    &ALL
}

fn compose_general() -> Vec<(String, Source)> {
    let mut found = std::collections::HashMap::new();
    for (i, (what, scene)) in general_scenes().into_iter().enumerate() {
        let mut prepared = Prepared::for_evaluator(&scene, 0, EVALUATORS[i % EVALUATORS.len()]).unwrap();
        prepared.thinning = (i % 3 == 1 && prepared.evaluator != Evaluator::Pt).then(|| some_paths(&prepared));
        let windows = windows(1 + i as u32 % 4, 1 + i as u32 / 4 % 4);
        for source in passes(&prepared, &windows, EvaluateShape::of(&prepared, i % 2 == 0)) {
            found.entry(source.text.clone()).or_insert_with(|| (format!("{} for {what}", source.label), source));
        }
    }
    found.into_values().collect()
}

// ---- What a scene does not need

fn texts(scene: &Scene) -> Vec<String> {
    let prepared = Prepared::new(scene, 0).unwrap();
    passes(&prepared, &windows(1, 1), EvaluateShape::new(3, true)).into_iter().map(|s| s.text).collect()
}

/// Identifiers of the code, comments apart.
fn words(text: &str) -> std::collections::HashSet<String> {
    let code: String = text.lines().map(|l| l.split("//").next().unwrap_or("").to_lowercase() + "\n").collect();
    code.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned).collect()
}

/// A room of triangles and one lamp has no word of what it does not use in any shader.
#[test]
fn a_plain_scene_pays_for_nothing_else() {
    let texts = texts(&plain_scene());
    for text in &texts {
        let words = words(text);
        // Words of other features, but for the fields of structures that are the same for every scene, and hemispheres.
        let foreign = [
            "sphere",
            "disk",
            "cylinder",
            "shape_",
            "_shape",
            "gaussian",
            "inverse_erf",
            "lens",
            "orthographic",
            "roulette",
            "survival",
            "knot",
            "window",
            "reversebits",
        ];
        let allowed = ["roulette_start", "cosine_hemisphere", "concentric_disk", "dimension_lens"];
        for part in foreign {
            let found: Vec<_> = words.iter().filter(|w| w.contains(part) && !allowed.contains(&w.as_str())).collect();
            assert!(found.is_empty(), "`{part}`: {found:?}");
        }
        assert!(code_bytes(text) <= MAX_PLAIN_BYTES, "{} bytes", code_bytes(text));
        assert!(!text.contains("$"), "an unfilled placeholder");
        assert!(text.lines().all(|l| !l.trim_start().starts_with('#')), "a directive was left");
    }
    let bounce = words(&texts[1]);
    assert!(!bounce.contains("switch") && !bounce.contains("throughputs") && !bounce.contains("environment_spectrum_"));
}

/// Volumes of each camera ray are looked for where a boundary cuts the window, and nowhere else.
#[test]
fn windows_within_one_medium_pay_for_no_other() {
    let mut point = window_in_gas(0.0);
    point.camera.projection = Projection::Perspective { tan_half: DVec2::ONE };
    let [point, inside, beside, cut] =
        [point, window_in_gas(1.5), window_in_gas(-4.5), window_in_gas(0.0)].map(|scene| texts(&scene));
    // The first pass makes the rays themselves.
    assert!(inside[1..] == point[1..] && beside[1..] == point[1..]);
    assert!(cut[1].contains("volumes_at(") && !point[1].contains("volumes_at("));
    assert!(cut[0] == inside[0] && cut[2] == inside[2]);
}

/// Switching one feature on changes the passes that it concerns, and no other.
#[test]
fn a_feature_changes_only_the_passes_it_concerns() {
    let plain = texts(&plain_scene());
    let changed = |scene: Scene| -> Vec<usize> {
        let texts = texts(&scene);
        (0..3).filter(|&i| texts[i] != plain[i]).collect()
    };
    let (camera, bounce, evaluate) = (0, 1, 2);
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut scene = plain_scene();
        change(&mut scene);
        changed(scene)
    };
    let none: Vec<usize> = Vec::new();
    assert_eq!(with(&|_| ()), none);
    assert_eq!(with(&|s| s.film.filter = Filter::Gaussian), [camera]);
    assert_eq!(with(&|s| s.camera.projection = Projection::Orthographic { half_size: DVec2::ONE }), [camera]);
    let lens = Projection::ThinLens { tan_half: DVec2::ONE, aperture_radius: 0.1, focus_distance: 1.0 };
    assert_eq!(with(&|s| s.camera.projection = lens.clone()), [camera]);
    assert_eq!(with(&|s| s.integrator.sampler = Sampler::Sobol), [camera, bounce]);
    assert_eq!(with(&|s| s.integrator.russian_roulette_start = 3), [camera, bounce]);
    // Numbers are data, not text.
    assert_eq!(with(&|s| s.integrator.max_bounces = 7), none);
    assert_eq!(with(&|s| s.camera.position.x += 0.1), none);
    assert_eq!(changed(Builder(plain_scene()).black(sphere(DVec3::ZERO, 0.1)).build()), [bounce]);
    // Few triangles are text.
    let quad = quad(DVec3::ZERO, DVec3::X, DVec3::Y);
    assert_eq!(changed(Builder(plain_scene()).diffuse(quad.clone(), 0.1).build()), [bounce, evaluate]);
    assert_eq!(changed(Builder(plain_scene()).sky(0.1).build()), [bounce, evaluate]);
    assert_eq!(with(&|s| s.channels = Channels::equal(400.0, 700.0, 12)), [evaluate]);
}
