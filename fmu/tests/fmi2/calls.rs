//! Calls in any order with any arguments, which no instance may mind.

use crate::host::{Api, Fmu, call};
use proptest::collection::vec;
use proptest::prelude::*;
use sinew::parameters::Parameters;
use sinew_fmu::fmi2::fmi2FMUstate;
use sinew_fmu::log::Status;
use std::ffi::CString;
use std::ptr;

/// How many saved states a host keeps.
const SLOTS: usize = 3;

/// One call. References are taken as they are; a missing value is a null pointer.
#[derive(Debug, Clone)]
pub enum Call {
    SetDebugLogging(bool, Option<String>),
    SetupExperiment(bool, f64, f64, bool, f64),
    EnterInitializationMode,
    ExitInitializationMode,
    Terminate,
    Reset,
    GetReal(Option<Vec<u32>>),
    GetInteger(Option<Vec<u32>>),
    GetBoolean(Option<Vec<u32>>),
    GetString(Option<Vec<u32>>),
    SetReal(Vec<(u32, f64)>),
    SetRealNull(u32),
    SetInteger(u32, i32),
    SetBoolean(u32),
    SetString(u32),
    GetState(usize),
    SetState(usize),
    FreeState(usize),
    Serialize(usize, usize),
    SerializeIntoNothing(usize),
    DeserializeDamaged(usize, usize, i8),
    DirectionalDerivative(Vec<u32>, Vec<u32>, f64),
    SetInputDerivatives(Vec<u32>, i32, f64),
    GetOutputDerivatives(Vec<u32>, i32),
    /// Step from where the instance is.
    Step(f64),
    StepFrom(f64, f64),
    CancelStep,
    AskStatus(i32),
}

fn real() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -10.0..10.0,
        2 => prop::sample::select(vec![0.0, 1.0, 2e5, -1e9, 1e300, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE]),
    ]
}

/// Mostly variables, enough of them inputs and outputs; some beyond the last.
fn reference() -> impl Strategy<Value = u32> {
    prop_oneof![5 => 0..12_u32, 5 => 0..60_u32, 1 => any::<u32>()]
}

fn references() -> impl Strategy<Value = Vec<u32>> {
    vec(reference(), 0..5)
}

/// A call with anything in it.
pub fn any_call() -> impl Strategy<Value = Call> {
    let category = prop::option::of(prop::sample::select(vec!["logEvents".to_owned(), "%s%n".to_owned()]));
    let (maybe, slot) = (|| prop::option::of(references()), || 0..SLOTS);
    let rare = prop_oneof![
        (any::<bool>(), category).prop_map(|(on, name)| Call::SetDebugLogging(on, name)),
        Just(Call::Terminate),
        Just(Call::Reset),
        Just(Call::CancelStep),
        maybe().prop_map(Call::GetInteger),
        maybe().prop_map(Call::GetBoolean),
        maybe().prop_map(Call::GetString),
        reference().prop_map(Call::SetRealNull),
        (reference(), any::<i32>()).prop_map(|(reference, value)| Call::SetInteger(reference, value)),
        reference().prop_map(Call::SetBoolean),
        reference().prop_map(Call::SetString),
        (-2..9).prop_map(Call::AskStatus),
        (real(), real()).prop_map(|(from, step)| Call::StepFrom(from, step.min(1.0))),
        (slot(), slot()).prop_map(|(from, to)| Call::Serialize(from, to)),
        slot().prop_map(Call::SerializeIntoNothing),
        (slot(), any::<usize>(), any::<i8>()).prop_map(|(slot, at, flip)| Call::DeserializeDamaged(slot, at, flip)),
        slot().prop_map(Call::FreeState),
    ];
    prop_oneof![
        4 => rare,
        1 => (any::<bool>(), real(), real(), any::<bool>(), real())
            .prop_map(|(with_tolerance, tolerance, start, with_stop, stop)| {
                Call::SetupExperiment(with_tolerance, tolerance, start, with_stop, stop)
            }),
        2 => Just(Call::EnterInitializationMode),
        2 => Just(Call::ExitInitializationMode),
        3 => maybe().prop_map(Call::GetReal),
        3 => vec((reference(), real()), 0..3).prop_map(Call::SetReal),
        1 => slot().prop_map(Call::GetState),
        2 => slot().prop_map(Call::SetState),
        1 => (references(), references(), real()).prop_map(|(of, by, change)| Call::DirectionalDerivative(of, by, change)),
        1 => (references(), 0..3, real()).prop_map(|(of, order, value)| Call::SetInputDerivatives(of, order, value)),
        1 => (references(), 0..3).prop_map(|(of, order)| Call::GetOutputDerivatives(of, order)),
        6 => (1e-6..5e-3).prop_map(Call::Step),
    ]
}

/// An instance with the saved states of its host.
pub struct Host {
    fmu: Fmu,
    states: [fmi2FMUstate; SLOTS],
}

impl Drop for Host {
    fn drop(&mut self) {
        for state in &mut self.states {
            assert_eq!(call!(self.fmu, fmi2FreeFMUstate, state), Status::Ok);
        }
    }
}

fn parts(references: &Option<Vec<u32>>) -> (*const u32, usize) {
    references.as_ref().map_or((ptr::null(), 3), |references| (references.as_ptr(), references.len()))
}

impl Host {
    pub fn new(api: Api, model: &str) -> Self {
        Self { fmu: Fmu::instantiate(api, model, &Parameters::default()), states: [ptr::null_mut(); SLOTS] }
    }

    fn time(&self) -> f64 {
        let mut time = 0.0;
        call!(self.fmu, fmi2GetRealStatus, 2, &mut time);
        time
    }

    fn serialized(&self, slot: usize) -> Vec<i8> {
        let mut size = 0;
        call!(self.fmu, fmi2SerializedFMUstateSize, self.states[slot], &mut size);
        let mut bytes = vec![0; size];
        call!(self.fmu, fmi2SerializeFMUstate, self.states[slot], bytes.as_mut_ptr(), size);
        bytes
    }

    /// Does a call. Whatever the library answers is fine, except that it is broken.
    pub fn apply(&mut self, call: &Call) {
        let status = self.status_of(call);
        assert_ne!(status, Status::Fatal, "{call:?}: {}", self.fmu.last_message());
        self.fmu.messages.take();
    }

    fn status_of(&mut self, call: &Call) -> Status {
        let (fmu, mut reals) = (&self.fmu, [0.0; 8]);
        match call {
            Call::SetDebugLogging(on, category) => {
                let name = category.as_ref().map(|name| CString::new(name.as_str()).unwrap());
                let pointer = name.as_ref().map_or(ptr::null(), |name| name.as_ptr());
                call!(fmu, fmi2SetDebugLogging, i32::from(*on), 1, &pointer)
            }
            Call::SetupExperiment(with_tolerance, tolerance, start, with_stop, stop) => {
                let (with_tolerance, with_stop) = (i32::from(*with_tolerance), i32::from(*with_stop));
                call!(fmu, fmi2SetupExperiment, with_tolerance, *tolerance, *start, with_stop, *stop)
            }
            Call::EnterInitializationMode => call!(fmu, fmi2EnterInitializationMode),
            Call::ExitInitializationMode => call!(fmu, fmi2ExitInitializationMode),
            Call::Terminate => call!(fmu, fmi2Terminate),
            Call::Reset => call!(fmu, fmi2Reset),
            Call::GetReal(references) => {
                let (pointer, length) = parts(references);
                call!(fmu, fmi2GetReal, pointer, length, reals.as_mut_ptr())
            }
            Call::GetInteger(references) => {
                let (pointer, length) = parts(references);
                call!(fmu, fmi2GetInteger, pointer, length, [0; 8].as_mut_ptr())
            }
            Call::GetBoolean(references) => {
                let (pointer, length) = parts(references);
                call!(fmu, fmi2GetBoolean, pointer, length, [0; 8].as_mut_ptr())
            }
            Call::GetString(references) => {
                let (pointer, length) = parts(references);
                call!(fmu, fmi2GetString, pointer, length, [ptr::null(); 8].as_mut_ptr())
            }
            Call::SetReal(values) => {
                let (references, values): (Vec<u32>, Vec<f64>) = values.iter().copied().unzip();
                call!(fmu, fmi2SetReal, references.as_ptr(), references.len(), values.as_ptr())
            }
            Call::SetRealNull(reference) => call!(fmu, fmi2SetReal, reference, 1, ptr::null()),
            Call::SetInteger(reference, value) => call!(fmu, fmi2SetInteger, reference, 1, value),
            Call::SetBoolean(reference) => call!(fmu, fmi2SetBoolean, reference, 1, &1),
            Call::SetString(reference) => call!(fmu, fmi2SetString, reference, 1, &c"text".as_ptr()),
            Call::GetState(slot) => call!(fmu, fmi2GetFMUstate, &mut self.states[*slot]),
            Call::SetState(slot) => call!(fmu, fmi2SetFMUstate, self.states[*slot]),
            Call::FreeState(slot) => call!(fmu, fmi2FreeFMUstate, &mut self.states[*slot]),
            Call::Serialize(from, to) => {
                let bytes = self.serialized(*from);
                call!(fmu, fmi2DeSerializeFMUstate, bytes.as_ptr().cast(), bytes.len(), &mut self.states[*to])
            }
            Call::SerializeIntoNothing(slot) => {
                call!(fmu, fmi2SerializeFMUstate, self.states[*slot], ptr::null_mut(), 100)
            }
            Call::DeserializeDamaged(slot, at, flip) => {
                let mut bytes = self.serialized(*slot);
                let position = at % bytes.len().max(1);
                bytes.iter_mut().skip(position).take(1).for_each(|byte| *byte ^= flip);
                call!(fmu, fmi2DeSerializeFMUstate, bytes.as_ptr().cast(), bytes.len(), &mut self.states[*slot])
            }
            Call::DirectionalDerivative(of, by, change) => {
                let (changes, results) = ([*change; 8], reals.as_mut_ptr());
                let (of, by) = ((of.as_ptr(), of.len()), (by.as_ptr(), by.len()));
                call!(fmu, fmi2GetDirectionalDerivative, of.0, of.1, by.0, by.1, changes.as_ptr(), results)
            }
            Call::SetInputDerivatives(of, order, value) => {
                let (orders, values) = ([*order; 8], [*value; 8]);
                call!(fmu, fmi2SetRealInputDerivatives, of.as_ptr(), of.len(), orders.as_ptr(), values.as_ptr())
            }
            Call::GetOutputDerivatives(of, order) => {
                call!(
                    fmu,
                    fmi2GetRealOutputDerivatives,
                    of.as_ptr(),
                    of.len(),
                    [*order; 8].as_ptr(),
                    reals.as_mut_ptr()
                )
            }
            Call::Step(step) => {
                let from = self.time();
                self.fmu.step(from, *step)
            }
            Call::StepFrom(from, step) => self.fmu.step(*from, *step),
            Call::CancelStep => call!(fmu, fmi2CancelStep),
            Call::AskStatus(kind) => {
                call!(fmu, fmi2GetStatus, *kind, &mut Status::Ok);
                call!(fmu, fmi2GetIntegerStatus, *kind, &mut 0);
                call!(fmu, fmi2GetBooleanStatus, *kind, &mut 0);
                call!(fmu, fmi2GetStringStatus, *kind, ptr::null_mut());
                call!(fmu, fmi2GetRealStatus, *kind, reals.as_mut_ptr())
            }
        }
    }
}
