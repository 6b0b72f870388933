//! The diagnosis for machines.

use super::{held_out, separating_experiment};
use crate::diagnosis::{Diagnosis, FittedParameter};
use serde_json::{Map, Value, json};

/// `diagnosis.json`.
pub fn to_json(diagnosis: &Diagnosis) -> Value {
    let parameters = |all: &[FittedParameter]| -> Map<String, Value> {
        let entry = |p: &FittedParameter| json!({ "value": p.value, "low": p.low, "high": p.high, "unit": p.unit });
        all.iter().map(|p| (p.name.to_owned(), entry(p))).collect()
    };
    let values = |all: &[(&str, f64)]| -> Map<String, Value> {
        all.iter().map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
    };
    let causes: Vec<Value> = diagnosis
        .causes
        .iter()
        .map(|cause| {
            json!({
                "effect": cause.effect,
                "sentence": cause.sentence,
                "parameters": parameters(&cause.parameters),
                "alternatives": cause.alternatives,
                "rivals": cause.rivals.iter().map(|(n, v)| ((*n).to_owned(), json!(values(v)))).collect::<Map<_, _>>(),
            })
        })
        .collect();
    let signals: Map<String, Value> = diagnosis
        .signals
        .iter()
        .map(|errors| {
            let value = json!({
                "unit": errors.signal.unit(),
                "nominal_rms": errors.nominal_rms,
                "extended_rms": errors.extended_rms,
                "noise_rms": errors.noise_rms,
            });
            (errors.signal.name().to_owned(), value)
        })
        .collect();
    let ranking: Vec<Value> = diagnosis
        .ranking
        .iter()
        .map(|r| json!({ "effect": r.effect, "explained": r.explained, "evidence": r.evidence, "parameters": values(&r.parameters) }))
        .collect();
    let remaining: Vec<Value> = diagnosis
        .remaining
        .iter()
        .map(|left| json!({ "signal": left.signal.name(), "on": left.on, "share": left.share }))
        .collect();
    json!({
        "verdict": diagnosis.verdict,
        "tolerance": diagnosis.tolerance,
        "causes": causes,
        "signals": signals,
        "improvement": diagnosis.improvement,
        "held_out": held_out(diagnosis),
        "saw_all": diagnosis.saw_all,
        "separating_experiment": separating_experiment(diagnosis),
        "corrections": parameters(&diagnosis.corrections),
        "correction": diagnosis.correction.as_ref().map(|correction| json!({
            "label": "cause unknown",
            "acts_on": correction.acts_on,
            "variables": correction.variables,
            "improvement": correction.improvement,
        })),
        "ranking": ranking,
        "notes": diagnosis.notes,
        "remaining": remaining,
    })
}
