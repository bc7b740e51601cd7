//! Good scenes, resolved to exact numbers.

use std::path::Path;

use glam::{DVec2, DVec3};
use spectile::scene::{self, Bsdf, Evaluator, Filter, Projection, Reflectance, Sampler, Shape, Sides, Wavelengths};
use spectile::spectral::{Curve, Outside};

use super::{BASE, changed, good, parse_with};

#[track_caller]
fn near(a: DVec3, b: [f64; 3]) {
    assert!((a - DVec3::from_array(b)).length() < 1e-12, "{a} is not {b:?}");
}

#[test]
fn cameras_resolve_to_frames() {
    let scene = good(BASE, &[], &[]);
    let camera = &scene.camera;
    near(camera.position, [0.0, 0.0, 5.0]);
    near(camera.forward, [0.0, 0.0, -1.0]);
    near(camera.right, [1.0, 0.0, 0.0]);
    near(camera.up, [0.0, 1.0, 0.0]);
    let tan_half = |sets: &[(&str, &str)]| match good(BASE, &[], sets).camera.projection {
        Projection::Perspective { tan_half } => tan_half,
        other => panic!("{other:?}"),
    };
    let t = 30f64.to_radians().tan();
    for (axis, expected) in [
        ("x", DVec2::new(t, t / 2.0)),
        ("y", DVec2::new(2.0 * t, t)),
        ("smaller", DVec2::new(2.0 * t, t)),
        ("larger", DVec2::new(t, t / 2.0)),
    ] {
        let got = tan_half(&[("camera.perspective.fov_axis", axis)]);
        assert!((got - expected).length() < 1e-14, "{axis}: {got}");
    }
    near(good(BASE, &[], &[("camera.perspective.flip_x", "true")]).camera.right, [-1.0, 0.0, 0.0]);
    // An up that is not across the view is straightened.
    let tilted = good(BASE, &[], &[("camera.perspective.up", "[0, 1, 3]")]).camera;
    near(tilted.up, [0.0, 1.0, 0.0]);

    let lens = "{ position = [1, 2, 3], look_at = [1, 2, 13], fov = 90, aperture_radius = 0.25, focus_distance = 8 }";
    let lens = good(BASE, &[], &[("camera.thin_lens", lens)]).camera;
    // Looking along +z, +x is at the left.
    near(lens.right, [-1.0, 0.0, 0.0]);
    let Projection::ThinLens { tan_half, aperture_radius, focus_distance } = lens.projection else { panic!() };
    assert!((tan_half - DVec2::new(1.0, 0.5)).length() < 1e-14);
    assert_eq!((aperture_radius, focus_distance), (0.25, 8.0));

    let orthographic = "{ position = [0, 9, 0], look_at = [0, 0, 0], up = [0, 0, -1], width = 6 }";
    let orthographic = good(BASE, &[], &[("camera.orthographic", orthographic)]).camera;
    near(orthographic.forward, [0.0, -1.0, 0.0]);
    near(orthographic.right, [1.0, 0.0, 0.0]);
    near(orthographic.up, [0.0, 0.0, -1.0]);
    assert_eq!(orthographic.projection, Projection::Orthographic { half_size: DVec2::new(3.0, 1.5) });
}

#[test]
fn settings_resolve_with_their_defaults() {
    let scene = good(&changed("[integrator]\nmax_bounces = 4", ""), &[], &[]);
    assert_eq!((scene.film.width, scene.film.height, scene.film.crop), (40, 20, [0, 0, 40, 20]));
    assert_eq!(scene.film.filter, Filter::Box);
    let integrator = &scene.integrator;
    assert_eq!((integrator.max_bounces, integrator.russian_roulette_start, integrator.epoch), (5, 0, 64));
    assert_eq!((integrator.sampler, integrator.wavelengths), (Sampler::Sobol, Wavelengths::Emission));
    assert_eq!(integrator.evaluator, Evaluator::Auto);
    assert!(scene.file.is_absolute());
    let scene = good(
        BASE,
        &[],
        &[
            ("film.filter", "gaussian"),
            ("film.crop", "[3, 4, 10, 20]"),
            (
                "integrator",
                "{ max_bounces = 0, russian_roulette_start = 3, sampler = \"independent\", evaluator = \"dpept-pixel\", wavelengths = \"uniform\", epoch = 1024 }",
            ),
        ],
    );
    assert_eq!((scene.film.filter, scene.film.cube_size()), (Filter::Gaussian, [7, 16]));
    let integrator = &scene.integrator;
    assert_eq!((integrator.max_bounces, integrator.russian_roulette_start, integrator.epoch), (0, 3, 1024));
    assert_eq!((integrator.sampler, integrator.evaluator), (Sampler::Independent, Evaluator::DpeptPixel));
}

#[test]
fn channels_resolve_in_their_order() {
    let scene = good(BASE, &[], &[("channels.false_colour", "[2, 1, 0]")]);
    assert_eq!(scene.channels.bounds, [[400.0, 500.0], [500.0, 600.0], [600.0, 700.0]]);
    assert_eq!(scene.channels.false_colour, Some([2, 1, 0]));
    // 1000 to 4000 cm-1 in three: 10, 5, 3.33 and 2.5 um, ascending in nm.
    let bounds = good(BASE, &[], &[("channels.wavenumber", "{ from = 1000, to = 4000, count = 3 }")]).channels.bounds;
    let expected = [[2500.0, 1e7 / 3000.0], [1e7 / 3000.0, 5000.0], [5000.0, 10000.0]];
    assert_eq!(bounds, expected);
    let bounds = good(BASE, &[], &[("channels.intervals", "[[8000, 12000], [380, 390], [385, 400]]")]).channels.bounds;
    assert_eq!(bounds, [[8000.0, 12000.0], [380.0, 390.0], [385.0, 400.0]]);
    let um = ("channels.unit", "um");
    let bounds = good(BASE, &[], &[("channels.intervals", "[[8, 12.5], [3, 5]]"), um]).channels.bounds;
    assert_eq!(bounds, [[8000.0, 12500.0], [3000.0, 5000.0]]);
    for unit in ["um", "\u{b5}m", "\u{3bc}m"] {
        let equal = format!("{{ from = 8, to = 14, unit = \"{unit}\", count = 3 }}");
        let bounds = good(BASE, &[], &[("channels.equal", equal.as_str())]).channels.bounds;
        assert_eq!(bounds, [[8e3, 10e3], [10e3, 12e3], [12e3, 14e3]], "{unit}");
    }
}

/// Area, and the sum of triangle normals times areas (0 for a closed surface).
fn area_and_normal(shape: &Shape) -> (f64, DVec3) {
    let Shape::Mesh(mesh) = shape else { panic!("no mesh: {shape:?}") };
    let mut total = (0.0, DVec3::ZERO);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let normal = 0.5 * (b - a).cross(c - a);
        total = (total.0 + normal.length(), total.1 + normal);
    }
    total
}

/// Signed volume: positive when the triangles of a closed mesh face outward.
fn volume(shape: &Shape) -> f64 {
    let Shape::Mesh(mesh) = shape else { panic!("no mesh: {shape:?}") };
    let corner = |i: u32| mesh.positions[i as usize];
    mesh.triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6.0).sum()
}

#[test]
fn shapes_and_transforms_resolve_to_the_world() {
    let shape = |value: &str, transform: &str| {
        let (kind, table) = value.split_once(' ').unwrap();
        let transform = if transform.is_empty() { "{}" } else { transform };
        let sets = [(&*format!("objects.0.{kind}"), table), ("objects.0.transform", transform)];
        good(BASE, &[], &sets).objects.swap_remove(0).shape
    };
    let quad = "quad { corner = [1, 0, 0], edge_u = [2, 0, 0], edge_v = [0, 3, 0] }";
    let (area, normal) = area_and_normal(&shape(quad, ""));
    assert_eq!(area, 6.0);
    near(normal, [0.0, 0.0, 6.0]);
    // Scale, then rotate, then translate: (1, 0, 0) -> (2, 0, 0) -> (0, 2, 0) -> (0, 2, 5).
    let turned = shape(quad, "{ translate = [0, 0, 5], rotate = [0, 0, 2, 90], scale = 2 }");
    let Shape::Mesh(mesh) = &turned else { panic!() };
    near(mesh.positions[0], [0.0, 2.0, 5.0]);
    near(mesh.positions[1], [0.0, 6.0, 5.0]);
    near(area_and_normal(&turned).1, [0.0, 0.0, 24.0]);
    // A mirrored mesh keeps its front: still towards +z.
    near(area_and_normal(&shape(quad, "{ scale = [-1, 1, 1] }")).1, [0.0, 0.0, 6.0]);

    let cube = "cube { min = [1, 2, 3], max = [2, 4, 6] }";
    for (transform, expected) in
        [("", 6.0), ("{ scale = [1, -2, 1] }", 12.0), ("{ scale = -1 }", 6.0), ("{ rotate = [1, 1, 0, 33] }", 6.0)]
    {
        let cube = shape(cube, transform);
        assert!((volume(&cube) - expected).abs() < 1e-12, "{transform}: {}", volume(&cube));
        assert!(area_and_normal(&cube).1.length() < 1e-12);
    }
    assert!((area_and_normal(&shape(cube, "")).0 - 22.0).abs() < 1e-12);

    let matrix = "{ matrix = [0, -2, 0, 7,  2, 0, 0, 8,  0, 0, -2, 9,  0, 0, 0, 1] }";
    let Shape::Sphere { center, radius } = shape("sphere { center = [1, 0, 1], radius = 3 }", matrix) else { panic!() };
    near(center, [7.0, 10.0, 7.0]);
    assert!((radius - 6.0).abs() < 1e-12);
    let disk = "disk { center = [0, 0, 0], normal = [0, 0, 5], radius = 0.5 }";
    let Shape::Disk { center, normal, radius } = shape(disk, matrix) else { panic!() };
    near(center, [7.0, 8.0, 9.0]);
    near(normal, [0.0, 0.0, -1.0]);
    assert!((radius - 1.0).abs() < 1e-12);
    let cylinder = "cylinder { from = [0, 0, 0], to = [0, 0, 1], radius = 1 }";
    let Shape::Cylinder { from, to, radius } = shape(cylinder, "{ translate = [1, 0, 0], scale = 3 }") else {
        panic!()
    };
    near(from, [1.0, 0.0, 0.0]);
    near(to, [1.0, 0.0, 3.0]);
    assert!((radius - 3.0).abs() < 1e-12);
}

#[test]
fn meshes_resolve_to_objects_by_material_and_group() {
    let mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\ng left\nusemtl white\nf 1 2 3\ng right\nusemtl soot\nf 1 3 4\ng left\nusemtl white\nf 3 4 5\nf 1 1 2\n";
    let text = changed("mesh = \"tri.obj\"\nmaterial = \"soot\"", "mesh = \"m.obj\"");
    let scene = good(&text, &[("m.obj", mesh)], &[]);
    assert_eq!(scene.objects.len(), 3);
    assert_eq!(scene.objects[1].name, "objects.1 (m.obj, material \"white\")");
    let triangles = |i: usize| match &scene.objects[i].shape {
        Shape::Mesh(mesh) => mesh.triangles.len(),
        _ => 0,
    };
    assert_eq!((triangles(1), triangles(2)), (2, 1));
    assert_eq!(scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["white", "soot"]);
    assert_eq!((scene.objects[1].material, scene.objects[2].material), (Some(0), Some(1)));
    assert!(scene.objects[2].emission.as_ref().is_some_and(|e| e.sides == Sides::Front));
    assert!(scene.warnings.iter().any(|w| w.contains("1 triangles without area")), "{:?}", scene.warnings);
    let right = good(&text, &[("m.obj", mesh)], &[("objects.1.group", "right")]);
    assert_eq!(right.objects.len(), 2);
    assert_eq!(right.materials[right.objects[1].material.unwrap()].bsdf, Bsdf::Black);
}

#[test]
fn spectra_resolve_from_every_source() {
    let files = [("s.csv", "nm,a,b\n400,0.1,0.2\n700,0.3,0.4\n"), ("s.spd", "400 0.1\n700 0.3\n")];
    let linear = |nm: &[f64], value: &[f64], outside| Curve::Linear { nm: nm.to_vec(), value: value.to_vec(), outside };
    let hold = |value: [f64; 2]| linear(&[400.0, 700.0], &value, Outside::Hold);
    for (source, expected) in [
        ("{ constant = 0.5, scale = 0.5 }", Curve::Constant(0.25)),
        ("0.125", Curve::Constant(0.125)),
        ("1", Curve::Constant(1.0)),
        ("{ file = \"s.csv\", column = \"b\" }", hold([0.2, 0.4])),
        ("{ file = \"s.spd\", scale = 2 }", hold([0.2, 0.6])),
        ("{ samples = [[400, 0.1], [700, 0.8]] }", hold([0.1, 0.8])),
        (
            "{ samples = [[400, 0.1], [700, 0.8]], outside = \"zero\" }",
            linear(&[400.0, 700.0], &[0.1, 0.8], Outside::Zero),
        ),
        (
            "{ regular = { from = 400, to = 700, values = [0, 0.5, 1] } }",
            linear(&[400.0, 550.0, 700.0], &[0.0, 0.5, 1.0], Outside::Hold),
        ),
        ("{ blackbody = 300, scale = 1e-6 }", Curve::Blackbody { kelvin: 300.0, scale: 1e-6 }),
        ("{ rgb = [0.5, 0.5, 0.5] }", Curve::Constant(0.5)),
    ] {
        for key in ["materials.white.diffuse.reflectance", "spectra.grey"] {
            let scene = good(BASE, &files, &[(key, source)]);
            let Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) } = scene.materials[0].bsdf else {
                panic!("{source}")
            };
            assert_eq!(scene.spectra[reflectance].curve, expected, "{key} = {source}");
        }
    }
    // As emission, a table is zero outside.
    let scene = good(BASE, &files, &[("objects.1.emission", "{ file = \"s.csv\", column = \"a\" }")]);
    let radiance = scene.objects[1].emission.as_ref().unwrap().radiance;
    assert_eq!(scene.spectra[radiance].curve, linear(&[400.0, 700.0], &[0.1, 0.3], Outside::Zero));
    // One name, two uses: each with its own outside. Equal curves are stored once.
    let both = good(
        BASE,
        &files,
        &[("spectra.grey", "{ file = \"s.spd\" }"), ("environment.radiance", "grey"), ("objects.1.emission", "grey")],
    );
    assert_eq!(both.spectra.len(), 2);
    // The environment's scale multiplies.
    let sky = good(
        BASE,
        &[],
        &[("environment.scale", "4"), ("environment.up", "[0, 0, 1]"), ("environment.rotate_degrees", "30")],
    );
    assert_eq!(sky.spectra[sky.environment.unwrap().uniform().unwrap()].curve, Curve::Constant(1.0));
}

#[test]
fn warnings_are_said_once_and_name_the_interval() {
    assert_eq!(good(BASE, &[], &[]).warnings, Vec::<String>::new());
    let table = ("spectra.grey", "{ samples = [[450, 0.1], [650, 0.8]] }");
    let warnings = good(BASE, &[], &[table, ("objects.1.material", "white")]).warnings;
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("`grey`") && warnings[0].contains("400-450 nm and 650-700 nm"), "{warnings:?}");
    let explicit = ("spectra.grey", "{ samples = [[450, 0.1], [650, 0.8]], outside = \"hold\" }");
    assert!(good(BASE, &[], &[explicit]).warnings.is_empty());
    let beside = ("spectra.grey", "{ samples = [[0.4, 0.1], [0.7, 0.8]] }");
    let error = parse_with(BASE, &[], &[beside]).expect_err("beside all channels").to_string();
    assert!(error.contains("`grey` (a reflectance) lies at 0.4 to 0.7 nm, beside all channels"), "{error}");
    assert!(error.contains("unit = \"um\""), "{error}");
    let glass = ("materials.white", "{ dielectric = { eta = { samples = [[5000, 1.4], [9000, 1.3]] } } }");
    let warnings = good(BASE, &[], &[glass]).warnings;
    assert!(warnings[0].contains("(an index of refraction) does not cover 400-700 nm"), "{warnings:?}");
    let held = ("spectra.grey", "{ samples = [[0.4, 0.1], [0.7, 0.8]], outside = \"hold\" }");
    assert_eq!(good(BASE, &[], &[held]).warnings, Vec::<String>::new());
    let unused = ("spectra.other", "{ samples = [[450, 0.1], [650, 0.8]] }");
    let warnings = good(BASE, &[], &[unused]).warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("changes nothing"), "{warnings:?}");
    let rgb = [("spectra.grey", "{ rgb = [0.9, 0.1, 0.1] }"), ("channels.equal.to", "2000")];
    let warnings = good(BASE, &[], &rgb).warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("830-2000 nm"), "{warnings:?}");
}

#[test]
fn the_digest_follows_the_scene_and_nothing_else() {
    let digest = |sets: &[(&str, &str)]| good(BASE, &[], sets).digest;
    let base = digest(&[]);
    assert_eq!(base.len(), 64);
    for same in [
        &[("spectra.unused", "3")][..],
        &[("film.crop", "[0, 0, 40, 20]")],
        &[("integrator.epoch", "64")],
        &[("materials.white.diffuse.reflectance", "0.5")],
    ] {
        assert_eq!(digest(same), base, "{same:?}");
    }
    let mut all = vec![base];
    for changed in [
        ("film.crop", "[0, 0, 40, 19]"),
        ("film.filter", "gaussian"),
        ("integrator.evaluator", "dpept-pixel"),
        ("integrator.epoch", "32"),
        ("integrator.sampler", "independent"),
        ("camera.perspective.fov", "60.00000000001"),
        ("channels.equal.count", "4"),
        ("channels.false_colour", "[0, 1, 2]"),
        ("spectra.grey.constant", "0.51"),
        ("materials.white.diffuse.two_sided", "false"),
        ("objects.1.emission_sides", "both"),
        ("objects.0.transform.translate", "[0, 0, 1e-9]"),
        ("environment.scale", "2"),
    ] {
        all.push(digest(&[changed]));
    }
    let count = all.len();
    all.sort();
    all.dedup();
    assert_eq!(all.len(), count);
}

#[test]
fn the_cornell_box_loads() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml");
    let scene = scene::load(&file, &[]).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert_eq!((scene.channels.len(), scene.objects.len(), scene.materials.len()), (400, 6, 4));
    let emitters: Vec<_> = scene.objects.iter().filter(|o| o.emission.is_some()).collect();
    assert_eq!(emitters.len(), 1);
    let (area, normal) = area_and_normal(&emitters[0].shape);
    // 130 x 105 mm, facing down.
    near(normal / area, [0.0, -1.0, 0.0]);
    assert_eq!(area, 130.0 * 105.0);
    // World +x is at the left.
    near(scene.camera.right, [-1.0, 0.0, 0.0]);
}
