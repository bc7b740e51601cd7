// How many workgroups the next bounce takes: for the paths that are still under way.

struct Step {
    bounce: u32,
    sample: u32,
}

@group(1) @binding(6) var<uniform> step: Step;
@group(1) @binding(13) var<storage, read> queue_lengths: array<u32>;
// Workgroups in x, y and z: a dimension takes at most 65,535.
@group(1) @binding(14) var<storage, read_write> launches: array<u32>;

@compute @workgroup_size(1)
fn launch() {
    let groups = (queue_lengths[step.bounce] + 63u) / 64u;
    let rows = max((groups + 65534u) / 65535u, 1u);
    launches[0] = (groups + rows - 1u) / rows;
    launches[1] = rows;
    launches[2] = 1u;
}
