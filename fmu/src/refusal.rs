//! Why a call did not do what was asked, as facts; the host's logger gets the sentence.

use crate::instance::Phase;
use crate::log::Status;
use std::fmt;

/// Why a call did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The model itself cannot: bad parameters, no start, a saved state that does not fit.
    #[error(transparent)]
    Model(#[from] sinew::Error),
    /// A step that the model could not do; it is where it was before.
    #[error("{0}; the values of the last good step can still be read")]
    StepFailed(sinew::Error),
    /// The order of calls.
    #[error("not allowed while the instance is {phase}")]
    WrongPhase {
        /// Where the instance is.
        phase: Phase,
    },
    /// A pointer that must not be null.
    #[error("`{argument}` is a null pointer")]
    NullPointer {
        /// The argument of the call.
        argument: &'static str,
    },
    /// An array that no memory can hold.
    #[error("`{argument}` cannot have {length} elements")]
    ArrayLength {
        /// The argument of the call.
        argument: &'static str,
        /// Its length.
        length: usize,
    },
    /// A number in the call that must be finite, or not negative.
    #[error("`{argument}` cannot be {value}")]
    Argument {
        /// The argument of the call.
        argument: &'static str,
        /// Its value.
        value: f64,
    },
    /// The host wants model exchange.
    #[error("this FMU is for co-simulation, not for model exchange")]
    NotCoSimulation,
    /// A name that FMI wants to be there.
    #[error("the instance needs a name")]
    NoInstanceName,
    /// GUID of another FMU, or of another version of this one.
    #[error(
        "no model in this library has the GUID `{guid}`: modelDescription.xml and the library do not belong together"
    )]
    UnknownGuid {
        /// What the host passed.
        guid: String,
    },
    /// A folder of resources that is not on this machine.
    #[error("the resource location `{location}` is not a folder: it must be a file: URI")]
    ResourceLocation {
        /// What the host passed.
        location: String,
    },
    /// A value reference without a variable.
    #[error("there is no variable with value reference {value_reference}")]
    UnknownVariable {
        /// The value reference.
        value_reference: u32,
    },
    /// A variable of another type.
    #[error("`{variable}` is of type {is}, not {asked}")]
    WrongType {
        /// Name of the variable.
        variable: &'static str,
        /// Its type.
        is: DataType,
        /// The type of the call.
        asked: DataType,
    },
    /// A variable of another causality.
    #[error("`{variable}` is not {needed}")]
    WrongCausality {
        /// Name of the variable.
        variable: &'static str,
        /// What the call works on.
        needed: &'static str,
    },
    /// A parameter that counts only at the start.
    #[error("`{variable}` can only be set before the end of the initialization")]
    Fixed {
        /// Name of the variable.
        variable: &'static str,
    },
    /// A derivative of a higher order than the first.
    #[error("`{variable}` has derivatives of order 1 only, not {order}")]
    DerivativeOrder {
        /// Name of the variable.
        variable: &'static str,
        /// The order that was asked for.
        order: i32,
    },
    /// A derivative that is not a number, or does not exist here.
    #[error("the derivative of `{variable}` cannot be {value}")]
    Derivative {
        /// Name of the variable.
        variable: &'static str,
        /// Its derivative.
        value: f64,
    },
    /// The host's clock and that of the instance disagree.
    #[error("the step starts at {from} s, but the instance is at {time} s")]
    CommunicationPoint {
        /// Where the host wants to start, s.
        from: f64,
        /// Where the instance is, s.
        time: f64,
    },
    /// A step that leads nowhere.
    #[error("the communication step must be longer than zero, not {step} s")]
    StepSize {
        /// The step, s.
        step: f64,
    },
    /// A step beyond the end that the host itself has announced.
    #[error("the step ends at {end} s, beyond the stop time {stop_time} s")]
    BeyondStopTime {
        /// End of the step, s.
        end: f64,
        /// Stop time, s.
        stop_time: f64,
    },
    /// A buffer that does not fit the saved state.
    #[error("a saved state of this model has {needed} bytes, not {given}")]
    BufferSize {
        /// Bytes of the saved state.
        needed: usize,
        /// Bytes of the buffer.
        given: usize,
    },
    /// Log categories that the FMU does not have; the others now count.
    #[error("there is no log category {names}")]
    UnknownCategory {
        /// The names.
        names: String,
    },
    /// Only a host that steps asynchronously has something to cancel.
    #[error("no step is in progress")]
    NoStepInProgress,
    /// A question about the last step that has no answer.
    #[error("there is no status of kind {kind} to report here")]
    NoSuchStatus {
        /// The number of the kind.
        kind: i32,
    },
    /// A defect of the library.
    #[error("internal error: {message}; the instance can only be freed")]
    Panicked {
        /// What the panic said.
        message: String,
    },
}

impl Refusal {
    /// The status that the call returns.
    pub fn status(&self) -> Status {
        match self {
            Self::UnknownCategory { .. } => Status::Warning,
            Self::StepFailed(_) | Self::NoSuchStatus { .. } => Status::Discard,
            Self::Panicked { .. } => Status::Fatal,
            _ => Status::Error,
        }
    }
}

/// The types of FMI, each with functions of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataType {
    /// Real.
    Real,
    /// Integer; an enumeration is read and set as one.
    Integer,
    /// Boolean.
    Boolean,
    /// String.
    String,
}

impl fmt::Display for DataType {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self:?}")
    }
}
