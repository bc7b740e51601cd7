// The renderer's choice of directions: (two random numbers, -, 0) in, (direction, density) out; or (direction, 1) in, its density
// out. Of the map, if there is one, else of the first lamp, chosen for sure.

@group(1) @binding(0) var<storage, read> asked: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> given: array<vec4<f32>>;

@compute @workgroup_size(64)
fn aim(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= arrayLength(&asked)) {
        return;
    }
    let question = asked[id.x];
#if MAP
    if (question.w == 0.0) {
        let sampled = sample_map(question.xy);
        given[id.x] = vec4<f32>(sampled.direction, sampled.density);
    } else {
        given[id.x] = vec4<f32>(question.xyz, find_in_map(question.xyz).density);
    }
#else
    let sure = Emitter(0u, EMITTER_IS_LAMP, 1.0, 1.0);
    if (question.w == 0.0) {
        let aim = aim_at_lamp(sure, vec3<f32>(0.0), question.xy);
        given[id.x] = vec4<f32>(aim.towards, aim.density);
    } else {
        given[id.x] = vec4<f32>(question.xyz, sun_density(sure, question.xyz));
    }
#endif
}
