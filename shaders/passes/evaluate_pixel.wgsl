// Evaluate, pixel-major: a workgroup owns one pixel (several, when there are few channels) and a block of channels,
// VECTORS x 4 channels a thread. It walks the pixel's saved paths in sample order, evaluates every channel along each, and
// folds them into the running mean in registers; no atomics, one write at the end (Algorithm 1 of Hoarau et al. 2018,
// with the loops over paths and channels exchanged).

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

#include common/hold_spectra.wgsl

    var bad = BadSamples(0u, 0u, 0u);
    // Bits in which the mark of a path's end differs from this wave's.
    var foreign = 0u;
    let mark = wave.sequence << 16u;
    for (var i = 0u; i < wave.samples; i += 1u) {
#if THINNED
        // Paths of which nothing is evaluated, in a loop of their own: software devices go through all of a loop's body that is skipped.
        var head: vec4<u32>;
        for (; i < wave.samples; i += 1u) {
            head = heads[local_slot * wave.samples + i];
            if (evaluates(head)) {
                break;
            }
            foreign |= (head.y ^ mark) | (head.z ^ mark);
#repeat VECTORS v
            mean_$v += (vec4<f32>(0.0) - mean_$v) / f32(wave.sample_begin + i + 1u);
#end
        }
        if (i >= wave.samples) {
            break;
        }
#endif
        let path = local_slot * wave.samples + i;
#if THINNED
#else
        let head = heads[path];
#endif
#if WAVELENGTHS
#else
        let s = spectral_sample(head.x);
#endif
        // Records in the low half; in the high one the wave, once the path has ended.
#include common/path_chance.wgsl
        foreign |= head.y ^ mark;
#if THINNED
        foreign |= head.z ^ mark;
#endif
#include common/each_wavelength.wgsl
#include common/held_spectra.wgsl

#repeat VECTORS v
        var throughput_$v = first_throughput(quad_$v, s);
        var radiance_$v = vec4<f32>(0.0);
#end
        let first_record = path * frame.max_records;
#include common/records.wgsl
#include common/mean_over_wavelengths.wgsl

        let index = wave.sample_begin + i + 1u;
#repeat VECTORS v
        mean_$v += (checked(radiance_$v, index, &bad) - mean_$v) / f32(index);
#end
    }

#repeat VECTORS v
    store_mean(out_$v, channels_$v, mean_$v);
#end
    if (thread % LANES == 0u) {
        prove(wave.samples, foreign, local_slot == 0u && group.z == 0u);
    }
    report(bad, slot);
}
