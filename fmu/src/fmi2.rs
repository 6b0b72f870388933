//! The C interface of FMI 2.0 for co-simulation.
//!
//! Every function checks its pointers and hands over to [`Instance`]; `with_instance` does for all of them what they
//! have in common.
//!
//! # Safety
//! What holds for every function: a component is null or came from [`fmi2Instantiate`] and has not been freed, and is
//! used by one thread at a time; an FMU state is null or came from [`fmi2GetFMUstate`] or [`fmi2DeSerializeFMUstate`]
//! and has not been freed; strings end with a null byte; arrays have the length that is passed with them.
#![allow(non_snake_case, non_camel_case_types)]

use crate::instance::{Instance, Outcome, Phase, Start, guarded};
use crate::log::{Log, Logger, Status};
use crate::refusal::{DataType, Refusal};
use crate::snapshot::Snapshot;
use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::ptr;

/// An instance.
pub type fmi2Component = *mut c_void;
/// A saved state of an instance.
pub type fmi2FMUstate = *mut c_void;
/// Position of a variable in the description of the model.
pub type fmi2ValueReference = c_uint;
/// A real number.
pub type fmi2Real = f64;
/// An integer or an enumeration.
pub type fmi2Integer = c_int;
/// 0 or 1.
pub type fmi2Boolean = c_int;
/// Text that ends with a null byte.
pub type fmi2String = *const c_char;
/// A byte of a serialised state.
pub type fmi2Byte = c_char;
/// Model exchange (0) or co-simulation (1).
pub type fmi2Type = c_int;
/// What to ask about the last step: its status (0), why it is pending (1), the last time that was reached (2), whether
/// the instance wants to end the simulation (3).
pub type fmi2StatusKind = c_int;

const CO_SIMULATION: fmi2Type = 1;
const DO_STEP_STATUS: fmi2StatusKind = 0;
const LAST_SUCCESSFUL_TIME: fmi2StatusKind = 2;
const TERMINATED: fmi2StatusKind = 3;

/// The host's logger: environment, name of the instance, status, category, format, what the format needs.
pub type fmi2CallbackLogger =
    unsafe extern "C" fn(*mut c_void, fmi2String, Status, fmi2String, message: fmi2String, ...);

/// What the host offers. Only the logger is used.
#[repr(C)]
pub struct fmi2CallbackFunctions {
    /// Takes messages.
    pub logger: Option<fmi2CallbackLogger>,
    /// `calloc` of the host.
    pub allocateMemory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// `free` of the host.
    pub freeMemory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// For asynchronous steps.
    pub stepFinished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    /// Passed on to the logger.
    pub componentEnvironment: *mut c_void,
}

/// Phases in which a function may be called, as in the Reference FMUs.
mod allowed {
    use super::Phase::{self, InitializationMode, Instantiated, StepComplete, StepFailed, Terminated};

    pub const ALWAYS: &[Phase] = &Phase::SAVED;
    pub const BEFORE_INITIALIZATION: &[Phase] = &[Instantiated];
    pub const INITIALIZATION: &[Phase] = &[InitializationMode];
    pub const STEP: &[Phase] = &[StepComplete];
    pub const TERMINATE: &[Phase] = &[StepComplete, StepFailed];
    pub const SET: &[Phase] = &[Instantiated, InitializationMode, StepComplete];
    pub const GET: &[Phase] = &[InitializationMode, StepComplete, StepFailed, Terminated];
    pub const AFTER_INITIALIZATION: &[Phase] = &[StepComplete, StepFailed, Terminated];
}

/// Does a call on an instance: null handle, phase, panics, log and status are dealt with here.
///
/// # Safety
/// As the module says of a component.
unsafe fn with_instance(
    component: fmi2Component,
    function: &str,
    allowed: &[Phase],
    work: impl FnOnce(&mut Instance) -> Outcome,
) -> Status {
    // SAFETY: not null, it is the box that fmi2Instantiate gave away, and no other thread uses it now.
    match unsafe { component.cast::<Instance>().as_mut() } {
        Some(instance) => instance.call(function, allowed, work),
        None => Status::Error,
    }
}

/// An array of the host, to be read.
///
/// # Safety
/// `pointer` is null or has `length` elements that stay as they are for as long as the result lives.
unsafe fn array<'a, T>(pointer: *const T, length: usize, argument: &'static str) -> Result<&'a [T], Refusal> {
    check_array(pointer, length, argument)?;
    // SAFETY: not null where there is something to read, and of a length that memory can hold.
    Ok(if length == 0 { &[] } else { unsafe { std::slice::from_raw_parts(pointer, length) } })
}

/// An array of the host, to be written.
///
/// # Safety
/// As [`array`], and nobody else uses it.
unsafe fn array_mut<'a, T>(pointer: *mut T, length: usize, argument: &'static str) -> Result<&'a mut [T], Refusal> {
    check_array(pointer, length, argument)?;
    // SAFETY: not null where there is something to write, and of a length that memory can hold.
    Ok(if length == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(pointer, length) } })
}

fn check_array<T>(pointer: *const T, length: usize, argument: &'static str) -> Outcome {
    match length {
        0 => Ok(()),
        _ if pointer.is_null() => Err(Refusal::NullPointer { argument }),
        _ if length > isize::MAX as usize / size_of::<T>() => Err(Refusal::ArrayLength { argument, length }),
        _ => Ok(()),
    }
}

/// A text of the host.
///
/// # Safety
/// `pointer` is null or a text that lives as long as the result.
unsafe fn text<'a>(pointer: fmi2String, argument: &'static str) -> Result<std::borrow::Cow<'a, str>, Refusal> {
    if pointer.is_null() {
        return Err(Refusal::NullPointer { argument });
    }
    // SAFETY: not null, hence a text.
    Ok(unsafe { CStr::from_ptr(pointer) }.to_string_lossy())
}

/// Where the host wants a result.
///
/// # Safety
/// `pointer` is null or good for one value that nobody else uses.
unsafe fn target<'a, T>(pointer: *mut T, argument: &'static str) -> Result<&'a mut T, Refusal> {
    // SAFETY: as the caller promises.
    unsafe { pointer.as_mut() }.ok_or(Refusal::NullPointer { argument })
}

/// The saved state behind a handle.
///
/// # Safety
/// As the module says of an FMU state.
unsafe fn snapshot<'a>(state: fmi2FMUstate) -> Result<&'a mut Snapshot, Refusal> {
    // SAFETY: not null, it is a box that store gave away.
    unsafe { target(state.cast(), "FMUstate") }
}

/// Puts a saved state behind a handle, which is a new one where it was null.
///
/// # Safety
/// As the module says of an FMU state.
unsafe fn store(saved: Snapshot, state: &mut fmi2FMUstate) {
    // SAFETY: as the caller promises.
    match unsafe { snapshot(*state) } {
        Ok(old) => *old = saved,
        Err(_) => *state = Box::into_raw(Box::new(saved)).cast(),
    }
}

/// The host's logger as a closure.
fn logger(functions: &fmi2CallbackFunctions, instance_name: &str) -> Logger {
    let (function, environment) = (functions.logger, functions.componentEnvironment);
    let name = c_text(instance_name);
    Box::new(move |status, category, text| {
        let (category, text) = (c_text(category), c_text(text));
        if let Some(function) = function {
            // SAFETY: a logger as FMI defines it; "%s" takes one text, so that a % in it means nothing.
            unsafe { function(environment, name.as_ptr(), status, category.as_ptr(), c"%s".as_ptr(), text.as_ptr()) };
        }
    })
}

fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// "default": the types are those of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> fmi2String {
    c"default".as_ptr()
}

/// "2.0".
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> fmi2String {
    c"2.0".as_ptr()
}

/// Makes an instance of the model with this GUID, or returns null and tells the logger why.
///
/// # Safety
/// As the module says; `functions` is null or lives as long as the instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    instanceName: fmi2String,
    fmuType: fmi2Type,
    fmuGUID: fmi2String,
    fmuResourceLocation: fmi2String,
    functions: *const fmi2CallbackFunctions,
    _visible: fmi2Boolean,
    loggingOn: fmi2Boolean,
) -> fmi2Component {
    // SAFETY: as the caller promises.
    let Some(functions) = (unsafe { functions.as_ref() }) else { return ptr::null_mut() };
    // SAFETY: as the caller promises.
    let name = unsafe { text(instanceName, "instanceName") };
    let log = Log::new(logger(functions, name.as_deref().unwrap_or_default()), loggingOn != 0);
    let start = guarded(|| {
        if name?.is_empty() {
            return Err(Refusal::NoInstanceName);
        }
        if fmuType != CO_SIMULATION {
            return Err(Refusal::NotCoSimulation);
        }
        // SAFETY: as the caller promises.
        let (guid, location) =
            unsafe { (text(fmuGUID, "fmuGUID")?, text(fmuResourceLocation, "fmuResourceLocation")?) };
        Start::find(&guid, &location)
    });
    match start {
        Ok(start) => Box::into_raw(Box::new(Instance::new(start, log))).cast(),
        Err(refusal) => {
            log.write(refusal.status(), || format!("fmi2Instantiate: {refusal}"));
            ptr::null_mut()
        }
    }
}

/// Ends an instance. Null is fine.
///
/// # Safety
/// As the module says; the component must not be used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(c: fmi2Component) {
    if !c.is_null() {
        // SAFETY: not null, it is the box that fmi2Instantiate gave away. Dropping it cannot panic: it runs no code but
        // that of the allocator.
        drop(unsafe { Box::from_raw(c.cast::<Instance>()) });
    }
}

/// See [`Log::enable`].
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    c: fmi2Component,
    loggingOn: fmi2Boolean,
    nCategories: usize,
    categories: *const fmi2String,
) -> Status {
    let work = |instance: &mut Instance| {
        // SAFETY: as the caller promises.
        let categories = unsafe { array(categories, nCategories, "categories") }?.iter();
        // SAFETY: as the caller promises.
        let names = categories.map(|&name| unsafe { text(name, "categories") }).collect::<Result<Vec<_>, _>>()?;
        instance.set_debug_logging(loggingOn != 0, &names.iter().map(AsRef::as_ref).collect::<Vec<_>>())
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2SetDebugLogging", allowed::ALWAYS, work) }
}

/// See [`Instance::setup_experiment`].
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    c: fmi2Component,
    toleranceDefined: fmi2Boolean,
    tolerance: fmi2Real,
    startTime: fmi2Real,
    stopTimeDefined: fmi2Boolean,
    stopTime: fmi2Real,
) -> Status {
    let tolerance = (toleranceDefined != 0).then_some(tolerance);
    let stop_time = (stopTimeDefined != 0).then_some(stopTime);
    let work = |instance: &mut Instance| instance.setup_experiment(tolerance, startTime, stop_time);
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2SetupExperiment", allowed::BEFORE_INITIALIZATION, work) }
}

/// Functions without arguments.
macro_rules! plain_functions {
    ($($(#[doc = $doc:literal])* $function:ident, $allowed:ident, $work:expr;)*) => {$(
        $(#[doc = $doc])*
        ///
        /// # Safety
        /// As the module says.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $function(c: fmi2Component) -> Status {
            // SAFETY: as the caller promises.
            unsafe { with_instance(c, stringify!($function), allowed::$allowed, $work) }
        }
    )*};
}

plain_functions! {
    /// See [`Instance::enter_initialization_mode`].
    fmi2EnterInitializationMode, BEFORE_INITIALIZATION, |instance| {
        instance.enter_initialization_mode();
        Ok(())
    };
    /// See [`Instance::exit_initialization_mode`].
    fmi2ExitInitializationMode, INITIALIZATION, Instance::exit_initialization_mode;
    /// See [`Instance::terminate`].
    fmi2Terminate, TERMINATE, |instance| {
        instance.terminate();
        Ok(())
    };
    /// See [`Instance::reset`].
    fmi2Reset, ALWAYS, |instance| {
        instance.reset();
        Ok(())
    };
    /// There is never anything to cancel: a step is done when [`fmi2DoStep`] returns.
    fmi2CancelStep, ALWAYS, |_| Err(Refusal::NoStepInProgress);
}

/// Functions that read variables.
macro_rules! getters {
    ($($(#[doc = $doc:literal])* $function:ident, $Value:ty, $work:expr;)*) => {$(
        $(#[doc = $doc])*
        ///
        /// # Safety
        /// As the module says.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $function(
            c: fmi2Component,
            vr: *const fmi2ValueReference,
            nvr: usize,
            value: *mut $Value,
        ) -> Status {
            let work = |instance: &mut Instance| {
                // SAFETY: as the caller promises.
                let (references, values) = unsafe { (array(vr, nvr, "vr")?, array_mut(value, nvr, "value")?) };
                $work(instance, references, values)
            };
            // SAFETY: as the caller promises.
            unsafe { with_instance(c, stringify!($function), allowed::GET, work) }
        }
    )*};
}

getters! {
    /// See [`Instance::get_real`].
    fmi2GetReal, fmi2Real, Instance::get_real;
    /// See [`Instance::get_integer`].
    fmi2GetInteger, fmi2Integer, |instance: &mut Instance, vr, values| instance.get_integer(vr, values);
    /// No model has such variables.
    fmi2GetBoolean, fmi2Boolean, |instance: &mut Instance, vr, _| instance.access_none(vr, DataType::Boolean);
    /// No model has such variables.
    fmi2GetString, fmi2String, |instance: &mut Instance, vr, _| instance.access_none(vr, DataType::String);
}

/// Functions that set variables.
macro_rules! setters {
    ($($(#[doc = $doc:literal])* $function:ident, $Value:ty, $work:expr;)*) => {$(
        $(#[doc = $doc])*
        ///
        /// # Safety
        /// As the module says.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $function(
            c: fmi2Component,
            vr: *const fmi2ValueReference,
            nvr: usize,
            value: *const $Value,
        ) -> Status {
            let work = |instance: &mut Instance| {
                // SAFETY: as the caller promises.
                let (references, values) = unsafe { (array(vr, nvr, "vr")?, array(value, nvr, "value")?) };
                $work(instance, references, values)
            };
            // SAFETY: as the caller promises.
            unsafe { with_instance(c, stringify!($function), allowed::SET, work) }
        }
    )*};
}

setters! {
    /// See [`Instance::set_real`].
    fmi2SetReal, fmi2Real, Instance::set_real;
    /// See [`Instance::set_integer`].
    fmi2SetInteger, fmi2Integer, Instance::set_integer;
    /// No model has such variables.
    fmi2SetBoolean, fmi2Boolean, |instance: &mut Instance, vr, _| instance.access_none(vr, DataType::Boolean);
    /// No model has such variables.
    fmi2SetString, fmi2String, |instance: &mut Instance, vr, _| instance.access_none(vr, DataType::String);
}

/// Saves the state behind a handle: a new one where `*FMUstate` is null.
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> Status {
    let work = |instance: &mut Instance| {
        // SAFETY: as the caller promises.
        unsafe { store(instance.save(), target(FMUstate, "FMUstate")?) };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2GetFMUstate", allowed::ALWAYS, work) }
}

/// Continues from a saved state.
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate) -> Status {
    // SAFETY: as the caller promises.
    let work = |instance: &mut Instance| instance.restore(unsafe { snapshot(FMUstate) }?);
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2SetFMUstate", allowed::ALWAYS, work) }
}

/// Frees a saved state and sets its handle to null. Null is fine.
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> Status {
    let work = |_: &mut Instance| {
        // SAFETY: as the caller promises.
        let state = unsafe { target(FMUstate, "FMUstate") }?;
        let state = std::mem::replace(state, ptr::null_mut());
        if !state.is_null() {
            // SAFETY: not null, it is a box that store gave away, and the host's handle to it is gone.
            drop(unsafe { Box::from_raw(state.cast::<Snapshot>()) });
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2FreeFMUstate", allowed::ALWAYS, work) }
}

/// Number of bytes that [`fmi2SerializeFMUstate`] writes.
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    size: *mut usize,
) -> Status {
    let work = |_: &mut Instance| {
        // SAFETY: as the caller promises.
        unsafe { *target(size, "size")? = snapshot(FMUstate)?.size() };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2SerializedFMUstateSize", allowed::ALWAYS, work) }
}

/// Writes a saved state as bytes: see [`crate::snapshot`].
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    serializedState: *mut fmi2Byte,
    size: usize,
) -> Status {
    let work = |_: &mut Instance| {
        // SAFETY: as the caller promises.
        let bytes = unsafe { snapshot(FMUstate) }?.to_bytes();
        if size != bytes.len() {
            return Err(Refusal::BufferSize { needed: bytes.len(), given: size });
        }
        // SAFETY: as the caller promises.
        unsafe { array_mut(serializedState.cast(), size, "serializedState") }?.copy_from_slice(&bytes);
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2SerializeFMUstate", allowed::ALWAYS, work) }
}

/// Reads back what [`fmi2SerializeFMUstate`] wrote.
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: fmi2Component,
    serializedState: *const fmi2Byte,
    size: usize,
    FMUstate: *mut fmi2FMUstate,
) -> Status {
    let work = |instance: &mut Instance| {
        // SAFETY: as the caller promises.
        let bytes = unsafe { array(serializedState.cast(), size, "serializedState") }?;
        let saved = instance.snapshot_from_bytes(bytes)?;
        // SAFETY: as the caller promises.
        unsafe { store(saved, target(FMUstate, "FMUstate")?) };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2DeSerializeFMUstate", allowed::ALWAYS, work) }
}

/// See [`Instance::get_directional_derivative`].
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetDirectionalDerivative(
    c: fmi2Component,
    vUnknown_ref: *const fmi2ValueReference,
    nUnknown: usize,
    vKnown_ref: *const fmi2ValueReference,
    nKnown: usize,
    dvKnown: *const fmi2Real,
    dvUnknown: *mut fmi2Real,
) -> Status {
    let work = |instance: &mut Instance| {
        // SAFETY: as the caller promises.
        let (unknowns, unknown_changes) =
            unsafe { (array(vUnknown_ref, nUnknown, "vUnknown_ref")?, array_mut(dvUnknown, nUnknown, "dvUnknown")?) };
        // SAFETY: as the caller promises.
        let (knowns, known_changes) =
            unsafe { (array(vKnown_ref, nKnown, "vKnown_ref")?, array(dvKnown, nKnown, "dvKnown")?) };
        instance.get_directional_derivative(unknowns, knowns, known_changes, unknown_changes)
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2GetDirectionalDerivative", allowed::GET, work) }
}

/// See [`Instance::set_input_derivatives`].
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetRealInputDerivatives(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *const fmi2Real,
) -> Status {
    let work = |instance: &mut Instance| {
        // SAFETY: as the caller promises.
        let (references, orders, values) =
            unsafe { (array(vr, nvr, "vr")?, array(order, nvr, "order")?, array(value, nvr, "value")?) };
        instance.set_input_derivatives(references, orders, values)
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2SetRealInputDerivatives", allowed::SET, work) }
}

/// See [`Instance::get_output_derivatives`].
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealOutputDerivatives(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *mut fmi2Real,
) -> Status {
    let work = |instance: &mut Instance| {
        // SAFETY: as the caller promises.
        let (references, orders, values) =
            unsafe { (array(vr, nvr, "vr")?, array(order, nvr, "order")?, array_mut(value, nvr, "value")?) };
        instance.get_output_derivatives(references, orders, values)
    };
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2GetRealOutputDerivatives", allowed::AFTER_INITIALIZATION, work) }
}

/// See [`Instance::do_step`].
///
/// # Safety
/// As the module says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(
    c: fmi2Component,
    currentCommunicationPoint: fmi2Real,
    communicationStepSize: fmi2Real,
    _noSetFMUStatePriorToCurrentPoint: fmi2Boolean,
) -> Status {
    let work = |instance: &mut Instance| instance.do_step(currentCommunicationPoint, communicationStepSize);
    // SAFETY: as the caller promises.
    unsafe { with_instance(c, "fmi2DoStep", allowed::STEP, work) }
}

/// Functions that ask about the last step.
macro_rules! status_functions {
    ($($(#[doc = $doc:literal])* $function:ident, $Value:ty, $answer:expr;)*) => {$(
        $(#[doc = $doc])*
        ///
        /// # Safety
        /// As the module says.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $function(c: fmi2Component, s: fmi2StatusKind, value: *mut $Value) -> Status {
            let work = |instance: &mut Instance| {
                let answer: Option<$Value> = $answer(instance, s);
                let answer = answer.ok_or(Refusal::NoSuchStatus { kind: s })?;
                // SAFETY: as the caller promises.
                *unsafe { target(value, "value") }? = answer;
                Ok(())
            };
            // SAFETY: as the caller promises.
            unsafe { with_instance(c, stringify!($function), allowed::AFTER_INITIALIZATION, work) }
        }
    )*};
}

status_functions! {
    /// How the last step ended.
    fmi2GetStatus, Status, |instance: &mut Instance, s| (s == DO_STEP_STATUS).then(|| instance.last_step_status());
    /// Time up to which the simulation has come.
    fmi2GetRealStatus, fmi2Real,
        |instance: &mut Instance, s| (s == LAST_SUCCESSFUL_TIME).then(|| instance.last_successful_time());
    /// There is no status of this type.
    fmi2GetIntegerStatus, fmi2Integer, |_, _| None;
    /// Whether the instance wants to end the simulation: never, as a failed step can be tried again from a saved state.
    fmi2GetBooleanStatus, fmi2Boolean, |_, s| (s == TERMINATED).then_some(0);
    /// Why a step is pending: it never is.
    fmi2GetStringStatus, fmi2String, |_, _| None;
}
