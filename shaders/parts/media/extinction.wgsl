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
    let list = volumes[first + 6u];
    let temperature = field_at(first + 3u);
#if ONE_KIND
    let density_of_all = field_at(list + 1u);
    let absorbers_of_all = volumes[list + 4u];
#endif
    let size = volume_size(first);
    var cells = cells_along(start, to, size);
    var done = 0.0;
    for (var n = 0u; n < most_cells(size); n += 1u) {
        let end = cell_end(cells);
        if (end > done) {
            let voxel = voxel_of(cells);
            let kelvin = field_value(temperature, voxel);
#if ONE_KIND
            let density = field_value(density_of_all, voxel);
            var taken = Taken(density * absorption(list + 5u, absorbers_of_all, kelvin, quad, s), vec4<f32>(0.0));
#if SCATTERS
            if (volumes[list + 3u] != NONE) {
                taken.scattering = density * spectrum_value(volumes[list + 3u], quad, s);
            }
#endif
#else
            let taken = coefficients(list, voxel, kelvin, quad, s);
#endif
            let length = metres * (end - done);
#if SCATTERS
            let lost = absorbed(length * (taken.absorption + taken.scattering));
            // Of what is lost on the way only what is absorbed is emitted.
            let both = max(taken.absorption + taken.scattering, vec4<f32>(1.0e-37));
            *radiance += emission * *through * lost * (taken.absorption / both) * squares * planck(wavelength, kelvin);
            *through *= exp(-length * (taken.absorption + taken.scattering));
#else
            let depth = length * taken.absorption;
            *radiance += emission * *through * absorbed(depth) * squares * planck(wavelength, kelvin);
            *through *= exp(-depth);
#endif
            done = end;
        }
        if (!next_cell(&cells, end)) {
            break;
        }
    }
}

// Per metre.
struct Taken {
    absorption: vec4<f32>,
    scattering: vec4<f32>,
}

// Of so many absorbers from word `first` on, at density 1: linear in temperature between columns, the ends held.
fn absorption(first: u32, absorbers: u32, kelvin: f32, quad: u32, s: SpectralSample) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    var at = first;
    for (var m = 0u; m < absorbers; m += 1u) {
        let strength = bitcast<f32>(volumes[at]);
        let columns = volumes[at + 1u];
        let column = at + 2u;
        at = column + 2u * columns;
        let above = columns_below(column, columns, kelvin);
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

#if ONE_KIND
#else
// Of all kinds of matter in a voxel.
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
        sum.absorption += density * absorption(at, absorbers, kelvin, quad, s);
        for (var m = 0u; m < absorbers; m += 1u) {
            at += 2u + 2u * volumes[at + 1u];
        }
    }
    return sum;
}
#endif
#endif
