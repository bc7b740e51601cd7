//! The scene on a device: one immutable copy, large arrays in windows below the binding limit.

use crate::files::format_bytes;
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;
use crate::device::kernels::{WindowList, Windows};
use crate::device::prepared::Prepared;
use crate::{Error, Result};

const NODE_BYTES: u64 = 80;
const PRIMITIVE_BYTES: u64 = 48;
/// Bindings that scene.wgsl keeps for the windows of nodes and of primitives.
const MAX_WINDOWS: u64 = 4;

/// Buffers of group 0 and the spectral tables, found by their WGSL names.
pub struct SceneBuffers {
    named: Vec<(String, wgpu::Buffer)>,
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
        "volumes" | "voxels" => ("the media of the scene", "smaller grids"),
        "map_table" | "map_texels" => ("the environment map", "a smaller one"),
        "emitters" | "emitter_cdf" => ("the emitting triangles of the scene", "a coarser mesh where it emits"),
        "textures" | "texels" => ("the textures of the scene", "smaller ones"),
        "attributes" => ("the texture coordinates and normals of the scene", "fewer triangles"),
        _ => ("the materials of the scene", "fewer of them"),
    };
    Err(Error::Usage(format!(
        "{what} take {} and this device binds at most {}: use {help}",
        format_bytes(bytes),
        format_bytes(most)
    )))
}

/// The scene's storage buffers: their names in WGSL and their content.
fn parts<'a>(prepared: &'a Prepared, windows: &Windows) -> Vec<(String, &'a [u8])> {
    let tables = &prepared.tables;
    let mut parts: Vec<(String, &[u8])> = vec![
        ("emitters".into(), bytemuck::cast_slice(&prepared.emitters)),
        ("emitter_cdf".into(), bytemuck::cast_slice(&prepared.picks.cdf)),
        ("spectra".into(), bytemuck::cast_slice(&tables.strata)),
    ];
    match &prepared.surfaces {
        None => parts.insert(0, ("materials".into(), bytemuck::cast_slice(&prepared.materials))),
        Some(surfaces) => parts.extend([
            ("surface_materials".into(), bytemuck::cast_slice(&surfaces.materials)),
            ("parts".into(), bytemuck::cast_slice(&surfaces.parts)),
            ("tables".into(), bytemuck::cast_slice(&surfaces.tables)),
        ]),
    }
    if let Some(textures) = prepared.surfaces.as_ref().and_then(|surfaces| surfaces.textures.as_ref()) {
        parts.push(("textures".into(), bytemuck::cast_slice(&textures.words)));
        parts.push(("texels".into(), bytemuck::cast_slice(&textures.texels)));
    }
    if let Some(radiators) = &prepared.radiators {
        parts.push(("radiators".into(), bytemuck::cast_slice(&radiators.all)));
    }
    if !prepared.accel.attributes.is_empty() {
        parts.push(("attributes".into(), bytemuck::cast_slice(&prepared.accel.attributes)));
    }
    if prepared.features.general.is_some_and(|general| general.lamps) {
        parts.push(("lamps".into(), bytemuck::cast_slice(&prepared.lamps)));
    }
    if let Some(media) = &prepared.media {
        parts.push(("volumes".into(), bytemuck::cast_slice(&media.volumes)));
        parts.push(("voxels".into(), bytemuck::cast_slice(&media.voxels)));
        parts.push(("boundaries".into(), bytemuck::cast_slice(&media.boundaries)));
    }
    if let Some(sky) = &prepared.sky {
        parts.push(("map_table".into(), bytemuck::cast_slice(&sky.table)));
        parts.push(("map_texels".into(), bytemuck::cast_slice(&sky.texels)));
    }
    let mut add_windows = |name: &str, list: WindowList, bytes: &'a [u8], element: u64| {
        for i in 0..u64::from(list.count) {
            let size = u64::from(list.size) * element;
            let end = ((i + 1) * size).min(bytes.len() as u64);
            parts.push((format!("{name}_{i}"), &bytes[(i * size) as usize..end as usize]));
        }
    };
    if !prepared.features.few_triangles {
        add_windows("nodes", windows.nodes, bytemuck::cast_slice(&prepared.accel.nodes), NODE_BYTES);
    }
    add_windows("primitives", windows.primitives, bytemuck::cast_slice(&prepared.accel.primitives), PRIMITIVE_BYTES);
    if prepared.features.knots {
        parts.push(("knot_starts".into(), bytemuck::cast_slice(&tables.knot_starts)));
        parts.push(("knots".into(), bytemuck::cast_slice(&tables.knots)));
    }
    parts
}

/// What the scene takes on a device, bytes.
pub fn scene_bytes(prepared: &Prepared, windows: &Windows) -> u64 {
    let frame = buffer::allocated(size_of_val(&prepared.frame) as u64);
    frame + parts(prepared, windows).iter().map(|(_, bytes)| buffer::allocated(bytes.len() as u64)).sum::<u64>()
}

impl SceneBuffers {
    /// Uploads the scene. Errors: spectra, materials or emitters that exceed one binding; a device that is lost, or whose
    /// memory does not hold the scene.
    pub fn new(gpu: &Gpu, prepared: &Prepared, windows: &Windows) -> Result<SceneBuffers> {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let frame = buffer::empty(gpu, "frame", size_of_val(&prepared.frame) as u64, usage);
        gpu.queue.write_buffer(&frame, 0, bytemuck::bytes_of(&prepared.frame));
        let mut named = vec![("frame".to_owned(), frame)];
        let limits = gpu.device.limits();
        for (name, bytes) in parts(prepared, windows) {
            check_size(&name, bytes.len() as u64, &limits)?;
            let buffer = buffer::storage(gpu, &name, bytes)?;
            named.push((name, buffer));
        }
        Ok(SceneBuffers { named })
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
