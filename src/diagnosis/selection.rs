//! Which causes are named, if any: forward selection over a beam of hypotheses, with refusal in both directions.

use super::Verdict;
use super::candidates::{Bench, Fitted, Part};
use super::residuals::{Loss, Scope};
use crate::effects::{Description, Effects};
use crate::measurement::Signal;
use crate::parameters::Parameters;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Evidence (natural logarithm of odds) that an effect must have: e¹⁰, about 22 000 to 1.
const LEAST_EVIDENCE: f64 = 10.0;
/// Odds up to which a rival explains the data as well as the best: 20 to 1, in natural logarithm.
const RIVAL: f64 = 3.0;
/// Share of the error beyond noise that the named causes together must explain.
const LEAST_EXPLAINED: f64 = 0.7;
/// Share of what is left that a further effect must explain: less is how the first one's form differs from the true one.
const LEAST_FURTHER: f64 = 0.6;
/// Error beyond noise, as a share of the variance of the noise, below which nothing is looked for.
const NEGLIGIBLE: f64 = 0.25;
/// Share of a signal's error that a named effect may leave without a further effect being looked for: a tenth of its rms
/// is how the form of an effect differs from the true one.
const LEFT_BY_FORM: f64 = 0.01;
/// Structural error of a nominal muscle beyond its coefficients, as a share of the declared tolerance and of the span of
/// the signal. It only keeps a small error from being called unexplained.
const STRUCTURE_SHARE: f64 = 0.2;
/// Hypotheses that are carried on at each number of effects.
const BEAM: usize = 3;
/// Most effects that are looked for at once.
const MOST_EFFECTS: usize = 3;
/// Candidates that are fitted, of those that look promising: for the first effect, and for further ones.
const FITTED: (usize, usize) = (10, 5);
/// Starts from which a candidate is fitted.
const STARTS: usize = 2;

/// A hypothesis with what speaks for it.
#[derive(Clone)]
pub struct Judged {
    /// The fit.
    pub fitted: Fitted,
    /// Evidence against the baseline.
    pub evidence: f64,
    /// Share of the error beyond noise that is explained.
    pub explained: f64,
}

/// The outcome of a search.
pub struct Chosen {
    /// What is said.
    pub verdict: Verdict,
    /// The hypothesis whose effects are named, fitted to the samples that fits may see; that of the baseline where none is.
    pub model: Fitted,
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
/// The size of the residuals of each signal is taken as unknown, so that the ratio counts; how long they hang together is
/// judged from the fit that the odds are for.
fn evidence(without: &Fitted, with: &Fitted) -> f64 {
    let samples: f64 = with.losses.iter().map(|loss| loss.effective).sum();
    let more = with.hypothesis.size() as f64 - without.hypothesis.size() as f64;
    gain(&without.losses, &with.losses) - 0.5 * more * samples.max(2.0).ln()
}

/// Gain of logarithmic likelihood.
fn gain(without: &[Loss], with: &[Loss]) -> f64 {
    without.iter().zip(with).map(|(b, a)| 0.5 * a.effective * (b.excess / a.excess).ln()).sum()
}

/// Mean squared residual per signal beyond that of the noise, relative to it.
fn beyond_noise(losses: &[Loss]) -> BTreeMap<Signal, f64> {
    let mut sums: BTreeMap<Signal, (f64, f64)> = BTreeMap::new();
    for loss in losses {
        let (sum, count) = sums.entry(loss.signal).or_default();
        *sum += loss.excess * loss.samples as f64;
        *count += loss.samples as f64;
    }
    sums.into_iter().map(|(signal, (sum, count))| (signal, (sum / count - 1.0).max(0.0))).collect()
}

fn total(beyond_noise: &BTreeMap<Signal, f64>) -> f64 {
    beyond_noise.values().sum()
}

/// The search for the causes of what a baseline leaves.
pub struct Search<'a, 'b> {
    bench: &'b mut Bench<'a>,
    baseline: Fitted,
    tolerance: f64,
}

impl<'a, 'b> Search<'a, 'b> {
    /// A search from a baseline.
    pub fn new(bench: &'b mut Bench<'a>, baseline: Fitted, tolerance: f64) -> Self {
        Self { bench, baseline, tolerance }
    }

    fn judge(&self, fitted: Fitted) -> Judged {
        let evidence = evidence(&self.baseline, &fitted);
        let (before, after) = (beyond_noise(&self.baseline.losses), beyond_noise(&fitted.losses));
        let explained = 1.0 - total(&after) / total(&before).max(f64::MIN_POSITIVE);
        Judged { fitted, evidence, explained }
    }

    /// Finds the causes; `done` is told after each candidate.
    pub fn run(mut self, done: &(dyn Fn(&str) + Sync)) -> Option<Chosen> {
        let mut singles = self.extend(&self.baseline, FITTED.0, done);
        if let Some(best) = singles.first().filter(|best| best.evidence > LEAST_EVIDENCE) {
            let residuals = best.fitted.residuals.clone();
            self.bench.refine_noise(&residuals);
            singles = self.judged_anew(singles);
        }
        let mut levels = vec![self.refined_best(singles)];
        while levels.len() < MOST_EFFECTS && self.something_is_left(levels.last()?) {
            let next = self.next_level(levels.last()?);
            levels.push(next);
        }
        self.trace(&levels);
        self.choose(levels)
    }

    fn trace(&self, levels: &[Vec<Judged>]) {
        if std::env::var("SINEW_TRACE").is_ok() {
            let show = |l: &[Loss]| {
                beyond_noise(l).iter().map(|(s, v)| format!("{}:{v:.2}", s.name())).collect::<Vec<_>>().join(" ")
            };
            eprintln!(
                "baseline {} neff {:?}",
                show(&self.baseline.losses),
                self.baseline.losses.iter().map(|l| l.effective as i64).collect::<Vec<_>>()
            );
            for level in levels {
                for j in level.iter().take(5) {
                    eprintln!(
                        "  {:?} ev {:.1} R {:.3} {} neff {:?} refined {:?}",
                        j.fitted.hypothesis.names(),
                        j.evidence,
                        j.explained,
                        show(&j.fitted.losses),
                        j.fitted.losses.iter().map(|l| l.effective as i64).collect::<Vec<_>>(),
                        j.fitted.hypothesis.parts.iter().map(|p| p.refined).collect::<Vec<_>>()
                    );
                }
            }
        }
    }

    /// Judges fits again after the noise became better known.
    fn judged_anew(&mut self, fits: Vec<Judged>) -> Vec<Judged> {
        let anew = |mut fitted: Fitted| {
            fitted.losses = self.bench.data.losses(&fitted.residuals, Scope::All);
            fitted
        };
        let baseline = anew(self.baseline.clone());
        let fits: Vec<Fitted> = fits.into_iter().map(|judged| anew(judged.fitted)).collect();
        self.baseline = baseline;
        sorted(fits.into_iter().map(|fitted| self.judge(fitted)).collect())
    }

    /// The most promising hypotheses with one effect more, the best first.
    fn extend(&self, base: &Fitted, most: usize, done: &(dyn Fn(&str) + Sync)) -> Vec<Judged> {
        let others: Vec<&'static Description> =
            Effects::DESCRIPTIONS.iter().filter(|effect| !base.hypothesis.has(effect.name)).collect();
        let mut promising: Vec<_> = others
            .into_par_iter()
            .map(|effect| {
                let starts = self.bench.starts(base, effect);
                done(effect.name);
                starts
            })
            .filter(|starts| !starts.is_empty())
            .collect();
        promising.sort_by(|a, b| b[0].0.total_cmp(&a[0].0));
        promising.truncate(most);
        sorted(promising.into_par_iter().filter_map(|starts| self.best_fit(base, &starts)).collect())
    }

    fn best_fit(&self, base: &Fitted, starts: &[(f64, Part, Parameters)]) -> Option<Judged> {
        let fits = starts.iter().take(STARTS).filter_map(|(_, part, start)| {
            Some(self.judge(self.bench.rough_fit(&base.hypothesis.with(*part), start)?))
        });
        fits.max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    /// The same, the best of them with their last effect refined and fitted to the end: what a fit left undone would
    /// else be credited to the next effect.
    fn refined_best(&self, mut judged: Vec<Judged>) -> Vec<Judged> {
        let rest = judged.split_off(BEAM.min(judged.len()));
        let refined = judged.into_par_iter().map(|judged| self.finished(self.refined(judged)));
        sorted(refined.chain(rest).collect())
    }

    fn finished(&self, judged: Judged) -> Judged {
        let Fitted { hypothesis, parameters, .. } = &judged.fitted;
        self.bench.exact_fit(hypothesis, parameters, Scope::All).map_or(judged.clone(), |fitted| self.judge(fitted))
    }

    /// The hypothesis with the refinements of its last effect free, where the data pay for them.
    fn refined(&self, judged: Judged) -> Judged {
        let mut hypothesis = judged.fitted.hypothesis.clone();
        let Some(last) = hypothesis.parts.last_mut().filter(|part| !part.effect.refinements.is_empty()) else {
            return judged;
        };
        last.refined = true;
        let mut start = judged.fitted.parameters;
        for (name, values) in last.effect.refinements {
            let _ = start.set(name, values[0]);
        }
        match self.bench.rough_fit(&hypothesis, &start).map(|fitted| self.judge(fitted)) {
            Some(better) if better.evidence > judged.evidence => better,
            _ => judged,
        }
    }

    /// Whether the best of the hypotheses leaves an error that is worth a further effect.
    fn something_is_left(&self, level: &[Judged]) -> bool {
        let Some(best) = level.first().filter(|best| best.evidence > LEAST_EVIDENCE) else { return false };
        let before = beyond_noise(&self.baseline.losses);
        let after = beyond_noise(&best.fitted.losses);
        after.iter().any(|(signal, left)| *left > NEGLIGIBLE && *left > LEFT_BY_FORM * before[signal])
    }

    fn next_level(&self, level: &[Judged]) -> Vec<Judged> {
        let mut next: Vec<Judged> = Vec::new();
        for base in level.iter().take(BEAM) {
            for judged in self.extend(&base.fitted, FITTED.1, &|_| ()) {
                let same = |known: &Judged| known.fitted.hypothesis.names() == judged.fitted.hypothesis.names();
                match next.iter().position(same) {
                    Some(k) if next[k].evidence < judged.evidence => next[k] = judged,
                    Some(_) => (),
                    None => next.push(judged),
                }
            }
        }
        self.refined_best(sorted(next))
    }

    /// Error beyond noise that is no reason to call a model wrong.
    fn allowance(&self, signal: Signal) -> f64 {
        let level = self.bench.data.noise(signal).level;
        // The declared tolerance is one of the muscle; what comes before it has none.
        let structure = if signal == Signal::GaugePressure {
            0.0
        } else {
            STRUCTURE_SHARE * self.tolerance * self.bench.data.span(signal)
        };
        NEGLIGIBLE + (structure / level).powi(2)
    }

    fn is_sound(&self, losses: &[Loss]) -> bool {
        beyond_noise(losses).into_iter().all(|(signal, beyond)| beyond <= self.allowance(signal))
    }

    /// The best hypothesis of all levels: a further effect must pay and explain a good part of what is left.
    fn best<'l>(&self, levels: &'l [Vec<Judged>]) -> Option<&'l Judged> {
        let mut best = levels[0].first().filter(|best| best.evidence > LEAST_EVIDENCE)?;
        for level in &levels[1..] {
            let Some(more) = level.first() else { break };
            let left = total(&beyond_noise(&best.fitted.losses));
            let further = 1.0 - total(&beyond_noise(&more.fitted.losses)) / left.max(f64::MIN_POSITIVE);
            if more.evidence < best.evidence + LEAST_EVIDENCE || further < LEAST_FURTHER {
                break;
            }
            best = more;
        }
        Some(best)
    }

    fn choose(self, levels: Vec<Vec<Judged>>) -> Option<Chosen> {
        let singles = levels[0].clone();
        let refused = |verdict| {
            let model = self.bench.exact_fit(&self.baseline.hypothesis, &self.baseline.parameters, Scope::Training)?;
            Some(Chosen { verdict, model, alternatives: Vec::new(), rivals: Vec::new(), singles: singles.clone() })
        };
        let wrong = if self.is_sound(&self.baseline.losses) { Verdict::Nominal } else { Verdict::Unexplained };
        let Some(best) = self.best(&levels) else { return refused(wrong) };
        if best.explained < LEAST_EXPLAINED || !self.holds(&best.fitted)? {
            return refused(wrong);
        }
        let rivals: Vec<&Judged> =
            levels[best.fitted.hypothesis.parts.len() - 1].iter().filter(|other| self.is_rival(best, other)).collect();
        let alternatives: Vec<Vec<&'static str>> =
            best.fitted.hypothesis.parts.iter().map(|part| in_place_of(part.effect.name, best, &rivals)).collect();
        let verdict = if alternatives.iter().any(|a| !a.is_empty()) {
            Verdict::Ambiguous
        } else if self.is_sound(&best.fitted.losses) {
            Verdict::Explained
        } else {
            Verdict::PartlyExplained
        };
        let model = self.bench.exact_fit(&best.fitted.hypothesis, &best.fitted.parameters, Scope::Training)?;
        let rivals = rivals.into_iter().map(|rival| rival.fitted.clone()).collect();
        Some(Chosen { verdict, model, alternatives, rivals, singles })
    }

    /// Whether a hypothesis, fitted to the samples that fits may see, does better on those that they may not.
    fn holds(&self, fitted: &Fitted) -> Option<bool> {
        let on_unseen = |fitted: &Fitted| {
            let trained = self.bench.exact_fit(&fitted.hypothesis, &fitted.parameters, Scope::Training)?;
            Some(self.bench.data.losses(&trained.residuals, Scope::HeldOut))
        };
        let (without, with) = (on_unseen(&self.baseline)?, on_unseen(fitted)?);
        Some(gain(&without, &with) > 0.0)
    }

    fn is_rival(&self, best: &Judged, other: &Judged) -> bool {
        other.fitted.hypothesis.names() != best.fitted.hypothesis.names()
            && evidence(&other.fitted, &best.fitted) < RIVAL
    }
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
    judged.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    judged
}
