// Planck's law and what it has in common with media.

// 1 - exp(-depth), for depth >= 0, without cancellation.
fn absorbed(depth: vec4<f32>) -> vec4<f32> {
    let x = min(depth, vec4<f32>(0.5));
    let series = x * (1.0 - x * 0.5 * (1.0 - x * 0.33333333 * (1.0 - x * 0.25 * (1.0 - x * 0.2 * (1.0 - x * 0.16666667
        * (1.0 - x * 0.14285714))))));
    return select(1.0 - exp(-depth), series, depth < vec4<f32>(0.5));
}

#if PLANCK
// Planck's law, W m-2 sr-1 nm-1, at wavelengths in micrometres: c1 / l^5 e^-x / (1 - e^-x), x = c2 / (l T).
fn planck(micrometres: vec4<f32>, kelvin: f32) -> vec4<f32> {
    let x = 14387.76878 / (max(micrometres, vec4<f32>(1.0e-3)) * max(kelvin, 1.0e-3));
    let l2 = micrometres * micrometres;
    let scale = 1.191042972e5 / max(l2 * l2 * micrometres, vec4<f32>(1.0e-15));
    return scale * (exp(-min(x, vec4<f32>(200.0))) / absorbed(x));
}
#endif
