//! Spectra, channels, Planck's law and colour, in f64 nanometres.

pub mod channels;
pub mod colour;
pub mod curve;
mod data;
pub mod planck;
pub mod table;
pub mod temperature;
pub mod upsample;

pub use channels::{Channels, Response};
pub use curve::{Curve, Outside};
