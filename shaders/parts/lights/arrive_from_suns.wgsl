// Suns are met by rays that leave the scene, several of them where they cover one another.

fn arrive_from_suns(list: ptr<function, RecordList>, path: Path) {
    for (var s = frame.emitter_count - SUNS; s < frame.emitter_count; s += 1u) {
        let sun = emitters[s];
        let other = sun_density(sun, path.ray.direction);
        if (other >= 0.0) {
            let begin = (*list).count;
            let weight = select(power_heuristic(path.density, other), 1.0, path.density < 0.0);
            append(list, OP_ONE | MODE_SINGLE, 0u, path.scale * sun.area * weight, 0.0);
            gather(list, begin, sun.spectrum & SPECTRUM_MASK);
        }
    }
}
