//! Bounded nonlinear least squares.
//!
//! # Model
//! Levenberg–Marquardt on Σ r², each step the minimum of the damped quadratic within the bounds. Derivatives are forward
//! differences, taken in parallel, updated from what steps do, and taken anew where one does not do what they promised, and at the end. Those of some
//! parameters may be given: they cost nothing then, and are only updated. A prior counts as one more residual.
//!
//! # Reference
//! D. Marquardt (1963), doi 10.1137/0111030; updates: C. Broyden (1965), doi 10.1090/S0025-5718-1965-0198670-6; bounds by
//! active sets, as in J. Nocedal, S. Wright (2006), Numerical Optimization, algorithm 16.3. Own code because `levenberg-marquardt` 0.15 has no bounds.

use nalgebra::{DMatrix, DVector, DVectorView};
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
    /// Mean and standard deviation of what is known beforehand.
    pub prior: Option<(f64, f64)>,
}

impl Free {
    /// The same, counted from a value.
    pub fn from(&self, value: f64) -> Self {
        let prior = self.prior.map(|(mean, deviation)| (mean - value, deviation));
        let (start, lower, upper) = (self.start - value, self.lower - value, self.upper - value);
        Self { start, lower, upper, typical: self.typical, prior }
    }
}

/// When a fit stops.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// How often derivatives are taken at most.
    pub iterations: usize,
    /// Relative decrease of the cost in one iteration below which a fit is at its end.
    pub small_decrease: f64,
    /// Cost above which a fit is worth nothing: it is given up where it would not get there at its pace; infinite where any is worth it.
    pub goal: f64,
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// No step makes the sum of squares noticeably smaller.
    Converged,
    /// Still getting smaller after derivatives were taken as often as is allowed.
    IterationLimit,
    /// Getting smaller so slowly that it would not come to the goal.
    GivenUp,
    /// The residuals could not be computed at the start.
    NoStart,
}

/// What a fit found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Values of the parameters.
    pub parameters: Vec<f64>,
    /// Residuals there, priors not among them; shape `(n_residuals,)`.
    pub residuals: Vec<f64>,
    /// Σ r² there, with the priors.
    pub cost: f64,
    /// How it ended.
    pub ended: Ended,
}

/// Steps of growing damping that are tried from one place, where derivatives are fresh; else one is.
const TRIALS: usize = 5;

/// Iterations over which the pace of a fit is judged: a single one may be slow.
const PACE: usize = 3;

/// By which share of what derivatives promised a step may miss it for them to be good enough for the next one, updated.
const SURPRISE: f64 = 0.25;

/// What came of the steps from a place.
enum Next {
    /// A place whose cost is smaller, and by how much it was expected to be.
    Better(Place, f64),
    /// None that was tried was better.
    Worse,
    /// None is worth the way.
    NotWorth,
}

/// What is minimised.
struct Problem<'a, R> {
    residuals: &'a R,
    free: &'a [Free],
    /// How many of the parameters, the first ones, have derivatives that are not known.
    unknown: usize,
}

/// A place with its residuals.
struct Place {
    parameters: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
}

/// Minimises the sum of squares of `residuals`, which gives `None` where it cannot be computed. `known` are derivatives of
/// the residuals by the last parameters, good enough to find the way.
pub fn fit<R>(residuals: &R, free: &[Free], known: &[Vec<f64>], effort: Effort) -> Fit
where
    R: Fn(&[f64]) -> Option<Vec<f64>> + Sync,
{
    let problem = Problem { residuals, free, unknown: free.len() - known.len() };
    let start: Vec<f64> = free.iter().map(|f| f.start.clamp(f.lower, f.upper)).collect();
    let Some(mut current) = problem.place(&start) else {
        return Fit { parameters: start, residuals: Vec::new(), cost: f64::INFINITY, ended: Ended::NoStart };
    };
    let mut columns = vec![Vec::new(); problem.unknown];
    columns.extend(known.iter().zip(&free[problem.unknown..]).map(|(slope, free)| scaled(slope, free.typical)));
    let (mut damping, mut ended) = (1e-3, Ended::IterationLimit);
    let mut costs = vec![current.cost];
    for left in (0..effort.iterations).rev() {
        problem.look(&mut columns, &current);
        if problem.follow(&mut columns, &mut current, &mut damping, effort.small_decrease) {
            ended = Ended::Converged;
            break;
        }
        costs.push(current.cost);
        if is_too_slow(&costs, left, effort.goal) {
            ended = Ended::GivenUp;
            break;
        }
    }
    Fit { parameters: current.parameters, residuals: current.residuals, cost: current.cost, ended }
}

/// Whether a fit whose cost went so from iteration to iteration would end above a goal after as many as are left.
fn is_too_slow(costs: &[f64], left: usize, goal: f64) -> bool {
    let (Some(now), Some(before)) = (costs.last(), costs.iter().nth_back(PACE)) else { return false };
    now - (before - now) / PACE as f64 * left as f64 > goal
}

/// Derivatives of the residuals by the first of the parameters at a place, one column each, as [`fit`] takes them.
pub fn derivatives<R>(residuals: &R, free: &[Free], at: &[f64], here: &[f64]) -> Vec<Vec<f64>>
where
    R: Fn(&[f64]) -> Option<Vec<f64>> + Sync,
{
    (0..free.len())
        .into_par_iter()
        .map(|k| {
            // Away from the nearer bound, so that the shifted point is allowed.
            let inwards = if at[k] - free[k].lower > free[k].upper - at[k] { -1.0 } else { 1.0 };
            let difference = inwards * 1e-3 * free[k].typical;
            let mut shifted = at.to_vec();
            shifted[k] += difference;
            let shifted = residuals(&shifted).filter(|r| all_finite(r)).unwrap_or_else(|| here.to_vec());
            shifted.iter().zip(here).map(|(after, before)| (after - before) / difference).collect()
        })
        .collect()
}

fn all_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

impl<R: Fn(&[f64]) -> Option<Vec<f64>> + Sync> Problem<'_, R> {
    fn place(&self, parameters: &[f64]) -> Option<Place> {
        let residuals = (self.residuals)(parameters).filter(|r| all_finite(r))?;
        let priors = self.free.iter().zip(parameters).filter_map(|(free, value)| {
            let (mean, deviation) = free.prior?;
            Some(((value - mean) / deviation).powi(2))
        });
        let cost = residuals.iter().map(|r| r * r).sum::<f64>() + priors.sum::<f64>();
        Some(Place { parameters: parameters.to_vec(), residuals, cost })
    }

    /// Takes the derivatives that are not known anew at a place, times the typical changes; one column per parameter.
    fn look(&self, columns: &mut [Vec<f64>], at: &Place) {
        let unknown = &self.free[..self.unknown];
        let derivatives = derivatives(self.residuals, unknown, &at.parameters, &at.residuals);
        for ((column, derivative), free) in columns.iter_mut().zip(derivatives).zip(unknown) {
            *column = scaled(&derivative, free.typical);
        }
    }

    /// JᵀJ and Jᵀr, with parameters in their typical sizes.
    fn normal_equations(&self, columns: &[Vec<f64>], at: &Place) -> (DMatrix<f64>, DVector<f64>) {
        let count = self.free.len();
        let mut normal = normal_matrix(columns);
        let mut gradient = DVector::from_fn(count, |i, _| dot(&columns[i], &at.residuals));
        for (k, free) in self.free.iter().enumerate() {
            if let Some((mean, deviation)) = free.prior {
                let weight = free.typical / deviation;
                normal[(k, k)] += weight * weight;
                gradient[k] += weight * (at.parameters[k] - mean) / deviation;
            }
        }
        (normal, gradient)
    }

    /// Goes on from a place for as long as steps do what derivatives promise, which are fresh there and then updated; whether that is the end,
    /// which only fresh ones can tell.
    fn follow(&self, columns: &mut [Vec<f64>], from: &mut Place, damping: &mut f64, small_decrease: f64) -> bool {
        let mut are_fresh = true;
        loop {
            let (normal, gradient) = self.normal_equations(columns, from);
            let least = small_decrease * from.cost;
            let trials = if are_fresh { TRIALS } else { 1 };
            let (better, expected) = match self.better(&normal, &gradient, from, damping, least, trials) {
                Next::Better(place, expected) => (place, expected),
                // What updated derivatives promise may be less than there is.
                Next::Worse | Next::NotWorth => return are_fresh,
            };
            let before = std::mem::replace(from, better);
            let decrease = before.cost - from.cost;
            let are_good = (decrease / expected - 1.0).abs() < SURPRISE;
            if decrease <= least && are_fresh {
                return true;
            }
            let step = self.step_between(&before.parameters, &from.parameters);
            update(columns, &step, &before.residuals, &from.residuals);
            if !are_good {
                return false;
            }
            are_fresh = false;
        }
    }

    /// The next place whose cost is smaller, if there is one that is worth the way, with so many trials.
    fn better(
        &self,
        normal: &DMatrix<f64>,
        gradient: &DVector<f64>,
        from: &Place,
        damping: &mut f64,
        least: f64,
        trials: usize,
    ) -> Next {
        for _ in 0..trials {
            let trial = step(normal, gradient, self.free, &from.parameters, *damping);
            let expected = self.expected_decrease(normal, gradient, from, &trial);
            if expected < least {
                return Next::NotWorth;
            }
            if let Some(better) = self.place(&trial).filter(|trial| trial.cost < from.cost) {
                *damping = (*damping * 0.1).max(1e-12);
                return Next::Better(better, expected);
            }
            *damping *= 10.0;
        }
        Next::Worse
    }

    /// The way from some parameters to others, in their typical sizes.
    fn step_between(&self, from: &[f64], to: &[f64]) -> DVector<f64> {
        DVector::from_fn(from.len(), |k, _| (to[k] - from[k]) / self.free[k].typical)
    }

    /// Decrease of the cost that the derivatives promise for a step.
    fn expected_decrease(&self, normal: &DMatrix<f64>, gradient: &DVector<f64>, from: &Place, trial: &[f64]) -> f64 {
        let step = self.step_between(&from.parameters, trial);
        -2.0 * gradient.dot(&step) - (normal * &step).dot(&step)
    }
}

/// Changes derivatives by as little as makes them promise what a step did.
fn update(columns: &mut [Vec<f64>], step: &DVector<f64>, before: &[f64], after: &[f64]) {
    let mut missed: Vec<f64> = after.iter().zip(before).map(|(after, before)| after - before).collect();
    for (column, by) in columns.iter().zip(step.iter()) {
        missed.iter_mut().zip(column).for_each(|(missed, slope)| *missed -= slope * by);
    }
    for (column, by) in columns.iter_mut().zip(step.iter()) {
        let share = by / step.norm_squared();
        column.iter_mut().zip(&missed).for_each(|(slope, missed)| *slope += share * missed);
    }
}

fn scaled(values: &[f64], by: f64) -> Vec<f64> {
    values.iter().map(|value| value * by).collect()
}

/// Scalar product of two series of the same length; several sums side by side, since one alone takes most of its time waiting.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let [a, b] = [a, b].map(|series| DVectorView::from_slice(series, series.len()));
    a.dot(&b)
}

/// Products of all pairs of columns.
pub fn normal_matrix(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let mut normal = DMatrix::zeros(columns.len(), columns.len());
    for i in 0..columns.len() {
        for j in 0..=i {
            let product = dot(&columns[i], &columns[j]);
            normal[(i, j)] = product;
            normal[(j, i)] = product;
        }
    }
    normal
}

/// Residuals to which columns are added in amounts within bounds, to see what others take off beside these.
pub struct Adapting {
    /// The residuals.
    pub residuals: Vec<f64>,
    columns: Vec<Vec<f64>>,
    free: Vec<Free>,
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Adapting {
    /// One amount per column, and from what it is free.
    pub fn new(residuals: Vec<f64>, columns: Vec<Vec<f64>>, free: Vec<Free>) -> Self {
        let normal = normal_matrix(&columns);
        let gradient = DVector::from_fn(columns.len(), |k, _| dot(&columns[k], &residuals));
        Self { residuals, columns, free, normal, gradient }
    }

    /// How much Σ r², priors among them, can decrease when other columns are added, too, in amounts within their bounds.
    pub fn decrease(&self, others: &[Vec<f64>], free: &[Free]) -> f64 {
        let columns: Vec<&Vec<f64>> = others.iter().chain(&self.columns).collect();
        let (count, new) = (columns.len(), others.len());
        let free: Vec<Free> = free.iter().chain(&self.free).copied().collect();
        let mut normal = DMatrix::zeros(count, count);
        normal.view_range_mut(new.., new..).copy_from(&self.normal);
        let mut gradient = DVector::zeros(count);
        gradient.rows_range_mut(new..).copy_from(&self.gradient);
        for k in 0..new {
            gradient[k] = dot(columns[k], &self.residuals);
            for other in k..count {
                let product = dot(columns[k], columns[other]);
                (normal[(k, other)], normal[(other, k)]) = (product, product);
            }
        }
        for (k, free) in free.iter().enumerate() {
            if let Some((mean, deviation)) = free.prior {
                normal[(k, k)] += deviation.powi(-2);
                gradient[k] -= mean / deviation.powi(2);
            }
        }
        let bounds: Vec<(f64, f64)> = free.iter().map(|free| (free.lower, free.upper)).collect();
        let amounts = bounded_minimum(&damped(&normal, SINGULAR), &gradient, &bounds);
        -2.0 * gradient.dot(&amounts) - (&normal * &amounts).dot(&amounts)
    }
}

/// The damped step of Gauss and Newton within the bounds.
fn step(normal: &DMatrix<f64>, gradient: &DVector<f64>, free: &[Free], parameters: &[f64], damping: f64) -> Vec<f64> {
    let both = free.iter().zip(parameters);
    let bounds: Vec<(f64, f64)> =
        both.map(|(free, at)| ((free.lower - at) / free.typical, (free.upper - at) / free.typical)).collect();
    let step = bounded_minimum(&damped(normal, damping), gradient, &bounds);
    let moved = (0..free.len()).map(|k| parameters[k] + step[k] * free[k].typical);
    moved.zip(free).map(|(value, free)| value.clamp(free.lower, free.upper)).collect()
}

/// Share of the diagonal that is added to a matrix that may be singular.
const SINGULAR: f64 = 1e-9;

/// A matrix with a share of its diagonal added, and a little more: it keeps a parameter that nothing depends on where it is.
fn damped(normal: &DMatrix<f64>, share: f64) -> DMatrix<f64> {
    let mut damped = normal.clone();
    damped.set_diagonal(&normal.diagonal().map(|entry| entry * (1.0 + share) + 1e-9));
    damped
}

/// Minimum of gᵀs + sᵀHs/2 for a positive definite H, with s within bounds that hold zero; zero where H is not.
///
/// Active sets: the minimum over the components that are not held is gone for until one meets its bound, which is then
/// held; at such a minimum the one that is held against the steepest descent is let go.
fn bounded_minimum(matrix: &DMatrix<f64>, gradient: &DVector<f64>, bounds: &[(f64, f64)]) -> DVector<f64> {
    let count = bounds.len();
    let mut at = DVector::zeros(count);
    let mut held = vec![false; count];
    // Each bound is met and left a few times at most; the limit is against rounding.
    for _ in 0..20 * count {
        let moving: Vec<usize> = (0..count).filter(|&k| !held[k]).collect();
        let slopes = gradient + matrix * &at;
        let reduced = DMatrix::from_fn(moving.len(), moving.len(), |i, j| matrix[(moving[i], moving[j])]);
        let Some(factor) = reduced.cholesky() else { return DVector::zeros(count) };
        let way = factor.solve(&DVector::from_fn(moving.len(), |i, _| -slopes[moving[i]]));
        let until_bound = |(&k, &change): (&usize, &f64)| {
            let bound = if change > 0.0 { bounds[k].1 } else { bounds[k].0 };
            if change == 0.0 { (f64::INFINITY, k, bound) } else { ((bound - at[k]) / change, k, bound) }
        };
        let first = moving.iter().zip(way.iter()).map(until_bound).min_by(|a, b| a.0.total_cmp(&b.0));
        let share = first.map_or(1.0, |(share, ..)| share.min(1.0));
        moving.iter().zip(way.iter()).for_each(|(&k, change)| at[k] += share * change);
        if let Some((_, k, bound)) = first.filter(|(share, ..)| *share < 1.0) {
            (at[k], held[k]) = (bound, true);
            continue;
        }
        let slopes = gradient + matrix * &at;
        // How steeply the cost falls towards the inside, where both bounds are not the same.
        let inwards = |k: usize| if at[k] > bounds[k].0 { slopes[k] } else { -slopes[k] } / matrix[(k, k)].sqrt();
        let steepest = (0..count).filter(|&k| held[k] && bounds[k].0 < bounds[k].1).map(|k| (inwards(k), k));
        let Some((_, k)) = steepest.filter(|(fall, _)| *fall > 1e-9).max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        held[k] = false;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    const EFFORT: Effort = Effort { iterations: 60, small_decrease: 1e-6, goal: f64::INFINITY };

    fn free(start: f64, lower: f64, upper: f64) -> Free {
        Free { start, lower, upper, typical: 1.0, prior: None }
    }

    #[test]
    fn a_fit_that_would_not_come_to_its_goal_is_given_up() {
        // Rosenbrock's valley takes its time; its end leaves nothing.
        let valley = |p: &[f64]| Some(vec![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0], 3.0]);
        let free = [-1.2, 1.0].map(|start| Free { start, lower: -5.0, upper: 5.0, typical: 1.0, prior: None });
        let ended = |goal: f64| fit(&valley, &free, &[], Effort { goal, ..EFFORT }).ended;
        assert_eq!(
            [ended(f64::INFINITY), ended(9.1), ended(8.0)],
            [Ended::Converged, Ended::Converged, Ended::GivenUp]
        );
        // 12.3 less each time: 63 after three more, and less than nothing after ten.
        let costs = [137.0, 123.0, 111.0, 100.0];
        assert!(is_too_slow(&costs, 3, 60.0) && !is_too_slow(&costs, 3, 70.0) && !is_too_slow(&costs, 10, 0.0));
        assert!(!is_too_slow(&costs[..3], 3, 1.0), "too early to tell");
    }

    #[test]
    fn rosenbrock_is_solved() {
        let rosenbrock = |p: &[f64]| Some(vec![1.0 - p[0], 10.0 * (p[1] - p[0] * p[0])]);
        let found = fit(&rosenbrock, &[free(-1.2, -5.0, 5.0), free(1.0, -5.0, 5.0)], &[], EFFORT);
        assert_eq!(found.ended, Ended::Converged);
        assert!((found.parameters[0] - 1.0).abs() < 1e-3 && (found.parameters[1] - 1.0).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn derivatives_that_hold_are_taken_at_the_start_and_the_end() {
        let evaluations = std::sync::atomic::AtomicUsize::new(0);
        let nearly_linear = |p: &[f64]| {
            evaluations.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            Some(p.iter().map(|p| p - 1.0 + 0.01 * p.sin()).chain([0.5]).collect())
        };
        let found = fit(&nearly_linear, &[free(0.3, -9.0, 9.0); 5], &[], EFFORT);
        assert!((found.cost - 0.25).abs() < 1e-6, "{found:?}");
        // The start, five derivatives twice, and a few steps.
        assert!(evaluations.into_inner() < 11 + 5);
    }

    #[test]
    fn an_end_is_one_by_derivatives_taken_there() {
        // Two decays and a level, from starts all around.
        let course = |p: &[f64], t: f64| p[0] * (-p[1] * t).exp() + p[2] * (-p[3] * t).exp() + p[4];
        let truth = [2.0, 3.0, -1.0, 0.4, 0.5];
        let times: Vec<f64> = (0..60).map(|k| 0.1 * f64::from(k)).collect();
        let noise = |t: f64| 0.02 * (37.0 * t).sin();
        let residuals = |p: &[f64]| Some(times.iter().map(|&t| course(&truth, t) + noise(t) - course(p, t)).collect());
        let mut ends = 0;
        for k in 0..100 {
            let off = |which: f64| 1.0 + 0.6 * (f64::from(k) * 1.7 + which * 2.3).sin();
            let start: Vec<Free> =
                truth.iter().zip(0..).map(|(value, which)| free(value * off(f64::from(which)), -9.0, 9.0)).collect();
            let found = fit(&residuals, &start, &[], EFFORT);
            if found.ended != Ended::Converged {
                continue;
            }
            ends += 1;
            let columns = derivatives(&residuals, &start, &found.parameters, &found.residuals);
            let promised = Adapting::new(found.residuals, columns, vec![free(0.0, -0.1, 0.1); 5]).decrease(&[], &[]);
            assert!(promised < EFFORT.small_decrease * found.cost, "{k}: {promised} of {}", found.cost);
        }
        assert!(ends > 90, "{ends}");
    }

    #[test]
    fn updated_derivatives_promise_what_the_step_did() {
        let mut columns = vec![vec![1.0, 2.0, -1.0], vec![0.5, 0.0, 3.0]];
        let (step, before, after) = (DVector::from_vec(vec![0.3, -0.7]), [1.0, 1.0, 1.0], [0.2, 1.5, -0.4]);
        update(&mut columns, &step, &before, &after);
        for k in 0..3 {
            let promised = before[k] + columns[0][k] * step[0] + columns[1][k] * step[1];
            assert!((promised - after[k]).abs() < 1e-12, "{k}: {promised}");
        }
        // Across the step nothing is known anew.
        assert!((columns[0][0] * 0.7 + columns[1][0] * 0.3 - (1.0 * 0.7 + 0.5 * 0.3)).abs() < 1e-12);
    }

    #[test]
    fn derivatives_from_elsewhere_find_the_way() {
        let residuals = |p: &[f64]| Some(vec![p[0] - 1.0, p[0] + p[1] * p[1] - 5.0, p[1] - 2.0]);
        // Those of y are of y = 0.5, where they are a quarter of what they are at the end.
        let known = [vec![0.0, 1.0, 1.0]];
        let found = fit(&residuals, &[free(0.0, -9.0, 9.0), free(0.5, -9.0, 9.0)], &known, EFFORT);
        assert!((found.parameters[0] - 1.0).abs() < 1e-2 && (found.parameters[1] - 2.0).abs() < 1e-2, "{found:?}");
    }

    #[test]
    fn bounds_hold_and_the_rest_is_still_optimal() {
        // Minimum of (x - 3)² + (x + y)² with x <= 1 is x = 1, y = -1.
        let residuals = |p: &[f64]| Some(vec![p[0] - 3.0, p[0] + p[1]]);
        let found = fit(&residuals, &[free(0.0, -1.0, 1.0), free(0.0, -5.0, 5.0)], &[], EFFORT);
        assert_eq!(found.parameters[0], 1.0);
        assert!((found.parameters[1] + 1.0).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn the_minimum_within_bounds_is_one() {
        // Badly conditioned, as powers of the same variable are; the conditions of Karush, Kuhn and Tucker tell a minimum.
        for seed in 1..200_u32 {
            let random = |k: usize| (f64::from(seed) * 12.9898 + k as f64 * 78.233).sin() * 43758.5453 % 1.0;
            let columns: Vec<Vec<f64>> =
                (0..8).map(|p| (0..40).map(|k| (1.0 + random(k)).powi(p) + 1e-3 * random(50 * k)).collect()).collect();
            let normal = damped(&normal_matrix(&columns), SINGULAR);
            let gradient = DVector::from_fn(8, |k, _| 20.0 * random(1000 + k));
            let bounds: Vec<_> = (0..8).map(|k| (-random(k).abs(), random(9 * k).abs())).collect();
            let at = bounded_minimum(&normal, &gradient, &bounds);
            let slopes = gradient + &normal * &at;
            for (k, (low, high)) in bounds.into_iter().enumerate() {
                let small = 1e-6 * normal[(k, k)].sqrt();
                assert!((low..=high).contains(&at[k]), "{seed}");
                assert!(slopes[k] > -small || at[k] == high, "{seed}: {k} could grow, {}", slopes[k]);
                assert!(slopes[k] < small || at[k] == low, "{seed}: {k} could shrink, {}", slopes[k]);
            }
        }
    }

    #[test]
    fn a_parameter_without_influence_stays() {
        let found =
            fit(&|p: &[f64]| Some(vec![p[0] - 2.0]), &[free(0.0, -5.0, 5.0), free(0.3, -5.0, 5.0)], &[], EFFORT);
        assert!((found.parameters[0] - 2.0).abs() < 1e-6);
        assert!((found.parameters[1] - 0.3).abs() < 1e-9);
    }

    #[test]
    fn a_known_derivative_and_a_prior_are_used() {
        // (x - 1)² + (x + y - 5)² + (y - 1)², the derivatives by y given: the minimum is x = 2, y = 2.
        let residuals = |p: &[f64]| Some(vec![p[0] - 1.0, p[0] + p[1] - 5.0]);
        let y = Free { prior: Some((1.0, 1.0)), ..free(0.0, -9.0, 9.0) };
        let found = fit(&residuals, &[free(0.0, -9.0, 9.0), y], &[vec![0.0, 1.0]], EFFORT);
        assert!((found.parameters[0] - 2.0).abs() < 1e-6 && (found.parameters[1] - 2.0).abs() < 1e-6, "{found:?}");
        assert!((found.cost - 3.0).abs() < 1e-9 && found.residuals.len() == 2);
    }
}
