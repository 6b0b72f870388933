//! PID controller with feed-forward.

use crate::GRAVITY;
use crate::Result;
use crate::model::{Documentation, Feedthrough, System};
use crate::parameters::Parameters;
use crate::plant::holding_pressure;

crate::variables::variables! {
    /// PID controller of the contraction.
    ///
    /// # Model
    /// u = u_ff + K_p e + K_i ∫e dt + D, e = setpoint − measured; D is K_d de/dt through a first-order filter with
    /// time constant T_f. The command stays within its limits, and the integral stops while it is at one.
    ///
    /// # Validity
    /// The default gains keep the peak of the sensitivity function below 1.8 on the linearised plant for both muscles,
    /// 20–80 kg and contractions up to 20 % of the rest length.
    ///
    /// # Reference
    /// Thesis eq. 5.6; filter and limits are additions.
    pub struct Controller in "controller." as Tunable {
        /// Proportional gain
        proportional_gain: f64 = 0.5, VOLT_PER_METRE, (-1e5..=1e5);
        /// Integral gain
        integral_gain: f64 = 20.0, VOLT_PER_METRE_SECOND, (-1e6..=1e6);
        /// Derivative gain
        derivative_gain: f64 = 0.25, VOLT_SECOND_PER_METRE, (-1e5..=1e5);
        /// Time constant of the derivative filter
        filter_time_constant: f64 = 0.005, SECOND, (1e-5..=10.0);
        /// Smallest command
        minimum_command: f64 = 0.0, VOLT, (-100.0..=100.0);
        /// Largest command
        maximum_command: f64 = 10.0, VOLT, (-100.0..=100.0);
    }
}

crate::variables::variables! {
    /// Feed-forward of the pressure that the reference needs.
    ///
    /// # Model
    /// p_r = (M (g + k_a d²x_r/dt²) − F_e(x_r)) / A(x_r), kept within what the limits of the command allow; u_ff = (p_r + k_v/ω dp_r/dt) / K_v: elastic force F_e and
    /// virtual area A of the muscle's force model at the setpoint x_r; `inertia` k_a; `valve_lag` k_v.
    ///
    /// # Reference
    /// Thesis section 5.3 has k_a = k_v = 0. Inverting the valve is an addition.
    pub struct FeedForward in "feed_forward." as Tunable {
        /// Share of the load's inertia that is fed forward
        inertia: f64 = 1.0, ONE, (0.0..=2.0);
        /// Share of the valve's lag that is inverted
        valve_lag: f64 = 1.0, ONE, (0.0..=2.0);
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

/// Gauge pressure in Pa that holds the load at a setpoint while it accelerates.
fn reference_pressure(parameters: &Parameters, setpoint: f64, acceleration: f64) -> f64 {
    let pull = parameters.load.mass * (GRAVITY + parameters.feed_forward.inertia * acceleration);
    holding_pressure(parameters, setpoint, pull)
}

/// Command in V that makes the valve follow the pressure that the reference needs.
pub fn feed_forward(parameters: &Parameters, inputs: &ControllerInputs) -> f64 {
    let Controller { minimum_command, maximum_command, .. } = parameters.controller;
    let (lowest, highest) = (parameters.valve.gain * minimum_command, parameters.valve.gain * maximum_command);
    // A setpoint that the muscle cannot reach may ask for any pressure or none (NaN): `max` makes that the lowest.
    let pressure_at =
        |setpoint| reference_pressure(parameters, setpoint, inputs.setpoint_acceleration).max(lowest).min(highest);
    let pressure = pressure_at(inputs.setpoint);
    let way = 1e-5 * parameters.muscle.rest_length;
    let slope = (pressure_at(inputs.setpoint + way) - pressure_at(inputs.setpoint - way)) / (2.0 * way);
    let lag = parameters.feed_forward.valve_lag / parameters.valve.bandwidth;
    (pressure + lag * slope * inputs.setpoint_velocity) / parameters.valve.gain
}

/// States of the controller: integral part of the command in V, filtered control error in m.
type ControllerState = [f64; 2];

/// Command before its limits are applied.
fn unlimited_command(parameters: &Parameters, inputs: &ControllerInputs, state: &ControllerState) -> f64 {
    let Parameters { controller, .. } = parameters;
    let [integral, filtered] = *state;
    let error = inputs.setpoint - inputs.measured_contraction;
    let derivative = (error - filtered) / controller.filter_time_constant;
    feed_forward(parameters, inputs)
        + controller.proportional_gain * error
        + integral
        + controller.derivative_gain * derivative
}

/// PID controller with feed-forward of the forces at the reference.
///
/// # Model
/// See [`Controller`] and [`FeedForward`]. It starts without a bump: the integral is such that the first command asks
/// for `initial.gauge_pressure`.
#[derive(Debug, Clone, Copy)]
pub struct PidFeedForward;

impl System for PidFeedForward {
    const NAME: &'static str = "PidFeedForward";
    const DESCRIPTION: &'static str = "PID controller of the contraction with feed-forward of the muscle's forces";
    const DOCUMENTATION: Documentation = Documentation {
        equation: "e = setpoint - measured_contraction\n\
                   command = feed_forward + proportional_gain e + integral_gain int(e) + derivative_gain de/dt, limited\n\
                   p = (mass (9.81 m/s2 + inertia setpoint_acceleration) - elastic(setpoint)) / area(setpoint)\n\
                   feed_forward = (p + valve_lag / bandwidth dp/dt) / gain\n\n\
                   de/dt goes through a first-order filter; the integral stops while the command is at a limit and \
                   starts such that the first command asks for initial.gauge_pressure.",
        limits: "The feed-forward knows the muscle as well as its parameters do: give both FMUs the same ones.",
        source: "Thesis eqs. 5.4 to 5.7 and section 5.3. Filter, limits, inertia and valve inversion are additions.",
    };
    const GROUPS: &'static [&'static str] = &["muscle", "valve", "load", "initial", "controller", "feed_forward"];
    const FEEDTHROUGH: &'static [Feedthrough] = &[
        ("command", &["setpoint", "setpoint_velocity", "setpoint_acceleration", "measured_contraction"]),
        ("feed_forward", &["setpoint", "setpoint_velocity", "setpoint_acceleration"]),
        ("control_error", &["setpoint", "measured_contraction"]),
    ];
    const INITIAL_INPUTS: &'static [&'static str] =
        &["setpoint", "setpoint_velocity", "setpoint_acceleration", "measured_contraction"];
    const STATE_NAMES: &'static [&'static str] = &["integral part of the command", "filtered control error"];
    type Inputs = ControllerInputs;
    type Outputs = ControllerOutputs;
    type State = ControllerState;
    type Memory = ();
    const SCALE: ControllerState = [1.0, 0.1];

    fn initial_state(parameters: &Parameters, inputs: &ControllerInputs) -> Result<ControllerState> {
        let error = inputs.setpoint - inputs.measured_contraction;
        let without_integral = unlimited_command(parameters, inputs, &[0.0, error]);
        Ok([parameters.initial.gauge_pressure / parameters.valve.gain - without_integral, error])
    }

    fn rates(parameters: &Parameters, inputs: &ControllerInputs, state: &ControllerState, rates: &mut ControllerState) {
        let Parameters { controller, .. } = parameters;
        let error = inputs.setpoint - inputs.measured_contraction;
        let command = unlimited_command(parameters, inputs, state);
        let rate = controller.integral_gain * error;
        let winds_up = (command > controller.maximum_command && rate > 0.0)
            || (command < controller.minimum_command && rate < 0.0);
        rates[0] = if winds_up { 0.0 } else { rate };
        rates[1] = (error - state[1]) / controller.filter_time_constant;
    }

    fn outputs(
        parameters: &Parameters,
        _: f64,
        inputs: &ControllerInputs,
        state: &ControllerState,
        (): &(),
    ) -> ControllerOutputs {
        let Parameters { controller, .. } = parameters;
        let command = unlimited_command(parameters, inputs, state);
        ControllerOutputs {
            // Not `clamp`: it panics where a user has set the limits the wrong way round, and keeps NaN.
            command: command.max(controller.minimum_command).min(controller.maximum_command),
            feed_forward: feed_forward(parameters, inputs),
            control_error: inputs.setpoint - inputs.measured_contraction,
        }
    }

    fn left_range(_: &Parameters, _: &ControllerState) -> Option<&'static str> {
        None
    }
}
