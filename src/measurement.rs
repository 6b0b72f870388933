//! Recordings: columns of a CSV file in SI units.

use crate::start::Motion;
use crate::{Error, Result, input, printable};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What a column of a recording means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Signal {
    Time,
    Command,
    GaugePressure,
    Contraction,
    Force,
    LoadMass,
    SupplyPressure,
    Diameter,
    Temperature,
}

use Signal::{Command, Contraction, Diameter, Force, GaugePressure, LoadMass, SupplyPressure, Temperature, Time};

/// Symbols of units with their size in SI; the first is SI.
pub type Units = &'static [(&'static str, f64)];

const PRESSURE: Units =
    &[("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("mbar", 1e2), ("bar", 1e5), ("psi", 6_894.757_293_168)];
const LENGTH: Units = &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)];

/// Columns that are understood: name, meaning, and units.
const COLUMNS: &[(&str, Signal, Units)] = &[
    ("time", Time, &[("s", 1.0), ("ms", 1e-3)]),
    ("command", Command, &[("V", 1.0), ("mV", 1e-3)]),
    ("gauge_pressure", GaugePressure, PRESSURE),
    ("contraction", Contraction, LENGTH),
    ("force", Force, &[("N", 1.0), ("kN", 1e3)]),
    ("load_mass", LoadMass, &[("kg", 1.0)]),
    ("supply_pressure", SupplyPressure, PRESSURE),
    ("diameter", Diameter, LENGTH),
    ("temperature", Temperature, &[("K", 1.0), ("degC", 1.0)]),
];

impl Signal {
    /// Name of the column.
    pub fn name(self) -> &'static str {
        COLUMNS.iter().find(|(_, signal, _)| *signal == self).map_or("", |(name, ..)| name)
    }

    /// Unit in SI.
    pub fn unit(self) -> &'static str {
        self.units().first().map_or("", |(symbol, _)| symbol)
    }

    /// Units that a file may use.
    pub fn units(self) -> Units {
        COLUMNS.iter().find(|(_, signal, _)| *signal == self).map_or(&[], |(.., units)| units)
    }
}

/// How a command goes between its samples, which no column tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// Along straight lines, as where a logger runs by itself: what comes closest to any smooth course.
    Lines,
    /// Along straight lines, but it jumps at the very sample that shows a jump, as where one program sets and logs it.
    Jumps,
    /// It is held until the next sample, as by a digital controller that logs what it sets.
    Held,
}

/// What was measured in one experiment.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Where it was read from.
    pub path: PathBuf,
    /// What people call it, without control characters.
    name: String,
    /// Its number among those that were read together, from 1; `None` where it was read alone.
    number: Option<usize>,
    /// Time in s, strictly increasing, shape `(n_samples,)`.
    pub time: Vec<f64>,
    /// Line of the file that each sample stands in, shape `(n_samples,)`; empty where there is no file.
    lines: Vec<u64>,
    /// The other signals in SI units, each of shape `(n_samples,)`; NaN where a sample is missing.
    signals: BTreeMap<Signal, Vec<f64>>,
    /// Unit that the file names for each column.
    units: BTreeMap<Signal, &'static str>,
    /// How many samples of the file there were to each of these, see [`Self::thinned`].
    every: usize,
    /// How the command goes between its samples.
    between: Between,
    /// How the load moves at the start; `None` where it may rest.
    motion: Option<Motion>,
    /// What a person should know about how the file was read.
    pub notes: Vec<String>,
}

/// Fewest samples that are worth looking at.
const FEWEST_SAMPLES: usize = 10;
/// Share of its span that a far jump of the command takes.
const FAR: f64 = 0.01;
/// Samples that thinning leaves at least.
const THINNED_SAMPLES: usize = 1000;

impl Recording {
    /// Reads a CSV file. `renamed` holds pairs of a header as the file has it and the name it stands for here.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Csv`] with line and column for what cannot be understood; [`Error::Recording`] where
    /// signals are missing that every use needs.
    pub fn read(path: &Path, renamed: &[(String, String)]) -> Result<Self> {
        Self::parse(&input::read(path)?, path, renamed)
    }

    /// As [`Recording::read`], of a text at hand; `path` is what messages call it.
    ///
    /// # Errors
    /// As [`Recording::read`].
    pub fn parse(text: &[u8], path: &Path, renamed: &[(String, String)]) -> Result<Self> {
        if text.trim_ascii().is_empty() {
            return Err(Error::Recording { path: path.to_owned(), problem: "the file is empty".to_owned() });
        }
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
        let headers = reader.headers().map_err(|error| csv_error(path, &error))?.clone();
        check_headers(path, &headers, renamed)?;
        let columns =
            headers.iter().map(|header| understand(header, path, renamed)).collect::<Result<Vec<Option<Column>>>>()?;
        let unused: Vec<&str> =
            headers.iter().zip(&columns).filter(|(_, column)| column.is_none()).map(|(header, _)| header).collect();
        let notes = match unused[..] {
            [] => Vec::new(),
            [header] => vec![format!("column `{header}` is not used")],
            _ => vec![format!("columns {} are not used", listed(&unused))],
        };
        let mut signals: BTreeMap<Signal, Vec<f64>> = BTreeMap::new();
        for column in columns.iter().flatten() {
            if signals.insert(column.signal, Vec::new()).is_some() {
                let problem = "there are two such columns: rename or remove one".to_owned();
                return Err(column.error(path, 1, problem));
            }
        }
        if !signals.contains_key(&Time) {
            let all: Vec<&str> = headers.iter().collect();
            let example = unused.iter().find(|header| !header.is_empty()).unwrap_or(&"clock");
            let problem = format!(
                "there is no column `time [s]` among {}: rename one, or say which it is, as in --map \"{example}=time [s]\"",
                listed(&all)
            );
            return Err(Error::Csv { path: path.to_owned(), line: 1, column: None, problem });
        }
        let mut lines = Vec::new();
        for row in reader.records() {
            let row = row.map_err(|error| csv_error(path, &error))?;
            let line = row.position().map_or(0, csv::Position::line);
            lines.push(line);
            for (cell, column) in row.iter().zip(&columns) {
                if let Some(column) = column {
                    let value = column.value(cell, path, line)?;
                    signals.entry(column.signal).or_default().push(value);
                }
            }
            check_time(path, line, signals.get(&Time))?;
        }
        check_mass(path, &lines, signals.get(&LoadMass))?;
        let name = printable(&path.file_name().unwrap_or(path.as_os_str()).to_string_lossy());
        let time = signals.remove(&Time).unwrap_or_default();
        let units = columns.iter().flatten().map(|column| (column.signal, column.unit)).collect();
        Self {
            path: path.to_owned(),
            name,
            number: None,
            time,
            lines,
            signals,
            units,
            notes,
            every: 1,
            between: Between::Lines,
            motion: None,
        }
        .checked()
    }

    /// An experiment that is yet to be made: its inputs in SI units, each of shape `(n_samples,)`.
    pub(crate) fn planned(name: &str, time: Vec<f64>, inputs: BTreeMap<Signal, Vec<f64>>) -> Self {
        let (path, name) = (PathBuf::from(name), name.to_owned());
        let (lines, units, notes) = (Vec::new(), BTreeMap::new(), Vec::new());
        let (between, motion) = (Between::Lines, None);
        Self { path, name, number: None, time, lines, signals: inputs, units, notes, every: 1, between, motion }
    }

    /// Refuses what no use could be made of, and drops rows without a new time.
    fn checked(mut self) -> Result<Self> {
        let fresh: Vec<bool> = (0..self.time.len()).map(|k| k == 0 || self.time[k] > self.time[k - 1]).collect();
        let repeated = fresh.iter().filter(|fresh| !**fresh).count();
        if repeated > 0 {
            self.notes.push(format!("{repeated} rows repeat the time of the row before and were left out"));
            for values in self.signals.values_mut().chain([&mut self.time]) {
                let mut keep = fresh.iter();
                values.retain(|_| *keep.next().unwrap_or(&true));
            }
            let mut keep = fresh.iter();
            self.lines.retain(|_| *keep.next().unwrap_or(&true));
        }
        let problem = |problem: String| Error::Recording { path: self.path.clone(), problem };
        if self.time.len() < FEWEST_SAMPLES && repeated > 0 {
            let left = self.time.len();
            return Err(problem(format!(
                "{repeated} rows repeat the time of the row before, which leaves {left}: write the time with more digits"
            )));
        }
        if self.time.len() < FEWEST_SAMPLES {
            let text = "fewer than 10 samples: record longer, or check the separator (a comma is needed)";
            return Err(problem(text.to_owned()));
        }
        if self.signals.contains_key(&LoadMass) && self.load_mass().is_none() {
            return Err(problem("column `load_mass` is empty".to_owned()));
        }
        let missing = |signal: Signal| self.get(signal).is_none_or(|values| values.iter().all(|v| v.is_nan()));
        // What is needed, and the columns that would do.
        let complaint: Option<(&str, &[Signal])> = if self.load_mass().is_some() {
            if missing(Command) {
                Some(("a hanging load (`load_mass`) needs the column `command [V]`", &[Command]))
            } else if missing(GaugePressure) && missing(Contraction) && missing(Force) {
                let text =
                    "none of `gauge_pressure`, `contraction`, `force` was measured: there is nothing to compare with";
                Some((text, &[GaugePressure, Contraction, Force]))
            } else {
                None
            }
        } else if missing(Contraction) {
            let text = "without `load_mass` the motion is prescribed and the column `contraction [m]` is needed";
            Some((text, &[Contraction]))
        } else if missing(Command) && missing(GaugePressure) {
            let text = "without `load_mass` either `command [V]` or `gauge_pressure [Pa]` is needed";
            Some((text, &[Command, GaugePressure]))
        } else {
            None
        };
        if let Some((text, would_do)) = complaint {
            let empty = would_do.iter().find(|signal| self.get(**signal).is_some());
            let empty = empty.map_or(String::new(), |signal| format!("column `{}` is empty: ", signal.name()));
            return Err(problem(format!("{empty}{text}")));
        }
        let contraction = self.bridged(Contraction).filter(|_| self.load_mass().is_some());
        self.motion = contraction.and_then(|contraction| Motion::shown_by(&self.time, &contraction));
        if let Some(Motion { contraction, velocity, .. }) = self.motion {
            let [place, rate] = [contraction, velocity].map(|of| 1e3 * of);
            self.notes
                .push(format!("the load moves at the start: simulations begin at {place:.1} mm with {rate:.0} mm/s"));
        }
        Ok(self)
    }

    /// A signal in SI units, NaN where a sample is missing; `None` where there is no such column.
    pub fn get(&self, signal: Signal) -> Option<&[f64]> {
        self.signals.get(&signal).map(Vec::as_slice)
    }

    /// Line of the file that a sample stands in, from 1; 0 where there is no file.
    pub fn line(&self, sample: usize) -> u64 {
        self.lines.get(sample).copied().unwrap_or(0)
    }

    /// Unit that the file names for a signal; `None` where there is no such column.
    pub fn unit_in_file(&self, signal: Signal) -> Option<&'static str> {
        self.units.get(&signal).copied()
    }

    /// Samples at which a signal is known.
    fn known(&self, signal: Signal) -> Vec<usize> {
        let values = self.get(signal).unwrap_or_default();
        (0..values.len()).filter(|&k| !values[k].is_nan()).collect()
    }

    /// A signal with its gaps bridged by straight lines, for use as an input.
    pub fn bridged(&self, signal: Signal) -> Option<Vec<f64>> {
        let values = self.get(signal)?;
        let known = self.known(signal);
        let (first, last) = (*known.first()?, *known.last()?);
        let mut bridged = values.to_vec();
        bridged[..first].fill(values[first]);
        bridged[last..].fill(values[last]);
        for pair in known.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            for (time, value) in self.time[a..b].iter().zip(&mut bridged[a..b]) {
                let share = (time - self.time[a]) / (self.time[b] - self.time[a]);
                *value = values[a] + share * (values[b] - values[a]);
            }
        }
        Some(bridged)
    }

    /// Hanging load in kg; `None` where the motion is prescribed.
    pub fn load_mass(&self) -> Option<f64> {
        self.get(LoadMass)?.iter().copied().find(|mass| !mass.is_nan())
    }

    /// Time from the first sample to the last, s.
    pub fn duration(&self) -> f64 {
        self.time[self.time.len() - 1] - self.time[0]
    }

    /// Times of the samples since the first one, s.
    pub fn since_start(&self) -> Vec<f64> {
        self.time.iter().map(|now| now - self.time[0]).collect()
    }

    /// Usual time between samples, s.
    pub fn period(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// The recording with about one sample per `period` in s, as far as there are as many and at least a thousand remain.
    /// Samples are left out; the command is a weighted mean, its weight falling to zero at the next sample that stays, so that
    /// a step between two of them keeps its time; of a command that is held, the mean until then. Where it jumps far at a sample, that one
    /// stays, and no mean reaches over the jump. So do samples of a signal that is logged in rows of its own.
    pub fn thinned(&self, period: f64) -> Self {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let every = ((period / self.period()).round() as usize).min(self.time.len() / THINNED_SAMPLES).max(1);
        let command = self.bridged(Command).filter(|_| self.between != Between::Lines);
        let jumps = command.map(|command| self.far_jumps(&command)).unwrap_or_default();
        let alone = self.alone(every);
        let stays = |k: &usize| k.is_multiple_of(every) || jumps.contains(k) || alone.contains(k);
        let kept: Vec<usize> = (0..self.time.len()).filter(stays).collect();
        let picked = |values: &[f64]| kept.iter().map(|k| values[*k]).collect();
        let weights = |position: usize| -> Vec<(usize, f64)> {
            let centre = kept[position];
            if self.between == Between::Held {
                let next = kept.get(position + 1).copied().unwrap_or(self.time.len());
                return (centre..next).map(|k| (k, 1.0)).collect();
            }
            let near = centre.saturating_sub(every - 1)..(centre + every).min(self.time.len());
            match jumps.range(near.clone()).next() {
                Some(_) => vec![(centre, 1.0)],
                None => near.map(|k| (k, (every - k.abs_diff(centre)) as f64)).collect(),
            }
        };
        let mean = |values: &[f64], position: usize| {
            let present = weights(position).into_iter().filter(|(k, _)| !values[*k].is_nan());
            let (weights, sum) =
                present.fold((0.0, 0.0), |(w, sum), (k, weight)| (w + weight, sum + weight * values[k]));
            sum / weights
        };
        let thinned = |(signal, values): (&Signal, &Vec<f64>)| {
            let is_command = *signal == Command;
            let means = || (0..kept.len()).map(|position| mean(values, position)).collect();
            (*signal, if is_command { means() } else { picked(values) })
        };
        Self {
            time: picked(&self.time),
            lines: kept.iter().map(|k| self.line(*k)).collect(),
            signals: self.signals.iter().map(thinned).collect(),
            every: self.every * every,
            ..self.clone()
        }
    }

    /// Of every so many samples the first ones that show a signal which the first of them mostly does not: one that is logged in rows of its own.
    fn alone(&self, every: usize) -> BTreeSet<usize> {
        let cells = || (0..self.time.len()).step_by(every).map(|first| first..self.time.len().min(first + every));
        let of_signal = |values: &Vec<f64>| {
            let shown: Vec<usize> = cells().filter_map(|mut cell| cell.find(|k| !values[*k].is_nan())).collect();
            let late = |k: &usize| !k.is_multiple_of(every);
            let is_mostly_late = 2 * shown.iter().filter(|k| late(k)).count() > shown.len();
            shown.into_iter().filter(move |k| is_mostly_late && late(k)).collect::<Vec<_>>()
        };
        self.signals.values().flat_map(of_signal).collect()
    }

    /// The recording with an instant more in the middle between any two samples, where all signals are on straight lines, but for what changes at
    /// the samples themselves.
    pub(crate) fn straight(&self) -> Self {
        let changes = self.own_changes();
        self.with_middles(|signal, values, k| match signal {
            Command if changes.contains(&(k + 1)) => values[k],
            _ => 0.5 * (values[k] + values[k + 1]),
        })
    }

    /// The recording with an instant more in the middle between any two samples, where each signal is on the cubic through the
    /// two samples before and after, its gaps bridged.
    pub fn doubled(&self) -> Self {
        let changes = self.own_changes();
        self.with_middles(|signal, values, k| match signal {
            Command if changes.contains(&(k + 1)) => values[k],
            Command if [k, k + 2].iter().any(|end| changes.contains(end)) => 0.5 * (values[k] + values[k + 1]),
            _ => self.halfway(values, k),
        })
    }

    /// The same along straight lines, but for jumps of the command: these are over in the middle between their samples, or else
    /// begin there; where samples were left out, they are that much less off. What changes at samples is not in doubt.
    pub fn with_jumps(&self, early: bool) -> Self {
        let jumps = self.bridged(Command).map(|command| self.jumps(&command)).unwrap_or_default();
        let changes = self.own_changes();
        self.with_middles(|signal, values, k| {
            let line = 0.5 * (values[k] + values[k + 1]);
            match signal {
                Command if changes.contains(&(k + 1)) => values[k],
                Command if jumps.contains(&(k + 1)) => {
                    line + (values[if early { k + 1 } else { k }] - line) / self.every as f64
                }
                _ => line,
            }
        })
    }

    /// Pairs of samples of a signal between which it is not known for longer than some time in s.
    pub(crate) fn gaps(&self, signal: Signal, longest: f64) -> Vec<(usize, usize)> {
        let known = self.known(signal);
        let pairs = known.windows(2).map(|pair| (pair[0], pair[1]));
        pairs.filter(|(from, to)| self.time[*to] - self.time[*from] > longest).collect()
    }

    /// The recording with an instant more in the middle between any two samples, its signals off the straight lines through their gaps longer
    /// than some time in s: in the middle by the most that they are off the same line within as long before and after. `None` where they are on these lines.
    pub(crate) fn bent_in_gaps(&self, longest: f64) -> Option<Self> {
        let bends_of = |signal: &Signal| {
            let bend = |(from, to)| (*signal, from, to, self.off_line(*signal, from, to));
            self.gaps(*signal, longest).into_iter().map(bend).collect::<Vec<_>>()
        };
        let bends: Vec<_> = self.signals.keys().flat_map(bends_of).filter(|(.., off)| *off != 0.0).collect();
        if bends.is_empty() {
            return None;
        }
        let mut bent = self.with_middles(|_, values, k| 0.5 * (values[k] + values[k + 1]));
        for (signal, from, to, off) in bends {
            let (middle, half) = (0.5 * (self.time[to] + self.time[from]), 0.5 * (self.time[to] - self.time[from]));
            let values = bent.signals.get_mut(&signal).into_iter().flatten();
            for (time, value) in bent.time.iter().zip(values) {
                *value += off * (1.0 - (time - middle).abs() / half).max(0.0);
            }
        }
        Some(bent)
    }

    /// The most that a signal is off the straight line through two of its samples, within as long before and after as they are apart.
    fn off_line(&self, signal: Signal, from: usize, to: usize) -> f64 {
        let values = self.get(signal).unwrap_or_default();
        let length = self.time[to] - self.time[from];
        let off = |k: usize| {
            values[k] - values[from] - (self.time[k] - self.time[from]) / length * (values[to] - values[from])
        };
        let around = self.time[from] - length..=self.time[to] + length;
        let near = self.known(signal).into_iter().filter(|k| around.contains(&self.time[*k]));
        near.map(off).fold(0.0, |most: f64, off| if off.abs() > most.abs() { off } else { most })
    }

    /// The recording of a command that went so between its samples; until this is said, along straight lines.
    pub fn going(&self, between: Between) -> Self {
        Self { between, ..self.clone() }
    }

    /// How its command goes between its samples.
    pub fn between(&self) -> Between {
        self.between
    }

    /// The bridged command as it comes to each sample: on straight lines from the sample before, but for what changes at the sample itself.
    pub fn arriving(&self, command: &[f64]) -> Vec<f64> {
        let mut arriving = command.to_vec();
        self.changing(command).into_iter().for_each(|k| arriving[k] = command[k - 1]);
        arriving
    }

    /// Samples at which the bridged command changes, and not before.
    fn changing(&self, command: &[f64]) -> BTreeSet<usize> {
        match self.between {
            Between::Lines => BTreeSet::new(),
            Between::Jumps => self.jumps(command),
            Between::Held => (1..command.len()).collect(),
        }
    }

    /// The same of its own command.
    fn own_changes(&self) -> BTreeSet<usize> {
        self.bridged(Command).map(|command| self.changing(&command)).unwrap_or_default()
    }

    /// Samples at which the bridged command jumps by more than a hundredth of its span.
    fn far_jumps(&self, command: &[f64]) -> BTreeSet<usize> {
        let [least, most] = [f64::min, f64::max].map(|of| command.iter().copied().fold(command[0], of));
        let is_far = |k: &usize| (command[*k] - command[k - 1]).abs() > FAR * (most - least);
        self.jumps(command).into_iter().filter(is_far).collect()
    }

    /// Whether it makes a difference that the command goes so and in no simpler way: it jumps by more than a hundredth of its span, or changes
    /// without jumps.
    pub fn can_go(&self, between: Between) -> bool {
        let Some(command) = self.bridged(Command) else { return false };
        match between {
            Between::Lines => true,
            Between::Jumps => !self.far_jumps(&command).is_empty(),
            Between::Held => {
                let jumps = self.jumps(&command);
                (1..command.len()).any(|k| command[k] != command[k - 1] && !jumps.contains(&k))
            }
        }
    }

    /// Samples that show a jump of the bridged command: after more than twice as fast a change as goes before and comes after.
    fn jumps(&self, command: &[f64]) -> BTreeSet<usize> {
        let rate = |k: usize| (command[k] - command[k - 1]).abs() / (self.time[k] - self.time[k - 1]);
        let jumps = |k: &usize| {
            let before = if *k > 1 { rate(k - 1) } else { 0.0 };
            let after = if k + 1 < command.len() { rate(k + 1) } else { 0.0 };
            rate(*k) > 2.0 * before.max(after)
        };
        (1..command.len()).filter(jumps).collect()
    }

    /// The recording with something added to all readings of a signal, in its SI unit.
    pub fn shifted(&self, signal: Signal, by: f64) -> Self {
        let mut shifted = self.clone();
        shifted.signals.get_mut(&signal).into_iter().flatten().for_each(|value| *value += by);
        shifted
    }

    /// How its load moves at the start; `None` where it may rest, or that is not known.
    pub(crate) fn motion(&self) -> Option<Motion> {
        self.motion
    }

    /// The recording of a load that moves at the start by as many deviations more, of its contraction and of the rate of it.
    pub(crate) fn moving_by(&self, [place, rate]: [f64; 2]) -> Self {
        let more = |motion: Motion| Motion {
            contraction: motion.contraction + place * motion.deviations[0],
            velocity: motion.velocity + rate * motion.deviations[1],
            ..motion
        };
        Self { motion: self.motion.map(more), ..self.clone() }
    }

    /// The recording with an instant more in the middle between any two samples; what a signal is there is told by its values, their
    /// gaps bridged, and the position of the first of both.
    fn with_middles(&self, middle: impl Fn(Signal, &[f64], usize) -> f64) -> Self {
        let doubled = |values: &[f64], middle: &dyn Fn(&[f64], usize) -> f64| -> Vec<f64> {
            (0..values.len())
                .flat_map(|k| [Some(values[k]), (k + 1 < values.len()).then(|| middle(values, k))])
                .flatten()
                .collect()
        };
        let signals = self.signals.keys().filter_map(|signal| {
            Some((*signal, doubled(&self.bridged(*signal)?, &|values, k| middle(*signal, values, k))))
        });
        let time = doubled(&self.time, &|time, k| 0.5 * (time[k] + time[k + 1]));
        Self { time, lines: Vec::new(), signals: signals.collect(), ..self.clone() }
    }

    /// Value of the cubic through four neighbours in the middle between the second, `sample`, and the third; of the straight
    /// line at the ends.
    fn halfway(&self, values: &[f64], sample: usize) -> f64 {
        let around = if sample > 0 && sample + 2 < values.len() { sample - 1..sample + 3 } else { sample..sample + 2 };
        let time = &self.time[around.clone()];
        let now = 0.5 * (self.time[sample] + self.time[sample + 1]);
        let share = |k: usize| {
            let others = time.iter().enumerate().filter(|(other, _)| *other != k);
            others.map(|(_, other)| (now - other) / (time[k] - other)).product::<f64>()
        };
        values[around].iter().enumerate().map(|(k, value)| share(k) * value).sum()
    }

    /// Its number among those that were read together, from 1; `None` where it was read alone.
    pub fn number(&self) -> Option<usize> {
        self.number
    }

    /// File name for people, with its folder only where another recording has the same.
    pub fn name(&self) -> String {
        self.name.clone()
    }
}

/// Reads several recordings, numbers them, and sees to it that their names differ.
///
/// # Errors
/// As [`Recording::read`]; [`Error::Recording`] for a file that is given twice.
pub fn read_all(paths: &[PathBuf], renamed: &[(String, String)]) -> Result<Vec<Recording>> {
    // However it is spelt, a file is the same; what is not there is named when it is read.
    let files: Vec<PathBuf> = paths.iter().map(|path| path.canonicalize().unwrap_or_else(|_| path.clone())).collect();
    if let Some(index) = (1..files.len()).find(|index| files[..*index].contains(&files[*index])) {
        let problem = "is given twice: a copy proves nothing about the original".to_owned();
        return Err(Error::Recording { path: paths[index].clone(), problem });
    }
    let mut recordings = paths.iter().map(|path| Recording::read(path, renamed)).collect::<Result<Vec<_>>>()?;
    let names: Vec<String> = recordings.iter().map(Recording::name).collect();
    for recording in &mut recordings {
        if names.iter().filter(|name| **name == recording.name).count() > 1 {
            recording.name = printable(&recording.path.display().to_string());
        }
    }
    Ok(numbered(recordings))
}

/// Recordings that are used together, with their numbers, where they are several.
pub fn numbered(mut recordings: Vec<Recording>) -> Vec<Recording> {
    let several = recordings.len() > 1;
    for (index, recording) in recordings.iter_mut().enumerate() {
        recording.number = several.then_some(index + 1);
    }
    recordings
}

/// A column that is understood.
struct Column {
    header: String,
    signal: Signal,
    unit: &'static str,
    scale: f64,
    offset: f64,
}

impl Column {
    fn error(&self, path: &Path, line: u64, problem: String) -> Error {
        Error::Csv { path: path.to_owned(), line, column: Some(self.header.clone()), problem }
    }

    /// The value of a cell in SI; NaN where it is empty.
    fn value(&self, cell: &str, path: &Path, line: u64) -> Result<f64> {
        if cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
            return Ok(f64::NAN);
        }
        match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => {
                let value = number * self.scale + self.offset;
                let problem = || format!("{cell} {} is more than a computer can count: correct it", self.unit);
                value.is_finite().then_some(value).ok_or_else(|| self.error(path, line, problem()))
            }
            _ => {
                Err(self.error(path, line, format!("`{cell}` is not a number; leave the cell empty if it is missing")))
            }
        }
    }
}

/// Headers in a message: the first ten, and how many more there are.
fn listed(headers: &[&str]) -> String {
    const SHOWN: usize = 10;
    let quoted: Vec<String> = headers.iter().take(SHOWN).map(|header| format!("`{header}`")).collect();
    let more = headers.len().saturating_sub(SHOWN);
    quoted.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

/// What a header means; `None` for a column that is of no use here.
fn understand(header: &str, path: &Path, renamed: &[(String, String)]) -> Result<Option<Column>> {
    let header = header.trim_start_matches('\u{feff}');
    let ours = renamed.iter().find(|(theirs, _)| theirs == header).map_or(header, |(_, ours)| ours);
    let (name, unit) = match ours.split_once('[') {
        Some((name, rest)) => (name.trim(), Some(rest.trim_end().trim_end_matches(']').trim())),
        None => (ours.trim(), None),
    };
    let fail = |problem| Error::Csv { path: path.to_owned(), line: 1, column: Some(header.to_owned()), problem };
    let Some((_, signal, units)) = COLUMNS.iter().find(|(known, ..)| *known == name) else {
        if ours != header {
            let known: Vec<&str> = COLUMNS.iter().map(|(known, ..)| *known).collect();
            return Err(fail(format!(
                "--map gives it the name `{name}`, which no column has; use one of {}",
                known.join(", ")
            )));
        }
        return Ok(None);
    };
    let known = units.iter().map(|(symbol, _)| *symbol).collect::<Vec<_>>().join(", ");
    let unit = unit.ok_or_else(|| fail(format!("the header has no unit: write `{name} [{}]`", units[0].0)))?;
    let found = units.iter().find(|(symbol, _)| *symbol == unit);
    let (unit, scale) = *found.ok_or_else(|| fail(format!("unit `{unit}` is unknown: use one of {known}")))?;
    let offset = if unit == "degC" { 273.15 } else { 0.0 };
    Ok(Some(Column { header: header.to_owned(), signal: *signal, unit, scale, offset }))
}

/// Refuses a wrong separator and renamings of columns that are not there.
fn check_headers(path: &Path, headers: &csv::StringRecord, renamed: &[(String, String)]) -> Result<()> {
    let fail = |problem| Err(Error::Csv { path: path.to_owned(), line: 1, column: None, problem });
    let only = headers.get(0).filter(|_| headers.len() == 1).unwrap_or_default();
    if let Some(separator) = [";", "\t"].into_iter().find(|separator| only.contains(separator)) {
        return fail(format!("the columns are separated by {separator:?}: a comma is needed"));
    }
    let known = |theirs: &String| headers.iter().any(|header| header.trim_start_matches('\u{feff}') == theirs);
    match renamed.iter().find(|(theirs, _)| !known(theirs)) {
        Some((theirs, _)) => fail(format!(
            "there is no column `{theirs}`, which --map names; there are {}",
            listed(&headers.iter().collect::<Vec<_>>())
        )),
        None => Ok(()),
    }
}

fn check_time(path: &Path, line: u64, time: Option<&Vec<f64>>) -> Result<()> {
    let fail =
        |problem: String| Err(Error::Csv { path: path.to_owned(), line, column: Some("time".to_owned()), problem });
    match time.map(Vec::as_slice) {
        Some([.., last]) if last.is_nan() => fail("the time is missing: remove the row".to_owned()),
        Some([.., before, last]) if last < before => {
            fail(format!("time runs backwards, from {before} s to {last} s: sort the rows or split the file"))
        }
        _ => Ok(()),
    }
}

fn check_mass(path: &Path, lines: &[u64], masses: Option<&Vec<f64>>) -> Result<()> {
    let known = || lines.iter().zip(masses.into_iter().flatten()).filter(|(_, mass)| !mass.is_nan());
    let Some((_, first)) = known().next() else { return Ok(()) };
    let problem = |mass: f64| match mass {
        _ if mass <= 0.0 => Some(format!("{mass} kg; a hanging load is heavier than nothing")),
        _ if mass != *first => {
            Some(format!("the load changes from {first} kg to {mass} kg: split the file into one recording per load"))
        }
        _ => None,
    };
    let refused = known().find_map(|(line, mass)| Some((*line, problem(*mass)?)));
    refused.map_or(Ok(()), |(line, problem)| {
        Err(Error::Csv { path: path.to_owned(), line, column: Some("load_mass".to_owned()), problem })
    })
}

fn csv_error(path: &Path, error: &csv::Error) -> Error {
    let line = error.position().map_or(1, csv::Position::line);
    let problem = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} cells where the header has {expected_len}: the file is cut off or a separator is missing")
        }
        csv::ErrorKind::Utf8 { .. } => "not UTF-8 text: save the file as UTF-8".to_owned(),
        _ => "not a CSV file".to_owned(),
    };
    Error::Csv { path: path.to_owned(), line, column: None, problem }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(header: &str, row: impl Fn(usize) -> String) -> String {
        (0..12).fold(format!("{header}\n"), |text, k| text + &row(k) + "\n")
    }

    fn parse(text: &str) -> Result<Recording> {
        Recording::parse(text.as_bytes(), Path::new("r.csv"), &[])
    }

    const HEADER: &str = "time [ms],command [mV],gauge_pressure [bar],contraction [mm],load_mass [kg],remark";

    #[test]
    fn doubling_follows_a_cubic() {
        let cubic = |t: f64| 1.0 + t * (0.2 + t * (-0.03 + t * 0.004));
        let time = |k: usize| k as f64 + 0.2 * (k % 3) as f64;
        let text = rows("time [s],command [V],contraction [mm]", |k| {
            format!("{},{:.12},{}", time(k), cubic(time(k)), if k == 5 { String::new() } else { "7".to_owned() })
        });
        let doubled = parse(&text).unwrap().doubled();
        assert_eq!(doubled.time.len(), 23);
        assert!(doubled.get(Contraction).unwrap().iter().all(|x| (x - 7e-3).abs() < 1e-15));
        let command = doubled.get(Command).unwrap();
        let off = command.iter().zip(&doubled.time).map(|(u, t)| (u - cubic(*t)).abs());
        assert!(off.skip(2).take(19).all(|off| off < 1e-10), "{command:?}");
        assert_eq!(command[1], 0.5 * (command[0] + command[2]));
    }

    #[test]
    fn inputs_bend_in_gaps_as_they_do_around() {
        // 1 s a sample; from 5 s on 4 s are lost. Through the ends of that a line of 0.5 V/s, from which the command before is 2 V off at most.
        let time = |k: usize| if k > 5 { k + 3 } else { k } as f64;
        let command = |k: usize| if k > 5 { 5.0 + 0.5 * (time(k) - 9.0) } else { 3.0 };
        let text = rows("time [s],command [V],contraction [mm]", |k| format!("{},{},{k}", time(k), command(k)));
        let recording = parse(&text).unwrap();
        assert_eq!(recording.gaps(Command, 3.0), [(5, 6)]);
        let bent = recording.bent_in_gaps(3.0).unwrap();
        assert_eq!(bent.get(Command).unwrap()[9..14], [3.0, 3.0, 4.0 + 2.0, 5.0, 5.25]);
        assert!(recording.bent_in_gaps(5.0).is_none(), "there is no gap as long");
        let plateau = rows("time [s],command [V],contraction [mm]", |k| format!("{},3,7", time(k)));
        assert!(
            parse(&plateau).unwrap().bent_in_gaps(3.0).is_none(),
            "a command that rests on either side rests between"
        );
    }

    /// What the command is in the middle between its samples if jumps are early, and if they are late.
    fn middles(command: impl Fn(usize) -> f64, time: impl Fn(usize) -> f64) -> [Vec<f64>; 2] {
        let text = rows("time [s],command [V],contraction [mm]", |k| format!("{},{},{k}", time(k), command(k)));
        let recording = parse(&text).unwrap();
        [true, false]
            .map(|early| recording.with_jumps(early).get(Command).unwrap().iter().skip(1).step_by(2).copied().collect())
    }

    #[test]
    fn only_jumps_have_a_doubtful_instant() {
        let even = |k: usize| k as f64;
        for jump in [0, 4, 10] {
            let [early, late] = middles(|k| if k > jump { 3.0 } else { 1.0 }, even);
            assert_eq!([early[jump], late[jump]], [3.0, 1.0]);
            let others = |middles: &[f64]| {
                middles.iter().enumerate().filter(|(k, _)| *k != jump).map(|(_, u)| *u).collect::<Vec<_>>()
            };
            assert_eq!(others(&early), others(&late));
        }
        let [early, late] = middles(even, even);
        assert_eq!(early, late);
        // Rows that are missing make a ramp no jump.
        let gap = |k: usize| if k > 5 { k + 7 } else { k } as f64;
        let [early, late] = middles(gap, gap);
        assert_eq!(early, late);
    }

    #[test]
    fn a_late_jump_comes_at_the_sample_that_shows_it() {
        let text = rows("time [s],command [V],contraction [mm]", |k| {
            format!("{k},{},{k}", if k < 5 { 1.0 } else { 3.0 + 0.1 * k as f64 })
        });
        let late = parse(&text).unwrap().going(Between::Jumps);
        let (command, arriving) = (late.bridged(Command).unwrap(), late.arriving(late.get(Command).unwrap()));
        let differ: Vec<usize> = (0..12).filter(|&k| command[k] != arriving[k]).collect();
        assert_eq!((differ, arriving[5]), (vec![5], 1.0));
        for between in [late.doubled(), late.with_jumps(true), late.with_jumps(false)] {
            assert_eq!(between.get(Command).unwrap()[9], 1.0);
            assert_eq!(between.own_changes().into_iter().collect::<Vec<_>>(), [10]);
        }
    }

    #[test]
    fn thinning_keeps_the_sample_of_a_late_jump() {
        let time: Vec<f64> = (0..4000).map(|k| 1e-3 * f64::from(k)).collect();
        let command = time.iter().map(|t| if *t < 1.9985 { 1.0 } else { 3.0 }).collect();
        let recording = Recording::planned("r", time, BTreeMap::from([(Command, command)])).going(Between::Jumps);
        let thinned = recording.thinned(4e-3);
        let jumps = thinned.own_changes();
        assert_eq!(jumps.iter().map(|k| thinned.time[*k]).collect::<Vec<_>>(), [1.999]);
        assert!(thinned.get(Command).unwrap().iter().all(|command| [1.0, 3.0].contains(command)));
        assert_eq!(thinned.time.len(), 1001);
    }

    #[test]
    fn thinning_keeps_the_area_under_a_held_command() {
        let time: Vec<f64> = (0..4000).map(|k| 1e-3 * f64::from(k)).collect();
        let command = time.iter().map(|t| if *t < 1.9985 { *t } else { 5.0 }).collect();
        let held = Recording::planned("r", time, BTreeMap::from([(Command, command)])).going(Between::Held);
        let area = |recording: &Recording| {
            let spans = recording.time.windows(2).map(|pair| pair[1] - pair[0]);
            recording.arriving(recording.get(Command).unwrap())[1..]
                .iter()
                .zip(spans)
                .map(|(u, span)| u * span)
                .sum::<f64>()
        };
        let thinned = held.thinned(4e-3);
        let (last, end) = (*thinned.time.last().unwrap(), *held.time.last().unwrap());
        assert_eq!(thinned.time.len(), 1001);
        assert!((area(&thinned) - area(&held) + 5.0 * (end - last)).abs() < 1e-9);
        assert!(thinned.time.contains(&1.999), "a far jump keeps its instant");
    }

    #[test]
    fn it_is_known_in_which_ways_a_command_may_have_gone() {
        let ways = |command: &dyn Fn(f64) -> f64| {
            let time: Vec<f64> = (0..40).map(f64::from).collect();
            let command = time.iter().map(|t| command(*t)).collect();
            let recording = Recording::planned("r", time, BTreeMap::from([(Command, command)]));
            [Between::Lines, Between::Jumps, Between::Held].map(|between| recording.can_go(between))
        };
        assert_eq!(ways(&|_| 1.0), [true, false, false]);
        assert_eq!(ways(&|t| if t < 20.0 { 1.0 } else { 2.0 }), [true, true, false]);
        assert_eq!(ways(&|t| t), [true, false, true]);
        assert_eq!(ways(&|t| if t < 20.0 { 0.0 } else { t }), [true, true, true]);
    }

    #[test]
    fn thinning_keeps_the_instant_of_a_jump() {
        let time: Vec<f64> = (0..4000).map(|k| 1e-3 * f64::from(k)).collect();
        let command = time.iter().map(|t| if *t < 1.9985 { 1.0 } else { 3.0 }).collect();
        let thinned = Recording::planned("r", time, BTreeMap::from([(Command, command)])).thinned(4e-3);
        let [early, late] = [true, false].map(|early| thinned.with_jumps(early).get(Command).unwrap().to_vec());
        let doubt = early.iter().zip(&late).map(|(early, late)| early - late).fold(0.0, f64::max);
        assert!(doubt > 0.0 && doubt <= 2.0 / 4.0, "{doubt}");
    }

    #[test]
    fn units_become_si_and_gaps_are_missing() {
        let text = rows(HEADER, |k| {
            let pressure = if k == 3 { String::new() } else { k.to_string() };
            format!("{},{},{pressure},{},20,x", 10 * k, 1000 * k, 2 * k)
        });
        let recording = parse(&text).unwrap();
        assert!((recording.time[5] - 0.05).abs() < 1e-15);
        assert_eq!(recording.get(Command).unwrap()[5], 5.0);
        assert!(recording.get(GaugePressure).unwrap()[3].is_nan());
        assert_eq!(recording.bridged(GaugePressure).unwrap()[3], 3e5);
        assert!((recording.get(Contraction).unwrap()[4] - 0.008).abs() < 1e-15);
        assert_eq!(recording.load_mass(), Some(20.0));
        let at_once = "the load moves at the start: simulations begin at 0.0 mm with 200 mm/s";
        assert_eq!(recording.notes, ["column `remark` is not used", at_once]);
    }

    #[test]
    fn a_file_is_the_same_however_it_is_spelt() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.csv");
        std::fs::write(&path, rows("time [s],command [V],contraction [m]", |k| format!("{k},1,0.1"))).unwrap();
        std::fs::create_dir(folder.path().join("x")).unwrap();
        let again = folder.path().join("x").join("..").join("r.csv");
        let refused = read_all(&[path, again.clone()], &[]).unwrap_err().to_string();
        assert!(refused.starts_with(&format!("{}: is given twice", again.display())), "{refused}");
    }

    #[test]
    fn a_name_stays_on_its_line() {
        let text = rows("time [s],command [V],contraction [m]", |k| format!("{k},1,0.1"));
        let recording = Recording::parse(text.as_bytes(), Path::new("a\n[load]\nmass = 1.csv"), &[]).unwrap();
        assert_eq!(recording.name(), "a\\n[load]\\nmass = 1.csv");
    }

    #[test]
    fn many_columns_without_use_are_one_note() {
        let header =
            (0..5000).fold("time [s],command [V],contraction [m]".to_owned(), |text, k| text + &format!(",x{k}"));
        let text = rows(&header, |k| format!("{k},1,0.1{}", ",7".repeat(5000)));
        let all = "`x0`, `x1`, `x2`, `x3`, `x4`, `x5`, `x6`, `x7`, `x8`, `x9` and 4990 more";
        assert_eq!(parse(&text).unwrap().notes, [format!("columns {all} are not used")]);
    }

    #[test]
    fn foreign_headers_can_be_renamed() {
        let text = rows("t,u,x", |k| format!("{k},1,0.1"));
        let map = [("t", "time [s]"), ("u", "command [V]"), ("x", "contraction [m]")]
            .map(|(theirs, ours)| (theirs.to_owned(), ours.to_owned()));
        assert!(Recording::parse(text.as_bytes(), Path::new("r.csv"), &map).unwrap().notes.is_empty());
        let slip = [map[0].clone(), map[1].clone(), ("x".to_owned(), "contracton [m]".to_owned())];
        let refused = Recording::parse(text.as_bytes(), Path::new("r.csv"), &slip).unwrap_err().to_string();
        assert!(refused.starts_with("r.csv: line 1, column `x`: --map gives it the name `contracton`"), "{refused}");
    }

    #[test]
    fn what_is_wrong_is_said_with_line_and_column() {
        let row = |k: usize| format!("{k},1,0.1,20");
        let header = "time [s],command [V],contraction [m],load_mass [kg]";
        let cases = [
            (rows(header, |k| if k == 4 { "4,1".into() } else { row(k) }), "r.csv: line 6: 2 cells where"),
            (
                rows("time,command [V],contraction [m],load_mass [kg]", row),
                "r.csv: line 1, column `time`: the header has",
            ),
            (
                rows("time [s],command [volt],contraction [m],load_mass [kg]", row),
                "r.csv: line 1, column `command [volt]`: unit `volt` is unknown: use one of V, mV",
            ),
            (
                rows(header, |k| row(if k == 7 { 2 } else { k })),
                "r.csv: line 9, column `time`: time runs backwards, from 6",
            ),
            (
                rows(header, |k| if k == 2 { "2,abc,1,20".into() } else { row(k) }),
                "r.csv: line 4, column `command [V]`: `abc`",
            ),
            (
                rows(&header.replace("[m]", "[kN]").replace("contraction", "force"), |k| format!("{k},1,1e306,20")),
                "r.csv: line 2, column `force [kN]`: 1e306 kN is more than",
            ),
            (rows(header, |k| format!("{k},1,0.1,-5")), "r.csv: line 2, column `load_mass`: -5 kg"),
            (rows(header, |k| format!("{k},1,0.1,{}", 20 + k)), "r.csv: line 3, column `load_mass`: the load changes"),
            (rows("time [s],command [V]", |k| format!("{k},1")), "r.csv: without `load_mass` the motion is prescribed"),
            ("time [s],command [V]\n".to_owned(), "r.csv: fewer than 10 samples"),
            (
                rows(header, |_| row(3)),
                "r.csv: 11 rows repeat the time of the row before, which leaves 1: write the time with more digits",
            ),
            (rows(header, |k| format!("{k},,0.1,20")), "r.csv: column `command` is empty: a hanging load"),
            (rows("time [s],contraction [m]", |k| format!("{k},")), "r.csv: column `contraction` is empty: without"),
            (
                rows("clock,command [V]", |k| format!("{k},1")),
                "r.csv: line 1: there is no column `time [s]` among `clock`, `command [V]`: rename one, or say which it \
                 is, as in --map \"clock=time [s]\"",
            ),
            (" \n\n".to_owned(), "r.csv: the file is empty"),
        ];
        for (text, expected) in cases {
            let message = parse(&text).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message} should start with {expected}");
        }
    }

    #[test]
    fn thinning_keeps_samples_and_averages_commands() {
        let text: String = (0..6000).fold("time [ms],command [V],contraction [m]\n".to_owned(), |text, k| {
            let missing = if k == 8 { String::new() } else { format!("{}", 0.1 + 1e-5 * f64::from(k)) };
            text + &format!("{k},{},{missing}\n", if k % 2 == 0 { 1.0 } else { 2.0 })
        });
        let thinned = parse(&text).unwrap().thinned(4e-3);
        assert_eq!(thinned.time.len(), 1500);
        for k in 1..1500 {
            assert!((thinned.time[k] - 4e-3 * k as f64).abs() < 1e-12);
            assert!((thinned.get(Command).unwrap()[k] - 1.5).abs() < 1e-12);
            let contraction = thinned.get(Contraction).unwrap()[k];
            assert!(if k == 2 { contraction.is_nan() } else { (contraction - 0.1 - 4e-5 * k as f64).abs() < 1e-12 });
        }
        assert_eq!(thinned.line(1), 6);
        assert_eq!(parse(&text).unwrap().thinned(1e-3).time.len(), 6000);
        assert_eq!(parse(&text).unwrap().thinned(1.0).time.len(), 1000);
    }

    #[test]
    fn thinning_keeps_signals_that_are_logged_in_rows_of_their_own() {
        // The contraction in every second row, the load in one.
        let text: String =
            (0..8000).fold("time [ms],command [V],contraction [m],load_mass [kg]\n".to_owned(), |text, k| {
                let (command, contraction) = if k % 2 == 0 { ("1", "") } else { ("", "0.1") };
                text + &format!("{k},{command},{contraction},{}\n", if k == 4001 { "20" } else { "" })
            });
        let thinned = parse(&text).unwrap().thinned(4e-3);
        assert_eq!(thinned.time.len(), 4000);
        assert_eq!(thinned.known(Contraction).len(), 2000);
        assert_eq!(thinned.load_mass(), Some(20.0));
    }

    #[test]
    fn repeated_times_are_left_out_with_a_note() {
        let text = rows("time [s],command [V],contraction [m]", |k| format!("{},1,0.1", k.max(2)));
        assert!(matches!(parse(&text), Ok(r) if r.time.len() == 10 && r.notes[0].starts_with("2 rows repeat")));
    }
}
