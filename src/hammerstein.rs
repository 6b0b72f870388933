//! Hammerstein model: from the command straight to the contraction, without any physics between.
//!
//! # Model
//! y(k) = c + Σⱼ bⱼ Pⱼ(z⁻¹) Σᵢ aᵢ hᵢ(u(k)): a polynomial hᵢ of the command, then a linear filter on Kautz functions, which
//! are orthonormal and share one pair of poles. Before the recording the command had its first value, and all was at rest.
//! For given poles the products aᵢ bⱼ follow by linear least squares, a and b from the largest singular value of
//! their matrix, and then in turn, each by linear least squares. Poles, degree and number of functions are those with the
//! smallest error on a part of the recording that these fits did not see; the error that is reported is that on a third part.
//!
//! # Validity
//! The load and the muscle of the recording, and commands within its range. It knows no load, no force and no hysteresis:
//! it is there to be compared with.
//!
//! # Reference
//! Thesis eqs. 3.48–3.50; B. Wahlberg (1994), doi 10.1109/9.293196, for the functions;
//! E.-W. Bai (1998), doi 10.1016/S0005-1098(97)00198-2, for the two stages.

use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plot::{Curve, plot};
use crate::simulation::replay;
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Shares of a recording at which the part for the fits and that for the choices end.
const PARTS: [f64; 2] = [0.5, 0.7];
/// Poles that are tried: natural frequencies in rad/s, evenly on a logarithmic scale, and damping ratios.
const FREQUENCIES: [f64; 2] = [1.0, 60.0];
const FREQUENCY_COUNT: usize = 16;
const DAMPING_RATIOS: [f64; 6] = [0.1, 0.2, 0.4, 0.7, 1.0, 1.5];
/// Largest degree of the polynomial, and most pairs of Kautz functions.
const MOST: [usize; 2] = [5, 3];
/// Degree and pairs with which the poles are chosen.
const FIRST: [usize; 2] = [3, 2];
/// Turns in which a and b are fitted.
const TURNS: usize = 20;

/// The poles of the filter, as those of a system in continuous time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poles {
    /// rad/s.
    pub natural_frequency: f64,
    /// 1.
    pub damping_ratio: f64,
}

/// An identified model.
#[derive(Debug, Clone)]
pub struct Hammerstein {
    /// Time in s between its samples.
    pub sampling: f64,
    /// Centre and half of the range of the command in V: the polynomial is one of (u − centre)/half.
    pub command: [f64; 2],
    /// Coefficients aᵢ of the powers from the first on; the largest of all is 1.
    pub polynomial: Vec<f64>,
    /// Coefficients bⱼ of the Kautz functions, m.
    pub filter: Vec<f64>,
    /// The poles of these.
    pub poles: Poles,
    /// Contraction in m at the first command.
    pub rest: f64,
}

/// An identified model beside what was measured and the physical model.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The model.
    pub model: Hammerstein,
    /// Time in s, even, shape `(n_samples,)`, and at it the contraction in m measured, of the model, and of the physical one.
    pub time: Vec<f64>,
    #[allow(missing_docs)]
    pub measured: Vec<f64>,
    #[allow(missing_docs)]
    pub modelled: Vec<f64>,
    #[allow(missing_docs)]
    pub physical: Vec<f64>,
    /// The first sample that neither fits nor choices have seen.
    pub held_out: usize,
}

/// Signals of the Kautz functions driven by an input, each of shape `(n_samples,)`; at rest before.
pub fn kautz(poles: Poles, sampling: f64, pairs: usize, input: &[f64]) -> Vec<Vec<f64>> {
    let Poles { natural_frequency, damping_ratio } = poles;
    let decay = (-2.0 * damping_ratio * natural_frequency * sampling).exp();
    let root = natural_frequency * sampling * (damping_ratio.powi(2) - 1.0).abs().sqrt();
    let turn = if damping_ratio < 1.0 { root.cos() } else { root.cosh() };
    // Poles of z² − sum z + decay, with b and c as in Wahlberg.
    let sum = 2.0 * decay.sqrt() * turn;
    let (b, c) = (sum / (1.0 + decay), -decay);
    let [even, odd] = [(1.0 - c * c).sqrt(), ((1.0 - c * c) * (1.0 - b * b)).sqrt()];
    let mut driving = input.to_vec();
    let mut signals = Vec::new();
    for _ in 0..pairs {
        // w = x / (z² − sum z + decay), whose numerators follow by shifts.
        let mut state = vec![0.0; driving.len() + 2];
        for k in 0..driving.len() {
            state[k + 2] = driving[k] + sum * state[k + 1] - decay * state[k];
        }
        let count = driving.len();
        signals.push((0..count).map(|k| even * (state[k + 1] - b * state[k])).collect());
        signals.push((0..count).map(|k| odd * state[k]).collect());
        driving = (0..count).map(|k| decay * state[k + 2] - sum * state[k + 1] + state[k]).collect();
    }
    signals
}

impl Hammerstein {
    /// Contractions in m to commands in V at its sampling, shape `(n_samples,)`.
    pub fn simulate(&self, command: &[f64]) -> Vec<f64> {
        let powers = powers(self.command, self.polynomial.len(), command);
        let bent = combined(&powers, &self.polynomial);
        let filtered = combined(&kautz(self.poles, self.sampling, self.filter.len() / 2, &bent), &self.filter);
        filtered.into_iter().map(|y| self.rest + y).collect()
    }
}

/// Identifies a model from the command and the contraction of a recording, and simulates the physical one beside it.
///
/// # Errors
/// [`Error::Recording`] where command or contraction are missing, the motion is prescribed, or the command never changes; those of the
/// simulation.
pub fn identify(recording: &Recording, parameters: &Parameters) -> Result<Identified> {
    let lacks = |problem: &str| Error::Recording { path: recording.path.clone(), problem: problem.to_owned() };
    let signal = |signal: Signal| {
        recording.bridged(signal).ok_or_else(|| {
            lacks(&format!("a Hammerstein model needs the column `{} [{}]`", signal.name(), signal.unit()))
        })
    };
    let (command, contraction) = (signal(Signal::Command)?, signal(Signal::Contraction)?);
    let [first, .., last] = recording.time[..] else { return Err(lacks("a single sample tells nothing")) };
    let count = recording.time.len();
    let sampling = (last - first) / (count - 1) as f64;
    let time: Vec<f64> = (0..count).map(|k| first + sampling * k as f64).collect();
    let even = |values: &[f64]| -> Vec<f64> { time.iter().map(|t| at(&recording.time, values, *t)).collect() };
    let (command, measured) = (even(&command), even(&contraction));
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let [fitted, chosen] = PARTS.map(|share| (share * count as f64) as usize);
    let data = Data { sampling, command: &command, contraction: &measured, fitted, chosen };
    let model = data.best().ok_or_else(|| {
        lacks("the command changes too little in the first half of the recording, which the model is fitted to")
    })?;
    let replay = replay(parameters, recording)?;
    let physical = replay.get(Signal::Contraction).map(even).ok_or_else(|| {
        lacks("a motion that is prescribed does not follow the command: record a hanging load and give its `load_mass`")
    })?;
    let modelled = model.simulate(&command);
    Ok(Identified { model, time, measured, modelled, physical, held_out: chosen })
}

/// What models are fitted to.
struct Data<'a> {
    sampling: f64,
    command: &'a [f64],
    contraction: &'a [f64],
    /// Samples before this one are fitted to.
    fitted: usize,
    /// Samples from there to before this one tell which model is best.
    chosen: usize,
}

impl Data<'_> {
    /// The model with the smallest error on the part for choices.
    fn best(&self) -> Option<Hammerstein> {
        let of = |poles: Vec<Poles>, sizes: Vec<[usize; 2]>| {
            let all: Vec<(Poles, [usize; 2])> =
                poles.iter().flat_map(|poles| sizes.iter().map(|size| (*poles, *size))).collect();
            let fits: Vec<(f64, Hammerstein)> =
                all.into_par_iter().filter_map(|(poles, size)| self.judged(poles, size)).collect();
            fits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, model)| model)
        };
        let [low, high] = FREQUENCIES;
        let step = |k: usize| low * (high / low).powf(k as f64 / (FREQUENCY_COUNT - 1) as f64);
        let frequencies = (0..FREQUENCY_COUNT).map(step);
        let poles = frequencies.flat_map(|natural_frequency| {
            DAMPING_RATIOS.map(|damping_ratio| Poles { natural_frequency, damping_ratio })
        });
        let first = of(poles.collect(), vec![FIRST])?;
        let sizes = (1..=MOST[0]).flat_map(|degree| (1..=MOST[1]).map(move |pairs| [degree, pairs]));
        of(vec![first.poles], sizes.collect())
    }

    /// A fit and its error on the part for choices.
    fn judged(&self, poles: Poles, size: [usize; 2]) -> Option<(f64, Hammerstein)> {
        let model = self.fit(poles, size)?;
        let modelled = model.simulate(self.command);
        let range = self.fitted..self.chosen;
        let error = rms(&self.contraction[range.clone()], &modelled[range]);
        error.is_finite().then_some((error, model))
    }

    fn fit(&self, poles: Poles, [degree, pairs]: [usize; 2]) -> Option<Hammerstein> {
        let seen = &self.command[..self.fitted];
        let [low, high] = [f64::min, f64::max].map(|pick| seen.iter().copied().fold(seen[0], pick));
        let range = [f64::midpoint(low, high), 0.5 * (high - low)];
        if range[1] <= 0.0 {
            return None;
        }
        // signals[i][j]: power i through Kautz function j.
        let signals: Vec<Vec<Vec<f64>>> =
            powers(range, degree, seen).iter().map(|h| kautz(poles, self.sampling, pairs, h)).collect();
        let target = &self.contraction[..self.fitted];
        let products = least_squares(signals.iter().flatten(), target)?;
        let matrix = DMatrix::from_row_slice(degree, 2 * pairs, &products[..degree * 2 * pairs]);
        let svd = matrix.svd(true, true);
        let largest = svd.singular_values.imax();
        let mut a: Vec<f64> = svd.u?.column(largest).iter().copied().collect();
        let (mut b, mut rest) = (vec![0.0; 2 * pairs], 0.0);
        for _ in 0..TURNS {
            let column = |j: usize| combined_by(&a, |i| &signals[i][j], self.fitted);
            let columns: Vec<Vec<f64>> = (0..2 * pairs).map(column).collect();
            b = least_squares(columns.iter(), target)?;
            b.pop();
            let columns: Vec<Vec<f64>> = signals.iter().map(|of_power| combined(of_power, &b)).collect();
            a = least_squares(columns.iter(), target)?;
            rest = a.pop()?;
            let largest = a.iter().copied().fold(0.0, |m: f64, v| if v.abs() > m.abs() { v } else { m });
            a.iter_mut().for_each(|v| *v /= largest);
            b.iter_mut().for_each(|v| *v *= largest);
        }
        Some(Hammerstein { sampling: self.sampling, command: range, polynomial: a, filter: b, poles, rest })
    }
}

/// Powers of the scaled command from the first on, less their values at the first command.
fn powers([centre, half]: [f64; 2], degree: usize, command: &[f64]) -> Vec<Vec<f64>> {
    let scaled = |u: f64| (u - centre) / half;
    let power = |i: usize| {
        let exponent = i32::try_from(i).expect("a small degree");
        command.iter().map(|u| scaled(*u).powi(exponent) - scaled(command[0]).powi(exponent)).collect()
    };
    (1..=degree).map(power).collect()
}

fn combined(signals: &[Vec<f64>], amounts: &[f64]) -> Vec<f64> {
    combined_by(amounts, |i| &signals[i], signals.first().map_or(0, Vec::len))
}

fn combined_by<'a>(amounts: &[f64], of: impl Fn(usize) -> &'a Vec<f64>, count: usize) -> Vec<f64> {
    let mut sum = vec![0.0; count];
    for (i, amount) in amounts.iter().enumerate() {
        sum.iter_mut().zip(of(i)).for_each(|(sum, value)| *sum += amount * value);
    }
    sum
}

/// Amounts of columns, and last of a constant, that come nearest to a target.
fn least_squares<'a>(columns: impl Iterator<Item = &'a Vec<f64>>, target: &[f64]) -> Option<Vec<f64>> {
    let columns: Vec<&Vec<f64>> = columns.collect();
    let width = columns.len() + 1;
    let matrix = DMatrix::from_fn(target.len(), width, |row, k| columns.get(k).map_or(1.0, |column| column[row]));
    if target.len() < width {
        return None;
    }
    let lengths: Vec<f64> = matrix.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    let scaled = DMatrix::from_fn(target.len(), width, |row, k| matrix[(row, k)] / lengths[k]);
    let mut right = DVector::from_column_slice(target);
    let qr = scaled.qr();
    qr.q_tr_mul(&mut right);
    let solved = qr.r().solve_upper_triangular(&right.rows(0, width).into_owned())?;
    let amounts: Vec<f64> = solved.iter().zip(&lengths).map(|(v, length)| v / length).collect();
    amounts.iter().all(|v| v.is_finite()).then_some(amounts)
}

/// Value at a time between samples, by a straight line.
fn at(time: &[f64], values: &[f64], wanted: f64) -> f64 {
    let after = time.partition_point(|t| *t < wanted).clamp(1, time.len() - 1);
    let share = (wanted - time[after - 1]) / (time[after] - time[after - 1]);
    values[after - 1] + share * (values[after] - values[after - 1])
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

impl Identified {
    /// Errors of the model and of the physical one on samples that neither fits nor choices have seen, rms in m.
    pub fn errors(&self) -> [f64; 2] {
        [&self.modelled, &self.physical].map(|all| rms(&self.measured[self.held_out..], &all[self.held_out..]))
    }

    /// What was found in a sentence.
    pub fn sentence(&self) -> String {
        let [own, physical] = self.errors().map(|error| 1e3 * error);
        let Hammerstein { polynomial, filter, poles, .. } = &self.model;
        format!(
            "From {:.1} s on, which the model did not see, it misses the contraction by {own:.2} mm rms and the physical model by \
             {physical:.2} mm. Polynomial of degree {}, {} Kautz functions with poles at {:.2} rad/s, damping ratio {}.",
            self.time[self.held_out],
            polynomial.len(),
            filter.len(),
            poles.natural_frequency,
            poles.damping_ratio
        )
    }

    /// `hammerstein.json` and a plot, as paths in `folder` with their bytes.
    pub fn files(&self, folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let in_mm = |values: &[f64]| values.iter().map(|v| 1e3 * v).collect::<Vec<f64>>();
        let [measured, modelled, physical] = [&self.measured, &self.modelled, &self.physical].map(|v| in_mm(v));
        let x = &self.time;
        let curves = [
            Curve { label: "measured", x, y: &measured, color: 0 },
            Curve { label: "physical model", x, y: &physical, color: 1 },
            Curve { label: "Hammerstein", x, y: &modelled, color: 2 },
        ];
        let title = format!("Command to contraction; not seen by the fit from {:.1} s on", x[self.held_out]);
        let svg = plot(&title, "time [s]", "contraction [mm]", &curves);
        vec![
            (folder.join("hammerstein.json"), format!("{:#}\n", self.to_json()).into_bytes()),
            (folder.join("contraction.svg"), svg.into_bytes()),
        ]
    }

    /// `hammerstein.json`.
    pub fn to_json(&self) -> Value {
        let Hammerstein { sampling, command, polynomial, filter, poles, rest } = &self.model;
        let [own, physical] = self.errors();
        json!({
            "sampling": sampling, "command_centre": command[0], "command_half_range": command[1],
            "polynomial": polynomial, "filter": filter, "rest": rest,
            "natural_frequency": poles.natural_frequency, "damping_ratio": poles.damping_ratio,
            "held_out_from": self.time[self.held_out], "held_out_rms": own, "held_out_rms_of_physical_model": physical,
        })
    }
}
