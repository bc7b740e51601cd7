// Radiance of pixels as sums over products, for cubes that are relit: what `Processor` (src/cube/weights/expand.rs) does on processors.

struct Task {
    pixels: u32,
    // Of this turn: values of a row.
    channels: u32,
    entries: u32,
    // Of weights: that of all samples, which makes means, and if there are more those of the groups that make standard errors.
    sets: u32,
    // What a sum of squares is divided by.
    divisor: f32,
}

@group(0) @binding(0) var<uniform> task: Task;
// Where each pixel's entries begin and end.
@group(0) @binding(1) var<storage, read> pixels: array<vec2<u32>>;
// Of each entry the product; [set][entry].
@group(0) @binding(2) var<storage, read> products: array<u32>;
@group(0) @binding(3) var<storage, read> weights: array<f32>;
// Epochs of each set.
@group(0) @binding(4) var<storage, read> epochs: array<f32>;
// [product][channel].
@group(0) @binding(5) var<storage, read> rows: array<f32>;
// [pixel][channel]; deviations only of several sets.
@group(0) @binding(6) var<storage, read_write> means: array<f32>;
@group(0) @binding(7) var<storage, read_write> deviations: array<f32>;

fn sum_of(part: u32, pixel: u32, channel: u32) -> f32 {
    var sum = 0.0;
    let entries = pixels[pixel];
    for (var i = entries.x; i < entries.y; i += 1u) {
        sum += weights[part * task.entries + i] * rows[products[i] * task.channels + channel];
    }
    return sum;
}

// A workgroup has 64 channels of a pixel, whose threads read a row side by side.
@compute @workgroup_size(64)
fn expand(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32) {
    let blocks = (task.channels + 63u) / 64u;
    let number = group.y * groups.x + group.x;
    let pixel = number / blocks;
    let channel = 64u * (number % blocks) + thread;
    if (pixel >= task.pixels || channel >= task.channels) {
        return;
    }
    let at = pixel * task.channels + channel;
    let mean = sum_of(0u, pixel, channel);
    means[at] = mean;
    if (task.sets > 1u) {
        var squares = 0.0;
        for (var part = 1u; part < task.sets; part += 1u) {
            let distance = sum_of(part, pixel, channel) - mean;
            squares += epochs[part] * distance * distance;
        }
        deviations[at] = sqrt(squares / task.divisor);
    }
}
