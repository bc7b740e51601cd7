//! The tables that are built in, under `data/` with their sources.

/// CIE 1931 2° colour matching functions: nm, x̄, ȳ, z̄, every nm from 360 to 830.
pub const CIE1931: &str = include_str!("data/cie1931_2deg_1nm.csv");
/// CIE 1964 10° colour matching functions: nm, x̄, ȳ, z̄, every nm from 360 to 830.
pub const CIE1964: &str = include_str!("data/cie1964_10deg_1nm.csv");
/// CIE 2015 2° colour matching functions: nm, x̄, ȳ, z̄, every nm from 390 to 830.
pub const CIE2015: &str = include_str!("data/cie2015_2deg_1nm.csv");
/// CIE standard illuminant D65: nm, relative power, every 5 nm from 300 to 780.
pub const D65: &str = include_str!("data/d65_300-780_5nm.csv");
/// CIE illuminants C, D50, D55 and D75: nm, relative power of each, every 5 nm from 300 to 780.
pub const DAYLIGHT: &str = include_str!("data/cie_daylight_300-780_5nm.csv");
/// CIE illuminants of lamps, FL1 to FL12, HP1 to HP5 and the LEDs: nm, relative power of each, every 5 nm from 380 to 780.
pub const LAMPS: &str = include_str!("data/cie_lamps_380-780_5nm.csv");
/// Spectral irradiance of the sun: nm, outside the atmosphere, direct through air mass 1.5 (W m⁻² nm⁻¹), from 280 to 4,000.
pub const SOLAR: &str = include_str!("data/solar_astm_g173_280-4000nm.csv");

/// The numbers of a built-in table; comments and the header are the lines that do not begin with a digit.
pub fn columns<const N: usize>(table: &'static str) -> impl Iterator<Item = [f64; N]> {
    table.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).map(|line| {
        let mut cells = line.split(',').map(|cell| cell.parse().expect("built-in tables hold numbers"));
        std::array::from_fn(|_| cells.next().expect("built-in tables are complete"))
    })
}
