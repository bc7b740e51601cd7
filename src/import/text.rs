//! Pieces of TOML as text, as a person would write them.

use glam::{DAffine3, DVec3};

/// Shortest digits that bring the number back.
pub fn number(value: f64) -> String {
    // -0 says nothing more than 0.
    let value = value + 0.0;
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value:.1}") } else { format!("{value:?}") }
}

/// A number that was calculated, without the digits that are rounding.
pub fn rounded(value: f64) -> String {
    let short: f64 = format!("{value:.9e}").parse().unwrap_or(value);
    number(short)
}

/// A bound for people: two digits, rounded up.
pub fn up(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return number(value);
    }
    let unit = 10f64.powi(value.abs().log10().floor() as i32 - 1);
    // What only rounding lifts above two digits stays.
    let digits = (value / unit * (1.0 - 1e-9)).ceil();
    let text: f64 = format!("{:.1e}", digits * unit).parse().unwrap_or(value);
    if text.fract() == 0.0 && text.abs() < 1e15 { format!("{text}") } else { format!("{text:?}") }
}

/// A share as per cent, likewise.
pub fn percent(share: f64) -> String {
    format!("{} %", up(100.0 * share))
}

pub fn list(values: impl IntoIterator<Item = f64>) -> String {
    format!("[{}]", values.into_iter().map(number).collect::<Vec<_>>().join(", "))
}

pub fn vector(v: DVec3) -> String {
    // What is beside the largest only rounding is 0.
    let largest = v.abs().max_element();
    let clean = |x: f64| if x.abs() < 1e-12 * largest { 0.0 } else { x };
    format!("[{}]", v.to_array().map(|x| rounded(clean(x))).join(", "))
}

/// `{ matrix = [...] }`, row by row.
pub fn transform(affine: &DAffine3) -> String {
    let (m, t) = (affine.matrix3, affine.translation);
    let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]].map(rounded).join(", ");
    format!("{{ matrix = [{}, {}, {}, 0, 0, 0, 1] }}", row(0), row(1), row(2))
}

/// A basic string.
pub fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", c as u32)),
            c => out.push(c),
        }
    }
    out + "\""
}

/// A key, bare where TOML allows that.
pub fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { name.to_owned() } else { quoted(name) }
}

/// A name as a file may have it.
pub fn file_name(name: &str) -> String {
    let clean: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' }).take(60).collect();
    let clean = clean.trim_matches(|c| c == '.' || c == '-').to_owned();
    if clean.is_empty() { "unnamed".to_owned() } else { clean }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_toml() {
        for name in ["a", "a b", "ü", "\"", "\\n\n\u{1}", ""] {
            let table: toml::Table = format!("{} = {}", key(name), quoted(name)).parse().unwrap();
            assert_eq!(table[name].as_str(), Some(name));
        }
        for value in [0.0, -0.0, 1.0, 1e300, 1e-300, 0.1, -12345678.9, f64::MIN_POSITIVE] {
            let table: toml::Table = format!("a = {}", number(value)).parse().unwrap();
            assert_eq!(table["a"].as_float(), Some(value + 0.0));
        }
        assert_eq!(vector(DVec3::new(1.0 / 3.0, 1e-17, -2.0)), "[0.3333333333, 0.0, -2.0]");
        assert_eq!(file_name("../a b.png"), "_a_b.png");
        let bounds = [0.0, 0.03, 0.0301, 1.0, 99.1, 100.0, 101.0].map(up);
        assert_eq!(bounds, ["0.0", "0.03", "0.031", "1", "100", "100", "110"]);
    }
}
