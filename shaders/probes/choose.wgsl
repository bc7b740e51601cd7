// The renderer's choice of directions at a surface of material 0 along z. The first question is (o, 1 if from behind), then
// (two random numbers for the direction, two for the lobe) with (0, 0, 0, 0) after it give (direction, 1), or 0 where nothing
// goes on, or -1 for the only direction of a lobe; (direction, -) with (1, 0, 0, 0) after it give the density.

@group(1) @binding(0) var<storage, read> asked: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> given: array<vec4<f32>>;

@compute @workgroup_size(64)
fn choose(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let n = id.x + id.y * groups.x * 64u;
    if (2u * n + 2u >= arrayLength(&asked)) {
        return;
    }
    let question = asked[2u * n + 1u];
    let material = surface_materials[0];
    var v: Vertex;
    v.s = vec3<f32>(1.0, 0.0, 0.0);
    v.t = vec3<f32>(0.0, 1.0, 0.0);
    v.normal = vec3<f32>(0.0, 0.0, 1.0);
    v.o = asked[0].xyz;
    v.inside = asked[0].w > 0.0;
#if TEXTURES
    v.uv = vec2<f32>(0.3, 0.6);
#endif
#if RATIOS
    // As of a path that has just begun.
    technique = n % TECHNIQUES;
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        ratios[t] = 1.0;
    }
#endif
#if BENDS_BY_TECHNIQUE
    lone_channel = NONE;
#endif
    let choice = choose_direction(material, &v, question.xy, question.zw, 0x80000000u, NONE);
    if (asked[2u * n + 2u].x > 0.0) {
        given[n] = vec4<f32>(question.xyz, bsdf_density(material, v, question.xyz));
        return;
    }
    let goes_on = choice.lobe != NONE && choice.goes_on;
    given[n] = vec4<f32>(choice.direction, select(0.0, select(1.0, -1.0, choice.density < 0.0), goes_on));
}
