// Instances that emit: a light each, and in it what emits of its assembly, by a table that all instances share.

// The instance whose part the emitter at hand is, or NONE.
var<private> light_in: u32 = NONE;

fn emitter_primitive(emitter: Emitter) -> Primitive {
    let p = load_primitive(emitter.primitive);
    if (light_in == NONE) {
        return p;
    }
    return moved(p, placed(light_in));
}

// `own`, of a table of an assembly, in an instance that is chosen with probability `pick`.
fn emitter_placed(own: Emitter, instance: u32, pick: f32) -> Emitter {
    light_in = instance;
    let to = placed(instance);
    let p = load_primitive(own.primitive);
    var emitter = own;
    emitter.pick *= pick;
#if SHAPES
    if ((p.tag >> 24u) != 0u) {
        emitter.area *= dot(to.linear[0], to.linear[0]);
        return emitter;
    }
#endif
    let q = moved(p, to);
    let b = q.b - q.a;
    let c = q.c - q.a;
    let sizes = vec2<f32>(largest_of(b), largest_of(c));
    emitter.area = 0.5 * length(cross(b / sizes.x, c / sizes.y)) * sizes.x * sizes.y;
    return emitter;
}

// What a path met; in the world itself where `instance` is NONE.
fn emitter_met(index: u32, instance: u32) -> Emitter {
    if (instance == NONE) {
        light_in = NONE;
        return emitters[index];
    }
    return emitter_placed(emitters[index], instance, emitters[load_primitive_part(instance, 1u).w].pick);
}
