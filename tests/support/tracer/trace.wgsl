// Any ray through the renderer's own traversal: (origin, limit), (direction, -) in; (distance, primitive, overflow, instance) out.

@group(1) @binding(0) var<storage, read> asked: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> given: array<vec4<u32>>;

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let n = id.x + id.y * groups.x * 64u;
    if (2u * n >= arrayLength(&asked)) {
        return;
    }
    let start = asked[2u * n];
    var overflow = false;
    let hit = traverse(Ray(start.xyz, asked[2u * n + 1u].xyz), start.w, false, &overflow);
    var instance = NONE;
#if INSTANCES
    instance = hit.instance;
#endif
    given[n] = vec4<u32>(bitcast<u32>(hit.distance), hit.primitive, select(0u, 1u, overflow), instance);
}
