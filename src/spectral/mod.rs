//! Spectra, channels, Planck's law and colour, in f64 nanometres.

pub mod channels;
pub mod curve;
pub mod planck;
pub mod upsample;

pub use channels::Channels;
pub use curve::{Curve, Outside};
