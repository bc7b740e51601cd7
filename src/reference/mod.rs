//! A small, plain, independent f64 path tracer on the CPU that every shader result is tested against.
//! Shares `scene` and `spectral` with the renderer and nothing else.
