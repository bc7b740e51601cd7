//! Scenes of glTF 2.0.

use glam::DVec3;
use spectile::scene::{Bsdf, Light, Projection, Roughness, Weight};

use super::{import, others, written};

/// A triangle of every material, a camera that is moved, and lights of every kind.
pub const SCENE: &str = r#"{"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_lights_punctual", "EXT_unheard_of"],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 72983.5, "color": [1, 1, 1]},
        {"type": "directional", "intensity": 10}, {"type": "spot", "spot": {"outerConeAngle": 0.5235987755982988}}]}},
    "nodes": [{"mesh": 0, "name": "plate"},
        {"camera": 0, "translation": [0, 0, 5], "rotation": [0, 1, 0, 0]},
        {"translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}}, {"extensions": {"KHR_lights_punctual": {"light": 2}}}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0471975511965976, "aspectRatio": 2, "znear": 0.1}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}, {"attributes": {"POSITION": 0}, "material": 1},
        {"attributes": {"POSITION": 0, "COLOR_0": 0}, "material": 2}, {"attributes": {"POSITION": 0}}]}],
    "materials": [{"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 0.25], "metallicFactor": 0,
            "roughnessFactor": 0.5}, "alphaMode": "BLEND"},
        {"name": "half", "pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.25, 0.25, 1], "metallicFactor": 0.5},
            "emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 729835}}},
        {"name": "glass", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0}, "extensions":
            {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_volume": {"thicknessFactor": 1}}}],
    "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 3}],
    "bufferViews": [{"buffer": 0, "byteLength": 9}],
    "buffers": [{"byteLength": 9, "uri": "data:;base64,AAAAAQAAAAEA"}]}"#;

#[test]
fn cameras_lights_and_materials() {
    let (_folder, path) = written("scene.gltf", SCENE);
    let found = import(&path);
    let scene = &found.scene;
    assert!(scene.camera.position.distance(DVec3::Z * 5.0) < 1e-9 && scene.camera.forward.distance(DVec3::Z) < 1e-6);
    let Projection::Perspective { tan_half } = scene.camera.projection else { panic!("a pinhole") };
    assert!((tan_half.y - 30f64.to_radians().tan()).abs() < 1e-6 && scene.film.width == 1440);
    // 683 lm/W times 106.857 nm: 72,983.5 cd have luminance 1, as D65, which is 1.051 at 550 nm.
    let at = |id: usize| scene.spectra[id].curve.eval(550.0);
    let Light::Point { position, intensity } = scene.lights[0] else { panic!("{:?}", scene.lights[0]) };
    assert!(position == DVec3::new(1.0, 2.0, 3.0) && (at(intensity) - 1.051).abs() < 0.01, "{}", at(intensity));
    let Light::Directional { direction, .. } = scene.lights[1] else { panic!("{:?}", scene.lights[1]) };
    assert_eq!(direction, DVec3::NEG_Z);
    // Its edge is that of the profile which is nearest to glTF's.
    let Light::Spot { .. } = scene.lights[2] else { panic!("{:?}", scene.lights[2]) };
    assert!(found.page.contains("by the nearest one (scene.gltf `nodes[4]`): off by at most "), "{}", found.page);
    let of = |object: usize| &scene.materials[scene.objects[object].material.expect("one")];
    let Bsdf::Plastic { roughness, .. } = of(0).bsdf else { panic!("{:?}", of(0)) };
    assert_eq!((roughness, of(0).opacity), (Roughness::even(0.25), Some(Weight::Constant(0.25))));
    let Bsdf::Blend { b, weight: Weight::Constant(0.5), .. } = of(1).bsdf else { panic!("{:?}", of(1)) };
    let Bsdf::Conductor { eta, .. } = scene.materials[b].bsdf else { panic!("a metal") };
    // n = 3 reflects a quarter.
    assert!((at(eta) - 3.0).abs() < 1e-6);
    let emission = scene.objects[1].emission.as_ref().expect("it glows");
    assert!((at(emission.radiance) - 10.51).abs() < 0.1, "{}", at(emission.radiance));
    let Bsdf::Dielectric { eta, .. } = of(2).bsdf else { panic!("{:?}", of(2)) };
    assert!((at(eta) - 1.33).abs() < 1e-6);
    // Without a material: a white metal, as glTF has it.
    assert!(matches!(of(3).bsdf, Bsdf::Conductor { .. }), "{:?}", of(3));
    for said in ["the extension EXT_unheard_of", "colours of vertices (COLOR_0) (scene.gltf `meshes[0].primitives[2]`)"]
    {
        assert!(found.page.contains(said), "{}", found.page);
    }
}

#[test]
fn mistakes_have_a_path() {
    for (from, to, expected) in [
        ("{\"light\": 0}", "{\"light\": 9}", "`nodes[2]` names light 9, which does not exist"),
        ("\"camera\": 0", "\"camera\": 3", "`nodes[1]` names camera 3, which does not exist"),
        ("\"yfov\": 1.0471975511965976", "\"yfov\": 0", "`cameras[0].perspective.yfov` must be between 0 and"),
        (
            "\"material\": 1",
            "\"material\": 7",
            "`meshes[0].primitives[1].material` names material 7, which does not exist",
        ),
        ("\"BLEND\"", "\"BLUR\"", "`materials[0].alphaMode` is unknown"),
        (
            "\"name\": \"paint\",",
            "\"name\": \"paint\", \"emissiveTexture\": {\"index\": 4}, \"emissiveFactor\": [1, 1, 1],",
            "names texture 4",
        ),
    ] {
        assert!(SCENE.contains(from), "{from}");
        let (folder, path) = written("scene.gltf", &SCENE.replacen(from, to, 1));
        let error = spectile::import::import(&path, &folder.path().join("out")).expect_err(from);
        let said = error.to_string();
        assert!(said.contains(expected) && !said.contains('\n') && error.exit_code() == 2, "{from}: {said}");
    }
}

/// All of them, with nothing done by hand.
#[test]
fn scenes_of_others_are_read() {
    for name in [
        "gltf-box/BoxInterleaved.glb",
        "gltf-box/BoxVertexColors.glb",
        "gltf-box/BoxTextured_glTF/BoxTextured.gltf",
        "gltf-box/nested.glb",
        "gltf-box/rgb_cube_with_primitives.gltf",
        "gltf-materials/02_shared_mesh/02_shared_mesh.gltf",
        "gltf-materials/17_ior/17_ior.gltf",
        "gltf-light-camera/Cameras.gltf",
        "gltf-light-camera/issue-261.gltf",
    ] {
        let Some(path) = others(name) else { return };
        let found = import(&path);
        assert!(!found.scene.objects.is_empty() && found.page.starts_with("# Import of "), "{name}");
    }
}

/// A mesh at two places of EXT_mesh_gpu_instancing and at a node: an assembly, placed three times.
#[test]
fn meshes_of_several_places_are_assemblies() {
    const PLACED: &str = r#"{"asset": {"version": "2.0"}, "extensionsRequired": ["EXT_mesh_gpu_instancing"],
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "nodes": [{"mesh": 0, "name": "tree", "translation": [0, 1, 0], "extensions": {"EXT_mesh_gpu_instancing":
            {"attributes": {"TRANSLATION": 1}}}}, {"mesh": 0, "translation": [0, 0, 5]}, {"mesh": 1}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}, {"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 3},
            {"bufferView": 1, "componentType": 5126, "type": "VEC3", "count": 2}],
        "bufferViews": [{"buffer": 0, "byteLength": 9}, {"buffer": 1, "byteLength": 24}],
        "buffers": [{"byteLength": 9, "uri": "data:;base64,AAAAAQAAAAEA"},
            {"byteLength": 24, "uri": "data:;base64,AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAA"}]}"#;
    let (folder, path) = written("scene.gltf", PLACED);
    let found = import(&path);
    let [assembly] = &found.scene.assemblies[..] else { panic!("{}", found.toml) };
    let places: Vec<DVec3> = assembly.instances.iter().map(|place| place.translation).collect();
    assert_eq!(places, [DVec3::new(0.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0), DVec3::new(0.0, 0.0, 5.0)]);
    let within: Vec<Option<usize>> = found.scene.objects.iter().map(|object| object.assembly).collect();
    assert_eq!(within, [None, Some(0)], "{}", found.toml);

    for (from, to, expected) in [
        ("\"TRANSLATION\": 1", "\"TRANSLATION\": 7", "accessor 7, which does not exist"),
        ("\"TRANSLATION\": 1", "\"TRANSLATION\": 1, \"SCALE\": 0", "has lists of different lengths"),
        ("{\"TRANSLATION\": 1}", "{}", "has no place"),
    ] {
        assert!(PLACED.contains(from), "{from}");
        std::fs::write(&path, PLACED.replacen(from, to, 1)).expect("written");
        let error = spectile::import::import(&path, &folder.path().join("out")).expect_err(from).to_string();
        assert!(error.contains(expected), "{to}: {error}");
    }
}
