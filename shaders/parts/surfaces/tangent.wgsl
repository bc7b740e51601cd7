// The direction by which anisotropic materials are turned, of either sign: along a triangle's first edge, around the axis of a
// disk or cylinder; or as what the surface carries (`given`, not 0) says.

fn surface_tangent(hit: Hit, surface: Surface, normal: vec3<f32>, given: vec3<f32>) -> vec3<f32> {
#if INSTANCES
    let p = primitive_met(hit);
#else
    let p = load_primitive(hit.primitive);
#endif
    var along = p.b - p.a;
#if SHAPES
    let kind = p.tag >> 24u;
    if (kind == KIND_DISK) {
        along = cross(p.b, surface.position - p.a);
    } else if (kind == KIND_CYLINDER) {
        along = cross(p.b - p.a, surface.position - p.a);
    } else if (kind == KIND_SPHERE) {
        along = vec3<f32>(0.0);
    }
#endif
    along = select(along, given, any(given != vec3<f32>(0.0)));
    let tangent = scaled_to_one(along) - dot(scaled_to_one(along), normal) * normal;
    let length2 = dot(tangent, tangent);
    if (!(length2 > 1.0e-12)) {
        return tangents(normal).s;
    }
    return tangent * inverseSqrt(length2);
}
