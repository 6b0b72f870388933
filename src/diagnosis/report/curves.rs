//! Signals over time for the interactive plots of the report, as compact JSON.

use super::display_unit;
use crate::diagnosis::Diagnosis;
use crate::measurement::{Recording, Signal};
use crate::simulation::{OUTPUTS, Replay};
use serde_json::{Value, json};

/// Most samples per curve of one recording; more are not seen and make the page slow.
const MOST_SAMPLES: usize = 5000;
/// Most samples per curve of all recordings together.
const MOST_SAMPLES_OF_ALL: usize = 16_000;
/// Steps that the span of a measured signal, and of time, is rounded to.
const STEPS: (f64, f64) = (2e4, 1e6);
/// Values are rounded to this share of the noise, where that is finer.
const SHARE_OF_NOISE: f64 = 0.2;

/// Most samples per curve that are shown of each of so many recordings.
pub fn most_samples(recordings: usize) -> usize {
    MOST_SAMPLES.min(MOST_SAMPLES_OF_ALL / recordings.max(1))
}

/// The signals that were measured and are an output of the simulation.
pub fn compared(recording: &Recording, replay: &Replay) -> Vec<Signal> {
    let both = |signal: &Signal| recording.get(*signal).is_some() && replay.get(*signal).is_some();
    OUTPUTS.into_iter().filter(both).collect()
}

/// A signal over time: measured, nominal and extended, in the unit for people.
pub fn over_time(
    diagnosis: &Diagnosis,
    recording: &Recording,
    signal: Signal,
    [nominal, extended]: &[Replay; 2],
    most: usize,
) -> Value {
    let (unit, size) = display_unit(signal);
    let curves = [recording.get(signal), nominal.get(signal), extended.get(signal)].map(Option::unwrap_or_default);
    let [measured, nominal, extended] = curves;
    let residual = |simulated: &[f64]| measured.iter().zip(simulated).map(|(m, s)| m - s).collect::<Vec<_>>();
    let kept = telling(&[measured, &residual(nominal), &residual(extended)], most);
    let noise = noise(diagnosis, signal);
    let step = (span(measured) / STEPS.0).min(noise.map_or(f64::INFINITY, |noise| SHARE_OF_NOISE * noise));
    let shown = |values: &[f64]| rounded(kept.iter().map(|&k| values[k] / size), step / size);
    json!({
        "label": signal.name().replace('_', " "),
        "unit": unit,
        "noise": noise.map(|noise| noise / size),
        "time": rounded(kept.iter().map(|&k| recording.time[k]), span(&recording.time) / STEPS.1),
        "measured": shown(measured),
        "nominal": shown(nominal),
        "extended": shown(extended),
    })
}

/// Noise of a signal, SI; `None` where the diagnosis did not judge it.
pub fn noise(diagnosis: &Diagnosis, signal: Signal) -> Option<f64> {
    diagnosis.signals.iter().find(|errors| errors.signal == signal).map(|errors| errors.noise_rms)
}

/// Positions of at most about `most` samples that keep the look of all curves: of each stretch of time the lowest and
/// the highest of each curve, and a missing one where there is a gap.
fn telling(curves: &[&[f64]], most: usize) -> Vec<usize> {
    let samples = curves[0].len();
    if samples <= most {
        return (0..samples).collect();
    }
    let stretch = samples.div_ceil(most / (2 * curves.len() + 1));
    let mut kept = Vec::with_capacity(most);
    for start in (0..samples).step_by(stretch) {
        let within = start..(start + stretch).min(samples);
        kept.extend(within.clone().find(|&k| curves[0][k].is_nan()));
        for curve in curves {
            let present = within.clone().filter(|&k| curve[k].is_finite());
            let by_value = |a: &usize, b: &usize| curve[*a].total_cmp(&curve[*b]);
            kept.extend(present.clone().min_by(by_value).into_iter().chain(present.max_by(by_value)));
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// Numbers to as many decimals as a step needs; `null` where a sample is missing.
pub fn rounded(values: impl Iterator<Item = f64>, step: f64) -> Vec<Value> {
    let decimals = if step > 0.0 && step.is_finite() { (-step.log10()).ceil().clamp(-9.0, 12.0) } else { 9.0 };
    let scale = 10_f64.powf(decimals.max(0.0));
    let short = |value: f64| {
        let value = (value * scale).round() / scale;
        #[allow(clippy::cast_possible_truncation)]
        if value.fract() == 0.0 && value.abs() < 1e15 { json!(value as i64) } else { json!(value) }
    };
    values.map(short).collect()
}

/// Largest less smallest value; negative where there is none.
pub fn span(values: &[f64]) -> f64 {
    let present = || values.iter().copied().filter(|value| value.is_finite());
    present().fold(f64::NEG_INFINITY, f64::max) - present().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_peaks_and_gaps() {
        let mut curve: Vec<f64> = (0..20_000).map(|k| (0.001 * f64::from(k)).sin()).collect();
        curve[7001] = 9.0;
        curve[12_345] = -9.0;
        curve[15_000] = f64::NAN;
        let kept = telling(&[&curve], 1000);
        assert!(kept.len() <= 1000 && kept.is_sorted());
        assert!([7001, 12_345, 15_000].iter().all(|k| kept.contains(k)));
        assert_eq!(telling(&[&curve[..900]], 1000).len(), 900);
    }

    #[test]
    fn numbers_are_short() {
        let values = [1.0, 0.123_456, -2.5, f64::NAN, f64::INFINITY];
        assert_eq!(serde_json::to_string(&rounded(values.into_iter(), 0.01)).unwrap(), "[1,0.12,-2.5,null,null]");
    }
}
