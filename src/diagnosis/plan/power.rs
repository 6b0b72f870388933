//! How well an experiment tells models apart.
//!
//! # Model
//! λ = min over the rival's parameters of ‖y_A − y_B‖²/σ²: how far a rival B, with its corrections within the tolerance,
//! stays from what a true model A would give, in units of the noise. Readings closer than a tenth of a second hang
//! together and count as one. All experiments are compared with both models to first order in their parameters; where λ
//! decides, the rival is fitted.
//!
//! # Reference
//! Optimal discrimination between models: A. Atkinson, V. Fedorov (1975), doi 10.1093/biomet/62.1.57.

use super::excitations::{EXCITATIONS, Excitation, PROGRAMME};
use super::rivals::Rival;
use super::{Limits, Place};
use crate::GRAVITY;
use crate::diagnosis::hypothesis::{bounds, declared, with_values};
use crate::effects::ValveResonance;
use crate::least_squares::{self, Effort, Ended, Free, dot};
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plant::holding_pressure;
use crate::simulation::{OUTPUTS, replay};
use crate::variables::Variable;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Time between the corners of a planned command, s; it is played twice as finely.
pub const PERIOD: f64 = 0.02;
/// Time in s over which the noise of a sensor hangs together.
const MEMORY: f64 = 0.1;
/// Every how many samples readings are compared.
const THINNED: usize = 2;
/// Cut-off in rad/s of a valve that is shut.
const SHUT: f64 = 1e-9;
/// How much of the range of the pressure is used, tried one after the other until all models stay within the limits.
const SHARES: [f64; 5] = [1.0, 0.85, 0.7, 0.55, 0.4];
/// Contraction at the lowest pressure, as a share of the rest length: the load hangs, the braid is not stretched.
pub const LEAST_CONTRACTION: f64 = 0.01;
/// Lengths at which a muscle is held, as shares of its rest length.
const LOCKED: [f64; 2] = [0.06, 0.14];
/// Of a refit.
const EFFORT: Effort = Effort { iterations: 6, small_decrease: 5e-2, goal: f64::INFINITY };
/// Starts from which a rival of unknown size is fitted.
const STARTS: usize = 2;

/// What every fit may change of the nominal model.
pub type Corrections = Vec<(&'static Variable, Free)>;

/// What the sensors would show, one series per signal of [`OUTPUTS`]; empty where the signal is an input.
pub type Readings = [Vec<f64>; 3];

/// One recording that could be made.
pub struct Run {
    /// The course of the command.
    pub excitation: &'static str,
    /// Where the muscle works.
    pub place: Place,
    /// Its inputs.
    pub recording: Recording,
    /// What every rival would show, thinned.
    readings: Vec<Readings>,
    /// Change of the readings per prior deviation of each correction.
    corrections: Vec<Readings>,
    /// Products of the changes that all parameters make, per signal; see [`Bank::vectors`].
    products: [DMatrix<f64>; 3],
}

impl Run {
    /// How long it takes, s.
    pub fn duration(&self) -> f64 {
        self.recording.time.last().copied().unwrap_or_default()
    }
}

/// The models with what a fit may change of them, and all runs.
pub struct Bank<'a> {
    rivals: &'a [Rival],
    /// The model around which the rivals are looked at.
    reference: Parameters,
    corrections: Corrections,
    /// The runs that stay within the limits.
    pub runs: Vec<Run>,
}

impl<'a> Bank<'a> {
    /// Simulates every rival in every run; `done` is told after each.
    pub fn new(
        rivals: &'a [Rival],
        nominal: &Parameters,
        corrections: Corrections,
        limits: &Limits,
        done: &(dyn Fn(&str) + Sync),
    ) -> Self {
        let known = rivals[0].variants.is_empty();
        let reference = if known { rivals[0].model } else { *nominal };
        let mut bank = Self { rivals, reference, corrections, runs: Vec::new() };
        let wanted = wanted(limits, rivals.len());
        let run = |(excitation, place): (&'static Excitation, Place)| {
            let run = bank.run(excitation, place, limits);
            done(excitation.name);
            run
        };
        let runs: Vec<Run> = wanted.into_par_iter().filter_map(run).collect();
        bank.runs = runs;
        bank
    }

    /// A run with as much of the pressure as the limits allow; `None` where they allow nothing.
    fn run(&self, excitation: &'static Excitation, place: Place, limits: &Limits) -> Option<Run> {
        let (low, high) = pressures(&self.reference, place, limits)?;
        let shares = if place.valve_shut() {
            vec![0.8; samples_in(limits.duration)]
        } else {
            excitation.samples(PERIOD, limits.duration)
        };
        SHARES.iter().find_map(|scale| {
            // Around the middle: a load that drops fast can stretch the braid, as one that jumps can end the stroke.
            let pressures = shares.iter().map(|share| low + (0.5 + scale * (share - 0.5)) * (high - low));
            let recording = inputs(pressures.collect(), place, &self.reference);
            let readings = self.rivals.iter().map(|rival| within(&rival.model, place, &recording, limits));
            let readings = readings.collect::<Option<Vec<_>>>()?;
            let excitation = if place.valve_shut() { "hold with the valve shut" } else { excitation.name };
            Some(self.with_changes(excitation, place, recording, readings))
        })
    }

    fn with_changes(
        &self,
        excitation: &'static str,
        place: Place,
        recording: Recording,
        readings: Vec<Readings>,
    ) -> Run {
        let show = |parameters: &Parameters| simulated(parameters, place, &recording);
        let base = if self.rivals[0].variants.is_empty() { readings.first().cloned() } else { show(&self.reference) };
        let base = base.unwrap_or_default();
        let corrections: Vec<Readings> = self
            .corrections
            .iter()
            .map(|(variable, free)| {
                let (at, step) = (declared(&self.reference, variable.name).1, deviation(free));
                let shifted = with_values(&self.reference, &[variable], &[at + 0.1 * step]);
                difference(show(&shifted), &base, 0.1)
            })
            .collect();
        let mut vectors: Vec<Readings> =
            readings.iter().map(|shown| difference(Some(shown.clone()), &base, 1.0)).collect();
        vectors.extend(corrections.iter().cloned());
        for (rival, shown) in self.rivals.iter().zip(&readings) {
            vectors.extend(rival.variants.iter().map(|variant| difference(show(variant), &base, 1.0)));
            if rival.variants.is_empty() {
                vectors.extend(slopes(rival, shown, &show));
            }
        }
        let products = std::array::from_fn(|signal| {
            DMatrix::from_fn(vectors.len(), vectors.len(), |i, j| dot(&vectors[i][signal], &vectors[j][signal]))
        });
        Run { excitation, place, recording, readings, corrections, products }
    }

    /// Positions of the changes that a rival's own parameters make, among all vectors: first one vector per rival, then
    /// one per correction, then those of each rival in turn.
    fn vectors(&self, rival: usize) -> std::ops::Range<usize> {
        let own = |rival: &Rival| if rival.variants.is_empty() { rival.free.len() } else { rival.variants.len() };
        let before: usize = self.rivals[..rival].iter().map(own).sum();
        let start = self.rivals.len() + self.corrections.len() + before;
        start..start + own(&self.rivals[rival])
    }

    /// Products of all vectors in an experiment, in units of what counts.
    fn products(&self, runs: &[usize], sensors: &[(Signal, f64)]) -> DMatrix<f64> {
        let size = self.runs[runs[0]].products[0].nrows();
        let mut products = DMatrix::zeros(size, size);
        for run in runs {
            for (signal, noise) in sensors {
                products += &self.runs[*run].products[position(*signal)] * weight(*noise).powi(2);
            }
        }
        products
    }

    /// λ of every rival against the model around which they are looked at.
    pub fn seen(&self, runs: &[usize], sensors: &[(Signal, f64)]) -> Vec<f64> {
        let products = self.products(runs, sensors);
        let first = self.rivals.len();
        let corrections: Vec<usize> = (first..first + self.corrections.len()).collect();
        let apart = |rival| DVector::from_fn(products.nrows(), |k, _| if k == rival { 1.0 } else { 0.0 });
        (0..first).map(|rival| left(&products, &apart(rival), &[], &corrections)).collect()
    }

    /// λ of all ordered pairs of rivals, to first order: the row is the true one.
    pub fn screened(&self, runs: &[usize], sensors: &[(Signal, f64)]) -> DMatrix<f64> {
        let products = self.products(runs, sensors);
        let size = products.nrows();
        let known = self.rivals[0].variants.is_empty();
        let lambda = |truth: usize, rival: usize| {
            if truth == rival {
                return 0.0;
            }
            let mut apart = DVector::zeros(size);
            apart[truth] = 1.0;
            if known {
                apart[rival] = -1.0;
            }
            let first = self.rivals.len();
            let corrections: Vec<usize> = (first..first + self.corrections.len()).collect();
            left(&products, &apart, &self.vectors(rival).collect::<Vec<_>>(), &corrections)
        };
        DMatrix::from_fn(self.rivals.len(), self.rivals.len(), lambda)
    }

    /// λ of all ordered pairs of rivals, each rival fitted: the row is the true one.
    pub fn fitted(&self, runs: &[usize], sensors: &[(Signal, f64)]) -> DMatrix<f64> {
        let count = self.rivals.len();
        let all: Vec<f64> = (0..count * count)
            .into_par_iter()
            .map(|k| if k / count == k % count { 0.0 } else { self.refitted(k / count, k % count, runs, sensors) })
            .collect();
        DMatrix::from_row_slice(count, count, &all)
    }

    /// What the best fit of a rival leaves of the readings of the true model.
    fn refitted(&self, truth: usize, rival: usize, runs: &[usize], sensors: &[(Signal, f64)]) -> f64 {
        let (truth_model, rival) = (&self.rivals[truth].model, &self.rivals[rival]);
        let mut variables = rival.free.clone();
        variables.extend(self.corrections.iter().map(|(variable, _)| *variable));
        let residuals = |values: &[f64]| {
            let model = with_values(&rival.model, &variables, values);
            let mut all = Vec::new();
            for run in runs.iter().map(|run| &self.runs[*run]) {
                let shown = simulated(&model, run.place, &run.recording)?;
                all.extend(stacked(&difference(Some(run.readings[truth].clone()), &shown, 1.0), sensors));
            }
            Some(all)
        };
        let known: Vec<Vec<f64>> = (0..self.corrections.len())
            .map(|k| {
                let deviation = deviation(&self.corrections[k].1);
                let slopes = runs.iter().flat_map(|run| stacked(&self.runs[*run].corrections[k], sensors));
                slopes.map(|slope| -slope / deviation).collect()
            })
            .collect();
        let starts = std::iter::once(&rival.model).chain(rival.variants.iter().skip(1)).take(STARTS);
        let fits = starts.map(|start| {
            let mut free = bounds(&rival.free, start);
            free.extend(self.corrections.iter().map(|(variable, free)| {
                // What the true model was corrected by, the rival gets for nothing.
                let mean = declared(truth_model, variable.name).1;
                Free { start: mean, prior: Some((mean, deviation(free))), ..*free }
            }));
            least_squares::fit(&residuals, &free, &known, EFFORT)
        });
        fits.filter(|fit| fit.ended != Ended::NoStart).map(|fit| fit.cost).fold(f64::INFINITY, f64::min)
    }
}

/// The runs that are worth a simulation.
fn wanted(limits: &Limits, rivals: usize) -> Vec<(&'static Excitation, Place)> {
    // For very many rivals the courses that say most.
    const FEW: usize = 6;
    let brief = ["slow stairs", "triangle at three speeds", PROGRAMME];
    let excitations: Vec<_> = EXCITATIONS.iter().filter(|e| rivals <= FEW || brief.contains(&e.name)).collect();
    let mut places: Vec<Place> = limits.load_masses.iter().map(|mass| Place::Load(*mass)).collect();
    if rivals <= FEW {
        // More than the rig may have, for when nothing else helps.
        places.extend(limits.further_load().map(Place::Load));
        places.extend(LOCKED.map(Place::Locked));
    }
    let worth = |excitation: &Excitation, place: &Place| match place {
        Place::Locked(_) => ["slow stairs", "steps of several sizes", "small reversals"].contains(&excitation.name),
        _ => true,
    };
    let both = places.iter().flat_map(|place| excitations.iter().map(move |excitation| (*excitation, *place)));
    let mut all: Vec<_> = both.filter(|(excitation, place)| worth(excitation, place)).collect();
    if rivals <= FEW {
        all.push((&EXCITATIONS[0], Place::ValveShut(limits.load_masses[0])));
    }
    all
}

fn samples_in(duration: f64) -> usize {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let count = (duration / PERIOD) as usize;
    count + 1
}

/// Lowest and highest gauge pressure of a run in Pa; `None` where the limits leave nothing between them.
fn pressures(model: &Parameters, place: Place, limits: &Limits) -> Option<(f64, f64)> {
    let (low, high) = match place {
        Place::Locked(share) if share * model.muscle.rest_length > limits.most_contraction(model) => return None,
        Place::Locked(_) => (0.0, limits.most_pressure),
        Place::Load(mass) | Place::ValveShut(mass) => {
            let holding = |contraction: f64| holding_pressure(model, contraction, mass * GRAVITY);
            let at_top = holding(limits.most_contraction(model));
            // Where no pressure reaches the largest contraction, the area is negative there.
            let high = if at_top > 0.0 { at_top.min(limits.most_pressure) } else { limits.most_pressure };
            (holding(LEAST_CONTRACTION * model.muscle.rest_length).max(0.0), high)
        }
    };
    const LEAST_RANGE: f64 = 2e4;
    (high - low > LEAST_RANGE).then_some((low, high))
}

/// The inputs of a run.
fn inputs(pressures: Vec<f64>, place: Place, model: &Parameters) -> Recording {
    let time: Vec<f64> = (0..pressures.len()).map(|k| k as f64 * PERIOD).collect();
    let constant = |value: f64| vec![value; pressures.len()];
    let mut signals = BTreeMap::new();
    match place {
        Place::Load(mass) => drop(signals.insert(Signal::LoadMass, constant(mass))),
        Place::Locked(share) => drop(signals.insert(Signal::Contraction, constant(share * model.muscle.rest_length))),
        Place::ValveShut(mass) => {
            signals.insert(Signal::LoadMass, constant(mass));
            signals.insert(Signal::GaugePressure, pressures.clone());
        }
    }
    let command = pressures.iter().map(|pressure| (pressure / model.valve.gain * 1e4).round() * 1e-4).collect();
    signals.insert(Signal::Command, command);
    Recording::planned("plan.csv", time, signals)
}

/// The model as the place has it.
fn in_place(model: &Parameters, place: Place) -> Parameters {
    let mut model = *model;
    if place.valve_shut() {
        model.valve.bandwidth = SHUT;
        model.effects.valve_resonance = ValveResonance::default(); // it would regulate whatever the cut-off is
    }
    model
}

/// What the sensors would show in a run, thinned; `None` where the model cannot be simulated.
fn simulated(model: &Parameters, place: Place, recording: &Recording) -> Option<Readings> {
    let replay = replay(&in_place(model, place), recording).ok()?;
    Some(OUTPUTS.map(|signal| replay.get(signal).unwrap_or_default().iter().step_by(THINNED).copied().collect()))
}

/// As [`simulated`]; `None` as well where pressure or contraction leave the limits.
fn within(model: &Parameters, place: Place, recording: &Recording, limits: &Limits) -> Option<Readings> {
    let readings = simulated(model, place, recording)?;
    let (low, high) = (-0.02 * model.muscle.rest_length, limits.most_contraction(model));
    let [pressures, contractions, forces] = &readings;
    let fine = recording.time.iter().step_by(THINNED).enumerate().all(|(k, time)| {
        let since = time - recording.time[0];
        let pressure = pressures.get(k).map(|reading| model.effects.true_pressure(*reading, since));
        let both = contractions.get(k).zip(forces.get(k));
        let contraction = both.map(|(reading, force)| model.effects.true_contraction(*reading, *force, since));
        // A simulation of numbers: half a percent is no excess.
        pressure.is_none_or(|pressure| pressure <= 1.005 * limits.most_pressure)
            && contraction.is_none_or(|contraction| (low..=1.005 * high).contains(&contraction))
    });
    fine.then_some(readings)
}

/// Change of a rival's readings per usual change of each of its parameters.
fn slopes(rival: &Rival, shown: &Readings, show: &impl Fn(&Parameters) -> Option<Readings>) -> Vec<Readings> {
    let slope = |(variable, free): (&&'static Variable, Free)| {
        let share = if free.start + 0.01 * free.typical > free.upper { -0.01 } else { 0.01 };
        let shifted = with_values(&rival.model, &[variable], &[free.start + share * free.typical]);
        difference(show(&shifted), shown, share)
    };
    rival.free.iter().zip(bounds(&rival.free, &rival.model)).map(slope).collect()
}

/// (a − b)/per; nothing where there is no a.
fn difference(a: Option<Readings>, b: &Readings, per: f64) -> Readings {
    let mut result = b.clone();
    for (k, series) in result.iter_mut().enumerate() {
        match &a {
            Some(a) => series.iter_mut().zip(&a[k]).for_each(|(b, a)| *b = (a - *b) / per),
            None => series.fill(0.0),
        }
    }
    result
}

fn position(signal: Signal) -> usize {
    OUTPUTS.iter().position(|output| *output == signal).unwrap_or_default()
}

/// What a reading counts, with a noise in SI.
fn weight(noise: f64) -> f64 {
    (PERIOD * THINNED as f64 / MEMORY).sqrt() / noise
}

/// The readings of some sensors in units of what counts.
fn stacked(readings: &Readings, sensors: &[(Signal, f64)]) -> Vec<f64> {
    let weighted = |(signal, noise): &(Signal, f64)| {
        let weight = weight(*noise);
        readings[position(*signal)].iter().map(move |reading| reading * weight).collect::<Vec<_>>()
    };
    sensors.iter().flat_map(weighted).collect()
}

fn deviation(correction: &Free) -> f64 {
    correction.prior.map_or(correction.typical, |(_, deviation)| deviation)
}

/// Square of what linear least squares leave of a vector, given the products of all vectors; the corrections cost what
/// they take of their prior.
fn left(products: &DMatrix<f64>, apart: &DVector<f64>, own: &[usize], corrections: &[usize]) -> f64 {
    let columns: Vec<usize> = own.iter().chain(corrections).copied().collect();
    let prior = |k: usize| if k < own.len() { 0.0 } else { 1.0 };
    let size = |k: usize| (products[(columns[k], columns[k])] + prior(k)).max(f64::MIN_POSITIVE).sqrt();
    let normal = DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
        let product = products[(columns[i], columns[j])] + if i == j { prior(i) } else { 0.0 };
        product / (size(i) * size(j))
    });
    let along = products * apart;
    let right = DVector::from_fn(columns.len(), |k, _| along[columns[k]] / size(k));
    // Forms of one effect can be the same to first order: what only rounding tells apart does not count.
    let explained = normal.svd(true, true).solve(&right, 1e-9).map_or(0.0, |solution| solution.dot(&right));
    (apart.dot(&along) - explained).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_what_least_squares_leave() {
        // (1, 1, 0) against (1, 0, 0) leaves 1; a correction (0, 1, 0) with prior 1 takes half of that.
        let vectors = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let products = &vectors * vectors.transpose();
        let apart = DVector::from_row_slice(&[1.0, 0.0, 0.0]);
        assert!((left(&products, &apart, &[1], &[]) - 1.0).abs() < 1e-12);
        assert!((left(&products, &apart, &[1], &[2]) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_muscle_is_not_held_beyond_its_largest_contraction() {
        let model = Parameters::default();
        let limits =
            Limits { most_pressure: 4e5, most_contraction: Some(0.1), load_masses: vec![20.0], duration: 40.0 };
        let allowed = LOCKED.map(|share| pressures(&model, Place::Locked(share), &limits));
        assert_eq!(allowed, [Some((0.0, 4e5)), None]);
    }
}
