// Voxels along a straight way (Amanatides and Woo 1987), and what is in them.

struct Cells {
    size: vec3<i32>,
    cell: vec3<i32>,
    ahead: vec3<i32>,
    // Where the next plane along each axis is crossed, as a fraction of the way; and how far apart planes are.
    next: vec3<f32>,
    pace: vec3<f32>,
}

// `start` and `to` in voxels.
fn cells_along(start: vec3<f32>, to: vec3<f32>, size: vec3<i32>) -> Cells {
    let way = to - start;
    var cells: Cells;
    cells.size = size;
    cells.ahead = vec3<i32>(select(vec3<f32>(-1.0), vec3<f32>(1.0), way > vec3<f32>(0.0)));
    cells.cell = clamp(vec3<i32>(floor(start)), vec3<i32>(0), size - 1);
    let resting = abs(way) < vec3<f32>(1.0e-12);
    let inverse = 1.0 / select(way, vec3<f32>(1.0), resting);
    cells.next = select((vec3<f32>(cells.cell + max(cells.ahead, vec3<i32>(0))) - start) * inverse, vec3<f32>(2.0), resting);
    cells.pace = select(abs(inverse), vec3<f32>(0.0), resting);
    return cells;
}

// The end of the cell, as a fraction of the way.
fn cell_end(cells: Cells) -> f32 {
    return min(min(cells.next.x, min(cells.next.y, cells.next.z)), 1.0);
}

fn voxel_of(cells: Cells) -> u32 {
    return u32(cells.cell.x + cells.size.x * (cells.cell.y + cells.size.y * cells.cell.z));
}

// The most cells of one way.
fn most_cells(size: vec3<i32>) -> u32 {
    return u32(size.x + size.y + size.z) + 3u;
}

// Goes on from a cell that ends at `end`; false at the end of the way. What rounding leaves beyond the last cell is nothing.
fn next_cell(cells: ptr<function, Cells>, end: f32) -> bool {
    if (end >= 1.0) {
        return false;
    }
    let next = (*cells).next;
    let axis = select(select(2u, 1u, next.y <= next.z), 0u, next.x <= next.y && next.x <= next.z);
    (*cells).cell[axis] += (*cells).ahead[axis];
    (*cells).next[axis] += (*cells).pace[axis];
    return (*cells).cell[axis] >= 0 && (*cells).cell[axis] < (*cells).size[axis];
}

fn volume_size(first: u32) -> vec3<i32> {
    return vec3<i32>(vec3<u32>(volumes[first + 7u], volumes[first + 8u], volumes[first + 9u]));
}

// A number that has voxels, whose first word `voxels` is, or NONE; then it is `value` everywhere.
struct Field {
    voxels: u32,
    value: f32,
}

// As words `at` and the next say.
fn field_at(at: u32) -> Field {
    return Field(volumes[at], bitcast<f32>(volumes[at + 1u]));
}

fn field_value(field: Field, voxel: u32) -> f32 {
    var value = field.value;
    if (field.voxels != NONE) {
        value = bitcast<f32>(volumes[field.voxels + voxel]);
    }
    return value;
}

fn value_in(at: u32, voxel: u32) -> f32 {
    return field_value(field_at(at), voxel);
}

// Where a temperature lies among the columns of an absorber from word `column` on: the lower, the upper, and the share of the upper.
struct Between {
    low: u32,
    high: u32,
    share: f32,
}

// How many columns are of lower temperatures.
fn columns_below(column: u32, columns: u32, kelvin: f32) -> u32 {
    // Without a loop: an invocation may have 32,768 iterations in all, and walks through cells take them.
    var below = 0u;
#repeat MOST_COLUMNS c
    below += select(0u, 1u, bitcast<f32>(volumes[column + 2u * min($cu, columns - 1u)]) < kelvin && $cu < columns);
#end
    return below;
}

fn between_columns(column: u32, columns: u32, kelvin: f32) -> Between {
    let below = columns_below(column, columns, kelvin);
    let high = min(below, columns - 1u);
    let low = max(below, 1u) - 1u;
    let a = bitcast<f32>(volumes[column + 2u * low]);
    let b = bitcast<f32>(volumes[column + 2u * high]);
    return Between(low, high, select(1.0, (kelvin - a) / (b - a), low != high));
}
