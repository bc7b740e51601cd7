// Transmittance and emission of media along segments, per wavelength; deterministic.

#if GRIDS
// A way through a volume of voxels that emits, cell by cell: what it emits is seen through `through` and added to `radiance`, and
// `through` is attenuated.
fn march(record: vec4<u32>, start: vec3<f32>, to: vec3<f32>, quad: u32, s: SpectralSample, emission: f32,
         through: ptr<function, vec4<f32>>, radiance: ptr<function, vec4<f32>>) {
    let first = volume_at(record.y);
    let metres = bitcast<f32>(record.w);
    let wavelength = spectrum_value(WAVELENGTH, quad, s);
    // In matter of index n sources are n^2 of those in a vacuum.
    var squares = vec4<f32>(1.0);
    if (volumes[first + 5u] != NONE) {
        let index = spectrum_value(volumes[first + 5u], quad, s);
        squares = index * index;
    }
    let size = volume_size(first);
    var cells = cells_along(start, to, size);
    var done = 0.0;
    for (var n = 0u; n < most_cells(size); n += 1u) {
        let end = cell_end(cells);
        if (end > done) {
            let voxel = voxel_of(cells);
            let kelvin = value_in(first + 3u, voxel);
            let taken = coefficients(volumes[first + 6u], voxel, kelvin, quad, s);
            let length = metres * (end - done);
            let lost = absorbed(length * (taken.absorption + taken.scattering));
            // Of what is lost on the way only what is absorbed is emitted.
            let both = max(taken.absorption + taken.scattering, vec4<f32>(1.0e-37));
            *radiance += emission * *through * lost * (taken.absorption / both) * squares * planck(wavelength, kelvin);
            *through *= exp(-length * (taken.absorption + taken.scattering));
            done = end;
        }
        if (!next_cell(&cells)) {
            break;
        }
    }
}

// Per metre.
struct Taken {
    absorption: vec4<f32>,
    scattering: vec4<f32>,
}

// Of all kinds of matter in a voxel: absorption linear in temperature between columns, the ends held.
fn coefficients(list: u32, voxel: u32, kelvin: f32, quad: u32, s: SpectralSample) -> Taken {
    var sum = Taken(vec4<f32>(0.0), vec4<f32>(0.0));
    var at = list + 1u;
    for (var n = 0u; n < volumes[list]; n += 1u) {
        let density = value_in(at, voxel);
        let scattering = volumes[at + 2u];
        let absorbers = volumes[at + 3u];
        at += 4u;
        if (scattering != NONE) {
            sum.scattering += density * spectrum_value(scattering, quad, s);
        }
        for (var m = 0u; m < absorbers; m += 1u) {
            let strength = bitcast<f32>(volumes[at]) * density;
            let columns = volumes[at + 1u];
            let column = at + 2u;
            at = column + 2u * columns;
            let between = between_columns(column, columns, kelvin);
            var value = spectrum_value(volumes[column + 2u * between.high + 1u], quad, s);
            if (between.low != between.high) {
                let under = spectrum_value(volumes[column + 2u * between.low + 1u], quad, s);
                value = under + between.share * (value - under);
            }
            sum.absorption += strength * value;
        }
    }
    return sum;
}
#endif
