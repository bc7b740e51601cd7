// Evaluate, pixel-major: a workgroup owns one pixel (several, when there are few channels) and a block of channels,
// four channels a thread. It walks the pixel's saved paths in sample order, evaluates every channel along each, and
// folds them into the running mean in registers; no atomics, one write at the end (Algorithm 1 of the method, with the
// loops over paths and channels exchanged).

@group(1) @binding(0) var<uniform> wave: Wave;
@group(1) @binding(3) var<storage, read> heads: array<vec2<u32>>;
@group(1) @binding(4) var<storage, read> records: array<vec2<u32>>;
@group(1) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;
// [stratum][spectrum][quad of channels][value, slope]; spectrum 0 is the constant 1.
@group(1) @binding(8) var<storage, read> spectra: array<vec4<f32>>;
// [pixel slot of the wave's units][channel].
@group(1) @binding(9) var<storage, read_write> means: array<f32>;
#if KNOTS
// Spectra that no affordable number of strata resolves, exact: first knot of (spectrum, channel), and (mu, value).
@group(1) @binding(10) var<storage, read> knot_starts: array<u32>;
@group(1) @binding(11) var<storage, read> knots: array<vec2<f32>>;
#endif

// Where the path's wavelength sample stands: its stratum, and the place within.
struct SpectralSample {
    stratum: u32,
    place: f32,
#if KNOTS
    mu: f32,
#endif
}

fn spectral_sample(mu: u32) -> SpectralSample {
    var s: SpectralSample;
    s.place = f32((mu << frame.stratum_bits) >> 8u) * 5.9604645e-8;
#if STRATA
    s.stratum = mu >> (32u - frame.stratum_bits);
#endif
#if KNOTS
    s.mu = f32(mu >> 8u) * 5.9604645e-8;
#endif
    return s;
}

fn table_index(stratum: u32, spectrum: u32, quad: u32) -> u32 {
    return ((stratum * SPECTRA + spectrum) * QUADS + quad) * 2u;
}

#if REGISTERS
#else
fn table_value(spectrum: u32, quad: u32, s: SpectralSample) -> vec4<f32> {
    let at = table_index(s.stratum, spectrum, quad);
    return spectra[at] + s.place * spectra[at + 1u];
}

#if KNOTS
// Binary search without a loop: loop iterations are scarce (KERNELS), and its length is known.
fn knot_value(spectrum: u32, channel: u32, mu: f32) -> f32 {
    let first = knot_starts[spectrum * CHANNELS_PADDED + channel];
    var low = first;
    // Segments still in question, from `low` on.
    var left = knot_starts[spectrum * CHANNELS_PADDED + channel + 1u] - 1u - first;
    var half = 0u;
    var above = false;
#repeat KNOT_STEPS
    half = left / 2u;
    above = knots[low + half].x <= mu;
    low = select(low, low + half, above);
    left = select(half, left - half, above);
#end
    let a = knots[low];
    let b = knots[low + 1u];
    return a.y + clamp((mu - a.x) / max(b.x - a.x, 1.0e-30), 0.0, 1.0) * (b.y - a.y);
}

fn spectrum_value(spectrum: u32, quad: u32, s: SpectralSample) -> vec4<f32> {
    if (spectrum < SPECTRA) {
        return table_value(spectrum, quad, s);
    }
    let k = spectrum - SPECTRA;
    return vec4<f32>(
        knot_value(k, 4u * quad, s.mu),
        knot_value(k, 4u * quad + 1u, s.mu),
        knot_value(k, 4u * quad + 2u, s.mu),
        knot_value(k, 4u * quad + 3u, s.mu),
    );
}
#else
fn spectrum_value(spectrum: u32, quad: u32, s: SpectralSample) -> vec4<f32> {
    return table_value(spectrum, quad, s);
}
#endif
#endif

@compute @workgroup_size($WORKGROUP)
fn evaluate_pixel(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                  @builtin(local_invocation_index) thread: u32) {
    let local_slot = (group.x + group.y * groups.x) * PIXELS_PER_GROUP + thread / LANES;
    let quad = group.z * LANES + thread % LANES;
    if (local_slot >= wave.pixel_count || quad >= QUADS) {
        return;
    }
    let slot = wave.pixel_begin + local_slot;
    let first_channel = 4u * quad;
    let out = slot * CHANNELS + first_channel;

    // Waves of one unit take turns: each goes on from the mean that the last one left.
    var mean = vec4<f32>(0.0);
    if (wave.sample_begin > 0u) {
        mean.x = means[out];
        if (first_channel + 1u < CHANNELS) { mean.y = means[out + 1u]; }
        if (first_channel + 2u < CHANNELS) { mean.z = means[out + 2u]; }
        if (first_channel + 3u < CHANNELS) { mean.w = means[out + 3u]; }
    }

#if REGISTERS
#if STRATA
#else
    // One stratum: every spectrum of these channels stays in registers.
#repeat FACTORS
    let factor_value_$i = spectra[table_index(0u, $(1+i)u, quad)];
    let factor_slope_$i = spectra[table_index(0u, $(1+i)u, quad) + 1u];
#end
#repeat SOURCES
    let source_value_$i = spectra[table_index(0u, FIRST_SOURCE + $iu, quad)];
    let source_slope_$i = spectra[table_index(0u, FIRST_SOURCE + $iu, quad) + 1u];
#end
#endif
#endif

    var bad_count = 0u;
    var negative_count = 0u;
    var bad_sample = 0u;
    for (var i = 0u; i < wave.samples; i += 1u) {
        let path = local_slot * wave.samples + i;
        let head = heads[path];
        let s = spectral_sample(head.x);
#if REGISTERS
#repeat FACTORS
#if STRATA
        let factor_at_$i = table_index(s.stratum, $(1+i)u, quad);
        let factor_$i = spectra[factor_at_$i] + s.place * spectra[factor_at_$i + 1u];
#else
        let factor_$i = factor_value_$i + s.place * factor_slope_$i;
#endif
#end
#repeat SOURCES
#if STRATA
        let source_at_$i = table_index(s.stratum, FIRST_SOURCE + $iu, quad);
        let source_$i = spectra[source_at_$i] + s.place * spectra[source_at_$i + 1u];
#else
        let source_$i = source_value_$i + s.place * source_slope_$i;
#endif
#end
#endif

        var throughput = vec4<f32>(1.0);
        var radiance = vec4<f32>(0.0);
        let first_record = path * frame.max_records;
        for (var r = first_record; r < first_record + head.y; r += 1u) {
            let record = records[r];
            let factor_id = record.x & 0xffffu;
            let source_id = record.x >> 16u;
#if REGISTERS
            var factor = vec4<f32>(1.0);
            var source = vec4<f32>(0.0);
#repeat FACTORS
            factor = select(factor, factor_$i, factor_id == $(1+i)u);
#end
#repeat SOURCES
            source = select(source, source_$i, source_id == FIRST_SOURCE + $iu);
#end
#else
            let factor = spectrum_value(factor_id, quad, s);
            let source = spectrum_value(source_id, quad, s);
#endif
            throughput *= factor;
            radiance += bitcast<f32>(record.y) * throughput * source;
        }

        // Infinite, NaN or with the sign bit set: told by the bits, since compilers may assume that NaN does not occur.
        let bits = bitcast<vec4<u32>>(radiance);
        let non_finite = (bits & vec4<u32>(0x7f800000u)) == vec4<u32>(0x7f800000u);
        let suspect = bits > vec4<u32>(0x7f7fffffu);
        if (any(suspect)) {
            let negative = suspect & !non_finite & (bits != vec4<u32>(0x80000000u));
            bad_count += dot(select(vec4<u32>(0u), vec4<u32>(1u), non_finite), vec4<u32>(1u));
            negative_count += dot(select(vec4<u32>(0u), vec4<u32>(1u), negative), vec4<u32>(1u));
            bad_sample = select(wave.sample_begin + i + 1u, bad_sample, bad_sample != 0u);
        }
        radiance = select(radiance, vec4<f32>(0.0), non_finite);
        mean += (radiance - mean) / f32(wave.sample_begin + i + 1u);
    }

    means[out] = mean.x;
    if (first_channel + 1u < CHANNELS) { means[out + 1u] = mean.y; }
    if (first_channel + 2u < CHANNELS) { means[out + 2u] = mean.z; }
    if (first_channel + 3u < CHANNELS) { means[out + 3u] = mean.w; }
    if (bad_count + negative_count > 0u) {
        atomicAdd(&counters[COUNTER_NON_FINITE], bad_count);
        atomicAdd(&counters[COUNTER_NEGATIVE], negative_count);
        // The first to come says where.
        if (atomicMax(&counters[COUNTER_BAD_SAMPLE], bad_sample) == 0u) {
            atomicStore(&counters[COUNTER_BAD_SLOT], slot);
        }
    }
}
