//! From equations to something that can be stepped, saved and asked by name: what an FMU needs of a model.
//!
//! A [`System`] is the equations; a [`Simulator`] integrates them; [`Model`] is the simulator without its type.

use crate::effects::{Description, Effects};
use crate::integrator;
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

/// State of a system: an array of reals.
pub trait State: Copy + Send {
    /// All zero.
    const ZERO: Self;
    /// As a slice.
    fn as_slice(&self) -> &[f64];
    /// As a slice that can be changed.
    fn as_mut_slice(&mut self) -> &mut [f64];
    /// See [`integrator::advance`].
    ///
    /// # Errors
    /// As [`integrator::advance`].
    fn advance(
        &mut self,
        rates: impl Fn(f64, &Self, &mut Self),
        scale: &Self,
        step: &mut f64,
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
        rates: impl Fn(f64, &Self, &mut Self),
        scale: &Self,
        step: &mut f64,
        duration: f64,
    ) -> std::result::Result<(), integrator::Failed> {
        if N == 0 {
            return Ok(());
        }
        integrator::advance(rates, scale, self, step, duration)
    }
}

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
    type Inputs: Signals;
    /// Outputs.
    type Outputs: Signals;
    /// State.
    type State: State;
    /// Usual size of each state.
    const SCALE: Self::State;

    /// State at the start.
    ///
    /// # Errors
    /// Where the parameters allow no start.
    fn initial_state(parameters: &Parameters, inputs: &Self::Inputs) -> Result<Self::State>;
    /// Derivatives of the state, per second.
    fn rates(parameters: &Parameters, inputs: &Self::Inputs, state: &Self::State, rates: &mut Self::State);
    /// Outputs at a time in s.
    fn outputs(parameters: &Parameters, time: f64, inputs: &Self::Inputs, state: &Self::State) -> Self::Outputs;
    /// Name of a state that has left the range in which the model means anything.
    fn left_range(parameters: &Parameters, state: &Self::State) -> Option<&'static str>;
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

/// A system in the course of a simulation.
#[derive(Debug, Clone)]
pub struct Simulator<S: System> {
    /// Parameters; a change counts from the next step.
    pub parameters: Parameters,
    /// Inputs at the present time.
    pub inputs: S::Inputs,
    /// Derivatives of the inputs, per second; they hold for one step.
    pub slopes: S::Inputs,
    time: f64,
    state: S::State,
    step: f64,
}

/// Step that an integration tries first, s.
const FIRST_STEP: f64 = 1e-3;

impl<S: System> Simulator<S> {
    /// A simulation that is yet to be initialised.
    pub fn new(parameters: Parameters) -> Self {
        let (inputs, slopes) = (S::Inputs::default(), S::Inputs::default());
        Self { parameters, inputs, slopes, time: 0.0, state: S::State::ZERO, step: FIRST_STEP }
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// State, in the order of [`System::STATE_NAMES`].
    pub fn state(&self) -> &S::State {
        &self.state
    }

    /// Puts the system at its start.
    ///
    /// # Errors
    /// As [`System::initial_state`], and [`Error::Diverged`] for a start out of range; nothing has changed then.
    pub fn initialize(&mut self, time: f64) -> Result<()> {
        let state = S::initial_state(&self.parameters, &self.inputs)?;
        if let Some(variable) = S::left_range(&self.parameters, &state) {
            return Err(Error::Diverged { time, variable });
        }
        self.state = state;
        self.time = time;
        self.step = FIRST_STEP;
        Ok(())
    }

    /// Outputs at the present time.
    pub fn outputs(&self) -> S::Outputs {
        S::outputs(&self.parameters, self.time, &self.inputs, &self.state)
    }

    /// Advances by a duration in s; the inputs move along their slopes, which are then zero.
    ///
    /// # Errors
    /// [`Error::Diverged`], [`Error::TooManySteps`]; nothing has changed then.
    pub fn advance(&mut self, duration: f64) -> Result<()> {
        let (mut state, mut step) = (self.state, self.step);
        let (parameters, inputs, slopes) = (&self.parameters, &self.inputs, &self.slopes);
        let rates = |after: f64, state: &S::State, rates: &mut S::State| {
            S::rates(parameters, &inputs.along(slopes, after), state, rates);
        };
        state.advance(rates, &S::SCALE, &mut step, duration).map_err(|failed| {
            let time = self.time + failed.after;
            match failed.state {
                Some(state) => {
                    let variable = S::STATE_NAMES.get(state).copied().unwrap_or("state of an effect");
                    Error::Diverged { time, variable }
                }
                None => Error::TooManySteps { time },
            }
        })?;
        if let Some(variable) = S::left_range(parameters, &state) {
            return Err(Error::Diverged { time: self.time + duration, variable });
        }
        self.inputs = inputs.along(slopes, duration);
        self.slopes = S::Inputs::default();
        (self.state, self.step) = (state, step);
        self.time += duration;
        Ok(())
    }

    /// Outputs `span` seconds from now, to first order.
    fn outputs_near(&self, span: f64) -> S::Outputs {
        let mut rates = S::State::ZERO;
        S::rates(&self.parameters, &self.inputs, &self.state, &mut rates);
        let mut state = self.state;
        for (value, rate) in state.as_mut_slice().iter_mut().zip(rates.as_slice()) {
            *value += rate * span;
        }
        S::outputs(&self.parameters, self.time + span, &self.inputs.along(&self.slopes, span), &state)
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
    /// Steps for a central difference around a value: a compromise of truncation and rounding.
    fn difference_step(&self, position: usize) -> f64 {
        let size = self.get(position).abs().max(S::interface().variables[position].declaration.unit.nominal * 1e-3);
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
        self.time
    }

    fn reset(&mut self, parameters: &Parameters) {
        *self = Self::new(*parameters);
    }

    fn set_time(&mut self, time: f64) {
        self.time = time;
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
        let span = 1e-5;
        let (after, before) = (self.outputs_near(span), self.outputs_near(-span));
        let output = position - S::interface().inputs;
        (after.get(output) - before.get(output)) / (2.0 * span)
    }

    fn partial_derivative(&self, output: usize, known: usize, at_start: bool) -> f64 {
        let (here, step) = (self.get(known), self.difference_step(known));
        let value_at = |known_value: f64| {
            let mut other = self.clone();
            other.set(known, known_value);
            if at_start && other.initialize(self.time).is_err() {
                return f64::NAN;
            }
            other.get(output)
        };
        (value_at(here + step) - value_at(here - step)) / (2.0 * step)
    }

    fn save(&self) -> Vec<f64> {
        let mut saved = vec![self.time, self.step];
        saved.extend_from_slice(self.state.as_slice());
        for signals in [&self.inputs, &self.slopes] {
            signals.visit(&mut |_, value| saved.push(value));
        }
        self.parameters.visit(&mut |_, value| saved.push(value));
        saved
    }

    fn restore(&mut self, saved: &[f64]) -> Result<()> {
        let wrong = |problem| Error::SavedState { problem };
        if saved.len() != self.save().len() {
            return Err(wrong("it is of another model or version"));
        }
        if saved.iter().any(|value| !value.is_finite()) || saved[1] <= 0.0 {
            return Err(wrong("it holds values that no simulation has"));
        }
        let mut restored = self.clone();
        let mut rest = saved.iter().copied();
        let mut take = || rest.next().unwrap_or_default();
        (restored.time, restored.step) = (take(), take());
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
