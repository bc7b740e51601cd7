// The renderer's aim at a light: the first question is (origin, -), then (two random numbers, -, 0) give (direction or point, density),
// and (direction, 1) give its density. Of the map, if there is one, else of the first emitter, chosen for sure.

@group(1) @binding(0) var<storage, read> asked: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> given: array<vec4<f32>>;

@compute @workgroup_size(64)
fn aim(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let n = id.x + id.y * groups.x * 64u;
    if (n + 1u >= arrayLength(&asked)) {
        return;
    }
    let question = asked[n + 1u];
#if MAP
    if (question.w == 0.0) {
        let sampled = sample_map(question.xy);
        given[n] = vec4<f32>(sampled.direction, sampled.density);
    } else {
        given[n] = vec4<f32>(question.xyz, find_in_map(question.xyz).density);
    }
#else
    var sure = emitters[0];
    sure.pick = 1.0;
#if LAMPS
    if (question.w == 0.0) {
        let aim = aim_at_lamp(sure, asked[0].xyz, question.xy);
        given[n] = vec4<f32>(aim.towards, aim.density);
    } else {
        given[n] = vec4<f32>(question.xyz, sun_density(sure, question.xyz));
    }
#else
    let point = sample_emitter(sure, asked[0].xyz, question.xy);
    given[n] = vec4<f32>(point.position, point.density);
#endif
#endif
}
