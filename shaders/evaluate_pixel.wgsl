// Evaluate, pixel-major: a workgroup owns one pixel (several, when there are few channels) and a block of channels,
// VECTORS x 4 channels a thread. It walks the pixel's saved paths in sample order, evaluates every channel along each, and
// folds them into the running mean in registers; no atomics, one write at the end (Algorithm 1 of the method, with the
// loops over paths and channels exchanged).

@group(1) @binding(0) var<uniform> wave: Wave;
@group(1) @binding(3) var<storage, read> heads: array<vec2<u32>>;
#if GENERAL
@group(1) @binding(4) var<storage, read> records: array<vec4<u32>>;
#else
@group(1) @binding(4) var<storage, read> records: array<vec2<u32>>;
#endif
@group(1) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;
// [stratum][spectrum][quad of channels][value, slope]; spectrum 0 is the constant 1.
@group(1) @binding(8) var<storage, read> spectra: array<vec4<f32>>;
// [pixel slot of the wave's units][channel].
@group(1) @binding(9) var<storage, read_write> means: array<f32>;
// Where the path's wavelength sample stands: its stratum, and the place within.
struct SpectralSample {
    stratum: u32,
    place: f32,
#if KNOTS
    mu: u32,
#endif
}

fn spectral_sample(mu: u32) -> SpectralSample {
    var s: SpectralSample;
    s.place = f32((mu << frame.stratum_bits) >> 8u) * 5.9604645e-8;
#if STRATA
    s.stratum = mu >> (32u - frame.stratum_bits);
#endif
#if KNOTS
    s.mu = mu;
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

@compute @workgroup_size($WORKGROUP)
fn evaluate_pixel(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                  @builtin(local_invocation_index) thread: u32) {
    let local_slot = (group.x + group.y * groups.x) * PIXELS_PER_GROUP + thread / LANES;
    let lane = group.z * LANES + thread % LANES;
    let first_quad = lane * VECTORS;
    if (local_slot >= wave.pixel_count || first_quad >= QUADS) {
        return;
    }
    let slot = wave.pixel_begin + local_slot;

    // This thread's quads of channels. Past the last one they repeat it, and are not written.
#repeat VECTORS v
    let quad_$v = min(first_quad + $vu, QUADS - 1u);
    let out_$v = slot * CHANNELS + 4u * quad_$v;
    let channels_$v = select(0u, min(4u, CHANNELS - 4u * quad_$v), first_quad + $vu < QUADS);
    // Waves of one unit take turns: each goes on from the mean that the last one left.
    var mean_$v = vec4<f32>(0.0);
    if (wave.sample_begin > 0u) {
        mean_$v = load_mean(out_$v, channels_$v);
    }
#end

#if REGISTERS
#if STRATA
#else
    // One stratum: every spectrum of these channels stays in registers.
#repeat VECTORS v
#repeat FACTORS i
    let factor_value_$i_$v = spectra[table_index(0u, $(1+i)u, quad_$v)];
    let factor_slope_$i_$v = spectra[table_index(0u, $(1+i)u, quad_$v) + 1u];
#end
#repeat SOURCES i
    let source_value_$i_$v = spectra[table_index(0u, FIRST_SOURCE + $iu, quad_$v)];
    let source_slope_$i_$v = spectra[table_index(0u, FIRST_SOURCE + $iu, quad_$v) + 1u];
#end
#end
#endif
#endif

    var bad = BadSamples(0u, 0u, 0u);
    // Bits in which the mark of a path's end differs from this wave's.
    var foreign = 0u;
    let mark = wave.sequence << 16u;
    for (var i = 0u; i < wave.samples; i += 1u) {
        let path = local_slot * wave.samples + i;
        let head = heads[path];
        let s = spectral_sample(head.x);
        // Records in the low half; in the high one the wave, once the path has ended.
        let used = head.y & 0xffffu;
        foreign |= head.y ^ mark;
#if REGISTERS
#repeat VECTORS v
#repeat FACTORS i
#if STRATA
        let factor_at_$i_$v = table_index(s.stratum, $(1+i)u, quad_$v);
        let factor_$i_$v = spectra[factor_at_$i_$v] + s.place * spectra[factor_at_$i_$v + 1u];
#else
        let factor_$i_$v = factor_value_$i_$v + s.place * factor_slope_$i_$v;
#endif
#end
#repeat SOURCES i
#if STRATA
        let source_at_$i_$v = table_index(s.stratum, FIRST_SOURCE + $iu, quad_$v);
        let source_$i_$v = spectra[source_at_$i_$v] + s.place * spectra[source_at_$i_$v + 1u];
#else
        let source_$i_$v = source_value_$i_$v + s.place * source_slope_$i_$v;
#endif
#end
#end
#endif

#repeat VECTORS v
#if WEIGHTED
        // What the channel's response and the density of wavelengths make of this one, before anything else.
#if REGISTERS
        let weight_at_$v = table_index(s.stratum, PATH_WEIGHT, quad_$v);
        var throughput_$v = spectra[weight_at_$v] + s.place * spectra[weight_at_$v + 1u];
#else
        var throughput_$v = spectrum_value(PATH_WEIGHT, quad_$v, s);
#endif
#else
        var throughput_$v = vec4<f32>(1.0);
#endif
        var radiance_$v = vec4<f32>(0.0);
#if GENERAL
        var product_$v = vec4<f32>(0.0);
        var factor_$v = vec4<f32>(0.0);
#endif
#if KEPT
        var kept_$v = vec4<f32>(0.0);
#endif
#if RADIATORS
        var held_$v = vec4<f32>(0.0);
#endif
#end
        let first_record = path * frame.max_records;
        for (var r = first_record; r < first_record + used; r += 1u) {
            let record = records[r];
#if GENERAL
#if RAW_RECORDS
            var raw = vec4<f32>(0.0);
            if ((record.x & 0x3fu) >= FIRST_RAW_OP) {
                r += 1u;
                raw = bitcast<vec4<f32>>(records[r]);
            }
#else
            let raw = vec4<f32>(0.0);
#endif
            let weight = bitcast<f32>(record.z);
#if MEDIA
            if ((record.x & 0x3fu) == OP_MEDIUM) {
#repeat VECTORS v
                let depth_$v = bitcast<f32>(record.w) * spectrum_value(record.y, quad_$v, s);
                if (weight > 0.0) {
                    radiance_$v += weight * throughput_$v * absorbed(depth_$v) * spectrum_value(record.x >> 16u, quad_$v, s);
                }
                throughput_$v *= exp(-depth_$v);
#end
                continue;
            }
#if GRIDS
            if ((record.x & 0x3fu) == OP_MARCH) {
                let march_from = bitcast<vec4<f32>>(records[r + 1u]).xyz;
                let march_to = bitcast<vec4<f32>>(records[r + 2u]).xyz;
                r += 2u;
                let on_factor = (record.x & MODE_ON_F) != 0u;
#repeat VECTORS v
                var through_$v = select(throughput_$v, factor_$v, on_factor);
                march(record, march_from, march_to, quad_$v, s, select(weight, 0.0, on_factor), &through_$v, &radiance_$v);
                throughput_$v = select(through_$v, throughput_$v, on_factor);
                factor_$v = select(factor_$v, through_$v, on_factor);
                if ((record.x & MODE_GATHER) != 0u) {
                    radiance_$v += throughput_$v * factor_$v * spectrum_value(record.x >> 16u, quad_$v, s);
                    factor_$v = vec4<f32>(0.0);
                }
#end
                continue;
            }
#endif
#endif
#if RADIATORS
            if ((record.x & 0x3fu) == OP_HOLD) {
#repeat VECTORS v
                held_$v = factor_$v;
                factor_$v = vec4<f32>(0.0);
#end
                continue;
            }
#endif
#repeat VECTORS v
            var value_$v = operation_value(record, raw, quad_$v, s);
#end
#if RADIATORS
            if ((record.x & 0x3fu) == OP_HELD) {
#repeat VECTORS v
                value_$v = held_$v;
#end
            }
#endif
#if KEPT
            if ((record.x & MODE_KEEP) != 0u) {
#repeat VECTORS v
                kept_$v += weight * value_$v;
#end
                continue;
            }
#if RADIATORS
            if ((record.x & 0x3fu) == OP_ABSORBED) {
#repeat VECTORS v
                value_$v = max(1.0 - kept_$v, vec4<f32>(0.0)) / (1.0 - kept_$v * bitcast<f32>(record.w) * value_$v);
                kept_$v = vec4<f32>(0.0);
#end
            }
#endif
            if ((record.x & 0x3fu) == OP_INNER) {
#repeat VECTORS v
                value_$v = kept_$v / (1.0 - kept_$v * value_$v);
                kept_$v = vec4<f32>(0.0);
#end
            }
#endif
            if ((record.x & 0x3fu) == OP_PLAIN) {
#repeat VECTORS v
                throughput_$v *= value_$v;
                radiance_$v += weight * throughput_$v * spectrum_value(record.x >> 16u, quad_$v, s);
#end
                continue;
            }
#repeat VECTORS v
            let weighted_$v = weight * value_$v;
            product_$v = select(product_$v, vec4<f32>(1.0), (record.x & MODE_START) != 0u);
            product_$v = select(product_$v * weighted_$v, product_$v, (record.x & MODE_ON_F) != 0u);
            factor_$v = select(factor_$v, factor_$v * weighted_$v, (record.x & MODE_ON_F) != 0u);
            factor_$v = select(factor_$v, factor_$v + product_$v, (record.x & MODE_ADD) != 0u);
#end
            if ((record.x & MODE_GATHER) != 0u) {
#repeat VECTORS v
                radiance_$v += throughput_$v * factor_$v * spectrum_value(record.x >> 16u, quad_$v, s);
                factor_$v = vec4<f32>(0.0);
#end
            }
            if ((record.x & MODE_ADVANCE) != 0u) {
#if OP_ONLY
                // Most channels of a path that dispersion left to one have nothing to come.
                var left = false;
#endif
#repeat VECTORS v
                throughput_$v *= factor_$v;
                factor_$v = vec4<f32>(0.0);
#if OP_ONLY
                left = left || any(throughput_$v != vec4<f32>(0.0));
#endif
#end
#if OP_ONLY
                if (!left) {
                    break;
                }
#endif
            }
#else
            let factor_id = record.x & 0xffffu;
            let source_id = record.x >> 16u;
            let weight = bitcast<f32>(record.y);
#repeat VECTORS v
#if REGISTERS
            var factor_$v = vec4<f32>(1.0);
            var source_$v = vec4<f32>(0.0);
#repeat FACTORS i
            factor_$v = select(factor_$v, factor_$i_$v, factor_id == $(1+i)u);
#end
#repeat SOURCES i
            source_$v = select(source_$v, source_$i_$v, source_id == FIRST_SOURCE + $iu);
#end
#else
            let factor_$v = spectrum_value(factor_id, quad_$v, s);
            let source_$v = spectrum_value(source_id, quad_$v, s);
#endif
            throughput_$v *= factor_$v;
            radiance_$v += weight * throughput_$v * source_$v;
#end
#endif
        }

        let index = wave.sample_begin + i + 1u;
#repeat VECTORS v
        mean_$v += (checked(radiance_$v, index, &bad) - mean_$v) / f32(index);
#end
    }

#repeat VECTORS v
    store_mean(out_$v, channels_$v, mean_$v);
#end
    // A kernel that a driver drops without a word is noticed by this.
    if (thread % LANES == 0u) {
        atomicAdd(&counters[COUNTER_FOLDED], select(wave.samples, 0u, foreign > 0xffffu));
        if (local_slot == 0u && group.z == 0u) {
            atomicStore(&counters[COUNTER_SEQUENCE], wave.sequence);
        }
    }
    if (bad.non_finite + bad.negative > 0u) {
        atomicAdd(&counters[COUNTER_NON_FINITE], bad.non_finite);
        atomicAdd(&counters[COUNTER_NEGATIVE], bad.negative);
        // The first to come says where.
        if (atomicMax(&counters[COUNTER_BAD_SAMPLE], bad.sample) == 0u) {
            atomicStore(&counters[COUNTER_BAD_SLOT], slot);
        }
    }
}
