//! How channels are evaluated on which kind of device: what `auto` stands for, and the shape of workgroups.

use crate::device::prepared::Prepared;
use crate::device::text::Defines;
use crate::device::words::LOOP_LIMIT;
use crate::scene::{Evaluator, Scene};

/// Channels up to which `auto` is the conventional path tracer on GPUs. Measured with `spectile bench` on an H200 (docs/reports):
/// its paths per second over those of `dpept-pixel`, geometric mean of four scenes, were 1.43 at 8 channels, 0.86 at 32 and 0.36 at
/// 128. On software devices `dpept-pixel` was the fastest in all of them, or one percent from it.
pub const MOST_PT_CHANNELS: usize = 16;

/// What to use for `scene` on a software device or a GPU: its evaluator, or what `auto` stands for.
pub fn resolve(scene: &Scene, software: bool) -> Evaluator {
    let values = scene.channels.len() * scene.integrator.wavelengths_per_channel.unwrap_or(1) as usize;
    match scene.integrator.evaluator {
        // Its state is that of every wavelength.
        Evaluator::Auto if !software && values <= MOST_PT_CHANNELS => Evaluator::Pt,
        Evaluator::Auto => Evaluator::DpeptPixel,
        chosen => chosen,
    }
}

/// What evaluating a path in all channels costs, over generating it, before it is known what paths take: by the kind of device, never by a
/// clock. Measured with `spectile bench` (docs/reports), geometric means over scenes of a channel's part of it: on an H200 from 128
/// channels on 4.4e-3, 1.3e-3, 5e-3 and 1.5e-3 (four scenes); on llvmpipe 2.8e-3 in registers, else 1.7e-2, 3.9e-2 and 1.3e-2.
pub fn evaluation_cost(scene: &Prepared, software: bool) -> f64 {
    let per_channel = match software {
        false => 2.6e-3,
        true if scene.features.registers => 2.8e-3,
        true => 2e-2,
    };
    per_channel * scene.channels as f64 * f64::from(scene.wavelengths_per_channel)
}

/// What parts of a path cost on a kind of device, nanoseconds: constants, never a clock's, so that what is decided by them is the same every
/// time. Only their ratios matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// To make it: its start, and each of its rays with what happens where it ends.
    pub camera: f64,
    pub ray: f64,
    /// To evaluate it in one channel: by itself, and at all its wavelengths for each record, what one that looks up an environment map
    /// takes more, and each voxel that is marched through.
    pub path: f64,
    pub record: f64,
    pub map: f64,
    pub cell: f64,
    /// In one channel, where roulette leaves nothing of it.
    pub skipped: f64,
    /// What a channel costs in which roulette tries a path, over one of those in which it is evaluated: threads that have a path each read
    /// records and tables more slowly than those that share one.
    pub tried: f64,
}

impl Costs {
    /// For a scene on a software device or a GPU.
    pub fn of(scene: &Prepared, software: bool) -> Costs {
        // Levels of the tree that a ray descends, were it binary; where all triangles are tested there is none.
        let depth = if scene.features.few_triangles { 0.0 } else { (1.0 + scene.accel.nodes.len() as f64).log2() };
        let in_registers = scene.features.registers;
        let costs = match software {
            // From paths a second at 8, 128 and 512 channels on an H200 (README), with what the pilot counts in these scenes. Voxels were
            // not measured there: as much of a record as on software devices.
            false => Costs {
                camera: 0.0,
                ray: 0.1 + 0.034 * depth,
                path: 7e-4,
                record: if in_registers { 1.4e-3 } else { 3e-3 },
                map: 6e-3,
                cell: 3e-3,
                skipped: 2e-4,
                tried: 2.5,
            },
            // llvmpipe, times of benches/tradeoff.
            true => Costs {
                camera: 200.0 + 80.0 * depth,
                ray: 150.0 + 90.0 * depth,
                path: if in_registers { 0.4 } else { 4.0 },
                record: if in_registers { 0.9 } else { 20.0 },
                map: 25.0,
                cell: 20.0,
                skipped: 0.3,
                tried: if in_registers { 6.0 } else { 3.5 },
            },
        };
        let apart = if software { apart(EvaluateShape::of(scene, true).lanes) } else { 1.0 };
        let several = f64::from(scene.wavelengths_per_channel) * apart;
        // Paths are tried at the first of their wavelengths, a thread for each in any case.
        Costs {
            path: apart * costs.path,
            record: several * costs.record,
            map: several * costs.map,
            cell: several * costs.cell,
            tried: costs.tried / several,
            ..costs
        }
    }
}

/// Eight threads of a software device run as one. Where so few share a path that they have several, each waits for the longest, and they read
/// different records: a channel then costs up to 2.6 times as much (conference, Cornell's box, a plume: 2.9, 2.6, 2.1 at 8 channels).
fn apart(lanes: u32) -> f64 {
    let paths = f64::from(8 / lanes.clamp(1, 8));
    1.0 + 1.6 / 3.0 * paths.log2()
}

/// Threads of one workgroup of what evaluates: `lanes` threads for each of `pixels` pixels, `vectors` quads of channels
/// a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EvaluateShape {
    pub vectors: u32,
    pub lanes: u32,
    pub pixels: u32,
    /// Workgroups that share a pixel's channels.
    pub blocks: u32,
    /// How often a thread takes `vectors` quads, one batch after the other (`dpept-path`); else once.
    pub batches: Option<u32>,
}

impl EvaluateShape {
    /// For a scene on a software device or a GPU.
    pub fn of(scene: &Prepared, software: bool) -> EvaluateShape {
        let quads = scene.tables.channels_padded as u32 / 4;
        let shape = match &scene.media {
            _ if !scene.is_general() => EvaluateShape::new(quads, software),
            // A march through voxels is long, and compiled for each quad.
            Some(media) if media.has_grids() => EvaluateShape::among(quads, software, &[1]),
            _ => EvaluateShape::general(quads, software),
        };
        match scene.evaluator {
            Evaluator::DpeptPath => shape.path_by_path(quads, scene.path_iterations()),
            _ => shape,
        }
    }

    /// Constants of what evaluates.
    pub fn define(&self, defines: &mut Defines) {
        defines.set("WORKGROUP", self.lanes * self.pixels);
        defines.constant("LANES", self.lanes);
        defines.constant("VECTORS", self.vectors);
        defines.constant("PIXELS_PER_GROUP", self.pixels);
        if let Some(batches) = self.batches {
            defines.constant("BATCHES", batches);
        }
    }

    /// For `quads` quads of channels: groups of 64 to 256 threads, few of them idle.
    ///
    /// On software devices loads count most, and more channels a thread share them: measured on lavapipe, a thread's time
    /// goes as 2.2 + vectors. A GPU hides loads behind other threads, and needs the registers for that.
    pub fn new(quads: u32, software: bool) -> EvaluateShape {
        EvaluateShape::among(quads, software, &[1, 2, 4])
    }

    /// For general scenes, whose code per quad is long: compiling it, and registers, set the limit.
    fn general(quads: u32, software: bool) -> EvaluateShape {
        EvaluateShape::among(quads, software, &[1, 2])
    }

    fn among(quads: u32, software: bool, candidates: &[u32]) -> EvaluateShape {
        let width = if software { 8 } else { 32 };
        let of = |vectors: u32| {
            let threads = quads.div_ceil(vectors);
            if threads < width {
                let lanes = threads.next_power_of_two();
                return EvaluateShape { vectors, lanes, pixels: (64 / lanes).max(1), blocks: 1, batches: None };
            }
            let blocks = threads.div_ceil(256);
            let lanes = threads.div_ceil(blocks).next_multiple_of(width);
            EvaluateShape { vectors, lanes, pixels: 1, blocks, batches: None }
        };
        let cost = |s: &EvaluateShape| f64::from(s.lanes * s.blocks) * (2.2 + f64::from(s.vectors));
        let candidates = if software { candidates } else { &[1] };
        let shapes = candidates.iter().map(|&v| of(v));
        shapes.min_by(|a, b| cost(a).total_cmp(&cost(b))).expect("at least one candidate")
    }

    /// A thread for all of a path's channels, or as many as its loops can take.
    fn path_by_path(self, quads: u32, path_iterations: u32) -> EvaluateShape {
        let batches = quads.div_ceil(self.vectors);
        let at_once = (LOOP_LIMIT / path_iterations).clamp(1, batches);
        EvaluateShape { lanes: 1, pixels: 64, blocks: batches.div_ceil(at_once), batches: Some(at_once), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::{EvaluateShape, apart};

    #[test]
    fn threads_that_share_a_path_cost_least() {
        assert_eq!([1, 2, 8, 32].map(|lanes| (100.0 * apart(lanes)).round()), [260.0, 207.0, 100.0, 100.0]);
    }

    #[test]
    fn evaluation_groups_cover_all_channels_with_few_idle_threads() {
        for software in [true, false] {
            let width = if software { 8 } else { 32 };
            for quads in (1..300).chain([500, 512, 1250, 2500]) {
                let s = EvaluateShape::new(quads, software);
                let (threads, needed) = (s.lanes * s.blocks, quads.div_ceil(s.vectors));
                // Each of a pixel's workgroups has channels: evaluation counts on that.
                assert_eq!(quads.div_ceil(s.lanes * s.vectors), s.blocks, "{quads}: {s:?}");
                assert!(threads >= needed && s.lanes * s.pixels <= 256, "{quads}: {s:?}");
                assert!(threads < 2 * needed || threads < needed + width * s.blocks, "{quads}: {s:?}");
            }
        }
        assert_eq!(
            EvaluateShape::new(100, false),
            EvaluateShape { vectors: 1, lanes: 128, pixels: 1, blocks: 1, batches: None }
        );
        assert_eq!(
            EvaluateShape::new(100, true),
            EvaluateShape { vectors: 4, lanes: 32, pixels: 1, blocks: 1, batches: None }
        );
        assert_eq!(
            EvaluateShape::new(2, true),
            EvaluateShape { vectors: 2, lanes: 1, pixels: 64, blocks: 1, batches: None }
        );
    }
}
