//! Roughness by place.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use glam::DVec3;

use super::{Choice, Lobe, Vertex};
use crate::scene::{SMOOTH, TextureId};

type Lobes = Vec<Box<dyn Lobe>>;

/// The lobes of each roughness that was met. Each has tables of its own, so this is for textures of few numbers.
struct Known {
    texture: TextureId,
    at: Box<dyn Fn(f64) -> Lobes + Send + Sync>,
    met: Mutex<HashMap<u64, Arc<Lobes>>>,
}

/// One of the lobes, at the roughness that the texture has at a vertex.
struct ByPlace {
    known: Arc<Known>,
    lobe: usize,
}

/// Lobes by what `texture` has at a vertex, of which `at` gives as many for every roughness.
pub fn lobes(texture: TextureId, at: impl Fn(f64) -> Lobes + Send + Sync + 'static) -> Lobes {
    let count = at(1.0).len();
    let known = Arc::new(Known { texture, at: Box::new(at), met: Mutex::default() });
    (0..count).map(|lobe| Box::new(ByPlace { known: Arc::clone(&known), lobe }) as Box<dyn Lobe>).collect()
}

impl ByPlace {
    fn here<T>(&self, at: &Vertex, what: impl FnOnce(&dyn Lobe) -> T) -> T {
        let alpha = at.spectra.number(self.known.texture).clamp(SMOOTH, 1.0);
        let mut met = self.known.met.lock().expect("nobody panics with it");
        let lobes = Arc::clone(met.entry(alpha.to_bits()).or_insert_with(|| Arc::new((self.known.at)(alpha))));
        drop(met);
        what(&*lobes[self.lobe])
    }
}

impl Lobe for ByPlace {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.here(at, |lobe| lobe.albedo(at, k))
    }

    fn sample(&self, at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        self.here(at, |lobe| lobe.sample(at, u))
    }

    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        self.here(at, |lobe| lobe.evaluate(at, i, scale, out));
    }

    fn density(&self, at: &Vertex, i: DVec3) -> f64 {
        self.here(at, |lobe| lobe.density(at, i))
    }

    fn factor(&self, at: &Vertex, k: usize) -> f64 {
        self.here(at, |lobe| lobe.factor(at, k))
    }
}
