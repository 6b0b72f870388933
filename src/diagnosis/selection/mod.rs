//! Which causes are named, if any: forward selection over a beam of hypotheses, with refusal in both directions.

pub mod evidence;
mod forms;
mod makeshift;
mod naming;
mod plain;

use super::Fitting;
use super::Verdict;
use super::fits::{Bench, Fitted, Slopes, Start};
use super::hypothesis::{Hypothesis, Part, has_many_minima, neutralised};
use super::residuals::{Loss, Scope};
use crate::effects::Effects;
use crate::measurement::Signal;
use evidence::*;
pub use forms::OUT_OF_REACH;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Evidence (natural logarithm of odds) that an effect must have: e¹⁰, about 22 000 to 1.
pub const LEAST_EVIDENCE: f64 = 10.0;
/// Share of what is left that a further effect must explain: less is how the first one's form differs from the true one.
const LEAST_FURTHER: f64 = 0.8;
/// The same of what is little enough to be the first one's form: a cause of its own leaves next to nothing of it.
const LEAST_OF_FORM: f64 = 0.9;
/// The same before the hypothesis is refined: fits of two effects that came to be named began at 0.87 and more.
const MAY_GO_FURTHER: f64 = 0.5;
/// The same before what the effects so far do is looked at anew.
pub const MAY_COME_FURTHER: f64 = 0.2;
/// Variance, relative to that of the noise, that an effect must take off where what is left without it may be the form of another one, or
/// coefficients that are off: what is less than the noise itself says nothing of a cause.
pub const LEAST_BESIDE_OTHERS: f64 = 1.0;
/// How many times the structural error of a sound model, or that share of the span where it has none, an error must be to be
/// called unexplained.
const UNEXPLAINED: f64 = 9.75;
/// Share of the largest reading by which a good sensor may drift, class 0.2: no reason to call a model wrong.
const SENSOR_CLASS: f64 = 0.002;
/// Hypotheses that are carried on at each number of effects, besides those that are best for a signal.
const BEAM: usize = 3;
/// Most effects that are looked for at once.
pub const MOST_EFFECTS: usize = 3;
/// Candidates that are fitted, of those that look promising: for the first effect, and for further ones; and the share of the
/// best one's promise from which on up to twice as many are, since then the promise does not tell which.
const FITTED: (usize, usize) = (9, 5);
const AS_PROMISING: f64 = 0.98;
/// Share of the best one's promise below which a single effect is not fitted before rivals count, or more effects than one.
const LESS_PROMISING: f64 = 0.5;
/// Starts from which a candidate is fitted, and the share of the first one's promise that a further one must have.
const STARTS: usize = 2;
const ALSO_PROMISING: f64 = 0.5;
/// Share of the squares in which starts of a form differ that are not the same one scaled.
const SAME_PROMISE: f64 = 1e-4;

/// A hypothesis with what speaks for it.
#[derive(Clone)]
pub struct Judged {
    /// The fit.
    pub fitted: Fitted,
    /// Evidence against the baseline.
    pub evidence: f64,
    /// Logarithm of its odds if nothing but noise were left, up to a constant: by this hypotheses are ranked.
    score: f64,
    /// Share of the error beyond noise that is explained.
    pub explained: f64,
}

/// The outcome of a search.
pub struct Chosen {
    /// What is said.
    pub verdict: Verdict,
    /// The hypothesis whose effects are named, fitted to the samples that fits may see; that of the baseline where none is.
    pub model: Fitted,
    /// Whether that fit saw all samples, since the first ones tell too little.
    pub saw_all: bool,
    /// The best fit to all samples, of causes in the library or of one that is in none; that of the baseline where there is no cause.
    pub best: Fitted,
    /// The hypothesis that leads, where it is refused a name.
    pub refused: Option<Fitted>,
    /// Per effect of the model, in its order: effects that could stand in its place.
    pub alternatives: Vec<Vec<&'static str>>,
    /// The hypotheses with these effects in their place.
    pub rivals: Vec<Fitted>,
    /// Single effects, the best first.
    pub singles: Vec<Judged>,
}

impl Chosen {
    /// Whether any cause is named.
    pub fn names_causes(&self) -> bool {
        !self.model.hypothesis.parts.is_empty()
    }
}

/// The search for the causes of what a baseline leaves.
pub struct Search<'a> {
    /// The hypotheses' fits.
    pub bench: Bench<'a>,
    fitting: &'a Fitting<'a>,
    /// The nominal model with its corrections.
    pub baseline: Fitted,
    /// Whether what the form of one cause may leave is worth a second one.
    minds_form: bool,
    /// Hypotheses of one effect, of two, and so on, the best of each first.
    levels: Vec<Vec<Judged>>,
    /// The single effect that looks best in its best form, where it is known but the others are not refined yet.
    best_single: Option<Judged>,
    /// Whether the single effects are as well as they get.
    is_refined: bool,
    /// Starts of the single effects that are not fitted yet since they promise less.
    unfitted: Vec<Vec<Start>>,
    /// From where each effect alone is best fitted.
    from: Vec<(Part, usize)>,
    /// The best cause that is in no library.
    unlisted: Option<Judged>,
    /// Whether what may rival several effects that lead is looked into, or need not be.
    is_done_with_rivals: bool,
}

impl<'a> Search<'a> {
    /// A search from a baseline, with the most promising single effects fitted but not refined; `fitting` is told the effects of each fit.
    /// Where another search lets the coefficients be off in a way that allows more, what the form of a cause may leave is that one's to
    /// explain: else coefficients that are off come out as a second cause.
    pub fn new(bench: Bench<'a>, baseline: Fitted, minds_form: bool, fitting: &'a Fitting<'a>) -> Self {
        let mut search = Self {
            bench,
            fitting,
            baseline,
            minds_form,
            levels: Vec::new(),
            best_single: None,
            is_refined: false,
            unfitted: Vec::new(),
            from: Vec::new(),
            unlisted: None,
            is_done_with_rivals: false,
        };
        let starts = search.starts();
        search.from = best_of_each(&starts);
        let least = LESS_PROMISING * starts.iter().map(|starts| starts[0].promise).fold(0.0, f64::max);
        let (promising, others) = starts.into_iter().partition(|starts| starts[0].promise >= least);
        search.unfitted = others;
        let singles = search.fitted(&search.baseline, promising, FITTED.0);
        search.levels = vec![search.judged_anew(singles)];
        search
    }

    /// Looks for causes in no library, too; until then there are none.
    pub fn look_beyond(&mut self) {
        self.unlisted = self.best_unlisted();
    }

    /// Whether no other search lets the coefficients be off in a way that allows more.
    pub fn allows_most(&self) -> bool {
        self.minds_form
    }

    /// The single effects that are fitted so far, the best first.
    pub fn singles(&self) -> &[Judged] {
        &self.levels[0]
    }

    /// Fits those single effects, too, that promise less. One of them may be the best, and tell the noise.
    fn complete(&mut self) {
        let (mut all, others) = (std::mem::take(&mut self.levels[0]), std::mem::take(&mut self.unfitted));
        let more = self.fitted(&self.baseline, others, FITTED.0.saturating_sub(all.len()));
        let is_better = |other: &Judged| all.first().is_none_or(|best| other.score > best.score);
        let is_another = more.first().is_some_and(is_better);
        all.extend(more);
        all = sorted(all);
        if is_another {
            self.best_single = None;
            all = self.judged_anew(all);
            self.look_beyond();
        }
        self.levels[0] = all;
    }

    /// The single effect that leads if only the one that looks best is refined, or a cause in no library that has the odds against it; `None`
    /// where none has the odds. The effects that promise less are not fitted for that.
    pub fn best_single(&mut self) -> Option<Fitted> {
        let mut singles = self.levels[0].clone();
        if !self.is_refined {
            if let Some(best) = singles.first_mut() {
                *best = self.best_single.take().unwrap_or_else(|| self.in_best_form(best.clone(), None));
                self.best_single = Some(best.clone());
            }
            singles = sorted(singles);
        }
        let leading = possible(&singles).filter(|best| self.leads(best));
        self.unlisted_instead_of(leading).or(leading).map(|leading| leading.fitted.clone())
    }

    /// Refines the single effects.
    fn refine(&mut self) {
        if self.is_refined {
            return;
        }
        self.complete();
        if self.may_show() {
            let (singles, best) = (std::mem::take(&mut self.levels[0]), self.best_single.take());
            self.levels[0] = self.refined_best(singles, best);
        }
        self.is_refined = true;
    }

    /// Whether another effect than those that were found elsewhere does best alone, by what an effect must have.
    pub fn leads_away_from(&self, found: &Hypothesis) -> bool {
        let is_found = |single: &&Judged| found.has(single.fitted.hypothesis.parts[0].effect.name);
        let singles = &self.levels[0];
        match (singles.first(), singles.iter().find(is_found)) {
            (Some(best), Some(other)) => evidence(&other.fitted, &best.fitted) > LEAST_EVIDENCE,
            (best, _) => best.is_some(),
        }
    }

    fn judge(&self, fitted: Fitted) -> Judged {
        let evidence = evidence(&self.baseline, &fitted);
        let explained = explained(&self.baseline.losses, &fitted.losses, &self.bench.data);
        let score = self.bench.data.log_likelihood(&fitted.losses)
            - fitted.hypothesis.size() as f64 * price_of_parameter(&fitted);
        Judged { fitted, evidence, score, explained }
    }

    /// Looks for at most so many effects at once, as long as one more is worth it, and chooses; `None` where a model cannot be simulated.
    pub fn up_to(&mut self, most: usize) -> Option<Chosen> {
        self.refine();
        while self.goes_on(most) {
            let next = self.next_level(self.levels.last()?);
            self.levels.push(next);
        }
        self.choose()
    }

    /// Takes a single effect that was found elsewhere, in the form that it has there, where that is better than what was found of it here: which start
    /// promises most hangs on how the coefficients may be off.
    pub fn take_single(&mut self, found: &Fitted) {
        let ([_], None) = (&found.hypothesis.parts[..], found.hypothesis.beside) else { return };
        let Some(fitted) = self.bench.exact_fit(&found.hypothesis, &found.parameters, Scope::All) else { return };
        let single = self.judge(fitted);
        let singles = &mut self.levels[0];
        if singles.iter().any(|known| same_effects(known, &single) && known.score >= single.score) {
            return;
        }
        singles.retain(|known| !same_effects(known, &single));
        let mut singles = std::mem::take(singles);
        let is_best = singles.first().is_none_or(|best| single.score > best.score);
        singles.push(single);
        singles = sorted(singles);
        if is_best {
            singles = self.judged_anew(singles);
            // What leaves nothing is in its best form.
            self.best_single = singles.first().filter(|best| self.says_all(best)).cloned();
        }
        self.levels[0] = singles;
    }

    /// Whether a hypothesis can be, and leaves no more than a sound model may.
    fn says_all(&self, judged: &Judged) -> bool {
        is_possible(judged) && !is_unsound(&judged.fitted.losses, &self.bench.data)
    }

    /// Takes two effects that were found elsewhere, and what is as good as they are here, for all that there is to find of one or two.
    pub fn take_two(&mut self, found: &Fitted) -> Option<()> {
        self.complete();
        self.is_refined = true;
        let both = self.judge(self.bench.exact_fit(&found.hypothesis, &found.parameters, Scope::All)?);
        let both = self.in_best_form(both, None);
        let next = self.with_exchanged(&self.levels[0], vec![both]);
        self.levels.push(next);
        Some(())
    }

    /// Chooses anew, with those hypotheses in their best form that may rival several effects that lead; `None` where no such lead, or that is done
    /// or need not be.
    pub fn with_rivals(&mut self) -> Option<Chosen> {
        let effects = self.leading()?.fitted.hypothesis.parts.len();
        if effects < 2 || std::mem::replace(&mut self.is_done_with_rivals, true) {
            return None;
        }
        let level = self.levels.iter().position(|level| effects_of(level) == effects)?;
        let hypotheses = std::mem::take(&mut self.levels[level]);
        let was_best = possible(&hypotheses).cloned();
        let mut hypotheses = self.rivals_in_best_form(hypotheses);
        // What became the best by its form may lend that to what was.
        if let (Some(was), Some(best)) = (was_best, possible(&hypotheses))
            && !same_effects(&was, best)
        {
            hypotheses = self.with_exchanged(&self.levels[level - 1], hypotheses);
        }
        self.levels[level] = hypotheses;
        self.choose()
    }

    /// Whether at most so many effects at once are more than were looked for, and worth it.
    pub fn goes_on(&self, most: usize) -> bool {
        self.levels.len() < most && self.is_worth_going_on()
    }

    /// Whether two effects at once were looked for, and no second one was worth a closer look beside any other one.
    pub fn ends_at_one(&self) -> bool {
        self.levels.get(1).is_some_and(Vec::is_empty)
    }

    /// Judges fits again with what the first of them shows of the noise, where it has the odds.
    fn judged_anew(&mut self, fits: Vec<Judged>) -> Vec<Judged> {
        let Some(first) = fits.first().filter(|first| first.evidence > LEAST_EVIDENCE) else { return fits };
        self.bench.refine_noise(&first.fitted.residuals);
        let baseline = self.bench.anew(&self.baseline);
        let fits: Vec<_> = fits.into_par_iter().filter_map(|judged| self.bench.anew(&judged.fitted)).collect();
        self.baseline = baseline.unwrap_or_else(|| self.baseline.clone());
        sorted(fits.into_iter().map(|fitted| self.judge(fitted)).collect())
    }

    /// Where fits of single effects start, the most promising of each first.
    fn starts(&self) -> Vec<Vec<Start>> {
        let base = self.bench.base(&self.baseline);
        let starts = Effects::DESCRIPTIONS.par_iter().map(|effect| self.bench.starts(&base, effect));
        starts.filter(|starts| !starts.is_empty()).collect()
    }

    /// The most promising hypotheses with one effect more, the best first. The base that leads is worth a look at every start;
    /// the others are extended from where each effect alone is best fitted, but for those whose error has many minima.
    fn extend(&self, base: &Fitted, leads: bool, from: &[(Part, usize)]) -> Vec<Judged> {
        let at = self.bench.base(base);
        let others = from.par_iter().filter(|(part, _)| !base.hypothesis.has(part.effect.name));
        let starts = others.map(|(part, choice)| {
            if leads || has_many_minima(part.effect) {
                self.bench.starts(&at, part.effect)
            } else {
                self.bench.start(&at, *part, *choice).into_iter().collect()
            }
        });
        self.fitted(base, starts.filter(|starts| !starts.is_empty()).collect(), FITTED.1)
    }

    /// Fits of the most promising effects, each from its most promising starts, the best first.
    fn fitted(&self, base: &Fitted, mut starts: Vec<Vec<Start>>, most: usize) -> Vec<Judged> {
        starts.sort_by(|a, b| b[0].promise.total_cmp(&a[0].promise));
        let as_good = AS_PROMISING * starts.first().map_or(0.0, |best| best[0].promise);
        let equal = starts.iter().take_while(|starts| starts[0].promise >= as_good).count();
        starts.truncate(equal.clamp(most, 2 * most));
        if starts.is_empty() {
            return Vec::new();
        }
        let Some(slopes) = self.bench.slopes(base) else { return Vec::new() };
        let base = self.judge(base.clone());
        let best = |starts: Vec<Start>| {
            let also = ALSO_PROMISING * starts[0].promise;
            let from = worth_fitting(&starts).filter(|start| start.promise >= also);
            from.filter_map(|start| self.fitted_from(&base, start, &slopes)).max_by(|a, b| a.score.total_cmp(&b.score))
        };
        sorted(starts.into_par_iter().filter_map(best).collect())
    }

    /// A fit of what a base has and one effect more: first with what the base does to the residuals taken as known, and anew where that
    /// looks as if it might be worth it.
    fn fitted_from(&self, base: &Judged, start: &Start, slopes: &Slopes) -> Option<Judged> {
        let hypothesis = base.fitted.hypothesis.with(start.part);
        (self.fitting)(&hypothesis.names().join(" + "));
        let first = self.judge(self.bench.rough_fit_with(slopes, &hypothesis, &self.bench.settled(start))?);
        if base.fitted.hypothesis.parts.is_empty() || self.further(base, &first) < MAY_COME_FURTHER {
            return Some(first);
        }
        self.bench.rough_fit(&hypothesis, &first.fitted.parameters).map(|fitted| self.judge(fitted))
    }

    /// Whether the last level brought a better hypothesis, and that leaves an error that is worth a further effect; or whether no single
    /// effect has the odds for it, as each of two leaves the other one's error. What the form of one cause may leave is worth a second one;
    /// what the forms of two may leave is not worth a third.
    fn is_worth_going_on(&self) -> bool {
        let now = self.levels.last().map_or(0, |level| effects_of(level));
        let asks_for_more = |best: &Judged| {
            is_unsound(&best.fitted.losses, &self.bench.data)
                && (now == 1 && self.minds_form || !self.may_be_form(&best.fitted.losses))
        };
        let is_worth = match self.leading() {
            Some(best) => best.fitted.hypothesis.parts.len() == now && asks_for_more(best),
            None => now == 1 && !self.is_sound(&self.baseline.losses),
        };
        is_worth && !self.unlisted_says_all()
    }

    /// Whether residuals are small enough to be those of forms or of a sound model.
    fn may_be_form(&self, losses: &[Loss]) -> bool {
        may_be_form(&self.baseline.losses, losses, &self.bench.data)
    }

    /// Share of what a hypothesis leaves that another one explains, in the signals in which it leaves more than forms may; where
    /// it leaves no more than that anywhere, in those in which it leaves more than a sound model may.
    fn further(&self, fewer: &Judged, more: &Judged) -> f64 {
        let [before, left, after] =
            [&self.baseline, &fewer.fitted, &more.fitted].map(|fitted| beyond_noise(&fitted.losses));
        let (mut worth, mut still) = (0.0, 0.0);
        let is_form_alone = self.may_be_form(&fewer.fitted.losses);
        for (signal, left) in left {
            let of_structure = left_by_structure(signal, &self.bench.data);
            let least = if is_form_alone { of_structure } else { left_by_form(before[&signal]) };
            if left > least {
                // What a sound model may leave is not there to be explained.
                worth += (left - of_structure).max(0.0);
                still += (after[&signal] - of_structure).max(0.0);
            } else {
                still += (after[&signal] - left).max(0.0);
            }
        }
        if worth > 0.0 { 1.0 - still / worth } else { 0.0 }
    }

    /// The most promising hypotheses with one effect more than those of a level, the best first.
    fn next_level(&self, level: &[Judged]) -> Vec<Judged> {
        let bases = carried_on(level);
        let (first, others) = bases.split_at(bases.len().min(1));
        let mut more = self.beside(level, first);
        // What forms may leave is looked into where the best leaves it first; and beside what looks worse alone where two are not enough there.
        let is_form_alone = level.first().is_some_and(|best| self.may_be_form(&best.fitted.losses));
        let is_best_first = is_form_alone || self.are_enough(level, &more);
        let others = if is_best_first {
            others.to_vec()
        } else {
            more.extend(self.beside(level, others));
            not_carried_on(level, &bases)
        };
        let mut next = self.worth_refining(level, more);
        let is_missed =
            if is_best_first { !next.iter().any(|more| self.is_worth_more(level, more)) } else { next.is_empty() };
        if is_missed && effects_of(level) == 1 {
            next.extend(self.worth_refining(level, self.beside(level, &others)));
            next = each_once(next);
        }
        self.with_exchanged(level, next)
    }

    /// Whether of fits with two effects the best, fitted to the end, can be, is worth more than one, and leaves no more than forms may.
    fn are_enough(&self, level: &[Judged], two: &[Judged]) -> bool {
        let two = two.first().filter(|_| effects_of(level) == 1).map(|two| self.finished(two.clone()));
        two.is_some_and(|two| {
            is_possible(&two) && self.may_be_form(&two.fitted.losses) && self.is_worth_more(level, &two)
        })
    }

    /// Hypotheses with one effect more than those of a level, and those with effects of the best, and of the best that can be, exchanged for others
    /// until no other one becomes the best by that; the best first.
    fn with_exchanged(&self, level: &[Judged], mut next: Vec<Judged>) -> Vec<Judged> {
        let mut exchanged_in: Vec<Vec<&str>> = Vec::new();
        loop {
            // Of what would be better but cannot be, one effect alone may be wrong.
            let mut leading = possible(&next).into_iter().chain(next.first());
            let is_new = |best: &&Judged| !exchanged_in.contains(&best.fitted.hypothesis.names());
            let Some(best) = leading.find(is_new) else { return next };
            exchanged_in.push(best.fitted.hypothesis.names());
            let others = self.exchanged(level, &next, best);
            next.extend(others);
            next = each_once(next);
        }
    }

    /// The hypotheses of some ranks of a level with one effect more each, the best of each rank first.
    fn beside(&self, level: &[Judged], ranks: &[usize]) -> Vec<Judged> {
        ranks.iter().flat_map(|&rank| self.extend(&level[rank].fitted, rank == 0, &self.from)).collect()
    }

    /// Hypotheses with effects of the best exchanged for others, those that are `known` to be as good in another form left out.
    ///
    /// Where the best leaves more than forms may, the earlier effects are exchanged, beside what the rest is without them: alone, a wrong one
    /// may have looked better. So is the last one, from all its starts beside what the rest is with it: it may have been found beside an
    /// earlier one that was in a poor form yet. Where the best leaves no more than that, and is worth one effect more than a level has, all are
    /// exchanged, beside what the rest is with them: what does the same there may not have been found from elsewhere.
    fn exchanged(&self, level: &[Judged], known: &[Judged], best: &Judged) -> Vec<Judged> {
        let parts = &best.fitted.hypothesis.parts;
        let leaves_much = !self.may_be_form(&best.fitted.losses);
        let beside = |part: Part| Some((part, self.bench.neutralised(&best.fitted, part.effect)?));
        let without = |part: Part| Some((part, self.without(best, &part)?.fitted));
        let Some((last, earlier)) = parts.split_last() else { return Vec::new() };
        let bases: Vec<(Part, Fitted)> = if leaves_much {
            earlier.iter().copied().filter_map(without).chain(beside(*last)).collect()
        } else if self.is_worth_more(level, best) {
            parts.iter().copied().filter_map(beside).collect()
        } else {
            Vec::new()
        };
        let exchange = |(part, base): &(Part, Fitted)| {
            let others = self.from.iter().copied().filter(|(other, _)| other.effect.name != part.effect.name);
            let leads = leaves_much && part.effect.name == last.effect.name;
            self.extend(base, leads, &others.collect::<Vec<_>>())
        };
        let mut exchanged: Vec<Judged> = bases.iter().flat_map(exchange).collect();
        let is_known =
            |other: &Judged| known.iter().any(|known| same_effects(known, other) && known.score >= other.score);
        exchanged.retain(|other| !is_known(other) && !self.is_out_of_reach(Some(best), other));
        self.worth_refining(level, exchanged)
    }

    /// Of hypotheses those that may be worth more effects than a level has, each once, refined, the best first.
    fn worth_refining(&self, level: &[Judged], more: Vec<Judged>) -> Vec<Judged> {
        let may_be = |judged: &Judged| possible(level).is_none_or(|fewer| self.further(fewer, judged) > MAY_GO_FURTHER);
        self.refined_best(first_of_each(sorted(more).into_iter().filter(may_be)), None)
    }

    /// A hypothesis fitted without one of its effects.
    fn without(&self, judged: &Judged, part: &Part) -> Option<Judged> {
        let start = neutralised(&judged.fitted.parameters, part.effect);
        let hypothesis = judged.fitted.hypothesis.without(part.effect.name);
        Some(self.judge(self.bench.exact_fit(&hypothesis, &start, Scope::All)?))
    }

    /// Whether an error is no reason to call a model wrong, nor to look for more than one cause.
    fn is_sound(&self, losses: &[Loss]) -> bool {
        let data = &self.bench.data;
        let of_sensor = |signal| data.share_of_reading(signal, SENSOR_CLASS);
        let of_structure = |signal| UNEXPLAINED.powi(2) * data.share_of_span(signal);
        leaves_at_most(losses, |signal| left_by_noise(signal, data) + of_structure(signal).max(of_sensor(signal)))
    }

    /// The best hypothesis of all levels, each of which must be worth its effects; the first may be of two.
    fn leading(&self) -> Option<&Judged> {
        let leads = |best: &&Judged| self.leads(best);
        let (singles, further) = self.levels.split_first()?;
        let mut best = possible(singles).filter(leads);
        for level in further {
            let is_worth = |more: &&Judged| best.map_or_else(|| leads(more), |best| self.is_worth(best, more));
            let Some(more) = possible(level).filter(is_worth) else { break };
            best = Some(more);
        }
        best
    }

    /// Whether a hypothesis may lead where none with fewer effects does: it has the odds, and shows.
    fn leads(&self, judged: &Judged) -> bool {
        judged.evidence > LEAST_EVIDENCE && self.shows(&self.baseline.losses, &judged.fitted.losses)
    }

    /// Whether a hypothesis with more effects is worth them: it pays, and explains a good part of what is left without.
    fn is_worth(&self, fewer: &Judged, more: &Judged) -> bool {
        let is_form_alone = self.may_be_form(&fewer.fitted.losses);
        let (share, variance) =
            if is_form_alone { (LEAST_OF_FORM, LEAST_BESIDE_OTHERS) } else { (LEAST_FURTHER, NEGLIGIBLE) };
        evidence(&fewer.fitted, &more.fitted) > LEAST_EVIDENCE
            && self.further(fewer, more) > share
            && takes_off(&fewer.fitted.losses, &more.fitted.losses, &self.bench.data, variance)
    }

    /// Whether a hypothesis is worth more effects than those of a level.
    fn is_worth_more(&self, level: &[Judged], more: &Judged) -> bool {
        possible(level).is_some_and(|fewer| self.is_worth(fewer, more))
    }

    /// Whether what an effect takes off the error of some signal is more than the structural error of a sound model:
    /// less may be that.
    fn shows(&self, without: &[Loss], with: &[Loss]) -> bool {
        takes_off(without, with, &self.bench.data, NEGLIGIBLE)
    }

    /// Whether an effect could show at all.
    fn may_show(&self) -> bool {
        !leaves_at_most(&self.baseline.losses, |signal| self.bench.data.structure(signal).max(NEGLIGIBLE))
    }
}

/// What each parameter takes off the score of a fit.
fn price_of_parameter(fitted: &Fitted) -> f64 {
    0.5 * (fitted.residuals.len() as f64).ln()
}

/// How many effects the hypotheses of a level have; 0 where there are none.
fn effects_of(level: &[Judged]) -> usize {
    level.first().map_or(0, |judged| judged.fitted.hypothesis.parts.len())
}

/// The best hypothesis of each set of effects, one that is possible where there is one; the best first.
fn each_once(judged: Vec<Judged>) -> Vec<Judged> {
    let (possible, impossible): (Vec<_>, Vec<_>) = judged.into_iter().partition(is_possible);
    sorted(first_of_each(sorted(possible).into_iter().chain(sorted(impossible))))
}

/// Of hypotheses with the same effects the first one.
fn first_of_each(judged: impl Iterator<Item = Judged>) -> Vec<Judged> {
    let mut once: Vec<Judged> = Vec::new();
    for judged in judged {
        if !once.iter().any(|known| same_effects(known, &judged)) {
            once.push(judged);
        }
    }
    once
}

/// Starts of an effect, those left out that promise the same in the same form: the other way round, or so much larger.
fn distinct(starts: &[Start]) -> impl Iterator<Item = &Start> {
    let same = |a: &Start, b: &Start| a.part.form == b.part.form && (a.promise - b.promise).abs() < SAME_PROMISE;
    starts
        .iter()
        .enumerate()
        .filter(move |(k, start)| !starts[..*k].iter().any(|known| same(known, start)))
        .map(|(_, s)| s)
}

/// Starts of an effect from which it is fitted. Those of forms with many minima are chosen form by form: what these promise leaves out
/// what they make worse.
fn worth_fitting(starts: &[Start]) -> impl Iterator<Item = &Start> {
    let mut taken: BTreeMap<Option<usize>, usize> = BTreeMap::new();
    distinct(starts).filter(move |start| {
        let of_kind = taken.entry(start.part.has_many_minima().then_some(start.part.form)).or_default();
        *of_kind += 1;
        *of_kind <= STARTS
    })
}

/// From where each effect is best fitted.
fn best_of_each(starts: &[Vec<Start>]) -> Vec<(Part, usize)> {
    starts.iter().map(|starts| (starts[0].part, starts[0].choice)).collect()
}

fn same_effects(a: &Judged, b: &Judged) -> bool {
    a.fitted.hypothesis.names() == b.fitted.hypothesis.names()
}

/// Whether the effects of a hypothesis are such as they can be.
fn is_possible(judged: &Judged) -> bool {
    judged.fitted.is_possible()
}

/// The best hypothesis that is possible.
fn possible(level: &[Judged]) -> Option<&Judged> {
    level.iter().find(|judged| is_possible(judged))
}

/// Ranks of the hypotheses that are carried on: the best, and for each signal the one that leaves least of it, since of two
/// effects each may be alone in its signal.
fn carried_on(level: &[Judged]) -> Vec<usize> {
    let left: Vec<BTreeMap<Signal, f64>> = level.iter().map(|judged| beyond_noise(&judged.fitted.losses)).collect();
    let signals = left.first().into_iter().flat_map(|left| left.keys());
    let best_for = |signal: &Signal| (0..level.len()).min_by(|a, b| left[*a][signal].total_cmp(&left[*b][signal]));
    let mut chosen: Vec<usize> = (0..level.len().min(BEAM)).chain(signals.filter_map(best_for)).collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// Ranks of the others that have the odds. Where two effects hide each other, the second may be found beside one of them only, and that one
/// need not look good alone.
fn not_carried_on(level: &[Judged], carried_on: &[usize]) -> Vec<usize> {
    (0..level.len()).filter(|rank| !carried_on.contains(rank) && level[*rank].evidence > LEAST_EVIDENCE).collect()
}

fn sorted(mut judged: Vec<Judged>) -> Vec<Judged> {
    judged.sort_by(|a, b| b.score.total_cmp(&a.score));
    judged
}
