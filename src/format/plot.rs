//! Plots as SVG, with text as text: no fonts are needed to make them.

use std::path::Path;

use plotters::prelude::*;

use crate::files::output::Product;
use crate::spectral::Channels;
use crate::{Error, Result};

/// What [`spectrum`] makes.
pub const PLOT: Product = Product {
    name: "a plot of a spectrum as SVG",
    extensions: &["svg"],
    is_stream: true,
    is_folder: false,
    check: is_plot,
};

/// The labels of both axes: no other drawing has them.
const AXES: [&str; 2] = ["wavelength (nm)", "spectral radiance ("];

fn is_plot(path: &Path) -> std::result::Result<(), String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("cannot be read as text ({error})"))?;
    let is_svg = text.trim_start().starts_with("<svg");
    if is_svg && AXES.iter().all(|label| text.contains(label)) { Ok(()) } else { Err("is another drawing".into()) }
}

/// An SVG plot of one spectrum over its channels: every channel a level over its own interval, joined where intervals
/// meet, with a band of two standard errors to both sides where `errors` has them. `radiance` in W m⁻² sr⁻¹ nm⁻¹; what is
/// not finite is left out.
pub fn spectrum(channels: &Channels, radiance: &[f32], errors: Option<&[f32]>, title: &str) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, channels, radiance, errors, title).map_err(|error| Error::Internal(format!("plot: {error}")))?;
    Ok(svg)
}

fn draw(
    svg: &mut String,
    channels: &Channels,
    radiance: &[f32],
    errors: Option<&[f32]>,
    title: &str,
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    // Two standard errors below and above, where they are known.
    let band: Vec<(f64, f64)> = (0..radiance.len())
        .map(|k| {
            let value = f64::from(radiance[k]);
            let error = errors.map_or(f64::NAN, |errors| 2.0 * f64::from(errors[k]));
            if error.is_finite() { (value - error, value + error) } else { (value, value) }
        })
        .collect();
    let finite = || band.iter().flat_map(|(low, high)| [*low, *high]).filter(|v| v.is_finite());
    let largest = finite().fold(0.0, |a, b| f64::max(a, b.abs()));
    // In powers of 1000, so that the axis has numbers for people whatever the level.
    let exponent = if largest > 0.0 { (largest.log10() / 3.0).floor() as i32 * 3 } else { 0 };
    // Not divided by 10^exponent, which underflows for the smallest f32.
    let scaled = |v: f64| v * 10f64.powi(-exponent);
    let low = 1.05 * scaled(finite().fold(0.0, f64::min));
    let high = if largest > 0.0 { 1.05 * scaled(finite().fold(0.0, f64::max)) } else { 1.0 };
    let from = channels.bounds.iter().map(|b| b[0]).fold(f64::INFINITY, f64::min);
    let to = channels.bounds.iter().map(|b| b[1]).fold(f64::NEG_INFINITY, f64::max);

    let root = SVGBackend::with_string(svg, (960, 540)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(48)
        .y_label_area_size(80)
        .build_cartesian_2d(from..to, low..high)?;
    let decimals = ((10.0 / (to - from)).log10().ceil().max(0.0) as usize).min(9);
    let unit = "W m⁻² sr⁻¹ nm⁻¹";
    let [x_label, y_label] = AXES;
    let y_label = match exponent {
        0 => format!("{y_label}{unit})"),
        _ => format!("{y_label}10{} {unit})", superscript(exponent)),
    };
    chart
        .configure_mesh()
        .x_desc(x_label)
        .y_desc(y_label)
        .x_label_formatter(&|nm| format!("{nm:.decimals$}"))
        .label_style(("sans-serif", 14))
        .axis_desc_style(("sans-serif", 16))
        .light_line_style(BLACK.mix(0.06))
        .draw()?;
    if errors.is_some() {
        for (k, &(low, high)) in band.iter().enumerate().filter(|(_, (low, high))| low < high) {
            let [from, to] = channels.bounds[k];
            let corners = [(from, scaled(low)), (to, scaled(high))];
            chart.draw_series([Rectangle::new(corners, RGBColor(0x1f, 0x4e, 0x9e).mix(0.25).filled())])?;
        }
    }
    for line in levels(channels, radiance) {
        let points = line.into_iter().map(|(nm, v)| (nm, scaled(v)));
        chart.draw_series(LineSeries::new(points, RGBColor(0x1f, 0x4e, 0x9e).stroke_width(2)))?;
    }
    root.present()?;
    Ok(())
}

/// The lines to draw: both ends of every channel, one line as long as each channel begins where the last one ended.
fn levels(channels: &Channels, radiance: &[f32]) -> Vec<Vec<(f64, f64)>> {
    let mut order: Vec<usize> = (0..channels.len()).filter(|&k| radiance[k].is_finite()).collect();
    order.sort_by(|&a, &b| channels.bounds[a][0].total_cmp(&channels.bounds[b][0]));
    let mut lines: Vec<Vec<(f64, f64)>> = Vec::new();
    for k in order {
        let ([from, to], value) = (channels.bounds[k], f64::from(radiance[k]));
        match lines.last_mut() {
            Some(line) if line.last().is_some_and(|end| (end.0 - from).abs() <= 1e-9 * from) => {
                line.extend([(from, value), (to, value)]);
            }
            _ => lines.push(vec![(from, value), (to, value)]),
        }
    }
    lines
}

/// 10 to this power, as it is written.
pub fn superscript(number: i32) -> String {
    let sign = if number < 0 { "⁻" } else { "" };
    let digits = number.unsigned_abs().to_string();
    let digit = |c: char| ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c as usize - '0' as usize];
    sign.chars().chain(digits.chars().map(digit)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_labels_units_and_scale() {
        let channels = Channels::equal(400.0, 700.0, 3);
        let svg = spectrum(&channels, &[1e-5, 4e-5, 2e-5], None, "pixel <1> & \"2\"").expect("plot");
        assert!(svg.contains("wavelength (nm)") && svg.contains("10⁻⁶ W m⁻² sr⁻¹ nm⁻¹"), "{svg}");
        assert!(svg.contains("<text") && svg.contains("pixel &lt;1&gt; &amp;"), "{svg}");
        assert!(svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn errors_are_a_band_around_the_levels() {
        let channels = Channels::equal(400.0, 700.0, 3);
        let bands = |errors: Option<&[f32]>| {
            let svg = spectrum(&channels, &[1.0, 4.0, 2.0], errors, "p").expect("plot");
            svg.matches("opacity=\"0.25\"").count()
        };
        assert_eq!((bands(None), bands(Some(&[f32::NAN, 0.5, 0.25])), bands(Some(&[0.0; 3]))), (0, 2, 0));
    }

    #[test]
    fn levels_join_where_channels_meet() {
        let channels =
            Channels::from_bounds(vec![[500.0, 600.0], [400.0, 500.0], [8000.0, 9000.0], [550.0, 560.0]], None);
        let lines = levels(&channels, &[2.0, 1.0, 3.0, f32::NAN]);
        let joined = vec![(400.0, 1.0), (500.0, 1.0), (500.0, 2.0), (600.0, 2.0)];
        assert_eq!(lines, [joined, vec![(8000.0, 3.0), (9000.0, 3.0)]]);
    }

    #[test]
    fn extreme_spectra_are_drawn() {
        let narrow = Channels::from_bounds(vec![[19_999.999, 20_000.0]], None);
        for values in [[0.0], [f32::MAX], [f32::from_bits(1)], [-3.0], [f32::NAN]] {
            let svg = spectrum(&narrow, &values, None, "one channel").expect("plot");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{values:?}");
        }
        assert_eq!([superscript(-45), superscript(36)], ["⁻⁴⁵", "³⁶"]);
    }
}
