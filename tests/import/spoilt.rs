//! Scenes to import that were valid before something happened to them: each is imported or refused in one sentence.

use std::path::Path;

use super::written;

/// Numbers without a pattern (xorshift, Marsaglia 2003), the same ones in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit.max(1) as u64) as usize
    }
}

const WORDS: [&str; 16] =
    ["nan", "-1", "1e999", "\"", "<", ">", "/>", "99999999999999999999", "0", ",", "$", "..", "/", "-0", "\n", "[]"];

fn spoil(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + random.below(3) {
        let at = random.below(bytes.len() + 1);
        let word = WORDS[random.below(WORDS.len())].as_bytes();
        match random.below(6) {
            0 => bytes.truncate(at),
            1 => drop(bytes.splice(at..at, word.iter().copied())),
            2 => {
                // A number becomes another.
                let digit = |b: &u8| b.is_ascii_digit() || *b == b'.' || *b == b'-';
                let start = (at..bytes.len()).find(|i| digit(&bytes[*i])).unwrap_or(bytes.len());
                let end = (start..bytes.len()).find(|i| !digit(&bytes[*i])).unwrap_or(bytes.len());
                drop(bytes.splice(start..end, word.iter().copied()));
            }
            3 => {
                // A line is lost.
                let start = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
                let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |i| at + i);
                drop(bytes.drain(start..end));
            }
            4 => {
                // A piece stands twice.
                let end = (at + random.below(200)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, piece));
            }
            _ if at < bytes.len() => bytes[at] ^= 1 << random.below(7),
            _ => {}
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn try_import(source: &Path, out: &Path) {
    match spectile::import::import(source, out) {
        Ok(_) => std::fs::remove_dir_all(out).expect("removed"),
        Err(error) => {
            let said = error.to_string();
            assert!(!said.is_empty() && !said.contains('\n') && said.len() < 2000, "{said}");
            assert!(!matches!(error, spectile::Error::Internal(_)), "{said}");
        }
    }
}

const MITSUBA: &str = r#"<scene version="3.0.0">
<default name="a" value="0.5"/>
<integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><transform name="to_world">
<lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/><rotate x="1" angle="3"/></transform>
<film type="hdrfilm"><integer name="width" value="40"/><integer name="crop_width" value="20"/></film></sensor>
<bsdf type="twosided" id="p"><bsdf type="principled"><rgb name="base_color" value="0.1, 0.2, 0.3"/><float name="metallic" value="$a"/></bsdf></bsdf>
<bsdf type="plastic" id="q"><texture type="checkerboard" name="diffuse_reflectance"><transform name="to_uv"><scale value="3"/></transform></texture></bsdf>
<shape type="sphere"><ref id="p"/><transform name="to_world"><scale x="2"/><matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/></transform></shape>
<shape type="disk"><ref id="q"/><emitter type="area"><spectrum name="radiance" value="400:1, 700:2"/></emitter></shape>
<shape type="shapegroup" id="g"><shape type="cube"/></shape>
<shape type="instance"><ref id="g"/></shape>
<shape type="obj"><string name="filename" value="m.obj"/><bsdf type="roughconductor"><string name="material" value="Ag"/></bsdf></shape>
<emitter type="spot"><float name="cutoff_angle" value="30"/></emitter>
<emitter type="constant"><rgb name="radiance" value="1, 2, 3"/></emitter>
</scene>
"#;

const PBRT: &str = r#"LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" [60] "float lensradius" 0.1 "float screenwindow" [-1 1 -1 1]
Film "rgb" "integer xresolution" [40] "integer yresolution" [20] "float cropwindow" [0 0.5 0 1]
WorldBegin
Texture "c" "spectrum" "checkerboard" "rgb tex1" [1 0.5 0.25] "float uscale" 4
MakeNamedMaterial "m" "string type" "coateddiffuse" "texture reflectance" "c" "float roughness" 0.1
AttributeBegin
ObjectBegin "o" Rotate 30 0 1 0 Shape "sphere" "float radius" 0.5 ObjectEnd
NamedMaterial "m"
AreaLightSource "diffuse" "blackbody L" 3000 "float power" 10
Shape "loopsubdiv" "integer levels" 1 "integer indices" [0 1 2] "point3 P" [0 0 0  1 0 0  0 1 0]
AttributeEnd
ObjectInstance "o"
Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 0.5]
Material "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k"
Shape "cylinder" "float zmin" 0 "float zmax" 2
LightSource "spot" "spectrum I" [400 1 700 2] "float coneangle" 40
LightSource "infinite" "rgb L" [0.4 0.45 0.5]
"#;

fn many(name: &str, valid: &str, cases: usize) {
    let (folder, path) = written(name, valid);
    std::fs::write(folder.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    let out = folder.path().join("out");
    spectile::import::import(&path, &out).expect("valid");
    std::fs::remove_dir_all(&out).expect("removed");
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for _ in 0..cases {
        std::fs::write(&path, spoil(valid, &mut random)).expect("written");
        try_import(&path, &out);
    }
}

#[test]
fn spoilt_scenes_are_imported_or_refused() {
    many("scene.xml", MITSUBA, 300);
    many("scene.pbrt", PBRT, 300);
    many("scene.gltf", super::gltf::SCENE, 300);
}

#[test]
fn files_that_include_each_other_end() {
    let (folder, path) = written("a.xml", "<scene version=\"3.0.0\"><include filename=\"b.xml\"/></scene>");
    let out = folder.path().join("out");
    std::fs::write(folder.path().join("b.xml"), "<scene version=\"3.0.0\"><include filename=\"a.xml\"/></scene>")
        .expect("written");
    let said = spectile::import::import(&path, &out).unwrap_err().to_string();
    assert!(said.contains("includes itself"), "{said}");
    // Twice as many in each: a million if nothing counted them.
    for i in 0..20 {
        let twice = format!("<include filename=\"{}.xml\"/>", i + 1).repeat(2);
        let text = format!("<scene version=\"3.0.0\">{twice}</scene>");
        std::fs::write(folder.path().join(format!("{i}.xml")), text).expect("written");
    }
    std::fs::write(folder.path().join("20.xml"), "<scene version=\"3.0.0\"/>").expect("written");
    let said = spectile::import::import(&folder.path().join("0.xml"), &out).unwrap_err().to_string();
    assert!(said.contains("that many are read at most"), "{said}");
}
