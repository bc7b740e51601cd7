// The conventional path tracer, when all paths of a wave have ended: their radiances into the running means of the pixels, in sample
// order. A workgroup owns one pixel (several, when there are few channels), as in evaluate_pixel.wgsl.

@group(1) @binding(14) var<storage, read> spectral_states: array<vec4<f32>>;

@compute @workgroup_size($WORKGROUP)
fn fold_paths(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) thread: u32) {
    let local_slot = (group.x + group.y * groups.x) * PIXELS_PER_GROUP + thread / LANES;
    let first_quad = (group.z * LANES + thread % LANES) * VECTORS;
    if (local_slot >= wave.pixel_count || first_quad >= QUADS) {
        return;
    }
    let slot = wave.pixel_begin + local_slot;
    var bad = BadSamples(0u, 0u, 0u);
    var foreign = 0u;
    for (var i = 0u; i < wave.samples; i += 1u) {
        let path = local_slot * wave.samples + i;
        foreign |= heads[path].y ^ (wave.sequence << 16u);
        let index = wave.sample_begin + i + 1u;
#repeat VECTORS v
        if (first_quad + $vu < QUADS) {
#if WAVELENGTHS
            var sum_$v = vec4<f32>(0.0);
            for (var turn = 0u; turn < WAVELENGTHS; turn += 1u) {
                let state_$v = ((path * WAVELENGTHS + turn) * QUADS + first_quad + $vu) * STATE_QUADS;
                sum_$v += spectral_states[state_$v + STATE_RADIANCE] + spectral_states[state_$v + STATE_DIRECT];
            }
            let radiance_$v = sum_$v / f32(WAVELENGTHS);
#else
            let state_$v = (path * QUADS + first_quad + $vu) * STATE_QUADS;
            let radiance_$v = spectral_states[state_$v + STATE_RADIANCE] + spectral_states[state_$v + STATE_DIRECT];
#endif
            let quad_$v = first_quad + $vu;
            let out_$v = slot * CHANNELS + 4u * quad_$v;
            refine_mean(out_$v, min(4u, CHANNELS - 4u * quad_$v), checked(radiance_$v, index, &bad), index);
        }
#end
    }
    if (thread % LANES == 0u) {
        prove(wave.samples, foreign, local_slot == 0u && group.z == 0u);
    }
    report(bad, slot);
}
