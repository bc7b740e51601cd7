//! How long passes take, by the device's own clock.

use std::time::Duration;

use super::adapter::Gpu;
use super::buffer;
use crate::Result;

/// Begin and end of a number of passes.
pub struct Timestamps {
    passes: u32,
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
}

impl Timestamps {
    pub fn new(gpu: &Gpu, passes: u32) -> Timestamps {
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * passes,
        });
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        Timestamps { passes, queries, resolved: buffer::empty(gpu, "timestamps", 16 * u64::from(passes), usage) }
    }

    /// What pass number `pass` is begun with.
    pub fn writes(&self, pass: u32) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * pass),
            end_of_pass_write_index: Some(2 * pass + 1),
        }
    }

    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2 * self.passes, &self.resolved, 0);
    }

    /// Seconds of each pass, when they are done.
    pub fn read(&self, gpu: &Gpu, limit: Duration) -> Result<Vec<f64>> {
        let ticks: Vec<[u64; 2]> = buffer::read(gpu, &self.resolved, 16 * u64::from(self.passes), limit)?;
        let period = f64::from(gpu.queue.get_timestamp_period()) * 1e-9;
        Ok(ticks.into_iter().map(|[begin, end]| end.saturating_sub(begin) as f64 * period).collect())
    }
}
