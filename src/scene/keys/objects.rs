//! Shapes, and where they are.

use super::Kind::{Choice, Direction, File, List, ListOfTables, Name, Number, Spectrum, Table, Text, Vector};
use super::{Key, Section};
use crate::scene::Quantity;

pub static OBJECT: Section = Section {
    path: "objects.N",
    heading: "`[[objects]]`",
    summary: "a shape, its material, and what it emits",
    about: "An object has one shape.",
    keys: &[
        Key::one_of("mesh", File, "An OBJ, PLY, STL or glTF 2.0 (.gltf, .glb) file; see [Meshes](#meshes)."),
        Key::one_of("sphere", Table, "").tables(&[&SPHERE]),
        Key::one_of("quad", Table, "A parallelogram.").tables(&[&QUAD]),
        Key::one_of("disk", Table, "").tables(&[&DISK]),
        Key::one_of("cube", Table, "A box along the axes.").tables(&[&CUBE]),
        Key::one_of("cylinder", Table, "The wall of a tube, open at both ends.").tables(&[&CYLINDER]),
        Key::optional(
            "group",
            Text,
            "all faces",
            "The faces of an OBJ mesh that stand under this `o` or `g`. With `mesh` only.",
        ),
        Key::optional(
            "node",
            Text,
            "all nodes",
            "The node of a glTF mesh that has this name, with what hangs on it, where the file puts it. With `mesh` only.",
        ),
        Key::optional("material", Name("material"), "see below", "One of `[materials]`."),
        Key::optional(
            "emission",
            Spectrum(Quantity::Radiance),
            "none",
            "Radiance that leaves the surface, the same in all directions. It adds to what heat emits and to what the \
             material scatters: a lamp that reflects nothing is `black`.",
        )
        .tables(&[&super::TEXTURE_OF_LIGHT]),
        Key::default(
            "emission_sides",
            Choice(&["front", "both"]),
            "\"front\"",
            "Which sides `emission` leaves from. Without `emission` it has no effect, which is said.",
        ),
        Key::optional("transform", Table, "none", "Scales, turns and moves it.").tables(&[&TRANSFORM]),
        Key::optional(
            "interior",
            Name("medium"),
            "none",
            "The gas, or other matter that absorbs, inside a sphere, a cube or a closed mesh.",
        ),
    ],
    later: &[],
    at: "objects.0",
    examples: &[
        r#"
[[objects]]
mesh = "floor.obj"
group = "tiles"
material = "floor"
transform = { scale = 0.01, rotate = [1, 0, 0, 90], translate = [0, 0, 0.2] }
"#,
        r#"
[[objects]]
mesh = "cage.gltf"
node = "bars"
material = "floor"
"#,
        r#"
[[objects]]                            # a lamp
disk = { center = [0, 0, 3], normal = [0, 0, -1], radius = 0.2 }
material = "lamp"
emission = { blackbody = 2856 }
emission_sides = "both"
"#,
        r#"
[[objects]]                            # glass that absorbs
sphere = { center = [0, 0, 1], radius = 0.4 }
material = "glass"
interior = "green"

[materials.glass.dielectric]
eta = 1.5

[media.green]
absorption = { samples = [[400, 3.0], [520, 0.1], [700, 4.0]] }
"#,
        r#"
[[objects]]                            # a cloud of gas, without a surface
cube = { min = [-1, -1, 0], max = [1, 1, 2] }
interior = "haze"

[media.haze]
absorption = 0.05
"#,
        r#"
[[objects]]
quad = { corner = [-2, -2, 0], edge_u = [4, 0, 0], edge_v = [0, 4, 0] }
material = "floor"
"#,
        r#"
[[objects]]
cylinder = { from = [0, 0, 0], to = [0, 0, 1], radius = 0.1 }
material = "ball"
"#,
    ],
    notes: "Without `material` an object with an `interior` is a *null boundary*: nothing but the bound of its gas, \
            invisible and no bounce. A mesh without `material` takes the names of materials in its file (OBJ: `usemtl`; \
            glTF: `name`, or `material N` for the one at index N that has none) as those of materials here. \
            Anything else needs one.",
};

pub static ASSEMBLY: Section = Section {
    path: "assemblies.NAME",
    heading: "`[assemblies.NAME]`",
    summary: "objects that are placed many times",
    about: "Its objects are stored once, in a space of their own, however often it is placed: a forest takes the memory of \
            its trees, and some 120 bytes a place.",
    keys: &[Key::required("objects", ListOfTables, "As `[[objects]]`, in the assembly's own space.").tables(&[&OBJECT])],
    later: &[],
    at: "assemblies.tree",
    examples: &[r#"
[[assemblies.tree.objects]]
cylinder = { from = [0, 0, 0], to = [0, 0, 1], radius = 0.1 }
material = "floor"

[[assemblies.tree.objects]]
sphere = { center = [0, 0, 1.5], radius = 0.6 }
material = "ball"

[[instances]]
assembly = "tree"
"#],
    notes: "What emits does so in every place, with the same radiance whatever its size: each instance is one light of those \
            that paths aim at. An `interior` fills every instance, with as much per metre of the world whatever its size; \
            where instances overlap it is there once. Grids of its medium are carried along by each instance: their voxels are \
            kept once, but each instance is then an interior of its own among the [254](#limits) of a scene.",
};

pub static INSTANCE: Section = Section {
    path: "instances.N",
    heading: "`[[instances]]`",
    summary: "where an assembly is placed",
    about: "Places an assembly in the world: once, by its `transform`, or as often as a file of `placements` has lines.",
    keys: &[
        Key::required("assembly", Name("assembly"), "One of `[assemblies]`."),
        Key::optional("transform", Table, "none", "Scales, turns and moves it, after `placements` have.")
            .tables(&[&TRANSFORM]),
        Key::optional(
            "placements",
            File,
            "one place",
            "A CSV file with a line for each instance, whose first line names the columns: `x,y,z`, and then \
             `yaw_degrees` and `scale` or not; or twelve, `m00` to `m23`: the first three rows of a matrix, as in \
             `transform`. The assembly is scaled, turned by `yaw_degrees` about `up`, counter-clockwise as seen from \
             its tip, and moved to x, y, z in metres.",
        ),
        Key::optional("up", Direction, "[0, 1, 0]", "About which `yaw_degrees` turns. With `placements` only."),
    ],
    later: &[],
    at: "instances.0",
    examples: &[
        r#"
[[assemblies.post.objects]]
cube = { min = [-0.1, -0.1, 0], max = [0.1, 0.1, 1] }
material = "floor"

[[instances]]
assembly = "post"
transform = { rotate = [0, 0, 1, 45], translate = [1, 0, 0] }

[[instances]]
assembly = "post"
"#,
        r#"
[[assemblies.tree.objects]]
sphere = { center = [0, 0, 1.5], radius = 0.6 }
material = "ball"

[[instances]]
assembly = "tree"
placements = "trees.csv"               # x,y,z,yaw_degrees,scale
"#,
        r#"
[[assemblies.tree.objects]]
sphere = { center = [0, 0, 1.5], radius = 0.6 }
material = "ball"

[[instances]]
assembly = "tree"
placements = "trees.csv"
up = [0, 0, 1]                         # yaw turns about the axis of the trunk
transform = { translate = [0, 0, 0.5] }
"#,
    ],
    notes: "Spheres, disks and cylinders in an assembly ask for instances that keep their shape: one scale in all \
            directions. Whether a thing is placed or copied changes what is rendered by rounding only: by some 1e-7 of the \
            scene's size, and of an instance's times how much it is stretched.",
};

const CENTER: Key = Key::required("center", Vector, "Its middle.").unit("m");
const RADIUS: Key = Key::required("radius", Number, "").unit("m").range("(0, ∞)");

pub static SPHERE: Section = Section {
    path: "objects.N.sphere",
    heading: "`sphere = { … }`",
    summary: "a ball",
    about: "Its front is outside.",
    keys: &[CENTER, RADIUS],
    later: &[],
    at: "objects.0.sphere",
    examples: &[r#"
[[objects]]
sphere = { center = [0.0, 0.0, 0.5], radius = 0.5 }
material = "ball"
"#],
    notes: "",
};

pub static QUAD: Section = Section {
    path: "objects.N.quad",
    heading: "`quad = { … }`",
    summary: "a parallelogram",
    about: "Its front is where `edge_u` turns counter-clockwise to `edge_v`: the normal is edge_u × edge_v.",
    keys: &[
        Key::required("corner", Vector, "One corner.").unit("m"),
        Key::required("edge_u", Vector, "From there to the next corner; u runs along it.").unit("m"),
        Key::required("edge_v", Vector, "From there to the other next corner, in another direction; v runs along it.")
            .unit("m"),
    ],
    later: &[],
    at: "objects.0.quad",
    examples: &[r#"
[[objects]]
quad = { corner = [-5, -5, 0], edge_u = [10, 0, 0], edge_v = [0, 10, 0] }      # a floor, seen from above (+z)
material = "floor"
"#],
    notes: "",
};

pub static DISK: Section = Section {
    path: "objects.N.disk",
    heading: "`disk = { … }`",
    summary: "a disk",
    about: "",
    keys: &[CENTER, Key::required("normal", Direction, "Points away from its front."), RADIUS],
    later: &[],
    at: "objects.0.disk",
    examples: &[r#"
[[objects]]
disk = { center = [0, 0, 3], normal = [0, 0, -1], radius = 0.5 }       # its front looks down
material = "floor"
"#],
    notes: "",
};

pub static CUBE: Section = Section {
    path: "objects.N.cube",
    heading: "`cube = { … }`",
    summary: "a box along the axes",
    about: "Its front is outside. Sides may differ in length; `transform` turns it.",
    keys: &[
        Key::required("min", Vector, "The corner with the least x, y and z.").unit("m"),
        Key::required("max", Vector, "The one with the greatest, each greater than in `min`.").unit("m"),
    ],
    later: &[],
    at: "objects.0.cube",
    examples: &[r#"
[[objects]]
cube = { min = [-1, -1, 0], max = [1, 1, 2] }
material = "floor"
"#],
    notes: "",
};

pub static CYLINDER: Section = Section {
    path: "objects.N.cylinder",
    heading: "`cylinder = { … }`",
    summary: "the wall of a tube",
    about: "Its front is outside. It has no lids, so it cannot be filled.",
    keys: &[
        Key::required("from", Vector, "One end of its axis.").unit("m"),
        Key::required("to", Vector, "The other one, elsewhere.").unit("m"),
        RADIUS,
    ],
    later: &[],
    at: "objects.0.cylinder",
    examples: &[r#"
[[objects]]
cylinder = { from = [0, 0, 0], to = [0, 0, 1], radius = 0.1 }
material = "ball"
"#],
    notes: "",
};

pub static TRANSFORM: Section = Section {
    path: "objects.N.transform",
    heading: "`transform = { … }`",
    summary: "scales, turns and moves an object",
    about: "First `scale`, then `rotate`, then `translate`, whatever order they are written in, all about the origin \
            of the object's own coordinates; or a `matrix`.",
    keys: &[
        Key::default("translate", Vector, "[0, 0, 0]", "Moves it by so much.").unit("m"),
        Key::default(
            "rotate",
            List("`[x, y, z, degrees]`"),
            "[0, 1, 0, 0]",
            "Turns it about the axis x, y, z, counter-clockwise as seen from the axis's tip.",
        )
        .unit("degrees")
        .range("axis not 0"),
        Key::default(
            "scale",
            Number,
            "1.0",
            "One factor, or one along each axis. Negative ones mirror; fronts stay fronts.",
        )
        .or("`[x, y, z]`")
        .range("not 0"),
        Key::optional(
            "matrix",
            List("16 numbers"),
            "the identity",
            "Row by row, for column vectors: the translation is the last number of the first three rows, the last row \
             0, 0, 0, 1. Without the other keys.",
        )
        .range("invertible"),
    ],
    later: &[],
    at: "objects.0.transform",
    examples: &[
        r#"
[[objects]]
cube = { min = [-1, -1, -1], max = [1, 1, 1] }
material = "floor"

[objects.transform]
scale = [0.5, 0.5, 2.0]
rotate = [0.0, 0.0, 1.0, 30.0]
translate = [0.0, 0.0, 2.0]
"#,
        r#"
[[objects]]
sphere = { center = [0, 0, 0], radius = 1 }
material = "ball"

[objects.transform]
matrix = [
    0.5, 0.0, 0.0, 1.0,
    0.0, 0.5, 0.0, 0.0,
    0.0, 0.0, 0.5, 0.5,
    0.0, 0.0, 0.0, 1.0,
]
"#,
    ],
    notes: "Spheres, disks and cylinders must keep their shape: of one scale in all directions. Everything must lie \
            within 1e15 m of the origin.",
};
