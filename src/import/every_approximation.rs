//! Every place in the code that approximates something is come to by a scene here, and says how far off that is.

use std::collections::BTreeSet;
use std::path::Path;

use super::scene::Scene;
use super::{gltf, mitsuba, pbrt};

const SENSOR: &str = "<sensor type=\"perspective\"/>";

/// Scenes by name; `{…}` of Mitsuba's stands within a scene with a camera.
fn scenes() -> Vec<(&'static str, String)> {
    let mitsuba = |inner: &str| ("a.xml", format!("<scene version=\"3.0.0\">{SENSOR}{inner}</scene>"));
    let bsdf = |inner: &str| mitsuba(&format!("<shape type=\"rectangle\">{inner}</shape>"));
    let bitmap = |name: &str, file: &str, more: &str| {
        format!(
            "<texture name=\"{name}\" type=\"bitmap\"><boolean name=\"raw\" value=\"true\"/><string name=\"filename\" value=\"{file}\"/>{more}</texture>"
        )
    };
    let pbrt = |before: &str, inner: &str| ("a.pbrt", format!("{before}\nWorldBegin\n{inner}\n"));
    let camera = "Camera \"perspective\"";
    let surface = |inner: &str| pbrt(camera, &format!("{inner} Shape \"sphere\""));
    let image = "Texture \"p\" \"spectrum\" \"imagemap\" \"string filename\" \"dim.pfm\"\nTexture \"n\" \"float\" \"imagemap\" \"string filename\" \"dim.pfm\"\n";
    let diffuse = |texture: &str| {
        surface(&format!(
            "{image}Texture \"t\" \"spectrum\" {texture}\nMaterial \"diffuse\" \"texture reflectance\" \"t\""
        ))
    };
    let gltf = |material: &str, more: &str| ("a.gltf", GLTF.replace("MATERIAL", material).replace("MORE", more));
    let clear = "\"KHR_materials_transmission\": {\"transmissionFactor\": ";
    vec![
        (
            "a.xml",
            "<scene version=\"3.0.0\"><sensor type=\"distant\"><film type=\"hdrfilm\"><rfilter type=\"tent\"/></film></sensor></scene>".into(),
        ),
        (
            "a.xml",
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"><film type=\"hdrfilm\"><rfilter type=\"odd\"/></film></sensor></scene>".into(),
        ),
        mitsuba(&format!("<integrator type=\"ptracer\"/><emitter type=\"point\">{}</emitter>", bitmap("intensity", "dim.pfm", ""))),
        mitsuba("<emitter type=\"envmap\"><string name=\"filename\" value=\"tall.pfm\"/></emitter>"),
        mitsuba("<shape type=\"sphere\"><transform name=\"to_world\"><scale x=\"2\"/></transform></shape>"),
        bsdf(&format!(
            "<bsdf type=\"principled\"><rgb name=\"base_color\" value=\"1\"/>{}</bsdf>",
            bitmap("metallic", "dim.pfm", "")
        )),
        bsdf(&format!(
            "<bsdf type=\"principled\">{}<float name=\"metallic\" value=\"1.5\"/>{}</bsdf>",
            bitmap("base_color", "dim.pfm", ""),
            bitmap("roughness", "bright.pfm", "")
        )),
        bsdf("<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"odd\"/></bsdf>"),
        bsdf(&format!(
            "<bsdf type=\"diffuse\">{}</bsdf>",
            bitmap("reflectance", "bright.pfm", "<string name=\"wrap_mode\" value=\"clamp\"/>")
        )),
        bsdf(&format!(
            "<bsdf type=\"diffuse\">{}</bsdf>",
            bitmap("reflectance", "dim.pfm", "<transform name=\"to_uv\"><rotate z=\"1\" angle=\"30\"/></transform>")
        )),
        bsdf(&format!(
            "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\">{}</texture></bsdf>",
            bitmap("color0", "dim.pfm", "")
        )),
        bsdf("<bsdf type=\"odd\"/>"),
        bsdf("<bsdf type=\"plastic\"/>"),
        bsdf("<bsdf type=\"thindielectric\"/>"),
        bsdf("<bsdf type=\"roughdielectric\"><float name=\"alpha_u\" value=\"0.1\"/><float name=\"alpha_v\" value=\"1.5\"/></bsdf>"),
        bsdf(&format!("<bsdf type=\"conductor\">{}{}</bsdf>", bitmap("eta", "dim.pfm", ""), bitmap("specular_reflectance", "dim.pfm", ""))),
        bsdf("<bsdf type=\"conductor\"><rgb name=\"specular_reflectance\" value=\"0.9, 0.5, 0.1\"/></bsdf>"),
        bsdf("<bsdf type=\"difftrans\"><float name=\"reflectance\" value=\"0.8\"/><float name=\"transmittance\" value=\"0.8\"/></bsdf>"),
        pbrt("Camera \"perspective\" \"float screenwindow\" [-1 1.111 -1 1]\nPixelFilter \"mitchell\"\nIntegrator \"odd\"", ""),
        pbrt("Camera \"realistic\"\nPixelFilter \"odd\"", ""),
        pbrt("Scale -1 1 1 Camera \"spherical\"", ""),
        surface("Material \"coateddiffuse\" \"float uroughness\" 0.1 \"float vroughness\" 0.5"),
        surface("Material \"thindielectric\""),
        surface("Material \"hair\""),
        surface("Material \"coatedconductor\""),
        surface(&format!("{image}Material \"coatedconductor\" \"texture conductor.reflectance\" \"p\"")),
        surface(&format!("{image}Material \"conductor\" \"texture reflectance\" \"p\" \"texture eta\" \"p\" \"texture uroughness\" \"n\"")),
        surface("Material \"diffuse\" \"rgb reflectance\" [-1 2 0.5]"),
        surface("Material \"diffuse\" \"spectrum reflectance\" [400 2 700 2]"),
        surface("AreaLightSource \"diffuse\" \"float spread\" 30"),
        diffuse("\"bilerp\" \"float uscale\" 3"),
        diffuse("\"checkerboard\" \"integer dimension\" 3"),
        diffuse("\"marble\""),
        diffuse("\"imagemap\" \"string filename\" \"bright.pfm\" \"string wrap\" \"clamp\" \"string mapping\" \"planar\""),
        diffuse("\"scale\" \"texture tex\" \"p\" \"texture scale\" \"p\""),
        surface(&format!(
            "{image}Texture \"q\" \"spectrum\" \"imagemap\" \"string filename\" \"dim.pfm\" \"float uscale\" 1.2345\n\
             Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"p\" \"texture tex2\" \"q\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\""
        )),
        pbrt(camera, "LightSource \"infinite\" \"string filename\" \"dim.pfm\""),
        pbrt(camera, "Shape \"sphere\" \"float zmax\" 0.5\nShape \"bilinearmesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0  1 1 1]"),
        gltf("\"pbrMetallicRoughness\": {\"metallicFactor\": 1.5, \"baseColorTexture\": {\"index\": 0}}", "TEXTURED"),
        gltf("\"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0}}, \"extensions\": {\"KHR_materials_unlit\": {}}", ""),
        gltf(
            "\"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 1, \"extensions\": {\"KHR_texture_transform\": {\"rotation\": 0.5}}}}",
            "TEXTURED",
        ),
        gltf(&format!("\"extensions\": {{\"KHR_materials_ior\": {{\"ior\": 0.5}}, {clear}1}}}}"), ""),
        gltf(&format!("\"pbrMetallicRoughness\": {{\"metallicFactor\": 0}}, \"extensions\": {{{clear}0.5}}}}"), ""),
    ]
}

const GLTF: &str = r#"{"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}},
    "nodes": [{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}], "meshes": [{"primitives": [{"attributes":
        {"POSITION": 0 MORE}, "material": 0}]}], "materials": [{MATERIAL}],
    "textures": [{"source": 0}, {"source": 0, "sampler": 0}], "images": [{"uri": "two.png"}], "samplers": [{"wrapS": 33071}],
    "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 3},
        {"bufferView": 1, "componentType": 5121, "normalized": true, "type": "VEC2", "count": 3}],
    "bufferViews": [{"buffer": 0, "byteLength": 9}, {"buffer": 0, "byteOffset": 9, "byteLength": 6}],
    "buffers": [{"byteLength": 15, "uri": "data:;base64,AAAAAQAAAAEAAAD/AAD/"}]}"#;

/// A portable float map of a shade and others that differ from it.
fn picture(size: [u32; 2], shades: [f32; 3]) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", size[0], size[1]).into_bytes();
    for i in 0..size[0] * size[1] {
        let shade = shades.map(|v| v * (1.0 - (i % 3) as f32 / 4.0));
        shade.into_iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    bytes
}

/// Lines of the code that approximate something, by file.
fn places_in_the_code() -> BTreeSet<(String, u32)> {
    fn collect(folder: &Path, found: &mut BTreeSet<(String, u32)>) {
        for entry in std::fs::read_dir(folder).expect("the code") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                collect(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("every_approximation.rs") {
                let text = std::fs::read_to_string(&path).expect("code");
                let name = path
                    .strip_prefix(env!("CARGO_MANIFEST_DIR"))
                    .expect("of this package")
                    .to_string_lossy()
                    .into_owned();
                let lines = text.lines().zip(1..).filter(|(line, _)| line.contains(".approximated("));
                found.extend(lines.map(|(_, number)| (name.clone(), number)));
            }
        }
    }
    let mut found = BTreeSet::new();
    collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/import"), &mut found);
    found
}

#[test]
fn every_approximation_says_how_far_off_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("dim.pfm", &picture([4, 4], [0.8, 0.4, 0.2]));
    write("bright.pfm", &picture([4, 4], [2.0, 1.0, 0.5]));
    write("tall.pfm", &picture([4, 257], [1.0, 1.0, 1.0]));
    write("two.png", &crate::format::png::encode([2, 1], &[255, 128, 0, 0, 64, 255]).unwrap());
    let mut met = BTreeSet::new();
    for (name, text) in scenes() {
        let text = text.replace("TEXTURED", ", \"TEXCOORD_0\": 1");
        write(name, text.as_bytes());
        let source = folder.path().join(name);
        let mut scene = Scene::new(&folder.path().join("out"));
        let read = match name {
            "a.xml" => mitsuba::read,
            "a.pbrt" => pbrt::read,
            _ => gltf::read,
        };
        read(&source, &mut scene).unwrap_or_else(|e| panic!("{e}: {text}"));
        let page = scene.report.page(&source);
        let approximated = page.split("## ").find(|part| part.starts_with("Approximated")).unwrap();
        for line in approximated.lines().filter(|line| line.starts_with("- ")) {
            let said = ["off by at most ", "measured off by ", "no bound: "]
                .iter()
                .filter_map(|begin| line.split_once(&format!(": {begin}")));
            let rest: Vec<&str> = said.map(|(_, rest)| rest).collect();
            assert!(rest.len() == 1 && rest[0].len() > 3 || rest[0].parse::<f64>().is_ok(), "{line}");
            let numbers = line.contains("no bound: ")
                || rest[0].chars().any(|c| c.is_ascii_digit())
                || line.contains("spherical");
            assert!(numbers && !line.contains("NaN") && !line.contains("inf "), "{line}");
        }
        met.extend(scene.report.made_at.iter().map(|(file, line)| ((*file).to_owned(), *line)));
    }
    let missing: Vec<_> = places_in_the_code().difference(&met).cloned().collect();
    assert!(missing.is_empty(), "no scene here comes to {missing:?}");
}
