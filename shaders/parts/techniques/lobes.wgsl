// Lobes of which each technique has its own chances (`device::parts::by_technique`). Behind the table of those by shares, [before, behind][257
// cosines] as everywhere, stand those of the techniques: [before, behind][257 cosines][technique].

#if SHARES
// Make the chances of each technique sum to 1 where textures have a say, at the vertex looked at.
var<private> pick_scales: array<f32, TECHNIQUES>;
#endif

// Where the chances of a lobe stand at a vertex, and how far it is to the next cosine.
struct PickRow {
    at: u32,
    place: f32,
    share: f32,
}

fn pick_row(p: u32, v: Vertex) -> PickRow {
    let x = clamp(v.o.z, 0.0, 1.0) * f32(COSINE_INTERVALS);
    let i = min(u32(x), COSINE_INTERVALS - 1u);
    let side = select(0u, COSINE_INTERVALS + 1u, v.inside);
    let at = lobes[p].picks + 2u * (COSINE_INTERVALS + 1u) + TECHNIQUES * (side + i);
#if SHARES
    return PickRow(at, x - f32(i), lobe_share(p, v.uv));
#else
    return PickRow(at, x - f32(i), 1.0);
#endif
}

fn unscaled_pick(row: PickRow, t: u32) -> f32 {
    let low = tables[row.at + t];
    return row.share * (low + row.place * (tables[row.at + TECHNIQUES + t] - low));
}

fn pick_by(row: PickRow, t: u32) -> f32 {
#if SHARES
    return unscaled_pick(row, t) * pick_scales[t];
#else
    return unscaled_pick(row, t);
#endif
}

#if SHARES
fn scale_picks(material: SurfaceMaterial, v: Vertex) {
    if ((material.flags & MATERIAL_BY_TECHNIQUE) == 0u) {
        return;
    }
    var sums = array<f32, TECHNIQUES>();
    for (var p = material.first_lobe; p < material.first_lobe + material.lobe_count; p += 1u) {
        let row = pick_row(p, v);
        for (var t = 0u; t < TECHNIQUES; t += 1u) {
            sums[t] += unscaled_pick(row, t);
        }
    }
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        pick_scales[t] = select(1.0 / sums[t], 0.0, sums[t] == 0.0);
    }
}
#endif

// The chance with which the path chooses lobe `p`.
fn own_pick(material: SurfaceMaterial, p: u32, v: Vertex) -> f32 {
    if ((material.flags & MATERIAL_BY_TECHNIQUE) != 0u) {
        return pick_by(pick_row(p, v), technique);
    }
    return lobe_pick(p, v);
}

// That of all techniques, as paths come here by them; the chance itself becomes a part of the path's densities.
fn pick_of_techniques(p: u32, v: Vertex) -> f32 {
    let row = pick_row(p, v);
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        densities[t] = pick_by(row, t);
    }
    chosen_densities = densities;
    return mean_density();
}

// The density with which the whole material chooses `i`, likewise.
fn density_of_techniques(material: SurfaceMaterial, v: Vertex, i: vec3<f32>) -> f32 {
    densities = array<f32, TECHNIQUES>();
    for (var p = material.first_lobe; p < material.first_lobe + material.lobe_count; p += 1u) {
        if (lobe_pick(p, v) > 0.0) {
            let lobe = unshared_lobe(p, v);
            let row = pick_row(p, v);
#if BENDS_BY_TECHNIQUE
            if ((lobe.kind & LOBE_BY_TECHNIQUE) != 0u && i.z < 0.0) {
                add_bent(row, lobe, v, i);
                continue;
            }
#endif
            let density = lobe_density(lobe, v, i);
            if (density > 0.0) {
                for (var t = 0u; t < TECHNIQUES; t += 1u) {
                    densities[t] += pick_by(row, t) * density;
                }
            }
        }
    }
    return mean_density();
}

#if BENDS_BY_TECHNIQUE
// The one channel that smooth dispersion has left the path, or NONE, and where the path is in it.
var<private> lone_channel: u32;
var<private> lone_mu: u32;

fn lone_index(lobe: Lobe) -> f32 {
    return channel_value(lobe.ab & 0xffffu, lone_channel, lone_mu);
}

// The index by which a rough boundary bends the path: its technique's, or with a tenth of the chance one that all have.
fn index_by_technique(lobe: Lobe, u: f32) -> f32 {
    if (lone_channel != NONE) {
        return lone_index(lobe);
    }
    if (u < 0.1) {
        return spread_index(lobe, min(u32(30.0 * u), 2u));
    }
    return tables[lobe.loss + technique];
}

fn add_bent(row: PickRow, lobe: Lobe, v: Vertex, i: vec3<f32>) {
    var shared_by_all = 0.0;
    if (lone_channel != NONE) {
        shared_by_all = refracted_density(lobe, v, i, relative_index(lone_index(lobe), v.inside));
    } else {
        for (var n = 0u; n < 3u; n += 1u) {
            shared_by_all += (0.1 / 3.0) * refracted_density(lobe, v, i, relative_index(spread_index(lobe, n), v.inside));
        }
    }
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        var density = shared_by_all;
        // What never comes here decides nothing.
        if (lone_channel == NONE && ratios[t] > 0.0) {
            density += 0.9 * refracted_density(lobe, v, i, relative_index(tables[lobe.loss + t], v.inside));
        }
        densities[t] += pick_by(row, t) * density;
    }
}
#endif
