// Transmittance and emission of media along segments, per wavelength; deterministic.

#if GRIDS
@group(0) @binding(62) var<storage, read> voxels: array<f32>;

// A way through a volume of voxels, cell by cell (Amanatides and Woo 1987). Emission seen through `through` is added to
// `radiance`, and `through` is attenuated.
fn march(record: vec4<u32>, start: vec3<f32>, to: vec3<f32>, quad: u32, s: SpectralSample, emission: f32,
         through: ptr<function, vec4<f32>>, radiance: ptr<function, vec4<f32>>) {
    let first = volume_at(record.y);
    let metres = bitcast<f32>(record.w);
    let size = vec3<i32>(vec3<u32>(volumes[first + 7u], volumes[first + 8u], volumes[first + 9u]));
    let way = to - start;
    let ahead = vec3<i32>(select(vec3<f32>(-1.0), vec3<f32>(1.0), way > vec3<f32>(0.0)));
    var cell = clamp(vec3<i32>(floor(start)), vec3<i32>(0), size - 1);
    // Where the next plane along each axis is crossed, as a fraction of the way.
    let resting = abs(way) < vec3<f32>(1.0e-12);
    let inverse = 1.0 / select(way, vec3<f32>(1.0), resting);
    var next = select((vec3<f32>(cell + max(ahead, vec3<i32>(0))) - start) * inverse, vec3<f32>(2.0), resting);
    let pace = select(abs(inverse), vec3<f32>(0.0), resting);
    let temperature_at = volumes[first + 3u];
    let density_at = volumes[first + 4u];
    let wavelength = spectrum_value(WAVELENGTH, quad, s);
    // In matter of index n sources are n^2 of those in a vacuum.
    var squares = vec4<f32>(1.0);
    if (volumes[first + 23u] != NONE) {
        let index = spectrum_value(volumes[first + 23u], quad, s);
        squares = index * index;
    }
    var done = 0.0;
    let most = u32(size.x + size.y + size.z) + 3u;
    for (var n = 0u; n < most; n += 1u) {
        let axis = select(select(2u, 1u, next.y <= next.z), 0u, next.x <= next.y && next.x <= next.z);
        let end = min(next[axis], 1.0);
        if (end > done) {
            let voxel = u32(cell.x + size.x * (cell.y + size.y * cell.z));
            var kelvin = bitcast<f32>(volumes[first + 5u]);
            if (temperature_at != NONE) {
                kelvin = voxels[temperature_at + voxel];
            }
            var density = bitcast<f32>(volumes[first + 6u]);
            if (density_at != NONE) {
                density = voxels[density_at + voxel];
            }
            if (density > 0.0) {
                let depth = (metres * (end - done) * density) * absorption(volumes[first + 22u], kelvin, quad, s);
                let lost = absorbed(depth);
                if (emission > 0.0) {
                    *radiance += emission * *through * lost * squares * planck(wavelength, kelvin);
                }
                *through *= exp(-depth);
            }
            done = end;
        }
        if (end >= 1.0) {
            break;
        }
        cell[axis] += ahead[axis];
        if (cell[axis] < 0 || cell[axis] >= size[axis]) {
            // Rounding at the end of the way: what is left belongs to the last cell, and is nothing.
            break;
        }
        next[axis] += pace[axis];
    }
}

// Per metre at density 1: linear in temperature between columns, the ends held.
fn absorption(list: u32, kelvin: f32, quad: u32, s: SpectralSample) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    var at = list + 1u;
    for (var n = 0u; n < volumes[list]; n += 1u) {
        let strength = bitcast<f32>(volumes[at]);
        let columns = volumes[at + 1u];
        let column = at + 2u;
        at = column + 2u * columns;
        // Without a loop: an invocation may have 32,768 iterations in all, and the march takes them.
        var above = 0u;
#repeat MOST_COLUMNS c
        above += select(0u, 1u, bitcast<f32>(volumes[column + 2u * min($cu, columns - 1u)]) < kelvin && $cu < columns);
#end
        let high = min(above, columns - 1u);
        let low = max(above, 1u) - 1u;
        var value = spectrum_value(volumes[column + 2u * high + 1u], quad, s);
        if (low != high) {
            let a = bitcast<f32>(volumes[column + 2u * low]);
            let b = bitcast<f32>(volumes[column + 2u * high]);
            let under = spectrum_value(volumes[column + 2u * low + 1u], quad, s);
            value = under + (kelvin - a) / (b - a) * (value - under);
        }
        sum += strength * value;
    }
    return sum;
}
#endif
