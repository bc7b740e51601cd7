// The radiance of an environment map at a place that a record names, for a quad of channels, over the source spectrum.

#if MAP_SPECTRAL
// [texel][band].
@group(0) @binding(42) var<storage, read> map_texels: array<f32>;

// `axis` is the place among the bands, the first at 1; 0 beyond them.
fn map_texel(texel: u32, axis: vec4<f32>) -> vec4<f32> {
    var value = vec4<f32>(0.0);
    for (var n = 0u; n < 4u; n += 1u) {
        if (axis[n] >= 1.0) {
            let band = min(u32(axis[n]), MAP_BANDS) - 1u;
            let first = texel * MAP_BANDS;
            let a = map_texels[first + band];
            value[n] = a + (axis[n] - f32(band + 1u)) * (map_texels[first + min(band + 1u, MAP_BANDS - 1u)] - a);
        }
    }
    return value;
}
#else
// Coefficients of a smooth spectrum, and its scale (`spectral::skylight`).
@group(0) @binding(42) var<storage, read> map_texels: array<vec4<f32>>;

// `axis` is the wavelength, 360 to 830 nm as 0 to 1.
fn map_texel(texel: u32, axis: vec4<f32>) -> vec4<f32> {
    let c = map_texels[texel];
    let x = (c.x * axis + c.y) * axis + c.z;
    // S(x) without cancellation: what lies below 1/2 is 1 / (2 root (root + |x|)).
    let root = sqrt(1.0 + x * x);
    let tail = 0.5 / (root * (root + abs(x)));
    return c.w * select(tail, 1.0 - tail, x >= vec4<f32>(0.0));
}
#endif

fn map_value(cell: u32, fractions: u32, axis: vec4<f32>) -> vec4<f32> {
    return map_between(0u, cell, fractions, axis);
}

#if MAP_LEFT
// What sources of products leave of it.
fn map_left(cell: u32, fractions: u32, axis: vec4<f32>) -> vec4<f32> {
    return map_between(MAP_WIDTH * MAP_HEIGHT, cell, fractions, axis);
}
#endif

// Between the texels from `first` on.
fn map_between(first: u32, cell: u32, fractions: u32, axis: vec4<f32>) -> vec4<f32> {
    let column = cell & 0xffffu;
    let row = cell >> 16u;
    let right = select(column + 1u, 0u, column + 1u == MAP_WIDTH);
    let upper = first + (max(row, 1u) - 1u) * MAP_WIDTH;
    let lower = first + min(row, MAP_HEIGHT - 1u) * MAP_WIDTH;
    let f = vec2<f32>(vec2<u32>(fractions & 0xffffu, fractions >> 16u)) / 65535.0;
    let a = map_texel(upper + column, axis);
    let b = map_texel(upper + right, axis);
    let c = map_texel(lower + column, axis);
    let d = map_texel(lower + right, axis);
    let top = a + f.x * (b - a);
    return top + f.y * (c + f.x * (d - c) - top);
}
