//! How the coefficients of a nominal muscle are off decides what is an effect: off as a whole, most muscles show small ones; coefficients
//! that are each off by themselves can stand for many. Bayes' rule weighs both.

use super::candidates::{Bench, Fitted};
use super::residuals::Scope;
use super::selection::evidence::odds;
use super::selection::{Chosen, LEAST_EVIDENCE, MOST_EFFECTS};

/// What was found where the coefficients of the nominal model may be off in one way.
pub struct Found<'a> {
    /// The hypotheses' fits.
    pub bench: Bench<'a>,
    /// What came of them.
    pub chosen: Chosen,
}

impl Found<'_> {
    /// Whether nothing is wrong, so that nothing can be where the coefficients may be off in a way that allows more.
    pub fn finds_nothing(&self) -> bool {
        self.causes() == 0 && self.chosen.says_all(&self.bench.data)
    }

    /// How many causes are worth looking for where the coefficients may be off in a way that allows more: where this says all, fewer causes
    /// than here, but a single one that may be another.
    pub fn most_beside(&self) -> usize {
        match self.causes() {
            0 => MOST_EFFECTS,
            _ if !self.chosen.says_all(&self.bench.data) => MOST_EFFECTS,
            causes => (causes - 1).max(1),
        }
    }

    /// Whether causes are named here that are better than what was found where the coefficients may be off in a way that allows more. Each
    /// cause more must be worth it, and against coefficients alone they must show.
    pub fn beats(&self, other: &Self) -> bool {
        let more = self.causes() as f64 - other.causes() as f64;
        let may_be = other.causes() > 0 || self.chosen.shows_beside_coefficients(&self.bench.data);
        self.causes() > 0 && may_be && self.odds_against(other) > LEAST_EVIDENCE * more
    }

    fn causes(&self) -> usize {
        self.chosen.model.hypothesis.parts.len()
    }

    /// Logarithm of the odds for the best fit here against the other one; the likelihoods are those of the other one's data.
    fn odds_against(&self, other: &Self) -> f64 {
        let [own, others] = [&self.chosen.best, &other.chosen.best];
        let losses = |fitted: &Fitted| other.bench.data.losses(&fitted.residuals, Scope::All);
        let (mut with, without) = (losses(own), losses(others));
        // The whiter residuals say how much a sample is worth, but no shape of a sound muscle is worth more than once in a block.
        for (a, b) in with.iter_mut().zip(&without) {
            a.effective = a.effective.max(b.effective).min(a.effective_beside_structure);
        }
        let more = own.hypothesis.size() as f64 - others.hypothesis.size() as f64;
        odds(&without, &with, more) - self.bench.price(own) + other.bench.price(others)
    }
}
