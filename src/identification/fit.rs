//! Robust fit of a force model to points, with intervals.
//!
//! # Model
//! Parameters that act linearly are solved for by QR at every value of the others (variable projection); the others follow
//! by [`crate::least_squares`], from several starts. Points far off count less: weights min(1, 2 s/|r|) after Huber, s the
//! median of |r| over 0.6745, anew until the forces rest.
//!
//! The covariance is the sandwich B⁻¹ Jᵀ Ψ² J B⁻¹, which asks for neither equal noise nor a true model: Ψ holds the weighted
//! residuals w r, and B = JᵀJ of the points that count in full, as a point farther off pulls no more when it moves away.
//! A point that counts in full has drawn the fit towards itself: its residual is r/(1 − h), h its leverage (HC3). Residuals that
//! follow their neighbours count as fewer: n (1 − ρ)/(1 + ρ) for a correlation ρ > 0 with the next point. Intervals are of
//! Student's t.
//!
//! # Reference
//! G. Golub and V. Pereyra (1973), doi 10.1137/0710036; P. Huber (1964), doi 10.1214/aoms/1177703732; H. White (1980),
//! doi 10.2307/1912934; J. MacKinnon and H. White (1985), doi 10.1016/0304-4076(85)90158-7; effective size as of a first-order autoregression (F. Zwiers and H. von Storch 1995,
//! J. Climate 8, 336–351).

use super::points::{Point, median, thinned};
use super::structure::{Parameter, Structure, forces};
use crate::least_squares::{self, Effort, Ended, Free};
use crate::parameters::Parameters;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Residuals up to so many standard deviations count in full.
const ROBUST: f64 = 2.0;
/// Rounds of new weights at most.
const ROUNDS: usize = 25;
/// Places that are looked at beside the given one.
const PLACES: usize = 40;
/// The best of them, from which a fit starts.
const STARTS: usize = 6;
/// Most points that are looked at from every start.
const COARSE: usize = 150;
/// Below this share of the largest singular value a direction is said to be weak.
const WEAK: f64 = 1e-3;
const LOOK: Effort = Effort { iterations: 15, small_decrease: 1e-3, goal: f64::INFINITY };
const POLISH: Effort = Effort { iterations: 60, small_decrease: 1e-12, goal: f64::INFINITY };

/// Where a fit starts.
#[derive(Debug, Clone, Copy)]
pub enum Start<'a> {
    /// From the given values and several others.
    Wide,
    /// From values near the solution, in the order of [`Structure::free`].
    Near(&'a [f64]),
}

/// A fitted force model.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Model and free parameters.
    pub structure: Structure,
    /// All parameters, ready for a simulation.
    pub parameters: Parameters,
    /// Values of the free parameters, SI.
    pub values: Vec<f64>,
    /// Half widths of 95 % intervals; `None` for a parameter at its bound.
    pub half_widths: Vec<Option<f64>>,
    /// Measured less modelled force in N, shape `(n_points,)`.
    pub residuals: Vec<f64>,
    /// How much each point counts, 0 to 1.
    pub weights: Vec<f64>,
    /// Robust standard deviation of the residuals, N.
    pub scale: f64,
    /// How many independent points these are worth.
    pub effective: f64,
    /// Singular values of the scaled Jacobian over the largest, and the directions of the weak ones.
    pub singular_values: Vec<f64>,
    /// Shares of parameters in directions that the points hardly tell, weakest first.
    pub weak: Vec<Vec<(usize, f64)>>,
    /// How the fit ended.
    pub ended: Ended,
}

/// Fits a model to points.
pub fn fit(structure: &Structure, points: &[Point], start: Start) -> Fitted {
    let problem = Problem { structure, points };
    let near = match start {
        Start::Near(values) => values[structure.linear..].to_vec(),
        Start::Wide => problem.look_around(),
    };
    let mut nonlinear = near;
    let mut weights = vec![1.0; points.len()];
    let mut before: Option<Solution> = None;
    let mut ended = Ended::IterationLimit;
    for _ in 0..ROUNDS {
        let (solution, end) = problem.settle(&nonlinear, &weights);
        nonlinear = solution.values[structure.linear..].to_vec();
        let scale = robust_scale(&solution.residuals);
        weights = solution.residuals.iter().map(|r| (ROBUST * scale / r.abs()).min(1.0)).collect();
        let moved = before.map_or(f64::INFINITY, |before| {
            let pairs = before.residuals.iter().zip(&solution.residuals);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        });
        before = Some(solution);
        ended = end;
        if moved <= 1e-3 * scale {
            break;
        }
    }
    let solution = before.expect("there is at least one round");
    problem.described(solution, weights, ended)
}

/// A place with its forces.
struct Solution {
    values: Vec<f64>,
    residuals: Vec<f64>,
}

struct Problem<'a> {
    structure: &'a Structure,
    points: &'a [Point],
}

impl Problem<'_> {
    /// The best values of the parameters that do not act linearly, as far as a coarse look shows.
    fn look_around(&self) -> Vec<f64> {
        let Structure { free, linear, .. } = self.structure;
        let nonlinear = &free[*linear..];
        let given: Vec<f64> = nonlinear.iter().map(|p| p.given).collect();
        if nonlinear.is_empty() {
            return given;
        }
        let few: Vec<Point> = thinned(self.points.len(), COARSE).into_iter().map(|k| self.points[k]).collect();
        let coarse = Problem { structure: self.structure, points: &few };
        let weights = vec![1.0; few.len()];
        let place = |start: usize| {
            let spread = |(k, p): (usize, &Parameter)| {
                if start == 0 {
                    return p.given;
                }
                let away = 2.0 * halton(start, [2, 3, 5, 7, 11, 13][k % 6]) - 1.0;
                // Within a factor of three, and every other one within ten.
                let factor = if start.is_multiple_of(2) { 3_f64 } else { 10.0 };
                let value = if p.given == 0.0 { away * p.typical() } else { p.given * factor.powf(away) };
                value.clamp(p.bounds[0], p.bounds[1])
            };
            let values: Vec<f64> = nonlinear.iter().enumerate().map(spread).collect();
            let absolute = |s: Solution| s.residuals.iter().map(|r| r.abs()).sum::<f64>();
            coarse.solution(&values, &weights).map(|solution| (absolute(solution), values))
        };
        let mut starts: Vec<(f64, Vec<f64>)> = (0..=PLACES).filter_map(place).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.truncate(STARTS);
        let starts = starts.into_iter().map(|(_, start)| start);
        let looked = starts.filter_map(|start| {
            let found = coarse.search(&start, &weights, LOOK);
            (found.ended != Ended::NoStart).then_some((found.cost, found.parameters))
        });
        looked.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(given, |(_, values)| values)
    }

    /// The least weighted sum of squares from a start.
    fn settle(&self, nonlinear: &[f64], weights: &[f64]) -> (Solution, Ended) {
        let found = self.search(nonlinear, weights, POLISH);
        let solution = self.solution(&found.parameters, weights).unwrap_or_else(|| {
            // No force can be computed there: the given values, so that the residuals say so.
            let values: Vec<f64> = self.structure.free.iter().map(|p| p.given).collect();
            let modelled = forces(&self.structure.at(&values), self.points);
            let residuals = self.points.iter().zip(&modelled).map(|(point, force)| point.force - force).collect();
            Solution { values, residuals }
        });
        (solution, found.ended)
    }

    fn search(&self, nonlinear: &[f64], weights: &[f64], effort: Effort) -> least_squares::Fit {
        let Structure { free, linear, .. } = self.structure;
        let free: Vec<Free> = free[*linear..]
            .iter()
            .zip(nonlinear)
            .map(|(p, start)| Free {
                start: *start,
                lower: p.bounds[0],
                upper: p.bounds[1],
                typical: 0.1 * p.typical(),
                prior: None,
            })
            .collect();
        let residuals = |values: &[f64]| {
            let solution = self.solution(values, weights)?;
            Some(solution.residuals.iter().zip(weights).map(|(r, w)| r * w.sqrt()).collect())
        };
        least_squares::fit(&residuals, &free, &[], effort)
    }

    /// The best linear parameters for values of the others; `None` where there are no forces.
    fn solution(&self, nonlinear: &[f64], weights: &[f64]) -> Option<Solution> {
        let Structure { free, linear, .. } = self.structure;
        let mut values: Vec<f64> = vec![0.0; *linear];
        values.extend(nonlinear);
        let offset = forces(&self.structure.at(&values), self.points);
        let rest: Vec<f64> = self.points.iter().zip(&offset).map(|(point, force)| point.force - force).collect();
        if !rest.iter().all(|r| r.is_finite()) {
            return None;
        }
        let columns: Vec<Vec<f64>> = (0..*linear)
            .map(|k| {
                let mut values = values.clone();
                values[k] = free[k].typical();
                let with = forces(&self.structure.at(&values), self.points);
                with.iter().zip(&offset).map(|(with, without)| with - without).collect()
            })
            .collect();
        let bounds: Vec<[f64; 2]> = free[..*linear].iter().map(|p| p.bounds.map(|bound| bound / p.typical())).collect();
        let amounts = bounded_linear(&columns, &rest, weights, &bounds)?;
        let mut residuals = rest;
        for (column, amount) in columns.iter().zip(&amounts) {
            residuals.iter_mut().zip(column).for_each(|(r, c)| *r -= amount * c);
        }
        for ((value, amount), p) in values.iter_mut().zip(&amounts).zip(free) {
            *value = amount * p.typical();
        }
        Some(Solution { values, residuals })
    }

    /// Intervals and what can be told.
    fn described(&self, solution: Solution, weights: Vec<f64>, ended: Ended) -> Fitted {
        let structure = self.structure.clone();
        let Solution { values, residuals } = solution;
        let count = structure.free.len();
        let at_bound = |k: usize| {
            let Parameter { bounds: [low, high], .. } = structure.free[k];
            let near = 1e-9 * structure.free[k].typical();
            values[k] - low <= near || high - values[k] <= near
        };
        let moving: Vec<usize> = (0..count).filter(|&k| !at_bound(k)).collect();
        let columns: Vec<Vec<f64>> = moving.iter().map(|&k| structure.derivative(&values, k, self.points)).collect();
        let lengths: Vec<f64> = columns.iter().map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
        let jacobian = DMatrix::from_fn(self.points.len(), moving.len(), |row, k| {
            columns[k][row] / lengths[k].max(f64::MIN_POSITIVE)
        });
        let effective = effective_size(&residuals, self.points);
        let mut half_widths = vec![None; count];
        let (mut singular_values, mut weak) = (Vec::new(), Vec::new());
        if !moving.is_empty() && jacobian.iter().all(|v| v.is_finite()) {
            let counts = |row: usize| weights[row] >= 1.0;
            let counting = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |row, k| {
                if counts(row) { jacobian[(row, k)] } else { 0.0 }
            });
            let svd = counting.svd(false, true);
            let v_t = svd.v_t.expect("asked for");
            let largest = svd.singular_values.max();
            singular_values = svd.singular_values.iter().map(|s| s / largest).collect();
            singular_values.sort_by(|a, b| b.total_cmp(a));
            let mut weakest: Vec<usize> =
                (0..moving.len()).filter(|&k| svd.singular_values[k] < WEAK * largest).collect();
            weakest.sort_by(|a, b| svd.singular_values[*a].total_cmp(&svd.singular_values[*b]));
            weak = weakest
                .into_iter()
                .map(|k| {
                    let shares = moving.iter().enumerate().map(|(i, &of)| (of, v_t[(k, i)]));
                    let largest = v_t.row(k).amax();
                    shares.filter(|(_, share)| share.abs() > 0.2 * largest).collect()
                })
                .collect();
            // With J = U S Vᵀ the covariance is V S⁻¹ Uᵀ Ψ² U S⁻¹ Vᵀ, and the leverages are the squares of the rows of U.
            let degrees = (effective - count as f64).max(1.0);
            let inflation = self.points.len() as f64 / effective;
            let quantile = StudentsT::new(0.0, 1.0, degrees).map_or(1.96, |t| t.inverse_cdf(0.975));
            let back = v_t.transpose() * DMatrix::from_diagonal(&svd.singular_values.map(|s| 1.0 / s.max(1e-300)));
            let mut inner = &jacobian * &back;
            for (row, mut of_point) in inner.row_iter_mut().enumerate() {
                let leverage = if counts(row) { of_point.norm_squared() } else { 0.0 };
                of_point *= weights[row] * residuals[row] / (1.0 - leverage).max(1e-6);
            }
            let spread = &back * inner.tr_mul(&inner) * back.transpose();
            for (i, &k) in moving.iter().enumerate() {
                half_widths[k] = Some(quantile * (spread[(i, i)] * inflation).sqrt() / lengths[i]);
            }
        }
        let parameters = structure.at(&values);
        let scale = robust_scale(&residuals);
        Fitted {
            structure,
            parameters,
            values,
            half_widths,
            residuals,
            weights,
            scale,
            effective,
            singular_values,
            weak,
            ended,
        }
    }
}

/// Weighted least squares with bounds: a coefficient that leaves them is put there, the others are solved for anew.
fn bounded_linear(columns: &[Vec<f64>], right: &[f64], weights: &[f64], bounds: &[[f64; 2]]) -> Option<Vec<f64>> {
    let mut amounts = vec![0.0; columns.len()];
    let mut open: Vec<usize> = (0..columns.len()).collect();
    let roots: Vec<f64> = weights.iter().map(|w| w.sqrt()).collect();
    let mut rest: Vec<f64> = right.to_vec();
    if right.len() < columns.len() {
        return None;
    }
    while !open.is_empty() {
        let matrix = DMatrix::from_fn(right.len(), open.len(), |row, k| roots[row] * columns[open[k]][row]);
        let lengths: Vec<f64> = matrix.column_iter().map(|c| c.norm()).collect();
        if !lengths.iter().all(|length| length.is_finite() && *length > 0.0) {
            return None;
        }
        let scaled = DMatrix::from_fn(matrix.nrows(), open.len(), |row, k| matrix[(row, k)] / lengths[k]);
        let mut target = DVector::from_fn(right.len(), |row, _| roots[row] * rest[row]);
        let qr = scaled.qr();
        qr.q_tr_mul(&mut target);
        let upper = qr.r();
        let solved = upper.solve_upper_triangular(&target.rows(0, open.len()).into_owned())?;
        for (k, &at) in open.iter().enumerate() {
            amounts[at] = solved[k] / lengths[k];
        }
        let outside = open.iter().position(|&k| !(bounds[k][0]..=bounds[k][1]).contains(&amounts[k]));
        let Some(outside) = outside else { return Some(amounts) };
        let stopped = open.remove(outside);
        amounts[stopped] = amounts[stopped].clamp(bounds[stopped][0], bounds[stopped][1]);
        rest.iter_mut().zip(&columns[stopped]).for_each(|(r, c)| *r -= amounts[stopped] * c);
    }
    Some(amounts)
}

/// Standard deviation from the median of |r|; never zero.
fn robust_scale(residuals: &[f64]) -> f64 {
    let absolute: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    (median(&absolute) / 0.6745).max(1e-9)
}

/// Number of independent points that residuals are worth.
pub fn effective_size(residuals: &[f64], points: &[Point]) -> f64 {
    let count = residuals.len() as f64;
    let variance = residuals.iter().map(|r| r * r).sum::<f64>() / count;
    let neighbours = (1..residuals.len()).filter(|&k| points[k].recording == points[k - 1].recording);
    let products: Vec<f64> = neighbours.map(|k| residuals[k] * residuals[k - 1]).collect();
    let correlation = products.iter().sum::<f64>() / (products.len().max(1) as f64 * variance);
    let correlation = if correlation.is_finite() { correlation.clamp(0.0, 0.999) } else { 0.0 };
    count * (1.0 - correlation) / (1.0 + correlation)
}

/// Evenly spread numbers between 0 and 1.
fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut share) = (0.0, 1.0);
    while index > 0 {
        share /= base as f64;
        value += share * (index % base) as f64;
        index /= base;
    }
    value
}
