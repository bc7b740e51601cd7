// How much of everything lies on a way through voxels: so that evaluation need not walk.

// Adds what `metres` in a voxel hold of each amount.
fn add_amounts(first: u32, voxel: u32, metres: f32, amounts: ptr<function, array<f32, MOST_TERMS>>) {
    let list = volumes[first + 6u];
    let kelvin = value_in(first + 3u, voxel);
    var at = list + 1u;
    var term = 0u;
    for (var n = 0u; n < volumes[list]; n += 1u) {
        let amount = metres * value_in(at, voxel);
        let scatters = volumes[at + 2u] != NONE;
        let absorbers = volumes[at + 3u];
        at += 4u;
        for (var m = 0u; m < absorbers; m += 1u) {
            let strength = bitcast<f32>(volumes[at]) * amount;
            let columns = volumes[at + 1u];
            let between = between_columns(at + 2u, columns, kelvin);
            if (between.low != between.high) {
                (*amounts)[term + between.low] += strength * (1.0 - between.share);
            }
            (*amounts)[term + between.high] += strength * between.share;
            term += columns;
            at += 2u + 2u * columns;
        }
        if (scatters) {
            (*amounts)[term] += amount;
            term += 1u;
        }
    }
}

// Those of a whole way, `start` and `to` in voxels.
fn amounts_along(first: u32, start: vec3<f32>, to: vec3<f32>, metres: f32) -> array<f32, MOST_TERMS> {
    var amounts = array<f32, MOST_TERMS>();
    let size = volume_size(first);
    var cells = cells_along(start, to, size);
    var done = 0.0;
    for (var n = 0u; n < most_cells(size); n += 1u) {
        let end = cell_end(cells);
        if (end > done) {
            add_amounts(first, voxel_of(cells), metres * (end - done), &amounts);
            done = end;
        }
        if (!next_cell(&cells, end)) {
            break;
        }
    }
    return amounts;
}

// Two of the amounts a record, with the spectra that they are of; `mode`: 0, or MODE_ON_F.
fn append_amounts(list: ptr<function, RecordList>, first: u32, amounts: ptr<function, array<f32, MOST_TERMS>>, mode: u32) {
    let kinds = volumes[first + 6u];
    var at = kinds + 1u;
    var term = 0u;
    var waits = false;
    var waiting = 0u;
    var waiting_amount = 0.0;
    for (var n = 0u; n < volumes[kinds]; n += 1u) {
        let scattering = volumes[at + 2u];
        let absorbers = volumes[at + 3u];
        at += 4u;
        for (var m = 0u; m <= absorbers; m += 1u) {
            // Absorbers, then what is scattered.
            let is_absorber = m < absorbers;
            let columns = select(select(1u, 0u, scattering == NONE), volumes[at + 1u], is_absorber);
            for (var c = 0u; c < columns; c += 1u) {
                let spectrum = select(scattering, volumes[at + 3u + 2u * c], is_absorber);
                let amount = (*amounts)[term];
                term += 1u;
                if (!(amount > 0.0)) {
                    continue;
                }
                if (waits) {
                    append_words(list, vec4<u32>(OP_AMOUNTS | mode, waiting | (spectrum << 16u), bitcast<u32>(waiting_amount), bitcast<u32>(amount)));
                } else {
                    waiting = spectrum;
                    waiting_amount = amount;
                }
                waits = !waits;
            }
            at += select(0u, 2u + 2u * columns, is_absorber);
        }
    }
    if (waits) {
        append_words(list, vec4<u32>(OP_AMOUNTS | mode, waiting | (waiting << 16u), bitcast<u32>(waiting_amount), 0u));
    }
}
