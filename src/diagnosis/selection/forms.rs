//! Hypotheses in their best form: refined, in other forms of their effects, fitted to the end.

use super::evidence::{beyond_noise, evidence, is_unsound, leaves_at_most, left_by_form, left_by_structure};
use super::naming::{LEAST_EXPLAINED, LEAST_EXPLAINED_EXACTLY, RIVAL};
use super::{
    Judged, LEAST_EVIDENCE, Search, carried_on, is_possible, possible, price_of_parameter, same_effects, sorted,
};
use crate::diagnosis::fits::{Fitted, Slopes};
use crate::diagnosis::hypothesis::{Part, Which};
use crate::diagnosis::residuals::Scope;
use rayon::prelude::*;

/// Share of the error that a hypothesis must explain to be refined as a possible rival of the best.
const MAY_RIVAL: f64 = 0.7;
/// Hypotheses that may become rivals: of those that explain enough, so many by their odds and so many by what they explain.
const MAY_BE_RIVALS: usize = 5;
/// How many times what a rival may leave a fit must leave for its end not to be worth the time: of 395 ends of fits none took off more than
/// five sixths.
pub const OUT_OF_REACH: f64 = 10.0;
/// How many times the squares of a best hypothesis of several effects that leaves more than forms may a fit must come to, to be worth its end.
const NEAR: f64 = 1.2;

impl Search<'_> {
    /// Hypotheses refined and fitted to the end, since what a fit left undone would else be credited to the next effect: the very
    /// best and the best that is possible with all of their effects, those that are carried on or may rival it with their last. Where the best leaves no more
    /// than forms may, only its possible rivals are, with all of theirs; other forms are worth the time to single effects, also where the
    /// best explains enough to be the only cause. The very best need not be refined where it is `known` as it is then.
    pub(super) fn refined_best(&self, judged: Vec<Judged>, known: Option<Judged>) -> Vec<Judged> {
        let (ranks, rivals) = (carried_on(&judged), may_rival(&judged));
        // What cannot be leads nothing, however good.
        let leads = judged.iter().position(is_possible);
        let mut others = judged.into_iter().enumerate();
        let Some((_, best)) = others.next() else { return Vec::new() };
        let best = known.unwrap_or_else(|| self.in_best_form(best, None));
        let may_be_form = self.may_be_form(&best.fitted.losses);
        let explains = best.explained > LEAST_EXPLAINED.0;
        let is_close = |(rank, judged): &(usize, Judged)| {
            let may_be = rivals.contains(rank) || !may_be_form && ranks.contains(rank) || leads == Some(*rank);
            may_be && !self.is_out_of_reach(Some(&best), judged)
        };
        let (close, rest): (Vec<_>, Vec<_>) = others.partition(is_close);
        let rest: Vec<Judged> = rest.into_iter().map(|(_, judged)| judged).collect();
        let refined = close.into_par_iter().map(|(rank, judged)| match judged.fitted.hypothesis.parts.len() {
            1 if may_be_form || explains => self.in_best_form(judged, Some(&best)),
            _ if leads == Some(rank) => self.in_best_form(judged, None),
            _ if may_be_form => self.finished_refined(judged, Some(&best), |judged| self.refined(judged)),
            parts => self.finished_refined(judged, Some(&best), |judged| self.part_refined(judged, parts - 1)),
        });
        let mut all: Vec<Judged> = refined.collect();
        all.push(best);
        all.extend(rest);
        sorted(all)
    }

    pub(super) fn finished(&self, judged: Judged) -> Judged {
        self.finished_near(judged, None)
    }

    /// A hypothesis fitted to the end, unless that comes nowhere near the `best`.
    fn finished_near(&self, judged: Judged, best: Option<&Judged>) -> Judged {
        if self.is_out_of_reach(best, &judged) {
            return judged;
        }
        let start = self.bench.scanned(&judged.fitted);
        self.bench
            .exact_fit_near(&judged.fitted.hypothesis, &start, Scope::All, NEAR * self.to_beat(best))
            .map_or(judged.clone(), |fitted| self.judge(fitted))
    }

    /// Squares that are left by a best hypothesis of several effects that can be, but leaves more than forms may; infinite for others. What comes nowhere
    /// near these becomes neither a rival nor the best. Of single effects each may be alone in its signal.
    fn to_beat(&self, best: Option<&Judged>) -> f64 {
        let leaves_much = |best: &&Judged| {
            best.fitted.hypothesis.parts.len() > 1 && is_possible(best) && !self.may_be_form(&best.fitted.losses)
        };
        best.filter(leaves_much).map_or(f64::INFINITY, |best| self.bench.squares(&best.fitted))
    }

    /// A hypothesis refined and fitted to the end, unless that brings it nowhere near the `best`. Where its causes could not be as they are
    /// then, without what the data do not ask for, or as it was.
    fn finished_refined(&self, judged: Judged, best: Option<&Judged>, refine: impl Fn(Judged) -> Judged) -> Judged {
        let finished = |judged| self.finished_near(judged, best);
        let refined = finished(refine(judged.clone()));
        if is_possible(&refined) {
            return refined;
        }
        let instead = if self.is_out_of_reach(best, &refined) { None } else { self.possible_instead(&refined) };
        instead.unwrap_or_else(|| if is_possible(&judged) { finished(judged) } else { refined })
    }

    /// The hypothesis with the shapes at whose bounds its fit ended at their defaults, or with no other refinements, where that is possible and the
    /// odds do not ask for what is left out: data that do not tell shapes leave them anywhere.
    fn possible_instead(&self, impossible: &Judged) -> Option<Judged> {
        let mut instead = self.bench.possible_instead(&impossible.fitted);
        instead.find(|fit| evidence(fit, &impossible.fitted) < LEAST_EVIDENCE).map(|fit| self.judge(fit))
    }

    /// Whether a hypothesis explains so much less than a best one that neither the end of its fit nor another form changes anything.
    pub(super) fn is_out_of_reach(&self, best: Option<&Judged>, other: &Judged) -> bool {
        best.is_some_and(|best| self.says_all(best) && self.leaves_too_much(best, other))
            || self.bench.squares(&other.fitted) > OUT_OF_REACH * self.to_beat(best)
    }

    /// Whether a hypothesis leaves so much in some signal that it is no rival of a best one that says all.
    fn leaves_too_much(&self, best: &Judged, other: &Judged) -> bool {
        let before = beyond_noise(&self.baseline.losses);
        let [best, rival] = [best, other].map(|judged| &judged.fitted.hypothesis);
        let may_be_simpler = best.parts.len() == 1 && rival.size() < best.size();
        !leaves_at_most(&other.fitted.losses, |signal| {
            let of_form = if may_be_simpler { left_by_form(before[&signal]) } else { 0.0 };
            OUT_OF_REACH * left_by_structure(signal, &self.bench.data).max(of_form)
        })
    }

    /// A hypothesis refined in all its effects and, where something is left then, further refined, and with one of them in another form.
    pub(super) fn in_best_form(&self, judged: Judged, best: Option<&Judged>) -> Judged {
        let refined = self.finished_refined(judged.clone(), best, |judged| self.refined(judged));
        if !is_unsound(&refined.fitted.losses, &self.bench.data) {
            return match best {
                Some(best) => self.in_simpler_form(refined, best),
                None => refined,
            };
        }
        let partly = refined
            .fitted
            .hypothesis
            .parts
            .iter()
            .any(|part| ![Which::NONE, self.bench.fully(part.effect)].contains(&part.refined));
        let further = partly.then(|| self.finished_refined(refined.clone(), best, |judged| self.refined(judged)));
        let other = self.in_other_forms(&judged, |_| true);
        let other = other.map(|other| self.finished_refined(other, best, |other| self.refined(other)));
        let all = further.into_iter().chain(other).filter(|fit| is_possible(fit) || !is_possible(&refined));
        all.chain([refined.clone()]).max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or(refined)
    }

    /// A single effect that leaves nothing, but has not the odds of the best, in a form with fewer parameters where that is better: the start that
    /// promises most need not be that of the form which needs no refinements.
    fn in_simpler_form(&self, rival: Judged, best: &Judged) -> Judged {
        let hypothesis = &rival.fitted.hypothesis;
        if hypothesis.parts.len() > 1 || evidence(&rival.fitted, &best.fitted) < RIVAL {
            return rival;
        }
        let size = hypothesis.size();
        let simpler = self.in_other_forms(&rival, |part| part.freed().count() < size).map(|other| self.finished(other));
        let better = simpler.filter(|other| is_possible(other) && other.score > rival.score);
        better.unwrap_or(rival)
    }

    /// The hypothesis with one of its effects in another form that is wanted, the best of these: of the starts only the most promising were fitted.
    pub(super) fn in_other_forms(&self, judged: &Judged, is_wanted: impl Fn(Part) -> bool) -> Option<Judged> {
        let parts = &judged.fitted.hypothesis.parts;
        let others = parts.iter().flat_map(|own| {
            let forms = self.bench.forms(own.effect).filter(|part| part.form != own.form && is_wanted(*part));
            forms.map(|part| (*own, part))
        });
        let fits = others.collect::<Vec<_>>().into_par_iter().filter_map(|(own, part)| {
            let start = self.bench.best_start(&judged.fitted.parameters, own, part)?;
            let fitted = self.bench.rough_fit(&judged.fitted.hypothesis.in_form_of(part), &start)?;
            (!self.may_be_driven(&fitted, part)).then(|| self.judge(fitted))
        });
        fits.max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// Whether what an effect does in a rare form may as well come from what drives the muscle.
    fn may_be_driven(&self, fitted: &Fitted, part: Part) -> bool {
        part.is_rare() && self.bench.data.goes_with_inputs(&fitted.parameters, part.effect.name)
    }

    /// The hypothesis with refinements of its effects free, the last one's first, one of them or all, where the data pay
    /// for them. What hid refinements of an earlier effect may have been the last one. A rare form with refinements would fit
    /// whatever is slow, and has none.
    fn refined(&self, judged: Judged) -> Judged {
        let parts = (0..judged.fitted.hypothesis.parts.len()).rev();
        parts.fold(judged, |judged, which| self.part_refined(judged, which))
    }

    fn part_refined(&self, judged: Judged, which: usize) -> Judged {
        let part = judged.fitted.hypothesis.parts[which];
        if part.is_rare() {
            return judged;
        }
        let fully = self.bench.fully(part.effect);
        let is_plain = part.refined == Which::NONE;
        let mut ways = if is_plain {
            vec![fully, Which::NONE]
        } else if part.refined == fully {
            return judged;
        } else {
            vec![fully]
        };
        ways.dedup(); // where there is none
        // What hangs on details hangs on what all else does here, too.
        let Some(slopes) = self.bench.slopes(&judged.fitted) else { return judged };
        let refined_by = |ways: Vec<Which>| -> Vec<Judged> {
            ways.into_par_iter().filter_map(|refined| self.refined_by(&judged, which, refined, &slopes)).collect()
        };
        let mut fits = refined_by(ways);
        // Where all refinements together are not worth the price of one, none of them is.
        if is_plain && self.may_pay(&fits) {
            fits.extend(refined_by(fully.each().filter(|one| *one != fully).collect()));
        }
        // A refinement that ends where the causes cannot be says nothing of them.
        let can_be = |fit: Judged| match is_possible(&fit) || !is_possible(&judged) {
            true => Some(fit),
            false if fit.score > judged.score => self.possible_instead(&fit).filter(is_possible),
            false => None,
        };
        let better = fits.into_iter().filter_map(can_be);
        better.chain([judged.clone()]).max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or(judged)
    }

    /// Whether the first of two fits of the same effects is so much more likely than the second that a parameter more may pay; where one
    /// of them failed, it may.
    fn may_pay(&self, fits: &[Judged]) -> bool {
        let [refined, plain] = fits else { return true };
        let [with, without] = [refined, plain].map(|judged| self.bench.data.log_likelihood(&judged.fitted.losses));
        with - without > price_of_parameter(&plain.fitted)
    }

    fn refined_by(&self, judged: &Judged, which: usize, refined: Which, slopes: &Slopes) -> Option<Judged> {
        let mut hypothesis = judged.fitted.hypothesis.clone();
        let part = &mut hypothesis.parts[which];
        let known: Vec<&str> = part.freed().map(|(name, _)| *name).collect();
        part.refined = refined;
        let part = *part;
        let start = self.bench.refined_start(&judged.fitted.parameters, part, &known)?;
        Some(self.judge(self.bench.rough_fit_with(slopes, &hypothesis, &start)?))
    }

    /// Hypotheses of several effects, those in their best form that a form may keep from rivalling the best.
    pub(super) fn rivals_in_best_form(&self, level: Vec<Judged>) -> Vec<Judged> {
        let best = possible(&level).filter(|best| self.may_be_form(&best.fitted.losses));
        let Some(best) = best.cloned() else { return level };
        let is_close = |judged: &Judged| {
            judged.explained > LEAST_EXPLAINED_EXACTLY.0
                && !same_effects(judged, &best)
                && !self.is_out_of_reach(Some(&best), judged)
        };
        let (mut close, mut rest): (Vec<_>, Vec<_>) = level.into_iter().partition(is_close);
        close.sort_by_key(|judged| !differ_in_one(judged, &best)); // only these can stand in the place of one of its effects
        rest.extend(close.split_off(close.len().min(MAY_BE_RIVALS)));
        let close = close.into_par_iter().map(|judged| self.in_best_form(judged, Some(&best)));
        sorted(close.chain(rest).collect())
    }
}

/// Whether hypotheses have all effects in common but one each.
fn differ_in_one(a: &Judged, b: &Judged) -> bool {
    let [a, b] = [a, b].map(|judged| judged.fitted.hypothesis.names());
    a.len() == b.len() && a.iter().filter(|name| !b.contains(name)).count() == 1
}

/// Ranks of the hypotheses that may rival the best: of those that explain enough the best, and those that explain
/// the most, since in one signal a form that is not quite right spoils the odds.
fn may_rival(level: &[Judged]) -> Vec<usize> {
    let mut ranks: Vec<usize> = (0..level.len()).filter(|rank| level[*rank].explained > MAY_RIVAL).collect();
    let best: Vec<usize> = ranks.iter().copied().filter(|rank| *rank < MAY_BE_RIVALS).collect();
    ranks.sort_by(|a, b| level[*b].explained.total_cmp(&level[*a].explained));
    ranks.truncate(MAY_BE_RIVALS);
    best.into_iter().chain(ranks).collect()
}
