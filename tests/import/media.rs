//! What fills shapes of others.

use super::{import, written};

const MITSUBA: &str = r#"<scene version="3.0.0"><sensor type="perspective"/>
    <medium type="homogeneous" id="fog"><float name="albedo" value="0.75"/><float name="sigma_t" value="2"/><float name="scale" value="3"/>
        <phase type="hg"><float name="g" value="0.7"/></phase></medium>
    <shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
    <shape type="sphere"><bsdf type="dielectric"/><medium name="interior" type="homogeneous">
        <volume name="albedo" type="constvolume"><float name="value" value="0"/></volume><phase type="rayleigh"/></medium></shape>
    <shape type="sphere"><bsdf type="diffuse"/><ref name="interior" id="fog"/></shape>
    <shape type="rectangle"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
    <shape type="cube"><bsdf type="null"/><medium name="interior" type="heterogeneous"/></shape></scene>"#;

const PBRT: &str = r#"Camera "perspective" WorldBegin
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [0.5 0.5 0.5] "rgb sigma_s" [1 1 1] "float scale" 2 "float g" 0.3
MakeNamedMedium "cloud" "string type" "cloud"
AttributeBegin
MediumInterface "fog" ""
Material "interface" Shape "sphere"
Material "dielectric" Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0  0 0 1] "integer indices" [0 2 1  0 1 3  1 2 3  0 3 2]
Shape "disk"
AttributeEnd
AttributeBegin MediumInterface "cloud" "" Material "interface" Shape "sphere" AttributeEnd
Material "diffuse" Shape "sphere"
"#;

/// Six of every unit are met, four and a half scattered.
#[test]
fn media_of_mitsuba_fill_what_is_closed() {
    let (_folder, path) = written("scene.xml", MITSUBA);
    let found = import(&path);
    let toml = &found.toml;
    for expected in ["[media.fog]\nabsorption = 1.5\nscattering = 4.5\nphase = { hg = 0.7 }\n", "absorption = 1.0\n"] {
        assert!(toml.contains(expected), "{expected}: {toml}");
    }
    // The box of fog, the glass, and what is diffuse.
    let within: Vec<(bool, bool)> =
        found.scene.objects.iter().map(|object| (object.material.is_some(), object.interior.is_some())).collect();
    assert_eq!(within, [(false, true), (true, true), (true, false)], "{toml}");
    for said in [
        "the medium \"fog\" in a shape: nothing passes its surface",
        "the medium \"fog\" in a shape: its shape has no inside",
        "a medium `heterogeneous`",
    ] {
        assert!(found.page.contains(said), "{said}: {}", found.page);
    }
}

#[test]
fn media_of_pbrt_fill_what_is_closed() {
    let (_folder, path) = written("scene.pbrt", PBRT);
    let found = import(&path);
    let toml = &found.toml;
    assert!(toml.contains("[media.fog]\nabsorption = 1.0\nscattering = 2.0\nphase = { hg = 0.3 }\n"), "{toml}");
    let within: Vec<(bool, bool)> =
        found.scene.objects.iter().map(|object| (object.material.is_some(), object.interior.is_some())).collect();
    assert_eq!(within, [(false, true), (true, true), (true, false), (true, false)], "{toml}");
    for said in ["the medium \"cloud\" (`cloud`): it differs from place to place", "its shape has no inside"] {
        assert!(found.page.contains(said), "{said}: {}", found.page);
    }
    let (folder, path) = written("scene.pbrt", &PBRT.replace("MediumInterface \"fog\"", "MediumInterface \"smoke\""));
    let error = spectile::import::import(&path, &folder.path().join("out")).expect_err("no such medium").to_string();
    assert!(error.contains("no medium is named \"smoke\""), "{error}");
}

/// What is placed several times keeps what is in it.
#[test]
fn media_of_groups_are_placed() {
    let group = r#"<shape type="shapegroup" id="drops"><shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape></shape>
        <shape type="instance"><ref id="drops"/></shape>
        <shape type="instance"><ref id="drops"/><transform name="to_world"><translate x="9"/></transform></shape></scene>"#;
    let (_folder, path) = written("scene.xml", &MITSUBA.replace("</scene>", group));
    let (_other, of_pbrt) = written(
        "scene.pbrt",
        &format!(
            "{PBRT}ObjectBegin \"drop\" MediumInterface \"fog\" \"\" Material \"interface\" Shape \"sphere\" ObjectEnd\n\
             ObjectInstance \"drop\" Translate 9 0 0 ObjectInstance \"drop\"\n"
        ),
    );
    for path in [path, of_pbrt] {
        let found = import(&path);
        let [assembly] = &found.scene.assemblies[..] else { panic!("{}", found.toml) };
        let own: Vec<_> = found.scene.objects.iter().filter(|object| object.assembly.is_some()).collect();
        assert_eq!((assembly.instances.len(), own.len()), (2, 1), "{}", found.toml);
        assert!(own[0].material.is_none() && own[0].interior.is_some(), "{}", found.toml);
    }
}

/// Of all that is scattered, half goes as Rayleigh says, and a quarter each as two of Henyey and Greenstein's; the first kind absorbs.
#[test]
fn phase_functions_are_blended() {
    let hg = |g: &str| format!("<phase type=\"hg\"><float name=\"g\" value=\"{g}\"/></phase>");
    let blended = |weight: &str, inner: &str| format!("<phase type=\"blendphase\">{weight}{inner}</phase>");
    let half = "<float name=\"weight\" value=\"0.5\"/>";
    let volume = "<volume type=\"constvolume\" name=\"weight\"><float name=\"value\" value=\"0.5\"/></volume>";
    let scene = |phase: &str| {
        format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" \
             type=\"homogeneous\" id=\"mist\"><float name=\"albedo\" value=\"0.75\"/><float name=\"sigma_t\" value=\"8\"/>{phase}</medium></shape></scene>"
        )
    };
    let both = blended(volume, &(hg("0.7") + &hg("-0.2")));
    let (_folder, path) = written("scene.xml", &scene(&blended(half, &format!("<phase type=\"rayleigh\"/>{both}"))));
    let found = import(&path);
    let header = "[[media.mist.components]]\n";
    let expected = format!(
        "{header}absorption = 2.0\nscattering = 3.0\nphase = {{ rayleigh = 0.0 }}\n\n\
         {header}scattering = 1.5\nphase = {{ hg = 0.7 }}\n\n{header}scattering = 1.5\nphase = {{ hg = -0.2 }}\n"
    );
    assert!(found.toml.contains(&expected), "{}", found.toml);
    assert_eq!(found.scene.media[0].components.len(), 3);
    // What has no share is not there.
    let none = half.replace("0.5", "1");
    let (_folder, path) = written("scene.xml", &scene(&blended(&none, &(hg("0.7") + &hg("0.1")))));
    let toml = import(&path).toml;
    assert!(toml.contains("[media.mist]\nabsorption = 2.0\nscattering = 6.0\nphase = { hg = 0.1 }\n"), "{toml}");
    for (phase, message) in [
        (blended("", &(hg("0.7") + &hg("0.1"))), "`blendphase` needs a `weight`"),
        (blended(&half.replace("0.5", "2"), &(hg("0.7") + &hg("0.1"))), "must lie between 0 and 1"),
        (blended(half, &hg("0.7")), "needs two phase functions"),
        ((0..20).fold(hg("0"), |inner, _| blended(half, &(hg("0.5") + &inner))), "within more than 16 others"),
    ] {
        let (folder, path) = written("scene.xml", &scene(&phase));
        let error = spectile::import::import(&path, &folder.path().join("out")).expect_err("a mistake").to_string();
        assert!(error.contains(message), "{error}");
    }
    let varied = blended("<volume type=\"gridvolume\" name=\"weight\"/>", &(hg("0.7") + &hg("0.1")));
    let (_folder, path) = written("scene.xml", &scene(&varied));
    let page = import(&path).page;
    assert!(page.contains("a medium whose phase function differs from place to place"), "{page}");
}
