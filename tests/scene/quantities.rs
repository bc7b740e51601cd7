//! What files say that their numbers are: applied, or refused by name where something else is wanted.

use super::{BASE, good, parse_with};

/// A file, its content, the column, what it is to be, and the values at 450 and 550 nm or words of the refusal.
type Case = (&'static str, &'static str, &'static str, &'static str, Result<[f64; 2], &'static str>);

const NK: &str = "nm,n,k\n400,1.5,1e-7\n600,1.5,1e-7\n";
const PAGE: &str = "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1.5 1e-7\n        0.6 1.5 1e-7\n";
const DOWNLOAD: &str = "wl,n\n0.4,1.5\n0.6,1.5\n\nwl,k\n0.4,1e-7\n0.6,1e-7\n";
const TAPE7: &str =
    " FREQ   TOT_TRANS  TOTAL_RAD BBODY_T[K]\n 16666.67 0.5 4.0e-8 300.0\n 25000.0 0.5 4.0e-8 300.0\n -9999.\n";
/// 4 π 1e-7 / λ
const ALPHA: [f64; 2] = [2.792_526_803_190_927, 2.284_794_657_156_213];

/// The scene with a spectrum of `quantity` in `file`.
fn scene(file: &str, column: &str, quantity: &str) -> String {
    let column = if column.is_empty() { String::new() } else { format!(", column = \"{column}\"") };
    let spectrum = format!("{{ file = \"{file}\"{column} }}");
    match quantity {
        "absorption" => BASE.replace(
            "[environment]",
            &format!(
                "[[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\ninterior = \"gas\"\n\n\
                 [media.gas]\nabsorption = {spectrum}\n\n[environment]"
            ),
        ),
        "reflectance" => BASE.replace("reflectance = \"grey\"", &format!("reflectance = {spectrum}")),
        "eta" => BASE.replace(
            "[materials.white.diffuse]\nreflectance = \"grey\"",
            &format!("[materials.white.dielectric]\neta = {spectrum}"),
        ),
        _ => BASE.replace("radiance = 0.25", &format!("radiance = {spectrum}")),
    }
}

/// Holds what a file becomes against what is expected.
fn check(file: &str, content: &str, column: &str, quantity: &str, expected: Result<[f64; 2], &str>) {
    let text = scene(file, column, quantity);
    match (parse_with(&text, &[(file, content)], &[]), expected) {
        (Ok(scene), Ok([at_450, at_550])) => {
            let is = |found: f64, wanted: f64| (found / wanted - 1.0).abs() < 1e-5;
            let holds =
                |curve: &spectile::spectral::Curve| is(curve.eval(450.0), at_450) && is(curve.eval(550.0), at_550);
            assert!(scene.spectra.iter().any(|spectrum| holds(&spectrum.curve)), "{content}: {quantity}");
        }
        (Err(error), Err(words)) => assert!(error.to_string().contains(words), "{content}: {quantity}: {error}"),
        (Ok(_), Err(words)) => panic!("{content}: {quantity}: accepted, though {words}"),
        (Err(error), Ok(_)) => panic!("{content}: {quantity}: {error}"),
    }
}

#[test]
fn files_are_what_they_call_their_values() {
    let cases: [Case; 22] = [
        ("a.csv", NK, "k", "absorption", Ok(ALPHA)),
        ("a.yml", PAGE, "k", "absorption", Ok(ALPHA)),
        ("a.csv", DOWNLOAD, "k", "absorption", Ok(ALPHA)),
        ("a.csv", "nm,k (m-1)\n400,2\n600,2\n", "", "absorption", Ok([2.0, 2.0])),
        ("a.csv", NK, "n", "absorption", Err("an index of refraction")),
        ("a.yml", PAGE, "n", "absorption", Err("an index of refraction")),
        ("a.csv", "nm,k\n400,2\n600,2\n", "", "absorption", Err("or of an absorption")),
        ("a.csv", NK, "n", "reflectance", Err("an index of refraction")),
        ("a.csv", DOWNLOAD, "k", "radiance", Err("the imaginary part")),
        ("a.yml", PAGE, "", "radiance", Err("an index of refraction")),
        ("a.csv", NK, "n", "eta", Ok([1.5, 1.5])),
        ("a.csv", NK, "k", "eta", Err("the imaginary part")),
        ("a.csv", "nm,permittivity\n400,2.25\n600,2.25\n", "", "eta", Err("a permittivity")),
        ("a.csv", "nm,group index\n400,1.5\n600,1.5\n", "", "eta", Err("a group index")),
        ("a.csv", "nm,n-1\n400,0.5\n600,0.5\n", "", "eta", Err("n - 1")),
        ("a.csv", "nm,refractive index\n400,1.5\n600,1.5\n", "", "eta", Ok([1.5, 1.5])),
        ("tape7", TAPE7, "BBODY_T[K]", "radiance", Err("a temperature")),
        ("tape7", TAPE7, "TOT_TRANS", "reflectance", Err("a transmittance")),
        ("a.csv", "# transmittance\nnm,v\n400,0.5\n600,0.5\n", "", "reflectance", Err("a transmittance")),
        ("a.csv", "Wavelength,Sample 1\nnm,%R\n400,50\n600,50\n", "", "reflectance", Ok([0.5, 0.5])),
        ("a.csv", "Wavelength,Sample 1\nnm,Abs\n400,0.5\n600,0.5\n", "", "reflectance", Err("logarithms")),
        ("a.csv", "nm,pine/bark\n400,0.5\n600,0.5\n", "", "reflectance", Ok([0.5, 0.5])),
    ];
    for (file, content, column, quantity, expected) in cases {
        check(file, content, column, quantity, expected);
    }
    let said = good(&scene("a.csv", "k", "absorption"), &[("a.csv", NK)], &[]).warnings;
    assert!(said.iter().any(|warning| warning.contains("4 π k / λ")), "{said:?}");
}

/// The kinds of a file that an outside tester found read wrongly or left out without a word.
#[test]
fn common_headers_are_applied_or_refused() {
    let leaf = "Name: oak leaf\nType: vegetation\nClass: tree\nX Units: Wavelength (micrometers)\nY Units: Reflectance (percentage)\n\
                First Column: X\nNumber of X Values: 2\n\n0.4 50\n0.6 50\n";
    let cases: &[Case] = &[
        ("e.spectrum.txt", leaf, "", "reflectance", Ok([0.5, 0.5])),
        ("a.csv", ",wl,refl\n1,400,0.25\n2,600,0.75\n3,700,0.5\n", "refl", "reflectance", Ok([0.375, 0.625])),
        ("a.csv", "No.,Wavelength (nm),refl\n1,400,0.25\n2,600,0.75\n", "refl", "reflectance", Ok([0.375, 0.625])),
        ("a.csv", "X,a,refl\n1,400,0.25\n2,600,0.75\n3,700,1\n", "refl", "reflectance", Err("numbers of rows")),
        ("a.csv", "nm,alpha / cm^-1\n400,0.01\n600,0.01\n", "", "absorption", Ok([1.0, 1.0])),
        ("a.csv", "nm,mu_a_mm-1\n400,0.01\n600,0.01\n", "", "absorption", Ok([10.0, 10.0])),
        ("a.csv", "nm,alpha_cm\n400,0.01\n600,0.01\n", "", "absorption", Err("which is not applied")),
        ("a.csv", "nm,R(\u{3bb}) / %\n400,50\n600,50\n", "", "reflectance", Ok([0.5, 0.5])),
        ("a.csv", "nm,Reflectance....\n400,0.5\n600,0.5\n", "", "reflectance", Err("which is not applied")),
        ("a.csv", "# nm, %\nnm,value\n400,50\n600,50\n", "", "reflectance", Ok([0.5, 0.5])),
        ("a.csv", "Wavelength (um),Reflectance (%)\nNA,NA\n0.4,50\n0.6,50\n", "", "reflectance", Ok([0.5, 0.5])),
        ("a.csv", "wl,a,wl.1,b\n400,1,500,0.5\n600,1,700,0.5\n", "b", "reflectance", Err("wavelengths of its own")),
        ("a.csv", "wl_min,wl_max,v\n400,500,0.5\n500,600,0.5\n", "v", "reflectance", Err("values of intervals")),
        ("a.csv", "nm,Rrs\n400,0.5\n600,0.5\n", "", "reflectance", Err("per steradian")),
        ("a.csv", "nm,%T\n400,50\n600,50\n", "", "reflectance", Err("a transmittance")),
        ("a.csv", "nm,reflectance_std\n400,0.5\n600,0.5\n", "", "reflectance", Err("an error or spread")),
        ("a.csv", "nm,photon radiance\n400,2\n600,2\n", "", "radiance", Err("a number of photons")),
        ("a.csv", "nm,extinction coefficient\n400,2\n600,2\n", "", "absorption", Ok([2.0, 2.0])),
        ("a.csv", "Wavenumber 1/cm,radiance\n25000,2\n16000,2\n", "", "radiance", Ok([2.0, 2.0])),
        ("a.csv", "Position,radiance\n400,2\n600,2\n", "", "radiance", Err("no wavelength follows")),
    ];
    for (file, content, column, quantity, expected) in cases.iter().copied() {
        check(file, content, column, quantity, expected);
    }
}

/// A header's unit is applied, and so is the scene's `scale`: where that is the same factor it is seldom meant.
#[test]
fn a_scale_that_is_the_units_factor_is_told_of() {
    let told = |content: &str, quantity: &str, scale: &str| {
        let scene = scene("a.csv", "", quantity).replacen("\"a.csv\"", &format!("\"a.csv\", scale = {scale}"), 1);
        good(&scene, &[("a.csv", content)], &[]).warnings.iter().any(|warning| warning.contains("twice"))
    };
    let percent = "nm,Reflectance (%)\n400,50\n600,50\n";
    assert!(told(percent, "reflectance", "0.01"));
    assert!(!told(percent, "reflectance", "0.5") && !told("nm,R\n400,50\n600,50\n", "reflectance", "0.01"));
    assert!(told("nm,L (W/m2/sr/um)\n400,50\n600,50\n", "radiance", "1e-3"));
}
