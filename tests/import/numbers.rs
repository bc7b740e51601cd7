//! Numbers by a picture, in every format: roughness, shares.

use spectile::scene::{Bsdf, Roughness, TextureKind, Weight};

use super::{import, written};

const MITSUBA: &str = r#"<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere">
    <bsdf type="roughconductor"><string name="distribution" value="ggx"/><string name="material" value="Au"/>
        <texture name="alpha" type="bitmap"><string name="filename" value="rough.png"/><boolean name="raw" value="true"/></texture>
    </bsdf></shape></scene>"#;
const PRINCIPLED: &str = r#"<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere">
    <bsdf type="principled">
        <texture name="roughness" type="bitmap"><string name="filename" value="rough.png"/><boolean name="raw" value="true"/></texture>
    </bsdf></shape></scene>"#;
const PBRT: &str = r#"Camera "perspective" WorldBegin
Texture "r" "float" "imagemap" "string filename" "rough.png" "string encoding" "linear"
Material "coateddiffuse" "texture roughness" "r" Shape "sphere"
"#;
const GLTF: &str = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
    "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "metallicRoughnessTexture": {"index": 0}}}],
    "textures": [{"source": 0}], "images": [{"uri": "rough.png"}],
    "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 3},
        {"bufferView": 1, "componentType": 5121, "normalized": true, "type": "VEC2", "count": 3}],
    "bufferViews": [{"buffer": 0, "byteLength": 9}, {"buffer": 0, "byteOffset": 9, "byteLength": 6}],
    "buffers": [{"byteLength": 15, "uri": "data:;base64,AAAAAQAAAAEAAAD/AAD/"}]}"#;

/// A PNG of two greys beside each other.
fn picture(greys: [u8; 2]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().expect("a picture");
    writer.write_image_data(&greys.map(|grey| [grey; 3]).concat()).expect("its texels");
    writer.finish().expect("its end");
    bytes
}

/// 51 and 204 of 255: a fifth and four fifths, which Mitsuba's facets have as they are, pbrt's as their roots, and those of glTF and of
/// Mitsuba's principled surfaces as their squares.
#[test]
fn pictures_of_roughness_are_textures() {
    for (name, text, expected) in [
        ("scene.xml", MITSUBA, [0.2, 0.8]),
        ("scene.xml", PRINCIPLED, [0.04, 0.64]),
        ("scene.pbrt", PBRT, [0.2f32.sqrt(), 0.8f32.sqrt()]),
        ("scene.gltf", GLTF, [0.04, 0.64]),
    ] {
        let (folder, path) = written(name, text);
        std::fs::write(folder.path().join("rough.png"), picture([51, 204])).expect("written");
        let found = import(&path);
        let material = &found.scene.materials[found.scene.objects[0].material.expect("one")];
        let (Bsdf::Conductor { roughness, .. } | Bsdf::Plastic { roughness, .. }) = material.bsdf else {
            panic!("{name}: {material:?}")
        };
        let Roughness::Texture(texture) = roughness else { panic!("{name}: {roughness:?}\n{}", found.toml) };
        let texture = &found.scene.textures[texture];
        assert_eq!((&texture.kind, texture.size), (&TextureKind::Number, [2, 1]), "{name}");
        let near = texture.texels.iter().zip(expected).all(|(alpha, expected)| (alpha - expected).abs() < 1e-6);
        assert!(near, "{name}: {:?} instead of {expected:?}", texture.texels);
        assert!(found.scene.objects[0].attributes.uv.is_some() || name != "scene.gltf", "{name}");
        assert!(!found.page.contains("as its mean"), "{name}: {}", found.page);
    }
}

/// What pbrt reads of a picture is linear, of numbers too: 188 of 255 is a half of sRGB. A checkerboard is shares of its two numbers.
#[test]
fn shares_of_pbrt_are_linear() {
    let text = r#"Camera "perspective" WorldBegin
Texture "m" "float" "imagemap" "string filename" "mask.png"
Texture "fields" "float" "checkerboard" "float tex1" 0.25 "float tex2" 0.75
MakeNamedMaterial "a" "string type" "diffuse"
MakeNamedMaterial "b" "string type" "diffuse" "rgb reflectance" [0.1 0.1 0.1]
MakeNamedMaterial "both" "string type" "mix" "string materials" ["a" "b"] "texture amount" "m"
NamedMaterial "both" Shape "sphere"
NamedMaterial "a" Shape "sphere" "texture alpha" "m"
Shape "sphere" "float alpha" 0.25
Shape "sphere" "float alpha" 1
Shape "sphere" "texture alpha" "fields"
"#;
    let (folder, path) = written("scene.pbrt", text);
    std::fs::write(folder.path().join("mask.png"), picture([0, 188])).expect("written");
    let found = import(&path);
    let materials: Vec<_> =
        found.scene.objects.iter().map(|object| &found.scene.materials[object.material.expect("one")]).collect();
    let texels = |texture: usize| found.scene.textures[texture].texels.to_vec();
    let halves = |texels: Vec<f32>| texels[0] == 0.0 && (texels[1] - 0.5).abs() < 0.003;
    let Bsdf::Blend { weight: Weight::Texture(weight), .. } = materials[0].bsdf else { panic!("{:?}", materials[0]) };
    assert!(halves(texels(weight)), "{:?}", texels(weight));
    let Some(Weight::Texture(mask)) = materials[1].opacity else { panic!("{:?}", materials[1]) };
    assert!(halves(texels(mask)), "{:?}", texels(mask));
    assert_eq!(mask, weight, "one picture is one file");
    assert_eq!((materials[2].opacity, materials[3].opacity), (Some(Weight::Constant(0.25)), None));
    let Some(Weight::Texture(fields)) = materials[4].opacity else { panic!("{:?}", materials[4]) };
    assert_eq!(texels(fields), [0.75, 0.25, 0.25, 0.75]);
    assert!(!found.page.contains("alpha"), "{}", found.page);
}
