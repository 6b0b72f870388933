//! Figures of chapter 4, drawn from the reconstructed points and the models.

use super::quantities::{Basis, Muscle, STROKE};
use crate::Result;
use crate::comparison::dynamic::TRAJECTORIES;
use crate::comparison::errors::{Class, force, levels, pressure};
use crate::identification::points::Point;
use crate::identification::structure::forces;
use crate::muscle::ForceModelName;
use crate::parameters::Parameters;
use crate::plot::{Curve, Panel, panels};
use crate::{Error, GRAVITY};

/// Loads that are drawn, kg.
const LOADS: [f64; 4] = [10.0, 30.0, 50.0, 80.0];
/// Points of a curve.
const SMOOTH: usize = 80;

/// Values over others, with what they are called and a colour.
struct Series {
    label: String,
    x: Vec<f64>,
    y: Vec<f64>,
    color: usize,
    dots: bool,
}

impl Series {
    fn of(label: impl Into<String>, color: usize, pairs: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (x, y) = pairs.into_iter().unzip();
        Self { label: label.into(), x, y, color, dots: false }
    }

    fn dotted(self) -> Self {
        Self { dots: true, ..self }
    }
}

/// A chart: title, axes, and what is in it.
struct Chart {
    title: String,
    axes: [&'static str; 2],
    series: Vec<Series>,
}

/// The SVG of a figure by its file name.
///
/// # Errors
/// Those of presets and simulations; [`Error::UnknownPreset`] for a figure that there is not.
pub fn draw(name: &str, basis: &Basis) -> Result<String> {
    let charts = match name {
        "isotonic.svg" => of_both(basis, isotonic),
        "diameter.svg" => of_both(basis, diameter),
        "isobaric.svg" => of_both(basis, isobaric),
        "isometric.svg" => of_both(basis, isometric),
        "virtual_area.svg" => of_both(basis, virtual_area),
        "elastic_force.svg" => of_both(basis, elastic_force),
        "stroke.svg" => of_both(basis, stroke),
        "stiffness.svg" => try_both(basis, stiffness)?,
        "spring.svg" => try_both(basis, |muscle| of_preset(muscle, "spring"))?,
        "mckibben.svg" => try_both(basis, |muscle| of_preset(muscle, "mckibben"))?,
        "tondu_lopez.svg" => try_both(basis, |muscle| of_preset(muscle, "tondu-lopez"))?,
        "modulus.svg" => modulus(basis)?,
        "improved_mckibben.svg" => of_both(basis, improved),
        "cross.svg" => crossed(basis),
        "low_pressure.svg" => low_pressure(basis)?,
        "dynamic.svg" => dynamic(basis)?,
        _ => return Err(Error::UnknownPreset { name: name.to_owned(), known: String::new() }),
    };
    Ok(drawn(&charts))
}

fn drawn(charts: &[Chart]) -> String {
    panels(&charts.iter().map(Chart::panel).collect::<Vec<_>>())
}

impl Chart {
    fn panel(&self) -> Panel<'_> {
        let of = |dots: bool| {
            let wanted = self.series.iter().filter(|series| series.dots == dots);
            wanted.map(|s| Curve { label: &s.label, x: &s.x, y: &s.y, color: s.color }).collect()
        };
        let [x_label, y_label] = self.axes;
        let (curves, dots) = (of(false), of(true));
        Panel { title: &self.title, x_label, y_label, curves, dots, legend: true, above: 0.15, ..Panel::default() }
    }
}

fn of_both(basis: &Basis, chart: impl Fn(&Muscle) -> Chart) -> Vec<Chart> {
    basis.muscles.iter().map(chart).collect()
}

fn try_both(basis: &Basis, chart: impl Fn(&Muscle) -> Result<Chart>) -> Result<Vec<Chart>> {
    basis.muscles.iter().map(chart).collect()
}

fn title(muscle: &Muscle, what: &str) -> String {
    format!("{what}, {} (reconstructed)", muscle.above.name.to_uppercase())
}

/// The points that share a load or a pressure, in their order.
fn members<'a>(class: &'a Class, points: &'a [Point]) -> impl Iterator<Item = &'a Point> {
    class.members.iter().map(|&k| &points[k])
}

/// The points of the loads that are drawn: load in kg, position among them, points.
fn by_load(points: &[Point]) -> Vec<(f64, usize, Vec<Point>)> {
    let classes = levels(points, force).unwrap_or_default();
    let of = |(color, kg): (usize, &f64)| {
        let class = classes.iter().find(|class| (class.value - kg * GRAVITY).abs() < 1.0)?;
        Some((*kg, color, members(class, points).copied().collect()))
    };
    LOADS.iter().enumerate().filter_map(of).collect()
}

/// Evenly spaced contractions in m from a little stretched to a quarter shorter.
fn contractions(muscle: &Muscle) -> impl Iterator<Item = f64> + use<> {
    let rest = muscle.printed.muscle.rest_length;
    (0..=SMOOTH).map(move |k| rest * (-0.02 + (STROKE + 0.02) * k as f64 / SMOOTH as f64))
}

const OVER_PRESSURE: [&str; 2] = ["gauge pressure [bar]", "contraction [mm]"];
const FORCE: [&str; 2] = ["gauge pressure [bar]", "force [N]"];

fn isotonic(muscle: &Muscle) -> Chart {
    let mut series = Vec::new();
    for (kg, color, points) in by_load(&muscle.points) {
        let pairs = points.iter().map(|point| (point.gauge_pressure / 1e5, point.contraction * 1e3));
        series.push(Series::of(format!("{kg} kg"), color, pairs));
        let pairs = points.iter().map(|point| (point.gauge_pressure / 1e5, point.contraction * 1e3));
        series.push(Series::of("", color, pairs).dotted());
    }
    Chart { title: title(muscle, "Isotonic curves"), axes: OVER_PRESSURE, series }
}

fn diameter(muscle: &Muscle) -> Chart {
    let mut series = Vec::new();
    for (kg, color, points) in by_load(&muscle.points) {
        let at = |point: &Point| (point.gauge_pressure / 1e5, muscle.printed.muscle.diameter(point.contraction) * 1e3);
        series.push(Series::of(format!("{kg} kg"), color, points.iter().map(at)));
        series.push(Series::of("", color, points.iter().map(at)).dotted());
    }
    let axes = ["gauge pressure [bar]", "diameter of the braid [mm]"];
    Chart { title: title(muscle, "Diameter"), axes, series }
}

fn isobaric(muscle: &Muscle) -> Chart {
    let classes = levels(&muscle.points, pressure).unwrap_or_default();
    let mut series = Vec::new();
    for (color, bar) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
        let Some(class) = classes.iter().find(|class| (class.value - bar * 1e5).abs() < 1e3) else { continue };
        let at = |point: &Point| (point.force, point.contraction * 1e3);
        series.push(Series::of(format!("{bar} bar"), color, members(class, &muscle.points).map(at)));
        series.push(Series::of("", color, members(class, &muscle.points).map(at)).dotted());
    }
    Chart { title: title(muscle, "Isobaric curves"), axes: ["force [N]", "contraction [mm]"], series }
}

fn isometric(muscle: &Muscle) -> Chart {
    let mut series = Vec::new();
    let Parameters { muscle: braid, force_models, .. } = &muscle.printed;
    for (color, (x, pairs)) in muscle.isometric().into_iter().enumerate() {
        let line = pairs.iter().map(|(p, _)| (p / 1e5, force_models.force(braid, *p, x)));
        series.push(Series::of(format!("{:.0} mm", 1e3 * x), color, line));
        series.push(Series::of("", color, pairs.iter().map(|(p, force)| (p / 1e5, *force))).dotted());
    }
    let what = "Isometric curves: interpolated points, printed lines";
    Chart { title: title(muscle, what), axes: FORCE, series }
}

fn virtual_area(muscle: &Muscle) -> Chart {
    let Parameters { muscle: braid, force_models, .. } = &muscle.printed;
    let ideal = crate::muscle::Muscle { force_model: ForceModelName::McKibben, ..*braid };
    let printed = contractions(muscle).map(|x| (1e3 * x, 1e4 * force_models.virtual_area(braid, 1e5, x)));
    let of_braid = contractions(muscle).map(|x| (1e3 * x, 1e4 * force_models.virtual_area(&ideal, 1e5, x)));
    let slopes = muscle.isometric_lines().into_iter().map(|(x, [slope, _])| (1e3 * x, 1e4 * slope));
    let series = vec![
        Series::of("printed, A", 0, printed),
        Series::of("ideal braid", 1, of_braid),
        Series::of("slopes of the isometric curves", 2, slopes).dotted(),
    ];
    Chart { title: title(muscle, "Virtual area"), axes: ["contraction [mm]", "area [cm²]"], series }
}

fn elastic_force(muscle: &Muscle) -> Chart {
    let Parameters { muscle: braid, force_models, .. } = &muscle.printed;
    let fitted = &muscle.fitted(ForceModelName::ImprovedMcKibben).fitted.parameters;
    let printed = contractions(muscle).map(|x| (1e3 * x, force_models.elastic_force(braid, x)));
    let membrane = contractions(muscle).map(|x| (1e3 * x, fitted.force_models.elastic_force(&fitted.muscle, x)));
    let intercepts = muscle.isometric_lines().into_iter().map(|(x, [_, intercept])| (1e3 * x, intercept));
    let series = vec![
        Series::of("printed, b", 0, printed),
        Series::of("membrane of improved-mckibben, fitted", 1, membrane),
        Series::of("intercepts of the isometric curves", 2, intercepts).dotted(),
    ];
    Chart { title: title(muscle, "Force without pressure"), axes: ["contraction [mm]", "force [N]"], series }
}

fn stroke(muscle: &Muscle) -> Chart {
    let strokes = muscle.strokes(0.5e5);
    let last = strokes.last().map_or(0.0, |(p, _)| *p);
    let spring = &muscle.printed.force_models.spring;
    let parabola = |[u0, u1, u2]: [f64; 3], from: f64, to: f64| {
        let places = (0..=SMOOTH).map(move |k| from + (to - from) * k as f64 / SMOOTH as f64);
        places.map(move |p| (p / 1e5, 1e3 * (u0 + p * (u1 + p * u2))))
    };
    let low = parabola([spring.low_u0, spring.low_u1, spring.low_u2], 0.5e5, 1e5);
    let high = parabola([spring.high_u0, spring.high_u1, spring.high_u2], 1e5, last.max(2e5));
    let series = vec![
        Series::of("spring model below 1 bar", 1, low),
        Series::of("spring model above 1 bar", 2, high),
        Series::of("virtual area, F = 0", 0, strokes.iter().step_by(2).map(|(p, x)| (p / 1e5, 1e3 * x))).dotted(),
    ];
    Chart { title: title(muscle, "Contraction without a load"), axes: OVER_PRESSURE, series }
}

/// Force over stretch, of the points and of the spring model as printed.
fn stiffness(muscle: &Muscle) -> Result<Chart> {
    let parameters = Parameters::preset(&format!("{}/spring", muscle.above.name))?;
    let spring = &parameters.force_models.spring;
    let stretch = |point: &Point| {
        let p = point.gauge_pressure;
        spring.high_u0 + p * (spring.high_u1 + p * spring.high_u2) - point.contraction
    };
    let mut series = Vec::new();
    for (kg, color, points) in by_load(&muscle.above.points.all) {
        let modelled = forces(&parameters, &points);
        // At 1 bar both ranges are mixed; near no stretch the stiffness has a pole.
        let told = |point: &Point| {
            point.gauge_pressure > spring.blend_end && stretch(point) > 0.02 * parameters.muscle.rest_length
        };
        let above = || points.iter().zip(&modelled).filter(|(point, _)| told(point));
        let printed = above().map(|(point, force)| (point.gauge_pressure / 1e5, 1e-3 * force / stretch(point)));
        let found = above().map(|(point, _)| (point.gauge_pressure / 1e5, 1e-3 * point.force / stretch(point)));
        series.push(Series::of(format!("{kg} kg"), color, printed));
        series.push(Series::of("", color, found).dotted());
    }
    let what = "Stiffness K: points, and printed coefficients as lines";
    Ok(Chart { title: title(muscle, what), axes: ["gauge pressure [bar]", "stiffness [N/mm]"], series })
}

/// Modelled forces over pressure as dots, load after load, beside the loads; from 1 bar on.
fn modelled(muscle: &Muscle, parameters: &Parameters, what: &str) -> Chart {
    let mut series = Vec::new();
    for (kg, color, points) in by_load(&muscle.above.points.all) {
        let found =
            points.iter().zip(forces(parameters, &points)).map(|(point, force)| (point.gauge_pressure / 1e5, force));
        let load = points.iter().map(|point| (point.gauge_pressure / 1e5, point.force));
        series.push(Series::of(format!("{kg} kg"), color, load));
        series.push(Series::of("", color, found).dotted());
    }
    Chart { title: title(muscle, what), axes: FORCE, series }
}

fn of_preset(muscle: &Muscle, model: &str) -> Result<Chart> {
    let parameters = Parameters::preset(&format!("{}/{model}", muscle.above.name))?;
    Ok(modelled(muscle, &parameters, &format!("{model}: force")))
}

fn improved(muscle: &Muscle) -> Chart {
    let fitted = &muscle.fitted(ForceModelName::ImprovedMcKibben).fitted.parameters;
    modelled(muscle, fitted, "improved-mckibben, fitted: force")
}

/// Coefficients of the one muscle in the other.
fn crossed(basis: &Basis) -> Vec<Chart> {
    let [long, short] = &basis.muscles;
    let chart = |of: &Muscle, on: &Muscle| {
        let mut parameters = on.printed;
        parameters.muscle.force_model = ForceModelName::ImprovedMcKibben;
        parameters.force_models = of.fitted(ForceModelName::ImprovedMcKibben).fitted.parameters.force_models;
        modelled(on, &parameters, "Force with the membrane of the other muscle")
    };
    vec![chart(long, short), chart(short, long)]
}

fn modulus(basis: &Basis) -> Result<Vec<Chart>> {
    let ratios = || (0..=SMOOTH).map(|k| 0.75 + 0.25 * k as f64 / SMOOTH as f64);
    let mut charts = Vec::new();
    for muscle in &basis.muscles {
        let printed = Parameters::preset(&format!("{}/table-4.3", muscle.above.name))?.force_models.improved_mckibben;
        let fitted = muscle.fitted(ForceModelName::ImprovedMcKibben).fitted.parameters.force_models.improved_mckibben;
        let curve = |membrane: crate::muscle::ImprovedMcKibben| ratios().map(move |r| (r, 1e-6 * membrane.modulus(r)));
        let series = vec![
            Series::of("Table 4.3", 1, curve(printed)),
            Series::of("fitted to reconstructed forces", 2, curve(fitted)),
        ];
        let axes = ["L/L₀", "modulus [MPa]"];
        let title = format!("Modulus of the membrane, {}", muscle.above.name.to_uppercase());
        charts.push(Chart { title, axes, series });
    }
    Ok(charts)
}

/// Forces of the two-point model and of the ideal braid over the load, at both low pressures.
fn low_pressure(basis: &Basis) -> Result<Vec<Chart>> {
    let [long, _] = &basis.muscles;
    let mut charts = Vec::new();
    for bar in [0.5, 1.0] {
        let classes = levels(&long.points, pressure).unwrap_or_default();
        let class = classes.iter().find(|class| (class.value - bar * 1e5).abs() < 1e3);
        let points: Vec<Point> = class.into_iter().flat_map(|class| members(class, &long.points)).copied().collect();
        let over_load = |preset: &str| -> Result<Vec<(f64, f64)>> {
            let modelled = forces(&Parameters::preset(&format!("dmsp-40-1000/{preset}"))?, &points);
            Ok(points.iter().map(|point| point.force / GRAVITY).zip(modelled).collect())
        };
        let load = points.iter().map(|point| (point.force / GRAVITY, point.force));
        let series = vec![
            Series::of("load", 0, load),
            Series::of("tondu-lopez-kq, Table 4.4", 2, over_load("tondu-lopez-kq")?).dotted(),
            Series::of("mckibben", 1, over_load("mckibben")?).dotted(),
        ];
        let axes = ["load [kg]", "force [N]"];
        charts.push(Chart { title: title(long, &format!("At {bar} bar")), axes, series });
    }
    Ok(charts)
}

/// Contraction in passing less that at rest, while the pressure rises.
fn dynamic(basis: &Basis) -> Result<Vec<Chart>> {
    let chart = |kg: f64| -> Result<Chart> {
        let mut series = Vec::new();
        for (color, number) in [1, 4, 5, 6].into_iter().enumerate() {
            let passages = basis.passages(kg, number)?;
            let rising = passages.iter().filter(|p| p.branch == crate::identification::points::Branch::Shortening);
            let pairs = rising.map(|p| (p.gauge_pressure / 1e5, 1e3 * (p.dynamic - p.at_rest)));
            let (rate, _) = TRAJECTORIES[number - 1];
            series.push(Series::of(format!("trajectory {number}, {} bar/s", rate / 1e5), color, pairs));
        }
        let title = format!("{kg} kg: contraction in passing less that at rest, DMSP-40-1000 (simulated)");
        Ok(Chart { title, axes: ["gauge pressure [bar]", "difference [mm]"], series })
    };
    [10.0, 30.0, 60.0].into_iter().map(chart).collect()
}
