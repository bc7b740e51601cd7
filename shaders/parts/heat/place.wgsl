// Surfaces whose emission differs from place to place: radiators become instructions.

#if HOT_FACETS
// Facets that a rough metal shows at once: a Fibonacci lattice, shifted at random.
#constants HOT_FACET_COUNT
const HOT_LATTICE: vec2<f32> = vec2<f32>(0.2, 0.4);
#endif

// Appends what adds `scale` times the radiance that the radiators of an emitter send along v.o to F.
fn append_heat(list: ptr<function, RecordList>, emitted: u32, v: Vertex, scale: f32, u: vec2<f32>) {
    let first = emitted & 0xffffu;
    for (var n = first; n < first + ((emitted >> 16u) & 0xfffu); n += 1u) {
        let r = radiators[n];
        let kind = r.kind & 0xffu;
        let closed = v.inside && (r.kind & RADIATOR_TWO_SIDED) == 0u;
#if HOT_LAMPS
        if (kind == RADIATOR_LAMP) {
#if HOT_PICTURES
            if (!closed && r.reflectance != NONE) {
                append_light_picture(list, r, v.uv, scale);
                continue;
            }
#endif
            if (!closed) {
                append(list, OP_SPECTRUM | MODE_SINGLE, r.spectra & 0xffffu, scale, 0.0);
            }
            continue;
        }
#endif
        var weight = scale * r.weight;
        var kelvin = r.kelvin;
#if HOT_NUMBERS
        weight *= product_of_shares(r.shares, v.uv);
        if (r.temperature != NONE) {
            kelvin = texture_number(r.temperature, texels_around(r.temperature, v.uv), 0u);
        }
#endif
        if (!(weight > 0.0 && kelvin > 0.0 && v.o.z > 0.0)) {
            continue;
        }
        // The back of what has no back is black.
        var mode = MODE_START;
        if (!closed) {
#if HOT_FACETS
            if (kind == RADIATOR_FACETS) {
                append_facets(list, r, v.o, weight, kelvin, u);
                continue;
            }
#endif
#if HOT_TEXTURED
            if (r.reflectance != NONE) {
                append_reflectance(list, r.reflectance, v.uv, 1.0, MODE_KEEP);
#if HOT_TRANSLUCENT
                if ((r.kind & RADIATOR_PASSES_SPECTRUM) != 0u) {
                    append(list, OP_SPECTRUM | MODE_KEEP, r.spectra & 0xffffu, 1.0, 0.0);
                }
                if ((r.kind & RADIATOR_PASSES_TEXTURE) != 0u) {
                    append_reflectance(list, r.kind >> 16u, v.uv, 1.0, MODE_KEEP);
                }
#endif
                append(list, OP_ABSORBED | MODE_START, r.inner & 0xffffu, 1.0, select(1.0, 0.0, kind == RADIATOR_OPEN));
                mode = 0u;
            }
#endif
            if ((r.kind & RADIATOR_ABSORBS) != 0u) {
                append(list, OP_SPECTRUM | MODE_START, r.inner & 0xffffu, 1.0, 0.0);
                mode = 0u;
            }
#if HOT_MIRRORS
            if (kind == RADIATOR_MIRROR) {
                append(list, OP_EMITTANCE | MODE_START, r.spectra, 1.0, v.o.z);
                mode = 0u;
            }
#endif
#if HOT_VARNISH
            if (kind == RADIATOR_VARNISH) {
                append(list, OP_TRANSMIT, r.spectra & 0xffffu, 1.0, v.o.z);
            }
#endif
#if HOT_COATS
            if (kind == RADIATOR_COAT) {
                append(list, OP_ETA_TABLE | MODE_SQUARE, (r.spectra & 0xffffu) | (r.inner & 0xffff0000u), 1.0, albedo_position(v.o.z, r.alpha.x));
            }
#endif
        }
        // What is in products of spectra says which radiator it is.
        append(list, OP_PLANCK | mode | MODE_ADD, select(0u, n + 1u, (r.kind & RADIATOR_SEPARATES) != 0u), weight, kelvin);
    }
}

#if HOT_PICTURES
// Appends what adds `scale` times the radiance of a lamp that is a picture to F: so much of each of its spectra, or colours times
// daylight.
fn append_light_picture(list: ptr<function, RecordList>, r: Radiator, uv: vec2<f32>, scale: f32) {
    if (textures[TEXTURE_WORDS * r.reflectance + 4u] != NONE) {
        append_reflectance(list, r.reflectance, uv, scale, MODE_SINGLE);
        return;
    }
#if COLOURS
    let around = texels_around(r.reflectance, uv);
    for (var n = 0u; n < 4u; n += 1u) {
        let at = textures[TEXTURE_WORDS * r.reflectance] + 4u * around.texel[n];
        let weight = scale * around.weight[n] * texels[at + 3u];
        if (weight > 0.0) {
            append(list, OP_SMOOTH | MODE_START, at, weight, 0.0);
            append(list, OP_SPECTRUM | MODE_ADD, r.spectra & 0xffffu, 1.0, 0.0);
        }
    }
#endif
}
#endif

#if HOT_FACETS
// A metal of facets absorbs where light meets them first, 1 - F; and of what meets others, a share that `inner` says, or all.
fn append_facets(list: ptr<function, RecordList>, r: Radiator, o: vec3<f32>, weight: f32, kelvin: f32, u: vec2<f32>) {
    let each = 1.0 / f32(HOT_FACET_COUNT);
    let lambda_o = ggx_lambda(r.alpha, o);
    var leaves = 0.0;
    for (var n = 0u; n < HOT_FACET_COUNT; n += 1u) {
        let h = ggx_visible_normal(r.alpha, o, fract(u + f32(n) * HOT_LATTICE));
        let cosine = clamp(dot(o, h), 0.0, 1.0);
        let i = 2.0 * cosine * h - o;
        if (i.z > 0.0) {
            let seen = each * (1.0 + lambda_o) / (1.0 + lambda_o + ggx_lambda(r.alpha, i));
            append(list, OP_EMITTANCE | MODE_START, r.spectra, weight * seen, cosine);
            append(list, OP_PLANCK | MODE_ADD, 0u, 1.0, kelvin);
            leaves += seen;
        }
    }
    let again = weight * (1.0 - leaves);
    if (!(again > 0.0)) {
        return;
    }
    if ((r.kind & RADIATOR_ABSORBS) != 0u) {
        append(list, OP_SPECTRUM | MODE_START, r.inner & 0xffffu, again, 0.0);
        append(list, OP_PLANCK | MODE_ADD, 0u, 1.0, kelvin);
        return;
    }
    append(list, OP_PLANCK | MODE_SINGLE, 0u, again, kelvin);
}
#endif

// Multiplies F with what the radiators of an emitter send along v.o.
fn append_heat_aimed_at(list: ptr<function, RecordList>, emitted: u32, v: Vertex, u: vec2<f32>) {
    append(list, OP_HOLD, 0u, 0.0, 0.0);
    append_heat(list, emitted, v, 1.0, u);
    append(list, OP_HELD | MODE_ON_F, 0u, 1.0, 0.0);
}

fn facet_numbers(path: u32, salt: u32) -> vec2<f32> {
#if HOT_FACETS
    return hot_numbers(path, salt);
#else
    return vec2<f32>(0.0);
#endif
}

// Whether an emitter is one that a path has met; then also what it sends along.
fn emits_by_place(list: ptr<function, RecordList>, path: u32, v: Vertex, emitter: Emitter, weight: f32) -> bool {
    if ((emitter.spectrum & EMITS_BY_PLACE) == 0u) {
        return false;
    }
    let begin = (*list).count;
    append_heat(list, emitter.spectrum, v, weight, facet_numbers(path, SALT_MET));
    gather(list, begin, 0u);
    return true;
}

// Notes the radiators of a point that is aimed at.
fn aim_by_place(aim: ptr<function, Aim>, emitter: Emitter, point: LightPoint) {
    if ((emitter.spectrum & EMITS_BY_PLACE) != 0u && (*aim).density > 0.0) {
        (*aim).hot = emitter.spectrum;
        (*aim).hot_vertex = emitting_vertex(emitter, point, -normalize((*aim).towards));
        (*aim).source = 0u;
    }
}
