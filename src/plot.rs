//! Plots as SVG.

use plotters::prelude::*;

/// One curve of a plot.
#[derive(Debug, Clone, Copy)]
pub struct Curve<'a> {
    /// What the legend says; nothing where it is empty.
    pub label: &'a str,
    /// Horizontal values; NaN is left out.
    pub x: &'a [f64],
    /// Vertical values; NaN is left out.
    pub y: &'a [f64],
    /// Position in the palette.
    pub color: usize,
}

/// Colours that stay apart for the colour-blind (Okabe and Ito) and in print.
const PALETTE: [RGBColor; 4] =
    [RGBColor(40, 40, 40), RGBColor(213, 94, 0), RGBColor(0, 114, 178), RGBColor(0, 158, 115)];
/// More points than this per curve are not seen.
const MOST_POINTS: usize = 1200;

/// A plot of curves over a common axis, as an SVG text.
pub fn plot(title: &str, x_label: &str, y_label: &str, curves: &[Curve]) -> String {
    scatter(title, x_label, y_label, &[], curves)
}

/// A plot of points and of curves, as an SVG text.
pub fn scatter(title: &str, x_label: &str, y_label: &str, dots: &[Curve], curves: &[Curve]) -> String {
    let mut svg = String::new();
    draw(&mut svg, title, x_label, y_label, dots, curves).expect("text takes every drawing");
    svg
}

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn draw(svg: &mut String, title: &str, x_label: &str, y_label: &str, dots: &[Curve], curves: &[Curve]) -> Drawn {
    let area = SVGBackend::with_string(svg, (760, 340)).into_drawing_area();
    let all = || dots.iter().chain(curves);
    let range = |pick: fn(&Curve) -> Vec<f64>, above: f64| padded(all().flat_map(pick), above);
    let labelled = all().filter(|curve| !curve.label.is_empty()).count();
    // Room for the legend, so that it hides nothing.
    let above = if labelled > 1 { 0.1 + 0.09 * labelled as f64 } else { 0.05 };
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 17))
        .margin(10)
        .x_label_area_size(38)
        .y_label_area_size(62)
        .build_cartesian_2d(range(|c| c.x.to_vec(), 0.02), range(|c| c.y.to_vec(), above))?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_desc(x_label)
        .y_desc(y_label)
        .label_style(("sans-serif", 13))
        .x_labels(8)
        .y_labels(6)
        .draw()?;
    for curve in dots {
        let color = PALETTE[curve.color % PALETTE.len()];
        let circles = points(curve).into_iter().map(|at| Circle::new(at, 2, color.filled()));
        let drawn = chart.draw_series(circles)?;
        if !curve.label.is_empty() {
            drawn.label(curve.label).legend(move |(x, y)| Circle::new((x + 8, y), 3, color.filled()));
        }
    }
    for curve in curves {
        let color = PALETTE[curve.color % PALETTE.len()];
        let drawn = chart.draw_series(LineSeries::new(points(curve), color.stroke_width(1)))?;
        if !curve.label.is_empty() {
            drawn
                .label(curve.label)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(3)));
        }
    }
    if labelled > 1 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .label_font(("sans-serif", 13))
            .draw()?;
    }
    area.present()
}

/// Range of finite values with a little room below and the given share of room above.
fn padded(values: impl Iterator<Item = f64>, above: f64) -> std::ops::Range<f64> {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return 0.0..1.0;
    }
    let size = (high - low).max(1e-9 * high.abs().max(1.0));
    low - 0.02 * size..high + above * size
}

/// The points of a curve that can be drawn, thinned where there are more than can be seen.
fn points(curve: &Curve) -> Vec<(f64, f64)> {
    let all = curve.x.iter().copied().zip(curve.y.iter().copied());
    let finite: Vec<_> = all.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let stride = finite.len().div_ceil(MOST_POINTS).max(1);
    finite.into_iter().step_by(stride).collect()
}
