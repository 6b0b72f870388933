//! What recordings can bear: contradictory units, sensors that do not follow, gaps, data that no sensor made.
//!
//! Judged before any fit, from the recordings and from static relations of the nominal model. Each finding is a sentence
//! for a person; where going on makes no sense it is an error. Every limit states its reason where it is declared.

pub(crate) mod sampling;
pub(crate) mod sensors;
mod units;

pub(crate) use units::HIGHEST_PRESSURE;

use crate::Result;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;

/// What a person should know of recordings before they are compared with a model, one sentence each; empty where there
/// is nothing to say.
///
/// # Errors
/// [`crate::Error::Recording`] where two columns contradict each other, or a column contradicts the muscle, by so much
/// that only a wrong unit can be the reason.
pub fn notes(recordings: &[Recording], parameters: &Parameters) -> Result<Vec<String>> {
    let mut notes = of_each(recordings, |recording| {
        let mut found = units::notes(recording, parameters)?;
        found.extend(sampling::notes(recording, parameters));
        found.extend(sensors::notes(recording, parameters));
        Ok(found)
    })?;
    notes.extend(sensors::copied_recordings(recordings));
    notes.extend(sampling::too_short(recordings));
    Ok(notes)
}

/// The part of [`notes`] on units and signs: what matters whatever the recordings are for.
///
/// # Errors
/// As [`notes`].
pub fn notes_on_units(recordings: &[Recording], parameters: &Parameters) -> Result<Vec<String>> {
    of_each(recordings, |recording| units::notes(recording, parameters))
}

/// What is found in each recording, with its name before it.
fn of_each(recordings: &[Recording], found: impl Fn(&Recording) -> Result<Vec<String>>) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    for recording in recordings {
        notes.extend(found(recording)?.into_iter().map(|note| format!("{}: {note}", recording.name())));
    }
    Ok(notes)
}

/// A column whose values a sensor shows: everything but the command, and a contraction that is prescribed.
fn is_measured(recording: &Recording, signal: Signal) -> bool {
    match signal {
        Signal::GaugePressure | Signal::Force => true,
        Signal::Contraction => recording.load_mass().is_some(),
        _ => false,
    }
}

/// The header of a column as the file has it.
fn header(recording: &Recording, signal: Signal) -> String {
    format!("`{} [{}]`", signal.name(), recording.unit_in_file(signal).unwrap_or(signal.unit()))
}

/// A value in SI as the file has it, with its unit.
fn in_file_unit(recording: &Recording, signal: Signal, value: f64) -> String {
    let unit = recording.unit_in_file(signal).unwrap_or(signal.unit());
    let scale = signal.units().iter().find(|(symbol, _)| *symbol == unit).map_or(1.0, |(_, scale)| *scale);
    format!("{} {unit}", rounded(value / scale))
}

/// A number to four digits, without superfluous zeros.
fn rounded(value: f64) -> String {
    let digits = format!("{value:.3e}").parse::<f64>().unwrap_or(value);
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) { format!("{digits}") } else { format!("{digits:e}") }
}

/// Values that are there.
fn present(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|value| !value.is_nan()).collect()
}

/// Value below which a share of the present values lies; `None` where there are none.
pub(crate) fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = present(values);
    sorted.sort_by(f64::total_cmp);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let index = (share * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied()
}

/// Largest less smallest present value; 0 where there is none.
pub(crate) fn span(values: &[f64]) -> f64 {
    let present = present(values);
    let largest = present.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = present.iter().copied().fold(f64::INFINITY, f64::min);
    (largest - smallest).max(0.0)
}

/// Range of the middle nine tenths of the present values: what they span without spikes.
fn middle_span(values: &[f64]) -> f64 {
    quantile(values, 0.95).zip(quantile(values, 0.05)).map_or(0.0, |(high, low)| high - low)
}

/// Means of two signals, and the sums of products of their deviations from these: of the first with itself, of both, of the second with
/// itself; over the samples that both have.
fn moments(a: &[f64], b: &[f64]) -> ([f64; 2], [f64; 3]) {
    let pairs: Vec<(f64, f64)> =
        a.iter().copied().zip(b.iter().copied()).filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
    let mean = |pick: fn(&(f64, f64)) -> f64| pairs.iter().map(pick).sum::<f64>() / pairs.len() as f64;
    let (mean_a, mean_b) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let sum =
        |product: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(a, b)| product(a - mean_a, b - mean_b)).sum::<f64>();
    ([mean_a, mean_b], [sum(&|a, _| a * a), sum(&|a, b| a * b), sum(&|_, b| b * b)])
}

/// Slope and offset of the straight line by which one signal best gives another, over the samples that both have; NaN where
/// the first one rests.
fn line(from: &[f64], to: &[f64]) -> (f64, f64) {
    let ([mean_from, mean_to], [own, both, _]) = moments(from, to);
    let slope = both / own;
    (slope, mean_to - slope * mean_from)
}

/// Correlation of two signals over the samples that both have; 0 where one of them rests.
pub(crate) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (_, [of_a, of_both, of_b]) = moments(a, b);
    let scale = (of_a * of_b).sqrt();
    if scale > 0.0 { of_both / scale } else { 0.0 }
}

/// Gauge pressure in Pa, shape `(n_samples,)`: measured, or else what the command asks for.
fn known_pressure(recording: &Recording, parameters: &Parameters) -> Option<Vec<f64>> {
    let measured = recording.get(Signal::GaugePressure).filter(|values| span(values) > 0.0);
    measured.map(<[f64]>::to_vec).or_else(|| asked_pressure(recording, parameters))
}

/// Gauge pressure in Pa that the command asks for, shape `(n_samples,)`.
fn asked_pressure(recording: &Recording, parameters: &Parameters) -> Option<Vec<f64>> {
    let command = recording.get(Signal::Command)?;
    // `max` would turn a missing sample into zero.
    let asked = |u: &f64| if u.is_nan() { *u } else { parameters.valve.target_pressure(*u) };
    Some(command.iter().map(asked).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_is_that_of_a_straight_line() {
        let a: Vec<f64> = (0..1000).map(|k| f64::from(k % 7)).collect();
        let falling: Vec<f64> = a.iter().map(|a| 3.0 - 2.0 * a).collect();
        assert!((correlation(&a, &falling) + 1.0).abs() < 1e-12);
        // Unrelated halves: of 4 + 1 parts of variance the line explains 4. A missing sample does not count.
        let half: Vec<f64> = (0..1000).map(|k| f64::from(k % 2)).collect();
        let mut noisy: Vec<f64> = (0..1000).map(|k| f64::from(k % 2) * 4.0 + f64::from(k / 2 % 2) * 2.0).collect();
        assert!((correlation(&half, &noisy).powi(2) - 0.8).abs() < 1e-12);
        noisy.splice(0..4, [f64::NAN; 4]);
        assert!((correlation(&half, &noisy).powi(2) - 0.8).abs() < 1e-12);
        assert_eq!(correlation(&[1.0, 1.0], &[2.0, 3.0]), 0.0);
    }
}
