//! Charts with logarithmic axes, as SVG with text as text.

use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::format::plot::superscript;
use crate::{Error, Result};

/// A line of a chart.
#[derive(Debug, Clone)]
pub struct Line {
    pub name: String,
    pub points: Vec<(f64, f64)>,
    /// Drawn thin and dashed, without marks: what others are compared with.
    pub guide: bool,
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

/// log10 of a range, with whole decades for labels.
struct Decades;

impl Decades {
    fn around(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
        let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high { 0.0..1.0 } else { (low - 0.08).min(high - 0.3)..(high + 0.08).max(low + 0.3) }
    }

    fn label(log: f64) -> String {
        let (whole, value) = (log.round(), 10f64.powf(log));
        match whole {
            w if (log - w).abs() < 1e-6 && (-3.0..4.0).contains(&w) => format!("{}", 10f64.powi(w as i32)),
            w if (log - w).abs() < 1e-6 => format!("10{}", superscript(w as i32)),
            _ => format!("{value:.2e}"),
        }
    }
}

/// A chart of `lines`, both axes logarithmic; what is not positive is left out. Axes carry `x` and `y`, with units.
pub fn log_log(title: &str, x: &str, y: &str, lines: &[Line]) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, title, x, y, lines).map_err(|error| Error::Internal(format!("chart: {error}")))?;
    Ok(svg)
}

fn draw(
    svg: &mut String,
    title: &str,
    x: &str,
    y: &str,
    lines: &[Line],
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, (860, 520)).into_drawing_area();
    root.fill(&WHITE)?;
    let all = || lines.iter().flat_map(|line| line.points.iter().copied());
    let (xs, ys) = (Decades::around(all().map(|p| p.0)), Decades::around(all().map(|p| p.1)));
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(76)
        .build_cartesian_2d(Log(xs.into()), Log(ys.into()))?;
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc(y)
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 15))
        .light_line_style(BLACK.mix(0.06))
        .draw()?;
    let mut next = 0;
    for line in lines {
        let shown = line.points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite());
        let points: Vec<(f64, f64)> = shown.map(|(x, y)| (x.log10(), y.log10())).collect();
        if line.guide {
            let style = RGBColor(90, 90, 90).stroke_width(1);
            chart
                .draw_series(DashedLineSeries::new(points, 6, 5, style))?
                .label(&line.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
            continue;
        }
        let colour = COLOURS[next % COLOURS.len()];
        next += 1;
        chart
            .draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, colour.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.2))
        .label_font(("sans-serif", 13))
        .draw()?;
    root.present()?;
    Ok(())
}

/// An axis of logarithms whose labels stand at whole decades; at 2 and 5 as well where there are few.
struct Log(RangedCoordf64);

impl Ranged for Log {
    type FormatOption = plotters::coord::ranged1d::NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.0.map(value, limit)
    }

    fn key_points<Hint: plotters::coord::ranged1d::KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let range = self.range();
        let steps: &[f64] = match range.end - range.start {
            span if span < 2.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let sparse = ((range.end - range.start) / hint.max_num_points().max(1) as f64).ceil().max(1.0) as i32;
        let decades = range.start.floor() as i32..=range.end.ceil() as i32;
        let points = decades.filter(|decade| decade.rem_euclid(sparse) == 0);
        let points = points.flat_map(|decade| steps.iter().map(move |step| f64::from(decade) + step.log10()));
        points.filter(|log| range.contains(log)).collect()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.0.range()
    }
}

impl ValueFormatter<f64> for Log {
    fn format_ext(&self, value: &f64) -> String {
        Decades::label(*value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
