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
const PALETTE: [RGBColor; 5] =
    [RGBColor(40, 40, 40), RGBColor(213, 94, 0), RGBColor(0, 114, 178), RGBColor(0, 158, 115), RGBColor(204, 121, 167)];
/// More points than this per curve are not seen.
const MOST_POINTS: usize = 1200;

/// One chart of a picture.
#[derive(Debug, Clone, Default)]
pub struct Panel<'a> {
    /// What stands above it.
    pub title: &'a str,
    /// Name and unit of the horizontal axis.
    pub x_label: &'a str,
    /// Name and unit of the vertical axis.
    pub y_label: &'a str,
    /// What is drawn as lines.
    pub curves: Vec<Curve<'a>>,
    /// What is drawn as dots.
    pub dots: Vec<Curve<'a>>,
    /// Whether the horizontal axis is logarithmic.
    pub logarithmic: bool,
    /// Whether room is left for a legend; without a label a curve is not in it.
    pub legend: bool,
    /// More room above the curves than usual, as a share of their range.
    pub above: f64,
}

/// Width and height of one chart, pixels.
const SIZE: (u32, u32) = (760, 340);

/// A plot of curves over a common axis, as an SVG text.
pub fn plot(title: &str, x_label: &str, y_label: &str, curves: &[Curve]) -> String {
    let legend = curves.len() > 1;
    panels(&[Panel { title, x_label, y_label, curves: curves.to_vec(), legend, ..Panel::default() }])
}

/// A plot of points and of curves, as an SVG text.
pub fn scatter(title: &str, x_label: &str, y_label: &str, dots: &[Curve], curves: &[Curve]) -> String {
    let (dots, curves) = (dots.to_vec(), curves.to_vec());
    let legend = dots.iter().chain(&curves).filter(|curve| !curve.label.is_empty()).count() > 1;
    panels(&[Panel { title, x_label, y_label, curves, dots, legend, ..Panel::default() }])
}

/// Charts one below the other, as an SVG text.
pub fn panels(panels: &[Panel]) -> String {
    let mut svg = String::new();
    draw(&mut svg, panels).expect("text takes every drawing");
    svg
}

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn draw(svg: &mut String, panels: &[Panel]) -> Drawn {
    #[allow(clippy::cast_possible_truncation)]
    let height = SIZE.1 * panels.len() as u32;
    let area = SVGBackend::with_string(svg, (SIZE.0, height)).into_drawing_area();
    for (area, panel) in area.split_evenly((panels.len(), 1)).iter().zip(panels) {
        let all = || panel.curves.iter().chain(&panel.dots);
        // Room for the legend, so that it hides nothing.
        let labels = all().filter(|curve| !curve.label.is_empty()).count();
        let above = panel.above + if panel.legend { 0.1 + 0.09 * labels as f64 } else { 0.05 };
        let x = padded(all().flat_map(|c| c.x.iter().copied()), 0.02);
        let y = padded(all().flat_map(|c| c.y.iter().copied()), above);
        let mut chart = ChartBuilder::on(area);
        let chart =
            chart.caption(panel.title, ("sans-serif", 17)).margin(10).x_label_area_size(38).y_label_area_size(62);
        if panel.logarithmic {
            let (low, high) = finite_range(all().flat_map(|c| c.x.iter().copied()).filter(|x| *x > 0.0));
            let range = if low < high { low..high } else { 0.1..10.0 };
            draw_panel(chart.build_cartesian_2d(range.log_scale(), y)?, panel)?;
        } else {
            draw_panel(chart.build_cartesian_2d(x, y)?, panel)?;
        }
    }
    area.present()
}

type Chart<'a, X> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, plotters::coord::types::RangedCoordf64>>;

fn draw_panel<'a, X>(mut chart: Chart<'a, X>, panel: &Panel) -> Drawn
where
    X: Ranged<ValueType = f64> + plotters::coord::ranged1d::ValueFormatter<f64> + 'a,
{
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_desc(panel.x_label)
        .y_desc(panel.y_label)
        .label_style(("sans-serif", 13))
        .x_labels(8)
        .y_labels(6)
        .draw()?;
    for curve in &panel.curves {
        let color = PALETTE[curve.color % PALETTE.len()];
        let drawn = chart.draw_series(LineSeries::new(points(curve), color.stroke_width(1)))?;
        if !curve.label.is_empty() {
            drawn
                .label(curve.label)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(3)));
        }
    }
    for curve in &panel.dots {
        let color = PALETTE[curve.color % PALETTE.len()];
        let dots = points(curve).into_iter().map(|at| Circle::new(at, 3, color.filled()));
        let drawn = chart.draw_series(dots)?;
        if !curve.label.is_empty() {
            drawn.label(curve.label).legend(move |(x, y)| Circle::new((x + 8, y), 3, color.filled()));
        }
    }
    if panel.legend {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .label_font(("sans-serif", 13))
            .draw()?;
    }
    Ok(())
}

/// Range of finite values with a little room below and the given share of room above.
fn padded(values: impl Iterator<Item = f64>, above: f64) -> std::ops::Range<f64> {
    let (low, high) = finite_range(values);
    if low > high {
        return 0.0..1.0;
    }
    let size = (high - low).max(1e-9 * high.abs().max(1.0));
    low - 0.02 * size..high + above * size
}

/// Smallest and largest finite value; the wrong way round where there is none.
fn finite_range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// The points of a curve that can be drawn, thinned where there are more than can be seen.
fn points(curve: &Curve) -> Vec<(f64, f64)> {
    let all = curve.x.iter().copied().zip(curve.y.iter().copied());
    let finite: Vec<_> = all.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let stride = finite.len().div_ceil(MOST_POINTS).max(1);
    finite.into_iter().step_by(stride).collect()
}
