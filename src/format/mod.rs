//! Readers and writers of other people's formats; they know no GPU.

pub mod csv_table;
pub mod envi;
pub mod image;
pub mod library;
pub mod maps;
pub mod modtran;
pub mod obj;
pub mod plot;
pub mod png;
pub mod refractive;
pub mod response;
pub mod text;
pub mod volume;
