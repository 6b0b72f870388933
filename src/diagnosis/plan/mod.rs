//! The next experiment: the recording that best tells apart what a diagnosis left standing.
//!
//! # Method
//! A library of courses of the command, with the loads there are, with a further load and at locked length, is simulated
//! under every remaining model, within the limits of the rig. Of each experiment λ says how far the rivals stay apart
//! (see `power.rs`); the experiment whose worst pair is told apart best per second is proposed. Where none reaches
//! [`ENOUGH`], what the rig lacks is named: a second load, a sensor, a clamp, a valve that shuts.

mod excitations;
mod files;
mod power;
mod rivals;

pub use excitations::EXCITATIONS;
pub use files::{files, matrix, outdated, to_json};
pub use rivals::{Rival, Task};

use super::hypothesis::{Off, corrections, declared};
use crate::measurement::Signal;
use crate::parameters::Parameters;
use crate::quality::HIGHEST_PRESSURE;
use crate::{Error, Result};
use nalgebra::DMatrix;
use power::{Bank, Corrections, LEAST_CONTRACTION};

/// λ from which two models are told apart beyond doubt: five standard deviations.
pub const ENOUGH: f64 = 25.0;
/// The cut-off of the valve is known this much worse than areas, as damping is: no experiment should hang on them.
const DYNAMIC_SLACK: f64 = 3.0;
/// Most experiments that are reported, the most promising ones of each kind; their rivals are fitted until one suffices.
const REPORTED: usize = 8;
/// Longest experiment by default, s.
pub const USUAL_DURATION: f64 = 60.0;
/// Highest gauge pressure by default, Pa.
pub const USUAL_PRESSURE: f64 = 5e5;
/// Shortest and longest recording that is planned, s: in less no load comes to rest, in an hour leaks and creep do.
const DURATIONS: (f64, f64) = (1.0, 3600.0);
/// Largest contraction of a FESTO muscle, as a share of its rest length.
const LARGEST_STROKE: f64 = 0.25;

/// What the rig can do.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Highest gauge pressure in Pa.
    pub most_pressure: f64,
    /// Largest contraction in m; `None` for a quarter of the rest length.
    pub most_contraction: Option<f64>,
    /// Loads that can be hung on, kg; at least one.
    pub load_masses: Vec<f64>,
    /// Longest single recording, s.
    pub duration: f64,
}

impl Limits {
    /// Refuses what no rig with this muscle can do, and what no recording is worth, by the option of `sinew plan`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`]; [`Error::Plan`] for loads that are missing or stand there twice.
    fn check(&self, nominal: &Parameters) -> Result<()> {
        let length = nominal.muscle.rest_length;
        let shortest = LEAST_CONTRACTION * length;
        within("--most-pressure", self.most_pressure, (0.0, HIGHEST_PRESSURE), "Pa")?;
        within("--most-contraction", self.most_contraction(nominal), (shortest, length), "m")?;
        within("--duration", self.duration, DURATIONS, "s")?;
        let (load, _) = declared(nominal, "load.mass");
        self.load_masses.iter().try_for_each(|mass| within("--load-mass", *mass, (load.min, load.max), "kg"))?;
        let refuse = |problem: String| Err(Error::Plan { problem });
        match (1..self.load_masses.len()).find(|k| self.load_masses[..*k].contains(&self.load_masses[*k])) {
            Some(k) => refuse(format!("--load-mass: {} kg stands there twice: leave one out", self.load_masses[k])),
            None if self.load_masses.is_empty() => refuse("--load-mass: give at least one load".to_owned()),
            None => Ok(()),
        }
    }

    /// Largest contraction of a muscle in m.
    fn most_contraction(&self, model: &Parameters) -> f64 {
        self.most_contraction.unwrap_or(LARGEST_STROKE * model.muscle.rest_length)
    }

    /// A load in kg beyond the only one there is.
    fn further_load(&self) -> Option<f64> {
        (self.load_masses.len() == 1).then(|| 1.5 * self.load_masses[0])
    }
}

/// Where the muscle works in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// Under a hanging load in kg.
    Load(f64),
    /// Held at a contraction, as a share of the rest length.
    Locked(f64),
    /// Under a hanging load in kg, the valve shut.
    ValveShut(f64),
}

impl Place {
    /// Hanging load in kg.
    pub fn load_mass(self) -> Option<f64> {
        match self {
            Place::Load(mass) | Place::ValveShut(mass) => Some(mass),
            Place::Locked(_) => None,
        }
    }

    fn valve_shut(self) -> bool {
        matches!(self, Place::ValveShut(_))
    }
}

/// What the rig may lack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Need {
    /// Another load, kg.
    Load(f64),
    /// A sensor.
    Sensor(Signal),
    /// Something that holds the ends of the muscle.
    Clamp,
    /// A valve that can be shut.
    ShutOffValve,
}

impl Need {
    /// In words.
    pub fn words(self) -> String {
        match self {
            Need::Load(mass) => format!("a second load of about {mass:.0} kg"),
            Need::Sensor(Signal::GaugePressure) => "a pressure sensor at the muscle (`gauge_pressure`)".to_owned(),
            Need::Sensor(Signal::Force) => "a force sensor (`force`)".to_owned(),
            Need::Sensor(signal) => format!("a sensor of `{}`", signal.name()),
            Need::Clamp => "a clamp that holds the muscle at a fixed length".to_owned(),
            Need::ShutOffValve => "a shut-off valve at the muscle".to_owned(),
        }
    }
}

/// An experiment: one run, or two that belong together.
#[derive(Debug, Clone)]
struct Experiment {
    runs: Vec<usize>,
    needs: Vec<Need>,
}

/// One line of the comparison.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The experiment in words.
    pub name: String,
    /// How long it takes, s.
    pub duration: f64,
    /// λ of the pair that it tells apart worst.
    pub lambda: f64,
    /// Pairs whose λ is enough.
    pub told_apart: usize,
    /// Whether λ comes from fits; else it is to first order.
    pub fitted: bool,
}

/// One recording that is to be made.
#[derive(Debug, Clone)]
pub struct Planned {
    /// Name of the CSV file.
    pub file: String,
    /// Name of the course.
    pub excitation: &'static str,
    /// Where the muscle works.
    pub place: Place,
    /// Time in s, shape `(n_samples,)`.
    pub time: Vec<f64>,
    /// Command in V, shape `(n_samples,)`.
    pub command: Vec<f64>,
    /// Contraction in m at which the muscle is held.
    pub locked: Option<f64>,
}

/// How far two models are apart.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// The two effects.
    pub effects: [&'static str; 2],
    /// λ, the smaller one of both directions.
    pub lambda: f64,
}

/// The proposal.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What is to be told apart, in words.
    pub why: String,
    /// The models.
    pub rivals: Vec<Rival>,
    /// Sensors that the proposal counts on.
    pub sensors: Vec<Signal>,
    /// What it takes beyond the rig as it is.
    pub needs: Vec<Need>,
    /// The recordings to make.
    pub runs: Vec<Planned>,
    /// The experiments of the same means, the best first.
    pub compared: Vec<Compared>,
    /// How far apart each pair is then, the closest first.
    pub pairs: Vec<Pair>,
    /// Effects of usual size that these sensors do not show at all.
    pub unseen: Vec<&'static str>,
}

impl Plan {
    /// Pairs that the proposal cannot tell apart.
    pub fn confused(&self) -> impl Iterator<Item = &Pair> {
        self.pairs.iter().filter(|pair| pair.lambda < ENOUGH)
    }

    /// How long the recordings take together, s.
    pub fn duration(&self) -> f64 {
        self.runs.iter().filter_map(|run| run.time.last()).sum()
    }

    /// The proposal in a sentence or three.
    pub fn sentence(&self) -> String {
        let runs: Vec<String> = self.runs.iter().map(|run| described(run.excitation, run.place)).collect();
        let mut text = format!("Record {} ({:.0} s).", runs.join(", and "), self.duration());
        if !self.needs.is_empty() {
            let needs: Vec<String> = self.needs.iter().map(|need| need.words()).collect();
            text += &format!(" This takes {}: without, no experiment of the library is enough.", needs.join(" and "));
        }
        if !self.unseen.is_empty() {
            text += &format!(" Not seen by these sensors: {}.", self.unseen.join(", "));
        }
        let confused: Vec<String> = self.confused().map(|pair| pair.effects.join(" from ")).collect();
        if !confused.is_empty() && self.rivals.len() <= FEW_RIVALS {
            text += &format!(
                " No experiment of the library tells {}, not even with more loads or sensors: it takes another sensor or \
                 a reference, such as a calibrated gauge.",
                confused.join(", or ")
            );
        }
        text
    }
}

/// Refuses what an option gives beyond its range, ends included.
fn within(option: &str, value: f64, (min, max): (f64, f64), unit: &'static str) -> Result<()> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(Error::OutOfRange { variable: option.to_owned(), value, min, max, unit })
}

/// More rivals than this are surveyed: nothing is fitted, and nothing is asked for that the rig has not.
const FEW_RIVALS: usize = 6;

fn described(excitation: &str, place: Place) -> String {
    match place {
        Place::Load(mass) | Place::ValveShut(mass) => format!("{excitation} under {mass:.0} kg"),
        Place::Locked(share) => format!("{excitation} locked at {:.0} % contraction", 100.0 * share),
    }
}

/// How many times [`plan`] tells that something is done, at most.
pub fn pieces(limits: &Limits) -> usize {
    EXCITATIONS.len() * (limits.load_masses.len() + 3)
}

/// Proposes the experiment that tells the models of a task apart; `done` is told after each simulated run.
///
/// `tolerance` is the relative error that the nominal coefficients may have.
///
/// # Errors
/// [`Error::OutOfRange`] for limits that make no sense, by the option that gives them; [`Error::Plan`] where they leave no experiment.
pub fn plan(
    task: &Task,
    nominal: &Parameters,
    tolerance: f64,
    limits: &Limits,
    done: &(dyn Fn(&str) + Sync),
) -> Result<Plan> {
    limits.check(nominal)?;
    let corrections = corrections(nominal, tolerance, Off::most(nominal));
    let bank = Bank::new(&task.rivals, nominal, slack(corrections), limits, done);
    let experiments = experiments(&bank, limits);
    let mut best: Option<Choice> = None;
    for needs in levels(task, limits) {
        let Some(choice) = Choice::of(&bank, task, &experiments, needs) else { continue };
        if best.as_ref().is_none_or(|best| choice.rows[0].told_apart > best.rows[0].told_apart) {
            best = Some(choice);
        }
        let pairs = task.rivals.len() * (task.rivals.len() - 1) / 2;
        if best.as_ref().is_some_and(|best| best.rows[0].told_apart == pairs) {
            break;
        }
    }
    let nothing = || Error::Plan {
        problem: "the limits leave no experiment: allow more pressure, more contraction or another load".to_owned(),
    };
    Ok(best.ok_or_else(nothing)?.plan(&bank, task))
}

/// The corrections, that of the valve's cut-off wider: that of the damping is.
fn slack(mut corrections: Corrections) -> Corrections {
    for (variable, free) in &mut corrections {
        if variable.name == "valve.bandwidth" {
            let start = free.start;
            let [lower, upper] = [free.lower, free.upper].map(|end| start + DYNAMIC_SLACK * (end - start));
            (free.lower, free.upper) = (lower.max(variable.min), upper.min(variable.max));
            free.prior = free.prior.map(|(mean, deviation)| (mean, DYNAMIC_SLACK * deviation));
        }
    }
    corrections
}

/// All single runs, and the same course under all loads or at all lengths.
fn experiments(bank: &Bank, limits: &Limits) -> Vec<Experiment> {
    let needs = |run: usize| match bank.runs[run].place {
        Place::Locked(_) => vec![Need::Clamp],
        Place::ValveShut(_) => vec![Need::ShutOffValve],
        Place::Load(mass) if !limits.load_masses.contains(&mass) => vec![Need::Load(mass)],
        Place::Load(_) => vec![],
    };
    let mut all: Vec<Experiment> =
        (0..bank.runs.len()).map(|run| Experiment { runs: vec![run], needs: needs(run) }).collect();
    for first in 0..bank.runs.len() {
        let a = &bank.runs[first];
        let partners = (first + 1..bank.runs.len()).filter(|second| {
            let b = &bank.runs[*second];
            let alike = std::mem::discriminant(&a.place) == std::mem::discriminant(&b.place);
            alike && a.excitation == b.excitation
        });
        for second in partners {
            let mut together = needs(first);
            together.extend(needs(second).into_iter().filter(|need| !needs(first).contains(need)));
            all.push(Experiment { runs: vec![first, second], needs: together });
        }
    }
    all
}

/// What may be asked for: nothing, then one thing, then two, what is least trouble first.
fn levels(task: &Task, limits: &Limits) -> Vec<Vec<Need>> {
    if task.rivals.len() > FEW_RIVALS {
        return vec![vec![]];
    }
    let missing = |signal: Signal| task.sensors.iter().all(|(there, _)| *there != signal);
    let sensors = [Signal::GaugePressure, Signal::Contraction].into_iter().filter(|signal| missing(*signal));
    let mut all: Vec<Need> = limits.further_load().map(Need::Load).into_iter().collect();
    all.extend(sensors.map(Need::Sensor));
    all.push(Need::Clamp);
    all.extend(missing(Signal::Force).then_some(Need::Sensor(Signal::Force)));
    all.push(Need::ShutOffValve);
    let mut levels = vec![vec![]];
    levels.extend(all.iter().map(|need| vec![*need]));
    for (k, first) in all.iter().enumerate() {
        levels.extend(all[k + 1..].iter().map(|second| vec![*first, *second]));
    }
    levels
}

/// The best experiments of some means.
struct Choice {
    needs: Vec<Need>,
    sensors: Vec<(Signal, f64)>,
    experiment: Experiment,
    /// λ of the best experiment.
    lambda: DMatrix<f64>,
    rows: Vec<Compared>,
}

impl Choice {
    fn of(bank: &Bank, task: &Task, experiments: &[Experiment], needs: Vec<Need>) -> Option<Self> {
        let mut sensors = task.sensors.clone();
        sensors.extend(needs.iter().filter_map(|need| match need {
            Need::Sensor(signal) => Some((*signal, rivals::usual_noise(*signal))),
            _ => None,
        }));
        let possible = experiments.iter().filter(|e| e.needs.iter().all(|need| needs.contains(need)));
        let screened = possible.map(|experiment| Screened {
            experiment,
            duration: experiment.runs.iter().map(|run| bank.runs[*run].duration()).sum(),
            lambda: bank.screened(&experiment.runs, &sensors),
            fitted: false,
        });
        let mut screened: Vec<Screened> = screened.collect();
        screened.sort_by(order);
        screened.truncate(REPORTED);
        // Only what promises something is worth the fits, and a further one only where those before fall short.
        let promised = screened.first().map_or(0, |best| told_apart(&best.lambda));
        if promised > 0 && task.rivals.len() <= FEW_RIVALS {
            for promising in &mut screened {
                promising.lambda = bank.fitted(&promising.experiment.runs, &sensors);
                promising.fitted = true;
                if told_apart(&promising.lambda) >= promised {
                    break;
                }
            }
            screened.sort_by(|a, b| b.fitted.cmp(&a.fitted).then(order(a, b)));
        }
        let rows = screened.iter().map(|screened| screened.row(bank)).collect();
        let Screened { experiment, lambda, .. } = screened.into_iter().next()?;
        Some(Self { needs, sensors, experiment: experiment.clone(), lambda, rows })
    }

    fn plan(self, bank: &Bank, task: &Task) -> Plan {
        let several = self.experiment.runs.len() > 1;
        let runs = self.experiment.runs.iter().enumerate().map(|(k, run)| {
            let run = &bank.runs[*run];
            let input = |signal: Signal| run.recording.get(signal).map(<[f64]>::to_vec);
            Planned {
                file: format!("{}.csv", files::STEMS[if several { k + 1 } else { 0 }]),
                excitation: run.excitation,
                place: run.place,
                time: halved(&run.recording.time),
                command: halved(&input(Signal::Command).unwrap_or_default()),
                locked: input(Signal::Contraction).map(|contraction| contraction[0]),
            }
        });
        // Models that a diagnosis left have been seen.
        let usual = task.rivals.iter().zip(bank.seen(&self.experiment.runs, &self.sensors));
        let unseen = usual.filter(|(rival, lambda)| !rival.variants.is_empty() && *lambda < ENOUGH);
        let unseen = unseen.map(|(rival, _)| rival.name).collect();
        let mut pairs: Vec<Pair> = worst_pairs(&self.lambda)
            .map(|(a, b, lambda)| Pair { effects: [task.rivals[a].name, task.rivals[b].name], lambda })
            .collect();
        pairs.sort_by(|a, b| a.lambda.total_cmp(&b.lambda));
        Plan {
            why: task.why.clone(),
            rivals: task.rivals.clone(),
            sensors: self.sensors.iter().map(|(signal, _)| *signal).collect(),
            needs: self.needs,
            runs: runs.collect(),
            compared: self.rows,
            pairs,
            unseen,
        }
    }
}

/// A series with the middles between its values.
fn halved(values: &[f64]) -> Vec<f64> {
    let middles = values.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
    middles.chain(values.last().copied()).collect()
}

/// An experiment with what it tells apart.
struct Screened<'a> {
    experiment: &'a Experiment,
    /// s.
    duration: f64,
    lambda: DMatrix<f64>,
    fitted: bool,
}

impl Screened<'_> {
    fn row(&self, bank: &Bank) -> Compared {
        let runs = self.experiment.runs.iter().map(|run| &bank.runs[*run]);
        Compared {
            name: runs.map(|run| described(run.excitation, run.place)).collect::<Vec<_>>().join(", "),
            duration: self.duration,
            lambda: smallest(&self.lambda),
            told_apart: told_apart(&self.lambda),
            fitted: self.fitted,
        }
    }
}

/// Pairs with the smaller λ of both directions.
fn worst_pairs(lambda: &DMatrix<f64>) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
    let count = lambda.nrows();
    (0..count)
        .flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
        .map(|(a, b)| (a, b, lambda[(a, b)].min(lambda[(b, a)])))
}

fn smallest(lambda: &DMatrix<f64>) -> f64 {
    worst_pairs(lambda).map(|(.., lambda)| lambda).fold(f64::INFINITY, f64::min)
}

fn told_apart(lambda: &DMatrix<f64>) -> usize {
    worst_pairs(lambda).filter(|(.., lambda)| *lambda >= ENOUGH).count()
}

/// The order of experiments: more pairs told apart, then the larger smallest λ of these per second.
fn order(a: &Screened, b: &Screened) -> std::cmp::Ordering {
    let key = |Screened { lambda, duration, .. }: &Screened| {
        let told = worst_pairs(lambda).map(|(.., lambda)| lambda).filter(|lambda| *lambda >= ENOUGH);
        let least = told.fold(f64::INFINITY, f64::min);
        (told_apart(lambda), if least.is_finite() { least } else { smallest(lambda) } / duration)
    };
    let (a, b) = (key(a), key(b));
    b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
}
