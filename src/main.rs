//! The `sinew` command: parse, call, print.

use clap::{Args, Parser, Subcommand, ValueEnum};
use serde_json::{Value, json};
use sinew::effects::Effects;
use sinew::measurement::Recording;
use sinew::model::models;
use sinew::muscle::ForceModelName;
use sinew::parameters::{Parameters, presets};
use sinew::{Error, Result, package};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Parser)]
#[command(version, about = "Pneumatic artificial muscles as FMUs that learn from measurements")]
struct Cli {
    /// Print the result as JSON
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write the FMUs, with any parameters, without a compiler
    #[command(after_help = "Example:\n  sinew export --parameters dmsp-40-290 --out fmus")]
    Export {
        #[command(flatten)]
        parameters: ParameterSource,
        /// Folder for the FMUs
        #[arg(long, default_value = ".")]
        out: PathBuf,
        /// FMU library for a platform (linux64, win64, darwin64 …); may be given several times
        #[arg(long = "library", value_name = "PLATFORM=FILE")]
        libraries: Vec<String>,
    },
    /// List what there is
    #[command(after_help = "Example:\n  sinew list effects")]
    List {
        /// What to list
        what: Listing,
    },
}

#[derive(Args)]
struct ParameterSource {
    /// Preset (see `sinew list presets`) or TOML file
    #[arg(long = "parameters", value_name = "FILE|PRESET", default_value = "dmsp-40-1000")]
    source: String,
}

impl ParameterSource {
    fn load(&self) -> Result<Parameters> {
        Parameters::load(&self.source)
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Listing {
    Models,
    Effects,
    Presets,
    Variables,
}

/// What a command has to say: to a person and to a machine.
struct Answer {
    text: String,
    json: Value,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(cli.command) {
        Ok(answer) => {
            let output = if cli.json { format!("{:#}", answer.json) } else { answer.text };
            println!("{}", output.trim_end());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("sinew: {error}");
            ExitCode::from(1)
        }
    }
}

fn run(command: Command) -> Result<Answer> {
    match command {
        Command::Export { parameters, out, libraries } => export(&parameters.load()?, &out, &libraries),
        Command::List { what } => Ok(list(what)),
    }
}

fn export(parameters: &Parameters, out: &std::path::Path, libraries: &[String]) -> Result<Answer> {
    let files = package::export(parameters, &package::libraries(libraries)?, out)?;
    let paths: Vec<_> = files.iter().map(|path| path.display().to_string()).collect();
    Ok(Answer { text: paths.join("\n"), json: json!({ "files": paths }) })
}

/// Rows of named texts, as a table and as JSON.
fn table(rows: Vec<Vec<(&str, String)>>) -> Answer {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].1.chars().count()).max().unwrap_or(0);
    let widths: Vec<_> = (0..columns).map(width).collect();
    let line = |row: &Vec<(&str, String)>| {
        row.iter().zip(&widths).map(|((_, text), width)| format!("{text:width$}  ")).collect::<String>()
    };
    let text = rows.iter().map(|row| line(row).trim_end().to_owned() + "\n").collect();
    let json = rows.iter().map(|row| row.iter().map(|(key, text)| ((*key).to_owned(), json!(text))).collect());
    Answer { text, json: Value::Array(json.map(Value::Object).collect()) }
}

fn list(what: Listing) -> Answer {
    match what {
        Listing::Models => table(
            ForceModelName::CHOICES
                .iter()
                .map(|model| vec![("name", model.name.to_owned()), ("description", model.description.to_owned())])
                .collect(),
        ),
        Listing::Presets => table(
            presets().into_iter().map(|(name, description)| vec![("name", name), ("description", description)]).collect(),
        ),
        Listing::Effects => list_effects(),
        Listing::Variables => list_variables(),
    }
}

fn list_effects() -> Answer {
    let mut text = String::new();
    let mut all = Vec::new();
    for effect in Effects::DESCRIPTIONS {
        let parts = [
            ("meaning", effect.meaning),
            ("equation", effect.equation),
            ("in the data", effect.signature),
            ("experiment", effect.experiment),
            ("reference", effect.reference),
        ];
        text += &format!("{}\n", effect.name);
        parts.iter().for_each(|(key, value)| text += &format!("  {key:<12} {value}\n"));
        let mut object = serde_json::Map::new();
        object.insert("name".to_owned(), json!(effect.name));
        parts.iter().for_each(|(key, value)| {
            object.insert(key.replace(' ', "_"), json!(value));
        });
        all.push(Value::Object(object));
    }
    Answer { text, json: Value::Array(all) }
}

fn list_variables() -> Answer {
    let mut rows = Vec::new();
    for model in models() {
        let interface = model.interface();
        for (position, variable) in interface.variables.iter().enumerate() {
            let declaration = variable.declaration;
            rows.push(vec![
                ("fmu", interface.name.to_owned()),
                ("name", variable.name.to_owned()),
                ("role", format!("{:?}", declaration.role).to_lowercase()),
                ("unit", declaration.unit.symbol.to_owned()),
                ("value", model.get(position).to_string()),
                ("description", declaration.description.to_owned()),
            ]);
        }
    }
    table(rows)
}
