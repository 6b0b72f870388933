//! The plan as files: the commands to play, `plan.json`, and what the rivals would show.

use super::{ENOUGH, Pair, Place, Plan, Planned};
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plot::{Curve, plot};
use crate::simulation::{OUTPUTS, replay};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Rivals whose readings are drawn.
const DRAWN: usize = 3;

/// All files of a plan, as paths in `folder` with their bytes.
pub fn files(plan: &Plan, nominal: &Parameters, folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![(folder.join("plan.json"), format!("{:#}\n", to_json(plan)).into_bytes())];
    for run in &plan.runs {
        files.push((folder.join(&run.file), csv(run).into_bytes()));
        for (name, svg) in plots(plan, run, nominal) {
            files.push((folder.join(format!("{}-{name}.svg", run.file.trim_end_matches(".csv"))), svg.into_bytes()));
        }
    }
    files
}

/// Files of an earlier plan in `folder` that a new one does not replace; a recording that was filled in, and its pictures, are none.
pub fn outdated(folder: &Path, new: &[(PathBuf, Vec<u8>)]) -> Vec<PathBuf> {
    let unplayed = |stem: &&str| {
        let text = std::fs::read_to_string(folder.join(format!("{stem}.csv"))).unwrap_or_default();
        text.lines().next().is_none_or(|header| HEADERS.contains(&header))
    };
    let of_run = |stem: &str| {
        let shown = OUTPUTS.map(Signal::name).into_iter().chain(["command"]);
        shown.map(|name| format!("{stem}-{name}.svg")).chain([format!("{stem}.csv")]).collect::<Vec<_>>()
    };
    let all = STEMS.into_iter().filter(unplayed).flat_map(of_run).map(|name| folder.join(name));
    all.filter(|path| path.is_file() && new.iter().all(|(other, _)| other != path)).collect()
}

/// Names of the files of a single run, and of those of a pair.
pub(super) const STEMS: [&str; 3] = ["plan", "plan-1", "plan-2"];
/// Headers of a recording that is yet to be made: under a hanging load, and at a fixed length.
const HEADERS: [&str; 2] = ["time [s],command [V],load_mass [kg]", "time [s],command [V],contraction [m]"];

/// The command to play, with what stays constant.
fn csv(run: &Planned) -> String {
    let (header, constant) = match (run.place.load_mass(), run.locked) {
        (Some(mass), _) => (HEADERS[0], mass),
        (None, contraction) => (HEADERS[1], contraction.unwrap_or_default()),
    };
    let mut text = format!("{header}\n");
    for (time, command) in run.time.iter().zip(&run.command) {
        let _ = writeln!(text, "{time:.2},{command:.4},{constant}");
    }
    text
}

/// `plan.json`.
pub fn to_json(plan: &Plan) -> Value {
    let runs = plan.runs.iter().map(|run| {
        json!({
            "file": run.file,
            "excitation": run.excitation,
            "load_mass": run.place.load_mass(),
            "contraction": run.locked,
            "valve_shut": matches!(run.place, Place::ValveShut(_)),
            "duration": run.time.last(),
        })
    });
    let pairs = |pair: &Pair| json!({ "effects": pair.effects, "lambda": pair.lambda });
    let compared = plan.compared.iter().map(|row| {
        json!({ "experiment": row.name, "duration": row.duration, "lambda": row.lambda, "told_apart": row.told_apart, "fitted": row.fitted })
    });
    json!({
        "sentence": plan.sentence(),
        "separates": plan.confused().next().is_none(),
        "enough": ENOUGH,
        "candidates": plan.rivals.iter().map(|rival| rival.name).collect::<Vec<_>>(),
        "sensors": plan.sensors.iter().map(|signal| signal.name()).collect::<Vec<_>>(),
        "unseen": plan.unseen,
        "needs": plan.needs.iter().map(|need| need.words()).collect::<Vec<_>>(),
        "recordings": runs.collect::<Vec<_>>(),
        "pairs": plan.pairs.iter().map(pairs).collect::<Vec<_>>(),
        "compared": compared.collect::<Vec<_>>(),
    })
}

/// λ of all pairs as a table of text: of few models the numbers; of many their powers of ten, a dot where a pair is not
/// told apart, and no line for what is not seen.
pub fn matrix(plan: &Plan) -> String {
    let names: Vec<&str> = plan.rivals.iter().map(|rival| rival.name).collect();
    let lambda = |a: &str, b: &str| {
        let of_both = |pair: &&Pair| pair.effects == [a, b] || pair.effects == [b, a];
        plan.pairs.iter().find(of_both).map(|pair| pair.lambda)
    };
    if names.len() <= super::FEW_RIVALS {
        let lines =
            plan.pairs.iter().map(|pair| format!("  {:<50} {:.3e}\n", pair.effects.join(" from "), pair.lambda));
        return lines.collect();
    }
    let names: Vec<&str> = names.into_iter().filter(|name| !plan.unseen.contains(name)).collect();
    let mut text = String::new();
    for (k, row) in names.iter().enumerate() {
        let cells: Vec<String> = names[..k]
            .iter()
            .map(|column| match lambda(row, column) {
                Some(lambda) if lambda >= ENOUGH => format!("{:.0}", lambda.log10().floor().min(9.0)),
                _ => ".".to_owned(),
            })
            .collect();
        let _ = writeln!(text, "  {:2} {row:<27}{}", k + 1, cells.join(" "));
    }
    text
}

/// The inputs of a run, for a simulation.
fn inputs(run: &Planned) -> Recording {
    let constant = |value: f64| vec![value; run.time.len()];
    let mut signals = BTreeMap::from([(Signal::Command, run.command.clone())]);
    signals.extend(run.place.load_mass().map(|mass| (Signal::LoadMass, constant(mass))));
    signals.extend(run.locked.map(|contraction| (Signal::Contraction, constant(contraction))));
    Recording::planned(&run.file, run.time.clone(), signals)
}

/// The command, and what the sensors would show under the first rivals.
fn plots(plan: &Plan, run: &Planned, nominal: &Parameters) -> Vec<(&'static str, String)> {
    let title = super::described(run.excitation, run.place);
    let command = Curve { label: "command", x: &run.time, y: &run.command, color: 0 };
    let mut plots = vec![("command", plot(&title, "time [s]", "command [V]", &[command]))];
    // With the valve shut the pressure at the start is set by hand, which a replay of the command does not know.
    if run.place.valve_shut() {
        return plots;
    }
    let recording = inputs(run);
    let few = plan.rivals.len() <= super::FEW_RIVALS;
    let rivals: Vec<(&str, &Parameters)> = if few {
        plan.rivals.iter().take(DRAWN).map(|rival| (rival.name, &rival.model)).collect()
    } else {
        vec![("nominal", nominal)]
    };
    for signal in OUTPUTS.into_iter().filter(|signal| plan.sensors.contains(signal)) {
        let shown: Vec<(&str, Vec<f64>)> = rivals
            .iter()
            .filter_map(|(name, model)| Some((*name, replay(model, &recording).ok()?.get(signal)?.to_vec())))
            .collect();
        let curves: Vec<Curve> =
            shown.iter().enumerate().map(|(k, (label, y))| Curve { label, x: &run.time, y, color: k + 1 }).collect();
        if !curves.is_empty() {
            let label = format!("{} [{}]", signal.name().replace('_', " "), signal.unit());
            plots.push((signal.name(), plot(&title, "time [s]", &label, &curves)));
        }
    }
    plots
}
