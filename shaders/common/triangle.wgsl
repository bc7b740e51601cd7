// Watertight ray-triangle intersection (Woop, Benthin and Wald, JCGT 2(1), 2013).

// The ray as the test wants it: the axis in which the direction is largest becomes z, and a shear makes the ray
// point along it.
struct ShearedRay {
    origin: vec3<f32>,
    axis: u32,
    shear: vec3<f32>,
}

// Cyclic permutation that brings component `axis` to z.
fn permuted(p: vec3<f32>, axis: u32) -> vec3<f32> {
    return select(select(p, p.yzx, axis == 0u), p.zxy, axis == 1u);
}

fn sheared(ray: Ray) -> ShearedRay {
    let a = abs(ray.direction);
    let axis = select(select(2u, 1u, a.y >= a.z), 0u, a.x >= a.y && a.x >= a.z);
    let d = permuted(ray.direction, axis);
    return ShearedRay(ray.origin, axis, vec3<f32>(d.x / d.z, d.y / d.z, 1.0 / d.z));
}

// Distance and barycentric weights (of b and c), or a negative distance. The sign of an edge function is read from a
// comparison of two separately rounded products: rounding is monotonic, so the comparison is right or a tie, a tie
// counts as inside for both neighbours, and no compiler can fuse it away.
fn intersect_triangle(ray: ShearedRay, a_in: vec3<f32>, b_in: vec3<f32>, c_in: vec3<f32>) -> vec3<f32> {
    let a = permuted(a_in - ray.origin, ray.axis);
    let b = permuted(b_in - ray.origin, ray.axis);
    let c = permuted(c_in - ray.origin, ray.axis);
    let a2 = a.xy - ray.shear.xy * a.z;
    let b2 = b.xy - ray.shear.xy * b.z;
    let c2 = c.xy - ray.shear.xy * c.z;
    let left = vec3<f32>(c2.x * b2.y, a2.x * c2.y, b2.x * a2.y);
    let right = vec3<f32>(c2.y * b2.x, a2.y * c2.x, b2.y * a2.x);
    if (!(all(left >= right) || all(left <= right))) {
#if INSTANCES
        return vec3<f32>(-INFINITE, 0.0, 0.0);
#else
        return vec3<f32>(-1.0, 0.0, 0.0);
#endif
    }
    // A tie is exactly 0, also where a compiler fuses the difference: residues of rounding would make up a hit edge-on.
    let edge = select(left - right, vec3<f32>(0.0), left == right);
    let determinant = edge.x + edge.y + edge.z;
    if (determinant == 0.0) {
#if INSTANCES
        return vec3<f32>(-INFINITE, 0.0, 0.0);
#else
        return vec3<f32>(-1.0, 0.0, 0.0);
#endif
    }
    let z = ray.shear.z * vec3<f32>(a.z, b.z, c.z);
    let inverse = 1.0 / determinant;
    return vec3<f32>(dot(edge, z) * inverse, edge.y * inverse, edge.z * inverse);
}

// `hit`, or what the ray meets before it.
#if INSTANCES
// The ray starts `begin` along that of the world.
fn nearer_within(ray: ShearedRay, begin: f32, hit: Hit, primitive: u32, instance: u32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Hit {
    let found = intersect_triangle(ray, a, b, c);
    let distance = begin + found.x;
    if (distance > 0.0 && distance < hit.distance) {
        return Hit(distance, primitive, found.y, found.z, instance);
    }
    return hit;
}
#else
fn nearer(ray: ShearedRay, hit: Hit, primitive: u32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Hit {
    let found = intersect_triangle(ray, a, b, c);
    if (found.x > 0.0 && found.x < hit.distance) {
        return Hit(found.x, primitive, found.y, found.z);
    }
    return hit;
}
#endif

// Counter-clockwise vertices face the front. Edges are scaled first: tiny triangles would leave only subnormals. The
// edges of a sliver may round to parallel ones: any direction is as good then, but not NaN.
fn triangle_normal(p: Primitive) -> vec3<f32> {
    let n = scaled_to_one(cross(scaled_to_one(p.b - p.a), scaled_to_one(p.c - p.a)));
    let length2 = dot(n, n);
    return select(vec3<f32>(0.0, 0.0, 1.0), n * inverseSqrt(max(length2, 0.5)), length2 > 0.0);
}

// How far paths go on from the edges of a triangle, in device units: some roundings of the scene's size, and a sixteenth of how far
// they start off its plane. Where two walls meet, a point that rounding put behind the other one would see through it.
const EDGE_MARGIN: f32 = 9.5367432e-7;

fn off_edges(position: vec3<f32>, normal: vec3<f32>, p: Primitive) -> vec3<f32> {
    return off_edge(off_edge(off_edge(position, normal, p.a, p.b), normal, p.b, p.c), normal, p.c, p.a);
}

// The inside is to the left of an edge.
fn off_edge(position: vec3<f32>, normal: vec3<f32>, from_vertex: vec3<f32>, to_vertex: vec3<f32>) -> vec3<f32> {
    let left = cross(normal, scaled_to_one(to_vertex - from_vertex));
    let inward = left * inverseSqrt(max(dot(left, left), 1.0e-37));
    return position + max(EDGE_MARGIN - dot(position - from_vertex, inward), 0.0) * inward;
}

fn scaled_to_one(v: vec3<f32>) -> vec3<f32> {
    let a = abs(v);
    return v / max(max(a.x, a.y), max(a.z, 1.0e-37));
}
