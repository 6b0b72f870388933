//! A smooth correction for errors whose cause is unknown: fitted, judged on samples that no fit saw, and no explanation.
//!
//! # Method
//! [`UnknownCause`] adds Σ c_ij T_i T_j of two variables to the force or to the target pressure. The coefficients come from
//! regularised least squares on the simulation error (Gauss–Newton, the model being almost linear in them). The two
//! variables, the place and the penalty are those with the smallest error in cross-validation within the training
//! samples: blocks of neighbouring samples are left out in turn.
//!
//! # Reference
//! Discrepancy of a model as a smooth function: M. Kennedy, A. O'Hagan (2001), doi 10.1111/1467-9868.00294.

use super::fits::Bench;
use super::residuals::Scope;
use crate::correction::{ActsOn, COEFFICIENTS, Quantity, UnknownCause};
use crate::least_squares::{Free, derivatives, dot, normal_matrix};
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::{replay, slopes};
use nalgebra::{DMatrix, DVector};

/// A correction without a cause.
#[derive(Debug, Clone)]
pub struct Correction {
    /// What it is added to.
    pub acts_on: &'static str,
    /// What it depends on.
    pub variables: [&'static str; 2],
    /// 1 − error with it / error of the extended model without it, held out, each signal weighted by its noise.
    pub improvement: f64,
    /// The extended model with it.
    pub parameters: Parameters,
}

impl Correction {
    /// What it is, in a sentence.
    pub fn sentence(&self) -> String {
        let [first, second] = self.variables.map(|name| name.replace('_', " "));
        format!(
            "A smooth correction of the {} by {first} and {second} (cause unknown, no explanation) takes off {:.0} % of \
             the remaining error on samples that no fit saw.",
            self.acts_on.replace('_', " "),
            100.0 * self.improvement
        )
    }
}

/// What is tried: place and variables.
const TRIED: [(ActsOn, Quantity, Quantity); 5] = [
    (ActsOn::Force, Quantity::Contraction, Quantity::GaugePressure),
    (ActsOn::Force, Quantity::Contraction, Quantity::ContractionVelocity),
    (ActsOn::Force, Quantity::GaugePressure, Quantity::ContractionVelocity),
    (ActsOn::TargetPressure, Quantity::CommandedPressure, Quantity::GaugePressure),
    (ActsOn::TargetPressure, Quantity::CommandedPressure, Quantity::Contraction),
];
/// Penalties that are tried, relative to the mean information on a coefficient.
const PENALTIES: [f64; 6] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Parts of the training samples that are left out in turn.
const FOLDS: usize = 4;
/// Neighbouring residuals that are left out together.
const BLOCK: usize = 150;
/// Most Gauss–Newton steps.
const STEPS: usize = 3;
/// Least improvement that is worth a file.
const LEAST_IMPROVEMENT: f64 = 0.1;
/// Share of the samples beyond either end of a range.
const BEYOND: f64 = 0.005;

/// A model with the derivatives of its residuals by the coefficients, all as weighted for fits.
struct Linear {
    parameters: Parameters,
    residuals: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

/// The correction that helps most; `None` where none helps on samples that no fit saw.
pub fn correction(bench: &Bench, extended: &Parameters) -> Option<Correction> {
    let tried = TRIED.iter().filter_map(|what| {
        let start = start(bench, extended, *what)?;
        let linear = linearised(bench, &start)?;
        let (penalty, error) = cross_validated(&linear);
        Some((error, penalty, linear))
    });
    let (_, penalty, linear) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let parameters = fitted(bench, linear, penalty);
    let held_out = |parameters: &Parameters| {
        Some(bench.data.weighted(&bench.data.held_out_rms(&bench.data.residuals(parameters)?)))
    };
    let improvement = 1.0 - held_out(&parameters)? / held_out(extended)?;
    let UnknownCause { acts_on, first, second, .. } = parameters.unknown_cause;
    let found =
        Correction { acts_on: acts_on.name(), variables: [first.name(), second.name()], improvement, parameters };
    (improvement > LEAST_IMPROVEMENT).then_some(found)
}

/// The model with a correction of zero over the ranges that its variables have.
fn start(
    bench: &Bench,
    model: &Parameters,
    (acts_on, first, second): (ActsOn, Quantity, Quantity),
) -> Option<Parameters> {
    let [(first_low, first_high), (second_low, second_high)] =
        [range(bench, model, first)?, range(bench, model, second)?];
    let unknown_cause = UnknownCause {
        acts_on,
        first,
        second,
        first_low,
        first_high,
        second_low,
        second_high,
        ..UnknownCause::default()
    };
    Some(Parameters { unknown_cause, ..*model })
}

/// Range of a variable over the recordings in its unit; `None` where it is not known or does not change.
fn range(bench: &Bench, model: &Parameters, quantity: Quantity) -> Option<(f64, f64)> {
    let of = |recording: &Recording| -> Option<Vec<f64>> {
        let known = |signal: Signal| {
            let simulated = || Some(replay(model, recording).ok()?.get(signal)?.to_vec());
            recording.bridged(signal).or_else(simulated)
        };
        match quantity {
            Quantity::Contraction => known(Signal::Contraction),
            Quantity::ContractionVelocity => Some(slopes(&recording.time, &known(Signal::Contraction)?)),
            Quantity::GaugePressure => known(Signal::GaugePressure),
            Quantity::CommandedPressure => {
                let command = recording.bridged(Signal::Command)?;
                Some(command.into_iter().map(|command| model.valve.target_pressure(command)).collect())
            }
        }
    };
    let mut values: Vec<f64> = bench.data.recordings().iter().filter_map(of).flatten().collect();
    values.sort_by(f64::total_cmp);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let beyond = (BEYOND * values.len() as f64) as usize;
    let (low, high) = (values.get(beyond)? / quantity.unit(), values.get(values.len() - 1 - beyond)? / quantity.unit());
    (high - low > 1e-3).then_some((low, high))
}

fn with_coefficients(parameters: &Parameters, coefficients: &[f64]) -> Parameters {
    Parameters { unknown_cause: parameters.unknown_cause.with_coefficients(coefficients), ..*parameters }
}

/// Residuals of a model that fits may see, weighted.
fn training(bench: &Bench, parameters: &Parameters) -> Option<Vec<f64>> {
    let (residuals, weights) = (bench.data.residuals(parameters)?, bench.data.weights(Scope::Training));
    Some(residuals.iter().zip(weights).filter(|(_, weight)| *weight > 0.0).map(|(r, weight)| r * weight).collect())
}

fn linearised(bench: &Bench, parameters: &Parameters) -> Option<Linear> {
    let residuals = training(bench, parameters)?;
    let free = [Free { start: 0.0, lower: -1e3, upper: 1e3, typical: 1.0, prior: None }; COEFFICIENTS];
    let shifted = |coefficients: &[f64]| training(bench, &with_coefficients(parameters, coefficients));
    let columns = derivatives(&shifted, &free, &parameters.unknown_cause.coefficients(), &residuals);
    Some(Linear { parameters: *parameters, residuals, columns })
}

/// Information of the residuals that `counts` picks: JᵀJ and −Jᵀr.
fn information(linear: &Linear, counts: impl Fn(usize) -> bool) -> (DMatrix<f64>, DVector<f64>) {
    let picked = |values: &[f64]| -> Vec<f64> {
        values.iter().enumerate().filter(|(k, _)| counts(*k)).map(|(_, value)| *value).collect()
    };
    let columns: Vec<Vec<f64>> = linear.columns.iter().map(|column| picked(column)).collect();
    let residuals = picked(&linear.residuals);
    let right = DVector::from_iterator(COEFFICIENTS, columns.iter().map(|column| -dot(column, &residuals)));
    (normal_matrix(&columns), right)
}

/// Step from coefficients to those that minimise squares and penalty; higher polynomials cost more.
fn step(normal: &DMatrix<f64>, right: &DVector<f64>, from: &[f64; COEFFICIENTS], penalty: f64) -> Option<DVector<f64>> {
    let size = penalty * normal.trace() / COEFFICIENTS as f64;
    let (mut matrix, mut right) = (normal.clone(), right.clone());
    for k in 0..COEFFICIENTS {
        let cost = size * (1.0 + (k / 4 + k % 4) as f64).powi(2) + 1e-12;
        matrix[(k, k)] += cost;
        right[k] -= cost * from[k];
    }
    Some(matrix.cholesky()?.solve(&right))
}

/// The penalty with the smallest squares on samples left out, relative to those without any correction.
fn cross_validated(linear: &Linear) -> (f64, f64) {
    let folds: Vec<_> = (0..FOLDS).map(|fold| information(linear, |k| k / BLOCK % FOLDS == fold)).collect();
    let none = || (DMatrix::zeros(COEFFICIENTS, COEFFICIENTS), DVector::zeros(COEFFICIENTS));
    let (all, all_right) = folds.iter().fold(none(), |sum, fold| (sum.0 + &fold.0, sum.1 + &fold.1));
    // Change of the squares of each fold, to first order of the residuals, by the fit to the others.
    let left_out = |penalty: f64| -> f64 {
        let of_fold = |(normal, right): &(DMatrix<f64>, DVector<f64>)| {
            let step = step(&(&all - normal), &(&all_right - right), &[0.0; COEFFICIENTS], penalty);
            step.map_or(0.0, |step| step.dot(&(normal * &step)) - 2.0 * right.dot(&step))
        };
        folds.iter().map(of_fold).sum()
    };
    let squares: f64 = linear.residuals.iter().map(|r| r * r).sum();
    let tried = PENALTIES.iter().map(|penalty| (*penalty, 1.0 + left_out(*penalty) / squares));
    tried.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((PENALTIES[0], 1.0))
}

/// Gauss–Newton from a linearised model; a step that helps less than it should is halved.
fn fitted(bench: &Bench, mut linear: Linear, penalty: f64) -> Parameters {
    let squares = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
    for _ in 0..STEPS {
        let (normal, right) = information(&linear, |_| true);
        let from = linear.parameters.unknown_cause.coefficients();
        let Some(step) = step(&normal, &right, &from, penalty) else { break };
        let before = squares(&linear.residuals);
        let better = [1.0, 0.5, 0.25].into_iter().find_map(|share| {
            let coefficients: Vec<f64> = from.iter().zip(step.iter()).map(|(c, s)| c + share * s).collect();
            let parameters = with_coefficients(&linear.parameters, &coefficients);
            let after = squares(&training(bench, &parameters)?);
            (after < before).then_some((parameters, after))
        });
        let Some((parameters, after)) = better else { break };
        linear.parameters = parameters;
        if after > 0.98 * before {
            break;
        }
        match linearised(bench, &parameters) {
            Some(next) => linear = next,
            None => break,
        }
    }
    linear.parameters
}
