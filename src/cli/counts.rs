//! What is said of counts of a sensor.

use std::fmt::Write;

use serde_json::{Value, json};

use super::Output;
use crate::Result;
use crate::cube::Cube;
use crate::files::shown;

/// `spectile info` of counts: what they are of, and the figures of every band.
pub fn info(cube: &Cube, output: &Output) -> Result<()> {
    let (header, channels, progress) = (cube.header(), cube.channels(), cube.progress()?);
    let attribute = |name: &str| header.attributes.get(name).unwrap_or(&Value::Null);
    let of_band = |name: &str, k: usize| attribute(name).get(k).cloned().unwrap_or_default();
    // Text, in lists of one kind.
    let netd =
        |k: usize| of_band("netd_K", k).as_str().and_then(|text| text.parse::<f64>().ok()).filter(|k| !k.is_nan());
    let [most, missing] = cube.count_range().unwrap_or_default();
    let bands = (0..channels.len()).map(|k| {
        json!({
            "band": channels.names[k],
            "bounds_nm": channels.bounds[k],
            "snr_at_mean": of_band("snr_at_mean", k),
            "nedl": of_band("nedl", k),
            "netd_k": netd(k),
            "mean_signal": of_band("mean_signal", k),
            "full_wells": of_band("full_wells", k),
            "clipped_above": of_band("clipped_above", k),
            "clipped_below": of_band("clipped_below", k),
        })
    });
    output.event(
        "done",
        json!({
            "cube": shown(cube.path()),
            "quantity": "counts",
            "size": header.size,
            "origin": header.origin,
            "tile": header.tile,
            "tiles": progress.tiles,
            "tiles_missing": progress.missing.iter().map(|tiles| [tiles.start, tiles.end]).collect::<Vec<_>>(),
            "count_most": most,
            "count_missing": missing,
            "bands": bands.collect::<Vec<_>>(),
            "attributes": header.attributes,
        }),
    )?;
    let mut text = String::new();
    let mut row = |name: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:<16} {value}");
    };
    let [width, height] = header.size;
    row("counts", cube.path().display().to_string());
    row("size", format!("{width} x {height} pixels x {} bands", channels.len()));
    if header.origin != [0, 0] {
        row("crop", format!("from column {}, row {} of the film", header.origin[0], header.origin[1]));
    }
    row("tiles", format!("{} of {} x {} pixels", progress.tiles, header.tile[0], header.tile[1]));
    let [tiles_missing, tiles] = progress.tiles_missing();
    if tiles_missing > 0 {
        row("missing tiles", format!("{tiles_missing} of {tiles}"));
    }
    row("range", format!("0 to {most}; {missing} is a pixel that is missing"));
    for k in 0..channels.len() {
        let [from, to] = channels.bounds[k];
        let number = |name: &str| of_band(name, k).as_f64().unwrap_or(f64::NAN);
        let mut figures =
            format!("{from} to {to} nm: SNR {:.4}, NEDL {:.4e} W m-2 sr-1 nm-1", number("snr_at_mean"), number("nedl"));
        if let Some(netd) = netd(k) {
            let _ = write!(figures, ", NETD {netd:.4} K at {} K", attribute("reference_temperature_K"));
        }
        row(&channels.names[k], figures);
        for (name, what) in [
            ("full_wells", "pixels with full wells"),
            ("clipped_above", "pixels above the converter's range"),
            ("clipped_below", "pixels below the converter's range"),
        ] {
            if number(name) > 0.0 {
                row("", format!("{} {what}", number(name)));
            }
        }
    }
    // What stands above already, band by band.
    let said = [
        "band_names",
        "snr_at_mean",
        "nedl",
        "netd_K",
        "full_wells",
        "clipped_above",
        "clipped_below",
        "Conventions",
        "title",
        "origin",
    ];
    for (name, value) in header.attributes.iter().filter(|(name, _)| !said.contains(&name.as_str())) {
        row(name, value.as_str().map_or_else(|| value.to_string(), str::to_owned));
    }
    output.text(&text)
}
