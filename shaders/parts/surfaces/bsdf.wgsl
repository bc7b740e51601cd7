// Scattering by the lobes of a material: densities, and the records that evaluate will read. Directions are local and point
// away from the surface: `o` to where the path comes from, with z > 0; `i` to where it goes on; z is the normal on the side
// of `o`.

struct Vertex {
    s: vec3<f32>,
    t: vec3<f32>,
    normal: vec3<f32>,
    o: vec3<f32>,
    // Whether the path comes from behind, against the geometric normal.
    inside: bool,
#if TEXTURES
    uv: vec2<f32>,
#endif
#if SHARES
    // Makes the probabilities of choosing lobes sum to 1.
    pick_scale: f32,
#endif
#if VARIES
    // Decides between the tables of two roughnesses.
    chance: f32,
#endif
}

// The vertex where `o`, a unit vector, leads away from a surface; `front`: on the side of the geometric normal.
fn vertex_at(hit: Hit, surface: Surface, front: bool, o: vec3<f32>) -> Vertex {
    var v: Vertex;
    v.normal = select(-surface.normal, surface.normal, front);
    v.inside = !front;
#if ATTRIBUTES
    let carried = carried_at(hit, surface);
#if SMOOTH
    v.normal = shading_normal(select(-carried.normal, carried.normal, front), o);
#endif
#if TEXTURES
    v.uv = carried.uv;
#endif
#endif
#if ANISOTROPIC
#if ATTRIBUTES
    v.s = surface_tangent(hit, surface, v.normal, carried.tangent);
#else
    v.s = surface_tangent(hit, surface, v.normal, vec3<f32>(0.0));
#endif
    v.t = cross(v.normal, v.s);
#else
    let around = tangents(v.normal);
    v.s = around.s;
    v.t = around.t;
#endif
    v.o = to_local(v, o);
    return v;
}

fn to_local(v: Vertex, d: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(d, v.s), dot(d, v.t), dot(d, v.normal));
}

fn to_world(v: Vertex, d: vec3<f32>) -> vec3<f32> {
    return normalize(d.x * v.s + d.y * v.t + d.z * v.normal);
}

// An opaque surface has no inside: its back is as its front, or black.
fn lobe_behind(lobe: Lobe, v: Vertex) -> bool {
    return v.inside && (lobe.kind & LOBE_OPAQUE) == 0u;
}

// Lobe `p` as it is at a vertex, but for its share.
fn unshared_lobe(p: u32, v: Vertex) -> Lobe {
#if VARIES
    if ((lobes[p].kind & LOBE_VARIES) != 0u) {
        return lobe_of_place(lobes[p], v);
    }
#endif
    return lobes[p];
}

// Lobe `p` as it is at a vertex.
fn lobe_at(p: u32, v: Vertex) -> Lobe {
#if SHARES
    var lobe = unshared_lobe(p, v);
    lobe.weight *= lobe_share(p, v.uv);
    return lobe;
#else
    return unshared_lobe(p, v);
#endif
}

// The probability of choosing lobe `p`; 0 for those that do not scatter here.
fn lobe_pick(p: u32, v: Vertex) -> f32 {
#if SHARES
    return cosine_table(lobes[p].picks, v.inside, v.o.z) * lobe_share(p, v.uv) * v.pick_scale;
#else
    return cosine_table(lobes[p].picks, v.inside, v.o.z);
#endif
}

// The index by which a path bends, beyond over before.
fn relative_index(eta: f32, behind: bool) -> f32 {
    return select(eta, 1.0 / eta, behind);
}

// Square of the relative index times the cosine beyond; not above 0 under total reflection.
fn beyond_square(cosine: f32, eta: f32) -> f32 {
    return (eta - 1.0) * (eta + 1.0) + cosine * cosine;
}

// `o` bent by a boundary of relative index `eta` and normal `h`, where beyond_square is above 0.
fn refracted(o: vec3<f32>, h: vec3<f32>, eta: f32) -> vec3<f32> {
    let cosine = dot(o, h);
    return normalize((cosine - sqrt(beyond_square(cosine, eta))) * h - o);
}

#if ROUGH_GLASS
// The half vector that refracts o into i, and |i h| / (o h + eta i h)^2; o_h is not above 0 where there is none.
struct Half {
    h: vec3<f32>,
    o_h: f32,
    spread: f32,
}

fn refracting_half(o: vec3<f32>, i: vec3<f32>, eta: f32) -> Half {
    var h = -(o + eta * i);
    h = normalize(select(h, -h, h.z < 0.0));
    let o_h = dot(o, h);
    let i_h = dot(i, h);
    let sum = o_h + eta * i_h;
    return Half(h, select(-1.0, o_h, i_h < 0.0 && sum != 0.0), -i_h / max(sum * sum, 1.0e-30));
}

fn refracted_density(lobe: Lobe, v: Vertex, i: vec3<f32>, eta: f32) -> f32 {
    let half = refracting_half(v.o, i, eta);
    if (!(half.o_h > 0.0)) {
        return 0.0;
    }
    let refracts = 1.0 - cosine_table(lobe.decision, v.inside, half.o_h);
    return refracts * ggx_visible(lobe.alpha, v.o) * ggx_distribution(lobe.alpha, half.h) * half.o_h / v.o.z
        * eta * eta * half.spread;
}
#if DISPERSION
// Where channels bend apart by less than the lobe is wide, directions are those of the least, the mean and the greatest
// index, weighted by all three (the balance heuristic).
fn spread_index(lobe: Lobe, which: u32) -> f32 {
    return select(select(lobe.eta_greatest, lobe.eta, which == 1u), lobe.eta_least, which == 0u);
}
#endif
#endif

#if CONDUCTOR_AGAIN
// Directions of what facets scatter more than once, by what single scattering loses there: a density over the square of the cosine that
// is one number in each interval of the cosine. A table has its integral up to each of 257 cosines, then these numbers.
fn again_direction(lobe: Lobe, u: vec2<f32>) -> vec3<f32> {
    var i = 0u;
    for (var step = COSINE_INTERVALS / 2u; step > 0u; step /= 2u) {
        i += select(0u, step, tables[lobe.decision + i + step] <= u.x);
    }
    let from_z = f32(i) / f32(COSINE_INTERVALS);
    let square = from_z * from_z + (u.x - tables[lobe.decision + i]) / tables[lobe.decision + COSINE_INTERVALS + 1u + i];
    let z2 = clamp(square, 0.0, 1.0);
    return vec3<f32>(unit_circle(u.y) * sqrt(1.0 - z2), sqrt(z2));
}

fn again_density(lobe: Lobe, z: f32) -> f32 {
    let i = min(u32(max(z, 0.0) * f32(COSINE_INTERVALS)), COSINE_INTERVALS - 1u);
    return max(z, 0.0) * INV_PI * tables[lobe.decision + COSINE_INTERVALS + 1u + i];
}
#endif

// The density over solid angle with which a lobe chooses `i`; 0 for the only directions of mirrors and ideal refraction.
fn lobe_density(lobe: Lobe, v: Vertex, i: vec3<f32>) -> f32 {
    switch (lobe.kind & 0xffu) {
#if MIRRORS
        case LOBE_CONDUCTOR, LOBE_MIRROR, LOBE_REFRACTION: {
            return 0.0;
        }
#endif
#if MICROFACETS
        case LOBE_ROUGH_CONDUCTOR, LOBE_ROUGH_COAT: {
            if (i.z <= 0.0) {
                return 0.0;
            }
#if CONDUCTOR_AGAIN
            if ((lobe.kind & LOBE_BOUNDED) != 0u) {
                return ggx_bounded_density(lobe.alpha, v.o, normalize(v.o + i));
            }
#endif
            return ggx_reflected_density(lobe.alpha, v.o, normalize(v.o + i));
        }
#endif
#if CONDUCTOR_AGAIN
        case LOBE_CONDUCTOR_AGAIN: {
            return again_density(lobe, i.z);
        }
#endif
#if ROUGH_GLASS
        case LOBE_ROUGH_BOUNDARY: {
            if (i.z > 0.0) {
                let h = normalize(v.o + i);
                return cosine_table(lobe.decision, v.inside, dot(v.o, h)) * ggx_reflected_density(lobe.alpha, v.o, h);
            }
#if DISPERSION
            if ((lobe.kind & LOBE_NARROW) != 0u) {
                return 0.0;
            }
            if ((lobe.kind & LOBE_DISPERSES) != 0u) {
                var sum = 0.0;
                for (var n = 0u; n < 3u; n += 1u) {
                    sum += refracted_density(lobe, v, i, relative_index(spread_index(lobe, n), v.inside));
                }
                return sum / 3.0;
            }
#endif
            return refracted_density(lobe, v, i, relative_index(lobe.eta, v.inside));
        }
        case LOBE_BEYOND_AGAIN: {
            return max(-i.z, 0.0) * INV_PI;
        }
#endif
#if TRANSMITTED
        case LOBE_TRANSMITTED: {
            return max(-i.z, 0.0) * INV_PI;
        }
#endif
        default: {
            return max(i.z, 0.0) * INV_PI;
        }
    }
}

// The density with which the whole material chooses `i`.
fn bsdf_density(material: SurfaceMaterial, v: Vertex, i: vec3<f32>) -> f32 {
#if BY_TECHNIQUE
    if ((material.flags & MATERIAL_BY_TECHNIQUE) != 0u) {
        return density_of_techniques(material, v, i);
    }
#endif
    var density = 0.0;
    for (var p = material.first_lobe; p < material.first_lobe + material.lobe_count; p += 1u) {
        let pick = lobe_pick(p, v);
        if (pick > 0.0) {
            density += pick * lobe_density(unshared_lobe(p, v), v, i);
        }
    }
    return density;
}

#if CONDUCTOR_AGAIN
// 1 - E of a rough surface that reflects everything.
fn reflection_loss(lobe: Lobe, v: vec3<f32>) -> f32 {
#if ANISOTROPIC
    let across = length(v.xy);
    if (lobe.rows > 1u && across > 0.0) {
        let towards = abs(v.xy) / across;
        let at = albedo_position(v.z, length(lobe.alpha * towards));
        let turned = lobe.alpha * towards;
        let turn = f32(lobe.rows - 1u) * (atan2(towards.y, towards.x) + atan2(turned.y, turned.x)) * INV_PI;
        let row = min(u32(turn), lobe.rows - 2u);
        let a = row_value(lobe.loss + 128u * row, at);
        return a + (turn - f32(row)) * (row_value(lobe.loss + 128u * (row + 1u), at) - a);
    }
#endif
    return row_value(lobe.loss, albedo_position(v.z, lobe.alpha.x));
}

fn row_value(first: u32, at: f32) -> f32 {
    let i = min(u32(at), 126u);
    return tables[first + i] + (at - f32(i)) * (tables[first + i + 1u] - tables[first + i]);
}
#endif

// Appends what adds scale f(o, i) |cos i| of one lobe to F; nothing for mirrors and ideal refraction.
fn append_lobe(list: ptr<function, RecordList>, lobe: Lobe, v: Vertex, i: vec3<f32>, scale: f32) {
    let a = lobe.ab & 0xffffu;
    let weight = scale * lobe.weight;
    let cosine = max(i.z, 0.0) * INV_PI;
    switch (lobe.kind & 0xffu) {
        case LOBE_LAMBERT: {
#if TEXTURED
            if ((lobe.kind & LOBE_TEXTURED) != 0u) {
                if (i.z > 0.0) {
                    append_reflectance(list, lobe.loss, v.uv, weight * cosine, MODE_SINGLE);
                }
                return;
            }
#endif
            append(list, OP_SPECTRUM | MODE_SINGLE, a, weight * cosine, 0.0);
        }
#if TRANSMITTED
        case LOBE_TRANSMITTED: {
            if (i.z < 0.0) {
                let passed = weight * -i.z * INV_PI;
#if TEXTURED
                if ((lobe.kind & LOBE_TEXTURED) != 0u) {
                    append_reflectance(list, lobe.loss, v.uv, passed, MODE_SINGLE);
                    return;
                }
#endif
                append(list, OP_SPECTRUM | MODE_SINGLE, a, passed, 0.0);
            }
        }
#endif
#if ROUGH_CONDUCTOR
        case LOBE_ROUGH_CONDUCTOR: {
            if (i.z > 0.0) {
                let h = normalize(v.o + i);
                append(list, OP_CONDUCTOR | MODE_SINGLE, lobe.ab, weight * facets(lobe.alpha, v.o, i, h), min(dot(v.o, h), 1.0));
            }
        }
#endif
#if CONDUCTOR_AGAIN
        case LOBE_CONDUCTOR_AGAIN: {
            if (i.z > 0.0) {
                let lost = reflection_loss(lobe, v.o) * reflection_loss(lobe, i) / lobe.mean_loss;
                append(list, OP_SPECTRUM | MODE_SINGLE, a, weight * cosine * max(lost, 0.0), 0.0);
            }
        }
#endif
#if ROUGH_COAT
        case LOBE_ROUGH_COAT: {
            if (i.z > 0.0) {
                let h = normalize(v.o + i);
                append(list, OP_FRESNEL | MODE_SINGLE, a, weight * facets(lobe.alpha, v.o, i, h), min(dot(v.o, h), 1.0));
            }
        }
#endif
#if BASE
        case LOBE_BASE: {
            if (i.z > 0.0) {
#if KEPT
                if ((lobe.kind & LOBE_TEXTURED) != 0u) {
                    append_reflectance(list, lobe.loss, v.uv, 1.0, MODE_KEEP);
                    append(list, OP_INNER | MODE_START, lobe.cd & 0xffffu, weight * cosine, 0.0);
                    append(list, OP_SPECTRUM, lobe.cd >> 16u, 1.0, 0.0);
                } else {
                    append(list, OP_SPECTRUM | MODE_START, lobe.cd & 0xffffu, weight * cosine, 0.0);
                }
#else
                append(list, OP_SPECTRUM | MODE_START, lobe.cd & 0xffffu, weight * cosine, 0.0);
#endif
#if ROUGH_BASE
                if (lobe.alpha.x > 0.0) {
                    let enters = OP_ETA_TABLE | MODE_SQUARE;
                    append(list, enters, lobe.ab, 1.0, albedo_position(v.o.z, lobe.alpha.x));
                    append(list, enters | MODE_ADD, lobe.ab, 1.0, albedo_position(i.z, lobe.alpha.x));
                    return;
                }
#endif
                append(list, OP_TRANSMIT, a, 1.0, v.o.z);
                append(list, OP_TRANSMIT | MODE_ADD, a, 1.0, min(i.z, 1.0));
            }
        }
#endif
#if ROUGH_GLASS
        case LOBE_ROUGH_BOUNDARY: {
            append_rough_boundary(list, lobe, v, i, weight);
        }
        case LOBE_BOUNDARY_AGAIN, LOBE_BEYOND_AGAIN: {
            let beyond = (lobe.kind & 0xffu) == LOBE_BEYOND_AGAIN;
            if ((i.z < 0.0) == beyond && i.z != 0.0) {
                let share = select(lobe.cd & 0xffffu, lobe.cd >> 16u, v.inside);
                let here = select(0u, MODE_BEHIND, v.inside);
                let there = select(0u, MODE_BEHIND, v.inside != beyond);
                append(list, OP_SPECTRUM | MODE_START, share, weight * abs(i.z) * INV_PI, 0.0);
                append(list, OP_ETA_TABLE | here, lobe.ab, 1.0, albedo_position(v.o.z, lobe.alpha.x));
                append(list, OP_ETA_TABLE | there | MODE_ADD, lobe.ab, 1.0, albedo_position(abs(i.z), lobe.alpha.x));
            }
        }
#endif
        default: {
        }
    }
}

#if MICROFACETS
// D G2 / (4 cos o), correlated by height (Heitz 2014, eq. 99): reflection by facets of normal h but for F.
fn facets(alpha: vec2<f32>, o: vec3<f32>, i: vec3<f32>, h: vec3<f32>) -> f32 {
    let both = 1.0 / (1.0 + ggx_lambda(alpha, o) + ggx_lambda(alpha, i));
    return ggx_distribution(alpha, h) * both / (4.0 * o.z);
}
#endif

#if ROUGH_GLASS
fn append_rough_boundary(list: ptr<function, RecordList>, lobe: Lobe, v: Vertex, i: vec3<f32>, weight: f32) {
    let a = lobe.ab & 0xffffu;
    let behind = select(0u, MODE_BEHIND, v.inside);
    let eta = relative_index(lobe.eta, v.inside);
    if (i.z > 0.0) {
        let h = normalize(v.o + i);
        let cosine = min(dot(v.o, h), 1.0);
        append(list, reflecting(lobe, cosine, eta) | behind, a, weight * facets(lobe.alpha, v.o, i, h), cosine);
        return;
    }
    if (i.z == 0.0) {
        return;
    }
    let visible = weight * ggx_visible(lobe.alpha, v.o) * ggx_visible(lobe.alpha, i) / v.o.z;
#if DISPERSION
    if ((lobe.kind & LOBE_NARROW) != 0u) {
        return;
    }
    if ((lobe.kind & LOBE_DISPERSES) != 0u) {
        append(list, OP_ROUGH_TRANSMIT | MODE_SINGLE | behind, a, visible, lobe.alpha.x);
        // Evaluation turns o into the plane of x and z.
        let sin_o = length(v.o.xy);
        let towards = select(v.o.xy / max(sin_o, 1.0e-20), vec2<f32>(1.0, 0.0), sin_o == 0.0);
        append_raw(list, vec4<f32>(v.o.z, dot(i.xy, towards), i.y * towards.x - i.x * towards.y, i.z));
        return;
    }
#endif
    let half = refracting_half(v.o, i, eta);
    if (half.o_h > 0.0) {
        let geometric = visible * ggx_distribution(lobe.alpha, half.h) * half.o_h * half.spread;
        append(list, OP_TRANSMIT | MODE_SINGLE | behind, a, geometric, min(half.o_h, 1.0));
    }
}
#endif

#if GLASS
// Reflection at a boundary by which all channels bend alike is total where that index says so.
fn reflecting(lobe: Lobe, cosine: f32, eta: f32) -> u32 {
    let total = (lobe.kind & LOBE_DISPERSES) == 0u && !(beyond_square(cosine, eta) > 0.0) && eta != 1.0;
    return MODE_SINGLE | select(OP_FRESNEL, OP_ONE, total);
}
#endif
