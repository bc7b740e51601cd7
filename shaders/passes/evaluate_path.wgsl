// Evaluate, path by path (Hoarau et al. 2018, section 5.1 and Algorithm 1): a thread has one path, and goes through its channels
// in batches of VECTORS x 4, for each of which it reads the whole path again. The state of a batch stays in registers. A dispatch
// takes one sample of every pixel, so that nobody else refines the same mean.

@group(1) @binding(6) var<uniform> step: Step;

@compute @workgroup_size(64)
fn evaluate_path(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let local_slot = id.x + id.y * groups.x * 64u;
    if (local_slot >= wave.pixel_count) {
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
    let first_batch = id.z * BATCHES;
    for (var b = first_batch; b < min(first_batch + BATCHES, (QUADS + VECTORS - 1u) / VECTORS); b += 1u) {
#repeat VECTORS v
        let quad_$v = min(b * VECTORS + $vu, QUADS - 1u);
        let out_$v = slot * CHANNELS + 4u * quad_$v;
        let channels_$v = select(0u, min(4u, CHANNELS - 4u * quad_$v), b * VECTORS + $vu < QUADS);
#end
#include common/each_wavelength.wgsl
#repeat VECTORS v
        var throughput_$v = first_throughput(quad_$v, s);
        var radiance_$v = vec4<f32>(0.0);
#end
#include common/records.wgsl
#include common/mean_over_wavelengths.wgsl

#repeat VECTORS v
        if (channels_$v > 0u) {
            refine_mean(out_$v, channels_$v, checked(radiance_$v, index, &bad), index);
        }
#end
    }
    var foreign = head.y ^ (wave.sequence << 16u);
#if THINNED
    foreign |= head.z ^ (wave.sequence << 16u);
#endif
    prove(1u, foreign, local_slot == 0u && id.z == 0u);
    report(bad, slot);
}
