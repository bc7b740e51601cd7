//! Drivers other than the one that all tests run on.

use std::path::Path;

use spectile::cube::Cube;
use tempfile::TempDir;

use crate::binary::{self, cornell};
use crate::report::excuse;

/// Where Debian's Chromium has its software driver, which offers ten storage buffers a stage.
const SWIFTSHADER: &str = "/usr/lib/chromium/vk_swiftshader_icd.json";

/// Relative. Both follow the same paths; a path's radiance is a product of tens of factors, each with a few roundings of 2^-24, and
/// SPIR-V allows a division or a square root 2.5 ulp.
const ROUNDING: f64 = 1e-4;
/// Of the pixels, those in which a path may meet another surface by rounding.
const OTHER_PATHS: f64 = 0.01;

#[test]
fn swiftshader_renders_the_cornell_box() {
    if !Path::new(SWIFTSHADER).exists() {
        return excuse(&format!("there is no {SWIFTSHADER}"));
    }
    let out = TempDir::new().expect("a folder");
    let scene = cornell();
    let render = |cube: &str, driver: Option<&str>| {
        let scene = scene.to_string_lossy();
        let channels = ["--set", "channels.equal.count=8", "--set", "channels.false_colour=[6,4,1]"];
        let arguments =
            [&["render", &scene, "-o", cube, "--size", "32x32", "--spp", "16", "--json"][..], &channels].concat();
        let mut command = binary::command(out.path(), &arguments);
        if let Some(driver) = driver {
            command.env("VK_DRIVER_FILES", driver).env("VK_ICD_FILENAMES", driver);
        }
        let output = binary::output(&mut command);
        let said = binary::text(&output.stdout) + &binary::text(&output.stderr);
        assert!(output.status.success() && !said.contains("warning"), "{said}");
        assert_eq!(said.contains("SwiftShader"), driver.is_some(), "{said}");
        let cube = Cube::open(&out.path().join(cube)).expect("a cube");
        let pixels = (0..32).flat_map(|y| (0..32).map(move |x| (x, y)));
        pixels.map(|(x, y)| cube.spectrum(x, y).expect("a pixel").expect("a rendered one")).collect::<Vec<_>>()
    };
    let (here, there) = (render("here.zarr", None), render("there.zarr", Some(SWIFTSHADER)));
    let alike = |a: &Vec<f32>, b: &Vec<f32>| {
        a.iter().zip(b).all(|(&a, &b)| f64::from((a - b).abs()) <= ROUNDING * f64::from(a.abs().max(b.abs())))
    };
    let other = here.iter().zip(&there).filter(|(a, b)| !alike(a, b)).count();
    assert!(here.iter().flatten().any(|v| *v > 0.0));
    assert!((other as f64) <= OTHER_PATHS * here.len() as f64, "{other} of {} pixels", here.len());
}
