// Russian roulette: whether a path survives a scattering event, and what that makes of its weight.

fn survives(path: ptr<function, Path>, u: f32, survival: f32) -> bool {
    if (step.bounce + 1u < frame.roulette_start) {
        return true;
    }
    (*path).scale /= survival;
    return u < survival;
}
