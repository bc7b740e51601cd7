//! Meshes of every format as objects of a scene, and those that others made.

use std::path::{Path, PathBuf};

use glam::DVec3;
use spectile::format::mesh::{self, Format, Mesh};
use spectile::scene::Shape;

use super::{changed, good};
use crate::binary::repository;
use crate::report::excuse;
use crate::scene::wrong::check_wrong;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n2 1 0\n0 1 0\n4 0 1 2 3\n";
const STL: &str =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
/// A triangle of "white" at 0 and one of "soot", the node "lid", at z = 5.
const GLTF: &str = r#"{"asset": {"version": "2.0"}, "materials": [{"name": "white"}, {"name": "soot"}],
    "nodes": [{"mesh": 0}, {"name": "lid", "mesh": 1, "translation": [0, 0, 5]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]},
        {"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]}],
    "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 3}],
    "bufferViews": [{"buffer": 0, "byteLength": 9}],
    "buffers": [{"byteLength": 9, "uri": "data:;base64,AAAAAQAAAAEA"}]}"#;

fn with(mesh: &str, material: &str) -> String {
    changed("mesh = \"tri.obj\"\nmaterial = \"soot\"", &format!("mesh = \"{mesh}\" #!\n{material}"))
}

#[test]
fn formats_are_told_by_name_or_content() {
    let soot = "material = \"soot\"";
    for (name, content, triangles) in
        [("m.ply", PLY, 2), ("m.PLY", PLY, 2), ("mesh", PLY, 2), ("m.stl", STL, 1), ("m.gltf", GLTF, 2)]
    {
        let scene = good(&with(name, soot), &[(name, content)], &[]);
        let Shape::Mesh(mesh) = &scene.objects[1].shape else { panic!("{name}") };
        assert_eq!((scene.objects.len(), mesh.triangles.len()), (2, triangles), "{name}");
        assert_eq!(scene.objects[1].name, format!("objects.1 ({name})"));
    }
}

#[test]
fn units_of_a_mesh_in_comments_are_told() {
    let ply = PLY.replace("element vertex", "comment File units = millimeters\nelement vertex");
    for (more, told) in [("", 1), ("\ntransform = { scale = 0.001 }", 0)] {
        let scene = good(&with("m.ply", &format!("material = \"soot\"{more}")), &[("m.ply", &ply)], &[]);
        let warnings: Vec<&String> = scene.warnings.iter().filter(|w| w.contains("millimeters")).collect();
        assert_eq!(warnings.len(), told, "{warnings:?}");
        assert!(warnings.iter().all(|w| w.contains("taken as metres: give the object a `transform`")), "{warnings:?}");
    }
}

#[test]
fn nodes_and_materials_of_gltf() {
    let scene = good(&with("m.gltf", ""), &[("m.gltf", GLTF)], &[]);
    let names: Vec<&str> = scene.objects[1..].iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["objects.1 (m.gltf, material \"white\")", "objects.1 (m.gltf, material \"soot\")"]);
    let lid = good(&with("m.gltf", "node = \"lid\""), &[("m.gltf", GLTF)], &[]);
    let Shape::Mesh(mesh) = &lid.objects[1].shape else { panic!("a mesh") };
    assert_eq!((lid.objects.len(), mesh.positions[0]), (2, DVec3::new(0.0, 0.0, 5.0)));
}

#[test]
fn what_goes_with_one_format_only() {
    let soot = "material = \"soot\"";
    let marked = |mesh: &str, key: &str| with(mesh, &format!("{soot}\n{key} #!")).replacen(" #!", "", 1);
    let ply = [("m.ply", PLY)];
    check_wrong(&marked("m.ply", "node = \"a\""), &ply, "node", "objects.1.node", &["goes with glTF meshes only"]);
    check_wrong(&marked("m.ply", "group = \"a\""), &ply, "group", "objects.1.group", &["goes with OBJ meshes only"]);
    let gltf = [("m.gltf", GLTF)];
    check_wrong(&marked("m.gltf", "group = \"a\""), &gltf, "group", "objects.1.group", &["use `node`"]);
    let said = |text: &str, files: &[(&str, &str)]| super::parse_with(text, files, &[]).unwrap_err().to_string();
    let none = said(&with("m.gltf", "node = \"led\""), &gltf);
    assert!(none.contains("m.gltf has no node \"led\"; it has \"lid\""), "{none}");
    let bare = said(&with("m.ply", ""), &ply);
    assert!(bare.contains("the object has no `material`, and m.ply no material"), "{bare}");
    let textured = with("m.gltf", "material = \"white\"")
        .replace("#!", "")
        .replace("reflectance = \"grey\"", "reflectance = { texture = \"a.png\" }");
    let folder = super::folder(&gltf);
    std::fs::write(folder.path().join("a.png"), white()).expect("written");
    let said = spectile::scene::parse(&textured, &folder.path().join("scene.toml"), &[]).unwrap_err().to_string();
    let expected = "m.gltf: `objects.1.mesh`: material \"white\" is textured, but the triangles from `meshes[0].primitives[0]` on have no \
                    texture coordinates";
    assert!(said.contains(expected), "{said}");
}

/// A picture of one pixel.
fn white() -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&[255])).expect("a picture");
    bytes
}

fn read(path: &Path) -> Mesh {
    let bytes = mesh::content(path).unwrap_or_else(|problem| panic!("{problem}"));
    mesh::parse(Format::of(path, &bytes), &bytes, path).unwrap_or_else(|problem| panic!("{problem}"))
}

/// Triangles, area, and the box around them.
fn facts(mesh: &Mesh) -> (usize, f64, [DVec3; 2]) {
    let (mut count, mut area, mut bounds) = (0, 0.0, [DVec3::INFINITY, DVec3::NEG_INFINITY]);
    for part in &mesh.parts {
        for triangle in &part.triangles {
            let [a, b, c] = triangle.map(|i| DVec3::from_array(part.positions[i as usize]));
            area += 0.5 * (b - a).cross(c - a).length();
            bounds = [bounds[0].min(a).min(b).min(c), bounds[1].max(a).max(b).max(c)];
        }
        count += part.triangles.len();
    }
    (count, area, bounds)
}

fn imports(name: &str) -> Option<PathBuf> {
    let path = repository("../shared/import").join(name);
    if !path.exists() {
        excuse(&format!("there is no {}", path.display()));
        return None;
    }
    Some(path)
}

/// Of files by other people: what trimesh made of them (`truth.csv`, six digits).
#[test]
fn files_of_others_have_the_triangles_that_others_find() {
    let mut seen = 0;
    for folder in ["meshes", "gltf-box", "gltf-materials", "gltf-light-camera"] {
        let Some(folder) = imports(folder) else { return };
        let truth = std::fs::read_to_string(folder.join("truth.csv")).expect("a table");
        for row in truth.lines().skip(1) {
            let cells: Vec<&str> = row.split(',').map(|cell| cell.trim_matches('"')).collect();
            let numbers: Vec<f64> = cells[2..10].iter().filter_map(|cell| cell.parse().ok()).collect();
            let [triangles, area, bounds @ ..] = &numbers[..] else { continue };
            let path = folder.join(cells[0]);
            if *triangles == 0.0 {
                let bytes = mesh::content(&path).expect("a file");
                let said = mesh::parse(Format::of(&path, &bytes), &bytes, &path).unwrap_err();
                assert_eq!(said.message, "has no faces");
                continue;
            }
            let (count, found_area, found) = facts(&read(&path));
            // n-gons are cut otherwise there, so that bent ones have another area.
            let polygons = cells[0].contains("suzanne");
            let near = |a: f64, b: f64, size: f64| (a - b).abs() <= if polygons { 2e-3 } else { 1e-5 } * size;
            assert!(count == *triangles as usize && near(found_area, *area, *area), "{row}: {count} {found_area}");
            let corners = found[0].to_array().into_iter().chain(found[1].to_array());
            let size = (found[1] - found[0]).length();
            for (found, expected) in corners.zip(bounds) {
                assert!(near(found, *expected, size), "{row}: {found} {expected}");
            }
            seen += 1;
        }
    }
    assert!(seen >= 28, "{seen}");
    // What trimesh cannot read, by its text form.
    let Some(folder) = imports("meshes/ply") else { return };
    let shelf = facts(&read(&folder.join("platonic_shelf_ascii.ply")));
    for other in ["platonic_shelf.ply", "platonic_shelf_big_endian.ply"] {
        let found = facts(&read(&folder.join(other)));
        assert!(found.0 == shelf.0 && (found.1 - shelf.1).abs() < 1e-4, "{other}: {found:?} {shelf:?}");
    }
}

/// A million triangles in each format: how long they take is printed, and asserted nowhere.
#[test]
#[ignore = "a million triangles in every format, 20 s"]
fn a_million_triangles() {
    let side = 708usize;
    let points: Vec<[f32; 3]> =
        (0..side * side).map(|i| [(i % side) as f32, (i / side) as f32, ((i * 7919) % 97) as f32 * 0.01]).collect();
    let quads = (0..(side - 1) * (side - 1)).map(|i| i / (side - 1) * side + i % (side - 1));
    let triangles: Vec<[u32; 3]> = quads
        .flat_map(|a| [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]].map(|t| t.map(|i| i as u32)))
        .collect();
    let count = triangles.len();
    let folder = tempfile::tempdir().expect("a folder");
    let mut files: Vec<(&str, Vec<u8>)> = Vec::new();
    let rows = |prefix: &str| points.iter().map(|[x, y, z]| format!("{prefix}{x} {y} {z}\n")).collect::<String>();
    let faces = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).collect::<String>();
    files.push(("m.obj", (rows("v ") + &faces).into_bytes()));
    let head = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {count}\n\
             property list uchar int vertex_indices\nend_header\n",
            points.len()
        )
    };
    let faces = triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect::<String>();
    files.push(("ascii.ply", (head("ascii") + &rows("") + &faces).into_bytes()));
    let bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let of_face = |t: &[u32; 3]| [&[3u8][..], &t.map(u32::to_le_bytes).concat()].concat();
    let faces: Vec<u8> = triangles.iter().flat_map(of_face).collect();
    files.push(("m.ply", [head("binary_little_endian").as_bytes(), &bytes, &faces].concat()));
    let of_facet = |t: &[u32; 3]| {
        let corners = t.iter().flat_map(|i| points[*i as usize]).flat_map(f32::to_le_bytes);
        [0; 12].into_iter().chain(corners).chain([0; 2]).collect::<Vec<u8>>()
    };
    let facets: Vec<u8> = triangles.iter().flat_map(of_facet).collect();
    files.push(("m.stl", [&[b'x'; 80][..], &(count as u32).to_le_bytes(), &facets].concat()));
    let indices: Vec<u8> = triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    let gltf = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}},
        "indices": 1}}]}}], "accessors": [{{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": {}}},
        {{"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": {}}}], "bufferViews": [{{"buffer": 0, "byteLength": {}}},
        {{"buffer": 0, "byteOffset": {}, "byteLength": {}}}], "buffers": [{{"byteLength": {}, "uri": "m.bin"}}]}}"#,
        points.len(),
        3 * count,
        bytes.len(),
        bytes.len(),
        indices.len(),
        bytes.len() + indices.len()
    );
    std::fs::write(folder.path().join("m.bin"), [bytes, indices].concat()).expect("written");
    files.push(("m.gltf", gltf.into_bytes()));
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("written");
        let began = std::time::Instant::now();
        let mesh = read(&path);
        println!("{name}: {count} triangles in {:.2} s", began.elapsed().as_secs_f64());
        assert_eq!(facts(&mesh).0, count);
    }
}
