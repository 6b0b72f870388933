#![doc = include_str!("../README.md")]

pub mod error;
pub mod variables;

pub mod controller;
pub mod effects;
pub mod integrator;
pub mod load;
pub mod model;
pub mod model_description;
pub mod muscle;
pub mod parameters;
pub mod plant;
pub mod reference;
pub mod valve;

#[cfg(feature = "tool")]
pub mod demo;
#[cfg(feature = "tool")]
pub mod diagnosis;
#[cfg(feature = "tool")]
pub mod least_squares;
#[cfg(feature = "tool")]
pub mod measurement;
#[cfg(feature = "tool")]
pub mod package;
#[cfg(feature = "tool")]
pub mod plot;
#[cfg(feature = "tool")]
pub mod simulation;

pub use error::{Error, Result};

/// Standard gravity, m/s², as the thesis uses it (eq. 5.4).
pub const GRAVITY: f64 = 9.81;
