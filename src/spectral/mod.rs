//! Spectra, channels, Planck's law and colour, in f64 nanometres.

pub mod channels;
pub mod colour;
pub mod curve;
mod data;
mod derived;
pub mod hemisphere;
pub mod illuminant;
pub mod kinks;
pub mod knots;
pub mod lab;
pub mod planck;
pub mod product;
pub mod skylight;
pub mod table;
pub mod temperature;
pub mod tone;
pub mod upsample;
pub mod warp;

pub use channels::{Channels, Response, hull};
pub use curve::{Curve, Outside};
pub use data::{D65, SOLAR, columns};
