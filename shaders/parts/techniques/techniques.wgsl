// Densities of the path so far under each technique, over that of its own.
var<private> ratios: array<f32, TECHNIQUES>;
// Its own.
var<private> technique: u32;
// The densities of the direction that was looked at last, 0 of techniques that never come there; and of the one that the path takes.
var<private> densities: array<f32, TECHNIQUES>;
var<private> chosen_densities: array<f32, TECHNIQUES>;

fn sum_of_ratios() -> f32 {
    var sum = 0.0;
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        sum += ratios[t];
    }
    return sum;
}

// The density of the direction that was looked at last, as paths come here by all techniques.
fn mean_density() -> f32 {
    var sum = 0.0;
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        sum += ratios[t] * densities[t];
    }
    return sum / sum_of_ratios();
}

// The density of a direction in which the path goes on becomes a part of its densities; its weight has that of all techniques already.
fn note_densities() {
    let own = max(chosen_densities[technique], 1.0e-30);
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        ratios[t] = min(ratios[t] * chosen_densities[t] / own, 1.0e30);
    }
}
