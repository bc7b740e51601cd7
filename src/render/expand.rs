//! Radiance of factored cubes' products made by devices, for `relight`.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytemuck::{Pod, Zeroable};

use crate::Result;
use crate::cube::{Entries, Expand};
use crate::device::kernels::expanding;
use crate::gpu::adapter::{Gpu, Selection};
use crate::gpu::buffer;
use crate::gpu::pass::{Pass, grid};

/// Threads of a workgroup.
const THREADS: u32 = 64;
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
    unused: [u32; 3],
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

    /// Their names, in order.
    pub fn names(&self) -> Vec<String> {
        let name =
            |device: &Mutex<(Gpu, Pass)>| device.lock().unwrap_or_else(|broken| broken.into_inner()).0.name.clone();
        self.devices.iter().map(name).collect()
    }
}

impl Expand for Devices {
    fn sums(&self, of: &Entries, values: &mut [f32], errors: &mut [f32]) -> Result<()> {
        let number = self.next.fetch_add(1, Ordering::Relaxed) % self.devices.len();
        let device = self.devices[number].lock().unwrap_or_else(|broken| broken.into_inner());
        let (gpu, pass) = &*device;
        let (pixels, all, products) = (of.pixels.len(), of.rows.channels(), of.rows.products());
        let largest = gpu.limits.max_storage_buffer_binding_size.min(self.most_bytes) / 4;
        let at_once = (largest / products.max(pixels).max(1) as u64).clamp(1, all as u64) as usize;
        let ranges = buffer::storage(gpu, "pixels", &of.pixels)?;
        let entries = buffer::storage(gpu, "products", of.products)?;
        let weights = buffer::storage(gpu, "weights", &of.sets.concat())?;
        let epochs: Vec<f32> = [0.0].into_iter().chain(of.epochs.iter().map(|epochs| *epochs as f32)).collect();
        let epochs = buffer::storage(gpu, "epochs", &epochs)?;
        for from in (0..all).step_by(at_once) {
            let channels = at_once.min(all - from);
            let mut rows = vec![0.0f32; products * channels];
            of.rows.write(from..from + channels, channels, &mut rows);
            let rows = buffer::storage(gpu, "rows", &rows)?;
            let bytes = 4 * (pixels * channels) as u64;
            let means = buffer::output(gpu, "means", bytes);
            let deviations = buffer::output(gpu, "deviations", if errors.is_empty() { 4 } else { bytes });
            let task = Task {
                pixels: pixels as u32,
                channels: channels as u32,
                entries: of.products.len() as u32,
                sets: of.sets.len() as u32,
                divisor: of.divisor as f32,
                unused: [0; 3],
            };
            let task = buffer::uniform(gpu, "task", bytemuck::bytes_of(&task));
            let groups = pixels as u32 * (channels as u32).div_ceil(THREADS);
            pass.run(gpu, grid(groups), |name| {
                let buffer = match name {
                    "task" => &task,
                    "pixels" => &ranges,
                    "products" => &entries,
                    "weights" => &weights,
                    "epochs" => &epochs,
                    "rows" => &rows,
                    "means" => &means,
                    _ => &deviations,
                };
                Some(buffer.as_entire_buffer_binding())
            })?;
            for (made, to) in [(&means, &mut *values), (&deviations, &mut *errors)] {
                if to.is_empty() {
                    continue;
                }
                let made: Vec<f32> = buffer::read(gpu, made, bytes, buffer::WARM_UP)?;
                for (to, made) in to.chunks_exact_mut(all).zip(made.chunks_exact(channels)) {
                    to[from..from + channels].copy_from_slice(made);
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use smallvec::smallvec;

    use super::*;
    use crate::cube::{Rect, Rows, Weights};
    use crate::spectral::product::Product;

    /// Channels that come in turns, the last of them fewer, are those of the processor.
    #[test]
    fn turns_of_channels_are_all_of_them() {
        let number = |i: usize| ((i * 7919) % 1013) as f32 / 97.0;
        let product = |i: usize| Product { factors: smallvec![i as u16], source: 0 };
        let entries =
            |pixel: usize| (0..5 * pixel).map(move |i| (product((i + pixel) % 71), f64::from(number(i * pixel))));
        let weights = Weights::of_pixels((0..12).map(entries));
        let (tile, rect, channels) = ([3, 4], Rect { x0: 3, y0: 4, x1: 5, y1: 7 }, 100);
        let rows: Vec<f32> = (0..weights.products.len() * channels).map(number).collect();
        let rows = Rows::Made(&rows, channels);
        let want = weights.expanded(rows, tile, rect);
        let most_bytes = 4 * 30 * weights.products.len() as u64;
        let devices = Devices { most_bytes, ..Devices::open(&Selection::Count(1)).expect("a device") };
        let (mut got, mut errors) = (Vec::new(), Vec::new());
        let done = weights.expand_by(&devices, rows, tile, rect, None, [&mut got, &mut errors]);
        done.expect("a device that works");
        assert!(errors.is_empty());
        assert!(want.iter().any(|v| *v > 0.0) && want.iter().any(|v| v.is_nan()));
        for (got, want) in got.iter().zip(&want) {
            assert!(got.is_nan() && want.is_nan() || (got - want).abs() <= 2e-6 * want, "{got} {want}");
        }
    }
}
