//! PLY files as they are written.

use super::*;

fn ply(bytes: &[u8]) -> Result<Mesh, Box<Problem>> {
    parse(bytes, Path::new("m.ply"))
}

/// A quad with normals and a triangle, faces first, with what does not matter between.
const TEXT: &str = "ply\nformat ascii 1.0\ncomment made up\nelement face 3\nproperty uchar flags\nproperty list uchar int vertex_indices\n\
    element vertex 5\nproperty float x\nproperty float y\nproperty uchar red\nproperty float z\nproperty float nx\nproperty float ny\n\
    property float nz\nproperty float s\nproperty float t\nproperty list uchar short near\nelement edge 1\nproperty int vertex1\n\
    end_header\n7 4 0 1 2 3\n\n7 3 0 1 4\n7 2 1 2\n0 0 9 0. 0 0 1 0 0 2 1 2\n2 0 9 .5 0 0 2 1 0 0\n2 2 9 1 0 0 1 1 1 0\n0 2 9 .5 0 0 1 0 1 1 5\n\
    1 1 9 2e0 1 0 0 .25 -1 0\n0\n";

const HEAD: &str = "ply\nformat ENDIAN 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty short z\nelement extra 2\n\
    property list ushort double a\nelement face 2\nproperty list uchar ushort vertex_index\nproperty list uchar float texcoord\nend_header\n";

/// Two triangles of a square, the second with texture coordinates.
fn binary(big: bool) -> Vec<u8> {
    let mut bytes = HEAD.replace("ENDIAN", if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
    let mut put = |little: &[u8]| {
        let mut value = little.to_vec();
        if big {
            value.reverse();
        }
        bytes.extend(value);
    };
    for (x, y) in [(0.0f64, 0.0f32), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        put(&x.to_le_bytes());
        put(&y.to_le_bytes());
        put(&i16::to_le_bytes(-3));
    }
    put(&[0, 0]);
    put(&u16::to_le_bytes(1));
    put(&f64::to_le_bytes(9.0));
    for (corners, uv) in [([0u16, 1, 2], vec![]), ([2, 3, 0], vec![1.0f32, 1.0, 0.0, 1.0, 0.0, 0.0])] {
        put(&[3]);
        corners.iter().for_each(|corner| put(&corner.to_le_bytes()));
        put(&[uv.len() as u8]);
        uv.iter().for_each(|x| put(&x.to_le_bytes()));
    }
    bytes
}

#[test]
fn text_in_any_order_of_elements() {
    for text in [TEXT.to_owned(), TEXT.replace('\n', "\r\n"), TEXT.replace('\n', "\r")] {
        let mesh = ply(text.as_bytes()).unwrap();
        assert_eq!(mesh.parts.len(), 1);
        let part = &mesh.parts[0];
        let expected = [[0., 0., 0.], [2., 0., 0.5], [2., 2., 1.], [0., 2., 0.5], [1., 1., 2.]];
        assert_eq!(part.positions, expected);
        assert_eq!(part.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 4]]);
        let normals = part.normals.as_ref().unwrap();
        assert_eq!(normals[2], [[0., 0., 1.], [0., 0., 2.], [1., 0., 0.]]);
        assert_eq!(part.uv.as_ref().unwrap()[2], [[0., 0.], [1., 0.], [0.25, -1.]]);
        assert_eq!((mesh.without_surface, part.place.clone()), (2, Place::Line(21)));
        assert_eq!((mesh.flaws, mesh.notes), (Flaws::default(), vec![]));
    }
}

#[test]
fn both_orders_of_bytes() {
    for big in [false, true] {
        let mesh = ply(&binary(big)).unwrap();
        let [bare, textured] = &mesh.parts[..] else { panic!("{} parts", mesh.parts.len()) };
        assert_eq!(bare.positions, [[0., 0., -3.], [1., 0., -3.], [1., 1., -3.], [0., 1., -3.]]);
        assert_eq!((&bare.triangles[..], &bare.uv), (&[[0, 1, 2]][..], &None));
        assert_eq!(textured.triangles, [[2, 3, 0]]);
        assert_eq!(textured.uv.as_deref(), Some(&[[[1., 1.], [0., 1.], [0., 0.]]][..]));
        assert_eq!(textured.place, Place::Face(1));
        assert_eq!(mesh.notes, ["elements \"extra\" are left out"]);
    }
}

#[test]
fn mistakes_have_a_line_or_a_byte() {
    let wrong = |from: &str, to: &str| {
        assert!(TEXT.contains(from), "{from}");
        ply(TEXT.replacen(from, to, 1).as_bytes()).unwrap_err().to_string()
    };
    for (from, to, expected) in [
        ("ply\n", "plyy\n", "m.ply:1: is no PLY file: its first line is not `ply`"),
        ("ascii", "ascij", "m.ply:2: the format `ascij` is unknown"),
        ("format ascii 1.0\n", "", "m.ply:19: the header has no format"),
        ("element vertex 5", "element vertex -5", "m.ply:7: `-5` is no number of elements"),
        ("property float nz\n", "", "m.ply:7: normals need all of nx, ny and nz"),
        ("property float z\n", "", "m.ply:7: vertices need properties x, y and z"),
        ("vertex_indices", "corners", "m.ply:4: faces need a list `vertex_indices` or `vertex_index`"),
        ("list uchar int", "list float int", "m.ply:6: the length of a list is a whole number"),
        ("property uchar red", "property byte red", "m.ply:10: the type of `red` is unknown"),
        ("element edge 1", "element vertex 1", "m.ply:18: there is a second element \"vertex\""),
        ("element edge 1", "elements edge 1", "m.ply:18: `elements` is no statement of a PLY header"),
        ("7 3 0 1 4", "7 3 0 1 5", "m.ply:23: face 1 names vertex 5, but the file has 5 vertices, counted from 0"),
        ("7 3 0 1 4", "7 3 0 -1 4", "m.ply:23: a face names a vertex by something that is no index"),
        ("7 3 0 1 4", "7 3 0 1", "m.ply:23: has fewer numbers than the header says"),
        ("7 3 0 1 4", "7 3 0 1 4 2", "m.ply:23: has more numbers than the header says"),
        ("2 0 9 .5", "2 0 9 x", "m.ply:26: `x` is not a number"),
        ("2 0 9 .5", "2 0 9 nan", "m.ply:26: a vertex, normal or texture coordinate is not finite"),
        ("vertex1\nend_header\n", "vertex1\n", "m.ply:20: `7` is no statement of a PLY header"),
        (
            "element vertex 5",
            "element vertex 99999999999999",
            "m.ply:7: there are to be 99999999999999 elements \"vertex\", but the file ends before",
        ),
    ] {
        assert_eq!(wrong(from, to), expected);
    }
    let mut short = binary(true);
    short.truncate(short.len() - 2);
    let at = short.len() - 2;
    let expected = format!("m.ply: at byte {at}: the file ends before all elements that its header tells of");
    assert_eq!(ply(&short).unwrap_err().to_string(), expected);
    let none = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
    assert_eq!(ply(none.as_bytes()).unwrap_err().to_string(), "m.ply: has no faces");
    let endless = "ply\nformat binary_little_endian 1.0\nelement x 99999999999999\nend_header\n";
    assert_eq!(ply(endless.as_bytes()).unwrap_err().to_string(), "m.ply: has no faces");
}
