//! Which residual exposes which cause: residuals of the links before and after, over the variables they may go with.

use super::curves::{noise, rounded, span};
use super::display_unit;
use crate::diagnosis::Diagnosis;
use crate::diagnosis::links::{Chain, Exposure, Link, Variable, mean_square, most_telling};
use crate::measurement::Recording;
use crate::parameters::Parameters;
use crate::variables::Declared;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::ops::Range;

/// Most dots of all recordings together in a plot.
const MOST_DOTS: usize = 3000;
/// Steps that the span of dots is rounded to.
const STEPS: f64 = 2e3;
/// A link must expose an effect this much better than one before it in the chain to be preferred.
const CLEARLY: f64 = 0.05;
/// A smaller share of a residual that goes with a variable is not seen in a plot.
pub const SEEN: f64 = 0.1;

/// The plot that exposes a cause.
#[derive(Debug, Clone, Copy)]
pub struct Exposed {
    /// Position of the link.
    pub link: usize,
    /// Position of the variable.
    pub variable: usize,
}

/// Residuals of every link that was measured, over all recordings one after the other.
pub struct Residuals {
    /// The links, each with the variable that the nominal residual goes with most.
    pub links: Vec<(Link, Exposure)>,
    /// The variables that were measured.
    pub variables: Vec<Variable>,
    /// Values per variable, SI; NaN where missing.
    values: Vec<Vec<f64>>,
    /// Residuals per model and link, SI: nominal, extended, and for each of several causes the extended model without it.
    residuals: Vec<Vec<Vec<f64>>>,
    /// Where each recording stands.
    ranges: Vec<Range<usize>>,
}

impl Residuals {
    /// Simulates the links of all recordings.
    pub fn new(diagnosis: &Diagnosis, nominal: &Parameters, recordings: &[Recording]) -> Self {
        let (mut variables, mut values) = (Vec::new(), Vec::new());
        for variable in Variable::ALL {
            let all = pooled(recordings.iter().map(|recording| (recording, variable.values(recording))));
            if mean_square(&all).is_some() {
                variables.push(variable);
                values.push(all);
            }
        }
        let value = |variable: Variable| variables.iter().position(|v| *v == variable).map(|k| values[k].as_slice());
        let models = models(diagnosis, nominal);
        let mut links = Vec::new();
        let mut residuals = vec![Vec::new(); models.len()];
        let chains: Vec<Vec<Chain>> =
            models.par_iter().map(|model| recordings.par_iter().map(|r| Chain::new(model, r)).collect()).collect();
        for link in Link::ALL {
            let of_model =
                |chains: &Vec<Chain>| pooled(recordings.iter().zip(chains).map(|(r, chain)| (r, chain.residual(link))));
            let all: Vec<Vec<f64>> = chains.iter().map(of_model).collect();
            let Some(exposure) = most_telling(link, &all[0], value) else { continue };
            if mean_square(&all[0]).is_some() {
                links.push((link, exposure));
                residuals.iter_mut().zip(all).for_each(|(model, residual)| model.push(residual));
            }
        }
        Self { links, variables, values, residuals, ranges: ranges(recordings) }
    }

    /// The plot that exposes each cause; where there is none, the one that shows best what is wrong.
    ///
    /// A link exposes a cause in so far as its residual without the effect goes with a variable and is gone with it.
    pub fn exposed(&self, diagnosis: &Diagnosis) -> Vec<Option<Exposed>> {
        let after = &self.residuals[1];
        let removed = |before: &[f64], link: usize| {
            let (before, after) = (mean_square(before), mean_square(&after[link]));
            before.zip(after).map_or(0.0, |(before, after)| (1.0 - after / before).max(0.0))
        };
        let beyond_noise = |before: &[f64], link: usize| {
            let noise = noise(diagnosis, self.links[link].0.output()).unwrap_or(0.0);
            mean_square(before).map_or(0.0, |before| (1.0 - noise * noise / before).max(0.0))
        };
        if diagnosis.causes.is_empty() {
            return vec![self.clearest(0, &beyond_noise)];
        }
        (0..diagnosis.causes.len()).map(|cause| self.clearest(self.before(cause), &removed)).collect()
    }

    /// Position of the model whose residual shows a cause.
    fn before(&self, cause: usize) -> usize {
        if self.residuals.len() > 2 { 2 + cause } else { 0 }
    }

    fn clearest(&self, model: usize, worth: &dyn Fn(&[f64], usize) -> f64) -> Option<Exposed> {
        let value = |variable: Variable| Some(self.values[self.position(variable)?].as_slice());
        let all = (0..self.links.len()).filter_map(|link| {
            let before = &self.residuals[model][link];
            let exposure = most_telling(self.links[link].0, before, value)?;
            let variable = self.position(exposure.variable)?;
            Some((exposure.share * worth(before, link), Exposed { link, variable }))
        });
        let best = all.reduce(|best, next| if next.0 > best.0 + CLEARLY { next } else { best });
        best.filter(|(seen, _)| *seen > SEEN).map(|(_, exposed)| exposed)
    }

    /// Position of a variable among those that were measured.
    pub fn position(&self, variable: Variable) -> Option<usize> {
        self.variables.iter().position(|v| *v == variable)
    }

    /// Names, units and noise for the script of the page.
    pub fn axes(&self, diagnosis: &Diagnosis) -> Value {
        let variable = |variable: &Variable| {
            let (label, unit, _) = variable.label();
            json!({ "label": label, "unit": unit })
        };
        let link = |(link, _): &(Link, Exposure)| {
            let (unit, size) = display_unit(link.output());
            // Other links hold the noise of their measured inputs too: that of the output says nothing of these.
            let own = matches!(link, Link::Valve | Link::Whole(_)).then(|| noise(diagnosis, link.output())).flatten();
            json!({ "unit": unit, "noise": own.map(|noise| noise / size) })
        };
        json!({
            "variables": self.variables.iter().map(variable).collect::<Vec<_>>(),
            "links": self.links.iter().map(link).collect::<Vec<_>>(),
        })
    }

    /// What is plotted of one recording: values per variable, and residuals per model and link, in units for people.
    pub fn dots(&self, recording: usize, exposed: &[Option<Exposed>]) -> Value {
        let range = &self.ranges[recording];
        let stride = self.ranges.last().map_or(1, |last| last.end.div_ceil(MOST_DOTS)).max(1);
        let shown = |values: &[f64], size: f64| {
            let kept = values[range.clone()].iter().step_by(stride).map(|value| value / size);
            rounded(kept, span(values) / size / STEPS)
        };
        let variables = self.variables.iter().zip(&self.values);
        let residual = |model: usize, link: usize| {
            shown(&self.residuals[model][link], display_unit(self.links[link].0.output()).1)
        };
        let all_links = |model: usize| (0..self.links.len()).map(|link| residual(model, link)).collect::<Vec<_>>();
        let own = |(cause, exposed): (usize, &Option<Exposed>)| {
            exposed.filter(|_| self.before(cause) > 1).map(|exposed| residual(self.before(cause), exposed.link))
        };
        json!({
            "variables": variables.map(|(variable, values)| shown(values, variable.label().2)).collect::<Vec<_>>(),
            "nominal": all_links(0),
            "extended": all_links(1),
            "causes": exposed.iter().enumerate().map(own).collect::<Vec<_>>(),
        })
    }
}

/// The nominal and the extended model, and where there are several causes the extended model without each.
fn models(diagnosis: &Diagnosis, nominal: &Parameters) -> Vec<Parameters> {
    let mut models = vec![*nominal, diagnosis.extended];
    if diagnosis.causes.len() > 1 {
        models.extend(diagnosis.causes.iter().map(|cause| without(&diagnosis.extended, nominal, cause.effect)));
    }
    models
}

/// A model whose parameters of one effect are those of the nominal model.
fn without(extended: &Parameters, nominal: &Parameters, effect: &str) -> Parameters {
    let mut parameters = *extended;
    parameters.visit_mut(&mut |variable, value| {
        if variable.group() == effect { nominal.get(variable.name).unwrap_or(value) } else { value }
    });
    parameters
}

/// Series of all recordings one after the other, NaN where a recording has none.
fn pooled<'a>(series: impl Iterator<Item = (&'a Recording, Option<Vec<f64>>)>) -> Vec<f64> {
    series.flat_map(|(recording, values)| values.unwrap_or_else(|| vec![f64::NAN; recording.time.len()])).collect()
}

/// Where each recording stands in such a series.
fn ranges(recordings: &[Recording]) -> Vec<Range<usize>> {
    let mut end = 0;
    let next = |recording: &Recording| {
        let start = end;
        end += recording.time.len();
        start..end
    };
    recordings.iter().map(next).collect()
}
