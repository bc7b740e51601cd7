//! Spectra: numbers over wavelength.

use super::Kind::{Choice, File, List, Name, Number, Table, Text};
use super::{Key, Section};
use crate::spectral::illuminant::ILLUMINANTS;

pub static SPECTRUM: Section = Section {
    path: "spectra.NAME",
    heading: "`[spectra.NAME]`, or `{ … }` in the place of a spectrum",
    summary: "a spectrum, from a file, numbers, a temperature or a colour",
    about: "Wherever this page says *spectrum* stands one of three: a number, the same at all wavelengths; the name \
            of one of `[spectra]`; or a table with the keys below. `[spectra]` has such tables, or numbers, under \
            names.",
    keys: &[
        Key::one_of(
            "file",
            File,
            "A table in a file: CSV, `.spd`, and what instruments and libraries write; see [Files of \
             spectra](#files-of-spectra).",
        ),
        Key::one_of("constant", Number, "The same at all wavelengths.").range("as the quantity allows"),
        Key::one_of(
            "blackbody",
            Number,
            "Planck's spectral radiance at this temperature, in W m⁻² sr⁻¹ nm⁻¹, whatever the quantity's unit. Not \
             for indices and absorption.",
        )
        .unit("K")
        .range("(0, ∞)"),
        Key::one_of(
            "samples",
            List("list of `[nm, value]`"),
            "Two or more, linear between. Two equal wavelengths make a step.",
        )
        .unit("nm and the quantity's")
        .range("nm above 0, ascending"),
        Key::one_of("regular", Table, "Values at wavelengths of equal distance, linear between.").tables(&[&REGULAR]),
        Key::one_of(
            "rgb",
            List("`[r, g, b]`"),
            "A colour in linear sRGB. A reflectance is the smoothest spectrum of that colour; light is a smooth \
             spectrum times the daylight D65, `[1, 1, 1]` with luminance Y = 1. Not for indices and absorption.",
        )
        .range("as the quantity allows"),
        Key::one_of(
            "illuminant",
            Choice(&ILLUMINANTS),
            "Light distributed as that of an illuminant of the CIE, 1 at 560 nm: incandescent light A; daylight C and D; E, the same \
             everywhere; fluorescent lamps FL; discharge lamps HP; LEDs. Zero beyond its table, 300 to 830 nm (A), 300 to 780 nm \
             (daylight), 380 to 780 nm (lamps). For light only.",
        ),
        Key::one_of(
            "named",
            Name("spectrum"),
            "That one of `[spectra]`, times `scale`. For `spectile relight` it is the one that the cube was rendered with.",
        ),
        Key::one_of(
            "mix",
            List("list of two spectra"),
            "The sum of both, by `share`. Exact where both are lines; black bodies are lines at so many wavelengths of the channels that \
             they are right to 1e-6.",
        ),
        Key::default("share", Number, "0.5", "Of the second spectrum of a `mix`; the first one has the rest. With `mix` only.")
            .range("[0, 1]"),
        Key::optional(
            "column",
            Text,
            "the only one",
            "Which column of the file, by the name that its header gives it or by its number (1 is that of the \
             wavelengths); which spectrum of a library, by name or number; `\"n\"` or `\"k\"` of a refractiveindex.info \
             file, of which `\"n\"` is the default. With `file` only.",
        )
        .or("whole number"),
        Key::optional(
            "unit",
            Text,
            "as the header says, else nm",
            "The unit of the first column of text in columns: nm, um, angstrom, cm-1, THz, eV and others, see [Files of \
             spectra](#files-of-spectra). With `file` only, and not with files that say it by themselves.",
        ),
        Key::default("scale", Number, "1.0", "Multiplies all values. With any source.").range("[0, ∞)"),
        Key::optional(
            "outside",
            Choice(&["zero", "hold"]),
            "by what it describes",
            "What holds beyond the ends of the table: nothing, or its first and last value. Without effect on \
             constants, black bodies, illuminants, named spectra and mixtures, which is said.",
        ),
    ],
    later: &[],
    at: "spectra.lamp",
    examples: &[
        r#"
[spectra.lamp]
file = "spectra/lamp.csv"
column = "warm"
unit = "um"
scale = 0.001
outside = "zero"
"#,
        "
[spectra.lamp]
constant = 0.5
",
        "
[spectra.lamp]
blackbody = 5778
scale = 6.8e-5                         # the sun's irradiance above the air: its disk has 6.8e-5 sr
",
        r#"
[spectra.lamp]
samples = [[400, 0.1], [550, 0.9], [700, 0.8]]
outside = "hold"
"#,
        "
[spectra.lamp]
regular = { from = 400, to = 700, values = [0.1, 0.4, 0.9, 0.8] }
",
        "
[spectra.lamp]
rgb = [0.8, 0.1, 0.1]
",
        r#"
[spectra.lamp]
illuminant = "D65"
scale = 0.01
"#,
        r#"
[spectra]
daylight = { illuminant = "D50", scale = 0.02 }
lamp = { named = "daylight", scale = 0.5 }
"#,
        r#"
[spectra]
tubes = { illuminant = "FL11", scale = 0.1 }
lamp = { mix = ["tubes", { blackbody = 2700, scale = 1e-5 }], share = 0.3 }
"#,
        r#"
[materials.red.diffuse]
reflectance = { file = "paints.csv", column = "red" }      # the same keys where it is used

[spectra]
half = 0.5                             # a number is a spectrum too
"#,
    ],
    notes: "",
};

pub static REGULAR: Section = Section {
    path: "spectra.NAME.regular",
    heading: "`regular = { … }`",
    summary: "values at equal distances of wavelength",
    about: "",
    keys: &[
        Key::required("from", Number, "The wavelength of the first value.").unit("nm").range("(0, ∞), less than `to`"),
        Key::required("to", Number, "That of the last one.").unit("nm").range("(0, ∞), more than `from`"),
        Key::required("values", List("list of numbers"), "Two or more.").unit("the quantity's"),
    ],
    later: &[],
    at: "spectra.paint.regular",
    examples: &["
[spectra.paint.regular]
from = 400
to = 700
values = [0.1, 0.4, 0.9, 0.8]
"],
    notes: "",
};
