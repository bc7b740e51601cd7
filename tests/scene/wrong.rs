//! Wrong scenes: each is refused with its file, line, key, and the words that help.

use std::path::Path;

use spectile::Error;
use spectile::scene::{self, Shape};
use spectile::spectral::Curve;

use super::{BASE, changed, good, parse_with};

/// A wrong scene: its name, what is replaced in the base scene, the key to be named, and words of the message. The
/// line to be named is the one with the mark `#!`, if there is one.
type Wrong = (&'static str, &'static str, &'static str, &'static str, &'static [&'static str]);

#[track_caller]
pub fn check_wrong(text: &str, files: &[(&str, &str)], name: &str, key: &str, words: &[&str]) {
    let line = text.lines().position(|line| line.contains("#!")).map(|i| i + 1);
    let error = match parse_with(text, files, &[]) {
        Ok(_) => panic!("{name}: accepted"),
        Err(error) => error,
    };
    assert_eq!(error.exit_code(), 2, "{name}");
    let message = error.to_string();
    let Error::Input(problems) = error else { panic!("{name}: {message}") };
    assert_eq!(problems.len(), 1, "{name}: {message}");
    let problem = &problems[0];
    assert!(problem.file.ends_with("scene.toml"), "{name}: {message}");
    assert_eq!(problem.line, line, "{name}: {message}");
    assert_eq!(problem.key.as_deref().unwrap_or(""), key, "{name}: {message}");
    for word in words {
        assert!(message.contains(word), "{name}: no {word:?} in: {message}");
    }
    if let Some(line) = line {
        assert!(problem.column.is_some(), "{name}: {message}");
        assert!(problem.snippet.as_deref().is_some_and(|snippet| snippet.contains('^')), "{name}: {message}");
        assert!(message.contains(&format!("scene.toml:{line}:")), "{name}: {message}");
    }
}

fn check_all(cases: &[Wrong]) {
    for (name, from, to, key, words) in cases {
        check_wrong(&changed(from, to), &[], name, key, words);
    }
}

#[test]
fn syntax_and_unknown_keys() {
    #[rustfmt::skip]
    check_all(&[
        ("broken syntax", "width = 40", "width = = 40 #!", "", &["not valid TOML"]),
        ("duplicate key", "height = 20", "height = 20\nheight = 30 #!", "", &["not valid TOML", "duplicate key"]),
        ("duplicate table", "[spectra.lamp]", "[spectra.grey] #!", "", &["not valid TOML", "duplicate key"]),
        ("unclosed string", "material = \"soot\"", "material = \"soot #!", "", &["not valid TOML"]),
        ("unknown section", "[film]", "[filmm] #!\n[film]", "filmm", &["unknown key `filmm`", "did you mean `film`?"]),
        ("misspelt key", "width = 40", "width = 40\nwidht = 3 #!", "film.widht", &["unknown key", "did you mean `width`?"]),
        ("far key", "width = 40", "width = 40\nzzzzzz = 3 #!", "film.zzzzzz", &["unknown key", "known keys: width, height"]),
        ("key of black", "[materials.soot.black]", "[materials.soot.black]\nreflectance = 1 #!", "materials.soot.black.reflectance", &["unknown key", "two_sided"]),
        ("key of channels", "count = 3 }", "count = 3, cuont = 4 } #!", "channels.equal.cuont", &["did you mean `count`?"]),
        ("unknown material kind", "[materials.soot.black]", "[materials.soot.blakc] #!", "materials.soot.blakc", &["unknown key", "did you mean `black`?"]),
    ]);
}

#[test]
fn camera() {
    #[rustfmt::skip]
    check_all(&[
        ("fov too wide", "fov = 60.0", "fov = 180 #!", "camera.perspective.fov", &["between 0 and 180", "is 180"]),
        ("fov zero", "fov = 60.0", "fov = 0.0 #!", "camera.perspective.fov", &["between 0 and 180"]),
        ("fov nan", "fov = 60.0", "fov = nan #!", "camera.perspective.fov", &["finite"]),
        ("fov infinite", "fov = 60.0", "fov = inf #!", "camera.perspective.fov", &["finite"]),
        ("fov overflowing", "fov = 60.0", "fov = 1e999 #!", "camera.perspective.fov", &["finite"]),
        ("fov a string", "fov = 60.0", "fov = \"60\" #!", "camera.perspective.fov", &["must be a number", "a string"]),
        ("fov_axis", "fov = 60.0", "fov = 60\nfov_axis = \"z\" #!", "camera.perspective.fov_axis", &["\"smaller\", \"larger\""]),
        ("no way to look", "look_at = [0.0, 0.0, 0.0]", "look_at = [0, 0, 5] #!", "camera.perspective.look_at", &["another point"]),
        ("up along the view", "up = [0.0, 1.0, 0.0]", "up = [0, 0, -3] #!", "camera.perspective.up", &["parallel to the view"]),
        ("up of no length", "up = [0.0, 1.0, 0.0]", "up = [0, 0, 0] #!", "camera.perspective.up", &["length is 0"]),
        ("two coordinates", "position = [0.0, 0.0, 5.0]", "position = [0, 0] #!", "camera.perspective.position", &["three numbers", "2 elements"]),
        ("a string coordinate", "position = [0.0, 0.0, 5.0]", "position = [0, 0, \"5\"] #!", "camera.perspective.position.2", &["a number"]),
        ("flip_x a number", "fov = 60.0", "fov = 60.0\nflip_x = 1 #!", "camera.perspective.flip_x", &["true or false"]),
        ("two cameras", "fov = 60.0", "fov = 60.0\n[camera.orthographic] #!", "camera.orthographic", &["only one kind of camera", "perspective, orthographic"]),
        ("unknown camera", "fov = 60.0", "fov = 60.0\n[camera.fisheye] #!", "camera.fisheye", &["unknown key", "thin_lens"]),
    ]);
    for (name, from, to, key, words) in [
        ("no fov", "fov = 60.0", "", "camera.perspective.fov", "`fov` is missing"),
        ("no position", "position = [0.0, 0.0, 5.0]", "", "camera.perspective.position", "`position` is missing"),
    ] {
        let text = changed(from, to).replace("[camera.perspective]", "[camera.perspective] #!");
        check_wrong(&text, &[], name, key, &[words]);
    }
    let lens = |keys: &str| changed("[camera.perspective]", &format!("[camera.thin_lens] #0\n{keys}"));
    check_wrong(
        &lens("aperture_radius = 0.1").replace("#0", "#!"),
        &[],
        "no focus",
        "camera.thin_lens.focus_distance",
        &["missing"],
    );
    check_wrong(
        &lens("focus_distance = 0 #!\naperture_radius = 1"),
        &[],
        "focus 0",
        "camera.thin_lens.focus_distance",
        &["greater than 0"],
    );
    check_wrong(
        &lens("focus_distance = 1\naperture_radius = -1 #!"),
        &[],
        "negative aperture",
        "camera.thin_lens.aperture_radius",
        &["0 or greater"],
    );
    let orthographic =
        |keys: &str| changed("[camera.perspective]", "[camera.orthographic]").replace("fov = 60.0", keys);
    check_wrong(
        &orthographic("width = 2\nfov = 60.0 #!"),
        &[],
        "fov of orthographic",
        "camera.orthographic.fov",
        &["unknown key `fov`"],
    );
    check_wrong(
        &orthographic("width = -2 #!"),
        &[],
        "negative width",
        "camera.orthographic.width",
        &["greater than 0"],
    );
}

#[test]
fn film() {
    #[rustfmt::skip]
    check_all(&[
        ("width 0", "width = 40", "width = 0 #!", "film.width", &["from 1 to 131072", "is 0"]),
        ("width a fraction", "width = 40", "width = 40.5 #!", "film.width", &["whole number", "40.5"]),
        ("width negative", "width = 40", "width = -1 #!", "film.width", &["from 1 to 131072"]),
        ("width huge", "width = 40", "width = 99999999999999999999 #!", "film.width", &["from 1 to 131072"]),
        ("filter", "width = 40", "width = 40\nfilter = \"bxo\" #!", "film.filter", &["\"box\", \"gaussian\"", "did you mean `box`?"]),
        ("crop outside", "width = 40", "width = 40\ncrop = [0, 0, 41, 20] #!", "film.crop.2", &["from 0 to 40", "is 41"]),
        ("crop empty", "width = 40", "width = 40\ncrop = [7, 3, 7, 9] #!", "film.crop", &["at least one pixel"]),
        ("crop of three", "width = 40", "width = 40\ncrop = [1, 2, 3] #!", "film.crop", &["four whole numbers"]),
    ]);
    let text = changed("height = 20", "").replace("[film]", "[film] #!");
    check_wrong(&text, &[], "no height", "film.height", &["`height` is missing"]);
    check_wrong(
        &changed("[film]\nwidth = 40\nheight = 20", ""),
        &[],
        "no film",
        "film",
        &["`[film]` is missing", "add [film]"],
    );
}

#[test]
fn channels() {
    const EQUAL: &str = "equal = { from = 400.0, to = 700.0, count = 3 }";
    #[rustfmt::skip]
    check_all(&[
        ("from above to", EQUAL, "equal = { from = 700, to = 400, count = 3 } #!", "channels.equal.from", &["less than `to`", "700", "400"]),
        ("from is to", EQUAL, "equal = { from = 400, to = 400, count = 3 } #!", "channels.equal.from", &["less than `to`"]),
        ("unit of equal", EQUAL, "equal = { from = 400, to = 700, count = 3 }\nunit = \"um\" #!", "channels.unit", &["of `intervals` only", "inside of `equal`"]),
        ("unknown unit", EQUAL, "equal = { from = 4, to = 7, unit = \"m\", count = 3 } #!", "channels.equal.unit", &["\"nm\", \"um\""]),
        ("too far in um", EQUAL, "equal = { from = 4, to = 7000, unit = \"um\", count = 3 } #!", "channels.equal.to", &["at most 1000 (um)"]),
        ("from 0", EQUAL, "equal = { from = 0, to = 400, count = 3 } #!", "channels.equal.from", &["greater than 0"]),
        ("to too far", EQUAL, "equal = { from = 1, to = 1e7, count = 3 } #!", "channels.equal.to", &["at most 1000000"]),
        ("no channels", EQUAL, "equal = { from = 1, to = 2, count = 0 } #!", "channels.equal.count", &["from 1 to 65536"]),
        ("too many", EQUAL, "equal = { from = 1, to = 2, count = 65537 } #!", "channels.equal.count", &["from 1 to 65536"]),
        ("no count", EQUAL, "equal = { from = 1, to = 2 } #!", "channels.equal.count", &["`count` is missing"]),
        ("too narrow", EQUAL, "equal = { from = 500, to = 500.0000000000001, count = 9 } #!", "channels.equal", &["too narrow"]),
        ("wavenumber 0", EQUAL, "wavenumber = { from = 0, to = 5000, count = 3 } #!", "channels.wavenumber.from", &["at least 10"]),
        ("wavenumbers reversed", EQUAL, "wavenumber = { from = 5000, to = 500, count = 3 } #!", "channels.wavenumber.from", &["less than `to`"]),
        ("interval reversed", EQUAL, "intervals = [[400, 500], [600, 500]] #!", "channels.intervals.1", &["from less than to"]),
        ("interval of three", EQUAL, "intervals = [[400, 500, 600]] #!", "channels.intervals.0", &["two wavelengths"]),
        ("no intervals", EQUAL, "intervals = [] #!", "channels.intervals", &["1 to 65536 intervals"]),
        ("two kinds", EQUAL, "equal = { from = 400, to = 700, count = 3 }\nintervals = [[1, 2]] #!", "channels.intervals", &["only one kind of channels"]),
        ("responses", EQUAL, "responses = \"sensor.csv\" #!", "channels.responses", &["sensor.csv cannot be read"]),
        ("false colour outside", EQUAL, "equal = { from = 400, to = 700, count = 3 }\nfalse_colour = [0, 1, 3] #!", "channels.false_colour.2", &["from 0 to 2"]),
    ]);
    let text = changed(EQUAL, "").replace("[channels]", "[channels] #!");
    check_wrong(&text, &[], "no kind", "channels", &["no kind of channels", "equal, wavenumber, intervals, responses"]);
}

#[test]
fn integrator() {
    const KEY: &str = "max_bounces = 4";
    #[rustfmt::skip]
    check_all(&[
        ("negative bounces", KEY, "max_bounces = -1 #!", "integrator.max_bounces", &["whole number from 0"]),
        ("roulette", KEY, "russian_roulette_start = 0.5 #!", "integrator.russian_roulette_start", &["whole number"]),
        ("sampler", KEY, "sampler = \"sobel\" #!", "integrator.sampler", &["\"sobol\", \"independent\"", "did you mean `sobol`?"]),
        ("wavelengths", KEY, "wavelengths = \"random\" #!", "integrator.wavelengths", &["must be one of \"emission\", \"uniform\""]),
        ("evaluator", KEY, "evaluator = \"dpept\" #!", "integrator.evaluator", &["\"auto\", \"dpept-pixel\""]),
        ("epoch", KEY, "epoch = 48 #!", "integrator.epoch", &["power of two up to 1024", "use 32 or 64"]),
        ("epoch too large", KEY, "epoch = 2048 #!", "integrator.epoch", &["from 1 to 1024"]),
        ("epoch 0", KEY, "epoch = 0 #!", "integrator.epoch", &["from 1 to 1024"]),
    ]);
}

#[test]
fn spectra_and_materials() {
    const GREY: &str = "constant = 0.5";
    const USE: &str = "reflectance = \"grey\"";
    let white = "materials.white.diffuse.reflectance";
    #[rustfmt::skip]
    check_all(&[
        ("reflectance above 1", GREY, "constant = 1.5 #!", "spectra.grey.constant", &["[0, 1]", "1.5", "used by `materials.white.diffuse.reflectance`"]),
        ("reflectance below 0", USE, "reflectance = -0.1 #!", white, &["[0, 1]", "-0.1"]),
        ("scale above 1", GREY, "constant = 0.5 #!\nscale = 3", "spectra.grey.constant", &["[0, 1]", "0.5 x scale 3"]),
        ("negative scale", GREY, "constant = 0.5\nscale = -1 #!", "spectra.grey.scale", &["0 or greater"]),
        ("nan", GREY, "constant = nan #!", "spectra.grey.constant", &["finite"]),
        ("two sources", GREY, "constant = 0.5\nblackbody = 300 #!", "spectra.grey.blackbody", &["only one spectrum source", "constant, blackbody"]),
        ("unknown source", GREY, "constant = 0.5\nconstnat = 3 #!", "spectra.grey.constnat", &["did you mean `constant`?"]),
        ("missing file", GREY, "file = \"nowhere.csv\" #!", "spectra.grey.file", &["nowhere.csv", "cannot be read"]),
        ("file is a folder", GREY, "file = \"\" #!", "spectra.grey.file", &["cannot be read"]),
        ("yaml", GREY, "file = \"gold.yml\" #!", "spectra.grey.file", &["gold.yml", "cannot be read"]),
        ("column without file", GREY, "constant = 0.5\ncolumn = \"a\" #!", "spectra.grey.column", &["goes with `file` only"]),
        ("outside", GREY, "constant = 0.5\noutside = \"nothing\" #!", "spectra.grey.outside", &["\"zero\", \"hold\""]),
        ("one sample", GREY, "samples = [[400, 0.1]] #!", "spectra.grey.samples", &["at least two"]),
        ("samples descending", GREY, "samples = [[500, 0.1], [400, 0.2]] #!", "spectra.grey.samples.1", &["ascend", "400 follows 500"]),
        ("samples of one number", GREY, "samples = [[400, 0.1], [500]] #!", "spectra.grey.samples.1", &["a pair [nm, value]"]),
        ("sample above 1", GREY, "samples = [[400, 0.1], [500, 1.25]] #!", "spectra.grey.samples", &["[0, 1]", "1.25 at 500 nm"]),
        ("regular", GREY, "regular = { from = 700, to = 400, values = [0, 1] } #!", "spectra.grey.regular.from", &["less than `to`"]),
        ("regular without values", GREY, "regular = { from = 400, to = 700 } #!", "spectra.grey.regular.values", &["missing"]),
        ("rgb above 1", GREY, "rgb = [0.5, 1.5, 0.5] #!", "spectra.grey.rgb", &["[0, 1]", "1.5"]),
        ("rgb of two", GREY, "rgb = [0.5, 0.5] #!", "spectra.grey.rgb", &["three numbers"]),
        ("a name for a spectrum", "[spectra.grey]\nconstant = 0.5", "[spectra]\ngrey = \"lamp\" #!", "spectra.grey", &["must be a number or a table"]),
        ("negative temperature", "blackbody = 3000", "blackbody = -1 #!", "spectra.lamp.blackbody", &["greater than 0"]),
        ("unknown spectrum", USE, "reflectance = \"gray\" #!", white, &["no spectrum is named \"gray\"", "did you mean `grey`?"]),
        ("unknown far spectrum", USE, "reflectance = \"copper\" #!", white, &["no spectrum is named", "grey, lamp"]),
        ("file for a name", USE, "reflectance = \"white.csv\" #!", white, &["write { file = \"white.csv\" }"]),
        ("boolean spectrum", USE, "reflectance = true #!", white, &["must be a spectrum", "a boolean"]),
        ("two_sided", USE, "reflectance = 0.5\ntwo_sided = \"yes\" #!", "materials.white.diffuse.two_sided", &["true or false"]),
        ("two kinds", "[materials.soot.black]", "[materials.soot.black]\n[materials.soot.diffuse] #!\nreflectance = 1", "materials.soot.diffuse", &["only one kind of material"]),
        ("no kind", "[materials.soot.black]", "[materials.soot.black]\n[materials.bare] #!", "materials.bare", &["no kind of material"]),
    ]);
    let text = changed(USE, "reflectance = \"lamp\"").replace("blackbody = 3000", "blackbody = 3000 #!");
    check_wrong(&text, &[], "radiance as reflectance", "spectra.lamp.blackbody", &["[0, 1]", "peak of the black body"]);
    let text = changed(USE, "").replace("[materials.white.diffuse]", "[materials.white.diffuse] #!");
    check_wrong(&text, &[], "no reflectance", white, &["`reflectance` is missing"]);
}

#[test]
fn objects() {
    const QUAD: &str = "quad = { corner = [0, 0, 0], edge_u = [2, 0, 0], edge_v = [0, 3, 0] }";
    const MESH: &str = "mesh = \"tri.obj\"\nmaterial = \"soot\"";
    #[rustfmt::skip]
    check_all(&[
        ("two shapes", QUAD, "sphere = { center = [0, 0, 0], radius = 1 }\nquad = { corner = [0, 0, 0], edge_u = [2, 0, 0], edge_v = [0, 3, 0] } #!", "objects.0.quad", &["only one shape"]),
        ("radius 0", QUAD, "sphere = { center = [0, 0, 0], radius = 0 } #!", "objects.0.sphere.radius", &["greater than 0"]),
        ("negative radius", QUAD, "disk = { center = [0, 0, 0], normal = [0, 0, 1], radius = -1 } #!", "objects.0.disk.radius", &["greater than 0"]),
        ("disk without normal", QUAD, "disk = { center = [0, 0, 0], radius = 1 } #!", "objects.0.disk.normal", &["missing"]),
        ("normal of no length", QUAD, "disk = { center = [0, 0, 0], normal = [0, 0, 0], radius = 1 } #!", "objects.0.disk.normal", &["length is 0"]),
        ("flat quad", QUAD, "quad = { corner = [0, 0, 0], edge_u = [2, 4, 0], edge_v = [1, 2, 0] } #!", "objects.0.quad", &["no area"]),
        ("inverted cube", QUAD, "cube = { min = [0, 0, 0], max = [1, -1, 1] } #!", "objects.0.cube.min", &["less than `max`"]),
        ("cylinder of no length", QUAD, "cylinder = { from = [1, 1, 1], to = [1, 1, 1], radius = 1 } #!", "objects.0.cylinder.to", &["another point"]),
        ("key of a shape", QUAD, "sphere = { centre = [0, 0, 0], center = [0, 0, 0], radius = 1 } #!", "objects.0.sphere.centre", &["did you mean `center`?"]),
        ("group of a quad", "material = \"white\"", "material = \"white\"\ngroup = \"a\" #!", "objects.0.group", &["goes with `mesh` only"]),
        ("unknown material", "material = \"white\"", "material = \"whit\" #!", "objects.0.material", &["no material is named \"whit\"", "did you mean `white`?"]),
        ("negative emission", "emission = \"lamp\"", "emission = -2 #!", "objects.1.emission", &["[0, 1e35]", "-2"]),
        ("emission_sides", "emission = \"lamp\"", "emission = 1\nemission_sides = \"back\" #!", "objects.1.emission_sides", &["\"front\", \"both\""]),
        ("missing mesh", MESH, "mesh = \"nowhere.obj\" #!\nmaterial = \"soot\"", "objects.1.mesh", &["nowhere.obj", "cannot be read"]),
        ("unknown group", MESH, "mesh = \"tri.obj\"\nmaterial = \"soot\"\ngroup = \"roof\" #!", "objects.1.group", &["\"roof\"", "groups with faces: part"]),
        ("scale 0", MESH, "mesh = \"tri.obj\"\nmaterial = \"soot\"\ntransform = { scale = 0 } #!", "objects.1.transform", &["determinant is 0"]),
        ("rotation without axis", MESH, "mesh = \"tri.obj\"\nmaterial = \"soot\"\ntransform = { rotate = [0, 0, 0, 30] } #!", "objects.1.transform.rotate", &["axis"]),
        ("matrix of 9", MESH, "mesh = \"tri.obj\"\nmaterial = \"soot\"\ntransform = { matrix = [1, 0, 0, 0, 1, 0, 0, 0, 1] } #!", "objects.1.transform.matrix", &["16 numbers"]),
        ("matrix column-major", MESH, "mesh = \"tri.obj\"\nmaterial = \"soot\"\ntransform = { matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1] } #!", "objects.1.transform.matrix", &["last row", "row-major"]),
        ("matrix and scale", MESH, "mesh = \"tri.obj\"\nmaterial = \"soot\"\ntransform = { scale = 2, matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] } #!", "objects.1.transform.scale", &["without `matrix` only"]),
        ("sheared sphere", QUAD, "sphere = { center = [0, 0, 0], radius = 1 }\ntransform = { scale = [1, 1, 2] } #!", "objects.0.transform", &["must keep the shape"]),
        ("too far", QUAD, "sphere = { center = [0, 0, 0], radius = 1 }\ntransform = { translate = [1e20, 0, 0] } #!", "objects.0.transform", &["farther than can be represented"]),
        ("up of nothing", "radiance = 0.25", "radiance = 0.25\nup = [0, 0, 0] #!", "environment.up", &["length is 0"]),
        ("map that is not there", "radiance = 0.25", "map = \"sky.exr\" #!", "environment.map", &["sky.exr", "cannot be read"]),
        ("negative sky", "radiance = 0.25", "radiance = -0.25 #!", "environment.radiance", &["[0, 1e35]"]),
        ("sky scaled too far", "radiance = 0.25", "radiance = 1e30\nscale = 1e10 #!", "environment.scale", &["[0, 1e35]", "after scaling"]),
        ("sky scaled below 0", "radiance = 0.25", "radiance = 1\nscale = -1 #!", "environment.scale", &["0 or greater"]),
        ("objects no array", "[environment]", "[environment]\nobjects = 3 #!", "environment.objects", &["unknown key"]),
    ]);
    let text = changed(QUAD, "").replacen("[[objects]]", "[[objects]] #!", 1);
    check_wrong(&text, &[], "no shape", "objects.0", &["no shape", "mesh, sphere, quad, disk, cube, cylinder"]);
    let text = changed("material = \"white\"", "").replacen("[[objects]]", "[[objects]] #!", 1);
    check_wrong(&text, &[], "no material", "objects.0.material", &["no `material`", "add e.g. `material"]);
}

#[test]
fn meshes_and_materials() {
    let by_usemtl = changed("mesh = \"tri.obj\"\nmaterial = \"soot\"", "mesh = \"m.obj\" #!");
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let mesh = format!("{square}usemtl brick\nf 1 2 3\nusemtl white\nf 1 3 4\n");
    check_wrong(
        &by_usemtl,
        &[("m.obj", &mesh)],
        "unknown usemtl",
        "objects.1.mesh",
        &["m.obj", "brick", "usemtl names are brick, white"],
    );
    let mut without = by_usemtl.replace(" #!", "");
    let last = without.rfind("[[objects]]").unwrap();
    without.insert_str(last + "[[objects]]".len(), " #!");
    check_wrong(
        &without,
        &[("m.obj", &format!("{square}f 1 2 3\n"))],
        "no usemtl",
        "objects.1.material",
        &["m.obj no usemtl", "add e.g."],
    );
    let partly = format!("{square}f 1 2 3\nusemtl white\nf 1 3 4\n");
    check_wrong(&without, &[("m.obj", &partly)], "partly usemtl", "objects.1.material", &["from line 5 of m.obj"]);
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nusemtl white\nf 1 2 3\n";
    check_wrong(&without, &[("m.obj", flat)], "degenerate", "objects.1", &["no area"]);
}

/// A scene, one of its files and what that holds; the line there, the key in the scene and the words to be named.
type WrongFile<'a> = (&'a str, &'a str, &'a str, Option<usize>, &'a str, &'a str);

/// Mistakes in a spectrum or mesh file are shown at their line there.
#[test]
fn mistakes_in_other_files_name_those() {
    let with_csv = changed("constant = 0.5", "file = \"s.csv\"");
    let with_obj = changed("tri.obj", "m.obj");
    let cases: &[WrongFile] = &[
        (&with_csv, "s.csv", "nm,value\n400,0.5\n500,x\n", Some(3), "spectra.grey.file", "`x` is not a finite number"),
        (
            &with_csv,
            "s.csv",
            "nm,value\n400,0.5\n500,1.5\n",
            Some(3),
            "materials.white.diffuse.reflectance",
            "[0, 1], but is 1.5 at 500 nm",
        ),
        (
            &with_csv,
            "s.csv",
            "400,0.5\n500,0.5\n450,0.5\n700,0.5",
            Some(3),
            "spectra.grey.file",
            "450 nm follows 500 nm",
        ),
        (&with_csv, "s.csv", "nm,a,b\n400,0,1\n500,0,1\n", Some(1), "spectra.grey.file", "2 value columns"),
        (&with_csv, "s.csv", "# nothing\n", None, "spectra.grey.file", "holds no data"),
        (
            &with_obj,
            "m.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
            Some(4),
            "objects.1.mesh",
            "vertex 9 does not exist",
        ),
        (&with_obj, "m.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", Some(2), "objects.1.mesh", "not finite"),
        (&with_obj, "m.obj", "v 0 0 0\n", None, "objects.1.mesh", "has no faces"),
    ];
    for (text, file, content, line, key, words) in cases {
        let error = parse_with(text, &[(file, content)], &[]).expect_err(words);
        assert_eq!(error.exit_code(), 2);
        let Error::Input(problems) = error else { panic!("{words}") };
        assert_eq!(problems.len(), 1, "{problems:?}");
        let message = problems[0].to_string();
        assert_eq!(problems[0].key.as_deref(), Some(*key), "{message}");
        assert!(message.contains(words) && message.contains(file), "{message}");
        if let Some(line) = line {
            assert!(problems[0].file.ends_with(file), "{message}");
            assert_eq!(problems[0].line, Some(*line), "{message}");
        }
    }
}

#[test]
fn independent_mistakes_are_reported_together_in_the_order_of_the_file() {
    let text = BASE
        .replace("fov = 60.0", "fov = 200")
        .replace("width = 40", "width = 0\nwidht = 3")
        .replace("count = 3", "count = 0")
        .replace("max_bounces = 4", "epoch = 3\nsampler = \"x\"")
        .replace("constant = 0.5", "constant = 2")
        .replace("material = \"soot\"", "material = \"sot\"")
        .replace("radiance = 0.25", "radiance = \"sky\"");
    let Err(Error::Input(problems)) = parse_with(&text, &[], &[]) else { panic!("accepted") };
    let keys: Vec<_> = problems.iter().map(|p| p.key.as_deref().unwrap_or("")).collect();
    assert_eq!(
        keys,
        [
            "camera.perspective.fov",
            "film.width",
            "film.widht",
            "channels.equal.count",
            "integrator.epoch",
            "integrator.sampler",
            "spectra.grey.constant",
            "objects.1.material",
            "environment.radiance",
        ]
    );
    let lines: Vec<_> = problems.iter().map(|p| p.line).collect();
    assert!(lines.is_sorted() && lines.iter().all(Option::is_some), "{lines:?}");
}

#[test]
fn every_part_of_an_object_is_looked_at() {
    let text = changed(
        "mesh = \"tri.obj\"\nmaterial = \"soot\"\nemission = \"lamp\"",
        "mesh = \"nowhere.obj\"\nmaterial = \"sot\"\nemission = -1\nemission_sides = \"up\"\ntransform = { scale = 0 }",
    );
    let Err(Error::Input(problems)) = parse_with(&text, &[], &[]) else { panic!("accepted") };
    let keys: Vec<_> = problems.iter().map(|p| p.key.as_deref().unwrap_or("")).collect();
    assert_eq!(
        keys,
        ["mesh", "material", "emission", "emission_sides", "transform"].map(|key| format!("objects.1.{key}"))
    );
}

#[test]
fn syntax_errors_are_reported_together() {
    let text = changed("fov = 60.0", "fov = ").replace("width = 40", "width = 4x");
    let Err(Error::Input(problems)) = parse_with(&text, &[], &[]) else { panic!("accepted") };
    assert!(problems.len() >= 2, "{problems:?}");
}

#[test]
fn an_unreadable_scene_is_bad_input() {
    let error = scene::load(Path::new("/nonexistent/scene.toml"), &[]).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("/nonexistent/scene.toml"));
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("scene.toml");
    std::fs::write(&file, b"[film]\nwidth = \xff\n").unwrap();
    let error = scene::load(&file, &[]).unwrap_err();
    assert!(error.to_string().contains("scene.toml:2: is not UTF-8"), "{error}");
}

#[test]
fn overrides_replace_and_their_mistakes_name_them() {
    let scene = good(
        BASE,
        &[],
        &[
            ("channels.equal.count", "1000"),
            ("objects.0.material", "soot"),
            ("film.crop", "[0, 0, 8, 8]"),
            ("materials.soot.diffuse.reflectance", "0.75"),
            ("objects.1.sphere", "{ center = [0, 0, 0], radius = 2 }"),
        ],
    );
    assert_eq!(scene.channels.len(), 1000);
    assert_eq!(scene.film.cube_size(), [8, 8]);
    assert_eq!((scene.objects[0].material, scene.materials.len()), (Some(0), 1));
    assert_eq!(scene.spectra[0].curve, Curve::Constant(0.75));
    assert!(matches!(scene.objects[1].shape, Shape::Sphere { radius: 2.0, .. }));
    assert_eq!(good(BASE, &[], &[("channels.intervals", "[[400, 500]]")]).channels.bounds, [[400.0, 500.0]]);
    // What nothing makes use of is told of, where the command line brings it.
    let told = |set: &[(&str, &str)]| {
        let found = good(BASE, &[], set).warnings;
        found.into_iter().filter(|warning| warning.contains("changes nothing")).collect::<Vec<_>>()
    };
    let stray = told(&[("spectra.lam", "0.5"), ("media.air.absorption", "1.0")]);
    assert!(
        stray.len() == 2 && stray[0].contains("--set spectra.lam=0.5") && stray[0].contains("no `lam`"),
        "{stray:?}"
    );
    assert_eq!(told(&[("spectra.grey", "0.5"), ("materials.white.diffuse.reflectance", "grey")]), Vec::<String>::new());

    let intervals = changed("equal = { from = 400.0, to = 700.0, count = 3 }", "intervals = [[400, 500]]");
    for (text, set, key, words) in [
        (intervals.as_str(), ("channels.equal.count", "1000"), "channels.equal.from", "`from` is missing"),
        (BASE, ("film.width", "0"), "film.width", "from 1 to 131072"),
        (BASE, ("film.widht", "5"), "film.widht", "did you mean `width`?"),
        (BASE, ("objects.0.material", "red"), "objects.0.material", "no material is named \"red\""),
        (BASE, ("objects.7.material", "white"), "objects.7.material", "no index of `objects`"),
        (BASE, ("film", "[1,"), "film", "not valid TOML"),
        (BASE, ("camera.thin_lens", "{}"), "camera.thin_lens.fov", "`fov` is missing"),
    ] {
        let error = parse_with(text, &[], &[set]).expect_err(words);
        assert_eq!(error.exit_code(), 2);
        let Error::Input(problems) = error else { panic!("{words}") };
        let argument = format!("--set {}={}", set.0, set.1);
        let named = problems.iter().find(|p| p.key.as_deref() == Some(key)).unwrap_or_else(|| panic!("{problems:?}"));
        assert_eq!((named.file.to_str(), named.line), (Some(argument.as_str()), None), "{named}");
        assert!(named.to_string().contains(words), "{named}");
    }
}
