//! When samples were taken: gaps, uneven and slow sampling, and what a recording is too short for.

use super::{present, quantile, rounded, span};
use crate::effects::Effects;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::OUTPUTS;
use crate::variables::units::SECOND;

/// A gap is an interval of so many usual ones: estimates of noise and velocity look at up to nine neighbours.
const GAP: f64 = 10.0;
/// Sampling is uneven where its slow and fast intervals are a decade apart: neighbours then no longer mean the same time.
const UNEVEN: f64 = 10.0;
/// A motion by such a share of its range between samples is not followed: nine neighbours, over which noise and velocity
/// are estimated, span nearly half the range.
const LEAP: f64 = 0.05;
/// A column that mostly is not there.
const MOSTLY: f64 = 0.5;

/// Findings on the times of one recording.
pub fn notes(recording: &Recording, parameters: &Parameters) -> Vec<String> {
    let intervals: Vec<f64> = recording.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(usual) = quantile(&intervals, 0.5) else { return Vec::new() };
    let mut notes = Vec::new();
    let longest_allowed = longest_allowed(usual, recording, parameters);
    notes.extend(gaps(&recording.time, longest_allowed).map(|found| {
        format!("{found}: inputs are joined by straight lines there, and what these may do wrong is not compared")
    }));
    let inputs_and_outputs = OUTPUTS.into_iter().chain([Signal::Command]);
    notes.extend(inputs_and_outputs.filter_map(|signal| missing(recording, signal, longest_allowed)));
    notes.extend(uneven(&intervals));
    notes.extend(leaps(recording));
    notes.extend(valve_time(recording, parameters).filter(|time| usual > *time).map(|time| {
        format!(
            "samples are {} s apart and the valve answers within {} s: its lag, dead time and resonance cannot be judged",
            rounded(usual),
            rounded(time)
        )
    }));
    notes
}

/// Time constant of the valve in s, where it matters.
fn valve_time(recording: &Recording, parameters: &Parameters) -> Option<f64> {
    let drives = recording.get(Signal::Command).is_some() && !parameters.valve.is_shut(recording.duration());
    drives.then(|| 1.0 / parameters.valve.bandwidth)
}

/// The longest interval in s that is no gap, given the usual one: what is shorter than the valve's own time loses nothing.
pub(crate) fn longest_allowed(usual: f64, recording: &Recording, parameters: &Parameters) -> f64 {
    (GAP * usual).max(valve_time(recording, parameters).unwrap_or(0.0))
}

/// Intervals between times that are longer than allowed, in words.
fn gaps(times: &[f64], longest_allowed: f64) -> Option<String> {
    let gaps =
        times.windows(2).map(|pair| (pair[1] - pair[0], pair[0])).filter(|(length, _)| *length > longest_allowed);
    let (count, (longest, at)) =
        gaps.fold((0, (0.0, 0.0)), |(count, longest), gap| (count + 1, if gap.0 > longest.0 { gap } else { longest }));
    let word = if count == 1 { "gap" } else { "gaps" };
    (count > 0).then(|| format!("{count} {word} in time, the longest of {} s at {} s", rounded(longest), rounded(at)))
}

/// Missing samples of one column beyond those of whole rows.
fn missing(recording: &Recording, signal: Signal, longest_allowed: f64) -> Option<String> {
    let values = recording.get(signal)?;
    let there = values.iter().filter(|value| !value.is_nan()).count();
    if there == 0 {
        return Some(format!("`{}` is empty", signal.name()));
    }
    let share = 1.0 - there as f64 / values.len() as f64;
    if share > MOSTLY {
        return Some(format!("`{}` is missing in {:.0} % of the rows", signal.name(), 100.0 * share));
    }
    let length = |(from, to): &(usize, usize)| recording.time[*to] - recording.time[*from];
    let gaps = recording.gaps(signal, longest_allowed).into_iter();
    let own = gaps.filter(|(from, to)| *to > from + 1).max_by(|a, b| length(a).total_cmp(&length(b)));
    own.map(|(from, to)| {
        let [from, to] = [from, to].map(|at| rounded(recording.time[at]));
        format!("`{}` is missing from {from} s to {to} s", signal.name())
    })
}

fn uneven(intervals: &[f64]) -> Option<String> {
    let (fast, slow) = (quantile(intervals, 0.05)?, quantile(intervals, 0.95)?);
    let text = || {
        format!(
            "sampling is uneven, with intervals from {} s to {} s: noise and velocity are estimated poorly",
            rounded(fast),
            rounded(slow)
        )
    };
    (slow > UNEVEN * fast).then(text)
}

/// A motion that is not followed from sample to sample, as in a static map.
fn leaps(recording: &Recording) -> Option<String> {
    let known = present(recording.get(Signal::Contraction)?);
    let moves: Vec<f64> = known.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let share = quantile(&moves, 0.5)? / span(&known);
    let text = || {
        format!(
            "`contraction` leaps by {:.0} % of its range from sample to sample: velocity and noise cannot be estimated, and \
             nothing that depends on time or direction can be judged",
            100.0 * share
        )
    };
    (share > LEAP).then(text)
}

/// Effects that are slower than the longest recording.
///
/// Within its time constant an exponential shows 63 % of itself; in less it cannot be told from a straight line.
pub fn too_short(recordings: &[Recording]) -> Option<String> {
    let longest = recordings.iter().map(Recording::duration).fold(0.0, f64::max);
    slower_than(longest, &slow_effects())
}

fn slower_than(longest: f64, effects: &[(&str, f64)]) -> Option<String> {
    let slower = effects.iter().filter(|(_, time)| *time > longest);
    let words: Vec<String> = slower.map(|(name, time)| format!("{name} (about {} s)", rounded(*time))).collect();
    let text = || {
        format!(
            "the longest recording lasts {} s: too short for {}, which can be neither named nor ruled out",
            rounded(longest),
            words.join(", ")
        )
    };
    (!words.is_empty()).then(text)
}

/// Effects with the longest time, s, from which a fit of their quickest form starts: what is usual of them.
fn slow_effects() -> Vec<(&'static str, f64)> {
    let defaults = Parameters::default();
    let is_time = |name: &str| defaults.find(name).is_some_and(|(variable, _)| variable.unit == SECOND);
    let slowest = |freed: &[crate::effects::Freed]| {
        freed.iter().filter(|(name, _)| is_time(name)).flat_map(|(_, starts)| *starts).copied().fold(0.0, f64::max)
    };
    Effects::DESCRIPTIONS
        .iter()
        .map(|effect| (effect.name, effect.forms.iter().map(|form| slowest(form)).fold(f64::INFINITY, f64::min)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_effects_need_long_recordings() {
        let effects = [("creep", 30.0), ("valve_lag", 0.05)];
        let found = slower_than(12.0, &effects).unwrap();
        assert!(found.contains("12 s: too short for creep (about 30 s)") && !found.contains("valve_lag"), "{found}");
        assert_eq!(slower_than(40.0, &effects), None);
    }
}
