//! Candidates: the nominal model with its small corrections and the parameters of one effect set free.

use super::Cause;
use super::residuals::{Data, HeldOut};
use crate::effects::{Description, Effects};
use crate::least_squares::{self, Ended, Free};
use crate::parameters::Parameters;
use crate::variables::{Declared, Variable};

/// Corrections that every fit may make, as factors on a nominal value.
const CORRECTIONS: [&str; 3] = ["muscle.area_scale", "muscle.elastic_scale", "muscle.damping"];

/// A parameter as fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedParameter {
    /// Full name.
    pub name: &'static str,
    /// Best value.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
    /// Unit.
    pub unit: &'static str,
}

/// What a fit sets free: the corrections, and one effect or none.
pub struct Candidate {
    effect: Option<&'static Description>,
}

impl Candidate {
    /// The nominal model, corrected within its tolerance.
    pub fn corrections_only() -> Self {
        Self { effect: None }
    }

    /// One candidate per effect.
    pub fn all() -> Vec<Self> {
        Effects::DESCRIPTIONS.iter().map(|effect| Self { effect: Some(effect) }).collect()
    }

    /// Name of the effect.
    pub fn name(&self) -> &'static str {
        self.effect.map_or("nominal", |effect| effect.name)
    }

    /// The free parameters with their bounds: corrections first.
    fn free(&self, nominal: &Parameters, tolerance: f64) -> Vec<(&'static Variable, Free)> {
        let mut free = Vec::new();
        for name in CORRECTIONS {
            let (variable, value) = declared(nominal, name);
            let size = tolerance * value.abs();
            if size > 0.0 {
                free.push((variable, Free { start: value, lower: value - size, upper: value + size, typical: size }));
            }
        }
        for (name, start) in self.effect.into_iter().flat_map(Description::typical) {
            let (variable, _) = declared(nominal, name);
            let bounds = Free { start, lower: variable.min, upper: variable.max, typical: start.abs() };
            free.push((variable, bounds));
        }
        free
    }
}

fn declared(parameters: &Parameters, name: &str) -> (&'static Variable, f64) {
    parameters.find(name).unwrap_or_else(|| panic!("`{name}` is declared"))
}

/// A candidate after its fit.
#[derive(Debug, Clone)]
pub struct Fitted {
    effect: Option<&'static Description>,
    /// The whole model.
    pub parameters: Parameters,
    /// The corrections that were made.
    pub corrections: Vec<FittedParameter>,
    found: Vec<FittedParameter>,
    /// How it does on samples that the fit did not see.
    pub held_out: Option<HeldOut>,
}

impl Fitted {
    /// Fits a candidate to the samples that fits may see; `None` where it cannot be simulated.
    pub fn fit(candidate: &Candidate, nominal: &Parameters, data: &Data, tolerance: f64) -> Option<Self> {
        let free = candidate.free(nominal, tolerance);
        let corrections = free.iter().filter(|(variable, _)| CORRECTIONS.contains(&variable.name)).count();
        let bounds: Vec<Free> = free.iter().map(|(_, free)| *free).collect();
        let with = |values: &[f64]| {
            let mut parameters = *nominal;
            parameters.visit_mut(&mut |variable, old| {
                free.iter().position(|(free, _)| free.name == variable.name).map_or(old, |k| values[k])
            });
            parameters
        };
        let residuals = |values: &[f64]| {
            let mut residuals = data.training_residuals(&with(values))?;
            // A correction of the whole tolerance counts as one expected residual: it is allowed, not encouraged.
            residuals.extend(bounds.iter().zip(values).take(corrections).map(|(b, v)| (v - b.start) / b.typical));
            Some(residuals)
        };
        let fit = least_squares::fit(&residuals, &bounds);
        if fit.ended == Ended::NoStart {
            return None;
        }
        let parameters = with(&fit.parameters);
        let samples = residuals(&fit.parameters).map_or(1, |r| r.len());
        // Residuals are neither of unit variance nor independent: both widen the interval.
        let widen = fit.cost / samples as f64 * data.samples_per_independent(&parameters);
        let fitted: Vec<FittedParameter> = (0..free.len())
            .map(|k| {
                let (value, half) = (fit.parameters[k], 1.96 * (fit.variances[k] * widen).sqrt());
                let (low, high) = (value - half, value + half);
                let (name, unit) = (free[k].0.name, free[k].0.unit.symbol);
                FittedParameter { name, value, low: low.max(bounds[k].lower), high: high.min(bounds[k].upper), unit }
            })
            .collect();
        let (corrections, found) = fitted.split_at(corrections);
        Some(Self {
            effect: candidate.effect,
            parameters,
            corrections: corrections.to_vec(),
            found: found.to_vec(),
            held_out: data.held_out_loss(&parameters),
        })
    }

    /// Whether it does better than a model on samples that the fit did not see.
    pub fn beats(&self, model: &Parameters, data: &Data) -> bool {
        let other = data.held_out_loss(model);
        self.held_out.as_ref().zip(other).is_some_and(|(own, other)| own.loss < other.loss)
    }

    /// Name of the effect.
    pub fn name(&self) -> &'static str {
        self.effect.map_or("nominal", |effect| effect.name)
    }

    /// How many parameters the effect has.
    pub fn size(&self) -> usize {
        self.found.len()
    }

    /// The cause as it is told.
    pub fn cause(&self, alternatives: Vec<&'static str>) -> Option<Cause> {
        let effect = self.effect?;
        let sentence = self.parameters.effects.sentence(effect.name)?;
        let (parameters, experiment) = (self.found.clone(), effect.experiment);
        Some(Cause { effect: effect.name, sentence, parameters, alternatives, experiment })
    }
}
