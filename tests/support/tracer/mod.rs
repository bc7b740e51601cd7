//! Rays of a test's own choice through the renderer's traversal and intersections on the first device.

use spectile::device::prepared::Prepared;
use spectile::device::text::Module;
use spectile::device::words::NONE;
use spectile::stress::probe::Kernel;

const TRACE: Module = Module { name: "tests/support/tracer/trace.wgsl", text: include_str!("trace.wgsl") };

/// A ray in device units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
}

/// What the nearest primitive along a ray is, and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    pub distance: f32,
    /// Index into `Accel::primitives`; `None` for a miss.
    pub primitive: Option<u32>,
    /// What it is a part of, among `Accel::primitives` as well; `None` in the world itself.
    pub instance: Option<u32>,
    /// The traversal gave up.
    pub overflow: bool,
}

/// The nearest hits of `rays`, at most four million.
pub fn trace(prepared: &Prepared, rays: &[Ray]) -> Vec<Hit> {
    let gpu = crate::device::shared();
    let kernel = Kernel::around(&gpu, prepared, TRACE).expect("a kernel");
    let asked: Vec<[f32; 4]> = rays
        .iter()
        .flat_map(|Ray { origin: [x, y, z], direction: [u, v, w] }| [[*x, *y, *z, 3.0e38], [*u, *v, *w, 0.0]])
        .collect();
    let hits: Vec<[u32; 4]> = kernel.ask(&asked, rays.len()).expect("results");
    hits.iter()
        .map(|[distance, primitive, overflow, instance]| Hit {
            distance: f32::from_bits(*distance),
            primitive: (*primitive != NONE).then_some(*primitive),
            instance: (*primitive != NONE && *instance != NONE).then_some(*instance),
            overflow: *overflow != 0,
        })
        .collect()
}
