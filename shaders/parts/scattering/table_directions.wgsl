// Directions by tables of phase functions.

// The first word of what technique `t` has of a table.
fn technique_rows(number: u32, t: u32) -> u32 {
    let head = phase_head(number);
    let rows = volumes[head];
    return head + 2u + rows * (1u + volumes[head + 1u] + 2u * t);
}

fn table_density(number: u32, t: u32, versine: f32) -> f32 {
    return phase_row(technique_rows(number, t), volumes[phase_head(number)], phase_place(number, versine));
}

// 1 - cos of an angle, with the density that technique `t` has: among the rows by their shares; between two rows phase function and sine
// are linear, so that their product is a sum of three polynomials, each of which is inverted.
fn sample_table(number: u32, t: u32, u_in: f32) -> f32 {
    let head = phase_head(number);
    let rows = volumes[head];
    let values = technique_rows(number, t);
    let shares = values + rows;
    let low = last_below(shares, rows, u_in);
    let high = low + 1u;
    let below = phase_number(shares + low);
    let share = phase_number(shares + high) - below;
    var u = clamp((u_in - below) / max(share, 1.0e-30), 0.0, 0.99999994);
    let from_angle = 0.0174532925 * phase_number(head + 2u + low);
    let to_angle = 0.0174532925 * phase_number(head + 2u + high);
    let s = max(sin(from_angle), 0.0);
    let e = max(sin(to_angle), 0.0);
    let p = phase_number(values + low);
    let q = phase_number(values + high);
    let first = p * s;
    let middle = 0.5 * (p * e + q * s);
    let last = q * e;
    let all = max(first + middle + last, 1.0e-30);
    var x = 0.0;
    if (u * all < first) {
        u = u * all / first;
        x = 1.0 - pow(1.0 - u, 1.0 / 3.0);
    } else if (u * all < first + middle) {
        u = clamp((u * all - first) / middle, 0.0, 1.0);
        x = 0.5 - sin(asin(clamp(1.0 - 2.0 * u, -1.0, 1.0)) / 3.0);
    } else {
        u = clamp((u * all - first - middle) / max(last, 1.0e-30), 0.0, 1.0);
        x = pow(u, 1.0 / 3.0);
    }
    let half = sin(0.5 * (from_angle + x * (to_angle - from_angle)));
    return 2.0 * half * half;
}
