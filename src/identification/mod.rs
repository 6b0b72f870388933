//! Force models fitted to what was measured.
//!
//! [`points`] finds static points in recordings, [`structure`] what of a model they can tell, [`mod@fit`] its parameters;
//! [`report`] says it.

pub mod fit;
pub mod points;
pub mod report;
pub mod structure;

use crate::comparison::assess::Assessed;
use crate::comparison::assess_all;
use crate::measurement::Recording;
use crate::muscle::ForceModelName;
use crate::parameters::Parameters;
use crate::plant::equilibrium;
use crate::{Error, GRAVITY, Result};
use points::{Point, Points, median};
use structure::{Braid, all_models, fewest_points};

/// A force model identified from recordings.
#[derive(Debug, Clone)]
pub struct Identification {
    /// Fit, errors and cross-validation.
    pub found: Assessed,
    /// What it was fitted to.
    pub points: Points,
    /// Parameters ready for a simulation: with a load that the muscle can hold at the start.
    pub parameters: Parameters,
    /// Names of the recordings.
    pub recordings: Vec<String>,
    /// Where no model was asked for: all, best first, with their held-out errors in N.
    pub rivals: Vec<(String, f64)>,
    /// What a person should know.
    pub notes: Vec<String>,
}

/// Identifies a model, or the one of all with the smallest error on points that were left out.
///
/// # Errors
/// As [`Points::of`]; [`Error::Recording`] where the model gives no force at the points.
pub fn identify(
    recordings: &[Recording],
    given: &Parameters,
    model: Option<ForceModelName>,
    braid: Braid,
) -> Result<Identification> {
    let models = model.map_or_else(all_models, |model| vec![model]);
    let points = Points::of(recordings, fewest_points(&models, given))?;
    let mut assessed = assess_all(&models, given, &points, &[braid]).into_iter();
    let found = assessed.next().filter(|found| found.errors.rms.is_finite()).ok_or_else(|| Error::Recording {
        path: recordings.first().map_or_else(Default::default, |recording| recording.path.clone()),
        problem: "the model gives no force at these points: check `muscle.rest_length` and `muscle.thread_length`, \
                  which --parameters sets; a muscle cannot be longer than its threads"
            .to_owned(),
    })?;
    let rivals = if model.is_none() {
        let line = |a: &Assessed| (a.fitted.structure.label(), a.held_out_rms());
        std::iter::once(line(&found)).chain(assessed.map(|a| line(&a))).collect()
    } else {
        Vec::new()
    };
    let mut notes = points.notes.clone();
    let mass = recordings.iter().find_map(Recording::load_mass);
    let parameters = able_to_start(&found.fitted.parameters, mass, &points.all, &mut notes);
    let recordings = recordings.iter().map(Recording::name).collect();
    Ok(Identification { found, points, parameters, recordings, rivals, notes })
}

/// Load and pressure at which a simulation can start: those given where the muscle holds that load there, or else those of
/// the recording, or a load in the middle of what was measured at the lowest pressure that holds it.
fn able_to_start(found: &Parameters, mass: Option<f64>, points: &[Point], notes: &mut Vec<String>) -> Parameters {
    let forces: Vec<f64> = points.iter().map(|point| point.force).collect();
    let highest = points.iter().map(|point| point.gauge_pressure).fold(0.0, f64::max);
    let masses = [mass, Some(found.load.mass), Some(median(&forces) / GRAVITY), Some(0.2 * median(&forces) / GRAVITY)];
    for mass in masses.into_iter().flatten().filter(|mass| *mass > 1e-3) {
        let pressures =
            std::iter::once(found.initial.gauge_pressure).chain((1..=20).map(|k| highest * f64::from(k) / 20.0));
        for pressure in pressures {
            if equilibrium(found, pressure, mass * GRAVITY).is_some() {
                let mut parameters = *found;
                parameters.load.mass = mass;
                parameters.initial.gauge_pressure = pressure;
                if parameters.load != found.load || parameters.initial != found.initial {
                    notes.push(format!(
                        "`load.mass` is {mass:.3} kg and `initial.gauge_pressure` {:.3} bar: there the muscle holds the load, \
                         and a simulation can start",
                        pressure / 1e5
                    ));
                }
                return parameters;
            }
        }
    }
    notes.push(
        "no load was found that hangs still from the muscle: set `load.mass` and `initial.gauge_pressure`".to_owned(),
    );
    *found
}
