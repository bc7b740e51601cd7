// Tables of phase functions, as `device::parts::scattering` lays them out: the word of each; then of each its numbers of rows and columns,
// the angles in degrees, the columns; and for each technique its phase function and the share of directions up to each row.

fn phase_head(number: u32) -> u32 {
    return volumes[volumes[4] + number];
}

fn phase_number(at: u32) -> f32 {
    return bitcast<f32>(volumes[at]);
}

// The last of `count` ascending numbers from word `first` on that is not above `x`, but for the very last: where an interval begins.
fn last_below(first: u32, count: u32, x: f32) -> u32 {
    var low = 0u;
    var high = count - 1u;
    while (high - low > 1u) {
        let middle = (low + high) / 2u;
        if (x < phase_number(first + middle)) {
            high = middle;
        } else {
            low = middle;
        }
    }
    return low;
}

// The place of an angle among the rows of a table, by 1 - cos of it.
fn phase_place(number: u32, versine: f32) -> f32 {
    let head = phase_head(number);
    let degrees = 114.591559 * asin(min(sqrt(0.5 * versine), 1.0));
    let low = last_below(head + 2u, volumes[head], degrees);
    let a = phase_number(head + 2u + low);
    let b = phase_number(head + 3u + low);
    return f32(low) + clamp((degrees - a) / (b - a), 0.0, 1.0);
}

// At a place among the rows that begin at word `first`, of `rows`.
fn phase_row(first: u32, rows: u32, place: f32) -> f32 {
    let row = min(u32(place), rows - 2u);
    let a = phase_number(first + row);
    return a + (place - f32(row)) * (phase_number(first + row + 1u) - a);
}

// For a quad of channels whose places among the columns are `columns`.
fn phase_columns(number: u32, place: f32, columns: vec4<f32>) -> vec4<f32> {
    let head = phase_head(number);
    let rows = volumes[head];
    let last = volumes[head + 1u] - 1u;
    var value = vec4<f32>(0.0);
    for (var n = 0u; n < 4u; n += 1u) {
        let x = clamp(columns[n], 0.0, f32(last));
        let column = u32(x);
        let a = phase_row(head + 2u + rows * (1u + column), rows, place);
        let b = phase_row(head + 2u + rows * (1u + min(column + 1u, last)), rows, place);
        value[n] = a + (x - f32(column)) * (b - a);
    }
    return value;
}
