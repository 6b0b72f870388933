//! Columns whose size contradicts the others, the muscle or the valve: nearly always a wrong unit in the header.

use super::{asked_pressure, correlation, header, in_file_unit, known_pressure, line, middle_span, quantile, rounded};
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plant::{equilibrium, holding_pressure};
use crate::{Error, GRAVITY, Result};

/// Neighbouring units of one quantity are ten or more times apart: half way there, on a logarithmic scale, is the most
/// that is put down to the plant. √10
const PLANT: f64 = 3.162_277_660_168_379_5;
/// No effect in a muscle or a valve, and no other muscle in its place, makes a signal a hundred times what it should be.
const ABSURD: f64 = 100.0;
/// No pneumatic muscle is run above this gauge pressure, Pa: compressed air comes at 6 to 10 bar, muscles burst above 20.
pub(crate) const HIGHEST_PRESSURE: f64 = 20e5;
/// Below this gauge pressure, Pa, no muscle does anything: it takes some 0.2 bar to widen its membrane.
const LOWEST_PRESSURE: f64 = 0.02e5;
/// The nominal model may be poor; a unit is wrong where another one makes the model's error this many times smaller.
const MUCH_BETTER: f64 = 10.0;
/// The model must mean something in that unit: where it gave no force at all it would be wrong by 1.
const MEANINGFUL: f64 = 0.5;

/// A column that is too large by a factor (below 1: too small), and what says so.
struct Doubt {
    signal: Signal,
    excess: f64,
    evidence: String,
}

/// Findings on units and signs.
///
/// # Errors
/// [`Error::Recording`] for a contradiction by a factor of 100 or more.
pub fn notes(recording: &Recording, parameters: &Parameters) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let checks: [fn(&Recording, &Parameters) -> Option<Doubt>; 9] = [
        too_much_pressure,
        command_against_pressure,
        longer_than_the_muscle,
        load_against_muscle,
        pressure_against_load,
        force_against_load,
        contraction_against_load,
        units_that_fit_better,
        too_slow_for_the_valve,
    ];
    for check in checks {
        let Some(doubt) = check(recording, parameters) else { continue };
        if !(1.0 / ABSURD..ABSURD).contains(&doubt.excess) {
            return Err(Error::Recording { path: recording.path.clone(), problem: doubt.sentence(recording) });
        }
        if !(1.0 / PLANT..PLANT).contains(&doubt.excess) {
            notes.push(doubt.sentence(recording));
            break; // what follows compares with a column that is in doubt
        }
    }
    notes.extend(pushes(recording, parameters).or_else(|| wrong_sign(recording, parameters)));
    Ok(notes)
}

impl Doubt {
    /// The evidence, and what to do about it.
    fn sentence(&self, recording: &Recording) -> String {
        let Self { signal, excess, evidence } = self;
        let remedy = match better_unit(recording, *signal, *excess) {
            Some(unit) => format!("it looks like {unit}: write `{} [{unit}]` in the header", signal.name()),
            None => format!("check the unit of `{}` and the parameters of the model", signal.name()),
        };
        format!("{evidence}; {remedy}")
    }
}

/// The unit that the values seem to be in, where they are too large by a factor in the unit of the file.
fn better_unit(recording: &Recording, signal: Signal, excess: f64) -> Option<&'static str> {
    let current = scale(signal, recording.unit_in_file(signal)?)?;
    let off = |size: f64| (size * excess / current).ln().abs();
    let best = signal.units().iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
    (best.1 != current && off(best.1) < PLANT.ln()).then_some(best.0)
}

fn scale(signal: Signal, unit: &str) -> Option<f64> {
    signal.units().iter().find(|(symbol, _)| *symbol == unit).map(|(_, scale)| *scale)
}

/// What a signal reaches without its spikes, by absolute value.
fn reach(values: &[f64]) -> Option<f64> {
    let sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    quantile(&sizes, 0.95)
}

fn reach_of(recording: &Recording, signal: Signal) -> Option<f64> {
    reach(recording.get(signal)?)
}

/// A pressure, measured or asked for, at which no muscle is whole. Two bar is taken as usual.
fn too_much_pressure(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    let usual = 2e5;
    let measured = reach_of(recording, Signal::GaugePressure).unwrap_or(0.0);
    if measured > HIGHEST_PRESSURE {
        let value = in_file_unit(recording, Signal::GaugePressure, measured);
        let evidence = format!("{} reaches {value}, which no muscle stands", header(recording, Signal::GaugePressure));
        return Some(Doubt { signal: Signal::GaugePressure, excess: measured / usual, evidence });
    }
    let asked = reach(&asked_pressure(recording, parameters)?)?;
    let evidence = format!(
        "{} reaches {}, which asks the valve for {} bar",
        header(recording, Signal::Command),
        in_file_unit(recording, Signal::Command, reach_of(recording, Signal::Command)?),
        rounded(asked / 1e5)
    );
    (asked > HIGHEST_PRESSURE).then_some(Doubt { signal: Signal::Command, excess: asked / usual, evidence })
}

/// Measured pressure against what the command asks for; the one that would do nothing to a muscle is in doubt.
fn command_against_pressure(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    let asked = reach(&asked_pressure(recording, parameters)?)?;
    let measured = reach_of(recording, Signal::GaugePressure)?;
    if asked <= 0.0 || measured <= 0.0 || asked.max(measured) < LOWEST_PRESSURE {
        return None;
    }
    let evidence = format!(
        "{} asks the valve for up to {} bar, and {} reaches {}",
        header(recording, Signal::Command),
        rounded(asked / 1e5),
        header(recording, Signal::GaugePressure),
        in_file_unit(recording, Signal::GaugePressure, measured)
    );
    let excess = measured / asked;
    let of_command = asked < measured && asked < LOWEST_PRESSURE;
    let (signal, excess) = if of_command { (Signal::Command, 1.0 / excess) } else { (Signal::GaugePressure, excess) };
    Some(Doubt { signal, excess, evidence })
}

/// A contraction by more than the whole muscle. A quarter of the length is taken as usual.
fn longer_than_the_muscle(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    let (length, contraction) = (parameters.muscle.rest_length, reach_of(recording, Signal::Contraction)?);
    let evidence = format!(
        "{} reaches {}, more than the whole muscle (`muscle.rest_length` {} m)",
        header(recording, Signal::Contraction),
        in_file_unit(recording, Signal::Contraction, contraction),
        rounded(length)
    );
    (contraction > length).then_some(Doubt {
        signal: Signal::Contraction,
        excess: 4.0 * contraction / length,
        evidence,
    })
}

/// A hanging load against the strongest pull that the pressure gives.
fn load_against_muscle(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    let weight = recording.load_mass()? * GRAVITY;
    let pressure = reach(&known_pressure(recording, parameters)?)?;
    let pull = parameters.force_models.force(&parameters.muscle, pressure, 0.0);
    let evidence = format!(
        "{} is {}; at {} bar, the most in the recording, the muscle lifts {} kg",
        header(recording, Signal::LoadMass),
        in_file_unit(recording, Signal::LoadMass, weight / GRAVITY),
        rounded(pressure / 1e5),
        rounded(pull / GRAVITY)
    );
    let excess = weight / pull;
    (pressure > LOWEST_PRESSURE && excess > PLANT).then_some(Doubt { signal: Signal::LoadMass, excess, evidence })
}

/// The pressure of a hanging load against what holds it at the contraction that was measured.
fn pressure_against_load(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    let weight = recording.load_mass()? * GRAVITY;
    let contraction = quantile(recording.get(Signal::Contraction)?, 0.5)?;
    let needed = holding_pressure(parameters, contraction, weight);
    let pressure = quantile(&known_pressure(recording, parameters)?, 0.5)?;
    let measured = recording.get(Signal::GaugePressure).is_some();
    let signal = if measured { Signal::GaugePressure } else { Signal::Command };
    let evidence = format!(
        "{} stands for {} bar where the load needs {} bar at the measured contraction",
        header(recording, signal),
        rounded(pressure / 1e5),
        rounded(needed / 1e5)
    );
    let excess = pressure / needed;
    // Near zero the model's own error decides.
    let telling = needed.max(pressure) > 0.2e5 && needed > LOWEST_PRESSURE / ABSURD && pressure > 0.0;
    telling.then_some(Doubt { signal, excess, evidence })
}

/// The pull on a hanging load against its weight.
fn force_against_load(recording: &Recording, _parameters: &Parameters) -> Option<Doubt> {
    let weight = recording.load_mass()? * GRAVITY;
    let force = reach_of(recording, Signal::Force).filter(|force| *force > 0.0)?;
    let evidence = format!(
        "{} reaches {} with a load that weighs {} N",
        header(recording, Signal::Force),
        in_file_unit(recording, Signal::Force, force),
        rounded(weight)
    );
    Some(Doubt { signal: Signal::Force, excess: force / weight, evidence })
}

/// How far a hanging load moves against what the change of pressure makes of it.
fn contraction_against_load(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    let weight = recording.load_mass()? * GRAVITY;
    let pressure = known_pressure(recording, parameters)?;
    let at = |share: f64| equilibrium(parameters, quantile(&pressure, share)?, weight);
    let (expected, moved) = (at(0.95)? - at(0.05)?, middle_span(recording.get(Signal::Contraction)?));
    let evidence = format!(
        "{} moves by {} where the pressure would move this muscle by {}",
        header(recording, Signal::Contraction),
        in_file_unit(recording, Signal::Contraction, moved),
        in_file_unit(recording, Signal::Contraction, expected)
    );
    // A hundredth of the muscle moves by friction alone, or not.
    let telling = expected > 0.01 * parameters.muscle.rest_length && moved > 0.0;
    telling.then_some(Doubt { signal: Signal::Contraction, excess: moved / expected, evidence })
}

/// Prescribed motion: a unit of one column with which the nominal force fits much better.
fn units_that_fit_better(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    if recording.load_mass().is_some() {
        return None;
    }
    let as_it_is = misfit(recording, parameters, None)?;
    let mut best: Option<(Signal, f64, f64)> = None;
    for signal in [Signal::Force, Signal::Contraction, Signal::GaugePressure, Signal::Command] {
        let Some(current) = recording.unit_in_file(signal).and_then(|unit| scale(signal, unit)) else { continue };
        for (_, size) in signal.units().iter().filter(|(_, size)| *size != current) {
            let Some(error) = misfit(recording, parameters, Some((signal, size / current))) else { continue };
            if best.is_none_or(|(.., least)| error < least) {
                best = Some((signal, current / size, error));
            }
        }
    }
    let (signal, excess, error) = best.filter(|(.., error)| *error < MEANINGFUL.min(as_it_is / MUCH_BETTER))?;
    let evidence = format!(
        "{} makes the nominal force wrong by {} times what was measured; in another unit by {}",
        header(recording, signal),
        rounded(as_it_is),
        rounded(error)
    );
    Some(Doubt { signal, excess, evidence })
}

/// How long a signal takes to follow the command against the time constant of the valve.
///
/// An honest plant may be slow; the time is in doubt where another unit makes the plant as fast as the valve, and nobody would have
/// sampled it so: the whole answer of the valve lies between two samples.
fn too_slow_for_the_valve(recording: &Recording, parameters: &Parameters) -> Option<Doubt> {
    let asked = asked_pressure(recording, parameters)?;
    let hanging = recording.load_mass().map(|_| Signal::Contraction);
    let driven = [Some(Signal::GaugePressure), hanging].into_iter().flatten();
    let (signal, values) = driven.filter_map(|signal| Some((signal, recording.get(signal)?))).next()?;
    let taken = time_to_follow(recording.period(), &asked, values)?;
    let expected = 1.0 / parameters.valve.bandwidth;
    let excess = taken / expected;
    let evidence = format!(
        "{} follows the command within {} s, and the valve answers within {} s",
        header(recording, signal),
        rounded(taken),
        rounded(expected)
    );
    let in_doubt = recording.period() > expected && excess > 1.0;
    let other = in_doubt && better_unit(recording, Signal::Time, excess).is_some();
    other.then_some(Doubt { signal: Signal::Time, excess, evidence })
}

/// Time constant in s of a signal that follows another one as a lag of first order, sampled with a period in s; `None` where it does not
/// follow, or within a sample. Scale and offset of the signal do not matter.
fn time_to_follow(period: f64, leader: &[f64], signal: &[f64]) -> Option<f64> {
    let (slope, offset) = line(leader, signal);
    let ahead: Vec<f64> = leader.iter().zip(signal).map(|(u, y)| slope * u + offset - y).collect();
    let change: Vec<f64> = signal.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (share, _) = line(&ahead, &change);
    let follows = correlation(leader, signal) > 0.5 && share > 0.0 && share < 1.0;
    follows.then(|| -period / (1.0 - share).ln())
}

/// Error of the nominal static force relative to the measured one (rms), with the values of one column multiplied.
fn misfit(recording: &Recording, parameters: &Parameters, changed: Option<(Signal, f64)>) -> Option<f64> {
    let factor = |signal: Signal| changed.filter(|(of, _)| *of == signal).map_or(1.0, |(_, factor)| factor);
    let pressure = known_pressure(recording, parameters)?;
    let measured = recording.get(Signal::GaugePressure).is_some();
    let of_pressure = factor(if measured { Signal::GaugePressure } else { Signal::Command });
    let (contraction, force) = (recording.get(Signal::Contraction)?, recording.get(Signal::Force)?);
    let (mut wrong, mut all) = (0.0, 0.0);
    for ((p, x), f) in pressure.iter().zip(contraction).zip(force) {
        let shown = f * factor(Signal::Force);
        let (p, x) = (p * of_pressure, x * factor(Signal::Contraction));
        let error = shown - parameters.force_models.force(&parameters.muscle, p, x);
        if error.is_finite() {
            (wrong, all) = (wrong + error.powi(2), all + shown.powi(2));
        }
    }
    (all > 0.0).then(|| (wrong / all).sqrt())
}

/// A force that is negative but for its spikes where a muscle pulls: under a hanging load, or as the nominal one does.
fn pushes(recording: &Recording, parameters: &Parameters) -> Option<String> {
    let pulls = || static_force(recording, parameters).and_then(|force| quantile(&force, 0.05)).unwrap_or(0.0) > 0.0;
    let negative = quantile(recording.get(Signal::Force)?, 0.95)? < 0.0;
    let text = || {
        format!(
            "{} is negative throughout; the pull of the muscle is positive: where the sensor counts it the other way, \
             change the sign of the column",
            header(recording, Signal::Force)
        )
    };
    (negative && (recording.load_mass().is_some() || pulls())).then(text)
}

/// A signal that runs against what drives it. Correlations of −½ and below are beyond what lag and noise make.
fn wrong_sign(recording: &Recording, parameters: &Parameters) -> Option<String> {
    let against =
        |signal: Signal, driver: &[f64]| correlation(recording.get(signal).unwrap_or_default(), driver) < -0.5;
    let pressure = known_pressure(recording, parameters)?;
    if recording.load_mass().is_some() {
        let text = "`contraction` falls where the pressure rises; it is the rest length minus the length, positive when shorter";
        return against(Signal::Contraction, &pressure).then(|| text.to_owned());
    }
    let force = static_force(recording, parameters)?;
    let text = "`force` falls where the model's rises; the pull of the muscle is positive, and so is a contraction that shortens";
    against(Signal::Force, &force).then(|| text.to_owned())
}

/// Nominal static force in N of a muscle whose motion is prescribed, shape `(n_samples,)`.
pub fn static_force(recording: &Recording, parameters: &Parameters) -> Option<Vec<f64>> {
    let pressure = known_pressure(recording, parameters)?;
    let contraction = recording.get(Signal::Contraction)?;
    let force = |(p, x): (&f64, &f64)| parameters.force_models.force(&parameters.muscle, *p, *x);
    Some(pressure.iter().zip(contraction).map(force).collect())
}
