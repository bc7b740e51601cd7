// Roulette on evaluation: between generating paths and evaluating them. What a path's scattered light brings is tried in a few
// channels that represent all; it is evaluated with the probability p = min(1, s f), f the most that it brings to one of them over
// the mean of that channel in the picture, and then counts for 1/p in every channel (docs/METHOD.md).

@group(1) @binding(1) var<storage, read> units: array<vec4<u32>>;
// Of each representative quad of channels: s over the channel's mean, 0 for channels that do not count.
@group(1) @binding(16) var<storage, read> importances: array<vec4<f32>>;

#constants MOST_WEIGHT

@compute @workgroup_size(64)
fn thin_paths(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let path = id.x + id.y * groups.x * 64u;
    if (path >= wave.path_count) {
        return;
    }
    let head = heads[path];
    let used = head.y & 0xffffu;
    let seen_records = min(head.z & 0xffffu, used);
    var kept = 1.0;
    if (used > seen_records) {
        // At the first of its wavelengths.
        let s = spectral_sample(head.x);
#if WAVELENGTHS
        let turn = 0u;
#endif
        let first_record = path * frame.max_records;
#lines REPRESENTATIVE_QUADS
#include common/hold_spectra.wgsl
#include common/held_spectra.wgsl
#repeat VECTORS v
        var throughput_$v = first_throughput(quad_$v, s);
        var radiance_$v = vec4<f32>(0.0);
#end
#include common/records.wgsl
        var brought = vec4<f32>(0.0);
#repeat VECTORS v
        brought = max(brought, abs(radiance_$v) * importances[$vu]);
#end
        let slot = wave.pixel_begin + path / wave.samples;
        let in_tile = slot % wave.tile_pixels;
        let pixel = units[slot / wave.tile_pixels].xy + vec2<u32>(in_tile % wave.tile_width, in_tile / wave.tile_width);
        let key = pixel_key(frame.seed_low, frame.seed_high, pixel.x, pixel.y, wave.epoch);
        // The second number of the pair whose first is the wavelength's: one of the sampler's own dimensions.
        let u = random_pair(key, DIMENSION_WAVELENGTH, wave.sample_begin + path % wave.samples, wave.epoch_mask).y;
        let p = clamp(max(max(brought.x, brought.y), max(brought.z, brought.w)), 1.0 / f32(MOST_WEIGHT), 1.0);
        kept = select(0.0, 1.0 / p, u < p);
    }
    heads[path].z = seen_records | (wave.sequence << 16u);
    heads[path].w = bitcast<u32>(kept);
}
