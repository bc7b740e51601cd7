//! Optics that blur, `spectile sensor --model` with `psf`, `mtf` and `oversampling`, against what is known of them.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use spectile::cube::{Cube, Header};
use spectile::scene::{Seen, parse_sensor};
use spectile::sensor::{Applied, Settings, apply};
use spectile::spectral::Channels;
use tempfile::tempdir;

use crate::cubes::{create, header, unit};
use crate::size;

const NM: f64 = 4000.0;

/// F/2 at 4 um: λN is 8 um, which `pitch` decides in pixels.
fn model(optics: &str, detector: &str) -> String {
    format!(
        "[optics]\nf_number = 2\n{optics}\n[detector]\nintegration_time = 1e-3\nquantum_efficiency = 1\ngain = 1\nbits = 24\n{detector}\n"
    )
}

/// A cube of `size` whose channels are `count` of 100 nm around 4 um, in tiles of 16 pixels; without the tile `missing`.
fn cube(
    folder: &Path,
    name: &str,
    (size, tile): ([u32; 2], u32),
    count: usize,
    missing: Option<u32>,
    value: impl Fn(u32, u32, usize) -> f64,
) -> Cube {
    let half = 50.0 * count as f64;
    let channels = Channels::equal(NM - half, NM + half, count);
    let tile = size.map(|side| side.min(tile));
    let cube = create(folder, name, Header { channels, ..header(size, tile, 1) });
    for tile in (0..cube.grid().count()).filter(|tile| Some(*tile) != missing) {
        cube.merge_unit(tile, 1, &unit(&cube, tile, |x, y, k| value(x, y, k) as f32)).expect("merged");
    }
    Cube::open(&folder.join(name)).expect("a cube")
}

/// What a model makes of a cube: the report, and the electrons of its first band, row by row; NaN where a pixel is missing.
fn exposed(cube: &Cube, text: &str, noise: bool, out: &Path) -> (Applied, Vec<f64>, usize) {
    let model = parse_sensor(text, Path::new("sensor.toml"), cube.channels(), Seen::default()).expect("a model");
    let about = "sensor.toml".to_owned();
    let settings = Settings { seed: 1, noise, electrons: true, partial: true, overwrite: false, about };
    let applied = apply(cube, &model, &settings, out, &mut |_, _| Ok(())).expect("exposed");
    let n = model.oversampling;
    let [width, height] = cube.header().size.map(|side| side / n);
    let [tile_w, tile_h] = cube.header().tile;
    let mut found = vec![f64::NAN; (width * height) as usize];
    for (row, column) in (0..height.div_ceil(tile_h)).flat_map(|r| (0..width.div_ceil(tile_w)).map(move |c| (r, c))) {
        let Ok(bytes) = fs::read(out.join(format!("electrons/c/0/{row}/{column}"))) else { continue };
        let values: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        for (i, value) in (0..tile_w * tile_h).zip(values) {
            let (x, y) = (column * tile_w + i % tile_w, row * tile_h + i / tile_w);
            if x < width && y < height {
                found[(y * width + x) as usize] = value.into();
            }
        }
    }
    assert!(!out.join("planes").exists());
    (applied, found, width as usize)
}

/// Where an Airy pattern has its first zero, over λN: J₁'s first zero over π.
const FIRST_ZERO: f64 = 1.219_669_891;

/// A point's image: all its light, and the first dark ring where the theory has it. The pattern is sampled at λN/8; amplitudes, roots of
/// intensities with the sign that changes at the zero, are smooth, and a parabola through three of them is 0 there.
#[test]
fn a_point_becomes_an_airy_pattern() {
    let folder = tempdir().expect("folder");
    let (size, at) = ([320, 288], [160u32, 144u32]);
    let point = |x: u32, y: u32, _| if [x, y] == at { 1000.0 } else { 0.0 };
    let cube = cube(folder.path(), "point.zarr", (size, 64), 1, None, point);
    let sharp = model("", "pitch = 1e-6");
    let (_, before, width) = exposed(&cube, &sharp, false, &folder.path().join("a.zarr"));
    let blurred = model("psf = \"diffraction\"", "pitch = 1e-6");
    let (_, after, _) = exposed(&cube, &blurred, false, &folder.path().join("b.zarr"));
    let (sum_before, sum_after) = (before.iter().sum::<f64>(), after.iter().sum::<f64>());
    println!("light {:e} of {sum_before:e}", sum_after / sum_before - 1.0);
    assert!((sum_after / sum_before - 1.0).abs() < 1e-6, "{sum_before} {sum_after}");
    let row = &after[at[1] as usize * width..][at[0] as usize..];
    let least = (5..14).min_by(|a, b| row[*a].total_cmp(&row[*b])).expect("pixels");
    let (before_it, after_it) = (row[least - 1].sqrt(), -row[least + 1].sqrt());
    // The least value itself may lie on either side: where amplitudes are smoother.
    let bend = |middle: f64| before_it - 2.0 * middle + after_it;
    let root = row[least].max(0.0).sqrt();
    let middle = if bend(root).abs() < bend(-root).abs() { root } else { -root };
    let slope = 0.5 * (after_it - before_it);
    let offset = (0..20).fold(0.0, |x, _| -(middle + 0.5 * bend(middle) * x * x) / slope);
    let zero = least as f64 + offset;
    println!("first zero at {zero} pixels, {} expected", 8.0 * FIRST_ZERO);
    assert!((zero / (8.0 * FIRST_ZERO) - 1.0).abs() < 0.005, "{zero}");
    // The peak: all light times π / (4 λ²N²) a pixel.
    let peak = PI / 4.0 / 64.0;
    assert!((row[0] / sum_before / peak - 1.0).abs() < 0.005, "{} {peak}", row[0] / sum_before);
}

/// Waves that fit the picture with its mirror images come out as they were, times the transfer function: of a circular aperture from
/// its closed form, 0 from 1/λN on; of a Gaussian; of a measured table between its rows.
#[test]
fn waves_keep_the_contrast_of_the_transfer_function() {
    const WIDTH: u32 = 240;
    let folder = tempdir().expect("folder");
    fs::write(folder.path().join("m.csv"), "cycles_per_mm,mtf\n0,1\n50,0.5\n100,0.3\n800,0\n").expect("written");
    let file = folder.path().join("m.csv");
    let measured = format!("mtf = {:?}", file.to_str().expect("text"));
    let airy = |s: f64| if s < 1.0 { 2.0 / PI * (s.acos() - s * (1.0 - s * s).sqrt()) } else { 0.0 };
    let table = |nu: f64| match nu {
        nu if nu < 50.0 => 1.0 - 0.01 * nu,
        nu if nu < 100.0 => 0.5 - 0.004 * (nu - 50.0),
        nu => 0.3 * (800.0 - nu) / 700.0,
    };
    let mut edge: Vec<(f64, f64)> = Vec::new();
    for m in size::first(6, [24u32, 80, 200, 228, 236, 239, 1, 60, 120, 150, 180, 210, 220, 232, 238]) {
        // m / 2W cycles a pixel.
        let frequency = f64::from(m) / f64::from(2 * WIDTH);
        let wave = |x: u32| (2.0 * PI * frequency * (f64::from(x) + 0.5)).cos();
        let name = format!("{m}.zarr");
        let cube = cube(folder.path(), &name, ([WIDTH, 3], 16), 1, None, |x, _, _| 5.0 + wave(x));
        let contrast = |optics: &str, kind: &str| {
            let out = folder.path().join(format!("{kind}{m}.zarr"));
            // 4 um pixels: λN is 2 of them.
            let (_, found, width) = exposed(&cube, &model(optics, "pitch = 4e-6"), false, &out);
            let mean = found.iter().sum::<f64>() / found.len() as f64;
            let along = |i: usize| (found[width + i] / mean - 1.0) * 5.0 * wave(i as u32);
            let norm: f64 = (0..WIDTH).map(|x| wave(x).powi(2)).sum();
            (0..width).map(along).sum::<f64>() / norm
        };
        let found = contrast("psf = \"diffraction\"", "d");
        let expected = airy(2.0 * frequency);
        println!("{m}: {frequency} cycles/pixel: {found} {expected}");
        // f32 electrons.
        assert!((found - expected).abs() < 2e-6, "{m}: {found} {expected}");
        edge.push((2.0 * frequency, found));
        let found = contrast("psf = \"gaussian\"\npsf_sigma = 0.7", "g");
        let expected = (-2.0 * (PI * 0.7 * frequency).powi(2)).exp();
        assert!((found - expected).abs() < 2e-6, "{m}: {found} {expected}");
        let found = contrast(&measured, "m");
        // Cycles a millimetre of 4 um pixels.
        let expected = table(frequency * 250.0);
        assert!((found - expected).abs() < 2e-6, "{m}: {found} {expected}");
    }
    // Near its end the function is 8√2 / 3π (1 - s)^(3/2) to first order: its 2/3 power is a line, whose zero is the cut-off.
    edge.retain(|(s, found)| *s > 0.9 && *found > 1e-3);
    edge.sort_by(|a, b| a.0.total_cmp(&b.0));
    let power = |i: usize| (edge[i].0, edge[i].1.powf(2.0 / 3.0));
    let ((a, p), (b, q)) = (power(edge.len() - 2), power(edge.len() - 1));
    let cut_off = b + q * (b - a) / (p - q);
    println!("cut-off at {cut_off} / λN");
    assert!((cut_off - 1.0).abs() < 0.005, "{cut_off}");
}

/// What is blurred band by band with many channels: a constant stays constant, all light stays, tiles and threads change no byte, and
/// the wavelengths between which channels are gathered are near enough.
#[test]
fn a_blur_has_no_seams() {
    let folder = tempdir().expect("folder");
    let text = model("psf = \"diffraction\"", "pitch = 3e-6\nread_noise = 20\nprnu = 0.01");
    let flat = cube(folder.path(), "flat.zarr", ([50, 34], 16), 8, None, |_, _, k| 1.0 + k as f64);
    let (_, found, _) = exposed(&flat, &text, false, &folder.path().join("f.zarr"));
    assert!(found.iter().all(|value| (value / found[0] - 1.0).abs() < 1e-6), "{found:?}");
    let (_, sharp, _) =
        exposed(&flat, &text.replace("psf = \"diffraction\"", ""), false, &folder.path().join("s.zarr"));
    assert!((found[0] / sharp[0] - 1.0).abs() < 1e-6, "{} {}", found[0], sharp[0]);
    // 60 channels from 1 to 7 um, spots of other colours.
    let spots = |x: u32, y: u32, k: usize| {
        if x % 11 == 3 && y % 7 == 2 { 100.0 + ((x + y) as usize * k % 17) as f64 } else { 1.0 }
    };
    let make = |name: &str, tile: u32| cube(folder.path(), name, ([53, 34], tile), 60, None, spots);
    let small = make("small.zarr", 8);
    let whole = make("whole.zarr", 64);
    let (_, of_small, width) = exposed(&small, &text, true, &folder.path().join("c.zarr"));
    let (_, of_whole, _) = exposed(&whole, &text, true, &folder.path().join("d.zarr"));
    assert_eq!(of_small, of_whole);
    let threads = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads");
    threads.install(|| exposed(&whole, &text, true, &folder.path().join("e.zarr")));
    let read = |name: &str| fs::read(folder.path().join(name).join("counts/c/0/0/0")).expect("counts");
    assert_eq!(read("d.zarr"), read("e.zarr"));
    // Against a sum over all channels and pixels, mirrored once, of the closed form of each channel's own transform.
    let model = parse_sensor(&text, Path::new("s.toml"), small.channels(), Seen::default()).expect("a model");
    let bands = spectile::sensor::Bands::new(&model, small.channels());
    let expected = by_hand(&small, &bands.bands[0].weights, [53, 34], 3e-6, spots);
    let scale = expected.iter().copied().fold(0.0, f64::max);
    let worst = expected.iter().zip(&of_small).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("off by {:e} of the largest of {} x {}", worst / scale, width, of_small.len() / width);
    // Transfer functions within 5e-4 of the channels' own, of signs that differ.
    assert!(worst < 5e-4 * scale, "{worst} {scale}");
}

/// Sums of cosines, channel by channel.
fn by_hand(
    cube: &Cube,
    weights: &[(usize, f64)],
    [width, height]: [usize; 2],
    pitch: f64,
    value: impl Fn(u32, u32, usize) -> f64,
) -> Vec<f64> {
    let waves = |n: usize| -> Vec<Vec<f64>> {
        let wave = |m: usize, i: usize| (PI * m as f64 * (2 * i + 1) as f64 / (2 * n) as f64).cos();
        (0..n).map(|m| (0..n).map(|i| wave(m, i)).collect()).collect()
    };
    let (across, along) = (waves(width), waves(height));
    let norm = |m: usize, n: usize| if m == 0 { 1.0 / n as f64 } else { 2.0 / n as f64 };
    let mut sums = vec![vec![0.0; width]; height];
    for &(k, weight) in weights {
        let lambda_n = cube.channels().centre(k) * 1e-9 * 2.0;
        let mut by_row = vec![vec![0.0; width]; height];
        for (y, row) in by_row.iter_mut().enumerate() {
            let line: Vec<f64> = (0..width).map(|x| value(x as u32, y as u32, k)).collect();
            for (m, sum) in row.iter_mut().enumerate() {
                *sum = line.iter().zip(&across[m]).map(|(a, b)| a * b).sum();
            }
        }
        for (n, line) in sums.iter_mut().enumerate() {
            for (m, sum) in line.iter_mut().enumerate() {
                let total: f64 = (0..height).map(|y| by_row[y][m] * along[n][y]).sum();
                let nu = (m as f64 / (2 * width) as f64).hypot(n as f64 / (2 * height) as f64) / pitch;
                let s = nu * lambda_n;
                let mtf = if s < 1.0 { 2.0 / PI * (s.acos() - s * (1.0 - s * s).sqrt()) } else { 0.0 };
                *sum += weight * mtf * total * norm(m, width) * norm(n, height);
            }
        }
    }
    let mut found = Vec::new();
    for y in 0..height {
        let waves_there: Vec<f64> = along.iter().map(|wave| wave[y]).collect();
        let column = |m: usize| sums.iter().zip(&waves_there).map(|(sums, wave)| sums[m] * wave).sum::<f64>();
        let line: Vec<f64> = (0..width).map(column).collect();
        found.extend((0..width).map(|x| (0..width).map(|m| line[m] * across[m][x]).sum::<f64>()));
    }
    found
}

/// Several pixels of the cube make one of the detector: their mean, after the blur. Their pitch is a share of the detector's.
#[test]
fn finer_pixels_make_one_after_the_blur() {
    let folder = tempdir().expect("folder");
    let value = |x: u32, y: u32, _| 1.0 + f64::from((5 * x + 3 * y) % 13);
    let fine = cube(folder.path(), "fine.zarr", ([48, 24], 16), 1, None, value);
    let (_, each, width) =
        exposed(&fine, &model("psf = \"diffraction\"", "pitch = 2e-6"), false, &folder.path().join("a.zarr"));
    let text = model("psf = \"diffraction\"", "pitch = 6e-6\noversampling = 3");
    let (applied, found, _) = exposed(&fine, &text, false, &folder.path().join("b.zarr"));
    assert_eq!((found.len(), applied.pixels), (16 * 8, 16 * 8));
    for (i, found) in found.iter().enumerate() {
        let (x, y) = (3 * (i % 16), 3 * (i / 16));
        let mean = (0..9).map(|j| each[(y + j / 3) * width + x + j % 3]).sum::<f64>() / 9.0;
        // Of nine times the area; f32.
        assert!((found / (9.0 * mean) - 1.0).abs() < 1e-6, "{i}: {found} {mean}");
    }
    let (_, plain, _) =
        exposed(&fine, &model("", "pitch = 6e-6\noversampling = 3"), false, &folder.path().join("c.zarr"));
    let (_, each, _) = exposed(&fine, &model("", "pitch = 2e-6"), false, &folder.path().join("d.zarr"));
    let mean = (0..9).map(|j| each[(3 + j / 3) * width + 6 + j % 3]).sum::<f64>();
    assert!((plain[16 + 2] / mean - 1.0).abs() < 1e-6, "{} {mean}", plain[18]);
}

/// A hole takes light from pixels around it: within the circle that holds 99 % of a point's light they are missing too. Of a Gaussian
/// that is σ √(2 ln 100).
#[test]
fn holes_grow_by_the_blur() {
    let folder = tempdir().expect("folder");
    let holed = cube(folder.path(), "holed.zarr", ([48, 48], 16), 1, Some(4), |_, _, _| 1.0);
    let text = model("psf = \"gaussian\"\npsf_sigma = 1.5", "pitch = 5e-6");
    let (applied, found, width) = exposed(&holed, &text, false, &folder.path().join("a.zarr"));
    let reach = 1.5 * (2.0 * 100f64.ln()).sqrt();
    let gap = |i: usize| f64::from((16 - i as i32 - 1).max(i as i32 - 32).max(0));
    let mut missing = 0;
    for (i, value) in found.iter().enumerate() {
        let (x, y) = (i % width, i / width);
        let is_inside = (16..32).contains(&x) && (16..32).contains(&y);
        let is_missing = is_inside || gap(x).hypot(gap(y)) < reach;
        assert_eq!(value.is_nan(), is_missing, "{x} {y}: {value}");
        missing += u64::from(is_missing);
    }
    assert_eq!(applied.pixels, 48 * 48 - missing);
    // What is left lacks less than 1 %.
    let whole = found.iter().copied().filter(|value| !value.is_nan()).fold(0.0, f64::max);
    assert!(found.iter().filter(|value| !value.is_nan()).all(|value| value / whole > 0.99));
}
