//! Plots as SVG, with text as text: no fonts are needed to make them.

use std::ops::Range;
use std::path::Path;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
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
    has_axes(path, AXES)
}

fn has_axes(path: &Path, axes: [&str; 2]) -> std::result::Result<(), String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("cannot be read as text ({error})"))?;
    let is_svg = text.trim_start().starts_with("<svg");
    if is_svg && axes.iter().all(|label| text.contains(label)) { Ok(()) } else { Err("is another drawing".into()) }
}

/// What [`mtf`] makes.
pub const MTF_PLOT: Product = Product {
    name: "a plot of transfer functions as SVG",
    extensions: &["svg"],
    is_stream: true,
    is_folder: false,
    check: is_mtf_plot,
};

const MTF_AXES: [&str; 2] = ["cycles/mm on the detector", "modulation transfer"];

fn is_mtf_plot(path: &Path) -> std::result::Result<(), String> {
    has_axes(path, MTF_AXES)
}

/// A line of a plot.
#[derive(Debug, Clone)]
pub struct Line {
    /// As the legend has it.
    pub name: String,
    pub points: Vec<(f64, f64)>,
    /// Drawn thin and dashed, without marks: what others are compared with.
    pub guide: bool,
}

/// A plot of `lines`, both axes logarithmic, with a mark at every point; what is not positive is left out. Axes carry `x` and
/// `y`, with units.
pub fn log_log(title: &str, x: &str, y: &str, lines: &[Line]) -> Result<String> {
    let all = || lines.iter().flat_map(|line| line.points.iter());
    let mut plot = Plot::new(title, Axis::log(x, all().map(|p| p.0)), Axis::log(y, all().map(|p| p.1)));
    plot.add(lines, Stroke::Marked);
    plot.draw()
}

/// A plot of modulation transfer functions: of `lines` the points are cycles/mm on the detector, and the share of contrast that is left.
pub fn mtf(title: &str, lines: &[Line]) -> Result<String> {
    let highest = lines.iter().flat_map(|line| &line.points).map(|point| point.0).fold(0.0, f64::max);
    let mut plot = Plot::new(title, Axis::linear(MTF_AXES[0], 0.0..highest), Axis::linear(MTF_AXES[1], 0.0..1.02));
    plot.add(lines, Stroke::Plain);
    plot.draw()
}

/// A plot of one spectrum over its channels: every channel a level over its own interval, joined where intervals meet, with
/// a band of two standard errors to both sides where `errors` has them. `radiance` in W m⁻² sr⁻¹ nm⁻¹; what is not finite
/// is left out.
pub fn spectrum(channels: &Channels, radiance: &[f32], errors: Option<&[f32]>, title: &str) -> Result<String> {
    // Two standard errors below and above, where they are known.
    let bands: Vec<[f64; 2]> = (0..radiance.len())
        .map(|k| {
            let value = f64::from(radiance[k]);
            let error = errors.map_or(f64::NAN, |errors| 2.0 * f64::from(errors[k]));
            if error.is_finite() { [value - error, value + error] } else { [value; 2] }
        })
        .collect();
    let [from, to] = channels.hull().expect("a cube has channels");
    let radiances = Axis::from_zero("spectral radiance", "W m⁻² sr⁻¹ nm⁻¹", bands.iter().flatten().copied());
    let mut plot = Plot::new(title, Axis::linear(AXES[0], from..to), radiances);
    for (k, [low, high]) in bands.into_iter().enumerate().filter(|(_, [low, high])| low < high) {
        let [from, to] = channels.bounds[k];
        plot.boxes.push(([from, low], [to, high]));
    }
    let line = |points| Curve { name: None, points, colour: COLOURS[0], stroke: Stroke::Plain };
    plot.curves.extend(levels(channels, radiance).into_iter().map(line));
    plot.draw()
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

/// Colours that differ to all eyes (Okabe and Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(120, 120, 120),
];
const GUIDE: RGBColor = RGBColor(90, 90, 90);

/// What is drawn, whatever it shows.
struct Plot {
    title: String,
    x: Axis,
    y: Axis,
    /// Two opposite corners each, behind the curves.
    boxes: Vec<([f64; 2], [f64; 2])>,
    curves: Vec<Curve>,
}

struct Curve {
    /// In the legend, if it is to stand there.
    name: Option<String>,
    points: Vec<(f64, f64)>,
    colour: RGBColor,
    stroke: Stroke,
}

#[derive(Clone, Copy, PartialEq)]
enum Stroke {
    Plain,
    /// With a dot at every point.
    Marked,
    /// And thin.
    Dashed,
}

impl Plot {
    fn new(title: &str, x: Axis, y: Axis) -> Plot {
        Plot { title: title.to_owned(), x, y, boxes: Vec::new(), curves: Vec::new() }
    }

    /// Adds lines in colours that differ; guides are dashed.
    fn add(&mut self, lines: &[Line], stroke: Stroke) {
        let mut colours = COLOURS.into_iter().cycle();
        for Line { name, points, guide } in lines {
            let (colour, stroke) = match guide {
                true => (GUIDE, Stroke::Dashed),
                false => (colours.next().unwrap_or(GUIDE), stroke),
            };
            self.curves.push(Curve { name: Some(name.clone()), points: points.clone(), colour, stroke });
        }
    }

    fn draw(&self) -> Result<String> {
        let mut svg = String::new();
        self.draw_into(&mut svg).map_err(|error| Error::Internal(format!("plot: {error}")))?;
        Ok(svg)
    }

    fn draw_into(&self, svg: &mut String) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let root = SVGBackend::with_string(svg, (960, 540)).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, ("sans-serif", 20))
            .margin(16)
            .x_label_area_size(48)
            .y_label_area_size(80)
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        chart
            .configure_mesh()
            .x_desc(&self.x.name)
            .y_desc(&self.y.name)
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 16))
            .light_line_style(BLACK.mix(0.06))
            .draw()?;

        let place = |x: f64, y: f64| Some((self.x.place(x)?, self.y.place(y)?));
        let corners = self.boxes.iter().filter_map(|(a, b)| Some([place(a[0], a[1])?, place(b[0], b[1])?]));
        chart.draw_series(corners.map(|corners| Rectangle::new(corners, COLOURS[0].mix(0.25).filled())))?;
        for Curve { name, points, colour, stroke } in &self.curves {
            let points: Vec<(f64, f64)> = points.iter().filter_map(|(x, y)| place(*x, *y)).collect();
            let style = colour.stroke_width(if *stroke == Stroke::Dashed { 1 } else { 2 });
            let drawn = match stroke {
                Stroke::Dashed => chart.draw_series(DashedLineSeries::new(points.iter().copied(), 6, 5, style))?,
                Stroke::Plain | Stroke::Marked => chart.draw_series(LineSeries::new(points.iter().copied(), style))?,
            };
            if let Some(name) = name {
                drawn.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
            }
            if *stroke == Stroke::Marked {
                chart.draw_series(points.into_iter().map(|point| Circle::new(point, 3, colour.filled())))?;
            }
        }
        if self.curves.iter().any(|curve| curve.name.is_some()) {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::LowerLeft)
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.2))
                .label_font(("sans-serif", 14))
                .draw()?;
        }
        root.present()?;
        Ok(())
    }
}

/// An axis: what stands at it, and where values come to lie.
#[derive(Clone)]
struct Axis {
    name: String,
    places: RangedCoordf64,
    scale: Scale,
}

#[derive(Clone, Copy)]
enum Scale {
    /// The place of a value is it times 10^-exponent; labels have so many decimals, or as many as they need.
    Linear { exponent: i32, decimals: Option<usize> },
    /// The place of a value is its log10. Labels stand at whole decades; at 2 and 5 as well where there are few.
    Log,
}

impl Axis {
    /// From end to end.
    fn linear(name: &str, ends: Range<f64>) -> Axis {
        let decimals = ((10.0 / (ends.end - ends.start)).log10().ceil().max(0.0) as usize).min(9);
        let scale = Scale::Linear { exponent: 0, decimals: Some(decimals) };
        Axis { name: name.into(), places: ends.into(), scale }
    }

    /// From zero, or the least value, to a little above the greatest; in powers of 1000 of `unit`, so that there are numbers for
    /// people whatever the level. What is not finite does not count.
    fn from_zero(name: &str, unit: &str, values: impl Iterator<Item = f64>) -> Axis {
        let finite = values.filter(|v| v.is_finite());
        let [low, high] = finite.fold([0.0; 2], |[low, high], v| [f64::min(low, v), f64::max(high, v)]);
        let largest = high.max(-low);
        let exponent = if largest > 0.0 { (largest.log10() / 3.0).floor() as i32 * 3 } else { 0 };
        let name = match exponent {
            0 => format!("{name} ({unit})"),
            _ => format!("{name} (10{} {unit})", superscript(exponent)),
        };
        // Not divided by 10^exponent, which underflows for the smallest f32.
        let ends = [low, high].map(|v| 1.05 * (v * 10f64.powi(-exponent)));
        let places = if largest > 0.0 { ends[0]..ends[1] } else { 0.0..1.0 };
        Axis { name, places: places.into(), scale: Scale::Linear { exponent, decimals: None } }
    }

    /// A little more than the values that have a logarithm.
    fn log(name: &str, values: impl Iterator<Item = f64>) -> Axis {
        let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let places = if low > high { 0.0..1.0 } else { (low - 0.08).min(high - 0.3)..(high + 0.08).max(low + 0.3) };
        Axis { name: name.into(), places: places.into(), scale: Scale::Log }
    }

    /// Where a value lies; nowhere if it is not finite, or has no logarithm where one is needed.
    fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Linear { exponent, .. } => value * 10f64.powi(-exponent),
            Scale::Log => value.log10(),
        };
        place.is_finite().then_some(place)
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, limit: (i32, i32)) -> i32 {
        self.places.map(place, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let Scale::Log = self.scale else { return self.places.key_points(hint) };
        let range = self.range();
        let span = range.end - range.start;
        let steps: &[f64] = if span < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let sparse = (span / hint.max_num_points().max(1) as f64).ceil().max(1.0) as i32;
        let decades = range.start.floor() as i32..=range.end.ceil() as i32;
        let points = decades.filter(|decade| decade.rem_euclid(sparse) == 0);
        let points = points.flat_map(|decade| steps.iter().map(move |step| f64::from(decade) + step.log10()));
        points.filter(|log| range.contains(log)).collect()
    }

    fn range(&self) -> Range<f64> {
        self.places.range()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, place: &f64) -> String {
        let whole = place.round();
        let is_whole = (place - whole).abs() < 1e-6;
        match self.scale {
            Scale::Linear { decimals: Some(decimals), .. } => format!("{place:.decimals$}"),
            Scale::Linear { decimals: None, .. } => RangedCoordf64::format(place),
            Scale::Log if is_whole && (-3.0..4.0).contains(&whole) => format!("{}", 10f64.powi(whole as i32)),
            Scale::Log if is_whole => format!("10{}", superscript(whole as i32)),
            Scale::Log => format!("{:.2e}", 10f64.powf(*place)),
        }
    }
}

/// 10 to this power, as it is written.
fn superscript(number: i32) -> String {
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

    #[test]
    fn axes_are_decades_with_units() {
        let points = vec![(1.0, 1e-3), (10.0, 1e-4), (100.0, 0.0), (1000.0, 1e-6)];
        let line = |guide| Line { name: if guide { "guide" } else { "a <b>" }.into(), points: points.clone(), guide };
        let svg = log_log("Error", "time (s)", "relMSE", &[line(false), line(true)]).expect("a chart");
        for text in ["time (s)", "relMSE", "a &lt;b&gt;", "guide", "10⁻⁴"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert!(svg.lines().any(|line| line.trim() == "100"), "no decade: {svg}");
        // Three points of the line: the fourth is not positive.
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(!svg.contains("NaN"));
        assert!(log_log("empty", "x", "y", &[]).expect("a chart").contains("empty"));
    }
}
