//! What a detector behind optics makes of a cube: electrons or watts, noise, counts.
//!
//! `radiometry` is optics and detector as weights of channels; `noise` the random numbers, by seed, pixel and band; `detect`
//! signal to counts; `figures` noise-equivalent differences in closed form; `apply` a cube, tile by tile; `store` what is written.

mod apply;
mod detect;
mod figures;
mod noise;
mod radiometry;
mod store;
#[cfg(test)]
mod tests;

pub use apply::{Applied, BandReport, Settings, apply};
pub use detect::{Clipped, Electronics};
pub use figures::Figures;
pub use noise::Stream;
pub use radiometry::{Bands, Optical};
