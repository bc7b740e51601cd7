// Traversal of the compressed wide BVH (Ylitie, Karras and Laine, HPG 2017), nodes as obvhs builds them. The stack is
// as deep as this scene's tree: a private array costs a software device by its size.
const STACK_SIZE: u32 = $STACK_SIZE;

// A driver in use ends loops silently after 65,535 iterations of an invocation: two traversals must stay below half.
#if LONG_WAYS
// All traversals of an invocation share the steps, since paths pass boundaries of media, and what lets them pass, without number.
const MAX_STEPS: u32 = 24000u;
var<private> steps_taken: u32;
#else
const MAX_STEPS: u32 = 12000u;
#endif

// For four children: entry and exit distances from quantised planes; a bit pattern for each child that is hit.
fn hit_children(lo: array<vec4<f32>, 3>, hi: array<vec4<f32>, 3>, scale: vec3<f32>, base_lo: vec3<f32>, base_hi: vec3<f32>,
                limit: f32, bits: vec4<u32>) -> u32 {
    let near = max(max(lo[0] * scale.x + base_lo.x, lo[1] * scale.y + base_lo.y), max(lo[2] * scale.z + base_lo.z, vec4<f32>(0.0)));
    let far = min(min(hi[0] * scale.x + base_hi.x, hi[1] * scale.y + base_hi.y), min(hi[2] * scale.z + base_hi.z, vec4<f32>(limit)));
    let hit = select(vec4<u32>(0u), bits, near <= far);
    return (hit.x | hit.y) | (hit.z | hit.w);
}

// What each of four children contributes to the hit mask: internal children set one bit in the high byte, ordered
// by the ray's octant; leaves set one bit per primitive in the low 24.
fn child_bits(meta4: u32, octant4: u32) -> vec4<u32> {
    let is_inner = (meta4 & (meta4 << 1u)) & 0x10101010u;
    let inner_mask = (is_inner >> 4u) * 0xffu;
    let index4 = (meta4 ^ (octant4 & inner_mask)) & 0x1f1f1f1fu;
    let bits4 = (meta4 >> 5u) & 0x07070707u;
    return unpack4xU8(bits4) << unpack4xU8(index4);
}

fn planes(word: u32) -> vec4<f32> {
    return vec4<f32>(unpack4xU8(word));
}

// A ray as boxes are held against it.
struct Slabs {
    origin: vec3<f32>,
    inverse: vec3<f32>,
    negative: vec3<bool>,
    octant4: u32,
}

fn slabs(origin: vec3<f32>, along: vec3<f32>) -> Slabs {
    // A zero component becomes tiny, so that its reciprocal stays finite.
    let tiny = abs(along) < vec3<f32>(1.0e-18);
    let direction = select(along, select(vec3<f32>(1.0e-18), vec3<f32>(-1.0e-18), along < vec3<f32>(0.0)), tiny);
    let negative = direction < vec3<f32>(0.0);
    let octant = select(0u, 4u, negative.x) | select(0u, 2u, negative.y) | select(0u, 1u, negative.z);
    return Slabs(origin, 1.0 / direction, negative, (7u - octant) * 0x01010101u);
}

// The nearest hit closer than `limit` (any hit, where `any_hit`). Sets `overflow` when it had to give up.
fn traverse(ray: Ray, limit: f32, any_hit: bool, overflow: ptr<function, bool>) -> Hit {
    var hit: Hit;
    hit.distance = limit;
    hit.primitive = NONE;
    if (!(limit > 0.0)) {
        return hit;
    }
#if INSTANCES
    // In the units of the instance that the ray is in, if it is in one; the rest of the world waits below `floor`.
    let of_world = sheared(ray);
    var sheared_ray = of_world;
    let across_world = slabs(ray.origin, ray.direction);
    var across = across_world;
    var begin = 0.0;
    var instance = NONE;
    var floor = 0u;
#else
    let sheared_ray = sheared(ray);
    let across = slabs(ray.origin, ray.direction);
#endif

    var stack: array<vec2<u32>, STACK_SIZE>;
    var stack_size = 0u;
    // (first child, hit bits in the high byte | which children are nodes), starting with the root.
    var nodes_left = vec2<u32>(0u, 0x80000000u);
    // (first primitive, hit bits in the low 24).
    var primitives_left = vec2<u32>(0u, 0u);
#if LONG_WAYS
    var steps = steps_taken;
#else
    var steps = 0u;
#endif
    loop {
        steps += 1u;
        if (nodes_left.y > 0x00ffffffu) {
            let bit = firstLeadingBit(nodes_left.y);
            let slot = (bit - 24u) ^ (across.octant4 & 0xffu);
            let rank = countOneBits(nodes_left.y & ~(0xffffffffu << slot) & 0xffu);
            let node = nodes_left.x + rank;
            nodes_left.y &= ~(1u << bit);
            if (nodes_left.y > 0x00ffffffu) {
                if (stack_size == STACK_SIZE) {
                    *overflow = true;
                    break;
                }
                stack[stack_size] = nodes_left;
                stack_size += 1u;
            }

            // The node's frame, and the rounding slack of the slab test that keeps it conservative.
            let n0 = load_node(node, 0u);
            let n1 = load_node(node, 1u);
            let n2 = load_node(node, 2u);
            let n3 = load_node(node, 3u);
            let n4 = load_node(node, 4u);
            let exponents = (vec3<u32>(n0.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(0xffu);
            let scale = bitcast<vec3<f32>>(exponents << vec3<u32>(23u)) * across.inverse;
            let base = (bitcast<vec3<f32>>(n0.xyz) - across.origin) * across.inverse;
            let slack = (abs(base) + 255.0 * abs(scale)) * 4.8e-7;
#if INSTANCES
            // What is added is rounded too.
            let rounding = begin * 2.4e-7;
            let base_lo = begin + (base - slack) - rounding;
            let base_hi = begin + (base + slack) + rounding;
#else
            let base_lo = base - slack;
            let base_hi = base + slack;
#endif

            let x = select(n2, n2.zwxy, across.negative.x);
            let y = select(n3, n3.zwxy, across.negative.y);
            let z = select(n4, n4.zwxy, across.negative.z);
            var mask = hit_children(
                array<vec4<f32>, 3>(planes(x.x), planes(y.x), planes(z.x)),
                array<vec4<f32>, 3>(planes(x.z), planes(y.z), planes(z.z)),
                scale, base_lo, base_hi, hit.distance, child_bits(n1.z, across.octant4));
            mask |= hit_children(
                array<vec4<f32>, 3>(planes(x.y), planes(y.y), planes(z.y)),
                array<vec4<f32>, 3>(planes(x.w), planes(y.w), planes(z.w)),
                scale, base_lo, base_hi, hit.distance, child_bits(n1.w, across.octant4));
            nodes_left = vec2<u32>(n1.x, (mask & 0xff000000u) | (n0.w >> 24u));
            primitives_left = vec2<u32>(n1.y, mask & 0x00ffffffu);
        } else {
            primitives_left = nodes_left;
            nodes_left = vec2<u32>(0u, 0u);
        }

#if INSTANCES
        var entering = false;
        var stub: Primitive;
#endif
        while (primitives_left.y != 0u) {
            steps += 1u;
            let bit = firstTrailingBit(primitives_left.y);
            primitives_left.y &= primitives_left.y - 1u;
            let primitive = primitives_left.x + bit;
            let p = load_primitive(primitive);
#if INSTANCES
            if ((p.tag >> 24u) == KIND_INSTANCE) {
                // What is left of the world waits, and what is left of this leaf.
                if (stack_size + 2u > STACK_SIZE) {
                    *overflow = true;
                    break;
                }
                if (nodes_left.y > 0x00ffffffu) {
                    stack[stack_size] = nodes_left;
                    stack_size += 1u;
                }
                if (primitives_left.y != 0u) {
                    stack[stack_size] = primitives_left;
                    stack_size += 1u;
                }
                instance = primitive;
                entering = true;
                stub = p;
                primitives_left.y = 0u;
                break;
            }
#endif
#if SHAPES
            if ((p.tag >> 24u) != 0u) {
#if INSTANCES
                var shape = p;
                if (instance != NONE) {
                    shape = moved(p, placed(instance));
                }
                let t = intersect_shape(ray, shape, hit.distance);
#else
                let t = intersect_shape(ray, p, hit.distance);
#endif
                if (t > 0.0) {
                    hit.distance = t;
                    hit.primitive = primitive;
#if INSTANCES
                    hit.instance = instance;
#endif
                }
                continue;
            }
#endif
#if INSTANCES
            hit = nearer_within(sheared_ray, begin, hit, primitive, instance, p.a, p.b, p.c);
#else
            hit = nearer(sheared_ray, hit, primitive, p.a, p.b, p.c);
#endif
        }

#if INSTANCES
        if (entering) {
            floor = stack_size;
            let inside = entered(ray, stub, instance);
            across = slabs(inside.ray.origin, inside.ray.direction);
            sheared_ray = sheared(inside.ray);
            begin = inside.begin;
            nodes_left = vec2<u32>(inside.root, 0x80000000u);
        }
#endif

        if (any_hit && hit.primitive != NONE) {
            break;
        }
        if (steps > MAX_STEPS) {
            *overflow = true;
            break;
        }
        if (nodes_left.y <= 0x00ffffffu) {
#if INSTANCES
            if (instance != NONE && stack_size == floor) {
                instance = NONE;
                across = across_world;
                sheared_ray = of_world;
                begin = 0.0;
            }
#endif
            if (stack_size == 0u) {
                break;
            }
            stack_size -= 1u;
            nodes_left = stack[stack_size];
        }
    }
#if LONG_WAYS
    steps_taken = steps;
#endif
    return hit;
}
