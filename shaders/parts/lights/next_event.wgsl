// Next-event estimation: choosing a light, a point on it, and the density with which that would have been chosen.

// Veach and Guibas 1995: the power heuristic (beta = 2) for a sample of density `own` against `other`.
fn power_heuristic(own: f32, other: f32) -> f32 {
    let r = min(other / own, 1.0e18);
    return 1.0 / (1.0 + r * r);
}

// A point on an emitter as seen from a reference point.
struct LightPoint {
    position: vec3<f32>,
    normal: vec3<f32>,
    // Density over solid angle at the reference point, the choice of the emitter included; 0 where nothing arrives.
    density: f32,
}

fn choose_emitter(u: f32) -> u32 {
    var low = 0u;
    var high = frame.emitter_count - 1u;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (u < emitters[middle].pick_end) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

// From a density over area to one over solid angle; 0 where the emitter shows a dark side.
fn solid_angle_density(emitter: Emitter, d: vec3<f32>, distance2: f32, normal: vec3<f32>) -> f32 {
    let facing = -dot(normal, d);
    let cosine = select(max(facing, 0.0), abs(facing), (emitter.spectrum & EMITS_BOTH_SIDES) != 0u);
    return select(0.0, emitter.pick * distance2 / (emitter.area * cosine), cosine > 0.0);
}

#if SHAPES
// 1 - cos of the half angle under which a sphere is seen, without cancellation; negative from within.
fn sphere_cap(center_distance2: f32, radius: f32) -> f32 {
    let s2 = radius * radius / center_distance2;
    return select(-1.0, s2 / (1.0 + sqrt(max(0.0, 1.0 - s2))), s2 < 0.9999);
}
#endif

// The density over solid angle with which next-event estimation at `origin` finds this point.
#if PLACED_LIGHTS
fn light_density(emitter: Emitter, origin: vec3<f32>, direction: vec3<f32>, distance: f32, normal: vec3<f32>) -> f32 {
#else
fn light_density(emitter_index: u32, origin: vec3<f32>, direction: vec3<f32>, distance: f32, normal: vec3<f32>) -> f32 {
    let emitter = emitters[emitter_index];
#endif
#if SHAPES
#if PLACED_LIGHTS
    let shape = emitter_primitive(emitter);
#else
    let shape = load_primitive(emitter.primitive);
#endif
    if ((shape.tag >> 24u) == KIND_SPHERE) {
        let to_center = shape.a - origin;
        let cap = sphere_cap(dot(to_center, to_center), shape.b.x);
        if (cap > 0.0) {
#if OPACITY
            // Seen through its near half, which alone is aimed at.
            if (dot(normal, direction) > 0.0) {
                return 0.0;
            }
#endif
            return emitter.pick / (2.0 * PI * cap);
        }
    }
#endif
    return solid_angle_density(emitter, direction, distance * distance, normal);
}

fn sample_emitter(emitter: Emitter, origin: vec3<f32>, u: vec2<f32>) -> LightPoint {
#if PLACED_LIGHTS
    let shape = emitter_primitive(emitter);
#else
    let shape = load_primitive(emitter.primitive);
#endif
    var p: vec3<f32>;
    var n: vec3<f32>;
#if SHAPES
    let kind = shape.tag >> 24u;
    if (kind == KIND_SPHERE) {
        let to_center = shape.a - origin;
        let center_distance2 = dot(to_center, to_center);
        let cap = sphere_cap(center_distance2, shape.b.x);
        if (cap > 0.0) {
            // Uniform in the cone that the sphere fills.
            let rim = concentric_disk(u);
            let r2 = dot(rim, rim);
            let cos_theta = 1.0 - r2 * cap;
            let sin_theta = sqrt(max(0.0, r2 * cap * (2.0 - r2 * cap)));
            let axis = to_center / sqrt(center_distance2);
            let around = tangents(axis);
            let side = select(rim / sqrt(r2), vec2<f32>(1.0, 0.0), r2 == 0.0);
            let d = normalize(sin_theta * (side.x * around.s + side.y * around.t) + cos_theta * axis);
            // The near intersection; the ray grazes where rounding misses the sphere.
            let along = dot(to_center, d);
            let off = to_center - along * d;
            let q = origin + (along - sqrt(max(0.0, shape.b.x * shape.b.x - dot(off, off)))) * d;
            n = normalize(q - shape.a);
            let lit = (emitter.spectrum & EMITS_BOTH_SIDES) != 0u || dot(n, d) < 0.0;
            return LightPoint(shape.a + shape.b.x * n, n, select(0.0, emitter.pick / (2.0 * PI * cap), lit));
        }
        // From within: uniform over the area.
        let z = 1.0 - 2.0 * u.x;
        let ring = unit_circle(u.y) * sqrt(max(0.0, 1.0 - z * z));
        n = vec3<f32>(ring, z);
        p = shape.a + shape.b.x * n;
    } else if (kind == KIND_DISK) {
        let around = tangents(shape.b);
        let disk = concentric_disk(u) * shape.c.x;
        n = shape.b;
        p = shape.a + disk.x * around.s + disk.y * around.t;
    } else if (kind == KIND_CYLINDER) {
        let axis = normalize(shape.b - shape.a);
        let around = tangents(axis);
        let ring = unit_circle(u.y);
        n = ring.x * around.s + ring.y * around.t;
        p = shape.a + u.x * (shape.b - shape.a) + shape.c.x * n;
    } else {
#endif
    // Uniform over a triangle, without folding the square (Heitz, "A Low-Distortion Map Between Triangle and Square", 2019).
    var b = 0.5 * u;
    let offset = b.y - b.x;
    b += select(vec2<f32>(-offset, 0.0) , vec2<f32>(0.0, offset), offset > 0.0);
    p = (1.0 - b.x - b.y) * shape.a + b.x * shape.b + b.y * shape.c;
    n = triangle_normal(shape);
#if SHAPES
    }
#endif
    let d = p - origin;
    let distance2 = dot(d, d);
    if (!(distance2 > 0.0)) {
        return LightPoint(p, n, 0.0);
    }
    return LightPoint(p, n, solid_angle_density(emitter, d / sqrt(distance2), distance2, n));
}
