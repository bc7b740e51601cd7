// Generate, first step: the camera ray, the path's wavelength coordinate, an empty list of records.

@group(1) @binding(0) var<uniform> wave: Wave;
@group(1) @binding(1) var<storage, read> units: array<vec4<u32>>;
@group(1) @binding(2) var<storage, read_write> states: array<vec4<u32>>;
@group(1) @binding(3) var<storage, read_write> heads: array<vec$HEAD_WORDS<u32>>;
#if CAMERA_PUSHBROOM
// Of each line of a scanner: where it is, and forward, right and nose.
@group(0) @binding(1) var<storage, read> lines: array<vec4<f32>>;
#endif
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

#if DISTORTION
// Where a pinhole would have what the lens shows at `seen`, y down: Newton's method on Brown's equations, as `scene::Distortion` has them.
fn before_lens(seen: vec2<f32>) -> vec2<f32> {
    let k = vec3<f32>(bitcast<f32>(LENS_K1), bitcast<f32>(LENS_K2), bitcast<f32>(LENS_K3));
    let p = vec2<f32>(bitcast<f32>(LENS_P1), bitcast<f32>(LENS_P2));
    var at = seen;
    for (var i = 0; i < 12; i++) {
        let r2 = dot(at, at);
        let radial = 1.0 + r2 * (k.x + r2 * (k.y + r2 * k.z));
        let slope = 2.0 * (k.x + r2 * (2.0 * k.y + r2 * 3.0 * k.z));
        let off = at * radial + 2.0 * at.x * at.y * p + p.yx * (r2 + 2.0 * at * at) - seen;
        let across = at.x * at.y * slope + 2.0 * (p.x * at.x + p.y * at.y);
        let along = radial + at * at * slope + vec2<f32>(2.0 * p.x * at.y + 6.0 * p.y * at.x, 6.0 * p.x * at.y + 2.0 * p.y * at.x);
        let determinant = along.x * along.y - across * across;
        at -= vec2<f32>(along.y * off.x - across * off.y, along.x * off.y - across * off.x) / determinant;
    }
    return at;
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
#if CAMERA_PUSHBROOM
    // Where the scanner is at this moment of the line's exposure: between two lines, or beyond the first or last.
    let moment = in_pixel.y - 0.5;
    let row = i32(pixel.y);
    let first = clamp(row + i32(floor(moment)), 0, i32(LINES) - 2);
    let share = moment + f32(row - first);
    let at = 4u * u32(first);
    let origin = mix(lines[at].xyz, lines[at + 4u].xyz, share);
    let forward = mix(lines[at + 1u].xyz, lines[at + 5u].xyz, share);
    let right = mix(lines[at + 2u].xyz, lines[at + 6u].xyz, share);
    let nose = mix(lines[at + 3u].xyz, lines[at + 7u].xyz, share);
    let along = 2.0 * random_pair(key, DIMENSION_LENS, index, wave.epoch_mask).x - 1.0;
    let direction = normalize(forward + screen.x * right + along * frame.half_size.y * nose);
#else
#if CAMERA_LATLONG
    // Longitude and latitude in turns; whole ones more make them positive.
    let longitude = unit_circle(screen.x + 1.0);
    let latitude = unit_circle(screen.y + 1.0);
    let origin = frame.camera_position;
    let level = longitude.x * frame.camera_forward + longitude.y * frame.camera_right;
    let direction = normalize(latitude.x * level + latitude.y * frame.camera_up);
#else
#if DISTORTION
    let pinhole = before_lens(screen * vec2<f32>(1.0, -1.0)) * vec2<f32>(1.0, -1.0);
    let across = pinhole.x * frame.camera_right + pinhole.y * frame.camera_up;
#else
    let across = screen.x * frame.camera_right + screen.y * frame.camera_up;
#endif

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
