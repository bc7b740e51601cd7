//! Lights and environment maps: what good ones resolve to, and what is said about wrong ones.

use std::f64::consts::PI;
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, WritableImage,
    f16,
};
use glam::DVec3;
use spectile::scene::{self, Environment, EnvironmentMap, Light, Profile, Scene, Texels};
use spectile::spectral::{Curve, upsample};
use spectile::{Error, Result};

use super::wrong::check_wrong;
use super::{BASE, changed, good, overrides};

const SKY: &str = "[environment]\nradiance = 0.25";

/// The base scene with `text` in place of its environment.
fn with(text: &str) -> String {
    changed(SKY, text)
}

#[test]
fn lights_resolve() {
    let scene = good(
        &with(
            "[[lights]]\npoint = { position = [1, 2, 3], intensity = \"lamp\" }
            [[lights]]\ndirectional = { direction = [0, -2, 0], irradiance = 1.5 }
            [[lights]]\nsun = { direction = [0, 0, 1], angular_radius = 0.2665, irradiance = { rgb = [1, 1, 1] } }",
        ),
        &[],
        &[],
    );
    assert_eq!(scene.warnings, Vec::<String>::new());
    let [Light::Point { position, intensity }, Light::Directional { direction, irradiance }, sun] = &scene.lights[..]
    else {
        panic!("{:?}", scene.lights)
    };
    assert_eq!(*position, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(scene.spectra[*intensity].curve, Curve::Blackbody { kelvin: 3000.0, scale: 1.0 });
    assert_eq!((*direction, &scene.spectra[*irradiance].curve), (DVec3::NEG_Y, &Curve::Constant(1.5)));
    let Light::Sun { direction, angular_radius, irradiance } = sun else { panic!("{sun:?}") };
    assert_eq!((*direction, *angular_radius), (DVec3::Z, 0.2665f64.to_radians()));
    // As emission: D65 with Y = 1. Zero outside a table, without a warning, as all that shines.
    assert_eq!(scene.spectra[*irradiance].curve, upsample::emission([1.0; 3]));
    assert!(scene.environment.is_none());

    // Exclusive keys replace one another.
    let text = with("[[lights]]\npoint = { position = [1, 2, 3], intensity = 1 }");
    let sun = ("lights.0.sun", "{ direction = [0, -1, 0], angular_radius = 90, irradiance = 1 }");
    let scene = good(&text, &[], &[sun]);
    assert!(matches!(scene.lights[..], [Light::Sun { angular_radius, .. }] if angular_radius == PI / 2.0));
}

#[test]
fn spots_resolve() {
    let spot = |more: &str| {
        let text = format!(
            "[[lights]]\nspot = {{ position = [1, 2, 3], direction = [0, 0, -2], intensity = \"lamp\", half_angle = 30{more} }}"
        );
        let scene = good(&with(&text), &[], &[]);
        let [Light::Spot { position, direction, cone, .. }] = scene.lights[..] else { panic!("{:?}", scene.lights) };
        assert_eq!((position, direction), (DVec3::new(1.0, 2.0, 3.0), DVec3::NEG_Z));
        (cone.half_angle.to_degrees().round(), cone.falloff.to_degrees().round(), cone.profile)
    };
    assert_eq!(spot(""), (30.0, 30.0, Profile::Smooth));
    assert_eq!(spot(", falloff = 0, profile = \"linear\""), (30.0, 0.0, Profile::Linear));
}

#[test]
fn wrong_lights() {
    #[rustfmt::skip]
    let cases: [(&str, &str, &str, &[&str]); 17] = [
        ("no half angle", "[[lights]]\nspot = { position = [0, 0, 0], direction = [0, 0, 1], intensity = 1 } #!", "lights.0.spot.half_angle", &["`half_angle` is missing"]),
        ("wide spot", "[[lights]]\nspot = { position = [0, 0, 0], direction = [0, 0, 1], intensity = 1, half_angle = 181 } #!", "lights.0.spot.half_angle", &["(0, 180] degrees, but is 181"]),
        ("falls beyond its end", "[[lights]]\nspot = { position = [0, 0, 0], direction = [0, 0, 1], intensity = 1, half_angle = 20, falloff = 25 } #!", "lights.0.spot.falloff", &["[0, 20] degrees, up to `half_angle`, but is 25"]),
        ("unknown profile", "[[lights]]\nspot = { position = [0, 0, 0], direction = [0, 0, 1], intensity = 1, half_angle = 20, profile = \"cubic\" } #!", "lights.0.spot.profile", &["must be one of", "\"linear\""]),
        ("no kind", "[[lights]] #!", "lights.0", &["has no kind of light", "point, spot, directional, sun"]),
        ("two kinds", "[[lights]]\npoint = { position = [0, 0, 0], intensity = 1 }\nsun = { direction = [0, 0, 1], angular_radius = 1, irradiance = 1 } #!", "lights.0.sun", &["only one kind of light"]),
        ("misspelt", "[[lights]]\npiont = { position = [0, 0, 0], intensity = 1 } #!", "lights.0.piont", &["did you mean `point`?"]),
        ("key of point", "[[lights]]\npoint = { position = [0, 0, 0], intensity = 1, irradiance = 1 } #!", "lights.0.point.irradiance", &["unknown key"]),
        ("no position", "[[lights]]\npoint = { intensity = 1 } #!", "lights.0.point.position", &["`position` is missing"]),
        ("no intensity", "[[lights]]\npoint = { position = [0, 0, 0] } #!", "lights.0.point.intensity", &["`intensity` is missing"]),
        ("intensity below 0", "[[lights]]\npoint = { position = [0, 0, 0], intensity = -1 } #!", "lights.0.point.intensity", &["an intensity must lie in [0, 1e35]"]),
        ("no direction", "[[lights]]\ndirectional = { irradiance = 1 } #!", "lights.0.directional.direction", &["`direction` is missing"]),
        ("direction of nothing", "[[lights]]\ndirectional = { direction = [0, 0, 0], irradiance = 1 } #!", "lights.0.directional.direction", &["length is 0"]),
        ("unknown spectrum", "[[lights]]\ndirectional = { direction = [0, 0, 1], irradiance = \"lmap\" } #!", "lights.0.directional.irradiance", &["did you mean `lamp`?"]),
        ("sun too small", "[[lights]]\nsun = { direction = [0, 0, 1], angular_radius = 1e-4, irradiance = 1 } #!", "lights.0.sun.angular_radius", &["[0.001, 90] degrees", "`directional`"]),
        ("sun too large", "[[lights]]\nsun = { direction = [0, 0, 1], angular_radius = 91, irradiance = 1 } #!", "lights.0.sun.angular_radius", &["[0.001, 90] degrees"]),
        ("negative sun", "[[lights]]\nsun = { direction = [0, 0, 1], angular_radius = 1, irradiance = -0.5 } #!", "lights.0.sun.irradiance", &["an irradiance must lie in [0, 1e35]"]),
    ];
    for (name, text, key, words) in cases {
        check_wrong(&with(text), &[], name, key, words);
    }
}

/// A folder with a scene's mesh and other files.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new(files: &[(&str, Vec<u8>)]) -> Folder {
        let dir = super::folder(&[]);
        for (name, bytes) in files {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
            std::fs::write(path, bytes).expect("a file");
        }
        Folder(dir)
    }

    fn load(&self, environment: &str) -> Result<Scene> {
        let text = with(&format!("[environment]\n{environment}"));
        scene::parse(&text, &self.0.path().join("scene.toml"), &overrides(&[]))
    }

    #[track_caller]
    fn map(&self, environment: &str) -> (EnvironmentMap, Vec<String>) {
        let scene = self.load(environment).unwrap_or_else(|e| panic!("{e}"));
        match scene.environment {
            // Maps here are small, and of any shape.
            Some(Environment::Map(map)) => {
                (map, scene.warnings.into_iter().filter(|warning| !warning.contains("twice as wide as high")).collect())
            }
            other => panic!("{other:?}"),
        }
    }

    #[track_caller]
    fn refused(&self, environment: &str, words: &[&str]) {
        let Err(error) = self.load(environment) else { panic!("accepted, without {words:?}") };
        assert_eq!(error.exit_code(), 2);
        let message = error.to_string();
        let Error::Input(problems) = error else { panic!("{message}") };
        assert_eq!(problems.len(), 1, "{message}");
        assert_eq!(problems[0].key.as_deref(), Some("environment.map"), "{message}");
        assert!(problems[0].line.is_some(), "{message}");
        words.iter().for_each(|word| assert!(message.contains(word), "no {word:?} in: {message}"));
    }
}

/// A flat Radiance picture.
fn hdr(size: [u32; 2], header: &str, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = format!("{header}\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", size[1], size[0]).into_bytes();
    bytes.extend(texels.iter().flatten());
    bytes
}

fn exr_file(size: [usize; 2], planes: Vec<(&str, FlatSamples)>, units: Option<&str>) -> Vec<u8> {
    let channels = planes.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let mut attributes = LayerAttributes::default();
    if let Some(units) = units {
        attributes.other.insert(Text::from("emissiveUnits"), AttributeValue::Text(Text::from(units)));
    }
    let layer = Layer::new((size[0], size[1]), attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("an EXR");
    bytes.into_inner()
}

/// Values \[y\]\[x\]\[band\] of a spectral map 3 wide and 2 high with 4 bands.
const BANDS: [f64; 4] = [400.0, 450.0, 550.0, 1000.5];
fn value(x: usize, y: usize, band: usize) -> f32 {
    (100 * (y + 1) + 10 * x + band) as f32
}
fn spectral_values() -> Vec<f32> {
    (0..6).flat_map(|texel| (0..4).map(move |band| value(texel % 3, texel / 3, band))).collect()
}

#[track_caller]
fn assert_spectral(map: &EnvironmentMap) {
    let Texels::Spectral { nm, radiance } = &map.texels else { panic!("{map:?}") };
    assert_eq!((map.size, &nm[..], &radiance[..]), ([3, 2], &BANDS[..], &spectral_values()[..]));
}

#[test]
fn rgb_maps_resolve() {
    // RGBE: mantissa x 2^(exponent - 136).
    let texels = [[128, 64, 0, 129], [0, 0, 0, 0], [255, 255, 255, 136], [1, 2, 3, 137]];
    let rgb = [1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 255.0, 255.0, 255.0, 2.0, 4.0, 6.0];
    let half = |v: f32| f16::from_f32(v);
    let plane = |i: usize| (0..4).map(|t| rgb[3 * t + i] as f32).collect::<Vec<f32>>();
    let folder = Folder::new(&[
        ("a.hdr", hdr([2, 2], "#?RADIANCE", &texels)),
        ("b.hdr", hdr([2, 2], "#?RGBE\n# made up\nEXPOSURE=2\nEXPOSURE=0.25", &texels)),
        (
            "c.exr",
            exr_file(
                [2, 2],
                vec![
                    ("R", FlatSamples::F32(plane(0))),
                    ("G", FlatSamples::F16(plane(1).into_iter().map(half).collect())),
                    ("B", FlatSamples::F32(plane(2))),
                    ("A", FlatSamples::F32(vec![1.0; 4])),
                ],
                None,
            ),
        ),
    ]);
    let rgb: Vec<f32> = rgb.iter().map(|v| *v as f32).collect();
    for (file, factor, warnings) in [("a.hdr", 1.0, 0), ("b.hdr", 2.0, 1), ("c.exr", 1.0, 0)] {
        let (map, said) = folder.map(&format!("map = \"{file}\""));
        let Texels::Rgb { rgb: read, .. } = &map.texels else { panic!("{map:?}") };
        let expected: Vec<f32> = rgb.iter().map(|v| v * factor).collect();
        assert_eq!((map.size, &read[..]), ([2, 2], &expected[..]), "{file}");
        assert_eq!((map.to_map, map.scale), (glam::DMat3::IDENTITY, 1.0));
        assert_eq!(said.len(), warnings, "{said:?}");
    }
    // The spectrum of its white is D65; nothing is known beyond the visible, which is said.
    let text = with("[environment]\nmap = \"a.hdr\"\nscale = 3");
    let file = folder.0.path().join("scene.toml");
    let scene = scene::parse(&text, &file, &overrides(&[("channels.equal.to", "2000")])).unwrap();
    assert!(scene.warnings.iter().any(|warning| warning.contains("830-2000 nm")), "{:?}", scene.warnings);
    let Some(Environment::Map(EnvironmentMap { scale, texels: Texels::Rgb { daylight, .. }, .. })) = &scene.environment
    else {
        panic!("{:?}", scene.environment)
    };
    assert_eq!((*scale, &scene.spectra[*daylight].curve), (3.0, &upsample::daylight()));
    // Exclusive keys replace one another.
    let radiance = overrides(&[("environment.radiance", "2")]);
    assert!(scene::parse(&text, &file, &radiance).unwrap().environment.unwrap().uniform().is_some());
}

/// One grey channel is a colour too; what is not twice as wide as high is told of, but not a single texel.
#[test]
fn grey_maps_and_maps_of_other_shapes() {
    let grey = |size: [usize; 2]| exr_file(size, vec![("Y", FlatSamples::F32(vec![0.5; size[0] * size[1]]))], None);
    let folder = Folder::new(&[("a.exr", grey([2, 1])), ("b.exr", grey([3, 2])), ("c.exr", grey([1, 1]))]);
    let (map, _) = folder.map("map = \"a.exr\"");
    let Texels::Rgb { rgb, .. } = &map.texels else { panic!("{map:?}") };
    assert_eq!(rgb[..], [0.5; 6]);
    for (file, warned) in [("a.exr", false), ("b.exr", true), ("c.exr", false)] {
        let warnings = folder.load(&format!("map = \"{file}\"")).unwrap().warnings;
        assert_eq!(warnings.iter().any(|warning| warning.contains("twice as wide as high")), warned, "{warnings:?}");
    }
}

#[test]
fn small_negative_values_become_0_and_are_said() {
    let folder = Folder::new(&[("a.exr", exr_rgb(&[1.0, 2.0, -0.01, 0.5, -0.001, 2.0]))]);
    let (map, warnings) = folder.map("map = \"a.exr\"");
    let Texels::Rgb { rgb, .. } = &map.texels else { panic!("{map:?}") };
    assert_eq!(rgb[..], [1.0, 2.0, 0.0, 0.5, 0.0, 2.0]);
    assert!(warnings.len() == 1 && warnings[0].contains("2 negative values, the lowest -0.01"), "{warnings:?}");
}

/// Two texels side by side.
fn exr_rgb(rgb: &[f32; 6]) -> Vec<u8> {
    let plane = |i: usize| FlatSamples::F32(vec![rgb[i], rgb[3 + i]]);
    exr_file([2, 1], vec![("R", plane(0)), ("G", plane(1)), ("B", plane(2))], None)
}

/// The spectral layout of EXR: channels stand by the bytes of their names, 1000.5 before 400.
#[test]
fn spectral_exr_resolves() {
    let plane = |band: usize| FlatSamples::F32((0..6).map(|t| value(t % 3, t / 3, band)).collect());
    let planes = || {
        vec![
            ("S0.400,000000nm", plane(0)),
            ("S0.0,45um", plane(1)),
            ("S0.550,000000nm", plane(2)),
            ("S0.1000,500000nm", plane(3)),
            ("R", plane(0)),
            ("G", plane(0)),
            ("B", plane(0)),
        ]
    };
    let folder = Folder::new(&[
        ("a.exr", exr_file([3, 2], planes(), Some("W.m^-2.sr^-1"))),
        ("b.exr", exr_file([3, 2], planes(), Some("mW m-2 sr-1 nm-1"))),
        ("c.exr", exr_file([3, 2], planes(), Some("counts"))),
    ]);
    let (map, warnings) = folder.map("map = \"a.exr\"");
    assert_spectral(&map);
    assert_eq!(warnings, Vec::<String>::new());
    let (map, warnings) = folder.map("map = \"b.exr\"");
    let Texels::Spectral { radiance, .. } = &map.texels else { panic!("{map:?}") };
    assert!(radiance.iter().zip(spectral_values()).all(|(a, b)| (a - 1e-3 * b).abs() <= 1e-6 * b), "{radiance:?}");
    assert!(warnings.len() == 1 && warnings[0].contains("`mW m-2 sr-1 nm-1`, which is converted"), "{warnings:?}");
    folder.refused("map = \"c.exr\"", &["`counts`, which is no spectral radiance"]);
}

fn envi_header(interleave: &str, data_type: u32, byte_order: u32, more: &str) -> Vec<u8> {
    format!(
        "ENVI\ndescription = {{ made\n up }}\nsamples = 3\nlines   = 2\nbands = 4\nheader offset = 5\n; a comment = 1\n\
        data type = {data_type}\ninterleave = {interleave}\nbyte order = {byte_order}\nwavelength units = Micrometers\n\
        wavelength = {{ 0.55, 0.4,\n 1.0005, 0.45 }}\n{more}"
    )
    .into_bytes()
}

/// Every order of numbers, both orders of bytes, several types, named by data or header; bands not in order.
#[test]
fn envi_resolves() {
    let order = [2, 0, 3, 1];
    let numbers = |interleave: &str| -> Vec<f32> {
        let at = |i: usize| match interleave {
            "bsq" => (i % 3, i / 3 % 2, i / 6),
            "bil" => (i % 3, i / 12, i / 3 % 4),
            _ => (i / 4 % 3, i / 12, i % 4),
        };
        (0..24).map(at).map(|(x, y, band)| value(x, y, order[band])).collect()
    };
    for (interleave, data_type, byte_order, data, named) in [
        ("bsq", 4, 0, "a.img", "a.img"),
        ("bil", 5, 1, "a.dat", "a.hdr"),
        ("bip", 12, 1, "a", "a"),
        ("bip", 2, 0, "a.bip", "a.hdr"),
        ("bsq", 4, 1, "a.raw", "a.raw"),
    ] {
        let mut bytes = b"12345".to_vec();
        for number in numbers(interleave) {
            let mut little = match data_type {
                4 => number.to_le_bytes().to_vec(),
                5 => f64::from(number).to_le_bytes().to_vec(),
                _ => (number as u16).to_le_bytes().to_vec(),
            };
            if byte_order == 1 {
                little.reverse();
            }
            bytes.extend(little);
        }
        let header = if data == "a.raw" { "a.raw.hdr" } else { "a.hdr" };
        let mut text = envi_header(interleave, data_type, byte_order, "");
        if data == "a.dat" {
            // As some editors begin a text.
            text.splice(..0, *b"\xef\xbb\xbf");
        }
        let folder = Folder::new(&[(data, bytes), (header, text)]);
        let (map, warnings) = folder.map(&format!("map = \"{named}\""));
        let Texels::Spectral { nm, radiance } = &map.texels else { panic!("{map:?}") };
        // Micrometres in text are not nanometres to the last bit.
        assert!(nm.iter().zip(BANDS).all(|(a, b)| (a - b).abs() < 1e-9), "{nm:?}");
        assert_eq!((map.size, &radiance[..]), ([3, 2], &spectral_values()[..]), "{interleave} {data}");
        assert_eq!(warnings, Vec::<String>::new());
    }
}

/// The metadata of a Zarr v3 array in one plain chunk.
fn zarr_array(shape: &[usize], kind: &str, names: &[&str], attributes: &str) -> Vec<u8> {
    format!(
        r#"{{"zarr_format": 3, "node_type": "array", "shape": {shape:?}, "data_type": "{kind}",
        "chunk_grid": {{"name": "regular", "configuration": {{"chunk_shape": {shape:?}}}}},
        "chunk_key_encoding": {{"name": "default", "configuration": {{"separator": "/"}}}},
        "fill_value": 0, "codecs": [{{"name": "bytes", "configuration": {{"endian": "little"}}}}],
        "dimension_names": {names:?}, "attributes": {attributes}}}"#
    )
    .into_bytes()
}

/// A Zarr v3 group of two arrays in plain chunks; `order` are the dimensions of the radiance.
fn zarr(order: [&str; 3], units: &str) -> Vec<(String, Vec<u8>)> {
    let length = |name: &str| match name {
        "wavelength" => 4,
        "y" => 2,
        _ => 3,
    };
    let shape = order.map(length);
    let mut values = Vec::new();
    for i in 0..24 {
        let index = [i / (shape[1] * shape[2]), i / shape[2] % shape[1], i % shape[2]];
        let of = |name: &str| index[order.iter().position(|o| *o == name).expect("a dimension")];
        values.extend(value(of("x"), of("y"), of("wavelength")).to_le_bytes());
    }
    let wavelengths = BANDS.iter().flat_map(|nm| nm.to_le_bytes()).collect();
    vec![
        ("s.zarr/zarr.json".into(), br#"{"zarr_format": 3, "node_type": "group", "attributes": {}}"#.to_vec()),
        ("s.zarr/sky/zarr.json".into(), zarr_array(&shape, "float32", &order, "{}")),
        ("s.zarr/sky/c/0/0/0".into(), values),
        ("s.zarr/wavelength/zarr.json".into(), zarr_array(&[4], "float64", &["wavelength"], units)),
        ("s.zarr/wavelength/c/0".into(), wavelengths),
    ]
}

fn zarr_folder(order: [&str; 3], units: &str) -> Folder {
    let files = zarr(order, units);
    Folder::new(&files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect::<Vec<_>>())
}

#[test]
fn zarr_resolves() {
    for order in [["wavelength", "y", "x"], ["y", "x", "wavelength"], ["y", "wavelength", "x"]] {
        let (map, warnings) = zarr_folder(order, r#"{"units": "nm"}"#).map("map = \"s.zarr\"");
        assert_spectral(&map);
        assert_eq!(warnings, Vec::<String>::new());
    }
    let wrong = zarr_folder(["wavelength", "y", "x"], r#"{"units": "K"}"#);
    wrong.refused("map = \"s.zarr\"", &["s.zarr", "\"K\"", "units = \"nm\""]);
    zarr_folder(["wavelength", "y", "x"], "{}").refused("map = \"s.zarr\"", &["in what unit"]);
    zarr_folder(["wavelength", "y", "x"], "{}")
        .refused("map = \"s.zarr/sky\"", &["sky is one Zarr array", "the folder of a group"]);
}

/// The plain store, with files added, and those without content left out.
fn zarr_with(more: &[(&str, Vec<u8>)]) -> Folder {
    let mut files = zarr(["wavelength", "y", "x"], r#"{"units": "nm"}"#);
    files.retain(|(name, _)| more.iter().all(|(other, _)| name != other));
    files.extend(
        more.iter().filter(|(_, bytes)| !bytes.is_empty()).map(|(name, bytes)| (name.to_string(), bytes.clone())),
    );
    Folder::new(&files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect::<Vec<_>>())
}

const OVER_SKY: [&str; 3] = ["wavelength", "y", "x"];

#[test]
fn zarr_attributes_that_are_not_applied_are_refused() {
    let sky = |attributes: &str| {
        zarr_with(&[("s.zarr/sky/zarr.json", zarr_array(&[4, 2, 3], "float32", &OVER_SKY, attributes))])
    };
    for attribute in [
        r#""gain": 2.0"#,
        r#""slope": 2.0"#,
        r#""intercept": 1.0"#,
        r#""multiplier": 2"#,
        r#""offset": 1.0"#,
        r#""scale": "0.5""#,
        r#""Scale_Factor": 10000.0"#,
        r#""Data_Ignore_Value": -9999"#,
        r#""data gain values": [2, 2, 2, 2]"#,
    ] {
        let name = attribute.split('"').nth(1).unwrap();
        let folder = sky(&format!("{{{attribute}}}"));
        folder.refused("map = \"s.zarr\"", &[&format!("`{name}` = "), "which is not applied", "`scale_factor`"]);
    }
    let (map, warnings) = sky(r#"{"gain": 1, "offset": [0, 0], "scale": "linear"}"#).map("map = \"s.zarr\"");
    assert_spectral(&map);
    assert_eq!(warnings, Vec::<String>::new());
}

/// A map of ENVI by latitude and longitude begins where a map does, or is refused.
#[test]
fn envi_maps_begin_in_the_north_west() {
    let with = |info: &str| {
        let more = format!("map info = {{ {info}, WGS-84, units=Degrees }}\n");
        let mut bytes = b"12345".to_vec();
        bytes.extend((0..24).flat_map(|i| (i as f32).to_le_bytes()));
        Folder::new(&[("a.img", bytes), ("a.hdr", envi_header("bsq", 4, 0, &more))])
    };
    for (info, words) in [
        ("Geographic Lat/Lon, 1, 1, 0, 90, 120, 90", Some("begins at longitude 0")),
        ("Geographic Lat/Lon, 1.5, 1.5, 60, 45, 120, 90", Some("begins at longitude 0")),
        ("Geographic Lat/Lon, 1, 1, -180, 45, 120, 90", Some("begins at latitude 45")),
        ("Geographic Lat/Lon, 1, 1, -180, 90, 120, 90", None),
        ("Geographic Lat/Lon, 1.5, 1.5, -120, 45, 120, 90", None),
        ("Arbitrary, 1, 1, 0, 0, 1, 1", None),
    ] {
        let folder = with(info);
        match words {
            Some(words) => folder.refused("map = \"a.img\"", &["map info", words]),
            None => drop(folder.map("map = \"a.img\"")),
        }
    }
}

#[test]
fn zarr_arrays_of_other_quantities_are_refused_by_name() {
    for (attribute, what) in [
        (r#""standard_name": "toa_brightness_temperature""#, "a temperature"),
        (r#""standard_name": "toa_bidirectional_reflectance""#, "a reflectance"),
        (r#""long_name": "log10 of radiance""#, "logarithms"),
        (r#""long_name": "spectral irradiance""#, "an irradiance"),
        (r#""long_name": "photon radiance""#, "a number of photons"),
        (r#""long_name": "irradiance reflectance""#, "a reflectance"),
        (r#""long_name": "standard deviation of radiance""#, "an error or spread"),
        (r#""long_name": "luminance""#, "a luminous quantity"),
        (r#""standard_name": "downwelling_photon_radiance_in_sea_water""#, "a number of photons"),
        (r#""standard_name": "toa_outgoing_radiance_per_unit_wavenumber""#, "a quantity per wavenumber"),
    ] {
        let attributes = format!("{{{attribute}}}");
        let array = zarr_array(&[4, 2, 3], "float32", &OVER_SKY, &attributes);
        zarr_with(&[("s.zarr/sky/zarr.json", array)]).refused("map = \"s.zarr\"", &["says that `sky` is", what]);
    }
    let named = r#"{"standard_name": "toa_outgoing_radiance_per_unit_wavelength", "long_name": "sky"}"#;
    let array = zarr_array(&[4, 2, 3], "float32", &OVER_SKY, named);
    assert_spectral(&zarr_with(&[("s.zarr/sky/zarr.json", array)]).map("map = \"s.zarr\"").0);
}

#[test]
fn zarr_wavelengths_in_air_are_converted() {
    for attribute in
        [r#""long_name": "wavelength in air""#, r#""standard_name": "air_wavelength""#, r#""medium": "air""#]
    {
        let axis = zarr_array(&[4], "float64", &["wavelength"], &format!(r#"{{"units": "nm", {attribute}}}"#));
        let (map, warnings) = zarr_with(&[("s.zarr/wavelength/zarr.json", axis)]).map("map = \"s.zarr\"");
        let Texels::Spectral { nm, .. } = &map.texels else { panic!("{map:?}") };
        assert!(nm.iter().zip(BANDS).all(|(a, b)| (a / b - 1.000_28).abs() < 2e-5), "{nm:?}");
        assert!(warnings.len() == 1 && warnings[0].contains("converted to vacuum"), "{warnings:?}");
    }
}

/// Beside the wavelengths, by any of the names that they have.
#[test]
fn zarr_flags_of_bad_bands_are_told() {
    for (name, flags, words) in [
        ("good_wavelengths", [1.0, 0.0, 1.0, 1.0], "1 bands"),
        ("bbl", [1.0, 0.0, 0.0, 1.0], "2 bands"),
        ("bad_bands", [1.0, 0.0, 0.0, 0.0], "1 bands"),
        ("mask", [1.0, 0.0, 0.0, 0.0], "flags of its bands"),
        ("mask", [1.0; 4], ""),
        ("valid", [1.0; 4], ""),
    ] {
        let values: Vec<u8> = flags.iter().flat_map(|flag: &f64| flag.to_le_bytes()).collect();
        let folder = zarr_with(&[
            (&format!("s.zarr/{name}/zarr.json"), zarr_array(&[4], "float64", &["wavelength"], "{}")),
            (&format!("s.zarr/{name}/c/0"), values),
        ]);
        let (_, mut warnings) = folder.map("map = \"s.zarr\"");
        warnings.retain(|warning| !warning.contains("shines in none"));
        let is_told = warnings.iter().any(|warning| warning.contains(words) && warning.contains(name));
        assert!(
            is_told != words.is_empty() && warnings.len() == usize::from(!words.is_empty()),
            "{name}: {warnings:?}"
        );
    }
}

/// Balls and pipes shine outward, so that those around everything are dark.
#[test]
fn lamps_around_everything_are_told_of() {
    for (shape, is_told) in [
        ("sphere = { center = [0, 0, 0], radius = 20 }", true),
        ("cylinder = { from = [0, 0, -20], to = [0, 0, 20], radius = 20 }", true),
        ("cube = { min = [-20, -20, -20], max = [20, 20, 20] }", true),
        ("sphere = { center = [0, 0, 9], radius = 1 }", false),
        ("cylinder = { from = [0, 0, 9], to = [0, 0, 10], radius = 1 }", false),
    ] {
        let lamp = format!("[[objects]]\n{shape}\nmaterial = \"soot\"\nemission = 1.0\n\n[environment]");
        let warnings = good(&BASE.replace("[environment]", &lamp), &[], &[]).warnings;
        let told = warnings.iter().filter(|warning| warning.contains("shines ") && warning.contains("emission_sides"));
        assert_eq!(told.count(), usize::from(is_told), "{shape}: {warnings:?}");
        let both = lamp.replace("emission = 1.0", "emission = 1.0\nemission_sides = \"both\"");
        let warnings = good(&BASE.replace("[environment]", &both), &[], &[]).warnings;
        assert!(!warnings.iter().any(|warning| warning.contains("emission_sides")), "{shape}: {warnings:?}");
    }
}

#[test]
fn zarr_chunks_without_a_file_are_told_or_refused() {
    let told = |folder: &Folder| {
        let (_, mut warnings) = folder.map("map = \"s.zarr\"");
        warnings.retain(|warning| !warning.contains("shines in none"));
        warnings
    };
    let warnings = told(&zarr_with(&[("s.zarr/sky/c/0/0/0", vec![])]));
    assert!(
        warnings.len() == 1 && warnings[0].contains("no file of 1 of the 1 chunks of its array `sky`"),
        "{warnings:?}"
    );
    assert!(warnings[0].contains("`c/0/0/0`") && warnings[0].contains("fill value, 0"), "{warnings:?}");
    let v2 = |fill: &str| {
        let metadata = format!(
            r#"{{"zarr_format": 2, "shape": [4, 2, 3], "chunks": [4, 2, 2], "dtype": "<f4", "order": "C", "compressor": null,
            "filters": null, "fill_value": {fill}}}"#
        );
        let names = br#"{"_ARRAY_DIMENSIONS": ["wavelength", "y", "x"]}"#.to_vec();
        zarr_with(&[
            ("s.zarr/sky/zarr.json", vec![]),
            ("s.zarr/sky/c/0/0/0", vec![]),
            ("s.zarr/sky/.zarray", metadata.into_bytes()),
            ("s.zarr/sky/.zattrs", names),
            ("s.zarr/sky/0.0.1", vec![0; 64]),
        ])
    };
    v2("null")
        .refused("map = \"s.zarr\"", &["no file of 1 of its 2 chunks, the first of them `0.0.0`", "no fill value"]);
    v2("\"NaN\"")
        .refused("map = \"s.zarr\"", &["no value at column 0, row 0 of band 1, and has no file of 1 of the 2 chunks"]);
    let warnings = told(&v2("0"));
    assert!(warnings.len() == 1 && warnings[0].contains("no file of 1 of the 2 chunks"), "{warnings:?}");
}

/// The same sky under CF's latitudes and longitudes, however its rows and columns are ordered and named.
#[test]
fn zarr_coordinates_say_where_rows_and_columns_lie() {
    let doubles = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    // (names of the dimensions, of the coordinates, their attributes, latitudes, longitudes, order of rows, of columns)
    let store = |[y, x]: [&str; 2], names: [&str; 2], attributes: [&str; 2], lat: &[f64], lon: &[f64]| {
        let [of_y, of_x] = names.map(|name| format!("s.zarr/{name}"));
        let array = |count: usize, over: &str, attributes: &str| zarr_array(&[count], "float64", &[over], attributes);
        zarr_with(&[
            ("s.zarr/sky/zarr.json", zarr_array(&[4, 2, 3], "float32", &["wavelength", y, x], "{}")),
            (&format!("{of_y}/zarr.json"), array(2, y, attributes[0])),
            (&format!("{of_y}/c/0"), doubles(lat)),
            (&format!("{of_x}/zarr.json"), array(3, x, attributes[1])),
            (&format!("{of_x}/c/0"), doubles(lon)),
        ])
    };
    let cf = [r#"{"units": "degrees_north"}"#, r#"{"standard_name": "longitude"}"#];
    let (south, north) = ([-45.0, 45.0], [45.0, -45.0]);
    for (dimensions, names, attributes, lat, lon, rows, columns) in [
        (["lat", "lon"], ["lat", "lon"], ["{}", "{}"], north, [-120.0, 0.0, 120.0], [0, 1], [0, 1, 2]),
        (["y", "x"], ["y", "x"], cf, south, [-120.0, 0.0, 120.0], [1, 0], [0, 1, 2]),
        (["y", "x"], ["phi", "lam"], cf, south, [0.0, 120.0, 240.0], [1, 0], [2, 0, 1]),
        (["lat", "lon"], ["lat", "lon"], ["{}", "{}"], north, [120.0, 0.0, -120.0], [0, 1], [2, 1, 0]),
        (["lat", "lon"], ["lat", "lon"], ["{}", "{}"], north, [240.0, 120.0, 0.0], [0, 1], [0, 2, 1]),
        // Without a word about what they are, rows go down.
        (["y", "x"], ["y", "x"], ["{}", "{}"], south, [240.0, 120.0, 0.0], [0, 1], [0, 1, 2]),
    ] {
        let (map, warnings) = store(dimensions, names, attributes, &lat, &lon).map("map = \"s.zarr\"");
        let Texels::Spectral { radiance, .. } = &map.texels else { panic!("{map:?}") };
        let expected: Vec<f32> = rows
            .iter()
            .flat_map(|y| columns.iter().flat_map(move |x| (0..4).map(move |band| value(*x, *y, band))))
            .collect();
        assert_eq!(radiance[..], expected, "{dimensions:?} {lon:?}");
        assert_eq!(warnings, Vec::<String>::new());
    }
    // A part of the sphere is taken as all of it, and told of.
    let (_, warnings) = store(["lat", "lon"], ["lat", "lon"], ["{}", "{}"], &[10.0, 20.0], &[170.0, 180.0, 190.0])
        .map("map = \"s.zarr\"");
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(
        warnings[0].contains("latitudes `lat` from 20 to 10")
            && warnings[1].contains("longitudes `lon` from 170 to 190")
    );
}

#[test]
fn radiance_headers_are_applied_refused_or_told() {
    let texels = [[128, 64, 0, 129]; 2];
    let folder = |line: &str| Folder::new(&[("a.hdr", hdr([2, 1], &format!("#?RADIANCE\n{line}"), &texels))]);
    folder("GAMMA=2.2").refused("map = \"a.hdr\"", &["GAMMA=2.2", "not linear"]);
    for (line, words) in
        [("GAMMA=1.0", None), ("PIXASPECT=2", Some("PIXASPECT=2")), ("VIEW= -vtv -vh 45", Some("VIEW=-vtv -vh 45"))]
    {
        let (_, warnings) = folder(line).map("map = \"a.hdr\"");
        assert_eq!(warnings.len(), usize::from(words.is_some()), "{line}: {warnings:?}");
        assert!(words.is_none_or(|words| warnings[0].contains(words)), "{warnings:?}");
    }
}

#[test]
fn envi_titles_of_plots_convert_maps() {
    let titles = "z plot titles = {Wavelength (nm), Radiance (uW/cm^2/sr/nm)}\n";
    let bytes = [b"12345".to_vec(), 2f32.to_le_bytes().repeat(24)].concat();
    let folder = Folder::new(&[("a.img", bytes), ("a.hdr", envi_header("bsq", 4, 0, titles))]);
    let (map, warnings) = folder.map("map = \"a.img\"");
    let Texels::Spectral { radiance, .. } = &map.texels else { panic!("{map:?}") };
    assert!(radiance.iter().all(|v| (v - 0.02).abs() < 1e-8), "{radiance:?}");
    assert!(warnings.len() == 1 && warnings[0].contains("converted to W m-2 sr-1 nm-1"), "{warnings:?}");
}

#[test]
fn wrong_maps() {
    let plane = |v: f32| FlatSamples::F32(vec![v; 6]);
    let data = |bytes: usize| vec![0; bytes];
    let header = |more: &str| envi_header("bsq", 4, 0, more);
    let spoilt = |from: &str, to: &str| String::from_utf8(header("")).unwrap().replace(from, to).into_bytes();
    let folder = Folder::new(&[
        ("text.exr", b"text, not a picture".to_vec()),
        ("cut.hdr", hdr([2, 2], "#?RADIANCE", &[[1, 2, 3, 4]])),
        ("nan.exr", exr_rgb(&[1.0, 2.0, 3.0, 4.0, f32::NAN, 5.0])),
        ("negative.exr", exr_rgb(&[1.0, 2.0, 3.0, 4.0, -0.5, 5.0])),
        ("bright.exr", exr_rgb(&[1e30; 6])),
        ("depth.exr", exr_file([3, 2], vec![("Z", plane(1.0))], None)),
        ("twice.exr", exr_file([3, 2], vec![("S0.500,0nm", plane(1.0)), ("S0.0,5um", plane(1.0))], None)),
        ("short.img", data(100)),
        ("short.hdr", header("")),
        ("alone.hdr", header("")),
        ("complex.img", data(101)),
        ("complex.hdr", spoilt("data type = 4", "data type = 6")),
        ("few.img", data(101)),
        ("few.hdr", spoilt("0.55, 0.4,", "0.55,")),
        ("unit.img", data(101)),
        ("unit.hdr", spoilt("Micrometers", "Index")),
        ("wavenumber.img", data(101)),
        ("wavenumber.hdr", spoilt("Micrometers", "Wavenumber")),
        ("gap.img", data(101)),
        ("gap.hdr", header("data ignore value = 0\n")),
        ("bare.img", data(101)),
        ("bare.hdr", spoilt("wavelength =", "fwhm =")),
        ("units.img", data(101)),
        ("units.hdr", spoilt("wavelength units = Micrometers\n", "")),
        ("two.img", data(101)),
        ("two.bil", data(101)),
        ("two.hdr", header("")),
        ("nested.zarr/.zgroup", b"{}".to_vec()),
        ("nested.zarr/inner/.zgroup", b"{}".to_vec()),
        ("empty.zarr/.zgroup", b"{}".to_vec()),
    ]);
    for (map, words) in [
        ("text.exr", &["text.exr", "no map in a known format", "OpenEXR, Radiance"][..]),
        ("cut.hdr", &["cut.hdr is no Radiance picture"]),
        ("nan.exr", &["nan.exr holds NaN at column 1, row 0"]),
        ("negative.exr", &["holds -0.5 at column 1, row 0", "0 or greater"]),
        ("depth.exr", &["channels Z", "neither R, G, B nor spectral"]),
        ("twice.exr", &["two bands at 500 nm"]),
        ("short.img", &["short.img has 100 bytes", "promises 101"]),
        ("alone.hdr", &["header without its data", "alone.img"]),
        ("gap.img", &["no value at column 0, row 0 of band 1"]),
        ("bare.img", &["lacks `wavelength`", "`wavelength = {"]),
        ("units.img", &["lacks `wavelength units`", "`wavelength units = Nanometers`"]),
        ("two.hdr", &["two.img", "two.bil", "name the file of the data"]),
        ("nested.zarr", &["no array of three dimensions, but the groups inner", "STORE/GROUP"]),
        ("empty.zarr", &["no array of three dimensions", "over y, x and `wavelength`"]),
        ("wavenumber.img", &["does not say in what unit its radiance is", "data units"]),
    ] {
        folder.refused(&format!("map = \"{map}\""), words);
    }
    // Mistakes on a line of a header are shown there.
    for (map, line, words) in [
        ("complex.img", 9, "`data type` must be 1, 2"),
        ("few.img", 13, "a number for each of 4 bands"),
        ("unit.img", 12, "but is `index`"),
    ] {
        let message = folder.load(&format!("map = \"{map}\"")).unwrap_err().to_string();
        let header = format!("{}:{line}", Path::new(map).with_extension("hdr").display());
        assert!(message.contains(&header) && message.contains(words), "{message}");
    }
    for (keys, key, words) in [
        ("map = \"bright.exr\"\nscale = 1e10 #!", "environment.scale", "[0, 1e35]"),
        ("map = \"bright.exr\"\nscale = -1 #!", "environment.scale", "0 or greater"),
        ("map = \"bright.exr\"\nup = [0, 0, 0] #!", "environment.up", "length is 0"),
        ("map = \"bright.exr\"\nrotate_degrees = \"a\" #!", "environment.rotate_degrees", "must be a number"),
        ("map = \"bright.exr\"\nradiance = 1 #!", "environment.radiance", "only one source of radiance"),
    ] {
        let message = folder.load(keys).unwrap_err().to_string();
        assert!(message.contains(key) && message.contains(words), "{message}");
    }
}

/// How a map is turned: shortest turn from +y to `up`, then counter-clockwise seen from above.
#[test]
fn maps_are_turned() {
    let folder = Folder::new(&[("a.exr", exr_rgb(&[1.0; 6]))]);
    // (keys, where the map's +y, -z (its middle) and +x lie in the world)
    for (keys, [up, middle, right]) in [
        ("", [DVec3::Y, DVec3::NEG_Z, DVec3::X]),
        ("rotate_degrees = 90", [DVec3::Y, DVec3::NEG_X, DVec3::NEG_Z]),
        ("up = [0, 0, 2]", [DVec3::Z, DVec3::Y, DVec3::X]),
        ("up = [0, 0, 1]\nrotate_degrees = 90", [DVec3::Z, DVec3::NEG_X, DVec3::Y]),
        ("up = [0, -1, 0]", [DVec3::NEG_Y, DVec3::Z, DVec3::X]),
        ("up = [1, 0, 0]", [DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y]),
    ] {
        let (map, _) = folder.map(&format!("map = \"a.exr\"\n{keys}"));
        for (world, in_map) in [(up, DVec3::Y), (middle, DVec3::NEG_Z), (right, DVec3::X)] {
            assert!((map.to_map * world).distance(in_map) < 1e-15, "{keys}: {world} is {}", map.to_map * world);
        }
    }
}

#[test]
fn the_digest_follows_lights_and_maps() {
    let folder = Folder::new(&[
        ("a.exr", exr_rgb(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        ("b.exr", exr_rgb(&[1.0, 2.0, 3.0, 4.0, 5.0, 7.0])),
        ("copy.exr", exr_rgb(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
    ]);
    let digest = |keys: &str| folder.load(keys).unwrap_or_else(|e| panic!("{e}")).digest;
    assert_eq!(digest("map = \"a.exr\""), digest("map = \"copy.exr\""));
    let point = "\n[[lights]]\npoint = { position = [0, 0, 0], intensity = 1 }";
    let mut all: Vec<String> = [
        "radiance = 1",
        "map = \"a.exr\"",
        "map = \"b.exr\"",
        "map = \"a.exr\"\nscale = 2",
        "map = \"a.exr\"\nrotate_degrees = 1",
        &format!("radiance = 1{point}"),
        &format!("radiance = 1{point}").replace("intensity = 1", "intensity = 2"),
        &format!("radiance = 1{point}").replace("[0, 0, 0]", "[0, 0, 1]"),
        "radiance = 1\n[[lights]]\ndirectional = { direction = [0, 0, 1], irradiance = 1 }",
        "radiance = 1\n[[lights]]\nsun = { direction = [0, 0, 1], angular_radius = 1, irradiance = 1 }",
        "radiance = 1\n[[lights]]\nsun = { direction = [0, 0, 1], angular_radius = 2, irradiance = 1 }",
    ]
    .map(digest)
    .into();
    let count = all.len();
    all.sort();
    all.dedup();
    assert_eq!(all.len(), count);
}
