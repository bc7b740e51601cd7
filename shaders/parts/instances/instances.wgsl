// What is stored once and placed many times. An instance is a primitive: the columns of its matrix are its corners, and its last word
// tells where the rest stands behind the nodes: where the space of its assembly begins, and the root of the assembly's tree.
//
// Boxes are met in the assembly's units; its triangles and shapes are moved into the world before a ray is held against them, so that
// distances are those of the world and no edge between two triangles opens.

#constants INSTANCES

struct Placed {
    linear: mat3x3<f32>,
    at: vec3<f32>,
    root: u32,
}

fn placed(instance: u32) -> Placed {
    let p = load_primitive(instance);
    let place = load_primitive_part(instance, 2u).w;
    let at = load_node(place / 5u, place % 5u);
    return Placed(mat3x3<f32>(p.a, p.b, p.c), bitcast<vec3<f32>>(at.xyz), at.w);
}

// A primitive of an assembly, in the world. Shapes keep their form.
fn moved(p: Primitive, to: Placed) -> Primitive {
    var q = p;
    q.a = to.linear * p.a + to.at;
#if SHAPES
    switch (p.tag >> 24u) {
        case KIND_SPHERE: {
            q.b = length(to.linear[0]) * p.b;
            return q;
        }
        case KIND_DISK: {
            q.b = normalize(to.linear * p.b);
            q.c = length(to.linear[0]) * p.c;
            return q;
        }
        case KIND_CYLINDER: {
            q.b = to.linear * p.b + to.at;
            q.c = length(to.linear[0]) * p.c;
            return q;
        }
        default: {}
    }
#endif
    q.b = to.linear * p.b + to.at;
    q.c = to.linear * p.c + to.at;
    return q;
}

// What a ray met, in the world.
fn primitive_met(hit: Hit) -> Primitive {
    let p = load_primitive(hit.primitive);
    if (hit.instance == NONE) {
        return p;
    }
    return moved(p, placed(hit.instance));
}

// What normals go through, but for their length: the matrix of cofactors. Its determinant is above 0.
fn matrix_of_normals(linear: mat3x3<f32>) -> mat3x3<f32> {
    let unit = 1.0 / largest(linear);
    let a = unit * linear[0];
    let b = unit * linear[1];
    let c = unit * linear[2];
    return mat3x3<f32>(cross(b, c), cross(c, a), cross(a, b));
}

fn largest(m: mat3x3<f32>) -> f32 {
    let most = max(max(abs(m[0]), abs(m[1])), abs(m[2]));
    return max(max(most.x, most.y), max(most.z, 1.0e-37));
}

// Each product of a cross product by itself, without its sign: what rounding is measured by.
fn cross_of_absolutes(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return abs(a.yzx * b.zxy) + abs(a.zxy * b.yzx);
}

// A ray in the units of an assembly, from where it passes nearest to the middle of it: `begin` along the ray of the world. What of it
// is rounded stays within `margin` of the true ray as far as the assembly reaches.
struct Entered {
    ray: Ray,
    begin: f32,
    margin: vec3<f32>,
}

fn entered(ray: Ray, to: Placed) -> Entered {
    let fastest = max(max(abs(ray.direction.x), abs(ray.direction.y)), max(abs(ray.direction.z), 1.0e-37));
    let along = ray.direction / fastest;
    let begin = max(dot(to.at - ray.origin, along) / dot(along, along), 0.0) / fastest;
    let near = ray.origin + begin * ray.direction;
    let unit = 1.0 / largest(to.linear);
    let a = unit * to.linear[0];
    let b = unit * to.linear[1];
    let c = unit * to.linear[2];
    let bc = cross(b, c);
    let ca = cross(c, a);
    let ab = cross(a, b);
    let scale = unit / dot(a, bc);
    let from_middle = near - to.at;
    let origin = scale * vec3<f32>(dot(bc, from_middle), dot(ca, from_middle), dot(ab, from_middle));
    let direction = scale * vec3<f32>(dot(bc, ray.direction), dot(ca, ray.direction), dot(ab, ray.direction));

    // In the world: a moved corner, and the place on the ray, are rounded eight times by their size; then the inverse by its own.
    let around_bc = cross_of_absolutes(b, c);
    let condition = 1.0 + dot(abs(a), around_bc) / max(abs(dot(a, bc)), 1.0e-37);
    let reach = (abs(to.linear[0]) + abs(to.linear[1]) + abs(to.linear[2]));
    let size = max(max(reach.x, reach.y), reach.z);
    let o = abs(near) + abs(ray.origin);
    let far = max(max(o.x, o.y), o.z) + max(max(abs(to.at.x), abs(to.at.y)), abs(to.at.z)) + size;
    let error = 4.8e-7 * far + 1.0e-6 * condition * size;
    let ones = vec3<f32>(1.0);
    let rows = vec3<f32>(dot(around_bc, ones), dot(cross_of_absolutes(c, a), ones), dot(cross_of_absolutes(a, b), ones));
    return Entered(Ray(origin, direction), begin, error * abs(scale) * rows);
}
