//! The start-up self-test: catches drivers that cut loops short or compute wrong before they spoil a cube.

use crate::device::rng;
use crate::device::text::{Defines, compose, module};
use crate::device::words::LOOP_LIMIT;
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;
use crate::gpu::pass::Pass;
use crate::{Error, Result};

const LANES: u32 = 64;
const WORDS: usize = 6;
const NAN_BITS: u32 = 0x7fc0_0000;
const SEED: u64 = 0x0123_4567_89ab_cdef;

/// Runs the kernel and compares every word with what it must be.
pub fn run(gpu: &Gpu) -> Result<()> {
    let _watched = gpu.deadline.watch(buffer::WARM_UP);
    let modules = [module!("common/rng.wgsl"), module!("passes/self_test.wgsl")];
    let source = compose(&modules, Defines::default().set("SOBOL", true));
    let pass = Pass::new(gpu, &source)?;
    let input = buffer::storage(gpu, "self-test input", &[LOOP_LIMIT, SEED as u32, (SEED >> 32) as u32, NAN_BITS])?;
    let size = u64::from(LANES) * WORDS as u64 * 4;
    let results = buffer::output(gpu, "self-test results", size);
    pass.run(gpu, [1, 1], |name| match name {
        "results" => Some(results.as_entire_buffer_binding()),
        "input" => Some(input.as_entire_buffer_binding()),
        _ => None,
    })?;
    let got: Vec<u32> = buffer::read(gpu, &results, size, buffer::WARM_UP)?;
    for lane in 0..LANES {
        let at = lane as usize * WORDS;
        let expected = expected(lane);
        for (what, (got, expected)) in EXPECTED_NAMES.iter().zip(got[at..at + WORDS].iter().zip(expected)) {
            if *got != expected {
                return Err(Error::NoDevice(format!(
                    "{}: the driver computes wrong: self-test of {what}, lane {lane}: {got} instead of {expected}; \
                     update the driver or choose another device",
                    gpu.name
                )));
            }
        }
    }
    Ok(())
}

const EXPECTED_NAMES: [&str; WORDS] =
    ["a long loop", "nested loops", "a private array", "random numbers", "random numbers", "not-a-number bits"];

fn expected(lane: u32) -> [u32; WORDS] {
    let single = (0..LOOP_LIMIT / 2).map(|i| (i ^ lane) & 1).sum();
    let stack = (0..lane % 32).map(|i| i + i * lane).sum();
    let [x, y] = rng::sobol_pair(rng::pixel_key(SEED, lane, 7, 3), lane, lane & 63, 63);
    [single, LOOP_LIMIT / 256 * 128, stack, x, y, 1]
}
