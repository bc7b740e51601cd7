//! Conductors, dielectrics, plastics and blends: what good ones resolve to, and what is said about wrong ones.

use spectile::Error;
use spectile::scene::{Bsdf, Material, Reflectance, Roughness, Scene, Shape, Weight};
use spectile::spectral::{Curve, Outside};

use super::wrong::check_wrong;
use super::{BASE, changed, good, parse_with};

const SOOT: &str = "[materials.soot.black]";
const GOLD: &str = "# made up\nwavelength_nm,n,k\n400,1.5,1.9\n550,0.3,2.5\n700,0.15,4.5\n";
const GLASS: &str = "DATA:\n  - type: formula 5\n    wavelength_range: 0.4 0.7\n    coefficients: 1.5 0.01 -2\n  - type: tabulated k\n    data: |\n      0.3 1e-6\n      0.8 2e-6\n";

/// The base scene whose first object is of material "m", defined by `text`.
fn with_material(text: &str) -> String {
    changed("material = \"white\"", "material = \"m\"").replace(SOOT, &format!("{SOOT}\n{text}"))
}

#[track_caller]
fn material(scene: &Scene, name: &str) -> Material {
    scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}")).clone()
}

#[track_caller]
fn load(text: &str) -> Scene {
    good(&with_material(text), &[("gold.csv", GOLD), ("glass.yml", GLASS)], &[])
}

#[test]
fn conductors_resolve() {
    let linear = |value: [f64; 3]| Curve::Linear {
        nm: vec![400.0, 550.0, 700.0],
        value: value.to_vec(),
        outside: Outside::Hold,
    };
    let scene = load("[materials.m.conductor]\nnk = \"gold.csv\"");
    let gold = material(&scene, "m");
    let Bsdf::Conductor { eta, k, roughness, energy_compensation } = gold.bsdf else { panic!("{gold:?}") };
    assert_eq!((roughness, energy_compensation, gold.two_sided), (Roughness::even(0.0), true, true));
    assert_eq!(scene.spectra[eta].curve, linear([1.5, 0.3, 0.15]));
    assert_eq!(scene.spectra[k].curve, linear([1.9, 2.5, 4.5]));
    assert_eq!((scene.spectra[eta].name.as_str(), scene.spectra[k].name.as_str()), ("gold.csv (n)", "gold.csv (k)"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);

    let text = "eta = { file = \"gold.csv\", column = \"n\" }\nk = 3\nroughness = [0.1, 1]\nenergy_compensation = false\ntwo_sided = false";
    let scene = load(&format!("[materials.m.conductor]\n{text}"));
    let m = material(&scene, "m");
    let Bsdf::Conductor { eta, k, roughness, energy_compensation } = m.bsdf else { panic!("{m:?}") };
    assert_eq!((roughness, energy_compensation, m.two_sided), (Roughness::Constant([0.1, 1.0]), false, false));
    assert_eq!(scene.spectra[eta].curve, linear([1.5, 0.3, 0.15]));
    assert_eq!(scene.spectra[k].curve, Curve::Constant(3.0));
    let scene = load("[materials.m.conductor]\nnk = \"glass.yml\"\nroughness = 0.25");
    let m = material(&scene, "m");
    let Bsdf::Conductor { eta, k, roughness, .. } = m.bsdf else { panic!("{m:?}") };
    assert_eq!(roughness, Roughness::even(0.25));
    assert!((scene.spectra[eta].curve.eval(500.0) - 1.54).abs() < 1e-7);
    assert!((scene.spectra[k].curve.eval(550.0) - 1.5e-6).abs() < 1e-18);
}

#[test]
fn dielectrics_and_plastics_resolve() {
    let scene = load("[materials.m.dielectric]\neta = 1.5");
    let m = material(&scene, "m");
    let Bsdf::Dielectric { eta, dispersion, roughness } = m.bsdf else { panic!("{m:?}") };
    assert_eq!((&scene.spectra[eta].curve, dispersion, roughness), (&Curve::Constant(1.5), true, Roughness::even(0.0)));
    let scene = load("[materials.m.dielectric]\neta = { file = \"glass.yml\" }\ndispersion = false\nroughness = 1");
    let m = material(&scene, "m");
    let Bsdf::Dielectric { eta, dispersion, roughness } = m.bsdf else { panic!("{m:?}") };
    assert!(
        (scene.spectra[eta].curve.eval(500.0) - 1.54).abs() < 1e-7 && !dispersion && roughness == Roughness::even(1.0)
    );
    let scene = load("[materials.m.plastic]\nreflectance = \"grey\"\neta = 1.5\nroughness = 0.05");
    let m = material(&scene, "m");
    let Bsdf::Plastic { reflectance: Reflectance::Spectrum(reflectance), eta, roughness } = m.bsdf else {
        panic!("{m:?}")
    };
    assert_eq!(scene.spectra[reflectance].curve, Curve::Constant(0.5));
    assert_eq!(
        (&scene.spectra[eta].curve, roughness, m.two_sided),
        (&Curve::Constant(1.5), Roughness::even(0.05), true)
    );
}

/// Parts stand before their blend, whatever the order of the file, and once.
#[test]
fn blends_resolve() {
    let scene = load(
        "[materials.m.blend]\na = \"inner\"\nb = \"white\"\nweight = 0.25\n[materials.inner.blend]\na = \"white\"\nb = \"soot\"\nweight = 1",
    );
    let names: Vec<_> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["white", "soot", "inner", "m"]);
    assert_eq!(material(&scene, "m").bsdf, Bsdf::Blend { a: 2, b: 0, weight: Weight::Constant(0.25) });
    assert_eq!(material(&scene, "inner").bsdf, Bsdf::Blend { a: 0, b: 1, weight: Weight::Constant(1.0) });
}

#[test]
fn indices_are_held_with_a_warning() {
    let sets = [("channels.equal.to", "800")];
    let files = [("gold.csv", GOLD)];
    let warnings = good(&with_material("[materials.m.conductor]\nnk = \"gold.csv\""), &files, &sets).warnings;
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("(an index of refraction) does not cover 700-800 nm"), "{warnings:?}");
    assert!(warnings[1].contains("(an extinction coefficient k)"), "{warnings:?}");
}

#[test]
fn overrides_exchange_the_ways_to_give_an_index() {
    let text = with_material("[materials.m.conductor]\nnk = \"gold.csv\"");
    let sets = [("materials.m.conductor.eta", "0.2"), ("materials.m.conductor.k", "3.4")];
    let scene = good(&text, &[], &sets);
    let Bsdf::Conductor { eta, k, .. } = material(&scene, "m").bsdf else { panic!() };
    assert_eq!((&scene.spectra[eta].curve, &scene.spectra[k].curve), (&Curve::Constant(0.2), &Curve::Constant(3.4)));
}

/// The first edges of the triangles of quads and faces of cubes are parallel, under every transform, and along edge_u.
#[test]
fn triangles_of_a_face_share_their_first_edge() {
    for transform in ["{}", "{ scale = [-1, 2, 1] }", "{ rotate = [1, 2, 3, 40], scale = [1, 1, -3] }"] {
        let sets = [
            ("objects.1.cube", "{ min = [0, 0, 0], max = [1, 2, 3] }"),
            ("objects.0.transform", transform),
            ("objects.1.transform", transform),
        ];
        for object in good(BASE, &[], &sets).objects {
            let Shape::Mesh(mesh) = object.shape else { panic!("{}", object.name) };
            for pair in mesh.triangles.chunks(2) {
                let edge = |t: [u32; 3]| mesh.positions[t[1] as usize] - mesh.positions[t[0] as usize];
                let (a, b) = (edge(pair[0]), edge(pair[1]));
                assert!(a.cross(b).length() < 1e-12 * a.length() * b.length(), "{transform}");
            }
        }
    }
    let Shape::Mesh(quad) = &good(BASE, &[], &[]).objects[0].shape else { panic!("a quad is a mesh") };
    let [a, b, _] = quad.triangles[0].map(|i| quad.positions[i as usize]);
    assert_eq!((b - a).normalize(), glam::DVec3::X);
}

#[test]
fn wrong_materials() {
    let conductor = |keys: &str| format!("[materials.m.conductor]\neta = 1\nk = 1\n{keys}");
    let blend = |keys: &str| format!("[materials.m.blend]\na = \"white\"\nb = \"soot\"\n{keys}");
    #[rustfmt::skip]
    let cases: &[(&str, String, &str, &[&str])] = &[
        ("two ways", conductor("nk = \"gold.csv\"").replace("eta = 1", "eta = 1 #!"), "materials.m.conductor.eta", &["without `nk` only"]),
        ("no index", "[materials.m.conductor] #!\nroughness = 0".into(), "materials.m.conductor.nk", &["`nk` is missing", "or eta and k"]),
        ("no k", "[materials.m.conductor] #!\neta = 1".into(), "materials.m.conductor.k", &["`k` is missing"]),
        ("no eta", "[materials.m.conductor] #!\nk = 1".into(), "materials.m.conductor.eta", &["`eta` is missing"]),
        ("misspelt nk", "[materials.m.conductor]\nnkk = \"gold.csv\" #!".into(), "materials.m.conductor.nkk", &["did you mean `nk`?"]),
        ("nk a number", "[materials.m.conductor]\nnk = 3 #!".into(), "materials.m.conductor.nk", &["a string"]),
        ("nk nowhere", "[materials.m.conductor]\nnk = \"nowhere.csv\" #!".into(), "materials.m.conductor.nk", &["nowhere.csv", "cannot be read"]),
        ("n without k", "[materials.m.conductor]\nnk = \"n.yml\" #!".into(), "materials.m.conductor.nk", &["does not give k", "`eta` and `k`"]),
        ("eta 0", "[materials.m.conductor]\neta = 0 #!\nk = 1".into(), "materials.m.conductor.eta", &["an index of refraction must lie in (0, 1000], but is 0"]),
        ("k negative", "[materials.m.conductor]\neta = 1\nk = -1 #!".into(), "materials.m.conductor.k", &["an extinction coefficient k must lie in [0, 1000], but is -1"]),
        ("roughness above 1", conductor("roughness = 1.5 #!"), "materials.m.conductor.roughness", &["a GGX roughness in [0, 1]", "1.5"]),
        ("roughness of three", conductor("roughness = [0.1, 0.1, 0.1] #!"), "materials.m.conductor.roughness", &["[alpha_x, alpha_y]", "3 elements"]),
        ("roughness negative", conductor("roughness = [0.1, -0.1] #!"), "materials.m.conductor.roughness.1", &["in [0, 1]"]),
        ("half smooth", conductor("roughness = [0, 0.1] #!"), "materials.m.conductor.roughness", &["0.001", "0 and 0.1"]),
        ("compensation", conductor("energy_compensation = 1 #!"), "materials.m.conductor.energy_compensation", &["true or false"]),
        ("no eta of glass", "[materials.m.dielectric] #!".into(), "materials.m.dielectric.eta", &["`eta` is missing"]),
        ("eta negative", "[materials.m.dielectric]\neta = -1.5 #!".into(), "materials.m.dielectric.eta", &["(0, 1000]"]),
        ("eta of a body", "[materials.m.dielectric]\neta = { blackbody = 300 } #!".into(), "materials.m.dielectric.eta.blackbody", &["is a black body"]),
        ("eta of a colour", "[materials.m.dielectric]\neta = { rgb = [1, 1, 1] } #!".into(), "materials.m.dielectric.eta.rgb", &["is a colour"]),
        ("eta nowhere", "[materials.m.dielectric]\neta = { samples = [[400, 1.5], [500, 1.4]], outside = \"zero\" } #!".into(), "materials.m.dielectric.eta.samples", &["cannot be 0 outside"]),
        ("two_sided glass", "[materials.m.dielectric]\neta = 1.5\ntwo_sided = true #!".into(), "materials.m.dielectric.two_sided", &["unknown key"]),
        ("glass of two alphas", "[materials.m.dielectric]\neta = 1.5\nroughness = [0.1, 0.2] #!".into(), "materials.m.dielectric.roughness", &["must be a number"]),
        ("dispersion", "[materials.m.dielectric]\neta = 1.5\ndispersion = 0 #!".into(), "materials.m.dielectric.dispersion", &["true or false"]),
        ("thin coat", "[materials.m.plastic]\nreflectance = 0.5\neta = 0.9 #!".into(), "materials.m.plastic.eta", &["[1, 1000]", "0.9"]),
        ("no reflectance", "[materials.m.plastic] #!\neta = 1.5".into(), "materials.m.plastic.reflectance", &["missing"]),
        ("column", "[materials.m.dielectric]\neta = { file = \"n.yml\", column = \"m\" } #!".into(), "materials.m.dielectric.eta.file", &["no column \"m\"", "n and k"]),
        ("no k to take", "[materials.m.dielectric]\neta = { file = \"n.yml\", column = \"k\" } #!".into(), "materials.m.dielectric.eta.file", &["does not give k"]),
        ("no weight", blend("").replace("blend]", "blend] #!"), "materials.m.blend.weight", &["missing", "share of b"]),
        ("weight", blend("weight = 1.25 #!"), "materials.m.blend.weight", &["[0, 1]", "1.25"]),
        ("unknown part", blend("weight = 0.5").replace("\"soot\"", "\"sot\" #!"), "materials.m.blend.b", &["no material is named \"sot\"", "did you mean `soot`?"]),
        ("part a number", blend("weight = 0.5").replace("\"soot\"", "1 #!"), "materials.m.blend.b", &["a string"]),
        ("itself", blend("weight = 0.5").replace("\"soot\"", "\"m\" #!"), "materials.m.blend.b", &["cannot contain itself: m -> m"]),
        ("a cycle", format!("{}\n[materials.o.blend]\na = \"soot\"\nb = \"m\"\nweight = 1", blend("weight = 0.5").replace("\"white\"", "\"o\" #!")), "materials.m.blend.a", &["cannot contain itself: m -> o -> m"]),
    ];
    let n_only = "DATA:\n  - type: tabulated n\n    data: |\n      0.3 1.5\n      0.8 1.4\n";
    for (name, text, key, words) in cases {
        check_wrong(&with_material(text), &[("n.yml", n_only)], name, key, words);
    }
}

#[test]
fn a_blend_of_too_many() {
    let mut text = String::new();
    for i in 0..6 {
        let (a, b) =
            if i == 0 { ("white".into(), "soot".into()) } else { (format!("b{}", i - 1), format!("b{}", i - 1)) };
        let mark = if i == 5 { " #!" } else { "" };
        text += &format!("[materials.b{i}.blend]\na = \"{a}\"\nb = \"{b}\"{mark}\nweight = 0.5\n");
    }
    let scene = with_material(&text).replace("material = \"m\"", "material = \"white\"");
    check_wrong(&scene, &[], "64 parts", "materials.b5.blend.b", &["blends 64 materials", "at most 32"]);
}

/// Two roughnesses need directions on the surface: spheres have them, meshes where they have texture coordinates.
#[test]
fn anisotropy_needs_a_tangent() {
    const BRUSHED: &str = "[materials.m.conductor]\neta = 1\nk = 1\nroughness = [0.1, 0.2]\n[materials.mix.blend]\na = \"soot\"\nb = \"m\"\nweight = 0.5";
    for name in ["m", "mix"] {
        let text = with_material(BRUSHED).replace("material = \"m\"", &format!("material = \"{name}\""));
        good(&text, &[], &[]);
        let quad = "quad = { corner = [0, 0, 0], edge_u = [2, 0, 0], edge_v = [0, 3, 0] }";
        let ball = text.replace(quad, "sphere = { center = [0, 0, 0], radius = 1 }");
        assert_eq!(good(&ball, &[], &[]).objects[0].attributes.axes, Some(glam::DMat3::IDENTITY));
        let mesh = text.replace(quad, "mesh = \"tri.obj\"");
        let Err(Error::Input(problems)) = parse_with(&mesh, &[], &[]) else { panic!("no tangent") };
        let [problem] = &problems[..] else { panic!("{problems:?}") };
        assert!(problem.file.ends_with("tri.obj") && problem.line == Some(6), "{problem}");
        assert!(problem.key.as_deref() == Some("objects.0.mesh") && problem.message.contains("two roughnesses"));
        let with_uv = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
        assert!(good(&mesh, &[("tri.obj", with_uv)], &[]).warnings.is_empty());
        let flat = good(&mesh, &[("tri.obj", &with_uv.replace("vt 0 1", "vt 2 0"))], &[]).warnings;
        assert!(flat.len() == 1 && flat[0].contains("1 triangles") && flat[0].contains("first edge"), "{flat:?}");
    }
}

/// Values out of range in an index file are shown at their line there.
#[test]
fn mistakes_in_index_files_name_those() {
    for (file, content, line, words) in [
        ("gold.csv", "nm,n,k\n400,1,1\n500,0,1\n", 3, "(0, 1000], but is 0 at 500 nm"),
        ("gold.csv", "nm,n,k\n400,1,1\n500,1,-1\n", 3, "[0, 1000], but is -1 at 500 nm"),
        ("gold.csv", "nm,n\n400,1\n500,1\n", 1, "no column \"k\""),
        (
            "gold.yml",
            "DATA:\n  - type: tabulated nk\n    data: |\n      0.4 1 1\n      0.5 -1 1\n",
            5,
            "but is -1 at 500 nm",
        ),
        ("gold.yml", "DATA:\n  - type: tabulated n2\n    data: |\n      0.4 1\n", 2, "`tabulated n2`"),
    ] {
        let text = with_material(&format!("[materials.m.conductor]\nnk = \"{file}\""));
        let Err(Error::Input(problems)) = parse_with(&text, &[(file, content)], &[]) else { panic!("{content}") };
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert!(problems[0].file.ends_with(file) && problems[0].to_string().contains(words), "{}", problems[0]);
        assert_eq!(problems[0].line, Some(line), "{}", problems[0]);
        assert_eq!(problems[0].key.as_deref(), Some("materials.m.conductor.nk"));
    }
}

#[test]
fn independent_mistakes_in_materials_are_reported_together() {
    let text = with_material(
        "[materials.m.conductor]\neta = 0\nk = -1\nroughness = 2\nenergy_compensation = 3\ntwo_sided = 4\n[materials.p.plastic]\nreflectance = 2\neta = 0\nroughness = -1\n[materials.d.dielectric]\neta = 0\ndispersion = 2\nroughness = 2\n[materials.x.blend]\na = 1\nb = 2\nweight = 3",
    );
    let Err(Error::Input(problems)) = parse_with(&text, &[], &[]) else { panic!("accepted") };
    let keys: Vec<_> =
        problems.iter().map(|p| p.key.as_deref().unwrap_or("").trim_start_matches("materials.")).collect();
    let m = ["eta", "k", "roughness", "energy_compensation", "two_sided"].map(|key| format!("m.conductor.{key}"));
    let p = ["reflectance", "eta", "roughness"].map(|key| format!("p.plastic.{key}"));
    let d = ["eta", "dispersion", "roughness"].map(|key| format!("d.dielectric.{key}"));
    let x = ["a", "b", "weight"].map(|key| format!("x.blend.{key}"));
    assert_eq!(keys, [&m[..], &p[..], &d[..], &x[..]].concat());
}

#[test]
fn the_digest_covers_every_material() {
    let mut digests = Vec::new();
    for text in [
        "[materials.m.conductor]\neta = 0.5\nk = 0.25",
        "[materials.m.conductor]\neta = 0.25\nk = 0.5",
        "[materials.m.conductor]\neta = 0.5\nk = 0.25\nroughness = 0.5",
        "[materials.m.conductor]\neta = 0.5\nk = 0.25\nroughness = [0.5, 0.25]",
        "[materials.m.conductor]\neta = 0.5\nk = 0.25\nenergy_compensation = false",
        "[materials.m.dielectric]\neta = 0.5",
        "[materials.m.dielectric]\neta = 0.5\ndispersion = false",
        "[materials.m.dielectric]\neta = 0.5\nroughness = 0.5",
        "[materials.m.plastic]\nreflectance = 0.5\neta = 1.25",
        "[materials.m.plastic]\nreflectance = 0.25\neta = 1.25",
        "[materials.m.plastic]\nreflectance = 0.5\neta = 1.5",
        "[materials.m.plastic]\nreflectance = 0.5\neta = 1.25\nroughness = 0.5",
        "[materials.m.blend]\na = \"white\"\nb = \"soot\"\nweight = 0.5",
        "[materials.m.blend]\na = \"soot\"\nb = \"white\"\nweight = 0.5",
        "[materials.m.blend]\na = \"white\"\nb = \"soot\"\nweight = 0.25",
    ] {
        digests.push(load(text).digest);
    }
    let count = digests.len();
    digests.sort();
    digests.dedup();
    assert_eq!(digests.len(), count);
}

/// What a file calls its values is what they are taken for, unless the scene says by `scale` that it knows better.
#[test]
fn what_files_call_their_values_counts() {
    let scene = |key: &str, header: &str, more: &str| {
        let text =
            with_material(&format!("[materials.m.diffuse]\nreflectance = 0.1\n{key} = {{ file = \"a.csv\"{more} }}"));
        let text = if key == "transmittance" { text } else { text.replace("reflectance = 0.1\n", "") };
        let table = format!("nm,{header}\n300,0.25\n900,0.25\n");
        parse_with(&text, &[("a.csv", &table)], &[])
    };
    for (key, header, noun) in [
        ("reflectance", "Transmittance", "a transmittance"),
        ("reflectance", "emissivity", "an emissivity"),
        ("reflectance", "absorptance", "an absorptance"),
        ("reflectance", "radiance", "a radiance"),
        ("reflectance", "DN", "counts of a detector"),
        ("transmittance", "reflectance", "a reflectance"),
        ("emissivity", "Reflectance", "a reflectance"),
    ] {
        let error = scene(key, header, "").map(|_| ()).expect_err(header).to_string();
        assert!(
            error.contains(&format!("calls its values `{header}`, {noun}")) && error.contains("scale = 1"),
            "{error}"
        );
        let found = scene(key, header, ", scale = 1").unwrap_or_else(|error| panic!("{error}"));
        assert!(
            found.warnings.iter().any(|warning| warning.contains(&format!("`{header}`: times `scale`"))),
            "{header}"
        );
    }
    for (key, header) in [
        ("reflectance", "reflectance"),
        ("reflectance", "albedo of snow"),
        ("reflectance", "oak"),
        ("transmittance", "leaf transmission"),
        ("emissivity", "emissivity"),
    ] {
        let found = scene(key, header, "").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(found.warnings, Vec::<String>::new(), "{header}");
    }
    // A factor that may or may not be applied is the scene's to say; percent of a comment is applied, but where the scene scales.
    let error = scene("reflectance", "reflectance x 100", "").map(|_| ()).expect_err("a factor").to_string();
    assert!(
        error.contains("`reflectance x 100`") && error.contains("not applied") && error.contains("`scale = "),
        "{error}"
    );
    scene("reflectance", "reflectance x 100", ", scale = 0.01").expect("the scene says it");
}
