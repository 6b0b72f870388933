//! What can go wrong, as facts; the sentence a person reads is made from them here.

use std::path::PathBuf;

/// Anything that keeps Sinew from doing what was asked.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A value outside the range that its declaration allows.
    #[error("`{variable}` is {value}{unit}, allowed is {min} to {max}{unit}", unit = spaced(unit))]
    OutOfRange {
        /// Full name of the variable.
        variable: String,
        /// The value that was refused.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
        /// Unit of all three.
        unit: &'static str,
    },
    /// A number that stands for none of the choices of an enumeration.
    #[error("`{variable}` is {value}; its choices are numbered from 1 to {choices}")]
    NoSuchChoice {
        /// Full name of the variable.
        variable: String,
        /// The value that was refused.
        value: f64,
        /// How many choices there are.
        choices: usize,
    },
    /// A value that is no number, for a variable that takes any.
    #[error("`{variable}` is {value}; it must be a finite number")]
    NotFinite {
        /// Full name of the variable.
        variable: String,
        /// The value that was refused.
        value: f64,
    },
    /// A name that no variable carries.
    #[error("there is no parameter `{name}`; `sinew list variables` shows all")]
    UnknownParameter {
        /// The name that was asked for.
        name: String,
    },
    /// A value of the wrong kind for its variable.
    #[error("`{name}` takes {expected}, not `{found}`")]
    WrongKind {
        /// Full name of the variable.
        name: String,
        /// What the variable takes, in words.
        expected: String,
        /// What was given.
        found: String,
    },
    /// Neither a preset nor a file.
    #[error("there is no preset or parameter file `{name}`; presets are {known}")]
    UnknownPreset {
        /// What was asked for.
        name: String,
        /// The names of all presets.
        known: String,
    },
    /// A parameter file that is not TOML.
    #[error("{source_name}: line {line}: {problem}")]
    Toml {
        /// File or preset name.
        source_name: String,
        /// Line, from 1.
        line: usize,
        /// What the parser said.
        problem: String,
    },
    /// A parameter file with a value that cannot be used.
    #[error("{source_name}: {problem}")]
    ParameterFile {
        /// File or preset name.
        source_name: String,
        /// Which value, and why not.
        problem: Box<Error>,
    },
    /// The load does not hang still at this pressure for any length of the muscle.
    #[error(
        "no length of the muscle holds {mass} kg{} at {gauge_pressure} Pa: change `load.mass`, `load.external_force` or \
         `initial.gauge_pressure`",
        if *external_force == 0.0 { String::new() } else { format!(" and {external_force} N") }
    )]
    NoEquilibrium {
        /// Total hanging mass, kg.
        mass: f64,
        /// Force that pulls beyond its weight, N.
        external_force: f64,
        /// Gauge pressure at the start, Pa.
        gauge_pressure: f64,
    },
    /// A start outside the range in which the model means anything.
    #[error(
        "at the start `{variable}` is out of the range in which the model holds: \
         check the load, the lengths of the muscle and the first values of the inputs"
    )]
    Start {
        /// What is out of its range.
        variable: &'static str,
    },
    /// The simulation left the range in which the model means anything.
    #[error(
        "the simulation diverged by {time} s: `{variable}` left the range in which the model holds; \
         check the load and the units of the inputs"
    )]
    Diverged {
        /// Simulated time at which it was noticed, s.
        time: f64,
        /// The first state that left its range.
        variable: &'static str,
    },
    /// An integration that would keep its caller waiting.
    #[error("the simulation got no further than {time} s: the step is too long, or the parameters make it too stiff")]
    TooManySteps {
        /// Simulated time that was reached, s.
        time: f64,
    },
    /// Saved model state that this model cannot read.
    #[error("the saved state cannot be restored: {problem}")]
    SavedState {
        /// What does not fit.
        problem: &'static str,
    },
    /// A recording (CSV) that cannot be read.
    #[error("{}: line {line}{}: {problem}", path.display(), column.as_ref().map(|c| format!(", column `{c}`")).unwrap_or_default())]
    Csv {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Column name, where one is to blame.
        column: Option<String>,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A recording that lacks what the work needs.
    #[error("{}: {problem}", path.display())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What is missing and what to do.
        problem: String,
    },
    /// A recording that the model cannot follow.
    #[error("{}: {problem}", path.display())]
    Replay {
        /// The file.
        path: PathBuf,
        /// Where the simulation failed.
        problem: Box<Error>,
    },
    /// A diagnosis from which no experiment can be planned.
    #[error("{}: {problem}", path.display())]
    Diagnosis {
        /// The file.
        path: PathBuf,
        /// What does not fit and what to do.
        problem: String,
    },
    /// An experiment that cannot be planned.
    #[error("{problem}")]
    Plan {
        /// Why not and what to do.
        problem: String,
    },
    /// A controller that cannot be tuned.
    #[error("{problem}")]
    Tuning {
        /// Why not and what to do.
        problem: String,
    },
    /// A file that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A file that is given as an FMU library and is none.
    #[error("{}: no shared library for {platform}: give that which `cargo build --package sinew-fmu` makes there", path.display())]
    NoLibrary {
        /// The file.
        path: PathBuf,
        /// FMI's name of the platform.
        platform: &'static str,
    },
    /// A file that would take the place of one that it was made from.
    #[error("this would overwrite {}, which was read: choose another --out", path.display())]
    Overwrites {
        /// The file.
        path: PathBuf,
    },
    /// A platform that FMI does not know.
    #[error("`{argument}` is not PLATFORM=FILE with PLATFORM one of linux64, linux32, win64, win32, darwin64")]
    Platform {
        /// What was given.
        argument: String,
    },
}

/// A text on one line that does nothing to a terminal: control characters are written out, a line break as `\n`.
pub fn printable(text: &str) -> String {
    text.chars().fold(String::new(), |mut line, c| {
        if c.is_control() {
            line.extend(c.escape_debug())
        } else {
            line.push(c)
        }
        line
    })
}

/// A unit as it stands behind a number.
fn spaced(unit: &str) -> String {
    if unit == "1" { String::new() } else { format!(" {unit}") }
}

/// `Result` with Sinew's [`enum@Error`].
pub type Result<T> = std::result::Result<T, Error>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_written_out() {
        assert_eq!(printable("a\nb\0\u{1b}[2J 'é\"\\"), "a\\nb\\0\\u{1b}[2J 'é\"\\");
    }
}
