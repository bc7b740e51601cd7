// Next-event estimation: a light is chosen and aimed at.

fn aim_at_light(path: u32, site: Site, v: Vertex, choice: f32, u: vec2<f32>) -> Aim {
    let transmits = (site.material.flags & MATERIAL_TRANSMITS) != 0u;
    let seen_from = select(offset_origin(site.surface.position, site.face), site.surface.position, transmits);
    var aim = find_light(path, seen_from, choice, u);
    let side = dot(site.face, aim.towards);
    var is_kept = true;
#lines LIGHT_SIDE
    if (!(aim.density > 0.0 && side != 0.0 && (side > 0.0 || transmits) && is_kept)) {
        aim.density = 0.0;
        return aim;
    }
    aim.direction = normalize(to_local(v, aim.towards));
    aim.shadow.origin = offset_origin(site.surface.position, select(-site.face, site.face, side > 0.0));
#if SCATTERS
    if (site.in_matter) {
        aim.shadow.origin = site.surface.position;
    }
#endif
    aim.shadow.direction = select(aim.end - aim.shadow.origin, aim.towards, aim.limit == INFINITE);
    return aim;
}

fn find_light(path: u32, seen_from: vec3<f32>, choice: f32, u: vec2<f32>) -> Aim {
    var aim: Aim;
    aim.strength = 1.0;
    aim.is_met = true;
    aim.limit = 1.0;
#lines AIM_AT_MAP
#if CHOOSES
#if PLACED_LIGHTS
    let emitter = emitter_chosen(path, choose_emitter(choice));
#else
    let emitter = emitters[choose_emitter(choice)];
#endif
    aim.source = emitter.spectrum & SPECTRUM_MASK;
#lines AIM_AT_EMITTER
#endif
    return aim;
}

// What a light's radiance counts, times `scale`, where its direction would otherwise be chosen with density `chance`.
fn light_weight(aim: Aim, chance: f32, scale: f32) -> f32 {
    let met = scale * power_heuristic(aim.density, chance) / aim.density;
    return aim.strength * select(scale / aim.density, met, aim.is_met);
}
