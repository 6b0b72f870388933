//! Force models compared on measured muscles: the assessment of the thesis, on anybody's data.
//!
//! [`errors`] and [`assess`] judge one model, [`cross`] takes its parameters to another muscle, [`isometric`] makes curves at
//! fixed length, [`dynamic`] sets motion against rest, [`claims`] says whether what the thesis claims holds, and [`report`] shows it all.

pub mod assess;
pub mod claims;
pub mod cross;
pub mod dynamic;
pub mod errors;
pub mod isometric;
pub mod report;

use crate::Result;
use crate::identification::points::Points;
use crate::identification::structure::{Braid, Structure, fewest_points};
use crate::measurement::Recording;
use crate::muscle::ForceModelName;
use crate::parameters::Parameters;
use assess::Assessed;
use cross::Cross;
use rayon::prelude::*;

/// A muscle with what was measured of it.
pub struct Muscle {
    /// What it is called.
    pub name: String,
    /// Its geometry, and where fits start.
    pub given: Parameters,
    /// Its recordings.
    pub recordings: Vec<Recording>,
}

/// The models on one muscle, best first.
pub struct OnMuscle {
    /// What it is called.
    pub name: String,
    /// Its geometry, and where fits started.
    pub given: Parameters,
    /// What was compared with.
    pub points: Points,
    /// Models by their error on pressures that were left out.
    pub models: Vec<Assessed>,
    /// How many independent points these are worth, by the residuals of the best model.
    pub effective: f64,
}

/// All models on all muscles.
pub struct Comparison {
    /// Muscle by muscle.
    pub muscles: Vec<OnMuscle>,
    /// Parameters of one muscle on the points of another.
    pub cross: Vec<Cross>,
}

/// Fits models to the points of a muscle and judges them, best first: a model of the braid once with the braid as given
/// and once with it fitted.
pub fn assess_all(models: &[ForceModelName], given: &Parameters, points: &Points, braids: &[Braid]) -> Vec<Assessed> {
    let all: Vec<(ForceModelName, Braid)> =
        models.iter().flat_map(|model| braids.iter().map(|braid| (*model, *braid))).collect();
    // What fits nothing of the braid is the same either way, and judged once.
    let worth = |(model, braid): &(ForceModelName, Braid)| {
        *braid == Braid::Given
            || !braids.contains(&Braid::Given)
            || Structure::of(*model, *braid, given, &points.all).fits_braid()
    };
    let mut assessed: Vec<Assessed> = all
        .into_par_iter()
        .filter(worth)
        .map(|(model, braid)| Assessed::of(model, braid, given, &points.all))
        .collect();
    assessed.sort_by(|a, b| a.held_out_rms().total_cmp(&b.held_out_rms()));
    assessed
}

/// Compares models on muscles, and takes their parameters from each muscle to each other.
///
/// # Errors
/// As [`Points::of`].
pub fn compare(muscles: Vec<Muscle>, models: &[ForceModelName]) -> Result<Comparison> {
    let on_muscle = |muscle: Muscle| -> Result<OnMuscle> {
        let points = Points::of(&muscle.recordings, fewest_points(models, &muscle.given))?;
        let assessed = assess_all(models, &muscle.given, &points, &[Braid::Given, Braid::Fitted]);
        let effective = assessed.first().map_or(0.0, |best| best.fitted.effective);
        // Nobody should take for measured what was not.
        let reconstructed = muscle.recordings.iter().any(|recording| recording.name().contains("reconstructed"));
        let name = if reconstructed { format!("{} (reconstructed)", muscle.name) } else { muscle.name };
        Ok(OnMuscle { name, given: muscle.given, points, models: assessed, effective })
    };
    let muscles = muscles.into_iter().map(on_muscle).collect::<Result<Vec<_>>>()?;
    let cross = cross::between(&muscles);
    Ok(Comparison { muscles, cross })
}
