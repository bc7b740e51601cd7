// Generate, first step: the camera ray, the path's wavelength coordinate, an empty list of records.

@group(1) @binding(0) var<uniform> wave: Wave;
@group(1) @binding(1) var<storage, read> units: array<vec4<u32>>;
@group(1) @binding(2) var<storage, read_write> states: array<vec4<u32>>;
@group(1) @binding(3) var<storage, read_write> heads: array<vec$HEAD_WORDS<u32>>;
#if SCALED
@group(1) @binding(7) var<storage, read_write> throughputs: array<f32>;
#endif

#if GAUSSIAN
// Inverse error function (Giles, "Approximating the erfinv function", GPU Computing Gems 2, 2011), |x| <= 0.99994.
fn inverse_erf(x: f32) -> f32 {
    let w = -log((1.0 - x) * (1.0 + x));
    if (w < 5.0) {
        let v = w - 2.5;
        return x * (1.50140941 + v * (0.246640727 + v * (-0.00417768164 + v * (-0.00125372503 + v * (0.00021858087
            + v * (-4.39150654e-06 + v * (-3.5233877e-06 + v * (3.43273939e-07 + v * 2.81022636e-08))))))));
    }
    let v = sqrt(w) - 3.0;
    return x * (2.83297682 + v * (1.00167406 + v * (0.00943887047 + v * (-0.0076224613 + v * (0.00573950773
        + v * (-0.00367342844 + v * (0.00134934322 + v * (0.000100950558 + v * -0.000200214257))))))));
}

// Offset from the pixel's centre: a normal distribution of sigma 0.5 px cut at 2 px, by inversion.
fn gaussian_offset(u: f32) -> f32 {
    // erf(2 / (0.5 sqrt 2)) = 0.99993666.
    return 0.70710678 * inverse_erf((2.0 * u - 1.0 + 5.9604645e-8) * 0.99993666);
}
#endif

@compute @workgroup_size(64)
fn generate_camera(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let path = id.x + id.y * groups.x * 64u;
    if (path >= wave.path_count) {
        return;
    }

    // Which pixel and sample. Slots of an edge tile that lie outside the image end at once.
    let slot = wave.pixel_begin + path / wave.samples;
    let index = wave.sample_begin + path % wave.samples;
    let unit = units[slot / wave.tile_pixels];
    let in_tile = slot % wave.tile_pixels;
    let pixel = unit.xy + vec2<u32>(in_tile % wave.tile_width, in_tile / wave.tile_width);
    if (any(pixel >= unit.zw)) {
#if THINNED
        heads[path] = vec4<u32>(0u, wave.sequence << 16u, 0u, 0u);
#else
        heads[path] = vec2<u32>(0u, wave.sequence << 16u);
#endif
#if GENERAL
        states[STATE_WORDS * path + 1u].w = ENDED;
#else
        states[2u * path + 1u].w = ENDED;
#endif
        return;
    }
    let key = pixel_key(frame.seed_low, frame.seed_high, pixel.x, pixel.y, wave.epoch);

    // Where on the film: the screen runs over [-1, 1].
    let u = random_pair(key, DIMENSION_FILM, index, wave.epoch_mask);
#if GAUSSIAN
    let in_pixel = vec2<f32>(0.5 + gaussian_offset(u.x), 0.5 + gaussian_offset(u.y));
#else
    let in_pixel = u;
#endif
    let from_centre = vec2<f32>(2 * vec2<i32>(pixel) - vec2<i32>(frame.film_size));
    let screen = (from_centre + 2.0 * in_pixel) / frame.film_size * vec2<f32>(1.0, -1.0) * frame.half_size;
    let across = screen.x * frame.camera_right + screen.y * frame.camera_up;

#if CAMERA_ORTHOGRAPHIC
    let origin = frame.camera_position + across;
    let direction = frame.camera_forward;
#else
#if CAMERA_THIN_LENS
    let on_lens = frame.aperture_radius * concentric_disk(random_pair(key, DIMENSION_LENS, index, wave.epoch_mask));
    let lens = on_lens.x * frame.camera_right + on_lens.y * frame.camera_up;
    let origin = frame.camera_position + lens;
    let direction = normalize(frame.focus_distance * (frame.camera_forward + across) - lens);
#else
    let origin = frame.camera_position;
    let direction = normalize(frame.camera_forward + across);
#endif
#endif

#if WAVELENGTH_BITS
    // Where all of the path's wavelengths stand in their parts of the channel, and by the last bits, which are in no order, in which
    // part its own is: so those of all samples together are as evenly spread as so many samples' would be.
    let drawn = random_pair_bits(key, DIMENSION_WAVELENGTH, index, wave.epoch_mask).x;
    let mu = (drawn >> $WAVELENGTH_BITSu) | (drawn << (32u - $WAVELENGTH_BITSu));
#else
    let mu = random_pair_bits(key, DIMENSION_WAVELENGTH, index, wave.epoch_mask).x;
#endif
#if THINNED
    heads[path] = vec4<u32>(mu, 0u, 0u, 0u);
#else
    heads[path] = vec2<u32>(mu, 0u);
#endif
#if GENERAL
    states[STATE_WORDS * path] = bitcast<vec4<u32>>(vec4<f32>(origin, -1.0));
    states[STATE_WORDS * path + 1u] = vec4<u32>(bitcast<vec3<u32>>(direction), 0u);
#if DISPERSION
    states[STATE_WORDS * path + 2u] = vec4<u32>(NONE, 0u, 0u, 0u);
#endif
#else
    states[2u * path] = bitcast<vec4<u32>>(vec4<f32>(origin, 0.0));
    states[2u * path + 1u] = vec4<u32>(bitcast<vec3<u32>>(direction), 0u);
#endif
#if SCALED
    throughputs[path] = 1.0;
#endif
}
