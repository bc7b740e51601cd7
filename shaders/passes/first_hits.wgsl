// What any ray meets first: (origin, limit), (direction, -) in; (distance, primitive, flags, instance) out. Not of a path: the host asks, for the
// layers of a tile, and goes on by itself where a surface lets rays pass.

#constants FIRST_HITS

@group(1) @binding(0) var<storage, read> asked: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> met: array<vec4<u32>>;

#if OPACITY
// Of surfaces that are there for some rays only: whether less than half of them.
fn is_open(ray: Ray, hit: Hit) -> bool {
    let material = load_primitive_part(hit.primitive, 0u).w & 0x00ffffffu;
    if (material == 0x00ffffffu) {
        return false;
    }
    let flags = surface_materials[material].flags;
    return (flags & MATERIAL_MASKED) != 0u && masked_opacity(flags, hit, surface_at(ray, hit)) < 0.5;
}
#endif

@compute @workgroup_size(64)
fn first_hits(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = id.x;
    if (2u * n >= arrayLength(&asked)) {
        return;
    }
    let start = asked[2u * n];
    let ray = Ray(start.xyz, asked[2u * n + 1u].xyz);
    var overflow = false;
    let hit = traverse(ray, start.w, false, &overflow);
    var flags = select(0u, FIRST_HIT_OVERFLOW, overflow);
#if OPACITY
    if (hit.primitive != NONE && is_open(ray, hit)) {
        flags |= FIRST_HIT_OPEN;
    }
#endif
    var instance = NONE;
#if INSTANCES
    instance = hit.instance;
#endif
    met[n] = vec4<u32>(bitcast<u32>(hit.distance), hit.primitive, flags, instance);
}
