//! How the coefficients of a nominal muscle are off decides what is an effect: off as a whole, most muscles show small ones; coefficients
//! that are each off by themselves can stand for many. Bayes' rule weighs both.

use super::candidates::{Bench, Fitted};
use super::residuals::{Loss, Scope};
use super::selection::evidence::gain;
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
    /// cause more must be worth it.
    pub fn beats(&self, other: &Self) -> bool {
        let more = self.causes() as f64 - other.causes() as f64;
        match (self.causes(), other.causes()) {
            (0, _) => false,
            (_, 0) => self.is_better_than_coefficients(&other.bench, &other.chosen.best),
            _ => self.odds_against(&other.bench, &other.chosen.best) > LEAST_EVIDENCE * more,
        }
    }

    /// Whether the causes are better than coefficients that are each off by themselves.
    fn is_better_than_coefficients(&self, bench: &Bench, baseline: &Fitted) -> bool {
        self.chosen.shows_beside_coefficients(&self.bench.data)
            && self.odds_against(bench, baseline) > LEAST_EVIDENCE * self.causes() as f64
    }

    fn causes(&self) -> usize {
        self.chosen.model.hypothesis.parts.len()
    }

    fn odds_against(&self, bench: &Bench, fitted: &Fitted) -> f64 {
        odds_between_ways(&self.bench, &self.chosen.best, (bench, fitted))
    }
}

/// Logarithm of the odds for a fit against another one that lets the coefficients of the nominal model be off in another way; the
/// likelihoods are those of the other one's data.
fn odds_between_ways(bench: &Bench, fitted: &Fitted, other: (&Bench, &Fitted)) -> f64 {
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
