// Any ray through the renderer's own traversal: (origin, limit), (direction, -) in; (distance, primitive, overflow, -) out.

@group(1) @binding(0) var<storage, read> rays: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> hits: array<vec4<u32>>;

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3<u32>) {
    if (2u * id.x >= arrayLength(&rays)) {
        return;
    }
    let start = rays[2u * id.x];
    var overflow = false;
    let hit = traverse(Ray(start.xyz, rays[2u * id.x + 1u].xyz), start.w, false, &overflow);
    hits[id.x] = vec4<u32>(bitcast<u32>(hit.distance), hit.primitive, select(0u, 1u, overflow), 0u);
}
