//! Cubes, and files of other programs: read, written and read back.

mod cube;
mod export;
mod imports;
mod interop;
mod outputs;
mod python;
mod refractive;
mod sensor;
mod sensor_blur;
mod sensor_model;
mod spoilt;
mod store;
