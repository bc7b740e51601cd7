// Spectra at a path's wavelength sample, for a quad of channels.

// [stratum][spectrum][quad of channels][value, slope]; spectrum 0 is the constant 1. In registers, in one stratum, there may be kinks:
// [spectrum][quad of channels][value, slope, places of kinks, changes of slope there].
@group(1) @binding(8) var<storage, read> spectra: array<vec4<f32>>;

// Where the path's wavelength sample stands: its stratum, and the place within.
struct SpectralSample {
    stratum: u32,
    place: f32,
#if KNOTS
    mu: u32,
#endif
}

fn spectral_sample(mu: u32) -> SpectralSample {
    var s: SpectralSample;
    s.place = f32((mu << frame.stratum_bits) >> 8u) * 5.9604645e-8;
#if STRATA
    s.stratum = mu >> (32u - frame.stratum_bits);
#endif
#if KNOTS
    s.mu = mu;
#endif
    return s;
}

fn table_index(stratum: u32, spectrum: u32, quad: u32) -> u32 {
#if KINKS
    return (spectrum * QUADS + quad) * (2u + 2u * KINKS);
#else
    return ((stratum * SPECTRA + spectrum) * QUADS + quad) * 2u;
#endif
}

#if REGISTERS
#else
fn table_value(spectrum: u32, quad: u32, s: SpectralSample) -> vec4<f32> {
    let at = table_index(s.stratum, spectrum, quad);
#if KINKS
    var value = spectra[at] + s.place * spectra[at + 1u];
#repeat KINKS j
    value += spectra[at + 2u + KINKS + $ju] * max(s.place - spectra[at + 2u + $ju], vec4<f32>(0.0));
#end
    return max(value, vec4<f32>(0.0));
#else
    return spectra[at] + s.place * spectra[at + 1u];
#endif
}

#if KNOTS
fn spectrum_value(spectrum: u32, quad: u32, s: SpectralSample) -> vec4<f32> {
    if (spectrum < SPECTRA) {
        return table_value(spectrum, quad, s);
    }
    return between_knots(spectrum - SPECTRA, quad, s.mu);
}
#else
fn spectrum_value(spectrum: u32, quad: u32, s: SpectralSample) -> vec4<f32> {
    return table_value(spectrum, quad, s);
}
#endif
#endif

// What a path's throughput begins with: what the channel's response and the density of wavelengths make of this one.
fn first_throughput(quad: u32, s: SpectralSample) -> vec4<f32> {
#if WEIGHTED
#if REGISTERS
    let at = table_index(s.stratum, PATH_WEIGHT, quad);
    return spectra[at] + s.place * spectra[at + 1u];
#else
    return spectrum_value(PATH_WEIGHT, quad, s);
#endif
#else
    return vec4<f32>(1.0);
#endif
}
