// What the operations of records (common/record.wgsl) mean, for a quad of channels.

#if OP_FRESNEL
// Reflectance of a boundary at cosines `c`, indices `eta` beyond over before (`spectral::hemisphere::fresnel`: no differences of nearly equal
// numbers).
fn fresnel_dielectric(c: vec4<f32>, eta: vec4<f32>) -> vec4<f32> {
    let excess = (eta - 1.0) * (eta + 1.0);
    let square = excess + c * c;
    let t = sqrt(max(square, vec4<f32>(0.0)));
    let s = excess / max((c + t) * (c + t), vec4<f32>(1.0e-30));
    let e = eta * eta * c + t;
    let p = excess * ((excess + 2.0) * c * c - 1.0) / max(e * e, vec4<f32>(1.0e-30));
    let partial = 0.5 * (s * s + p * p);
    return select(min(select(partial, vec4<f32>(1.0), square <= vec4<f32>(0.0)), vec4<f32>(1.0)), vec4<f32>(0.0), excess == vec4<f32>(0.0));
}
#endif

#if OP_CONDUCTOR
// (F, 1 - F) of a metal at cosine `c` (Born and Wolf, section 14.2), neither from the other.
fn fresnel_conductor(c: f32, eta: vec4<f32>, k: vec4<f32>) -> array<vec4<f32>, 2> {
    let c2 = c * c;
    let s2 = max(0.0, (1.0 - c) * (1.0 + c));
    let difference = (eta - k) * (eta + k) - s2;
    let product = 2.0 * eta * k;
    let modulus = sqrt(difference * difference + product * product);
    let sum = modulus + abs(difference);
    let small = 0.5 * product * product / max(sum, vec4<f32>(1.0e-30));
    let a = sqrt(select(small, 0.5 * sum, difference >= vec4<f32>(0.0)));
    let ac = 2.0 * a * c;
    let lost_s = 2.0 * ac / max(modulus + c2 + ac, vec4<f32>(1.0e-30));
    let s = max(modulus + c2 - ac, vec4<f32>(0.0)) / max(modulus + c2 + ac, vec4<f32>(1.0e-30));
    let even = c2 * modulus + s2 * s2;
    let odd = ac * s2;
    // At normal incidence from a vacuum both are 0, and p is s.
    let q = select((even - odd) / (even + odd), vec4<f32>(1.0), even + odd <= vec4<f32>(0.0));
    let lost_q = select(2.0 * odd / (even + odd), vec4<f32>(0.0), even + odd <= vec4<f32>(0.0));
    return array<vec4<f32>, 2>(0.5 * s * (1.0 + q), 0.5 * (lost_s + lost_s + s * lost_q));
}
#endif

#if OP_ETA_TABLE
// Table `number` (in units of 128 values) over ln index and cosine position: a head of first ln index, steps per ln index, number
// of indices; then [index][reflected before, loss before, reflected behind, loss behind][128].
fn eta_table(number: u32, row: u32, at: f32, eta: vec4<f32>) -> vec4<f32> {
    let head = 128u * number;
    let last = u32(tables[head + 2u]) - 1u;
    let x = clamp((log(eta) - tables[head]) * tables[head + 1u], vec4<f32>(0.0), vec4<f32>(f32(last)));
    let node = min(u32(at), 126u);
    let place = at - f32(node);
    var value = vec4<f32>(0.0);
    for (var n = 0u; n < 4u; n += 1u) {
        let column = u32(x[n]);
        let first = head + 128u * (1u + 4u * column + row) + node;
        let a = tables[first] + place * (tables[first + 1u] - tables[first]);
        let second = head + 128u * (1u + 4u * min(column + 1u, last) + row) + node;
        let b = tables[second] + place * (tables[second + 1u] - tables[second]);
        value[n] = a + (x[n] - f32(column)) * (b - a);
    }
    return value;
}
#endif

#if OP_ROUGH_TRANSMIT
// The indices nearest to 1 make no half vector in f32.
fn bending_index(eta: vec4<f32>) -> vec4<f32> {
    let away = eta - 1.0;
    return select(eta, 1.0 + select(vec4<f32>(-1.0e-4), vec4<f32>(1.0e-4), away >= vec4<f32>(0.0)), abs(away) < vec4<f32>(1.0e-4));
}

fn rough_transmit(eta_in: vec4<f32>, alpha: f32, cos_o: f32, i: vec3<f32>) -> vec4<f32> {
    let eta = bending_index(eta_in);
    let o = vec3<f32>(sqrt(max(0.0, (1.0 - cos_o) * (1.0 + cos_o))), 0.0, cos_o);
    var hx = -(o.x + eta * i.x);
    var hy = -(eta * i.y);
    var hz = -(o.z + eta * i.z);
    let turn = select(vec4<f32>(1.0), vec4<f32>(-1.0), hz < vec4<f32>(0.0)) * inverseSqrt(max(hx * hx + hy * hy + hz * hz, vec4<f32>(1.0e-30)));
    hx *= turn;
    hy *= turn;
    hz *= turn;
    let o_h = o.x * hx + o.z * hz;
    let i_h = i.x * hx + i.y * hy + i.z * hz;
    let sum = o_h + eta * i_h;
    let slope2 = (hx * hx + hy * hy) / (alpha * alpha) + hz * hz;
    let distribution = 1.0 / (PI * alpha * alpha * slope2 * slope2);
    let geometric = distribution * o_h * -i_h / max(sum * sum, vec4<f32>(1.0e-30));
    let passes = 1.0 - fresnel_dielectric(clamp(o_h, vec4<f32>(0.0), vec4<f32>(1.0)), eta_in);
    return select(vec4<f32>(0.0), geometric * passes, (o_h > vec4<f32>(0.0)) & (i_h < vec4<f32>(0.0)));
}
#endif

#if COLOURS
@group(0) @binding(51) var<storage, read> texels: array<f32>;

fn smooth_spectrum(at: u32, t: vec4<f32>) -> vec4<f32> {
    let x = (texels[at] * t + texels[at + 1u]) * t + texels[at + 2u];
    // S(x) = 1/2 + x / (2 sqrt(1 + x^2)), without cancellation where it is small.
    let root = sqrt(1.0 + x * x);
    let tail = 0.5 / (root * (root + abs(x)));
    return select(1.0 - tail, tail, x < vec4<f32>(0.0));
}
#endif

// The value of an instruction for the channels of `quad`; `raw` is the record after it.
fn operation_value(record: vec4<u32>, raw: vec4<f32>, quad: u32, s: SpectralSample) -> vec4<f32> {
    let operation = record.x & 0x3fu;
    if (operation == OP_ONE) {
        return vec4<f32>(1.0);
    }
#if OP_ONLY
    if (operation == OP_ONLY) {
        return select(vec4<f32>(0.0), vec4<f32>(1.0), vec4<u32>(4u * quad, 4u * quad + 1u, 4u * quad + 2u, 4u * quad + 3u) == vec4<u32>(record.y));
    }
#endif
#if COLOURS
    if (operation == OP_SMOOTH) {
        return smooth_spectrum(record.y, spectrum_value(VISIBLE_PLACE, quad, s));
    }
#endif
#if OP_MAP
    if (operation == OP_MAP) {
        return map_value(record.y, record.w, spectrum_value(MAP_AXIS, quad, s));
    }
#endif
#if RADIATORS
    if (operation == OP_PLANCK) {
        return planck(spectrum_value(WAVELENGTH, quad, s), bitcast<f32>(record.w));
    }
#endif
    let a = spectrum_value(record.y & 0xffffu, quad, s);
    let parameter = bitcast<f32>(record.w);
    // Channels that only fill up the last quad have index 0.
    let index = max(a, vec4<f32>(1.0e-6));
    switch (operation) {
#if MEDIA
        case OP_EXTINCTION: {
            return exp(-parameter * a);
        }
#endif
#if SCATTERS
        case OP_HENYEY_GREENSTEIN: {
            let g = spectrum_value(record.y >> 16u, quad, s);
            let x = (1.0 - g) * (1.0 - g) + 2.0 * parameter * g;
            return a * (1.0 - g) * (1.0 + g) / (x * sqrt(x));
        }
#endif
#if PHASE_TABLES
        case OP_PHASE_TABLE: {
            return phase_columns(record.y >> 16u, parameter, a);
        }
#endif
#if OP_FRESNEL
        case OP_FRESNEL, OP_TRANSMIT: {
            let eta = select(index, 1.0 / index, (record.x & MODE_BEHIND) != 0u);
            let reflected = fresnel_dielectric(vec4<f32>(parameter), eta);
            if (operation == OP_FRESNEL) {
                return reflected;
            }
            return (1.0 - reflected) * select(vec4<f32>(1.0), 1.0 / (eta * eta), (record.x & MODE_SQUARE) != 0u);
        }
#endif
#if OP_CONDUCTOR
        case OP_CONDUCTOR, OP_EMITTANCE: {
            let f = fresnel_conductor(parameter, a, spectrum_value(record.y >> 16u, quad, s));
            return select(f[1], f[0], operation == OP_CONDUCTOR);
        }
#endif
#if OP_ETA_TABLE
        case OP_ETA_TABLE: {
            let enters = (record.x & MODE_SQUARE) != 0u;
            let row = select(1u, 0u, enters) + select(0u, 2u, (record.x & MODE_BEHIND) != 0u);
            let value = eta_table(record.y >> 16u, row, parameter, index);
            return select(max(value, vec4<f32>(0.0)), 1.0 - value, enters);
        }
#endif
#if OP_ROUGH_TRANSMIT
        case OP_ROUGH_TRANSMIT: {
            let eta = select(index, 1.0 / index, (record.x & MODE_BEHIND) != 0u);
            return rough_transmit(eta, parameter, raw.x, raw.yzw);
        }
#endif
        default: {
            return a;
        }
    }
}
