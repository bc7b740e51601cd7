// The decision at a vertex: which part of a material goes on, and in which direction.

struct DirectionChoice {
    // Number of the part; NONE where none scatters.
    part: u32,
    direction: vec3<f32>,
    goes_on: bool,
    // 0, or negative where the direction is the only one that the part has.
    density: f32,
    // Then: what that does to every channel, as an instruction.
    only: u32,
    only_weight: f32,
    only_parameter: f32,
#if DISPERSION
    // And the channel that it leaves, or NONE.
    only_channel: u32,
#endif
}

// Chooses, and sets the pick_scale of the vertex. `mu`: of the path; `live`: the one channel that refraction has left it, or NONE.
fn choose_direction(material: SurfaceMaterial, vertex: ptr<function, Vertex>, u_bsdf: vec2<f32>, u_lobe: vec2<f32>, mu: u32, live: u32) -> DirectionChoice {
#if SHARES
    (*vertex).pick_scale = 1.0;
    var picks = 0.0;
    for (var p = material.first_part; p < material.first_part + material.part_count; p += 1u) {
        picks += part_pick(p, *vertex);
    }
    (*vertex).pick_scale = select(1.0 / picks, 0.0, picks == 0.0);
#endif
    let v = *vertex;
    var choice: DirectionChoice;
    choice.part = NONE;
    // The part that goes on.
    var chosen_pick = 0.0;
    var below = 0.0;
    for (var p = material.first_part; p < material.first_part + material.part_count; p += 1u) {
        let pick = part_pick(p, v);
        if (pick > 0.0 && (choice.part == NONE || u_lobe.x >= below)) {
            choice.part = p;
            chosen_pick = pick;
        }
        below += pick;
    }
    if (choice.part == NONE) {
        return choice;
    }
    let part = part_at(choice.part, v);
    choice.direction = cosine_hemisphere(vec3<f32>(0.0, 0.0, 1.0), u_bsdf);
    choice.goes_on = true;
    choice.only = OP_ONE;
    choice.only_weight = part.weight / chosen_pick;
    choice.only_parameter = v.o.z;
#if DISPERSION
    choice.only_channel = NONE;
#endif
    let behind = part_behind(part, v);
    let mode_behind = select(0u, MODE_BEHIND, behind);
    switch (part.kind & 0xffu) {
#if CONDUCTOR
        case KIND_CONDUCTOR: {
            choice.direction = vec3<f32>(-v.o.xy, v.o.z);
            choice.density = -1.0;
            choice.only = OP_CONDUCTOR | MODE_SINGLE;
        }
#endif
#if MIRROR
        case KIND_MIRROR: {
            choice.direction = vec3<f32>(-v.o.xy, v.o.z);
            choice.density = -1.0;
            choice.only = reflecting(part, v.o.z, relative_index(part.eta, behind)) | mode_behind;
        }
#endif
#if REFRACTION
        case KIND_REFRACTION: {
            choice.density = -1.0;
            choice.only = OP_TRANSMIT | MODE_SINGLE | MODE_SQUARE | mode_behind;
            var eta = part.eta;
#if DISPERSION
            if ((part.kind & PART_DISPERSES) != 0u) {
                let channel = select(live, min(u32(u_lobe.y * f32(CHANNELS)), CHANNELS - 1u), live == NONE);
                choice.only_channel = select(NONE, channel, live == NONE);
                eta = channel_value(part.ab & 0xffffu, channel, mu);
            }
#endif
            eta = relative_index(eta, behind);
            if ((part.kind & PART_DISPERSES) == 0u) {
                choice.only = OP_TRANSMIT | MODE_SINGLE | mode_behind;
                choice.only_weight /= eta * eta;
            }
            choice.goes_on = beyond_square(v.o.z, eta) > 0.0;
            if (choice.goes_on) {
                choice.direction = refracted(v.o, vec3<f32>(0.0, 0.0, 1.0), eta);
            }
        }
#endif
#if MICROFACETS
        case KIND_ROUGH_CONDUCTOR, KIND_ROUGH_COAT: {
            let h = ggx_visible_normal(part.alpha, v.o, u_bsdf);
            choice.direction = 2.0 * dot(v.o, h) * h - v.o;
            choice.goes_on = choice.direction.z > 0.0;
        }
#endif
#if ROUGH_GLASS
        case KIND_ROUGH_BOUNDARY: {
            let h = ggx_visible_normal(part.alpha, v.o, u_bsdf);
            let cosine = min(dot(v.o, h), 1.0);
            let reflects = cosine_table(part.decision, v.inside, cosine);
            if (u_lobe.y < reflects) {
                choice.direction = 2.0 * cosine * h - v.o;
                choice.goes_on = choice.direction.z > 0.0;
            } else {
                var eta = part.eta;
#if DISPERSION
                let u_channel = (u_lobe.y - reflects) / (1.0 - reflects);
                if ((part.kind & PART_NARROW) != 0u) {
                    let channel = select(live, min(u32(u_channel * f32(CHANNELS)), CHANNELS - 1u), live == NONE);
                    choice.only_channel = select(NONE, channel, live == NONE);
                    eta = channel_value(part.ab & 0xffffu, channel, mu);
                } else if ((part.kind & PART_DISPERSES) != 0u) {
                    eta = spread_index(part, min(u32(3.0 * u_channel), 2u));
                }
#endif
                eta = relative_index(eta, behind);
                choice.goes_on = beyond_square(cosine, eta) > 0.0;
                if (choice.goes_on) {
                    choice.direction = refracted(v.o, h, eta);
                    choice.goes_on = choice.direction.z < 0.0;
                }
#if DISPERSION
                if ((part.kind & PART_NARROW) != 0u) {
                    choice.density = -1.0;
                    choice.only = OP_TRANSMIT | MODE_SINGLE | MODE_SQUARE | mode_behind;
                    choice.only_weight *= ggx_visible(part.alpha, choice.direction) / (1.0 - reflects);
                    choice.only_parameter = cosine;
                }
#endif
            }
        }
        case KIND_BEYOND_AGAIN: {
            choice.direction.z = -choice.direction.z;
        }
#endif
        default: {
        }
    }
    return choice;
}
