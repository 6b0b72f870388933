//! Models over time: the replay of a recording, and the closed loop.

use crate::controller::PidFeedForward;
use crate::measurement::{Recording, Signal};
use crate::model::{Simulator, System};
use crate::parameters::Parameters;
use crate::plant::{
    ActuatorInputs, ActuatorOutputs, MeasuredInputs, MuscleAlone, MuscleInputs, MuscleOutputs, PneumaticActuator,
    PneumaticMuscle, holding_pressure,
};
use crate::reference::ReferenceTrajectory;
use crate::variables::Signals;
use crate::{GRAVITY, Result};

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
}

/// Samples whose mean is taken as the pressure at the start.
const START_SAMPLES: usize = 5;

/// Simulates an experiment with its recorded inputs, which are joined by straight lines.
///
/// With a hanging load the input is the command; without, it is the contraction with the command or, where there is
/// none, with the measured pressure. A hanging load starts at rest at the first measured pressure.
///
/// # Errors
/// [`crate::Error::NoEquilibrium`], [`crate::Error::Diverged`].
pub fn replay(parameters: &Parameters, recording: &Recording) -> Result<Replay> {
    let mut parameters = *parameters;
    let time = &recording.time;
    let command = recording.bridged(Signal::Command);
    let pressure = recording.bridged(Signal::GaugePressure);
    parameters.initial.gauge_pressure = match (&pressure, &command) {
        (Some(pressure), _) => mean(&pressure[..START_SAMPLES.min(pressure.len())]).max(0.0),
        (None, Some(command)) => parameters.valve.target_pressure(command[0]),
        (None, None) => 0.0,
    };
    if let (Some(mass), Some(command)) = (recording.load_mass(), &command) {
        parameters.load.mass = mass;
        let inputs = |k: usize| MuscleInputs { command: command[k], external_force: 0.0 };
        let shown = |out: &MuscleOutputs| [out.measured_gauge_pressure, out.measured_contraction, out.measured_force];
        return follow::<PneumaticMuscle>(&parameters, time, inputs, shown, &[]);
    }
    let Some(command) = command else { return replay_muscle(&parameters, recording) };
    let contraction = true_contraction(&parameters, recording);
    let velocity = slopes(time, &contraction);
    let inputs = |k: usize| ActuatorInputs {
        command: command[k],
        contraction: contraction[k],
        contraction_velocity: velocity[k],
    };
    follow::<PneumaticActuator>(&parameters, time, inputs, driven_readings, &[Signal::Contraction])
}

/// Simulates the muscle alone, from measured pressure and contraction to force: free of errors of valve and load.
///
/// # Errors
/// As [`replay`].
pub fn replay_muscle(parameters: &Parameters, recording: &Recording) -> Result<Replay> {
    let nothing = || vec![0.0; recording.time.len()];
    let pressure = recording.bridged(Signal::GaugePressure).unwrap_or_else(nothing);
    let contraction = true_contraction(parameters, recording);
    let velocity = slopes(&recording.time, &contraction);
    let inputs = |k: usize| MeasuredInputs {
        gauge_pressure: pressure[k],
        contraction: contraction[k],
        contraction_velocity: velocity[k],
    };
    let given = [Signal::Contraction, Signal::GaugePressure];
    follow::<MuscleAlone>(parameters, &recording.time, inputs, driven_readings, &given)
}

/// The contraction behind the readings of the position sensor.
fn true_contraction(parameters: &Parameters, recording: &Recording) -> Vec<f64> {
    let measured = recording.bridged(Signal::Contraction).unwrap_or_else(|| vec![0.0; recording.time.len()]);
    measured.into_iter().map(|reading| parameters.effects.true_contraction(reading)).collect()
}

fn driven_readings(out: &ActuatorOutputs) -> [f64; 3] {
    [out.measured_gauge_pressure, out.measured_contraction, out.measured_force]
}

/// Simulates a system whose inputs are joined by straight lines between the given times.
fn follow<S: System>(
    parameters: &Parameters,
    time: &[f64],
    inputs: impl Fn(usize) -> S::Inputs,
    shown: impl Fn(&S::Outputs) -> [f64; 3],
    given: &[Signal],
) -> Result<Replay> {
    let mut simulator = Simulator::<S>::new(*parameters);
    simulator.inputs = inputs(0);
    simulator.initialize(time[0])?;
    let mut replay = Replay { given: given.to_vec(), ..Replay::default() };
    for k in 0..time.len() {
        simulator.inputs = inputs(k);
        let [gauge_pressure, contraction, force] = shown(&simulator.outputs());
        replay.gauge_pressure.push(gauge_pressure);
        replay.contraction.push(contraction);
        replay.force.push(force);
        if k + 1 < time.len() {
            let span = time[k + 1] - time[k];
            let difference = inputs(k + 1).along(&inputs(k), -1.0);
            simulator.slopes = S::Inputs::default().along(&difference, 1.0 / span);
            simulator.advance(span)?;
        }
    }
    Ok(replay)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Rate of change at every sample: slope of the least-squares line through the nearest samples, which keeps the noise
/// of a position sensor out of the velocity.
pub fn slopes(time: &[f64], values: &[f64]) -> Vec<f64> {
    const HALF_WINDOW: usize = 4;
    (0..time.len())
        .map(|k| {
            let window = k.saturating_sub(HALF_WINDOW)..(k + HALF_WINDOW + 1).min(time.len());
            let (t, y) = (&time[window.clone()], &values[window]);
            let (mean_t, mean_y) = (mean(t), mean(y));
            let covariance: f64 = t.iter().zip(y).map(|(t, y)| (t - mean_t) * (y - mean_y)).sum();
            covariance / t.iter().map(|t| (t - mean_t).powi(2)).sum::<f64>()
        })
        .collect()
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
    let weight = parameters.load.mass * GRAVITY;
    parameters.initial.gauge_pressure = holding_pressure(&parameters, parameters.reference.start, weight).max(0.0);
    parameters
}

/// Simulates reference, controller and muscle for `duration` s, exchanging signals every `step` s; the load starts at
/// rest where the reference starts.
///
/// # Errors
/// As [`replay`].
pub fn closed_loop(parameters: &Parameters, step: f64, duration: f64) -> Result<ClosedLoop> {
    let parameters = at_rest_on_reference(parameters);
    let mut reference = Simulator::<ReferenceTrajectory>::new(parameters);
    let mut controller = Simulator::<PidFeedForward>::new(parameters);
    let mut muscle = Simulator::<PneumaticMuscle>::new(parameters);
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
