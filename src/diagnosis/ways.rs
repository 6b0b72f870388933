//! How the coefficients of a nominal muscle are off decides what is an effect: off as a whole, most muscles show small ones; coefficients
//! that are each off by themselves can stand for many. Bayes' rule weighs both.

use super::Fitting;
use super::fits::{Bench, Fitted};
use super::hypothesis::{Hypothesis, neutralised};
use super::residuals::Scope;
use super::selection::evidence::{is_unsound, odds};
use super::selection::{Chosen, LEAST_EVIDENCE, MOST_EFFECTS, Search};
use crate::Result;

/// Effects that are looked for in both ways before more are in either.
const AT_FIRST: usize = 2;

/// A way in which the coefficients of the nominal model may be off, before any effect is looked for.
pub struct Way<'a> {
    bench: Bench<'a>,
    /// The nominal model with its corrections.
    baseline: Fitted,
    /// Whether no way allows more.
    allows_most: bool,
}

impl<'a> Way<'a> {
    /// Fits the nominal model with its corrections, which tell the noise; `None` where it cannot be simulated.
    pub fn new(mut bench: Bench<'a>, allows_most: bool) -> Option<Self> {
        let first = bench.baseline()?;
        bench.refine_noise(&first.residuals);
        let baseline = bench.baseline()?;
        Some(Self { bench, baseline, allows_most })
    }

    /// Whether no more is left than a sound model may leave.
    fn says_all(&self) -> bool {
        !is_unsound(&self.baseline.losses, &self.bench.data)
    }

    /// Looks for at most so many effects; `fitting` is told those of each fit. `None` where a model cannot be simulated.
    pub fn searched(self, most: usize, fitting: &'a Fitting<'a>) -> Option<Found<'a>> {
        Found::in_full(self.looked_over(fitting), most)
    }

    fn looked_over(self, fitting: &'a Fitting<'a>) -> Search<'a> {
        Search::new(self.bench, self.baseline, self.allows_most, fitting)
    }
}

/// What was found in the better one of two ways, of which the second allows more and is prepared where it is needed; `None` where a model
/// cannot be simulated.
///
/// # Errors
/// Those of preparing the second one.
pub fn better<'a>(
    narrow: Way<'a>,
    wide: impl Fn() -> Result<Way<'a>>,
    fitting: &'a Fitting<'a>,
) -> Result<Option<Found<'a>>> {
    let at_once = if narrow.says_all() { None } else { Some(wide()?) };
    // Against coefficients that explain all by themselves several causes would hardly have the odds, and take minutes to find.
    let most = if at_once.as_ref().is_some_and(Way::says_all) { 1 } else { MOST_EFFECTS };
    let Some(mut found) = narrow.searched(1, fitting) else { return Ok(None) };
    if found.finds_nothing() {
        return Ok(Some(found));
    }
    let mut beside = at_once.map_or_else(wide, Ok)?.looked_over(fitting);
    match beside.single_that_says_all() {
        // Where the one that looks best has not the odds, others are not looked for in full.
        Some(best) if found.says_all() && found.beats(&beside.bench, &best) => return Ok(Some(found)),
        // Against a single one that explains all there, several would hardly have the odds either.
        Some(_) => {}
        None => found.up_to(most.min(AT_FIRST)),
    }
    let Some(mut other) = Found::in_full(beside, found.most_beside().min(AT_FIRST)) else { return Ok(None) };
    // Where another cause leads than was found, as many may be others.
    if other.search.leads_away_from(&found.chosen.best.hypothesis) {
        other.up_to(found.causes().min(AT_FIRST));
    }
    // A third one takes minutes to find, and none is missing where two say all.
    if !other.says_all() {
        found.up_to(most);
        other.up_to(found.most_beside());
    }
    Ok(Some(if found.beats(other.bench(), &other.chosen.best) { found } else { other }))
}

/// What was found where the coefficients of the nominal model may be off in one way.
pub struct Found<'a> {
    /// Where it was looked for.
    search: Search<'a>,
    /// What came of it.
    pub chosen: Chosen,
}

impl<'a> Found<'a> {
    /// What comes of a search for at most so many effects; `None` where a model cannot be simulated.
    fn in_full(mut search: Search<'a>, most: usize) -> Option<Self> {
        search.refine();
        let chosen = search.up_to(most)?;
        Some(Self { search, chosen })
    }

    /// The hypotheses' fits.
    pub fn bench(&self) -> &Bench<'a> {
        &self.search.bench
    }

    /// Looks for more effects, at most so many, where that is worth it.
    fn up_to(&mut self, most: usize) {
        if self.search.goes_on(most)
            && let Some(chosen) = self.search.up_to(most)
        {
            self.chosen = chosen;
        }
    }

    /// Whether no more is left than a sound model may leave and, of several causes, their forms.
    fn says_all(&self) -> bool {
        self.chosen.says_all(&self.bench().data)
    }

    /// Whether nothing is wrong, so that nothing can be where the coefficients may be off in a way that allows more.
    pub fn finds_nothing(&self) -> bool {
        self.causes() == 0 && self.says_all()
    }

    /// How many causes are worth looking for where the coefficients may be off in a way that allows more: where this says all, fewer causes
    /// than here, but a single one that may be another.
    pub fn most_beside(&self) -> usize {
        match self.causes() {
            0 => MOST_EFFECTS,
            _ if !self.says_all() => MOST_EFFECTS,
            causes => (causes - 1).max(1),
        }
    }

    /// Whether causes are found here that are better than the best fit where the coefficients may be off in a way that allows more. Each
    /// cause more must be worth it, and against coefficients alone they must show. A cause in no library must be worth it against one
    /// that has a name, and is none against coefficients that say all.
    fn beats(&self, wider: &Bench, best: &Fitted) -> bool {
        let [own, others] = [&self.chosen.best, best].map(|fitted| &fitted.hypothesis);
        let more = own.causes() as f64 - others.causes() as f64;
        let [is_unlisted, other_is_unlisted] = [own, others].map(|hypothesis| hypothesis.beside.is_some());
        let (may_be, stranger) = match others.causes() {
            0 if is_unlisted && !is_unsound(&best.losses, &wider.data) => (false, 0.0),
            0 => (self.chosen.shows_beside_coefficients(&self.bench().data), 0.0),
            _ => (true, f64::from(is_unlisted) - f64::from(other_is_unlisted)),
        };
        own.causes() > 0 && may_be && self.odds_against(wider, best) > LEAST_EVIDENCE * (more + stranger)
    }

    /// How many causes were found, one in no library among them.
    fn causes(&self) -> usize {
        self.chosen.best.hypothesis.causes()
    }

    /// Logarithm of the odds for the best fit here against that of another way, be it with the causes that both found in the forms that they
    /// have here: which form fits best hangs on how the coefficients may be off.
    fn odds_against(&self, wider: &Bench, best: &Fitted) -> f64 {
        let in_these_forms = in_forms_of(wider, best, &self.chosen.best);
        let each = [Some(best), in_these_forms.as_ref()];
        each.into_iter().flatten().map(|fit| self.odds_against_fit(wider, fit)).fold(f64::INFINITY, f64::min)
    }

    /// The odds against one fit of the other way; the likelihoods are those of the other one's data.
    fn odds_against_fit(&self, wider: &Bench, others: &Fitted) -> f64 {
        let own = &self.chosen.best;
        let losses = |fitted: &Fitted| wider.data.losses(&fitted.residuals, Scope::All);
        let (mut with, without) = (losses(own), losses(others));
        // The whiter residuals say how much a sample is worth, but no shape of a sound muscle is worth more than once in a block.
        for (a, b) in with.iter_mut().zip(&without) {
            a.effective = a.effective.max(b.effective).min(a.effective_beside_structure);
        }
        let more = own.hypothesis.size() as f64 - others.hypothesis.size() as f64;
        odds(&without, &with, more) - self.bench().price(own) + wider.price(others)
    }
}

/// A fit with the causes that were found elsewhere, too, in the forms that they have there; `None` where none was, or where they cannot
/// be so.
fn in_forms_of(bench: &Bench, own: &Fitted, elsewhere: &Fitted) -> Option<Fitted> {
    let shared = elsewhere.hypothesis.parts.iter().copied().filter(|part| own.hypothesis.has(part.effect.name));
    let shared = Hypothesis { parts: shared.collect(), beside: None };
    if shared.parts.is_empty() || own.hypothesis.names() == elsewhere.hypothesis.names() {
        return None;
    }
    let hypothesis = shared.parts.iter().fold(own.hypothesis.clone(), |all, part| all.in_form_of(*part));
    let without = shared.parts.iter().fold(own.parameters, |model, part| neutralised(&model, part.effect));
    let start = shared.at_work_in(&without, &elsewhere.parameters);
    bench.exact_fit(&hypothesis, &start, Scope::All).filter(Fitted::is_possible)
}
