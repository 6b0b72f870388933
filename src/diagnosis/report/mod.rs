//! The diagnosis as files: `diagnosis.json`, `report.html`, `extended.toml`, `nominal.toml`, `simulated.csv` and the extended FMU.

mod curves;
mod exposure;
mod json;
mod page;
mod pictures;
mod simulated;

pub use json::to_json;
pub use pictures::{residual_plot, time_plots};
pub use simulated::simulated_csv;

use super::{Correction, Diagnosis, Verdict};
use crate::Result;
use crate::effects::Effects;
use crate::measurement::{Recording, Signal};
use crate::models::models;
use crate::package::{Library, fmu};
use crate::parameters::Parameters;
use crate::simulation::replay;
use rayon::prelude::*;
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
            let looks_like = diagnosis.remaining.iter().find(|left| left.is_known).map(|left| {
                let (share, signal) = (100.0 * left.share, left.signal.name().replace('_', " "));
                format!("Of the error of the {signal} {share:.0} % goes with {}.", left.on)
            });
            let correction = diagnosis.correction.as_ref().map(Correction::sentence);
            [unknown.to_owned()].into_iter().chain(looks_like).chain(correction).collect::<Vec<_>>().join(" ")
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
    let (share, where_from) = (100.0 * diagnosis.improvement, held_out(diagnosis));
    format!("{what} {share:.0} % of the error, on samples {}: {where_from}.", which_samples(diagnosis))
}

/// Where the samples are that no fit saw.
fn held_out(diagnosis: &Diagnosis) -> String {
    diagnosis.held_out.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// On what samples errors are given.
fn which_samples(diagnosis: &Diagnosis) -> &'static str {
    if diagnosis.saw_all {
        "that the fit had to see, as those before do not tell the size precisely enough to foretell them"
    } else {
        "that no fit saw"
    }
}

/// The experiment that tells a cause from its alternatives; `None` where none is needed.
fn separating_experiment(diagnosis: &Diagnosis) -> Option<String> {
    let cause = diagnosis.causes.iter().find(|cause| !cause.alternatives.is_empty())?;
    let shown_by = |name: &str| Effects::description(name).map(|effect| effect.experiment);
    let mut experiments = vec![cause.experiment];
    for experiment in cause.alternatives.iter().filter_map(|name| shown_by(name)) {
        if !experiments.contains(&experiment) {
            experiments.push(experiment);
        }
    }
    Some(experiments.join("; and "))
}

/// A file of a diagnosis.
struct Made {
    name: String,
    /// What it is good for, in one line.
    purpose: &'static str,
    bytes: Vec<u8>,
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
    let recordings = &diagnosis.taken(recordings);
    let extended = &diagnosis.extended;
    let both = |recording: &Recording| Ok([replay(nominal, recording)?, replay(extended, recording)?]);
    let replays = recordings.par_iter().map(both).collect::<Result<Vec<_>>>()?;
    let made = |name: &str, purpose, bytes| Made { name: name.to_owned(), purpose, bytes };
    let mut files = vec![
        made(
            "extended.toml",
            "parameters of the extended model, to edit and to export from",
            extended.to_toml().into(),
        ),
        made("nominal.toml", "parameters of the model that was diagnosed, for `sinew plan`", nominal.to_toml().into()),
        made(
            "simulated.csv",
            "measured, nominal and extended signals, SI units",
            simulated_csv(["nominal", "extended"], recordings, &replays),
        ),
        made("diagnosis.json", "this diagnosis for machines", format!("{:#}\n", to_json(diagnosis)).into()),
    ];
    if let Some(muscle) = models().into_iter().next() {
        let interface = muscle.interface();
        let name = format!("{}.fmu", interface.name);
        files.insert(0, made(&name, "the extended model for any FMI 2.0 tool", fmu(interface, extended, libraries)));
    }
    if let (Some(correction), Some(muscle)) = (&diagnosis.correction, models().into_iter().next()) {
        let (interface, model) = (muscle.interface(), &correction.parameters);
        let name = format!("{}-unknown-cause.fmu", interface.name);
        files.push(made("unknown_cause.toml", "the model with a correction of unknown cause", model.to_toml().into()));
        files.push(made(&name, "the FMU with a correction of unknown cause", fmu(interface, model, libraries)));
    }
    let page = page::html(diagnosis, nominal, recordings, &replays, &files);
    files.push(made("report.html", "this page", page.into()));
    Ok(files.into_iter().map(|file| (folder.join(file.name), file.bytes)).collect())
}
