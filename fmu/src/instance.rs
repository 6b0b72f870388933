//! One instance of an FMU: a model, and the order in which a host may use it.

use crate::log::{Log, Status};
use crate::refusal::{DataType, Refusal};
use crate::resources;
use crate::snapshot::Snapshot;
use sinew::model::{Interface, Model, ModelVariable};
use sinew::model_description;
use sinew::models::models;
use sinew::parameters::Parameters;
use sinew::variables::{Kind, Role};
use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;

/// Result of a call.
pub type Outcome = Result<(), Refusal>;

/// Where an instance is in the order of calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Just made, or reset.
    Instantiated = 1,
    /// Between entering and exiting the initialization mode.
    InitializationMode = 2,
    /// Ready for a step.
    StepComplete = 3,
    /// A step could not be done.
    StepFailed = 4,
    /// The host has ended the simulation.
    Terminated = 5,
    /// After a defect of the library.
    Fatal = 6,
}

impl Phase {
    /// The phases in which an instance can be saved.
    pub const SAVED: [Self; 5] =
        [Self::Instantiated, Self::InitializationMode, Self::StepComplete, Self::StepFailed, Self::Terminated];
}

impl fmt::Display for Phase {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Instantiated => "not initialized",
            Self::InitializationMode => "in initialization mode",
            Self::StepComplete => "ready for a step",
            Self::StepFailed => "stopped by a failed step",
            Self::Terminated => "terminated",
            Self::Fatal => "unusable after an internal error",
        })
    }
}

/// How far the host's clock may be off, relative to the time or the step, whichever is longer.
const CLOCK_TOLERANCE: f64 = 1e-9;

/// GUIDs of [`models`], in their order.
static GUIDS: LazyLock<Vec<String>> =
    LazyLock::new(|| models().iter().map(|model| model_description::guid(model.interface())).collect());

/// A fresh model with its GUID.
fn model_with_guid(guid: &str) -> Option<(&'static str, Box<dyn Model>)> {
    GUIDS.iter().map(String::as_str).zip(models()).find(|(known, _)| *known == guid)
}

/// Runs a piece of work of which a panic is a [`Refusal`].
///
/// # Errors
/// Those of the work, and [`Refusal::Panicked`].
pub fn guarded<T>(work: impl FnOnce() -> Result<T, Refusal>) -> Result<T, Refusal> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(Refusal::Panicked { message: message_of(&*panic) }))
}

fn message_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic without a message").to_owned()
}

/// What an instance is made of: found by GUID, with start values from the resources of the FMU.
pub struct Start {
    guid: &'static str,
    model: Box<dyn Model>,
    parameters: Parameters,
}

impl Start {
    /// Finds the model and reads its start values.
    ///
    /// # Errors
    /// [`Refusal::UnknownGuid`]; those of [`resources::start_parameters`].
    pub fn find(guid: &str, resource_location: &str) -> Result<Self, Refusal> {
        let unknown = || Refusal::UnknownGuid { guid: guid.to_owned() };
        let (guid, model) = model_with_guid(guid).ok_or_else(unknown)?;
        Ok(Self { guid, model, parameters: resources::start_parameters(resource_location)? })
    }
}

/// One instance of an FMU.
pub struct Instance {
    guid: &'static str,
    model: Box<dyn Model>,
    interface: &'static Interface,
    start_parameters: Parameters,
    log: Log,
    phase: Phase,
    /// Infinite where the host has set none.
    stop_time: f64,
    outputs: Vec<f64>,
    /// Whether `outputs` are those of the model as it is now; in initialization mode, also whether its state is.
    is_current: bool,
}

impl Instance {
    /// An instance that is yet to be initialised.
    pub fn new(start: Start, log: Log) -> Self {
        let Start { guid, mut model, parameters } = start;
        model.reset(&parameters);
        let interface = model.interface();
        Self {
            guid,
            model,
            interface,
            start_parameters: parameters,
            log,
            phase: Phase::Instantiated,
            stop_time: f64::INFINITY,
            outputs: vec![0.0; interface.outputs],
            is_current: false,
        }
    }

    /// Does a call if the phase allows it, tells the log how it went, and returns the status for the host.
    pub fn call(&mut self, function: &str, allowed: &[Phase], work: impl FnOnce(&mut Self) -> Outcome) -> Status {
        let before = self.phase;
        let outcome = match allowed.contains(&before) {
            true => guarded(|| work(self)),
            false => Err(Refusal::WrongPhase { phase: before }),
        };
        let status = match outcome {
            Ok(()) => Status::Ok,
            Err(refusal) => self.report(function, &refusal),
        };
        if self.phase != before {
            self.log.write(Status::Ok, || format!("{function}: the instance is now {}", self.phase));
        }
        status
    }

    #[cold]
    fn report(&mut self, function: &str, refusal: &Refusal) -> Status {
        let status = refusal.status();
        if status == Status::Fatal {
            self.phase = Phase::Fatal;
        }
        self.log.write(status, || format!("{function}: {refusal}"));
        status
    }

    /// See [`Log::enable`].
    ///
    /// # Errors
    /// As [`Log::enable`].
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Outcome {
        self.log.enable(on, categories)
    }

    /// Sets where the simulation starts and, if that is known, ends, in s.
    ///
    /// # Errors
    /// [`Refusal::Argument`] for times that are not finite or in the wrong order, or a tolerance that is negative. Else
    /// the tolerance is ignored: the model has its own, far below what anyone asks for.
    pub fn setup_experiment(&mut self, tolerance: Option<f64>, start_time: f64, stop_time: Option<f64>) -> Outcome {
        let check = |argument, value: f64, least| match value.is_finite() && value >= least {
            true => Ok(()),
            false => Err(Refusal::Argument { argument, value }),
        };
        check("startTime", start_time, f64::NEG_INFINITY)?;
        tolerance.map_or(Ok(()), |tolerance| check("tolerance", tolerance, 0.0))?;
        stop_time.map_or(Ok(()), |stop_time| check("stopTime", stop_time, start_time))?;
        self.model.set_time(start_time);
        self.stop_time = stop_time.unwrap_or(f64::INFINITY);
        Ok(())
    }

    /// The model itself is initialised when something is first read, or at the exit: until then its parameters may be
    /// such that it has no start.
    pub fn enter_initialization_mode(&mut self) {
        self.phase = Phase::InitializationMode;
    }

    /// Ends the initialization.
    ///
    /// # Errors
    /// Those of [`Model::initialize`]; parameters and inputs can then be set to other values.
    pub fn exit_initialization_mode(&mut self) -> Outcome {
        self.refresh()?;
        self.phase = Phase::StepComplete;
        Ok(())
    }

    /// Ends the simulation.
    pub fn terminate(&mut self) {
        self.phase = Phase::Terminated;
    }

    /// Back to how it was when it was made.
    pub fn reset(&mut self) {
        self.model.reset(&self.start_parameters);
        self.phase = Phase::Instantiated;
        self.stop_time = f64::INFINITY;
        self.is_current = false;
    }

    /// Makes `outputs` current.
    fn refresh(&mut self) -> Outcome {
        if self.is_current {
            return Ok(());
        }
        if self.phase == Phase::InitializationMode {
            self.model.initialize(self.model.time())?;
        }
        self.model.copy_outputs(&mut self.outputs);
        self.is_current = true;
        Ok(())
    }

    /// The variable with a value reference, if it is of the type of the call.
    fn variable(&self, value_reference: u32, asked: DataType) -> Result<&'static ModelVariable, Refusal> {
        let Some(variable) = self.interface.variables.get(value_reference as usize) else {
            return Err(Refusal::UnknownVariable { value_reference });
        };
        let is = match variable.declaration.kind {
            Kind::Real => DataType::Real,
            Kind::Enumeration(..) => DataType::Integer,
        };
        if is == asked { Ok(variable) } else { Err(Refusal::WrongType { variable: variable.name, is, asked }) }
    }

    /// The real variable with a value reference, if its role is fit for the call.
    fn real_variable(
        &self,
        value_reference: u32,
        is_fit: impl Fn(Role) -> bool,
        needed: &'static str,
    ) -> Result<&'static ModelVariable, Refusal> {
        let variable = self.variable(value_reference, DataType::Real)?;
        let fit = is_fit(variable.declaration.role);
        if fit { Ok(variable) } else { Err(Refusal::WrongCausality { variable: variable.name, needed }) }
    }

    fn input(&self, value_reference: u32) -> Result<&'static ModelVariable, Refusal> {
        self.real_variable(value_reference, |role| role == Role::Input, "an input")
    }

    fn output(&self, value_reference: u32) -> Result<&'static ModelVariable, Refusal> {
        self.real_variable(value_reference, |role| role == Role::Output, "an output")
    }

    /// Reads real variables.
    ///
    /// # Errors
    /// [`Refusal::UnknownVariable`], [`Refusal::WrongType`]; those of [`Model::initialize`] in initialization mode.
    pub fn get_real(&mut self, value_references: &[u32], values: &mut [f64]) -> Outcome {
        let first_output = self.interface.inputs as u32;
        for (&reference, value) in value_references.iter().zip(values) {
            // Outputs, all real, are what hosts read at every step: the short way for them.
            let output = reference.wrapping_sub(first_output) as usize;
            *value = if output < self.outputs.len() {
                self.refresh()?;
                self.outputs[output]
            } else {
                self.variable(reference, DataType::Real)?;
                self.model.get(reference as usize)
            };
        }
        Ok(())
    }

    /// Reads enumerations.
    ///
    /// # Errors
    /// [`Refusal::UnknownVariable`], [`Refusal::WrongType`].
    pub fn get_integer(&self, value_references: &[u32], values: &mut [i32]) -> Outcome {
        for (&reference, value) in value_references.iter().zip(values) {
            self.variable(reference, DataType::Integer)?;
            *value = self.model.get(reference as usize) as i32;
        }
        Ok(())
    }

    /// Gets or sets variables of a type that no model has.
    ///
    /// # Errors
    /// [`Refusal::UnknownVariable`], [`Refusal::WrongType`] unless there are no value references.
    pub fn access_none(&self, value_references: &[u32], asked: DataType) -> Outcome {
        value_references.iter().try_for_each(|&reference| self.variable(reference, asked).map(|_| ()))
    }

    /// Sets real inputs and parameters: all or, on an error, none.
    ///
    /// # Errors
    /// [`Refusal::UnknownVariable`], [`Refusal::WrongType`], [`Refusal::WrongCausality`] for an output,
    /// [`Refusal::Fixed`] for a parameter that is set too late, [`sinew::Error::OutOfRange`].
    pub fn set_real(&mut self, value_references: &[u32], values: &[f64]) -> Outcome {
        self.set(value_references, values.iter().copied(), DataType::Real)
    }

    /// Sets enumerations: all or, on an error, none.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_integer(&mut self, value_references: &[u32], values: &[i32]) -> Outcome {
        self.set(value_references, values.iter().copied().map(f64::from), DataType::Integer)
    }

    fn set(&mut self, references: &[u32], values: impl Iterator<Item = f64> + Clone, asked: DataType) -> Outcome {
        let assignments = references.iter().copied().zip(values);
        for (reference, value) in assignments.clone() {
            let ModelVariable { name: variable, declaration, .. } = *self.variable(reference, asked)?;
            if declaration.role == Role::Output {
                return Err(Refusal::WrongCausality { variable, needed: "an input or a parameter" });
            }
            let may_change = declaration.role == Role::Input || declaration.is_tunable();
            if self.phase == Phase::StepComplete && !may_change {
                return Err(Refusal::Fixed { variable });
            }
            declaration.check(value)?;
        }
        assignments.for_each(|(reference, value)| self.model.set(reference as usize, value));
        self.is_current = false;
        Ok(())
    }

    /// Sets the time derivatives of inputs for the next step: all or, on an error, none.
    ///
    /// # Errors
    /// Refusals for a variable that is no real input, an order other than 1, a value that is not finite.
    pub fn set_input_derivatives(&mut self, value_references: &[u32], orders: &[i32], values: &[f64]) -> Outcome {
        for ((&reference, &order), &value) in value_references.iter().zip(orders).zip(values) {
            let variable = self.input(reference)?.name;
            check_order(variable, order)?;
            check_derivative(variable, value)?;
        }
        for (&reference, &value) in value_references.iter().zip(values) {
            self.model.set_slope(reference as usize, value);
        }
        Ok(())
    }

    /// Reads the time derivatives of outputs.
    ///
    /// # Errors
    /// Refusals for a variable that is no output, an order other than 1, a derivative that does not exist.
    pub fn get_output_derivatives(&self, value_references: &[u32], orders: &[i32], values: &mut [f64]) -> Outcome {
        for ((&reference, &order), value) in value_references.iter().zip(orders).zip(values) {
            let variable = self.output(reference)?.name;
            check_order(variable, order)?;
            *value = self.model.output_derivative(reference as usize);
            check_derivative(variable, *value)?;
        }
        Ok(())
    }

    /// Change of the outputs `unknowns` for a small change of the inputs or parameters `knowns`; the state of the model
    /// stays, or in initialization mode follows.
    ///
    /// # Errors
    /// Refusals for variables of another causality, those of [`Model::initialize`], a derivative that does not exist.
    pub fn get_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        known_changes: &[f64],
        unknown_changes: &mut [f64],
    ) -> Outcome {
        self.refresh()?;
        let is_known = |role: Role| role == Role::Input || role.is_parameter();
        for &known in knowns {
            self.real_variable(known, is_known, "an input or a parameter")?;
        }
        let at_start = self.phase == Phase::InitializationMode;
        for (&unknown, change) in unknowns.iter().zip(unknown_changes) {
            let variable = self.output(unknown)?.name;
            let partial = |known: u32| self.model.partial_derivative(unknown as usize, known as usize, at_start);
            *change = knowns.iter().zip(known_changes).map(|(&known, change)| partial(known) * change).sum();
            check_derivative(variable, *change)?;
        }
        Ok(())
    }

    /// Simulates from a communication point over a step, both in s.
    ///
    /// # Errors
    /// [`Refusal::StepFailed`] when the simulation diverged: the instance is then as before the step, but can only be
    /// read, restored, reset or terminated. Others for a step that does not start where the instance is, or ends nowhere
    /// or beyond the stop time.
    pub fn do_step(&mut self, from: f64, step: f64) -> Outcome {
        self.check_step(from, step)?;
        // The host's clock is taken over, so that rounding cannot add up to a difference between the two.
        self.model.set_time(from);
        self.is_current = false;
        self.model.advance(step).map_err(|error| {
            self.phase = Phase::StepFailed;
            Refusal::StepFailed(error)
        })
    }

    fn check_step(&self, from: f64, step: f64) -> Outcome {
        let (time, stop_time, end) = (self.model.time(), self.stop_time, from + step);
        if !(step > 0.0 && step.is_finite()) {
            return Err(Refusal::StepSize { step });
        }
        let tolerance = CLOCK_TOLERANCE * step.max(time.abs());
        let agrees = (from - time).abs() <= tolerance; // false for NaN
        if !agrees {
            return Err(Refusal::CommunicationPoint { from, time });
        }
        if end > stop_time + tolerance {
            return Err(Refusal::BeyondStopTime { end, stop_time });
        }
        Ok(())
    }

    /// Time up to which the simulation has come, in s.
    pub fn last_successful_time(&self) -> f64 {
        self.model.time()
    }

    /// How the last step ended.
    pub fn last_step_status(&self) -> Status {
        if self.phase == Phase::StepFailed { Status::Discard } else { Status::Ok }
    }

    /// Everything that is needed to continue from here.
    pub fn save(&self) -> Snapshot {
        Snapshot { guid: self.guid, phase: self.phase, stop_time: self.stop_time, values: self.model.save() }
    }

    /// Continues from a saved state.
    ///
    /// # Errors
    /// [`sinew::Error::SavedState`] for the state of another model; nothing has changed then.
    pub fn restore(&mut self, saved: &Snapshot) -> Outcome {
        if saved.guid != self.guid {
            return Err(sinew::Error::SavedState { problem: "it is of another model" }.into());
        }
        self.model.restore(&saved.values)?;
        self.phase = saved.phase;
        self.stop_time = saved.stop_time;
        self.is_current = false;
        Ok(())
    }

    /// Reads a saved state from the bytes of [`Snapshot::to_bytes`].
    ///
    /// # Errors
    /// [`sinew::Error::SavedState`] for anything that [`Instance::restore`] would not take either.
    pub fn snapshot_from_bytes(&self, bytes: &[u8]) -> Result<Snapshot, Refusal> {
        let saved = Snapshot::from_bytes(bytes, self.guid)?;
        let trial = model_with_guid(self.guid);
        trial.map_or(Ok(()), |(_, mut model)| model.restore(&saved.values))?;
        Ok(saved)
    }
}

fn check_order(variable: &'static str, order: i32) -> Outcome {
    if order == 1 { Ok(()) } else { Err(Refusal::DerivativeOrder { variable, order }) }
}

fn check_derivative(variable: &'static str, value: f64) -> Outcome {
    if value.is_finite() { Ok(()) } else { Err(Refusal::Derivative { variable, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::rc::Rc;

    #[test]
    fn a_panic_ends_the_instance_but_not_the_host() {
        let told = Rc::new(RefCell::new(Vec::new()));
        let listener = Rc::clone(&told);
        let logger = Box::new(move |status, _: &str, text: &str| listener.borrow_mut().push((status, text.to_owned())));
        let mut model = models().remove(0);
        let guid = GUIDS[0].as_str();
        let parameters = Parameters::default();
        model.reset(&parameters);
        let mut instance = Instance::new(Start { guid, model, parameters }, Log::new(logger, false));
        let status = instance.call("fmi2Test", &Phase::SAVED, |_| panic!("at the disco"));
        assert_eq!(status, Status::Fatal);
        let expected = "fmi2Test: internal error: at the disco; the instance can only be freed";
        assert_eq!(told.take(), [(Status::Fatal, expected.to_owned())]);
        assert_eq!(instance.call("fmi2Reset", &Phase::SAVED, |_| Ok(())), Status::Error);
    }
}
