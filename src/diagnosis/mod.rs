//! What a simulation gets wrong, and why: residuals → hypotheses → fits → selection → report.
//!
//! # Method
//! The nominal model is first allowed to be a little off (areas, elastic force and damping within the declared tolerance).
//! What error then remains is compared, on samples that no fit saw, with the error that remains when one effect more is
//! freed. An effect is named when it explains a good part of the error beyond doubt; otherwise the answer is that
//! nothing is wrong, or that the cause is unknown; so it is where a cause that is in no library explains far more (`unlisted`).

mod correction;
mod fits;
mod hypothesis;
mod links;
mod noise;
pub mod plan;
mod remaining;
pub mod report;
mod residuals;
mod selection;
mod timing;
mod unlisted;
mod ways;

pub use correction::Correction;
pub use fits::FittedParameter;
pub use remaining::Remaining;
pub use residuals::HeldOut;

use crate::Result;
use crate::measurement::{Between, Recording, Signal};
use crate::parameters::Parameters;
use crate::quality;
use crate::variables::Declared;
use fits::{Bench, Fitted};
use hypothesis::{Part, recording_of};
use residuals::{Data, Scope};
use selection::{Chosen, Judged};
use serde::Serialize;
use timing::Taken;
use unlisted::Shown;

/// How far a nominal muscle's own coefficients may be off without being called wrong, by default.
pub const DEFAULT_TOLERANCE: f64 = 0.03;

/// What a person should know of a command that does not go along straight lines between its samples.
fn says_how_command_goes(between: Between) -> Option<&'static str> {
    match between {
        Between::Lines => None,
        Between::Jumps => Some(
            "the command jumps at the samples that first show it: simulated so, the same causes explain far more than \
             with straight lines from the samples before; hold it until then when another tool replays the recording",
        ),
        Between::Held => Some(
            "the command is held from each sample to the next: simulated so, the same causes explain far more than \
             with straight lines between samples; hold it when another tool replays the recording",
        ),
    }
}

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
    /// Their fits: what each model with one of them in place of the named one changes of the nominal model.
    pub rivals: Vec<(&'static str, Values)>,
    /// The experiment that would tell them apart.
    pub experiment: &'static str,
}

/// What is told the effects that are at work in a fit.
pub type Fitting<'f> = dyn Fn(&str) + Sync + 'f;

/// Parameters with their values, SI.
pub type Values = Vec<(&'static str, f64)>;

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
    /// Share of the error beyond noise that this effect alone explains.
    pub explained: f64,
    /// Evidence for the effect (natural logarithm, at the effective number of samples).
    pub evidence: f64,
    /// What its fit changes of the nominal model.
    pub parameters: Values,
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// What was found.
    pub verdict: Verdict,
    /// Relative error of the nominal coefficients below which nothing was called wrong.
    pub tolerance: f64,
    /// The causes, in the order in which they were found: each explains most of what those before leave.
    pub causes: Vec<Cause>,
    /// Errors per signal.
    pub signals: Vec<SignalErrors>,
    /// 1 − error of the extended model / error of the nominal one, held out, each signal weighted by its noise.
    pub improvement: f64,
    /// Which samples no fit saw.
    pub held_out: Vec<HeldOut>,
    /// Whether the fit saw those as well, because the others do not tell the size of a cause precisely enough to foretell
    /// them, or are only foretold by them.
    pub saw_all: bool,
    /// All candidates, the best first.
    pub ranking: Vec<Ranked>,
    /// The extended model: the nominal one with corrections within the tolerance and the named cause.
    pub extended: Parameters,
    /// How the command goes between its samples: what explains the data best.
    pub between: Between,
    /// Corrections of the nominal model that were fitted along.
    pub corrections: Vec<FittedParameter>,
    /// Where the cause is unknown: a smooth correction without one, which explains nothing. No part of `extended`.
    pub correction: Option<Correction>,
    /// What a person should know about the input.
    pub notes: Vec<String>,
    /// What the error that is left goes with.
    pub remaining: Vec<Remaining>,
}

impl Diagnosis {
    /// Recordings as they are simulated: with the command between samples as it was found to go.
    pub fn taken(&self, recordings: &[Recording]) -> Vec<Recording> {
        recordings.iter().map(|recording| recording.going(self.between)).collect()
    }
}

/// Diagnoses recordings against a nominal model.
///
/// `tolerance` is the relative error of the nominal coefficients below which nothing is called wrong; `fitting` is told, before each fit,
/// the effects that are at work in it: how many there will be nobody knows. What is set anew in each recording is
/// found where these are [`numbered`](crate::measurement::numbered).
///
/// # Errors
/// [`Error::Recording`](crate::Error::Recording) where nothing can be compared; errors of the simulation of the nominal model.
pub fn diagnose(
    nominal: &Parameters,
    recordings: &[Recording],
    tolerance: f64,
    fitting: &Fitting<'_>,
) -> Result<Diagnosis> {
    let notes = quality::notes(recordings, nominal)?;
    let cannot_follow = || residuals::cannot_follow(recordings);
    let taken = Taken::in_all_ways(recordings, nominal, tolerance);
    let (found, data) = timing::better(&taken, fitting)?;
    answer(found.bench(), data, nominal, &found.chosen, notes).ok_or_else(cannot_follow)
}

/// The choice in words and figures, its errors on all samples.
fn answer(
    bench: &Bench,
    mut data: Data,
    nominal: &Parameters,
    chosen: &Chosen,
    mut notes: Vec<String>,
) -> Option<Diagnosis> {
    if chosen.saw_all {
        notes.push(
            "the fit saw all samples: the first ones do not tell the size of the cause, or not precisely enough"
                .to_owned(),
        );
    }
    let between = data.recordings()[0].between();
    notes.extend(says_how_command_goes(between).map(str::to_owned));
    let says_nothing = |name| format!("{name}: no output was measured that could be compared with the model");
    notes.extend(data.not_compared().map(says_nothing));
    let nominal_residuals = data.residuals(nominal)?;
    let mut left = data.residuals(&chosen.model.parameters)?;
    data.refine_noise(&left);
    let seen = if chosen.saw_all { Scope::All } else { Scope::Training };
    let (parameters, mut corrections) = bench.intervals(&chosen.model, seen);
    notes.extend(of_several(chosen, data.recordings()));
    let nominal_errors = data.held_out_rms(&nominal_residuals);
    let mut extended = chosen.model.parameters;
    let mut extended_errors = data.held_out_rms(&left);
    // Corrections that do not help on unseen samples are not made.
    if !chosen.names_causes() && data.weighted(&extended_errors) > data.weighted(&nominal_errors) {
        (extended, extended_errors, left) = (*nominal, nominal_errors.clone(), nominal_residuals);
        corrections.clear();
    }
    let (before, after) = (data.weighted(&nominal_errors), data.weighted(&extended_errors));
    let signals = nominal_errors.iter().map(|(signal, nominal_rms)| SignalErrors {
        signal: *signal,
        nominal_rms: *nominal_rms,
        extended_rms: extended_errors[signal],
        noise_rms: data.noise(*signal).level,
    });
    let baseline = |judged: &Judged| Ranked {
        effect: judged.fitted.hypothesis.parts[0].effect.name,
        explained: judged.explained,
        evidence: judged.evidence,
        parameters: changes(nominal, &judged.fitted.parameters),
    };
    let unexplained = chosen.verdict == Verdict::Unexplained;
    Some(Diagnosis {
        verdict: chosen.verdict,
        tolerance: data.tolerance,
        correction: if unexplained { correction::correction(bench, &extended) } else { None },
        causes: causes(chosen, nominal, &parameters),
        signals: signals.collect(),
        improvement: if before > 0.0 { 1.0 - after / before } else { 0.0 },
        held_out: data.held_out(),
        saw_all: chosen.saw_all,
        ranking: chosen.singles.iter().map(baseline).collect(),
        extended,
        between,
        corrections,
        notes,
        remaining: unlisted(bench, chosen).into_iter().chain(remaining::remaining(&data, &extended, &left)).collect(),
    })
}

/// What the error goes with as a cause in no library would have it.
fn unlisted(bench: &Bench, chosen: &Chosen) -> Option<Remaining> {
    let cause = chosen.best.hypothesis.beside?;
    let course = Shown::beside(&bench.data, &chosen.model.parameters)?.by(cause)?;
    let with = bench.fit_beside(&chosen.model, cause, &course, Scope::Training)?;
    let signal = cause.signal();
    let [before, after] = [&chosen.model, &with].map(|fitted| bench.data.held_out_rms(&fitted.residuals)[&signal]);
    let share = (1.0 - (after / before).powi(2)).max(0.0);
    Some(Remaining { signal, on: cause.on().to_owned(), share, is_known: true })
}

/// How to simulate another recording than the first with causes that have values of their own there.
fn of_several(chosen: &Chosen, recordings: &[Recording]) -> Option<String> {
    // What shifts in the first recording stays so in those that follow.
    let differ = |part: &&Part| recordings.len() > 1 && part.freed().any(|(name, _)| recording_of(name) > 0);
    let numbers = chosen.model.hypothesis.parts.iter().filter(differ);
    let numbers: Vec<_> = numbers.map(|part| format!("`{}.recording`", part.effect.name)).collect();
    let names: Vec<_> =
        recordings.iter().enumerate().map(|(index, r)| format!("{} for {}", index + 1, r.name())).collect();
    let text =
        format!("{} says which recording the extended model is for: {}", numbers.join(" and "), names.join(", "));
    (!numbers.is_empty()).then_some(text)
}

/// The causes as they are told, in the order in which they were found.
fn causes(chosen: &Chosen, nominal: &Parameters, parameters: &[FittedParameter]) -> Vec<Cause> {
    let parts = chosen.model.hypothesis.parts.iter().zip(&chosen.alternatives);
    let causes = parts.map(|(part, alternatives)| {
        let effect = part.effect;
        let own = |parameter: &&FittedParameter| parameter.name.split('.').next() == Some(effect.name);
        Cause {
            effect: effect.name,
            sentence: chosen.model.parameters.effects.sentence(effect.name).unwrap_or_default(),
            parameters: parameters.iter().filter(own).cloned().collect(),
            alternatives: alternatives.clone(),
            rivals: rivals(chosen, nominal, effect.name, alternatives),
            experiment: effect.experiment,
        }
    });
    causes.collect()
}

/// The fits with each of the alternatives in the place of a named effect.
fn rivals(
    chosen: &Chosen,
    nominal: &Parameters,
    effect: &str,
    alternatives: &[&'static str],
) -> Vec<(&'static str, Values)> {
    let others: Vec<_> = chosen.model.hypothesis.names().into_iter().filter(|name| *name != effect).collect();
    let fit_with = |name: &'static str| {
        let stands_in = |rival: &&Fitted| rival.hypothesis.has(name) && others.iter().all(|o| rival.hypothesis.has(o));
        let rival = chosen.rivals.iter().find(stands_in)?;
        Some((name, changes(nominal, &rival.parameters)))
    };
    alternatives.iter().filter_map(|name| fit_with(name)).collect()
}

/// The parameters of a model that differ from the nominal ones.
fn changes(nominal: &Parameters, model: &Parameters) -> Values {
    let (mut before, mut changes) = (Vec::new(), Vec::new());
    nominal.visit(&mut |_, value| before.push(value));
    let mut before = before.into_iter();
    model.visit(&mut |variable, value| {
        if before.next() != Some(value) {
            changes.push((variable.name, value));
        }
    });
    changes
}
