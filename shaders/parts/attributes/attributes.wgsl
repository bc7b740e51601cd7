// What surfaces carry beside their geometry: texture coordinates, shading normals, tangents. `scene::Attributes` says what
// they mean.

// The last word of a primitive is where its numbers start, with these bits; 0 where it has none. A triangle has (u, v) of its
// three vertices, then their normals; a round shape its axes.
@group(0) @binding(52) var<storage, read> attributes: array<f32>;
#constants ATTRIBUTES

struct Carried {
    uv: vec2<f32>,
    // Towards growing u, of any length; 0 where the shape itself says more.
    tangent: vec3<f32>,
    // On the front.
    normal: vec3<f32>,
}

fn attribute_vector(at: u32) -> vec3<f32> {
    return vec3<f32>(attributes[at], attributes[at + 1u], attributes[at + 2u]);
}

fn carried_at(hit: Hit, surface: Surface) -> Carried {
    var carried = Carried(vec2<f32>(0.0), vec3<f32>(0.0), surface.normal);
    let word = load_primitive_part(hit.primitive, 2u).w;
    var at = word & 0x3fffffffu;
    if (word == 0u) {
        return carried;
    }
#if INSTANCES
    let p = primitive_met(hit);
#else
    let p = load_primitive(hit.primitive);
#endif
#if SHAPES
    let kind = p.tag >> 24u;
    if (kind != 0u) {
        var axes = mat3x3<f32>(attribute_vector(at), attribute_vector(at + 3u), attribute_vector(at + 6u));
#if INSTANCES
        if (hit.instance != NONE) {
            axes = placed(hit.instance).linear * axes;
            axes = mat3x3<f32>(normalize(axes[0]), normalize(axes[1]), normalize(axes[2]));
        }
#endif
        let y = axes[1];
        var place = surface.normal;
        if (kind == KIND_DISK) {
            place = (surface.position - p.a) / p.c.x;
        } else if (kind == KIND_CYLINDER) {
            place = surface.position - p.a;
        } else {
            carried.tangent = cross(y, surface.normal);
        }
        let q = vec3<f32>(dot(axes[0], place), dot(y, place), dot(axes[2], place));
        var v = 0.5 + turn_of(length(q.xz), q.y);
        if (kind == KIND_DISK) {
            v = 1.0 - length(q);
        } else if (kind == KIND_CYLINDER) {
            v = q.y / length(p.b - p.a);
        }
        // Half a turn as v goes from pole to pole, a whole one around.
        carried.uv = vec2<f32>(0.5 + 0.5 * turn_of(q.z, q.x), v);
        return carried;
    }
#endif
    let weights = vec3<f32>(1.0 - hit.u - hit.v, hit.u, hit.v);
    if ((word & HAS_COORDINATES) != 0u) {
        let a = vec2<f32>(attributes[at], attributes[at + 1u]);
        let ab = vec2<f32>(attributes[at + 2u], attributes[at + 3u]) - a;
        let ac = vec2<f32>(attributes[at + 4u], attributes[at + 5u]) - a;
        carried.uv = a + hit.u * ab + hit.v * ac;
        let area = ab.x * ac.y - ab.y * ac.x;
        carried.tangent = select(0.0, select(-1.0, 1.0, area > 0.0), area != 0.0) * (ac.y * (p.b - p.a) - ab.y * (p.c - p.a));
        at += 6u;
    }
    if ((word & HAS_NORMALS) != 0u) {
        var normals = mat3x3<f32>(attribute_vector(at), attribute_vector(at + 3u), attribute_vector(at + 6u));
#if INSTANCES
        if (hit.instance != NONE) {
            normals = matrix_of_normals(placed(hit.instance).linear) * normals;
            normals = mat3x3<f32>(normalize(normals[0]), normalize(normals[1]), normalize(normals[2]));
        }
#endif
        let normal = normals * weights;
        if (dot(normal, surface.normal) > 0.0) {
            carried.normal = normalize(normal);
        }
    }
    return carried;
}

#if SMOOTH
// The normal that light sees, on the side of `o`, which leads to the viewer. One that `o` is behind, as happens on
// silhouettes, is bent towards it until the cosine between both is some 0.01.
fn shading_normal(normal: vec3<f32>, o: vec3<f32>) -> vec3<f32> {
    let missing = 0.01 - dot(o, normal);
    return normalize(normal + max(missing, 0.0) * o);
}
#endif
