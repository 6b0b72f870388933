//! What an experiment is to tell apart: models that a diagnosis left standing, or effects at a usual size.

use crate::diagnosis::Verdict;
use crate::diagnosis::hypothesis::{at_start, count_starts, declared, recording_of};
use crate::diagnosis::report::EXTENDED;
use crate::effects::{Description, Effects};
use crate::measurement::Signal;
use crate::parameters::Parameters;
use crate::simulation::OUTPUTS;
use crate::variables::Variable;
use crate::{Error, Result, input};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Display;
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

    /// A model as the difference from the nominal one, under a key of a diagnosis; the parameters of effects are free.
    fn fitted(name: &str, key: &str, values: &Value, nominal: &Parameters, source: &Source) -> Result<Self> {
        let effect = source.effect(key, name)?;
        let mut model = *nominal;
        let mut free = Vec::new();
        for (name, value) in values.as_object().into_iter().flatten() {
            let key = format!("{key}.{name}");
            model.set(name, source.number(&key, value)?).map_err(|error| source.refuse(&key, error))?;
            let variable = declared(&model, name).0;
            if Effects::DESCRIPTIONS.iter().any(|effect| effect.name == variable.group()) {
                free.push(variable);
            }
        }
        Ok(Self { name: effect.name, model, free, variants: Vec::new() })
    }
}

/// A diagnosis that was read; what does not fit in it is refused by its key.
struct Source<'a> {
    path: &'a Path,
    json: Value,
}

impl<'a> Source<'a> {
    fn read(path: &'a Path) -> Result<Self> {
        let bytes = input::read(path)?;
        let text = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes);
        let no_json = |error: serde_json::Error| Error::Diagnosis {
            path: path.to_owned(),
            problem: format!("line {}: no JSON, so no diagnosis", error.line()),
        };
        Ok(Self { path, json: serde_json::from_slice(text).map_err(no_json)? })
    }

    fn refuse(&self, key: &str, problem: impl Display) -> Error {
        let problem = format!("`{key}`: {problem}; give the diagnosis.json as `sinew diagnose` wrote it");
        Error::Diagnosis { path: self.path.to_owned(), problem }
    }

    fn number(&self, key: &str, value: &Value) -> Result<f64> {
        value.as_f64().ok_or_else(|| self.refuse(key, format!("a number belongs here, not {}", shown(value))))
    }

    fn list<'b>(&self, key: &str, value: &'b Value) -> Result<&'b [Value]> {
        let list = value.as_array().map(Vec::as_slice);
        list.ok_or_else(|| self.refuse(key, format!("a list belongs here, not {}", shown(value))))
    }

    fn effect(&self, key: &str, name: &str) -> Result<&'static Description> {
        Effects::description(name).ok_or_else(|| self.refuse(key, format!("there is no effect `{name}`")))
    }

    fn effect_in(&self, key: &str, value: &Value) -> Result<&'static Description> {
        let name = value.as_str();
        self.effect(key, name.ok_or_else(|| self.refuse(key, format!("an effect belongs here, not {}", shown(value))))?)
    }

    fn verdict(&self) -> Result<Verdict> {
        use Verdict::{Ambiguous, Explained, Nominal, PartlyExplained, Unexplained};
        let all = [Nominal, Explained, PartlyExplained, Ambiguous, Unexplained];
        let found = all.into_iter().find(|verdict| json!(verdict) == self.json["verdict"]);
        found.ok_or_else(|| self.refuse("verdict", format!("there is no verdict {}", shown(&self.json["verdict"]))))
    }

    fn tolerance(&self) -> Result<Option<f64>> {
        let (key, value) = ("tolerance", &self.json["tolerance"]);
        if value.is_null() {
            return Ok(None);
        }
        let share = Some(self.number(key, value)?).filter(|share| *share > 0.0 && *share < 1.0);
        share.map(Some).ok_or_else(|| self.refuse(key, format!("a share between 0 and 1 belongs here, not {value}")))
    }

    /// The outputs that were compared, with their noise.
    fn sensors(&self) -> Result<Vec<(Signal, f64)>> {
        let measured =
            OUTPUTS.into_iter().filter_map(|signal| Some((signal, self.json["signals"].get(signal.name())?)));
        let noise = |(signal, of): (Signal, &Value)| {
            let (key, value) = (format!("signals.{}.noise_rms", signal.name()), &of["noise_rms"]);
            let noise = Some(self.number(&key, value)?).filter(|noise| *noise > 0.0);
            let refused = || self.refuse(&key, format!("a number above 0 belongs here, not {value}"));
            Ok((signal, noise.ok_or_else(refused)?))
        };
        measured.map(noise).collect()
    }

    /// The causes with their keys, each once.
    fn causes(&self) -> Result<Vec<Named<'_>>> {
        let mut causes: Vec<Named> = Vec::new();
        for (k, cause) in self.list("causes", &self.json["causes"])?.iter().enumerate() {
            let key = format!("causes[{k}]");
            let effect = self.effect_in(&format!("{key}.effect"), &cause["effect"])?;
            for name in cause["alternatives"].as_array().into_iter().flatten() {
                self.effect_in(&format!("{key}.alternatives"), name)?;
            }
            for (name, parameter) in pairs(&cause["parameters"]) {
                self.number(&format!("{key}.parameters.{name}.value"), &parameter["value"])?;
            }
            if causes.iter().all(|other| other.effect.name != effect.name) {
                causes.push(Named { key, effect, cause });
            }
        }
        Ok(causes)
    }
}

/// A cause of a diagnosis.
struct Named<'a> {
    key: String,
    effect: &'static Description,
    cause: &'a Value,
}

/// A value in a message, which has no room for all of a list.
fn shown(value: &Value) -> String {
    match value {
        Value::Array(_) => "a list".to_owned(),
        Value::Object(_) => "a table".to_owned(),
        Value::Null => "nothing".to_owned(),
        other => other.to_string(),
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
        // A sensor that is named twice is there once.
        let sensors: BTreeSet<Signal> = sensors.iter().copied().collect();
        let sensors = sensors.into_iter().map(|signal| (signal, usual_noise(signal))).collect();
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
    /// [`Error::Io`]; [`Error::Diagnosis`] for a file that is no diagnosis, with the key where one is to blame.
    pub fn of_diagnosis(path: &Path, nominal: &Parameters) -> Result<Option<Self>> {
        let source = Source::read(path)?;
        let not_one = |problem: &str| Error::Diagnosis { path: path.to_owned(), problem: problem.to_owned() };
        let sensors = source.sensors()?;
        if sensors.is_empty() || source.json["verdict"].is_null() {
            return Err(not_one("no `verdict` and `signals`: give the diagnosis.json that `sinew diagnose` wrote"));
        }
        let tolerance = source.tolerance()?;
        if source.verdict()? == Verdict::Nominal {
            return Ok(None);
        }
        let causes = source.causes()?;
        let mut rivals: Vec<Rival> = named(&causes, &source, nominal)?.into_iter().collect();
        let mut why = format!("{} and what this data cannot tell from it", effects(&rivals));
        for Named { key, cause, .. } in &causes {
            let fits =
                pairs(&cause["rivals"]).into_iter().map(|(name, fit)| (format!("{key}.rivals.{name}"), name, fit));
            add(&mut rivals, fits, usize::MAX, nominal, &source)?;
        }
        if rivals.len() < 2 {
            why = if rivals.is_empty() {
                "the effects that come closest to the unknown cause".to_owned()
            } else {
                format!("{} and the effects that come next", effects(&rivals))
            };
            let fit = |(k, ranked): (usize, &'_ Value)| {
                let key = format!("ranking[{k}]");
                let effect = source.effect_in(&format!("{key}.effect"), &ranked["effect"])?;
                Ok((format!("{key}.parameters"), effect.name))
            };
            let ranking = source.list("ranking", &source.json["ranking"])?;
            let fits = ranking.iter().enumerate().map(fit).collect::<Result<Vec<_>>>()?.into_iter().zip(ranking);
            let fits = fits.map(|((key, name), ranked)| (key, name, &ranked["parameters"]));
            add(&mut rivals, fits, 3, nominal, &source)?;
        }
        if rivals.len() < 2 {
            return Err(not_one("it holds no fits of other effects: run `sinew diagnose` again"));
        }
        Ok(Some(Self { why, rivals, sensors, tolerance }))
    }
}

fn effects(rivals: &[Rival]) -> String {
    rivals.iter().map(|rival| rival.name).collect::<Vec<_>>().join(", ")
}

fn pairs(values: &Value) -> Vec<(&str, &Value)> {
    values.as_object().into_iter().flatten().map(|(name, values)| (name.as_str(), values)).collect()
}

/// Adds fits of effects that are not there yet, each with its key, up to a number of rivals.
fn add<'a>(
    rivals: &mut Vec<Rival>,
    fits: impl IntoIterator<Item = (String, &'a str, &'a Value)>,
    most: usize,
    nominal: &Parameters,
    source: &Source,
) -> Result<()> {
    for (key, name, values) in fits {
        let is_new = rivals.iter().all(|rival| rival.name != name);
        // An effect that changes nothing is no rival.
        if rivals.len() < most && is_new && values.as_object().is_some_and(|values| !values.is_empty()) {
            rivals.push(Rival::fitted(name, &key, values, nominal, source)?);
        }
    }
    Ok(())
}

/// The model with the named causes, from the file beside the diagnosis.
fn named(causes: &[Named], source: &Source, nominal: &Parameters) -> Result<Option<Rival>> {
    let ambiguous = |named: &&Named| named.cause["rivals"].as_object().is_some_and(|rivals| !rivals.is_empty());
    let Some(first) = causes.iter().find(ambiguous).or(causes.first()) else { return Ok(None) };
    let beside = source.path.with_file_name(EXTENDED.name);
    if !beside.is_file() {
        let problem =
            format!("`{}` must lie beside it: keep the folder together, or run `sinew diagnose` again", EXTENDED.name);
        return Err(Error::Diagnosis { path: source.path.to_owned(), problem });
    }
    let model = Parameters::load(&beside.display().to_string())?;
    let names = causes
        .iter()
        .flat_map(|Named { key, cause, .. }| pairs(&cause["parameters"]).into_iter().map(move |(name, _)| (key, name)));
    let declared = |(key, name): (&String, &str)| {
        let unknown = || source.refuse(&format!("{key}.parameters"), format!("there is no parameter `{name}`"));
        Ok(nominal.find(name).ok_or_else(unknown)?.0)
    };
    let free = names.map(declared).collect::<Result<_>>()?;
    Ok(Some(Rival { name: first.effect.name, model, free, variants: Vec::new() }))
}
