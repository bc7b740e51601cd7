//! OBJ files as they are written.

use super::*;

fn obj(text: &str) -> Result<Mesh, Box<Problem>> {
    parse(text.as_bytes(), Path::new("m.obj"))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn convex_polygons_become_fans() {
    let mesh = obj(&format!("{SQUARE}f 1/1/1 2//1 3/2 -1 # four\n")).unwrap();
    assert_eq!(mesh.parts.len(), 1);
    assert_eq!(mesh.parts[0].positions, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
    assert_eq!(mesh.parts[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.parts[0].labels, Labels::default());
    let pentagon = obj("v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 2 0\nv -1 1 0\nf 1 2 3 4 5").unwrap();
    assert_eq!(pentagon.parts[0].triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
}

fn area(mesh: &Mesh) -> f64 {
    let of = |part: &Part| -> f64 {
        let at = |i: u32| glam::DVec3::from_array(part.positions[i as usize]);
        part.triangles.iter().map(|t| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).z).sum()
    };
    mesh.parts.iter().map(of).sum()
}

/// Signed areas sum to that of the outline however it is cut, so all triangles must face the same way too.
#[test]
fn other_polygons_cover_their_outline_and_no_more() {
    for (text, expected) in [
        ("v -1 -1 0\nv 0 0 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3 4\n", 1.0),
        ("v -1 -1 0\nv 1 -1 0\nv 1 0 0\nv 0 0 0\nv 0 1 0\nv -1 1 0\nf 2 3 4 5 6 1\n", 3.0),
        // A square with a square hole, cut open by a bridge.
        ("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n", 12.0),
    ] {
        let mesh = obj(text).unwrap();
        assert!((area(&mesh) - expected).abs() < 1e-12, "{text}: {}", area(&mesh));
        let part = &mesh.parts[0];
        let single =
            |t: &[u32; 3]| area(&Mesh { parts: vec![Part { triangles: vec![*t], ..part.clone() }], ..mesh.clone() });
        assert!(part.triangles.iter().all(|t| single(t) > 0.0), "{text}: {:?}", part.triangles);
        assert_eq!(mesh.flaws, Flaws::default(), "{text}");
    }
    let bent = obj("v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\n\nf 1 2 3 4\n").unwrap();
    assert_eq!(bent.flaws, Flaws { bent: Some((1, Place::Line(6))), crossing: None });
    let crossing = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 4\n").unwrap();
    assert_eq!(crossing.flaws.crossing, Some((1, Place::Line(5))));
}

#[test]
fn parts_carry_object_group_and_material() {
    let text = format!(
        "mtllib missing.mtl\no house\n{SQUARE}vn 0 0 1\nusemtl brick wall\nf 1 2 3\nf 1 3 4\ng roof left\nf 1 2 4\nusemtl tile\ng\nf 2 3 4\n"
    );
    let mesh = obj(&text).unwrap();
    let found: Vec<_> = mesh
        .parts
        .iter()
        .map(|p| {
            (
                p.labels.object.as_deref(),
                p.labels.group.as_deref(),
                p.labels.material.as_deref(),
                p.place.line().unwrap_or(0),
                p.triangles.len(),
            )
        })
        .collect();
    assert_eq!(
        found,
        [
            (Some("house"), None, Some("brick wall"), 9, 2),
            (Some("house"), Some("roof left"), Some("brick wall"), 12, 1),
            (Some("house"), None, Some("tile"), 15, 1),
        ]
    );
    let roof = &mesh.parts[1].labels;
    assert!(roof.in_group("house") && roof.in_group("roof") && roof.in_group("left") && roof.in_group("roof left"));
    assert!(!roof.in_group("brick wall") && !mesh.parts[0].labels.in_group("roof"));
}

#[test]
fn vertices_keep_their_f64_bits_and_extras_are_understood() {
    let mesh = obj("v 0.1 1e-9 1234567.1234567\nv 2 4 6 2\nv 1 1 1 0.5 0.5 0.5\nf 1 \\\n 2 3\nl 1 2\n").unwrap();
    assert_eq!(mesh.parts[0].positions, [[0.1, 1e-9, 1234567.1234567], [1., 2., 3.], [1., 1., 1.]]);
    assert_eq!(mesh.without_surface, 1);
}

/// Seams give a vertex several coordinates; faces that lack some are parts of their own.
#[test]
fn normals_and_texture_coordinates_stand_at_corners() {
    let text = format!(
        "{SQUARE}vt 0 0\nvt 1 0 0.5\nvt 0.25\nvn 0 0 1\nvn 0 0 -2\nf 1/1/1 2/2/2 3/3/1\nf 1/-3/-1 3/1/1 4/2/1\n\
         f 1//1 2//1 3//2\nf 1/1 2/2 4/3\nf 1/1/1 2/2 3/3/1 4/1/2\n"
    );
    let mesh = obj(&text).unwrap();
    let given = |p: &Part| (p.place.line().unwrap_or(0), p.triangles.len(), p.uv.is_some(), p.normals.is_some());
    let given: Vec<_> = mesh.parts.iter().map(given).collect();
    assert_eq!(given, [(10, 2, true, true), (12, 1, false, true), (13, 3, true, false)]);
    let whole = &mesh.parts[0];
    let uv = [[[0., 0.], [1., 0.], [0.25, 0.]], [[0., 0.], [0., 0.], [1., 0.]]];
    assert_eq!(whole.uv.as_deref(), Some(&uv[..]));
    let (up, down) = ([0., 0., 1.], [0., 0., -2.]);
    assert_eq!(whole.normals.as_deref(), Some(&[[up, down, up], [down, up, up]][..]));
    assert_eq!(mesh.parts[1].normals.as_deref(), Some(&[[up, up, down]][..]));
}

#[test]
fn mistakes_name_their_line() {
    for (text, line, words) in [
        ("", None, "no faces"),
        ("v 0 0 0\n", None, "no faces"),
        ("v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3", Some(2), "three numbers"),
        ("v 0 0 0\nv 1 0 x\nv 0 1 0\nf 1 2 3", Some(2), "three numbers"),
        ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3", Some(2), "not finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3", Some(3), "not finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\nf 1 2 3", Some(5), "vertex 4 does not exist"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 2 3", Some(4), "vertex 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 2 3", Some(4), "vertex -4"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2", Some(4), "at least 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf", Some(4), "at least 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 c", Some(4), "whole numbers"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 /3", Some(4), "names no vertex"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/2", Some(5), "texture coordinate 2 does not exist"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//1 3//1", Some(4), "normal 1 does not exist: the file has 0 normals"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 1\nf 1 2 3", Some(4), "a normal needs three"),
        ("v 0 0 0\nvt x 0\n", Some(2), "one to three numbers"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan 1 0\nf 1//1 2//1 3//1", Some(4), "not finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/c 3/1", Some(5), "whole numbers"),
        ("v 0 0 0\nusemtl\n", Some(2), "needs a name"),
        ("surf 0 1 0 1 1 2\n", Some(1), "free-form"),
        ("PK\u{3}\u{4}binary", Some(1), "not an OBJ statement"),
    ] {
        let problem = obj(text).unwrap_err();
        assert_eq!(problem.line, line, "{text:?}: {problem}");
        assert!(problem.message.contains(words), "{text:?}: {problem}");
    }
}
