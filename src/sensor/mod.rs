//! What a detector behind optics makes of a cube: electrons or watts, noise, counts.
//!
//! `radiometry` is optics and detector as weights of channels; `transfer` how optics blur, `planes` whole pictures blurred on disk by
//! `cosine` transforms; `noise` the random numbers, by seed, pixel and band; `detect` signal to counts; `figures` noise-equivalent
//! differences in closed form; `apply` a cube, tile by tile; `store` what is written.

mod apply;
mod cosine;
mod detect;
mod figures;
mod noise;
mod planes;
mod radiometry;
mod store;
#[cfg(test)]
mod tests;
mod transfer;

pub use apply::{Applied, BandReport, Settings, apply};
pub use detect::{Clipped, Electronics};
pub use figures::Figures;
pub use noise::Stream;
pub use radiometry::{Bands, Optical};
pub use transfer::{Transfer, TransferCurve, curves};
