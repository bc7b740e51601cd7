//! Readers and writers of other people's formats; they know no GPU.

pub mod asd;
pub mod csv_table;
pub mod envi;
pub mod gltf;
pub mod image;
pub mod instrument;
pub mod library;
pub mod maps;
pub mod mesh;
pub mod modtran;
pub mod noise;
pub mod obj;
pub mod phase;
pub mod plot;
pub mod ply;
pub mod png;
pub mod polygon;
pub mod primaries;
pub mod refractive;
pub mod response;
pub mod stl;
pub mod table;
pub mod text;
pub mod unit;
pub mod volume;
pub mod zarr;
