//! What is computed for the comparison, from the reconstructed points and the presets.

use crate::closed_loop::{Unknown, cases, outcome};
use crate::comparison::assess::{Assessed, LOW};
use crate::comparison::cross::{Cross, Transfer, between};
use crate::comparison::dynamic::{Passage, TRAJECTORIES, simulated, trajectory};
use crate::comparison::errors::{Errors, levels, pressure};
use crate::comparison::isometric::Relation;
use crate::comparison::{OnMuscle, assess_all};
use crate::identification::points::{Branch, Point, Points, range};
use crate::identification::structure::{Braid, all_models, forces, model_name};
use crate::measurement::Recording;
use crate::muscle::ForceModelName;
use crate::parameters::Parameters;
use crate::plant::equilibrium;
use crate::tuning::linear::{LinearPlant, roots};
use crate::{Error, GRAVITY, Result};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Deserialize;
use std::path::Path;

/// Points of the thesis' muscles, reconstructed: preset and recording.
const MUSCLES: [(&str, &str); 2] = [
    ("dmsp-40-1000", include_str!("../../data/reconstructed/dmsp_40_1000_reconstructed.csv")),
    ("dmsp-40-290", include_str!("../../data/reconstructed/dmsp_40_290_reconstructed.csv")),
];
/// Models that the thesis fits and shows.
const MODELS: [ForceModelName; 4] =
    [ForceModelName::McKibben, ForceModelName::TonduLopez, ForceModelName::ImprovedMcKibben, ForceModelName::Spring];
/// Isometric curves, as in thesis figure 4.23.
pub const ISOMETRIC: usize = 5;
/// Pressures of the thesis' static experiments, Pa.
pub fn pressures() -> Vec<f64> {
    (1..=9).map(|k| 0.5e5 * f64::from(k)).collect()
}

/// One of the thesis' muscles.
pub struct Muscle {
    /// Its preset: the virtual-area model as printed.
    pub printed: Parameters,
    /// All reconstructed points.
    pub points: Vec<Point>,
    /// Those from 1 bar on where the muscle is not stretched, with the models fitted to them.
    pub above: OnMuscle,
}

/// What the quantities are computed from.
pub struct Basis {
    /// The long and the short muscle.
    pub muscles: [Muscle; 2],
    /// Parameters of the one on the other.
    pub cross: Vec<Cross>,
}

/// Something to compute; contractions in m, pressures in bar and masses in kg, as the thesis counts.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "of", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Quantity {
    /// A definition.
    Constant {
        /// Its value, SI.
        value: f64,
    },
    /// A parameter of a preset.
    Parameter {
        /// The preset.
        preset: String,
        /// Full name.
        name: String,
    },
    /// Contraction at which the printed virtual-area model holds a load.
    Contraction {
        /// Preset.
        muscle: String,
        /// Gauge pressure.
        bar: f64,
        /// Load.
        kg: f64,
    },
    /// The same over the length at rest.
    Strain {
        /// Preset.
        muscle: String,
        /// Gauge pressure.
        bar: f64,
        /// Load.
        kg: f64,
    },
    /// Force of a preset without pressure.
    ElasticForce {
        /// The preset.
        preset: String,
        /// Contraction.
        contraction: f64,
    },
    /// Force of a preset.
    Force {
        /// The preset.
        preset: String,
        /// Gauge pressure.
        bar: f64,
        /// Contraction.
        contraction: f64,
    },
    /// Diameter of a braid with so many turns, at rest.
    RestDiameter {
        /// Preset.
        muscle: String,
        /// Turns, where they are not those of the preset.
        turns: Option<f64>,
    },
    /// 3/tan² of a braid angle in degrees.
    Alpha {
        /// The angle.
        degrees: f64,
    },
    /// 1/sin² of a braid angle in degrees.
    Beta {
        /// The angle.
        degrees: f64,
    },
    /// Braid angle in rad at which 1/sin² is a value.
    AngleOfBeta {
        /// The value.
        beta: f64,
    },
    /// Error of a preset's force at reconstructed points, rms in N; from 1 bar on where the muscle is not stretched.
    Rms {
        /// The preset, without a fit.
        preset: String,
        /// Lowest gauge pressure.
        from: f64,
        /// Highest.
        to: f64,
    },
    /// Error of a model fitted to the reconstructed points from 1 bar on, rms in N.
    FittedRms {
        /// Preset.
        muscle: String,
        /// Model.
        model: String,
    },
    /// A parameter of such a fit.
    Fitted {
        /// Preset.
        muscle: String,
        /// Full name.
        name: String,
    },
    /// Elastic modulus of the membrane in Pa, at a length ratio.
    Modulus {
        /// Preset with the coefficients as printed; a muscle for the fitted ones.
        preset: String,
        /// L/L₀.
        ratio: f64,
    },
    /// Cross-validation of `improved-mckibben`: share of the points at which the modelled force is too low.
    CrossTooLow {
        /// Whose parameters.
        muscle: String,
    },
    /// Share at which it is too high.
    CrossTooHigh {
        /// Whose parameters.
        muscle: String,
    },
    /// The same: error, rms in N.
    CrossRms {
        /// Whose parameters.
        muscle: String,
    },
    /// One quantity over another.
    Ratio {
        /// Numerator.
        part: Box<Quantity>,
        /// Denominator.
        whole: Box<Quantity>,
    },
    /// A coefficient found by the way of sections 4.2.3 and 4.3.1: isometric curves interpolated, a straight line through
    /// each, a polynomial through slopes and intercepts.
    Isometric {
        /// Preset.
        muscle: String,
        /// Which: `area` or `elastic`.
        polynomial: Polynomial,
        /// Power of the contraction.
        power: usize,
    },
    /// Value of such a polynomial at a contraction.
    IsometricAt {
        /// Preset.
        muscle: String,
        /// Which.
        polynomial: Polynomial,
        /// Contraction.
        contraction: f64,
    },
    /// Largest distance in N of an interpolated isometric point from its straight line.
    IsometricBend {
        /// Preset.
        muscle: String,
    },
    /// Largest distance of isobaric contractions from a straight line over the force, over their range.
    IsobaricBend {
        /// Preset.
        muscle: String,
        /// Gauge pressure.
        bar: f64,
    },
    /// Change of the contraction from the lightest to the heaviest load at a pressure, m.
    IsobaricChange {
        /// Preset.
        muscle: String,
        /// Gauge pressure.
        bar: f64,
    },
    /// Largest distance of strokes without load from a parabola over pressure, over their range.
    StrokeBend {
        /// Preset.
        muscle: String,
        /// Lowest gauge pressure.
        from: f64,
    },
    /// Force of the spring above 1 bar less that below, at 1 bar, N.
    SpringJump {
        /// Preset.
        muscle: String,
        /// Contraction.
        contraction: f64,
    },
    /// k of eq. 4.23, from the printed virtual-area model.
    TwoPointK {
        /// Preset.
        muscle: String,
        /// Gauge pressure.
        bar: f64,
    },
    /// q of eq. 4.22, likewise.
    TwoPointQ {
        /// Preset.
        muscle: String,
        /// Gauge pressure.
        bar: f64,
    },
    /// Largest difference in m of the contraction in passing from that at rest, over pressures of 0.5 to 4.5 bar.
    Lag {
        /// Load.
        kg: f64,
        /// Trajectory of Table 4.5, from 1.
        trajectory: usize,
    },
    /// Largest excess in m of the contraction in passing over that at rest while the pressure rises.
    Lead {
        /// Load.
        kg: f64,
        /// Last trajectory of Table 4.5 that counts, from 1.
        last: usize,
    },
    /// Largest real part of the poles of valve, muscle and load at half the stroke, 1/s.
    OpenLoopPole {
        /// Preset.
        muscle: String,
        /// Load.
        kg: f64,
    },
    /// Smallest damping ratio of the closed loop that eq. 5.5 and Table 5.1 make.
    PrintedLoopDamping {
        /// Load.
        kg: f64,
        /// Pole of the valve as printed, rad/s.
        bandwidth: f64,
    },
    /// Gain of the valve at a frequency, over that at rest.
    ValveGain {
        /// The frequency, Hz.
        hertz: f64,
    },
    /// Largest control error of the printed controller in the simulations of section 5.4, over the stroke.
    ControlError {
        /// Preset.
        muscle: String,
        /// Bandwidth of the valve, rad/s; where there is none, that of the preset.
        bandwidth: Option<f64>,
    },
}

/// A polynomial of the virtual-area model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Polynomial {
    /// A of eq. 4.6, a straight line.
    Area,
    /// b of eq. 4.7, a cubic.
    Elastic,
}

/// Pa in a bar.
const BAR: f64 = 1e5;
/// Contractions in m beyond this share of the length are none of a FESTO muscle.
pub const STROKE: f64 = 0.25;

impl Muscle {
    fn new(preset: &str, csv: &str) -> Result<Self> {
        let printed = Parameters::preset(preset)?;
        let file = format!("{}_reconstructed.csv", preset.replace('-', "_"));
        let recording = Recording::parse(csv.as_bytes(), Path::new(&file), &[])?;
        let points = Points::of(&[recording], 0)?;
        let mut above = points.clone();
        above.all.retain(|point| point.gauge_pressure >= LOW && point.contraction >= 0.0);
        let models = assess_all(&MODELS, &printed, &above, &[Braid::Given]);
        let above = OnMuscle { name: preset.to_owned(), given: printed, points: above, models, effective: 0.0 };
        Ok(Self { printed, points: points.all, above })
    }

    /// A model fitted to the points from 1 bar on.
    pub fn fitted(&self, model: ForceModelName) -> &Assessed {
        let is = |assessed: &&Assessed| assessed.fitted.structure.model == model;
        self.above.models.iter().find(is).expect("it is one of those that are fitted")
    }

    /// Contractions of isometric curves in m, each with its points: pressure in Pa and force in N.
    pub fn isometric(&self) -> Vec<(f64, Vec<(f64, f64)>)> {
        let relation = Relation::of(&self.points, None);
        relation.contractions(ISOMETRIC).into_iter().map(|x| (x, relation.isometric(x))).collect()
    }

    /// Slope in m² and intercept in N of the straight line through each isometric curve, with its contraction.
    pub fn isometric_lines(&self) -> Vec<(f64, [f64; 2])> {
        let line = |(x, pairs): (f64, Vec<(f64, f64)>)| {
            let line = polynomial(&pairs, 1);
            (x, [line[1], line[0]])
        };
        self.isometric().into_iter().map(line).collect()
    }

    /// Coefficients by rising powers of a polynomial through slopes or intercepts.
    fn coefficients(&self, which: Polynomial) -> Vec<f64> {
        let (column, degree) = if which == Polynomial::Area { (0, 1) } else { (1, 3) };
        let pairs: Vec<(f64, f64)> = self.isometric_lines().iter().map(|(x, line)| (*x, line[column])).collect();
        polynomial(&pairs, degree)
    }

    /// Contraction in m at which the printed virtual-area model holds a load in kg at a gauge pressure in Pa.
    pub fn contraction(&self, gauge_pressure: f64, mass: f64) -> Option<f64> {
        equilibrium(&self.printed, gauge_pressure, mass * GRAVITY)
    }

    /// Gauge pressures in Pa with the contraction in m of the muscle without a load, within its stroke.
    pub fn strokes(&self, from: f64) -> Vec<(f64, f64)> {
        let longest = STROKE * self.printed.muscle.rest_length;
        let steps = (0..=40).map(|k| 1e4 * f64::from(k) + 0.5e5).filter(|p| *p >= from);
        let within = |p: f64| self.contraction(p, 0.0).filter(|x| *x <= longest).map(|x| (p, x));
        steps.filter_map(within).collect()
    }
}

/// Coefficients by rising powers of the polynomial of a degree through points, by least squares.
fn polynomial(points: &[(f64, f64)], degree: usize) -> Vec<f64> {
    // In units of the largest, so that the powers are of one magnitude.
    let size = points.iter().map(|(x, _)| x.abs()).fold(f64::MIN_POSITIVE, f64::max);
    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)]
    let powers = DMatrix::from_fn(points.len(), degree + 1, |row, power| (points[row].0 / size).powi(power as i32));
    let values = DVector::from_iterator(points.len(), points.iter().map(|(_, y)| *y));
    let solved = powers.svd(true, true).solve(&values, 1e-12).expect("both sides of the decomposition are there");
    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)]
    solved.iter().enumerate().map(|(power, value)| value / size.powi(power as i32)).collect()
}

/// Largest distance of points from such a polynomial.
fn bend(points: &[(f64, f64)], degree: usize) -> f64 {
    let found = polynomial(points, degree);
    points.iter().map(|(x, y)| (y - value(&found, *x)).abs()).fold(0.0, f64::max)
}

/// Value of a polynomial.
fn value(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// The same, over the range of the values.
fn relative_bend(points: &[(f64, f64)], degree: usize) -> f64 {
    bend(points, degree) / range(&points.iter().map(|(_, y)| *y).collect::<Vec<_>>())
}

/// Errors of the force of parameters at points; not a number where there is no point.
pub fn errors(parameters: &Parameters, points: &[Point]) -> f64 {
    let modelled = forces(parameters, points);
    let pairs = points.iter().zip(modelled).map(|(point, force)| (point.force - force, point.force));
    Errors::of(pairs).map_or(f64::NAN, |errors| errors.rms)
}

impl Basis {
    /// Points and fits.
    ///
    /// # Errors
    /// Those of [`Points::of`].
    pub fn new() -> Result<Self> {
        let muscles = MUSCLES.par_iter().map(|(preset, csv)| Muscle::new(preset, csv)).collect::<Result<Vec<_>>>()?;
        let muscles: [Muscle; 2] = muscles.try_into().ok().expect("there are two");
        let [long, short] = &muscles;
        let of = |muscle: &Muscle| OnMuscle {
            name: muscle.above.name.clone(),
            given: muscle.printed,
            points: muscle.above.points.clone(),
            models: muscle.above.models.clone(),
            effective: muscle.above.effective,
        };
        let cross = between(&[of(long), of(short)]);
        Ok(Self { muscles, cross })
    }

    /// A muscle by the beginning of a preset's name.
    pub fn muscle(&self, preset: &str) -> Result<&Muscle> {
        let base = preset.split('/').next().unwrap_or_default();
        let known = || MUSCLES.map(|(name, _)| name).join(", ");
        let found = self.muscles.iter().find(|muscle| muscle.above.name == base);
        found.ok_or_else(|| Error::UnknownPreset { name: preset.to_owned(), known: known() })
    }

    fn cross(&self, of: &str) -> &Cross {
        let is = |cross: &&Cross| {
            cross.of == of && cross.model == "improved-mckibben" && cross.transfer == Transfer::AsTheyAre
        };
        self.cross.iter().find(is).expect("both muscles have the model")
    }

    /// A quantity, SI.
    ///
    /// # Errors
    /// Those of presets and simulations.
    pub fn value(&self, quantity: &Quantity) -> Result<f64> {
        Ok(match quantity {
            Quantity::Constant { value } => *value,
            Quantity::Parameter { preset, name } => Parameters::preset(preset)?.get(name)?,
            Quantity::Contraction { muscle, bar, kg } => {
                self.muscle(muscle)?.contraction(bar * BAR, *kg).unwrap_or(f64::NAN)
            }
            Quantity::Strain { muscle, bar, kg } => {
                let muscle = self.muscle(muscle)?;
                muscle.contraction(bar * BAR, *kg).unwrap_or(f64::NAN) / muscle.printed.muscle.rest_length
            }
            Quantity::Force { preset, bar, contraction } => {
                let Parameters { muscle, force_models, .. } = Parameters::preset(preset)?;
                force_models.force(&muscle, bar * BAR, *contraction)
            }
            Quantity::ElasticForce { preset, contraction } => {
                let Parameters { muscle, force_models, .. } = Parameters::preset(preset)?;
                force_models.elastic_force(&muscle, *contraction)
            }
            Quantity::RestDiameter { muscle, turns } => {
                let mut braid = self.muscle(muscle)?.printed.muscle;
                braid.turns = turns.unwrap_or(braid.turns);
                braid.diameter(0.0)
            }
            Quantity::Alpha { degrees } => 3.0 / degrees.to_radians().tan().powi(2),
            Quantity::Beta { degrees } => 1.0 / degrees.to_radians().sin().powi(2),
            Quantity::AngleOfBeta { beta } => (1.0 / beta).sqrt().asin(),
            Quantity::Rms { preset, from, to } => {
                let inside = |point: &Point| (from * BAR..=to * BAR).contains(&point.gauge_pressure);
                let muscle = self.muscle(preset)?;
                let points = if from * BAR >= LOW { &muscle.above.points.all } else { &muscle.points };
                let points = points.iter().filter(|point| inside(point)).copied();
                errors(&Parameters::preset(preset)?, &points.collect::<Vec<_>>())
            }
            Quantity::FittedRms { muscle, model } => {
                let named = all_models().into_iter().find(|known| model_name(*known) == model);
                self.muscle(muscle)?.fitted(named.expect("a model that there is")).errors.rms
            }
            Quantity::Fitted { muscle, name } => {
                let fits = &self.muscle(muscle)?.above.models;
                let of = |fit: &Assessed| fit.fitted.structure.free.iter().any(|free| free.variable.name == name);
                let fit = fits.iter().find(|fit| of(fit)).ok_or(Error::UnknownParameter { name: name.clone() })?;
                fit.fitted.parameters.get(name)?
            }
            Quantity::Modulus { preset, ratio } => self.membrane(preset)?.modulus(*ratio),
            Quantity::CrossTooLow { muscle } => self.cross(muscle).too_low,
            Quantity::CrossTooHigh { muscle } => 1.0 - self.cross(muscle).too_low,
            Quantity::CrossRms { muscle } => self.cross(muscle).errors.rms,
            Quantity::Ratio { part, whole } => self.value(part)? / self.value(whole)?,
            Quantity::Isometric { muscle, polynomial, power } => self.muscle(muscle)?.coefficients(*polynomial)[*power],
            Quantity::IsometricAt { muscle, polynomial, contraction } => {
                value(&self.muscle(muscle)?.coefficients(*polynomial), *contraction)
            }
            Quantity::IsometricBend { muscle } => {
                let curves = self.muscle(muscle)?.isometric();
                curves.iter().map(|(_, pairs)| bend(pairs, 1)).fold(0.0, f64::max)
            }
            Quantity::IsobaricBend { muscle, bar } => relative_bend(&self.isobaric(muscle, *bar)?, 1),
            Quantity::IsobaricChange { muscle, bar } => {
                let pairs = self.isobaric(muscle, *bar)?;
                pairs.last().map_or(f64::NAN, |last| last.1 - pairs[0].1)
            }
            Quantity::StrokeBend { muscle, from } => relative_bend(&self.muscle(muscle)?.strokes(from * BAR), 2),
            Quantity::SpringJump { muscle, contraction } => {
                let mut parameters = Parameters::preset(&format!("{muscle}/spring"))?;
                let mut force = |start: f64| {
                    let spring = &mut parameters.force_models.spring;
                    (spring.blend_start, spring.blend_end) = (start, start + 1.0);
                    parameters.force_models.force(&parameters.muscle, BAR, *contraction)
                };
                force(0.5 * BAR) - force(2.0 * BAR)
            }
            Quantity::TwoPointK { muscle, bar } => self.two_points(muscle, *bar)?.0,
            Quantity::TwoPointQ { muscle, bar } => self.two_points(muscle, *bar)?.1,
            Quantity::Lag { kg, trajectory } => {
                let passages = self.passages(*kg, *trajectory)?;
                passages.iter().map(|p| (p.dynamic - p.at_rest).abs()).fold(0.0, f64::max)
            }
            Quantity::Lead { kg, last } => {
                let mut most = f64::NEG_INFINITY;
                for number in 1..=*last {
                    let rising = self.passages(*kg, number)?.into_iter();
                    let rising = rising.filter(|p| p.branch == Branch::Shortening);
                    most = rising.map(|p| p.dynamic - p.at_rest).fold(most, f64::max);
                }
                most
            }
            Quantity::OpenLoopPole { muscle, kg } => {
                let mut parameters = self.muscle(muscle)?.printed;
                parameters.load.mass = *kg;
                let half = 0.5 * STROKE * parameters.muscle.rest_length;
                let poles = roots(&LinearPlant::at(&parameters, half).denominator());
                poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max)
            }
            Quantity::PrintedLoopDamping { kg, bandwidth } => printed_loop_damping(*kg, *bandwidth)?,
            Quantity::ValveGain { hertz } => {
                let ratio = std::f64::consts::TAU * hertz / Parameters::default().valve.bandwidth;
                1.0 / 1.0_f64.hypot(ratio)
            }
            Quantity::ControlError { muscle, bandwidth } => {
                let mut parameters = Parameters::preset(&format!("{muscle}/thesis"))?;
                parameters.valve.bandwidth = bandwidth.unwrap_or(parameters.valve.bandwidth);
                let cases = cases().into_iter().filter(|case| case.muscle == muscle).collect::<Vec<_>>();
                let stroke = parameters.reference.target - parameters.reference.start;
                let error = |case| Ok(outcome(&parameters, case, &Unknown::default())?.largest_error / stroke);
                cases.par_iter().map(error).collect::<Result<Vec<_>>>()?.into_iter().fold(0.0, f64::max)
            }
        })
    }

    /// The membrane of a preset, or of the fit where it is a muscle.
    fn membrane(&self, preset: &str) -> Result<crate::muscle::ImprovedMcKibben> {
        if preset.contains('/') {
            return Ok(Parameters::preset(preset)?.force_models.improved_mckibben);
        }
        let fit = self.muscle(preset)?.fitted(ForceModelName::ImprovedMcKibben);
        Ok(fit.fitted.parameters.force_models.improved_mckibben)
    }

    /// Forces in N with contractions in m at a pressure in bar, by rising force.
    fn isobaric(&self, muscle: &str, bar: f64) -> Result<Vec<(f64, f64)>> {
        let points = &self.muscle(muscle)?.points;
        let near = |value: f64| (value - bar * BAR).abs() < 0.01 * BAR;
        let level = levels(points, pressure).into_iter().flatten().find(|level| near(level.value));
        let members = level.map(|level| level.members).unwrap_or_default();
        let mut pairs: Vec<(f64, f64)> = members.iter().map(|&k| (points[k].force, points[k].contraction)).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(pairs)
    }

    /// k and q of eqs. 4.22 and 4.23 from the printed virtual-area model.
    fn two_points(&self, muscle: &str, bar: f64) -> Result<(f64, f64)> {
        let muscle = self.muscle(muscle)?;
        let Parameters { muscle: braid, force_models, .. } = &muscle.printed;
        let pull = force_models.force(braid, bar * BAR, 0.0);
        let stroke = muscle.contraction(bar * BAR, 0.0).unwrap_or(f64::NAN);
        Ok(force_models.tondu_lopez_kq.two_points(braid, bar * BAR, pull, stroke))
    }

    /// Passages of the long muscle at the pressures of the static experiments that it reaches within its stroke.
    pub fn passages(&self, mass: f64, number: usize) -> Result<Vec<Passage>> {
        let [long, _] = &self.muscles;
        let longest = STROKE * long.printed.muscle.rest_length;
        let within = |p: &f64| long.contraction(*p, mass).is_some_and(|x| x <= longest);
        let pressures: Vec<f64> = pressures().into_iter().filter(within).collect();
        let [first, last] = [pressures[0], pressures[pressures.len() - 1]];
        let played = trajectory(&long.printed, TRAJECTORIES[number - 1], [0.9 * first, last + 0.1 * BAR], mass);
        simulated(&long.printed, &played, &pressures)
    }
}

/// Smallest damping ratio of the poles of 1 + C G, C of eq. 5.7 with Table 5.1 and G of eq. 5.5, as printed.
fn printed_loop_damping(mass: f64, bandwidth: f64) -> Result<f64> {
    let parameters = Parameters::preset("dmsp-40-1000/thesis")?;
    let controller = &parameters.controller;
    let by = |value: f64| parameters.valve.gain * bandwidth * value;
    let gains = [controller.integral_gain, controller.proportional_gain, controller.derivative_gain].map(by);
    let poles = roots(&[gains[0], gains[1], gains[2], mass * bandwidth, mass]);
    Ok(poles.iter().map(|pole| -pole.re / pole.norm()).fold(f64::INFINITY, f64::min))
}
