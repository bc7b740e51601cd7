// Spectra that no affordable number of strata resolves, as exact knots (src/spectral/knots.rs).

// Where the places of each (spectrum, quad of channels) begin in this list; then all places, mu as it stands in the head. And the
// values there of the four channels.
@group(1) @binding(10) var<storage, read> knot_places: array<u32>;
@group(1) @binding(11) var<storage, read> knot_values: array<vec4<f32>>;

// Binary search without a loop: an invocation may have 32,768 iterations in all, which the walk along the records takes;
// and its length is known.
fn between_knots(spectrum: u32, quad: u32, mu: u32) -> vec4<f32> {
    let row = spectrum * QUADS + quad;
    var low = knot_places[row];
    // Segments still in question, from `low` on.
    var left = knot_places[row + 1u] - 1u - low;
    var half = 0u;
    var above = false;
#repeat KNOT_STEPS i
    half = left / 2u;
    above = knot_places[low + half] <= mu;
    low = select(low, low + half, above);
    left = select(half, left - half, above);
#end
    let begin = knot_places[low];
    let place = min(f32(mu - begin) / max(f32(knot_places[low + 1u] - begin), 1.0), 1.0);
    let a = knot_values[low - FIRST_KNOT_PLACE];
    let b = knot_values[low + 1u - FIRST_KNOT_PLACE];
    return a + place * (b - a);
}
