//! The main job in one go, on recordings that ship with the program.

use crate::Result;
use crate::diagnosis::{DEFAULT_TOLERANCE, Diagnosis, Fitting, diagnose, report};
use crate::export;
use crate::measurement::{Recording, numbered};
use crate::package::Library;
use crate::parameters::Parameters;
use crate::plot::{Curve, plot};
use crate::simulation::{ClosedLoop, closed_loop};
use std::path::{Path, PathBuf};

/// Recordings of a muscle with dry friction in it, simulated by an independent program; see `data/README.md`.
const RECORDINGS: [(&str, &[u8]); 2] = [
    ("dry_friction_20kg.csv", include_bytes!("../data/dry_friction_20kg.csv")),
    ("dry_friction_60kg.csv", include_bytes!("../data/dry_friction_60kg.csv")),
];

/// What the demonstration made.
#[derive(Debug)]
pub struct Demo {
    /// The closed loop with the nominal muscle.
    pub closed_loop: ClosedLoop,
    /// The diagnosis of the shipped recordings.
    pub diagnosis: Diagnosis,
    /// All files that were written.
    pub files: Vec<PathBuf>,
}

/// Runs the demonstration into a folder; `fitting` is told what [`diagnose`] is at.
///
/// # Errors
/// [`crate::Error::Io`] where the folder cannot be written.
pub fn run(folder: &Path, fitting: &Fitting<'_>) -> Result<Demo> {
    let nominal = Parameters::preset("dmsp-40-1000")?;
    let libraries = [Library::embedded()?];
    let closed_loop = closed_loop(&nominal, 1e-3, nominal.reference.duration() + 2.0)?;
    let recordings = RECORDINGS
        .iter()
        .map(|(name, text)| Recording::parse(text, Path::new(name), &[]))
        .collect::<Result<Vec<_>>>()?;
    let recordings = numbered(recordings);
    let diagnosis = diagnose(&nominal, &recordings, DEFAULT_TOLERANCE, fitting)?;
    let mut files = export::files(&nominal, &libraries, &folder.join("nominal"));
    files.extend(report::files(&diagnosis, &nominal, &recordings, &libraries, &folder.join("diagnosis"))?);
    files.push((folder.join("closed_loop.svg"), closed_loop_plot(&closed_loop).into_bytes()));
    for (name, bytes) in RECORDINGS {
        files.push((folder.join("recordings").join(name), bytes.to_vec()));
    }
    let residual = report::residual_plot(&nominal, &diagnosis.extended, &recordings[1])?;
    files.extend(residual.map(|svg| (folder.join("residual.svg"), svg.into_bytes())));
    Ok(Demo { closed_loop, diagnosis, files: export::write_whole(files, &[])? })
}

fn closed_loop_plot(course: &ClosedLoop) -> String {
    let mm = |values: &[f64]| values.iter().map(|value| value * 1e3).collect::<Vec<_>>();
    let (setpoint, contraction) = (mm(&course.setpoint), mm(&course.contraction));
    let curves = [
        Curve { label: "setpoint", x: &course.time, y: &setpoint, color: 0 },
        Curve { label: "contraction", x: &course.time, y: &contraction, color: 1 },
    ];
    plot("Closed loop", "time [s]", "contraction [mm]", &curves)
}
