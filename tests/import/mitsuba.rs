//! Scenes of Mitsuba 3.

use glam::{DVec2, DVec3};
use serde_json::Value;
use spectile::scene::{Bsdf, Filter, Light, Projection, Reflectance, Roughness, Shape, Sides, Weight};

use super::{Imported, import, others, written};
use crate::binary;

/// A scene with `inner` after a sensor.
fn scene(inner: &str) -> String {
    format!(
        r#"<?xml version="1.0"?>
<scene version="3.0.0">
    <default name="grey" value="0.25"/>
    <default name="greyer" value="0.125"/>
    <integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="20"/></film>
    </sensor>
    {inner}
</scene>"#
    )
}

fn imported(inner: &str) -> Imported {
    let (_folder, path) = written("scene.xml", &scene(inner));
    import(&path)
}

#[test]
fn cameras_and_films() {
    let found = imported("<emitter type=\"constant\"/>");
    let camera = &found.scene.camera;
    assert_eq!((camera.position, camera.forward, camera.right), (DVec3::Z * 5.0, DVec3::NEG_Z, DVec3::X));
    let Projection::Perspective { tan_half } = camera.projection else { panic!("{:?}", camera.projection) };
    assert!((tan_half.x - 30f64.to_radians().tan()).abs() < 1e-9);
    assert_eq!((found.scene.film.filter, found.scene.integrator.max_bounces), (Filter::Gaussian, 3));
    // By its diagonal; mirrored; a window.
    let other = scene("")
        .replace("<float name=\"fov\" value=\"60\"/>", "<string name=\"focal_length\" value=\"35mm\"/>")
        .replace("<transform name=\"to_world\">", "<transform name=\"to_world\"><scale x=\"-1\"/>")
        .replace(
            "</film>",
            "<integer name=\"crop_offset_x\" value=\"3\"/><integer name=\"crop_width\" value=\"5\"/><rfilter type=\"box\"/></film>",
        );
    let (_folder, path) = written("scene.xml", &other);
    let found = import(&path);
    let Projection::Perspective { tan_half } = found.scene.camera.projection else { panic!("a pinhole") };
    let diagonal = tan_half.length();
    assert!((diagonal - 0.5 * 36f64.hypot(24.0) / 35.0).abs() < 1e-9, "{tan_half}");
    assert_eq!((found.scene.camera.right, found.scene.film.crop), (DVec3::NEG_X, [3, 0, 8, 20]));
    assert_eq!(found.scene.film.filter, Filter::Box);
}

#[test]
fn shapes_stand_where_they_stood() {
    let found = imported(
        r#"
    <shape type="rectangle" id="wall"><transform name="to_world">
        <scale x="2"/><rotate y="1" angle="90"/><translate value="1 2 3"/></transform></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.5"/></transform></shape>
    <shape type="sphere"><point name="center" x="1"/><float name="radius" value="2"/>
        <transform name="to_world"><scale value="3"/></transform></shape>
    <shape type="disk"><transform name="to_world"><rotate x="1" angle="90"/></transform></shape>
    <shape type="cylinder"><point name="p0" value="0, 0, 1"/><point name="p1" value="0, 0, 2"/></shape>
    <shape type="sphere"><transform name="to_world"><scale y="2"/></transform></shape>"#,
    );
    let shapes: Vec<&Shape> = found.scene.objects.iter().map(|object| &object.shape).collect();
    let Shape::Mesh(wall) = shapes[0] else { panic!("a quad") };
    let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-9, "{a} {b}");
    // x of the rectangle goes to -z, and its front to +x.
    near(wall.positions[0], DVec3::new(1.0, 1.0, 5.0));
    near(wall.positions[1] - wall.positions[0], DVec3::new(0.0, 0.0, -4.0));
    near(wall.positions[3] - wall.positions[0], DVec3::new(0.0, 2.0, 0.0));
    assert_eq!(shapes[1].bounds(), [DVec3::splat(-0.5), DVec3::splat(0.5)]);
    let Shape::Sphere { center, radius } = shapes[2] else { panic!("a sphere") };
    near(*center, DVec3::X * 3.0);
    assert!((radius - 6.0).abs() < 1e-9);
    let Shape::Disk { normal, radius, .. } = shapes[3] else { panic!("a disk") };
    near(*normal, DVec3::NEG_Y);
    assert!((radius - 1.0).abs() < 1e-9);
    let Shape::Cylinder { from, to, radius } = shapes[4] else { panic!("a cylinder") };
    assert_eq!((*from, *to, *radius), (DVec3::Z, DVec3::Z * 2.0, 1.0));
    let [low, high] = shapes[5].bounds();
    near(low, DVec3::new(-1.0, -2.0, -1.0));
    near(high, DVec3::new(1.0, 2.0, 1.0));
    assert!(found.toml.contains("# wall\n[[objects]]"), "{}", found.toml);
    assert!(
        found.page.contains("a round shape by 128 segments around") && found.page.contains("scene.xml:18"),
        "{}",
        found.page
    );
}

#[test]
fn materials_and_their_adapters() {
    let found = imported(
        r#"
    <bsdf type="twosided" id="paint"><bsdf type="diffuse"><spectrum name="reflectance" value="$grey"/></bsdf></bsdf>
    <bsdf type="mask" id="net"><float name="opacity" value="0.5"/><bsdf type="conductor"><string name="material" value="Cu"/></bsdf></bsdf>
    <bsdf type="blendbsdf" id="mix"><float name="weight" value="0.75"/><ref id="paint"/>
        <bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/>
            <float name="specular_reflectance" value="$greyer"/><spectrum name="eta" value="400:1, 700:2"/><float name="k" value="3"/></bsdf></bsdf>
    <shape type="rectangle"><ref id="paint"/></shape>
    <shape type="rectangle"><ref id="net"/></shape>
    <shape type="rectangle"><ref id="mix"/></shape>
    <shape type="rectangle"><bsdf type="dielectric"><string name="int_ior" value="water"/><string name="ext_ior" value="vacuum"/></bsdf></shape>
    <shape type="rectangle"><bsdf type="diffuse"><rgb name="reflectance" value="1, 0.5, 0.25"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="3"/></emitter></shape>
    <shape type="rectangle"><bsdf type="null"/></shape>
    <shape type="rectangle"><bsdf type="hair"/></shape>"#,
    );
    let scene = &found.scene;
    let of = |object: usize| &scene.materials[scene.objects[object].material.expect("one")];
    assert_eq!(scene.objects.len(), 6);
    let Bsdf::Diffuse { reflectance: Reflectance::Spectrum(paint) } = of(0).bsdf else { panic!("{:?}", of(0)) };
    assert_eq!((scene.spectra[paint].curve.eval(550.0), of(0).two_sided, of(0).name.as_str()), (0.25, true, "paint"));
    let Bsdf::Conductor { eta, k, .. } = of(1).bsdf else { panic!("{:?}", of(1)) };
    // The edge of copper, where Johnson and Christy (1972) fall from 0.76 at 563 nm to 0.27 at 620 nm, k from 2.46 to 3.25.
    let [n, k] = [eta, k].map(|id| scene.spectra[id].curve.eval(590.0));
    assert!((0.27..0.76).contains(&n) && (2.46..3.25).contains(&k), "{n} {k}");
    assert_eq!((of(1).opacity, of(1).two_sided), (Some(Weight::Constant(0.5)), false));
    let Bsdf::Blend { a, b, weight: Weight::Constant(0.75) } = of(2).bsdf else { panic!("{:?}", of(2)) };
    assert_eq!(scene.materials[a].name, "paint-2");
    // A metal times 1/8.
    let Bsdf::Blend { a, b, weight: Weight::Constant(0.875) } = scene.materials[b].bsdf else { panic!("{b}") };
    assert!(matches!(
        scene.materials[a].bsdf,
        Bsdf::Conductor { roughness: Roughness::Constant([0.3, 0.3]), energy_compensation: false, .. }
    ));
    assert_eq!(scene.materials[b].bsdf, Bsdf::Black);
    let Bsdf::Dielectric { eta, .. } = of(3).bsdf else { panic!("{:?}", of(3)) };
    assert_eq!(scene.spectra[eta].curve.eval(550.0), 1.333);
    let emission = scene.objects[4].emission.as_ref().expect("a lamp");
    assert_eq!(emission.sides, Sides::Front);
    // D65 with Y = 1 is 1.051 at 550 nm.
    let radiance = scene.spectra[emission.radiance].curve.eval(550.0);
    assert!((radiance - 3.0 * 1.051).abs() < 0.01, "{radiance}");
    assert!(found.page.contains("a shape of which nothing is seen (BSDF `null`) (scene.xml:23)"), "{}", found.page);
    assert!(found.page.contains("the BSDF `hair` as a diffuse grey of 0.5 (scene.xml:24)"), "{}", found.page);
}

#[test]
fn lights_and_what_is_not_read() {
    let found = imported(
        r#"
    <emitter type="point"><point name="position" x="1"/><spectrum name="intensity" value="2"/><float name="flicker" value="1"/></emitter>
    <emitter type="directional"><vector name="direction" value="0, -2, 0"/><spectrum name="irradiance" type="blackbody">
        <float name="temperature" value="3000"/></spectrum></emitter>
    <emitter type="spot"><transform name="to_world"><rotate x="1" angle="90"/></transform><float name="cutoff_angle" value="40"/></emitter>
    <emitter type="constant"><float name="radiance" value="0.5"/></emitter>
    <emitter type="sunsky"/>"#,
    );
    let scene = &found.scene;
    let Light::Point { position, intensity } = &scene.lights[0] else { panic!("{:?}", scene.lights[0]) };
    assert_eq!((*position, scene.spectra[*intensity].curve.eval(500.0)), (DVec3::X, 2.0));
    let Light::Directional { direction, .. } = &scene.lights[1] else { panic!("{:?}", scene.lights[1]) };
    assert_eq!(*direction, DVec3::NEG_Y);
    assert!(matches!(scene.lights[2], Light::Spot { .. }), "{:?}", scene.lights[2]);
    assert!(scene.environment.is_some());
    assert!(found.toml.contains("half_angle = 40.0, falloff = 30.0, profile = \"linear\""), "{}", found.toml);
    assert!(found.page.contains("the parameter `flicker` of the emitter `point` (scene.xml:12)"), "{}", found.page);
    assert!(found.page.contains("the emitter `sunsky` (scene.xml:17)"), "{}", found.page);
}

#[test]
fn groups_are_placed() {
    let found = imported(
        r#"
    <shape type="shapegroup" id="pair"><shape type="sphere"/>
        <shape type="sphere"><point name="center" x="5"/></shape></shape>
    <shape type="instance"><ref id="pair"/><transform name="to_world"><translate y="1"/></transform></shape>
    <shape type="instance"><ref id="pair"/><transform name="to_world"><scale value="2"/></transform></shape>"#,
    );
    let spheres: Vec<(DVec3, f64)> = found
        .scene
        .copied()
        .objects
        .iter()
        .map(|object| match object.shape {
            Shape::Sphere { center, radius } => (center, radius),
            _ => panic!("{:?}", object.shape),
        })
        .collect();
    assert_eq!(
        spheres,
        [(DVec3::Y, 1.0), (DVec3::ZERO, 2.0), (DVec3::new(5.0, 1.0, 0.0), 1.0), (DVec3::X * 10.0, 2.0)]
    );
    assert!(found.toml.contains("[[assemblies.pair.objects]]"), "{}", found.toml);
}

/// Mitsuba 3.9.1 has, on a triangle without texture coordinates, u and v of 1 at its second and third corner, and the first edge as its tangent.
#[test]
fn meshes_without_coordinates_have_those_of_their_triangles() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("flat.obj", "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3\nf 1 3 4\n");
    write(
        "smooth.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n\
        property float nz\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n",
    );
    write("picture.pfm", "Pf\n1 2\n-1.0\n\0\0\0\0\0\0\0\0");
    let picture =
        "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"picture.pfm\"/></texture>";
    write(
        "scene.xml",
        &scene(&format!(
            "<bsdf type=\"diffuse\" id=\"picture\">{picture}</bsdf><bsdf type=\"roughconductor\" id=\"brushed\"><float name=\"alpha_u\" value=\"0.2\"/></bsdf>\
         <bsdf type=\"diffuse\" id=\"plain\"/>\
         <shape type=\"obj\"><string name=\"filename\" value=\"flat.obj\"/><ref id=\"picture\"/></shape>\
         <shape type=\"ply\"><string name=\"filename\" value=\"smooth.ply\"/><ref id=\"picture\"/></shape>\
         <shape type=\"ply\"><string name=\"filename\" value=\"smooth.ply\"/><ref id=\"brushed\"/></shape>\
         <shape type=\"ply\"><string name=\"filename\" value=\"smooth.ply\"/><ref id=\"plain\"/></shape>"
        )),
    );
    let found = import(&folder.path().join("scene.xml"));
    let uv: Vec<_> = found.scene.objects.iter().map(|object| object.attributes.uv.clone()).collect();
    // v of the surface runs down but where that of a file would be turned up, as it is of OBJ: either way the second corner has the same texel.
    let corners = |v: [f64; 3]| [DVec2::new(0.0, v[0]), DVec2::new(1.0, v[1]), DVec2::new(0.0, v[2])];
    assert_eq!(uv[0], Some(vec![corners([1.0, 1.0, 0.0]); 2]));
    assert_eq!(uv[1..3], [Some(vec![corners([0.0, 0.0, 1.0])]), Some(vec![corners([0.0, 0.0, 1.0])])]);
    assert_eq!(uv[3], None);
    let way = |object: usize| match found.scene.materials[found.scene.objects[object].material.expect("one")].bsdf {
        Bsdf::Diffuse { reflectance: Reflectance::Texture(id) } => found.scene.textures[id].placement.scale.y,
        ref other => panic!("{other:?}"),
    };
    assert_eq!((way(0), way(1)), (1.0, -1.0));
}

/// Beyond its ends a light is nothing, a reflectance what it is there.
#[test]
fn tables_end_as_they_do_there() {
    let long = (0..10).map(|i| format!("{}:1", 500 + 10 * i)).collect::<Vec<_>>().join(", ");
    for table in ["500:1, 590:1", long.as_str()] {
        let found = imported(&format!(
            "<emitter type=\"constant\"><spectrum name=\"radiance\" value=\"{table}\"/></emitter>\
             <shape type=\"sphere\"><bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"{table}\"/></bsdf></shape>"
        ));
        let sky = found.scene.environment.as_ref().and_then(|sky| sky.uniform()).expect("an even sky");
        let Bsdf::Diffuse { reflectance: Reflectance::Spectrum(paint) } = found.scene.materials[0].bsdf else {
            panic!("{:?}", found.scene.materials[0])
        };
        let of = |id: usize| [450.0, 550.0, 650.0].map(|nm| found.scene.spectra[id].curve.eval(nm));
        assert_eq!((of(sky), of(paint)), ([0.0, 1.0, 0.0], [1.0; 3]), "{}", found.toml);
    }
}

#[test]
fn what_is_clipped_or_left_out_is_told() {
    let found = imported(
        r#"<shape type="sphere"><bsdf type="null"/></shape>
        <shape type="sphere"><bsdf type="difftrans">
            <rgb name="reflectance" value="0.8, 0.8, 0.8"/><rgb name="transmittance" value="0.8, 0.8, 0.8"/>
        </bsdf></shape>"#,
    );
    let told = &found.page;
    assert!(told.contains("a shape of which nothing is seen"), "{told}");
    assert!(told.contains("of 1.600 in all, both scaled to 1 in all"), "{told}");
    let found = imported(
        r#"<emitter type="spot"><float name="cutoff_angle" value="200"/><float name="beam_width" value="190"/></emitter>
        <shape type="sphere"><bsdf type="principled">
            <float name="metallic" value="1.25"/><float name="specular" value="-0.5"/>
        </bsdf></shape>"#,
    );
    let told = &found.page;
    for words in [
        "- `cutoff_angle` of 200 as 180 (",
        "- `beam_width` of 190 as 180 (",
        "- `metallic` of a principled BSDF of 1.25 as 1 (",
        "- `specular` of a principled BSDF of -0.5 as 0 (",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    let both = scene("").replace("<film", "<string name=\"focal_length\" value=\"50mm\"/><film");
    let (_folder, path) = written("scene.xml", &both);
    let error = spectile::import::import(&path, &path.with_extension("out")).expect_err("both").to_string();
    assert!(error.contains("both `fov` and `focal_length`"), "{error}");
}

#[test]
fn mistakes_have_file_and_line() {
    let said = |text: &str| {
        let (folder, path) = written("scene.xml", text);
        let error = spectile::import::import(&path, &folder.path().join("out")).expect_err(text);
        assert!(!folder.path().join("out").exists() && error.exit_code() == 2, "{error}");
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    for (inner, expected) in [
        ("<shape type=\"rectangle\"><ref id=\"nobody\"/></shape>", "scene.xml:11: no object has the id `nobody`"),
        (
            "<emitter type=\"constant\"><float name=\"radiance\" value=\"$x\"/></emitter>",
            "scene.xml:11: `$x` has no <default>",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"a\"/></shape>",
            "scene.xml:11: `radius` must be a number, but is `a`",
        ),
        (
            "<shape type=\"ply\"><string name=\"filename\" value=\"../a.ply\"/></shape>",
            "\"../a.ply\" is not in the folder of the scene",
        ),
        (
            "<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/></shape>",
            "scene.xml:11: a.ply: cannot be read",
        ),
        ("<include filename=\"scene.xml\"/>", "scene.xml: includes itself"),
        (
            "<shape type=\"cube\"><transform name=\"to_world\"><matrix value=\"1 2\"/></transform></shape>",
            "`matrix` needs 9 or 16 numbers, but has 2",
        ),
        (
            "<bsdf type=\"conductor\" id=\"a\"><string name=\"material\" value=\"Xx\"/></bsdf><shape type=\"cube\"><ref id=\"a\"/></shape>",
            "the metal `Xx` is not known",
        ),
        ("<shape>", "is no XML that can be read"),
    ] {
        let found = said(&scene(inner));
        assert!(found.contains(expected) && !found.contains('\n'), "{inner}: {found}");
    }
    assert!(said("<scene version=\"0.6.0\"/>").contains("before version 2"));
    assert!(said("<mesh/>").contains("its first element is `mesh`"));
    assert!(said("").contains("has no element"));
    // What is there is not replaced.
    let (folder, path) = written("scene.xml", &scene(""));
    let error = spectile::import::import(&path, folder.path()).expect_err("a folder");
    assert!(error.to_string().contains("exists"), "{error}");
}

/// Channel means of scenes by others over those that Mitsuba found, and how far off they may be: 1 % and three standard errors, or
/// what IMPORT.md calls approximated. Errors of the references are below 0.2 %, but 0.8 % in veach-mis.
fn against_mitsuba(scene: &str, reference: &str, samples: &str, bounds: [f64; 2]) {
    let Some(path) = others(scene) else { return };
    let Some(mut python) = crate::outside::python("reference_means.py") else { return };
    let Some(reference) = others(reference) else { return };
    let output = binary::output(python.arg(reference));
    assert!(output.status.success(), "{}", binary::text(&output.stderr));
    let truth: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let numbers = |key: &str| -> Vec<f64> { serde_json::from_value(truth[key].clone()).expect("numbers") };
    let found = import(&path);
    let folder = found.folder.path();
    let size = format!("{}x{}", truth["size"][0], truth["size"][1]);
    let arguments = ["render", "out/scene.toml", "-o", "cube.zarr", "--spp", samples, "--size", &size, "--quiet"];
    let sets = [
        "channels.equal={ from = 400.0, to = 700.0, count = 8 }",
        "integrator.max_bounces=5",
        "integrator.russian_roulette_start=0",
        "film.filter=\"box\"",
    ];
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    let output = binary::run(folder, &arguments.into_iter().chain(sets).collect::<Vec<_>>());
    assert!(output.status.success(), "{}", binary::text(&output.stderr));
    let cube = spectile::cube::Cube::open(&folder.join("cube.zarr")).expect("a cube");
    let [width, height]: [u32; 2] = serde_json::from_value(truth["size"].clone()).expect("two sides");
    let mut sum = [0.0; 8];
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let spectrum = cube.spectrum(x, y).expect("read").expect("rendered");
        sum.iter_mut().zip(&spectrum).for_each(|(sum, value)| *sum += f64::from(*value));
    }
    let pixels = f64::from(width * height);
    let ratios: Vec<f64> = sum.iter().zip(numbers("mean")).map(|(sum, mean)| sum / pixels / mean).collect();
    println!("{scene}: {ratios:.4?}");
    for ((ratio, error), mean) in ratios.iter().zip(numbers("sem")).zip(numbers("mean")) {
        let noise = 3.0 * error / mean;
        assert!((bounds[0] - noise..=bounds[1] + noise).contains(ratio), "{scene}: {ratios:.4?}");
    }
}

#[test]
fn the_cornell_box_is_mitsubas() {
    against_mitsuba("mi-cornell/scene_v3.xml", "mi-cornell/reference.npz", "64", [0.99, 1.01]);
}

#[test]
#[ignore = "renders all scenes of others in Mitsuba's format, 5 minutes"]
fn scenes_of_others_are_mitsubas() {
    against_mitsuba("mi-made/spectra.xml", "mi-made/reference-spectra.npz", "256", [0.99, 1.01]);
    // A wedge of five faces under interpolated normals is darker in Mitsuba, where they face away.
    against_mitsuba("mi-made/outdoor.xml", "mi-made/reference-outdoor.npz", "256", [0.99, 1.035]);
    // Burley's lobe is brighter than a coat's where light and view are as oblique as they are there, and darker elsewhere.
    against_mitsuba("mi-blender-cube/test1.xml", "mi-blender-cube/reference.npz", "256", [0.96, 1.01]);
    // Plastics; and Beckmann's facets as GGX's, with indices that Mitsuba's spectral variants clamp.
    against_mitsuba("mi-staircase2/scene.xml", "mi-staircase2/reference.npz", "64", [0.99, 1.05]);
    against_mitsuba("mi-veach-mis/scene.xml", "mi-veach-mis/reference.npz", "256", [0.93, 1.12]);
}

/// All of them, with nothing done by hand.
#[test]
fn scenes_of_others_are_read() {
    for name in [
        "mi-cornell/scene_v3.xml",
        "mi-made/spectra.xml",
        "mi-made/outdoor.xml",
        "mi-veach-mis/scene.xml",
        "mi-blender-cube/test1.xml",
        "mi-blender-cube/film_hdrfilm_crop.xml",
    ] {
        let Some(path) = others(name) else { return };
        let found = import(&path);
        assert_eq!(found.scene.warnings, Vec::<String>::new(), "{name}");
        assert!(found.page.starts_with("# Import of "), "{name}");
    }
}
