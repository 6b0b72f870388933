//! Which candidate is named, if any.

use super::candidates::Fitted;
use super::residuals::HeldOut;
use super::{Ranked, Verdict};

/// Mean squared scaled residual up to which nothing is called wrong: noise and structural error make 1, and the rest is
/// room for the scatter of that estimate.
const SOUND: f64 = 1.25;
/// Evidence (natural logarithm) that an effect must have: odds of e¹⁰, about 22 000 to 1.
const LEAST_EVIDENCE: f64 = 10.0;
/// Share of the excess error that an effect must explain to be named.
const LEAST_EXPLAINED: f64 = 0.4;
/// Mean gain over blocks, in its standard errors: at least one, so that a single block does not decide.
const LEAST_BLOCK_SCORE: f64 = 1.0;
/// A rival that leaves at most this much more error than the best cannot be told from it.
const RIVAL: f64 = 1.15;

/// The outcome of a selection.
pub struct Chosen {
    /// What is said.
    pub verdict: Verdict,
    /// The candidate that is named.
    pub best: Option<Fitted>,
    /// Its rivals.
    pub alternatives: Vec<&'static str>,
    /// All candidates, the best first.
    pub ranking: Vec<Ranked>,
}

/// Chooses among fitted candidates; `floor` is the loss that sensor noise alone would leave.
pub fn select(baseline: &Fitted, candidates: Vec<Fitted>, floor: f64) -> Chosen {
    let Some(without) = &baseline.held_out else {
        return Chosen { verdict: Verdict::Unexplained, best: None, alternatives: Vec::new(), ranking: Vec::new() };
    };
    let mut judged: Vec<(Fitted, f64, f64)> = candidates
        .into_iter()
        .filter_map(|fitted| {
            let held_out = fitted.held_out.as_ref()?;
            let (loss, evidence) = (held_out.loss, evidence(without, held_out, fitted.size()));
            Some((fitted, loss, evidence))
        })
        .collect();
    judged.sort_by(|a, b| a.1.total_cmp(&b.1));
    let ranking = judged
        .iter()
        .map(|(fitted, loss, evidence)| Ranked {
            effect: fitted.name(),
            relative_error: (loss / without.loss).sqrt(),
            evidence: *evidence,
        })
        .collect();
    let none = |verdict, ranking| Chosen { verdict, best: None, alternatives: Vec::new(), ranking };
    if without.loss <= SOUND {
        return none(Verdict::Nominal, ranking);
    }
    let Some((best, loss, evidence)) = judged.first() else { return none(Verdict::Unexplained, ranking) };
    let explained = (without.loss - loss) / (without.loss - floor);
    let beyond_doubt =
        best.held_out.as_ref().is_some_and(|held_out| block_score(without, held_out) > LEAST_BLOCK_SCORE);
    if *evidence < LEAST_EVIDENCE || explained < LEAST_EXPLAINED || !beyond_doubt {
        return none(Verdict::Unexplained, ranking);
    }
    let alternatives: Vec<_> =
        judged[1..].iter().filter(|(_, rival, _)| *rival <= RIVAL * loss).map(|(fitted, ..)| fitted.name()).collect();
    let verdict = match (alternatives.is_empty(), *loss <= SOUND) {
        (false, _) => Verdict::Ambiguous,
        (true, true) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
    };
    Chosen { verdict, best: Some(best.clone()), alternatives, ranking }
}

/// Logarithm of the odds for a candidate: gain of likelihood at the effective number of samples, less what its
/// parameters cost (Schwarz 1978).
fn evidence(without: &HeldOut, with: &HeldOut, parameters: usize) -> f64 {
    // Of the residuals that the candidate leaves: those of the baseline hang together because of what it lacks.
    let samples = with.effective_samples.max(2.0);
    0.5 * samples * (without.loss / with.loss).ln() - 0.5 * parameters as f64 * samples.ln()
}

/// Mean logarithmic gain over blocks, in its standard errors.
fn block_score(without: &HeldOut, with: &HeldOut) -> f64 {
    let gains: Vec<f64> =
        without.blocks.iter().zip(&with.blocks).map(|(before, after)| (before / after).ln()).collect();
    let count = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    mean / (variance / count).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held_out(blocks: &[f64]) -> HeldOut {
        let loss = blocks.iter().sum::<f64>() / blocks.len() as f64;
        HeldOut { blocks: blocks.to_vec(), loss, effective_samples: 100.0 }
    }

    #[test]
    fn evidence_is_what_the_formula_says() {
        let gain = evidence(&held_out(&[4.0; 5]), &held_out(&[1.0; 5]), 2);
        assert!((gain - (50.0 * 4.0_f64.ln() - 100.0_f64.ln())).abs() < 1e-12);
    }

    #[test]
    fn a_gain_in_one_block_only_is_no_proof() {
        let before = held_out(&[2.0, 2.0, 2.0, 2.0, 200.0]);
        let after = held_out(&[2.1, 2.0, 2.0, 2.1, 2.0]);
        assert!(block_score(&before, &after) < 1.0 + 1e-9);
        assert!(block_score(&before, &held_out(&[1.0, 1.1, 0.9, 1.0, 100.0])) > 3.0);
    }
}
