//! Indices of refraction by the names that formats have for them.

use crate::spectral::illuminant::illuminant as of_cie;
use crate::spectral::{Curve, Outside};

/// Of metals, n and k; see the head of the file for where they are from.
const METALS: &str = include_str!("data/metals.csv");

/// Of other matter at 589 nm: Hecht, Optics, 4th edition, as Mitsuba lists them.
const MATTER: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// n and k of a metal.
pub fn metal(name: &str) -> Option<[Curve; 2]> {
    let (mut nm, mut n, mut k) = (Vec::new(), Vec::new(), Vec::new());
    for row in METALS.lines().filter(|row| !row.starts_with('#')) {
        let mut cells = row.split(',');
        if cells.next() != Some(name) {
            continue;
        }
        let mut next = || cells.next().and_then(|cell| cell.parse::<f64>().ok()).unwrap_or(0.0);
        nm.push(next());
        n.push(next());
        k.push(next());
    }
    let curve = |value| Curve::Linear { nm: nm.clone(), value, outside: Outside::Hold };
    (!n.is_empty()).then(|| [curve(n), curve(k)])
}

/// Sellmeier's coefficients B and C (µm²) of glasses that pbrt names: Schott's, as refractiveindex.info has them.
const GLASSES: [(&str, [f64; 6]); 7] = [
    ("BK7", [1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653]),
    ("BAF10", [1.5851495, 0.00926681282, 0.143559385, 0.0424489805, 1.08521269, 105.613573]),
    ("FK51A", [0.971247817, 0.00472301995, 0.216901417, 0.0153575612, 0.904651666, 168.68133]),
    ("LASF9", [2.00029547, 0.0121426017, 0.298926886, 0.0538736236, 1.80691843, 156.530829]),
    ("SF5", [1.52481889, 0.011254756, 0.187085527, 0.0588995392, 1.42729015, 129.141675]),
    ("SF10", [1.62153902, 0.0122241457, 0.256287842, 0.0595736775, 1.64447552, 147.468793]),
    ("SF11", [1.73759695, 0.013188707, 0.313747346, 0.0623068142, 1.89878101, 155.23629]),
];

/// The index of a glass over wavelength.
pub fn glass(name: &str) -> Option<Curve> {
    let (_, terms) = GLASSES.iter().find(|(known, _)| *known == name)?;
    Some(super::picture::sampled(&|nm| {
        let square = (1e-3 * nm).powi(2);
        let sum: f64 = terms.as_chunks::<2>().0.iter().map(|[b, c]| b * square / (square - c)).sum();
        (1.0 + sum).sqrt()
    }))
}

/// Daylight of 6000 K; see the head of the file for where it is from.
const D60: &str = include_str!("data/daylight_d60.csv");

/// The spectrum of an illuminant that pbrt names, of any scale: `F1` to `F12`, `D50`, `D60`.
pub fn illuminant(name: &str) -> Option<Curve> {
    match name {
        "D50" => of_cie(name),
        "D60" => {
            let rows = D60.lines().filter(|row| !row.starts_with('#')).skip(1).filter_map(|row| row.split_once(','));
            let number = |cell: &str| cell.parse().unwrap_or(0.0);
            let (nm, value) = rows.map(|(nm, value)| (number(nm), number(value))).unzip();
            Some(Curve::Linear { nm, value, outside: Outside::Zero })
        }
        // CIE 15:2018 calls them FL1 to FL12.
        _ => of_cie(&format!("FL{}", name.strip_prefix('F')?)),
    }
}

/// The names of all metals.
pub fn names() -> Vec<&'static str> {
    let mut names: Vec<&str> =
        METALS.lines().filter(|row| !row.starts_with('#')).skip(1).filter_map(|row| row.split(',').next()).collect();
    names.dedup();
    names
}

/// The index of clear matter, by its name in any letters.
pub fn matter(name: &str) -> Option<f64> {
    MATTER.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, index)| *index)
}

/// Those names, for messages.
pub fn matters() -> Vec<&'static str> {
    MATTER.iter().map(|(name, _)| *name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_whole() {
        for name in names() {
            let [n, k] = metal(name).unwrap();
            for curve in [n, k] {
                let Curve::Linear { nm, value, .. } = curve else { panic!("{name}") };
                assert!(nm.is_sorted() && nm.len() >= 6 && value.iter().all(|v| *v >= 0.0), "{name}");
            }
        }
        let [n, k] = metal("Au").unwrap();
        // At 600 nm Johnson and Christy (1972) have 0.25 + 3.0 i, Olmon et al. (2012) 0.204 + 3.122 i: other gold lies between.
        let (n, k) = (n.eval(600.0), k.eval(600.0));
        assert!((0.204..=0.25).contains(&n) && (2.95..=3.122).contains(&k), "{n} + {k} i");
        assert_eq!((matter("Acrylic Glass"), matter("unobtainium")), (Some(1.49), None));
        assert!(metal("Xx").is_none());
        // F11 has its line of terbium at 545 nm; chromaticities are those of CIE 15, table T.3.
        let peak = illuminant("F11").unwrap();
        assert!(peak.eval(545.0) > 5.0 * peak.eval(560.0) && peak.eval(900.0) == 0.0);
        for (name, x, y) in
            [("D50", 0.3457, 0.3585), ("F2", 0.3721, 0.3751), ("F7", 0.3129, 0.3292), ("F11", 0.3805, 0.3769)]
        {
            let curve = illuminant(name).unwrap();
            let observer = crate::spectral::colour::Observer::Cie1931.curves();
            let sum = |i: usize| {
                (76..=156).map(|j| 5.0 * f64::from(j)).map(|nm| observer[i].eval(nm) * curve.eval(nm)).sum::<f64>()
            };
            let all = sum(0) + sum(1) + sum(2);
            assert!(
                (sum(0) / all - x).abs() < 5e-4 && (sum(1) / all - y).abs() < 5e-4,
                "{name}: {} {}",
                sum(0) / all,
                sum(1) / all
            );
        }
        assert!(illuminant("nm").is_none() && illuminant("F13").is_none());
        // Schott's data sheets at the d line.
        for (name, index) in [
            ("BK7", 1.5168),
            ("BAF10", 1.67),
            ("FK51A", 1.48656),
            ("LASF9", 1.85025),
            ("SF5", 1.6727),
            ("SF10", 1.72825),
            ("SF11", 1.78472),
        ] {
            assert!((glass(name).unwrap().eval(587.56) - index).abs() < 2e-4, "{name}");
        }
    }
}
