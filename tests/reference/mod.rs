//! The f64 reference path tracer against closed forms.

mod light;
mod surfaces;
