//! From where a scene is seen: cameras.

use super::Kind::{Boolean, Choice, Direction, File, Name, Number, Table, Vector};
use super::{Key, Section};

pub static CAMERA: Section = Section {
    path: "camera",
    heading: "`[camera]`",
    summary: "from where the scene is seen",
    about: "One of five kinds of camera.",
    keys: &[
        Key::one_of("perspective", Table, "All rays start in one point.").tables(&[&PERSPECTIVE]),
        Key::one_of("thin_lens", Table, "As perspective, through an ideal lens: what is out of focus is blurred.")
            .tables(&[&THIN_LENS]),
        Key::one_of("orthographic", Table, "Parallel rays through a window.").tables(&[&ORTHOGRAPHIC]),
        Key::one_of("latlong", Table, "All directions from one point: makes environment maps.").tables(&[&LATLONG]),
        Key::one_of("pushbroom", Table, "A line scanner: every row from where it is then.").tables(&[&PUSHBROOM]),
    ],
    later: &[],
    at: "camera",
    examples: &[A_PERSPECTIVE, A_THIN_LENS, AN_ORTHOGRAPHIC, A_LATLONG, A_PUSHBROOM],
    notes: "The first three look from `position` to `look_at`. Row 0 of the picture is its top, column 0 its left: columns \
            run along the cross product of the view and `up`, rows from `up` downward.",
};

const A_PERSPECTIVE: &str = r#"
[camera.perspective]
position = [278.0, 273.0, -800.0]
look_at = [278.0, 273.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 39.3077
fov_axis = "x"
flip_x = false
medium = "air"

[media.air]
absorption = 0.0
"#;
const A_THIN_LENS: &str = r#"
[camera.thin_lens]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
fov = 30
fov_axis = "smaller"
aperture_radius = 0.05
focus_distance = 3.6
flip_x = false
medium = "air"

[media.air]
absorption = 0.0
"#;
const AN_ORTHOGRAPHIC: &str = r#"
[camera.orthographic]
position = [3, -4, 2]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
width = 3.0
flip_x = false
medium = "air"

[media.air]
absorption = 0.0
"#;

const A_LATLONG: &str = r#"
[camera.latlong]
position = [0, 0, 1]
up = [0, 0, 1]
rotate_degrees = 90
medium = "air"

[film]
width = 360
height = 180

[media.air]
absorption = 0.0
"#;
const A_PUSHBROOM: &str = r#"
[camera.pushbroom]
lines = "track.csv"
up = [0, 0, 1]
north = [1, 0, 0]
ifov = 0.5
medium = "air"

[media.air]
absorption = 0.0

[film]
width = 60
height = 3
"#;
const A_WIDE_PUSHBROOM: &str = r#"
[camera.pushbroom]
lines = "track.csv"
up = [0, 0, 1]
fov = 40
fov_axis = "x"

[film]
width = 60
height = 3
"#;
const A_PUSHBROOM_BY_LENS: &str = r#"
[camera.pushbroom]
lines = "track.csv"
up = [0, 0, 1]
focal_length = 50
pixel_pitch = 7.5

[film]
width = 60
height = 3
"#;
const A_PUSHBROOM_BY_GROUND: &str = r#"
[camera.pushbroom]
lines = "track.csv"
up = [0, 0, 1]
ground_sampling_distance = 0.5
altitude = 1000

[film]
width = 60
height = 3
"#;
const BY_FOCAL_LENGTH: &str = r#"
[camera.perspective]
position = [0, 0, 800]
look_at = [0, 0, 0]
up = [0, 1, 0]
focal_length = 50                      # mm
pixel_pitch = 5.5                      # um
"#;
const BY_IFOV: &str = r#"
[camera.perspective]
position = [0, 0, 800]
look_at = [0, 0, 0]
up = [0, 1, 0]
ifov = 0.11                            # mrad
"#;
const BY_GROUND: &str = r#"
[camera.perspective]
position = [0, 0, 800]
look_at = [0, 0, 0]
up = [0, 1, 0]
ground_sampling_distance = 0.088       # m
altitude = 800
"#;
const BY_LENS: &str = r#"
[camera.thin_lens]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
focal_length = 35
pixel_pitch = 100
aperture_radius = 0.01
focus_distance = 4
"#;

const A_DISTORTION: &str = r#"
[camera.perspective]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
fov = 40
distortion = { k1 = -0.28, k2 = 0.07, k3 = 0.0, p1 = 2e-4, p2 = -1e-5 }
"#;
const A_LENS_BY_IFOV: &str = r#"
[camera.thin_lens]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
ifov = 8
aperture_radius = 0.01
focus_distance = 4
"#;
const A_LENS_BY_GROUND: &str = r#"
[camera.thin_lens]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
ground_sampling_distance = 0.03
altitude = 4
aperture_radius = 0.01
focus_distance = 4
"#;
const A_DISTORTED_LENS: &str = r#"
[camera.thin_lens]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
fov = 60
aperture_radius = 0.01
focus_distance = 4
distortion = { k1 = -0.1 }
"#;
const LENS_DISTORTION: Key = Key::optional("distortion", Table, "none", "Of the lens: what a calibration says of it.");

const POSITION: Key = Key::required(
    "position",
    Vector,
    "Where the camera is: the point, or the middle of the lens or window that rays start from.",
)
.unit("m");
const LOOK_AT: Key =
    Key::required("look_at", Vector, "What is in the middle of the full film; not where `position` is.").unit("m");
const UP: Key = Key::default(
    "up",
    Direction,
    "[0, 1, 0]",
    "What points up in the picture. It need not be perpendicular to the view, but must not be parallel to it.",
);
const FLIP_X: Key = Key::default(
    "flip_x",
    Boolean,
    "false",
    "Mirrors the picture: columns run the other way. For scenes out of programs with left-handed coordinates (pbrt).",
);
const CAMERA_MEDIUM: Key = Key::optional(
    "medium",
    Name("medium"),
    "empty space",
    "What fills space outside every `interior`. It may have no grids. Light of the environment, of suns and of \
     directional lights arrives through it undimmed.",
);
const FOV: Key = Key::required("fov", Number, "The full angle of view along `fov_axis`.")
    .unless("another of the four ways to say how much is seen")
    .unit("degrees")
    .range("(0, 180)");
const OTHERWISE_SEEN: &str = "another of the four ways to say how much is seen";
const FOCAL_LENGTH: Key =
    Key::required("focal_length", Number, "Of the lens, with `pixel_pitch`; both as a data sheet has them.")
        .unless(OTHERWISE_SEEN)
        .unit("mm")
        .range("(0, ∞)");
const PIXEL_PITCH: Key = Key::required("pixel_pitch", Number, "Distance of the centres of two pixels on the detector.")
    .unless(OTHERWISE_SEEN)
    .unit("µm")
    .range("(0, ∞)");
const IFOV: Key = Key::required("ifov", Number, "The angle that a pixel in the middle of the picture sees.")
    .unless(OTHERWISE_SEEN)
    .unit("mrad")
    .range("(0, 3000]");
const GROUND_SAMPLING_DISTANCE: Key = Key::required(
    "ground_sampling_distance",
    Number,
    "What a pixel sees from side to side on a plane at right angles to the view, `altitude` away.",
)
.unless(OTHERWISE_SEEN)
.unit("m")
.range("(0, ∞)");
const ALTITUDE: Key = Key::required("altitude", Number, "How far away the plane of `ground_sampling_distance` is.")
    .unless(OTHERWISE_SEEN)
    .unit("m")
    .range("(0, ∞)");
const FOV_AXIS: Key = Key::default(
    "fov_axis",
    Choice(&["x", "y", "smaller", "larger"]),
    "\"x\"",
    "Whether `fov` is the angle between the left and right edges of the full film, between top and bottom, or along \
     its smaller or larger side.",
);

pub static PERSPECTIVE: Section = Section {
    path: "camera.perspective",
    heading: "`[camera.perspective]`",
    summary: "a pinhole camera",
    about: "",
    keys: &[
        POSITION,
        LOOK_AT,
        UP,
        FLIP_X,
        CAMERA_MEDIUM,
        FOV,
        FOV_AXIS,
        FOCAL_LENGTH,
        PIXEL_PITCH,
        IFOV,
        GROUND_SAMPLING_DISTANCE,
        ALTITUDE,
        LENS_DISTORTION.tables(&[&DISTORTION]),
    ],
    later: &[],
    at: "camera.perspective",
    examples: &[A_PERSPECTIVE, BY_FOCAL_LENGTH, BY_IFOV, BY_GROUND, A_DISTORTION],
    notes: "How much is seen is said in one of four ways; with all but `fov` it grows with the film, whose pixels are square:             `width` times `pixel_pitch` is the detector's width.",
};

pub static THIN_LENS: Section = Section {
    path: "camera.thin_lens",
    heading: "`[camera.thin_lens]`",
    summary: "a camera with a lens",
    about: "",
    keys: &[
        POSITION,
        LOOK_AT,
        UP,
        FLIP_X,
        CAMERA_MEDIUM,
        FOV,
        FOV_AXIS,
        FOCAL_LENGTH,
        PIXEL_PITCH,
        IFOV,
        GROUND_SAMPLING_DISTANCE,
        ALTITUDE,
        LENS_DISTORTION.tables(&[&DISTORTION]),
        Key::required("aperture_radius", Number, "Radius of the lens; 0 is a pinhole.").unit("m").range("[0, ∞)"),
        Key::required(
            "focus_distance",
            Number,
            "Distance of the plane that is sharp, measured along the axis of view (not along each ray).",
        )
        .unit("m")
        .range("(0, ∞)"),
    ],
    later: &[],
    at: "camera.thin_lens",
    examples: &[A_THIN_LENS, BY_LENS, A_LENS_BY_IFOV, A_LENS_BY_GROUND, A_DISTORTED_LENS],
    notes: "",
};

pub static DISTORTION: Section = Section {
    path: "distortion",
    heading: "`distortion = { … }`",
    summary: "of a lens: Brown and Conrady",
    about: "What a pinhole would show at (x, y), in units of the focal length, x to the right and y down, is seen at x (1 + k₁ r² + k₂ r⁴ + \
            k₃ r⁶) + 2 p₁ x y + p₂ (r² + 2 x²) and y (1 + k₁ r² + k₂ r⁴ + k₃ r⁶) + p₁ (r² + 2 y²) + 2 p₂ x y, r² = x² + y²: names and signs \
            are those of OpenCV and most calibrations. How much is seen (`fov` and the like) is said of the film without it.",
    keys: &[
        Key::default("k1", Number, "0", "Radial, of r²: barrels are below 0, cushions above."),
        Key::default("k2", Number, "0", "Radial, of r⁴."),
        Key::default("k3", Number, "0", "Radial, of r⁶."),
        Key::default("p1", Number, "0", "Tangential."),
        Key::default("p2", Number, "0", "Tangential."),
    ],
    later: &[],
    at: "camera.perspective.distortion",
    examples: &[A_DISTORTION],
    notes: "Each place of the film must see one direction: a distortion that folds the picture over is refused.",
};

pub static ORTHOGRAPHIC: Section = Section {
    path: "camera.orthographic",
    heading: "`[camera.orthographic]`",
    summary: "a camera with parallel rays",
    about: "",
    keys: &[
        POSITION,
        LOOK_AT,
        UP,
        FLIP_X,
        CAMERA_MEDIUM,
        Key::required(
            "width",
            Number,
            "What is seen from the left edge of the full film to the right one; the height follows from the film's.",
        )
        .unit("m")
        .range("(0, ∞)"),
    ],
    later: &[],
    at: "camera.orthographic",
    examples: &[AN_ORTHOGRAPHIC],
    notes: "",
};

pub static LATLONG: Section = Section {
    path: "camera.latlong",
    heading: "`[camera.latlong]`",
    summary: "a camera that sees all directions",
    about: "",
    keys: &[
        Key::required("position", Vector, "The point that all rays start from.").unit("m"),
        Key::default("up", Direction, "[0, 1, 0]", "Where the upper edge of the picture is."),
        Key::default(
            "rotate_degrees",
            Number,
            "0",
            "Turns the picture about `up`, counter-clockwise as seen from above: as the key of that name turns an environment map.",
        )
        .unit("degrees"),
        CAMERA_MEDIUM,
    ],
    later: &[],
    at: "camera.latlong",
    examples: &[A_LATLONG],
    notes: "Longitude runs along x, latitude along y, all pixels the same angle: a film twice as wide as high has square ones. What is             rendered is an environment map as it stands: `environment = { map = \"CUBE.zarr\" }` with the same `up` and             `rotate_degrees` sends from every direction what was seen there.",
};

pub static PUSHBROOM: Section = Section {
    path: "camera.pushbroom",
    heading: "`[camera.pushbroom]`",
    summary: "a line scanner",
    about: "",
    keys: &[
        Key::required(
            "lines",
            File,
            "Where it is in the middle of each line's exposure: CSV with the columns `x`, `y`, `z` and any of `yaw_degrees`, `pitch_degrees`, \
             `roll_degrees`, a row for each row of the film. With all three 0 it looks straight down with its nose north; yaw \
             turns it clockwise as seen from above, pitch lifts the nose, roll lowers the right wing, one after the other.",
        ),
        Key::default("up", Direction, "[0, 1, 0]", "Where up is in the scene."),
        Key::optional("north", Direction, "`[0, 0, -1]`; `[0, 1, 0]` where `up` is z", "Where north is; made level."),
        FOV,
        FOV_AXIS,
        FOCAL_LENGTH,
        PIXEL_PITCH,
        IFOV,
        GROUND_SAMPLING_DISTANCE,
        ALTITUDE,
        CAMERA_MEDIUM,
    ],
    later: &[],
    at: "camera.pushbroom",
    examples: &[A_PUSHBROOM, A_WIDE_PUSHBROOM, A_PUSHBROOM_BY_LENS, A_PUSHBROOM_BY_GROUND],
    notes: "Row 0 is the first line, columns run to the right of the flight. A line is exposed until the next begins, and the scanner moves \
            and turns evenly between their middles: what a pixel sees is smeared along the track by that and by its own size. How \
            much is seen is said of the row, across the track; pixels are square. The track may lead through bodies of gas: each ray begins in what is around the scanner at that moment.",
};
