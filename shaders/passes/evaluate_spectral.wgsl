// Evaluate, spectrally parallel (Hoarau et al. 2018, section 5.2): a workgroup has one path (several, when there are few
// channels), and each of its threads VECTORS x 4 of the channels, so that all read the same records at the same time. A dispatch
// takes one sample of every pixel, so that nobody else refines the same mean.

@group(1) @binding(6) var<uniform> step: Step;

@compute @workgroup_size($WORKGROUP)
fn evaluate_spectral(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                     @builtin(local_invocation_index) thread: u32) {
    let local_slot = (group.x + group.y * groups.x) * PIXELS_PER_GROUP + thread / LANES;
    let first_quad = (group.z * LANES + thread % LANES) * VECTORS;
    if (local_slot >= wave.pixel_count || first_quad >= QUADS) {
        return;
    }
    let slot = wave.pixel_begin + local_slot;
    let path = local_slot * wave.samples + step.sample;
    let head = heads[path];
#if WAVELENGTHS
#else
    let s = spectral_sample(head.x);
#endif
#include common/path_chance.wgsl
    let first_record = path * frame.max_records;
    let index = wave.sample_begin + step.sample + 1u;
    var bad = BadSamples(0u, 0u, 0u);
#repeat VECTORS v
    let quad_$v = min(first_quad + $vu, QUADS - 1u);
#end
#include common/each_wavelength.wgsl
#repeat VECTORS v
    var throughput_$v = first_throughput(quad_$v, s);
    var radiance_$v = vec4<f32>(0.0);
#end
#include common/records.wgsl
#include common/mean_over_wavelengths.wgsl

#repeat VECTORS v
    if (first_quad + $vu < QUADS) {
        let out_$v = slot * CHANNELS + 4u * quad_$v;
        refine_mean(out_$v, min(4u, CHANNELS - 4u * quad_$v), checked(radiance_$v, index, &bad), index);
    }
#end
    if (thread % LANES == 0u) {
        var foreign = head.y ^ (wave.sequence << 16u);
#if THINNED
        foreign |= head.z ^ (wave.sequence << 16u);
#endif
        prove(1u, foreign, local_slot == 0u && group.z == 0u);
    }
    report(bad, slot);
}
