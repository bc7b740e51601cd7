//! glTF files as they are written.

use base64::Engine;
use glam::DVec3;

use super::*;
use crate::format::mesh::{Mesh, Part, Place};

/// A file with `nodes`, `primitives` of one mesh, `accessors`, and `views` of one buffer of `bytes`.
fn text(nodes: &str, primitives: &str, accessors: &str, views: &str, bytes: &[u8]) -> String {
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{nodes}], "meshes": [{{"primitives": [{primitives}]}}],
        "materials": [{{"name": "red"}}, {{}}], "accessors": [{accessors}], "bufferViews": [{views}],
        "buffers": [{{"byteLength": {}, "uri": "data:application/octet-stream;base64,{data}"}}]}}"#,
        bytes.len()
    )
}

fn read(text: &str) -> Result<Mesh, String> {
    let file = parse(text.as_bytes(), Path::new("m.gltf")).map_err(|problem| problem.to_string())?;
    file.mesh(None).map_err(|message| file.problem(message).to_string())
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn normal_of(part: &Part, triangle: usize) -> DVec3 {
    let [a, b, c] = part.triangles[triangle].map(|i| DVec3::from_array(part.positions[i as usize]));
    (b - a).cross(c - a)
}

const ACCESSOR: &str = r#"{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4}"#;
const VIEW: &str = r#"{"buffer": 0, "byteLength": 48}"#;
const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];
const STRIP: &str = r#"{"attributes": {"POSITION": 0}, "mode": 5}"#;

fn square(nodes: &str, primitives: &str) -> String {
    text(nodes, primitives, ACCESSOR, VIEW, &floats(&SQUARE))
}

#[test]
fn transforms_of_nodes_are_chained() {
    // Turned by 90 degrees about z and moved, within twice the size.
    let nodes = r#"{"scale": [2, 2, 2], "children": [1]}, {"mesh": 0, "name": "a",
        "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476], "translation": [1, 0, 0]}"#;
    let mesh = read(&square(nodes, STRIP)).unwrap();
    let part = &mesh.parts[0];
    let expected = [[2., 0., 0.], [2., 2., 0.], [0., 0., 0.], [0., 2., 0.]];
    for (found, expected) in part.positions.iter().flatten().zip(expected.iter().flatten()) {
        // Quaternions have the 24 bits of f32.
        assert!((found - expected).abs() < 1e-6, "{part:?}");
    }
    assert_eq!((part.triangles.len(), part.labels.object.as_deref()), (2, Some("a")));
    assert_eq!(part.place, Place::Json("meshes[0].primitives[0]".to_owned()));
    assert!((0..2).all(|i| normal_of(part, i).z > 3.9));
    // At places around the node: of what the accessor has, the square's corners.
    let nodes = r#"{"mesh": 0, "translation": [0, 0, 7], "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}}"#;
    let mesh = read(&square(nodes, STRIP)).unwrap();
    let first: Vec<[f64; 3]> = mesh.parts.iter().map(|part| part.positions[0]).collect();
    assert_eq!(first, [[0., 0., 7.], [1., 0., 7.], [0., 1., 7.], [1., 1., 7.]]);
    // By columns, mirrored: fronts stay fronts.
    let matrix = r#"{"mesh": 0, "matrix": [-1, 0, 0, 0,  0, 1, 0, 0,  0, 0, 1, 0,  5, 6, 7, 1]}"#;
    let mesh = read(&square(matrix, STRIP)).unwrap();
    assert_eq!(mesh.parts[0].positions[1], [4., 6., 7.]);
    assert!((0..2).all(|i| normal_of(&mesh.parts[0], i) == DVec3::Z));
    let both = matrix.replace("\"mesh\": 0", "\"mesh\": 0, \"scale\": [2, 2, 2]");
    assert!(read(&square(&both, STRIP)).unwrap_err().to_string().contains("`nodes[0]` has a matrix and a"));
}

#[test]
fn every_mode_that_has_triangles() {
    let indices = r#"{"bufferView": 1, "componentType": 5121, "type": "SCALAR", "count": 4}"#;
    let views = format!(r#"{VIEW}, {{"buffer": 0, "byteOffset": 48, "byteLength": 4}}"#);
    let bytes = [floats(&SQUARE), vec![0, 1, 3, 2]].concat();
    let with = |mode: u32, indices_of: &str| {
        let primitive = format!(r#"{{"attributes": {{"POSITION": 0}}, "mode": {mode}{indices_of}}}"#);
        read(&text(r#"{"mesh": 0}"#, &primitive, &format!("{ACCESSOR}, {indices}"), &views, &bytes))
    };
    let fan = with(6, r#", "indices": 1"#).unwrap();
    assert!((0..2).all(|i| normal_of(&fan.parts[0], i) == DVec3::Z) && fan.parts[0].triangles.len() == 2);
    let strip = with(5, "").unwrap();
    assert!((0..2).all(|i| normal_of(&strip.parts[0], i) == DVec3::Z));
    assert!(with(4, "").unwrap_err().contains("has 4 corners, which make no whole number of triangles"));
    assert_eq!(with(1, "").unwrap_err(), "m.gltf: has no triangles");
    assert!(with(7, "").unwrap_err().contains("`meshes[0].primitives[0].mode` is unknown"));
}

/// Positions in 16 bits, normals in 8 of them a stride apart, texture coordinates in 8.
#[test]
fn numbers_of_every_type() {
    let accessors = r#"{"bufferView": 0, "componentType": 5122, "type": "VEC3", "count": 3},
        {"bufferView": 1, "componentType": 5120, "normalized": true, "type": "VEC3", "count": 3},
        {"bufferView": 1, "byteOffset": 3, "componentType": 5121, "normalized": true, "type": "VEC2", "count": 3}"#;
    let views =
        r#"{"buffer": 0, "byteLength": 18}, {"buffer": 0, "byteOffset": 18, "byteLength": 15, "byteStride": 5}"#;
    let mut bytes: Vec<u8> = [-300i16, 0, 0, 700, 0, 0, 0, 500, 2].iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u8, 0, 127, 0, 255, 0, 0, 0x80, 255, 51, 0, 127, 0, 102, 0]);
    let primitive = r#"{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "material": 1}"#;
    let mesh = read(&text(r#"{"mesh": 0}"#, primitive, accessors, views, &bytes)).unwrap();
    let part = &mesh.parts[0];
    assert_eq!(part.positions, [[-300., 0., 0.], [700., 0., 0.], [0., 500., 2.]]);
    assert_eq!(part.normals.as_ref().unwrap()[0], [[0., 0., 1.], [0., 0., -1.], [0., 1., 0.]]);
    // v from above.
    assert_eq!(part.uv.as_ref().unwrap()[0], [[0., 0.], [1., 0.8], [0.4, 1.]]);
    assert_eq!(part.labels.material.as_deref(), Some("material 1"));
}

#[test]
fn sparse_elements_replace_others() {
    let sparse = r#""sparse": {"count": 2, "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 2}}}"#;
    let views = format!(
        r#"{VIEW}, {{"buffer": 0, "byteOffset": 48, "byteLength": 4}}, {{"buffer": 0, "byteOffset": 52, "byteLength": 24}}"#
    );
    let bytes = [floats(&SQUARE), vec![1, 0, 3, 0], floats(&[9., 0., 0., 9., 9., 0.])].concat();
    let with = |base: &str| {
        let accessor = format!(r#"{{{base}"componentType": 5126, "type": "VEC3", "count": 4, {sparse}"#);
        read(&text(r#"{"mesh": 0}"#, STRIP, &accessor, &views, &bytes)).unwrap().parts[0].positions.clone()
    };
    assert_eq!(with(r#""bufferView": 0, "#), [[0., 0., 0.], [9., 0., 0.], [0., 1., 0.], [9., 9., 0.]]);
    assert_eq!(with(""), [[0., 0., 0.], [9., 0., 0.], [0., 0., 0.], [9., 9., 0.]]);
}

#[test]
fn a_node_is_picked_by_its_name() {
    let nodes = r#"{"name": "a", "mesh": 0, "children": [1]}, {"name": "b", "mesh": 0, "translation": [0, 0, 5]},
        {"name": "c", "mesh": 0}, {"name": "c", "mesh": 0}, {"name": "empty"}"#;
    let file = parse(square(nodes, STRIP).as_bytes(), Path::new("m.gltf")).unwrap();
    let names = |node| -> Result<Vec<String>, String> {
        Ok(file.mesh(node)?.parts.iter().map(|part| part.labels.object.clone().unwrap()).collect())
    };
    assert_eq!(names(None).unwrap(), ["a", "b", "c", "c"]);
    assert_eq!(names(Some("a")).unwrap(), ["a", "b"]);
    assert_eq!(names(Some("b")).unwrap(), ["b"]);
    assert_eq!(file.mesh(Some("b")).unwrap().parts[0].positions[0], [0., 0., 5.]);
    assert_eq!(names(Some("c")).unwrap_err(), "has 2 nodes named \"c\"");
    assert_eq!(names(Some("d")).unwrap_err(), "has no node \"d\"; it has \"a\", \"b\", \"c\", \"empty\"");
    assert_eq!(names(Some("empty")).unwrap_err(), "has no triangles on the node \"empty\"");
}

#[test]
fn mistakes_have_a_path() {
    let node = r#"{"mesh": 0}"#;
    let good = square(node, STRIP);
    for (from, to, expected) in [
        (
            r#""count": 4"#,
            r#""count": 5"#,
            "`accessors[0]` needs 5 elements of 12 bytes, more than `bufferViews[0]` has",
        ),
        (r#""count": 4"#, r#""count": 18446744073709551615"#, "more than `bufferViews[0]` has"),
        (
            r#""bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4"#,
            r#""componentType": 5126, "type": "VEC3", "count": 99999999"#,
            "`accessors[0]` has 99999999 elements, but no `bufferView` to hold them",
        ),
        (
            r#"0, "byteLength": 48"#,
            r#"0, "byteLength": 49"#,
            "`bufferViews[0]` is 49 bytes from 0 on of `buffers[0]`, which has 48",
        ),
        (r#""buffer": 0"#, r#""buffer": 3"#, "`bufferViews[0]` names buffer 3, which does not exist"),
        (
            r#""POSITION": 0"#,
            r#""POSITION": 7"#,
            "`meshes[0].primitives[0].attributes.POSITION` names accessor 7, which does not exist",
        ),
        (r#""POSITION": 0"#, r#""NORMAL": 0"#, "`meshes[0].primitives[0]` has no POSITION"),
        (
            r#""VEC3""#,
            r#""VEC2""#,
            "`accessors[0].type` must have 3 components here (meshes[0].primitives[0].attributes.POSITION)",
        ),
        (r#""componentType": 5126"#, r#""componentType": 5124"#, "`accessors[0].componentType` is unknown"),
        (r#"{"mesh": 0}"#, r#"{"mesh": 1}"#, "`nodes[0].mesh` names mesh 1, which does not exist"),
        (r#"{"mesh": 0}"#, r#"{"mesh": 0, "children": [0]}"#, "has no triangles"),
        (
            r#"{"mesh": 0}"#,
            r#"{"children": [1, 1]}, {"mesh": 0}"#,
            "`nodes[1]` hangs on more than one node: nodes must be trees",
        ),
        (r#"{"mesh": 0}"#, r#"{"mesh": 0, "skin": 0}"#, "`nodes[0]` has a skin, which is not supported"),
        (r#"{"mesh": 0}"#, r#"{"mesh": 0, "weights": [0, 0.5]}"#, "`nodes[0]` is morphed"),
        (r#"{"mesh": 0}"#, r#"{"mesh": 0, "rotation": [0, 0, 0, 0]}"#, "`nodes[0].rotation` is no rotation"),
        (r#""mode": 5"#, r#""mode": 5, "material": 9"#, "`meshes[0].primitives[0].material` names material 9"),
        (r#""2.0""#, r#""1.0""#, "is glTF of version 1.0: only 2 is supported"),
        (r#""2.0""#, r#""2.1", "minVersion": "2.1""#, "asks for readers of glTF 2.1: only 2.0 is supported"),
        (
            r#""nodes""#,
            r#""extensionsRequired": ["EXT_meshopt_compression"], "nodes""#,
            "requires the extension EXT_meshopt_compression",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}}"#,
            "`nodes[0]` is hidden by KHR_node_visibility",
        ),
        ("data:application/octet-stream;base64,", "../", "only files in the folder of this one are read"),
        ("data:application/octet-stream;base64,", "/etc/", "only files in the folder of this one are read"),
        ("base64,A", "base64,*", "`buffers[0].uri` is no base64"),
    ] {
        assert!(good.contains(from), "{from}");
        let said = read(&good.replacen(from, to, 1)).unwrap_err();
        assert!(said.contains(expected) && !said.contains('\n'), "{from} {to}: {said}");
    }
    let said = read("{\n \"asset\": 3}").unwrap_err();
    assert!(said.starts_with("m.gltf:2:11: is not glTF: invalid type"), "{said}");
}

#[test]
fn binary_files_have_chunks() {
    let json = square(r#"{"mesh": 0}"#, STRIP);
    let mut json = json.split(", \"uri\"").next().unwrap().to_owned() + "}]}";
    json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
    let data = floats(&SQUARE);
    let all = 12 + 8 + json.len() + 8 + data.len();
    let mut bytes = b"glTF".to_vec();
    for word in [2, all as u32, json.len() as u32] {
        bytes.extend(u32::to_le_bytes(word));
    }
    bytes.extend([b"JSON", json.as_bytes(), &48u32.to_le_bytes(), b"BIN\0", &data].concat());
    let mesh = |bytes: &[u8]| parse(bytes, Path::new("m.glb")).map(|file| file.mesh(None).unwrap());
    assert_eq!(mesh(&bytes).unwrap().parts[0].triangles, [[0, 1, 2], [1, 3, 2]]);
    for (change, expected) in [
        (bytes[..bytes.len() - 1].to_vec(), "is cut off"),
        (bytes[..7].to_vec(), "ends within its header"),
        ([&bytes[..4], &[1, 0, 0, 0], &bytes[8..]].concat(), "version 1"),
        ([&bytes[..12], &[255, 255, 0, 0], &bytes[16..]].concat(), "the chunk at byte 12 should have 65535 bytes"),
    ] {
        let said = mesh(&change).unwrap_err().to_string();
        assert!(said.contains(expected), "{said}");
    }
}
