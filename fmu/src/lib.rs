//! The library inside every FMU: it knows FMI, not muscles.
//!
//! One library serves all models of [`sinew::models::models`]; the GUID that the host passes says which.
//!
//! - [`fmi2`] is the C interface of FMI 2.0 for co-simulation, and the only place with `unsafe` code. Another version
//!   of FMI would be another file beside it.
//! - [`instance`] is what happens behind it, in safe Rust: order of calls, checks, time, lazy initialisation.
//! - [`snapshot`] is the saved state of an instance as bytes, [`resources`] finds the parameter file, [`log`] talks to
//!   the host, [`refusal`] says why a call was refused.

pub mod fmi2;
pub mod instance;
pub mod log;
pub mod refusal;
pub mod resources;
pub mod snapshot;
