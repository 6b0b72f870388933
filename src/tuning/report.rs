//! A tuning as files: `tuning.json`, `report.html`, `parameters.toml`.

use super::linear::{
    LinearPlant, Margins, closed_loop_poles, closed_loop_polynomials, controller_polynomials, controller_response,
    product, step_response,
};
use super::{OperatingPoint, Part, PointMargins, SENSITIVITY_BOUND, Tuning, worst};
use crate::controller::Controller;
use crate::package::{render, short};
use crate::parameters::Parameters;
use crate::plot::{Curve, Panel, panels};
use minijinja::context;
use nalgebra::Complex;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Names of the gains and what is shown of them.
const GAINS: [(&str, &str); 3] = [
    ("controller.proportional_gain", "V/m"),
    ("controller.integral_gain", "V/(m s)"),
    ("controller.derivative_gain", "V s/m"),
];

/// All files of a tuning, as paths in `folder` with their bytes; `before` are the parameters as they were.
pub fn files(tuning: &Tuning, before: &Parameters, name: &str, folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    vec![
        (folder.join("parameters.toml"), tuning.parameters.to_toml().into_bytes()),
        (folder.join("tuning.json"), format!("{:#}\n", to_json(tuning)).into_bytes()),
        (folder.join("report.html"), page(tuning, before, name).into_bytes()),
    ]
}

/// The tuning for machines; SI, angles in degrees, what is infinite as null.
pub fn to_json(tuning: &Tuning) -> Value {
    let margins = |m: &Margins| {
        json!({
            "gain_margin": m.gain, "phase_margin_degrees": m.phase.to_degrees(), "delay_margin": m.delay,
            "sensitivity_peak": m.sensitivity, "peak_frequency": m.peak_frequency, "slowest_pole": m.slowest_pole,
        })
    };
    let point = |p: &PointMargins| {
        json!({
            "load_mass": p.point.mass, "contraction": p.point.contraction,
            "known": margins(&p.known), "uncertain": margins(&p.uncertain),
        })
    };
    let gains = GAINS.iter().map(|(name, unit)| {
        let value = tuning.parameters.get(name).expect("a declared name");
        ((*name).to_owned(), json!({ "value": value, "unit": unit }))
    });
    json!({
        "gains": gains.collect::<serde_json::Map<_, _>>(),
        "filter_time_constant": tuning.parameters.controller.filter_time_constant,
        "design": {
            "load_mass": tuning.design.mass, "contraction": tuning.design.contraction,
            "natural_frequency": tuning.placement.natural_frequency, "damping_ratio": tuning.placement.damping_ratio,
            "product_of_other_poles": tuning.placement.other_product,
        },
        "sensitivity_bound": SENSITIVITY_BOUND,
        "worst": point(tuning.worst()),
        "out_of_reach": tuning.out_of_reach,
        "points": tuning.margins.iter().map(point).collect::<Vec<_>>(),
        "scheduling": tuning.scheduling.iter().map(|Part { name, integral_gain, .. }| {
            json!({ "part": name, "integral_gain": integral_gain })
        }).collect::<Vec<_>>(),
        "gain_of_scheduling": tuning.gain_of_scheduling(),
    })
}

/// Frequencies of the diagrams, rad/s.
fn diagram_frequencies() -> Vec<f64> {
    (0..800).map(|k| 0.3 * 1000_f64.powf(f64::from(k) / 799.0)).collect()
}

/// A loop that is drawn.
struct Drawn {
    label: String,
    plant: LinearPlant,
    controller: Controller,
    color: usize,
}

impl Drawn {
    fn open(&self, frequency: f64) -> Complex<f64> {
        self.plant.response(frequency) * controller_response(&self.controller, frequency)
    }

    fn closed(&self, frequency: f64) -> Complex<f64> {
        let open = self.open(frequency);
        open / (open + 1.0)
    }
}

fn decibels(value: &Complex<f64>) -> f64 {
    20.0 * value.norm().log10()
}

/// Phases in degrees without jumps.
fn phases(values: &[Complex<f64>]) -> Vec<f64> {
    let mut turns = 0.0;
    let mut before: Option<f64> = None;
    values
        .iter()
        .map(|value| {
            let phase = value.arg().to_degrees();
            if let Some(before) = before {
                turns -= ((phase - before) / 360.0).round() * 360.0;
            }
            before = Some(phase);
            phase + turns
        })
        .collect()
}

/// Magnitude and phase over frequency.
fn bode(title: &str, loops: &[Drawn], response: fn(&Drawn, f64) -> Complex<f64>) -> String {
    let frequencies = diagram_frequencies();
    let of = |drawn: &Drawn| frequencies.iter().map(|at| response(drawn, *at)).collect::<Vec<_>>();
    let responses: Vec<_> = loops.iter().map(of).collect();
    let magnitudes: Vec<Vec<f64>> = responses.iter().map(|all| all.iter().map(decibels).collect()).collect();
    let phases: Vec<Vec<f64>> = responses.iter().map(|all| phases(all)).collect();
    let (x_label, logarithmic) = ("frequency [rad/s]", true);
    let curves = curves(loops, &frequencies, &magnitudes);
    let magnitude =
        Panel { title, x_label, y_label: "magnitude [dB]", curves, logarithmic, legend: true, ..Panel::default() };
    let curves = self::curves(loops, &frequencies, &phases);
    panels(&[magnitude, Panel { x_label, y_label: "phase [°]", curves, logarithmic, ..Panel::default() }])
}

fn curves<'a>(loops: &'a [Drawn], x: &'a [f64], values: &'a [Vec<f64>]) -> Vec<Curve<'a>> {
    loops.iter().zip(values).map(|(drawn, y)| Curve { label: &drawn.label, x, y, color: drawn.color }).collect()
}

/// Largest factor on the gains that the root locus shows.
const LARGEST_FACTOR: f64 = 5.0;

/// Poles of the closed loop while all gains grow from nothing to five times what they are.
fn root_locus(drawn: &Drawn) -> String {
    let poles = |factor: f64| {
        let poles = closed_loop_poles(&drawn.plant, &drawn.controller, factor);
        let near = poles.into_iter().filter(|pole| pole.re > -40.0); // the filter's own pole lies far to the left
        near.map(|pole| (pole.re, pole.im)).unzip::<_, _, Vec<_>, Vec<_>>()
    };
    let (mut re, mut im) = (Vec::new(), Vec::new());
    for k in 1..=200 {
        let (more_re, more_im) = poles(LARGEST_FACTOR * (f64::from(k) / 200.0).powi(2));
        re.extend(more_re);
        im.extend(more_im);
    }
    let (open, now) = (poles(0.0), poles(1.0));
    let sets =
        [("gains from 0 to 5 times the tuned ones", &(re, im), 0), ("without feedback", &open, 1), ("tuned", &now, 2)];
    let title = format!("Root locus, {}", drawn.label);
    panels(&[Panel {
        title: &title,
        x_label: "real part [1/s]",
        y_label: "imaginary part [rad/s]",
        dots: sets.iter().map(|(label, (x, y), color)| Curve { label, x, y, color: *color }).collect(),
        legend: true,
        ..Panel::default()
    }])
}

/// Contraction after a step of the setpoint and of the load's weight.
fn steps(loops: &[Drawn]) -> String {
    let times: Vec<f64> = (0..=600).map(|k| f64::from(k) * 0.01).collect();
    let setpoint = |drawn: &Drawn| {
        let (numerator, characteristic) = closed_loop_polynomials(&drawn.plant, &drawn.controller, 1.0);
        step_response(&numerator, &characteristic, &times)
    };
    // From a force on the load in N to the contraction in mm: (s − a)/M times the controller's denominator.
    let load = |drawn: &Drawn| {
        let (_, characteristic) = closed_loop_polynomials(&drawn.plant, &drawn.controller, 1.0);
        let (_, denominator) = controller_polynomials(&drawn.controller);
        let valve = [-drawn.plant.rates[0][0] / drawn.plant.mass, 1.0 / drawn.plant.mass];
        let course = step_response(&product(&valve, &denominator), &characteristic, &times);
        course.into_iter().map(|way| -1e3 * STEP_FORCE * way).collect()
    };
    let (of_setpoint, of_load): (Vec<Vec<f64>>, Vec<Vec<f64>>) = loops.iter().map(|l| (setpoint(l), load(l))).unzip();
    let load_title = format!("Step of the load by {STEP_FORCE} N");
    panels(&[
        Panel {
            title: "Step of the setpoint, linear, without feed-forward",
            x_label: "time [s]",
            y_label: "contraction per step",
            curves: curves(loops, &times, &of_setpoint),
            legend: true,
            ..Panel::default()
        },
        Panel {
            title: &load_title,
            x_label: "time [s]",
            y_label: "contraction [mm]",
            curves: curves(loops, &times, &of_load),
            ..Panel::default()
        },
    ])
}

/// Step of the load that is shown, N.
const STEP_FORCE: f64 = 40.0;

/// Smallest and largest of a margin over all operating points, for people.
fn extremes(margins: &[PointMargins]) -> Vec<minijinja::Value> {
    let row = |name: &str, pick: fn(&PointMargins) -> &Margins| {
        let least = |value: fn(&Margins) -> f64| margins.iter().map(|m| value(pick(m))).fold(f64::INFINITY, f64::min);
        let peak = margins.iter().map(|m| pick(m).sensitivity).fold(0.0, f64::max);
        context! {
            name,
            stable => margins.iter().all(|m| pick(m).is_stable()),
            gain => format!("{:.2}", least(|m| m.gain)),
            phase => format!("{:.0}°", least(|m| m.phase).to_degrees()),
            delay => format!("{:.0} ms", 1e3 * least(|m| m.delay)),
            sensitivity => format!("{peak:.2}"),
        }
    };
    vec![row("as known", |m| &m.known), row("not quite known, that with the largest peak", |m| &m.uncertain)]
}

fn point_words(point: &OperatingPoint) -> String {
    format!("{} kg at {:.0} mm", point.mass, 1e3 * point.contraction)
}

fn page(tuning: &Tuning, before: &Parameters, name: &str) -> String {
    let middle = tuning.design.contraction;
    let drawn = |point: OperatingPoint, parameters: &Parameters, what: &str, color| Drawn {
        label: format!("{what}{}", point_words(&point)),
        plant: point.plant(parameters),
        controller: parameters.controller,
        color,
    };
    let mut masses: Vec<f64> = tuning.margins.iter().map(|m| m.point.mass).collect();
    masses.dedup();
    let lightest_and_heaviest = [masses[0], masses[masses.len() - 1]];
    let worst_point = tuning.worst().point;
    let mut loops: Vec<_> = lightest_and_heaviest
        .into_iter()
        .enumerate()
        .map(|(k, mass)| drawn(OperatingPoint { mass, contraction: middle }, &tuning.parameters, "", k + 1))
        .collect();
    if worst_point.contraction != middle || !lightest_and_heaviest.contains(&worst_point.mass) {
        loops.push(drawn(worst_point, &tuning.parameters, "worst: ", 3));
    }
    let compared =
        [drawn(tuning.design, &tuning.parameters, "tuned: ", 2), drawn(tuning.design, before, "before: ", 1)];
    let gain_row = |(name, unit): &(&str, &str)| {
        let value = |parameters: &Parameters| minus(&short(parameters.get(name).expect("a declared name")));
        context! { name => *name, unit => *unit, tuned => value(&tuning.parameters), before => value(before) }
    };
    let worst_margins = worst(&tuning.margins);
    let point_row = |m: &PointMargins| {
        context! {
            mass => m.point.mass.to_string(),
            contraction => format!("{:.0}", 1e3 * m.point.contraction),
            frequency => format!("{:.1}", m.point.plant(&tuning.parameters).natural_frequency()),
            gain => format!("{:.2}", m.known.gain),
            phase => format!("{:.0}°", m.known.phase.to_degrees()),
            delay => format!("{:.0}", 1e3 * m.known.delay),
            sensitivity => format!("{:.2}", m.known.sensitivity),
            uncertain => format!("{:.2}", m.uncertain.sensitivity),
            worst => m.point == worst_margins.point,
        }
    };
    let integral_gain = tuning.parameters.controller.integral_gain;
    let page = context! {
        name,
        loads => masses.iter().map(f64::to_string).collect::<Vec<_>>().join(", "),
        bound => SENSITIVITY_BOUND.to_string(),
        worst => point_words(&worst_point),
        worst_sensitivity => format!("{:.2}", worst_margins.uncertain.sensitivity),
        worst_frequency => format!("{:.1}", worst_margins.uncertain.peak_frequency),
        gains => GAINS.iter().map(gain_row).collect::<Vec<_>>(),
        filter => short(1e3 * tuning.parameters.controller.filter_time_constant),
        margins => extremes(&tuning.margins),
        margins_before => extremes(&tuning.before),
        points => tuning.margins.iter().map(point_row).collect::<Vec<_>>(),
        design => point_words(&tuning.design),
        out_of_reach => tuning.out_of_reach,
        natural_frequency => short(tuning.placement.natural_frequency),
        damping_ratio => short(tuning.placement.damping_ratio),
        other_product => short(tuning.placement.other_product.sqrt()),
        scheduling_gain => format!("{:.1}", tuning.gain_of_scheduling()),
        scheduling => tuning.scheduling.iter().map(|part| context! {
            name => part.name.clone(), gain => short(part.integral_gain), factor => format!("{:.1}", part.integral_gain / integral_gain),
        }).collect::<Vec<_>>(),
        open_loop => bode("Open loop", &loops, Drawn::open),
        closed_loop => bode("Closed loop, from setpoint to contraction without feed-forward", &loops, Drawn::closed),
        root_locus => root_locus(&compared[0]),
        steps => steps(&compared),
        style => include_str!("../diagnosis/report/page.css"),
        version => env!("CARGO_PKG_VERSION"),
    };
    render("report.html", include_str!("page.html"), &page)
}

/// A number with a true minus sign.
fn minus(number: &str) -> String {
    number.replace('-', "−")
}
