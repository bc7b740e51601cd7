//! Illuminants of the CIE: light of which only the distribution over wavelength is said, so that all are 1 at 560 nm.

use super::data::{self, columns};
use super::{Curve, Outside};

/// All that are known: incandescent light, daylight and equal energy; fluorescent lamps; high-pressure discharge lamps; LEDs (CIE 015:2018).
pub const ILLUMINANTS: [&str; 33] = [
    "A", "C", "D50", "D55", "D65", "D75", "E", "FL1", "FL2", "FL3", "FL4", "FL5", "FL6", "FL7", "FL8", "FL9", "FL10",
    "FL11", "FL12", "HP1", "HP2", "HP3", "HP4", "HP5", "LED-B1", "LED-B2", "LED-B3", "LED-B4", "LED-B5", "LED-BH1",
    "LED-RGB1", "LED-V1", "LED-V2",
];
/// Columns of the table of daylight.
const DAYLIGHT: [&str; 4] = ["C", "D50", "D55", "D75"];
/// Where the columns of the table of lamps begin.
const FIRST_LAMP: usize = 7;
const LAMPS: usize = ILLUMINANTS.len() - FIRST_LAMP;

/// The illuminant of a name in [`ILLUMINANTS`], over nm: 1 at 560 nm, and zero beyond its table but for E, which is 1 everywhere.
pub fn illuminant(name: &str) -> Option<Curve> {
    let (nm, value) = match name {
        "E" => return Some(Curve::Constant(1.0)),
        // CIE 015:2018, 4.1.1.
        "A" => {
            let planck = |nm: f64| (560.0 / nm).powi(5) / (1.435e7 / (2848.0 * nm)).exp_m1();
            (300..=830).map(|nm| (f64::from(nm), planck(f64::from(nm)))).unzip()
        }
        "D65" => columns::<2>(data::D65).map(|[nm, value]| (nm, value)).unzip(),
        _ => match DAYLIGHT.iter().position(|known| *known == name) {
            Some(i) => column::<5>(data::DAYLIGHT, i),
            None => {
                let i = ILLUMINANTS[FIRST_LAMP..].iter().position(|known| *known == name)?;
                column::<{ LAMPS + 1 }>(data::LAMPS, i)
            }
        },
    };
    let table = Curve::Linear { nm, value, outside: Outside::Zero };
    Some(table.scaled(1.0 / table.eval(560.0)))
}

fn column<const N: usize>(table: &'static str, i: usize) -> (Vec<f64>, Vec<f64>) {
    columns::<N>(table).map(|row| (row[0], row[i + 1])).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chromaticities for the 2 degree observer to the digits that CIE 015:2018 has (tables 1, 5, 9, 10, 12), by sums every 5 nm as the CIE
    /// makes them; x and y each with half a digit of the last place.
    #[test]
    fn chromaticities_are_those_of_the_cie() {
        let rows: Vec<[f64; 4]> = columns(data::CIE1931).filter(|row: &[f64; 4]| row[0] % 5.0 == 0.0).collect();
        for (name, x, y, half) in [
            ("A", 0.44758, 0.40745, 5e-6),
            ("C", 0.31006, 0.31616, 5e-6),
            ("D50", 0.34567, 0.35851, 5e-6),
            ("D55", 0.33243, 0.34744, 5e-6),
            ("D65", 0.31272, 0.32903, 5e-6),
            ("D75", 0.29903, 0.31488, 5e-6),
            ("FL2", 0.3721, 0.3751, 5e-5),
            ("FL4", 0.4402, 0.4031, 5e-5),
            ("FL7", 0.3129, 0.3292, 5e-5),
            ("FL11", 0.3805, 0.3769, 5e-5),
            ("HP1", 0.5330, 0.4150, 5e-5),
            ("LED-B3", 0.3756, 0.3723, 5e-5),
        ] {
            let curve = illuminant(name).expect(name);
            assert!((curve.eval(560.0) - 1.0).abs() < 1e-15, "{name}");
            let xyz = rows.iter().filter(|row| (380.0..=780.0).contains(&row[0])).fold([0.0; 3], |sum, row| {
                let light = curve.eval(row[0]);
                std::array::from_fn(|i| sum[i] + light * row[i + 1])
            });
            let sum: f64 = xyz.iter().sum();
            let got = [xyz[0] / sum, xyz[1] / sum];
            assert!((got[0] - x).abs() < half && (got[1] - y).abs() < half, "{name}: {got:?}");
        }
    }

    #[test]
    fn every_name_is_known_and_no_other() {
        for name in ILLUMINANTS {
            assert!(illuminant(name).is_some(), "{name}");
        }
        assert_eq!(["B", "FL13", "d65", ""].map(illuminant), [None, None, None, None]);
    }
}
