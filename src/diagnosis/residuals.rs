//! Residuals of a model against recordings: how large they are allowed to be, and which of them no fit sees.

use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::{OUTPUTS, Replay, replay};
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Share of each recording, from its start, that fits see when its end is held out.
const TRAINING_SHARE: f64 = 0.6;
/// Structural error of a nominal model beyond its coefficients, as a share of the declared tolerance and of the span of
/// the signal: a polynomial is never quite the muscle.
const STRUCTURE_SHARE: f64 = 0.2;
/// Fewest samples of a recording from which anything can be concluded.
const FEWEST_SAMPLES: usize = 50;
/// Length of a block in s: errors of different blocks count as independent.
const BLOCK: f64 = 2.0;

/// Recordings with what is needed to judge residuals.
pub struct Data<'a> {
    recordings: &'a [Recording],
    /// Time in s from which a recording is held out.
    held_out_from: Vec<f64>,
    noise: BTreeMap<Signal, f64>,
    /// Residuals of this size are expected of a sound model.
    scale: BTreeMap<Signal, f64>,
}

/// Squared, scaled residuals of held-out blocks.
#[derive(Debug, Clone)]
pub struct HeldOut {
    /// Mean square per block, all signals together.
    pub blocks: Vec<f64>,
    /// Mean square over everything.
    pub loss: f64,
    /// Number of samples that are worth an independent one.
    pub effective_samples: f64,
}

impl<'a> Data<'a> {
    /// Looks at recordings before any fit.
    ///
    /// # Errors
    /// [`Error::Recording`] where a recording is too short, or no measured signal can be judged.
    pub fn new(recordings: &'a [Recording], nominal: &Parameters, tolerance: f64) -> Result<Self> {
        if let Some(short) = recordings.iter().find(|recording| recording.time.len() < FEWEST_SAMPLES) {
            let problem = format!("too short for a diagnosis: it takes at least {FEWEST_SAMPLES} samples");
            return Err(Error::Recording { path: short.path.clone(), problem });
        }
        let replays: Vec<Replay> = recordings.iter().map(|r| replay(nominal, r)).collect::<Result<_>>()?;
        // Recordings that have a signal as an output.
        let with = |signal: Signal| {
            let both = |(index, r): (usize, &Replay)| r.get(signal).and(recordings[index].get(signal)).map(|_| index);
            replays.iter().enumerate().filter_map(both).collect::<Vec<_>>()
        };
        let (mut noise, mut scale) = (BTreeMap::new(), BTreeMap::new());
        for signal in OUTPUTS {
            let measured: Vec<&[f64]> = with(signal).into_iter().filter_map(|k| recordings[k].get(signal)).collect();
            // A sensor that always shows the same says nothing of the model.
            let spans = measured.iter().map(|values| span(values)).filter(|span| *span > 0.0);
            let Some(smallest_span) = spans.reduce(f64::min) else { continue };
            let finest = 1e-6 * smallest_span; // no sensor is better than a millionth of what it shows
            let level = rms(&measured.iter().map(|values| noise_rms(values)).collect::<Vec<_>>()).max(finest);
            noise.insert(signal, level);
            scale.insert(signal, level.hypot(STRUCTURE_SHARE * tolerance * smallest_span));
        }
        let counts = |from: &[f64], signal: Signal| {
            let mut counts = (0, 0);
            for index in with(signal) {
                let recording = &recordings[index];
                let values = recording.get(signal).unwrap_or_default();
                for (time, _) in recording.time.iter().zip(values).filter(|(_, value)| !value.is_nan()) {
                    let count = if *time < from[index] { &mut counts.0 } else { &mut counts.1 };
                    *count += 1;
                }
            }
            counts
        };
        let judged = |from: &[f64], signal: &Signal| {
            let (seen, unseen) = counts(from, *signal);
            seen >= FEWEST_SAMPLES / 2 && unseen >= FEWEST_SAMPLES / 2
        };
        // The last of several recordings is held out, if all signals can be both fitted and judged then.
        let mut held_out_from = last_recording(recordings);
        if recordings.len() == 1 || !scale.keys().all(|signal| judged(&held_out_from, signal)) {
            held_out_from = last_part(recordings);
            scale.retain(|signal, _| judged(&held_out_from, signal));
        }
        if scale.is_empty() {
            return Err(Error::Recording {
                path: recordings[0].path.clone(),
                problem: "no output was measured that changes and reaches to the end of the recording; add `force`, \
                          `contraction` or `gauge_pressure`"
                    .to_owned(),
            });
        }
        Ok(Self { recordings, held_out_from, noise, scale })
    }

    /// Loss that sensor noise alone leaves.
    pub fn noise_floor(&self) -> f64 {
        let shares = self.scale.iter().map(|(signal, scale)| (self.noise[signal] / scale).powi(2));
        shares.sum::<f64>() / self.scale.len() as f64
    }

    /// The signals that can be compared.
    pub fn signals(&self) -> Vec<Signal> {
        self.scale.keys().copied().collect()
    }

    /// Rms noise of a signal's sensor, SI.
    pub fn noise(&self, signal: Signal) -> f64 {
        self.noise[&signal]
    }

    /// What is held out, in words.
    pub fn held_out(&self) -> String {
        let parts = self.recordings.iter().zip(&self.held_out_from).filter(|(r, from)| r.time.last() > Some(from));
        let words = parts.map(|(recording, from)| {
            if *from <= recording.time[0] { recording.name() } else { format!("{} from {from:.1} s", recording.name()) }
        });
        words.collect::<Vec<_>>().join(", ")
    }

    /// Scaled residuals of the samples that fits may see; `None` where the model cannot be simulated.
    pub fn training_residuals(&self, parameters: &Parameters) -> Option<Vec<f64>> {
        let replays = self.replays(parameters)?;
        let mut all = Vec::new();
        for (index, replay) in replays.iter().enumerate() {
            self.each_residual(index, replay, |_, time, scaled| {
                if time < self.held_out_from[index] {
                    all.push(scaled);
                }
            });
        }
        Some(all)
    }

    /// Number of training samples per independent one, from the autocorrelation of a model's residuals.
    pub fn samples_per_independent(&self, parameters: &Parameters) -> f64 {
        let residuals = self.training_residuals(parameters).unwrap_or_default();
        let rho = autocorrelation(&residuals);
        (1.0 + rho) / (1.0 - rho)
    }

    /// Squared residuals of the samples that no fit saw; `None` where the model cannot be simulated.
    pub fn held_out_loss(&self, parameters: &Parameters) -> Option<HeldOut> {
        let replays = self.replays(parameters)?;
        let mut blocks: BTreeMap<(usize, u64), (f64, usize)> = BTreeMap::new();
        let mut series = Vec::new();
        for (index, replay) in replays.iter().enumerate() {
            self.each_residual(index, replay, |_, time, scaled| {
                if time >= self.held_out_from[index] {
                    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                    let block = ((time - self.held_out_from[index].max(self.recordings[index].time[0])) / BLOCK) as u64;
                    let entry = blocks.entry((index, block)).or_default();
                    *entry = (entry.0 + scaled * scaled, entry.1 + 1);
                    series.push(scaled);
                }
            });
        }
        let rho = autocorrelation(&series);
        Some(HeldOut {
            blocks: blocks.values().map(|(sum, count)| sum / *count as f64).collect(),
            loss: series.iter().map(|r| r * r).sum::<f64>() / series.len() as f64,
            effective_samples: series.len() as f64 * (1.0 - rho) / (1.0 + rho),
        })
    }

    /// Rms of each signal's residual on the samples that no fit saw, SI; `None` where the model cannot be simulated.
    pub fn held_out_rms(&self, parameters: &Parameters) -> Option<BTreeMap<Signal, f64>> {
        let replays = self.replays(parameters)?;
        let mut sums: BTreeMap<Signal, (f64, usize)> = self.signals().into_iter().map(|s| (s, (0.0, 0))).collect();
        for (index, replay) in replays.iter().enumerate() {
            self.each_residual(index, replay, |signal, time, scaled| {
                if time >= self.held_out_from[index] {
                    let entry = sums.entry(signal).or_default();
                    *entry = (entry.0 + scaled * scaled, entry.1 + 1);
                }
            });
        }
        Some(sums.into_iter().map(|(s, (sum, n))| (s, self.scale[&s] * (sum / n.max(1) as f64).sqrt())).collect())
    }

    fn replays(&self, parameters: &Parameters) -> Option<Vec<Replay>> {
        self.recordings.par_iter().map(|recording| replay(parameters, recording).ok()).collect()
    }

    /// Every residual of a recording: signal, time in s, measured − simulated relative to its scale.
    fn each_residual(&self, index: usize, replay: &Replay, mut see: impl FnMut(Signal, f64, f64)) {
        let recording = &self.recordings[index];
        for (signal, scale) in &self.scale {
            if let (Some(measured), Some(simulated)) = (recording.get(*signal), replay.get(*signal)) {
                for (k, time) in recording.time.iter().enumerate() {
                    let residual = measured[k] - simulated[k];
                    if residual.is_finite() {
                        see(*signal, *time, residual / scale);
                    }
                }
            }
        }
    }
}

/// Times from which recordings are held out when it is the last one, whole.
fn last_recording(recordings: &[Recording]) -> Vec<f64> {
    let last = recordings.len() - 1;
    (0..=last).map(|index| if index == last { f64::NEG_INFINITY } else { f64::INFINITY }).collect()
}

/// Times from which recordings are held out when it is the end of each.
fn last_part(recordings: &[Recording]) -> Vec<f64> {
    let from = |time: &Vec<f64>| time[0] + TRAINING_SHARE * (time[time.len() - 1] - time[0]);
    recordings.iter().map(|recording| from(&recording.time)).collect()
}

/// Rms noise of a sensor: the scatter about straight lines through neighbouring samples, robust against real motion,
/// and at least the noise of rounding to the steps that the values show.
pub fn noise_rms(values: &[f64]) -> f64 {
    let present: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    let mut bends: Vec<f64> = present.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    let mut steps: Vec<f64> = present.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).collect();
    bends.sort_by(f64::total_cmp);
    steps.sort_by(f64::total_cmp);
    let median = bends.get(bends.len() / 2).copied().unwrap_or(0.0);
    let quantum = steps.first().copied().unwrap_or(0.0);
    // 1.4826 makes a median deviation a standard deviation; the bend of white noise has √6 of it.
    let scatter = 1.4826 * median / 6.0_f64.sqrt();
    scatter.max(quantum / 12.0_f64.sqrt())
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Largest less smallest value; negative where there is none.
fn span(values: &[f64]) -> f64 {
    let present = || values.iter().copied().filter(|value| !value.is_nan());
    present().fold(f64::NEG_INFINITY, f64::max) - present().fold(f64::INFINITY, f64::min)
}

/// Correlation of neighbours, within what leaves an effective sample size.
fn autocorrelation(series: &[f64]) -> f64 {
    let power: f64 = series.iter().map(|r| r * r).sum();
    let together: f64 = series.windows(2).map(|pair| pair[0] * pair[1]).sum();
    if power > 0.0 { (together / power).clamp(0.0, 0.999) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_told_from_motion() {
        // A slow sine of amplitude 1 with uniform noise of 1e-3 rms from a linear congruential generator.
        let mut seed = 1_u32;
        let values: Vec<f64> = (0..4000)
            .map(|k| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = (f64::from(seed) / f64::from(u32::MAX) - 0.5) * 12.0_f64.sqrt() * 1e-3;
                (f64::from(k) * 0.002).sin() + noise
            })
            .collect();
        let estimate = noise_rms(&values);
        assert!((0.7e-3..1.4e-3).contains(&estimate), "{estimate}");
    }

    #[test]
    fn a_constant_signal_has_no_noise() {
        assert_eq!(noise_rms(&[1.0; 50]), 0.0);
    }
}
