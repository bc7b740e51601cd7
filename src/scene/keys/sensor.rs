//! What a sensor model's file may contain.

use super::Kind::{Boolean, Choice, File, ListOfTables, Number, Spectrum, Table, Text, Whole};
use super::{Key, Section};
use crate::scene::Quantity::{Absorptance, Efficiency, Transmittance};

const fn section(path: &'static str, keys: &'static [Key], later: &'static [&'static str]) -> Section {
    Section { path, heading: path, summary: "", about: "", keys, later, at: "", examples: &[], notes: "" }
}

pub static SENSOR: Section = section(
    "sensor",
    &[
        Key::required("optics", Table, "What is in front of the detector."),
        Key::required("detector", Table, "What makes counts of light."),
        Key::optional("bands", ListOfTables, "one band over all channels", "Intervals of wavelength."),
        Key::optional("responses", File, "none", "A file with a response for each band, instead of `bands`."),
        Key::default("reference_temperature", Number, "300.0", "Of the black body that NETD is told for.").unit("K"),
        Key::optional("spectra", super::Kind::NamedTables, "none", "Spectra that others name."),
    ],
    &[],
);

pub static OPTICS: Section = section(
    "optics",
    &[
        Key::optional("f_number", Number, "focal_length / aperture", "Focal length over aperture.").range("[0.5, inf)"),
        Key::optional("aperture", Number, "from `f_number`", "Diameter of the entrance pupil.").unit("m"),
        Key::optional("focal_length", Number, "not needed beside `f_number`", "Focal length.").unit("m"),
        Key::default("transmittance", Spectrum(Transmittance), "1.0", "What the optics let through."),
        Key::default("cos4", Boolean, "false", "Whether irradiance falls as cos⁴ of the angle to the axis."),
        Key::optional("temperature", Number, "they emit nothing", "Of the optics, which emit what they absorb.")
            .unit("K"),
        Key::optional("cold_shield", Number, "none: the hemisphere", "F-number of the cone that warm optics fill."),
        Key::default(
            "psf",
            Choice(&["none", "gaussian", "diffraction"]),
            "\"none\"",
            "How optics blur: the point spread function.",
        ),
        Key::optional("psf_sigma", Number, "a Gaussian needs it", "Standard deviation of a Gaussian, along each axis.")
            .unit("pixels"),
        Key::optional("mtf", File, "none", "A measured transfer function of modulation, in the place of `psf`."),
    ],
    &[],
);

pub static DETECTOR: Section = section(
    "detector",
    &[
        Key::default("kind", Choice(&["photon", "thermal"]), "\"photon\"", "What it counts."),
        Key::required("pitch", Number, "Side of a square pixel.")
            .unless("`focal_length` on a cube that tells its camera's angle")
            .unit("m")
            .range("(0, 0.1]"),
        Key::default("oversampling", Whole, "1", "Pixels of the cube, along each axis, that make one of the detector.")
            .range("[1, 64]"),
        Key::default("fill_factor", Number, "1.0", "Share of a pixel that is sensitive.").range("(0, 1]"),
        Key::required("bits", Whole, "Of the converter.").range("[1, 24]"),
        Key::default("offset", Number, "0.0", "Counts without light."),
        Key::default("prnu", Number, "0.0", "Standard deviation of the response over pixels.").range("[0, 0.1]"),
        Key::default("dsnu", Number, "0.0", "Standard deviation of the dark signal over pixels: electrons, or counts."),
        Key::default("pattern_seed", Whole, "0", "Of both patterns, the same in every exposure."),
        Key::optional("integration_time", Number, "photon detectors need it", "Exposure.").unit("s"),
        Key::optional("quantum_efficiency", Spectrum(Efficiency), "photon detectors need it", "Electrons a photon."),
        Key::default("dark_current", Number, "0.0", "At the temperature of operation.").unit("electrons/s"),
        Key::optional("full_well", Number, "no limit", "Electrons that a pixel holds."),
        Key::default("read_noise", Number, "0.0", "Standard deviation.").unit("electrons"),
        Key::optional("gain", Number, "photon detectors need it", "Electrons a count."),
        Key::optional("responsivity", Number, "thermal detectors need it", "Counts a watt on the sensitive area."),
        Key::optional("noise_equivalent_power", Number, "thermal detectors need it", "Standard deviation.").unit("W"),
        Key::default("absorptance", Spectrum(Absorptance), "1.0", "Of thermal detectors."),
    ],
    &[],
);

pub static BAND: Section = section(
    "bands",
    &[
        Key::required("name", Text, "Its name."),
        Key::optional("from", Number, "`response` stands in", "Lower end.").unit("nm"),
        Key::optional("to", Number, "`response` stands in", "Upper end.").unit("nm"),
        Key::optional("response", File, "1 between `from` and `to`", "What the band responds to, by wavelength."),
    ],
    &[],
);
