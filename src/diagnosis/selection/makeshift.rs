//! Causes that are in no library: where one of them explains the data far better than effects of the library do, these are makeshifts.

use super::evidence::{evidence, is_unsound};
use super::{Judged, LEAST_EVIDENCE, MAY_GO_FURTHER, Search};
use crate::diagnosis::fits::Base;
use crate::diagnosis::residuals::Scope;
use crate::diagnosis::selection::naming::LEAST_EXPLAINED;
use crate::diagnosis::unlisted::{Shown, Unlisted};
use rayon::prelude::*;

/// How often at most a cause is looked at again beside the model that it leaves.
const MOST_ROUNDS: usize = 4;

/// A cause in no library beside the nominal model.
struct Beside {
    cause: Unlisted,
    /// What one of size one adds to the residuals.
    course: Vec<f64>,
    fit: Judged,
}

impl Search<'_> {
    /// The best of them that is worth a word: it shows, and has the odds and the share of the error, seen and unseen, that an effect needs
    /// to be named.
    pub(super) fn best_unlisted(&self) -> Option<Judged> {
        if !self.may_show() {
            return None;
        }
        let shown = Shown::beside(&self.bench.data, &self.baseline.parameters)?;
        let base = self.bench.base(&self.baseline);
        let mut each: Vec<Unlisted> = Vec::new();
        for cause in self.most_promising(&base, &shown, Unlisted::all()) {
            if !each.iter().any(|known| known.is_like(cause)) {
                each.push(cause);
            }
        }
        let fits = each.into_par_iter().filter_map(|cause| {
            let Beside { cause, course, fit } = self.settled(&base, &shown, cause)?;
            let explains = fit.evidence > LEAST_EVIDENCE
                && fit.explained > LEAST_EXPLAINED.0
                && self.shows(&self.baseline.losses, &fit.fitted.losses);
            let foretells = || {
                let trained = self.bench.fit_beside(&self.baseline, cause, &course, Scope::Training)?;
                self.holds(&trained, Scope::Training)
            };
            (explains && foretells() == Some(true)).then_some(fit)
        });
        fits.collect::<Vec<_>>().into_iter().max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// A cause in the form that does best. The baseline stands for a part of what it does, and moves otherwise than the muscle did: as far as the cause
    /// explains a good part, it is looked at again beside the model that is left.
    fn settled(&self, base: &Base, shown: &Shown, cause: Unlisted) -> Option<Beside> {
        let mut best = self.beside_nearby(base, shown, cause)?;
        for _ in 0..MOST_ROUNDS {
            if best.fit.explained < MAY_GO_FURTHER {
                break;
            }
            let shown = Shown::beside(&self.bench.data, &best.fit.fitted.parameters)?;
            match self.beside_nearby(base, &shown, best.cause) {
                Some(next) if next.fit.score > best.fit.score => best = next,
                _ => break,
            }
        }
        Some(best)
    }

    /// The most promising form near one, fitted.
    fn beside_nearby(&self, base: &Base, shown: &Shown, cause: Unlisted) -> Option<Beside> {
        let cause = self.most_promising(base, shown, cause.nearby()).into_iter().next()?;
        let course = shown.by(cause)?;
        let fit = self.judge(self.bench.fit_beside(&self.baseline, cause, &course, Scope::All)?);
        Some(Beside { cause, course, fit })
    }

    /// Causes that may take something off the error, the most promising first.
    fn most_promising(&self, base: &Base, shown: &Shown, causes: Vec<Unlisted>) -> Vec<Unlisted> {
        let promises = causes.into_par_iter().filter_map(|cause| {
            let promise = self.bench.promise_of_course(base, &shown.by(cause)?);
            (promise > 0.0).then_some((cause, promise))
        });
        let mut promising: Vec<(Unlisted, f64)> = promises.collect();
        promising.sort_by(|a, b| b.1.total_cmp(&a.1));
        promising.into_iter().map(|(cause, _)| cause).collect()
    }

    /// The cause in no library that has the odds against a hypothesis, or beside none where the error is large enough to be one.
    pub(super) fn unlisted_instead_of(&self, best: Option<&Judged>) -> Option<&Judged> {
        self.unlisted.as_ref().filter(|unlisted| match best {
            Some(best) => evidence(&best.fitted, &unlisted.fitted) > LEAST_EVIDENCE,
            None => !self.is_sound(&self.baseline.losses),
        })
    }

    /// Whether such a cause leaves no more than a sound model may, where nothing does that has fewer causes than are looked for next.
    pub(super) fn unlisted_says_all(&self) -> bool {
        let says_all = |unlisted: &Judged| !is_unsound(&unlisted.fitted.losses, &self.bench.data);
        self.unlisted_instead_of(self.leading()).is_some_and(says_all)
    }
}
