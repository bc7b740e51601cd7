//! The worked examples of `docs/examples/`: their commands, in their order, and the numbers of their tables against what is worked out here.

use std::fs;
use std::path::{Path, PathBuf};

use spectile::spectral::{Curve, Outside, columns};
use tempfile::TempDir;

use crate::binary;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A page whose commands have been given, in a folder that has the repository's files that it needs.
struct Walked {
    folder: TempDir,
    page: String,
}

impl Walked {
    fn of(name: &str) -> Walked {
        let folder = tempfile::tempdir().expect("a folder");
        for part in ["docs/examples", "scenes/grove/spectra", "scenes/conference/spectra"] {
            let to = folder.path().join(part);
            fs::create_dir_all(&to).expect("made");
            for entry in fs::read_dir(Path::new(ROOT).join(part)).expect("there") {
                let from = entry.expect("an entry").path();
                if from.is_file() {
                    fs::copy(&from, to.join(from.file_name().expect("a name"))).expect("copied");
                }
            }
        }
        fs::create_dir(folder.path().join("out")).expect("made");
        let page = fs::read_to_string(Path::new(ROOT).join("docs/examples").join(name)).expect("a page");
        let commands: Vec<&str> = page.lines().filter_map(|line| line.strip_prefix("    ./run ")).collect();
        assert!(commands.len() >= 5, "{name} has {} commands", commands.len());
        for command in commands {
            let words = shlex::split(command).expect("words");
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let output = binary::run(folder.path(), &words);
            assert!(output.status.success(), "{command}: {}", binary::text(&output.stderr));
            if let Some(at) = words.iter().position(|word| *word == "-o") {
                assert!(folder.path().join(words[at + 1]).exists(), "{command}");
            }
        }
        Walked { folder, page }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Numbers of a CSV file, lines that begin with one.
    fn table(&self, name: &str) -> Vec<Vec<f64>> {
        let text = fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let lines = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()).collect()
    }

    /// A spectrum out of a table with a header.
    fn curve(&self, name: &str, column: &str) -> Curve {
        let text = fs::read_to_string(self.path(name)).expect("read");
        let header = text.lines().find(|line| !line.starts_with('#')).expect("a header");
        let at = header.split(',').position(|name| name == column).unwrap_or_else(|| panic!("{name} has no {column}"));
        let (nm, value) = self.table(name).into_iter().map(|row| (row[0], row[at])).unzip();
        Curve::Linear { nm, value, outside: Outside::Hold }
    }

    /// The numbers of the page's table row that begins with this, cell by cell.
    fn row(&self, begins: &str) -> Vec<Vec<f64>> {
        let row = self.page.lines().find(|line| line.starts_with(&format!("| {begins} |")));
        let row = row.unwrap_or_else(|| panic!("no row begins with {begins}"));
        let cells = row.trim_matches(['|', ' ']).split('|').skip(1);
        cells.map(|cell| cell.split(", ").filter_map(|word| word.trim().parse().ok()).collect()).collect()
    }
}

/// The mean of some columns' pixels in column `value` of a table that begins with x, y.
fn mean_of(table: &[Vec<f64>], columns: &[u32], value: usize) -> f64 {
    let of: Vec<f64> = table.iter().filter(|row| columns.contains(&(row[0] as u32))).map(|row| row[value]).collect();
    assert!(!of.is_empty() && of.iter().all(|value| value.is_finite()));
    of.iter().sum::<f64>() / of.len() as f64
}

/// Reflectances within 2 % of the closed form, as the page says, and as it prints them; NDVI from them.
#[test]
fn vegetation() {
    let walked = Walked::of("vegetation.md");
    let spectra = "scenes/grove/spectra";
    let [rho, tau] = ["reflectance", "transmittance"].map(|name| walked.curve(&format!("{spectra}/leaf.csv"), name));
    let litter = walked.curve(&format!("{spectra}/ground.csv"), "litter");
    let sun = walked.curve("out/sky-sun.csv", "direct normal irradiance (W/m2/nm)");
    // A band's response by nm; all of its lines.
    let responses = fs::read_to_string(walked.path("docs/examples/sentinel2a.csv")).expect("read");
    let band = |name: &str| -> Vec<(f64, f64)> {
        let cells = responses.lines().map(|line| line.split(',').collect::<Vec<_>>()).filter(|cells| cells[0] == name);
        cells.map(|cells| (cells[1].parse().expect("nm"), cells[2].parse().expect("a response"))).collect()
    };
    let over = |ground: f64, nm: f64| rho.eval(nm) + tau.eval(nm).powi(2) * ground / (1.0 - rho.eval(nm) * ground);
    let truth = |name: &str, leaves: u32| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (nm, response) in band(name) {
            let weight = response.max(0.0) * sun.eval(nm);
            sum += weight * (0..leaves).fold(litter.eval(nm), |ground, _| over(ground, nm));
            weights += weight;
        }
        sum / weights
    };
    let table = walked.table("out/reflectance.csv");
    // x, y, B2, B3, B4, B5, B8, …
    let strips = [("litter", [1, 2]), ("leaves over litter", [5, 6]), ("leaves over leaves over litter", [9, 10])];
    for (leaves, (name, columns)) in strips.into_iter().enumerate() {
        let [red, infrared] = [4, 6].map(|value| mean_of(&table, &columns, value));
        for (found, band) in [(red, "B4"), (infrared, "B8")] {
            let truth = truth(band, leaves as u32);
            assert!((found / truth - 1.0).abs() < 0.02, "{name}, {band}: {found}, the truth is {truth}");
        }
        let printed: Vec<f64> = walked.row(name)[1..].iter().map(|cell| cell[0]).collect();
        let ndvi = (infrared - red) / (infrared + red);
        // Rounding, and what another kind of device may draw.
        for (found, printed) in [(red, printed[0]), (infrared, printed[1]), (ndvi, printed[2])] {
            assert!((found - printed).abs() < 0.0005 + 0.01 * printed, "{name}: {found}, the page says {printed}");
        }
    }
}

/// W m⁻² sr⁻¹ m⁻¹; CODATA 2018.
fn planck(nm: f64, kelvin: f64) -> f64 {
    let (h, c, k) = (6.626_070_15e-34, 299_792_458.0, 1.380_649e-23);
    let m = nm * 1e-9;
    2.0 * h * c * c / m.powi(5) / ((h * c / (m * k * kelvin)).exp() - 1.0)
}

/// The mean of `f` over an interval, by midpoints.
fn mean(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let steps = 2000;
    (0..steps).map(|i| f(from + (to - from) * (f64::from(i) + 0.5) / f64::from(steps))).sum::<f64>() / f64::from(steps)
}

#[test]
fn thermal() {
    let walked = Walked::of("thermal.md");
    let table = walked.table("out/kelvin.csv");
    for (i, (name, emissivity)) in [("paint", 0.95), ("rust", 0.5), ("foil", 0.05)].into_iter().enumerate() {
        let radiance =
            mean(10_000.0, 10_200.0, |nm| emissivity * planck(nm, 310.0) + (1.0 - emissivity) * planck(nm, 260.0));
        // Planck's law inverted.
        let (h, c, k) = (6.626_070_15e-34, 299_792_458.0, 1.380_649e-23);
        let m = 10_100e-9_f64;
        let truth = h * c / (m * k) / (1.0 + 2.0 * h * c * c / (m.powi(5) * radiance)).ln();
        let columns: Vec<u32> = (16 * i as u32..16 * (i as u32 + 1)).collect();
        let found = mean_of(&table, &columns, 2);
        assert!((found - truth).abs() < 0.05, "{name}: {found} K, the truth is {truth}");
        let row = walked.row(name);
        assert!(row[1][0] == emissivity && (row[2][0] - found).abs() < 0.1, "{name}: {found}, the page says {row:?}");
    }
    // Electrons of a black body: t A fill π τ / (4 N²) ∫ L QE λ / hc dλ; noise of light, reading and rounding.
    let electrons = |kelvin: f64| {
        let photons =
            4000e-9 * mean(8000.0, 12_000.0, |nm| planck(nm, kelvin) * nm * 1e-9 / (6.626_070_15e-34 * 299_792_458.0));
        100e-6 * 30e-6 * 30e-6 * 0.9 * std::f64::consts::PI * 0.9 / 16.0 * 0.7 * photons
    };
    let noise = (electrons(300.0) + 1000.0 * 1000.0 + 2500.0 * 2500.0 / 12.0).sqrt();
    let netd = noise / ((electrons(300.05) - electrons(299.95)) / 0.1);
    let printed =
        walked.page.lines().find_map(|line| line.strip_prefix("| NETD at 300 K | ")?.split(' ').next()?.parse().ok());
    let printed: f64 = printed.expect("a number");
    assert!((netd / printed - 1.0).abs() < 0.004, "{netd} K, the page says {printed}");
    let counts = fs::read_to_string(walked.path("out/counts.zarr/zarr.json")).expect("attributes");
    assert!(counts.contains("netd_K"), "{counts}");
}

#[test]
fn colour() {
    let walked = Walked::of("colour.md");
    let observer: Vec<[f64; 4]> = columns::<4>(include_str!("../../src/spectral/data/cie1931_2deg_1nm.csv"))
        .filter(|row| row[0] >= 380.0 && row[0] <= 780.0)
        .collect();
    let lab = |[x, y, z]: [f64; 3], white: [f64; 3]| {
        let f = |t: f64| if t > 216.0 / 24_389.0 { t.cbrt() } else { (24_389.0 / 27.0 * t + 16.0) / 116.0 };
        let [x, y, z] = [f(x / white[0]), f(y / white[1]), f(z / white[2])];
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    };
    for (name, column) in [("foliage", 5), ("orange", 10)] {
        let paint = walked.curve("scenes/conference/spectra/colorchecker.csv", name);
        let row = walked.row(name);
        let mut both = Vec::new();
        for (lamp, file, printed) in [(6504.0, "out/day.csv", &row[0]), (2856.0, "out/evening.csv", &row[1])] {
            let under = |reflectance: &dyn Fn(f64) -> f64| {
                observer.iter().fold([0.0; 3], |sum, [nm, x, y, z]| {
                    let light = reflectance(*nm) * planck(*nm, lamp);
                    [sum[0] + light * x, sum[1] + light * y, sum[2] + light * z]
                })
            };
            let truth = lab(under(&|nm| paint.eval(nm)), under(&|_| 1.0));
            let table = walked.table(file);
            let xyz = |column: u32| [2, 3, 4].map(|value| mean_of(&table, &[column], value));
            let found = lab(xyz(column), xyz(1));
            for i in 0..3 {
                assert!((found[i] - truth[i]).abs() < 0.1, "{name}, {lamp} K: {found:?}, the truth is {truth:?}");
                assert!(
                    (found[i] - printed[i]).abs() < 0.051,
                    "{name}, {lamp} K: {found:?}, the page says {printed:?}"
                );
            }
            both.push(found);
        }
        let difference = (0..3).map(|i| (both[0][i] - both[1][i]).powi(2)).sum::<f64>().sqrt();
        assert!((difference - row[2][0]).abs() < 0.051, "{name}: {difference}, the page says {:?}", row[2]);
    }
}
