// The decision at a vertex: which lobe of a material goes on, and in which direction.

struct DirectionChoice {
    // Number of the lobe; NONE where none scatters.
    lobe: u32,
    direction: vec3<f32>,
    goes_on: bool,
    // 0, or negative where the direction is the only one that the lobe has.
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
    for (var p = material.first_lobe; p < material.first_lobe + material.lobe_count; p += 1u) {
        picks += lobe_pick(p, *vertex);
    }
    (*vertex).pick_scale = select(1.0 / picks, 0.0, picks == 0.0);
#if BY_TECHNIQUE
    scale_picks(material, *vertex);
#endif
#endif
    let v = *vertex;
    var choice: DirectionChoice;
    choice.lobe = NONE;
    // The lobe that goes on.
    var chosen_pick = 0.0;
    var below = 0.0;
    for (var p = material.first_lobe; p < material.first_lobe + material.lobe_count; p += 1u) {
#if BY_TECHNIQUE
        let pick = own_pick(material, p, v);
#else
        let pick = lobe_pick(p, v);
#endif
        if (pick > 0.0 && (choice.lobe == NONE || u_lobe.x >= below)) {
            choice.lobe = p;
            chosen_pick = pick;
        }
        below += pick;
    }
    if (choice.lobe == NONE) {
        return choice;
    }
#if BY_TECHNIQUE
    if ((material.flags & MATERIAL_BY_TECHNIQUE) != 0u) {
        chosen_pick = pick_of_techniques(choice.lobe, v);
    }
#endif
    let lobe = lobe_at(choice.lobe, v);
    choice.direction = cosine_hemisphere(vec3<f32>(0.0, 0.0, 1.0), u_bsdf);
    choice.goes_on = true;
    choice.only = OP_ONE;
    choice.only_weight = lobe.weight / chosen_pick;
    choice.only_parameter = v.o.z;
#if DISPERSION
    choice.only_channel = NONE;
#endif
    let behind = lobe_behind(lobe, v);
    let mode_behind = select(0u, MODE_BEHIND, behind);
    switch (lobe.kind & 0xffu) {
#if CONDUCTOR
        case LOBE_CONDUCTOR: {
            choice.direction = vec3<f32>(-v.o.xy, v.o.z);
            choice.density = -1.0;
            choice.only = OP_CONDUCTOR | MODE_SINGLE;
        }
#endif
#if MIRROR
        case LOBE_MIRROR: {
            choice.direction = vec3<f32>(-v.o.xy, v.o.z);
            choice.density = -1.0;
            choice.only = reflecting(lobe, v.o.z, relative_index(lobe.eta, behind)) | mode_behind;
        }
#endif
#if REFRACTION
        case LOBE_REFRACTION: {
            choice.density = -1.0;
            choice.only = OP_TRANSMIT | MODE_SINGLE | MODE_SQUARE | mode_behind;
            var eta = lobe.eta;
#if DISPERSION
            if ((lobe.kind & LOBE_DISPERSES) != 0u) {
                let channel = select(live, min(u32(u_lobe.y * f32(CHANNELS)), CHANNELS - 1u), live == NONE);
                choice.only_channel = select(NONE, channel, live == NONE);
                eta = channel_value(lobe.ab & 0xffffu, channel, mu);
            }
#endif
            eta = relative_index(eta, behind);
            if ((lobe.kind & LOBE_DISPERSES) == 0u) {
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
        case LOBE_ROUGH_CONDUCTOR, LOBE_ROUGH_COAT: {
            var h = ggx_visible_normal(lobe.alpha, v.o, u_bsdf);
#if CONDUCTOR_AGAIN
            if ((lobe.kind & LOBE_BOUNDED) != 0u) {
                h = ggx_bounded_normal(lobe.alpha, v.o, u_bsdf);
            }
#endif
            choice.direction = 2.0 * dot(v.o, h) * h - v.o;
            choice.goes_on = choice.direction.z > 0.0;
        }
#endif
#if CONDUCTOR_AGAIN
        case LOBE_CONDUCTOR_AGAIN: {
            choice.direction = again_direction(lobe, u_bsdf);
        }
#endif
#if ROUGH_GLASS
        case LOBE_ROUGH_BOUNDARY: {
            let h = ggx_visible_normal(lobe.alpha, v.o, u_bsdf);
            let cosine = min(dot(v.o, h), 1.0);
            let reflects = cosine_table(lobe.decision, v.inside, cosine);
            if (u_lobe.y < reflects) {
                choice.direction = 2.0 * cosine * h - v.o;
                choice.goes_on = choice.direction.z > 0.0;
            } else {
                var eta = lobe.eta;
#if DISPERSION
                let u_channel = (u_lobe.y - reflects) / (1.0 - reflects);
                if ((lobe.kind & LOBE_NARROW) != 0u) {
                    let channel = select(live, min(u32(u_channel * f32(CHANNELS)), CHANNELS - 1u), live == NONE);
                    choice.only_channel = select(NONE, channel, live == NONE);
                    eta = channel_value(lobe.ab & 0xffffu, channel, mu);
#if BENDS_BY_TECHNIQUE
                } else if ((lobe.kind & LOBE_BY_TECHNIQUE) != 0u) {
                    eta = index_by_technique(lobe, u_channel);
#endif
                } else if ((lobe.kind & LOBE_DISPERSES) != 0u) {
                    eta = spread_index(lobe, min(u32(3.0 * u_channel), 2u));
                }
#endif
                eta = relative_index(eta, behind);
                choice.goes_on = beyond_square(cosine, eta) > 0.0;
                if (choice.goes_on) {
                    choice.direction = refracted(v.o, h, eta);
                    choice.goes_on = choice.direction.z < 0.0;
                }
#if DISPERSION
                if ((lobe.kind & LOBE_NARROW) != 0u) {
                    choice.density = -1.0;
                    choice.only = OP_TRANSMIT | MODE_SINGLE | MODE_SQUARE | mode_behind;
                    choice.only_weight *= ggx_visible(lobe.alpha, choice.direction) / (1.0 - reflects);
                    choice.only_parameter = cosine;
                }
#endif
            }
        }
        case LOBE_BEYOND_AGAIN: {
            choice.direction.z = -choice.direction.z;
        }
#endif
#if TRANSMITTED
        case LOBE_TRANSMITTED: {
            choice.direction.z = -choice.direction.z;
        }
#endif
        default: {
        }
    }
    return choice;
}
