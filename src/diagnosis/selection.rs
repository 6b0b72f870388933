//! Which causes are named, if any: forward selection over a beam of hypotheses, with refusal in both directions.

use super::candidates::{Bench, Fitted, Part, Refined, Slopes, Start, declared, has_many_minima, neutralised};
use super::residuals::{Data, Loss, Scope};
use super::{FittedParameter, Verdict};
use crate::effects::{Effects, Holds};
use crate::measurement::Signal;
use crate::parameters::Parameters;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Evidence (natural logarithm of odds) that an effect must have: e¹⁰, about 22 000 to 1.
pub const LEAST_EVIDENCE: f64 = 10.0;
/// Odds up to which a rival explains the data as well as the best: 20 to 1, in natural logarithm.
const RIVAL: f64 = 3.0;
/// Share of the error beyond noise that the named causes together must explain: of all samples, and of those that the fit did
/// not see. Measured seals leave 3.5 % in the form of friction that we have, a measured leak 5 to 10 % of what is unseen.
const LEAST_EXPLAINED: (f64, f64) = (0.96, 0.9);
/// The same where all causes are scales and zeros: these have no form that could differ from ours.
const LEAST_EXPLAINED_EXACTLY: (f64, f64) = (0.995, 0.95);
/// The same where a cause is left to chance. A pilot that sticks ends each fast move anywhere between the command and its
/// threshold h before it: of the mean square h²/3 of that, the variance h²/12 cannot be foretold.
const LEAST_EXPLAINED_BUT_FOR_CHANCE: (f64, f64) = (0.75, 0.75);
/// Share of what is left that a further effect must explain: less is how the first one's form differs from the true one.
const LEAST_FURTHER: f64 = 0.8;
/// The same of what is little enough to be the first one's form: a cause of its own leaves next to nothing of it.
const LEAST_OF_FORM: f64 = 0.9;
/// The same before the hypothesis is refined: fits of two effects that came to be named began at 0.87 and more.
const MAY_GO_FURTHER: f64 = 0.5;
/// Variance, relative to that of the noise, that a further effect must take off where what is left may be the form of the first:
/// what is less than the noise itself says nothing of a cause.
const LEAST_BESIDE_FORM: f64 = 1.0;
/// Error beyond noise, as a share of the variance of the noise, below which nothing is looked for.
const NEGLIGIBLE: f64 = 0.25;
/// Logarithm of the likelihood that a parameter without meaning takes along by chance, in one of twenty cases: half of the 95 %
/// quantile of χ² with one degree of freedom.
const SPARED: f64 = 1.92;
/// Share of a signal's error that a named effect may leave because its form differs from the true one: a tenth of its rms.
const LEFT_BY_FORM: f64 = 0.01;
/// Variance that a rival may leave beside what the best leaves, where both leave no more than [`LEFT_BY_FORM`]: as much lies
/// in the forms, which are never known exactly. Beside a single cause one in a simpler form may leave all of that.
const ALSO_BY_FORM: f64 = 3.0;
/// Share of the error that a hypothesis must explain to be refined as a possible rival of the best.
const MAY_RIVAL: f64 = 0.8;
/// How many times the structural error of a sound model, or that share of the span where it has none, an error must be to be
/// called unexplained.
const UNEXPLAINED: f64 = 9.75;
/// Share of the largest reading by which a good sensor may drift, class 0.2: no reason to call a model wrong.
const SENSOR_CLASS: f64 = 0.002;
/// How many standard deviations of the noise's variance a sound model may leave: 0.1 % of all estimates are off by more.
const NOISE_DOUBT: f64 = 3.0;
/// Hypotheses that are carried on at each number of effects, besides those that are best for a signal.
const BEAM: usize = 3;
/// Hypotheses that may become rivals: of those that explain enough, so many by their odds and so many by what they explain.
const MAY_BE_RIVALS: usize = 5;
/// Most effects that are looked for at once.
const MOST_EFFECTS: usize = 3;
/// Candidates that are fitted, of those that look promising: for the first effect, and for further ones; and the share of the
/// best one's promise from which on up to twice as many are, since then the promise does not tell which.
const FITTED: (usize, usize) = (9, 5);
const AS_PROMISING: f64 = 0.98;
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
    /// The best fit to all samples; that of the baseline where no cause is named.
    pub best: Fitted,
    /// Per effect of the model, in its order: effects that could stand in its place.
    pub alternatives: Vec<Vec<&'static str>>,
    /// The hypotheses with these effects in their place.
    pub rivals: Vec<Fitted>,
    /// Single effects, the best first.
    pub singles: Vec<Judged>,
}

/// Logarithm of the odds for a hypothesis against another: gain of likelihood per signal and recording at the effective
/// number of samples, less what its parameters cost (G. Schwarz 1978, doi 10.1214/aos/1176344136).
///
/// The size of the residuals of each signal is taken as unknown, so that the ratio counts; the structural error that a sound
/// model may have is added to them, and how long they hang together is judged from the fit that the odds are for.
fn evidence(without: &Fitted, with: &Fitted) -> f64 {
    let samples: f64 = with.losses.iter().map(|loss| loss.effective).sum();
    let more = with.hypothesis.size() as f64 - without.hypothesis.size() as f64;
    gain(&without.losses, &with.losses) - 0.5 * more * samples.max(2.0).ln()
}

/// Gain of logarithmic likelihood.
fn gain(without: &[Loss], with: &[Loss]) -> f64 {
    let ratio = |b: &Loss, a: &Loss| (b.excess + b.structure) / (a.excess + a.structure);
    without.iter().zip(with).map(|(b, a)| 0.5 * a.effective * ratio(b, a).ln()).sum()
}

/// Mean squared residual per signal beyond that of the noise, relative to it; what the unknown instants of jumps of the command may leave
/// does not count.
fn beyond_noise(losses: &[Loss]) -> BTreeMap<Signal, f64> {
    let mut sums: BTreeMap<Signal, (f64, f64)> = BTreeMap::new();
    for loss in losses {
        let (sum, count) = sums.entry(loss.signal).or_default();
        *sum += loss.doubtless * loss.samples as f64;
        *count += loss.samples as f64;
    }
    sums.into_iter().map(|(signal, (sum, count))| (signal, (sum / count - 1.0).max(0.0))).collect()
}

/// What may be left of a signal's error because the form of an effect is never known exactly.
fn left_by_form(before: f64) -> f64 {
    NEGLIGIBLE.max(LEFT_BY_FORM * before)
}

/// What may be left of a signal's error because of noise, which is known so precisely, and the structural error that a sound model may have.
fn left_by_structure(signal: Signal, data: &Data) -> f64 {
    left_by_noise(signal, data) + data.structure(signal)
}

/// What may be left because of noise alone.
fn left_by_noise(signal: Signal, data: &Data) -> f64 {
    NEGLIGIBLE + NOISE_DOUBT * data.noise_doubt(signal)
}

/// What is left beyond that.
fn unsound(left: &BTreeMap<Signal, f64>, data: &Data) -> f64 {
    left.iter().map(|(signal, left)| (left - left_by_structure(*signal, data)).max(0.0)).sum()
}

/// Whether no signal has more left beyond noise than it may.
fn leaves_at_most(losses: &[Loss], most: impl Fn(Signal) -> f64) -> bool {
    beyond_noise(losses).into_iter().all(|(signal, left)| left <= most(signal))
}

/// Whether more is left of some signal than noise and the structural error that a sound model may have.
fn is_unsound(losses: &[Loss], data: &Data) -> bool {
    !leaves_at_most(losses, |signal| left_by_structure(signal, data))
}

/// Share of the error beyond noise that goes away.
fn explained(without: &[Loss], with: &[Loss], data: &Data) -> f64 {
    let before: f64 = beyond_noise(without).values().sum();
    1.0 - unsound(&beyond_noise(with), data) / before.max(f64::MIN_POSITIVE)
}

/// Whether nothing beyond noise is left that is worth a look.
fn is_negligible(losses: &[Loss]) -> bool {
    leaves_at_most(losses, |_| NEGLIGIBLE)
}

impl Chosen {
    /// Whether any cause is named.
    pub fn names_causes(&self) -> bool {
        !self.model.hypothesis.parts.is_empty()
    }

    /// Whether the best fit to all samples leaves no more than a sound model may.
    pub fn leaves_nothing(&self, data: &Data) -> bool {
        !is_unsound(&self.best.losses, data)
    }
}

/// Logarithm of the odds for a fit against another one that lets the coefficients of the nominal model be off in another way; the
/// likelihoods are those of the other one's data.
pub fn odds_between_ways(bench: &Bench, fitted: &Fitted, other: (&Bench, &Fitted)) -> f64 {
    let [own, others] = [fitted, other.1].map(|fitted| other.0.data.losses(&fitted.residuals, Scope::All));
    // The whiter residuals say how much a sample is worth.
    let effective: Vec<f64> = own.iter().zip(&others).map(|(a, b)| a.effective.max(b.effective)).collect();
    let as_whitest = |losses: Vec<Loss>| -> Vec<Loss> {
        losses.into_iter().zip(&effective).map(|(loss, effective)| Loss { effective: *effective, ..loss }).collect()
    };
    let more = fitted.hypothesis.size() as f64 - other.1.hypothesis.size() as f64;
    let samples: f64 = effective.iter().sum();
    gain(&as_whitest(others), &as_whitest(own)) - 0.5 * more * samples.max(2.0).ln() - bench.price(fitted)
        + other.0.price(other.1)
}

/// The search for the causes of what a baseline leaves.
pub struct Search<'a, 'b> {
    bench: &'b mut Bench<'a>,
    baseline: Fitted,
}

impl<'a, 'b> Search<'a, 'b> {
    /// A search from a baseline.
    pub fn new(bench: &'b mut Bench<'a>, baseline: Fitted) -> Self {
        Self { bench, baseline }
    }

    fn judge(&self, fitted: Fitted) -> Judged {
        let evidence = evidence(&self.baseline, &fitted);
        let explained = explained(&self.baseline.losses, &fitted.losses, &self.bench.data);
        let score = self.bench.data.log_likelihood(&fitted.losses)
            - 0.5 * fitted.hypothesis.size() as f64 * (fitted.residuals.len() as f64).ln();
        Judged { fitted, evidence, score, explained }
    }

    /// Finds the causes; `done` is told after each candidate.
    pub fn run(mut self, done: &(dyn Fn(&str) + Sync)) -> Option<Chosen> {
        let starts = self.starts(done);
        let from = best_of_each(&starts);
        let mut singles = self.fitted(&self.baseline, starts, FITTED.0);
        if singles.first().is_some_and(|best| best.evidence > LEAST_EVIDENCE) {
            singles = self.judged_anew(singles);
        }
        let singles = if self.may_show() { self.refined_best(singles) } else { singles };
        self.go_on(vec![singles.clone()], singles, &from)
    }

    /// Adds levels of one effect more each while that is worth it, and chooses.
    fn go_on(&self, mut levels: Vec<Vec<Judged>>, singles: Vec<Judged>, from: &[(Part, usize)]) -> Option<Chosen> {
        while self.is_worth_going_on(&levels) {
            let next = self.next_level(levels.last()?, from);
            levels.push(next);
        }
        self.choose(&levels, singles)
    }

    /// Judges fits again with what the first of them shows of the noise.
    fn judged_anew(&mut self, fits: Vec<Judged>) -> Vec<Judged> {
        let Some(first) = fits.first() else { return fits };
        self.bench.refine_noise(&first.fitted.residuals);
        let anew = |mut fitted: Fitted| {
            fitted.losses = self.bench.data.losses(&fitted.residuals, Scope::All);
            fitted
        };
        let baseline = anew(self.baseline.clone());
        let fits: Vec<Fitted> = fits.into_iter().map(|judged| anew(judged.fitted)).collect();
        self.baseline = baseline;
        sorted(fits.into_iter().map(|fitted| self.judge(fitted)).collect())
    }

    /// Where fits of single effects start, the most promising of each first.
    fn starts(&self, done: &(dyn Fn(&str) + Sync)) -> Vec<Vec<Start>> {
        let starts = Effects::DESCRIPTIONS.par_iter().map(|effect| {
            let starts = self.bench.starts(&self.baseline, effect);
            done(effect.name);
            starts
        });
        starts.filter(|starts| !starts.is_empty()).collect()
    }

    /// The most promising hypotheses with one effect more, the best first. The base that leads is worth a look at every start;
    /// the others are extended from where each effect alone is best fitted, but for those whose error has many minima.
    fn extend(&self, base: &Fitted, leads: bool, from: &[(Part, usize)]) -> Vec<Judged> {
        let others = from.par_iter().filter(|(part, _)| !base.hypothesis.has(part.effect.name));
        let starts = others.map(|(part, choice)| {
            if leads || has_many_minima(part.effect) {
                self.bench.starts(base, part.effect)
            } else {
                self.bench.start(base, *part, *choice).into_iter().collect()
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
        let best = |starts: Vec<Start>| {
            let also = ALSO_PROMISING * starts[0].promise;
            let fits = distinct(&starts).take(STARTS).filter(|start| start.promise >= also).filter_map(|start| {
                Some(self.judge(self.bench.rough_fit(&base.hypothesis.with(start.part), &start.parameters)?))
            });
            fits.max_by(|a, b| a.score.total_cmp(&b.score))
        };
        sorted(starts.into_par_iter().filter_map(best).collect())
    }

    /// The same, refined and fitted to the end, since what a fit left undone would else be credited to the next effect: the very
    /// best and the best that is possible with all of their effects, those that are carried on or may rival it with their last. Where the best leaves no more
    /// than forms may, only its possible rivals are, with all of theirs; other forms are worth the time to single effects, also where the
    /// best explains enough to be the only cause.
    fn refined_best(&self, judged: Vec<Judged>) -> Vec<Judged> {
        let (ranks, rivals) = (carried_on(&judged), may_rival(&judged));
        // What cannot be leads nothing, however good.
        let leads = judged.iter().position(is_possible);
        let mut others = judged.into_iter().enumerate();
        let Some(best) = others.next().map(|(_, best)| self.in_best_form(best)) else { return Vec::new() };
        let may_be_form = self.may_be_form(&best.fitted.losses);
        let explains = best.explained > LEAST_EXPLAINED.0;
        let is_close = |(rank, _): &(usize, Judged)| {
            rivals.contains(rank) || !may_be_form && ranks.contains(rank) || leads == Some(*rank)
        };
        let (close, rest): (Vec<_>, Vec<_>) = others.partition(is_close);
        let rest: Vec<Judged> = rest.into_iter().map(|(_, judged)| judged).collect();
        let refined = close.into_par_iter().map(|(rank, judged)| match judged.fitted.hypothesis.parts.len() {
            1 if may_be_form || explains => self.in_best_form(judged),
            _ if leads == Some(rank) => self.in_best_form(judged),
            _ if may_be_form => self.finished_refined(judged, |judged| self.refined(judged)),
            parts => self.finished_refined(judged, |judged| self.part_refined(judged, parts - 1)),
        });
        sorted(refined.chain([best]).chain(rest).collect())
    }

    fn finished(&self, judged: Judged) -> Judged {
        let start = self.bench.scanned(&judged.fitted);
        self.bench
            .exact_fit(&judged.fitted.hypothesis, &start, Scope::All)
            .map_or(judged.clone(), |fitted| self.judge(fitted))
    }

    /// A hypothesis refined and fitted to the end; as it is where its refinements would end where its causes cannot be.
    fn finished_refined(&self, judged: Judged, refine: impl Fn(Judged) -> Judged) -> Judged {
        let refined = self.finished(refine(judged.clone()));
        if is_possible(&refined) || !is_possible(&judged) { refined } else { self.finished(judged) }
    }

    /// A hypothesis refined in all its effects and, where something is left then, further refined, and with one of them in another form.
    fn in_best_form(&self, judged: Judged) -> Judged {
        let refined = self.finished_refined(judged.clone(), |judged| self.refined(judged));
        if !is_unsound(&refined.fitted.losses, &self.bench.data) {
            return refined;
        }
        let partly = refined
            .fitted
            .hypothesis
            .parts
            .iter()
            .any(|part| ![Refined::NOT, self.bench.fully(part.effect)].contains(&part.refined));
        let further = partly.then(|| self.finished_refined(refined.clone(), |judged| self.refined(judged)));
        let other = self.in_other_forms(&judged).map(|other| self.finished_refined(other, |other| self.refined(other)));
        let all = further.into_iter().chain(other).filter(|fit| is_possible(fit) || !is_possible(&refined));
        all.chain([refined.clone()]).max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or(refined)
    }

    /// The hypothesis with one of its effects in another form, the best of these: of the starts only the most promising were fitted.
    fn in_other_forms(&self, judged: &Judged) -> Option<Judged> {
        let parts = &judged.fitted.hypothesis.parts;
        let others = parts.iter().flat_map(|own| {
            self.bench.forms(own.effect).filter(|part| part.form != own.form).map(move |part| (*own, part))
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
        let effects = &fitted.parameters.effects;
        part.is_rare() && self.bench.data.goes_with_inputs(|time| effects.own_course(part.effect.name, time))
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
        let mut ways: Vec<_> = if part.refined == Refined::NOT {
            [Refined::NOT, fully].into_iter().chain(fully.each()).collect()
        } else if part.refined == fully {
            return judged;
        } else {
            vec![fully]
        };
        ways.dedup(); // where there is one refinement, or none
        // What hangs on details hangs on what the corrections do here, too.
        let slopes = self.bench.slopes_of(&judged.fitted);
        let better = ways.into_par_iter().filter_map(|refined| self.refined_by(&judged, which, refined, &slopes));
        // A refinement that ends where the cause cannot be says nothing of the cause.
        let better = better.filter(|better| is_possible(better) || !is_possible(&judged));
        better.chain([judged.clone()]).max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or(judged)
    }

    fn refined_by(&self, judged: &Judged, which: usize, refined: Refined, slopes: &Slopes) -> Option<Judged> {
        let mut hypothesis = judged.fitted.hypothesis.clone();
        let part = &mut hypothesis.parts[which];
        let known: Vec<&str> = part.freed().map(|(name, _)| *name).collect();
        part.refined = refined;
        let part = *part;
        let start = self.bench.refined_start(&judged.fitted.parameters, part, &known)?;
        Some(self.judge(self.bench.rough_fit_with(slopes, &hypothesis, &start)?))
    }

    /// Whether the last level brought a better hypothesis, and that leaves an error that is worth a further effect; or whether no single
    /// effect has the odds for it, as each of two leaves the other one's error. What the form of one cause may leave is worth a second one;
    /// what the forms of two may leave is not worth a third.
    fn is_worth_going_on(&self, levels: &[Vec<Judged>]) -> bool {
        let most = levels.last().map_or(0, |level| effects_of(level));
        let asks_for_more = |best: &Judged| {
            is_unsound(&best.fitted.losses, &self.bench.data) && (most == 1 || !self.may_be_form(&best.fitted.losses))
        };
        let is_worth = match self.leading(levels) {
            Some(best) => best.fitted.hypothesis.parts.len() == most && asks_for_more(best),
            None => most == 1,
        };
        most < MOST_EFFECTS && is_worth && !self.is_sound(&self.baseline.losses)
    }

    /// Whether residuals are small enough to be those of forms, which are never known exactly.
    fn may_be_form(&self, losses: &[Loss]) -> bool {
        let before = beyond_noise(&self.baseline.losses);
        leaves_at_most(losses, |signal| left_by_form(before[&signal]))
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
    ///
    /// Of the best, effects are exchanged for others. Where it leaves more than forms may, the earlier ones are, beside what the rest
    /// is without them: alone, a wrong one may have looked better. Where it does not, and is worth one effect more, all are, beside
    /// what the rest is with them: what does the same there may not have been found from elsewhere.
    fn next_level(&self, level: &[Judged], starts: &[(Part, usize)]) -> Vec<Judged> {
        let mut bases = carried_on(level);
        // What forms may leave is looked into only where the best leaves it.
        if level.first().is_some_and(|best| self.may_be_form(&best.fitted.losses)) {
            bases.truncate(1);
        }
        let more = bases.into_iter().flat_map(|rank| self.extend(&level[rank].fitted, rank == 0, starts)).collect();
        let mut next = self.worth_refining(level, more);
        let Some(best) = possible(&next).or(next.first()) else { return next };
        let parts = &best.fitted.hypothesis.parts;
        let without: Vec<(&Part, Fitted)> = if !self.may_be_form(&best.fitted.losses) {
            let earlier = parts.split_last().map_or(&[][..], |(_, earlier)| earlier);
            earlier.iter().filter_map(|part| Some((part, self.without(best, part)?.fitted))).collect()
        } else if possible(level).is_some_and(|fewer| self.is_worth(fewer, best)) {
            parts.iter().filter_map(|part| Some((part, self.bench.neutralised(&best.fitted, part.effect)?))).collect()
        } else {
            Vec::new()
        };
        let exchange = |(part, base): &(&Part, Fitted)| {
            let others = starts.iter().copied().filter(|(other, _)| other.effect.name != part.effect.name);
            self.extend(base, false, &others.collect::<Vec<_>>())
        };
        let mut exchanged: Vec<Judged> = without.iter().flat_map(exchange).collect();
        exchanged.retain(|judged| !next.iter().any(|known| same_effects(known, judged) && known.score >= judged.score));
        next.extend(self.worth_refining(level, exchanged));
        self.rivals_in_best_form(each_once(next))
    }

    /// Hypotheses of several effects, those in their best form that a form may keep from rivalling the best.
    fn rivals_in_best_form(&self, level: Vec<Judged>) -> Vec<Judged> {
        let best = possible(&level).filter(|best| self.may_be_form(&best.fitted.losses));
        let Some(best) = best.map(|best| best.fitted.hypothesis.names()) else { return level };
        let lacks_form =
            |judged: &Judged| judged.explained > LEAST_EXPLAINED_EXACTLY.0 && judged.fitted.hypothesis.names() != best;
        let (mut close, mut rest): (Vec<_>, Vec<_>) = level.into_iter().partition(lacks_form);
        rest.extend(close.split_off(close.len().min(MAY_BE_RIVALS)));
        let close = close.into_par_iter().map(|judged| self.in_best_form(judged));
        sorted(close.chain(rest).collect())
    }

    /// Of hypotheses those that may be worth more effects than a level has, each once, refined, the best first.
    fn worth_refining(&self, level: &[Judged], more: Vec<Judged>) -> Vec<Judged> {
        let may_be = |judged: &Judged| possible(level).is_none_or(|fewer| self.further(fewer, judged) > MAY_GO_FURTHER);
        self.refined_best(first_of_each(sorted(more).into_iter().filter(may_be)))
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
    fn leading<'l>(&self, levels: &'l [Vec<Judged>]) -> Option<&'l Judged> {
        let leads =
            |best: &&Judged| best.evidence > LEAST_EVIDENCE && self.shows(&self.baseline.losses, &best.fitted.losses);
        let mut best = possible(&levels[0]).filter(leads);
        for level in &levels[1..] {
            let is_worth = |more: &&Judged| best.map_or_else(|| leads(more), |best| self.is_worth(best, more));
            let Some(more) = possible(level).filter(is_worth) else { break };
            best = Some(more);
        }
        best
    }

    /// Whether a hypothesis with more effects is worth them: it pays, and explains a good part of what is left without.
    fn is_worth(&self, fewer: &Judged, more: &Judged) -> bool {
        let is_form_alone = self.may_be_form(&fewer.fitted.losses);
        let (share, variance) =
            if is_form_alone { (LEAST_OF_FORM, LEAST_BESIDE_FORM) } else { (LEAST_FURTHER, NEGLIGIBLE) };
        evidence(&fewer.fitted, &more.fitted) > LEAST_EVIDENCE
            && self.further(fewer, more) > share
            && self.takes_off(&fewer.fitted.losses, &more.fitted.losses, variance)
    }

    /// Whether what an effect takes off the error of some signal is more than the structural error of a sound model:
    /// less may be that.
    fn shows(&self, without: &[Loss], with: &[Loss]) -> bool {
        self.takes_off(without, with, NEGLIGIBLE)
    }

    /// The same, and more than some variance, relative to that of the noise.
    fn takes_off(&self, without: &[Loss], with: &[Loss], least: f64) -> bool {
        let (before, after) = (beyond_noise(without), beyond_noise(with));
        let least = |signal| self.bench.data.structure(signal).max(least);
        before.into_iter().any(|(signal, beyond)| beyond - after[&signal] > least(signal))
    }

    /// Whether an effect could show at all.
    fn may_show(&self) -> bool {
        !leaves_at_most(&self.baseline.losses, |signal| self.bench.data.structure(signal).max(NEGLIGIBLE))
    }

    /// Drops effects that a hypothesis of several can spare and be possible, the most superfluous first.
    fn pruned(&self, judged: Judged) -> Judged {
        let parts = judged.fitted.hypothesis.parts.clone();
        if parts.len() < 2 {
            return judged;
        }
        let fewer = parts.par_iter().filter_map(|part| self.without(&judged, part)).filter(is_possible);
        match fewer.max_by(|a, b| a.score.total_cmp(&b.score)) {
            Some(fewer) if !self.is_worth(&fewer, &judged) => self.pruned(fewer),
            _ => judged,
        }
    }

    fn choose(&self, levels: &[Vec<Judged>], singles: Vec<Judged>) -> Option<Chosen> {
        let refused = |verdict| {
            let model = self.bench.exact_fit(&self.baseline.hypothesis, &self.baseline.parameters, Scope::Training)?;
            Some(Chosen {
                verdict,
                best: self.baseline.clone(),
                model,
                saw_all: false,
                alternatives: Vec::new(),
                rivals: Vec::new(),
                singles: singles.clone(),
            })
        };
        let wrong = if self.is_sound(&self.baseline.losses) { Verdict::Nominal } else { Verdict::Unexplained };
        let Some(best) = self.leading(levels).map(|best| self.pruned(best.clone())) else { return refused(wrong) };
        if best.explained < least_explained(&best.fitted).0 {
            return refused(wrong);
        }
        let plain = self.simplest(&best);
        let size = plain.fitted.hypothesis.size();
        let told = self.without_idle(plain.clone());
        let are_idle = told.fitted.hypothesis.size() < size;
        let foretold = self.foretelling(told).or_else(|| if are_idle { self.foretelling(plain) } else { None });
        let Some((model, holds_out)) = foretold else { return refused(wrong) };
        let of_as_many = levels.iter().find(|level| effects_of(level) == best.fitted.hypothesis.parts.len());
        let rivals = self.rivals(&best, size, of_as_many.map_or(&[], |level| level));
        let alternatives: Vec<Vec<&'static str>> =
            best.fitted.hypothesis.parts.iter().map(|part| in_place_of(part.effect.name, &best, &rivals)).collect();
        let verdict = if alternatives.iter().any(|a| !a.is_empty()) {
            Verdict::Ambiguous
        } else if self.is_sound(&best.fitted.losses) {
            Verdict::Explained
        } else {
            Verdict::PartlyExplained
        };
        let rivals = rivals.into_iter().map(|rival| rival.fitted.clone()).collect();
        Some(Chosen { verdict, model, best: best.fitted, saw_all: !holds_out, alternatives, rivals, singles })
    }

    /// A hypothesis fitted to the samples that fits may see, and whether it foretells the others; or, where these tell too little,
    /// as it was fitted to all: they cannot tell it from their own best, or are foretold by a fit to the others. `None` where neither will
    /// do.
    fn foretelling(&self, told: Judged) -> Option<(Fitted, bool)> {
        let seeing = |seen| self.bench.exact_fit(&told.fitted.hypothesis, &told.fitted.parameters, seen);
        let may_be = |fitted: &Fitted| !fitted.hypothesis.is_impossible(&fitted.parameters);
        let foretells = |fitted: &Fitted, seen| {
            Some(may_be(fitted) && self.holds(fitted, seen)? && !self.bench.shows_elsewhere(fitted, seen))
        };
        let model = seeing(Scope::Training)?;
        if foretells(&model, Scope::Training)? {
            return Some((model, true));
        }
        let tells_too_little = may_be(&model) && self.is_as_good_in_training(&told.fitted, &model)
            || foretells(&seeing(Scope::HeldOut)?, Scope::HeldOut)?;
        (tells_too_little && self.holds(&told.fitted, Scope::Training)?).then_some((told.fitted, false))
    }

    /// The hypothesis without refinements, where that leaves nothing either: they were for the comparison with its rivals.
    fn simplest(&self, judged: &Judged) -> Judged {
        if !judged.fitted.hypothesis.is_refined() {
            return judged.clone();
        }
        let plain = self.bench.less_refined(&judged.fitted, |_| false);
        let plain = plain.filter(|fitted| is_negligible(&fitted.losses)).map(|fitted| self.judge(fitted));
        plain.unwrap_or_else(|| judged.clone())
    }

    /// The hypothesis without those refinements that may as well be neutral: by their intervals, and by what is lost without them.
    fn without_idle(&self, judged: Judged) -> Judged {
        if !judged.fitted.hypothesis.is_refined() {
            return judged;
        }
        let neutral = Parameters::default();
        let (own, _) = self.bench.intervals(&judged.fitted, Scope::All);
        let neutral = |own: &FittedParameter| declared(&neutral, own.name).1;
        let parts = &judged.fitted.hypothesis.parts;
        let is_refinement =
            |own: &&FittedParameter| parts.iter().any(|part| part.refinements().any(|(name, _)| *name == own.name));
        let may_be_neutral = |own: &&FittedParameter| (own.low..=own.high).contains(&neutral(own));
        let mut idle: Vec<&FittedParameter> = own.iter().filter(is_refinement).filter(may_be_neutral).collect();
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

    /// Whether the first samples cannot tell a fit from their own best.
    ///
    /// A pilot that sticks jumps or does not: values that no jump among the first samples tells apart make the later ones
    /// different altogether.
    fn is_as_good_in_training(&self, fitted: &Fitted, trained: &Fitted) -> bool {
        let seen = |fitted: &Fitted| self.bench.data.losses(&fitted.residuals, Scope::Training);
        !self.shows(&seen(fitted), &seen(trained))
    }

    /// Whether a fit does better than the baseline, fitted to some samples, does on all others.
    fn holds(&self, fitted: &Fitted, seen: Scope) -> Option<bool> {
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
        let (equal, behind): (Vec<_>, Vec<_>) =
            possible.partition(|other| evidence(&other.fitted, &best.fitted) < RIVAL);
        let by_form = || behind.into_iter().find(|other| self.differ_by_form(best, size, other));
        if equal.is_empty() { by_form().into_iter().collect() } else { equal }
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
    match fitted.hypothesis.parts.iter().map(|part| part.effect.holds).max() {
        Some(Holds::Exactly) => LEAST_EXPLAINED_EXACTLY,
        Some(Holds::ButForChance) => LEAST_EXPLAINED_BUT_FOR_CHANCE,
        Some(Holds::AsLaw) | None => LEAST_EXPLAINED,
    }
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

/// From where each effect is best fitted.
fn best_of_each(starts: &[Vec<Start>]) -> Vec<(Part, usize)> {
    starts.iter().map(|starts| (starts[0].part, starts[0].choice)).collect()
}

fn same_effects(a: &Judged, b: &Judged) -> bool {
    a.fitted.hypothesis.names() == b.fitted.hypothesis.names()
}

/// Whether the effects of a hypothesis are such as they can be.
fn is_possible(judged: &Judged) -> bool {
    !judged.fitted.hypothesis.is_impossible(&judged.fitted.parameters)
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

/// Ranks of the hypotheses that may rival the best: of those that explain enough the best, and those that explain
/// the most, since in one signal a form that is not quite right spoils the odds.
fn may_rival(level: &[Judged]) -> Vec<usize> {
    let mut ranks: Vec<usize> = (0..level.len()).filter(|rank| level[*rank].explained > MAY_RIVAL).collect();
    let best: Vec<usize> = ranks.iter().copied().filter(|rank| *rank < MAY_BE_RIVALS).collect();
    ranks.sort_by(|a, b| level[*b].explained.total_cmp(&level[*a].explained));
    ranks.truncate(MAY_BE_RIVALS);
    best.into_iter().chain(ranks).collect()
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

fn sorted(mut judged: Vec<Judged>) -> Vec<Judged> {
    judged.sort_by(|a, b| b.score.total_cmp(&a.score));
    judged
}
