// Spheres, disks and cylinders, intersected as they are. Each returns a distance in (0, limit), or a negative one.
// As primitives: sphere a = center, b.x = radius; disk a = center, b = normal, c.x = radius; cylinder a = from, b = to,
// c.x = radius.

#constants PRIMITIVE_KINDS

// The nearest of two ordered roots within (0, limit).
fn nearest_root(t0: f32, t1: f32, limit: f32) -> f32 {
    let near = min(t0, t1);
    let far = max(t0, t1);
    let t = select(far, near, near > 0.0);
    return select(-1.0, t, t > 0.0 && t < limit);
}

// Haines, Guenther and Akenine-Moeller, Ray Tracing Gems ch. 7: the discriminant from the distance between center
// and ray, the small root from the product of both.
fn intersect_sphere(ray: Ray, center: vec3<f32>, radius: f32, limit: f32) -> f32 {
    let f = ray.origin - center;
    let dd = dot(ray.direction, ray.direction);
    let b = -dot(f, ray.direction);
    let closest = f + (b / dd) * ray.direction;
    let discriminant = radius * radius - dot(closest, closest);
    if (discriminant < 0.0) {
        return -1.0;
    }
    let c = (length(f) - radius) * (length(f) + radius);
    let q = b + select(-1.0, 1.0, b >= 0.0) * sqrt(dd * discriminant);
    if (q == 0.0) {
        return -1.0;
    }
    return nearest_root(c / q, q / dd, limit);
}

fn intersect_disk(ray: Ray, center: vec3<f32>, normal: vec3<f32>, radius: f32, limit: f32) -> f32 {
    let slope = dot(ray.direction, normal);
    if (slope == 0.0) {
        return -1.0;
    }
    let t = dot(center - ray.origin, normal) / slope;
    if (!(t > 0.0 && t < limit)) {
        return -1.0;
    }
    let p = ray.origin + t * ray.direction - center;
    let radial = p - dot(p, normal) * normal;
    return select(-1.0, t, dot(radial, radial) <= radius * radius);
}

fn intersect_cylinder(ray: Ray, base: vec3<f32>, to: vec3<f32>, radius: f32, limit: f32) -> f32 {
    let height = length(to - base);
    let axis = (to - base) / height;
    let f = ray.origin - base;
    let f_along = dot(f, axis);
    let d_along = dot(ray.direction, axis);
    let f_across = f - f_along * axis;
    let d_across = ray.direction - d_along * axis;
    let dd = dot(d_across, d_across);
    if (dd == 0.0) {
        return -1.0;
    }
    let b = -dot(f_across, d_across);
    let closest = f_across + (b / dd) * d_across;
    let discriminant = radius * radius - dot(closest, closest);
    if (discriminant < 0.0) {
        return -1.0;
    }
    let c = (length(f_across) - radius) * (length(f_across) + radius);
    let q = b + select(-1.0, 1.0, b >= 0.0) * sqrt(dd * discriminant);
    if (q == 0.0) {
        return -1.0;
    }
    // Either root may lie beyond the wall's ends.
    let roots = vec2<f32>(min(c / q, q / dd), max(c / q, q / dd));
    let heights = f_along + roots * d_along;
    let valid = (roots > vec2<f32>(0.0)) & (roots < vec2<f32>(limit)) & (heights >= vec2<f32>(0.0)) & (heights <= vec2<f32>(height));
    return select(select(-1.0, roots.y, valid.y), roots.x, valid.x);
}

fn intersect_shape(ray: Ray, p: Primitive, limit: f32) -> f32 {
    switch (p.tag >> 24u) {
        case KIND_SPHERE: { return intersect_sphere(ray, p.a, p.b.x, limit); }
        case KIND_DISK: { return intersect_disk(ray, p.a, p.b, p.c.x, limit); }
        default: { return intersect_cylinder(ray, p.a, p.b, p.c.x, limit); }
    }
}

// Position and normal where a ray met the shape near `q`, which is pulled back onto it.
fn shape_surface(p: Primitive, q: vec3<f32>) -> array<vec3<f32>, 2> {
    switch (p.tag >> 24u) {
        case KIND_SPHERE: {
            let n = normalize(q - p.a);
            return array<vec3<f32>, 2>(p.a + p.b.x * n, n);
        }
        case KIND_DISK: {
            return array<vec3<f32>, 2>(q - dot(q - p.a, p.b) * p.b, p.b);
        }
        default: {
            let axis = normalize(p.b - p.a);
            let along = dot(q - p.a, axis) * axis;
            let n = normalize(q - p.a - along);
            return array<vec3<f32>, 2>(p.a + along + p.c.x * n, n);
        }
    }
}
