//! Models over time: the replay of a recording, and the closed loop.

use crate::controller::PidFeedForward;
use crate::effects::{Effects, Readings};
use crate::integrator::Accuracy;
use crate::measurement::{Recording, Signal};
use crate::model::{Known, Simulator, System};
use crate::parameters::Parameters;
use crate::plant::{
    ActuatorInputs, ActuatorOutputs, MeasuredInputs, MuscleAlone, MuscleInputs, MuscleOutputs, PneumaticActuator,
    PneumaticMuscle, masses, resting_pressure,
};
use crate::recent::Recent;
use crate::reference::ReferenceTrajectory;
use crate::start::{initial_motion, initial_pressure};
use crate::variables::Signals;
use crate::{Error, GRAVITY, Result};

/// The signals that a simulation gives and a recording may hold.
pub const OUTPUTS: [Signal; 3] = [Signal::GaugePressure, Signal::Contraction, Signal::Force];

/// What the sensors would show, at the times of the recording; each of shape `(n_samples,)`, SI.
#[derive(Debug, Clone, Default)]
pub struct Replay {
    gauge_pressure: Vec<f64>,
    contraction: Vec<f64>,
    force: Vec<f64>,
    /// Which signals were inputs of the simulation, and so cannot be compared.
    given: Vec<Signal>,
}

impl Replay {
    /// A simulated signal; `None` where it was an input.
    pub fn get(&self, signal: Signal) -> Option<&[f64]> {
        match signal {
            _ if self.given.contains(&signal) => None,
            Signal::GaugePressure => Some(&self.gauge_pressure),
            Signal::Contraction => Some(&self.contraction),
            Signal::Force => Some(&self.force),
            _ => None,
        }
    }

    fn push(&mut self, [gauge_pressure, contraction, force]: [f64; 3]) {
        self.gauge_pressure.push(gauge_pressure);
        self.contraction.push(contraction);
        self.force.push(force);
    }

    /// What it is with further sensors behind, at the given times.
    fn seen_by(mut self, sensors: &Effects, time: &[f64]) -> Self {
        if sensors.are_neutral() {
            return self;
        }
        let readings = self.gauge_pressure.iter_mut().zip(&mut self.contraction).zip(&mut self.force);
        for (((gauge_pressure, contraction), force), now) in readings.zip(time) {
            let time = now - time[0];
            let truth = Readings { time, contraction: *contraction, gauge_pressure: *gauge_pressure, force: *force };
            let shown = sensors.readings(truth);
            (*gauge_pressure, *contraction, *force) = (shown.gauge_pressure, shown.contraction, shown.force);
        }
        self
    }
}

/// Simulates an experiment with its recorded inputs, which are joined by straight lines, unless the command is said to
/// go [otherwise](Recording::going).
///
/// With a hanging load the input is the command; without, it is the contraction with the command or, where there is
/// none, with the measured pressure. Measured inputs are what the sensors showed: the effects on the sensors are undone.
/// The simulation starts at the first measured pressure, by all readings before the command moves, or, where there is none,
/// at the one that the first command leads to; at rest, unless the readings of the contraction show that it moves.
///
/// # Errors
/// [`Error::Replay`], with what the simulation failed of.
pub fn replay(parameters: &Parameters, recording: &Recording) -> Result<Replay> {
    replay_within(parameters, recording, Accuracy::USUAL)
}

/// As [`replay`], with an accuracy of the integration.
///
/// # Errors
/// As [`replay`].
pub fn replay_within(parameters: &Parameters, recording: &Recording, accuracy: Accuracy) -> Result<Replay> {
    replay_remembering(parameters, recording, accuracy, &Recent::new(0))
}

/// The same where it is known what the models did that were simulated last in this recording, to the same accuracy; of a load that hangs how
/// it moved, not what sensors showed of it.
///
/// # Errors
/// As [`replay`].
pub(crate) fn replay_remembering(
    parameters: &Parameters,
    recording: &Recording,
    accuracy: Accuracy,
    known: &Recent<Replay>,
) -> Result<Replay> {
    replay_chain(parameters, recording, accuracy, known).map_err(|error| in_file(recording, error))
}

/// An error with the recording that it is one of.
fn in_file(recording: &Recording, error: Error) -> Error {
    Error::Replay { path: recording.path.clone(), problem: Box::new(error) }
}

fn replay_chain(
    parameters: &Parameters,
    recording: &Recording,
    accuracy: Accuracy,
    known: &Recent<Replay>,
) -> Result<Replay> {
    let mut parameters = in_recording(parameters, recording);
    let Some(command) = recording.bridged(Signal::Command) else {
        return known.get_or(&parameters, || replay_pull(&parameters, recording, accuracy));
    };
    parameters.initial.gauge_pressure = initial_pressure(&parameters, recording, &command);
    let arriving = recording.arriving(&command);
    let time = &recording.time;
    if let Some(mass) = recording.load_mass() {
        parameters.load.mass = mass;
        parameters.initial_motion = initial_motion(&parameters, recording);
        let inputs = [&command, &arriving]
            .map(|command| move |k: usize, _: f64| MuscleInputs { command: command[k], external_force: 0.0 });
        let shown = |out: &MuscleOutputs| [out.measured_gauge_pressure, out.measured_contraction, out.measured_force];
        let [plant, sensors] = parameters.effects.apart();
        let plant = Parameters { effects: plant, ..parameters };
        let follow = || follow::<PneumaticMuscle>(&plant, time, accuracy, inputs, shown, None, &[]);
        return Ok(known.get_or(&plant, follow)?.seen_by(&sensors, time));
    }
    let motion = &Motion::of(&parameters, recording);
    let inputs = [&command, &arriving].map(|command| {
        move |k: usize, pull: f64| ActuatorInputs {
            command: command[k],
            contraction: motion.contraction(k, pull),
            contraction_velocity: motion.velocity[k],
        }
    });
    let given = [Signal::Contraction];
    let follow =
        || follow::<PneumaticActuator>(&parameters, time, accuracy, inputs, driven_readings, motion.pull(), &given);
    known.get_or(&parameters, follow)
}

/// The parameters as they are in a recording that is one of several, without those that are of others.
pub(crate) fn in_recording(parameters: &Parameters, recording: &Recording) -> Parameters {
    let mut parameters = *parameters;
    if let Some(number) = recording.number() {
        parameters.effects.in_recording(number);
    }
    parameters
}

/// Simulates the muscle alone, from measured pressure and contraction to force: free of errors of valve and load.
///
/// # Errors
/// As [`replay`].
pub fn replay_muscle(parameters: &Parameters, recording: &Recording) -> Result<Replay> {
    replay_pull(&in_recording(parameters, recording), recording, Accuracy::USUAL)
        .map_err(|error| in_file(recording, error))
}

fn replay_pull(parameters: &Parameters, recording: &Recording, accuracy: Accuracy) -> Result<Replay> {
    let nothing = || vec![0.0; recording.time.len()];
    let mut pressure = recording.bridged(Signal::GaugePressure).unwrap_or_else(nothing);
    let start = recording.time[0];
    for (reading, time) in pressure.iter_mut().zip(&recording.time) {
        *reading = parameters.effects.true_pressure(*reading, time - start);
    }
    let motion = Motion::of(parameters, recording);
    let inputs = |k: usize, pull: f64| MeasuredInputs {
        gauge_pressure: pressure[k],
        contraction: motion.contraction(k, pull),
        contraction_velocity: motion.velocity[k],
    };
    let given = [Signal::Contraction, Signal::GaugePressure];
    follow::<MuscleAlone>(
        parameters,
        &recording.time,
        accuracy,
        [&inputs, &inputs],
        driven_readings,
        motion.pull(),
        &given,
    )
}

/// A prescribed motion behind the readings of the position sensor.
struct Motion<'a> {
    parameters: &'a Parameters,
    /// Readings without their delay, m.
    readings: Vec<f64>,
    /// When they were shown, s since the start.
    shown: Vec<f64>,
    /// Velocity in m/s; the rate at which something in series stretches is neglected.
    velocity: Vec<f64>,
}

impl<'a> Motion<'a> {
    fn of(parameters: &'a Parameters, recording: &Recording) -> Self {
        let time = &recording.time;
        let mut readings = recording.bridged(Signal::Contraction).unwrap_or_else(|| vec![0.0; time.len()]);
        let since = recording.since_start();
        let averaging = parameters.effects.contraction_averaging();
        let first = readings[0];
        let filter = parameters.effects.contraction_filter();
        let late = parameters.effects.contraction_lateness();
        if late > 0.0 {
            readings = ahead(time, &readings, late);
        }
        undo_rest_in_means(&since, &mut readings, first, averaging);
        undo_rest_in_filter(&since, &mut readings, first, filter);
        let end = since[since.len() - 1];
        let shown: Vec<f64> = since.iter().map(|since| (since + late).min(end)).collect();
        let unstretched = |(reading, time): (&f64, &f64)| parameters.effects.true_contraction(*reading, 0.0, *time);
        let unstretched: Vec<f64> = readings.iter().zip(&shown).map(unstretched).collect();
        Self { parameters, velocity: slopes(time, &unstretched), readings, shown }
    }

    /// Contraction in m at a sample, while the muscle pulls with a force in N.
    fn contraction(&self, sample: usize, pull: f64) -> f64 {
        self.parameters.effects.true_contraction(self.readings[sample], pull, self.shown[sample])
    }

    /// What tells the pull of the muscle, where the contraction behind a reading depends on it.
    fn pull(&self) -> Option<fn(&ActuatorOutputs) -> f64> {
        let stretches = |pull: f64| self.parameters.effects.true_contraction(0.0, pull, 0.0);
        (stretches(0.0) != stretches(100.0)).then_some(|out| out.force)
    }
}

/// Takes out of the first means over a time in s the rest at `first` before the start; right for a constant speed.
fn undo_rest_in_means(since: &[f64], means: &mut [f64], first: f64, averaging: f64) {
    for (mean, after) in means.iter_mut().zip(since).take_while(|(_, after)| **after < 0.5 * averaging) {
        *mean = first + (*mean - first) * 2.0 * averaging * after / (after + 0.5 * averaging).powi(2);
    }
}

/// Takes out of the first of what a filter of first order shows the rest at `first` before the start; right for a constant speed
/// where nothing averages as well.
fn undo_rest_in_filter(since: &[f64], shown: &mut [f64], first: f64, constant: f64) {
    for (shown, after) in shown.iter_mut().zip(since).take_while(|(_, after)| **after < 20.0 * constant) {
        *shown = first + (*shown - first) * after / (after + constant * (-after / constant - 1.0).exp());
    }
}

/// A series as it will be by a delay in s later, its last value held.
fn ahead(time: &[f64], values: &[f64], delay: f64) -> Vec<f64> {
    let mut next = 0;
    let value = |time_wanted: f64| {
        while next < time.len() && time[next] <= time_wanted {
            next += 1;
        }
        if next == time.len() {
            return values[next - 1];
        }
        let share = (time_wanted - time[next - 1]) / (time[next] - time[next - 1]);
        values[next - 1] + share * (values[next] - values[next - 1])
    };
    time.iter().map(|time| time + delay).map(value).collect()
}

fn driven_readings(out: &ActuatorOutputs) -> [f64; 3] {
    [out.measured_gauge_pressure, out.measured_contraction, out.measured_force]
}

/// Simulates a system whose inputs are joined by straight lines between the given times.
///
/// The inputs are those at a sample while the muscle pulls with some force in N, and those that the lines lead to there, which differ where
/// they jump; where they depend on the force, `pull` tells it.
fn follow<S: System>(
    parameters: &Parameters,
    time: &[f64],
    accuracy: Accuracy,
    [inputs, arriving]: [impl Fn(usize, f64) -> S::Inputs; 2],
    shown: impl Fn(&S::Outputs) -> [f64; 3],
    pull: Option<fn(&S::Outputs) -> f64>,
    given: &[Signal],
) -> Result<Replay> {
    let mut simulator =
        Simulator::<S>::new(Parameters { effects: parameters.effects.without_neutral(), ..*parameters });
    simulator.accuracy = accuracy;
    simulator.inputs = inputs(0, 0.0);
    // What settles counts from the start of the recording.
    simulator.initialize(0.0)?;
    let mut force = 0.0;
    if let Some(pull) = pull {
        force = balance(&mut simulator, |force| inputs(0, force), pull, force);
        simulator.initialize(0.0)?;
    }
    let mut replay = Replay { given: given.to_vec(), ..Replay::default() };
    let may_skip = pull.is_none() && !S::remembers_finely(parameters);
    let (mut k, mut known) = (0, Known::nothing());
    loop {
        if let Some(pull) = pull {
            force = balance(&mut simulator, |force| inputs(k, force), pull, force);
        }
        replay.push(shown(&simulator.outputs()));
        if k + 1 == time.len() {
            return Ok(replay);
        }
        // While the inputs rest, the integration goes on over samples with steps as long as it likes.
        let here = inputs(k, 0.0);
        let resting = (k + 1..time.len()).take_while(|&next| may_skip && inputs(next, 0.0) == here).count();
        let next = k + resting.max(1);
        let span = time[next] - time[k];
        let difference = arriving(next, force).along(&simulator.inputs, -1.0);
        simulator.slopes = S::Inputs::default().along(&difference, 1.0 / span);
        let between: Vec<f64> = time[k + 1..next].iter().map(|time_between| time_between - time[k]).collect();
        simulator.advance_past(span, &mut known, &between, &mut |outputs| replay.push(shown(&outputs)))?;
        if inputs(next, force) != arriving(next, force) {
            simulator.inputs = inputs(next, force);
        }
        k = next;
    }
}

/// Sets the inputs such that the muscle pulls with the force in N that they presuppose, and gives it; by secants from a
/// guess.
fn balance<S: System>(
    simulator: &mut Simulator<S>,
    inputs: impl Fn(f64) -> S::Inputs,
    pull: fn(&S::Outputs) -> f64,
    guess: f64,
) -> f64 {
    const CLOSE: f64 = 1e-6;
    const MOST_SECANTS: usize = 10;
    let mut surplus = |force: f64| {
        simulator.inputs = inputs(force);
        pull(&simulator.outputs()) - force
    };
    let (mut before, mut surplus_before) = (guess, surplus(guess));
    let mut force = guess + surplus_before;
    for _ in 0..MOST_SECANTS {
        let surplus_now = surplus(force);
        let secant = (surplus_now - surplus_before) / (force - before);
        if surplus_now.abs() < CLOSE || secant == 0.0 || !secant.is_finite() {
            break;
        }
        (before, surplus_before) = (force, surplus_now);
        force -= surplus_now / secant;
    }
    force
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Half width in s of the window from which a velocity is taken.
const HALF_WINDOW: f64 = 0.04;
/// Fewest samples to either side in such a window.
const FEWEST_BESIDE: usize = 2;

/// Rate of change at every sample: slope of the least-squares line through the samples around it, which keeps the noise
/// of a position sensor out of the velocity. The window is one of time, so that a finer sampling gives no more noise.
pub fn slopes(time: &[f64], values: &[f64]) -> Vec<f64> {
    let (mut first, mut end) = (0, 0);
    (0..time.len())
        .map(|k| {
            while time[first] < time[k] - HALF_WINDOW {
                first += 1;
            }
            while end < time.len() && time[end] <= time[k] + HALF_WINDOW {
                end += 1;
            }
            let window = first.min(k.saturating_sub(FEWEST_BESIDE))..end.max(k + FEWEST_BESIDE + 1).min(time.len());
            slope(&time[window.clone()], &values[window])
        })
        .collect()
}

/// Slope of the least-squares line; zero for a single sample.
pub(crate) fn slope(time: &[f64], values: &[f64]) -> f64 {
    let mean_time = mean(time);
    let (mut covariance, mut variance) = (0.0, 0.0);
    for (time, value) in time.iter().zip(values) {
        covariance += (time - mean_time) * value;
        variance += (time - mean_time).powi(2);
    }
    if variance > 0.0 { covariance / variance } else { 0.0 }
}

/// Rms difference of the samples that both have; `None` where they have none in common.
pub fn rms_difference(measured: &[f64], simulated: &[f64]) -> Option<f64> {
    let differences: Vec<f64> = measured.iter().zip(simulated).map(|(m, s)| m - s).filter(|d| !d.is_nan()).collect();
    let mean_square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
    (!differences.is_empty()).then(|| mean_square.sqrt())
}

/// The course of a closed loop, each of shape `(n_steps + 1,)`, SI.
#[derive(Debug, Clone, Default)]
#[allow(missing_docs)]
pub struct ClosedLoop {
    pub time: Vec<f64>,
    pub setpoint: Vec<f64>,
    pub contraction: Vec<f64>,
    pub control_error: Vec<f64>,
    pub command: Vec<f64>,
    pub gauge_pressure: Vec<f64>,
}

impl ClosedLoop {
    /// Largest absolute control error in m.
    pub fn largest_error(&self) -> f64 {
        self.control_error.iter().fold(0.0, |largest, error| largest.max(error.abs()))
    }
}

/// The parameters with the initial pressure at which the load hangs still where the reference starts.
pub fn at_rest_on_reference(parameters: &Parameters) -> Parameters {
    let mut parameters = *parameters;
    let start = parameters.reference.start;
    let (weighing, _) = masses(&parameters, start);
    parameters.initial.gauge_pressure = resting_pressure(&parameters, start, weighing * GRAVITY);
    parameters
}

/// Simulates reference, controller and muscle for `duration` s, exchanging signals every `step` s; the load starts at
/// rest where the reference starts.
///
/// # Errors
/// As [`replay`].
pub fn closed_loop(parameters: &Parameters, step: f64, duration: f64) -> Result<ClosedLoop> {
    closed_loop_on(parameters, parameters, step, duration)
}

/// As [`closed_loop`], with a plant of which the controller knows the parameters `known` and the pressure at which it starts.
///
/// # Errors
/// As [`replay`].
pub fn closed_loop_on(plant: &Parameters, known: &Parameters, step: f64, duration: f64) -> Result<ClosedLoop> {
    let (plant, mut known) = (at_rest_on_reference(plant), *known);
    known.initial = plant.initial;
    let mut reference = Simulator::<ReferenceTrajectory>::new(known);
    let mut controller = Simulator::<PidFeedForward>::new(known);
    let mut muscle = Simulator::<PneumaticMuscle>::new(plant);
    reference.initialize(0.0)?;
    muscle.initialize(0.0)?;
    let mut course = ClosedLoop::default();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let steps = (duration / step).round() as usize;
    for k in 0..=steps {
        let (wanted, is) = (reference.outputs(), muscle.outputs());
        controller.inputs.setpoint = wanted.setpoint;
        controller.inputs.setpoint_velocity = wanted.setpoint_velocity;
        controller.inputs.setpoint_acceleration = wanted.setpoint_acceleration;
        controller.inputs.measured_contraction = is.measured_contraction;
        if k == 0 {
            controller.initialize(0.0)?;
            // Anew, so that a valve that is late has had the first command before the start as well.
            muscle.inputs.command = plant.initial.gauge_pressure / plant.valve.gain;
            muscle.initialize(0.0)?;
        }
        let control = controller.outputs();
        course.time.push(muscle.time());
        course.setpoint.push(wanted.setpoint);
        course.contraction.push(is.contraction);
        course.control_error.push(control.control_error);
        course.command.push(control.command);
        course.gauge_pressure.push(is.gauge_pressure);
        if k < steps {
            muscle.inputs.command = control.command;
            reference.advance(step)?;
            controller.advance(step)?;
            muscle.advance(step)?;
        }
    }
    Ok(course)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Description;
    use crate::measurement::Between;
    use crate::variables::Declared;

    const PERIOD: f64 = 0.01;

    fn time() -> Vec<f64> {
        (0..300).map(|k| PERIOD * f64::from(k)).collect()
    }

    fn followed(parameters: &Parameters) -> Replay {
        // Held for some samples, then rising.
        let command: Vec<f64> = (0..300_usize).map(|k| 2.0 + 0.01 * k.max(60) as f64).collect();
        let inputs = |k: usize, _: f64| MuscleInputs { command: command[k], external_force: 0.0 };
        let shown = |out: &MuscleOutputs| [out.measured_gauge_pressure, out.measured_contraction, out.measured_force];
        follow::<PneumaticMuscle>(parameters, &time(), Accuracy::USUAL, [inputs, inputs], shown, None, &[]).unwrap()
    }

    #[test]
    fn a_valve_answers_a_command_that_changes_at_samples_from_there_on() {
        // Of first order, while the command is u: p(t) = G u + (p(0) − G u) exp(−ω t).
        let parameters = Parameters::default();
        let pressure = |recording: &Recording| {
            replay(&parameters, recording).unwrap().get(Signal::GaugePressure).unwrap().to_vec()
        };
        let jump = |k: u32| if k < 20 { 2.0 } else { 3.0 };
        let ramp = |k: u32| 2.0 + 0.05 * f64::from(k);
        let cases: [(&dyn Fn(u32) -> f64, Between); 2] = [(&jump, Between::Jumps), (&ramp, Between::Held)];
        for (command, between) in cases {
            let mut text = "time [s],command [V],contraction [mm],load_mass [kg]\n".to_owned();
            for k in 0..60 {
                text += &format!("{:.2},{},100,20\n", PERIOD * f64::from(k), command(k));
            }
            let recording = Recording::parse(text.as_bytes(), std::path::Path::new("changes.csv"), &[]).unwrap();
            let shown = pressure(&recording.going(between));
            let mut expected = parameters.valve.gain * command(0);
            for (k, shown) in (0..).zip(&shown) {
                assert!((shown - expected).abs() < 1.0, "{between:?}, {k}: {shown} {expected}");
                let wanted = parameters.valve.gain * command(k);
                expected = wanted + (expected - wanted) * (-parameters.valve.bandwidth * PERIOD).exp();
            }
            // Along a straight line from the sample before it begins earlier.
            assert!(pressure(&recording)[20] > shown[20] + 100.0, "{between:?}");
        }
    }

    #[test]
    fn a_muscle_that_rests_shows_so_at_every_sample() {
        const COUNT: usize = 60;
        let mut text = "time [s],gauge_pressure [bar],contraction [mm],force [N]\n".to_owned();
        for k in 0..COUNT {
            let pressure = if k < COUNT / 2 { 2 } else { 1 };
            text += &format!("{:.2},{pressure},0,500\n", 0.01 * k as f64);
        }
        let recording = Recording::parse(text.as_bytes(), std::path::Path::new("rests.csv"), &[]).unwrap();
        for replayed in [replay, replay_muscle] {
            let shown = replayed(&Parameters::default(), &recording).unwrap();
            let force = shown.get(Signal::Force).unwrap();
            let (first, last) = (force[0], force[force.len() - 1]);
            assert!(first > last + 100.0, "{first} {last}");
            assert_eq!(force.len(), COUNT);
            let [before, after] = [&force[..COUNT / 2], &force[COUNT / 2..]];
            assert!(before.iter().all(|now| (now - first).abs() < 1e-9), "{before:?}");
            assert!(after.iter().all(|now| (now - last).abs() < 1e-9), "{after:?}");
        }
    }

    #[test]
    fn what_is_of_other_recordings_makes_no_difference_to_one() {
        let mut of_recordings = Vec::new();
        Parameters::default().visit(&mut |variable, neutral| {
            if variable.of_recording > 0 {
                assert_eq!(neutral, 0.0, "{}", variable.name);
                of_recordings.push(variable);
            }
        });
        let has = |effect: &&Description| of_recordings.iter().any(|variable| variable.group() == effect.name);
        let (mut least_felt, mut felt_by_supply) = ([usize::MAX; 4], Vec::new());
        for effect in Effects::DESCRIPTIONS.iter().filter(has) {
            let mut all = Parameters::default();
            for variable in of_recordings.iter().filter(|variable| variable.group() == effect.name) {
                all.set(variable.name, 1e-3 * variable.max).unwrap();
            }
            let freed = effect.all_forms().flatten().chain(effect.refinements);
            freed.for_each(|(name, starts)| all.set(name, starts[0]).unwrap());
            for (number, least) in (1..=4).zip(&mut least_felt) {
                let mut in_one = all;
                in_one.effects.in_recording(number);
                all.set(&format!("{}.recording", effect.name), number as f64).unwrap();
                let [without, with] = [&in_one, &all].map(followed);
                for signal in OUTPUTS {
                    assert_eq!(without.get(signal), with.get(signal), "{} in recording {number}", effect.name);
                }
                let mut felt = 0;
                in_one.visit(&mut |variable, value| felt += usize::from(variable.of_recording > 0 && value != 0.0));
                if effect.name == "supply_saturation" {
                    felt_by_supply.push(felt);
                } else {
                    *least = felt.min(*least);
                }
            }
        }
        assert_eq!(least_felt, [0, 1, 1, 0], "all are left out but those of the recording itself");
        assert_eq!(felt_by_supply, [0; 4], "those of the recording itself are part of the supply");
    }

    #[test]
    fn sensors_behind_a_course_show_what_they_show_within_it() {
        let mut parameters = Parameters::default();
        let of_sensors = Effects::DESCRIPTIONS.iter().filter(|effect| effect.name.contains("_sensor_"));
        let refined = |effect: &Description| effect.refinements.iter().map(|(name, starts)| (*name, starts[0]));
        let sensors: Vec<_> = of_sensors.flat_map(|effect| effect.typical().chain(refined(effect))).collect();
        let others = [
            ("temperature_drift.force_zero", 20.0),
            ("temperature_drift.pressure_zero", 5e3),
            ("series_elasticity.compliance", 5e-6),
        ];
        assert!(sensors.len() > 14, "{sensors:?}");
        for (name, value) in sensors.into_iter().chain(others) {
            parameters.set(name, value).unwrap();
        }
        let [plant, sensors] = parameters.effects.apart();
        assert_ne!(plant, parameters.effects);
        let behind = followed(&Parameters { effects: plant, ..parameters }).seen_by(&sensors, &time());
        let within = followed(&parameters);
        for (signal, close) in [(Signal::GaugePressure, 1e-3), (Signal::Contraction, 1e-9), (Signal::Force, 1e-5)] {
            let [within, behind] = [&within, &behind].map(|replay| replay.get(signal).unwrap());
            for (within, behind) in within.iter().zip(behind) {
                assert!((within - behind).abs() < close, "{signal:?} {within} {behind}");
            }
        }
    }
}
