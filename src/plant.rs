//! Valve, muscle and load put together, with every effect in its place.

use crate::effects::{Effects, Point, Readings};
use crate::memory::{Line, PlantMemory};
use crate::model::{Clock, Documentation, Extended, Extent, Feedthrough, Passage, State, Step, System};
use crate::muscle::{bisect, force_equations};
use crate::parameters::Parameters;
use crate::variables::Signals;
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
    Modelling\u{201d}, Politecnico di Milano: chapters 3 and 4, with the corrections that the force models state, eqs. 5.3, 5.4.";

/// Stiffness of what stretches, times this time in s, is how it damps: without mass and loss it would be infinitely fast.
const LOSS_TIME: f64 = 5e-4;
/// The same of something stiff, together with the damping of the muscle: at 1 kN/s that is less than 0.03 mm off, and a shorter time would
/// take the smaller steps.
const FOLLOWING_TIME: f64 = 3e-3;
/// Pull in N from which on it does: where it becomes slack, nothing jumps.
const TAUT: f64 = 10.0;
/// Slack in m that is more than any muscle is long.
const MOST_SLACK: f64 = 0.5;
/// Damping in N s/m that a muscle has at least while it moves by itself.
const LEAST_DAMPING: f64 = 1.0;
/// Steps in which it is found how what stretches moves, and the share of its pull that ends that.
const MOST_STEPS: usize = 40;
const SAME_FORCE: f64 = 1e-12;

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

/// What is at work of the effects.
#[inline]
fn extent(parameters: &Parameters) -> Extent {
    if parameters.are_nominal() { Extent::Nominal } else { Extent::Moving(parameters.effects.moving()) }
}

/// The point of the muscle itself behind that of its load, and its pull on the load in N; `own` are the states of the effects.
#[inline]
fn pulling(parameters: &Parameters, at: Point, own: &[f64]) -> (Point, f64) {
    let stretched = parameters.effects.tension(own).map(|tension| stretched(parameters, &at, own, tension));
    stretched.unwrap_or_else(|| (at, muscle_force(parameters, &at, own)))
}

/// The point of the muscle itself behind that of its load.
#[inline]
fn of_muscle(parameters: &Parameters, at: Point, own: &[f64]) -> Point {
    parameters.effects.tension(own).map_or(at, |tension| stretched(parameters, &at, own, tension).0)
}

/// The same with the pull, behind something that stretches: it gives way at such a rate that the pull of the muscle, which moves along,
/// is the one that it passes on. A `tension` below zero says how slack it is.
fn stretched(parameters: &Parameters, at: &Point, own: &[f64], tension: f64) -> (Point, f64) {
    let (stretch, compliance) = parameters.effects.stretch(tension);
    let still = Point { contraction: at.contraction + stretch, ..*at };
    let point = |tension_rate: f64| Point {
        contraction_velocity: at.contraction_velocity + compliance * tension_rate,
        tension_rate,
        ..still
    };
    let pull = StaticPull::at(parameters, &still, own);
    let loss_time = LOSS_TIME.max(FOLLOWING_TIME - compliance * parameters.muscle.damping);
    let loss = loss_time * (tension / TAUT).clamp(0.0, 1.0);
    let passed_on = |rate: f64| tension.max(0.0) + loss * rate;
    let of_muscle = |rate: f64| pull.moving(parameters, &point(rate), own) - LEAST_DAMPING * compliance * rate;
    let lack = |rate: f64| of_muscle(rate) - passed_on(rate);
    // What damps the muscle is nominal, and else no less than nothing.
    let (at_rest, least) = (lack(0.0), loss + compliance * LEAST_DAMPING);
    let guess = at_rest / (least + compliance * parameters.muscle.damping);
    let rate = root(lack, at_rest, guess, at_rest / least, SAME_FORCE * (1.0 + tension.abs()));
    (point(rate), passed_on(rate))
}

/// Tension in N of what stretches with a load at rest or one that moves evenly, or the pull of the muscle where nothing does; with the
/// effects as they are at the start.
fn resting_tension(parameters: &Parameters, at: &Point) -> f64 {
    let effects = &parameters.effects;
    let stretch = |tension: f64| effects.stretch(tension).0;
    let pull = |contraction: f64| {
        let at = with_pull(parameters, &Point { contraction, ..*at });
        muscle_force(parameters, &at, &effects.start(&at))
    };
    let rigid = pull(at.contraction);
    if stretch(rigid) == 0.0 {
        return rigid;
    }
    let stretched = |tension: f64| pull(at.contraction + stretch(tension));
    if rigid < 0.0 {
        // The muscle would push: it is as long as it is without a load.
        return bisect(stretched, MOST_SLACK / stretch(-1.0), 0.0);
    }
    root(|tension| stretched(tension) - tension, rigid, rigid, 10.0 * rigid, SAME_FORCE * (1.0 + rigid))
}

/// Pull in N on a load at rest.
fn resting_pull(parameters: &Parameters, at: &Point) -> f64 {
    let tension = resting_tension(parameters, at);
    if parameters.effects.stretch(tension).0 == 0.0 { tension } else { tension.max(0.0) }
}

/// The root of a function that falls, between zero, its value at which is given, and a bound of the same sign; from a guess to where the
/// function is small enough, or as near as so many steps come (false position, Illinois).
fn root(function: impl Fn(f64) -> f64, at_zero: f64, guess: f64, bound: f64, small: f64) -> f64 {
    if at_zero.abs() <= small {
        return 0.0;
    }
    let (mut near, mut value_near) = (0.0, at_zero);
    let (mut far, mut value_far) = (bound, -at_zero);
    let mut now = guess;
    let mut was_near = None;
    for _ in 0..MOST_STEPS {
        let value = function(now);
        if value.abs() <= small {
            break;
        }
        // An end that stays twice counts half, since else it would stay for ever.
        let is_near = value * at_zero > 0.0;
        let stays = if was_near == Some(is_near) { 0.5 } else { 1.0 };
        if is_near {
            (near, value_near, value_far) = (now, value, stays * value_far);
        } else {
            (far, value_far, value_near) = (now, value, stays * value_near);
        }
        was_near = Some(is_near);
        let next = near - value_near * (far - near) / (value_far - value_near);
        if next == now {
            break;
        }
        now = next;
    }
    now
}

/// Pull of the muscle in N at its own point, with damping, effects and correction; `own` are the states of the effects.
#[inline]
fn muscle_force(parameters: &Parameters, at: &Point, own: &[f64]) -> f64 {
    StaticPull::at(parameters, at, own).moving(parameters, at, own)
}

/// What of the pull of a muscle does not depend on how fast it moves.
struct StaticPull {
    /// Gauge pressure that the muscle feels, Pa.
    pressure: f64,
    /// Contraction that it feels, m.
    contraction: f64,
    /// Pull in N.
    force: f64,
}

impl StaticPull {
    #[inline]
    fn at(parameters: &Parameters, at: &Point, own: &[f64]) -> Self {
        let Parameters { muscle, force_models, effects, .. } = parameters;
        let nominal_pull = || force_models.force(muscle, at.gauge_pressure, at.contraction);
        let pressure = effects.effective_pressure(at, &nominal_pull, at.gauge_pressure);
        let contraction = effects.effective_contraction(at, own, at.contraction);
        let of_area = effects.area_force(at, own, force_models.pressure_force(muscle, pressure, contraction));
        let of_membrane = effects.elastic_contraction(at, own, contraction);
        let elastic = effects.elastic_force(at, own, force_models.elastic_force(muscle, of_membrane));
        Self { pressure, contraction, force: effects.static_force(of_area + elastic) }
    }

    /// The whole pull in N at the point's velocity.
    #[inline]
    fn moving(&self, parameters: &Parameters, at: &Point, own: &[f64]) -> f64 {
        let Parameters { muscle, force_models, effects, unknown_cause, .. } = parameters;
        let velocity = at.contraction_velocity;
        let resistance = force_models.resistance(muscle, self.pressure, self.contraction, velocity);
        let force = effects.muscle_force(at, own, self.force - muscle.damping * velocity - resistance);
        unknown_cause.force(at, force)
    }
}

/// Pull of the muscle in N without effects.
#[inline]
fn nominal_force(parameters: &Parameters, at: &Point) -> f64 {
    let Parameters { muscle, force_models, .. } = parameters;
    let velocity = at.contraction_velocity;
    force_models.moving_force(muscle, at.gauge_pressure, at.contraction, velocity) - muscle.damping * velocity
}

/// Gauge pressure in Pa that a command in V asks for.
#[inline]
fn commanded_pressure(parameters: &Parameters, command: f64, at: &Point, own: &[f64]) -> f64 {
    parameters.valve.target_pressure(parameters.effects.command(at, own, command))
}

/// The point with the pressure that the valve goes for.
#[inline]
fn with_target(parameters: &Parameters, command: f64, at: Point, own: &[f64]) -> Point {
    let commanded_pressure = commanded_pressure(parameters, command, &at, own);
    let at = Point { commanded_pressure, ..at };
    let target_pressure = parameters.effects.target_pressure(&at, own, commanded_pressure);
    // No valve sucks.
    Point { target_pressure: parameters.unknown_cause.target_pressure(&at, target_pressure).max(0.0), ..at }
}

/// Rate of the gauge pressure in Pa/s.
#[inline]
fn pressure_rate(parameters: &Parameters, at: &Point, own: &[f64]) -> f64 {
    let effects = &parameters.effects;
    let bandwidth = effects.valve_bandwidth(at, parameters.valve.bandwidth);
    let rate = effects.pressure_rate(at, own, bandwidth * (at.target_pressure - at.gauge_pressure));
    // Nor does what swings behind it.
    if at.gauge_pressure > 0.0 { rate } else { rate.max(0.0) }
}

/// As [`pressure_rate`], without effects.
#[inline]
fn nominal_pressure_rate(parameters: &Parameters, command: f64, gauge_pressure: f64) -> f64 {
    parameters.valve.bandwidth * (parameters.valve.target_pressure(command) - gauge_pressure)
}

/// Masses in kg of the load that weigh and that move at a contraction in m, in this order.
#[inline]
pub fn masses(parameters: &Parameters, contraction: f64) -> (f64, f64) {
    parameters.effects.masses(parameters.load.mass, contraction)
}

/// Name of the contraction in m where the muscle would be longer than its threads, or shorter than nothing.
pub(crate) fn stretched_apart(parameters: &Parameters, contraction: f64) -> Option<&'static str> {
    let length = parameters.muscle.rest_length - contraction;
    (!(0.0..=parameters.muscle.thread_length).contains(&length)).then_some("muscle.contraction")
}

/// Point of a muscle at rest, its valve asking for the pressure that is there.
fn at_rest(gauge_pressure: f64, contraction: f64) -> Point {
    let (commanded_pressure, target_pressure) = (gauge_pressure, gauge_pressure);
    let nothing = Point::default();
    Point { commanded_pressure, target_pressure, gauge_pressure, contraction, ..nothing }
}

/// The same of a muscle that is moved.
fn moved(gauge_pressure: f64, contraction: f64, contraction_velocity: f64) -> Point {
    Point { contraction_velocity, ..at_rest(gauge_pressure, contraction) }
}

/// Point of a hanging load at the start: at rest, or as slow as the effects have it start.
fn at_start(parameters: &Parameters, gauge_pressure: f64, contraction: f64) -> Point {
    moved(gauge_pressure, contraction, parameters.effects.start_velocity())
}

/// The point as the states of effects see it.
#[inline]
fn with_pull(parameters: &Parameters, at: &Point) -> Point {
    let pressure_pull = parameters.force_models.pressure_force(&parameters.muscle, at.gauge_pressure, at.contraction);
    Point { pressure_pull, ..*at }
}

/// States of the effects at the start, at the point of a load at rest or one that moves evenly.
fn effects_at_start(parameters: &Parameters, at: &Point) -> [f64; Effects::STATES] {
    let tension = resting_tension(parameters, at);
    let contraction = at.contraction + parameters.effects.stretch(tension).0;
    parameters.effects.start(&with_pull(parameters, &Point { contraction, tension, ..*at }))
}

/// Gauge pressure in Pa at which the valve comes to rest under a command in V, with a contraction in m.
pub fn steady_pressure(parameters: &Parameters, command: f64, contraction: f64) -> f64 {
    let still = Parameters { effects: parameters.effects.at_rest(), ..*parameters };
    let command = parameters.effects.slack().start_at(command);
    let own = effects_at_start(&still, &at_rest(0.0, contraction));
    let rate = |pressure: f64| {
        let at = with_target(&still, command, at_rest(pressure, contraction), &own);
        pressure_rate(&still, &at, &own)
    };
    let highest = 1e5 + commanded_pressure(&still, command, &at_rest(0.0, contraction), &own);
    let target = if rate(0.0) <= 0.0 { 0.0 } else { bisect(rate, 0.0, highest) };
    (target + parameters.effects.rests_off()).max(0.0)
}

/// State of a muscle with a hanging load at a point, its effects as at the start.
fn hanging_state(parameters: &Parameters, at: &Point) -> Extended<3, HANGING_STATES> {
    let mut state = [0.0; HANGING_STATES];
    state[..3].copy_from_slice(&[at.gauge_pressure, at.contraction, at.contraction_velocity]);
    state[3..].copy_from_slice(&effects_at_start(parameters, at));
    Extended(state)
}

/// Rates of gauge pressure in Pa, contraction in m and its velocity in m/s of a load that hangs, in SI units per second, under a command in V;
/// with the effects as they are where that rests.
pub fn quasi_steady_rates(
    parameters: &Parameters,
    [pressure, contraction, velocity]: [f64; 3],
    command: f64,
) -> [f64; 3] {
    let still = Parameters { effects: parameters.effects.at_rest(), ..*parameters };
    let state = hanging_state(&still, &moved(pressure, contraction, velocity));
    let mut rates = Extended::ZERO;
    PneumaticMuscle::rates(&still, &MuscleInputs { command, external_force: 0.0 }, &state, &mut rates);
    [rates.0[0], rates.0[1], rates.0[2]]
}

/// Gauge pressure in Pa at which a weight in N hangs still at a contraction in m; see [`ForceModels::holding_pressure`].
///
/// [`ForceModels::holding_pressure`]: crate::muscle::ForceModels::holding_pressure
pub fn holding_pressure(parameters: &Parameters, contraction: f64, weight: f64) -> f64 {
    parameters.force_models.holding_pressure(&parameters.muscle, contraction, weight)
}

/// As [`holding_pressure`], with the effects as they are at the start; never below ambient.
pub fn resting_pressure(parameters: &Parameters, contraction: f64, weight: f64) -> f64 {
    let nominal = holding_pressure(parameters, contraction, weight).max(0.0);
    if parameters.are_nominal() {
        return nominal;
    }
    let lack =
        |gauge_pressure: f64| weight - resting_pull(parameters, &at_start(parameters, gauge_pressure, contraction));
    let highest = 2.0 * nominal + 5e5;
    if lack(0.0) <= 0.0 || lack(highest) > 0.0 { nominal } else { bisect(lack, 0.0, highest) }
}

/// Contraction in m at which the muscle holds a weight in N at a gauge pressure in Pa, at rest or as slow as the effects have it
/// start, with these as they are at the start; `None` where there is none.
///
/// Among several it is the longest muscle whose stiffness is positive.
pub fn equilibrium(parameters: &Parameters, gauge_pressure: f64, weight: f64) -> Option<f64> {
    equilibrium_with(parameters, gauge_pressure, |_| weight)
}

/// The same of a weight in N that may depend on the contraction in m.
fn equilibrium_with(parameters: &Parameters, gauge_pressure: f64, weight: impl Fn(f64) -> f64) -> Option<f64> {
    let muscle = &parameters.muscle;
    let surplus = |contraction: f64| {
        resting_pull(parameters, &at_start(parameters, gauge_pressure, contraction)) - weight(contraction)
    };
    let samples = 300;
    let at = |k: i32| muscle.rest_length * (-0.2 + 0.7 * f64::from(k) / f64::from(samples));
    let bracket = (0..samples).find(|&k| surplus(at(k)) > 0.0 && surplus(at(k + 1)) <= 0.0)?;
    Some(bisect(surplus, at(bracket), at(bracket + 1)))
}

/// Contraction in m at which the load hangs still at the start, pulled down by a force in N beyond its weight.
///
/// # Errors
/// [`Error::NoEquilibrium`].
pub fn hanging_contraction(parameters: &Parameters, external_force: f64) -> Result<f64> {
    let gauge_pressure = parameters.initial.gauge_pressure;
    let mass = |contraction| masses(parameters, contraction).0;
    let hanging =
        equilibrium_with(parameters, gauge_pressure, |contraction| mass(contraction) * GRAVITY + external_force);
    hanging.ok_or_else(|| Error::NoEquilibrium { mass: mass(0.0), external_force, gauge_pressure })
}

/// Muscle, valve and a load that hangs from it.
///
/// # Model
/// dp/dt = ω (K_v u − p); F = p A(x) + F_e(x) − B v; M dv/dt = F − M g − F_ext; the effects act on u, ω, dp/dt, on what
/// the muscle feels of p and x, on both parts of F, on M that weighs and M that moves, and on what the sensors show.
///
/// # Reference
/// Thesis eqs. 4.5, 5.3, 5.4.
#[derive(Debug, Clone, Copy)]
pub struct PneumaticMuscle;

impl System for PneumaticMuscle {
    const NAME: &'static str = "PneumaticMuscle";
    const DESCRIPTION: &'static str = "Pneumatic artificial muscle with proportional valve and hanging load";
    const DOCUMENTATION: Documentation = Documentation {
        equation: concat!(
            "valve   d(gauge_pressure)/dt = bandwidth (gain max(command, 0) - gauge_pressure)\n\
             muscle  force = F(gauge_pressure, contraction) - damping contraction_velocity\n\
             load    mass d(contraction_velocity)/dt = force - mass 9.81 m/s2 - external_force\n\n\
             At the start the load hangs still at initial.gauge_pressure, unless initial_motion has it move.\n\n\
             F of muscle.force_model, with contraction x, its rate v, length L = rest_length - x, thread_length b and \
             turns n:\n",
            force_equations!(),
        ),
        limits: LIMITS,
        source: SOURCE,
    };
    const GROUPS: &'static [&'static str] = &["muscle", "valve", "load", "initial", "initial_motion", "unknown_cause"];
    const EFFECTS: bool = true;
    const FEEDTHROUGH: &'static [Feedthrough] = &[];
    const INITIAL_INPUTS: &'static [&'static str] = &["load.external_force"];
    const STATE_NAMES: &'static [&'static str] =
        &["muscle.gauge_pressure", "muscle.contraction", "muscle.contraction_velocity"];
    type Inputs = MuscleInputs;
    type Outputs = MuscleOutputs;
    type State = Extended<3, HANGING_STATES>;
    type Memory = PlantMemory;
    const SCALE: Self::State = Extended(Effects::scales(&[1e5, 0.1, 0.1]));

    fn initial_state(parameters: &Parameters, inputs: &MuscleInputs) -> Result<Self::State> {
        let motion = parameters.initial_motion;
        let contraction = hanging_contraction(parameters, inputs.external_force)? + motion.contraction_offset;
        let mut at = at_start(parameters, parameters.initial.gauge_pressure, contraction);
        at.contraction_velocity += motion.contraction_velocity;
        Ok(hanging_state(parameters, &at))
    }

    #[inline]
    fn rates(parameters: &Parameters, inputs: &MuscleInputs, state: &Self::State, rates: &mut Self::State) {
        let (at, own) = hanging_point(state);
        let at = with_target(parameters, inputs.command, at, own);
        rates.0[1] = at.contraction_velocity;
        let (at, force) = pulling(parameters, at, own);
        rates.0[0] = pressure_rate(parameters, &at, own);
        let (weighing, moving) = masses(parameters, state.0[1]);
        rates.0[2] = (force - inputs.external_force) / moving - GRAVITY * (weighing / moving);
        parameters.effects.rates(&with_pull(parameters, &at), own, &mut rates.0[3..]);
    }

    #[inline]
    fn nominal_rates(parameters: &Parameters, inputs: &MuscleInputs, state: &Self::State, rates: &mut Self::State) {
        let (at, _) = hanging_point(state);
        rates.0[0] = nominal_pressure_rate(parameters, inputs.command, at.gauge_pressure);
        rates.0[1] = at.contraction_velocity;
        rates.0[2] = (nominal_force(parameters, &at) - inputs.external_force) / parameters.load.mass - GRAVITY;
    }

    fn outputs(
        parameters: &Parameters,
        clock: Clock,
        _: &MuscleInputs,
        state: &Self::State,
        memory: &PlantMemory,
    ) -> MuscleOutputs {
        let (of_load, own) = hanging_point(state);
        let (at, force) = pulling(parameters, of_load, own);
        let shown = readings(parameters, clock, &of_load, force, memory);
        MuscleOutputs {
            contraction: at.contraction,
            contraction_velocity: at.contraction_velocity,
            gauge_pressure: at.gauge_pressure,
            force,
            diameter: parameters.muscle.diameter(at.contraction),
            measured_contraction: shown.contraction,
            measured_gauge_pressure: shown.gauge_pressure,
            measured_force: shown.force,
        }
    }

    fn left_range(parameters: &Parameters, _: &Self::Inputs, state: &Self::State) -> Option<&'static str> {
        let (weighing, moving) = masses(parameters, state.0[1]);
        if weighing <= 0.0 || moving <= 0.0 {
            return Some("load.mass with payload_mass");
        }
        stretched_apart(parameters, state.0[1])
    }

    #[inline]
    fn extent(parameters: &Parameters) -> Extent {
        extent(parameters)
    }

    #[inline]
    fn expect(memory: &mut PlantMemory, step: &Step<'_, Self>) {
        if nothing_to_remember(memory, step.parameters) {
            return;
        }
        expect_command(memory, step, |inputs| inputs.command);
        expect_contraction(memory, step, step.state.0[1]);
    }

    #[inline]
    fn felt(memory: &PlantMemory, step: &Step<'_, Self>, after: f64) -> Passage<MuscleInputs> {
        felt(memory, step, after, |inputs| &mut inputs.command)
    }

    #[inline]
    fn witness(
        memory: &mut PlantMemory,
        parameters: &Parameters,
        times: [f64; 2],
        states: &dyn Fn() -> [Self::State; 2],
    ) {
        if memory.contraction().is_empty() {
            return;
        }
        let [before, now] = states();
        let (contractions, velocities) = ([before.0[1], now.0[1]], [before.0[2], now.0[2]]);
        match parameters.effects.contraction_filter() {
            0.0 => memory.contraction().push_cubic(times, contractions, velocities),
            constant => memory.contraction().push_filtered(times, contractions, velocities, constant),
        }
    }

    fn remembers_finely(parameters: &Parameters) -> bool {
        remembers_contraction(parameters)
    }

    #[inline]
    fn forget(memory: &mut PlantMemory, parameters: &Parameters, time: f64) {
        forget(memory, parameters, time);
    }
}

/// The hanging load at an instant, but for the command; and the states of the effects.
#[inline]
fn hanging_point(state: &Extended<3, HANGING_STATES>) -> (Point, &[f64]) {
    let [gauge_pressure, contraction, contraction_velocity, own @ ..] = &state.0;
    let mut at = at_rest(*gauge_pressure, *contraction);
    at.contraction_velocity = *contraction_velocity;
    (at, own)
}

/// What the sensors show.
#[inline]
fn readings(parameters: &Parameters, clock: Clock, at: &Point, force: f64, memory: &PlantMemory) -> Readings {
    let effects = &parameters.effects;
    let Clock { time, start } = clock;
    let remembered = memory.mean_contraction(time - effects.contraction_reach(), time - effects.contraction_delay());
    let contraction = remembered.unwrap_or(at.contraction);
    effects.readings(Readings { time: time - start, contraction, gauge_pressure: at.gauge_pressure, force })
}

/// Whether the memory is empty and stays so. An effect that has become neutral is forgotten.
#[inline]
fn nothing_to_remember(memory: &mut PlantMemory, parameters: &Parameters) -> bool {
    let nothing = parameters.effects.are_neutral();
    if nothing && !memory.is_empty() {
        *memory = PlantMemory::default();
    }
    nothing
}

/// Takes note of the command of a step.
fn expect_command<S: System>(memory: &mut PlantMemory, step: &Step<'_, S>, command: impl Fn(&S::Inputs) -> f64) {
    let (effects, value, slope) = (&step.parameters.effects, command(&step.inputs), command(&step.slopes));
    let line = Line { start: step.time, span: step.duration, value, slope };
    memory.expect_command(&effects.slack(), effects.command_delay(), line);
}

/// Begins to remember the contraction, in m now, where its sensor is late, and ends where it is not.
fn expect_contraction<S: System>(memory: &mut PlantMemory, step: &Step<'_, S>, contraction: f64) {
    if remembers_contraction(step.parameters) {
        memory.contraction().begin(step.time, contraction);
    } else {
        *memory.contraction() = Default::default();
    }
}

/// Whether the sensor of the contraction is late.
fn remembers_contraction(parameters: &Parameters) -> bool {
    parameters.effects.contraction_reach() + parameters.effects.contraction_filter() != 0.0
}

/// The inputs as the valve feels them: their command is the one behind dead time and pilot.
#[inline]
fn felt<S: System>(
    memory: &PlantMemory,
    step: &Step<'_, S>,
    after: f64,
    command: impl Fn(&mut S::Inputs) -> &mut f64,
) -> Passage<S::Inputs> {
    let (mut inputs, mut slopes) = (step.inputs.along(&step.slopes, after), step.slopes);
    let mut span = step.duration - after;
    let delays = step.parameters.effects.command_delays();
    if let Some((value, slope, lasts)) = memory.seen_command(step.time + after, delays) {
        (*command(&mut inputs), *command(&mut slopes)) = (value, slope);
        span = span.min(lasts);
    }
    (inputs, slopes, span)
}

/// Forgets what no delay reaches any more.
#[inline]
fn forget(memory: &mut PlantMemory, parameters: &Parameters, time: f64) {
    if !memory.is_empty() {
        let effects = &parameters.effects;
        memory.forget(time - effects.command_delay(), time - effects.contraction_reach());
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
    const GROUPS: &'static [&'static str] = &["muscle", "valve", "initial", "unknown_cause"];
    const EFFECTS: bool = true;
    const FEEDTHROUGH: &'static [Feedthrough] = &[
        ("muscle.force", &["muscle.contraction", "muscle.contraction_velocity"]),
        ("measured.contraction", &["muscle.contraction", "muscle.contraction_velocity"]),
        ("measured.force", &["muscle.contraction", "muscle.contraction_velocity"]),
    ];
    const INITIAL_INPUTS: &'static [&'static str] = &["muscle.contraction", "muscle.contraction_velocity"];
    const STATE_NAMES: &'static [&'static str] = &["muscle.gauge_pressure"];
    type Inputs = ActuatorInputs;
    type Outputs = ActuatorOutputs;
    type State = Extended<1, DRIVEN_STATES>;
    type Memory = PlantMemory;
    const SCALE: Self::State = Extended(Effects::scales(&[1e5]));

    fn initial_state(parameters: &Parameters, inputs: &ActuatorInputs) -> Result<Self::State> {
        let gauge_pressure = parameters.initial.gauge_pressure;
        let mut state = [gauge_pressure; DRIVEN_STATES];
        let at = moved(gauge_pressure, inputs.contraction, inputs.contraction_velocity);
        state[1..].copy_from_slice(&effects_at_start(parameters, &at));
        Ok(Extended(state))
    }

    #[inline]
    fn rates(parameters: &Parameters, inputs: &ActuatorInputs, state: &Self::State, rates: &mut Self::State) {
        let (at, own) = driven_point(inputs, state);
        let at = with_target(parameters, inputs.command, at, own);
        let at = of_muscle(parameters, at, own);
        rates.0[0] = pressure_rate(parameters, &at, own);
        parameters.effects.rates(&with_pull(parameters, &at), own, &mut rates.0[1..]);
    }

    #[inline]
    fn nominal_rates(parameters: &Parameters, inputs: &ActuatorInputs, state: &Self::State, rates: &mut Self::State) {
        rates.0[0] = nominal_pressure_rate(parameters, inputs.command, state.0[0]);
    }

    fn outputs(
        parameters: &Parameters,
        clock: Clock,
        inputs: &ActuatorInputs,
        state: &Self::State,
        memory: &PlantMemory,
    ) -> ActuatorOutputs {
        let (at, own) = driven_point(inputs, state);
        driven_outputs(parameters, clock, &at, own, memory)
    }

    fn left_range(parameters: &Parameters, inputs: &Self::Inputs, _: &Self::State) -> Option<&'static str> {
        stretched_apart(parameters, inputs.contraction)
    }

    #[inline]
    fn extent(parameters: &Parameters) -> Extent {
        extent(parameters)
    }

    #[inline]
    fn expect(memory: &mut PlantMemory, step: &Step<'_, Self>) {
        if nothing_to_remember(memory, step.parameters) {
            return;
        }
        expect_command(memory, step, |inputs| inputs.command);
        expect_contraction(memory, step, step.inputs.contraction);
        let (start, span) = (step.time, step.duration);
        let (value, slope) = (step.inputs.contraction, step.slopes.contraction);
        match step.parameters.effects.contraction_filter() {
            _ if memory.contraction().is_empty() => {}
            0.0 => memory.contraction().push_line(&Line { start, span, value, slope }),
            constant => {
                let values = [value, value + slope * span];
                memory.contraction().push_filtered([start, start + span], values, [slope; 2], constant);
            }
        }
    }

    #[inline]
    fn felt(memory: &PlantMemory, step: &Step<'_, Self>, after: f64) -> Passage<ActuatorInputs> {
        felt(memory, step, after, |inputs| &mut inputs.command)
    }

    #[inline]
    fn forget(memory: &mut PlantMemory, parameters: &Parameters, time: f64) {
        forget(memory, parameters, time);
    }
}

/// The driven muscle at an instant, but for the command; and the states of the effects.
#[inline]
fn driven_point<'a>(inputs: &ActuatorInputs, state: &'a Extended<1, DRIVEN_STATES>) -> (Point, &'a [f64]) {
    let [gauge_pressure, own @ ..] = &state.0;
    (moved(*gauge_pressure, inputs.contraction, inputs.contraction_velocity), own)
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
    type State = Extended<0, { Effects::STATES }>;
    type Memory = ();
    const SCALE: Self::State = Extended(Effects::scales(&[]));

    fn initial_state(parameters: &Parameters, inputs: &MeasuredInputs) -> Result<Self::State> {
        Ok(Extended(effects_at_start(parameters, &measured_point(inputs))))
    }

    #[inline]
    fn rates(parameters: &Parameters, inputs: &MeasuredInputs, state: &Self::State, rates: &mut Self::State) {
        let at = of_muscle(parameters, measured_point(inputs), &state.0);
        parameters.effects.rates(&with_pull(parameters, &at), &state.0, &mut rates.0);
    }

    fn outputs(
        parameters: &Parameters,
        clock: Clock,
        inputs: &MeasuredInputs,
        state: &Self::State,
        (): &(),
    ) -> ActuatorOutputs {
        driven_outputs(parameters, clock, &measured_point(inputs), &state.0, &PlantMemory::default())
    }

    fn left_range(parameters: &Parameters, inputs: &Self::Inputs, _: &Self::State) -> Option<&'static str> {
        stretched_apart(parameters, inputs.contraction)
    }

    #[inline]
    fn extent(parameters: &Parameters) -> Extent {
        extent(parameters)
    }
}

/// The muscle alone at an instant.
#[inline]
fn measured_point(inputs: &MeasuredInputs) -> Point {
    moved(inputs.gauge_pressure, inputs.contraction, inputs.contraction_velocity)
}

/// Outputs of a muscle whose motion is given; `own` are the states of the effects.
#[inline]
fn driven_outputs(
    parameters: &Parameters,
    clock: Clock,
    at: &Point,
    own: &[f64],
    memory: &PlantMemory,
) -> ActuatorOutputs {
    let (_, force) = pulling(parameters, *at, own);
    let shown = readings(parameters, clock, at, force, memory);
    ActuatorOutputs {
        force,
        gauge_pressure: at.gauge_pressure,
        measured_contraction: shown.contraction,
        measured_gauge_pressure: shown.gauge_pressure,
        measured_force: shown.force,
    }
}
