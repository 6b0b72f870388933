//! Fits of hypotheses.

use super::hypothesis::{
    Hypothesis, Off, Part, Which, at_start, bounds, corrections, count_starts, declared, many_minima, neutralised,
    recording_of, with_values,
};
use super::residuals::{Data, Loss, Scope};
use super::unlisted::Unlisted;
use crate::effects::{Description, Freed};
use crate::least_squares::{self, Adapting, Effort, Ended, Free, derivatives, normal_matrix};
use crate::parameters::Parameters;
use crate::recent::Recent;
use crate::variables::Variable;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Of a fit that only has to show what a hypothesis is worth.
const ROUGH: Effort = Effort { iterations: 10, small_decrease: 1e-3, goal: f64::INFINITY };
/// Of a fit whose parameters count.
const EXACT: Effort = Effort { iterations: 20, small_decrease: 1e-5, goal: f64::INFINITY };

/// A size with many minima is looked for so many steps to either side, each this share of it, first coarse and then fine.
const SCAN_STEPS: i32 = 20;
const SCANS: [f64; 2] = [4e-3, 2e-4];

/// Rounds of a fit that counts, and the relative gain of one below which it is the last.
const MOST_ROUNDS: usize = 6;
const SMALL_GAIN: f64 = 1e-3;

/// An error of a reading is no more than so many times what a fit leaves.
const MANY_TIMES: f64 = 100.0;

/// Simulations that are kept: of the longest recordings they take 40 MB.
const KEPT: usize = 128;

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

/// A hypothesis after its fit.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// What was free.
    pub hypothesis: Hypothesis,
    /// The whole model.
    pub parameters: Parameters,
    /// Measured − simulated in SI, as [`Data::residuals`] gives them.
    pub residuals: Vec<f64>,
    /// How large they are, on all samples.
    pub losses: Vec<Loss>,
}

impl Fitted {
    /// Whether its effects are such as they can be.
    pub fn is_possible(&self) -> bool {
        !self.hypothesis.is_impossible(&self.parameters)
    }

    /// Refinements of which each alone, at its default, would let the effects be such as they can be.
    fn shapes_to_blame(&self) -> Vec<&'static str> {
        let would_do = |name: &&'static str| {
            let [(variable, _), (_, default)] = [&self.parameters, &Parameters::default()].map(|of| declared(of, name));
            !self.hypothesis.is_impossible(&with_values(&self.parameters, &[variable], &[default]))
        };
        self.hypothesis
            .parts
            .iter()
            .flat_map(|part| part.refinements())
            .map(|(name, _)| *name)
            .filter(would_do)
            .collect()
    }
}

/// A fit with what its corrections may take off the residuals, to see what an effect more takes off beside them.
pub struct Base<'f> {
    fitted: &'f Fitted,
    adapting: Adapting,
}

/// Where a fit starts.
#[derive(Clone)]
pub struct Start {
    /// Share of the weighted squares of the residuals that may go away.
    pub promise: f64,
    /// The effect that is added.
    pub part: Part,
    /// Which of the starts of its form.
    pub choice: usize,
    /// The model.
    pub parameters: Parameters,
}

/// What parameters do to the residuals of a model.
#[derive(Default)]
pub struct Slopes {
    of: Vec<&'static Variable>,
    /// Change of the residuals per unit of each.
    by: Vec<Vec<f64>>,
}

impl Slopes {
    /// That of one parameter, where it is known.
    fn of(&self, variable: &Variable) -> Option<&Vec<f64>> {
        self.of.iter().position(|known| known.name == variable.name).map(|k| &self.by[k])
    }
}

/// What nominal models with some effects beside change of the residuals.
pub type Changes = Recent<Vec<f64>>;

/// What fits of all hypotheses have in common.
pub struct Bench<'a> {
    /// The recordings.
    pub data: Data<'a>,
    /// How the nominal model may be off.
    pub off: Off,
    nominal: &'a Parameters,
    /// Corrections with their bounds and priors.
    corrections: Vec<(&'static Variable, Free)>,
    /// Of the corrections at the baseline; empty before it is known.
    slopes: Slopes,
    weights: Vec<f64>,
    /// Models that were simulated last, with what [`Data::residuals`] gives for them.
    recent: Recent<Vec<f64>>,
    /// What effects change of the baseline's residuals, in whatever way its coefficients are off.
    changes: &'a Changes,
}

impl<'a> Bench<'a> {
    /// Prepares fits of a nominal model that is good to `tolerance`.
    pub fn new(data: Data<'a>, nominal: &'a Parameters, tolerance: f64, off: Off, changes: &'a Changes) -> Self {
        let corrections = corrections(nominal, tolerance, off);
        let weights = data.weights(Scope::All);
        Self { data, off, nominal, corrections, slopes: Slopes::default(), weights, recent: Recent::new(KEPT), changes }
    }

    /// Takes what a better model shows of the noise.
    pub fn refine_noise(&mut self, residuals: &[f64]) {
        self.data.refine_noise(residuals);
        self.weights = self.data.weights(Scope::All);
        self.recent = Recent::new(KEPT); // the start is in doubt as the noise has it
    }

    /// A fit with its residuals as the noise that is known now has them; `None` where it cannot be simulated.
    pub fn anew(&self, fitted: &Fitted) -> Option<Fitted> {
        let residuals = self.residuals(&fitted.parameters)?;
        Some(Fitted { losses: self.data.losses(&residuals, Scope::All), residuals, ..fitted.clone() })
    }

    /// [`Data::residuals`] of a model. A fit starts from where another one did or ended: one simulation in eight is known.
    fn residuals(&self, model: &Parameters) -> Option<Vec<f64>> {
        self.recent.get_or(model, || self.data.residuals(model).ok_or(())).ok()
    }

    /// Fits the corrections alone, and learns what each of them does to the residuals.
    ///
    /// `None` where the nominal model cannot be simulated.
    pub fn baseline(&mut self) -> Option<Fitted> {
        let nominal = Hypothesis::default();
        let first = self.exact_fit(&nominal, self.nominal, Scope::All)?;
        self.slopes = self.slopes(&first)?;
        Some(self.fit(&nominal, &first.parameters, Scope::All, &self.slopes, EXACT)?.0)
    }

    /// Fits a hypothesis on all samples, starting from a model, to see what it is worth. What the corrections do to the
    /// residuals is taken from the baseline, so that an iteration costs one simulation per parameter of the effects.
    ///
    /// `None` where the start cannot be simulated.
    pub fn rough_fit(&self, hypothesis: &Hypothesis, start: &Parameters) -> Option<Fitted> {
        self.rough_fit_with(&self.slopes, hypothesis, start)
    }

    /// The same with slopes from nearby, be it also of parameters of effects: an iteration costs one simulation per other parameter.
    pub fn rough_fit_with(&self, slopes: &Slopes, hypothesis: &Hypothesis, start: &Parameters) -> Option<Fitted> {
        Some(self.fit(hypothesis, start, Scope::All, slopes, ROUGH)?.0)
    }

    /// The same from a fit to recordings that were taken in another way; what the corrections do is looked at there.
    pub fn rough_fit_again(&self, fitted: &Fitted) -> Option<Fitted> {
        let slopes = self.slopes_at(&Hypothesis::default(), &fitted.parameters)?;
        self.rough_fit_with(&slopes, &fitted.hypothesis, &fitted.parameters)
    }

    /// Fits a hypothesis to the end on the samples in scope, starting from a model that is about right. What the
    /// corrections do is looked at anew until that helps no more.
    ///
    /// `None` where the start cannot be simulated.
    pub fn exact_fit(&self, hypothesis: &Hypothesis, start: &Parameters, scope: Scope) -> Option<Fitted> {
        self.exact_fit_near(hypothesis, start, scope, f64::INFINITY)
    }

    /// The same, given up where it would not come near enough to another fit: to the sum of squares of the goal.
    pub fn exact_fit_near(
        &self,
        hypothesis: &Hypothesis,
        start: &Parameters,
        scope: Scope,
        goal: f64,
    ) -> Option<Fitted> {
        let weights = self.data.weights(scope);
        let mut best: Option<Fitted> = None;
        let mut before = cost(&self.residuals(start)?, &weights);
        for _ in 0..MOST_ROUNDS {
            let from = best.as_ref().map_or(*start, |fitted| fitted.parameters);
            let slopes = self.slopes_at(&Hypothesis::default(), &from)?;
            let (next, ended) = self.fit(hypothesis, &from, scope, &slopes, Effort { goal, ..EXACT })?;
            let now = cost(&next.residuals, &weights);
            let is_last = ended == Ended::GivenUp || now > (1.0 - SMALL_GAIN) * before;
            // The start need not be as likely as a fit.
            if best.is_none() || now < before {
                (best, before) = (Some(next), now);
            }
            if is_last {
                break;
            }
        }
        best
    }

    /// Weighted squares that a fit leaves: what a [goal](Self::exact_fit_near) is measured by.
    pub fn squares(&self, fitted: &Fitted) -> f64 {
        cost(&fitted.residuals, &self.weights)
    }

    /// A hypothesis with only those of its refinements whose parameters are wanted, fitted anew; `None` where it cannot be simulated.
    pub fn less_refined(&self, fitted: &Fitted, is_wanted: impl Fn(&str) -> bool) -> Option<Fitted> {
        self.with_fewer_free(fitted, &fitted.hypothesis.refined_as(is_wanted))
    }

    /// A hypothesis with one of its effects as large as it likes and its other parameters at their defaults; `None` where it cannot be simulated.
    pub fn of_size_alone(&self, fitted: &Fitted, part: &Part) -> Option<Fitted> {
        let others: Vec<&str> = part.freed().map(|(name, _)| *name).filter(|name| *name != part.size().0).collect();
        self.with_fewer_free(fitted, &fitted.hypothesis.in_form_of(part.holding(&others)))
    }

    /// Possible fits in the place of one that is impossible only by its shapes: those that ended at bounds at their defaults, or all other
    /// refinements, of which one may have pushed them there, or one without which the effects could be: where a shape does next to nothing,
    /// fits leave it anywhere.
    pub fn possible_instead(&self, fitted: &Fitted) -> impl Iterator<Item = Fitted> {
        let hypothesis = &fitted.hypothesis;
        let at_ends = fitted.parameters.effects.at_ends();
        let is_by_shapes = !at_ends.is_empty() && !hypothesis.parts.iter().any(|part| at_ends.contains(&part.size().0));
        let held = hypothesis.parts.iter().map(|part| part.holding(&at_ends)).collect();
        let without_ends = Hypothesis { parts: held, ..*hypothesis };
        let without_others = hypothesis.refined_as(|name| at_ends.contains(&name));
        let blamed = fitted.shapes_to_blame().into_iter().filter(|name| !at_ends.contains(name));
        let without_one: Vec<Hypothesis> = blamed.map(|name| hypothesis.refined_as(|other| other != name)).collect();
        let fewer = is_by_shapes.then_some([without_ends, without_others]).into_iter().flatten().chain(without_one);
        let fewer = fewer.filter(|fewer| fewer.size() < fitted.hypothesis.size());
        fewer.filter_map(|fewer| self.with_fewer_free(fitted, &fewer)).filter(Fitted::is_possible)
    }

    /// A hypothesis with the same effects of which fewer parameters are free, the others at their defaults; fitted anew.
    fn with_fewer_free(&self, fitted: &Fitted, fewer: &Hypothesis) -> Option<Fitted> {
        let Fitted { hypothesis, parameters, .. } = fitted;
        let neutral = hypothesis.at_work_in(parameters, &Parameters::default());
        self.exact_fit(fewer, &fewer.at_work_in(&neutral, parameters), Scope::All)
    }

    /// A model at least as good, with sizes nearby of those effects whose error has many minima.
    pub fn scanned(&self, fitted: &Fitted) -> Parameters {
        let sizes = fitted.hypothesis.parts.iter().map(|part| part.size());
        sizes
            .filter(|size| many_minima(size))
            .flat_map(|(size, _)| SCANS.map(|share| (size, share)))
            .fold(fitted.parameters, |model, (size, share)| {
                self.best_nearby(&model, size, share).map_or(model, |(_, better)| better)
            })
    }

    /// Where a fit starts that frees more of an effect than the `known` parameters of a model: at the first start of each, or,
    /// where the error has many minima over the size, at the best of all with its size. `None` where they change nothing: some
    /// act only together with others.
    pub fn refined_start(&self, model: &Parameters, part: Part, known: &[&str]) -> Option<Parameters> {
        let new: Vec<_> = part.freed().filter(|(name, _)| !known.contains(name)).collect();
        let at = |choice: usize| at_start(model, new.iter().copied(), choice);
        if !new.is_empty() && self.residuals(&at(0)) == self.residuals(model) {
            return None;
        }
        let size = part.size();
        if !many_minima(size) {
            return Some(at(0));
        }
        let nearby = (0..count_starts(new.iter().copied()).max(1))
            .filter_map(|choice| self.best_nearby(&at(choice), size.0, SCANS[0]));
        let best = nearby.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, model)| model)?;
        self.best_nearby(&best, size.0, SCANS[1]).map(|(_, model)| model)
    }

    /// The best of a model with sizes nearby, and the sum of squares that it leaves.
    fn best_nearby(&self, model: &Parameters, size: &str, share: f64) -> Option<(f64, Parameters)> {
        let (variable, value) = declared(model, size);
        let mut steps: Vec<i32> = (-SCAN_STEPS..=SCAN_STEPS).collect();
        steps.sort_by_key(|k| k.abs());
        let nearby =
            steps.into_iter().map(|k| with_values(model, &[variable], &[value * (1.0 + f64::from(k) * share)]));
        self.best_of(nearby.collect())
    }

    /// The model that leaves least, the first of equal ones, and the sum of squares that it leaves; `None` where none can be
    /// simulated.
    fn best_of(&self, models: Vec<Parameters>) -> Option<(f64, Parameters)> {
        self.ranked(models).into_iter().next()
    }

    /// Sums of squares that models leave, the least first, of equal ones the first; without those that cannot be simulated.
    fn ranked(&self, models: Vec<Parameters>) -> Vec<(f64, Parameters)> {
        let costs = models.into_par_iter().filter_map(|model| {
            let cost = cost(&self.residuals(&model)?, &self.weights);
            Some((cost, model))
        });
        let mut ranked: Vec<_> = costs.collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        ranked
    }

    fn fit(
        &self,
        hypothesis: &Hypothesis,
        start: &Parameters,
        scope: Scope,
        slopes: &Slopes,
        effort: Effort,
    ) -> Option<(Fitted, Ended)> {
        let (variables, free) = self.everything_free(hypothesis, start);
        // Those whose slopes are known last.
        let mut each: Vec<_> = variables.into_iter().zip(free).collect();
        each.sort_by_key(|(variable, _)| slopes.of(variable).is_some());
        let (variables, free): (Vec<_>, Vec<_>) = each.into_iter().unzip();
        let weights = self.data.weights(scope);
        let residuals =
            |values: &[f64]| Some(weighted(&self.residuals(&with_values(self.nominal, &variables, values))?, &weights));
        let known = variables.iter().filter_map(|variable| slopes.of(variable)).map(|slope| weighted(slope, &weights));
        let known: Vec<Vec<f64>> = known.collect();
        let fit = least_squares::fit(&residuals, &free, &known, effort);
        if fit.ended == Ended::NoStart {
            return None;
        }
        let parameters = with_values(self.nominal, &variables, &fit.parameters);
        Some((self.fitted(hypothesis, parameters, self.residuals(&parameters)?), fit.ended))
    }

    /// The baseline with a cause beside it that is in no library, given what one of size one adds to the residuals; fitted to the samples in
    /// scope. `None` where it adds nothing.
    pub fn fit_beside(&self, baseline: &Fitted, cause: Unlisted, course: &[f64], scope: Scope) -> Option<Fitted> {
        let (scale, course) = self.as_large(course, baseline)?;
        let (smallest, largest) = cause.sizes();
        let (variables, mut free) = self.everything_free(&baseline.hypothesis, &baseline.parameters);
        let (lower, upper) = ((smallest / scale).max(-MANY_TIMES), (largest / scale).min(MANY_TIMES));
        free.insert(0, Free { start: 0.0, lower, upper, typical: 1.0, prior: None });
        let beside = |values: &[f64]| {
            let residuals = self.residuals(&with_values(self.nominal, &variables, &values[1..]))?;
            Some(residuals.iter().zip(&course).map(|(residual, by)| residual - values[0] * by).collect::<Vec<_>>())
        };
        let weights = self.data.weights(scope);
        let taken_off: Vec<f64> = course.iter().map(|by| -by).collect();
        let known: Vec<Vec<f64>> =
            [&taken_off].into_iter().chain(&self.slopes.by).map(|slope| weighted(slope, &weights)).collect();
        let fit =
            least_squares::fit(&|values: &[f64]| Some(weighted(&beside(values)?, &weights)), &free, &known, EXACT);
        if fit.ended == Ended::NoStart {
            return None;
        }
        let parameters = with_values(self.nominal, &variables, &fit.parameters[1..]);
        let hypothesis = Hypothesis { beside: Some(cause), ..baseline.hypothesis.clone() };
        Some(self.fitted(&hypothesis, parameters, beside(&fit.parameters)?))
    }

    /// Share of the squares that may go away with an error of readings that has a course of its own, as for starts of effects.
    pub fn promise_of_course(&self, base: &Base, course: &[f64]) -> f64 {
        self.as_large(course, base.fitted)
            .map_or(0.0, |(_, course)| promise(base, vec![weighted(&course, &self.weights)]))
    }

    /// By how much a course must be larger to have as large squares as a fit leaves, and as it is then; `None` where it is zero.
    fn as_large(&self, course: &[f64], fitted: &Fitted) -> Option<(f64, Vec<f64>)> {
        let [own, wanted] = [course, &fitted.residuals].map(|values| cost(values, &self.weights));
        let scale = (wanted / own).sqrt();
        (scale.is_finite() && scale > 0.0).then(|| (scale, course.iter().map(|value| scale * value).collect()))
    }

    /// A fit with one of its effects at its neutral defaults and all else as it was; `None` where that cannot be simulated.
    pub fn neutralised(&self, fitted: &Fitted, effect: &Description) -> Option<Fitted> {
        let parameters = neutralised(&fitted.parameters, effect);
        let residuals = self.residuals(&parameters)?;
        Some(self.fitted(&fitted.hypothesis.without(effect.name), parameters, residuals))
    }

    /// What the corrections of a fit take off its odds: how far they are from what was expected, and how much more precisely the data know
    /// them than that (Laplace's approximation of the evidence, D. MacKay 1992, doi 10.1162/neco.1992.4.3.415).
    pub fn price(&self, fitted: &Fitted) -> f64 {
        let weights = self.data.weights_beside_structure();
        // What cannot be simulated is worth nothing.
        let Some(slopes) = self.slopes_at(&Hypothesis::default(), &fitted.parameters) else { return f64::INFINITY };
        let columns = self.corrections.iter().zip(slopes.by).filter_map(|((_, correction), slope)| {
            let (_, deviation) = correction.prior?;
            Some(weighted(&slope, &weights).into_iter().map(|slope| slope * deviation).collect())
        });
        price(&self.off(fitted), &columns.collect::<Vec<_>>())
    }

    /// By how much the corrections of a fit are less likely than none, in natural logarithm, before the data are looked at.
    pub fn strain(&self, fitted: &Fitted) -> f64 {
        half_squares(&self.off(fitted))
    }

    /// How far the corrections of a fit are from what was expected, in its standard deviations.
    fn off(&self, fitted: &Fitted) -> Vec<f64> {
        let off = self.corrections.iter().filter_map(|(variable, correction)| {
            let (mean, deviation) = correction.prior?;
            Some((declared(&fitted.parameters, variable.name).1 - mean) / deviation)
        });
        off.collect()
    }

    /// What the parameters of a fit, corrections among them, do to its residuals; `None` where it cannot be simulated.
    pub fn slopes(&self, fitted: &Fitted) -> Option<Slopes> {
        self.slopes_at(&fitted.hypothesis, &fitted.parameters)
    }

    /// What the parameters of a hypothesis, corrections among them, do to the residuals of a model.
    fn slopes_at(&self, hypothesis: &Hypothesis, model: &Parameters) -> Option<Slopes> {
        let (of, free) = self.everything_free(hypothesis, model);
        let by = self.derivatives(model, &of, &free)?;
        Some(Slopes { of, by })
    }

    /// Change of the residuals of a model per unit of some of its parameters, which are free from where they are.
    fn derivatives(&self, model: &Parameters, variables: &[&'static Variable], free: &[Free]) -> Option<Vec<Vec<f64>>> {
        let at: Vec<f64> = free.iter().map(|free| free.start).collect();
        let residuals = |values: &[f64]| self.residuals(&with_values(model, variables, values));
        Some(derivatives(&residuals, free, &at, &self.residuals(model)?))
    }

    fn fitted(&self, hypothesis: &Hypothesis, parameters: Parameters, residuals: Vec<f64>) -> Fitted {
        let losses = self.data.losses(&residuals, Scope::All);
        Fitted { hypothesis: hypothesis.clone(), parameters, residuals, losses }
    }

    /// A fit as one that may get one effect more. Its corrections are free within their bounds.
    pub fn base<'f>(&self, fitted: &'f Fitted) -> Base<'f> {
        let each = self.corrections.iter();
        let free = each.map(|(variable, correction)| correction.from(declared(&fitted.parameters, variable.name).1));
        let columns = self.slopes.by.iter().map(|slope| weighted(slope, &self.weights));
        let residuals = weighted(&fitted.residuals, &self.weights);
        Base { fitted, adapting: Adapting::new(residuals, columns.collect(), free.collect()) }
    }

    /// Where fits of a hypothesis with one effect more start, the most promising first: every start of every
    /// common form.
    ///
    /// How promising is judged from one simulation: how much of the weighted squares of the residuals goes away when the
    /// change that the effect makes is scaled and the corrections and the parameters so far adapt, to first order.
    pub fn starts(&self, base: &Base, effect: &'static Description) -> Vec<Start> {
        let forms = self.forms(effect).filter(|part| !part.is_rare());
        let forms = forms.flat_map(|part| (0..part.starts()).map(move |choice| (part, choice)));
        let mut starts: Vec<Start> = forms.filter_map(|(part, choice)| self.start(base, part, choice)).collect();
        starts.sort_by(|a, b| b.promise.total_cmp(&a.promise));
        starts
    }

    /// The forms of an effect that mean something here, rare ones among them, without refinements.
    pub fn forms(&self, effect: &'static Description) -> impl Iterator<Item = Part> {
        let forms = effect.all_forms().enumerate();
        let possible = forms.filter(|(_, form)| form.iter().all(|(name, _)| self.means_something(name)));
        possible.map(move |(form, _)| Part::plain(effect, form))
    }

    /// All refinements of an effect that mean something here.
    pub fn fully(&self, effect: &Description) -> Which {
        Which::those(effect.refinements, |_, name| self.means_something(name))
    }

    /// Whether there is the recording that a parameter is of.
    fn means_something(&self, name: &str) -> bool {
        self.data.recordings().len() >= recording_of(name)
    }

    /// A hypothesis with one effect more, at one of the starts of its form; `None` where it cannot be simulated.
    pub fn start(&self, base: &Base, part: Part, choice: usize) -> Option<Start> {
        let parameters = at_start(&base.fitted.parameters, part.freed(), choice);
        let change = |model: &Parameters| Some(weighted(&self.change(base.fitted, model)?, &self.weights));
        let mut whole = change(&parameters)?;
        if part.has_many_minima() {
            forgive(&mut whole, &base.adapting.residuals, self.data.blocks());
        }
        // What shows nothing at a usual size cannot be told from nothing.
        if whole.iter().map(|c| c * c).sum::<f64>() < 1.0 {
            return None;
        }
        // What is another one in each recording goes its own way there.
        let anew = part.freed().filter(|(name, _)| recording_of(name) > 1);
        let neutral = |name| declared(&Parameters::default(), name);
        let without =
            anew.map(|(name, _)| neutral(name)).map(|(own, value)| with_values(&parameters, &[own], &[value]));
        let in_others = without.filter_map(|model| change(&model));
        let promise = promise(base, [whole].into_iter().chain(in_others).collect());
        Some(Start { promise, part, choice, parameters })
    }

    /// By how much the residuals of a model differ from those of a fit. Effects alone do the same where the coefficients of the nominal model are
    /// off in another way, to first order.
    fn change(&self, base: &Fitted, model: &Parameters) -> Option<Vec<f64>> {
        let change = || {
            let changed = self.residuals(model)?;
            Some(changed.iter().zip(&base.residuals).map(|(after, before)| after - before).collect())
        };
        if base.hypothesis.parts.is_empty() {
            let effects = Parameters { effects: model.effects, ..*self.nominal };
            self.changes.get_or(&effects, || change().ok_or(())).ok()
        } else {
            change()
        }
    }

    /// A start with the best size nearby, where the error has many minima over it.
    pub fn settled(&self, start: &Start) -> Parameters {
        let size = start.part.size();
        if !many_minima(size) {
            return start.parameters;
        }
        self.best_nearby(&start.parameters, size.0, SCANS[0]).map_or(start.parameters, |(_, model)| model)
    }

    /// A model with an effect of its own exchanged for another form of it, at the start that leaves least, be it with what both
    /// forms have as it was or not; `None` where none can be simulated. A start at which nothing that is new would act, such as a knee beyond all
    /// that happened, is none.
    pub fn best_start(&self, model: &Parameters, from: Part, to: Part) -> Option<Parameters> {
        let without = neutralised(model, to.effect);
        let (shared, new): (Vec<&Freed>, Vec<&Freed>) =
            to.freed().partition(|(name, _)| from.freed().any(|(known, _)| known == name));
        let at = |of: &Parameters, freed: &[&Freed]| -> (Vec<_>, Vec<_>) {
            freed.iter().map(|(name, _)| declared(of, name)).unzip()
        };
        let (variables, values) = at(model, &shared);
        let starts = (0..to.starts()).flat_map(|choice| {
            let anew = at_start(&without, to.freed(), choice);
            let kept = (!variables.is_empty()).then(|| with_values(&anew, &variables, &values));
            kept.into_iter().chain([anew])
        });
        let (own, neutral) = at(&Parameters::default(), &new);
        let acts = |start: &Parameters| self.residuals(start) != self.residuals(&with_values(start, &own, &neutral));
        let mut ranked = self.ranked(starts.collect()).into_iter().map(|(_, start)| start);
        ranked.find(|start| own.is_empty() || acts(start))
    }

    fn everything_free(&self, hypothesis: &Hypothesis, start: &Parameters) -> (Vec<&'static Variable>, Vec<Free>) {
        let mut variables = hypothesis.variables();
        let mut free = bounds(&variables, start);
        for (variable, correction) in &self.corrections {
            variables.push(variable);
            free.push(Free { start: declared(start, variable.name).1, ..*correction });
        }
        (variables, free)
    }

    /// The parameters of a fit with their 95 % intervals: those of the effects, then the corrections.
    ///
    /// The scatter of the estimate comes from how much blocks of a few seconds pull it apart, noise or not (sandwich with
    /// clusters: H. White 1982, doi 10.2307/1912526; K.-Y. Liang and S. Zeger 1986, doi 10.1093/biomet/73.1.13), and from how
    /// far it goes if the inputs are no straight lines between their samples.
    pub fn intervals(&self, fitted: &Fitted, scope: Scope) -> (Vec<FittedParameter>, Vec<FittedParameter>) {
        let (variables, free) = self.everything_free(&fitted.hypothesis, &fitted.parameters);
        let deviations = self.deviations(&variables, &free, fitted, scope);
        let parameters = variables.iter().enumerate().map(|(k, variable)| {
            let (value, half) = (free[k].start, 1.96 * deviations.as_ref().map_or(f64::INFINITY, |d| d[k]));
            let (low, high) = ((value - half).max(free[k].lower), (value + half).min(free[k].upper));
            FittedParameter { name: variable.name, value, low, high, unit: variable.unit.symbol }
        });
        let mut found: Vec<_> = parameters.collect();
        let corrections = found.split_off(fitted.hypothesis.size());
        (found, corrections)
    }

    /// Standard deviation of each estimate; `None` where the data do not tell them.
    fn deviations(
        &self,
        variables: &[&'static Variable],
        free: &[Free],
        fitted: &Fitted,
        scope: Scope,
    ) -> Option<Vec<f64>> {
        let weights = self.data.weights(scope);
        let scaled = |(column, free): (Vec<f64>, &Free)| -> Vec<f64> {
            column.iter().zip(&weights).map(|(slope, weight)| slope * weight * free.typical).collect()
        };
        let columns = self.derivatives(&fitted.parameters, variables, free)?;
        let columns: Vec<Vec<f64>> = columns.into_iter().zip(free).map(scaled).collect();
        // The small constant keeps a parameter without influence from spoiling the others.
        let priors = free.iter().map(|free| 1e-9 + free.prior.map_or(0.0, |(_, of)| (free.typical / of).powi(2)));
        let priors = DMatrix::from_diagonal(&DVector::from_iterator(free.len(), priors));
        let inverse = (normal_matrix(&columns) + &priors).try_inverse()?;
        let scatter = &inverse * (self.gradients(&columns, &weighted(&fitted.residuals, &weights)) + priors) * &inverse;
        let sampling = weighted(&self.data.sampling_error(&fitted.parameters)?, &weights);
        let pull = columns.iter().map(|column| column.iter().zip(&sampling).map(|(slope, error)| slope * error).sum());
        let shift = inverse * DVector::from_iterator(free.len(), pull);
        let deviation = |k: usize| (scatter[(k, k)].max(0.0) + shift[k].powi(2)).sqrt() * free[k].typical;
        Some((0..free.len()).map(deviation).collect())
    }

    /// Whether some parameter of an effect shows in none of the samples that its fit saw, but in others: one that jumps late.
    pub fn shows_elsewhere(&self, fitted: &Fitted, seen: Scope) -> bool {
        let variables = fitted.hypothesis.variables();
        let free = bounds(&variables, &fitted.parameters);
        let [seen, unseen] = [seen, seen.others()].map(|scope| self.data.weights(scope));
        let is_late = |column: &Vec<f64>| cost(column, &seen) == 0.0 && cost(column, &unseen) > 0.0;
        self.derivatives(&fitted.parameters, &variables, &free).is_some_and(|columns| columns.iter().any(is_late))
    }

    /// Sum over blocks of the squared gradients that each of them contributes, enlarged for how few they are.
    fn gradients(&self, columns: &[Vec<f64>], residuals: &[f64]) -> DMatrix<f64> {
        let (blocks, count) = self.data.blocks();
        let mut gradients = DMatrix::<f64>::zeros(columns.len(), count);
        for (k, column) in columns.iter().enumerate() {
            for ((slope, residual), block) in column.iter().zip(residuals).zip(&blocks) {
                gradients[(k, *block)] += slope * residual;
            }
        }
        let seen = gradients.column_iter().filter(|gradient| gradient.iter().any(|g| *g != 0.0)).count() as f64;
        let free = (seen - columns.len() as f64).max(1.0);
        &gradients * gradients.transpose() * (seen / free)
    }
}

/// Share of the squares that goes away when changes are scaled, up to five times in either direction, and the corrections adapt within their
/// bounds.
fn promise(base: &Base, changes: Vec<Vec<f64>>) -> f64 {
    let scale = Free { start: 0.0, lower: -5.0, upper: 5.0, typical: 1.0, prior: None };
    let squares: f64 = base.adapting.residuals.iter().map(|r| r * r).sum();
    base.adapting.decrease(&changes, &vec![scale; changes.len()]) / squares
}

/// Takes back what a change of residuals does in blocks, numbered and so many, that it makes worse: where each jump hangs on the ones before,
/// a size that is not quite right goes wrong for a while by chance.
fn forgive(change: &mut [f64], residuals: &[f64], (blocks, count): (Vec<usize>, usize)) {
    let mut worse = vec![0.0; count];
    for ((block, residual), by) in blocks.iter().zip(residuals).zip(change.iter()) {
        worse[*block] += (residual + by).powi(2) - residual.powi(2);
    }
    change.iter_mut().zip(&blocks).filter(|(_, block)| worse[**block] > 0.0).for_each(|(by, _)| *by = 0.0);
}

/// What parameters that were expected at zero, within one, take off the logarithm of the odds, where they are, given what a change of each by
/// one does to residuals in units of their noise.
fn price(off: &[f64], columns: &[Vec<f64>]) -> f64 {
    let known = normal_matrix(columns) + DMatrix::identity(columns.len(), columns.len());
    // Of a positive definite matrix; its determinant is the squared product of the factor's diagonal.
    let precision: f64 = known.cholesky().map_or(0.0, |factor| factor.l().diagonal().iter().map(|d| d.ln()).sum());
    half_squares(off) + precision
}

fn half_squares(off: &[f64]) -> f64 {
    0.5 * off.iter().map(|off| off * off).sum::<f64>()
}

/// Sum of weighted squares.
fn cost(residuals: &[f64], weights: &[f64]) -> f64 {
    weighted(residuals, weights).iter().map(|r| r * r).sum()
}

fn weighted(residuals: &[f64], weights: &[f64]) -> Vec<f64> {
    residuals.iter().zip(weights).map(|(residual, weight)| residual * weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::timing::{INTEGRATION, thinned};
    use crate::effects::Effects;
    use crate::measurement::read_all;
    use crate::simulation::replay_within;
    use std::path::Path;

    #[test]
    fn a_change_counts_in_the_blocks_that_it_makes_better() {
        let mut change = [-1.0, -1.5, 0.5, -0.1, 0.0, 2.0];
        // The second block would be worse by 0.16, though one of its residuals gets smaller; the third no better and no worse.
        forgive(&mut change, &[1.0, 1.0, 0.1, 1.0, 0.0, -1.0], (vec![0, 0, 1, 1, 2, 2], 3));
        assert_eq!(change, [-1.0, -1.5, 0.0, 0.0, 0.0, 2.0]);
    }

    #[test]
    fn a_shape_that_does_nothing_is_to_blame_where_it_is_what_cannot_be() {
        let effect = Effects::DESCRIPTIONS.iter().find(|effect| effect.name == "friction_hysteresis").unwrap();
        let mut part = Part::plain(effect, 0);
        part.refined = Which::those(effect.refinements, |_, _| true);
        let hypothesis = Hypothesis { parts: vec![part], beside: None };
        let mut parameters = Parameters::default();
        let friction = &mut parameters.effects.friction_hysteresis;
        // A second element that hardly counts and gives way over 15 cm.
        (friction.half_width, friction.presliding_displacement) = (20.0, 5e-3);
        (friction.second_share, friction.second_ratio, friction.knee) = (1e-3, 30.0, 3.0);
        let fitted = Fitted { hypothesis, parameters, residuals: Vec::new(), losses: Vec::new() };
        assert!(!fitted.is_possible());
        assert_eq!(fitted.shapes_to_blame(), ["friction_hysteresis.second_share", "friction_hysteresis.second_ratio"]);
    }

    #[test]
    fn every_start_of_every_effect_is_simulated_in_time() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
        let files = ["prescribed_motion.csv", "dry_friction_20kg.csv"].map(|name| folder.join(name));
        let recordings = thinned(&read_all(&files, &[]).unwrap());
        let mut rubbed = Parameters::default();
        (rubbed.effects.friction_hysteresis.half_width, rubbed.effects.friction_hysteresis.knee) = (50.0, 2.0);
        Effects::DESCRIPTIONS.par_iter().for_each(|effect| {
            let parts = effect.all_forms().enumerate().map(|(form, _)| Part::plain(effect, form));
            for (part, choice) in parts.flat_map(|part| (0..part.starts()).map(move |choice| (part, choice))) {
                let model = at_start(&rubbed, part.freed(), choice);
                for recording in &recordings {
                    let replayed = replay_within(&model, recording, INTEGRATION);
                    assert!(replayed.is_ok(), "{} {} {choice}: {replayed:?}", effect.name, part.form);
                }
            }
        });
    }

    #[test]
    fn a_price_is_what_the_evidence_of_a_linear_model_takes_off_its_likelihood() {
        // y = A x + noise with variances of one all over: y is normal with the covariance C = 1 + A Aᵀ, so that
        // −2 ln p(y) = yᵀ C⁻¹ y + ln det C, but for a constant.
        let slopes = DMatrix::from_fn(7, 3, |i, k| (1.3 * i as f64 + 2.1 * k as f64).sin() * (k as f64 + 0.5));
        let measured = DVector::from_fn(7, |i, _| 3.0 * (0.7 * i as f64).cos());
        let covariance = DMatrix::identity(7, 7) + &slopes * slopes.transpose();
        let solved = covariance.clone().lu().solve(&measured).unwrap();
        let evidence = -0.5 * (measured.dot(&solved) + covariance.determinant().ln());

        let normal = slopes.transpose() * &slopes + DMatrix::identity(3, 3);
        let fitted = normal.lu().solve(&(slopes.transpose() * &measured)).unwrap();
        let left = &measured - &slopes * &fitted;
        let columns: Vec<Vec<f64>> = slopes.column_iter().map(|column| column.iter().copied().collect()).collect();
        let paid = price(fitted.as_slice(), &columns);
        assert!((-0.5 * left.norm_squared() - paid - evidence).abs() < 1e-9, "{paid} {evidence}");
        assert!(paid > 0.5, "{paid}");
    }
}
