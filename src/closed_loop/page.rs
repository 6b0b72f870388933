//! `closed-loop.md` with its figures.

use super::{
    Case, LIMIT_CYCLE, LOADS, MUSCLES, Outcome, SETTLED, Unknown, VELOCITIES, cases, course, outcomes, random_plants,
    unknown_plants,
};
use crate::Result;
use crate::parameters::Parameters;
use crate::plot::{Curve, Panel, panels};
use crate::simulation::ClosedLoop;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Controllers that are compared: name, variant of the preset, and bandwidth of the valve in rad/s where it is not the
/// measured one.
const CONTROLLERS: [(&str, &str, Option<f64>); 3] = [
    ("printed gains, valve 2.5 rad/s", "/thesis", Some(2.5)),
    ("printed gains, valve 2.5 Hz", "/thesis", None),
    ("tuned gains, valve 2.5 Hz", "", None),
];
/// The last two: those on the valve as it was measured.
const PRINTED: usize = 1;
const TUNED: usize = 2;

/// Parameters of a muscle with one of the controllers.
fn parameters(controller: usize, muscle: &str) -> Result<Parameters> {
    let (_, variant, bandwidth) = CONTROLLERS[controller];
    let mut parameters = Parameters::preset(&format!("{muscle}{variant}"))?;
    parameters.valve.bandwidth = bandwidth.unwrap_or(parameters.valve.bandwidth);
    Ok(parameters)
}

/// All that the page tells, computed.
#[derive(Debug)]
pub struct Evaluation {
    /// For each controller the 18 cases on the plant that it knows.
    known: Vec<Vec<Outcome>>,
    /// For each unknown plant the 18 cases with printed and with tuned gains.
    unknown: Vec<(String, [Vec<Outcome>; 2])>,
    /// Random plants with printed and with tuned gains.
    random: [Vec<Outcome>; 2],
    figures: Vec<(String, String)>,
}

/// Simulates everything; `plants` is how many random plants, `done` is told what has been done.
///
/// # Errors
/// Errors of the simulation.
pub fn evaluate(plants: usize, done: &(dyn Fn(&str) + Sync)) -> Result<Evaluation> {
    let none = Unknown::default();
    let known = (0..CONTROLLERS.len()).map(|controller| outcomes(|muscle| parameters(controller, muscle), &none));
    let known = known.collect::<Result<Vec<_>>>()?;
    done("known plant");
    let mut unknown = Vec::new();
    for (name, plant) in unknown_plants() {
        let with = |controller: usize| outcomes(|muscle| parameters(controller, muscle), &plant);
        done(&name);
        unknown.push((name, [with(PRINTED)?, with(TUNED)?]));
    }
    let random = |controller| random_plants(plants, |muscle| parameters(controller, muscle));
    let random = [random(PRINTED)?, random(TUNED)?];
    done("random plants");
    let figures = figures(&random)?;
    done("figures");
    Ok(Evaluation { known, unknown, random, figures })
}

/// How many pieces of work [`evaluate`] tells of.
pub fn pieces() -> usize {
    3 + unknown_plants().len()
}

/// All files, as paths in `folder` with their bytes.
pub fn files(evaluation: &Evaluation, folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![(folder.join("closed-loop.md"), page(evaluation).into_bytes())];
    for (name, svg) in &evaluation.figures {
        files.push((folder.join("closed-loop").join(name), svg.clone().into_bytes()));
    }
    files
}

/// Largest of a quantity over outcomes.
fn most(outcomes: &[Outcome], quantity: fn(&Outcome) -> f64) -> f64 {
    outcomes.iter().map(quantity).fold(0.0, f64::max)
}

fn held(outcomes: &[Outcome]) -> usize {
    outcomes.iter().filter(|outcome| outcome.holds()).count()
}

/// The evaluation for machines; SI, what is infinite as null.
pub fn to_json(evaluation: &Evaluation) -> Value {
    let outcome = |o: &Outcome| json!({ "largest_error": o.largest_error, "left": o.left, "swing": o.swing, "settling_time": o.settling_time });
    let rows = |outcomes: &[Outcome]| {
        let row = |(case, o): (&Case, &Outcome)| {
            let mut row = outcome(o);
            row["muscle"] = json!(case.muscle);
            row["load_mass"] = json!(case.mass);
            row["velocity"] = json!(case.velocity);
            row
        };
        cases().iter().zip(outcomes).map(row).collect::<Vec<_>>()
    };
    let summary = |outcomes: &[Outcome]| {
        json!({
            "simulations": outcomes.len(), "held": held(outcomes), "largest_error": most(outcomes, |o| o.largest_error),
            "left": most(outcomes, |o| o.left), "swing": most(outcomes, |o| o.swing),
            "settling_time": most(outcomes, |o| o.settling_time),
        })
    };
    let pair = |[printed, tuned]: &[Vec<Outcome>; 2]| json!({ "printed": summary(printed), "tuned": summary(tuned) });
    json!({
        "known": CONTROLLERS.iter().zip(&evaluation.known).map(|((name, ..), outcomes)| {
            json!({ "controller": name, "cases": rows(outcomes) })
        }).collect::<Vec<_>>(),
        "unknown": evaluation.unknown.iter().map(|(name, outcomes)| {
            json!({ "plant": name, "outcomes": pair(outcomes) })
        }).collect::<Vec<_>>(),
        "random": pair(&evaluation.random),
    })
}

/// Millimetres for people; what left the range is `lost`.
fn mm(metres: f64) -> String {
    if metres.is_finite() { format!("{:.2}", 1e3 * metres) } else { "lost".to_owned() }
}

fn seconds(time: f64) -> String {
    if time.is_finite() { format!("{time:.1}") } else { "never".to_owned() }
}

const INTRODUCTION: &str = "# The closed loop

Written by `sinew closed-loop --out docs`; do not edit.

The simulations of section 5.4 of the thesis: 15 cm with the long muscle (DMSP-40-1000), 5 cm with the short one (DMSP-40-290), 20, 40
and 80 kg at 0.01, 0.03 and 0.05 m/s. The load hangs still at zero contraction; `initial.gauge_pressure` is the pressure
that holds it there. The reference accelerates with 0.05 m/s²; controller and plant exchange signals every 1 ms. The force
model is `virtual-area`, with 80 N s/m of damping. Errors are setpoint minus contraction. *Printed* is the
controller of Table 5.1 with the feed-forward of section 5.3 (`PRESET/thesis`), on the valve as the thesis prints it in eq. 5.3 (2.5 rad/s)
and as it was measured (2.5 Hz); *tuned* is the controller of the presets, from `sinew tune`, which also feeds forward inertia and
damping and inverts the lag of the valve.

The printed gains were also simulated by an independent program, with another force model (improved McKibben, 50 N s/m):
worst error 3.7 mm at 0.05 m/s on the valve of 2.5 Hz, 21.9 mm on that of 2.5 rad/s. `tests/reference/closed_loop.py` is that
program; a test compares the two under its conditions.
";

fn page(evaluation: &Evaluation) -> String {
    let mut text = INTRODUCTION.to_owned();
    text += "\n## On the plant that the controller knows\n\nLargest error in mm:\n\n| muscle | load | velocity |";
    CONTROLLERS.iter().for_each(|(name, ..)| text += &format!(" {name} |"));
    text += "\n|---|---:|---:|---:|---:|---:|\n";
    for (k, case) in cases().iter().enumerate() {
        let _ = write!(text, "| {} | {} kg | {} m/s |", case.muscle, case.mass, case.velocity);
        evaluation.known.iter().for_each(|outcomes| text += &format!(" {} |", mm(outcomes[k].largest_error)));
        text += "\n";
    }
    text += "| **worst** | | |";
    evaluation.known.iter().for_each(|outcomes| text += &format!(" **{}** |", mm(most(outcomes, |o| o.largest_error))));
    text += "\n\n";
    text += &unknown_table(evaluation);
    text += &random_section(evaluation);
    text += "\n## Figures\n\nNumbers in brackets are those of the figures of the thesis.\n";
    for (k, (name, mass)) in figure_cases().into_iter().enumerate() {
        let (position, error) = figure_names(k);
        let (number, muscle) = (10 + 2 * k, name);
        let _ = write!(
            text,
            "\n### {muscle}, {mass} kg (5.{number}, 5.{})\n\n![Position](closed-loop/{position})\n\n![Error](closed-loop/{error})\n",
            number + 1
        );
    }
    text
}

fn unknown_table(evaluation: &Evaluation) -> String {
    let mut text = format!(
        "## On plants that it does not know\n\nThe controller has the parameters of the known plant; it starts at the pressure that holds the real load. A \
         loop *holds* when, from 5 to 10 s after the motion, the error stays within {} mm and the position moves by \
         less than {} mm. Dry friction is a smooth loop of ± 40 N that is passed \
         within 2 mm (`friction_hysteresis`, without a Stribeck term: jerks of a load that sticks are not tested). Worst of the 18 simulations, tuned gains; in the \
         last two columns the printed ones on the valve of 2.5 Hz:\n\n\
         | plant | largest error, mm | settled after, s | left, mm | swing, mm | holds | printed: largest error, mm | holds |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|\n",
        1e3 * SETTLED,
        1e3 * LIMIT_CYCLE
    );
    for (name, [printed, tuned]) in &evaluation.unknown {
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {} of {} | {} | {} of {} |",
            mm(most(tuned, |o| o.largest_error)),
            seconds(most(tuned, |o| o.settling_time)),
            mm(most(tuned, |o| o.left)),
            mm(most(tuned, |o| o.swing)),
            held(tuned),
            tuned.len(),
            mm(most(printed, |o| o.largest_error)),
            held(printed),
            printed.len(),
        );
    }
    let failing: Vec<String> = evaluation
        .unknown
        .iter()
        .flat_map(|(name, [_, tuned])| {
            let all = cases();
            let failed = all.into_iter().zip(tuned).filter(|(_, outcome)| !outcome.holds());
            failed
                .map(move |(case, o)| {
                    let Case { muscle, mass, velocity, .. } = case;
                    format!(
                        "- {name}: {muscle}, {mass} kg, {velocity} m/s: {} mm left, swing {} mm\n",
                        mm(o.left),
                        mm(o.swing)
                    )
                })
                .collect::<Vec<_>>()
        })
        .collect();
    if failing.is_empty() {
        text += "\nThe tuned loop holds in all of them.\n";
    } else {
        text += "\nWhere the tuned loop does not hold:\n\n";
        failing.iter().for_each(|line| text += line);
    }
    text
}

fn random_section(evaluation: &Evaluation) -> String {
    let [printed, tuned] = &evaluation.random;
    let percentile = |outcomes: &[Outcome], share: f64, quantity: fn(&Outcome) -> f64| {
        let sorted = sorted(outcomes, quantity);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let at = (share * (sorted.len().max(1) - 1) as f64).round() as usize;
        mm(sorted.get(at).copied().unwrap_or_default())
    };
    let mut text = format!(
        "\n## On {} random plants\n\nEach runs one of the 18 simulations in turn. Evenly distributed: load ± 20 %, force ± 10 %, bandwidth of the \
         valve ± 20 %, damping ± 50 %, dry friction 0 to 40 N, dead time 0 to 10 ms. The loop holds on {} of them with the tuned gains, on {} with the printed ones.\n\n\
         | mm | median | 95 % below | largest |\n|---|---:|---:|---:|\n",
        tuned.len(),
        held(tuned),
        held(printed)
    );
    type Quantity = fn(&Outcome) -> f64;
    let quantities: [(&str, Quantity); 3] =
        [("largest error", |o| o.largest_error), ("error left", |o| o.left), ("swing", |o| o.swing)];
    for (controller, outcomes) in [("tuned", tuned), ("printed", printed)] {
        for (name, quantity) in quantities {
            let cells = [0.5, 0.95, 1.0].map(|share| percentile(outcomes, share, quantity));
            let _ = writeln!(text, "| {controller}: {name} | {} |", cells.join(" | "));
        }
    }
    text + "\n![Share of the random plants below an error](closed-loop/random_plants.svg)\n"
}

/// Muscle and load of each pair of figures.
fn figure_cases() -> Vec<(&'static str, f64)> {
    MUSCLES.iter().flat_map(|muscle| LOADS.map(|mass| (*muscle, mass))).collect()
}

/// File names of position and error.
fn figure_names(pair: usize) -> (String, String) {
    (format!("figure_5_{}.svg", 10 + 2 * pair), format!("figure_5_{}.svg", 11 + 2 * pair))
}

fn sorted(outcomes: &[Outcome], quantity: fn(&Outcome) -> f64) -> Vec<f64> {
    let mut values: Vec<f64> = outcomes.iter().map(quantity).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn figures(random: &[Vec<Outcome>; 2]) -> Result<Vec<(String, String)>> {
    let pairs: Vec<_> = figure_cases().into_iter().enumerate().collect();
    let drawn = pairs.par_iter().map(|(k, (muscle, mass))| {
        let courses = |controller: usize| -> Result<Vec<ClosedLoop>> {
            let of_pair = cases().into_iter().filter(|case| case.muscle == *muscle && case.mass == *mass);
            let known = parameters(controller, muscle)?;
            of_pair.map(|case| course(&known, &case, &Unknown::default())).collect()
        };
        let all = (0..CONTROLLERS.len()).map(courses).collect::<Result<Vec<_>>>()?;
        let (position, error) = figure_names(*k);
        let title = format!("{muscle}, {mass} kg");
        Ok(vec![(position, position_figure(&title, &all)), (error, error_figure(&title, &all))])
    });
    let drawn = drawn.collect::<Result<Vec<_>>>()?;
    let mut figures: Vec<_> = drawn.into_iter().flatten().collect();
    figures.push(("random_plants.svg".to_owned(), random_figure(random)));
    Ok(figures)
}

fn in_mm(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| 1e3 * value).collect()
}

/// Reference and position, for the three velocities, as printed and tuned.
fn position_figure(title: &str, all: &[Vec<ClosedLoop>]) -> String {
    let mut series = Vec::new();
    for (label, controller, color) in
        [("printed gains, valve 2.5 rad/s", 0, 1), ("tuned gains, valve 2.5 Hz", TUNED, 2)]
    {
        for (k, course) in all[controller].iter().enumerate() {
            series.push((if k == 0 { label } else { "" }, &course.time, in_mm(&course.contraction), color));
        }
    }
    for (k, course) in all[TUNED].iter().enumerate() {
        series.push((if k == 0 { "reference" } else { "" }, &course.time, in_mm(&course.setpoint), 0));
    }
    let curves = series.iter().map(|(label, x, y, color)| Curve { label, x, y, color: *color }).collect();
    let title = format!("Position: {title}, {} m/s", VELOCITIES.map(|v| v.to_string()).join(", "));
    let (x_label, y_label) = ("time [s]", "contraction [mm]");
    panels(&[Panel { title: &title, x_label, y_label, curves, legend: true, ..Panel::default() }])
}

/// Control error for the three velocities, a chart per controller.
fn error_figure(title: &str, all: &[Vec<ClosedLoop>]) -> String {
    let errors: Vec<Vec<Vec<f64>>> =
        all.iter().map(|courses| courses.iter().map(|course| in_mm(&course.control_error)).collect()).collect();
    let labels = VELOCITIES.map(|velocity| format!("{velocity} m/s"));
    let titles: Vec<String> = CONTROLLERS.iter().map(|(name, ..)| format!("Error: {title}, {name}")).collect();
    let chart = |controller: usize| {
        let curve = |k: usize| Curve {
            label: &labels[k],
            x: &all[controller][k].time,
            y: &errors[controller][k],
            color: k + 1,
        };
        Panel {
            title: &titles[controller],
            x_label: "time [s]",
            y_label: "setpoint − contraction [mm]",
            curves: (0..VELOCITIES.len()).map(curve).collect(),
            legend: true,
            ..Panel::default()
        }
    };
    panels(&(0..CONTROLLERS.len()).map(chart).collect::<Vec<_>>())
}

/// Errors below this, in mm, are drawn as if they were this.
const SMALLEST_SHOWN: f64 = 0.01;

/// Share of the random plants whose error is below a value.
fn random_figure([printed, tuned]: &[Vec<Outcome>; 2]) -> String {
    let shown = |outcomes: &[Outcome], quantity: fn(&Outcome) -> f64| -> Vec<f64> {
        in_mm(&sorted(outcomes, quantity)).into_iter().map(|error| error.max(SMALLEST_SHOWN)).collect()
    };
    let series = [
        ("left from 5 s on, tuned", shown(tuned, |o| o.left), 3),
        ("largest error, tuned", shown(tuned, |o| o.largest_error), 2),
        ("left from 5 s on, printed", shown(printed, |o| o.left), 0),
        ("largest error, printed", shown(printed, |o| o.largest_error), 1),
    ];
    let shares: Vec<f64> = (1..=tuned.len()).map(|k| 100.0 * k as f64 / tuned.len() as f64).collect();
    let curves = series.iter().map(|(label, x, color)| Curve { label, x, y: &shares, color: *color }).collect();
    panels(&[Panel {
        title: "Errors on random plants",
        x_label: "error [mm]",
        y_label: "share of the plants below [%]",
        curves,
        logarithmic: true,
        legend: true,
        ..Panel::default()
    }])
}
