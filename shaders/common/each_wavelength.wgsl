#if WAVELENGTHS
    // Text, not functions: begins the loop over a path's wavelengths in each channel, which common/mean_over_wavelengths.wgsl ends.
#repeat VECTORS v
    var sum_$v = vec4<f32>(0.0);
#end
    for (var turn = 0u; turn < WAVELENGTHS; turn += 1u) {
    let s = spectral_sample(head.x + turn * WAVELENGTH_STEP);
#endif
