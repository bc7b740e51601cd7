// Start-up self-test of what the kernels rely on; `src/gpu/self_test.rs` knows the answers.

@group(0) @binding(0) var<storage, read_write> results: array<u32>;
// Trip counts come from a buffer, so that no compiler can work the loops out.
@group(0) @binding(1) var<storage, read> input: array<u32>;

@compute @workgroup_size(64)
fn self_test(@builtin(global_invocation_id) id: vec3<u32>) {
    let lane = id.x;
    let iterations = input[0];

    // A loop of 32,768 iterations, and the same number spread over a nest.
    var single = 0u;
    for (var i = 0u; i < iterations / 2u; i += 1u) {
        single += (i ^ lane) & 1u;
    }
    var nested = 0u;
    for (var i = 0u; i < iterations / 256u; i += 1u) {
        for (var j = 0u; j < 128u; j += 1u) {
            nested += 1u;
        }
    }

    // A private array used as a stack with a depth that differs by lane.
    var stack: array<vec2<u32>, 32>;
    var size = 0u;
    for (var i = 0u; i < lane % 32u; i += 1u) {
        stack[size] = vec2<u32>(i, i * lane);
        size += 1u;
    }
    var sum = 0u;
    while (size > 0u) {
        size -= 1u;
        sum += stack[size].x + stack[size].y;
    }

    // Random numbers, bit by bit.
    let random = random_pair_bits(pixel_key(input[1], input[2], lane, 7u, 3u), lane, lane & 63u, 63u);

    let at = lane * 6u;
    results[at] = single;
    results[at + 1u] = nested;
    results[at + 2u] = sum;
    results[at + 3u] = random.x;
    results[at + 4u] = random.y;
    // Not a number must be told by its bits.
    let bad = bitcast<f32>(input[3]) * f32(lane);
    results[at + 5u] = u32((bitcast<u32>(bad) & 0x7f800000u) == 0x7f800000u);
}
