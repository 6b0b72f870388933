//! PID controller with feed-forward.

use crate::GRAVITY;
use crate::Result;
use crate::memory::Memory;
use crate::model::{Clock, Documentation, Feedthrough, Step, System};
use crate::parameters::Parameters;
use crate::plant::holding_pressure;
use crate::variables::Signals;

crate::variables::variables! {
    /// PID controller of the contraction.
    ///
    /// # Model
    /// u = u_ff + K_p e + K_i ∫e dt + D, e = setpoint − measured; D is K_d de/dt through a first-order filter with
    /// time constant T_f. The command stays within its limits, and the integral rests while it is beyond one; without
    /// a sample time it comes to rest over the first millivolt.
    ///
    /// # Validity
    /// The gains of the presets are those of `sinew tune`, rounded: on the linearised plant, 20–80 kg and contractions up to
    /// 20 % of the rest length, the peak of the sensitivity function stays below 2.02 although load, force and dead time are not
    /// known; see `docs/closed-loop.md`.
    ///
    /// # Reference
    /// Thesis eq. 5.6; filter and limits are additions.
    pub struct Controller in "controller." as Tunable {
        /// Proportional gain
        proportional_gain: f64 = 0.05, VOLT_PER_METRE, (-1e5..=1e5);
        /// Integral gain
        integral_gain: f64 = 22.5, VOLT_PER_METRE_SECOND, (-1e6..=1e6);
        /// Derivative gain
        derivative_gain: f64 = 0.23, VOLT_SECOND_PER_METRE, (-1e5..=1e5);
        /// Time constant of the derivative filter
        filter_time_constant: f64 = 0.005, SECOND, (1e-5..=10.0);
        /// Smallest command
        minimum_command: f64 = 0.0, VOLT, (-100.0..=100.0);
        /// Largest command
        maximum_command: f64 = 10.0, VOLT, (-100.0..=100.0);
    }
}

crate::variables::variables! {
    /// When the controller acts.
    ///
    /// # Model
    /// With `sample_time` T_s = 0 the controller is continuous: it acts on whatever it is given, whenever it is asked. Otherwise it
    /// reads its inputs every T_s, from the start on, and holds its command in between (zero-order hold). At sample n:
    ///
    /// * f_n = (T_f f_(n−1) + T_s e_n)/(T_f + T_s), D_n = K_d (e_n − f_n)/T_f (backward difference),
    /// * u_n = u_ff + K_p e_n + I_n + D_n, limited,
    /// * I_(n+1) = I_n + K_i T_s e_n, unless that drives a limited command further out.
    ///
    /// Samples are taken exactly at their instants, also within a communication step, from inputs that move along their
    /// derivatives.
    ///
    /// # Reference
    /// K. Åström, T. Hägglund (2006), Advanced PID Control, ISA, section 13.
    pub struct Sampling in "controller." as Fixed {
        /// Time between two samples, at least 1 µs; zero for a continuous controller
        sample_time: f64 = 0.0, SECOND, (0.0..=10.0);
    }
}

crate::variables::variables! {
    /// Feed-forward of the pressure that the reference needs.
    ///
    /// # Model
    /// F(p_r, x_r) = M (k_g g + k_a d²x_r/dt²) + k_d B dx_r/dt + (1 − k_e) F_e(x_r) is solved for p_r, with the static force F
    /// and its elastic part F_e of whichever force model is chosen; where F = p A + F_e, p_r is (M (…) + k_d B dx_r/dt −
    /// k_e F_e)/A. p_r is kept within what the limits of the command allow. u_ff = (p_r + k_v/ω dp_r/dt)/K_v, with
    /// dp_r/dt along velocity and acceleration of the setpoint; the rate of the acceleration is taken through the filter of
    /// the controller, T_f, so that jumps of the acceleration are followed as fast as that. Shares: `elastic` k_e, `gravity` k_g, `inertia` k_a,
    /// `damping` k_d, `valve_lag` k_v.
    ///
    /// # Validity
    /// What the pull of the pressure depends on velocity, in models in which it does, is left to the feedback.
    ///
    /// # Reference
    /// Thesis section 5.3 has k_e = k_g = 1 and the others 0. It names the elastic forces only, but its gains could not
    /// carry the weight over the stroke. Inertia, damping and the inversion of the valve are additions.
    pub struct FeedForward in "feed_forward." as Tunable {
        /// Share of the elastic force that is fed forward
        elastic: f64 = 1.0, ONE, (0.0..=1.0);
        /// Share of the load's weight that is fed forward
        gravity: f64 = 1.0, ONE, (0.0..=1.0);
        /// Share of the load's inertia that is fed forward
        inertia: f64 = 1.0, ONE, (0.0..=1.0);
        /// Share of the muscle's damping that is fed forward
        damping: f64 = 1.0, ONE, (0.0..=1.0);
        /// Share of the valve's lag that is inverted
        valve_lag: f64 = 1.0, ONE, (0.0..=1.0);
    }
}

crate::variables::signals! {
    /// What the controller is given.
    pub struct ControllerInputs in "" as Input {
        /// Reference of the contraction
        setpoint: METRE;
        /// First derivative of the setpoint
        setpoint_velocity: METRE_PER_SECOND;
        /// Second derivative of the setpoint
        setpoint_acceleration: METRE_PER_SECOND2;
        /// Contraction that the position sensor shows
        measured_contraction: METRE;
    }
}

crate::variables::signals! {
    /// What the controller gives.
    pub struct ControllerOutputs in "" as Output {
        /// Command of the valve
        command: VOLT;
        /// Part of the command that is fed forward
        feed_forward: VOLT;
        /// Setpoint minus measured contraction
        control_error: METRE;
    }
}

/// Gauge pressure in Pa that the motion of the reference needs, within what the limits of the command allow.
fn reference_pressure(parameters: &Parameters, setpoint: f64, velocity: f64, acceleration: f64) -> f64 {
    let Parameters { muscle, force_models, load, valve, controller, feed_forward, .. } = parameters;
    let of_load = load.mass * (feed_forward.gravity * GRAVITY + feed_forward.inertia * acceleration);
    let of_damping = feed_forward.damping * muscle.damping * velocity;
    // What of the elastic force is not fed forward is taken for granted.
    let granted = (1.0 - feed_forward.elastic) * force_models.elastic_force(muscle, setpoint);
    let pull = of_load + of_damping + granted;
    let pressure = holding_pressure(parameters, setpoint, pull);
    let [lowest, highest] = [controller.minimum_command, controller.maximum_command].map(|u| valve.gain * u);
    if (lowest..=highest).contains(&pressure) {
        return pressure;
    }
    // Beyond its reach the muscle pulls less the higher the pressure, and asks for any: what is too far takes the highest.
    if force_models.force(muscle, highest, setpoint) < pull { highest } else { lowest.min(highest) }
}

/// Whether the muscle can hold the load still at a contraction in m by a command within its limits.
pub fn can_hold(parameters: &Parameters, contraction: f64) -> bool {
    let Parameters { load, valve, controller, .. } = parameters;
    let command = holding_pressure(parameters, contraction, load.mass * GRAVITY) / valve.gain;
    (controller.minimum_command..=controller.maximum_command).contains(&command)
}

/// Half the time in s over which the rate of the reference pressure is taken: the setpoint hardly moves meanwhile.
const MOMENT: f64 = 1e-4;

/// Command in V that makes the valve follow the pressure that the reference needs; `jerk` is the rate of the setpoint's
/// acceleration in m/s³.
fn feed_forward(parameters: &Parameters, inputs: &ControllerInputs, jerk: f64) -> f64 {
    let ControllerInputs { setpoint: x, setpoint_velocity: v, setpoint_acceleration: a, .. } = *inputs;
    let pressure = reference_pressure(parameters, x, v, a);
    let lag = parameters.feed_forward.valve_lag / parameters.valve.bandwidth;
    if lag == 0.0 {
        return pressure / parameters.valve.gain;
    }
    let pressure_in = |time: f64| reference_pressure(parameters, x + v * time, v + a * time, a + jerk * time);
    let rate = (pressure_in(MOMENT) - pressure_in(-MOMENT)) / (2.0 * MOMENT);
    (pressure + lag * rate) / parameters.valve.gain
}

/// States of the controller: integral part of the command in V, filtered control error in m, filtered acceleration of the
/// setpoint in m/s².
type ControllerState = [f64; 3];

/// Derivative, through the filter, of a signal that is `now` and was `filtered`.
///
/// A continuous controller knows the filtered value of now, a sampled one that of its last sample.
fn filtered_derivative(parameters: &Parameters, now: f64, filtered: f64) -> f64 {
    (now - filtered) / (parameters.controller.filter_time_constant + parameters.sampling.sample_time)
}

/// Feed-forward in V, and the command in V before its limits are applied.
fn commands(parameters: &Parameters, inputs: &ControllerInputs, state: &ControllerState) -> (f64, f64) {
    let Controller { proportional_gain, derivative_gain, .. } = parameters.controller;
    let [integral, filtered_error, filtered_acceleration] = *state;
    let error = inputs.setpoint - inputs.measured_contraction;
    let jerk = filtered_derivative(parameters, inputs.setpoint_acceleration, filtered_acceleration);
    let feed_forward = feed_forward(parameters, inputs, jerk);
    let derivative = filtered_derivative(parameters, error, filtered_error);
    (feed_forward, feed_forward + proportional_gain * error + integral + derivative_gain * derivative)
}

/// How far in V beyond its limits the command of the continuous controller may come before the integral part rests. It must
/// not stop at once: between growth below a limit and rest above it, no step would be short enough.
const LIMIT_WIDTH: f64 = 1e-3;

/// How far in V the command, without limits, is beyond the one towards which the integral part drives it; negative within.
fn beyond_limit(controller: &Controller, error: f64, unlimited: f64) -> f64 {
    let grows = controller.integral_gain * error > 0.0;
    if grows { unlimited - controller.maximum_command } else { controller.minimum_command - unlimited }
}

fn outputs_now(parameters: &Parameters, inputs: &ControllerInputs, state: &ControllerState) -> ControllerOutputs {
    let Controller { minimum_command, maximum_command, .. } = parameters.controller;
    let (feed_forward, unlimited) = commands(parameters, inputs, state);
    ControllerOutputs {
        // Not `clamp`: it panics where a user has set the limits the wrong way round, and keeps NaN.
        command: unlimited.max(minimum_command).min(maximum_command),
        feed_forward,
        control_error: inputs.setpoint - inputs.measured_contraction,
    }
}

/// Share of the time between two samples by which an instant may be off by rounding.
const ROUNDING: f64 = 1e-9;
/// Shortest time in s between two samples.
const LEAST_SAMPLE_TIME: f64 = 1e-6;

/// What a sampled controller holds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Held {
    /// Time of the first sample, s.
    start: f64,
    /// Number of samples that were taken.
    taken: f64,
    /// State at the coming sample; what is filtered is as of the last one.
    state: ControllerState,
    command: f64,
    feed_forward: f64,
}

impl Held {
    /// Whether the coming sample is to be taken at a time in s or before.
    fn is_due(&self, sample_time: f64, time: f64) -> bool {
        self.start + self.taken * sample_time <= time + ROUNDING * sample_time
    }

    fn take_sample(&mut self, parameters: &Parameters, inputs: &ControllerInputs) {
        let Parameters { controller, sampling, .. } = parameters;
        let (filter, sample_time) = (controller.filter_time_constant, sampling.sample_time);
        let outputs = outputs_now(parameters, inputs, &self.state);
        (self.command, self.feed_forward) = (outputs.command, outputs.feed_forward);
        let [integral, filtered_error, filtered_acceleration] = self.state;
        let error = outputs.control_error;
        let is_beyond = beyond_limit(controller, error, commands(parameters, inputs, &self.state).1) > 0.0;
        let rate = if is_beyond { 0.0 } else { controller.integral_gain * error };
        let smooth = |now: f64, filtered: f64| (filter * filtered + sample_time * now) / (filter + sample_time);
        self.state = [
            integral + sample_time * rate,
            smooth(error, filtered_error),
            smooth(inputs.setpoint_acceleration, filtered_acceleration),
        ];
        self.taken += 1.0;
    }
}

/// What a controller remembers beyond its state: nothing where it is continuous.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sampler(Option<Held>);

impl Memory for Sampler {
    type Mark = Self;

    fn mark(&self, _: f64) -> Self {
        *self
    }

    fn roll_back(&mut self, mark: Self) {
        *self = mark;
    }

    fn shift(&mut self, span: f64) {
        if let Some(held) = &mut self.0 {
            held.start += span;
        }
    }

    fn save(&self, saved: &mut Vec<f64>) {
        if let Some(Held { start, taken, state: [integral, error, acceleration], command, feed_forward }) = self.0 {
            saved.extend([start, taken, integral, error, acceleration, command, feed_forward]);
        }
    }

    fn load(saved: &[f64]) -> Option<Self> {
        match *saved {
            [] => Some(Self(None)),
            [start, taken, integral, error, acceleration, command, feed_forward]
                if taken >= 0.0 && taken.fract() == 0.0 =>
            {
                let state = [integral, error, acceleration];
                Some(Self(Some(Held { start, taken, state, command, feed_forward })))
            }
            _ => None,
        }
    }
}

/// PID controller with feed-forward of the forces at the reference.
///
/// # Model
/// See [`Controller`], [`Sampling`] and [`FeedForward`]. It starts without a bump: the integral is such that a setpoint
/// at rest asks for `initial.gauge_pressure`.
#[derive(Debug, Clone, Copy)]
pub struct PidFeedForward;

impl System for PidFeedForward {
    const NAME: &'static str = "PidFeedForward";
    const DESCRIPTION: &'static str = "PID controller of the contraction with feed-forward of the muscle's forces";
    const DOCUMENTATION: Documentation = Documentation {
        equation: "e = setpoint - measured_contraction\n\
                   command = feed_forward + proportional_gain e + integral_gain int(e) + derivative_gain de/dt, limited\n\
                   F(p, setpoint) = mass (gravity 9.81 m/s2 + inertia setpoint_acceleration) + damping muscle.damping setpoint_velocity\n\
                   feed_forward = (p + valve_lag / bandwidth dp/dt) / gain\n\n\
                   F of muscle.force_model, its elastic part by the share feed_forward.elastic. de/dt goes through a first-order filter; the \
                   integral stops while the command is at a limit and starts such that a setpoint at rest asks for \
                   initial.gauge_pressure. With sample_time above zero the inputs are read once per sample and the command is held.",
        limits: "The feed-forward knows the muscle as well as its parameters do: give both FMUs the same ones.",
        source: "Thesis eqs. 5.4 to 5.7 and section 5.3. Filter, limits, sampling, inertia, damping and valve inversion are additions.",
    };
    const GROUPS: &'static [&'static str] = &["muscle", "valve", "load", "initial", "controller", "feed_forward"];
    const FEEDTHROUGH: &'static [Feedthrough] = &[
        ("command", &["setpoint", "setpoint_velocity", "setpoint_acceleration", "measured_contraction"]),
        ("feed_forward", &["setpoint", "setpoint_velocity", "setpoint_acceleration"]),
        ("control_error", &["setpoint", "measured_contraction"]),
    ];
    const INITIAL_INPUTS: &'static [&'static str] =
        &["setpoint", "setpoint_velocity", "setpoint_acceleration", "measured_contraction"];
    const STATE_NAMES: &'static [&'static str] =
        &["integral part of the command", "filtered control error", "filtered setpoint_acceleration"];
    type Inputs = ControllerInputs;
    type Outputs = ControllerOutputs;
    type State = ControllerState;
    type Memory = Sampler;
    const SCALE: ControllerState = [1.0, 0.1, 1.0];

    fn initial_state(parameters: &Parameters, inputs: &ControllerInputs) -> Result<ControllerState> {
        let ControllerInputs { setpoint, measured_contraction, .. } = *inputs;
        // Before the start everything was at rest, even where the motion begins at once.
        let at_rest = ControllerInputs { setpoint, measured_contraction, ..ControllerInputs::default() };
        let error = setpoint - measured_contraction;
        let (_, without_integral) = commands(parameters, &at_rest, &[0.0, error, 0.0]);
        Ok([parameters.initial.gauge_pressure / parameters.valve.gain - without_integral, error, 0.0])
    }

    fn rates(parameters: &Parameters, inputs: &ControllerInputs, state: &ControllerState, rates: &mut ControllerState) {
        let Parameters { controller, sampling, .. } = parameters;
        if sampling.sample_time > 0.0 {
            *rates = [0.0; 3]; // it changes by samples only
            return;
        }
        let error = inputs.setpoint - inputs.measured_contraction;
        let beyond = beyond_limit(controller, error, commands(parameters, inputs, state).1);
        rates[0] = controller.integral_gain * error * (1.0 - beyond.max(0.0) / LIMIT_WIDTH).max(0.0);
        rates[1] = filtered_derivative(parameters, error, state[1]);
        rates[2] = filtered_derivative(parameters, inputs.setpoint_acceleration, state[2]);
    }

    fn outputs(
        parameters: &Parameters,
        clock: Clock,
        inputs: &ControllerInputs,
        state: &ControllerState,
        memory: &Sampler,
    ) -> ControllerOutputs {
        let control_error = inputs.setpoint - inputs.measured_contraction;
        match memory.0 {
            None => outputs_now(parameters, inputs, state),
            Some(held) if held.is_due(parameters.sampling.sample_time, clock.time) => {
                outputs_now(parameters, inputs, &held.state)
            }
            Some(Held { command, feed_forward, .. }) => ControllerOutputs { command, feed_forward, control_error },
        }
    }

    fn expect(memory: &mut Sampler, step: &Step<'_, Self>) {
        let sample_time = step.parameters.sampling.sample_time;
        if sample_time == 0.0 {
            return;
        }
        let start = Held { start: step.time, taken: 0.0, state: *step.state, command: 0.0, feed_forward: 0.0 };
        let held = memory.0.get_or_insert(start);
        // The sample at the end of the step belongs to the next one, whose inputs are not known yet.
        let end = step.time + step.duration - 2.0 * ROUNDING * sample_time;
        while held.is_due(sample_time, end) {
            let after = (held.start + held.taken * sample_time - step.time).max(0.0);
            held.take_sample(step.parameters, &step.inputs.along(&step.slopes, after));
        }
    }

    fn is_held(parameters: &Parameters, output: &str) -> bool {
        parameters.sampling.sample_time > 0.0 && output != "control_error"
    }

    /// A controller that samples so often would keep its caller waiting.
    fn left_range(parameters: &Parameters, _: &Self::Inputs, _: &ControllerState) -> Option<&'static str> {
        let sample_time = parameters.sampling.sample_time;
        (sample_time > 0.0 && sample_time < LEAST_SAMPLE_TIME).then_some("controller.sample_time")
    }
}
