// The technique of a path, and where its densities begin.

fn begin_techniques(path: u32) {
    let from_path = draw_of(path);
    let u = draw(Draw(from_path.key ^ 0x5bd1e995u, from_path.index), DIMENSION_BOUNCE).x;
    technique = min(u32(u * f32(TECHNIQUES)), TECHNIQUES - 1u);
    if (step.bounce == 0u) {
        for (var t = 0u; t < TECHNIQUES; t += 1u) {
            ratios[t] = 1.0;
        }
    }
}
