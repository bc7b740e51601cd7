// A vertex in matter: its directions, and what light takes there from one to another.

// A place without a surface, whose own frame is the world's.
fn site_in_matter(position: vec3<f32>, survival: f32) -> Site {
    var site: Site;
    site.in_matter = true;
    site.surface.position = position;
    site.material.flags = MATERIAL_TRANSMITS;
#if RATIOS
    site.material.flags |= MATERIAL_BY_TECHNIQUE;
#endif
    site.material.lobe_count = 1u;
    site.material.survival = survival;
    // No direction lies along it.
    site.face = vec3<f32>(0.5402, 0.6714, 0.5073);
    return site;
}

fn vertex_in_matter() -> Vertex {
    var v: Vertex;
    v.s = vec3<f32>(1.0, 0.0, 0.0);
    v.t = vec3<f32>(0.0, 1.0, 0.0);
    v.normal = vec3<f32>(0.0, 0.0, 1.0);
    v.o = vec3<f32>(0.0, 0.0, 1.0);
    return v;
}

fn choose_turn(u: vec2<f32>, u_kind: f32) -> DirectionChoice {
    var choice: DirectionChoice;
    choice.lobe = 0u;
    choice.goes_on = true;
    choice.direction = sample_turn(u, u_kind);
    choice.density = matter_density(choice.direction);
#if RATIOS
    chosen_densities = densities;
#endif
#if DISPERSION
    choice.only_channel = NONE;
#endif
    return choice;
}

// What is scattered into a direction, of every kind of matter there.
fn append_turn(list: ptr<function, RecordList>, direction: vec3<f32>, weight: f32) {
    let versine = versine_between(collision.direction, direction);
    let scatterers = scatterers_of(collision.first);
    var at = scatterers + 1u;
    for (var n = 0u; n < volumes[scatterers]; n += 1u) {
        let counts = weight * collision.weight * scatterer_density(at, collision.voxel) * (0.25 * INV_PI);
        let kind = volumes[at + 3u];
        let spectrum = volumes[at + 2u];
        let parameter = volumes[at + 4u];
        if (counts > 0.0) {
            if (kind == PHASE_RAYLEIGH) {
                append(list, OP_SPECTRUM | MODE_SINGLE, spectrum, counts * rayleigh(bitcast<f32>(parameter), versine), 0.0);
            }
            if (kind == PHASE_HENYEY_GREENSTEIN) {
                append(list, OP_HENYEY_GREENSTEIN | MODE_SINGLE, spectrum | (parameter << 16u), counts, versine);
            }
#if PHASE_TABLES
            if (kind == PHASE_TABLE) {
                append(list, OP_SPECTRUM | MODE_START, spectrum, counts, 0.0);
                append(list, OP_PHASE_TABLE | MODE_ADD, volumes[at + 6u] | (parameter << 16u), 1.0, phase_place(parameter, versine));
            }
#endif
        }
        at += SCATTERER_WORDS + 2u * TECHNIQUES;
    }
}
