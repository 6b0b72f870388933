//! What the thesis claims of the models, tried on a muscle: said from the numbers, never from memory.

use super::OnMuscle;
use super::assess::Assessed;
use super::cross::{Cross, Transfer};
use crate::identification::structure::{Braid, model_name};
use serde::Serialize;

/// What became of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The numbers bear it out.
    Confirmed,
    /// They speak against it.
    Refuted,
    /// They cannot tell.
    Open,
}

/// A claim with its verdict.
#[derive(Debug, Clone, Serialize)]
pub struct Claim {
    /// The claim.
    pub claim: &'static str,
    /// What became of it.
    pub verdict: Verdict,
    /// The numbers, in a sentence.
    pub because: String,
}

/// Models without a picture of the braid.
const EMPIRICAL: [&str; 3] = ["virtual-area", "spring", "three-element"];
/// A model fails where it misses more than this share of the full-scale force.
const FAILS: f64 = 0.1;
/// A term repairs a model where it leaves less than this share of the error.
const REPAIRS: f64 = 0.5;
/// Fewer points below 1 bar tell nothing of it.
const FEWEST_LOW: usize = 5;
/// Low pressure is bad where the relative error is so many times that above.
const BAD: f64 = 2.0;
/// An error keeps a sign where it has it at this share of the points.
const SIGN: f64 = 0.8;

/// The claims of thesis sections 4.3 on one muscle.
pub fn on_muscle(muscle: &OnMuscle) -> Vec<Claim> {
    let full = full_scale(muscle);
    let all = [fails(muscle, full), repairs(muscle), low_pressure(muscle), empirical(muscle)];
    all.into_iter().flatten().collect()
}

/// Largest measured force, N.
pub fn full_scale(muscle: &OnMuscle) -> f64 {
    muscle.points.all.iter().map(|point| point.force.abs()).fold(0.0, f64::max)
}

fn given<'a>(muscle: &'a OnMuscle, name: &str) -> Option<&'a Assessed> {
    let is = |a: &&Assessed| model_name(a.fitted.structure.model) == name && a.fitted.structure.braid == Braid::Given;
    muscle.models.iter().find(is)
}

fn verdict(holds: bool) -> Verdict {
    if holds { Verdict::Confirmed } else { Verdict::Refuted }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn fails(muscle: &OnMuscle, full: f64) -> Option<Claim> {
    let (plain, fitted) = (
        given(muscle, "mckibben")?,
        muscle
            .models
            .iter()
            .find(|a| model_name(a.fitted.structure.model) == "mckibben" && a.fitted.structure.fits_braid()),
    );
    let [rms, share] = [plain.errors.rms, plain.errors.rms / full];
    let fitted = fitted.map_or(String::new(), |a| {
        format!("; with the braid fitted {:.0} N, {}", a.errors.rms, percent(a.errors.rms / full))
    });
    Some(Claim {
        claim: "The plain McKibben model fails for FESTO's muscles.",
        verdict: verdict(share > FAILS),
        because: format!(
            "It misses the force by {rms:.0} N rms, {} of the full scale of {full:.0} N{fitted}; above {} counts as failing.",
            percent(share),
            percent(FAILS)
        ),
    })
}

fn repairs(muscle: &OnMuscle) -> Option<Claim> {
    let (plain, elastic) = (given(muscle, "mckibben")?, given(muscle, "improved-mckibben")?);
    let share = elastic.errors.rms / plain.errors.rms;
    Some(Claim {
        claim: "An elastic term repairs it.",
        verdict: verdict(share < REPAIRS),
        because: format!(
            "With the braid as given, the elasticity of the membrane leaves {:.0} N of {:.0} N rms, {}; below {} counts as repaired.",
            elastic.errors.rms,
            plain.errors.rms,
            percent(share),
            percent(REPAIRS)
        ),
    })
}

fn low_pressure(muscle: &OnMuscle) -> Option<Claim> {
    let claim = "Below 1 bar the geometrical models stay bad.";
    let elastic = given(muscle, "improved-mckibben")?;
    let (Some(low), Some(high)) = (elastic.low, elastic.high) else {
        let because = "No points on both sides of 1 bar.".to_owned();
        return Some(Claim { claim, verdict: Verdict::Open, because });
    };
    if low.points < FEWEST_LOW {
        let because = format!("Only {} of the points lie below 1 bar, {FEWEST_LOW} are asked for.", low.points);
        return Some(Claim { claim, verdict: Verdict::Open, because });
    }
    Some(Claim {
        claim,
        verdict: verdict(low.relative > BAD * high.relative),
        because: format!(
            "improved-mckibben misses {} of the force at {} points below 1 bar and {} at {} points above; {BAD:.0} times as much \
             counts as bad.",
            percent(low.relative),
            low.points,
            percent(high.relative),
            high.points
        ),
    })
}

fn empirical(muscle: &OnMuscle) -> Option<Claim> {
    let is_empirical = |a: &&Assessed| EMPIRICAL.contains(&model_name(a.fitted.structure.model));
    let empirical = muscle.models.iter().find(is_empirical)?;
    let other = muscle.models.iter().find(|a| !is_empirical(a))?;
    if [empirical, other].iter().any(|a| a.held_out_rms().is_infinite()) {
        return None; // nothing could be left out
    }
    let told = |a: &Assessed| format!("{} with {:.1} N", a.fitted.structure.label(), a.held_out_rms());
    let seen = format!(
        "On points that the fits did not see, the best empirical model is {}, the best of the others {}.",
        told(empirical),
        told(other)
    );
    let (verdict, because) = if muscle.name.contains("reconstructed") {
        (Verdict::Open, format!("{seen} These points were made from an empirical model, which tells nothing."))
    } else {
        (verdict(empirical.held_out_rms() < other.held_out_rms()), seen)
    };
    Some(Claim { claim: "Empirical models fit best.", verdict, because })
}

/// Whether a cross-validation errs to one side in each direction, and to opposite sides.
pub fn keeps_a_sign(cross: &[Cross], one: &str, other: &str, transfer: Transfer) -> Option<Claim> {
    let find = |of: &str, on: &str| {
        cross.iter().find(|c| c.of == of && c.on == on && c.model == "improved-mckibben" && c.transfer == transfer)
    };
    let (there, back) = (find(one, other)?, find(other, one)?);
    let one_sided = |c: &Cross| c.too_low.max(1.0 - c.too_low) >= SIGN;
    let opposite = (there.too_low > 0.5) != (back.too_low > 0.5);
    let told = |c: &Cross| {
        format!(
            "parameters of {} on {}: {:.0} N rms against {:.0} N with its own, too low at {:.0} % of the points",
            c.of,
            c.on,
            c.errors.rms,
            c.own_rms,
            100.0 * c.too_low
        )
    };
    let how = if transfer == Transfer::Normalised { "normalised" } else { "as they are" };
    Some(Claim {
        claim: "In cross-validation between muscles the error keeps a sign, opposite in the two directions.",
        verdict: verdict(one_sided(there) && one_sided(back) && opposite),
        because: format!(
            "improved-mckibben, {how}: {}; {}. At least {:.0} % on one side counts as a sign.",
            told(there),
            told(back),
            100.0 * SIGN
        ),
    })
}
