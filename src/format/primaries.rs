//! Primaries of pictures: what red, green and blue are where a file says that they are not those of sRGB.

use crate::spectral::colour::XYZ_TO_LINEAR_SRGB;

type Matrix = [[f64; 3]; 3];

/// CIE 1931 (x, y) of red, green, blue and white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Primaries(pub [[f64; 2]; 4]);

/// What becomes of white.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum White {
    /// The colour stays the same, as that of light must.
    Kept,
    /// It becomes the white of sRGB (Bradford's transform): a surface that reflects everything stays one.
    Adapted,
}

const SRGB: Primaries = Primaries([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]]);
/// Linear Bradford: sharpened cone responses of XYZ (Lam 1985).
const BRADFORD: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

impl Primaries {
    /// Whether these are those of sRGB, but for the digits that a file keeps.
    pub fn are_srgb(&self) -> bool {
        self.0.iter().flatten().zip(SRGB.0.iter().flatten()).all(|(a, b)| (a - b).abs() <= 1.5e-3)
    }

    /// From linear RGB of these primaries to linear sRGB; `None` where they span no colours.
    pub fn to_srgb(self, white: White) -> Option<Matrix> {
        let xyz = |[x, y]: [f64; 2]| [x / y, 1.0, (1.0 - x - y) / y];
        if !self.0.iter().flatten().all(|v| v.is_finite()) || self.0.iter().any(|[_, y]| *y == 0.0) {
            return None;
        }
        let [r, g, b, w] = self.0.map(xyz);
        let columns = |columns: [[f64; 3]; 3]| transposed(columns);
        let scale = apply(&inverse(&columns([r, g, b]))?, w);
        let scaled = |of: [f64; 3], by: f64| of.map(|v| v * by);
        let mut to_xyz = columns([scaled(r, scale[0]), scaled(g, scale[1]), scaled(b, scale[2])]);
        if white == White::Adapted {
            let (from, to) = (apply(&BRADFORD, w), apply(&BRADFORD, xyz(SRGB.0[3])));
            let gain = [0, 1, 2].map(|i| to[i] / from[i]);
            let cones = BRADFORD;
            let adapted = times(&inverse(&BRADFORD)?, &[0, 1, 2].map(|i| cones[i].map(|v| v * gain[i])));
            to_xyz = times(&adapted, &to_xyz);
        }
        Some(times(&XYZ_TO_LINEAR_SRGB, &to_xyz)).filter(|m| m.iter().flatten().all(|v| v.is_finite()))
    }
}

pub fn apply(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    let b = transposed(*b);
    a.map(|row| b.map(|column| row[0] * column[0] + row[1] * column[1] + row[2] * column[2]))
}

fn transposed(m: Matrix) -> Matrix {
    [0, 1, 2].map(|i| [m[0][i], m[1][i], m[2][i]])
}

fn inverse(m: &Matrix) -> Option<Matrix> {
    let m = glam::DMat3::from_cols_array_2d(m);
    let determinant = m.determinant();
    (determinant.is_finite() && determinant.abs() > 1e-12).then(|| m.inverse().to_cols_array_2d())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rec. 2020 to Rec. 709, both white D65: ITU-R BT.2087, section 2. ACES2065-1 to sRGB by way of Bradford: the matrix that
    /// the Academy's documents give for it, to their four digits.
    #[test]
    fn published_matrices() {
        let rec2020 = Primaries([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], [0.3127, 0.3290]]);
        let expected = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
        for white in [White::Kept, White::Adapted] {
            let m = rec2020.to_srgb(white).unwrap();
            let off = m.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-4, "{m:?}");
        }
        let aces = Primaries([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], [0.32168, 0.33767]]);
        let expected = [[2.5217, -1.1341, -0.3876], [-0.2765, 1.3727, -0.0963], [-0.0154, -0.1530, 1.1684]];
        let m = aces.to_srgb(White::Adapted).unwrap();
        let off = m.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 2e-3, "{m:?}");
        let identity = SRGB.to_srgb(White::Kept).unwrap();
        assert!(SRGB.are_srgb() && (0..3).all(|i| (0..3).all(|j| (identity[i][j] - f64::from(i == j)).abs() < 2e-4)));
    }

    #[test]
    fn white_is_white_where_it_is_adapted() {
        let p3 = Primaries([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], [0.314, 0.351]]);
        let adapted = apply(&p3.to_srgb(White::Adapted).unwrap(), [1.0; 3]);
        assert!(adapted.iter().all(|v| (v - 1.0).abs() < 5e-4), "{adapted:?}");
        let kept = apply(&p3.to_srgb(White::Kept).unwrap(), [1.0; 3]);
        assert!(kept[1] > 1.02 && kept[2] < 1.0, "{kept:?}");
        let flat = Primaries([[0.3, 0.3], [0.3, 0.3], [0.15, 0.06], [0.3127, 0.329]]);
        assert_eq!(flat.to_srgb(White::Kept), None);
    }
}
