//! Pneumatic artificial muscles as FMUs that learn from measurements.
//!
//! In the order data flows: [`variables`] declares what there is; [`muscle`], [`valve`], [`load`] and [`effects`] are the
//! physics, [`memory`] what they remember, [`correction`] what is added where the cause is unknown; [`plant`], [`controller`] and [`mod@reference`] put it together; [`model`] steps it and [`mod@model_description`] describes
//! it; [`models`] lists them. With the feature `tool`, [`package`] makes FMUs and [`mod@export`] writes them, [`measurement`] reads recordings, [`quality`] says what they can bear, [`simulation`] replays them and
//! [`diagnosis`] says what the model gets wrong; [`reproduction`] sets the thesis beside what comes out here.

pub mod error;
pub mod variables;

pub mod controller;
pub mod correction;
pub mod effects;
mod input;
pub mod integrator;
pub mod load;
pub mod memory;
pub mod model;
pub mod model_description;
pub mod models;
pub mod muscle;
pub mod parameters;
pub mod plant;
pub mod reference;
mod scale;
pub mod valve;
mod zero;

#[cfg(feature = "tool")]
pub mod closed_loop;
#[cfg(feature = "tool")]
pub mod comparison;
#[cfg(feature = "tool")]
pub mod demo;
#[cfg(feature = "tool")]
pub mod diagnosis;
#[cfg(feature = "tool")]
pub mod export;
#[cfg(feature = "tool")]
pub mod hammerstein;
#[cfg(feature = "tool")]
pub mod identification;
#[cfg(feature = "tool")]
pub mod least_squares;
#[cfg(feature = "tool")]
pub mod measurement;
#[cfg(feature = "tool")]
pub mod package;
#[cfg(feature = "tool")]
pub mod plot;
#[cfg(feature = "tool")]
pub mod quality;
#[cfg(feature = "tool")]
mod recent;
#[cfg(feature = "tool")]
pub mod reproduction;
#[cfg(feature = "tool")]
pub mod simulation;
#[cfg(feature = "tool")]
pub mod ssp;
#[cfg(feature = "tool")]
mod start;
#[cfg(feature = "tool")]
pub mod tuning;

pub use error::{Error, Result, printable};

/// Standard gravity, m/s², as the thesis uses it (eq. 5.4).
pub const GRAVITY: f64 = 9.81;
