//! The closed loop put to the test: the simulations of thesis section 5.4, on the plant that the controller knows and on
//! others.

mod page;

pub use page::{Evaluation, evaluate, files, pieces, to_json};

use crate::parameters::Parameters;
use crate::simulation::{ClosedLoop, closed_loop_on};
use crate::{Error, Result};
use rayon::prelude::*;

/// Loads of section 5.4, kg.
pub const LOADS: [f64; 3] = [20.0, 40.0, 80.0];
/// Velocities of section 5.4, m/s.
pub const VELOCITIES: [f64; 3] = [0.01, 0.03, 0.05];
/// Muscles of section 5.4, as presets, whose `reference.target` is the end of the motion.
pub const MUSCLES: [&str; 2] = ["dmsp-40-1000", "dmsp-40-290"];
/// Time between two exchanges of signals, s.
const STEP: f64 = 1e-3;
/// Time that the loop is given after the motion, s; its last part is judged.
const REST: (f64, f64) = (10.0, 5.0);
/// Error that counts as settled, m.
pub const SETTLED: f64 = 1e-3;
/// Swing that counts as a limit cycle, m.
pub const LIMIT_CYCLE: f64 = 0.5e-3;

/// One of the 18 simulations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// Preset of the muscle.
    pub muscle: &'static str,
    /// Load, kg.
    pub mass: f64,
    /// Velocity of the motion, m/s.
    pub velocity: f64,
}

/// All of them, by muscle, load and velocity.
pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    for muscle in MUSCLES {
        for mass in LOADS {
            all.extend(VELOCITIES.map(|velocity| Case { muscle, mass, velocity }));
        }
    }
    all
}

impl Case {
    /// The parameters with load and velocity of this case.
    fn applied(&self, parameters: &Parameters) -> Parameters {
        let mut parameters = *parameters;
        parameters.load.mass = self.mass;
        parameters.reference.velocity = self.velocity;
        parameters
    }
}

/// What a plant has that its controller does not know.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Unknown {
    /// Relative error of the load.
    pub load: f64,
    /// Relative error of the muscle's force.
    pub force: f64,
    /// Half width of the loop of dry friction, N.
    pub friction: f64,
    /// Dead time of the valve, s.
    pub dead_time: f64,
    /// Relative error of the valve's bandwidth.
    pub bandwidth: f64,
    /// Relative error of the muscle's damping.
    pub damping: f64,
}

impl Unknown {
    /// The plant behind the parameters that the controller knows.
    pub fn plant(&self, known: &Parameters) -> Parameters {
        let mut plant = *known;
        plant.load.mass *= 1.0 + self.load;
        plant.muscle.area_scale *= 1.0 + self.force;
        plant.muscle.elastic_scale *= 1.0 + self.force;
        plant.muscle.damping *= 1.0 + self.damping;
        plant.valve.bandwidth *= 1.0 + self.bandwidth;
        plant.effects.friction_hysteresis.half_width += self.friction;
        plant.effects.valve_dead_time.delay += self.dead_time;
        plant
    }
}

/// How a simulation went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Largest absolute control error, m.
    pub largest_error: f64,
    /// Largest absolute control error at the end, m.
    pub left: f64,
    /// Way between the lowest and the highest position at the end, m.
    pub swing: f64,
    /// Time after the motion from which the error stays settled, s; infinite where it does not.
    pub settling_time: f64,
}

impl Outcome {
    /// A plant that left its range.
    const LOST: Self =
        Self { largest_error: f64::INFINITY, left: f64::INFINITY, swing: f64::INFINITY, settling_time: f64::INFINITY };

    fn of(course: &ClosedLoop, motion: f64) -> Self {
        let end = course.time.last().copied().unwrap_or_default();
        let errors = || course.time.iter().zip(&course.control_error);
        let judged: Vec<f64> = errors().filter(|(time, _)| **time > end - REST.1).map(|(_, error)| *error).collect();
        let highest = judged.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = judged.iter().copied().fold(f64::INFINITY, f64::min);
        let last = errors().filter(|(_, error)| error.abs() > SETTLED).map(|(time, _)| *time).next_back();
        Self {
            largest_error: course.largest_error(),
            left: highest.abs().max(lowest.abs()),
            swing: highest - lowest,
            settling_time: match last {
                Some(time) if time >= end => f64::INFINITY,
                Some(time) => (time - motion).max(0.0),
                None => 0.0,
            },
        }
    }

    /// Stable, settled and without a limit cycle.
    pub fn holds(&self) -> bool {
        self.left <= SETTLED && self.swing <= LIMIT_CYCLE
    }
}

/// Simulates a case with the controller and the muscle of some parameters on a plant that they do not quite know.
///
/// # Errors
/// Those of [`closed_loop_on`], but for a plant that leaves its range.
pub fn course(known: &Parameters, case: &Case, unknown: &Unknown) -> Result<ClosedLoop> {
    let known = case.applied(known);
    closed_loop_on(&unknown.plant(&known), &known, STEP, known.reference.duration() + REST.0)
}

/// As [`course`], judged.
///
/// # Errors
/// Those of [`closed_loop_on`], but for a plant that leaves its range.
pub fn outcome(known: &Parameters, case: &Case, unknown: &Unknown) -> Result<Outcome> {
    match course(known, case, unknown) {
        Ok(course) => Ok(Outcome::of(&course, case.applied(known).reference.duration())),
        Err(Error::Diverged { .. }) => Ok(Outcome::LOST),
        Err(error) => Err(error),
    }
}

/// The plants that a controller must hold although it does not know them: each change alone, and all together.
pub fn unknown_plants() -> Vec<(String, Unknown)> {
    let none = Unknown::default();
    let mut all = vec![
        ("as known".to_owned(), none),
        ("load +20 %".to_owned(), Unknown { load: 0.2, ..none }),
        ("load −20 %".to_owned(), Unknown { load: -0.2, ..none }),
        ("force +10 %".to_owned(), Unknown { force: 0.1, ..none }),
        ("force −10 %".to_owned(), Unknown { force: -0.1, ..none }),
        ("dry friction 40 N".to_owned(), Unknown { friction: 40.0, ..none }),
        ("dead time 10 ms".to_owned(), Unknown { dead_time: 0.01, ..none }),
    ];
    for (load, more) in [(0.2, "+"), (-0.2, "−")] {
        for (force, stronger) in [(0.1, "+"), (-0.1, "−")] {
            let name = format!("all together: load {more}20 %, force {stronger}10 %, 40 N, 10 ms");
            all.push((name, Unknown { load, force, friction: 40.0, dead_time: 0.01, ..none }));
        }
    }
    all
}

/// The 18 cases on one plant, each with the parameters of its muscle.
///
/// # Errors
/// As [`outcome`].
pub fn outcomes(known: impl Fn(&'static str) -> Result<Parameters> + Sync, unknown: &Unknown) -> Result<Vec<Outcome>> {
    cases().par_iter().map(|case| outcome(&known(case.muscle)?, case, unknown)).collect()
}

/// Seed of the random plants.
const SEED: u64 = 2006;

/// Random plants, each with one of the cases in turn, with the parameters of its muscle.
///
/// # Errors
/// As [`outcome`].
pub fn random_plants(plants: usize, known: impl Fn(&'static str) -> Result<Parameters> + Sync) -> Result<Vec<Outcome>> {
    let mut random = fastrand::Rng::with_seed(SEED);
    let mut within = |low: f64, high: f64| low + (high - low) * random.f64();
    let mut plant = |_| Unknown {
        load: within(-0.2, 0.2),
        force: within(-0.1, 0.1),
        friction: within(0.0, 40.0),
        dead_time: within(0.0, 0.01),
        bandwidth: within(-0.2, 0.2),
        damping: within(-0.5, 0.5),
    };
    let plants: Vec<_> = (0..plants).map(&mut plant).zip(cases().into_iter().cycle()).collect();
    plants.par_iter().map(|(unknown, case)| outcome(&known(case.muscle)?, case, unknown)).collect()
}
