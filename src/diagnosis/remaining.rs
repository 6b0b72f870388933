//! What the error that is left depends on: for causes without a name, and for the rest of those that have one.

use super::links::binned;
use super::residuals::Data;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::{Replay, replay};

/// What a part of the error that is left goes with.
#[derive(Debug, Clone, PartialEq)]
pub struct Remaining {
    /// The signal whose residual it is.
    pub signal: Signal,
    /// What the residual goes with, in words.
    pub on: String,
    /// Share of its mean square on samples that no fit saw.
    pub share: f64,
    /// Whether that is how a cause shows that is in no library, but known.
    pub is_known: bool,
}

/// Least share that is worth a word.
const LEAST_SHARE: f64 = 0.1;
/// Bins per variable: alone, and in a pair.
const BINS: (usize, usize) = (16, 7);
/// What a second variable must add to be named: bins of two catch a little of everything.
const LEAST_ADDED: f64 = 0.1;
/// Speed in m/s below which a muscle counts as at rest.
const AT_REST: f64 = 1e-3;

/// A quantity that residuals may depend on.
struct Variable {
    name: &'static str,
    /// Value at each residual.
    values: Vec<f64>,
}

/// For each signal the variable, or the pair of them, that tells most of the residual of a model; the most telling first.
///
/// The share is that of the mean square which bin means of the training samples take off the held-out ones.
pub fn remaining(data: &Data, model: &Parameters, residuals: &[f64]) -> Vec<Remaining> {
    let replays: Vec<Option<Replay>> =
        data.recordings().iter().map(|recording| replay(model, recording).ok()).collect();
    let mut all: Vec<Remaining> =
        data.signals().into_iter().filter_map(|signal| most_telling(data, signal, residuals, &replays)).collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

fn most_telling(data: &Data, signal: Signal, residuals: &[f64], replays: &[Option<Replay>]) -> Option<Remaining> {
    let samples: Vec<(usize, usize, f64, bool)> = data.each(signal, residuals).collect();
    let variables = variables(data.recordings(), replays, &samples);
    let bins: Vec<Vec<usize>> = variables.iter().map(|variable| binned(&variable.values, BINS.0)).collect();
    let alone = (0..variables.len()).map(|k| (vec![k], share(&samples, &bins[k])));
    let best = alone.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let coarse: Vec<Vec<usize>> = variables.iter().map(|variable| binned(&variable.values, BINS.1)).collect();
    let pairs = (0..variables.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| {
        let both: Vec<usize> = coarse[i].iter().zip(&coarse[j]).map(|(a, b)| a * BINS.1 + b).collect();
        (vec![j, i], share(&samples, &both))
    });
    let pair = pairs.max_by(|a, b| a.1.total_cmp(&b.1));
    let (which, share) = pair.filter(|pair| pair.1 > best.1 + LEAST_ADDED).unwrap_or(best);
    let names: Vec<&str> = which.iter().map(|k| variables[*k].name).collect();
    (share >= LEAST_SHARE).then(|| Remaining { signal, on: names.join(" and "), share, is_known: false })
}

/// The quantities at the samples: measured where they were, else simulated.
fn variables(
    recordings: &[Recording],
    replays: &[Option<Replay>],
    samples: &[(usize, usize, f64, bool)],
) -> Vec<Variable> {
    let signal = |signal: Signal| -> Vec<Option<Vec<f64>>> {
        let simulated = |k: usize| replays[k].as_ref().and_then(|replay| replay.get(signal)).map(<[f64]>::to_vec);
        (0..recordings.len()).map(|k| recordings[k].bridged(signal).or_else(|| simulated(k))).collect()
    };
    let rates = |columns: &[Option<Vec<f64>>]| -> Vec<Option<Vec<f64>>> {
        columns
            .iter()
            .zip(recordings)
            .map(|(column, r)| column.as_ref().map(|c| crate::simulation::slopes(&r.time, c)))
            .collect()
    };
    let (pressure, contraction) = (signal(Signal::GaugePressure), signal(Signal::Contraction));
    let velocity = rates(&contraction);
    let direction: Vec<Option<Vec<f64>>> = velocity
        .iter()
        .map(|v| v.as_ref().map(|v| v.iter().map(|v| if v.abs() < AT_REST { 0.0 } else { v.signum() }).collect()))
        .collect();
    let time = recordings.iter().map(|recording| Some(recording.since_start())).collect::<Vec<_>>();
    let mass = recordings.iter().map(|r| r.load_mass().map(|mass| vec![mass; r.time.len()])).collect::<Vec<_>>();
    let columns = [
        ("the command", signal(Signal::Command)),
        ("the pressure", pressure.clone()),
        ("the rate of the pressure", rates(&pressure)),
        ("the contraction", contraction),
        ("the velocity", velocity),
        ("the direction of motion", direction),
        ("the time since the start", time),
        ("the load", mass),
    ];
    let at_samples = columns.into_iter().filter_map(|(name, columns)| {
        let values: Option<Vec<f64>> =
            samples.iter().map(|(recording, k, ..)| columns[*recording].as_ref().map(|column| column[*k])).collect();
        values.map(|values| Variable { name, values })
    });
    at_samples.collect()
}

/// Share of the mean square of held-out residuals that the bin means of the others take off.
fn share(samples: &[(usize, usize, f64, bool)], bins: &[usize]) -> f64 {
    let count = bins.iter().max().map_or(0, |last| last + 1);
    let mut means = vec![(0.0, 0.0); count];
    for ((.., residual, training), bin) in samples.iter().zip(bins) {
        if *training {
            means[*bin] = (means[*bin].0 + residual, means[*bin].1 + 1.0);
        }
    }
    let (mut before, mut after) = (0.0, 0.0);
    for ((.., residual, training), bin) in samples.iter().zip(bins) {
        if !training {
            let (sum, number) = means[*bin];
            before += residual * residual;
            after += (residual - sum / f64::max(number, 1.0)).powi(2);
        }
    }
    if before > 0.0 { 1.0 - after / before } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_what_was_put_in() {
        // Half of the mean square is a step of the variable, half alternates.
        let samples: Vec<_> = (0..1000)
            .map(|k| (0, k, if k % 100 < 50 { 1.0 } else { -1.0 } + if k % 2 == 0 { 1.0 } else { -1.0 }, k < 500))
            .collect();
        let variable: Vec<f64> = (0..1000).map(|k| f64::from(k % 100)).collect();
        let share = share(&samples, &binned(&variable, 10));
        assert!((share - 0.5).abs() < 0.02, "{share}");
    }
}
