//! Valve, muscle and load put together, with every effect in its place.

use crate::effects::{Effects, Point, Readings};
use crate::model::{Documentation, Feedthrough, System};
use crate::parameters::Parameters;
use crate::{Error, GRAVITY, Result};

/// States of the plant: pressure, contraction, its velocity, and those of the effects.
const HANGING_STATES: usize = 3 + Effects::STATES;
/// States without a load: pressure, and those of the effects.
const DRIVEN_STATES: usize = 1 + Effects::STATES;

const LIMITS: &str = "Static force identified at 0.5 to 4.5 bar and 100 to 800 N; below 0.5 bar the real muscle has \
    no force yet where the model has. A muscle longer than its thread or shorter than nothing ends the simulation. \
    The integration adapts its own step: results do not depend on the communication step for inputs that are held or \
    interpolated alike.";
const SOURCE: &str = "Master thesis \u{201c}Comparative Assessment and Improvement of Pneumatic Artificial Muscles \
    Modelling\u{201d}, Politecnico di Milano: eqs. 4.5 to 4.11, 4.17 (sign of b\u{b2} corrected), 5.3, 5.4.";

crate::variables::signals! {
    /// What acts on the muscle with its hanging load.
    pub struct MuscleInputs as Input {
        /// Command of the valve
        command = "valve.command", VOLT;
        /// Force that pulls the load down beyond its weight
        external_force = "load.external_force", NEWTON;
    }
}

crate::variables::signals! {
    /// What the muscle with its hanging load does and shows.
    pub struct MuscleOutputs as Output {
        /// Rest length minus length
        contraction = "muscle.contraction", METRE;
        /// Rate of the contraction
        contraction_velocity = "muscle.contraction_velocity", METRE_PER_SECOND;
        /// Gauge pressure in the muscle
        gauge_pressure = "muscle.gauge_pressure", PASCAL;
        /// Pull of the muscle on the load
        force = "muscle.force", NEWTON;
        /// Diameter of the braid
        diameter = "muscle.diameter", METRE;
        /// Contraction that the position sensor shows
        measured_contraction = "measured.contraction", METRE;
        /// Gauge pressure that the pressure sensor shows
        measured_gauge_pressure = "measured.gauge_pressure", PASCAL;
        /// Pull that the force sensor shows
        measured_force = "measured.force", NEWTON;
    }
}

crate::variables::signals! {
    /// What acts on the muscle when its motion comes from outside.
    pub struct ActuatorInputs as Input {
        /// Command of the valve
        command = "valve.command", VOLT;
        /// Rest length minus length
        contraction = "muscle.contraction", METRE;
        /// Rate of the contraction
        contraction_velocity = "muscle.contraction_velocity", METRE_PER_SECOND;
    }
}

crate::variables::signals! {
    /// What the driven muscle does and shows.
    pub struct ActuatorOutputs as Output {
        /// Pull of the muscle
        force = "muscle.force", NEWTON;
        /// Gauge pressure in the muscle
        gauge_pressure = "muscle.gauge_pressure", PASCAL;
        /// Contraction that the position sensor shows
        measured_contraction = "measured.contraction", METRE;
        /// Gauge pressure that the pressure sensor shows
        measured_gauge_pressure = "measured.gauge_pressure", PASCAL;
        /// Pull that the force sensor shows
        measured_force = "measured.force", NEWTON;
    }
}

/// Pull of the muscle in N, with damping and effects; `own` are the states of the effects.
#[inline]
fn muscle_force(parameters: &Parameters, at: &Point, contraction: f64, own: &[f64]) -> f64 {
    let Parameters { muscle, force_models, effects, .. } = parameters;
    let static_force = force_models.force(muscle, at.gauge_pressure, contraction);
    effects.muscle_force(at, own, static_force - muscle.damping * at.contraction_velocity)
}

/// Rate of the gauge pressure in Pa/s.
#[inline]
fn pressure_rate(parameters: &Parameters, command: f64, gauge_pressure: f64) -> f64 {
    let bandwidth = parameters.effects.valve_bandwidth(parameters.valve.bandwidth);
    bandwidth * (parameters.valve.target_pressure(command) - gauge_pressure)
}

fn moving_mass(parameters: &Parameters) -> f64 {
    parameters.effects.mass(parameters.load.mass)
}

/// Gauge pressure in Pa at which a weight in N hangs still at a contraction in m.
pub fn holding_pressure(parameters: &Parameters, contraction: f64, weight: f64) -> f64 {
    let Parameters { muscle, force_models, .. } = parameters;
    (weight - force_models.elastic_force(muscle, contraction)) / force_models.virtual_area(muscle, contraction)
}

/// Contraction in m at which the muscle holds a weight in N at a gauge pressure in Pa, at rest; `None` where there is
/// none.
///
/// Among several it is the longest muscle whose stiffness is positive.
pub fn equilibrium(parameters: &Parameters, gauge_pressure: f64, weight: f64) -> Option<f64> {
    let Parameters { muscle, force_models, .. } = parameters;
    let surplus = |contraction: f64| force_models.force(muscle, gauge_pressure, contraction) - weight;
    let samples = 300;
    let at = |k: i32| muscle.rest_length * (-0.2 + 0.7 * f64::from(k) / f64::from(samples));
    let bracket = (0..samples).find(|&k| surplus(at(k)) > 0.0 && surplus(at(k + 1)) <= 0.0)?;
    Some(bisect(surplus, at(bracket), at(bracket + 1)))
}

/// Root of a function that is positive at `low` and not at `high`, to the last bit.
fn bisect(function: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if function(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// Muscle, valve and a load that hangs from it.
///
/// # Model
/// dp/dt = ω (K_v u − p); F = p A(x) + F_e(x) − B v; M dv/dt = F − M g − F_ext; the effects act on ω, F, M and on what
/// the sensors show.
///
/// # Reference
/// Thesis eqs. 4.5, 5.3, 5.4.
#[derive(Debug, Clone, Copy)]
pub struct PneumaticMuscle;

impl System for PneumaticMuscle {
    const NAME: &'static str = "PneumaticMuscle";
    const DESCRIPTION: &'static str = "Pneumatic artificial muscle with proportional valve and hanging load";
    const DOCUMENTATION: Documentation = Documentation {
        equation: "valve   d(gauge_pressure)/dt = bandwidth (gain max(command, 0) - gauge_pressure)\n\
                   muscle  force = F(gauge_pressure, contraction) - damping contraction_velocity\n\
                   load    mass d(contraction_velocity)/dt = force - mass 9.81 m/s2 - external_force\n\n\
                   F of muscle.force_model, with contraction x, length L = rest_length - x:\n\
                   virtual-area       F = p (area_0 + area_1 x) + elastic_0 + elastic_1 x + elastic_2 x^2 + elastic_3 x^3\n\
                   improved-mckibben  F = p (3 L^2 - b^2)/(4 pi n^2) + E(L/L0) (eps_L delta pi D - 2 eps_D delta L^2/(D n^2 pi^2))\n\n\
                   At the start the load hangs still at initial.gauge_pressure.",
        limits: LIMITS,
        source: SOURCE,
    };
    const GROUPS: &'static [&'static str] = &["muscle", "valve", "load", "initial"];
    const EFFECTS: bool = true;
    const FEEDTHROUGH: &'static [Feedthrough] = &[];
    const INITIAL_INPUTS: &'static [&'static str] = &["load.external_force"];
    const STATE_NAMES: &'static [&'static str] =
        &["muscle.gauge_pressure", "muscle.contraction", "muscle.contraction_velocity"];
    type Inputs = MuscleInputs;
    type Outputs = MuscleOutputs;
    type State = [f64; HANGING_STATES];
    const SCALE: Self::State = {
        let mut scale = [1.0; HANGING_STATES];
        (scale[0], scale[1], scale[2]) = (1e5, 0.1, 0.1);
        scale
    };

    fn initial_state(parameters: &Parameters, inputs: &MuscleInputs) -> Result<Self::State> {
        let (mass, gauge_pressure) = (moving_mass(parameters), parameters.initial.gauge_pressure);
        let hanging = equilibrium(parameters, gauge_pressure, mass * GRAVITY + inputs.external_force);
        let mut state = [0.0; HANGING_STATES];
        state[0] = gauge_pressure;
        state[1] = hanging.ok_or(Error::NoEquilibrium { mass, gauge_pressure })?;
        Ok(state)
    }

    #[inline]
    fn rates(parameters: &Parameters, inputs: &MuscleInputs, state: &Self::State, rates: &mut Self::State) {
        let [gauge_pressure, contraction, contraction_velocity, own @ ..] = state;
        let at = Point { gauge_pressure: *gauge_pressure, contraction_velocity: *contraction_velocity };
        let mass = moving_mass(parameters);
        let force = muscle_force(parameters, &at, *contraction, own);
        rates[0] = pressure_rate(parameters, inputs.command, *gauge_pressure);
        rates[1] = *contraction_velocity;
        rates[2] = (force - inputs.external_force) / mass - GRAVITY;
        parameters.effects.rates(&at, own, &mut rates[3..]);
    }

    fn outputs(parameters: &Parameters, _: f64, _: &MuscleInputs, state: &Self::State) -> MuscleOutputs {
        let [gauge_pressure, contraction, contraction_velocity, own @ ..] = *state;
        let at = Point { gauge_pressure, contraction_velocity };
        let force = muscle_force(parameters, &at, contraction, &own);
        let shown = parameters.effects.readings(Readings { contraction, gauge_pressure, force });
        MuscleOutputs {
            contraction,
            contraction_velocity,
            gauge_pressure,
            force,
            diameter: parameters.muscle.diameter(contraction),
            measured_contraction: shown.contraction,
            measured_gauge_pressure: shown.gauge_pressure,
            measured_force: shown.force,
        }
    }

    fn left_range(parameters: &Parameters, state: &Self::State) -> Option<&'static str> {
        if moving_mass(parameters) <= 0.0 {
            return Some("load.mass with payload_mass.additional_mass");
        }
        let length = parameters.muscle.rest_length - state[1];
        (!(0.0..=parameters.muscle.thread_length).contains(&length)).then_some("muscle.contraction")
    }
}

/// Muscle and valve, moved from outside.
///
/// # Model
/// As [`PneumaticMuscle`], with contraction and velocity as inputs.
#[derive(Debug, Clone, Copy)]
pub struct PneumaticActuator;

impl System for PneumaticActuator {
    const NAME: &'static str = "PneumaticActuator";
    const DESCRIPTION: &'static str = "Pneumatic artificial muscle with proportional valve, moved from outside";
    const DOCUMENTATION: Documentation = Documentation {
        equation: "valve   d(gauge_pressure)/dt = bandwidth (gain max(command, 0) - gauge_pressure)\n\
                   muscle  force = F(gauge_pressure, contraction) - damping contraction_velocity\n\n\
                   F as in PneumaticMuscle. The contraction and its velocity are inputs and must belong together.",
        limits: LIMITS,
        source: SOURCE,
    };
    const GROUPS: &'static [&'static str] = &["muscle", "valve", "initial"];
    const EFFECTS: bool = true;
    const FEEDTHROUGH: &'static [Feedthrough] = &[
        ("muscle.force", &["muscle.contraction", "muscle.contraction_velocity"]),
        ("measured.contraction", &["muscle.contraction"]),
        ("measured.force", &["muscle.contraction", "muscle.contraction_velocity"]),
    ];
    const INITIAL_INPUTS: &'static [&'static str] = &["muscle.contraction", "muscle.contraction_velocity"];
    const STATE_NAMES: &'static [&'static str] = &["muscle.gauge_pressure"];
    type Inputs = ActuatorInputs;
    type Outputs = ActuatorOutputs;
    type State = [f64; DRIVEN_STATES];
    const SCALE: Self::State = {
        let mut scale = [1.0; DRIVEN_STATES];
        scale[0] = 1e5;
        scale
    };

    fn initial_state(parameters: &Parameters, _: &ActuatorInputs) -> Result<Self::State> {
        let mut state = [0.0; DRIVEN_STATES];
        state[0] = parameters.initial.gauge_pressure;
        Ok(state)
    }

    #[inline]
    fn rates(parameters: &Parameters, inputs: &ActuatorInputs, state: &Self::State, rates: &mut Self::State) {
        let [gauge_pressure, own @ ..] = state;
        let at = Point { gauge_pressure: *gauge_pressure, contraction_velocity: inputs.contraction_velocity };
        rates[0] = pressure_rate(parameters, inputs.command, *gauge_pressure);
        parameters.effects.rates(&at, own, &mut rates[1..]);
    }

    fn outputs(parameters: &Parameters, _: f64, inputs: &ActuatorInputs, state: &Self::State) -> ActuatorOutputs {
        let [gauge_pressure, own @ ..] = state;
        driven_outputs(parameters, *gauge_pressure, inputs.contraction, inputs.contraction_velocity, own)
    }

    fn left_range(_: &Parameters, _: &Self::State) -> Option<&'static str> {
        None
    }
}

crate::variables::signals! {
    /// What is known of the muscle when its pressure was measured.
    pub struct MeasuredInputs as Input {
        /// Gauge pressure in the muscle
        gauge_pressure = "muscle.gauge_pressure", PASCAL;
        /// Rest length minus length
        contraction = "muscle.contraction", METRE;
        /// Rate of the contraction
        contraction_velocity = "muscle.contraction_velocity", METRE_PER_SECOND;
    }
}

/// The muscle alone, its pressure and motion given: the chain cut where it was measured. It is no FMU.
///
/// # Model
/// As [`PneumaticActuator`], with the gauge pressure as an input.
#[derive(Debug, Clone, Copy)]
pub struct MuscleAlone;

impl System for MuscleAlone {
    const NAME: &'static str = "MuscleAlone";
    const DESCRIPTION: &'static str = "Pneumatic artificial muscle, its pressure and motion given";
    const DOCUMENTATION: Documentation = PneumaticActuator::DOCUMENTATION;
    const GROUPS: &'static [&'static str] = PneumaticActuator::GROUPS;
    const EFFECTS: bool = true;
    const FEEDTHROUGH: &'static [Feedthrough] = &[];
    const INITIAL_INPUTS: &'static [&'static str] = &[];
    const STATE_NAMES: &'static [&'static str] = &[];
    type Inputs = MeasuredInputs;
    type Outputs = ActuatorOutputs;
    type State = [f64; Effects::STATES];
    const SCALE: Self::State = [1.0; Effects::STATES];

    fn initial_state(_: &Parameters, _: &MeasuredInputs) -> Result<Self::State> {
        Ok([0.0; Effects::STATES])
    }

    #[inline]
    fn rates(parameters: &Parameters, inputs: &MeasuredInputs, state: &Self::State, rates: &mut Self::State) {
        let at = Point { gauge_pressure: inputs.gauge_pressure, contraction_velocity: inputs.contraction_velocity };
        parameters.effects.rates(&at, state, rates);
    }

    fn outputs(parameters: &Parameters, _: f64, inputs: &MeasuredInputs, state: &Self::State) -> ActuatorOutputs {
        let MeasuredInputs { gauge_pressure, contraction, contraction_velocity } = *inputs;
        driven_outputs(parameters, gauge_pressure, contraction, contraction_velocity, state)
    }

    fn left_range(_: &Parameters, _: &Self::State) -> Option<&'static str> {
        None
    }
}

/// Outputs of a muscle whose motion is given; `own` are the states of the effects.
fn driven_outputs(
    parameters: &Parameters,
    gauge_pressure: f64,
    contraction: f64,
    contraction_velocity: f64,
    own: &[f64],
) -> ActuatorOutputs {
    let at = Point { gauge_pressure, contraction_velocity };
    let force = muscle_force(parameters, &at, contraction, own);
    let shown = parameters.effects.readings(Readings { contraction, gauge_pressure, force });
    ActuatorOutputs {
        force,
        gauge_pressure,
        measured_contraction: shown.contraction,
        measured_gauge_pressure: shown.gauge_pressure,
        measured_force: shown.force,
    }
}
