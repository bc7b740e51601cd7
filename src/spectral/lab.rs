//! CIELAB, and how much two colours differ.

/// L*, a* and b*.
pub type Lab = [f64; 3];

/// L*, a*, b* of tristimulus values `xyz` where `white` has L* = 100 and a* = b* = 0 (CIE 015:2018, 8.2.1.1).
pub fn lab(xyz: [f64; 3], white: [f64; 3]) -> Lab {
    // (6/29)³, below which it goes on as a line.
    const BEND: f64 = 216.0 / 24389.0;
    let f = |t: f64| if t > BEND { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 };
    let [x, y, z] = std::array::from_fn(|i| f(xyz[i] / white[i]));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The colour difference ΔE 2000 (CIEDE2000, CIE 015:2018, 8.3.1) with weights of 1, in the form of G. Sharma, W. Wu and E. N. Dalal, *The
/// CIEDE2000 color-difference formula*, Color Research and Application 30 (2005), 21-30.
pub fn delta_e_2000(a: Lab, b: Lab) -> f64 {
    const FAR: f64 = 6_103_515_625.0; // 25⁷
    let chroma = |lab: Lab| lab[1].hypot(lab[2]);
    let share = |chroma: f64| (chroma.powi(7) / (chroma.powi(7) + FAR)).sqrt();
    let stretch = 1.5 - 0.5 * share(0.5 * (chroma(a) + chroma(b)));
    // a* stretched where chroma is small; chroma, and hue in degrees from 0 to 360, 0 where there is none.
    let polar = |lab: Lab| {
        let (x, y) = (stretch * lab[1], lab[2]);
        let hue = if x == 0.0 && y == 0.0 { 0.0 } else { y.atan2(x).to_degrees().rem_euclid(360.0) };
        (x.hypot(y), hue)
    };
    let ((chroma_a, hue_a), (chroma_b, hue_b)) = (polar(a), polar(b));
    let is_grey = chroma_a * chroma_b == 0.0;
    let turn = match hue_b - hue_a {
        _ if is_grey => 0.0,
        turn if turn > 180.0 => turn - 360.0,
        turn if turn < -180.0 => turn + 360.0,
        turn => turn,
    };
    let lightness_change = b[0] - a[0];
    let chroma_change = chroma_b - chroma_a;
    let hue_change = 2.0 * (chroma_a * chroma_b).sqrt() * (0.5 * turn).to_radians().sin();

    let lightness = 0.5 * (a[0] + b[0]);
    let mean_chroma = 0.5 * (chroma_a + chroma_b);
    let hue = match hue_a + hue_b {
        sum if is_grey => sum,
        sum if (hue_a - hue_b).abs() <= 180.0 => 0.5 * sum,
        sum if sum < 360.0 => 0.5 * (sum + 360.0),
        sum => 0.5 * (sum - 360.0),
    };
    let cos = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cos(hue - 30.0) + 0.24 * cos(2.0 * hue) + 0.32 * cos(3.0 * hue + 6.0)
        - 0.20 * cos(4.0 * hue - 63.0);
    let blue = 30.0 * (-((hue - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * share(mean_chroma) * (2.0 * blue).to_radians().sin();
    let middle = (lightness - 50.0).powi(2);
    let of_lightness = lightness_change / (1.0 + 0.015 * middle / (20.0 + middle).sqrt());
    let of_chroma = chroma_change / (1.0 + 0.045 * mean_chroma);
    let of_hue = hue_change / (1.0 + 0.015 * mean_chroma * t);
    let square = of_lightness * of_lightness + of_chroma * of_chroma + of_hue * of_hue + rotation * of_chroma * of_hue;
    // The last term may be negative, the sum only by rounding.
    square.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 1 of Sharma, Wu and Dalal (2005): L*, a*, b* of two colours, and ΔE to four digits.
    const PAIRS: [[f64; 7]; 34] = [
        [50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425],
        [50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615],
        [50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412],
        [50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669],
        [50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461],
        [50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065],
        [50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492],
        [50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977],
        [50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030],
        [50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ];

    #[test]
    fn differences_are_those_that_were_published() {
        for [l1, a1, b1, l2, a2, b2, want] in PAIRS {
            let (first, second) = ([l1, a1, b1], [l2, a2, b2]);
            for got in [delta_e_2000(first, second), delta_e_2000(second, first)] {
                // Rounded to four digits.
                assert!((got - want).abs() <= 0.5e-4 + 1e-9, "{first:?} {second:?}: {got} {want}");
            }
            assert_eq!(delta_e_2000(first, first), 0.0);
        }
    }

    /// Of the definition itself: white, black, a grey whose L* is 50 (Y = 0.18418651851 of the white's), and the bend.
    #[test]
    fn lightness_is_that_of_the_definition() {
        let white = [0.95047, 1.0, 1.08883];
        let grey = |y: f64| lab(white.map(|v| v * y), white);
        let near = |got: Lab, want: Lab| got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-8);
        assert!(near(grey(1.0), [100.0, 0.0, 0.0]) && near(grey(0.0), [0.0; 3]));
        assert!(near(grey(0.184_186_518_512_444), [50.0, 0.0, 0.0]), "{:?}", grey(0.184_186_518_512_444));
        assert!(near(grey(216.0 / 24389.0), [8.0, 0.0, 0.0]));
        // The red of sRGB, as B. Lindbloom's tables have it (brucelindbloom.com).
        let red = lab([0.412_456_4, 0.212_672_9, 0.019_333_9], white);
        assert!([53.2408, 80.0925, 67.2032].iter().zip(red).all(|(want, got)| (got - want).abs() < 1e-4), "{red:?}");
    }
}
