//! Matter that absorbs, scatters and emits.

use super::Kind::{File, ListOfTables, Number, Spectrum, Table};
use super::{CELSIUS, Key, Section};
use crate::scene::Quantity;

const NOTHING_ELSE: &str = "another of `absorption`, `species`, `scattering`, `components`";
const NO_OTHER: &str = "another of `absorption`, `species`, `scattering`";

const ABSORPTION: Key =
    Key::required("absorption", Spectrum(Quantity::Absorption), "Absorption coefficient at density 1.");
const GASES: Key =
    Key::required("species", ListOfTables, "Gases by tables over wavelength and temperature. Not beside `absorption`.");
const SCATTERING: Key =
    Key::required("scattering", Spectrum(Quantity::Scattering), "Scattering coefficient at density 1.");
const PHASE_KEY: Key =
    Key::optional("phase", Table, "the same in all directions", "Where scattered light goes. With `scattering` only.");
const PRESSURE: Key =
    Key::default("pressure", Number, "1.0", "Total pressure. With `species` only.").unit("atm").range("[0, ∞)");

pub static MEDIUM: Section = Section {
    path: "media.NAME",
    heading: "`[media.NAME]`",
    summary: "matter that fills space: absorbs, scatters, and emits where it is warm",
    about: "Objects name it as their `interior`, the camera as its `medium`. Its absorption coefficient, per metre, \
            is density x absorption, or density x pressure x the sum over its species of fraction x table; its scattering \
            coefficient is density x scattering. With a temperature it emits as much as it absorbs, times Planck's radiance. \
            Light that it scatters counts as a bounce ([METHOD.md](METHOD.md#matter-that-scatters)): clouds want many, \
            `integrator.max_bounces`, and `russian_roulette_start`.",
    keys: &[
        ABSORPTION.unless(NOTHING_ELSE),
        GASES.unless(NOTHING_ELSE).tables(&[&SPECIES]),
        SCATTERING.unless(NOTHING_ELSE),
        PHASE_KEY.tables(&[&PHASE]),
        PRESSURE,
        Key::required("components", ListOfTables, "Several kinds of matter in the same place, instead of the keys above.")
            .unless(NOTHING_ELSE)
            .tables(&[&COMPONENT]),
        Key::optional(
            "temperature",
            Number,
            "it does not emit",
            "Of all that is in it. Required where the table of a species has several columns. In grids 0 is allowed, and emits nothing.",
        )
        .or(CELSIUS)
        .unit("K")
        .range("(0, 1e9]")
        .tables(&[&GRID]),
        Key::default("density", Number, "1.0", "Relative: multiplies all absorption and scattering.")
            .range("[0, ∞)")
            .tables(&[&GRID]),
    ],
    later: &[],
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
        r#"
[media.plume]
scattering = { samples = [[400, 0.05], [700, 0.02]] }
phase = { hg = 0.7 }
"#,
        r#"
[media.plume]
density = 0.5

[[media.plume.components]]
scattering = 0.01
phase = { rayleigh = 0.0279 }

[[media.plume.components]]
scattering = 0.02
absorption = 0.001
phase = { hg = { samples = [[400, 0.75], [700, 0.65]] } }
density = { grid = "d.zarr" }
"#,
    ],
    notes: "Matter around the camera without an end (`medium`) must not scatter: give it a shape.",
};

pub static COMPONENT: Section = Section {
    path: "media.NAME.components.N",
    heading: "`[[media.NAME.components]]`",
    summary: "a kind of matter beside others in the same place",
    about: "As the keys of a medium with one kind of matter. The temperature belongs to the medium.",
    keys: &[
        ABSORPTION.unless(NO_OTHER),
        GASES.unless(NO_OTHER).tables(&[&SPECIES]),
        SCATTERING.unless(NO_OTHER),
        PHASE_KEY.tables(&[&PHASE]),
        PRESSURE,
        Key::optional("density", Number, "the medium's", "Relative, in the place of the medium's.")
            .range("[0, ∞)")
            .tables(&[&GRID]),
    ],
    later: &[],
    at: "media.haze.components.0",
    examples: &[
        r#"
[[media.haze.components]]
absorption = 0.002
density = 0.5
"#,
        r#"
[media.haze]
temperature = 288.0

[[media.haze.components]]
species = [{ table = "h2o.csv", fraction = 0.01 }]
pressure = 0.9
"#,
        r#"
[[media.haze.components]]
scattering = 0.02
phase = { hg = 0.7 }
"#,
    ],
    notes: "",
};

pub static PHASE: Section = Section {
    path: "phase",
    heading: "`phase = { … }`",
    summary: "where scattered light goes",
    about: "A function P of the angle by which light turns, whose mean over the sphere is 1.",
    keys: &[
        Key::one_of(
            "hg",
            Spectrum(Quantity::Asymmetry),
            "Henyey and Greenstein's, of mean cosine g: (1 - g²) / (1 + g² - 2 g cos θ)^1.5.",
        ),
        Key::one_of(
            "rayleigh",
            Number,
            "Rayleigh's, of this depolarisation factor ρ (air: 0.0279): 3 / (4 (1 + 2γ)) (1 + 3γ + (1 - γ) cos² θ), γ = ρ / (2 - ρ). \
             `scattering` is taken as given: the King factor is in it. Without polarisation, so that skies may be off by several \
             percent.",
        )
        .range("[0, 0.5]"),
        Key::one_of(
            "table",
            File,
            "CSV: a column of angles in degrees that ascend from 0 to 180, and one for each wavelength, whose header is that in nm: \
             `degrees,450,550,700`. Linear in degrees between rows and in nm between columns; the outermost columns hold beyond them, \
             with a warning. Each column is divided by its mean over the sphere, with a warning beyond 1 %.",
        ),
    ],
    later: &[],
    at: "media.haze.phase",
    examples: &[
        r#"
[media.haze]
scattering = 0.01
phase = { hg = 0.7 }
"#,
        r#"
[media.haze]
scattering = 0.01
phase = { rayleigh = 0.0279 }
"#,
        r#"
[media.haze]
scattering = 0.01
phase = { table = "mie.csv" }
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
             whose header is that in K: `nm,300,600,1000`; or of cross sections (`300 K (cm2/molecule)`), times \
             the molecules in a volume, p / (k T), T the gas's own (without one the column's). Between columns it is linear in temperature; beyond them \
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
            along x. A voxel has one value throughout. Where the grids of one medium differ in shape, their voxels are divided until they do not, which must not take more than 134,217,728.\n\nDimensions called z, \
            y and x may have any order, and coordinates that descend turn an array round; uneven ones are an error. \
            `units` of a temperature are K, or °C, which is converted; where there are none, a name may say it (`long_name` = \
            `Temperature (C)`). A density has none, and one that is called a temperature, a logarithm, an error or flags is an error. Negative values down to -1 % \
            of the peak become 0. The last two are told of. [Environment maps](#environment-maps) says what of Zarr is read.",
};
