// How many workgroups of 64 the next bounce takes, for the paths that are still under way: what `grid` (src/gpu/pass.rs) says on the host.

@group(1) @binding(6) var<uniform> step: Step;
@group(1) @binding(13) var<storage, read> queue_lengths: array<u32>;
// In x, y and z.
@group(1) @binding(14) var<storage, read_write> launches: array<u32>;

@compute @workgroup_size(1)
fn launch() {
    let groups = (queue_lengths[step.bounce] + 63u) / 64u;
    let rows = max((groups + 65534u) / 65535u, 1u);
    launches[0] = (groups + rows - 1u) / rows;
    launches[1] = rows;
    launches[2] = 1u;
}
