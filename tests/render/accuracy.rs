//! `--error`: a render ends when its estimate is there, and the estimate is what the error really is.

use spectile::cube::Cube;

use super::{Place, samples, spectrum};

/// sqrt(Σ (x - ref)² / Σ ref²) per channel over all pixels: what the error estimate estimates.
fn true_errors(cube: &Cube, truth: &Cube) -> Vec<f64> {
    let [width, height] = cube.header().size;
    let mut sums = vec![(0.0, 0.0); cube.channels().len()];
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let (values, expected) = (spectrum(cube, x, y), spectrum(truth, x, y));
        for (sum, (value, expected)) in sums.iter_mut().zip(values.iter().zip(&expected)) {
            let (value, expected) = (f64::from(*value), f64::from(*expected));
            *sum = (sum.0 + (value - expected).powi(2), sum.1 + expected * expected);
        }
    }
    sums.iter().map(|(difference, square)| (difference / square).sqrt()).collect()
}

#[test]
fn a_render_ends_when_it_is_accurate_enough() {
    let place = Place::new();
    let render = |error: f64, more: &[&str]| -> (u64, f64) {
        let error_text = error.to_string();
        let arguments = ["render", "scene.toml", "-o", "cube.zarr", "--spp", "65536", "--error", &error_text];
        let events = place.events(&[&arguments[..], more].concat());
        let of = |name: &str| events.iter().filter(|e| e["event"] == name).cloned().collect::<Vec<_>>();
        assert_eq!(of("start")[0]["error_limit"], error);
        let done = of("done").remove(0);
        let (spp, estimate) = (done["samples"].as_u64().expect("a number"), done["error_estimate"].as_f64());
        assert!((512..65_536).contains(&spp) && spp.is_multiple_of(64), "{spp}");
        // Every epoch before, from the eighth on, was not accurate enough.
        for epoch in of("epoch") {
            let samples = epoch["samples"].as_u64().expect("a number");
            if (512..spp).contains(&samples) {
                assert!(epoch["error_estimate"].as_f64().expect("a number") > error, "{epoch}");
            }
        }
        (spp, estimate.filter(|estimate| *estimate <= error).expect("small enough"))
    };
    let (spp, estimate) = render(0.02, &[]);
    // What is accurate enough is left as it is; when more is asked for, it is rendered.
    assert_eq!(u64::from(samples(&place.render("cube.zarr", &["--resume", "--error", "0.02"]))), spp);
    let (more, _) = render(0.6 * estimate, &["--resume"]);
    assert!(more > spp, "{more} samples after {spp}");
    // Whichever comes first.
    assert_eq!(samples(&place.render("few.zarr", &["--error", "1e-9", "--spp", "640"])), 640);
}

/// Means over seeds of the squares of estimated and true errors, channel by channel: the estimate is within 10 % of the truth.
#[test]
fn the_estimate_is_calibrated() {
    let place = Place::new();
    let scene = ["--size", "12x10", "--tile", "16", "--set", "integrator.sampler=independent"];
    let truth = place.render("truth.zarr", &[&scene[..], &["--seed", "1000", "--spp", "65536"]].concat());
    const SEEDS: u32 = 24;
    let (mut estimated, mut real) = (vec![0.0; 5], vec![0.0; 5]);
    for seed in 1..=SEEDS {
        let seed = seed.to_string();
        let stop = ["--seed", &seed, "--error", "0.03", "--overwrite"];
        let cube = place.render("cube.zarr", &[&scene[..], &stop[..]].concat());
        let errors = true_errors(&cube, &truth);
        for k in 0..5 {
            let estimate = cube.error_estimate().expect("readable")[k];
            assert!(estimate <= 0.03);
            estimated[k] += estimate * estimate / f64::from(SEEDS);
            real[k] += errors[k] * errors[k] / f64::from(SEEDS);
        }
    }
    let ratios: Vec<f64> = estimated.iter().zip(&real).map(|(e, r)| (e / r).sqrt()).collect();
    println!("estimated over true error, per channel: {ratios:.3?}");
    // The truth has some error of its own: 1/128 of the variance at 512 samples.
    assert!(ratios.iter().all(|ratio| (0.9..=1.1).contains(ratio)), "{ratios:?}");
}

#[test]
fn errors_are_positive_numbers() {
    let place = Place::new();
    for bad in ["0", "-1", "nan", "one"] {
        let output = place.run(&["render", "scene.toml", "-o", "cube.zarr", "--error", bad]);
        let stderr = super::text(&output.stderr);
        assert!(output.status.code() == Some(2) && (stderr.contains("0.01 for 1 %") || bad == "-1"), "{stderr}");
    }
    assert!(!place.path().join("cube.zarr").exists());
    // Percent are meant, perhaps.
    let output = place.run(&["render", "scene.toml", "-o", "cube.zarr", "--error", "5", "--spp", "1"]);
    assert!(output.status.success() && super::text(&output.stderr).contains("500 %"), "{output:?}");
}
