// An environment map: choosing a direction by it, and the density of that choice.
//
// Radiance is bilinear between texel centres, which are the corners of MAP_WIDTH x (MAP_HEIGHT + 1) cells; those of the first
// and the last row are half as high. A cell is chosen by the mean importance of its corners times its solid angle, and a place
// in it in proportion to their bilinear interpolation: wherever there is radiance, there is a density.

// Columns of the rotation to the map (9 numbers, 3 unused); upper ends of the rows' intervals; of the columns', row by row;
// importance of the texels.
@group(0) @binding(41) var<storage, read> map_table: array<f32>;

#constants MAP_ROWS
const MAP_COLUMNS: u32 = MAP_ROWS + MAP_HEIGHT + 1u;
const MAP_IMPORTANCE: u32 = MAP_COLUMNS + (MAP_HEIGHT + 1u) * MAP_WIDTH;

// A place in a cell: between columns `column` and `column` + 1, and rows `row` - 1 and `row` of texels.
struct MapPlace {
    column: u32,
    row: u32,
    fraction: vec2<f32>,
}

struct MapSample {
    direction: vec3<f32>,
    density: f32,
    place: MapPlace,
}

// Importance at the corners: upper left, upper right, lower left, lower right.
fn map_corners(column: u32, row: u32) -> vec4<f32> {
    let right = select(column + 1u, 0u, column + 1u == MAP_WIDTH);
    let upper = MAP_IMPORTANCE + (max(row, 1u) - 1u) * MAP_WIDTH;
    let lower = MAP_IMPORTANCE + min(row, MAP_HEIGHT - 1u) * MAP_WIDTH;
    return vec4<f32>(map_table[upper + column], map_table[upper + right], map_table[lower + column], map_table[lower + right]);
}

// The interval of [0, 1) that entry `i` of those from `first` on has.
fn map_interval(first: u32, i: u32) -> vec2<f32> {
    return vec2<f32>(select(map_table[first + max(i, 1u) - 1u], 0.0, i == 0u), map_table[first + i]);
}

fn map_search(first: u32, count: u32, u: f32) -> u32 {
    var low = 0u;
    var high = count - 1u;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (u < map_table[first + middle]) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

// Density over solid angle at a place where the sine of the polar angle is `sine`.
fn map_density_at(place: MapPlace, corners: vec4<f32>, sine: f32) -> f32 {
    let rows = map_interval(MAP_ROWS, place.row);
    let columns = map_interval(MAP_COLUMNS + place.row * MAP_WIDTH, place.column);
    let mean = 0.25 * (corners.x + corners.y + corners.z + corners.w);
    let across = mix(corners.xz, corners.yw, place.fraction.x);
    let here = mix(across.x, across.y, place.fraction.y);
    let cells = f32(MAP_WIDTH) * f32(MAP_HEIGHT) * select(1.0, 2.0, place.row == 0u || place.row == MAP_HEIGHT);
    let chance = (rows.y - rows.x) * (columns.y - columns.x);
    return select(0.0, chance * cells * here / (mean * 2.0 * PI * PI * max(sine, 1.0e-7)), mean > 0.0);
}

// x in [0, 1] with a density in proportion to a + x (b - a).
fn sample_linear(a: f32, b: f32, u: f32) -> f32 {
    let root = sqrt(max(0.0, a * a + u * (b * b - a * a)));
    return select(u, min(u * (a + b) / (a + root), 1.0), a + root > 0.0);
}

fn map_rotation(column: u32) -> vec3<f32> {
    return vec3<f32>(map_table[3u * column], map_table[3u * column + 1u], map_table[3u * column + 2u]);
}

fn sample_map(u: vec2<f32>) -> MapSample {
    var place: MapPlace;
    place.row = map_search(MAP_ROWS, MAP_HEIGHT + 1u, u.y);
    let rows = map_interval(MAP_ROWS, place.row);
    let first = MAP_COLUMNS + place.row * MAP_WIDTH;
    place.column = map_search(first, MAP_WIDTH, u.x);
    let columns = map_interval(first, place.column);
    let left = clamp((u - vec2<f32>(columns.x, rows.x)) / vec2<f32>(columns.y - columns.x, rows.y - rows.x), vec2<f32>(0.0), vec2<f32>(1.0));
    let corners = map_corners(place.column, place.row);
    var y = sample_linear(corners.x + corners.y, corners.z + corners.w, left.y);
    let across = mix(corners.xy, corners.zw, y);
    place.fraction.x = sample_linear(across.x, across.y, left.x);
    // The halves that the first and the last row have.
    y = select(y, 0.5 + 0.5 * y, place.row == 0u);
    place.fraction.y = select(y, 0.5 * y, place.row == MAP_HEIGHT);

    let polar = unit_circle(0.5 * ((f32(place.row) - 0.5 + place.fraction.y) / f32(MAP_HEIGHT)));
    let azimuth = unit_circle((f32(place.column) + 0.5 + place.fraction.x) / f32(MAP_WIDTH));
    let m = vec3<f32>(-polar.y * azimuth.y, polar.x, polar.y * azimuth.x);
    let direction = normalize(vec3<f32>(dot(map_rotation(0u), m), dot(map_rotation(1u), m), dot(map_rotation(2u), m)));
    return MapSample(direction, map_density_at(place, corners, polar.y), place);
}

// Angle of (x, y) from the x axis in turns, in [-1/2, 1/2]. WGSL promises 4096 ulp for its own; this polynomial (Moshier, Cephes,
// atanf) keeps 2.
fn turns(x: f32, y: f32) -> f32 {
    let large = max(abs(x), abs(y));
    let ratio = min(abs(x), abs(y)) / max(large, 1.0e-30);
    let beyond = ratio > 0.41421356;
    let z = select(ratio, (ratio - 1.0) / (ratio + 1.0), beyond);
    let z2 = z * z;
    let series = z + z * z2 * (-3.33329491e-1 + z2 * (1.99777106e-1 + z2 * (-1.38776856e-1 + z2 * 8.05374449e-2)));
    var turn = series * (0.5 * INV_PI) + select(0.0, 0.125, beyond);
    turn = select(turn, 0.25 - turn, abs(y) > abs(x));
    turn = select(turn, 0.5 - turn, x < 0.0);
    return select(turn, -turn, y < 0.0);
}

// Where `direction` meets the map, and the density with which it is chosen.
fn find_in_map(direction: vec3<f32>) -> MapSample {
    let m = map_rotation(0u) * direction.x + map_rotation(1u) * direction.y + map_rotation(2u) * direction.z;
    let sine = length(m.xz);
    let x = (0.5 + turns(-m.z, m.x)) * f32(MAP_WIDTH) - 0.5;
    let y = clamp(2.0 * turns(m.y, sine), 0.0, 1.0) * f32(MAP_HEIGHT) + 0.5;
    var place: MapPlace;
    let column = i32(floor(x));
    place.column = u32(select(min(column, i32(MAP_WIDTH) - 1), i32(MAP_WIDTH) - 1, column < 0));
    place.row = min(u32(y), MAP_HEIGHT);
    place.fraction = clamp(vec2<f32>(x - floor(x), y - f32(place.row)), vec2<f32>(0.0), vec2<f32>(1.0));
    return MapSample(direction, map_density_at(place, map_corners(place.column, place.row), sine), place);
}
