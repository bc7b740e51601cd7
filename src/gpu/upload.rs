//! The scene on a device: one immutable copy, large arrays in windows below the binding limit.

use crate::files::format_bytes;
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;
use crate::render::prepare::{Prepared, WindowList, Windows};
use crate::{Error, Result};

const NODE_BYTES: u64 = 80;
const PRIMITIVE_BYTES: u64 = 48;
/// Bindings that scene.wgsl keeps for the windows of nodes and of primitives.
const MAX_WINDOWS: u64 = 4;

/// Buffers of group 0 and the spectral tables, found by their WGSL names.
pub struct SceneBuffers {
    named: Vec<(String, wgpu::Buffer)>,
    /// Sum of all sizes, bytes.
    pub bytes: u64,
}

/// How many windows of how many elements, with bindings of at most `binding` bytes.
pub fn windows(prepared: &Prepared, binding: u64) -> Result<Windows> {
    let split = |what: &str, count: usize, bytes: u64| {
        let size = (binding / bytes).min(u64::from(u32::MAX));
        let windows = (count as u64).div_ceil(size).max(1);
        if windows > MAX_WINDOWS {
            return Err(Error::Usage(format!(
                "the scene has {count} {what}, and this device binds at most {}; use fewer triangles or a larger device",
                MAX_WINDOWS * size
            )));
        }
        Ok(WindowList { count: windows as u32, size: size as u32 })
    };
    Ok(Windows {
        nodes: split("BVH nodes", prepared.accel.nodes.len(), NODE_BYTES)?,
        primitives: split("triangles and shapes", prepared.accel.primitives.len(), PRIMITIVE_BYTES)?,
    })
}

/// Refuses what is not spread over windows and exceeds one binding.
fn check_size(name: &str, bytes: u64, limits: &wgpu::Limits) -> Result<()> {
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if bytes <= most {
        return Ok(());
    }
    let (what, help) = match name {
        "spectra" | "knot_starts" | "knots" => ("the spectra of the scene", "fewer channels or fewer spectra"),
        "emitters" | "emitter_cdf" => ("the emitting triangles of the scene", "a coarser mesh where it emits"),
        _ => ("the materials of the scene", "fewer of them"),
    };
    Err(Error::Usage(format!(
        "{what} take {} and this device binds at most {}: use {help}",
        format_bytes(bytes),
        format_bytes(most)
    )))
}

impl SceneBuffers {
    /// Uploads the scene. Errors: spectra, materials or emitters that exceed one binding.
    pub fn new(gpu: &Gpu, prepared: &Prepared, windows: &Windows) -> Result<SceneBuffers> {
        let mut named = Vec::new();
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let frame = buffer::empty(gpu, "frame", size_of_val(&prepared.frame) as u64, usage);
        gpu.queue.write_buffer(&frame, 0, bytemuck::bytes_of(&prepared.frame));
        named.push(("frame".into(), frame));
        let limits = gpu.device.limits();
        let mut add = |name: &str, bytes: &[u8]| {
            check_size(name, bytes.len() as u64, &limits)?;
            named.push((name.to_owned(), buffer::storage(gpu, name, bytes)));
            Ok::<_, Error>(())
        };
        add("materials", bytemuck::cast_slice(&prepared.materials))?;
        add("emitters", bytemuck::cast_slice(&prepared.emitters))?;
        add("emitter_cdf", bytemuck::cast_slice(&prepared.picks.cdf))?;
        let mut add_windows = |name: &str, list: WindowList, bytes: &[u8], element: u64| {
            for i in 0..u64::from(list.count) {
                let size = u64::from(list.size) * element;
                let end = ((i + 1) * size).min(bytes.len() as u64);
                add(&format!("{name}_{i}"), &bytes[(i * size) as usize..end as usize])?;
            }
            Ok::<_, Error>(())
        };
        add_windows("nodes", windows.nodes, bytemuck::cast_slice(&prepared.accel.nodes), NODE_BYTES)?;
        let primitives = bytemuck::cast_slice(&prepared.accel.primitives);
        add_windows("primitives", windows.primitives, primitives, PRIMITIVE_BYTES)?;
        add("spectra", bytemuck::cast_slice(&prepared.tables.strata))?;
        if prepared.features.knots {
            add("knot_starts", bytemuck::cast_slice(&prepared.tables.knot_starts))?;
            add("knots", bytemuck::cast_slice(&prepared.tables.knots))?;
        }
        let bytes = named.iter().map(|(_, b)| b.size()).sum();
        Ok(SceneBuffers { named, bytes })
    }

    /// The binding for the variable `name`, if it is one of the scene's.
    pub fn find(&self, name: &str) -> Option<wgpu::BufferBinding<'_>> {
        self.named.iter().find(|(n, _)| n == name).map(|(_, b)| b.as_entire_buffer_binding())
    }
}

#[cfg(test)]
mod tests {
    use super::check_size;

    #[test]
    fn what_exceeds_a_binding_is_bad_input() {
        let limits =
            wgpu::Limits { max_storage_buffer_binding_size: 128 << 20, max_buffer_size: 2 << 30, ..Default::default() };
        assert!(check_size("knots", 128 << 20, &limits).is_ok());
        let error = check_size("knots", (128 << 20) + 8, &limits).expect_err("too large");
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("spectra"), "{error}");
    }
}
