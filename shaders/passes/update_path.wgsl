// The conventional path tracer (Hoarau et al. 2018, section 4), one bounce of every path that was under way: after `generate` has found
// the vertex, the state of all channels is read from memory, taken through what happened there, and written back. A workgroup has
// one path (several, when there are few channels), each of its threads VECTORS x 4 of the channels.

@group(1) @binding(6) var<uniform> step: Step;
@group(1) @binding(12) var<storage, read> queue: array<u32>;
@group(1) @binding(13) var<storage, read> queue_lengths: array<u32>;
@group(1) @binding(14) var<storage, read_write> spectral_states: array<vec4<f32>>;

@compute @workgroup_size($WORKGROUP)
fn update_path(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
               @builtin(local_invocation_index) thread: u32) {
    let place = (group.x + group.y * groups.x) * PIXELS_PER_GROUP + thread / LANES;
    let first_quad = (group.z * LANES + thread % LANES) * VECTORS;
    if (first_quad >= QUADS) {
        return;
    }
    var path = place;
    if (step.bounce == 0u) {
        if (place >= wave.path_count) {
            return;
        }
    } else {
        if (place >= queue_lengths[step.bounce - 1u]) {
            return;
        }
        path = queue[(step.bounce & 1u) * wave.path_count + place];
    }
    let head = heads[path];
#if WAVELENGTHS
#else
    let s = spectral_sample(head.x);
#endif
    // Of this bounce alone.
    let used = head.y & 0xffffu;
    let first_record = path * frame.max_records;
#if WAVELENGTHS
    for (var turn = 0u; turn < WAVELENGTHS; turn += 1u) {
    let s = spectral_sample(head.x + turn * WAVELENGTH_STEP);
#endif
#repeat VECTORS v
    let quad_$v = min(first_quad + $vu, QUADS - 1u);
#if WAVELENGTHS
    let state_$v = ((path * WAVELENGTHS + turn) * QUADS + quad_$v) * STATE_QUADS;
#else
    let state_$v = (path * QUADS + quad_$v) * STATE_QUADS;
#endif
    var throughput_$v = first_throughput(quad_$v, s);
    var before_$v = vec4<f32>(0.0);
    if (step.bounce > 0u) {
        throughput_$v = spectral_states[state_$v + STATE_THROUGHPUT];
        before_$v = spectral_states[state_$v + STATE_RADIANCE] + spectral_states[state_$v + STATE_DIRECT];
    }
    var radiance_$v = vec4<f32>(0.0);
#end
#include common/records.wgsl

#repeat VECTORS v
    if (first_quad + $vu < QUADS) {
        spectral_states[state_$v + STATE_THROUGHPUT] = throughput_$v;
        spectral_states[state_$v + STATE_RADIANCE] = before_$v;
        spectral_states[state_$v + STATE_DIRECT] = radiance_$v;
    }
#end
#if WAVELENGTHS
    }
#endif
}
