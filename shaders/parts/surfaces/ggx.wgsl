// The GGX distribution of microfacet normals with Smith's masking; directions are local, z along the normal.

// Density of normals D(h) (Walter et al. 2007, eq. 33, stretched), through slopes, so that nothing cancels.
fn ggx_distribution(alpha: vec2<f32>, h: vec3<f32>) -> f32 {
    let slope = h.xy / alpha;
    let stretched = dot(slope, slope) + h.z * h.z;
    return 1.0 / (PI * alpha.x * alpha.y * stretched * stretched);
}

// Smith's Lambda, as a quotient: sqrt(1 + a^2) - 1 would cancel.
fn ggx_lambda(alpha: vec2<f32>, v: vec3<f32>) -> f32 {
    let slope = alpha * v.xy;
    let slope2 = min(dot(slope, slope) / max(v.z * v.z, 1.0e-30), 1.0e30);
    return 0.5 * slope2 / (1.0 + sqrt(1.0 + slope2));
}

fn ggx_visible(alpha: vec2<f32>, v: vec3<f32>) -> f32 {
    return 1.0 / (1.0 + ggx_lambda(alpha, v));
}

// A normal as seen from `o` (Dupuy and Benyoub 2023): halfway between `o` and a point of a spherical cap.
fn ggx_visible_normal(alpha: vec2<f32>, o: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    let round = normalize(vec3<f32>(alpha * o.xy, o.z));
    let height = (1.0 - u.x) * (1.0 + round.z);
    let z = height - round.z;
    let ring = unit_circle(u.y) * sqrt(max(0.0, (1.0 - z) * (1.0 + z)));
    return normalize(vec3<f32>(alpha * (ring + round.xy), max(height, 1.0e-7)));
}

#if CONDUCTOR_AGAIN
// Visible normals of which fewer mirror `o` below the surface: the lower end of the cap is raised by this factor, to where no normal
// mirrors it above (Eto and Tokuyoshi 2023, "Bounded VNDF sampling for Smith-GGX reflections", eq. 5).
fn ggx_bound(alpha: vec2<f32>, o: vec3<f32>) -> f32 {
    let a = min(alpha.x, alpha.y);
    let s = 1.0 + length(o.xy);
    return (1.0 - a) * (1.0 + a) * s * s / (s * s + a * a * o.z * o.z);
}

fn ggx_bounded_normal(alpha: vec2<f32>, o: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    let round = normalize(vec3<f32>(alpha * o.xy, o.z));
    let below = ggx_bound(alpha, o) * round.z;
    let z = (1.0 - u.x) * (1.0 + below) - below;
    let ring = unit_circle(u.y) * sqrt(max(0.0, (1.0 - z) * (1.0 + z)));
    return normalize(vec3<f32>(alpha * (ring + round.xy), max(z + round.z, 1.0e-7)));
}

// Density of the directions that reflection by those has (eq. 9).
fn ggx_bounded_density(alpha: vec2<f32>, o: vec3<f32>, h: vec3<f32>) -> f32 {
    let stretched = length(vec3<f32>(alpha * o.xy, o.z));
    return ggx_distribution(alpha, h) / (2.0 * (ggx_bound(alpha, o) * o.z + stretched));
}
#endif

// Density of the directions that reflection by visible normals has.
fn ggx_reflected_density(alpha: vec2<f32>, o: vec3<f32>, h: vec3<f32>) -> f32 {
    return ggx_visible(alpha, o) * ggx_distribution(alpha, h) / (4.0 * o.z);
}
