// The angle of (x, y) over pi, in [-1, 1]: the arctangent by Abramowitz and Stegun 4.4.49, within 2e-8. WGSL promises less.
fn turn_of(x: f32, y: f32) -> f32 {
    let least = min(abs(x), abs(y));
    let most = max(abs(x), abs(y));
    let t = select(least / most, 0.0, most == 0.0);
    let s = t * t;
    let tail = s * (0.0429096138 + s * (-0.0161657367 + s * 0.0028662257));
    let series = 1.0 + s * (-0.3333314528 + s * (0.1999355085 + s * (-0.1420889944 + s * (0.1065626393 + s * (-0.0752896400 + tail)))));
    let octant = t * series * INV_PI;
    let quarter = select(octant, 0.5 - octant, abs(y) > abs(x));
    let half = select(quarter, 1.0 - quarter, x < 0.0);
    return select(half, -half, y < 0.0);
}
