//! Light that comes from no surface.

use super::Kind::{Choice, Direction, File, Number, Spectrum, Table, Text, Vector};
use super::{CELSIUS, Key, Section};
use crate::scene::Quantity;

pub static LIGHT: Section = Section {
    path: "lights.N",
    heading: "`[[lights]]`",
    summary: "light from a point, a spot, a direction or a sun",
    about: "A light has one of four kinds. Lamps with a surface are objects with `emission`.",
    keys: &[
        Key::one_of("point", Table, "Shines from a point, the same in all directions.").tables(&[&POINT]),
        Key::one_of("spot", Table, "Shines from a point into a cone.").tables(&[&SPOT]),
        Key::one_of("directional", Table, "Parallel light from far away.").tables(&[&DIRECTIONAL]),
        Key::one_of("sun", Table, "Light from a disk far away, which the camera sees and whose shadows are soft.")
            .tables(&[&SUN]),
    ],
    later: &[],
    at: "lights.0",
    examples: &[A_POINT, A_SPOT, A_DIRECTIONAL, A_SUN],
    notes: "Points, spots and directional light are seen neither by the camera nor in smooth mirrors; suns are. `direction` \
            is where light *travels*: a sun in the zenith has `[0, -1, 0]` in scenes whose up is +y, `[0, 0, -1]` \
            where it is +z.",
};

const A_POINT: &str = r#"
[[lights]]
point = { position = [2, -2, 4], intensity = { blackbody = 3000, scale = 1e-3 } }
"#;
const A_SPOT: &str = r#"
[[lights]]
spot = { position = [0, 0, 3], direction = [0, 0, -1], intensity = 20, half_angle = 30 }
"#;
const A_SOFT_SPOT: &str = r#"
[[lights]]
spot = { position = [0, 0, 3], direction = [0, 0, -1], intensity = 20, half_angle = 30, falloff = 25, profile = "linear" }
"#;
const A_DIRECTIONAL: &str = r#"
[[lights]]
directional = { direction = [1, 1, -2], irradiance = 1.5 }
"#;
const A_SUN: &str = r#"
[[lights]]
sun = { direction = [0.5, 0, -0.866], angular_radius = 0.2665, irradiance = { file = "spectra/sun.csv" } }
"#;
const A_HIGH_SUN: &str = r#"
[[lights]]
sun = { azimuth = 135, elevation = 40, north = [1, 0, 0], up = [0, 0, 1], irradiance = "am1.5" }
"#;
const A_SUN_OF_A_DAY: &str = r#"
[[lights]]
sun = { date = "2026-06-21T10:30:00Z", latitude = 43.6, longitude = 5.1, irradiance = "am0" }
"#;

const OTHERWISE_PLACED: &str = "another of the three ways to say where it stands";
const TRAVEL: Key = Key::required("direction", Direction, "The direction that its light travels in: away from it.");
const IRRADIANCE: Key = Key::required(
    "irradiance",
    Spectrum(Quantity::Irradiance),
    "On a plane that faces it, with nothing between. Two names are known without a definition: `\"am0\"`, the sun outside the \
     atmosphere, and `\"am1.5\"`, its direct light and that from close around it through air mass 1.5 (ASTM G173-03, from 280 to \
     4,000 nm, zero beyond, with a warning).",
);

pub static POINT: Section = Section {
    path: "lights.N.point",
    heading: "`point = { … }`",
    summary: "light from a point",
    about: "",
    keys: &[
        Key::required("position", Vector, "Where it is.").unit("m"),
        Key::required(
            "intensity",
            Spectrum(Quantity::Intensity),
            "Radiant intensity: irradiance is it divided by the square of the distance in metres.",
        ),
    ],
    later: &[],
    at: "lights.0.point",
    examples: &[A_POINT],
    notes: "",
};

pub static SPOT: Section = Section {
    path: "lights.N.spot",
    heading: "`spot = { … }`",
    summary: "light from a point into a cone",
    about: "",
    keys: &[
        Key::required("position", Vector, "Where it is.").unit("m"),
        Key::required("direction", Direction, "The direction that the light on its axis travels in."),
        Key::required(
            "intensity",
            Spectrum(Quantity::Intensity),
            "Radiant intensity on the axis: irradiance is it divided by the square of the distance in metres.",
        ),
        Key::required("half_angle", Number, "From the axis to where the light ends.").unit("degrees").range("(0, 180]"),
        Key::optional(
            "falloff",
            Number,
            "`half_angle`: a sharp edge",
            "From the axis to where the intensity begins to fall.",
        )
        .unit("degrees")
        .range("[0, 180], at most `half_angle`"),
        Key::default(
            "profile",
            Choice(&["smooth", "linear"]),
            "\"smooth\"",
            "How the intensity falls over the angle θ to the axis, from `falloff` to `half_angle`: `smooth` as t²(3 - 2t), t linear \
             in cos θ; `linear` as t, linear in θ.",
        ),
    ],
    later: &[],
    at: "lights.0.spot",
    examples: &[A_SPOT, A_SOFT_SPOT],
    notes: "`smooth` is the spot of pbrt (`coneangle` is `half_angle`, less `conedeltaangle` it is `falloff`), `linear` that of \
            Mitsuba (`cutoff_angle` and `beam_width`).",
};

pub static DIRECTIONAL: Section = Section {
    path: "lights.N.directional",
    heading: "`directional = { … }`",
    summary: "parallel light",
    about: "",
    keys: &[TRAVEL, IRRADIANCE],
    later: &[],
    at: "lights.0.directional",
    examples: &[A_DIRECTIONAL],
    notes: "",
};

pub static SUN: Section = Section {
    path: "lights.N.sun",
    heading: "`sun = { … }`",
    summary: "a disk of light far away",
    about: "",
    keys: &[
        TRAVEL.unless("`azimuth` and `elevation`, or `date`, `latitude` and `longitude`"),
        Key::required("azimuth", Number, "Where it stands: from north over east.")
            .unit("degrees")
            .range("[-360, 360]")
            .unless(OTHERWISE_PLACED),
        Key::required("elevation", Number, "How far above the horizon; below 0 with a warning.")
            .unit("degrees")
            .range("[-90, 90]")
            .unless(OTHERWISE_PLACED),
        Key::required("date", Text, "A day, a time and its offset from UTC, as RFC 3339 writes them.")
            .or("a date of TOML")
            .unless(OTHERWISE_PLACED),
        Key::required("latitude", Number, "North of the equator.")
            .unit("degrees")
            .range("[-90, 90]")
            .unless(OTHERWISE_PLACED),
        Key::required("longitude", Number, "East of Greenwich.")
            .unit("degrees")
            .range("[-180, 180]")
            .unless(OTHERWISE_PLACED),
        Key::optional(
            "north",
            Direction,
            "`[0, 0, -1]`, or `[0, 1, 0]` where `up` is +z or -z",
            "Where north is in the scene; what is not level of it is left out.",
        )
        .range("not parallel to `up`"),
        Key::default("up", Direction, "[0, 1, 0]", "Where the zenith is."),
        Key::optional(
            "angular_radius",
            Number,
            "0.2665, of a date that divided by the distance",
            "From its centre to its rim.",
        )
        .unit("degrees")
        .range("[0.001, 90]"),
        IRRADIANCE,
    ],
    later: &[],
    at: "lights.0.sun",
    examples: &[A_SUN, A_HIGH_SUN, A_SUN_OF_A_DAY],
    notes: "Its radiance is the same all over the disk. By date it stands where the solar position algorithm of Reda and \
            Andreas (2004) has it, within 0.001 degrees, seen from sea level without the refraction of the air, which \
            lifts it by 0.01 degrees at an elevation of 60, by 0.1 at 10, by half a degree at the horizon. The \
            standards `\"am0\"` and `\"am1.5\"` are divided by the square of that day's distance in astronomical units \
            (3 % more in January, 3 % less in July); an irradiance of your own is taken as it is.",
};

pub static ENVIRONMENT: Section = Section {
    path: "environment",
    heading: "`[environment]`",
    summary: "light from all around",
    about: "The radiance that arrives from every direction in which nothing is met: the same from everywhere, or a map.",
    keys: &[
        Key::one_of("radiance", Spectrum(Quantity::Radiance), "The same from everywhere."),
        Key::one_of("map", File, "A map in longitude and latitude; see [Environment maps](#environment-maps)."),
        Key::one_of("temperature", Number, "The same from everywhere: Planck's radiance, times `scale`.")
            .or(CELSIUS)
            .unit("K")
            .range("(0, 1e9]"),
        Key::default(
            "up",
            Direction,
            "[0, 1, 0]",
            "Where the top row of the map is. The map is turned there from +y by the shortest way; to -y, by half a \
             turn about +x.",
        ),
        Key::default(
            "rotate_degrees",
            Number,
            "0.0",
            "Then turns it about `up`, counter-clockwise as seen from above.",
        )
        .unit("degrees"),
        Key::default("scale", Number, "1.0", "Multiplies the radiance.").range("[0, ∞)"),
    ],
    later: &[],
    at: "environment",
    examples: &[
        r#"
[environment]
map = "sky.exr"
up = [0, 0, 1]
rotate_degrees = 90
scale = 0.5
"#,
        "
[environment]
radiance = { blackbody = 5778, scale = 1e-6 }
",
        r#"
[environment]
temperature = "15 C"
scale = 0.8
"#,
    ],
    notes: "",
};
