//! Which of the hypotheses that were found is told, if any: what can be spared is left out, what does not foretell unseen samples is
//! refused, and what explains them as well is told beside it.

use super::evidence::*;
use super::{Chosen, Judged, LEAST_EVIDENCE, Search, effects_of, is_possible, same_effects, sorted};
use crate::diagnosis::fits::Fitted;
use crate::diagnosis::hypothesis::{Part, declared};
use crate::diagnosis::residuals::Scope;
use crate::diagnosis::{FittedParameter, Verdict};
use crate::effects::Holds;
use crate::parameters::Parameters;
use rayon::prelude::*;

/// Share of the error beyond noise that the named causes together must explain: of all samples, and of those that the fit did
/// not see. Measured seals leave 3.5 % in the form of friction that we have, a measured leak 5 to 10 % of what is unseen.
pub const LEAST_EXPLAINED: (f64, f64) = (0.96, 0.9);
/// The same where all causes are scales and zeros: these have no form that could differ from ours.
pub const LEAST_EXPLAINED_EXACTLY: (f64, f64) = (0.995, 0.95);
/// The same where a cause is left to chance. A pilot that sticks ends each fast move anywhere between the command and its
/// threshold h before it: of the mean square h²/3 of that, the variance h²/12 cannot be foretold.
const LEAST_EXPLAINED_BUT_FOR_CHANCE: (f64, f64) = (0.75, 0.75);
/// Odds up to which a rival explains the data as well as the best: 20 to 1, in natural logarithm.
pub const RIVAL: f64 = 3.0;
/// Variance that a rival may leave beside what the best leaves, where both leave no more than [`LEFT_BY_FORM`]: as much lies
/// in the forms, which are never known exactly. Beside a single cause one in a simpler form may leave all of that.
const ALSO_BY_FORM: f64 = 3.0;
/// Logarithm of the likelihood that a parameter without meaning takes along by chance, in one of twenty cases: half of the 95 %
/// quantile of χ² with one degree of freedom.
const SPARED: f64 = 1.92;

/// A hypothesis that is told.
struct Told {
    /// Number of parameters with which it can be.
    size: usize,
    /// Its fit, without refinements that may as well be neutral.
    model: Fitted,
    /// Whether the fit foretold samples that it did not see.
    holds_out: bool,
}

impl Search<'_> {
    pub(super) fn choose(&self) -> Option<Chosen> {
        match self.leading() {
            Some(best) => self.chosen(best.clone()),
            None => self.unnamed(None),
        }
    }

    /// What is said where a hypothesis leads.
    pub(super) fn chosen(&self, best: Judged) -> Option<Chosen> {
        let best = self.assured(self.pruned(best));
        match self.as_told(&best) {
            Some(told) => self.named(best, told),
            None => self.unnamed(Some(&best)),
        }
    }

    /// What there is where nothing can be named, be it that what leads is refused: a cause in no library, if there is one that does better.
    fn unnamed(&self, refused: Option<&Judged>) -> Option<Chosen> {
        let Fitted { hypothesis, parameters, losses, .. } = &self.baseline;
        let unlisted = self.unlisted_instead_of(refused);
        let is_nominal = unlisted.is_none() && self.is_sound(losses);
        Some(Chosen {
            verdict: if is_nominal { Verdict::Nominal } else { Verdict::Unexplained },
            best: unlisted.map_or(&self.baseline, |unlisted| &unlisted.fitted).clone(),
            refused: refused.map(|refused| refused.fitted.clone()),
            model: self.bench.exact_fit(hypothesis, parameters, Scope::Training)?,
            saw_all: false,
            alternatives: Vec::new(),
            rivals: Vec::new(),
            singles: self.levels.first()?.clone(),
        })
    }

    /// The best hypothesis with its rivals.
    fn named(&self, best: Judged, told: Told) -> Option<Chosen> {
        let parts = &best.fitted.hypothesis.parts;
        let of_as_many = self.levels.iter().find(|level| effects_of(level) == parts.len());
        let rivals = self.rivals(&best, told.size, of_as_many.map_or(&[], |level| level));
        let alternatives: Vec<Vec<&'static str>> =
            parts.iter().map(|part| in_place_of(part.effect.name, &best, &rivals)).collect();
        let verdict = if alternatives.iter().any(|a| !a.is_empty()) {
            Verdict::Ambiguous
        } else if self.is_sound(&best.fitted.losses) {
            Verdict::Explained
        } else {
            Verdict::PartlyExplained
        };
        Some(Chosen {
            verdict,
            rivals: rivals.into_iter().map(|rival| rival.fitted.clone()).collect(),
            best: best.fitted,
            refused: None,
            model: told.model,
            saw_all: !told.holds_out,
            alternatives,
            singles: self.levels.first()?.clone(),
        })
    }

    /// A hypothesis as it is told; `None` where it is no name.
    fn as_told(&self, best: &Judged) -> Option<Told> {
        if best.explained < least_explained(&best.fitted).0 || is_better_if_impossible(&self.levels, best) {
            return None;
        }
        let plain = self.simplest(best);
        let size = plain.fitted.hypothesis.size();
        let told = self.without_idle(plain.clone());
        // As it is told, without refinements that only comparisons paid for, it must lose, too.
        if [best, &told].into_iter().all(|judged| self.unlisted_instead_of(Some(judged)).is_some()) {
            return None;
        }
        let are_idle = told.fitted.hypothesis.size() < size;
        let foretold = self.foretelling(told.clone());
        let foretold = foretold.or_else(|| if are_idle { self.foretelling(plain) } else { None });
        let foretold = foretold.or_else(|| {
            let mut fewer = self.one_refinement_fewer(&told).into_iter();
            fewer.find_map(|fewer| self.foretelling(fewer))
        });
        foretold.map(|(model, holds_out)| Told { size, model, holds_out })
    }

    /// A single cause with each of its refinements left out that explains enough so, too, the best first: two that hold a course together among
    /// the samples that a fit sees may part beyond them.
    fn one_refinement_fewer(&self, told: &Judged) -> Vec<Judged> {
        let [part] = told.fitted.hypothesis.parts[..] else { return Vec::new() };
        let each: Vec<&str> = part.refinements().map(|(name, _)| *name).collect();
        let fewer = each.into_par_iter().filter_map(|left_out| {
            let fewer = self.judge(self.bench.less_refined(&told.fitted, |name| name != left_out)?);
            (is_possible(&fewer) && fewer.explained >= least_explained(&fewer.fitted).0).then_some(fewer)
        });
        sorted(fewer.collect())
    }

    /// Drops effects that a hypothesis of several can spare and be possible, the most superfluous first: fitted anew without it or, where
    /// that goes where the others cannot be, as these are beside it. What is left without it may be the others' form, which fits of these alone
    /// may have missed from where they began.
    fn pruned(&self, judged: Judged) -> Judged {
        let parts = judged.fitted.hypothesis.parts.clone();
        if parts.len() < 2 {
            return judged;
        }
        let fewer = parts.par_iter().filter_map(|part| {
            let as_it_is = || self.bench.neutralised(&judged.fitted, part.effect).map(|fitted| self.judge(fitted));
            let fewer = self.without(&judged, part).filter(is_possible).or_else(as_it_is).filter(is_possible)?;
            let in_best_form = self.may_be_form(&fewer.fitted.losses).then(|| self.in_best_form(fewer.clone(), None));
            Some(in_best_form.filter(is_possible).unwrap_or(fewer))
        });
        match fewer.max_by(|a, b| a.score.total_cmp(&b.score)) {
            Some(fewer) if !self.is_worth(&fewer, &judged) => self.pruned(fewer),
            _ => judged,
        }
    }

    /// Drops effects of several that may as well be neutral, with their size alone, too, as parameters may stand in for each other: what the
    /// odds make of them hangs on a few blocks, and is more likely the form of the others.
    fn assured(&self, judged: Judged) -> Judged {
        let Fitted { hypothesis, .. } = &judged.fitted;
        if hypothesis.parts.len() < 2 {
            return judged;
        }
        let in_doubt = hypothesis.parts.iter().find(|part| {
            self.may_be_neutral(&judged.fitted, part)
                && self.bench.of_size_alone(&judged.fitted, part).is_some_and(|plain| self.may_be_neutral(&plain, part))
        });
        match in_doubt.and_then(|part| self.without(&judged, part)).filter(is_possible) {
            Some(fewer) => self.assured(fewer),
            None => judged,
        }
    }

    /// Whether the intervals of all parameters of an effect hold their neutral values.
    fn may_be_neutral(&self, fitted: &Fitted, part: &Part) -> bool {
        let (own, _) = self.bench.intervals(fitted, Scope::All);
        own.iter().filter(|own| part.freed().any(|(name, _)| *name == own.name)).all(holds_neutral)
    }

    /// The hypothesis without refinements, where that leaves nothing either and its causes can be so: they were for the comparison with its rivals.
    fn simplest(&self, judged: &Judged) -> Judged {
        if !judged.fitted.hypothesis.is_refined() {
            return judged.clone();
        }
        let plain = self.bench.less_refined(&judged.fitted, |_| false);
        let plain = plain.filter(|fitted| is_negligible(&fitted.losses)).map(|fitted| self.judge(fitted));
        plain.filter(is_possible).unwrap_or_else(|| judged.clone())
    }

    /// The hypothesis without those refinements that may as well be neutral: by their intervals, and by what is lost without them.
    fn without_idle(&self, judged: Judged) -> Judged {
        if !judged.fitted.hypothesis.is_refined() {
            return judged;
        }
        let (own, _) = self.bench.intervals(&judged.fitted, Scope::All);
        let parts = &judged.fitted.hypothesis.parts;
        let is_refinement =
            |own: &&FittedParameter| parts.iter().any(|part| part.refinements().any(|(name, _)| *name == own.name));
        let mut idle: Vec<&FittedParameter> =
            own.iter().filter(is_refinement).filter(|own| holds_neutral(own)).collect();
        // In its interval, the ones that are nearest to neutral first.
        let doubt =
            |own: &FittedParameter| (own.value - neutral(own)).abs() / (own.high - own.low).max(f64::MIN_POSITIVE);
        idle.sort_by(|a, b| doubt(a).total_cmp(&doubt(b)));
        let ways = [&idle[..], &idle[..idle.len().min(1)]];
        let fewer = ways.into_iter().filter(|idle| !idle.is_empty()).find_map(|idle| self.spared(&judged, idle));
        fewer.map_or(judged, |fewer| self.without_idle(fewer))
    }

    /// The hypothesis without some of its refinements; `None` where more is lost than chance takes.
    fn spared(&self, judged: &Judged, idle: &[&FittedParameter]) -> Option<Judged> {
        let is_wanted = |name: &str| idle.iter().all(|idle| idle.name != name);
        let fewer = self.judge(self.bench.less_refined(&judged.fitted, is_wanted)?);
        let [likelihood, without] =
            [judged, &fewer].map(|judged| self.bench.data.log_likelihood(&judged.fitted.losses));
        (is_possible(&fewer) && likelihood - without <= SPARED * idle.len() as f64).then_some(fewer)
    }

    /// A hypothesis fitted to the samples that fits may see, and whether it foretells the others; or, where these tell too little,
    /// as it was fitted to all: they cannot tell it from their own best, or are foretold by a fit to the others. `None` where neither will
    /// do.
    fn foretelling(&self, told: Judged) -> Option<(Fitted, bool)> {
        let seeing = |seen| self.bench.exact_fit(&told.fitted.hypothesis, &told.fitted.parameters, seen);
        let foretells = |fitted: &Fitted, seen| {
            Some(fitted.is_possible() && self.holds(fitted, seen)? && !self.bench.shows_elsewhere(fitted, seen))
        };
        let model = seeing(Scope::Training)?;
        if foretells(&model, Scope::Training)? {
            return Some((model, true));
        }
        let tells_too_little = model.is_possible() && self.is_as_good_in_training(&told.fitted, &model)
            || foretells(&seeing(Scope::HeldOut)?, Scope::HeldOut)?;
        (tells_too_little && self.holds(&told.fitted, Scope::Training)?).then_some((told.fitted, false))
    }

    /// Whether the first samples cannot tell a fit from their own best.
    ///
    /// A pilot that sticks jumps or does not: values that no jump among the first samples tells apart make the later ones
    /// different altogether.
    fn is_as_good_in_training(&self, fitted: &Fitted, trained: &Fitted) -> bool {
        let seen = |fitted: &Fitted| self.bench.data.losses(&fitted.residuals, Scope::Training);
        !self.shows(&seen(fitted), &seen(trained))
    }

    /// Whether a fit does better than the baseline, fitted to some samples, does on all others.
    pub(super) fn holds(&self, fitted: &Fitted, seen: Scope) -> Option<bool> {
        let Fitted { hypothesis, parameters, .. } = &self.baseline;
        let baseline = self.bench.exact_fit(hypothesis, parameters, seen)?;
        let unseen = |of: &Fitted| self.bench.data.losses(&of.residuals, seen.others());
        let (without, with) = (unseen(&baseline), unseen(fitted));
        let explained = explained(&without, &with, &self.bench.data);
        Some(gain(&without, &with) > 0.0 && explained > least_explained(fitted).1)
    }

    /// Hypotheses that explain the data as well as the best, which can be told with `size` parameters: all that the odds allow, or else
    /// the one whose forms may be why it is not the best.
    fn rivals<'l>(&self, best: &Judged, size: usize, level: &'l [Judged]) -> Vec<&'l Judged> {
        let possible = level.iter().filter(|other| !same_effects(other, best) && is_possible(other));
        let odds = |other: &&Judged| evidence(&other.fitted, &best.fitted);
        let (equal, behind): (Vec<_>, Vec<_>) = possible.partition(|other| odds(other) < RIVAL);
        let by_form = || behind.into_iter().filter(|other| self.differ_by_form(best, size, other));
        if equal.is_empty() {
            by_form().min_by(|a, b| odds(a).total_cmp(&odds(b))).into_iter().collect()
        } else {
            equal
        }
    }

    /// Whether two hypotheses leave so little that their forms decide between them, and not their causes. A cause in a simpler
    /// form is as good as long as forms may leave as much; of several causes one would be as small as that.
    fn differ_by_form(&self, best: &Judged, size: usize, other: &Judged) -> bool {
        let is_simpler = best.fitted.hypothesis.parts.len() == 1 && other.fitted.hypothesis.size() < size;
        let [before, of_best, of_other] =
            [&self.baseline, &best.fitted, &other.fitted].map(|fitted| beyond_noise(&fitted.losses));
        before.into_iter().all(|(signal, before)| {
            let alike = if is_simpler { f64::INFINITY } else { ALSO_BY_FORM * of_best[&signal] };
            // A sound model may have its structural error, too, and then that decides.
            let structure = self.bench.data.structure(signal).min(LEFT_BY_FORM * before);
            of_other[&signal] <= NEGLIGIBLE.max(structure).max(alike.min(left_by_form(before)))
        })
    }
}

/// Share of the error that the effects of a fit must explain: of all samples, and of those that it did not see.
fn least_explained(fitted: &Fitted) -> (f64, f64) {
    let parts = &fitted.hypothesis.parts;
    if parts.iter().any(|part| fitted.parameters.effects.hangs_on_chance(part.effect.name)) {
        return LEAST_EXPLAINED_BUT_FOR_CHANCE;
    }
    match parts.iter().map(|part| part.effect.holds).max() {
        Some(Holds::Exactly) => LEAST_EXPLAINED_EXACTLY,
        Some(Holds::AsLaw) | None => LEAST_EXPLAINED,
    }
}

/// Whether the same effects explain much more where they are such as they cannot be: then the possible fit is a makeshift.
fn is_better_if_impossible(levels: &[Vec<Judged>], best: &Judged) -> bool {
    let mut same = levels.iter().flatten().filter(|other| same_effects(other, best) && !is_possible(other));
    same.any(|other| evidence(&best.fitted, &other.fitted) > LEAST_EVIDENCE)
}

/// Value at which a parameter does nothing.
fn neutral(own: &FittedParameter) -> f64 {
    declared(&Parameters::default(), own.name).1
}

/// Whether a parameter's interval holds that.
fn holds_neutral(own: &FittedParameter) -> bool {
    (own.low..=own.high).contains(&neutral(own))
}

/// Effects that stand in the place of one in rivals that agree in all others.
fn in_place_of(effect: &str, best: &Judged, rivals: &[&Judged]) -> Vec<&'static str> {
    let others: Vec<_> = best.fitted.hypothesis.names().into_iter().filter(|name| *name != effect).collect();
    let agree = rivals.iter().map(|rival| rival.fitted.hypothesis.names());
    agree
        .filter(|names| others.iter().all(|other| names.contains(other)) && !names.contains(&effect))
        .filter_map(|names| names.into_iter().find(|name| !others.contains(name)))
        .collect()
}
