//! All parameters in one place: their defaults, presets, and the TOML file that people edit.

use crate::controller::{Controller, FeedForward, Sampling};
use crate::correction::UnknownCause;
use crate::effects::Effects;
use crate::load::{Initial, InitialMotion, Load};
use crate::muscle::{ForceModelName, ForceModels, Muscle};
use crate::reference::Reference;
use crate::valve::Valve;
use crate::variables::{Declared, Kind, Variable};
use crate::{Error, Result, input};
use std::fmt::Write;

macro_rules! groups {
    ($($(#[$attribute:meta])* $field:ident: $Group:ty,)*) => {
        /// Every parameter of every model. The defaults are the muscle DMSP-40-1000 of the thesis.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Parameters { $($(#[$attribute])* pub $field: $Group,)* }

        impl Declared for Parameters {
            fn visit(&self, see: &mut dyn FnMut(&'static Variable, f64)) {
                $(self.$field.visit(see);)*
            }
            fn visit_mut(&mut self, change: &mut dyn FnMut(&'static Variable, f64) -> f64) {
                $(self.$field.visit_mut(change);)*
            }
        }
    };
}

groups! {
    /// Geometry, damping and force model of the muscle.
    muscle: Muscle,
    /// Coefficients of the force models.
    force_models: ForceModels,
    /// Valve.
    valve: Valve,
    /// Hanging load.
    load: Load,
    /// Where a simulation starts.
    initial: Initial,
    /// How the load moves there.
    initial_motion: InitialMotion,
    /// PID controller.
    controller: Controller,
    /// When the controller acts.
    sampling: Sampling,
    /// Feed-forward of the controller.
    feed_forward: FeedForward,
    /// Reference trajectory.
    reference: Reference,
    /// What a real plant adds to the nominal one.
    effects: Effects,
    /// What is added where the cause is unknown.
    unknown_cause: UnknownCause,
}

impl Parameters {
    /// Whether neither an effect nor a correction is at work.
    #[inline]
    pub fn are_nominal(&self) -> bool {
        self.effects.are_neutral() && self.unknown_cause.is_neutral()
    }
}

/// A named set of parameters, as the difference from the defaults.
struct Preset {
    name: &'static str,
    description: &'static str,
    toml: &'static str,
    /// The elastic modulus of the improved McKibben model as printed.
    table_4_3: &'static str,
}

const PRESETS: &[Preset] = &[
    Preset {
        name: "dmsp-40-1000",
        description: "FESTO DMSP-40, 1 m: coefficients of the thesis",
        toml: "",
        table_4_3: include_str!("../presets/dmsp-40-1000-table-4.3.toml"),
    },
    Preset {
        name: "dmsp-40-290",
        description: "FESTO DMSP-40, 29 cm: coefficients of the thesis",
        toml: include_str!("../presets/dmsp-40-290.toml"),
        table_4_3: include_str!("../presets/dmsp-40-290-table-4.3.toml"),
    },
];

/// The controller as the thesis prints it; a variant of every preset.
const THESIS_CONTROLLER: &str = include_str!("../presets/thesis.toml");

/// Gains for the force models that the gains of a muscle were not tuned on, by the name of the variant.
const GAINS: &str = include_str!("../presets/gains.toml");

/// A model without elastic force holds a load only under pressure.
const UNDER_PRESSURE: &str = include_str!("../presets/under-pressure.toml");

/// What a variant that is named after a force model changes beside `muscle.force_model`.
fn beside_the_model(model: &str) -> &'static str {
    match model {
        "mckibben"
        | "tondu-lopez"
        | "tondu-lopez-k"
        | "tondu-lopez-kq"
        | "tondu-lopez-friction"
        | "frustum-ends"
        | "rounded-ends"
        | "variable-diameter" => UNDER_PRESSURE,
        "three-element" => include_str!("../presets/three-element.toml"),
        _ => "",
    }
}

/// Names of all presets and their variants, each with a line on what it is.
pub fn presets() -> Vec<(String, String)> {
    let mut all = Vec::new();
    for preset in PRESETS {
        all.push((preset.name.to_owned(), preset.description.to_owned()));
        for model in ForceModelName::CHOICES {
            all.push((format!("{}/{}", preset.name, model.name), format!("force model: {}", model.description)));
        }
        let printed =
            "improved-mckibben with the elastic modulus as printed, which does not reproduce the thesis' forces";
        all.push((format!("{}/table-4.3", preset.name), printed.to_owned()));
        all.push((format!("{}/thesis", preset.name), "controller with the printed gains and structure".to_owned()));
    }
    all
}

impl Parameters {
    /// The parameters of a preset such as `dmsp-40-1000` or `dmsp-40-290/improved-mckibben`.
    ///
    /// # Errors
    /// [`Error::UnknownPreset`] for any other name.
    pub fn preset(name: &str) -> Result<Self> {
        let unknown = || Error::UnknownPreset {
            name: name.to_owned(),
            known: PRESETS.iter().map(|p| p.name).collect::<Vec<_>>().join(", "),
        };
        let mut parts = name.split('/');
        let base = parts.next().and_then(|base| PRESETS.iter().find(|p| p.name == base)).ok_or_else(unknown)?;
        let mut parameters = Self::default();
        parameters.apply_toml(base.toml, base.name)?;
        // Gains first: a variant may have its own.
        let gains: toml::Table = toml::from_str(GAINS).expect("a table of the program's own");
        if let Some(gains) = name.split('/').skip(1).find_map(|model| gains.get(&format!("{}/{model}", base.name))) {
            parameters.apply_value("controller", gains)?;
        }
        for variant in parts {
            match variant {
                "thesis" => parameters.apply_toml(THESIS_CONTROLLER, "thesis")?,
                "table-4.3" => parameters.apply_toml(base.table_4_3, "table-4.3")?,
                model if ForceModelName::CHOICES.iter().any(|c| c.name == model) => {
                    parameters.set_text("muscle.force_model", model)?;
                    parameters.apply_toml(beside_the_model(model), model)?;
                }
                _ => return Err(unknown()),
            }
        }
        Ok(parameters)
    }

    /// The parameters of a preset, or else of a TOML file, which starts from the defaults.
    ///
    /// # Errors
    /// [`Error::UnknownPreset`] where there is neither; [`Error::Io`]; otherwise as [`Parameters::apply_toml`].
    pub fn load(source: &str) -> Result<Self> {
        Self::load_with_note(source).map(|(parameters, _)| parameters)
    }

    /// As [`Parameters::load`], with what a person should know of the file: that it gives coefficients of other force
    /// models than the chosen one.
    ///
    /// # Errors
    /// As [`Parameters::load`].
    pub fn load_with_note(source: &str) -> Result<(Self, Option<String>)> {
        let path = std::path::Path::new(source);
        if path.is_dir() {
            let no_file = || std::io::Error::other("is a folder: give a TOML file in it, or a preset");
            let preset = Self::preset(source).map_err(|_| Error::Io { path: path.to_owned(), source: no_file() });
            return Ok((preset?, None));
        }
        if !path.exists() {
            return Ok((Self::preset(source)?, None));
        }
        let text = input::read_text(path)?;
        let mut parameters = Self::default();
        let table = parsed(&text, source)?;
        parameters.apply_table(&table, source)?;
        let note = parameters.of_other_models(&table).map(|note| format!("{source}: {note}"));
        Ok((parameters, note))
    }

    /// Coefficients in a file of other force models than the chosen one, where it gives none of that, in a sentence. A file
    /// that gives those of all models is a complete one, as `to_toml` writes it.
    fn of_other_models(&self, table: &toml::Table) -> Option<String> {
        let mut groups = Vec::new();
        self.force_models.visit(&mut |variable, _| groups.push(variable.group()));
        groups.dedup();
        let is_given = |group: &str| table.keys().any(|key| key.split('.').next() == Some(group));
        let given: Vec<&str> = groups.iter().copied().filter(|group| is_given(group)).collect();
        let chosen = self.muscle.force_model as usize - 1;
        if given.is_empty() || given.len() == groups.len() || given.contains(&ForceModels::GROUPS[chosen]) {
            return None;
        }
        Some(format!(
            "it gives coefficients in [{}], but `muscle.force_model` is {}, which uses none of them: choose the model they belong \
             to under [muscle], or leave them out",
            given.join("], ["),
            ForceModelName::CHOICES[chosen].name
        ))
    }

    /// Changes parameters by a TOML text; a top-level `preset = "NAME"` says what the text starts from.
    ///
    /// # Errors
    /// [`Error::Toml`] with the line for a text that is not TOML; [`Error::ParameterFile`] for a name, kind or value
    /// that does not fit. The parameters are then unchanged.
    pub fn apply_toml(&mut self, text: &str, source_name: &str) -> Result<()> {
        self.apply_table(&parsed(text, source_name)?, source_name)
    }

    fn apply_table(&mut self, table: &toml::Table, source_name: &str) -> Result<()> {
        let in_file =
            |problem| Error::ParameterFile { source_name: source_name.to_owned(), problem: Box::new(problem) };
        let mut changed = match table.get("preset") {
            Some(toml::Value::String(name)) => Self::preset(name).map_err(|_| {
                let expected = "the name of a preset and of no file (`sinew list presets` shows all)".to_owned();
                in_file(Error::WrongKind { name: "preset".to_owned(), expected, found: name.clone() })
            })?,
            Some(other) => {
                let (name, expected) = ("preset".to_owned(), "the name of a preset".to_owned());
                return Err(in_file(Error::WrongKind { name, expected, found: other.type_str().to_owned() }));
            }
            None => *self,
        };
        for (key, value) in table {
            if key != "preset" {
                changed.apply_value(key, value).map_err(in_file)?;
            }
        }
        *self = changed;
        Ok(())
    }

    fn apply_value(&mut self, name: &str, value: &toml::Value) -> Result<()> {
        match value {
            toml::Value::Table(table) if !table.is_empty() => {
                table.iter().try_for_each(|(key, value)| self.apply_value(&format!("{name}.{key}"), value))
            }
            toml::Value::Float(number) => self.set(name, *number),
            // TOML integers are 64 bit; the ones people write here are exact in a double.
            #[allow(clippy::cast_precision_loss)]
            toml::Value::Integer(number) => self.set(name, *number as f64),
            toml::Value::String(text) => self.set_text(name, text),
            other => Err(Error::WrongKind {
                name: name.to_owned(),
                expected: "a number or a name".to_owned(),
                found: other.type_str().to_owned(),
            }),
        }
    }

    /// Value of a parameter by its full name; an enumeration gives its number.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`].
    pub fn get(&self, name: &str) -> Result<f64> {
        self.find(name).map(|(_, value)| value).ok_or_else(|| Error::UnknownParameter { name: name.to_owned() })
    }

    /// Declaration and value of a parameter by its full name; `None` where there is none.
    pub fn find(&self, name: &str) -> Option<(&'static Variable, f64)> {
        let mut found = None;
        self.visit(&mut |variable, value| {
            if variable.name == name {
                found = Some((variable, value));
            }
        });
        found
    }

    /// Sets a parameter by its full name.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`], [`Error::OutOfRange`].
    pub fn set(&mut self, name: &str, value: f64) -> Result<()> {
        let mut outcome = Err(Error::UnknownParameter { name: name.to_owned() });
        self.visit_mut(&mut |variable, old| {
            if variable.name != name {
                return old;
            }
            outcome = variable.check(value);
            if outcome.is_ok() { value } else { old }
        });
        outcome
    }

    fn set_text(&mut self, name: &str, text: &str) -> Result<()> {
        let choices = self.find(name).map(|(variable, _)| variable.kind);
        let wrong = |expected| Error::WrongKind { name: name.to_owned(), expected, found: text.to_owned() };
        match choices {
            None => Err(Error::UnknownParameter { name: name.to_owned() }),
            Some(Kind::Real) => Err(wrong("a number".to_owned())),
            Some(Kind::Enumeration(_, choices)) => {
                let names: Vec<_> = choices.iter().map(|choice| choice.name).collect();
                let position = names.iter().position(|known| *known == text);
                let position = position.ok_or_else(|| wrong(format!("one of {}", names.join(", "))))?;
                self.set(name, (position + 1) as f64)
            }
        }
    }

    /// The parameters as a TOML file with units and descriptions; [`Parameters::apply_toml`] reads it back exactly.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        let mut table = "";
        self.visit(&mut |variable, value| {
            let (group, key) = variable.name.split_once('.').unwrap_or(("", variable.name));
            if group != table {
                let _ = writeln!(text, "{}[{group}]", if table.is_empty() { "" } else { "\n" });
                table = group;
            }
            let written = variable.choice(value).map_or_else(|| format!("{value:?}"), |name| format!("{name:?}"));
            let _ = writeln!(text, "{key} = {written}  # {}: {}", variable.unit.symbol, variable.description);
        });
        text
    }
}

/// A text as a table of TOML.
fn parsed(text: &str, source_name: &str) -> Result<toml::Table> {
    toml::from_str(text).map_err(|error| Error::Toml {
        source_name: source_name.to_owned(),
        line: error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count()),
        problem: error.message().to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_file_reads_back_exactly() {
        let mut parameters = Parameters::preset("dmsp-40-290/improved-mckibben/thesis").unwrap();
        parameters.set("friction_hysteresis.half_width", 41.234_567_890_123_4).unwrap();
        let mut read = Parameters::default();
        read.apply_toml(&parameters.to_toml(), "test").unwrap();
        assert_eq!(read, parameters);
    }

    #[test]
    fn every_preset_loads() {
        for (name, _) in presets() {
            Parameters::preset(&name).unwrap();
        }
    }

    #[test]
    fn coefficients_of_another_force_model_than_the_chosen_one_are_noticed() {
        let note = |text: &str| {
            let (mut parameters, table) = (Parameters::default(), parsed(text, "f.toml").unwrap());
            parameters.apply_table(&table, "f.toml").unwrap();
            parameters.of_other_models(&table)
        };
        let foreign = note("[spring]\nlow_c0 = 1e5\n[mooney_rivlin]\nc10 = 1e6").unwrap();
        assert!(foreign.starts_with("it gives coefficients in [mooney_rivlin], [spring], but"), "{foreign}");
        assert!(foreign.contains("`muscle.force_model` is virtual-area, which uses none of them"), "{foreign}");
        for sound in ["[load]\nmass = 3", "[spring]\nlow_c0 = 1e5\n[muscle]\nforce_model = \"spring\"", PRESETS[1].toml]
        {
            assert_eq!(note(sound), None);
        }
        for (name, _) in presets() {
            assert_eq!(note(&Parameters::preset(&name).unwrap().to_toml()), None, "{name}");
        }
    }

    #[test]
    fn a_bad_file_changes_nothing_and_says_what_is_wrong() {
        for (text, expected) in [
            (
                "[load]\nmass = 30\nmas = 4.0",
                "f.toml: there is no parameter `load.mas`; `sinew list variables` shows all",
            ),
            ("[load]\nmass = nan", "f.toml: `load.mass` is NaN kg, allowed is 0.001 to 100000 kg"),
            ("[load]\nmass = -3", "f.toml: `load.mass` is -3 kg, allowed is 0.001 to 100000 kg"),
            (
                "[muscle]\nforce_model = \"x\"",
                "f.toml: `muscle.force_model` takes one of virtual-area, improved-mckibben, mckibben, tondu-lopez, \
                 tondu-lopez-k, tondu-lopez-kq, tondu-lopez-friction, frustum-ends, rounded-ends, variable-diameter, \
                 mooney-rivlin, spring, three-element, not `x`",
            ),
            ("[load]\nmass = \"x\"", "f.toml: `load.mass` takes a number, not `x`"),
            (
                "preset = \"p/int.toml\"",
                "f.toml: `preset` takes the name of a preset and of no file (`sinew list presets` shows all), not `p/int.toml`",
            ),
            ("[load]\nmass = true", "f.toml: `load.mass` takes a number or a name, not `boolean`"),
        ] {
            let mut parameters = Parameters::default();
            let message = parameters.apply_toml(text, "f.toml").unwrap_err().to_string();
            assert_eq!(message, expected);
            assert_eq!(parameters, Parameters::default());
        }
        let folder = Parameters::load(env!("CARGO_MANIFEST_DIR")).unwrap_err().to_string();
        assert!(folder.ends_with("is a folder: give a TOML file in it, or a preset"), "{folder}");
        let message = Parameters::default().apply_toml("[load]\n\nmass = = 3", "f.toml").unwrap_err().to_string();
        assert!(message.starts_with("f.toml: line 3: "), "{message}");
    }
}
