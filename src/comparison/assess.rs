//! One force model on the points of one muscle: fit, errors, and the error on points that the fit did not see.

use super::errors::{Class, Errors, classes, contraction, force, levels, pressure};
use crate::identification::fit::{Fitted, Start, fit};
use crate::identification::points::{Point, thinned};
use crate::identification::structure::{Braid, Structure, forces};
use crate::muscle::ForceModelName;
use crate::parameters::Parameters;
use serde::Serialize;

/// Pressure in Pa that parts the low from the high.
pub const LOW: f64 = 1e5;
/// Most folds of a cross-validation.
const FOLDS: usize = 5;
/// Fewest classes that can be left out in turn.
const FEWEST_CLASSES: usize = 3;
/// Most points of a cross-validation.
const MOST_POINTS: usize = 600;

/// Errors within a class of points.
#[derive(Debug, Clone, Serialize)]
pub struct ClassErrors {
    /// The class.
    #[serde(flatten)]
    pub class: Class,
    /// Its errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// What blocks of points were left out, and the error there.
#[derive(Debug, Clone, Serialize)]
pub struct HeldOut {
    /// Whole classes of this were left out: `pressure`, `load` or `contraction`.
    pub blocks: &'static str,
    /// In so many turns.
    pub folds: usize,
    /// Root mean square of the error at the points left out, N.
    pub rms: f64,
}

/// A model on the points of a muscle.
#[derive(Debug, Clone)]
pub struct Assessed {
    /// The fit to all points.
    pub fitted: Fitted,
    /// Its errors at all points.
    pub errors: Errors,
    /// R²: share of the variance of the force.
    pub determination: f64,
    /// At pressures below 1 bar.
    pub low: Option<Errors>,
    /// From 1 bar on.
    pub high: Option<Errors>,
    /// By pressure.
    pub by_pressure: Vec<ClassErrors>,
    /// By force: load after load.
    pub by_load: Vec<ClassErrors>,
    /// Cross-validations.
    pub held_out: Vec<HeldOut>,
}

impl Assessed {
    /// Fits a model and judges it.
    pub fn of(model: ForceModelName, braid: Braid, given: &Parameters, points: &[Point]) -> Self {
        let structure = Structure::of(model, braid, given, points);
        let fitted = fit(&structure, points, Start::Wide);
        let held_out =
            blocks(points).into_iter().filter_map(|(name, all)| held_out(name, &all, &fitted, points)).collect();
        Self::described(fitted, held_out, points)
    }

    fn described(fitted: Fitted, held_out: Vec<HeldOut>, points: &[Point]) -> Self {
        let at = |k: usize| (fitted.residuals[k], points[k].force);
        let some =
            |chosen: &dyn Fn(&Point) -> bool| Errors::of((0..points.len()).filter(|&k| chosen(&points[k])).map(at));
        let by = |of: fn(&Point) -> f64| {
            let of_class = |class: Class| {
                let errors = Errors::of(class.members.iter().map(|&k| at(k)))?;
                Some(ClassErrors { class, errors })
            };
            classes(points, of).into_iter().filter_map(of_class).collect()
        };
        let errors = some(&|_| true).expect("there are points");
        let mean = points.iter().map(force).sum::<f64>() / points.len() as f64;
        let variance = points.iter().map(|p| (p.force - mean).powi(2)).sum::<f64>() / points.len() as f64;
        Self {
            errors,
            determination: 1.0 - errors.rms.powi(2) / variance.max(f64::MIN_POSITIVE),
            low: some(&|point| point.gauge_pressure < LOW),
            high: some(&|point| point.gauge_pressure >= LOW),
            by_pressure: by(pressure),
            by_load: by(force),
            held_out,
            fitted,
        }
    }

    /// By what models are put in order: the error in N on pressures that were left out, or else on what could be; where
    /// nothing could be left out there is nothing to trust, and the error is infinite.
    pub fn held_out_rms(&self) -> f64 {
        self.held_out.first().map_or(f64::INFINITY, |held| if held.rms.is_nan() { f64::INFINITY } else { held.rms })
    }

    /// Number of fitted parameters.
    pub fn count(&self) -> usize {
        self.fitted.structure.free.len()
    }

    /// Corrected Akaike and Bayesian information criteria for points worth `effective` independent ones; `None` where
    /// these are too few for the parameters.
    pub fn criteria(&self, effective: f64) -> Option<[f64; 2]> {
        // The variance of the residuals is one more parameter.
        let parameters = self.count() as f64 + 1.0;
        let free = effective - parameters - 1.0;
        let misfit = effective * self.errors.rms.max(1e-12).powi(2).ln();
        let corrected = misfit + 2.0 * parameters + 2.0 * parameters * (parameters + 1.0) / free;
        (free > 0.0).then(|| [corrected, misfit + parameters * effective.ln()])
    }
}

/// Classes of points that can be left out: pressures, and loads where these are levels, or else contractions.
fn blocks(points: &[Point]) -> Vec<(&'static str, Vec<Class>)> {
    let loads = levels(points, force).filter(|levels| 3 * levels.len() <= points.len());
    let other = loads.map_or_else(|| ("contraction", classes(points, contraction)), |loads| ("load", loads));
    let all = [("pressure", classes(points, pressure)), other];
    // What holds most of the points cannot be left out.
    let largest = |classes: &[Class]| classes.iter().map(|class| class.members.len()).max().unwrap_or(0);
    let useful = |classes: &[Class]| classes.len() >= FEWEST_CLASSES && 2 * largest(classes) <= points.len();
    all.into_iter().filter(|(_, classes)| useful(classes)).collect()
}

/// Cross-validation: the inner classes are dealt out to folds, every fold is left out once. The first and the last class
/// stay, so that models are asked to interpolate. `None` where the rest of the points cannot tell the parameters.
fn held_out(blocks: &'static str, classes: &[Class], fitted: &Fitted, points: &[Point]) -> Option<HeldOut> {
    let inner = &classes[1..classes.len() - 1];
    let folds = inner.len().min(FOLDS);
    let mut fold_of = vec![None; points.len()];
    for (k, class) in inner.iter().enumerate() {
        class.members.iter().for_each(|&member| fold_of[member] = Some(k % folds));
    }
    let used = thinned(points.len(), MOST_POINTS);
    let mut residuals = Vec::new();
    for fold in 0..folds {
        let part = |inside: bool| -> Vec<Point> {
            used.iter().filter(|&&k| (fold_of[k] == Some(fold)) == inside).map(|&k| points[k]).collect()
        };
        let (test, training) = (part(true), part(false));
        let Structure { model, braid, ref base, .. } = fitted.structure;
        let told = Structure::of(model, braid, base, &training);
        if told.free.len() < fitted.structure.free.len() || training.len() <= told.free.len() {
            return None;
        }
        let refitted = fit(&fitted.structure, &training, Start::Near(&fitted.values));
        let modelled = forces(&refitted.parameters, &test);
        residuals.extend(test.iter().zip(modelled).map(|(point, force)| (point.force - force, point.force)));
    }
    let rms = Errors::of(residuals.into_iter())?.rms;
    Some(HeldOut { blocks, folds, rms })
}
