//! How a recording begins, as its readings tell: the pressure, and how the load moves.

use crate::load::InitialMotion;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plant::{hanging_contraction, steady_pressure, stretched_apart};
use crate::quality::sensors::resolution;
use crate::quality::{quantile, span as span_of};
use crate::simulation::{mean, slope};
use nalgebra::{Const, DVector, Dyn, OMatrix};

/// Samples whose mean is taken as the pressure at the start where it drifts; by how many standard deviations of noise it may move
/// within them; and how many samples tell this noise.
const START_SAMPLES: usize = 5;
const MOVED: f64 = 3.0;
const NOISE_SAMPLES: usize = 100;
/// Longest time in s over which the pressure at the start is judged where it rests.
const START_SPAN: f64 = 1.0;
/// Fewest samples that tell whether it rests.
const TO_TELL: usize = 20;
/// By how many standard deviations of the second half of these the first samples' mean, and that of the first quarter, may differ from
/// their level: a straight line makes five, a step before the start more.
const AT_REST: (f64, f64) = (2.0, 1.0);
/// Share of its span within which a command is held.
const HELD: f64 = 1e-3;

/// Time in s, and fewest samples, within which the load shows how it moves at the start; and a time in s that is too long for that.
const MOTION_SPAN: f64 = 0.1;
const MOTION_SAMPLES: usize = 8;
const TOO_LONG: f64 = 0.3;
/// Odds of readings as these if the load began at rest below which it did not.
const CHANCE: f64 = 1e-6;
/// What it moves by itself then at least, as a share of what it moves there in all, and of the span of the recording.
const FAR: (f64, f64) = (0.2, 0.01);
/// Powers of time that its course is made of, those of a load that rests last.
const POWERS: [i32; 5] = [1, 2, 0, 3, 4];

/// Gauge pressure in Pa at the start of a recording.
pub fn initial_pressure(parameters: &Parameters, recording: &Recording, command: &[f64]) -> f64 {
    match recording.bridged(Signal::GaugePressure) {
        Some(readings) => {
            let (time, effects) = (&recording.time, &parameters.effects);
            let first = 0..resting(time, command, &readings);
            let truth: Vec<f64> = first.map(|k| effects.true_pressure(readings[k], time[k] - time[0])).collect();
            // Behind a shut valve it may still drift.
            let since = mean(&time[..truth.len()]) - time[0];
            let drift = if truth.len() > START_SAMPLES { slope(&time[..truth.len()], &truth) } else { 0.0 };
            (mean(&truth) - drift * since).max(0.0)
        }
        None => {
            let contraction = recording.bridged(Signal::Contraction).map_or(0.0, |readings| readings[0]);
            steady_pressure(parameters, command[0], parameters.effects.true_contraction(contraction, 0.0, 0.0))
        }
    }
}

/// Standard deviation in Pa of the pressure that readings tell at the start of a recording, given the noise of one and how many of them are
/// worth one that is independent; `None` where none tells it.
pub fn pressure_deviation(recording: &Recording, noise: f64, inflation: f64) -> Option<f64> {
    let (command, readings) = (recording.bridged(Signal::Command)?, recording.bridged(Signal::GaugePressure)?);
    let first = resting(&recording.time, &command, &readings);
    // The end of a straight line through readings is four times as uncertain as their mean.
    let of_line = if first > START_SAMPLES { 4.0 } else { 1.0 };
    let of_noise = noise * (of_line * inflation / first as f64).sqrt().min(1.0);
    // What rests shows the same steps all the time.
    let step = recording.get(Signal::GaugePressure).and_then(resolution).unwrap_or(0.0);
    Some(of_noise.hypot(step / 12.0_f64.sqrt()))
}

/// How many of the first readings show the pressure at the start: as many as there are before the command moves, unless they move
/// by themselves by more than a slow drift: then a few, or the first alone where it moves fast.
fn resting(time: &[f64], command: &[f64], readings: &[f64]) -> usize {
    let few = if moves_at_once(readings) { 1 } else { START_SAMPLES.min(readings.len()) };
    let [least, most] = [f64::min, f64::max].map(|of| command.iter().copied().fold(command[0], of));
    let is_held =
        |k: &usize| (command[*k] - command[0]).abs() <= HELD * (most - least) && time[*k] - time[0] <= START_SPAN;
    let held = &readings[..(0..readings.len()).take_while(is_held).count()];
    if held.len() < TO_TELL {
        return few;
    }
    let (_, late) = held.split_at(held.len() / 2);
    let level = mean(late);
    let deviation = (late.iter().map(|reading| (reading - level).powi(2)).sum::<f64>() / late.len() as f64).sqrt();
    let is_off = |first: usize, most: f64| (mean(&held[..first]) - level).abs() > most * deviation;
    if is_off(START_SAMPLES, AT_REST.0) || is_off(held.len() / 4, AT_REST.1) { few } else { held.len() }
}

/// Whether the first few readings go on in one direction by more than noise would make them: neither a glitch nor a step does.
fn moves_at_once(readings: &[f64]) -> bool {
    let [first, second, others @ ..] = &readings[..START_SAMPLES.min(readings.len())] else { return false };
    let deviation = deviation_of(readings);
    let steps = [second - first, mean(others) - second];
    let moved = steps[0] + steps[1];
    moved.abs() > MOVED * deviation && steps.iter().all(|step| step * moved.signum() > deviation)
}

/// Standard deviation of the first readings beside a smooth course, as their fourth differences tell it: of white noise, or of rounding.
fn deviation_of(readings: &[f64]) -> f64 {
    let early = &readings[..NOISE_SAMPLES.min(readings.len())];
    let difference = |of: &[f64]| (of[0] - 4.0 * of[1] + 6.0 * of[2] - 4.0 * of[3] + of[4]).abs();
    let differences: Vec<f64> = early.windows(5).map(difference).collect();
    // Standard deviation of these for white noise of one, and their median beside it (of a normal distribution).
    let noise = quantile(&differences, 0.5).unwrap_or(0.0) / (70.0_f64.sqrt() * 0.6745);
    noise.max(resolution(early).unwrap_or(0.0) / 12.0_f64.sqrt())
}

/// How a load moves at the start of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Reading of the contraction without its noise, m.
    pub contraction: f64,
    /// Its rate, m/s.
    pub velocity: f64,
    /// Standard deviations of both.
    pub deviations: [f64; 2],
}

impl Motion {
    /// How readings of the contraction in m show the load moving at the start; `None` where it may as well rest there.
    ///
    /// # Model
    /// x(t) = Σ cₖ tᵏ with k from 0 to 4, by least squares. Of a load that rests c₁ = c₂ = 0: its pressure has to move first, and the pull
    /// does not jump.
    ///
    /// # Reference
    /// Likelihood ratio of nested models; with two coefficients more it has the probability exp(−χ²/2).
    pub fn shown_by(time: &[f64], contraction: &[f64]) -> Option<Self> {
        let after = |k: usize| time[k] - time[0];
        let samples = (0..time.len()).take_while(|k| *k < MOTION_SAMPLES || after(*k) <= MOTION_SPAN).count();
        let span = after(samples.checked_sub(1)?);
        if samples < MOTION_SAMPLES || span > TOO_LONG {
            return None;
        }
        let readings = DVector::from_fn(samples, |k, _| contraction[k] - contraction[0]);
        let powers =
            OMatrix::<f64, Dyn, Const<5>>::from_fn(samples, |k, column| (after(k) / span).powi(POWERS[column]));
        let left = samples - POWERS.len();
        let all = powers.clone().svd(true, true).solve(&readings, 0.0).ok()?;
        let resting = powers.fixed_columns::<3>(2).into_owned();
        let of_rest = resting.clone().svd(true, true).solve(&readings, 0.0).ok()?;
        let [moving, rest] =
            [&powers * all - &readings, &resting * of_rest - &readings].map(|left| left.norm_squared());
        let deviation = deviation_of(contraction).max((moving / left as f64).sqrt());
        let by_itself = all[0].abs() + all[1].abs();
        let in_all = by_itself + all[3].abs() + all[4].abs();
        let is_far = by_itself > (FAR.0 * in_all).max(FAR.1 * span_of(contraction));
        if !is_far || ((moving - rest) / (2.0 * deviation.powi(2))).exp() > CHANCE {
            return None;
        }
        let covariance = (powers.transpose() * &powers).try_inverse()?;
        let [of_rate, of_place] = [0, 2].map(|k| deviation * covariance[(k, k)].sqrt());
        Some(Self {
            contraction: contraction[0] + all[2],
            velocity: all[0] / span,
            deviations: [of_place, of_rate / span],
        })
    }
}

/// How the load of a recording moves at the start of its simulation, the gauge pressure at the start known; not at all where no muscle
/// could be as long as its readings say.
pub fn initial_motion(parameters: &Parameters, recording: &Recording) -> InitialMotion {
    let Some(Motion { contraction, velocity, .. }) = recording.motion() else { return InitialMotion::default() };
    let truth = |reading: f64| parameters.effects.true_contraction(reading, 0.0, 0.0);
    // Of a thousandth of a second, in which no scale changes.
    let contraction_velocity = 1e3 * (truth(contraction + 1e-3 * velocity) - truth(contraction));
    let contraction = truth(contraction) + parameters.effects.contraction_lateness() * contraction_velocity;
    match hanging_contraction(parameters, 0.0) {
        Ok(hanging) if stretched_apart(parameters, contraction).is_none() => {
            InitialMotion { contraction_offset: contraction - hanging, contraction_velocity }
        }
        _ => InitialMotion::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time() -> Vec<f64> {
        (0..300).map(|k| 0.01 * f64::from(k)).collect()
    }

    /// Held for some samples, then rising.
    fn command(held: usize) -> Vec<f64> {
        (0..300_usize).map(|k| 2.0 + 0.01 * k.max(held) as f64).collect()
    }

    fn rests(held: usize, pressure: impl Fn(f64) -> f64) -> usize {
        let time = time();
        // Noise of 300 Pa that a sensor of 400 Pa shows.
        let noise = |k: usize| 400.0 * (0.75 * ((k * k) as f64 * 0.7).sin()).round();
        let readings: Vec<f64> = time.iter().enumerate().map(|(k, time)| pressure(*time) + noise(k)).collect();
        resting(&time, &command(held), &readings)
    }

    #[test]
    fn the_pressure_at_the_start_is_the_mean_of_all_readings_at_rest() {
        assert_eq!(rests(60, |_| 2e5), 61);
        assert_eq!(rests(250, |_| 2e5), 101, "a second at most");
        assert_eq!(rests(0, |_| 2e5), START_SAMPLES, "the command moves at once");
        assert_eq!(rests(0, |time| 2e5 + 1e5 * (6.0 * time).sin()), 1, "the pressure moves at once");
        assert_eq!(rests(60, |time| 2e5 + 2e4 * (-time / 0.064).exp()), 1, "the pressure still moves");
        assert_eq!(rests(120, |time| 2e5 + 2e5 * (-time / 0.025).exp()), 1, "the pressure still moves");
        assert_eq!(rests(25, |time| 2e5 + 2e4 * time), START_SAMPLES, "the pressure drifts");
    }

    /// Contraction in m of a load that swings, or whatever else, with noise of 0.05 mm.
    fn course(contraction: impl Fn(f64) -> f64) -> Option<Motion> {
        let noise = |k: usize| 5e-5 * (((k * k) as f64 * 0.7).sin() + ((k * k) as f64 * 1.19).cos());
        let readings: Vec<f64> = time().iter().enumerate().map(|(k, time)| contraction(*time) + noise(k)).collect();
        Motion::shown_by(&time(), &readings)
    }

    #[test]
    fn a_load_that_swings_at_the_start_is_seen_to() {
        let (rate, amplitude) = (20.0, 0.01);
        for phase in [0.3, 1.2, 2.0, 3.0, 5.5] {
            let motion = course(|time| 0.1 + amplitude * (rate * time + phase).sin()).unwrap();
            let off =
                [motion.contraction - 0.1 - amplitude * phase.sin(), motion.velocity - rate * amplitude * phase.cos()];
            let [place, slope] = motion.deviations;
            assert!(off[0].abs() < 4.0 * place && off[1].abs() < 4.0 * slope, "{phase}: {off:?} {motion:?}");
            assert!(place < 1e-4 && slope < 0.02, "{motion:?}");
        }
    }

    #[test]
    fn a_load_in_motion_is_ahead_of_a_sensor_that_is_late() {
        // 50 mm/s, shown 40 ms late in all.
        let (rate, first) = (0.05, 0.12);
        let row = |k: u32| format!("{},2,2,{},40\n", 0.01 * f64::from(k), 1e3 * (first + rate * 0.01 * f64::from(k)));
        let rows: String = (0..100).map(row).collect();
        let header = "time [s],command [V],gauge_pressure [bar],contraction [mm],load_mass [kg]";
        let path = std::path::Path::new("moves.csv");
        let recording = Recording::parse(format!("{header}\n{rows}").as_bytes(), path, &[]).unwrap();
        let mut parameters = Parameters::default();
        parameters.load.mass = 40.0;
        parameters.initial.gauge_pressure = 2e5;
        let hanging = hanging_contraction(&parameters, 0.0).unwrap();
        for (delay, averaging, filter_time) in
            [(0.04, 0.0, 0.0), (0.0, 0.08, 0.0), (0.0, 0.0, 0.04), (0.01, 0.02, 0.02)]
        {
            let sensor = &mut parameters.effects.contraction_sensor_delay;
            (sensor.delay, sensor.averaging, sensor.filter_time) = (delay, averaging, filter_time);
            let InitialMotion { contraction_offset, contraction_velocity } = initial_motion(&parameters, &recording);
            let place = hanging + contraction_offset;
            assert!((place - first - 0.04 * rate).abs() < 1e-6, "{delay} {averaging} {filter_time}: {place}");
            assert!((contraction_velocity - rate).abs() < 1e-6, "{contraction_velocity}");
        }
    }

    #[test]
    fn a_load_that_rests_at_the_start_is_not_taken_to_move() {
        assert_eq!(course(|time| if time > 1.0 { 0.2 } else { 0.1 }), None);
        assert_eq!(course(|time| 0.1 + 0.01 * (1.0 - (-time / 5.0).exp())), None, "it creeps");
        // A step of the command at the start: pressure of first order behind it, a load on a spring that is damped.
        let mut state = [0.0, 0.0, 0.0];
        let mut stepped = Vec::new();
        for _ in 0..300 {
            stepped.push(0.1 + state[1]);
            for _ in 0..1000 {
                let [pressure, place, velocity] = state;
                let rates = [(1.0 - pressure) / 0.064, velocity, 400.0 * (0.05 * pressure - place) - 4.0 * velocity];
                (0..3).for_each(|k| state[k] += 1e-5 * rates[k]);
            }
        }
        assert_eq!(course(|time| stepped[(100.0 * time).round() as usize]), None, "it is pulled from rest");
    }
}
