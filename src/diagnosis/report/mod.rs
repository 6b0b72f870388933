//! The diagnosis as files: those of [`FILES`].

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

/// A file that a diagnosis may write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Named {
    /// Its name.
    pub name: &'static str,
    /// What it is good for, in one line.
    pub purpose: &'static str,
}

impl Named {
    const fn new(name: &'static str, purpose: &'static str) -> Self {
        Self { name, purpose }
    }
}

/// The FMU of the extended model.
pub const FMU: Named = Named::new("PneumaticMuscle.fmu", "the extended model for any FMI 2.0 tool");
/// The extended model.
pub const EXTENDED: Named = Named::new("extended.toml", "parameters of the extended model, to edit and to export from");
/// The model that was diagnosed.
pub const NOMINAL: Named = Named::new("nominal.toml", "parameters of the model that was diagnosed, for `sinew plan`");
/// Courses of all signals.
pub const SIMULATED: Named = Named::new("simulated.csv", "measured, nominal and extended signals, SI units");
/// What [`to_json`] gives.
pub const DIAGNOSIS: Named = Named::new("diagnosis.json", "this diagnosis for machines");
/// The model with a correction, where the cause is unknown.
pub const CORRECTED: Named = Named::new("unknown_cause.toml", "the model with a correction of unknown cause");
/// Its FMU.
pub const CORRECTED_FMU: Named =
    Named::new("PneumaticMuscle-unknown-cause.fmu", "the FMU with a correction of unknown cause");
/// The report.
pub const REPORT: Named = Named::new("report.html", "this page");

/// All files that a diagnosis may write, in the order of the report.
pub const FILES: [Named; 8] = [FMU, EXTENDED, NOMINAL, SIMULATED, DIAGNOSIS, CORRECTED, CORRECTED_FMU, REPORT];

/// A file of a diagnosis with what it holds.
type Made = (Named, Vec<u8>);

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
    let fmu = |model: &Parameters| models().first().map(|muscle| fmu(muscle.interface(), model, libraries));
    let mut files: Vec<Made> = fmu(extended).into_iter().map(|fmu| (FMU, fmu)).collect();
    files.push((EXTENDED, extended.to_toml().into()));
    files.push((NOMINAL, nominal.to_toml().into()));
    files.push((SIMULATED, simulated_csv(["nominal", "extended"], recordings, &replays)));
    files.push((DIAGNOSIS, format!("{:#}\n", to_json(diagnosis)).into()));
    if let Some(correction) = &diagnosis.correction {
        let model = &correction.parameters;
        files.push((CORRECTED, model.to_toml().into()));
        files.extend(fmu(model).map(|fmu| (CORRECTED_FMU, fmu)));
    }
    let page = page::html(diagnosis, nominal, recordings, &replays, &files);
    files.push((REPORT, page.into()));
    Ok(files.into_iter().map(|(file, bytes)| (folder.join(file.name), bytes)).collect())
}
