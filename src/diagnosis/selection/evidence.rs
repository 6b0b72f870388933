//! What speaks for a hypothesis: what it takes off the error, and what may be left of it.

use super::LEAST_BESIDE_OTHERS;
use crate::diagnosis::fits::Fitted;
use crate::diagnosis::residuals::{Data, Loss};
use crate::measurement::Signal;
use std::collections::BTreeMap;

/// Error beyond noise, as a share of the variance of the noise, below which nothing is looked for.
pub const NEGLIGIBLE: f64 = 0.25;
/// Share of a signal's error that a named effect may leave because its form differs from the true one: a tenth of its rms.
pub const LEFT_BY_FORM: f64 = 0.01;
/// How many standard deviations of the noise's variance a sound model may leave: 0.1 % of all estimates are off by more.
const NOISE_DOUBT: f64 = 3.0;

/// Logarithm of the odds for a hypothesis against another: gain of likelihood per signal and recording at the effective
/// number of samples, less what its parameters cost (G. Schwarz 1978, doi 10.1214/aos/1176344136).
///
/// The size of the residuals of each signal is taken as unknown, so that the ratio counts; the structural error that a sound
/// model may have is added to them, and how long they hang together is judged from the fit that the odds are for.
pub fn evidence(without: &Fitted, with: &Fitted) -> f64 {
    odds(&without.losses, &with.losses, with.hypothesis.size() as f64 - without.hypothesis.size() as f64)
}

/// The same of losses, for a hypothesis with so many parameters more.
pub fn odds(without: &[Loss], with: &[Loss], more: f64) -> f64 {
    let samples: f64 = with.iter().map(|loss| loss.effective).sum();
    gain(without, with) - 0.5 * more * samples.max(2.0).ln()
}

/// Gain of logarithmic likelihood.
pub fn gain(without: &[Loss], with: &[Loss]) -> f64 {
    let ratio = |b: &Loss, a: &Loss| (b.excess + b.structure) / (a.excess + a.structure);
    without.iter().zip(with).map(|(b, a)| 0.5 * a.effective * ratio(b, a).ln()).sum()
}

/// Mean squared residual per signal beyond that of the noise, relative to it; what the unknown instants of jumps of the command may leave
/// does not count.
pub fn beyond_noise(losses: &[Loss]) -> BTreeMap<Signal, f64> {
    let mut sums: BTreeMap<Signal, (f64, f64)> = BTreeMap::new();
    for loss in losses {
        let (sum, count) = sums.entry(loss.signal).or_default();
        *sum += loss.doubtless * loss.samples as f64;
        *count += loss.samples as f64;
    }
    sums.into_iter().map(|(signal, (sum, count))| (signal, (sum / count - 1.0).max(0.0))).collect()
}

/// What may be left of a signal's error because the form of an effect is never known exactly.
pub fn left_by_form(before: f64) -> f64 {
    NEGLIGIBLE.max(LEFT_BY_FORM * before)
}

/// What may be left of a signal's error because of noise, which is known so precisely, and the structural error that a sound model may have.
pub fn left_by_structure(signal: Signal, data: &Data) -> f64 {
    left_by_noise(signal, data) + data.structure(signal)
}

/// What may be left because of noise alone.
pub fn left_by_noise(signal: Signal, data: &Data) -> f64 {
    NEGLIGIBLE + NOISE_DOUBT * data.noise_doubt(signal)
}

/// What is left beyond that.
fn unsound(left: &BTreeMap<Signal, f64>, data: &Data) -> f64 {
    left.iter().map(|(signal, left)| (left - left_by_structure(*signal, data)).max(0.0)).sum()
}

/// Whether no signal has more left beyond noise than it may.
pub fn leaves_at_most(losses: &[Loss], most: impl Fn(Signal) -> f64) -> bool {
    beyond_noise(losses).into_iter().all(|(signal, left)| left <= most(signal))
}

/// Whether more is left of some signal than noise and the structural error that a sound model may have.
pub fn is_unsound(losses: &[Loss], data: &Data) -> bool {
    !leaves_at_most(losses, |signal| left_by_structure(signal, data))
}

/// Whether no more is left of what there was before than forms may leave, which are never known exactly, or a sound model. Where there was
/// less than the noise itself, that says nothing of a cause, neither before nor now: noise with a long memory is told only so well.
pub fn may_be_form(before: &[Loss], left: &[Loss], data: &Data) -> bool {
    let before = beyond_noise(before);
    leaves_at_most(left, |signal| {
        let of_form =
            if before[&signal] < LEAST_BESIDE_OTHERS { LEAST_BESIDE_OTHERS } else { left_by_form(before[&signal]) };
        of_form.max(left_by_structure(signal, data))
    })
}

/// Share of the error beyond noise that goes away.
pub fn explained(without: &[Loss], with: &[Loss], data: &Data) -> f64 {
    let before: f64 = beyond_noise(without).values().sum();
    1.0 - unsound(&beyond_noise(with), data) / before.max(f64::MIN_POSITIVE)
}

/// Whether more goes away of some signal than the structural error of a sound model, and than some variance, relative to that of the noise.
pub fn takes_off(without: &[Loss], with: &[Loss], data: &Data, least: f64) -> bool {
    let (before, after) = (beyond_noise(without), beyond_noise(with));
    before.into_iter().any(|(signal, beyond)| beyond - after[&signal] > data.structure(signal).max(least))
}

/// Whether nothing beyond noise is left that is worth a look.
pub fn is_negligible(losses: &[Loss]) -> bool {
    leaves_at_most(losses, |_| NEGLIGIBLE)
}
