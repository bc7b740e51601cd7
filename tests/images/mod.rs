//! What devices render, against the f64 reference, closed forms and themselves.

mod against_reference;
mod convergence;
mod evaluators;
mod factored;
mod instances;
mod invariance;
mod leaves;
mod lights;
mod materials;
mod media;
mod opacity;
mod pictures;
mod remainder;
mod roughness;
mod roulette;
mod scattering;
mod spots;
mod techniques;
mod textures;
mod wavelengths;
