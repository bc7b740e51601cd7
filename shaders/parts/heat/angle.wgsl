// Surfaces whose emission depends on the angle: a row of spectra over the cosine.

#constants EMITS_BY_ANGLE HOT_COSINES

// What an emitter sends out at a cosine to the normal that light sees: one of the two spectra nearest to it, by chance, so that the
// mean is linear between them.
fn emitted_spectrum(emitter: Emitter, front: bool, cosine: f32, u: f32) -> u32 {
    let x = pow(clamp(cosine, 1.0e-9, 1.0), 1.0 / 3.0) * f32(HOT_COSINES - 1u);
    let node = min(u32(x), HOT_COSINES - 2u);
    let nearer = select(0u, 1u, u < x - f32(node));
    let row = (emitter.spectrum & 0x1fffffffu) + select(HOT_COSINES, 0u, front);
    return emitters[row + node + nearer].primitive;
}

// Whether an emitter is one that a path has met; then also what it sends along.
fn emits_by_angle(list: ptr<function, RecordList>, path: Path, site: Site, v: Vertex, emitter: Emitter, weight: f32) -> bool {
    if ((emitter.spectrum & EMITS_BY_ANGLE) == 0u) {
        return false;
    }
    var cosine = abs(dot(site.surface.normal, path.ray.direction));
#lines MET_COSINE
    let begin = (*list).count;
    append(list, OP_ONE | MODE_SINGLE, 0u, weight, 0.0);
    gather(list, begin, emitted_spectrum(emitter, site.from_front, cosine, hot_numbers(path.number, SALT_ANGLE).x));
    return true;
}

// The spectrum of a point that is aimed at.
fn aim_by_angle(aim: ptr<function, Aim>, path: u32, emitter: Emitter, point: LightPoint) {
    if ((emitter.spectrum & EMITS_BY_ANGLE) == 0u) {
        return;
    }
    let along = dot(point.normal, (*aim).towards) / max(length((*aim).towards), 1.0e-30);
    var cosine = abs(along);
#lines AIMED_COSINE
    (*aim).source = emitted_spectrum(emitter, along < 0.0, cosine, hot_numbers(path, SALT_ANGLE).y);
}
