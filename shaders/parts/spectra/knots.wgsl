// Spectra that no affordable number of strata resolves, as exact knots.

// First knot of (spectrum, channel), and (mu as it stands in the head, value).
@group(1) @binding(10) var<storage, read> knot_starts: array<u32>;
@group(1) @binding(11) var<storage, read> knots: array<vec2<u32>>;

// Binary search without a loop: an invocation may have 32,768 iterations in all, which the walk along the records takes;
// and its length is known.
fn knot_value(spectrum: u32, channel: u32, mu: u32) -> f32 {
    let first = knot_starts[spectrum * CHANNELS_PADDED + channel];
    var low = first;
    // Segments still in question, from `low` on.
    var left = knot_starts[spectrum * CHANNELS_PADDED + channel + 1u] - 1u - first;
    var half = 0u;
    var above = false;
#repeat KNOT_STEPS i
    half = left / 2u;
    above = knots[low + half].x <= mu;
    low = select(low, low + half, above);
    left = select(half, left - half, above);
#end
    let a = knots[low];
    let b = knots[low + 1u];
    let place = min(f32(mu - a.x) / max(f32(b.x - a.x), 1.0), 1.0);
    return bitcast<f32>(a.y) + place * (bitcast<f32>(b.y) - bitcast<f32>(a.y));
}
