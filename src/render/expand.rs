//! Radiance of factored cubes' products made by devices, for `relight`.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytemuck::{Pod, Zeroable};

use crate::Result;
use crate::cube::{Entries, Expand};
use crate::device::kernels::expanding;
use crate::gpu::adapter::{Gpu, Selection};
use crate::gpu::buffer;
use crate::gpu::pass::Pass;

/// Threads of a workgroup, and workgroups of a row of a dispatch.
const THREADS: u32 = 64;
const ACROSS: u32 = 1 << 15;
/// Bytes of a buffer at most: of more channels some are made at a time.
const MOST_BYTES: u64 = 128 << 20;

/// Devices that expand, each one tile at a time.
pub struct Devices {
    devices: Vec<Mutex<(Gpu, Pass)>>,
    next: AtomicUsize,
    most_bytes: u64,
}

/// `Task` in shaders/passes/expand.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Task {
    pixels: u32,
    channels: u32,
    entries: u32,
    sets: u32,
    divisor: f32,
    across: u32,
    unused: [u32; 2],
}

impl Devices {
    /// # Errors
    /// Devices that are not there, or do not take the kernel.
    pub fn open(selection: &Selection) -> Result<Devices> {
        let source = expanding();
        let with_kernel = |gpu: Gpu| Ok(Mutex::new((Pass::new(&gpu, &source).map(|pass| (gpu, pass)))?));
        let devices = Gpu::open_all(selection)?.into_iter().map(with_kernel).collect::<Result<_>>()?;
        Ok(Devices { devices, next: AtomicUsize::new(0), most_bytes: MOST_BYTES })
    }

    /// With less room, so that channels come in turns.
    pub fn with_most_bytes(self, most_bytes: u64) -> Devices {
        Devices { most_bytes, ..self }
    }

    /// Their names, in order.
    pub fn names(&self) -> Vec<String> {
        let name =
            |device: &Mutex<(Gpu, Pass)>| device.lock().unwrap_or_else(|broken| broken.into_inner()).0.name.clone();
        self.devices.iter().map(name).collect()
    }
}

impl Expand for Devices {
    fn sums(&self, of: Entries) -> Result<Vec<f32>> {
        let number = self.next.fetch_add(1, Ordering::Relaxed) % self.devices.len();
        let device = self.devices[number].lock().unwrap_or_else(|broken| broken.into_inner());
        let (gpu, pass) = &*device;
        let (pixels, all, products) = (of.pixels(), of.channels, of.rows.len() / of.channels.max(1));
        let largest = gpu.limits.max_storage_buffer_binding_size.min(self.most_bytes) / 4;
        let at_once = (largest / products.max(pixels).max(1) as u64).clamp(1, all as u64) as usize;
        let starts = buffer::storage(gpu, "starts", of.starts)?;
        let entries = buffer::storage(gpu, "products", of.products)?;
        let weights = buffer::storage(gpu, "weights", &of.sets.concat())?;
        let epochs: Vec<f32> = [0.0].into_iter().chain(of.epochs.iter().map(|epochs| *epochs as f32)).collect();
        let epochs = buffer::storage(gpu, "epochs", &epochs)?;
        let mut values = vec![0.0f32; pixels * all];
        for from in (0..all).step_by(at_once) {
            let channels = at_once.min(all - from);
            let rows: Vec<f32> =
                of.rows.chunks_exact(all).flat_map(|row| &row[from..from + channels]).copied().collect();
            let rows = buffer::storage(gpu, "rows", &rows)?;
            let bytes = 4 * (pixels * channels) as u64;
            let sums = buffer::output(gpu, "sums", bytes);
            let task = Task {
                pixels: pixels as u32,
                channels: channels as u32,
                entries: of.products.len() as u32,
                sets: of.sets.len() as u32,
                divisor: of.divisor as f32,
                across: ACROSS,
                unused: [0; 2],
            };
            let task = buffer::uniform(gpu, "task", bytemuck::bytes_of(&task));
            let groups = pixels as u32 * (channels as u32).div_ceil(THREADS);
            pass.run(gpu, [groups.min(ACROSS), groups.div_ceil(ACROSS)], |name| {
                let buffer = match name {
                    "task" => &task,
                    "starts" => &starts,
                    "products" => &entries,
                    "weights" => &weights,
                    "epochs" => &epochs,
                    "rows" => &rows,
                    _ => &sums,
                };
                Some(buffer.as_entire_buffer_binding())
            })?;
            let made: Vec<f32> = buffer::read(gpu, &sums, bytes, buffer::WARM_UP)?;
            for (to, made) in values.chunks_exact_mut(all).zip(made.chunks_exact(channels)) {
                to[from..from + channels].copy_from_slice(made);
            }
        }
        Ok(values)
    }
}
