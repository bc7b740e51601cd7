//! What a spectrum is of.

use crate::format::noise::Range;
use crate::format::said::Said;
use crate::format::unit::Kind;
use crate::spectral::Outside;

/// Sums and products of a few radiances beyond this leave f32.
const BRIGHTEST: f64 = 1e35;
/// Far above any index of refraction (200 or so in metals at 20 um) and its squares far inside f32.
const DENSEST: f64 = 1e3;
/// Opaque within any distance that matters, and far inside f32 times one.
const MOST_ABSORBING: f64 = 1e15;

/// What a spectrum describes: decides the allowed values, what a table means beyond its ends, and what `rgb` is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Dimensionless, in [0, 1]; held beyond its table, with a warning.
    Reflectance,
    /// What passes through; as [`Quantity::Reflectance`].
    Transmittance,
    /// What a detector absorbs; as [`Quantity::Reflectance`].
    Absorptance,
    /// Electrons a photon: dimensionless, in [0, 1]; zero beyond its table, with a warning, since detectors end there.
    Efficiency,
    /// What a surface emits of what a black body does: as [`Quantity::Reflectance`], of which it is the complement.
    Emissivity,
    /// W m⁻² sr⁻¹ nm⁻¹, not negative; zero beyond its table.
    Radiance,
    /// Of a point light, W sr⁻¹ nm⁻¹; as [`Quantity::Radiance`].
    Intensity,
    /// Of a light far away, W m⁻² nm⁻¹ on a plane facing it; as [`Quantity::Radiance`].
    Irradiance,
    /// Of refraction: dimensionless, above 0; held beyond its table, with a warning.
    Index,
    /// Of a coat: at least 1; otherwise as [`Quantity::Index`].
    CoatIndex,
    /// Imaginary part of a complex index, not negative; held beyond its table, with a warning.
    Extinction,
    /// Of a gas: m⁻¹ (and per atmosphere of a species), not negative; zero beyond its table, with a warning.
    Absorption,
    /// Of matter that scatters: m⁻¹, not negative; held beyond its table, with a warning.
    Scattering,
    /// The mean cosine g by which light is turned where it is scattered: dimensionless, in (-1, 1); held beyond its table, with a
    /// warning.
    Asymmetry,
}

impl Quantity {
    pub const ALL: [Quantity; 14] = [
        Quantity::Reflectance,
        Quantity::Transmittance,
        Quantity::Absorptance,
        Quantity::Efficiency,
        Quantity::Emissivity,
        Quantity::Radiance,
        Quantity::Intensity,
        Quantity::Irradiance,
        Quantity::Index,
        Quantity::CoatIndex,
        Quantity::Extinction,
        Quantity::Absorption,
        Quantity::Scattering,
        Quantity::Asymmetry,
    ];

    /// Whether it is light itself rather than what becomes of light.
    pub fn is_light(self) -> bool {
        matches!(self, Quantity::Radiance | Quantity::Intensity | Quantity::Irradiance)
    }

    /// Whether it is an emissivity, an index of refraction or something of matter, which no temperature and no colour makes.
    pub fn is_index(self) -> bool {
        !self.is_made_of_light() && !self.is_light()
    }

    /// Whether it is a share of light that is not that of an emissivity.
    fn is_made_of_light(self) -> bool {
        matches!(self, Quantity::Reflectance | Quantity::Transmittance | Quantity::Absorptance | Quantity::Efficiency)
    }

    /// Whether values that their file calls `said` can be of it.
    pub(super) fn may_be(self, said: Said) -> bool {
        match self {
            Quantity::Reflectance => said == Said::Reflectance,
            Quantity::Transmittance => said == Said::Transmittance,
            Quantity::Absorptance => matches!(said, Said::Absorptance | Said::Absorption | Said::Emissivity),
            Quantity::Emissivity => matches!(said, Said::Emissivity | Said::Absorptance),
            // Files of filters and of windows before a detector are taken for what it counts.
            Quantity::Efficiency => {
                matches!(said, Said::Efficiency | Said::Transmittance | Said::Absorptance | Said::Absorption)
            }
            Quantity::Radiance => said == Said::Radiance,
            Quantity::Irradiance => said == Said::Irradiance,
            Quantity::Intensity => false,
            // Of a gas that does not scatter they are one.
            Quantity::Absorption => matches!(said, Said::Absorption | Said::Attenuation),
            Quantity::Scattering => said == Said::Scattering,
            Quantity::Index | Quantity::CoatIndex => said == Said::Index,
            Quantity::Extinction => matches!(said, Said::Extinction | Said::Kay | Said::Attenuation),
            Quantity::Asymmetry => false,
        }
    }

    /// Whether it is a share.
    fn is_share(self) -> bool {
        self.is_made_of_light() || self == Quantity::Emissivity
    }

    /// Whether it is n or k.
    pub(super) fn is_optical_constant(self) -> bool {
        matches!(self, Quantity::Index | Quantity::CoatIndex | Quantity::Extinction)
    }

    pub(super) fn default_outside(self) -> Outside {
        let is_zero = self.is_light() || matches!(self, Quantity::Absorption | Quantity::Efficiency);
        if is_zero { Outside::Zero } else { Outside::Hold }
    }

    /// Empty where it has none.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Radiance => "W m⁻² sr⁻¹ nm⁻¹",
            Quantity::Intensity => "W sr⁻¹ nm⁻¹",
            Quantity::Irradiance => "W m⁻² nm⁻¹",
            Quantity::Absorption | Quantity::Scattering => "m⁻¹",
            Quantity::Reflectance
            | Quantity::Transmittance
            | Quantity::Absorptance
            | Quantity::Efficiency
            | Quantity::Emissivity
            | Quantity::Index
            | Quantity::CoatIndex
            | Quantity::Extinction
            | Quantity::Asymmetry => "",
        }
    }

    /// What holds beyond the ends of a table, in words.
    pub fn beyond_words(self) -> &'static str {
        match (self.default_outside(), self.is_light()) {
            (Outside::Hold, _) => "its first and last value are held, with a warning",
            (Outside::Zero, true) => "zero",
            (Outside::Zero, false) => "zero, with a warning",
        }
    }

    pub fn noun(self) -> &'static str {
        match self {
            Quantity::Reflectance => "a reflectance",
            Quantity::Transmittance => "a transmittance",
            Quantity::Absorptance => "an absorptance",
            Quantity::Efficiency => "a quantum efficiency",
            Quantity::Emissivity => "an emissivity",
            Quantity::Radiance => "a radiance",
            Quantity::Intensity => "an intensity",
            Quantity::Irradiance => "an irradiance",
            Quantity::Index => "an index of refraction",
            Quantity::CoatIndex => "the index of refraction of a coat",
            Quantity::Extinction => "an extinction coefficient k",
            Quantity::Absorption => "an absorption coefficient",
            Quantity::Scattering => "a scattering coefficient",
            Quantity::Asymmetry => "an asymmetry g",
        }
    }

    pub fn allows(self, value: f64) -> bool {
        match self {
            _ if self.is_share() => (0.0..=1.0).contains(&value),
            Quantity::Radiance | Quantity::Intensity | Quantity::Irradiance => (0.0..=BRIGHTEST).contains(&value),
            Quantity::Index => value > 0.0 && value <= DENSEST,
            Quantity::CoatIndex => (1.0..=DENSEST).contains(&value),
            Quantity::Extinction => (0.0..=DENSEST).contains(&value),
            Quantity::Absorption | Quantity::Scattering => (0.0..=MOST_ABSORBING).contains(&value),
            _ => value > -1.0 && value < 1.0,
        }
    }

    /// What measured values of it may be but for noise; `None` where there is no bound that noise could cross.
    pub(super) fn noise(self) -> Option<Range> {
        match self {
            _ if self.is_share() => Some(Range::Share),
            Quantity::Extinction => Some(Range::Extinction),
            Quantity::Index | Quantity::CoatIndex | Quantity::Asymmetry => None,
            _ => Some(Range::NotNegative),
        }
    }

    /// What units of it are.
    pub(super) fn kind(self) -> Kind {
        match self {
            Quantity::Radiance => Kind::Radiance,
            Quantity::Intensity => Kind::Intensity,
            Quantity::Irradiance => Kind::Irradiance,
            Quantity::Absorption | Quantity::Scattering => Kind::Absorption,
            _ => Kind::Number,
        }
    }

    /// The values that are allowed.
    pub fn interval(self) -> &'static str {
        match self {
            _ if self.is_share() => "[0, 1]",
            Quantity::Radiance | Quantity::Intensity | Quantity::Irradiance => "[0, 1e35]",
            Quantity::Index => "(0, 1000]",
            Quantity::CoatIndex => "[1, 1000]",
            Quantity::Extinction => "[0, 1000]",
            Quantity::Absorption | Quantity::Scattering => "[0, 1e15]",
            _ => "(-1, 1)",
        }
    }

    pub fn range(self) -> String {
        format!("{} must lie in {}", self.noun(), self.interval())
    }
}
