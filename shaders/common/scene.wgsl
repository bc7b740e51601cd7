// Group 0: the scene, one immutable copy per device. Nodes and primitives may be spread over several windows, since a
// binding is limited.

#if GENERAL
#else
@group(0) @binding(1) var<storage, read> materials: array<Material>;
#endif
@group(0) @binding(2) var<storage, read> emitters: array<Emitter>;
#repeat NODE_WINDOWS i
@group(0) @binding($(4+i)) var<storage, read> nodes_$i: array<vec4<u32>>;
#end
#repeat PRIMITIVE_WINDOWS i
@group(0) @binding($(8+i)) var<storage, read> primitives_$i: array<vec4<u32>>;
#end

#if NODE_WINDOWS
// Word `part` (0..5) of an 80-byte CWBVH node.
fn load_node(node: u32, part: u32) -> vec4<u32> {
#if MANY_NODE_WINDOWS
    let window = node / NODE_WINDOW;
    let at = (node % NODE_WINDOW) * 5u + part;
    switch (window) {
#repeat NODE_WINDOWS i
        case $iu: { return nodes_$i[at]; }
#end
        default: { return vec4<u32>(0u); }
    }
#else
    return nodes_0[node * 5u + part];
#endif
}
#endif

// A 48-byte primitive. Words that are not numbers never pass through a float, which could lose them as subnormal.
fn load_primitive(primitive: u32) -> Primitive {
    let w0 = load_primitive_part(primitive, 0u);
    let w1 = load_primitive_part(primitive, 1u);
    let w2 = load_primitive_part(primitive, 2u);
    return Primitive(bitcast<vec3<f32>>(w0.xyz), w0.w, bitcast<vec3<f32>>(w1.xyz), w1.w, bitcast<vec3<f32>>(w2.xyz));
}

fn load_primitive_part(primitive: u32, part: u32) -> vec4<u32> {
#if MANY_PRIMITIVE_WINDOWS
    let window = primitive / PRIMITIVE_WINDOW;
    let at = (primitive % PRIMITIVE_WINDOW) * 3u + part;
    switch (window) {
#repeat PRIMITIVE_WINDOWS i
        case $iu: { return primitives_$i[at]; }
#end
        default: { return vec4<u32>(0u); }
    }
#else
    return primitives_0[primitive * 3u + part];
#endif
}
