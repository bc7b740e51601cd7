//! Gases that absorb and emit.

use super::Kind::{File, ListOfTables, Number, Spectrum};
use super::{CELSIUS, Key, Section};
use crate::scene::Quantity;

pub static MEDIUM: Section = Section {
    path: "media.NAME",
    heading: "`[media.NAME]`",
    summary: "matter that fills space: absorbs, and emits where it is warm",
    about: "Objects name it as their `interior`, the camera as its `medium`. Its absorption coefficient, per metre, \
            is density x absorption, or density x pressure x the sum over its species of fraction x table. With a \
            temperature it emits as much as it absorbs, times Planck's radiance.",
    keys: &[
        Key::one_of("absorption", Spectrum(Quantity::Absorption), "Absorption coefficient at density 1."),
        Key::one_of("species", ListOfTables, "Gases by tables over wavelength and temperature.").tables(&[&SPECIES]),
        Key::default("pressure", Number, "1.0", "Total pressure. With `species` only.").unit("atm").range("[0, ∞)"),
        Key::optional(
            "temperature",
            Number,
            "it does not emit",
            "Required where the table of a species has several columns. In grids 0 is allowed, and emits nothing.",
        )
        .or(CELSIUS)
        .unit("K")
        .range("(0, 1e9]")
        .tables(&[&GRID]),
        Key::default("density", Number, "1.0", "Relative: multiplies all absorption.").range("[0, ∞)").tables(&[&GRID]),
    ],
    later: &["scattering", "phase_g"],
    at: "media.plume",
    examples: &[
        r#"
[media.plume]
absorption = { samples = [[400, 0.02], [700, 0.01]] }
temperature = 900.0
density = 1.0
"#,
        r#"
[media.plume]
species = [
    { table = "co2.csv", fraction = 0.05 },
    { table = "h2o.csv", fraction = 0.06 },
]
pressure = 1.0
temperature = { grid = "t.zarr" }
density = { grid = "d.zarr" }
"#,
    ],
    notes: "",
};

pub static SPECIES: Section = Section {
    path: "media.NAME.species.N",
    heading: "`species = [{ … }]`",
    summary: "a gas by its table",
    about: "",
    keys: &[
        Key::required(
            "table",
            File,
            "CSV of the absorption coefficient in m⁻¹ atm⁻¹: a column of wavelengths, and one for each temperature, \
             whose header is that in K: `nm,300,600,1000`; or of cross sections (`300 K (cm2/molecule)`), which become that. Between columns it is linear in temperature; beyond them \
             the nearest holds, with a warning. One column holds at all temperatures.",
        ),
        Key::required("fraction", Number, "Share of the volume (mole fraction). Those of a medium sum to 1 at most.")
            .range("[0, 1]"),
    ],
    later: &[],
    at: "media.plume.species.0",
    examples: &[r#"
[media.plume]
temperature = 900.0

[[media.plume.species]]
table = "co2.csv"
fraction = 0.05
"#],
    notes: "",
};

pub static GRID: Section = Section {
    path: "grid",
    heading: "`{ grid = … }`",
    summary: "a temperature or density that differs from place to place",
    about: "In the place of a medium's `temperature` or `density`, but not of one that fills all space.",
    keys: &[Key::required(
        "grid",
        File,
        "The folder of a Zarr array [z, y, x], version 2 or 3, of real numbers that are finite and not negative; of \
         one in a group, `\"file.zarr/name\"`. Up to 268,435,456 voxels.",
    )],
    later: &[],
    at: "media.plume.density",
    examples: &[r#"
[media.plume]
absorption = 0.5
temperature = 1200.0

[media.plume.density]
grid = "d.zarr"
"#],
    notes: "The array fills the bounding box of the object that the medium is in, in the object's own coordinates, so \
            that `transform` carries it along: its first number is at the least x, y and z, and the last index runs \
            along x. A voxel has one value throughout. The grids of one medium have one shape.\n\nDimensions called z, \
            y and x may have any order, and coordinates that descend turn an array round; uneven ones are an error. \
            `units` of a temperature are K, or °C, which is converted; a density has none. Negative values down to -1 % \
            of the peak become 0. The last two are told of. [Environment maps](#environment-maps) says what of Zarr is read.",
};
