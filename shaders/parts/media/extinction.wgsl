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
    // Of every temperature once, not in each cell: spectra that are lines are searched, and a way has more cells than they have columns.
    var terms = spectra_of_matter(list, quad, s);
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
            var at = list + 5u;
            var term = 0u;
            var taken = Taken(density * absorption(&at, absorbers_of_all, kelvin, &term, &terms), vec4<f32>(0.0));
#if SCATTERS
            if (volumes[list + 3u] != NONE) {
                taken.scattering = density * terms[term];
            }
#endif
#else
            let taken = coefficients(list, voxel, kelvin, &terms);
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

// The spectra of a volume's matter in the order of amounts: of each kind those of its absorbers at each temperature, then of what it
// scatters.
fn spectra_of_matter(list: u32, quad: u32, s: SpectralSample) -> array<vec4<f32>, MOST_TERMS> {
    var terms = array<vec4<f32>, MOST_TERMS>();
    var at = list + 1u;
    var term = 0u;
    for (var n = 0u; n < volumes[list]; n += 1u) {
        let scattering = volumes[at + 2u];
        let absorbers = volumes[at + 3u];
        at += 4u;
        for (var m = 0u; m < absorbers; m += 1u) {
            let columns = volumes[at + 1u];
            for (var c = 0u; c < columns; c += 1u) {
                terms[term] = spectrum_value(volumes[at + 3u + 2u * c], quad, s);
                term += 1u;
            }
            at += 2u + 2u * columns;
        }
        if (scattering != NONE) {
            terms[term] = spectrum_value(scattering, quad, s);
            term += 1u;
        }
    }
    return terms;
}

// Of so many absorbers from word `at` on, at density 1: linear in temperature between columns, the ends held. Leads `at` and `term`
// behind them. Without a loop: an invocation may have 32,768 iterations in all, and walks through cells take them.
fn absorption(at: ptr<function, u32>, absorbers: u32, kelvin: f32, term: ptr<function, u32>, terms: ptr<function, array<vec4<f32>, MOST_TERMS>>) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
#repeat MOST_ABSORBERS m
    if ($mu < absorbers) {
        let strength = bitcast<f32>(volumes[*at]);
        let columns = volumes[*at + 1u];
        let between = between_columns(*at + 2u, columns, kelvin);
        var value = (*terms)[*term + between.high];
        if (between.low != between.high) {
            let under = (*terms)[*term + between.low];
            value = under + between.share * (value - under);
        }
        sum += strength * value;
        *at += 2u + 2u * columns;
        *term += columns;
    }
#end
    return sum;
}

#if ONE_KIND
#else
// Of all kinds of matter in a voxel.
fn coefficients(list: u32, voxel: u32, kelvin: f32, terms: ptr<function, array<vec4<f32>, MOST_TERMS>>) -> Taken {
    var sum = Taken(vec4<f32>(0.0), vec4<f32>(0.0));
    var at = list + 1u;
    var term = 0u;
    for (var n = 0u; n < volumes[list]; n += 1u) {
        let density = value_in(at, voxel);
        let scattering = volumes[at + 2u];
        let absorbers = volumes[at + 3u];
        at += 4u;
        sum.absorption += density * absorption(&at, absorbers, kelvin, &term, terms);
        if (scattering != NONE) {
            sum.scattering += density * (*terms)[term];
            term += 1u;
        }
    }
    return sum;
}
#endif
#endif
