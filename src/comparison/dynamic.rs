//! A muscle in motion against the same muscle at rest (thesis section 4.4).
//!
//! # Model
//! A load hangs from the muscle and the commanded pressure follows a trajectory of limited rate v and acceleration a, up
//! and down again. At the pressures of static points the contraction in passing is compared with that at rest.

use crate::identification::points::{Branch, range};
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plant::equilibrium;
use crate::reference::Reference;
use crate::simulation::replay;
use crate::{GRAVITY, Result};
use serde::Serialize;
use std::collections::BTreeMap;

/// Rates in Pa/s and accelerations in Pa/s² of the commanded pressure, as in thesis table 4.5.
pub const TRAJECTORIES: [(f64, f64); 6] = [(1e4, 2e3), (2e4, 2e3), (3e4, 2e4), (1e5, 8e4), (2e5, 2e5), (4e5, 6e5)];

/// Rest in s before, between and after the two ways.
const REST: f64 = 2.0;
/// Time between the samples of a trajectory, s.
const SAMPLING: f64 = 0.01;

/// A pressure that is passed in motion.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Passage {
    /// Pa.
    pub gauge_pressure: f64,
    /// Whether it rose.
    pub branch: Branch,
    /// Contraction in passing, m.
    pub dynamic: f64,
    /// Contraction at rest, m.
    pub at_rest: f64,
}

/// The command for a trajectory between two pressures in Pa and back, for a load in kg: what an experiment plays.
pub fn trajectory(parameters: &Parameters, (rate, acceleration): (f64, f64), span: [f64; 2], mass: f64) -> Recording {
    let way = |start: f64, target: f64| Reference { start, target, velocity: rate, acceleration, start_time: 0.0 };
    let [up, down] = [way(span[0], span[1]), way(span[1], span[0])];
    let turn = REST + up.duration() + REST;
    let end = turn + down.duration() + REST;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let time: Vec<f64> = (0..=(end / SAMPLING) as usize).map(|k| SAMPLING * k as f64).collect();
    let at = |t: &f64| if *t < turn { up.at(t - REST) } else { down.at(t - turn) };
    let command = time.iter().map(|t| at(t).setpoint / parameters.valve.gain).collect();
    let inputs = BTreeMap::from([(Signal::Command, command), (Signal::LoadMass, vec![mass; time.len()])]);
    Recording::planned("trajectory.csv", time, inputs)
}

/// Passages of a simulated trajectory at pressures in Pa.
///
/// # Errors
/// Those of the simulation.
pub fn simulated(parameters: &Parameters, trajectory: &Recording, pressures: &[f64]) -> Result<Vec<Passage>> {
    let mass = trajectory.load_mass().unwrap_or(parameters.load.mass);
    let replay = replay(parameters, trajectory)?;
    let signal = |signal| replay.get(signal).unwrap_or_default();
    let at_rest = |pressure: f64| equilibrium(parameters, pressure, mass * GRAVITY);
    Ok(passages(signal(Signal::GaugePressure), signal(Signal::Contraction), pressures, at_rest))
}

/// Contractions where a pressure passes given ones, beside those at rest; both ways. Where the muscle has no contraction
/// at rest there is no passage.
pub fn passages(
    pressure: &[f64],
    contraction: &[f64],
    pressures: &[f64],
    at_rest: impl Fn(f64) -> Option<f64>,
) -> Vec<Passage> {
    let mut found = Vec::new();
    // A pressure that stays is not passed by its noise.
    let near = 1e-3 * range(pressure);
    for &level in pressures {
        let Some(at_rest) = at_rest(level) else { continue };
        let mut side = 0_i8;
        for k in 1..pressure.len() {
            let now = if pressure[k] > level + near {
                1
            } else if pressure[k] < level - near {
                -1
            } else {
                continue;
            };
            if side != 0 && now != side {
                // The crossing itself lies in the samples before.
                let last = (1..=k).rev().find(|&i| (pressure[i - 1] - level) * f64::from(now) <= 0.0).unwrap_or(k);
                let share = (level - pressure[last - 1]) / (pressure[last] - pressure[last - 1]);
                let dynamic = contraction[last - 1] + share * (contraction[last] - contraction[last - 1]);
                let branch = if now > 0 { Branch::Shortening } else { Branch::Lengthening };
                found.push(Passage { gauge_pressure: level, branch, dynamic, at_rest });
            }
            side = now;
        }
    }
    found
}
