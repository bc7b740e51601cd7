//! What is known of a material before a path meets it: tables of directional albedos and of decision probabilities.
//!
//! Data for whoever scatters light, on a device or in `reference`; nothing here evaluates or samples a BSDF. Directions
//! are local: z along the normal on the side of the observer, so that `z` is the cosine. Albedos are of *flux*; where
//! light crosses a boundary, radiance changes by the square of the relative index besides.
//!
//! A table takes up to seconds, and one surface is scattered by, is hot and is rendered again: the latest ones are kept
//! (`shared`) for whoever in the process asks for the same.

mod decision;
mod facet_cosines;
pub mod fresnel;
mod microfacet;

use std::hash::Hash;
use std::sync::Arc;

use quick_cache::sync::Cache;

pub use decision::{ReflectionProbability, index_range};
pub use facet_cosines::{FACET_COSINES, FacetCosines, facet_cosine};
pub use microfacet::{CoatAlbedo, DielectricAlbedo, IndexTable, ReflectionAlbedo};

/// The value of `key`, made unless it is among the latest. Two who ask at once may both make it: nobody waits, since those
/// who make it do so on threads that others wait on.
fn recent<K: Eq + Hash, V>(cache: &Cache<K, Arc<V>>, key: K, make: impl FnOnce() -> V) -> Arc<V> {
    cache.get(&key).unwrap_or_else(|| {
        let made = Arc::new(make());
        cache.insert(key, Arc::clone(&made));
        made
    })
}
