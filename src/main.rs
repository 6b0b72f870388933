//! The `sinew` command: parse, call, print.

use clap::{Args, Parser, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use sinew::comparison::{self, Muscle, compare};
use sinew::diagnosis::plan::{self, Limits, Plan, Task};
use sinew::diagnosis::report::{EXTENDED, FILES, NOMINAL};
use sinew::diagnosis::{self, Diagnosis, diagnose, report};
use sinew::effects::Effects;
use sinew::identification::structure::{Braid, all_models, model_name};
use sinew::identification::{self, identify};
use sinew::measurement::{self, Recording, Signal};
use sinew::models::models;
use sinew::muscle::ForceModelName;
use sinew::parameters::{Parameters, presets};
use sinew::simulation::{OUTPUTS, replay, rms_difference};
use sinew::{
    Error, Result, closed_loop, demo, export, hammerstein, package, printable, quality, reproduction, ssp, tuning,
};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

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
    /// Replay recorded inputs through the model and compare
    #[command(after_help = "Example:\n  sinew simulate run1.csv --parameters dmsp-40-1000 --out simulated")]
    Simulate {
        #[command(flatten)]
        recordings: RecordingSource,
        #[command(flatten)]
        parameters: ParameterSource,
        /// Folder for simulated.csv and the plots
        #[arg(long, default_value = "sinew-simulated")]
        out: PathBuf,
    },
    /// Fit a force model to recordings
    #[command(
        after_help = "Examples:\n  sinew identify isotonic.csv --model improved-mckibben --parameters my-muscle.toml --out identified\n  \
        sinew export --parameters identified/parameters.toml --out fmus\n\n\
        --parameters gives the geometry (muscle.rest_length above all) and where the fit starts. Without --model it is the one \
        with the smallest error on points that were left out."
    )]
    Identify {
        #[command(flatten)]
        recordings: RecordingSource,
        #[command(flatten)]
        parameters: ParameterSource,
        /// Force model (see `sinew list models`) [default: the best on points that were left out]
        #[arg(long, value_name = "NAME", value_parser = force_model)]
        model: Option<ForceModelName>,
        /// Keep thread length and turns as --parameters has them
        #[arg(long)]
        fixed_braid: bool,
        /// Folder for parameters.toml, identification.json and the plots
        #[arg(long, default_value = "sinew-identified")]
        out: PathBuf,
    },
    /// Fit a Hammerstein model, from command to contraction without physics, and set the physical one beside it
    #[command(after_help = "Example:\n  sinew hammerstein run1.csv --parameters dmsp-40-1000 --out hammerstein\n\n\
        The model is fitted to the first half of the recording and chosen by the next fifth; errors are those of the rest. It holds \
        for the load of the recording. --parameters is the physical model.")]
    Hammerstein {
        #[command(flatten)]
        recordings: RecordingSource,
        #[command(flatten)]
        parameters: ParameterSource,
        /// Folder for hammerstein.json and the plot
        #[arg(long, default_value = "sinew-hammerstein")]
        out: PathBuf,
    },
    /// Fit every force model to recordings and compare them
    #[command(after_help = "Examples:\n  sinew compare map.csv --parameters my-muscle.toml --out comparison\n  \
        sinew compare isotonic.csv --models mckibben,improved-mckibben,virtual-area\n  \
        sinew compare --muscle dmsp-40-1000=long.csv --muscle dmsp-40-290=short1.csv,short2.csv\n\n\
        Several muscles are compared one by one, and the parameters of each are tried on the others. What stands before the = \
        is a preset or parameter file with the geometry of the muscle (muscle.rest_length above all), and its name.")]
    Compare {
        /// Recordings of one muscle: CSV files with a header `name [unit]` per column
        #[arg(value_name = "RECORDING.csv", required_unless_present = "muscles", conflicts_with = "muscles")]
        files: Vec<PathBuf>,
        /// Header of a foreign file and what it means here, as in --map "p_mus=gauge_pressure [bar]"
        #[arg(long = "map", value_name = "THEIRS=OURS", value_parser = renaming)]
        renamed: Vec<(String, String)>,
        #[command(flatten)]
        parameters: ParameterSource,
        /// Geometry and recordings of a muscle; once for each muscle
        #[arg(
            long = "muscle", value_name = "PARAMETERS=FILE[,FILE]", value_parser = muscle_files, conflicts_with = "source"
        )]
        muscles: Vec<(String, Vec<PathBuf>)>,
        /// Force models [default: all]
        #[arg(long, value_name = "NAME,NAME", value_delimiter = ',', value_parser = force_model)]
        models: Vec<ForceModelName>,
        /// Folder for report.html, comparison.json and comparison.md
        #[arg(long, default_value = "sinew-compared")]
        out: PathBuf,
    },
    /// Say what the simulation gets wrong and why, and extend the model
    #[command(after_help = "Example:\n  sinew diagnose run1.csv run2.csv --out diagnosis\n\n\
        The last 40 % of each recording are held out from the fits.")]
    Diagnose {
        #[command(flatten)]
        recordings: RecordingSource,
        #[command(flatten)]
        parameters: ParameterSource,
        /// Relative error of the nominal coefficients below which nothing is called wrong
        #[arg(long, default_value_t = diagnosis::DEFAULT_TOLERANCE, value_parser = tolerance)]
        tolerance: f64,
        /// Folder for diagnosis.json, report.html, extended.toml, nominal.toml, simulated.csv and the extended FMU
        #[arg(long, default_value = "sinew-diagnosis")]
        out: PathBuf,
    },
    /// Propose the recording that tells apart the causes that are left
    #[command(after_help = "Examples:\n  sinew plan sinew-diagnosis/diagnosis.json --load-mass 20,40 --out plan\n  \
        sinew plan --effects payload_mass,force_gain --load-mass 20 --sensors contraction\n  \
        sinew plan --effects all\n\n\
        plan.csv, or plan-1.csv and plan-2.csv where two belong together, hold the command to play; diagnose what you record\n\
        with them together with the recordings there are.\n\
        Without a diagnosis, the recording is planned that tells all effects apart as well as one can.")]
    Plan(PlanArguments),
    /// Choose the gains of the controller for a range of loads, and say how robust they are
    #[command(after_help = "Examples:\n  sinew tune --parameters dmsp-40-290 --load-mass 20,40,80 --out tuned\n  \
        sinew export --parameters tuned/parameters.toml")]
    Tune {
        #[command(flatten)]
        parameters: ParameterSource,
        /// Loads that the controller must hold, kg
        #[arg(long, value_delimiter = ',', default_value = "20,40,80", value_parser = |text: &str| quantity(text, Signal::LoadMass))]
        load_mass: Vec<f64>,
        /// Folder for parameters.toml, tuning.json and report.html
        #[arg(long, default_value = "sinew-tuning")]
        out: PathBuf,
    },
    /// Simulate the closed loops of the thesis, on known, unknown and random plants
    #[command(after_help = "Example:\n  sinew closed-loop --out docs")]
    ClosedLoop {
        /// Number of random plants
        #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
        plants: u32,
        /// Folder for closed-loop.md and its figures
        #[arg(long, default_value = "sinew-closed-loop")]
        out: PathBuf,
    },
    /// Regenerate docs/thesis.md: what the thesis prints beside what comes out, with a verdict on each
    #[command(after_help = "Example:\n  sinew reproduce --out docs")]
    Reproduce {
        /// Folder for thesis.md and its figures
        #[arg(long, default_value = "sinew-reproduced")]
        out: PathBuf,
    },
    /// Do it all once, on recordings that ship with the program
    #[command(after_help = "Example:\n  sinew demo --out sinew-demo")]
    Demo {
        /// Folder for everything that is made
        #[arg(long, default_value = "sinew-demo")]
        out: PathBuf,
    },
    /// List what there is
    #[command(after_help = "Example:\n  sinew list effects")]
    List {
        /// What to list
        what: Listing,
    },
}

#[derive(Args)]
struct PlanArguments {
    /// Diagnosis that left something open [default: sinew-diagnosis/diagnosis.json where it is there]
    #[arg(value_name = "diagnosis.json", conflicts_with = "effects")]
    diagnosis: Option<PathBuf>,
    /// Preset or TOML file of the model that was diagnosed [default: nominal.toml beside the diagnosis, or else dmsp-40-1000]
    #[arg(long = "parameters", value_name = "FILE|PRESET")]
    nominal: Option<String>,
    /// Effects to tell apart instead, at a usual size; or `all`
    #[arg(long, value_name = "NAME,NAME", value_parser = contenders)]
    effects: Option<Contenders>,
    /// Sensors of the rig, where no diagnosis tells them
    #[arg(long, value_delimiter = ',', default_value = "gauge_pressure,contraction", value_parser = sensor)]
    sensors: Vec<Signal>,
    /// Highest gauge pressure, as in "5 bar"; without a unit in Pa
    #[arg(long, default_value = "5 bar", allow_hyphen_values = true, value_parser = |text: &str| quantity(text, Signal::GaugePressure))]
    most_pressure: f64,
    /// Largest contraction, as in "200 mm"; without a unit in m [default: a quarter of the rest length]
    #[arg(long, allow_hyphen_values = true, value_parser = |text: &str| quantity(text, Signal::Contraction))]
    most_contraction: Option<f64>,
    /// Loads that can be hung on, kg
    #[arg(long, value_delimiter = ',', default_value = "20,40", allow_hyphen_values = true, value_parser = |text: &str| quantity(text, Signal::LoadMass))]
    load_mass: Vec<f64>,
    /// Longest single recording, s
    #[arg(long, default_value_t = plan::USUAL_DURATION, allow_hyphen_values = true, value_parser = |text: &str| quantity(text, Signal::Time))]
    duration: f64,
    /// Relative error of the nominal coefficients that is no cause [default: that of the diagnosis, or else 0.03]
    #[arg(long, value_parser = tolerance)]
    tolerance: Option<f64>,
    /// Folder for plan.csv, or plan-1.csv and plan-2.csv, plan.json and the plots; those of an earlier plan go
    #[arg(long, default_value = "sinew-plan")]
    out: PathBuf,
}

impl PlanArguments {
    /// The diagnosis that it is about.
    fn of_diagnosis(&self) -> Option<&Path> {
        let usual = Path::new("sinew-diagnosis/diagnosis.json");
        let there = || (self.effects.is_none() && usual.is_file()).then_some(usual);
        self.diagnosis.as_deref().or_else(there)
    }

    /// Files that it reads, where they are there.
    fn reads(&self) -> Vec<PathBuf> {
        let beside = |path: &Path| [NOMINAL, EXTENDED].map(|file| path.with_file_name(file.name));
        let of_diagnosis =
            self.of_diagnosis().into_iter().flat_map(|path| beside(path).into_iter().chain([path.into()]));
        of_diagnosis.chain(self.nominal.iter().map(PathBuf::from)).collect()
    }

    /// The model that was diagnosed.
    fn nominal(&self) -> Result<Parameters> {
        let beside = self.of_diagnosis().map(|path| path.with_file_name(NOMINAL.name));
        match (&self.nominal, beside) {
            (Some(given), _) => load_parameters(given),
            (None, Some(beside)) if beside.is_file() => load_parameters(&beside.display().to_string()),
            (None, _) => load_parameters(USUAL_MUSCLE),
        }
    }

    /// That it is planned for another model than was diagnosed, where that is not known.
    fn note(&self) -> Option<String> {
        let beside = self.of_diagnosis()?.with_file_name(NOMINAL.name);
        (self.nominal.is_none() && !beside.is_file())
            .then(|| format!("there is no {}: planned for {USUAL_MUSCLE}", beside.display()))
    }

    /// What is to be told apart.
    fn task(&self, nominal: &Parameters) -> Result<Task> {
        if let Some(path) = self.of_diagnosis()
            && let Some(task) = Task::of_diagnosis(path, nominal)?
        {
            return Ok(task);
        }
        let names = self.effects.as_ref().map_or(&[][..], |Contenders(names)| names);
        Task::of_effects(names, &self.sensors, nominal)
    }

    fn limits(&self) -> Limits {
        Limits {
            most_pressure: self.most_pressure,
            most_contraction: self.most_contraction,
            load_masses: self.load_mass.clone(),
            duration: self.duration,
        }
    }
}

/// Effects that are to be told apart; all where none is named.
#[derive(Clone)]
struct Contenders(Vec<String>);

fn contenders(text: &str) -> std::result::Result<Contenders, String> {
    if text == "all" {
        return Ok(Contenders(Vec::new()));
    }
    let names: Vec<String> = text.split(',').map(str::to_owned).collect();
    if let Some(unknown) = names.iter().find(|name| Effects::description(name).is_none()) {
        return Err(format!("there is no effect `{unknown}`; `sinew list effects` shows all"));
    }
    match (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
        Some(k) => Err(format!("`{}` stands there twice", names[k])),
        None if names.len() < 2 => Err("name at least two effects that are to be told apart, or `all`".to_owned()),
        None => Ok(Contenders(names)),
    }
}

fn sensor(text: &str) -> std::result::Result<Signal, String> {
    let found = OUTPUTS.into_iter().find(|signal| signal.name() == text);
    found.ok_or_else(|| "one of gauge_pressure, contraction, force".to_owned())
}

/// A positive number in SI, with or without a unit behind it.
fn quantity(text: &str, signal: Signal) -> std::result::Result<f64, String> {
    let number = text.trim_end_matches(|c: char| c.is_alphabetic() && c != 'e').trim_end();
    let unit = text[number.len()..].trim();
    let scale = signal.units().iter().find(|(symbol, _)| *symbol == unit).map(|(_, scale)| *scale);
    let scale = if unit.is_empty() { Some(1.0) } else { scale };
    match (number.parse::<f64>(), scale) {
        (Ok(value), Some(scale)) if value > 0.0 && (value * scale).is_finite() => Ok(value * scale),
        _ => {
            let symbols = signal.units().iter().map(|(symbol, _)| *symbol).collect::<Vec<_>>().join(", ");
            Err(format!("a positive number, in {symbols}"))
        }
    }
}

/// The muscle that is meant where none is named.
const USUAL_MUSCLE: &str = "dmsp-40-1000";

#[derive(Args)]
struct ParameterSource {
    /// Preset (see `sinew list presets`) or TOML file
    #[arg(long = "parameters", value_name = "FILE|PRESET", default_value = USUAL_MUSCLE)]
    source: String,
}

impl ParameterSource {
    fn load(&self) -> Result<Parameters> {
        load_parameters(&self.source)
    }

    fn path(&self) -> PathBuf {
        PathBuf::from(&self.source)
    }
}

#[derive(Args)]
struct RecordingSource {
    /// Recordings: CSV files with a header `name [unit]` per column
    #[arg(required = true, value_name = "RECORDING.csv")]
    files: Vec<PathBuf>,
    /// Header of a foreign file and what it means here, as in --map "p_mus=gauge_pressure [bar]"
    #[arg(long = "map", value_name = "THEIRS=OURS", value_parser = renaming)]
    renamed: Vec<(String, String)>,
}

impl RecordingSource {
    fn read(&self) -> Result<Vec<Recording>> {
        read_recordings(&self.files, &self.renamed)
    }
}

/// Says beside the answer what a person should know.
fn say_note(note: &str) {
    eprintln!("note: {}", printable(note));
}

/// Loads parameters and says what of their file is in doubt.
fn load_parameters(source: &str) -> Result<Parameters> {
    let (parameters, note) = Parameters::load_with_note(source)?;
    note.iter().for_each(|note| say_note(note));
    Ok(parameters)
}

/// Reads recordings and says what of them is not used.
fn read_recordings(files: &[PathBuf], renamed: &[(String, String)]) -> Result<Vec<Recording>> {
    let recordings = measurement::read_all(files, renamed)?;
    for recording in &recordings {
        recording.notes.iter().for_each(|note| say_note(&format!("{}: {note}", recording.name())));
    }
    Ok(recordings)
}

/// Refuses units that contradict each other or the muscle, and says of which it is in doubt.
fn check_units(recordings: &[Recording], parameters: &Parameters) -> Result<()> {
    quality::notes_on_units(recordings, parameters)?.iter().for_each(|note| say_note(note));
    Ok(())
}

fn renaming(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=') {
        Some((theirs, ours)) if !theirs.is_empty() && !ours.is_empty() => Ok((theirs.to_owned(), ours.to_owned())),
        _ => Err("write THEIRS=OURS, as in \"p_mus=gauge_pressure [bar]\"".to_owned()),
    }
}

fn muscle_files(text: &str) -> std::result::Result<(String, Vec<PathBuf>), String> {
    match text.split_once('=') {
        Some((source, files)) if !source.is_empty() && !files.is_empty() => {
            Ok((source.to_owned(), files.split(',').map(PathBuf::from).collect()))
        }
        _ => Err("write PARAMETERS=FILE,FILE, as in dmsp-40-290=short.csv".to_owned()),
    }
}

fn force_model(text: &str) -> std::result::Result<ForceModelName, String> {
    let known = || all_models().into_iter().map(model_name).collect::<Vec<_>>().join(", ");
    let found = all_models().into_iter().find(|model| model_name(*model) == text);
    found.ok_or_else(|| format!("one of {}", known()))
}

fn tolerance(text: &str) -> std::result::Result<f64, String> {
    let value: f64 = text.trim_end_matches('%').trim().parse().map_err(|_| "not a number".to_owned())?;
    let value = if text.ends_with('%') { value / 100.0 } else { value };
    if value > 0.0 && value < 1.0 { Ok(value) } else { Err("a share between 0 and 1, such as 0.03 or 3%".to_owned()) }
}

#[derive(Clone, Copy, ValueEnum)]
enum Listing {
    Models,
    Effects,
    Presets,
    Variables,
}

/// What a command has to say: to a person, with notes beside it, and to a machine, whose JSON holds the notes.
#[derive(Default)]
struct Answer {
    text: String,
    notes: Vec<String>,
    json: Value,
    /// What is yet to be written.
    files: Vec<(PathBuf, Vec<u8>)>,
    /// What is to go when that is done.
    outdated: Vec<PathBuf>,
}

impl Answer {
    /// Writes its files, none of them over one that was read, and says which.
    fn write(mut self, read: &[PathBuf]) -> Result<Self> {
        if !self.files.is_empty() {
            let written = names(&export::write_whole(std::mem::take(&mut self.files), read)?);
            self.text = format!("{}\n\n{}", self.text.trim_end(), written.join("\n")).trim_start().to_owned();
            self.json["files"] = json!(written);
        }
        for path in &self.outdated {
            std::fs::remove_file(path).map_err(|source| Error::Io { path: path.clone(), source })?;
        }
        Ok(self)
    }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(cli.command) {
        Ok(answer) => {
            if !cli.json {
                answer.notes.iter().for_each(|note| say_note(note));
            }
            let output = if cli.json { format!("{:#}", answer.json) } else { answer.text };
            let mut stdout = std::io::stdout();
            match writeln!(stdout, "{}", output.trim_end()).and_then(|()| stdout.flush()) {
                // Whoever stops reading early, as `head` does, has all that was wanted.
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    eprintln!("sinew: the answer cannot be written to standard output: {error}");
                    ExitCode::from(1)
                }
                _ => ExitCode::SUCCESS,
            }
        }
        Err(error) => {
            eprintln!("sinew: {}", printable(&error.to_string()));
            ExitCode::from(1)
        }
    }
}

impl Command {
    /// Files that it reads, where they are there.
    fn reads(&self) -> Vec<PathBuf> {
        match self {
            Self::Export { parameters, libraries, .. } => {
                let files = libraries.iter().filter_map(|library| library.split_once('='));
                files.map(|(_, file)| file.into()).chain([parameters.path()]).collect()
            }
            Self::Simulate { recordings, parameters, .. }
            | Self::Identify { recordings, parameters, .. }
            | Self::Hammerstein { recordings, parameters, .. }
            | Self::Diagnose { recordings, parameters, .. } => {
                recordings.files.iter().cloned().chain([parameters.path()]).collect()
            }
            Self::Compare { files, parameters, muscles, .. } => {
                let of_muscles =
                    muscles.iter().flat_map(|(source, files)| files.iter().cloned().chain([source.into()]));
                files.iter().cloned().chain([parameters.path()]).chain(of_muscles).collect()
            }
            Self::Plan(arguments) => arguments.reads(),
            Self::Tune { parameters, .. } => vec![parameters.path()],
            Self::ClosedLoop { .. } | Self::Reproduce { .. } | Self::Demo { .. } | Self::List { .. } => Vec::new(),
        }
    }
}

fn run(command: Command) -> Result<Answer> {
    let read = command.reads();
    if let Command::Diagnose { out, .. } = &command {
        // So much is known before a long search.
        let written = FILES.map(|file| out.join(file.name));
        export::spare(written.iter().map(PathBuf::as_path), &read)?;
    }
    answer(command)?.write(&read)
}

fn answer(command: Command) -> Result<Answer> {
    match command {
        Command::Export { parameters, out, libraries } => export_fmus(&parameters.load()?, &out, &libraries),
        Command::Simulate { recordings, parameters, out } => simulate(&parameters.load()?, &recordings.read()?, &out),
        Command::Identify { recordings, parameters, model, fixed_braid, out } => {
            run_identification(&parameters.load()?, &recordings.read()?, model, fixed_braid, &out)
        }
        Command::Hammerstein { recordings, parameters, out } => {
            run_hammerstein(&parameters.load()?, &recordings.read()?, &out)
        }
        Command::Compare { files, renamed, parameters, muscles, models, out } => {
            let all = if muscles.is_empty() { vec![(parameters.source, files)] } else { muscles };
            run_comparison(all, &renamed, models, &out)
        }
        Command::Diagnose { recordings, parameters, tolerance, out } => {
            run_diagnosis(&parameters.load()?, &recordings.read()?, tolerance, &out)
        }
        Command::Plan(arguments) => run_plan(&arguments),
        Command::Tune { parameters, load_mass, out } => tune(&parameters, load_mass, &out),
        Command::ClosedLoop { plants, out } => evaluate_closed_loop(plants, &out),
        Command::Reproduce { out } => run_reproduction(&out),
        Command::Demo { out } => run_demo(&out),
        Command::List { what } => Ok(list(what)),
    }
}

/// A bar on stderr that counts finished pieces of work; invisible where stderr is no terminal.
fn progress(pieces: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}").expect("a valid template");
    ProgressBar::new(pieces as u64).with_style(style)
}

/// What tells a bar that one more piece is done or begun, by its name.
fn counting(bar: &ProgressBar) -> impl Fn(&str) + Sync {
    |name| {
        bar.set_message(name.to_owned());
        bar.inc(1);
    }
}

/// What a diagnosis is at, on stderr: how many fits it takes nobody knows.
fn fits() -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {elapsed}, fit {pos}: {wide_msg}").expect("a valid template");
    let fits = ProgressBar::new_spinner().with_style(style).with_message("the nominal model");
    fits.enable_steady_tick(Duration::from_millis(200));
    fits
}

fn simulate(parameters: &Parameters, recordings: &[Recording], out: &Path) -> Result<Answer> {
    check_units(recordings, parameters)?;
    let replayed = |recording| Ok([replay(parameters, recording)?]);
    let replays = recordings.iter().map(replayed).collect::<Result<Vec<_>>>()?;
    let mut files = vec![(out.join("simulated.csv"), report::simulated_csv(["simulated"], recordings, &replays))];
    let (mut rows, mut errors) = (Vec::new(), Vec::new());
    for (recording, replays) in recordings.iter().zip(&replays) {
        let name = recording.name();
        let stem = name.trim_end_matches(".csv").replace(['/', '\\'], "_");
        let plots = report::time_plots(recording, replays).into_iter();
        for (k, svg) in plots.chain(report::residual_plot(parameters, parameters, recording)?).enumerate() {
            files.push((out.join(format!("{stem}-{}.svg", k + 1)), svg.into_bytes()));
        }
        for signal in OUTPUTS {
            if let (Some(measured), Some(simulated)) = (recording.get(signal), replays[0].get(signal)) {
                let Some(rms) = rms_difference(measured, simulated) else { continue };
                let (signal, unit) = (signal.name(), signal.unit());
                errors.push(json!({ "recording": name, "signal": signal, "rms": rms, "unit": unit }));
                let texts = [name.clone(), signal.to_owned(), format!("{rms:.3e}"), unit.to_owned()];
                rows.push(["recording", "signal", "rms", "unit"].into_iter().zip(texts).collect());
            }
        }
    }
    Ok(Answer { text: table(rows).text, json: json!({ "errors": errors }), files, ..Answer::default() })
}

/// The paths as text, which those of some systems are only nearly.
fn names(files: &[PathBuf]) -> Vec<String> {
    files.iter().map(|path| path.display().to_string()).collect()
}

fn run_identification(
    parameters: &Parameters,
    recordings: &[Recording],
    model: Option<ForceModelName>,
    fixed_braid: bool,
    out: &Path,
) -> Result<Answer> {
    check_units(recordings, parameters)?;
    let braid = if fixed_braid { Braid::Given } else { Braid::Fitted };
    let found = identify(recordings, parameters, model, braid)?;
    let mut rows = vec![["parameter", "value", "95 % from", "to", "unit"].map(str::to_owned)];
    let fitted = &found.found.fitted;
    for ((free, value), half) in fitted.structure.free.iter().zip(&fitted.values).zip(&fitted.half_widths) {
        let bound = |sign: f64| half.map_or("at its bound".to_owned(), |half| format!("{:.5e}", value + sign * half));
        let (name, unit) = (free.variable.name.to_owned(), free.variable.unit.symbol.to_owned());
        rows.push([name, format!("{value:.5e}"), bound(-1.0), bound(1.0), unit]);
    }
    let rows = rows.into_iter().map(|cells| cells.into_iter().map(|cell| ("", cell)).collect()).collect();
    let said = identification::report::sentences(&found).join("\n");
    let text = format!("{said}\n\n{}", table(rows).text);
    let (json, files) = (identification::report::to_json(&found), identification::report::files(&found, out));
    Ok(Answer { text, notes: found.notes, json, files, ..Answer::default() })
}

fn run_hammerstein(parameters: &Parameters, recordings: &[Recording], out: &Path) -> Result<Answer> {
    let [recording] = recordings else {
        let problem = "a Hammerstein model is one of a single recording: give one".to_owned();
        return Err(Error::Recording { path: recordings[1].path.clone(), problem });
    };
    check_units(recordings, parameters)?;
    let found = hammerstein::identify(recording, parameters)?;
    Ok(Answer { text: found.sentence(), json: found.to_json(), files: found.files(out), ..Answer::default() })
}

fn run_comparison(
    muscles: Vec<(String, Vec<PathBuf>)>,
    renamed: &[(String, String)],
    models: Vec<ForceModelName>,
    out: &Path,
) -> Result<Answer> {
    let models = if models.is_empty() { all_models() } else { models };
    let stem = |source: &String| match Path::new(source) {
        path if path.is_file() => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        _ => source.clone(),
    };
    let stem = |source: &String| printable(&stem(source));
    let stems: Vec<String> = muscles.iter().map(|(source, _)| stem(source)).collect();
    let read = |(source, files): (String, Vec<PathBuf>)| -> Result<Muscle> {
        let given = load_parameters(&source)?;
        let short = stem(&source);
        let name = if stems.iter().filter(|other| **other == short).count() > 1 { printable(&source) } else { short };
        let recordings = read_recordings(&files, renamed)?;
        check_units(&recordings, &given)?;
        Ok(Muscle { name, given, recordings })
    };
    let found = compare(muscles.into_iter().map(read).collect::<Result<_>>()?, &models)?;
    let (mut text, mut notes) = (String::new(), Vec::new());
    for muscle in &found.muscles {
        notes.extend(muscle.points.notes.iter().cloned());
        let rows = comparison::report::table_of(muscle);
        let rows = rows.into_iter().map(|cells| cells.into_iter().map(|cell| ("", cell)).collect()).collect();
        text += &format!("{}\n\n{}\n", comparison::report::headline(muscle), table(rows).text);
    }
    let (json, files) = (comparison::report::to_json(&found), comparison::report::files(&found, out));
    Ok(Answer { text, notes, json, files, ..Answer::default() })
}

fn run_diagnosis(parameters: &Parameters, recordings: &[Recording], tolerance: f64, out: &Path) -> Result<Answer> {
    let fits = fits();
    let found = diagnose(parameters, recordings, tolerance, &counting(&fits))?;
    fits.finish_and_clear();
    let files = report::files(&found, parameters, recordings, &package::libraries(&[])?, out)?;
    let (text, json) = (told(&found), report::to_json(&found));
    Ok(Answer { text, json, notes: found.notes, files, ..Answer::default() })
}

/// A diagnosis in a few lines.
fn told(found: &Diagnosis) -> String {
    let mut text = format!("{}\n", report::headline(found));
    text += &format!("{}\n", report::gain(found));
    for signal in &found.signals {
        text += &format!(
            "  {:<15} nominal {:.3e}, extended {:.3e}, noise {:.3e} {}\n",
            signal.signal.name(),
            signal.nominal_rms,
            signal.extended_rms,
            signal.noise_rms,
            signal.signal.unit()
        );
    }
    text
}

fn run_plan(arguments: &PlanArguments) -> Result<Answer> {
    let (nominal, limits) = (arguments.nominal()?, arguments.limits());
    let task = arguments.task(&nominal)?;
    arguments.note().iter().for_each(|note| say_note(note));
    let tolerance = arguments.tolerance.or(task.tolerance).unwrap_or(diagnosis::DEFAULT_TOLERANCE);
    let bar = progress(plan::pieces(&limits));
    let found = plan::plan(&task, &nominal, tolerance, &limits, &counting(&bar))?;
    bar.finish_and_clear();
    let files = plan::files(&found, &nominal, &arguments.out);
    let outdated = plan::outdated(&arguments.out, &files);
    Ok(Answer { text: planned(&found), json: plan::to_json(&found), files, outdated, ..Answer::default() })
}

/// A plan in a table or two.
fn planned(found: &Plan) -> String {
    let mut text = format!("To tell apart: {}.\n{}\n\n", found.why, found.sentence());
    let header = ["experiment", "seconds", "pairs told apart", "smallest lambda", ""].map(str::to_owned);
    let row = |row: &plan::Compared| {
        let (seconds, lambda) = (format!("{:.0}", row.duration), format!("{:.3e}", row.lambda));
        let how = if row.fitted { "fitted" } else { "to first order" };
        [row.name.clone(), seconds, row.told_apart.to_string(), lambda, how.to_owned()]
    };
    let rows = std::iter::once(header).chain(found.compared.iter().map(row));
    text += &table(rows.map(|cells| cells.into_iter().map(|cell| ("", cell)).collect()).collect()).text;
    let all = plan::matrix(found);
    text += &format!("\nlambda of the best (from {:.0} on a pair is told apart):\n{all}", plan::ENOUGH);
    text
}

fn tune(source: &ParameterSource, mut masses: Vec<f64>, out: &Path) -> Result<Answer> {
    masses.sort_by(f64::total_cmp);
    masses.dedup();
    let parameters = source.load()?;
    let tuning = tuning::tune(&parameters, &masses)?;
    let files = tuning::files(&tuning, &parameters, &source.source, out);
    let controller = &tuning.parameters.controller;
    let worst = tuning.worst();
    let least =
        |value: fn(&tuning::PointMargins) -> f64| tuning.margins.iter().map(value).fold(f64::INFINITY, f64::min);
    let text = format!(
        "proportional {:.4} V/m, integral {:.4} V/(m s), derivative {:.4} V s/m\n\
         gain margin {:.2}, phase margin {:.0}°, dead time margin {:.0} ms; sensitivity peak {:.2} on plants that are not quite known,\n\
         at its worst with {} kg at {:.0} mm\n",
        controller.proportional_gain,
        controller.integral_gain,
        controller.derivative_gain,
        least(|m| m.known.gain),
        least(|m| m.known.phase).to_degrees(),
        1e3 * least(|m| m.known.delay),
        worst.uncertain.sensitivity,
        worst.point.mass,
        1e3 * worst.point.contraction,
    );
    Ok(Answer { text, json: tuning::to_json(&tuning), files, ..Answer::default() })
}

fn evaluate_closed_loop(plants: u32, out: &Path) -> Result<Answer> {
    let bar = progress(closed_loop::pieces());
    let evaluation = closed_loop::evaluate(plants as usize, &counting(&bar))?;
    bar.finish_and_clear();
    let (json, files) = (closed_loop::to_json(&evaluation), closed_loop::files(&evaluation, out));
    Ok(Answer { json, files, ..Answer::default() })
}

fn run_reproduction(out: &Path) -> Result<Answer> {
    let bar = progress(reproduction::pieces());
    let found = reproduction::reproduce(&counting(&bar))?;
    bar.finish_and_clear();
    let (json, files) = (reproduction::to_json(&found), reproduction::files(&found, out));
    Ok(Answer { json, files, ..Answer::default() })
}

fn run_demo(out: &Path) -> Result<Answer> {
    let fits = fits();
    let made = demo::run(out, &counting(&fits))?;
    fits.finish_and_clear();
    let text = format!(
        "1. Exported the nominal FMUs to {nominal}.\n\
         2. Simulated the closed loop: largest control error {error:.2} mm ({out}/closed_loop.svg).\n\
         3. Replayed two recordings with dry friction hidden in them and fitted every effect.\n\n{told}\n\
         4. Wrote the extended model and FMU to {diagnosis}.\n\nOpen {diagnosis}/report.html.\n",
        nominal = out.join("nominal").display(),
        out = out.display(),
        error = 1e3 * made.closed_loop.largest_error(),
        told = told(&made.diagnosis),
        diagnosis = out.join("diagnosis").display(),
    );
    let json = json!({ "files": names(&made.files), "diagnosis": report::to_json(&made.diagnosis) });
    Ok(Answer { text, notes: made.diagnosis.notes, json, ..Answer::default() })
}

fn export_fmus(parameters: &Parameters, out: &std::path::Path, libraries: &[String]) -> Result<Answer> {
    let files = export::files(parameters, &package::libraries(libraries)?, out);
    ssp::warnings(parameters).iter().for_each(|note| say_note(note));
    Ok(Answer { json: json!({}), files, ..Answer::default() })
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
    Answer { text, json: Value::Array(json.map(Value::Object).collect()), ..Answer::default() }
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
            presets()
                .into_iter()
                .map(|(name, description)| vec![("name", name), ("description", description)])
                .collect(),
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
    Answer { text, json: Value::Array(all), ..Answer::default() }
}

fn list_variables() -> Answer {
    let (mut rows, mut all) = (Vec::new(), Vec::new());
    for model in models() {
        let interface = model.interface();
        for (position, variable) in interface.variables.iter().enumerate() {
            let (declaration, value) = (variable.declaration, model.get(position));
            let choice = declaration.choice(value);
            let shown = choice.map_or_else(|| value.to_string(), str::to_owned);
            let value = choice.map_or_else(|| json!(value), |name| json!(name));
            let words = [
                ("fmu", interface.name),
                ("name", variable.name),
                ("role", declaration.role_name()),
                ("unit", declaration.unit.symbol),
                ("value", &shown),
                ("description", declaration.description),
            ];
            rows.push(words.iter().map(|(key, text)| (*key, (*text).to_owned())).collect());
            let mut object: serde_json::Map<_, _> =
                words.iter().map(|(key, text)| ((*key).to_owned(), json!(text))).collect();
            object.extend(
                [("value", value), ("min", json!(declaration.min)), ("max", json!(declaration.max))]
                    .map(|(key, value)| (key.to_owned(), value)),
            );
            all.push(Value::Object(object));
        }
    }
    Answer { text: table(rows).text, json: Value::Array(all), ..Answer::default() }
}
