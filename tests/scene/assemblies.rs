//! `[assemblies]` and `[[instances]]`: what is placed where, and what is refused.

use glam::{DAffine3, DVec3};
use spectile::scene::{Scene, Shape};

use super::wrong::check_wrong;
use super::{BASE, good};

const TREE: &str = r#"
[[assemblies.tree.objects]]
mesh = "tri.obj"
material = "white"
transform = { translate = [0, 0, 1] }

[[assemblies.tree.objects]]
quad = { corner = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 1, 0] }
material = "soot"
"#;

fn with(instances: &str) -> String {
    format!("{BASE}{TREE}{instances}")
}

/// The places of the only assembly.
fn places(scene: &Scene) -> &[DAffine3] {
    let [assembly] = &scene.assemblies[..] else { panic!("{} assemblies", scene.assemblies.len()) };
    &assembly.instances
}

#[track_caller]
fn assert_close(a: DVec3, b: DVec3) {
    assert!(a.distance(b) < 1e-12, "{a} is not {b}");
}

#[test]
fn one_place() {
    let instance = "[[instances]]\nassembly = \"tree\"\ntransform = { scale = 2, translate = [1, 2, 3] }";
    let scene = good(&with(instance), &[], &[]);
    assert_eq!(scene.objects.iter().map(|object| object.assembly).collect::<Vec<_>>(), [None, None, Some(0), Some(0)]);
    assert_eq!(scene.objects[2].name, "assemblies.tree.objects.0 (tri.obj)");
    let Shape::Mesh(mesh) = &scene.objects[2].shape else { panic!("a mesh") };
    assert_eq!(mesh.positions[1], DVec3::new(1.0, 0.0, 1.0), "in the assembly's own space");
    assert_close(places(&scene)[0].transform_point3(mesh.positions[1]), DVec3::new(3.0, 2.0, 5.0));
    let copies = scene.copied();
    let Shape::Mesh(mesh) = &copies.objects[2].shape else { panic!("a mesh") };
    assert_close(mesh.positions[1], DVec3::new(3.0, 2.0, 5.0));
    assert!(copies.assemblies.is_empty() && copies.objects.iter().all(|object| object.assembly.is_none()));
}

#[test]
fn placements_are_scaled_turned_and_moved() {
    let instance = "[[instances]]\nassembly = \"tree\"\nplacements = \"trees.csv\"\n";
    let at = |scene: &Scene, i: usize| places(scene)[i].transform_point3(DVec3::new(1.0, 0.0, 0.0));
    let scene = good(&with(instance), &[("trees.csv", "x,y,z\n1,2,3\n-4,5,6e1\n")], &[]);
    assert_eq!(places(&scene).len(), 2);
    assert_close(at(&scene, 1), DVec3::new(-3.0, 5.0, 60.0));
    // Counter-clockwise about +y: +x goes to -z. Columns in any order, with the unit of all lengths.
    let scene = good(&with(instance), &[("trees.csv", "scale;x [m];z [m];y [m];yaw_degrees\n2;0;0;0;90\n")], &[]);
    assert_close(at(&scene, 0), DVec3::new(0.0, 0.0, -2.0));
    let up = format!("{instance}up = [0, 0, 1]\ntransform = {{ translate = [10, 0, 0], scale = 3 }}");
    let scene = good(&with(&up), &[("trees.csv", "x,y,z,yaw_degrees\n1,0,0,90\n")], &[]);
    assert_close(at(&scene, 0), DVec3::new(13.0, 3.0, 0.0));
    let rows = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n0,-1,0,5,2,0,0,6,0,0,1,7\n";
    let scene = good(&with(instance), &[("trees.csv", rows)], &[]);
    assert_close(at(&scene, 0), DVec3::new(5.0, 8.0, 7.0));
}

/// What is mirrored is an assembly of its own, whose fronts stay fronts.
#[test]
fn mirrored_places() {
    let both =
        "[[instances]]\nassembly = \"tree\"\n[[instances]]\nassembly = \"tree\"\ntransform = { scale = [1, 1, -2] }";
    let scene = good(&with(both), &[], &[]);
    assert_eq!(scene.assemblies.iter().map(|a| a.name.as_str()).collect::<Vec<_>>(), ["tree", "tree, mirrored"]);
    assert!(scene.assemblies.iter().flat_map(|a| &a.instances).all(|m| m.matrix3.determinant() > 0.0));
    let corners = |object: usize, place: &DAffine3| {
        let Shape::Mesh(mesh) = &scene.objects[object].shape else { panic!("a mesh") };
        mesh.triangles[0].map(|i| place.transform_point3(mesh.positions[i as usize]))
    };
    let [a, b, c] = corners(4, &scene.assemblies[1].instances[0]);
    let mut places: Vec<DVec3> = vec![a, b, c];
    places.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    for (found, wanted) in places.into_iter().zip([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]) {
        assert_close(found, DVec3::new(wanted[0], wanted[1], -2.0));
    }
    // As of an object that is mirrored: the image of the front is the front.
    assert!((b - a).cross(c - a).z < 0.0);
    let alone = both.replacen("[[instances]]\nassembly = \"tree\"\n", "", 1);
    assert_eq!(good(&with(&alone), &[], &[]).objects.len(), 4);
}

#[test]
fn what_is_placed_nowhere_is_left_out() {
    let scene = good(&with(""), &[], &[]);
    assert_eq!((scene.objects.len(), scene.assemblies.len()), (2, 0));
    assert!(scene.warnings.iter().any(|w| w.contains("assemblies.tree is placed nowhere")), "{:?}", scene.warnings);
    assert_eq!(scene.digest, good(BASE, &[], &[]).digest);
    assert_ne!(scene.digest, good(&with("[[instances]]\nassembly = \"tree\""), &[], &[]).digest);
}

/// Matter in what is placed is there with each instance, and fills it as it fills its copies.
#[test]
fn interiors_are_placed_too() {
    let drop = "[[assemblies.tree.objects]]\nsphere = { center = [1, 0, 0], radius = 1 }\ninterior = \"water\"\n\
        [media.water]\nabsorption = 0.5\n[[instances]]\nassembly = \"tree\"\ntransform = { scale = 2, translate = [0, 3, 0] }\n";
    let scene = good(&with(drop), &[], &[]);
    let own = scene.objects.last().unwrap();
    assert_eq!((own.assembly, own.material, own.interior.unwrap().medium), (Some(0), None, 0));
    let copies = scene.copied();
    let copy = copies.objects.last().unwrap();
    assert_ne!(copy.interior.unwrap().body, own.interior.unwrap().body);
    // The box of the placed ball is the unit cube.
    for (world, grid) in
        [(DVec3::new(0.0, 1.0, -2.0), DVec3::ZERO), (DVec3::new(4.0, 5.0, 0.0), DVec3::new(1.0, 1.0, 0.5))]
    {
        assert_close(copy.interior.unwrap().to_grid.transform_point3(world), grid);
    }
}

#[test]
fn what_is_refused() {
    let check = |instance: &str, files: &[(&str, &str)], key: &str, words: &[&str]| {
        check_wrong(&with(&format!("[[instances]]\n{instance}")), files, instance, key, words);
    };
    check("assembly = \"tre\" #!", &[], "instances.0.assembly", &["no assembly is named", "did you mean `tree`?"]);
    check("assembly = \"tree\"\nup = [0, 0, 1] #!", &[], "instances.0.up", &["goes with `placements` only"]);
    check("assembly = \"tree\"\ntransform = { scale = 0 } #!", &[], "instances.0.transform", &["flattens space"]);
    check("assembly = \"tree\"\ntransform = { translate = [2e15, 0, 0] } #!", &[], "instances.0.transform", &["1e15"]);
    check("assembly = \"tree\"\nplacements = \"none.csv\" #!", &[], "instances.0.placements", &["cannot be read"]);
    let of_file = |text: &str, words: &[&str]| {
        let scene = with("[[instances]]\nassembly = \"tree\"\nplacements = \"trees.csv\"");
        let Err(error) = super::parse_with(&scene, &[("trees.csv", text)], &[]) else { panic!("{text}: accepted") };
        let message = error.to_string();
        assert_eq!(error.exit_code(), 2);
        for word in words.iter().chain(&["trees.csv"]) {
            assert!(message.contains(word), "no {word:?} in: {message}");
        }
    };
    of_file("1,2,3\n", &["names no columns", "x,y,z"]);
    of_file("x,y\n1,2\n", &["no column z"]);
    of_file("x,y,z,pitch\n1,2,3,4\n", &["`pitch`"]);
    of_file("x,y,z,x\n1,2,3,4\n", &["`x`, twice"]);
    of_file("x,y,z [km]\n1,2,3\n", &["`z [km]`"]);
    of_file("m00,m01\n1,2\n", &["no column m02"]);
    of_file("x,y,z\n1,2,3\n1,2\n", &["csv:3", "2 cells"]);
    of_file("x,y,z\n1,2,3\n1,nan,3\n", &["csv:3", "finite"]);
    of_file("x,y,z,yaw_degrees,scale\n1,2,3,0,0\n", &["csv:2", "flattens space"]);
    of_file("x,y,z\n1,2,3e15\n", &["csv:2", "1e15"]);
    let round = with("[[assemblies.tree.objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"soot\"\n");
    let stretched = format!("{round}[[instances]]\nassembly = \"tree\"\ntransform = {{ scale = [1, 1, 2] }} #!");
    check_wrong(&stretched, &[], "round", "instances.0.transform", &["keep the shape of a sphere"]);
    let empty = format!("{BASE}[assemblies.tree]\nobjects = [] #!\n[[instances]]\nassembly = \"tree\"");
    assert!(super::parse_with(&empty, &[], &[]).is_err_and(|e| e.to_string().contains("has no objects")));
}
