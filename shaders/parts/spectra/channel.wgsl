// One channel's value of a spectrum, for the decision that dispersion leaves to one channel.

// [stratum][spectrum][quad of channels][value, slope], as evaluate has it.
@group(1) @binding(8) var<storage, read> spectra: array<vec4<f32>>;

fn channel_value(spectrum: u32, channel: u32, mu: u32) -> f32 {
#if KNOTS
    if (spectrum >= SPECTRA) {
        return between_knots(spectrum - SPECTRA, channel / 4u, mu)[channel % 4u];
    }
#endif
#if STRATA
    let stratum = mu >> (32u - frame.stratum_bits);
#else
    let stratum = 0u;
#endif
    let place = f32((mu << frame.stratum_bits) >> 8u) * 5.9604645e-8;
    let at = ((stratum * SPECTRA + spectrum) * QUADS + channel / 4u) * 2u;
    return spectra[at][channel % 4u] + place * spectra[at + 1u][channel % 4u];
}
