//! How a scene is to be rendered.

use serde::{Deserialize, Serialize};

/// At how many wavelengths of a channel a path may be evaluated, at most.
pub const MOST_WAVELENGTHS: u32 = 16;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Integrator {
    /// Scattering events; next-event estimation at the last one included.
    pub max_bounces: u32,
    /// 0 = off; otherwise the first scattering event (1-based) at which roulette may end a path.
    pub russian_roulette_start: u32,
    pub sampler: Sampler,
    pub wavelengths: Wavelengths,
    /// At how many wavelengths of each channel a path is evaluated, a power of two up to 16; `None`: as a few samples of the scene tell
    /// before it is rendered. Cubes made before there was a choice say nothing of it, and have 1.
    #[serde(default = "one", with = "auto")]
    pub wavelengths_per_channel: Option<u32>,
    /// By how many techniques paths decide (docs/METHOD.md, Techniques), 1 to 16; `None`: as many as the scene's channels differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub techniques: Option<u32>,
    /// Whether a camera ray that leaves the scene through matter that scatters is always scattered there, with the weight of the chance of it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub forced_collision: bool,
    /// Which of a scene's paths are evaluated.
    pub evaluation: Evaluation,
    pub evaluator: Evaluator,
    /// Samples per pixel of a full epoch, a power of two up to 1,024.
    pub epoch: u32,
}

/// Which paths are evaluated: all have the same means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Evaluation {
    /// What pays, as a few samples of the scene tell before it is rendered.
    Auto,
    All,
    /// Those of little energy by chance.
    Roulette,
}

impl Evaluation {
    pub const ALL: [Evaluation; 3] = [Evaluation::Auto, Evaluation::All, Evaluation::Roulette];

    /// As scene files have it.
    pub fn name(self) -> &'static str {
        match self {
            Evaluation::Auto => "auto",
            Evaluation::All => "all",
            Evaluation::Roulette => "roulette",
        }
    }
}

/// How channels are evaluated along paths. All trace the same paths and differ in rounding only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Evaluator {
    /// What is fastest on the device, by a fixed rule of its kind and the number of channels (`device::evaluator`).
    Auto,
    /// Deferred: a thread takes some channels of a pixel along all its saved paths.
    DpeptPixel,
    /// Deferred: a thread takes all channels of a saved path, batch by batch (Hoarau et al. 2018, section 5.1).
    DpeptPath,
    /// Deferred: the threads of a workgroup take different channels of the same saved path (Hoarau et al. 2018, section 5.2).
    DpeptSpectral,
    /// The conventional path tracer: all channels of all paths in memory, updated at every bounce (Hoarau et al. 2018, section 4).
    Pt,
    /// None: weights of products of spectra are kept, from which any channels follow (`render --factored`).
    Factored,
}

impl Evaluator {
    /// Those that a scene may ask for.
    pub const ALL: [Evaluator; 5] =
        [Evaluator::Auto, Evaluator::DpeptPixel, Evaluator::DpeptPath, Evaluator::DpeptSpectral, Evaluator::Pt];

    /// Whether a dispatch takes one sample of every pixel, instead of all that are there.
    pub fn takes_one_sample(self) -> bool {
        matches!(self, Evaluator::DpeptPath | Evaluator::DpeptSpectral)
    }

    /// The one of this name, but for `auto`, which is none.
    pub fn named(name: &str) -> Option<Evaluator> {
        Evaluator::ALL[1..].iter().copied().find(|evaluator| evaluator.name() == name)
    }

    /// As scenes write it.
    pub fn name(self) -> &'static str {
        match self {
            Evaluator::Auto => "auto",
            Evaluator::DpeptPixel => "dpept-pixel",
            Evaluator::DpeptPath => "dpept-path",
            Evaluator::DpeptSpectral => "dpept-spectral",
            Evaluator::Pt => "pt",
            Evaluator::Factored => "factored",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampler {
    Sobol,
    Independent,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wavelengths {
    /// Evenly over each channel: Eq. 4 of Hoarau et al. 2018.
    Uniform,
    /// From the emitters' own spectral density in each channel, see [`crate::spectral::warp`].
    Emission,
}

fn is_false(value: &bool) -> bool {
    !value
}

fn one() -> Option<u32> {
    Some(1)
}

/// A number, or `"auto"`.
mod auto {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Written {
        Number(u32),
        Word(String),
    }

    pub fn serialize<S: Serializer>(number: &Option<u32>, to: S) -> Result<S::Ok, S::Error> {
        number.map_or_else(|| Written::Word("auto".into()), Written::Number).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<u32>, D::Error> {
        match Written::deserialize(from)? {
            Written::Number(number) => Ok(Some(number)),
            Written::Word(word) if word == "auto" => Ok(None),
            Written::Word(word) => Err(D::Error::custom(format!("{word:?} is neither a number nor \"auto\""))),
        }
    }
}
