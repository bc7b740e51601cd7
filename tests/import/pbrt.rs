//! Scenes of pbrt-v4.

use glam::{DVec2, DVec3};
use spectile::scene::{Bsdf, Light, Projection, Reflectance, Roughness, Shape, Sides, Weight};

use super::{Imported, import, others, written};

fn scene(inner: &str) -> String {
    format!(
        "# made up\nLookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [60]\nFilm \"rgb\" \"integer xresolution\" [40] \
         \"integer yresolution\" [20]\nIntegrator \"path\" \"integer maxdepth\" 7\nWorldBegin\n{inner}\n"
    )
}

fn imported(inner: &str) -> Imported {
    let (_folder, path) = written("scene.pbrt", &scene(inner));
    import(&path)
}

fn near(a: DVec3, b: DVec3) {
    assert!(a.distance(b) < 1e-9, "{a} {b}");
}

#[test]
fn cameras_are_left_handed() {
    let found = imported("LightSource \"infinite\"");
    let camera = &found.scene.camera;
    near(camera.position, DVec3::Z * -5.0);
    near(camera.forward, DVec3::Z);
    // Columns run along +x, though forward x up is -x.
    near(camera.right, DVec3::X);
    let Projection::Perspective { tan_half } = camera.projection else { panic!("{:?}", camera.projection) };
    assert!((tan_half.y - 30f64.to_radians().tan()).abs() < 1e-9 && (tan_half.x - 2.0 * tan_half.y).abs() < 1e-9);
    assert_eq!(found.scene.integrator.max_bounces, 7);
    let (_folder, path) = written(
        "scene.pbrt",
        "Scale -1 1 1\nCamera \"orthographic\" \"float screenwindow\" [-3 3 -1.5 1.5]\nFilm \"rgb\" \"integer xresolution\" 40 \
         \"integer yresolution\" 20 \"float cropwindow\" [0.25 0.5 0 1]\nPixelFilter \"box\"\nWorldBegin\n",
    );
    let found = import(&path);
    near(found.scene.camera.right, DVec3::NEG_X);
    let Projection::Orthographic { half_size } = found.scene.camera.projection else { panic!("parallel") };
    assert!((half_size.x - 3.0).abs() < 1e-9 && found.scene.film.crop == [10, 0, 20, 20]);
}

/// pbrt-v4 has (0, 0), (1, 0) and (1, 1) at the corners of a triangle without `uv`, which are those of what it is a half of.
#[test]
fn triangles_without_coordinates_have_those_of_pbrt() {
    let found = imported(
        r#"Texture "t" "spectrum" "checkerboard"
Material "diffuse" "texture reflectance" "t"
Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0] "normal3 N" [0 0 -1  0 0 -1  0 0 -1]
Material "diffuse"
Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0]"#,
    );
    let [textured, plain] = &found.scene.objects[..] else { panic!("{}", found.toml) };
    // Turned to where its normals are, by which two corners change places.
    assert_eq!(textured.attributes.uv, Some(vec![[DVec2::ZERO, DVec2::ONE, DVec2::X]]));
    assert_eq!(plain.attributes.uv, None);
}

#[test]
fn transforms_attributes_and_instances() {
    let found = imported(
        r#"
Material "diffuse" "float reflectance" 0.25
AttributeBegin
  Translate 1 2 3
  Scale 2 2 2
  CoordinateSystem "there"
  ObjectBegin "ball" Translate 1 0 0 Shape "sphere" "float radius" 0.5 ObjectEnd
  Attribute "shape" "float radius" 3
  Shape "sphere"
AttributeEnd
Shape "sphere"
ObjectInstance "ball"
Translate 0 0 10
ObjectInstance "ball"
CoordSysTransform "there"
Rotate 90 0 0 1
Shape "disk" "float height" 1
Transform [ 1 0 0 0  0 1 0 0  0 0 1 0  7 8 9 1 ]
ConcatTransform [ 1 0 0 0  0 1 0 0  0 0 1 0  1 0 0 1 ]
Shape "cylinder" "float zmin" 0"#,
    );
    let spheres: Vec<(DVec3, f64)> = found
        .scene
        .copied()
        .objects
        .iter()
        .filter_map(|object| match object.shape {
            Shape::Sphere { center, radius } => Some((center, radius)),
            _ => None,
        })
        .collect();
    let expected = [
        (DVec3::new(1.0, 2.0, 3.0), 6.0),
        (DVec3::ZERO, 1.0),
        // The object keeps the transforms around its own definition.
        (DVec3::new(3.0, 2.0, 3.0), 1.0),
        (DVec3::new(3.0, 2.0, 13.0), 1.0),
    ];
    assert_eq!(spheres, expected);
    let Shape::Disk { center, normal, radius } = found.scene.objects[2].shape else { panic!("a disk") };
    near(center, DVec3::new(1.0, 2.0, 5.0));
    near(normal, DVec3::Z);
    assert!((radius - 2.0).abs() < 1e-9);
    let Shape::Cylinder { from, to, .. } = found.scene.objects[3].shape else { panic!("a cylinder") };
    near(from, DVec3::new(8.0, 8.0, 9.0));
    near(to, DVec3::new(8.0, 8.0, 10.0));
    let [ball] = &found.scene.assemblies[..] else { panic!("{:?}", found.scene.assemblies) };
    assert_eq!((ball.name.as_str(), ball.instances.len()), ("ball", 2));
    // What is stretched cannot be one of them; many places stand in a file.
    let stretched = imported(
        "ObjectBegin \"ball\" Shape \"sphere\" ObjectEnd\nObjectInstance \"ball\"\nScale 1 2 1\nObjectInstance \"ball\"",
    );
    assert!(stretched.page.contains("an instance that stretches a round shape"), "{}", stretched.page);
    let many: String = (0..20).map(|i| format!("Translate {i} 0 0 ObjectInstance \"ball\"\n")).collect();
    let many = imported(&format!("ObjectBegin \"ball\" Shape \"sphere\" ObjectEnd\n{many}"));
    assert!(many.toml.contains("placements = \"placements/ball.csv\""), "{}", many.toml);
    near(many.scene.assemblies[0].instances[19].translation, DVec3::new(190.0, 0.0, 0.0));
}

#[test]
fn materials_textures_and_spectra() {
    let found = imported(
        r#"
Texture "checks" "spectrum" "checkerboard" "rgb tex1" [1 0.5 0.25] "spectrum tex2" [400 0.1 700 0.3] "float uscale" 4 "float vscale" 2
Texture "dim" "spectrum" "scale" "texture tex" "checks" "float scale" 0.5
MakeNamedMaterial "floor" "string type" "diffuse" "texture reflectance" "dim"
MakeNamedMaterial "gold" "string type" "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.04
MakeNamedMaterial "both" "string type" "mix" "string materials" ["floor" "gold"] "float amount" 0.75
NamedMaterial "floor" Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 0]
NamedMaterial "both" Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 0]
Material "dielectric" "spectrum eta" "glass-BK7" "float roughness" 0.1 "bool remaproughness" false Shape "sphere"
Material "diffusetransmission" "rgb transmittance" [0.1 0.1 0.1] Shape "sphere"
Material "conductor" "rgb reflectance" [0.5 0.5 0.5] "float flavour" 3 Shape "sphere"
Material "interface" Shape "sphere""#,
    );
    let scene = &found.scene;
    let of = |object: usize| &scene.materials[scene.objects[object].material.expect("one")];
    let Bsdf::Diffuse { reflectance: Reflectance::Texture(texture) } = of(0).bsdf else { panic!("{:?}", of(0)) };
    // A picture of two by two fields over two of pbrt's.
    assert_eq!(scene.textures[texture].placement.scale.to_array(), [2.0, 1.0]);
    let spectile::scene::TextureKind::Mixture(endmembers) = &scene.textures[texture].kind else { panic!("shares") };
    assert!((scene.spectra[endmembers[1]].curve.eval(550.0) - 0.1).abs() < 1e-9);
    assert!(matches!(of(1).bsdf, Bsdf::Blend { weight: Weight::Constant(0.75), .. }), "{:?}", of(1));
    // α is the square root.
    let metal = scene.materials.iter().find(|material| material.name == "gold").expect("gold");
    assert!(matches!(metal.bsdf, Bsdf::Conductor { roughness: Roughness::Constant([0.2, 0.2]), .. }), "{metal:?}");
    let Bsdf::Dielectric { eta, roughness: Roughness::Constant([0.1, 0.1]), .. } = of(2).bsdf else {
        panic!("{:?}", of(2))
    };
    assert!((scene.spectra[eta].curve.eval(587.56) - 1.5168).abs() < 1e-4);
    assert!(matches!(of(3).bsdf, Bsdf::Translucent { .. }), "{:?}", of(3));
    let Bsdf::Conductor { eta, k, .. } = of(4).bsdf else { panic!("{:?}", of(4)) };
    let [n, k] = [eta, k].map(|id| scene.spectra[id].curve.eval(550.0));
    let reflected = ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
    assert!((reflected - 0.5).abs() < 1e-9, "{reflected}");
    assert_eq!(scene.objects.len(), 5);
    for said in [
        "`flavour` of the material `conductor` (scene.pbrt:17)",
        "of which nothing is seen (material `interface`) (scene.pbrt:18)",
    ] {
        assert!(found.page.contains(said), "{}", found.page);
    }
}

/// What is no RGB is scaled to luminance 1; power is spread over what shines.
/// What `zmin`, `zmax`, `phimax` and `innerradius` leave: areas of zones, rings and sectors, within what 128 segments a turn cut off.
#[test]
fn parts_of_round_shapes() {
    let found = imported(
        r#"Shape "sphere" "float radius" 2 "float zmin" 0 "float zmax" 1 "float phimax" 180
        Shape "disk" "float radius" 2 "float innerradius" 1 "float phimax" 90
        Shape "cylinder" "float radius" 2 "float phimax" 90
        Shape "sphere" "float radius" 2 "float zmin" -2 "float zmax" 3 "float phimax" 400
        Shape "disk" "float phimax" 0"#,
    );
    let pi = std::f64::consts::PI;
    assert_eq!(found.scene.objects.len(), 4, "{}", found.toml);
    for (object, (area, [low, high])) in found.scene.objects.iter().zip([
        (2.0 * pi * 2.0 * 0.5, [DVec3::new(-2.0, 0.0, 0.0), DVec3::new(2.0, 2.0, 1.0)]),
        (pi * (4.0 - 1.0) / 4.0, [DVec3::ZERO, DVec3::new(2.0, 2.0, 0.0)]),
        (2.0 * pi * 2.0 * 2.0 / 4.0, [DVec3::new(0.0, 0.0, -1.0), DVec3::new(2.0, 2.0, 1.0)]),
    ]) {
        let Shape::Mesh(mesh) = &object.shape else { panic!("{}", object.name) };
        let corners = mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize]));
        let found: f64 = corners.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum();
        // Chords across π / 128 of an angle in two directions.
        assert!((found / area - 1.0).abs() < 1e-3 && found < area, "{}: {found}, {area}", object.name);
        let bounds = object.shape.bounds();
        assert!(bounds[0].distance(low) < 1e-6 && bounds[1].distance(high) < 1e-6, "{}: {bounds:?}", object.name);
    }
    assert!(matches!(found.scene.objects[3].shape, Shape::Sphere { .. }));
    assert!(found.page.contains("a `disk` of which no part is there"), "{}", found.page);
}

#[test]
fn lights_and_their_scales() {
    let found = imported(
        r#"
LightSource "point" "blackbody I" 3000 "float scale" 2 "point3 from" [1 0 0]
LightSource "distant" "rgb L" [1 1 1] "point3 from" [0 5 0] "point3 to" [0 0 0]
LightSource "spot" "spectrum I" [400 1 700 1] "float coneangle" 40 "float conedeltaangle" 10
Material "diffuse" "float reflectance" 0
AreaLightSource "diffuse" "rgb L" [1 1 1] "float power" 100 "bool twosided" true
Scale 2 2 2
Shape "sphere"
LightSource "goniometric""#,
    );
    let scene = &found.scene;
    let luminance = |id: usize| {
        let y = &spectile::spectral::colour::Observer::Cie1931.curves()[1];
        let nm = || (360..=830).map(f64::from);
        nm().map(|nm| y.eval(nm) * scene.spectra[id].curve.eval(nm)).sum::<f64>()
            / nm().map(|nm| y.eval(nm)).sum::<f64>()
    };
    let Light::Point { position, intensity } = scene.lights[0] else { panic!("{:?}", scene.lights[0]) };
    near(position, DVec3::X);
    assert!((luminance(intensity) - 2.0).abs() < 1e-3, "{}", luminance(intensity));
    let Light::Directional { direction, irradiance } = scene.lights[1] else { panic!("{:?}", scene.lights[1]) };
    near(direction, DVec3::NEG_Y);
    assert!((luminance(irradiance) - 1.0).abs() < 1e-3);
    assert!(found.toml.contains("half_angle = 40.0, falloff = 30.0"), "{}", found.toml);
    let emission = scene.objects[0].emission.as_ref().expect("a lamp");
    // 100 over π and both sides of 4π · 2².
    let expected = 100.0 / (std::f64::consts::PI * 2.0 * 16.0 * std::f64::consts::PI);
    assert!((luminance(emission.radiance) / expected - 1.0).abs() < 1e-3 && emission.sides == Sides::Both);
    assert!(found.page.contains("the light `goniometric` (scene.pbrt:15)"), "{}", found.page);
}

/// Fronts are where the normals of the corners are, else where corners run counter-clockwise; both turned by ReverseOrientation.
#[test]
fn fronts_are_pbrts() {
    let triangle = |more: &str| {
        format!("Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0  1 0 0  0 1 0] {more}\n")
    };
    let against = "\"normal N\" [0 0 -1  0 0 -1  0 0 -1]";
    let inner = format!(
        "{}{}ReverseOrientation\n{}Scale -1 1 1\n{}",
        triangle(""),
        triangle(against),
        triangle(""),
        triangle("")
    );
    let found = imported(&inner);
    let normals: Vec<DVec3> = found
        .scene
        .objects
        .iter()
        .map(|object| {
            let Shape::Mesh(mesh) = &object.shape else { panic!("a mesh") };
            let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a).normalize()
        })
        .collect();
    assert_eq!(normals, [DVec3::Z, DVec3::NEG_Z, DVec3::NEG_Z, DVec3::NEG_Z]);
}

#[test]
fn what_is_clipped_is_told() {
    let sphere = "Shape \"sphere\"";
    for (inner, words) in [
        (
            format!("Material \"diffuse\" \"rgb reflectance\" [1.5 .2 .2]\n{sphere}"),
            "a reflectance above 1, which is 1",
        ),
        (
            format!("Material \"diffuse\" \"rgb reflectance\" [-.5 .2 .2]\n{sphere}"),
            "`reflectance` with negative values, which are 0",
        ),
        ("LightSource \"infinite\" \"rgb L\" [-1 1 1]".to_owned(), "`L` with negative values, which are 0"),
        (
            format!(
                "Material \"diffusetransmission\" \"rgb reflectance\" [.8 .8 .8] \"rgb transmittance\" [.8 .8 .8]\n{sphere}"
            ),
            "of 1.600 in all, both scaled to 1 in all",
        ),
        (
            "LightSource \"spot\" \"float coneangle\" 30 \"float conedeltaangle\" 40".to_owned(),
            "`conedeltaangle` of 40 as 30",
        ),
        (
            format!("Material \"conductor\" \"float roughness\" 1.5 \"bool remaproughness\" false\n{sphere}"),
            "a roughness of 1.5 as 1",
        ),
    ] {
        let page = imported(&inner).page;
        assert!(page.contains(words), "{inner}: {page}");
    }
}

#[test]
fn mistakes_have_file_and_line() {
    let said = |text: &str| {
        let (folder, path) = written("scene.pbrt", text);
        let error = spectile::import::import(&path, &folder.path().join("out")).expect_err(text);
        assert!(!folder.path().join("out").exists() && error.exit_code() == 2, "{error}");
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    for (inner, expected) in [
        ("NamedMaterial \"x\"", "scene.pbrt:7: no material is named \"x\""),
        ("Shape \"sphere\" \"float radius\" [a]", "scene.pbrt:7: `a` is not a finite number"),
        ("Shape \"sphere\" \"float radius\" [1", "the values of `radius` have no `]`"),
        ("Shape \"sphere\" \"radius\" 1", "a parameter is `\"type name\"`"),
        ("AttributeEnd", "scene.pbrt:7: `AttributeEnd` ends what has not begun"),
        ("AttributeBegin", "scene.pbrt: ends before an `AttributeEnd`"),
        ("Include \"../a.pbrt\"", "is not in the folder of the scene"),
        ("Include \"scene.pbrt\"", "scene.pbrt: includes itself"),
        ("Shape \"plymesh\" \"string filename\" \"a.ply\"", "scene.pbrt:7: a.ply: cannot be read"),
        (
            "Shape \"trianglemesh\" \"integer indices\" [0 1 9] \"point3 P\" [0 0 0 1 0 0 0 1 0]",
            "`indices` must be whole numbers from 0 to 2",
        ),
        ("Translate 1 2", "the file ends where 3 numbers are expected"),
        ("Scale 0 1 1", "scene.pbrt:7: a `Scale` of 0 flattens space"),
        ("Wobble", "`Wobble` is no directive of pbrt-v4"),
        ("Material \"diffuse\" \"spectrum reflectance\" \"metal-Xx-k\"", "the metal of \"metal-Xx-k\" is not known"),
        ("\"open", "a text in quotes has no end on its line"),
    ] {
        let found = said(&scene(inner));
        assert!(found.contains(expected) && !found.contains('\n'), "{inner}: {found}");
    }
    assert!(said("").contains("has no `WorldBegin`"));
}

/// All of them, with nothing done by hand.
#[test]
fn scenes_of_others_are_read() {
    for name in [
        "pbrt-cornell/cornell-box.pbrt",
        "pbrt-cornell/cornell-box-specular.pbrt",
        "pbrt-cornell/cornell-box-silver.pbrt",
        "pbrt-cornell/smallpt.pbrt",
        "pbrt-macbeth/MacBethChecker.pbrt",
        "pbrt-checkerboard/checkerboard.pbrt",
        "pbrt-arealight/arealight.pbrt",
        "pbrt-veach-mis-colour/veach-mis-colorized.pbrt",
        "pbrt-veach-bidir/scene-v4.pbrt",
    ] {
        let Some(path) = others(name) else { return };
        let found = import(&path);
        assert!(!found.scene.objects.is_empty() && found.page.starts_with("# Import of "), "{name}");
    }
}

#[test]
#[ignore = "a map of two million texels, 20 s"]
fn a_map_of_equal_areas_is_unrolled() {
    let Some(path) = others("pbrt-envmap/cornell-box-environment-map.pbrt") else { return };
    let found = import(&path);
    assert!(
        found.scene.environment.is_some() && found.toml.contains("map = \"textures/Skydome.exr\""),
        "{}",
        found.toml
    );
}
