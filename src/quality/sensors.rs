//! Sensors that do not follow what they measure, and columns that no sensor made.

use super::{
    asked_pressure, header, in_file_unit, is_measured, known_pressure, line, present, quantile, rounded, span, units,
};
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::OUTPUTS;

/// A proportional valve repeats itself to about one per cent (data sheets): a command that moves by less is constant.
const REPEATABILITY: f64 = 0.01;
/// What drives a clipped sensor goes on beyond the clipped level by so much of its range: ten times the error of an
/// ordinary sensor (class 0.5).
const BEYOND: f64 = 0.05;
/// What drives a stuck sensor moves by so much of its range meanwhile: friction and dead bands hold a signal over a tenth.
const MEANWHILE: f64 = 0.25;
/// Fewest samples that count as a level at which a sensor stays.
const STAY: usize = 10;
/// No sensor is quieter than a millionth of what it spans: that takes 20 bits without noise.
const QUIETEST: f64 = 1e-6;
/// A relation between two columns is no accident where both resolve so many steps and it holds to within one.
const STEPS: f64 = 100.0;

/// Findings on the columns of one recording.
pub fn notes(recording: &Recording, parameters: &Parameters) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(constant_command(recording));
    for signal in OUTPUTS {
        let Some(values) = recording.get(signal).filter(|values| !present(values).is_empty()) else { continue };
        if span(values) == 0.0 {
            notes.push(constant(recording, signal, values));
            continue;
        }
        if !is_measured(recording, signal) {
            continue;
        }
        if let Some((name, driver)) = driver(recording, parameters, signal) {
            let clipped = clipped(recording, signal, name, &driver);
            let follows = clipped.is_empty();
            notes.extend(clipped);
            notes.extend(frozen(recording, signal, name, &driver).filter(|_| follows));
        }
        notes.extend(without_noise(recording, signal));
    }
    notes.extend(copied_columns(recording));
    notes
}

fn constant_command(recording: &Recording) -> Option<String> {
    let command = recording.get(Signal::Command)?;
    let level = quantile(command, 0.5)?;
    let text = "`command` is constant: of the valve nothing can be judged, only what drifts or is moved from outside";
    (span(command) <= REPEATABILITY * level.abs()).then(|| text.to_owned())
}

/// A column that always shows the same.
fn constant(recording: &Recording, signal: Signal, values: &[f64]) -> String {
    let level = in_file_unit(recording, signal, present(values)[0]);
    let meaning = if is_measured(recording, signal) {
        "a sensor that never changes says nothing of the model"
    } else {
        "nothing can be judged that depends on motion"
    };
    format!("`{}` is {level} throughout: {meaning}", signal.name())
}

/// What moves a signal in the same direction: its name and its course, in any unit.
fn driver(recording: &Recording, parameters: &Parameters, signal: Signal) -> Option<(&'static str, Vec<f64>)> {
    let hanging = recording.load_mass().is_some();
    match signal {
        Signal::GaugePressure => Some(("the command", asked_pressure(recording, parameters)?)),
        Signal::Contraction if hanging => Some(("the pressure", known_pressure(recording, parameters)?)),
        Signal::Force if !hanging => Some(("the model's force", units::static_force(recording, parameters)?)),
        _ => None,
    }
}

/// Stretches of equal values: first and last sample, missing ones left out.
fn stays(values: &[f64]) -> Vec<(usize, usize)> {
    let known: Vec<usize> = (0..values.len()).filter(|&k| !values[k].is_nan()).collect();
    let equal = known.chunk_by(|&a, &b| values[a] == values[b]);
    equal.filter(|stretch| stretch.len() > 1).map(|stretch| (stretch[0], stretch[stretch.len() - 1])).collect()
}

/// Largest and smallest value of a driver from one sample to another.
fn extremes(driver: &[f64]) -> (f64, f64) {
    let known = driver.iter().copied().filter(|value| !value.is_nan());
    known.fold((f64::NEG_INFINITY, f64::INFINITY), |(high, low), value| (high.max(value), low.min(value)))
}

/// Both ends of a sensor's range at which it stays although what drives it goes further and comes back.
fn clipped(recording: &Recording, signal: Signal, driven_by: &str, driver: &[f64]) -> Vec<String> {
    let values = recording.get(signal).unwrap_or_default();
    let (high, low) = extremes(values);
    let beyond = BEYOND * span(driver);
    let count = |level: f64, goes_beyond: &dyn Fn(usize, usize) -> bool| {
        let at_level = stays(values).into_iter().filter(|(from, to)| values[*from] == level && goes_beyond(*from, *to));
        at_level.map(|(from, to)| to - from + 1).sum::<usize>()
    };
    let above = |from: usize, to: usize| extremes(&driver[from..=to]).0 > driver[from].max(driver[to]) + beyond;
    let below = |from: usize, to: usize| extremes(&driver[from..=to]).1 < driver[from].min(driver[to]) - beyond;
    let ends = [(high, "largest", count(high, &above)), (low, "smallest", count(low, &below))];
    let text = |(level, which, count): (f64, &str, usize)| {
        format!(
            "{} stays at exactly {}, its {which} value, in {count} samples ({} %) while {driven_by} goes further: clipped by \
             the sensor{}; leave such cells empty",
            header(recording, signal),
            in_file_unit(recording, signal, level),
            rounded(100.0 * count as f64 / values.len() as f64),
            if signal == Signal::GaugePressure { ", unless the supply ends there" } else { "" }
        )
    };
    ends.into_iter().filter(|(.., count)| *count >= STAY).map(text).collect()
}

/// A stretch over which a sensor shows one value although what drives it moves on.
fn frozen(recording: &Recording, signal: Signal, driven_by: &str, driver: &[f64]) -> Option<String> {
    let values = recording.get(signal)?;
    let moves = |from: usize, to: usize| {
        let (high, low) = extremes(&driver[from..=to]);
        (high - low) / span(driver)
    };
    let still = stays(values).into_iter().filter(|(from, to)| to - from >= STAY && moves(*from, *to) > MEANWHILE);
    let (from, to) = still.max_by_key(|(from, to)| to - from)?;
    Some(format!(
        "{} shows {} without change from {} s to {} s while {driven_by} moves over {:.0} % of its range: stuck, or not \
         recorded; leave such cells empty",
        header(recording, signal),
        in_file_unit(recording, signal, values[from]),
        rounded(recording.time[from]),
        rounded(recording.time[to]),
        100.0 * moves(from, to)
    ))
}

/// A signal that a computer made: smooth to many digits.
fn without_noise(recording: &Recording, signal: Signal) -> Option<String> {
    let values = recording.get(signal)?;
    let known: Vec<usize> = (0..values.len()).filter(|&k| !values[k].is_nan()).collect();
    let quietest = QUIETEST * span(values);
    let scatter: Vec<f64> = known.windows(7).map(|seven| off_the_curve(&recording.time, values, seven)).collect();
    // Coarse resolution hides noise: then nothing can be said.
    let quiet = quantile(&scatter, 0.5)? < quietest && resolution(values)? < quietest;
    let text = || {
        format!(
            "`{}` has no noise, not a millionth of what it spans: it looks simulated, and what is found then holds for \
             the simulation that made it",
            signal.name()
        )
    };
    quiet.then(text)
}

/// How far the middle of seven samples is off the polynomial (of fifth degree) through the others.
fn off_the_curve(time: &[f64], values: &[f64], seven: &[usize]) -> f64 {
    let others: Vec<usize> = seven.iter().copied().filter(|k| *k != seven[3]).collect();
    let middle = time[seven[3]];
    let weight = |k: usize| {
        others.iter().filter(|&&j| j != k).map(|&j| (middle - time[j]) / (time[k] - time[j])).product::<f64>()
    };
    (values[seven[3]] - others.iter().map(|&k| weight(k) * values[k]).sum::<f64>()).abs()
}

/// Smallest step between neighbouring values: the resolution of what was written; `None` where nothing changes.
pub(crate) fn resolution(values: &[f64]) -> Option<f64> {
    let known = present(values);
    known.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).reduce(f64::min)
}

/// Pairs of columns of which one follows from the other.
fn copied_columns(recording: &Recording) -> Vec<String> {
    let columns: Vec<Signal> = [Signal::Command].into_iter().chain(OUTPUTS).collect();
    let mut notes = Vec::new();
    for (k, a) in columns.iter().enumerate() {
        for b in &columns[k + 1..] {
            let (Some(from), Some(to)) = (recording.get(*a), recording.get(*b)) else { continue };
            let Some((slope, offset)) = same_but_for_scale(from, to) else { continue };
            notes.push(format!(
                "`{}` is `{}` times {} plus {} (SI units), to within rounding, throughout: one was computed from the \
                 other and adds nothing",
                b.name(),
                a.name(),
                rounded(slope),
                rounded(offset)
            ));
        }
    }
    notes
}

/// Measured columns that two recordings share.
pub fn copied_recordings(recordings: &[Recording]) -> Vec<String> {
    let mut notes = Vec::new();
    for (k, second) in recordings.iter().enumerate() {
        for first in &recordings[..k] {
            let measured =
                OUTPUTS.into_iter().filter(|signal| is_measured(first, *signal) && is_measured(second, *signal));
            let copied = |signal: &Signal| {
                first.get(*signal).zip(second.get(*signal)).is_some_and(|(a, b)| same_but_for_scale(a, b).is_some())
            };
            let names: Vec<_> = measured.filter(copied).map(|signal| format!("`{}`", signal.name())).collect();
            if !names.is_empty() {
                let (first, second, names) = (first.name(), second.name(), names.join(", "));
                notes.push(format!(
                    "{second}: {names} equals that of {first} but for scale, sample by sample: a copy proves nothing \
                     about the original"
                ));
            }
        }
    }
    notes
}

/// Slope and offset with which one column gives another to within the rounding of both; `None` where it does not, or where
/// too few steps are resolved to tell.
fn same_but_for_scale(from: &[f64], to: &[f64]) -> Option<(f64, f64)> {
    if from.len() != to.len() {
        return None;
    }
    let (step_from, step_to) = (resolution(from)?, resolution(to)?);
    let both: Vec<(f64, f64)> =
        from.iter().copied().zip(to.iter().copied()).filter(|(a, b)| !a.is_nan() && !b.is_nan()).collect();
    let (slope, offset) = line(from, to);
    // Half a step of either column, with room for the arithmetic.
    let allowed = 0.5 * (step_to + slope.abs() * step_from) + 1e-9 * span(to);
    let holds = both.iter().all(|(a, b)| (b - slope * a - offset).abs() <= allowed);
    let resolved = span(from) >= STEPS * step_from && span(to) >= STEPS * step_to;
    (holds && resolved && both.len() as f64 >= STEPS).then_some((slope, offset))
}
