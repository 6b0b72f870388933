//! What an experiment is to tell apart: models that a diagnosis left standing, or effects at a usual size.

use crate::diagnosis::hypothesis::{at_start, count_starts, declared, recording_of};
use crate::effects::{Description, Effects};
use crate::measurement::Signal;
use crate::parameters::Parameters;
use crate::simulation::OUTPUTS;
use crate::variables::Variable;
use crate::{Error, Result};
use serde_json::Value;
use std::path::Path;

/// A model that might be the true one.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The effect that makes it differ from the others.
    pub name: &'static str,
    /// The whole model.
    pub model: Parameters,
    /// What a fit of it may change besides the corrections within the tolerance.
    pub free: Vec<&'static Variable>,
    /// The same effect in other forms and sizes, where its size is not known.
    pub variants: Vec<Parameters>,
}

/// What is to be told apart, and with what.
#[derive(Debug, Clone)]
pub struct Task {
    /// Why these, in words.
    pub why: String,
    /// The models.
    pub rivals: Vec<Rival>,
    /// Sensors with their noise (standard deviation, SI).
    pub sensors: Vec<(Signal, f64)>,
    /// Relative error of the nominal coefficients that was no cause; `None` where no diagnosis says so.
    pub tolerance: Option<f64>,
}

/// Noise of a usual sensor (standard deviation, SI): 5 mbar, 0.1 mm, 1 N.
pub fn usual_noise(signal: Signal) -> f64 {
    match signal {
        Signal::GaugePressure => 500.0,
        Signal::Contraction => 1e-4,
        _ => 1.0,
    }
}

fn effect(name: &str) -> Result<&'static Description> {
    let known = || Effects::DESCRIPTIONS.iter().map(|effect| effect.name).collect::<Vec<_>>().join(", ");
    Effects::description(name)
        .ok_or_else(|| Error::Plan { problem: format!("there is no effect `{name}`; there are {}", known()) })
}

impl Rival {
    /// An effect at its usual size.
    fn usual(effect: &'static Description, nominal: &Parameters) -> Self {
        // A single experiment has no second recording.
        let forms = effect.forms.iter().filter(|form| form.iter().all(|(name, _)| recording_of(name) <= 1));
        let variants = forms.flat_map(|form| (0..count_starts(form.iter())).map(|k| at_start(nominal, form.iter(), k)));
        let free = effect.typical().map(|(name, _)| declared(nominal, name).0).collect();
        let model = at_start(nominal, effect.forms[0].iter(), 0);
        Self { name: effect.name, model, free, variants: variants.collect() }
    }

    /// A model as the difference from the nominal one; the parameters of effects are free.
    fn fitted(name: &str, values: &Value, nominal: &Parameters) -> Option<Result<Self>> {
        let mut model = *nominal;
        let mut free = Vec::new();
        for (key, value) in values.as_object().filter(|values| !values.is_empty())? {
            let value = value.as_f64()?;
            if let Err(error) = model.set(key, value) {
                return Some(Err(error));
            }
            let variable = declared(&model, key).0;
            if Effects::DESCRIPTIONS.iter().any(|effect| effect.name == variable.group()) {
                free.push(variable);
            }
        }
        Some(effect(name).map(|effect| Self { name: effect.name, model, free, variants: Vec::new() }))
    }
}

impl Task {
    /// Effects at a usual size; all of them where none are named.
    ///
    /// # Errors
    /// [`Error::Plan`] for an unknown name, or for one alone.
    pub fn of_effects(names: &[String], sensors: &[Signal], nominal: &Parameters) -> Result<Self> {
        let chosen: Vec<_> = if names.is_empty() {
            Effects::DESCRIPTIONS.iter().collect()
        } else {
            names.iter().map(|name| effect(name)).collect::<Result<_>>()?
        };
        if chosen.len() < 2 {
            return Err(Error::Plan { problem: "name at least two effects that are to be told apart".to_owned() });
        }
        let why = if names.is_empty() { "any cause, at its usual size".to_owned() } else { names.join(", ") };
        let sensors = sensors.iter().map(|signal| (*signal, usual_noise(*signal))).collect();
        Ok(Self {
            why,
            rivals: chosen.into_iter().map(|effect| Rival::usual(effect, nominal)).collect(),
            sensors,
            tolerance: None,
        })
    }

    /// What a diagnosis left standing; `None` where it found nothing wrong.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Diagnosis`] for a file that is no diagnosis.
    pub fn of_diagnosis(path: &Path, nominal: &Parameters) -> Result<Option<Self>> {
        let text = std::fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })?;
        let not_one = |problem: &str| Error::Diagnosis { path: path.to_owned(), problem: problem.to_owned() };
        let json: Value = serde_json::from_slice(&text)
            .map_err(|error| not_one(&format!("line {}: no JSON, so no diagnosis", error.line())))?;
        let sensors: Vec<_> = OUTPUTS.into_iter().filter_map(|signal| Some((signal, noise(&json, signal)?))).collect();
        let verdict = json["verdict"].as_str().unwrap_or_default();
        if sensors.is_empty() || verdict.is_empty() {
            return Err(not_one("no `verdict` and `signals`: give the diagnosis.json that `sinew diagnose` wrote"));
        }
        if verdict == "nominal" {
            return Ok(None);
        }
        let named = named(&json, path, nominal)?;
        let mut rivals: Vec<Rival> = named.into_iter().collect();
        let mut why = format!("{} and what this data cannot tell from it", effects(&rivals));
        for cause in json["causes"].as_array().into_iter().flatten() {
            add(&mut rivals, pairs(&cause["rivals"]), usize::MAX, nominal)?;
        }
        if rivals.len() < 2 {
            why = if rivals.is_empty() {
                "the effects that come closest to the unknown cause".to_owned()
            } else {
                format!("{} and the effects that come next", effects(&rivals))
            };
            let ranked = json["ranking"].as_array().into_iter().flatten();
            let ranked = ranked.filter_map(|r| Some((r["effect"].as_str()?, &r["parameters"]))).collect();
            add(&mut rivals, ranked, 3, nominal)?;
        }
        if rivals.len() < 2 {
            return Err(not_one("it holds no fits of other effects: run `sinew diagnose` again"));
        }
        Ok(Some(Self { why, rivals, sensors, tolerance: json["tolerance"].as_f64() }))
    }
}

fn noise(json: &Value, signal: Signal) -> Option<f64> {
    json["signals"][signal.name()]["noise_rms"].as_f64().filter(|noise| *noise > 0.0)
}

fn effects(rivals: &[Rival]) -> String {
    rivals.iter().map(|rival| rival.name).collect::<Vec<_>>().join(", ")
}

fn pairs(values: &Value) -> Vec<(&str, &Value)> {
    values.as_object().into_iter().flatten().map(|(name, values)| (name.as_str(), values)).collect()
}

/// Adds fits of effects that are not there yet, up to a number of rivals.
fn add(rivals: &mut Vec<Rival>, fits: Vec<(&str, &Value)>, most: usize, nominal: &Parameters) -> Result<()> {
    for (name, values) in fits {
        if rivals.len() < most && rivals.iter().all(|rival| rival.name != name) {
            rivals.extend(Rival::fitted(name, values, nominal).transpose()?);
        }
    }
    Ok(())
}

/// The model with the named causes, from the file beside the diagnosis.
fn named(json: &Value, path: &Path, nominal: &Parameters) -> Result<Option<Rival>> {
    let causes: Vec<&Value> = json["causes"].as_array().into_iter().flatten().collect();
    let ambiguous = |cause: &&&Value| cause["rivals"].as_object().is_some_and(|rivals| !rivals.is_empty());
    let Some(first) = causes.iter().find(ambiguous).or(causes.first()) else { return Ok(None) };
    let beside = path.with_file_name("extended.toml");
    if !beside.is_file() {
        let problem =
            "`extended.toml` must lie beside it: keep the folder together, or run `sinew diagnose` again".to_owned();
        return Err(Error::Diagnosis { path: path.to_owned(), problem });
    }
    let model = Parameters::load(&beside.display().to_string())?;
    let names = causes.iter().flat_map(|cause| pairs(&cause["parameters"]));
    let free = names.filter_map(|(name, _)| Some(nominal.find(name)?.0)).collect();
    let effect = effect(first["effect"].as_str().unwrap_or_default())?;
    Ok(Some(Rival { name: effect.name, model, free, variants: Vec::new() }))
}
