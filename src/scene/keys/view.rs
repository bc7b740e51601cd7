//! The file as a whole; what is seen, in which channels, and how it is computed.

use super::Kind::{
    Boolean, Choice, Direction, File, List, ListOfTables, Name, NamedTables, Number, Table, Text, Vector, Whole,
};
use super::{ENVIRONMENT, Key, LIGHT, MATERIAL, MEDIUM, OBJECT, SPECTRUM, Section};

pub static SCENE: Section = Section {
    path: "scene",
    heading: "The file as a whole",
    summary: "the sections that a file has",
    about: "",
    keys: &[
        Key::required("camera", Table, "From where the scene is seen.").tables(&[&CAMERA]),
        Key::required("film", Table, "The picture's size in pixels.").tables(&[&FILM]),
        Key::optional("georeference", Table, "nowhere on earth", "Where on a map the picture lies.")
            .tables(&[&GEOREFERENCE]),
        Key::required("channels", Table, "The intervals of wavelength that are rendered.").tables(&[&CHANNELS]),
        Key::optional("integrator", Table, "all its defaults", "How paths are made.").tables(&[&INTEGRATOR]),
        Key::optional("spectra", NamedTables, "none", "Spectra that others name.").tables(&[&SPECTRUM]),
        Key::optional("materials", NamedTables, "none", "What surfaces do with light.").tables(&[&MATERIAL]),
        Key::optional("objects", ListOfTables, "none", "Shapes: what reflects, shines or holds gas.")
            .tables(&[&OBJECT]),
        Key::optional("lights", ListOfTables, "none", "Light that comes from no surface.").tables(&[&LIGHT]),
        Key::optional("environment", Table, "black", "Light from all around.").tables(&[&ENVIRONMENT]),
        Key::optional("media", NamedTables, "none", "Matter that absorbs, scatters and emits.").tables(&[&MEDIUM]),
    ],
    later: &[],
    at: "",
    examples: &[EVERY_SECTION, ON_A_MAP],
    notes: "Tables of the same kind stand in any order. What no object uses (a material, a spectrum, a medium) is \
            checked, and then left out.",
};

const EVERY_SECTION: &str = r#"
[camera.perspective]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
fov = 40
medium = "air"

[film]
width = 64
height = 64

[channels]
intervals = [[400, 500], [500, 600], [600, 700]]

[integrator]
max_bounces = 3

[spectra]
white = 0.8                            # a constant; others are tables
lamp = { blackbody = 3000 }

[materials]
wall = { diffuse = { reflectance = "white" } }

[[objects]]
sphere = { center = [0, 0, 0.5], radius = 0.5 }
material = "wall"

[[lights]]
point = { position = [2, -2, 4], intensity = "lamp" }

[environment]
radiance = 0.01

[media.air]
absorption = 1e-4
"#;

const ON_A_MAP: &str = r#"
[camera.orthographic]
position = [0, 0, 10]
look_at = [0, 0, 0]
up = [0, 1, 0]
width = 8

[georeference]
crs = "EPSG:32631"
origin = [650000, 4800000, 0]
up = [0, 0, 1]
"#;

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
    ],
    later: &[],
    at: "camera.pushbroom",
    examples: &[A_PUSHBROOM, A_WIDE_PUSHBROOM, A_PUSHBROOM_BY_LENS, A_PUSHBROOM_BY_GROUND],
    notes: "Row 0 is the first line, columns run to the right of the flight. A line is exposed until the next begins, and the scanner moves \
            and turns evenly between their middles: what a pixel sees is smeared along the track by that and by its own size. How \
            much is seen is said of the row, across the track; pixels are square. Not with media.",
};

pub static FILM: Section = Section {
    path: "film",
    heading: "`[film]`",
    summary: "the picture's size, filter and crop",
    about: "",
    keys: &[
        Key::required("width", Whole, "Columns of the full film.").unit("pixels").range("[1, 131072]"),
        Key::required("height", Whole, "Rows of the full film.").unit("pixels").range("[1, 131072]"),
        Key::default(
            "filter",
            Choice(&["box", "gaussian"]),
            "\"box\"",
            "What a pixel is the mean over: its own square, or a Gaussian about its centre with a standard deviation \
             of 0.5 pixels, cut at 2 along each axis. Every sample belongs to one pixel.",
        ),
        Key::optional(
            "crop",
            List("`[x0, y0, x1, y1]`"),
            "the full film",
            "Renders columns x0 up to x1 and rows y0 up to y1 alone, x1 and y1 not included. The cube has the crop's \
             size; its pixels have the values that they have in the full film.",
        )
        .unit("pixels")
        .range("within the film, x0 < x1, y0 < y1"),
    ],
    later: &[],
    at: "film",
    examples: &[
        r#"
[film]
width = 640
height = 400
filter = "gaussian"
"#,
        "
[film]
width = 640
height = 400
crop = [200, 100, 328, 228]            # 128 x 128 pixels of it
",
    ],
    notes: "",
};

pub static GEOREFERENCE: Section = Section {
    path: "georeference",
    heading: "`[georeference]`",
    summary: "where on a map the picture lies",
    about: "For orthographic cameras that look down, and for perspective ones that look straight down: the cube and its exports say where \
            on a map each pixel is, so that QGIS places the picture.",
    keys: &[
        Key::required("crs", Text, "The coordinate reference system of the map: `\"EPSG:32631\"` or the like, or WKT."),
        Key::optional(
            "origin",
            Vector,
            "`[0, 0, 0]`: the scene has the map's coordinates",
            "Easting, northing and height of the scene's origin.",
        )
        .unit("m"),
        Key::default("up", Direction, "[0, 1, 0]", "Where up is in the scene."),
        Key::optional(
            "north",
            Direction,
            "`[0, 0, -1]`; `[0, 1, 0]` where `up` is z",
            "Where the map's northing grows; made level.",
        ),
        Key::default(
            "ground",
            Number,
            "0",
            "Height of the level ground on which pixels are placed. What stands higher is seen displaced, as in any picture that is no \
             orthophoto; under an orthographic camera that looks straight down nothing is.",
        )
        .unit("m"),
    ],
    later: &[],
    at: "georeference",
    examples: &[
        r#"
[camera.orthographic]
position = [0, 100, 0]
look_at = [0, 0, 0]
up = [0, 0, -1]
width = 64

[georeference]
crs = "EPSG:32631"
origin = [650000, 4800000, 120]
up = [0, 1, 0]
north = [0, 0, -1]
ground = 120
"#,
    ],
    notes: "One unit of the scene is one of the map: metres, in most. Large coordinates lose nothing, in the scene or as `origin`.",
};

pub static CHANNELS: Section = Section {
    path: "channels",
    heading: "`[channels]`",
    summary: "the intervals of wavelength that are rendered",
    about: "What is stored for a channel is the *mean* spectral radiance over its interval, in W m⁻² sr⁻¹ nm⁻¹, \
            whatever the unit of the interval: wider channels are not brighter. With responses R it is ∫L R dλ / ∫R \
            dλ. Wavelengths are those in a vacuum.",
    keys: &[
        Key::one_of("equal", Table, "Intervals of equal width.").tables(&[&EQUAL]),
        Key::one_of(
            "wavenumber",
            Table,
            "Intervals of equal width in wavenumber; stored in the order of ascending wavelengths.",
        )
        .tables(&[&WAVENUMBER]),
        Key::one_of(
            "intervals",
            List("list of `[from, to]`"),
            "Any intervals, kept in this order. They may overlap, and leave gaps. 1 to 65,536 of them.",
        )
        .unit("nm, or as `unit` says")
        .range("from < to, both in (0, 1e6] nm"),
        Key::default(
            "unit",
            Choice(&["nm", "um"]),
            "\"nm\"",
            "Of `intervals`, the micrometre for short (`\"µm\"` too); `equal` has its own.",
        ),
        Key::one_of("responses", File, "The responses of a sensor, one channel each; see [Responses](#responses)."),
        Key::optional(
            "false_colour",
            List("`[r, g, b]`"),
            "as seen",
            "Numbers of the channels, from 0, that pictures show as red, green and blue. Absent, they show what an \
             eye would see where the channels cover the visible and are no responses, else the channels of the \
             shortest, the middle and the longest wavelengths.",
        )
        .range("below the number of channels"),
    ],
    later: &[],
    at: "channels",
    examples: &[
        r#"
[channels]
equal = { from = 380, to = 780, count = 400 }
false_colour = [300, 180, 60]
"#,
        r#"
[channels]
wavenumber = { from = 500, to = 5000, count = 1000 }
"#,
        r#"
[channels]
intervals = [[380, 390], [450, 470], [8000, 12000]]
"#,
        r#"
[channels]
intervals = [[3, 5], [8, 12]]
unit = "um"
"#,
        r#"
[channels]
responses = "sensor.csv"
"#,
    ],
    notes: "",
};

pub static EQUAL: Section = Section {
    path: "channels.equal",
    heading: "`equal = { … }`",
    summary: "channels of equal width",
    about: "",
    keys: &[
        Key::required("from", Number, "Where the first channel begins.")
            .unit("nm, or as `unit` says")
            .range("(0, 1e6], less than `to`"),
        Key::required("to", Number, "Where the last one ends.")
            .unit("nm, or as `unit` says")
            .range("(0, 1e6], more than `from`"),
        Key::required("count", Whole, "How many channels.").range("[1, 65536]"),
        Key::default(
            "unit",
            Choice(&["nm", "um"]),
            "\"nm\"",
            "Of `from` and `to`: nanometres or micrometres (`\"µm\"` too).",
        ),
    ],
    later: &[],
    at: "channels.equal",
    examples: &[
        "
[channels.equal]
from = 380.0
to = 780.0
count = 400
",
        r#"
[channels.equal]
from = 8
to = 14
unit = "um"
count = 60
"#,
    ],
    notes: "",
};

pub static WAVENUMBER: Section = Section {
    path: "channels.wavenumber",
    heading: "`wavenumber = { … }`",
    summary: "channels of equal width in wavenumber",
    about: "",
    keys: &[
        Key::required("from", Number, "Lowest wavenumber, where the longest waves are.")
            .unit("cm⁻¹")
            .range("[10, ∞), less than `to`"),
        Key::required("to", Number, "Highest wavenumber.").unit("cm⁻¹").range("[10, ∞), more than `from`"),
        Key::required("count", Whole, "How many channels.").range("[1, 65536]"),
    ],
    later: &[],
    at: "channels.wavenumber",
    examples: &["
[channels.wavenumber]
from = 500                             # 20 um
to = 5000                              # 2 um
count = 1000
"],
    notes: "",
};

pub static INTEGRATOR: Section = Section {
    path: "integrator",
    heading: "`[integrator]`",
    summary: "how paths are made and evaluated",
    about: "",
    keys: &[
        Key::default(
            "max_bounces",
            Whole,
            "5",
            "Scattering events of a path at most; light is aimed at from the last one too. With 0 only what shines by \
             itself is seen.",
        )
        .range("[0, 16383]"),
        Key::default(
            "russian_roulette_start",
            Whole,
            "0",
            "The first scattering event, counted from 1, at which a dark path may be ended at random; 0 is never. It \
             changes noise and time, not the mean.",
        )
        .range("[0, 16383]"),
        Key::default(
            "sampler",
            Choice(&["sobol", "independent"]),
            "\"sobol\"",
            "Owen-scrambled Sobol' points, or independent random numbers.",
        ),
        Key::default(
            "wavelengths",
            Choice(&["emission", "uniform"]),
            "\"emission\"",
            "Whether wavelengths are drawn within each channel by what the scene emits there, or evenly. The means \
             are the same; spiky lamps make less noise with `emission` \
             ([METHOD.md](METHOD.md#wavelengths-by-emission)).",
        ),
        Key::default(
            "wavelengths_per_channel",
            Whole,
            "\"auto\"",
            "At how many wavelengths of every channel a path is evaluated, evenly spread: less noise where spectra vary within a \
             channel (lines of gases, narrow reflectances), for as much more time in evaluation \
             ([METHOD.md](METHOD.md#several-wavelengths-a-channel)). `auto` asks a few samples before the render begins, where spectra \
             vary enough, and takes more than one where that is expected to pay; the cube remembers. `pt` takes one.",
        )
        .or("`\"auto\"`")
        .range("[1, 16], a power of two"),
        Key::default(
            "techniques",
            Whole,
            "\"auto\"",
            "By how many channels paths decide where light goes that matter scatters, one of them drawn for each path: the means are \
             the same, and channels that differ much among one another make less noise with more \
             ([METHOD.md](METHOD.md#techniques)). `auto`: one more than how often the largest optical depth of all channels halves to \
             the smallest. With 1 the mean over channels decides.",
        )
        .or("`\"auto\"`")
        .range("[1, 16]"),
        Key::default(
            "evaluation",
            Choice(&["auto", "all", "roulette"]),
            "\"auto\"",
            "Whether all paths are evaluated, or those that carry little energy by chance only, and then for more: the means are the \
             same, and time goes where it brings most ([METHOD.md](METHOD.md#roulette-on-evaluation)). How many are worth it is \
             found by a few samples before the render begins, and stays with the cube. `auto` does it where that is expected to \
             pay. `pt` evaluates all.",
        ),
        Key::default(
            "evaluator",
            Choice(&["auto", "dpept-pixel", "dpept-path", "dpept-spectral", "pt"]),
            "\"auto\"",
            "How channels are evaluated: `pt` is the conventional path tracer, the others are ways to evaluate saved \
             paths. They trace the same paths, and differ by rounding and by what tables may be off (1e-4 of a \
             channel's peak). `auto` takes `dpept-pixel`, and `pt` on GPUs where channels are few; a cube remembers \
             which.",
        ),
        Key::default(
            "epoch",
            Whole,
            "64",
            "Samples per pixel of a full epoch, after which a render may end ([METHOD.md](METHOD.md#epochs)).",
        )
        .range("[1, 1024], a power of two"),
    ],
    later: &[],
    at: "integrator",
    examples: &[r#"
[integrator]
max_bounces = 16
russian_roulette_start = 4
sampler = "independent"
wavelengths = "uniform"
wavelengths_per_channel = 4
techniques = 4
evaluation = "roulette"
evaluator = "dpept-spectral"
epoch = 16
"#],
    notes: "",
};
