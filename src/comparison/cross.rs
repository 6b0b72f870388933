//! Parameters of one muscle on the points of another, as in thesis figures 4.46 to 4.49.
//!
//! # Model
//! *As they are*: the coefficients of the model go over, the geometry is that of the other muscle.
//! *Normalised*: the muscles are taken to be similar. Force over the square of the diameter at rest is the same function of
//! pressure and contraction ratio, F = (D/D')² F'(p, x L'₀/L₀): this holds for every model, whatever its coefficients.

use super::OnMuscle;
use super::errors::Errors;
use crate::identification::points::Point;
use crate::identification::structure::{Braid, forces};
use crate::muscle::ForceModelName;
use crate::parameters::Parameters;
use serde::Serialize;

/// How parameters were taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Transfer {
    /// Coefficients unchanged, geometry of the other muscle.
    AsTheyAre,
    /// By contraction ratio and force over diameter squared.
    Normalised,
}

/// Parameters of one muscle on the points of another.
#[derive(Debug, Clone, Serialize)]
pub struct Cross {
    /// The muscle that the parameters are of.
    pub of: String,
    /// The muscle whose points they meet.
    pub on: String,
    /// The model.
    pub model: &'static str,
    /// How they were taken over.
    pub transfer: Transfer,
    /// Errors at the points of the other muscle.
    pub errors: Errors,
    /// Share of the points at which the modelled force is too low.
    pub too_low: f64,
    /// Error there of the parameters fitted to these points, with the same braid, rms in N.
    pub own_rms: f64,
}

/// Parameters from each muscle to each other; the braid is as given.
pub fn between(muscles: &[OnMuscle]) -> Vec<Cross> {
    let mut all = Vec::new();
    for (index, of) in muscles.iter().enumerate() {
        for (_, on) in muscles.iter().enumerate().filter(|(other, _)| *other != index) {
            for model in of.models.iter().filter(|model| model.fitted.structure.braid == Braid::Given) {
                let name = model.fitted.structure.model;
                let own = on
                    .models
                    .iter()
                    .find(|m| m.fitted.structure.model == name && m.fitted.structure.braid == Braid::Given);
                let Some(own) = own else { continue };
                for transfer in [Transfer::AsTheyAre, Transfer::Normalised] {
                    let modelled = taken_over(&model.fitted.parameters, name, &on.given, &on.points.all, transfer);
                    let residuals: Vec<(f64, f64)> =
                        on.points.all.iter().zip(modelled).map(|(p, force)| (p.force - force, p.force)).collect();
                    let low = residuals.iter().filter(|(r, _)| *r > 0.0).count() as f64;
                    let Some(errors) = Errors::of(residuals.iter().copied()) else { continue };
                    all.push(Cross {
                        of: of.name.clone(),
                        on: on.name.clone(),
                        model: crate::identification::structure::model_name(name),
                        transfer,
                        errors,
                        too_low: low / residuals.len() as f64,
                        own_rms: own.errors.rms,
                    });
                }
            }
        }
    }
    all
}

/// Forces in N at points of another muscle.
fn taken_over(
    fitted: &Parameters,
    model: ForceModelName,
    given: &Parameters,
    points: &[Point],
    transfer: Transfer,
) -> Vec<f64> {
    if transfer == Transfer::AsTheyAre {
        let mut parameters = *given;
        parameters.muscle.force_model = model;
        parameters.force_models = fitted.force_models;
        return forces(&parameters, points);
    }
    let length = fitted.muscle.rest_length / given.muscle.rest_length;
    let width = (given.muscle.diameter(0.0) / fitted.muscle.diameter(0.0)).powi(2);
    let similar = |point: &Point| Point {
        contraction: point.contraction * length,
        contraction_velocity: point.contraction_velocity * length,
        ..*point
    };
    let points: Vec<Point> = points.iter().map(similar).collect();
    forces(fitted, &points).into_iter().map(|force| width * force).collect()
}
