// What is stored once and placed many times. An instance is a primitive: the rows of the inverse of its matrix are its corners,
// and its last word tells where the rest stands behind the nodes, four vectors: where the space of its assembly begins and the root of
// the assembly's tree, then the columns of its matrix.
//
// Within an instance one ray in the assembly's units is held against boxes and triangles alike, so that no edge between two triangles
// opens. Distances are those of the world.

#constants INSTANCES

struct Placed {
    linear: mat3x3<f32>,
    at: vec3<f32>,
}

fn placed(instance: u32) -> Placed {
    let place = load_primitive_part(instance, 2u).w;
    let linear = mat3x3<f32>(
        bitcast<vec3<f32>>(placement_vector(place + 1u).xyz),
        bitcast<vec3<f32>>(placement_vector(place + 2u).xyz),
        bitcast<vec3<f32>>(placement_vector(place + 3u).xyz),
    );
    return Placed(linear, bitcast<vec3<f32>>(placement_vector(place).xyz));
}

fn placement_vector(at: u32) -> vec4<u32> {
    return load_node(at / 5u, at % 5u);
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
    return largest_of(max(max(abs(m[0]), abs(m[1])), abs(m[2])));
}

fn largest_of(v: vec3<f32>) -> f32 {
    let a = abs(v);
    return max(max(a.x, a.y), max(a.z, 1.0e-37));
}

// A ray in the units of an assembly, from where it passes nearest to the middle of it: `begin` along the ray of the world. From farther
// away its digits would not do for what is small.
struct Entered {
    ray: Ray,
    begin: f32,
    root: u32,
}

fn entered(ray: Ray, stub: Primitive, instance: u32) -> Entered {
    let middle = placement_vector(load_primitive_part(instance, 2u).w);
    let fastest = largest_of(ray.direction);
    let along = ray.direction / fastest;
    let towards = bitcast<vec3<f32>>(middle.xyz) - ray.origin;
    let begin = max(dot(towards, along) / dot(along, along), 0.0) / fastest;
    let near = begin * ray.direction - towards;
    let origin = vec3<f32>(dot(stub.a, near), dot(stub.b, near), dot(stub.c, near));
    let direction = vec3<f32>(dot(stub.a, ray.direction), dot(stub.b, ray.direction), dot(stub.c, ray.direction));
    return Entered(Ray(origin, direction), begin, middle.w);
}
