// Small geometry: frames, directions, robust ray origins.

// sin and cos for |x| <= pi/4. WGSL only promises an absolute error of 2^-11 for its own.
fn sin_cos_octant(x: f32) -> vec2<f32> {
    let x2 = x * x;
    let s = x + x * x2 * (-0.16666667 + x2 * (8.3333310e-3 + x2 * (-1.9840874e-4 + x2 * 2.7525562e-6)));
    let c = 1.0 + x2 * (-0.5 + x2 * (4.1666642e-2 + x2 * (-1.3888397e-3 + x2 * 2.4760495e-5)));
    return vec2<f32>(s, c);
}

// (cos, sin) of 2 pi u.
fn unit_circle(u: f32) -> vec2<f32> {
    let quarter = floor(4.0 * u + 0.5);
    let sc = sin_cos_octant(0.5 * PI * (4.0 * u - quarter));
    let turn = u32(quarter) & 3u;
    let across = select(sc.yx, vec2<f32>(-sc.x, sc.y), (turn & 1u) == 1u);
    return select(across, -across, turn >= 2u);
}

// Area-preserving map from the unit square to the unit disk (Shirley and Chiu 1997).
fn concentric_disk(u: vec2<f32>) -> vec2<f32> {
    let p = 2.0 * u - 1.0;
    let x_major = abs(p.x) > abs(p.y);
    let radius = select(p.y, p.x, x_major);
    let other = select(p.x, p.y, x_major);
    let divisor = select(radius, 1.0, radius == 0.0);
    let sc = sin_cos_octant(0.25 * PI * (other / divisor));
    return radius * select(sc, sc.yx, x_major);
}

// An orthonormal frame around a unit vector (Duff et al., JCGT 6(1), 2017): the two tangents.
struct Tangents {
    s: vec3<f32>,
    t: vec3<f32>,
}

fn tangents(n: vec3<f32>) -> Tangents {
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    return Tangents(
        vec3<f32>(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        vec3<f32>(b, sign + n.y * n.y * a, -n.y),
    );
}

// A direction around `n` with density cos/pi; never below the surface.
fn cosine_hemisphere(n: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    let d = concentric_disk(u);
    let z = sqrt(max(1.0e-8, 1.0 - dot(d, d)));
    let frame = tangents(n);
    return normalize(d.x * frame.s + d.y * frame.t + z * n);
}

// A point off the surface, on the side `n` points to, far enough that a ray from it cannot meet the surface again
// through rounding (Waechter and Binder, Ray Tracing Gems ch. 6).
fn offset_origin(p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let steps = vec3<i32>(256.0 * n);
    let moved = bitcast<vec3<f32>>(bitcast<vec3<i32>>(p) + select(steps, -steps, p < vec3<f32>(0.0)));
    return select(moved, p + n * (1.0 / 65536.0), abs(p) < vec3<f32>(1.0 / 32.0));
}
