//! Bounded nonlinear least squares.
//!
//! # Model
//! Levenberg–Marquardt on Σ r², with steps projected onto the bounds and parameters at a bound that push outwards left
//! out of the step. Derivatives are forward differences, taken in parallel.
//!
//! # Reference
//! D. Marquardt (1963), doi 10.1137/0111030; projection as in C. Kanzow, N. Yamashita, M. Fukushima (2004),
//! doi 10.1016/j.cam.2004.02.013. Own code because `levenberg-marquardt` 0.15 has no bounds.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// One parameter of a fit.
#[derive(Debug, Clone, Copy)]
pub struct Free {
    /// Where the fit starts.
    pub start: f64,
    /// Smallest allowed value.
    pub lower: f64,
    /// Largest allowed value.
    pub upper: f64,
    /// A change of this size matters.
    pub typical: f64,
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// No step makes the sum of squares noticeably smaller.
    Converged,
    /// Still getting smaller after the last allowed iteration.
    IterationLimit,
    /// The residuals could not be computed at the start.
    NoStart,
}

/// What a fit found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Values of the parameters.
    pub parameters: Vec<f64>,
    /// Σ r² there.
    pub cost: f64,
    /// Covariance for residuals of unit variance; infinite variance where the data say nothing.
    pub variances: Vec<f64>,
    /// How it ended.
    pub ended: Ended,
}

const MOST_ITERATIONS: usize = 40;
/// Relative decrease of the cost below which a fit has converged.
const SMALL_DECREASE: f64 = 1e-6;

/// Minimises the sum of squares of `residuals`, which gives `None` where it cannot be computed.
pub fn fit(residuals: &(impl Fn(&[f64]) -> Option<Vec<f64>> + Sync), free: &[Free]) -> Fit {
    let mut parameters: Vec<f64> = free.iter().map(|f| f.start.clamp(f.lower, f.upper)).collect();
    let residuals = &|parameters: &[f64]| residuals(parameters).filter(|all| all.iter().all(|r| r.is_finite()));
    let Some(mut current) = residuals(&parameters) else {
        return Fit {
            parameters,
            cost: f64::INFINITY,
            variances: vec![f64::INFINITY; free.len()],
            ended: Ended::NoStart,
        };
    };
    let mut damping = 1e-3;
    let mut ended = Ended::IterationLimit;
    let mut normal = DMatrix::zeros(free.len(), free.len());
    for _ in 0..MOST_ITERATIONS {
        let cost = sum_of_squares(&current);
        let gradient;
        (normal, gradient) = normal_equations(residuals, free, &parameters, &current);
        let accepted = loop {
            let trial = step(&normal, &gradient, free, &parameters, damping);
            let better = residuals(&trial).filter(|trial| sum_of_squares(trial) < cost);
            if let Some(better) = better {
                damping = (damping * 0.2).max(1e-12);
                break Some((trial, better));
            }
            damping *= 5.0;
            if damping > 1e8 {
                break None;
            }
        };
        let Some((trial, better)) = accepted else {
            ended = Ended::Converged;
            break;
        };
        let decrease = cost - sum_of_squares(&better);
        (parameters, current) = (trial, better);
        if decrease <= SMALL_DECREASE * cost {
            ended = Ended::Converged;
            break;
        }
    }
    Fit { variances: variances(&normal, free), cost: sum_of_squares(&current), parameters, ended }
}

fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// JᵀJ and Jᵀr, with parameters in their typical sizes.
fn normal_equations(
    residuals: &(impl Fn(&[f64]) -> Option<Vec<f64>> + Sync),
    free: &[Free],
    parameters: &[f64],
    current: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    let columns: Vec<Vec<f64>> = (0..free.len())
        .into_par_iter()
        .map(|k| {
            // Away from the nearer bound, so that the shifted point is allowed.
            let inwards = if parameters[k] - free[k].lower > free[k].upper - parameters[k] { -1.0 } else { 1.0 };
            let difference = inwards * 1e-4;
            let mut shifted = parameters.to_vec();
            shifted[k] += difference * free[k].typical;
            let shifted = residuals(&shifted).unwrap_or_else(|| current.to_vec());
            shifted.iter().zip(current).map(|(after, before)| (after - before) / difference).collect()
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let normal = DMatrix::from_fn(free.len(), free.len(), |i, j| dot(&columns[i], &columns[j]));
    (normal, DVector::from_fn(free.len(), |i, _| dot(&columns[i], current)))
}

fn step(normal: &DMatrix<f64>, gradient: &DVector<f64>, free: &[Free], parameters: &[f64], damping: f64) -> Vec<f64> {
    let pushes_out = |k: usize| {
        (parameters[k] <= free[k].lower && gradient[k] > 0.0) || (parameters[k] >= free[k].upper && gradient[k] < 0.0)
    };
    let moving: Vec<usize> = (0..free.len()).filter(|&k| !pushes_out(k)).collect();
    let matrix = DMatrix::from_fn(moving.len(), moving.len(), |i, j| {
        let entry = normal[(moving[i], moving[j])];
        // The small constant keeps a parameter that nothing depends on where it is.
        if i == j { entry * (1.0 + damping) + 1e-9 } else { entry }
    });
    let right = DVector::from_fn(moving.len(), |i, _| -gradient[moving[i]]);
    let solution = matrix.cholesky().map(|factor| factor.solve(&right));
    let mut trial = parameters.to_vec();
    if let Some(solution) = solution {
        for (&k, change) in moving.iter().zip(solution.iter()) {
            trial[k] = (trial[k] + change * free[k].typical).clamp(free[k].lower, free[k].upper);
        }
    }
    trial
}

fn variances(normal: &DMatrix<f64>, free: &[Free]) -> Vec<f64> {
    match normal.clone().try_inverse() {
        Some(inverse) => (0..free.len()).map(|k| inverse[(k, k)].abs() * free[k].typical.powi(2)).collect(),
        None => vec![f64::INFINITY; free.len()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn free(start: f64, lower: f64, upper: f64) -> Free {
        Free { start, lower, upper, typical: 1.0 }
    }

    #[test]
    fn rosenbrock_is_solved() {
        let rosenbrock = |p: &[f64]| Some(vec![1.0 - p[0], 10.0 * (p[1] - p[0] * p[0])]);
        let found = fit(&rosenbrock, &[free(-1.2, -5.0, 5.0), free(1.0, -5.0, 5.0)]);
        assert_eq!(found.ended, Ended::Converged);
        assert!((found.parameters[0] - 1.0).abs() < 1e-3 && (found.parameters[1] - 1.0).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn bounds_hold_and_the_rest_is_still_optimal() {
        // Minimum of (x - 3)² + (x + y)² with x <= 1 is x = 1, y = -1.
        let residuals = |p: &[f64]| Some(vec![p[0] - 3.0, p[0] + p[1]]);
        let found = fit(&residuals, &[free(0.0, -1.0, 1.0), free(0.0, -5.0, 5.0)]);
        assert_eq!(found.parameters[0], 1.0);
        assert!((found.parameters[1] + 1.0).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_parameter_without_influence_stays_and_is_unknown() {
        let found = fit(&|p: &[f64]| Some(vec![p[0] - 2.0]), &[free(0.0, -5.0, 5.0), free(0.3, -5.0, 5.0)]);
        assert!((found.parameters[0] - 2.0).abs() < 1e-6);
        assert!((found.parameters[1] - 0.3).abs() < 1e-9);
        assert_eq!(found.variances[1], f64::INFINITY);
    }

    #[test]
    fn variance_of_a_mean() {
        let data = [1.0, 2.0, 4.0, 5.0];
        let found = fit(&|p: &[f64]| Some(data.iter().map(|d| d - p[0]).collect()), &[free(0.0, -9.0, 9.0)]);
        assert!((found.parameters[0] - 3.0).abs() < 1e-6 && (found.variances[0] - 0.25).abs() < 1e-6);
    }
}
