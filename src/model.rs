//! From equations to something that can be stepped, saved and asked by name: what an FMU needs of a model.
//!
//! A [`System`] is the equations; a [`Simulator`] integrates them; [`Model`] is the simulator without its type.

use crate::effects::{Description, Effects};
use crate::integrator::{self, Accuracy, Now};
use crate::memory::Memory;
use crate::muscle::ForceModels;
use crate::parameters::Parameters;
use crate::variables::{Declared, Signals, Variable};
use crate::{Error, Result};

/// Output of a model and the inputs that it depends on without delay.
pub type Feedthrough = (&'static str, &'static [&'static str]);

/// What a user of a model should know.
#[derive(Debug, Clone, Copy)]
pub struct Documentation {
    /// The equations, with the names of the variables.
    pub equation: &'static str,
    /// Where the model holds and where it does not.
    pub limits: &'static str,
    /// Where it comes from.
    pub source: &'static str,
}

/// State of a system: an array of reals, first its own and then those of effects.
pub trait State: Copy + Send {
    /// All zero.
    const ZERO: Self;
    /// As a slice.
    fn as_slice(&self) -> &[f64];
    /// As a slice that can be changed.
    fn as_mut_slice(&mut self) -> &mut [f64];
    /// See [`integrator::advance`]; of the states of effects only those move whose bits are set in `moving`, and the others rest: `rates` may
    /// leave out theirs, and of `now` theirs may be anything.
    ///
    /// # Errors
    /// As [`integrator::advance`].
    #[allow(clippy::too_many_arguments)]
    fn advance(
        &mut self,
        moving: u64,
        rates: impl FnMut(f64, &Self, &mut Self),
        witness: impl FnMut([f64; 2], &dyn Fn() -> [Self; 2], &dyn Fn(f64) -> Self),
        scale: &Self,
        accuracy: Accuracy,
        step: &mut f64,
        now: &mut Now<Self>,
        duration: f64,
    ) -> std::result::Result<(), integrator::Failed>;
}

impl<const N: usize> State for [f64; N] {
    const ZERO: Self = [0.0; N];
    fn as_slice(&self) -> &[f64] {
        self
    }
    fn as_mut_slice(&mut self) -> &mut [f64] {
        self
    }
    #[inline]
    fn advance(
        &mut self,
        _moving: u64,
        rates: impl FnMut(f64, &Self, &mut Self),
        mut witness: impl FnMut([f64; 2], &dyn Fn() -> [Self; 2], &dyn Fn(f64) -> Self),
        scale: &Self,
        accuracy: Accuracy,
        step: &mut f64,
        now: &mut Now<Self>,
        duration: f64,
    ) -> std::result::Result<(), integrator::Failed> {
        if N == 0 {
            witness([0.0, duration], &|| [Self::ZERO; 2], &|_| Self::ZERO);
            return Ok(());
        }
        integrator::advance(rates, witness, scale, accuracy, self, step, now, duration)
    }
}

/// `N` states of which the first `OWN` are those of the system itself, and the others those of effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extended<const OWN: usize, const N: usize>(pub [f64; N]);

impl<const OWN: usize, const N: usize> Extended<OWN, N> {
    /// Advances some of the states, while all others rest: `of` takes them out of all, `put` puts them there.
    #[inline]
    #[allow(clippy::too_many_arguments)]
    fn advance_some<const M: usize>(
        &mut self,
        of: impl Fn(&Self) -> [f64; M],
        put: impl Fn(&[f64; M], &mut Self),
        mut rates: impl FnMut(f64, &Self, &mut Self),
        mut witness: impl FnMut([f64; 2], &dyn Fn() -> [Self; 2], &dyn Fn(f64) -> Self),
        scale: &Self,
        accuracy: Accuracy,
        step: &mut f64,
        now: &mut Now<Self>,
        duration: f64,
    ) -> std::result::Result<(), integrator::Failed> {
        let resting = *self;
        let with = |some: &[f64; M]| {
            let mut all = resting;
            put(some, &mut all);
            all
        };
        // What rests is put there once.
        let (mut all, mut all_rates) = (resting, Self::ZERO);
        let mut some_now = Now { is_known: now.is_known, rates: of(&now.rates) };
        let rates = |t: f64, some: &[f64; M], out: &mut [f64; M]| {
            put(some, &mut all);
            rates(t, &all, &mut all_rates);
            *out = of(&all_rates);
        };
        let witness = |times: [f64; 2], ends: &dyn Fn() -> [[f64; M]; 2], within: &dyn Fn(f64) -> [f64; M]| {
            witness(times, &|| ends().map(|some| with(&some)), &|t| with(&within(t)));
        };
        let mut some = of(self);
        some.advance(0, rates, witness, &of(scale), accuracy, step, &mut some_now, duration)?;
        put(&some, self);
        put(&some_now.rates, &mut now.rates);
        now.is_known = true;
        Ok(())
    }

    /// The same with those at some positions.
    #[inline]
    #[allow(clippy::too_many_arguments)]
    fn advance_at<const M: usize>(
        &mut self,
        positions: [usize; M],
        rates: impl FnMut(f64, &Self, &mut Self),
        witness: impl FnMut([f64; 2], &dyn Fn() -> [Self; 2], &dyn Fn(f64) -> Self),
        scale: &Self,
        accuracy: Accuracy,
        step: &mut f64,
        now: &mut Now<Self>,
        duration: f64,
    ) -> std::result::Result<(), integrator::Failed> {
        let of = |all: &Self| positions.map(|position| all.0[position]);
        let put = |some: &[f64; M], all: &mut Self| {
            positions.iter().zip(some).for_each(|(position, value)| all.0[*position] = *value);
        };
        let arrived = self.advance_some(of, put, rates, witness, scale, accuracy, step, now, duration);
        let named = |failed: integrator::Failed| integrator::Failed {
            state: failed.state.map(|which| positions[which]),
            ..failed
        };
        arrived.map_err(named)
    }
}

impl<const OWN: usize, const N: usize> State for Extended<OWN, N> {
    const ZERO: Self = Self([0.0; N]);
    fn as_slice(&self) -> &[f64] {
        &self.0
    }
    fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.0
    }
    #[inline]
    fn advance(
        &mut self,
        moving: u64,
        rates: impl FnMut(f64, &Self, &mut Self),
        witness: impl FnMut([f64; 2], &dyn Fn() -> [Self; 2], &dyn Fn(f64) -> Self),
        scale: &Self,
        accuracy: Accuracy,
        step: &mut f64,
        now: &mut Now<Self>,
        duration: f64,
    ) -> std::result::Result<(), integrator::Failed> {
        const { assert!(FEW <= N && N <= u64::BITS as usize) };
        let all_moving = moving << OWN | ((1 << OWN) - 1);
        if moving == 0 {
            let of = |all: &Self| -> [f64; OWN] { std::array::from_fn(|k| all.0[k]) };
            let put = |own: &[f64; OWN], all: &mut Self| all.0[..OWN].copy_from_slice(own);
            self.advance_some(of, put, rates, witness, scale, accuracy, step, now, duration)
        } else if all_moving.count_ones() as usize <= VERY_FEW {
            self.advance_at(positions::<VERY_FEW>(all_moving), rates, witness, scale, accuracy, step, now, duration)
        } else if all_moving.count_ones() as usize <= FEW {
            self.advance_at(positions::<FEW>(all_moving), rates, witness, scale, accuracy, step, now, duration)
        } else {
            let (of, put) = (|all: &Self| all.0, |moved: &[f64; N], all: &mut Self| all.0 = *moved);
            self.advance_some(of, put, rates, witness, scale, accuracy, step, now, duration)
        }
    }
}

/// States that are integrated where no more than these move: the plant's own with those of almost any effect, and of several.
const VERY_FEW: usize = 6;
const FEW: usize = 12;

/// Positions of the states whose bits are set and, as they are to be `M`, of others.
fn positions<const M: usize>(moving: u64) -> [usize; M] {
    let mut rest = [moving, !moving];
    std::array::from_fn(|_| {
        let those = usize::from(rest[0] == 0);
        let position = rest[those].trailing_zeros();
        rest[those] &= rest[those] - 1;
        position as usize
    })
}

/// What of a system is at work besides its own equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Nothing: the nominal equations hold.
    Nominal,
    /// Effects, of whose states those move whose bits are set, by their positions among those of all effects.
    Moving(u64),
}

impl Extent {
    /// The states of effects that move.
    fn moving(self) -> u64 {
        match self {
            Self::Nominal => 0,
            Self::Moving(moving) => moving,
        }
    }
}

/// Inputs as the equations feel them over a passage: at its start, their slopes, and how long it lasts in s.
pub type Passage<Inputs> = (Inputs, Inputs, f64);

/// The equations of a model.
pub trait System: Copy + Send + 'static {
    /// Name of the model and of its FMU.
    const NAME: &'static str;
    /// One line.
    const DESCRIPTION: &'static str;
    /// What a user should know.
    const DOCUMENTATION: Documentation;
    /// The groups of parameters that it uses, by the first part of their names; with `muscle` come its force models.
    const GROUPS: &'static [&'static str];
    /// Whether it also has the parameters of every effect.
    const EFFECTS: bool = false;
    /// The group whose prefix its variables do not repeat.
    const OWN_GROUP: Option<&'static str> = None;
    /// Outputs with the inputs that act on them at once; an output that is not listed depends on none.
    const FEEDTHROUGH: &'static [Feedthrough];
    /// Inputs that the outputs depend on at the start.
    const INITIAL_INPUTS: &'static [&'static str];
    /// Names of the states, for messages; effects add theirs behind.
    const STATE_NAMES: &'static [&'static str];
    /// Inputs.
    type Inputs: Signals + PartialEq;
    /// Outputs.
    type Outputs: Signals;
    /// State.
    type State: State;
    /// What it remembers beyond its state.
    type Memory: Memory;
    /// Usual size of each state.
    const SCALE: Self::State;

    /// State at the start.
    ///
    /// # Errors
    /// Where the parameters allow no start.
    fn initial_state(parameters: &Parameters, inputs: &Self::Inputs) -> Result<Self::State>;
    /// Derivatives of the state, per second.
    fn rates(parameters: &Parameters, inputs: &Self::Inputs, state: &Self::State, rates: &mut Self::State);
    /// Outputs at an instant.
    fn outputs(
        parameters: &Parameters,
        clock: Clock,
        inputs: &Self::Inputs,
        state: &Self::State,
        memory: &Self::Memory,
    ) -> Self::Outputs;
    /// Whether an output keeps its value until it jumps, so that its time derivative is zero.
    fn is_held(_parameters: &Parameters, _output: &str) -> bool {
        false
    }
    /// Name of an input or a state that has left the range in which the model means anything.
    fn left_range(parameters: &Parameters, inputs: &Self::Inputs, state: &Self::State) -> Option<&'static str>;

    /// Derivatives of the outputs at a time in s, per second, of a system that is a function of time with jumps, which
    /// no difference may straddle; `None` where differences serve.
    fn output_rates(_parameters: &Parameters, _time: f64) -> Option<Self::Outputs> {
        None
    }
    /// What is at work.
    fn extent(_parameters: &Parameters) -> Extent {
        Extent::Nominal
    }
    /// As [`System::rates`] where the extent is nominal.
    #[inline]
    fn nominal_rates(parameters: &Parameters, inputs: &Self::Inputs, state: &Self::State, rates: &mut Self::State) {
        Self::rates(parameters, inputs, state, rates);
    }
    /// Takes note of the step that is to come; nothing is remembered where the extent is nominal.
    fn expect(_memory: &mut Self::Memory, _step: &Step<'_, Self>) {}
    /// The inputs as they are felt from `after` seconds into a step on.
    #[inline]
    fn felt(_memory: &Self::Memory, step: &Step<'_, Self>, after: f64) -> Passage<Self::Inputs> {
        (step.inputs.along(&step.slopes, after), step.slopes, step.duration - after)
    }
    /// Takes note of what the state has become between two times in s.
    fn witness(
        _memory: &mut Self::Memory,
        _parameters: &Parameters,
        _times: [f64; 2],
        _states: &dyn Fn() -> [Self::State; 2],
    ) {
    }
    /// Whether it remembers what only steps as short as between samples tell precisely enough.
    fn remembers_finely(_parameters: &Parameters) -> bool {
        false
    }
    /// Forgets what does not matter from a time in s on.
    fn forget(_memory: &mut Self::Memory, _parameters: &Parameters, _time: f64) {}
}

/// An instant of a simulation, which need not have started at zero.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Clock {
    /// Now, s.
    pub time: f64,
    /// At the start, s.
    pub start: f64,
}

impl Clock {
    /// A span in s later.
    fn later(self, span: f64) -> Self {
        Self { time: self.time + span, ..self }
    }
}

/// A communication step.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a, S: System> {
    /// Parameters.
    pub parameters: &'a Parameters,
    /// Time at its start, s.
    pub time: f64,
    /// State at its start.
    pub state: &'a S::State,
    /// Inputs at its start.
    pub inputs: S::Inputs,
    /// Derivatives of the inputs, per second.
    pub slopes: S::Inputs,
    /// How long it lasts, s.
    pub duration: f64,
}

/// A variable of a model: its declaration and the name it has there.
#[derive(Debug, Clone, Copy)]
pub struct ModelVariable {
    /// Name in the FMU.
    pub name: &'static str,
    /// Declaration.
    pub declaration: &'static Variable,
    /// Value with the default parameters.
    pub default: f64,
}

/// Fixed facts of a model, the same for all its instances.
#[derive(Debug)]
pub struct Interface {
    /// Name of the model.
    pub name: &'static str,
    /// One line.
    pub description: &'static str,
    /// What a user should know.
    pub documentation: Documentation,
    /// Inputs, outputs, parameters, in this order; the position is the value reference.
    pub variables: Vec<ModelVariable>,
    /// How many of the variables are inputs.
    pub inputs: usize,
    /// How many are outputs.
    pub outputs: usize,
    /// See [`System::FEEDTHROUGH`].
    pub feedthrough: &'static [Feedthrough],
    /// See [`System::INITIAL_INPUTS`].
    pub initial_inputs: &'static [&'static str],
}

impl Interface {
    /// The interface of a system.
    pub fn of<S: System>() -> Self {
        let inputs = S::Inputs::VARIABLES;
        let outputs = S::Outputs::VARIABLES;
        let as_is =
            |declaration: &'static Variable| ModelVariable { name: declaration.name, declaration, default: 0.0 };
        let mut variables: Vec<_> = inputs.iter().chain(outputs).map(as_is).collect();
        Parameters::default().visit(&mut |declaration, default| {
            if used_by::<S>(declaration) {
                variables.push(ModelVariable { name: exposed_name::<S>(declaration), declaration, default });
            }
        });
        Self {
            name: S::NAME,
            description: S::DESCRIPTION,
            documentation: S::DOCUMENTATION,
            variables,
            inputs: inputs.len(),
            outputs: outputs.len(),
            feedthrough: S::FEEDTHROUGH,
            initial_inputs: S::INITIAL_INPUTS,
        }
    }
}

fn used_by<S: System>(declaration: &Variable) -> bool {
    let group = declaration.group();
    S::GROUPS.contains(&group)
        || (S::GROUPS.contains(&"muscle") && ForceModels::GROUPS.contains(&group))
        || (S::EFFECTS && Effects::DESCRIPTIONS.iter().any(|effect| effect.name == group && acts_on::<S>(effect)))
}

/// Whether an effect means anything to a system.
fn acts_on<S: System>(effect: &Description) -> bool {
    !effect.of_load || S::GROUPS.contains(&"load")
}

fn exposed_name<S: System>(declaration: &'static Variable) -> &'static str {
    let own = S::OWN_GROUP.filter(|group| declaration.group() == *group);
    own.map_or(declaration.name, |group| &declaration.name[group.len() + 1..])
}

/// How the state moves at the end of a step, per second, and the inputs by which it does.
#[derive(Debug, Clone, Copy)]
pub struct Known<S: System> {
    inputs: S::Inputs,
    now: Now<S::State>,
}

impl<S: System> Known<S> {
    /// Before the first step.
    pub fn nothing() -> Self {
        Self { inputs: S::Inputs::default(), now: Now { is_known: false, rates: S::State::ZERO } }
    }
}

/// A system in the course of a simulation.
#[derive(Debug, Clone)]
pub struct Simulator<S: System> {
    /// Parameters; a change counts from the next step.
    pub parameters: Parameters,
    /// Inputs at the present time.
    pub inputs: S::Inputs,
    /// Derivatives of the inputs, per second; they hold for one step.
    pub slopes: S::Inputs,
    /// See [`integrator::advance`].
    pub accuracy: Accuracy,
    clock: Clock,
    state: S::State,
    step: f64,
    memory: S::Memory,
}

/// Step that an integration tries first, s.
const FIRST_STEP: f64 = 1e-3;

impl<S: System> Simulator<S> {
    /// A simulation that is yet to be initialised.
    pub fn new(parameters: Parameters) -> Self {
        let (inputs, slopes) = (S::Inputs::default(), S::Inputs::default());
        let memory = S::Memory::default();
        let (accuracy, state) = (Accuracy::USUAL, S::State::ZERO);
        Self { parameters, inputs, slopes, accuracy, clock: Clock::default(), state, step: FIRST_STEP, memory }
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.clock.time
    }

    /// State, in the order of [`System::STATE_NAMES`].
    pub fn state(&self) -> &S::State {
        &self.state
    }

    /// Puts the system at its start.
    ///
    /// # Errors
    /// As [`System::initial_state`], and [`Error::Start`] for a start out of range; nothing has changed then.
    pub fn initialize(&mut self, time: f64) -> Result<()> {
        let state = S::initial_state(&self.parameters, &self.inputs)?;
        if let Some(variable) = S::left_range(&self.parameters, &self.inputs, &state) {
            return Err(Error::Start { variable });
        }
        self.state = state;
        self.clock = Clock { time, start: time };
        self.step = FIRST_STEP;
        let mut memory = S::Memory::default();
        S::expect(&mut memory, &self.coming(0.0));
        self.memory = memory;
        Ok(())
    }

    /// Outputs at the present time.
    pub fn outputs(&self) -> S::Outputs {
        S::outputs(&self.parameters, self.clock, &self.inputs, &self.state, &self.memory)
    }

    /// The step that is to come.
    fn coming(&self, duration: f64) -> Step<'_, S> {
        let Self { ref parameters, inputs, slopes, clock: Clock { time, .. }, ref state, .. } = *self;
        Step { parameters, time, state, inputs, slopes, duration }
    }

    /// Advances by a duration in s; the inputs move along their slopes, which are then zero.
    ///
    /// # Errors
    /// [`Error::Diverged`], [`Error::TooManySteps`]; nothing has changed then.
    pub fn advance(&mut self, duration: f64) -> Result<()> {
        self.advance_past(duration, &mut Known::nothing(), &[], &mut |_| {})
    }

    /// The same, with the outputs at some instants, in s from now, on the way; they are sorted. With `known` from the step before it need not
    /// find out anew how the state moves at its start, where the parameters are the same.
    ///
    /// # Errors
    /// As [`Simulator::advance`].
    pub fn advance_past(
        &mut self,
        duration: f64,
        known: &mut Known<S>,
        instants: &[f64],
        see: &mut dyn FnMut(S::Outputs),
    ) -> Result<()> {
        let mark = self.memory.mark(self.clock.time);
        let before = (self.state, self.step);
        if let Err(error) = self.integrate(&before.0, duration, known, instants, see) {
            (self.state, self.step) = before;
            self.memory.roll_back(mark);
            *known = Known::nothing(); // it may be of a passage on the way
            return Err(error);
        }
        self.inputs = self.inputs.along(&self.slopes, duration);
        self.slopes = S::Inputs::default();
        self.clock.time += duration;
        S::forget(&mut self.memory, &self.parameters, self.clock.time);
        Ok(())
    }

    /// Has state and memory, but neither clock nor inputs, go on from a state by a duration in s.
    fn integrate(
        &mut self,
        from: &S::State,
        duration: f64,
        known: &mut Known<S>,
        instants: &[f64],
        see: &mut dyn FnMut(S::Outputs),
    ) -> Result<()> {
        let Self { ref parameters, inputs, slopes, accuracy, clock, ref mut state, ref mut step, ref mut memory } =
            *self;
        let time = clock.time;
        let coming = Step { parameters, time, state: from, inputs, slopes, duration };
        let extent = S::extent(parameters);
        S::expect(memory, &coming);
        let mut instants = instants.iter().copied().peekable();
        let mut after = 0.0;
        while after < duration {
            let (felt, felt_slopes, span) = S::felt(memory, &coming, after);
            let rates = |t: f64, y: &S::State, dy: &mut S::State| {
                let inputs = felt.along(&felt_slopes, t);
                match extent {
                    Extent::Nominal => S::nominal_rates(parameters, &inputs, y, dy),
                    Extent::Moving(_) => S::rates(parameters, &inputs, y, dy),
                }
            };
            let start = time + after;
            let witness = |[t0, t1]: [f64; 2], ends: &dyn Fn() -> [S::State; 2], within: &dyn Fn(f64) -> S::State| {
                S::witness(memory, parameters, [start + t0, start + t1], ends);
                while let Some(instant) = instants.next_if(|instant| instant - after < t1) {
                    let (clock, inputs) = (clock.later(instant), inputs.along(&slopes, instant));
                    see(S::outputs(parameters, clock, &inputs, &within(instant - after), memory));
                }
            };
            known.now.is_known &= known.inputs == felt;
            let now = &mut known.now;
            let passed = state.advance(extent.moving(), rates, witness, &S::SCALE, accuracy, step, now, span);
            passed.map_err(|failed| diverged::<S>(time + after, &failed))?;
            known.inputs = felt.along(&felt_slopes, span);
            // On, even where a passage is shorter than rounding.
            after = if span < duration - after { (after + span).max(after.next_up()) } else { duration };
        }
        match S::left_range(parameters, &inputs.along(&slopes, duration), state) {
            Some(variable) => Err(Error::Diverged { time: time + duration, variable }),
            None => Ok(()),
        }
    }

    /// Outputs `span` seconds from now, to first order.
    fn outputs_near(&self, span: f64) -> S::Outputs {
        let (mut rates, mut memory, coming) = (S::State::ZERO, self.memory.clone(), self.coming(span.abs()));
        S::expect(&mut memory, &coming);
        let (felt, ..) = S::felt(&memory, &coming, 0.0);
        S::rates(&self.parameters, &felt, &self.state, &mut rates);
        let mut state = self.state;
        for (value, rate) in state.as_mut_slice().iter_mut().zip(rates.as_slice()) {
            *value += rate * span;
        }
        let clock = self.clock.later(span);
        S::outputs(&self.parameters, clock, &self.inputs.along(&self.slopes, span), &state, &self.memory)
    }
}

fn diverged<S: System>(start: f64, failed: &integrator::Failed) -> Error {
    let time = start + failed.after;
    match failed.state {
        Some(state) => {
            Error::Diverged { time, variable: S::STATE_NAMES.get(state).copied().unwrap_or("state of an effect") }
        }
        None => Error::TooManySteps { time },
    }
}

/// A simulation without the type of its system; variables go by position in its [`Interface`].
pub trait Model: Send {
    /// What the model looks like from outside.
    fn interface(&self) -> &'static Interface;
    /// Time in s.
    fn time(&self) -> f64;
    /// Starts anew with these parameters, as if just made.
    fn reset(&mut self, parameters: &Parameters);
    /// Sets the clock, for a host that keeps its own; the state stays as it is.
    fn set_time(&mut self, time: f64);
    /// Value of a variable.
    fn get(&self, position: usize) -> f64;
    /// Writes all outputs, in order: cheaper than to get one after the other.
    fn copy_outputs(&self, values: &mut [f64]);
    /// Sets an input or a parameter. The value must have been checked against the declaration.
    fn set(&mut self, position: usize, value: f64);
    /// Sets the derivative of an input, per second, for the next step.
    fn set_slope(&mut self, position: usize, slope: f64);
    /// See [`Simulator::initialize`].
    ///
    /// # Errors
    /// As [`Simulator::initialize`].
    fn initialize(&mut self, time: f64) -> Result<()>;
    /// See [`Simulator::advance`].
    ///
    /// # Errors
    /// As [`Simulator::advance`].
    fn advance(&mut self, duration: f64) -> Result<()>;
    /// Time derivative of an output at the present time, per second.
    fn output_derivative(&self, position: usize) -> f64;
    /// Partial derivative of an output by an input or a parameter, state held; at the start, where `at_start`, the
    /// state follows the initialisation.
    fn partial_derivative(&self, output: usize, known: usize, at_start: bool) -> f64;
    /// Everything that a simulation remembers, as numbers.
    fn save(&self) -> Vec<f64>;
    /// Takes back what [`Model::save`] gave.
    ///
    /// # Errors
    /// [`Error::SavedState`]; nothing has changed then.
    fn restore(&mut self, saved: &[f64]) -> Result<()>;
}

impl<S: Registered> Simulator<S> {
    /// Steps for a central difference around a value: a compromise of truncation and rounding, which is larger where an output
    /// is a difference itself.
    fn difference_step(&self, position: usize) -> f64 {
        let size = self.get(position).abs().max(S::interface().variables[position].declaration.unit.nominal * 0.1);
        size * f64::EPSILON.cbrt()
    }
}

/// A system whose interface is at hand.
pub trait Registered: System {
    /// The interface, made at the first call.
    fn interface() -> &'static Interface;
}

impl<S: Registered> Model for Simulator<S> {
    fn interface(&self) -> &'static Interface {
        S::interface()
    }

    fn time(&self) -> f64 {
        self.time()
    }

    fn reset(&mut self, parameters: &Parameters) {
        *self = Self::new(*parameters);
    }

    fn set_time(&mut self, time: f64) {
        if time != self.clock.time {
            self.memory.shift(time - self.clock.time);
        }
        self.clock.time = time;
    }

    fn copy_outputs(&self, values: &mut [f64]) {
        let outputs = self.outputs();
        values.iter_mut().enumerate().for_each(|(position, value)| *value = outputs.get(position));
    }

    fn get(&self, position: usize) -> f64 {
        let interface = S::interface();
        if position < interface.inputs {
            return self.inputs.get(position);
        }
        if position < interface.inputs + interface.outputs {
            return self.outputs().get(position - interface.inputs);
        }
        let name = interface.variables[position].declaration.name;
        self.parameters.find(name).map_or(0.0, |(_, value)| value)
    }

    fn set(&mut self, position: usize, value: f64) {
        let interface = S::interface();
        if position < interface.inputs {
            return self.inputs.set(position, value);
        }
        let name = interface.variables[position].declaration.name;
        self.parameters.visit_mut(&mut |variable, old| if variable.name == name { value } else { old });
    }

    fn set_slope(&mut self, position: usize, slope: f64) {
        self.slopes.set(position, slope);
    }

    fn initialize(&mut self, time: f64) -> Result<()> {
        self.initialize(time)
    }

    fn advance(&mut self, duration: f64) -> Result<()> {
        self.advance(duration)
    }

    fn output_derivative(&self, position: usize) -> f64 {
        if S::is_held(&self.parameters, S::interface().variables[position].name) {
            return 0.0;
        }
        let output = position - S::interface().inputs;
        if let Some(rates) = S::output_rates(&self.parameters, self.clock.time) {
            return rates.get(output);
        }
        let span = 1e-5;
        let (after, before) = (self.outputs_near(span), self.outputs_near(-span));
        (after.get(output) - before.get(output)) / (2.0 * span)
    }

    fn partial_derivative(&self, output: usize, known: usize, at_start: bool) -> f64 {
        let (here, step) = (self.get(known), self.difference_step(known));
        let value_at = |known_value: f64| {
            let mut other = self.clone();
            other.set(known, known_value);
            if at_start && other.initialize(self.clock.time).is_err() {
                return f64::NAN;
            }
            other.get(output)
        };
        (value_at(here + step) - value_at(here - step)) / (2.0 * step)
    }

    fn save(&self) -> Vec<f64> {
        let mut saved = vec![self.clock.time, self.clock.start, self.step];
        saved.extend_from_slice(self.state.as_slice());
        for signals in [&self.inputs, &self.slopes] {
            signals.visit(&mut |_, value| saved.push(value));
        }
        self.parameters.visit(&mut |_, value| saved.push(value));
        self.memory.save(&mut saved);
        saved
    }

    fn restore(&mut self, saved: &[f64]) -> Result<()> {
        let wrong = |problem| Error::SavedState { problem };
        let foreign = || wrong("it is of another model or version");
        let mut restored = Self::new(self.parameters);
        // All but the memory has a fixed length.
        let mut memory_of_none = Vec::new();
        restored.memory.save(&mut memory_of_none);
        let fixed = restored.save().len() - memory_of_none.len();
        let (saved, memory) = saved.split_at_checked(fixed).ok_or_else(foreign)?;
        if saved.iter().chain(memory).any(|value| !value.is_finite()) || saved[2] <= 0.0 {
            return Err(wrong("it holds values that no simulation has"));
        }
        restored.memory = S::Memory::load(memory).ok_or_else(foreign)?;
        let mut rest = saved.iter().copied();
        let mut take = || rest.next().unwrap_or_default();
        restored.clock = Clock { time: take(), start: take() };
        restored.step = take();
        restored.state.as_mut_slice().iter_mut().for_each(|value| *value = take());
        for signals in [&mut restored.inputs, &mut restored.slopes] {
            signals.visit_mut(&mut |_, _| take());
        }
        let mut allowed = true;
        restored.parameters.visit_mut(&mut |variable, old| {
            let value = take();
            allowed &= variable.check(value).is_ok();
            if allowed { value } else { old }
        });
        if !allowed {
            return Err(wrong("it holds a parameter out of range"));
        }
        *self = restored;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A load on a spring, and effects of which the third and the last drive it and the others rest.
    fn rates(_: f64, all: &Extended<2, 14>, rates: &mut Extended<2, 14>) {
        let state = &all.0;
        (rates.0[0], rates.0[1]) = (state[1], -40.0 * (state[0] - state[4] - state[13]));
        (rates.0[4], rates.0[13]) = (-3.0 * state[4], 0.5 * (state[0] - state[13]));
    }

    #[test]
    fn states_that_rest_make_no_difference_whether_they_are_integrated_or_not() {
        let driving = 1 << 2 | 1 << 11;
        let with_others = driving | 0b11_1110_1000;
        assert_eq!([driving, with_others].map(|moves: u64| 2 + moves.count_ones() as usize), [4, FEW - 2]);
        [driving, with_others].into_iter().for_each(make_no_difference);
    }

    fn make_no_difference(moves: u64) {
        let start = Extended(std::array::from_fn(|k| 1.0 / (k + 1) as f64));
        let (mut all, mut moving) = (start, start);
        let (mut step_of_all, mut step_of_moving) = (1e-3, 1e-3);
        let nothing = Now { is_known: false, rates: Extended::ZERO };
        let (mut now_of_all, mut now_of_moving) = (nothing, nothing);
        let mut instants = [Vec::new(), Vec::new()];
        let accuracy = Accuracy { tolerance: 1e-8, ..Accuracy::USUAL };
        for _ in 0..20 {
            let scale = Extended([1.0; 14]);
            let [of_all, of_moving] = &mut instants;
            let see = |seen: &mut Vec<[f64; 14]>, t1: f64, within: &dyn Fn(f64) -> Extended<2, 14>| {
                seen.push(within(0.5 * t1).0);
            };
            let witness = |[_, t1]: [f64; 2], _: &dyn Fn() -> _, within: &dyn Fn(f64) -> _| see(of_all, t1, within);
            all.advance(u64::MAX >> 2, rates, witness, &scale, accuracy, &mut step_of_all, &mut now_of_all, 0.1)
                .unwrap();
            let witness = |[_, t1]: [f64; 2], _: &dyn Fn() -> _, within: &dyn Fn(f64) -> _| see(of_moving, t1, within);
            moving
                .advance(moves, rates, witness, &scale, accuracy, &mut step_of_moving, &mut now_of_moving, 0.1)
                .unwrap();
        }
        assert_eq!((all, step_of_all, now_of_all, &instants[0]), (moving, step_of_moving, now_of_moving, &instants[1]));
        assert!(all.0[13] != start.0[13] && all.0[12] == start.0[12] && !instants[0].is_empty());
    }
}
