// Radiance of pixels as sums over products, for cubes that are relit: what `Weights::expanded` and `Weights::standard_errors`
// (src/cube/weights/expand.rs) do on processors.

struct Task {
    pixels: u32,
    // Of this turn: values of a row.
    channels: u32,
    entries: u32,
    // One set of weights makes means; several, that of all samples first, their standard error.
    sets: u32,
    // What a sum of squares is divided by.
    divisor: f32,
    // Workgroups of a row of the dispatch.
    across: u32,
}

@group(0) @binding(0) var<uniform> task: Task;
// Where each pixel's entries begin, and the end of the last one's.
@group(0) @binding(1) var<storage, read> starts: array<u32>;
// Of each entry the product; [set][entry].
@group(0) @binding(2) var<storage, read> products: array<u32>;
@group(0) @binding(3) var<storage, read> weights: array<f32>;
// Epochs of each set.
@group(0) @binding(4) var<storage, read> epochs: array<f32>;
// [product][channel].
@group(0) @binding(5) var<storage, read> rows: array<f32>;
// [pixel][channel].
@group(0) @binding(6) var<storage, read_write> sums: array<f32>;

fn sum_of(part: u32, pixel: u32, channel: u32) -> f32 {
    var sum = 0.0;
    for (var i = starts[pixel]; i < starts[pixel + 1u]; i += 1u) {
        sum += weights[part * task.entries + i] * rows[products[i] * task.channels + channel];
    }
    return sum;
}

// A workgroup has 64 channels of a pixel, whose threads read a row side by side.
@compute @workgroup_size(64)
fn expand(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let blocks = (task.channels + 63u) / 64u;
    let number = group.y * task.across + group.x;
    let pixel = number / blocks;
    let channel = 64u * (number % blocks) + thread;
    if (pixel >= task.pixels || channel >= task.channels) {
        return;
    }
    var value = sum_of(0u, pixel, channel);
    if (task.sets > 1u) {
        var squares = 0.0;
        for (var part = 1u; part < task.sets; part += 1u) {
            let distance = sum_of(part, pixel, channel) - value;
            squares += epochs[part] * distance * distance;
        }
        value = sqrt(squares / task.divisor);
    }
    sums[pixel * task.channels + channel] = value;
}
