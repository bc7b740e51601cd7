//! What each part of the renderer is on a device: its rows of [`PARTS`](crate::device::part::PARTS), and how the scene is flattened for
//! it; its WGSL stands in the folder of the same name in `shaders/parts/`.

pub mod attributes;
pub mod by_technique;
pub mod camera;
pub mod crossings;
pub mod geometry;
pub mod heat;
pub mod instances;
pub mod layers;
pub mod lights;
mod lobe_choice;
mod lobes;
pub mod media;
pub mod opacity;
pub mod origins;
pub mod paths;
pub mod radiators;
pub mod remainder;
pub mod roughness;
pub mod scattering;
pub mod sky;
pub mod spectra;
pub mod surfaces;
pub mod techniques;
pub mod textures;
