//! What of a force model can be fitted to points: which parameters act on the force at all, which of them act linearly,
//! and which can be told apart.
//!
//! # Model
//! The free parameters of a model are those of its group, `muscle.damping` where the muscle moves, and for a model of the
//! braid `muscle.thread_length` and `muscle.turns` where these are to be fitted. Nothing is declared twice: a set of
//! parameters acts linearly where the force is affine in all of them together, which is tried out, and the largest such
//! set is solved for directly. Then the derivatives of the force are orthogonalised one after the other; a parameter whose
//! derivative is a combination of those before it is held at its given value. So E and δ come as a product, and
//! δ stays where it is.

use super::points::{Point, thinned};
use crate::muscle::{ForceModelName, ForceModels};
use crate::parameters::Parameters;
use crate::variables::{Declared, Kind, Scalar, Variable};
use nalgebra::DVector;
use serde::Serialize;

/// Whether the braid is as given or fitted too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Braid {
    /// Thread length and turns are those of the given parameters.
    Given,
    /// They are fitted where the force tells them.
    Fitted,
}

/// A parameter that is fitted.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its declaration.
    pub variable: &'static Variable,
    /// Value that is given.
    pub given: f64,
    /// Smallest and largest value of a fit.
    pub bounds: [f64; 2],
}

impl Parameter {
    /// A change of this size matters.
    pub fn typical(&self) -> f64 {
        if self.given == 0.0 { self.variable.unit.nominal } else { self.given.abs() }
    }
}

/// A parameter that is not fitted, and why.
#[derive(Debug, Clone, Serialize)]
pub struct Held {
    /// Full name.
    pub name: &'static str,
    /// Value, SI.
    pub value: f64,
    /// Why.
    pub reason: String,
}

/// A force model with the parameters that points can tell.
#[derive(Debug, Clone)]
pub struct Structure {
    /// The model.
    pub model: ForceModelName,
    /// What was asked of the braid.
    pub braid: Braid,
    /// Where parameters have their given values.
    pub base: Parameters,
    /// Free parameters: first those that act linearly.
    pub free: Vec<Parameter>,
    /// How many act linearly.
    pub linear: usize,
    /// Parameters of the model that are not free.
    pub held: Vec<Held>,
}

/// Most points at which the structure is tried out.
const PROBES: usize = 200;
/// Relative deviation from an affine function, by rounding.
const AFFINE: f64 = 1e-9;
/// A derivative counts as a combination of others where less than this share of it is left.
const DEPENDENT: f64 = 1e-6;

/// Choices of whoever makes a model, and not properties of a muscle.
const CHOSEN: [&str; 5] = [
    "spring.blend_end",
    "spring.blend_start",
    "tondu_lopez_friction.smoothing_velocity",
    "tondu_lopez_kq.high_pressure",
    "tondu_lopez_kq.low_pressure",
];

const BRAID: [&str; 2] = ["muscle.thread_length", "muscle.turns"];
const DAMPING: &str = "muscle.damping";

/// Name of a model, as in files.
pub fn model_name(model: ForceModelName) -> &'static str {
    ForceModelName::CHOICES[position(model)].name
}

fn position(model: ForceModelName) -> usize {
    model as usize - 1
}

/// All models, in their order.
pub fn all_models() -> Vec<ForceModelName> {
    (1..=ForceModelName::CHOICES.len()).map(|number| ForceModelName::from_number(number as f64)).collect()
}

/// Forces in N at points, shape `(n_points,)`; NaN where the model has none.
pub fn forces(parameters: &Parameters, points: &[Point]) -> Vec<f64> {
    let Parameters { muscle, force_models, .. } = parameters;
    let force = |point: &Point| {
        let Point { gauge_pressure, contraction, contraction_velocity, .. } = *point;
        force_models.moving_force(muscle, gauge_pressure, contraction, contraction_velocity)
            - muscle.damping * contraction_velocity
    };
    points.iter().map(force).collect()
}

impl Structure {
    /// What of a model `points` can tell; `given` holds the geometry and where fits start.
    pub fn of(model: ForceModelName, braid: Braid, given: &Parameters, points: &[Point]) -> Self {
        let mut base = *given;
        base.muscle.force_model = model;
        // Coefficients are those of this muscle and need no correction.
        let neutral = crate::muscle::Muscle::default();
        base.muscle.area_scale = neutral.area_scale;
        base.muscle.elastic_scale = neutral.elastic_scale;
        base.muscle.area_tilt = neutral.area_tilt;
        base.muscle.area_bend = neutral.area_bend;
        base.muscle.area_wave = neutral.area_wave;
        base.muscle.elastic_tilt = neutral.elastic_tilt;
        let probes: Vec<Point> = thinned(points.len(), PROBES).into_iter().map(|k| points[k]).collect();
        let own = candidates(&base, ForceModels::GROUPS[position(model)], points);
        let extra: &[&str] = if braid == Braid::Fitted { &BRAID } else { &[] };
        let others = extra.iter().chain([&DAMPING]).filter_map(|name| parameter(&base, name, points));
        let mut all: Vec<Parameter> = own.into_iter().chain(others).collect();
        let mut found = Self { model, braid, base, free: all.clone(), linear: 0, held: Vec::new() };
        let linear = found.largest_affine_set(&probes);
        // In this order the first that depend on others, and are held, are the last of this list.
        all.sort_by_key(|p| (!linear.contains(&p.variable.name), BRAID.contains(&p.variable.name)));
        found.free = all;
        found.linear = linear.len();
        found.hold_what_cannot_be_told(&probes);
        found
    }

    /// Parameters with free ones at values, in the order of [`Structure::free`].
    pub fn at(&self, values: &[f64]) -> Parameters {
        let mut parameters = self.base;
        let mut change = |variable: &'static Variable, old: f64| {
            let place = self.free.iter().position(|p| p.variable.name == variable.name);
            place.map_or(old, |place| values[place])
        };
        parameters.muscle.visit_mut(&mut change);
        parameters.force_models.visit_mut(&mut change);
        parameters
    }

    /// Whether anything of the braid is fitted.
    pub fn fits_braid(&self) -> bool {
        self.free.iter().any(|p| BRAID.contains(&p.variable.name))
    }

    /// Name for people.
    pub fn label(&self) -> String {
        let name = model_name(self.model);
        if self.fits_braid() { format!("{name}, braid fitted") } else { name.to_owned() }
    }

    /// Names of parameters in which the force is affine together: the largest set that trying finds.
    fn largest_affine_set(&self, probes: &[Point]) -> Vec<&'static str> {
        let mut best = Vec::new();
        for first in 0..self.free.len() {
            let mut set = vec![first];
            if !self.is_affine(&set, probes) {
                continue;
            }
            for next in (0..self.free.len()).filter(|next| *next != first) {
                set.push(next);
                if !self.is_affine(&set, probes) {
                    set.pop();
                }
            }
            if set.len() > best.len() {
                best = set;
            }
        }
        best.into_iter().map(|k| self.free[k].variable.name).collect()
    }

    /// Whether f(a + c) + f(0) = f(a) + f(c) for parameters `set`, the others near their given values.
    fn is_affine(&self, set: &[usize], probes: &[Point]) -> bool {
        let place = |weights: [f64; 2]| {
            let value = |(k, p): (usize, &Parameter)| {
                let [a, c] = [uneven(2 * k), uneven(2 * k + 1)].map(|share| share * p.typical());
                if set.contains(&k) { weights[0] * a + weights[1] * c } else { nearby(k, p) }
            };
            forces(&self.at(&self.free.iter().enumerate().map(value).collect::<Vec<_>>()), probes)
        };
        let [both, none, a, c] = [[1.0, 1.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(place);
        let size = both.iter().chain(&a).chain(&c).map(|force| force.abs()).fold(0.0, f64::max);
        (0..probes.len()).all(|k| (both[k] + none[k] - a[k] - c[k]).abs() <= AFFINE * size)
    }

    /// Holds parameters whose effect on the force is none, or a combination of that of others.
    fn hold_what_cannot_be_told(&mut self, probes: &[Point]) {
        let place: Vec<f64> = self.free.iter().enumerate().map(|(k, p)| nearby(k, p)).collect();
        let size = forces(&self.at(&place), probes).iter().fold(0.0, |size: f64, force| size.max(force.abs()));
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let mut told: Vec<Parameter> = Vec::new();
        let mut told_linear = 0;
        let mut columns: Vec<DVector<f64>> = Vec::new();
        for (k, parameter) in self.free.iter().enumerate() {
            let column = DVector::from_vec(self.derivative(&place, k, probes)) * parameter.typical();
            let length = column.norm();
            let left = basis.iter().fold(column.clone(), |left, b| &left - b * b.dot(&left));
            let left = basis.iter().fold(left.clone(), |left, b| &left - b * b.dot(&left));
            if length.is_finite() && length > 1e-9 * size.max(f64::MIN_POSITIVE) && left.norm() > DEPENDENT * length {
                basis.push(left.normalize());
                columns.push(column);
                told.push(*parameter);
                told_linear += usize::from(k < self.linear);
                continue;
            }
            let reason = if length > 1e-9 * size {
                let with = columns.iter().zip(&told).filter(|(c, _)| c.dot(&column).abs() > 0.5 * c.norm() * length);
                let names: Vec<&str> = with.map(|(_, p)| p.variable.name).collect();
                format!("the force tells it only in combination with {}", names.join(", "))
            } else {
                "the force at these points does not depend on it".to_owned()
            };
            self.held.push(Held { name: parameter.variable.name, value: parameter.given, reason });
        }
        // The damping of a resting muscle, and a braid that the model does not know, are not worth a word.
        let own = ForceModels::GROUPS[position(self.model)];
        self.held.retain(|held| held.name.starts_with(&format!("{own}.")) || held.reason.contains("combination"));
        self.free = told;
        self.linear = told_linear;
    }

    /// ∂F/∂parameter at points.
    pub fn derivative(&self, values: &[f64], k: usize, points: &[Point]) -> Vec<f64> {
        // The force is affine in the first: any step is exact, and a long one loses no digits.
        let share = if k < self.linear { 1.0 } else { 1e-5 };
        let step = share * values[k].abs().max(1e-3 * self.free[k].typical());
        let at = |change: f64| {
            let mut values = values.to_vec();
            values[k] += change;
            forces(&self.at(&values), points)
        };
        let (above, below) = (at(step), at(-step));
        above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * step)).collect()
    }
}

/// Free parameters of a group.
fn candidates(base: &Parameters, group: &str, points: &[Point]) -> Vec<Parameter> {
    let mut names = Vec::new();
    base.force_models.visit(&mut |variable, _| {
        if variable.group() == group && matches!(variable.kind, Kind::Real) && !CHOSEN.contains(&variable.name) {
            names.push(variable.name);
        }
    });
    names.into_iter().filter_map(|name| parameter(base, name, points)).collect()
}

fn parameter(base: &Parameters, name: &str, points: &[Point]) -> Option<Parameter> {
    let (variable, given) = base.find(name)?;
    let mut bounds = [variable.min, variable.max];
    if BRAID.contains(&name) {
        let rest = base.muscle.rest_length;
        let longest = points.iter().map(|point| rest - point.contraction).fold(rest, f64::max);
        // Threads longer than the muscle at its longest, and at 57 degrees at most.
        let own = if name == BRAID[0] { [1.001 * longest, 1.85 * rest] } else { [0.2 * given, 5.0 * given] };
        bounds = [bounds[0].max(own[0]), bounds[1].min(own[1])];
    }
    Some(Parameter { variable, given: given.clamp(bounds[0], bounds[1]), bounds })
}

/// A value near the given one, where no two effects cancel by chance.
fn nearby(k: usize, parameter: &Parameter) -> f64 {
    let shift = if parameter.given == 0.0 { 1.0 } else { 0.01 };
    (parameter.given + shift * uneven(k) * parameter.typical()).clamp(parameter.bounds[0], parameter.bounds[1])
}

/// Numbers between 0.5 and 1 without a pattern.
fn uneven(k: usize) -> f64 {
    0.5 + 0.5 * (0.618_033_988_749_895 * (k + 1) as f64).fract()
}

/// How many static points a fit of these models needs: twice as many as the largest has parameters, and two.
pub fn fewest_points(models: &[ForceModelName], given: &Parameters) -> usize {
    let own = |model: &ForceModelName| candidates(given, ForceModels::GROUPS[position(*model)], &[]).len();
    2 * models.iter().map(own).max().unwrap_or(0) + 2
}
