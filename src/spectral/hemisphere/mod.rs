//! What is known of a material before a path meets it: tables of directional albedos and of decision probabilities.
//!
//! Data for whoever scatters light, on a device or in `reference`; nothing here evaluates or samples a BSDF. Directions
//! are local: z along the normal on the side of the observer, so that `z` is the cosine. Albedos are of *flux*; where
//! light crosses a boundary, radiance changes by the square of the relative index besides.

mod decision;
mod facet_cosines;
pub mod fresnel;
mod microfacet;

pub use decision::{ReflectionProbability, index_range};
pub use facet_cosines::{FACET_COSINES, FacetCosines, facet_cosine};
pub use microfacet::{DielectricAlbedo, ReflectionAlbedo};
