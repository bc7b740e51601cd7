// Folding the radiances of a pixel's paths into its running means, in the order of the samples.

@group(1) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;
// [pixel slot of the wave's units][channel].
@group(1) @binding(9) var<storage, read_write> means: array<f32>;

#if THINNED
// Whether roulette (passes/thin_paths.wgsl) left anything of a path to evaluate: what it sees before it is scattered always is.
fn evaluates(head: vec4<u32>) -> bool {
    return (head.y & 0xffffu) > 0u && (head.w != 0u || (head.z & 0xffffu) > 0u);
}
#endif

fn load_mean(at: u32, channels: u32) -> vec4<f32> {
    var m = vec4<f32>(0.0);
    if (channels > 0u) { m.x = means[at]; }
    if (channels > 1u) { m.y = means[at + 1u]; }
    if (channels > 2u) { m.z = means[at + 2u]; }
    if (channels > 3u) { m.w = means[at + 3u]; }
    return m;
}

fn store_mean(at: u32, channels: u32, m: vec4<f32>) {
    if (channels > 0u) { means[at] = m.x; }
    if (channels > 1u) { means[at + 1u] = m.y; }
    if (channels > 2u) { means[at + 2u] = m.z; }
    if (channels > 3u) { means[at + 3u] = m.w; }
}

// The mean of `index` samples, of which `x` is the last.
fn refine_mean(at: u32, channels: u32, x: vec4<f32>, index: u32) {
    var m = vec4<f32>(0.0);
    if (index > 1u) {
        m = load_mean(at, channels);
    }
    store_mean(at, channels, m + (x - m) / f32(index));
}

// Samples of a channel that must not occur; `sample` is the index + 1 of the first path that had one.
struct BadSamples {
    non_finite: u32,
    negative: u32,
    sample: u32,
}

fn count_true(b: vec4<bool>) -> u32 {
    return dot(select(vec4<u32>(0u), vec4<u32>(1u), b), vec4<u32>(1u));
}

// A path's radiance with what is not finite counted and replaced by 0, what is negative counted. Told by the bits, since
// compilers may assume that NaN and infinity do not occur.
fn checked(radiance: vec4<f32>, sample: u32, bad: ptr<function, BadSamples>) -> vec4<f32> {
    let bits = bitcast<vec4<u32>>(radiance);
    let non_finite = (bits & vec4<u32>(0x7f800000u)) == vec4<u32>(0x7f800000u);
    if (any(bits > vec4<u32>(0x7f7fffffu))) {
        (*bad).non_finite += count_true(non_finite);
        (*bad).negative += count_true((bits > vec4<u32>(0x80000000u)) & !non_finite);
        (*bad).sample = select((*bad).sample, sample, (*bad).sample == 0u);
    }
    return select(radiance, vec4<f32>(0.0), non_finite);
}

// Where samples that must not occur were first seen, and how many there are.
fn report(bad: BadSamples, slot: u32) {
    if (bad.non_finite + bad.negative > 0u) {
        atomicAdd(&counters[COUNTER_NON_FINITE], bad.non_finite);
        atomicAdd(&counters[COUNTER_NEGATIVE], bad.negative);
        // The first to come says where.
        if (atomicMax(&counters[COUNTER_BAD_SAMPLE], bad.sample) == 0u) {
            atomicStore(&counters[COUNTER_BAD_SLOT], slot);
        }
    }
}

// A kernel that a driver drops without a word is noticed by this. `foreign`: bits in which the mark of a path's end differs from
// this wave's.
fn prove(samples: u32, foreign: u32, is_first: bool) {
    atomicAdd(&counters[COUNTER_FOLDED], select(samples, 0u, foreign > 0xffffu));
    if (is_first) {
        atomicStore(&counters[COUNTER_SEQUENCE], wave.sequence);
    }
}
