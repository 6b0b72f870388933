//! What a simulation gets wrong, and why: residuals → candidates → selection → report.
//!
//! # Method
//! The nominal model is first allowed to be a little off (areas, elastic force and damping within the declared tolerance).
//! What error then remains is compared, on samples that no fit saw, with the error that remains when one effect more is
//! freed. An effect is named when it explains a good part of the error beyond doubt; otherwise the answer is that
//! nothing is wrong, or that the cause is unknown.

mod candidates;
pub mod report;
mod residuals;
mod selection;

pub use candidates::FittedParameter;

use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::replay;
use crate::{Error, Result};
use candidates::{Candidate, Fitted};
use residuals::Data;
use serde::Serialize;

/// How far a nominal muscle's own coefficients may be off without being called wrong, by default.
pub const DEFAULT_TOLERANCE: f64 = 0.03;

/// What the recordings say of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is wrong beyond noise and tolerance.
    Nominal,
    /// The named cause explains the error.
    Explained,
    /// The named cause holds, and structure is left.
    PartlyExplained,
    /// Several causes explain the error equally well.
    Ambiguous,
    /// Something is wrong that no effect accounts for.
    Unexplained,
}

/// An effect that was found.
#[derive(Debug, Clone)]
pub struct Cause {
    /// Name of the effect.
    pub effect: &'static str,
    /// Its size in words.
    pub sentence: String,
    /// Its parameters with 95 % intervals.
    pub parameters: Vec<FittedParameter>,
    /// Effects that this data cannot tell from it.
    pub alternatives: Vec<&'static str>,
    /// The experiment that would.
    pub experiment: &'static str,
}

/// Errors of one signal on samples that no fit saw, in its SI unit.
#[derive(Debug, Clone, Copy)]
pub struct SignalErrors {
    /// The signal.
    pub signal: Signal,
    /// Of the model as it was given.
    pub nominal_rms: f64,
    /// Of the extended model.
    pub extended_rms: f64,
    /// Of the sensor, estimated from the recording.
    pub noise_rms: f64,
}

/// One line of the ranking.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// Name of the effect.
    pub effect: &'static str,
    /// Held-out error of the model with this effect, relative to the error without.
    pub relative_error: f64,
    /// Evidence for the effect (natural logarithm, at the effective number of samples).
    pub evidence: f64,
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// What was found.
    pub verdict: Verdict,
    /// The causes, the largest first.
    pub causes: Vec<Cause>,
    /// Errors per signal.
    pub signals: Vec<SignalErrors>,
    /// 1 − error of the extended model / error of the nominal one, held out, each signal weighted by its noise.
    pub improvement: f64,
    /// Which samples no fit saw.
    pub held_out: String,
    /// All candidates, the best first.
    pub ranking: Vec<Ranked>,
    /// The extended model: the nominal one with corrections within the tolerance and the named cause.
    pub extended: Parameters,
    /// Corrections of the nominal model that were fitted along.
    pub corrections: Vec<FittedParameter>,
}

/// Diagnoses recordings against a nominal model.
///
/// `tolerance` is the relative error of the nominal coefficients below which nothing is called wrong; `done` is told
/// after each of the `1 + candidates` fits.
///
/// # Errors
/// [`Error::Recording`] where nothing can be compared; errors of the simulation of the nominal model.
pub fn diagnose(
    nominal: &Parameters,
    recordings: &[Recording],
    tolerance: f64,
    done: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosis> {
    for recording in recordings {
        replay(nominal, recording)?; // a model that cannot be simulated at all is the user's to mend
    }
    let data = Data::new(recordings, nominal, tolerance)?;
    let cannot_follow = || Error::Recording {
        path: recordings[0].path.clone(),
        problem: "the model cannot follow the recording: check `load_mass` and the units".to_owned(),
    };
    let baseline = Fitted::fit(&Candidate::corrections_only(), nominal, &data, tolerance).ok_or_else(cannot_follow)?;
    done("nominal");
    let candidates: Vec<Fitted> = Candidate::all()
        .iter()
        .filter_map(|candidate| {
            let fitted = Fitted::fit(candidate, nominal, &data, tolerance);
            done(candidate.name());
            fitted
        })
        .collect();
    let chosen = selection::select(&baseline, candidates, data.noise_floor());
    let nominal_errors = data.held_out_rms(nominal).ok_or_else(cannot_follow)?;
    // Corrections that do not help on unseen samples are not made.
    let without_cause = if baseline.beats(nominal, &data) { baseline.parameters } else { *nominal };
    let extended = chosen.best.as_ref().map_or(without_cause, |best| best.parameters);
    let extended_errors = data.held_out_rms(&extended).ok_or_else(cannot_follow)?;
    let signals: Vec<SignalErrors> = data
        .signals()
        .into_iter()
        .map(|signal| SignalErrors {
            signal,
            nominal_rms: nominal_errors[&signal],
            extended_rms: extended_errors[&signal],
            noise_rms: data.noise(signal),
        })
        .collect();
    let weighted = |rms: fn(&SignalErrors) -> f64| {
        signals.iter().map(|errors| (rms(errors) / errors.noise_rms).powi(2)).sum::<f64>().sqrt()
    };
    let (before, after) = (weighted(|e| e.nominal_rms), weighted(|e| e.extended_rms));
    let improvement = if before > 0.0 { 1.0 - after / before } else { 0.0 };
    Ok(Diagnosis {
        verdict: chosen.verdict,
        causes: chosen.best.iter().filter_map(|best| best.cause(chosen.alternatives.clone())).collect(),
        improvement,
        signals,
        held_out: data.held_out(),
        ranking: chosen.ranking,
        corrections: chosen.best.as_ref().unwrap_or(&baseline).corrections.clone(),
        extended,
    })
}
