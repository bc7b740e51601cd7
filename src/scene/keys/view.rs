//! The file as a whole; the film and where it lies on a map, channels, and how all is computed.

use super::Kind::{
    Boolean, Choice, Direction, File, List, ListOfTables, NamedTables, Number, Table, Text, Vector, Whole,
};
use super::{ASSEMBLY, CAMERA, ENVIRONMENT, INSTANCE, Key, LIGHT, MATERIAL, MEDIUM, OBJECT, SPECTRUM, Section};

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
        Key::optional("assemblies", NamedTables, "none", "Objects that are placed many times, and stored once.")
            .tables(&[&ASSEMBLY]),
        Key::optional("instances", ListOfTables, "none", "Where assemblies are placed.").tables(&[&INSTANCE]),
        Key::optional("lights", ListOfTables, "none", "Light that comes from no surface.").tables(&[&LIGHT]),
        Key::optional("environment", Table, "black", "Light from all around.").tables(&[&ENVIRONMENT]),
        Key::optional("media", NamedTables, "none", "Matter that absorbs, scatters and emits.").tables(&[&MEDIUM]),
    ],
    later: &[],
    at: "",
    examples: &[EVERY_SECTION, ON_A_MAP],
    notes: "Tables of the same kind stand in any order. What no object uses (a material, a spectrum, a medium) is \
            checked, and then left out; an assembly that no instance places is left out without a look.",
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

[[assemblies.post.objects]]
cylinder = { from = [0, 0, 0], to = [0, 0, 1], radius = 0.05 }
material = "wall"

[[instances]]
assembly = "post"
transform = { translate = [1, 0, 0] }

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
            "By how many channels paths decide where light goes that matter scatters, by which lobe of a plastic, leaf or blend it goes on, \
             and how rough dispersive glass bends it, one of them drawn for each path: the means are the same, and channels that differ \
             much among one another make less noise with more ([METHOD.md](METHOD.md#techniques)). `auto`: as many as the scene's media, \
             lobes and boundaries need, which `spectile plan` tells; 1 where channels hardly differ. With 1 all channels together decide, and \
             dispersive glass whose channels bend further apart than its lobe is wide leaves one of them.",
        )
        .or("`\"auto\"`")
        .range("[1, 16]"),
        Key::default(
            "forced_collision",
            Boolean,
            "false",
            "Whether what a camera ray sees of thin matter that scatters, before nothing but the environment, is drawn by chance, as \
             everything else, or always: such a ray is then scattered for certain, with the weight of the chance of it. The means are the \
             same; skies and hazes make much less noise ([METHOD.md](METHOD.md#matter-that-scatters)).",
        ),
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
forced_collision = true
evaluation = "roulette"
evaluator = "dpept-spectral"
epoch = 16
"#],
    notes: "",
};
