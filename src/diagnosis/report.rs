//! The diagnosis as files: `diagnosis.json`, `report.html`, `extended.toml`, `simulated.csv` and the extended FMU.

use super::{Correction, Diagnosis, FittedParameter, Verdict};
use crate::Result;
use crate::effects::Effects;
use crate::measurement::{Recording, Signal};
use crate::models::models;
use crate::package::{Library, fmu, render, short};
use crate::parameters::Parameters;
use crate::plot::{Curve, plot};
use crate::simulation::{OUTPUTS, replay, replay_muscle};
use minijinja::context;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Unit for people and its size in SI.
fn display_unit(signal: Signal) -> (&'static str, f64) {
    match signal {
        Signal::GaugePressure => ("bar", 1e5),
        Signal::Contraction => ("mm", 1e-3),
        _ => ("N", 1.0),
    }
}

/// One sentence that says what was found.
pub fn headline(diagnosis: &Diagnosis) -> String {
    let named = diagnosis.causes.iter().map(|cause| cause.sentence.clone()).collect::<Vec<_>>().join(" ");
    match diagnosis.verdict {
        Verdict::Nominal => "Nothing is wrong beyond noise and the declared tolerance.".to_owned(),
        Verdict::Explained => named,
        Verdict::PartlyExplained => format!("{named} Some structure is left that this does not explain."),
        Verdict::Ambiguous => format!("{named} This data cannot tell it from other causes, named below."),
        Verdict::Unexplained => {
            let unknown = "Something is wrong that no effect in the library accounts for: the cause is unknown.";
            let correction = diagnosis.correction.as_ref().map(Correction::sentence);
            [unknown.to_owned()].into_iter().chain(correction).collect::<Vec<_>>().join(" ")
        }
    }
}

/// One sentence on how much smaller the error is on samples that no fit saw.
pub fn gain(diagnosis: &Diagnosis) -> String {
    let what = if diagnosis.causes.is_empty() {
        "Corrections within the tolerance remove"
    } else {
        "The extended model removes"
    };
    let (share, where_from) = (100.0 * diagnosis.improvement, &diagnosis.held_out);
    format!("{what} {share:.0} % of the error, on samples that no fit saw: {where_from}.")
}

/// `diagnosis.json`.
pub fn to_json(diagnosis: &Diagnosis) -> Value {
    let parameters = |all: &[FittedParameter]| -> Map<String, Value> {
        let entry = |p: &FittedParameter| json!({ "value": p.value, "low": p.low, "high": p.high, "unit": p.unit });
        all.iter().map(|p| (p.name.to_owned(), entry(p))).collect()
    };
    let values = |all: &[(&str, f64)]| -> Map<String, Value> {
        all.iter().map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
    };
    let causes: Vec<Value> = diagnosis
        .causes
        .iter()
        .map(|cause| {
            json!({
                "effect": cause.effect,
                "sentence": cause.sentence,
                "parameters": parameters(&cause.parameters),
                "alternatives": cause.alternatives,
                "rivals": cause.rivals.iter().map(|(n, v)| ((*n).to_owned(), json!(values(v)))).collect::<Map<_, _>>(),
            })
        })
        .collect();
    let signals: Map<String, Value> = diagnosis
        .signals
        .iter()
        .map(|errors| {
            let value = json!({
                "unit": errors.signal.unit(),
                "nominal_rms": errors.nominal_rms,
                "extended_rms": errors.extended_rms,
                "noise_rms": errors.noise_rms,
            });
            (errors.signal.name().to_owned(), value)
        })
        .collect();
    let ranking: Vec<Value> = diagnosis
        .ranking
        .iter()
        .map(|r| json!({ "effect": r.effect, "explained": r.explained, "evidence": r.evidence, "parameters": values(&r.parameters) }))
        .collect();
    json!({
        "verdict": diagnosis.verdict,
        "causes": causes,
        "signals": signals,
        "improvement": diagnosis.improvement,
        "held_out": diagnosis.held_out,
        "separating_experiment": separating_experiment(diagnosis),
        "corrections": parameters(&diagnosis.corrections),
        "correction": diagnosis.correction.as_ref().map(|correction| json!({
            "label": "cause unknown",
            "acts_on": correction.acts_on,
            "variables": correction.variables,
            "improvement": correction.improvement,
        })),
        "ranking": ranking,
    })
}

/// What would tell the first ambiguous cause from its alternatives: the experiments that show each of them.
fn separating_experiment(diagnosis: &Diagnosis) -> Option<String> {
    let cause = diagnosis.causes.iter().find(|cause| !cause.alternatives.is_empty())?;
    let shown_by = |name: &str| Effects::DESCRIPTIONS.iter().find(|e| e.name == name).map(|e| e.experiment);
    let mut experiments = vec![cause.experiment];
    for experiment in cause.alternatives.iter().filter_map(|name| shown_by(name)) {
        if !experiments.contains(&experiment) {
            experiments.push(experiment);
        }
    }
    Some(experiments.join("; and "))
}

/// All files of a diagnosis, as paths in `folder` with their bytes.
///
/// # Errors
/// Errors of the simulation of the nominal or the extended model.
pub fn files(
    diagnosis: &Diagnosis,
    nominal: &Parameters,
    recordings: &[Recording],
    libraries: &[Library],
    folder: &Path,
) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    let extended = &diagnosis.extended;
    let (mut exposing, mut plots) = (Vec::new(), Vec::new());
    for recording in recordings {
        // Measured inputs may be too wild for the muscle alone; the diagnosis does not need this picture.
        exposing.extend(residual_plot(nominal, extended, recording).ok().flatten());
        plots.extend(time_plots(nominal, extended, recording)?);
    }
    let json = format!("{:#}\n", to_json(diagnosis));
    let mut files = vec![
        (folder.join("diagnosis.json"), json.into_bytes()),
        (folder.join("report.html"), html(diagnosis, &exposing, &plots).into_bytes()),
        (folder.join("extended.toml"), extended.to_toml().into_bytes()),
        (folder.join("simulated.csv"), simulated_csv(&[("nominal", nominal), ("extended", extended)], recordings)?),
    ];
    let muscle = models().into_iter().next();
    files.extend(muscle.map(|muscle| {
        let interface = muscle.interface();
        (folder.join(format!("{}.fmu", interface.name)), fmu(interface, extended, libraries))
    }));
    if let Some(correction) = &diagnosis.correction {
        files.extend(unknown_cause(correction, libraries, folder));
    }
    Ok(files)
}

/// The model with a correction without a cause, as parameters and as FMU.
fn unknown_cause(correction: &Correction, libraries: &[Library], folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![(folder.join("unknown_cause.toml"), correction.parameters.to_toml().into_bytes())];
    files.extend(models().into_iter().next().map(|muscle| {
        let interface = muscle.interface();
        let name = format!("{}-unknown-cause.fmu", interface.name);
        (folder.join(name), fmu(interface, &correction.parameters, libraries))
    }));
    files
}

/// Measured against simulated over time, and the residual over the contraction, as SVG.
///
/// # Errors
/// Errors of the simulation.
pub fn recording_plots(nominal: &Parameters, extended: &Parameters, recording: &Recording) -> Result<Vec<String>> {
    let mut plots = time_plots(nominal, extended, recording)?;
    plots.extend(residual_plot(nominal, extended, recording)?);
    Ok(plots)
}

/// Measured against simulated over time for every signal, as SVG.
fn time_plots(nominal: &Parameters, extended: &Parameters, recording: &Recording) -> Result<Vec<String>> {
    let (before, after) = (replay(nominal, recording)?, replay(extended, recording)?);
    let name = recording.name();
    let mut plots = Vec::new();
    for signal in OUTPUTS {
        let (Some(measured), Some(before), Some(after)) =
            (recording.get(signal), before.get(signal), after.get(signal))
        else {
            continue;
        };
        let (unit, size) = display_unit(signal);
        let shown = |values: &[f64]| values.iter().map(|value| value / size).collect::<Vec<_>>();
        let (measured, before, after) = (shown(measured), shown(before), shown(after));
        let curve = |label, y, color| Curve { label, x: &recording.time, y, color };
        let mut curves = vec![curve("measured", measured.as_slice(), 0), curve("nominal", before.as_slice(), 1)];
        if nominal != extended {
            curves.push(curve("extended", after.as_slice(), 2));
        }
        let label = format!("{} [{unit}]", signal.name().replace('_', " "));
        plots.push(plot(&format!("{name}: {}", signal.name().replace('_', " ")), "time [s]", &label, &curves));
    }
    Ok(plots)
}

/// The residual over the contraction: of the force, with the chain cut at the measured pressure and contraction, where
/// these were measured; else of the contraction.
///
/// # Errors
/// Errors of the simulation.
pub fn residual_plot(nominal: &Parameters, extended: &Parameters, recording: &Recording) -> Result<Option<String>> {
    let Some(contraction) = recording.get(Signal::Contraction) else { return Ok(None) };
    let cut = recording.get(Signal::GaugePressure).is_some() && recording.get(Signal::Force).is_some();
    let signal = if cut { Signal::Force } else { Signal::Contraction };
    let (unit, size) = display_unit(signal);
    let residual = |parameters: &Parameters| -> Result<Option<Vec<f64>>> {
        let simulated = if cut { replay_muscle(parameters, recording)? } else { replay(parameters, recording)? };
        Ok(simulated.get(signal).zip(recording.get(signal)).map(|(simulated, measured)| {
            measured.iter().zip(simulated).map(|(measured, simulated)| (measured - simulated) / size).collect()
        }))
    };
    let (Some(before), Some(after)) = (residual(nominal)?, residual(extended)?) else { return Ok(None) };
    let x: Vec<f64> = contraction.iter().map(|value| value * 1e3).collect();
    let mut curves = vec![Curve { label: "nominal", x: &x, y: &before, color: 1 }];
    if nominal != extended {
        curves.push(Curve { label: "extended", x: &x, y: &after, color: 2 });
    }
    let what = if cut { "force, from measured pressure and contraction" } else { "contraction" };
    let title = format!("{}: residual of the {what}", recording.name());
    Ok(Some(plot(&title, "contraction [mm]", &format!("measured − simulated [{unit}]"), &curves)))
}

/// Measured and simulated signals of all recordings as CSV, in SI units.
///
/// # Errors
/// Errors of the simulation.
pub fn simulated_csv(models: &[(&str, &Parameters)], recordings: &[Recording]) -> Result<Vec<u8>> {
    let mut text = String::from("recording,time [s]");
    for signal in OUTPUTS {
        let _ = write!(text, ",measured_{} [{}]", signal.name(), signal.unit());
        models.iter().for_each(|(label, _)| {
            let _ = write!(text, ",{label}_{} [{}]", signal.name(), signal.unit());
        });
    }
    text.push('\n');
    for recording in recordings {
        let replays = models.iter().map(|(_, p)| replay(p, recording)).collect::<Result<Vec<_>>>()?;
        let name = quoted(&recording.name());
        for (k, time) in recording.time.iter().enumerate() {
            let _ = write!(text, "{name},{time}");
            for signal in OUTPUTS {
                let measured = recording.get(signal).map(|values| values[k]).filter(|value| !value.is_nan());
                let columns = std::iter::once(measured).chain(replays.iter().map(|r| r.get(signal).map(|v| v[k])));
                columns.for_each(|value| {
                    let _ = write!(text, ",{}", value.map(|value| value.to_string()).unwrap_or_default());
                });
            }
            text.push('\n');
        }
    }
    Ok(text.into_bytes())
}

/// A CSV cell that may hold separators.
fn quoted(text: &str) -> String {
    let mut writer = csv::WriterBuilder::new().terminator(csv::Terminator::Any(b'\n')).from_writer(Vec::new());
    writer.write_record([text]).expect("memory takes every write");
    let bytes = writer.into_inner().expect("memory takes every write");
    String::from_utf8_lossy(&bytes).trim_end().to_owned()
}

fn html(diagnosis: &Diagnosis, exposing: &[String], plots: &[String]) -> String {
    let parameters = |all: &[FittedParameter]| {
        let row = |p: &FittedParameter| {
            context! {
                name => p.name, value => short(p.value), low => short(p.low), high => short(p.high), unit => p.unit,
            }
        };
        all.iter().map(row).collect::<Vec<_>>()
    };
    let causes: Vec<_> = diagnosis
        .causes
        .iter()
        .map(|cause| {
            context! {
                effect => cause.effect, parameters => parameters(&cause.parameters),
                alternatives => cause.alternatives.clone(), experiment => cause.experiment,
            }
        })
        .collect();
    let signals: Vec<_> = diagnosis
        .signals
        .iter()
        .map(|errors| {
            let (unit, size) = display_unit(errors.signal);
            context! {
                name => errors.signal.name(), unit,
                nominal => short(errors.nominal_rms / size), extended => short(errors.extended_rms / size),
                noise => short(errors.noise_rms / size),
            }
        })
        .collect();
    let ranking: Vec<_> = diagnosis
        .ranking
        .iter()
        .map(|r| context! { effect => r.effect, explained => format!("{:.0} %", 100.0 * r.explained), evidence => format!("{:.0}", r.evidence) })
        .collect();
    let page = context! {
        headline => headline(diagnosis), causes, signals, ranking, plots => plots.to_vec(), exposing => exposing.to_vec(),
        verdict => format!("{}", to_json(diagnosis)["verdict"].as_str().unwrap_or_default().replace('_', " ")),
        gain => gain(diagnosis),
        corrections => parameters(&diagnosis.corrections),
        version => env!("CARGO_PKG_VERSION"),
    };
    render("report.html", include_str!("report.html"), &page)
}
