//! Residuals of a model against recordings: how large they are, what noise alone would leave, which of them no fit sees.

use super::noise::{self, Noise};
use crate::integrator::Accuracy;
use crate::measurement::{Between, Recording, Signal};
use crate::parameters::Parameters;
use crate::quality::correlation;
use crate::quality::sampling::longest_allowed;
use crate::quality::sensors::resolution;
use crate::recent::Recent;
use crate::simulation::{OUTPUTS, Replay, in_recording, replay, replay_remembering, replay_within};
use crate::start::pressure_deviation;
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;

/// Share of each recording, from its start, that fits see; the rest is held out.
const TRAINING_SHARE: f64 = 0.6;
/// Fewest samples of a recording from which anything can be concluded.
const FEWEST_SAMPLES: usize = 50;
/// Longest time in s over which neighbouring residuals are expected to hang together.
const LONGEST_CORRELATION: f64 = 3.0;
/// Structural error of a nominal muscle beyond its coefficients, as a share of the declared tolerance and of the span of
/// the signal: a polynomial is never quite the muscle.
const STRUCTURE_SHARE: f64 = 0.02;
/// Length of a block in s: errors of different blocks count as independent.
const BLOCK: f64 = 2.0;
/// A course with more of its variance than this in common with what drives the muscle may come from there.
const MOST_OF_VARIANCE: f64 = 0.5;
/// Simulations that are kept of each recording: fits of what sensors show change little else, nor do those of what is of another recording.
const KEPT_COURSES: usize = 32;
/// No sensor is better than this share of what it shows: data without any noise are simulated.
const FINEST: f64 = 1e-5;

/// The samples of one signal of one recording that can be compared.
struct Segment {
    recording: usize,
    signal: Signal,
    /// Positions within the recording.
    samples: Vec<usize>,
    /// Where they stand among all residuals.
    range: Range<usize>,
}

/// Recordings with what is needed to judge residuals.
pub struct Data<'a> {
    recordings: &'a [Recording],
    /// Time in s from which a recording is held out.
    held_out_from: Vec<f64>,
    segments: Vec<Segment>,
    noise: BTreeMap<Signal, Noise>,
    /// Per residual, the error in SI that a jump of the command leaves since its instant between two samples is not known.
    mistimed: Vec<f64>,
    /// Per residual, the error in SI that the start of its recording leaves since readings tell it no better, one standard deviation: by
    /// the pressure, and by place and rate of a load that moves there. Each is white of those before it; none where all count as known.
    by_start: Vec<Vec<f64>>,
    /// Relative error of the nominal coefficients below which nothing is called wrong.
    pub tolerance: f64,
    /// Accuracy of the integration.
    pub integration: Accuracy,
    /// Per recording, what the models did there that were simulated last; see [`replay_remembering`].
    courses: Vec<Recent<Replay>>,
}

/// How large the residuals of one signal in one recording are.
#[derive(Debug, Clone, Copy)]
pub struct Loss {
    /// The signal.
    pub signal: Signal,
    /// Number of residuals.
    pub samples: usize,
    /// Mean square relative to that of the noise.
    pub excess: f64,
    /// The same, where a residual beyond noise is excused as far as the unknown instant of a jump of the command may leave it.
    pub doubtless: f64,
    /// Mean square that the structural error of a sound nominal model makes, relative to that of the noise.
    pub structure: f64,
    /// Number of samples that are worth an independent one, judged from how these residuals hang together.
    pub effective: f64,
    /// The same if they hang together as noise and the structural error do.
    pub effective_beside_structure: f64,
}

/// Which samples are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Everything.
    All,
    /// Those that fits may see.
    Training,
    /// Those that no fit saw.
    HeldOut,
}

impl Scope {
    /// The samples that are not among these; for all of them the ones that no fit saw.
    pub fn others(self) -> Self {
        if self == Self::HeldOut { Self::Training } else { Self::HeldOut }
    }
}

/// A part of a recording that fits do not see.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// Name of the recording.
    pub recording: String,
    /// Time in s from which on they do not.
    pub from: f64,
}

impl std::fmt::Display for HeldOut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} from {:.1} s", self.recording, self.from)
    }
}

/// Recordings whose simulation gives nothing to compare.
pub fn cannot_follow(recordings: &[Recording]) -> Error {
    let of_load =
        if recordings.iter().any(|recording| recording.load_mass().is_some()) { "`load_mass` and " } else { "" };
    let names: Vec<_> = recordings.iter().map(Recording::name).collect();
    let problem = format!("the model cannot follow {}: check {of_load}the units", names.join(" or "));
    Error::Recording { path: recordings[0].path.clone(), problem }
}

impl<'a> Data<'a> {
    /// Looks at recordings before any fit.
    ///
    /// # Errors
    /// [`Error::Recording`] where there is none, one is too short, no measured signal can be judged, or the model cannot follow.
    pub fn new(recordings: &'a [Recording], nominal: &Parameters, tolerance: f64) -> Result<Self> {
        if recordings.is_empty() {
            return Err(Error::Recording {
                path: PathBuf::new(),
                problem: "there is no recording to diagnose".to_owned(),
            });
        }
        if let Some(short) = recordings.iter().find(|recording| recording.time.len() < FEWEST_SAMPLES) {
            let problem = format!("too short for a diagnosis: it takes at least {FEWEST_SAMPLES} samples");
            return Err(Error::Recording { path: short.path.clone(), problem });
        }
        let mut data = Self {
            recordings,
            held_out_from: last_part(recordings),
            segments: segments(recordings, nominal, tolerance)?,
            noise: BTreeMap::new(),
            mistimed: Vec::new(),
            by_start: Vec::new(),
            tolerance,
            integration: Accuracy::USUAL,
            courses: recordings.iter().map(|_| Recent::new(KEPT_COURSES)).collect(),
        };
        let judged: Vec<Signal> = data.signals().into_iter().filter(|signal| data.is_judged(*signal)).collect();
        data.segments.retain(|segment| judged.contains(&segment.signal));
        number(&mut data.segments);
        if data.segments.is_empty() {
            return Err(Error::Recording {
                path: recordings[0].path.clone(),
                problem: "no output was measured that changes and reaches to the end of the recording; add `force`, \
                          `contraction` or `gauge_pressure`"
                    .to_owned(),
            });
        }
        let residuals = data.residuals_on(recordings, 1, nominal).ok_or_else(|| cannot_follow(recordings))?;
        data.noise = data.noise_in(&residuals);
        data.mistimed = data.mistiming(nominal).unwrap_or_else(|| vec![0.0; data.count()]);
        Ok(data)
    }

    /// The signals that can be compared.
    pub fn signals(&self) -> Vec<Signal> {
        let mut signals: Vec<Signal> = self.segments.iter().map(|segment| segment.signal).collect();
        signals.sort();
        signals.dedup();
        signals
    }

    /// Names of the recordings of which nothing can be compared.
    pub fn not_compared(&self) -> impl Iterator<Item = String> {
        let is_compared = |recording: usize| self.segments.iter().any(|segment| segment.recording == recording);
        let recordings = self.recordings.iter().enumerate();
        recordings.filter(move |(number, _)| !is_compared(*number)).map(|(_, recording)| recording.name())
    }

    /// Noise of a signal's sensor, SI.
    pub fn noise(&self, signal: Signal) -> Noise {
        self.noise[&signal]
    }

    /// Standard deviation of the estimated variance of a signal's noise, relative to it.
    pub fn noise_doubt(&self, signal: Signal) -> f64 {
        let of_signal = self.segments.iter().filter(|segment| segment.signal == signal);
        let samples: usize = of_signal.map(|segment| segment.samples.len()).sum();
        (2.0 * self.noise[&signal].inflation / samples as f64).sqrt()
    }

    /// Noise per signal as the residuals of a model show it; they should come from a model that is about right.
    pub fn noise_in(&self, residuals: &[f64]) -> BTreeMap<Signal, Noise> {
        let estimates = |signal: Signal| {
            let of_signal = self.segments.iter().filter(move |segment| segment.signal == signal);
            of_signal.map(|segment| {
                let series = self.series(segment, residuals);
                let noise = noise::estimate(&series, self.recordings[segment.recording].period());
                let measured = self.measured(segment);
                let rounding = resolution(measured).unwrap_or(0.0) / 12.0_f64.sqrt();
                let least = rounding.max(FINEST * span(measured));
                (segment.samples.len() as f64, noise.level.max(least).powi(2), noise.inflation)
            })
        };
        let pooled = |signal: Signal| {
            let weight: f64 = estimates(signal).map(|(n, ..)| n).sum();
            let variance = estimates(signal).map(|(n, variance, _)| n * variance).sum::<f64>() / weight;
            let inflation = estimates(signal).map(|(n, _, inflation)| n * inflation).sum::<f64>() / weight;
            Noise { level: variance.sqrt(), inflation }
        };
        self.signals().into_iter().map(|signal| (signal, pooled(signal))).collect()
    }

    /// Mean square of an error that is some share of the largest that a signal shows, relative to that of the noise.
    pub fn share_of_reading(&self, signal: Signal, share: f64) -> f64 {
        let of_signal = self.segments.iter().filter(|segment| segment.signal == signal);
        let largest = of_signal.flat_map(|segment| self.measured(segment)).fold(0.0, |most: f64, v| most.max(v.abs()));
        (share * largest / self.noise[&signal].level).powi(2)
    }

    /// Mean square of the structural error of a sound nominal muscle relative to that of the noise. What comes before the
    /// muscle has none: the declared tolerance is one of the muscle.
    pub fn structure(&self, signal: Signal) -> f64 {
        self.mean_of_samples(signal, |segment| self.structure_in(segment))
    }

    /// The same in one recording.
    fn structure_in(&self, segment: &Segment) -> f64 {
        if segment.signal == Signal::GaugePressure { 0.0 } else { self.share_of_own_span(segment) }
    }

    /// Mean square of an error that is in each recording as large a share of the span of a signal, of whichever; relative to that of the noise.
    pub fn share_of_span(&self, signal: Signal) -> f64 {
        self.mean_of_samples(signal, |segment| self.share_of_own_span(segment))
    }

    /// Mean over all samples of a signal of what is the same for those of a recording.
    fn mean_of_samples(&self, signal: Signal, value: impl Fn(&Segment) -> f64) -> f64 {
        let of_signal = || self.segments.iter().filter(|segment| segment.signal == signal);
        let sum: f64 = of_signal().map(|segment| segment.samples.len() as f64 * value(segment)).sum();
        sum / of_signal().map(|segment| segment.samples.len() as f64).sum::<f64>()
    }

    fn share_of_own_span(&self, segment: &Segment) -> f64 {
        let error = STRUCTURE_SHARE * self.tolerance * span(self.measured(segment));
        (error / self.noise[&segment.signal].level).powi(2)
    }

    /// Takes what a better model shows of the noise, where that is less.
    pub fn refine_noise(&mut self, residuals: &[f64]) {
        for (signal, seen) in self.noise_in(residuals) {
            let known = self.noise.entry(signal).or_insert(seen);
            if seen.level < known.level {
                *known = seen;
            }
        }
    }

    /// The parts of recordings that are held out.
    pub fn held_out(&self) -> Vec<HeldOut> {
        let parts = self.recordings.iter().zip(&self.held_out_from);
        parts.map(|(recording, from)| HeldOut { recording: recording.name(), from: *from }).collect()
    }

    /// Measured − simulated in SI, signal by signal and recording by recording; `None` where the model cannot be
    /// simulated. What the pressure at the start does to them counts less, the more it is in doubt.
    pub fn residuals(&self, parameters: &Parameters) -> Option<Vec<f64>> {
        let mut residuals = self.residuals_of(&self.replays(parameters)?, 1)?;
        self.whiten_all(&mut residuals);
        Some(residuals)
    }

    fn whiten_all(&self, residuals: &mut [f64]) {
        for common in &self.by_start {
            (0..self.recordings.len()).for_each(|recording| self.whiten(recording, common, residuals));
        }
    }

    /// Takes the start for known no better than its readings tell; a model says what that does. Behind a valve that is shut
    /// the pressure is never forgotten: there the readings are all that there is, and what they lose is a leak.
    pub fn doubt_starts(&mut self, parameters: &Parameters) {
        let pressure = self.noise.get(&Signal::GaugePressure).copied();
        let deviation = |recording: &Recording| match pressure {
            Some(noise) if !parameters.valve.is_shut(recording.duration()) => {
                pressure_deviation(recording, noise.level, noise.inflation).unwrap_or(0.0)
            }
            _ => 0.0,
        };
        let of_pressure =
            |recording: &Recording, by: f64| recording.shifted(Signal::GaugePressure, by * deviation(recording));
        self.doubt(parameters, pressure.is_some(), of_pressure);
        let moves = self.recordings.iter().any(|recording| recording.motion().is_some());
        self.doubt(parameters, moves, |recording, by| recording.moving_by([by, 0.0]));
        self.doubt(parameters, moves, |recording, by| recording.moving_by([0.0, by]));
    }

    /// Takes something for known to one deviation only, by which recordings are changed, if it is in doubt at all.
    fn doubt(&mut self, parameters: &Parameters, is_doubted: bool, changed: impl Fn(&Recording, f64) -> Recording) {
        if !is_doubted {
            return;
        }
        let off = |by: f64| {
            let recordings: Vec<Recording> = self.recordings.iter().map(|recording| changed(recording, by)).collect();
            self.residuals_on(&recordings, 1, parameters)
        };
        if let (Some(less), Some(more)) = (off(-1.0), off(1.0)) {
            let mut common = more.iter().zip(&less).map(|(more, less)| 0.5 * (more - less)).collect::<Vec<_>>();
            self.whiten_all(&mut common);
            self.by_start.push(common);
        }
    }

    /// With an error at the start that does c to the residuals e of a recording, both in units of the noise, their covariance is
    /// C = 1 + c cᵀ; C^−½ e is white again.
    fn whiten(&self, recording: usize, common: &[f64], residuals: &mut [f64]) {
        let of_recording = || self.segments.iter().filter(|segment| segment.recording == recording);
        let weighted = of_recording().flat_map(|segment| {
            let noise = self.noise[&segment.signal];
            let weight = 1.0 / (noise.level.powi(2) * noise.inflation);
            let both = common[segment.range.clone()].iter().zip(&residuals[segment.range.clone()]);
            both.map(move |(common, residual)| (weight, *common, *residual))
        });
        let share = share_to_whiten(weighted);
        let all = of_recording().flat_map(|segment| segment.range.clone());
        for at in all {
            residuals[at] -= share * common[at];
        }
    }

    /// By how much the residuals of a model change where inputs go along cubics between their samples instead of along straight
    /// lines: how they truly go nobody knows. `None` where the model cannot be simulated.
    pub fn sampling_error(&self, parameters: &Parameters) -> Option<Vec<f64>> {
        // Both have as many instants, so that both begin alike.
        let going = |doubled: fn(&Recording) -> Recording| {
            let recordings: Vec<Recording> = self.recordings.iter().map(doubled).collect();
            self.residuals_on(&recordings, 2, parameters)
        };
        let (cubics, lines) = (going(Recording::doubled)?, going(Recording::straight)?);
        let mut error: Vec<f64> = cubics.iter().zip(lines).map(|(cubic, line)| cubic - line).collect();
        self.whiten_all(&mut error);
        Some(error)
    }

    /// Half of the difference that it makes to the residuals of a model whether jumps of the command come a quarter of a sampling interval
    /// before or after the middle between their samples: about the deviation if all instants there are as likely.
    fn mistiming(&self, parameters: &Parameters) -> Option<Vec<f64>> {
        let jumping = |early: bool| {
            let recordings: Vec<Recording> =
                self.recordings.iter().map(|recording| recording.with_jumps(early)).collect();
            self.residuals_on(&recordings, 2, parameters)
        };
        Some(jumping(true)?.iter().zip(jumping(false)?).map(|(early, late)| 0.5 * (early - late).abs()).collect())
    }

    /// Number of residuals.
    fn count(&self) -> usize {
        self.segments.last().map_or(0, |segment| segment.range.end)
    }

    /// Simulations of a model, one per recording; `None` where one cannot be done.
    pub fn replays(&self, parameters: &Parameters) -> Option<Vec<Replay>> {
        let replayed = |(recording, known)| replay_remembering(parameters, recording, self.integration, known).ok();
        self.recordings.par_iter().zip(&self.courses).map(replayed).collect()
    }

    /// Residuals of simulations on recordings whose `every`-th samples are those of this data.
    fn residuals_on(&self, recordings: &[Recording], every: usize, parameters: &Parameters) -> Option<Vec<f64>> {
        let replayed = |recording| replay_within(parameters, recording, self.integration).ok();
        self.residuals_of(&recordings.par_iter().map(replayed).collect::<Option<Vec<_>>>()?, every)
    }

    /// The same of simulations that were done.
    fn residuals_of(&self, replays: &[Replay], every: usize) -> Option<Vec<f64>> {
        let mut all = Vec::with_capacity(self.count());
        for segment in &self.segments {
            let (measured, simulated) = (self.measured(segment), replays[segment.recording].get(segment.signal)?);
            all.extend(segment.samples.iter().map(|&k| measured[k] - simulated[every * k]));
        }
        all.iter().all(|residual| residual.is_finite()).then_some(all)
    }

    /// Factor per residual that makes it count as much as it is worth: slow noise and frequent samples count less.
    /// Residuals out of scope count nothing.
    pub fn weights(&self, scope: Scope) -> Vec<f64> {
        self.weights_by(scope, |_, noise| noise.inflation)
    }

    /// The same for all samples, where there is the structural error of a sound nominal model as well.
    pub fn weights_beside_structure(&self) -> Vec<f64> {
        self.weights_by(Scope::All, |segment, _| self.inflation_beside_structure(segment))
    }

    /// Variance of sums of a segment's residuals relative to that of as many independent ones of the noise, where there is the structural
    /// error of a sound nominal model as well, one for each block.
    fn inflation_beside_structure(&self, segment: &Segment) -> f64 {
        let per_block = (BLOCK / self.recordings[segment.recording].period()).max(1.0);
        self.noise[&segment.signal].inflation + per_block * self.structure_in(segment)
    }

    fn weights_by(&self, scope: Scope, variance: impl Fn(&Segment, Noise) -> f64) -> Vec<f64> {
        let mut weights = Vec::new();
        for segment in &self.segments {
            let noise = self.noise[&segment.signal];
            let weight = 1.0 / (noise.level * variance(segment, noise).sqrt());
            weights.extend(segment.samples.iter().map(|&k| if self.is_in(scope, segment, k) { weight } else { 0.0 }));
        }
        weights
    }

    /// How large residuals are, per signal and recording.
    pub fn losses(&self, residuals: &[f64], scope: Scope) -> Vec<Loss> {
        let of_segment = |segment: &Segment| {
            let level = self.noise[&segment.signal].level;
            let in_scope =
                segment.samples.iter().zip(segment.range.clone()).filter(|(k, _)| self.is_in(scope, segment, **k));
            // Excused, and not credited: what is below noise does not make up for errors elsewhere.
            let excused = |at: usize| {
                let [of_noise, of_both] =
                    [level, level.hypot(self.mistimed[at])].map(|of| (residuals[at] / of).powi(2));
                of_noise.min(1.0).max(of_both)
            };
            let (scaled, doubtless): (Vec<f64>, Vec<f64>) =
                in_scope.map(|(_, at)| (residuals[at] / level, excused(at))).unzip();
            let structure = self.structure_in(segment);
            (!scaled.is_empty()).then(|| Loss {
                signal: segment.signal,
                samples: scaled.len(),
                excess: mean_square(&scaled),
                doubtless: doubtless.iter().sum::<f64>() / doubtless.len() as f64,
                structure,
                effective: effective_samples(&scaled, self.recordings[segment.recording].period()),
                effective_beside_structure: scaled.len() as f64 * (1.0 + structure)
                    / self.inflation_beside_structure(segment),
            })
        };
        self.segments.iter().filter_map(of_segment).collect()
    }

    /// Logarithm of the likelihood of residuals, up to a constant, if they hang together no longer than the noise does.
    pub fn log_likelihood(&self, losses: &[Loss]) -> f64 {
        let of = |loss: &Loss| -0.5 * loss.samples as f64 / self.noise[&loss.signal].inflation * loss.excess.ln();
        losses.iter().map(of).sum()
    }

    /// Residuals of a signal one by one: recording, position within it, residual in SI, and whether fits may see it.
    pub fn each<'s>(
        &'s self,
        signal: Signal,
        residuals: &'s [f64],
    ) -> impl Iterator<Item = (usize, usize, f64, bool)> + 's {
        self.segments.iter().filter(move |segment| segment.signal == signal).flat_map(move |segment| {
            segment
                .samples
                .iter()
                .zip(&residuals[segment.range.clone()])
                .map(move |(&k, residual)| (segment.recording, k, *residual, self.is_in(Scope::Training, segment, k)))
        })
    }

    /// Values at the samples of each recording as an error of one reading, per residual in SI; `None` where they are not known or the reading
    /// is not compared.
    pub fn at_residuals(&self, signal: Signal, values: &[Option<Vec<f64>>]) -> Option<Vec<f64>> {
        let mut all = vec![0.0; self.count()];
        let mut of_signal = self.segments.iter().filter(|segment| segment.signal == signal).peekable();
        of_signal.peek()?;
        for segment in of_signal {
            let values = values[segment.recording].as_ref()?;
            segment.samples.iter().zip(segment.range.clone()).for_each(|(&k, at)| all[at] = values[k]);
        }
        self.whiten_all(&mut all);
        Some(all)
    }

    /// Whether what an effect of a model does over time by itself cannot be told from what drives the muscle: in every recording in which
    /// it does anything, the command, or the pressure where that is not there, has most of its variance in common with it.
    pub fn goes_with_inputs(&self, model: &Parameters, effect: &str) -> bool {
        let goes = |recording: &Recording| {
            let effects = in_recording(model, recording).effects;
            let course: Vec<f64> =
                recording.since_start().into_iter().map(|time| effects.own_course(effect, time)).collect();
            let input = recording.get(Signal::Command).or_else(|| recording.get(Signal::GaugePressure));
            let is_driven = |input: &[f64]| correlation(&course, input).powi(2) > MOST_OF_VARIANCE;
            course.iter().any(|value| *value != course[0]).then(|| input.is_some_and(is_driven))
        };
        let each: Vec<bool> = self.recordings.iter().filter_map(goes).collect();
        !each.is_empty() && each.into_iter().all(|goes| goes)
    }

    /// The recordings.
    pub fn recordings(&self) -> &'a [Recording] {
        self.recordings
    }

    /// Per residual, the number of its block, and how many there are: blocks of a few seconds of a recording, all signals together.
    pub fn blocks(&self) -> (Vec<usize>, usize) {
        let mut first = 0;
        let mut numbers = Vec::with_capacity(self.recordings.len());
        for recording in self.recordings {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let of_recording: Vec<usize> =
                recording.since_start().into_iter().map(|time| first + (time / BLOCK) as usize).collect();
            first = of_recording.last().map_or(first, |last| last + 1);
            numbers.push(of_recording);
        }
        let of = |segment: &Segment| segment.samples.iter().map(|&k| numbers[segment.recording][k]).collect::<Vec<_>>();
        (self.segments.iter().flat_map(of).collect(), first)
    }

    /// Rms of each signal's residual on the samples that no fit saw, SI.
    pub fn held_out_rms(&self, residuals: &[f64]) -> BTreeMap<Signal, f64> {
        let mut sums: BTreeMap<Signal, (f64, f64)> = BTreeMap::new();
        for loss in self.losses(residuals, Scope::HeldOut) {
            let (sum, count) = sums.entry(loss.signal).or_default();
            *sum += loss.excess * loss.samples as f64;
            *count += loss.samples as f64;
        }
        sums.into_iter()
            .map(|(signal, (sum, count))| (signal, self.noise[&signal].level * (sum / count).sqrt()))
            .collect()
    }

    /// Errors of all signals together, each in units of its noise.
    pub fn weighted(&self, errors: &BTreeMap<Signal, f64>) -> f64 {
        errors.iter().map(|(signal, rms)| (rms / self.noise[signal].level).powi(2)).sum::<f64>().sqrt()
    }

    fn is_in(&self, scope: Scope, segment: &Segment, sample: usize) -> bool {
        let held_out = self.recordings[segment.recording].time[sample] >= self.held_out_from[segment.recording];
        match scope {
            Scope::All => true,
            Scope::Training => !held_out,
            Scope::HeldOut => held_out,
        }
    }

    fn is_judged(&self, signal: Signal) -> bool {
        let count = |scope: Scope| {
            let segments = self.segments.iter().filter(|segment| segment.signal == signal);
            segments.map(|s| s.samples.iter().filter(|k| self.is_in(scope, s, **k)).count()).sum::<usize>()
        };
        // As many as are held out of a recording that is just long enough.
        let fewest = (1.0 - TRAINING_SHARE) * FEWEST_SAMPLES as f64;
        [Scope::Training, Scope::HeldOut].into_iter().all(|scope| count(scope) as f64 >= fewest)
    }

    fn measured(&self, segment: &Segment) -> &[f64] {
        self.recordings[segment.recording].get(segment.signal).unwrap_or_default()
    }

    /// Residuals of a segment at all times of its recording, NaN where there are none.
    fn series(&self, segment: &Segment, residuals: &[f64]) -> Vec<f64> {
        let mut series = vec![f64::NAN; self.recordings[segment.recording].time.len()];
        segment.samples.iter().zip(&residuals[segment.range.clone()]).for_each(|(&k, residual)| series[k] = *residual);
        series
    }
}

/// How much of what a common error does to residuals is to be taken off them, so that they are white again, given for each its weight (one
/// over the variance of its noise), what one standard deviation of the common error does to it, and itself.
fn share_to_whiten(residuals: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
    let (mut doubt, mut shared) = (0.0, 0.0);
    for (weight, common, residual) in residuals {
        doubt += weight * common.powi(2);
        shared += weight * common * residual;
    }
    if doubt > 0.0 { (1.0 - 1.0 / (1.0 + doubt).sqrt()) / doubt * shared } else { 0.0 }
}

/// The samples that can be compared: measured, changing, an output of the simulation, and no longer in doubt after a gap.
fn segments(recordings: &[Recording], nominal: &Parameters, tolerance: f64) -> Result<Vec<Segment>> {
    let mut segments = Vec::new();
    for (recording, read) in recordings.iter().enumerate() {
        let simulated = replay(nominal, read)?;
        let doubt = GapDoubt::of(nominal, read);
        for signal in OUTPUTS {
            let (Some(measured), Some(_)) = (read.get(signal), simulated.get(signal)) else { continue };
            let least = STRUCTURE_SHARE * tolerance * span(measured);
            let doubted = doubt.as_ref().map(|doubt| doubt.doubted(signal, least));
            let is_sure = |k: &usize| doubted.as_ref().is_none_or(|doubted| !doubted[*k]);
            let samples: Vec<usize> =
                (0..measured.len()).filter(|&k| measured[k].is_finite()).filter(is_sure).collect();
            // A sensor that always shows the same says nothing of the model.
            if span(measured) > 0.0 && !samples.is_empty() {
                segments.push(Segment { recording, signal, samples, range: 0..0 });
            }
        }
    }
    number(&mut segments);
    Ok(segments)
}

/// What inputs that nobody knows, in the gaps of a recording, may do to a simulation.
struct GapDoubt {
    /// The last known samples before gaps.
    begins: BTreeSet<usize>,
    /// Simulation with inputs on straight lines, at twice as many instants.
    straight: Replay,
    /// The same with inputs off them in the gaps.
    bent: Replay,
}

impl GapDoubt {
    /// `None` where the inputs have no gap, or stay on straight lines on either side of it. It is the same however the command went between samples.
    fn of(nominal: &Parameters, recording: &Recording) -> Option<Self> {
        let recording = recording.going(Between::Lines);
        let longest = longest_allowed(recording.period(), &recording, nominal);
        let bent = replay(nominal, &recording.bent_in_gaps(longest)?).ok()?;
        let of_signal = |signal: &Signal| recording.gaps(*signal, longest).into_iter().map(|(from, _)| from);
        let begins = OUTPUTS.iter().chain([&Signal::Command]).flat_map(of_signal).collect();
        Some(Self { begins, straight: replay(nominal, &recording.straight()).ok()?, bent })
    }

    /// Which samples of a signal may be off by more than what is the least that counts: from a gap on until it never is any more.
    fn doubted(&self, signal: Signal, least: f64) -> Vec<bool> {
        let at_samples = |replay: &Replay| -> Vec<f64> {
            replay.get(signal).unwrap_or_default().iter().step_by(2).copied().collect()
        };
        let (straight, bent) = (at_samples(&self.straight), at_samples(&self.bent));
        let mut doubted = vec![false; straight.len()];
        let mut is_doubted = false;
        for k in (self.begins.first().copied().unwrap_or(0)..straight.len()).rev() {
            is_doubted &= !self.begins.contains(&k);
            is_doubted |= (bent[k] - straight[k]).abs() > least;
            doubted[k] = is_doubted;
        }
        doubted
    }
}

fn number(segments: &mut [Segment]) {
    let mut end = 0;
    for segment in segments {
        segment.range = end..end + segment.samples.len();
        end = segment.range.end;
    }
}

/// Times from which recordings are held out: the end of each, so that every load and every regime is seen by the fits.
fn last_part(recordings: &[Recording]) -> Vec<f64> {
    recordings.iter().map(|recording| recording.time[0] + TRAINING_SHARE * recording.duration()).collect()
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

/// Largest less smallest value; negative where there is none.
fn span(values: &[f64]) -> f64 {
    let present = || values.iter().copied().filter(|value| !value.is_nan());
    present().fold(f64::NEG_INFINITY, f64::max) - present().fold(f64::INFINITY, f64::min)
}

/// Number of samples divided by 1 + 2 Σ ρ, the sum of the autocorrelations up to the first that is negative
/// (initial positive sequence, C. Geyer 1992, doi 10.1214/ss/1177011137); at least one per block of two seconds.
fn effective_samples(series: &[f64], period: f64) -> f64 {
    let power: f64 = series.iter().map(|r| r * r).sum();
    if power <= 0.0 {
        return series.len() as f64;
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let longest = ((LONGEST_CORRELATION / period) as usize).min(series.len() / 4);
    let correlation = |lag: usize| series.iter().zip(&series[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
    let sum: f64 = (1..=longest).map(correlation).take_while(|rho| *rho > 0.0).sum();
    let samples = series.len() as f64;
    (samples / (1.0 + 2.0 * sum)).max(samples * (period / BLOCK).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn residuals_with_a_common_error_have_their_likelihood_once_white() {
        // eᵀ C⁻¹ e with C = D + c cᵀ, D the variances of the noise: the sum of squares of the whitened residuals in units of the noise.
        let deviation = DVector::from_fn(6, |k, _| 0.4 + 0.3 * k as f64);
        let common = DVector::from_fn(6, |k, _| (1.7 * k as f64).sin());
        let residuals = DVector::from_fn(6, |k, _| 2.0 * (0.9 * k as f64).cos());
        let covariance = DMatrix::from_diagonal(&deviation.map(|d| d * d)) + &common * common.transpose();
        let expected = residuals.dot(&covariance.lu().solve(&residuals).unwrap());

        let weighted = (0..6).map(|k| (deviation[k].powi(-2), common[k], residuals[k]));
        let white = &residuals - share_to_whiten(weighted) * &common;
        assert!((white.component_div(&deviation).norm_squared() - expected).abs() < 1e-12 * expected);
        assert_eq!(share_to_whiten([(1.0, 0.0, 2.0)].into_iter()), 0.0);
    }

    /// A load of 40 kg on a muscle at 2 bar, its command waving from the first sample on, with a gap of two seconds; its pressure
    /// is read with noise, so that the start is estimated from a few readings.
    fn with_a_gap() -> Recording {
        let noise = |k: u32| 0.01 * (f64::from(k * k) * 0.71).sin();
        let row = |k: u32| {
            let time = 0.02 * f64::from(k);
            let (command, pressure) = (2.0 + 0.3 * (2.0 * time).sin(), 2.0 + noise(k));
            format!("{time},{command},{pressure},{},40\n", 100.0 + noise(k))
        };
        let rows: String = (0..600).filter(|k| !(200..300).contains(k)).map(row).collect();
        let header = "time [s],command [V],gauge_pressure [bar],contraction [mm],load_mass [kg]";
        Recording::parse(format!("{header}\n{rows}").as_bytes(), std::path::Path::new("gap.csv"), &[]).unwrap()
    }

    #[test]
    fn readings_count_again_once_a_gap_in_the_inputs_is_forgotten() {
        let (read, mut nominal) = (with_a_gap(), Parameters::default());
        let doubted = |nominal: &Parameters| GapDoubt::of(nominal, &read).unwrap().doubted(Signal::Contraction, 1e-5);
        let behind_valve = doubted(&nominal);
        assert!(!behind_valve[199] && behind_valve[200] && behind_valve[210] && !behind_valve[499]);
        // A shut valve takes no notice of its command; what the start is estimated from must be the same with and without the gap.
        nominal.valve.bandwidth = 1e-9;
        assert!(doubted(&nominal).iter().all(|is_doubted| !is_doubted));
    }

    #[test]
    fn neighbours_that_hang_together_are_worth_less() {
        let alternating: Vec<f64> = (0..1000).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(effective_samples(&alternating, 0.01), 1000.0);
        let blocks: Vec<f64> = (0..1000).map(|k| if k / 20 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let worth = effective_samples(&blocks, 0.01);
        assert!((30.0..200.0).contains(&worth), "{worth}");
        assert_eq!(effective_samples(&blocks, 10.0), 1000.0, "none is worth more than itself");
    }
}
