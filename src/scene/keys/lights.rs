//! Light that comes from no surface.

use super::Kind::{Direction, File, Number, Spectrum, Table, Vector};
use super::{Key, Section};
use crate::scene::Quantity;

pub static LIGHT: Section = Section {
    path: "lights.N",
    heading: "`[[lights]]`",
    summary: "light from a point, a direction or a sun",
    about: "A light has one of three kinds. Lamps with a surface are objects with `emission`.",
    keys: &[
        Key::one_of("point", Table, "Shines from a point, the same in all directions.").tables(&[&POINT]),
        Key::one_of("directional", Table, "Parallel light from far away.").tables(&[&DIRECTIONAL]),
        Key::one_of("sun", Table, "Light from a disk far away, which the camera sees and whose shadows are soft.")
            .tables(&[&SUN]),
    ],
    later: &[],
    at: "lights.0",
    examples: &[A_POINT, A_DIRECTIONAL, A_SUN],
    notes: "Points and directional light are seen neither by the camera nor in smooth mirrors; suns are. `direction` \
            is where light *travels*: a sun in the zenith has `[0, -1, 0]` in scenes whose up is +y, `[0, 0, -1]` \
            where it is +z.",
};

const A_POINT: &str = r#"
[[lights]]
point = { position = [2, -2, 4], intensity = { blackbody = 3000, scale = 1e-3 } }
"#;
const A_DIRECTIONAL: &str = r#"
[[lights]]
directional = { direction = [1, 1, -2], irradiance = 1.5 }
"#;
const A_SUN: &str = r#"
[[lights]]
sun = { direction = [0.5, 0, -0.866], angular_radius = 0.2665, irradiance = { file = "spectra/sun.csv" } }
"#;

const TRAVEL: Key = Key::required("direction", Direction, "The direction that its light travels in: away from it.");
const IRRADIANCE: Key =
    Key::required("irradiance", Spectrum(Quantity::Irradiance), "On a plane that faces it, with nothing between.");

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
        TRAVEL,
        Key::required("angular_radius", Number, "From its centre to its rim; the sun's is 0.2665.")
            .unit("degrees")
            .range("[0.001, 90]"),
        IRRADIANCE,
    ],
    later: &[],
    at: "lights.0.sun",
    examples: &[A_SUN],
    notes: "Its radiance is the same all over the disk.",
};

pub static ENVIRONMENT: Section = Section {
    path: "environment",
    heading: "`[environment]`",
    summary: "light from all around",
    about: "The radiance that arrives from every direction in which nothing is met: the same from everywhere, or a map.",
    keys: &[
        Key::one_of("radiance", Spectrum(Quantity::Radiance), "The same from everywhere."),
        Key::one_of("map", File, "A map in longitude and latitude; see [Environment maps](#environment-maps)."),
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
    ],
    notes: "",
};
