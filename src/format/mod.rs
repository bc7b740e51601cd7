//! Readers and writers of other people's formats; they know no GPU.

pub mod image;
pub mod maps;
pub mod obj;
pub mod plot;
pub mod png;
pub mod refractive;
pub mod text;
pub mod volume;
