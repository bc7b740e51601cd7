//! Textures, texture coordinates and normals in scene files.

use std::io::Cursor;

use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage, f16};
use glam::{DMat3, DVec2, DVec3};
use spectile::Error;
use spectile::error::Problem;
use spectile::scene::{
    self, Bsdf, Placement, Reflectance, Roughness, Scene, Temperature, TextureFilter, TextureKind, Weight,
};
use spectile::spectral::upsample;

use super::BASE;

type Files<'a> = [(&'a str, Vec<u8>)];

fn load(text: &str, files: &Files) -> Result<Scene, Vec<Problem>> {
    let dir = super::folder(&[]);
    for (name, bytes) in files {
        std::fs::write(dir.path().join(name), bytes).expect("a file");
    }
    scene::parse(text, &dir.path().join("scene.toml"), &[]).map_err(|error| match error {
        Error::Input(problems) => problems,
        other => panic!("{other}"),
    })
}

/// The base scene with another reflectance and a mask, `(reflectance, files)`.
fn with_reflectance(reflectance: &str) -> String {
    BASE.replace("reflectance = \"grey\"", &format!("reflectance = {reflectance}"))
}

fn png(size: [u32; 2], colour: png::ColorType, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(colour);
    let mut writer = encoder.write_header().expect("header");
    writer.write_image_data(data).expect("pixels");
    writer.finish().expect("end");
    bytes
}

fn exr(size: (usize, usize), planes: &[(&str, FlatSamples)]) -> Vec<u8> {
    let channels = planes.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone())).collect();
    let layer = Layer::new(size, LayerAttributes::default(), Encoding::UNCOMPRESSED, AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("written");
    bytes.into_inner()
}

fn floats(name: &str, values: &[f32]) -> (String, FlatSamples) {
    (name.to_owned(), FlatSamples::F32(values.to_vec()))
}

fn float_exr(size: (usize, usize), planes: &[(&str, &[f32])]) -> Vec<u8> {
    let planes: Vec<_> = planes.iter().map(|(name, values)| floats(name, values)).collect();
    let planes: Vec<_> = planes.iter().map(|(name, samples)| (name.as_str(), samples.clone())).collect();
    exr(size, &planes)
}

#[test]
fn what_good_textures_resolve_to() {
    let files = [
        ("albedo.png", png([2, 1], png::ColorType::Rgb, &[255, 0, 188, 51, 51, 51])),
        ("shares.png", png([1, 1], png::ColorType::Rgb, &[51, 102, 51])),
        ("linear.exr", float_exr((1, 1), &[("R", &[0.25]), ("G", &[0.5]), ("B", &[1.0])])),
        ("mix.exr", float_exr((2, 1), &[("soil", &[0.25, 1.0]), ("grass", &[0.5, 0.0])])),
    ];
    let texture = |reflectance: &str| {
        let scene = load(&with_reflectance(reflectance), &files).unwrap_or_else(|e| panic!("{e:?}"));
        let Bsdf::Diffuse { reflectance: Reflectance::Texture(0) } = scene.materials[0].bsdf else { panic!() };
        assert_eq!(scene.textures.len(), 1);
        assert!(scene.objects[0].attributes.uv.is_some() && scene.objects[1].attributes.uv.is_none());
        (scene.textures[0].clone(), scene)
    };
    let (albedo, _) = texture("{ texture = \"albedo.png\" }");
    assert_eq!((albedo.size, albedo.kind, albedo.texels.len()), ([2, 1], TextureKind::Colour, 6));
    // IEC 61966-2-1: 188 and 51 of 255 are 0.502886 and 0.033105.
    for (texel, expected) in albedo.texels.iter().zip([1.0, 0.0, 0.502_886, 0.033_105, 0.033_105, 0.033_105]) {
        assert!((texel - expected).abs() < 1e-6, "{texel} {expected}");
    }
    assert_eq!(texture("{ texture = \"linear.exr\" }").0.texels[..], [0.25, 0.5, 1.0]);

    // By the names of the channels: grass, soil.
    let (mix, scene) = texture("{ texture = \"mix.exr\", endmembers = [\"grey\", 0.125] }");
    assert_eq!(mix.texels[..], [0.5, 0.25, 0.0, 1.0]);
    let TextureKind::Mixture(endmembers) = mix.kind else { panic!() };
    let values: Vec<f64> = endmembers.iter().map(|id| scene.spectra[*id].curve.eval(500.0)).collect();
    assert_eq!(values, [0.5, 0.125]);
    // Shares of colours: a PNG is linear then.
    let (linear, _) = texture("{ texture = \"shares.png\", endmembers = [1, \"grey\", 0.125] }");
    assert_eq!(linear.texels[..], [0.2, 0.4, 0.2]);
}

/// Sums over 1 within the rounding of halfs are scaled to 1, with a warning; one image serves several uses.
#[test]
fn rounding_is_forgiven_and_files_are_shared() {
    let half = |v: f32| FlatSamples::F16(vec![f16::from_f32(v)]);
    let planes = [("a", half(0.3335)), ("b", half(0.3335)), ("c", half(0.3335))];
    let sum: f64 = planes.iter().map(|(_, s)| f64::from(s.value_by_flat_index(0).to_f32())).sum();
    assert!(sum > 1.0003 && sum < 1.0 + 3.0 / 4096.0);
    let files = [("m.exr", exr((1, 1), &planes)), ("mask.png", png([1, 1], png::ColorType::Grayscale, &[51]))];
    let text = with_reflectance("{ texture = \"m.exr\", endmembers = [0.1, 0.2, 0.3] }");
    let scene = load(&text, &files).unwrap();
    let [order, rounded] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(order.contains("paired in order: a, b, c are the shares of 0.1, 0.2, 0.3"), "{order}");
    assert!(rounded.contains("scaled to 1"), "{rounded}");
    assert!((scene.textures[0].texels.iter().sum::<f32>() - 1.0).abs() < 1e-6);

    let mixed = format!(
        "{}\n[materials.a.plastic]\nreflectance = {{ texture = \"m.exr\", endmembers = [0.1, 0.2, 0.3] }}\neta = 1.5\n\
         [materials.b.blend]\na = \"a\"\nb = \"white\"\nweight = {{ texture = \"mask.png\" }}\n",
        text.replace("\"white\"\n\n[[objects]]", "\"b\"\n\n[[objects]]")
    );
    let scene = load(&mixed, &files).unwrap();
    assert_eq!(scene.textures.len(), 2);
    let blend = scene.materials.iter().find(|m| m.name == "b").unwrap();
    let Bsdf::Blend { weight: Weight::Texture(mask), .. } = blend.bsdf else { panic!("{blend:?}") };
    assert_eq!(
        (scene.textures[mask].texels[..].to_vec(), &scene.textures[mask].kind),
        (vec![0.2], &TextureKind::Number)
    );
}

#[test]
fn wrong_textures() {
    let grey = png([2, 1], png::ColorType::Grayscale, &[0, 255]);
    let rgba = png([1, 2], png::ColorType::Rgba, &[1, 2, 3, 255, 1, 2, 3, 254]);
    let files = [
        ("grey.png", grey.clone()),
        ("rgba.png", rgba),
        ("cut.png", grey[..30].to_vec()),
        ("text.png", b"hello".to_vec()),
        ("rgb.png", png([1, 1], png::ColorType::Rgb, &[1, 2, 3])),
        ("bright.exr", float_exr((2, 2), &[("R", &[0.0; 4]), ("G", &[0.0, 0.0, 1.5, 0.0]), ("B", &[0.0; 4])])),
        ("nan.exr", float_exr((1, 2), &[("Y", &[0.5, f32::NAN])])),
        ("two.exr", float_exr((1, 1), &[("a", &[0.75]), ("b", &[0.75])])),
        ("negative.exr", float_exr((1, 1), &[("a", &[-0.02]), ("b", &[0.5])])),
    ];
    const KEY: &str = "materials.white.diffuse.reflectance";
    for (reflectance, key, words) in [
        ("{ texture = \"none.png\" }", ".texture", &["none.png", "cannot be read"][..]),
        ("{ texture = 3 }", ".texture", &["a string"]),
        ("{ texture = \"cut.png\" }", ".texture", &["not a whole PNG"]),
        ("{ texture = \"text.png\" }", ".texture", &["neither a PNG nor an OpenEXR"]),
        ("{ texture = \"rgba.png\" }", ".texture", &["transparent at column 0, row 1", "blend"]),
        ("{ texture = \"bright.exr\" }", ".texture", &["[0, 1]", "channel G is 1.5 at column 0, row 1"]),
        ("{ texture = \"nan.exr\" }", ".texture", &["NaN at column 0, row 1"]),
        ("{ texture = \"two.exr\" }", ".texture", &["2 channels: a, b", "endmembers"]),
        (
            "{ texture = \"two.exr\", endmembers = [0.1, 0.2] }",
            ".texture",
            &["sum to 1.5, more than 1", "column 0, row 0"],
        ),
        ("{ texture = \"two.exr\", endmembers = [0.1] }", ".endmembers", &["names 1 spectra", "2 channels: a, b"]),
        ("{ texture = \"two.exr\", endmembers = [] }", ".endmembers", &["1 to 32"]),
        ("{ texture = \"two.exr\", endmembers = [0.1, 1.2] }", ".endmembers.1", &["[0, 1]", "1.2"]),
        ("{ texture = \"two.exr\", endmembers = [0.1, \"gravel\"] }", ".endmembers.1", &["no spectrum is named"]),
        ("{ texture = \"negative.exr\", endmembers = [0.1, 0.2] }", ".texture", &["[0, 1]", "channel a is -0.02"]),
        ("{ endmembers = [0.1] }", ".texture", &["missing"]),
        ("{ texture = \"grey.png\", scales = 2 }", ".scales", &["unknown key", "did you mean `scale`"]),
    ] {
        let problems = load(&with_reflectance(reflectance), &files).expect_err(reflectance);
        let [problem] = &problems[..] else { panic!("{reflectance}: {problems:?}") };
        let shown = problem.to_string();
        assert_eq!(problem.key.as_deref(), Some(&*format!("{KEY}{key}")), "{shown}");
        assert!(problem.line.is_some() && problem.file.ends_with("scene.toml"), "{shown}");
        words.iter().for_each(|word| assert!(shown.contains(word), "{reflectance}: no {word:?} in {shown}"));
    }
    // Where no texture may be, and masks of several channels.
    let blend = |weight: &str| format!("{BASE}\n[materials.m.blend]\na = \"white\"\nb = \"soot\"\nweight = {weight}\n");
    for (text, words) in [
        (BASE.replace("constant = 0.5", "texture = \"grey.png\""), "cannot be a texture"),
        (BASE.replace("radiance = 0.25", "radiance = { texture = \"grey.png\" }"), "cannot be a texture"),
        (blend("{ texture = \"rgb.png\" }"), "one channel is needed"),
        (blend("{ texture = \"grey.png\", endmembers = [1] }"), "unknown key `endmembers`"),
        (blend("{ }"), "`texture` is missing"),
    ] {
        let problems = load(&text, &files).expect_err(words);
        assert!(problems.len() == 1 && problems[0].to_string().contains(words), "{words}: {problems:?}");
    }
}

/// Kelvins from a texture: on every kind of material, which asks for texture coordinates then; black too.
#[test]
fn textures_of_temperatures() {
    let files =
        [("t.exr", float_exr((2, 1), &[("Y", &[300.0, 0.0])])), ("hot.exr", float_exr((1, 1), &[("T", &[301.0])]))];
    let with = |temperature: &str| {
        let hot = format!("[materials.m.black]\ntemperature = {temperature}\n[materials.white");
        BASE.replacen("[materials.white", &hot, 1).replacen("material = \"white\"", "material = \"m\"", 1)
    };
    let scene = load(&with("{ texture = \"t.exr\" }"), &files).unwrap_or_else(|e| panic!("{e:?}"));
    let m = scene.materials.iter().position(|m| m.name == "m").expect("it is in use");
    assert_eq!(scene.materials[m].temperature, Some(Temperature::Texture(0)));
    assert_eq!((&scene.textures[0].texels[..], &scene.textures[0].kind), (&[300.0, 0.0][..], &TextureKind::Number));
    let object = scene.objects.iter().find(|object| object.material == Some(m)).expect("an object");
    assert_ne!(object.attributes, scene::Attributes::default());
    let digests = ["{ texture = \"t.exr\" }", "{ texture = \"hot.exr\" }", "301", "300"];
    let digests = digests.map(|temperature| load(&with(temperature), &files).expect(temperature).digest);
    for (i, digest) in digests.iter().enumerate() {
        assert!(!digests[..i].contains(digest), "{i}");
    }
}

#[test]
fn wrong_textures_of_temperatures() {
    let files = [
        ("grey.png", png([2, 1], png::ColorType::Grayscale, &[0, 255])),
        ("cold.exr", float_exr((2, 1), &[("Y", &[300.0, -5.0])])),
        ("hot.exr", float_exr((1, 1), &[("Y", &[2e9])])),
        ("nan.exr", float_exr((1, 1), &[("Y", &[f32::NAN])])),
        ("two.exr", float_exr((1, 1), &[("a", &[300.0]), ("b", &[400.0])])),
    ];
    for (temperature, key, words) in [
        (
            "{ texture = \"grey.png\" }",
            ".texture",
            &["grey.png is a PNG, which cannot hold temperatures", "OpenEXR"][..],
        ),
        ("{ texture = \"cold.exr\" }", ".texture", &["[0, 1e9] K", "is -5 at column 1, row 0"]),
        ("{ texture = \"hot.exr\" }", ".texture", &["[0, 1e9] K", "2000000000"]),
        ("{ texture = \"nan.exr\" }", ".texture", &["NaN at column 0"]),
        ("{ texture = \"two.exr\" }", ".texture", &["2 channels: a, b", "one channel is needed"]),
        ("{ grid = \"two.exr\" }", ".grid", &["unknown key"]),
        ("[300, 400]", "", &["must be a number, but is an array"]),
    ] {
        let hot = format!("[materials.m.black]\ntemperature = {temperature}\n[materials.white");
        let text = BASE.replacen("[materials.white", &hot, 1);
        let problems = load(&text, &files).expect_err(temperature);
        let found = problems.iter().find(|p| p.key.as_deref() == Some(&*format!("materials.m.black.temperature{key}")));
        let shown = found.unwrap_or_else(|| panic!("{temperature}: {problems:?}")).to_string();
        words.iter().for_each(|word| assert!(shown.contains(word), "{temperature}: no {word:?} in {shown}"));
    }
}

/// (u, v) and axes of every kind of shape, turned and mirrored.
#[test]
fn texture_coordinates_of_every_shape() {
    let files = [("t.png", png([1, 1], png::ColorType::Grayscale, &[99]))];
    let text = |shape: &str| {
        let quad = "quad = { corner = [0, 0, 0], edge_u = [2, 0, 0], edge_v = [0, 3, 0] }";
        with_reflectance("{ texture = \"t.png\" }").replace(quad, shape)
    };
    let object = |shape: &str| load(&text(shape), &files).unwrap_or_else(|e| panic!("{e:?}")).objects.swap_remove(0);
    // Where u and v point on flat faces: for each of their triangles.
    let growing = |shape: &str| -> Vec<[DVec3; 2]> {
        let object = object(shape);
        let scene::Shape::Mesh(mesh) = &object.shape else { panic!("{shape}") };
        let uv = object.attributes.uv.as_ref().unwrap();
        assert_eq!(uv.len(), mesh.triangles.len());
        let along = |(triangle, uv): (&[u32; 3], &[DVec2; 3])| {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
            let (e1, e2, det) = (b - a, c - a, d1.perp_dot(d2));
            [(d2.y * e1 - d1.y * e2) / det, (d1.x * e2 - d2.x * e1) / det]
        };
        mesh.triangles.iter().zip(uv).map(along).collect()
    };
    let quad = "quad = { corner = [1, 0, 0], edge_u = [2, 0, 0], edge_v = [1, 3, 0] }";
    assert_eq!(growing(quad), [[DVec3::new(2., 0., 0.), DVec3::new(1., 3., 0.)]; 2]);
    let mirrored = format!("{quad}\ntransform = {{ scale = [-1, 1, 1] }}");
    assert_eq!(growing(&mirrored), [[DVec3::new(-2., 0., 0.), DVec3::new(-1., 3., 0.)]; 2]);
    let (x, y, z) = (DVec3::X, 2.0 * DVec3::Y, 3.0 * DVec3::Z);
    let cube: Vec<_> = growing("cube = { min = [0, 0, 0], max = [1, 2, 3] }").into_iter().step_by(2).collect();
    assert_eq!(cube, [[z, y], [-z, y], [x, z], [x, -z], [-x, y], [x, y]]);

    let axes = |shape: &str| object(shape).attributes.axes.unwrap();
    assert_eq!(axes("sphere = { center = [0, 0, 0], radius = 2 }"), DMat3::IDENTITY);
    let near = |a: DMat3, b: [DVec3; 3]| {
        let difference = (a - DMat3::from_cols(b[0], b[1], b[2])).to_cols_array();
        assert!(difference.iter().all(|d| d.abs() < 1e-12), "{a}, expected {b:?}");
    };
    let turned = "sphere = { center = [0, 0, 0], radius = 2 }\ntransform = { rotate = [1, 0, 0, 90], scale = 3 }";
    near(axes(turned), [DVec3::X, DVec3::Z, DVec3::NEG_Y]);
    near(axes("disk = { center = [0, 0, 0], normal = [0, 0, 5], radius = 2 }"), [DVec3::X, DVec3::Z, DVec3::NEG_Y]);
    let mirrored = "cylinder = { from = [0, 0, 0], to = [0, 2, 0], radius = 2 }\ntransform = { scale = [-2, 2, 2] }";
    near(axes(mirrored), [DVec3::NEG_X, DVec3::Y, DVec3::Z]);
}

#[test]
fn meshes_bring_their_own_coordinates_and_normals() {
    let text = with_reflectance("{ texture = \"t.png\" }")
        .replace("quad = { corner = [0, 0, 0], edge_u = [2, 0, 0], edge_v = [0, 3, 0] }", "mesh = \"m.obj\"");
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 3 0\nvt 0 -1\nvn 0 0 2\nvn 0 3 4\nvn 0 -3 -4\n";
    let load = |text: &str, faces: &str| {
        let texture = png([1, 1], png::ColorType::Grayscale, &[99]);
        load(text, &[("m.obj", format!("{mesh}{faces}").into_bytes()), ("t.png", texture)])
    };
    let scene = load(&text, "f 1/1/1 2/2/2 3/3/3\nf 1/2 2/2 3/1\n").unwrap();
    let attributes = &scene.objects[0].attributes;
    let (o, u, v) = (DVec2::ZERO, DVec2::new(3., 0.), DVec2::new(0., -1.));
    assert_eq!(attributes.uv, Some(vec![[o, u, v], [u, u, o]]));
    let tilted = DVec3::new(0., 0.6, 0.8);
    let normals = attributes.normals.as_ref().unwrap();
    let expected = [[DVec3::Z, tilted, tilted], [DVec3::Z; 3]];
    assert_eq!(normals.len(), 2);
    assert!(
        normals.iter().flatten().zip(expected.iter().flatten()).all(|(a, b)| a.distance(*b) < 1e-15),
        "{normals:?}"
    );
    assert!(scene.warnings.len() == 1 && scene.warnings[0].contains("1 vertex normals point behind"));

    // Without a texture, no coordinates; without curvature, no normals; on black, neither.
    let plain = text.replace("{ texture = \"t.png\" }", "0.5");
    let scene = load(&plain, "f 1/1/1 2/2/1 3/3/1\n").unwrap();
    assert_eq!(scene.objects[0].attributes, scene::Attributes::default());
    assert_eq!(scene.digest, load(&plain, "f 1 2 3\n").unwrap().digest);
    assert_ne!(scene.digest, load(&plain, "f 1//1 2//1 3//2\n").unwrap().digest);
    let black = text.replace("material = \"white\"", "material = \"soot\"");
    assert_eq!(load(&black, "f 1//1 2//1 3//2\n").unwrap().objects[0].attributes, scene::Attributes::default());

    // Normals under a transform that is no similarity, mirrored: (0, 0.6, 0.8) by the inverse transpose.
    let moved = plain.replace("mesh = \"m.obj\"", "mesh = \"m.obj\"\ntransform = { scale = [-1, 2, 1] }");
    let scene = load(&moved, "f 1//1 2//2 3//1\n").unwrap();
    let [[a, b, c]] = scene.objects[0].attributes.normals.as_ref().unwrap()[..] else { panic!() };
    let expected = DVec3::new(0., 0.3, 0.8).normalize();
    assert!(a.distance(expected) < 1e-15 && b == DVec3::Z && c == DVec3::Z, "corners 1 and 0 are exchanged");

    // Faces without coordinates are shown where they stand.
    let problems = load(&text, "f 1/1 2/2 3/3\nf 1 2 3\n").unwrap_err();
    let [problem] = &problems[..] else { panic!("{problems:?}") };
    assert!(problem.file.ends_with("m.obj") && problem.line == Some(11), "{problem}");
    assert_eq!(problem.key.as_deref(), Some("objects.0.mesh"));
    assert!(problem.message.contains("\"white\" is textured") && problem.message.contains("(vt)"), "{problem}");
}

/// The identity of a scene counts every texel, and what the channels are.
#[test]
fn digests_count_textures() {
    let digest = |reflectance: &str, texel: f32| {
        let files = [("t.exr", float_exr((1, 1), &[("R", &[texel]), ("G", &[0.5]), ("B", &[0.125])]))];
        load(&with_reflectance(reflectance), &files).unwrap().digest
    };
    let (colour, mixture) = ("{ texture = \"t.exr\" }", "{ texture = \"t.exr\", endmembers = [0.25, 0.5, 0.75] }");
    let other = "{ texture = \"t.exr\", endmembers = [0.5, 0.25, 0.75] }";
    let all = [digest(colour, 0.25), digest(colour, 0.375), digest(mixture, 0.25), digest(other, 0.25)];
    for (i, a) in all.iter().enumerate() {
        assert!(all[..i].iter().all(|b| a != b), "{i}");
    }
    assert_eq!(all[0], digest(colour, 0.25));
}

#[test]
fn placements_resolve_and_share_their_picture() {
    let files = [("albedo.png", png([1, 1], png::ColorType::Rgb, &[255, 0, 188]))];
    let text =
        with_reflectance("{ texture = \"albedo.png\", filter = \"nearest\", scale = [2, -3], offset = [0.5, 0] }")
            .replace(
                "[materials.soot.black]",
                "[materials.soot.diffuse]\nreflectance = { texture = \"albedo.png\", scale = 4 }",
            );
    let text =
        text.replace("mesh = \"tri.obj\"", "quad = { corner = [0, 0, 1], edge_u = [1, 0, 0], edge_v = [0, 1, 0] }");
    let scene = load(&text, &files).unwrap_or_else(|e| panic!("{e:?}"));
    let [a, b] = &scene.textures[..] else { panic!("{:?}", scene.textures) };
    let placed =
        Placement { filter: TextureFilter::Nearest, scale: DVec2::new(2.0, -3.0), offset: DVec2::new(0.5, 0.0) };
    assert_eq!(a.placement, placed);
    assert_eq!(b.placement, Placement { scale: DVec2::splat(4.0), ..Placement::default() });
    assert!(std::sync::Arc::ptr_eq(&a.texels, &b.texels));
    for (wrong, words) in [
        ("filter = \"cubic\"", "must be one of \"bilinear\", \"nearest\""),
        ("scale = 1e5", "must lie in [-10000, 10000]"),
        ("offset = [0, 2e4]", "must lie in [-10000, 10000]"),
        ("offset = 1", "must be two numbers [u, v]"),
    ] {
        let text = with_reflectance(&format!("{{ texture = \"albedo.png\", {wrong} }}"));
        let problems = load(&text, &files).expect_err(wrong);
        assert!(problems[0].to_string().contains(words), "{wrong}: {problems:?}");
    }
}

/// What leaves reflect and let through is 1 at most, at every wavelength and in every texel.
#[test]
fn what_passes_and_is_reflected_is_no_more_than_all() {
    let files = [
        ("a.png", png([2, 1], png::ColorType::Grayscale, &[204, 51])),
        ("b.png", png([2, 1], png::ColorType::Grayscale, &[51, 204])),
    ];
    let leaf = |transmittance: &str, more: &str| {
        let text = format!("[materials.white.diffuse]\n{more}\ntransmittance = {transmittance} #!");
        load(&BASE.replace("[materials.white.diffuse]\nreflectance = \"grey\"", &text), &files)
    };
    let of = |name: &str, more: &str| format!("{{ texture = \"{name}\", endmembers = [1.0]{more} }}");
    let (a, b) = (format!("reflectance = {}", of("a.png", "")), of("b.png", ""));
    for (transmittance, more) in [("0.5", "reflectance = 0.5"), (b.as_str(), a.as_str()), ("0.2", a.as_str())] {
        let scene = leaf(transmittance, more).unwrap_or_else(|e| panic!("{transmittance}: {e:?}"));
        assert!(matches!(scene.materials[0].bsdf, Bsdf::Translucent { .. }));
    }
    let step = "{ samples = [[400, 0.2], [550, 0.2], [551, 0.7], [552, 0.2], [700, 0.2]] }";
    for (transmittance, more, words) in [
        ("0.51", "reflectance = 0.5", "must be 1 at most together, but are 1.010000"),
        (step, "reflectance = 0.4", "but are 1.100000 at 551.0 nm"),
        ("0.3", a.as_str(), "but are 1.100000"),
        // Placed otherwise, what is dark here may lie on what is bright there.
        (of("b.png", ", scale = 2").as_str(), a.as_str(), "but are 1.600000"),
        ("0.1", "emissivity = 0.5", "does not say how much is reflected"),
        ("0.1", "reflectance = 0.5\ntwo_sided = false", "has two sides"),
    ] {
        let problems = leaf(transmittance, more).expect_err(transmittance);
        assert!(problems[0].to_string().contains(words), "{transmittance}: {problems:?}");
    }
}

#[test]
fn opacities_resolve() {
    let files = [("mask.png", png([1, 1], png::ColorType::Grayscale, &[51]))];
    let with = |opacity: &str| {
        let text = BASE.replace("reflectance = \"grey\"", &format!("reflectance = \"grey\"\nopacity = {opacity} #!"));
        load(&text, &files)
    };
    let resolved = |opacity: &str| {
        let scene = with(opacity).unwrap_or_else(|e| panic!("{e:?}"));
        (scene.materials[0].opacity, scene.objects[0].attributes.uv.is_some())
    };
    assert_eq!(resolved("0.25"), (Some(Weight::Constant(0.25)), false));
    assert_eq!(resolved("0"), (Some(Weight::Constant(0.0)), false));
    // What is there for all rays is as without one.
    assert_eq!(resolved("1"), (None, false));
    assert_eq!(resolved("{ texture = \"mask.png\" }"), (Some(Weight::Texture(0)), true));
    for (wrong, words) in [("1.5", "in [0, 1], but is 1.5"), ("\"half\"", "must be a number")] {
        let problems = with(wrong).expect_err(wrong);
        assert!(problems[0].to_string().contains(words), "{wrong}: {problems:?}");
    }
    let blend = "[materials.mix.blend]\na = \"white\"\nb = \"soot\"\nweight = 0.5\n\n[materials.soot.black]";
    let text = BASE
        .replace("[materials.soot.black]", blend)
        .replace("reflectance = \"grey\"", "reflectance = \"grey\"\nopacity = 0.5");
    let problems = load(&text, &files).expect_err("a part with an opacity");
    assert!(problems[0].to_string().contains("which a part of a blend cannot have"), "{problems:?}");
}

#[test]
fn pictures_of_light_resolve() {
    let files = [
        ("screen.png", png([2, 1], png::ColorType::Rgb, &[255, 255, 255, 0, 0, 0])),
        ("bright.exr", float_exr((1, 1), &[("R", &[20.0]), ("G", &[10.0]), ("B", &[5.0])])),
        ("negative.exr", float_exr((1, 1), &[("R", &[-20.0]), ("G", &[10.0]), ("B", &[5.0])])),
        ("amounts.exr", float_exr((1, 1), &[("a", &[3.0]), ("b", &[0.5])])),
    ];
    let with = |emission: &str| {
        let text = BASE.replace("material = \"white\"", &format!("material = \"white\"\nemission = {emission} #!"));
        load(&text, &files)
    };
    let lit = |emission: &str| {
        let scene = with(emission).unwrap_or_else(|e| panic!("{e:?}"));
        let of_object = scene.objects[0].emission.clone().expect("an emission");
        assert!(scene.objects[0].attributes.uv.is_some() && scene.objects[1].attributes.uv.is_none());
        (
            scene.textures[of_object.texture.expect("a texture")].clone(),
            scene.spectra[of_object.radiance].curve.clone(),
            scene,
        )
    };
    let (screen, mean, scene) = lit("{ texture = \"screen.png\", strength = 4, filter = \"nearest\" }");
    let TextureKind::Light(daylight) = screen.kind else { panic!("{:?}", screen.kind) };
    assert_eq!(scene.spectra[daylight].curve, upsample::daylight());
    assert_eq!(
        (&screen.texels[..], screen.placement.filter),
        (&[4.0, 4.0, 4.0, 0.0, 0.0, 0.0][..], TextureFilter::Nearest)
    );
    assert_eq!(mean, upsample::emission([2.0; 3]));
    assert_eq!(lit("{ texture = \"bright.exr\" }").0.texels[..], [20.0, 10.0, 5.0]);
    let (amounts, mean, scene) = lit("{ texture = \"amounts.exr\", endmembers = [0.25, 2.0], strength = 2 }");
    let TextureKind::Mixture(lamps) = amounts.kind else { panic!("{:?}", amounts.kind) };
    assert_eq!(lamps.iter().map(|lamp| scene.spectra[*lamp].curve.eval(500.0)).collect::<Vec<_>>(), [0.25, 2.0]);
    assert_eq!(amounts.texels[..], [6.0, 1.0]);
    assert!((mean.mean(400.0, 700.0) - (6.0 * 0.25 + 2.0)).abs() < 1e-4, "{mean:?}");
    for (wrong, words) in [
        ("{ texture = \"negative.exr\" }", "a radiance must lie in [0, 1e30], but channel R is -20"),
        ("{ texture = \"screen.png\", strength = -1 }", "a factor in [0, 1e30], but is -1"),
        ("{ texture = \"amounts.exr\", endmembers = [1] }", "names 1 spectra"),
        ("{ texture = \"nothing.png\" }", "nothing.png"),
    ] {
        let problems = with(wrong).expect_err(wrong);
        assert!(problems[0].to_string().contains(words), "{wrong}: {problems:?}");
    }
}

/// GGX's α of every kind of material; a mirror is none.
#[test]
fn textured_roughness() {
    let files = [
        ("rough.exr", float_exr((2, 1), &[("Y", &[0.25, 0.5])])),
        ("mirror.png", png([2, 1], png::ColorType::Grayscale, &[0, 255])),
        ("more.exr", float_exr((1, 1), &[("Y", &[1.5])])),
    ];
    let kinds = ["conductor]\neta = 0.2\nk = 3", "dielectric]\neta = 1.5", "plastic]\nreflectance = 0.5\neta = 1.5"];
    // Of the quad, which has coordinates.
    let with = |kind: &str, rest: &str| {
        let white = "[materials.white.diffuse]
reflectance = \"grey\"
";
        assert!(BASE.contains(white));
        load(
            &BASE.replace(
                white,
                &format!(
                    "[materials.white.{kind}
{rest}
"
                ),
            ),
            &files,
        )
    };
    for kind in kinds {
        let scene = with(kind, "roughness = { texture = \"rough.exr\", filter = \"nearest\" }").expect(kind);
        let white = scene.materials.iter().find(|material| material.name == "white").expect("it is in use");
        let (Bsdf::Conductor { roughness, .. } | Bsdf::Dielectric { roughness, .. } | Bsdf::Plastic { roughness, .. }) =
            white.bsdf
        else {
            panic!("{white:?}")
        };
        let Roughness::Texture(texture) = roughness else { panic!("{roughness:?}") };
        let texture = &scene.textures[texture];
        assert_eq!((&texture.kind, &texture.texels[..]), (&TextureKind::Number, &[0.25, 0.5][..]));
        assert_eq!(texture.placement.filter, TextureFilter::Nearest);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);

        let scene = with(kind, "roughness = { texture = \"mirror.png\" }").expect(kind);
        assert!(
            scene.warnings[0].contains("has 1 of 2 roughnesses below 0.001, which count as that"),
            "{:?}",
            scene.warnings
        );
        assert_eq!(scene.textures[0].texels[..], [1e-3, 1.0]);
        let problems = with(kind, "roughness = { texture = \"more.exr\" }").expect_err(kind);
        assert!(
            problems[0].to_string().contains("a roughness must lie in [0, 1], but channel Y is 1.5"),
            "{problems:?}"
        );
    }
    let problems = with(kinds[0], "roughness = [{ texture = \"rough.exr\" }, 0.1]").expect_err("two");
    assert!(problems[0].to_string().contains("must be a number, but is a table"), "{problems:?}");

    // What is hot has one roughness, by its own temperature or that of a blend.
    let rough = "roughness = { texture = \"rough.exr\" }";
    let hot = format!("{rough}\ntemperature = 300.0");
    let blend =
        format!("{rough}\n[materials.warm.blend]\na = \"soot\"\nb = \"white\"\nweight = 0.5\ntemperature = 300.0");
    for (rest, key) in [(hot, "materials.white.plastic.temperature"), (blend, "materials.warm.blend.temperature")] {
        let problems = with(kinds[2], &rest).expect_err(key);
        assert_eq!(problems[0].key.as_deref(), Some(key), "{problems:?}");
        assert!(
            problems[0].message.contains("\"white\" has a roughness by texture, with which no temperature"),
            "{problems:?}"
        );
    }
}
