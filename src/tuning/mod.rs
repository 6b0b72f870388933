//! Gains of the controller by pole placement on the linearised plant, robust against what the controller does not know.
//!
//! # Model
//! Without filter and dead time the closed loop has four poles, whose sum the gains cannot change. The three gains
//! place a pair with natural frequency ω_n and damping ratio ζ, and the product of the other two, at the middle of the working
//! range. Of all placements with no gain below zero that one is taken whose integral gain is largest (a load that changes in a step leaves the integral error
//! 1/K_i) while the sensitivity peak stays below [`SENSITIVITY_BOUND`] at every operating point, for plants that differ
//! from the known one by all of [`uncertain`] at once.
//!
//! # Reference
//! Thesis section 5.3 (pole placement). K. Åström, H. Panagopoulos, T. Hägglund (1998), Design of PI controllers based on
//! non-convex optimization, doi 10.1016/S0005-1098(98)00011-9 (largest integral gain under a bound of the sensitivity).

pub mod linear;
mod report;

pub use report::{files, to_json};

use crate::controller::{Controller, can_hold};
use crate::parameters::Parameters;
use crate::{Error, Result};
use linear::{LinearPlant, Margins, closed_loop_poles, controller_response, frequencies, product};
use nalgebra::Complex;
use rayon::prelude::*;

/// Largest contraction of the working range, as a share of the rest length: 20 cm of the long muscle.
pub const RANGE: f64 = 0.204;
/// Peak of the sensitivity that no plant may exceed: a gain margin of 2 and a phase margin of 29° at least.
pub const SENSITIVITY_BOUND: f64 = 2.0;
/// Parts of the stroke that are asked whether gains of their own would pay.
const THIRDS: usize = 3;
/// What the names of these parts begin with.
const CONTRACTION: &str = "contraction";
/// Contractions that the working range is divided into.
const CONTRACTIONS: usize = 7;
/// Dead time that a tuned loop bears, s.
pub const DEAD_TIME: f64 = 0.01;
/// Stiffness in N/m of dry friction before it slips: 40 N within 2 mm.
const STUCK: f64 = 40.0 / 2e-3;

/// Where the plant is linearised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OperatingPoint {
    /// Load, kg.
    pub mass: f64,
    /// Contraction, m.
    pub contraction: f64,
}

impl OperatingPoint {
    /// The plant there.
    pub fn plant(&self, parameters: &Parameters) -> LinearPlant {
        let mut parameters = *parameters;
        parameters.load.mass = self.mass;
        // A sampled controller acts half a sample late on average.
        LinearPlant::at(&parameters, self.contraction).delayed(0.5 * parameters.sampling.sample_time)
    }
}

/// Poles that were asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Natural frequency of the pair, rad/s.
    pub natural_frequency: f64,
    /// Damping ratio of the pair.
    pub damping_ratio: f64,
    /// Product of the other two poles, 1/s².
    pub other_product: f64,
}

impl Placement {
    /// The controller that puts the poles of a plant there; the dead time and the filter are left out.
    pub fn controller(&self, plant: &LinearPlant, controller: &Controller) -> Controller {
        let denominator = plant.denominator();
        let sum_of_others = denominator[2] - 2.0 * self.damping_ratio * self.natural_frequency;
        let pair = [self.natural_frequency.powi(2), 2.0 * self.damping_ratio * self.natural_frequency, 1.0];
        let wanted = product(&pair, &[self.other_product, sum_of_others, 1.0]);
        Controller {
            integral_gain: wanted[0] / plant.gain(),
            proportional_gain: (wanted[1] - denominator[0]) / plant.gain(),
            derivative_gain: (wanted[2] - denominator[1]) / plant.gain(),
            ..*controller
        }
    }

    /// The placement with each number multiplied.
    fn scaled(&self, [frequency, damping, product]: [f64; 3]) -> Self {
        Self {
            natural_frequency: self.natural_frequency * frequency,
            damping_ratio: self.damping_ratio * damping,
            other_product: self.other_product * product,
        }
    }
}

/// Margins of a controller at an operating point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMargins {
    /// Where.
    pub point: OperatingPoint,
    /// On the plant that the controller knows.
    pub known: Margins,
    /// On the worst of the plants that it does not know.
    pub uncertain: Margins,
}

/// A tuned controller and what it was judged by.
#[derive(Debug, Clone)]
pub struct Tuning {
    /// The parameters with the tuned gains.
    pub parameters: Parameters,
    /// Operating point whose poles were placed.
    pub design: OperatingPoint,
    /// Poles that were asked for there.
    pub placement: Placement,
    /// Margins at every operating point, by load and contraction.
    pub margins: Vec<PointMargins>,
    /// Margins with the gains that the parameters had before.
    pub before: Vec<PointMargins>,
    /// What gains of its own would bring to each part of the working range.
    pub scheduling: Vec<Part>,
    /// How many operating points the muscle cannot hold within the limits of the command; they are left out.
    pub out_of_reach: usize,
}

/// A part of the working range with gains of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// What the part is.
    pub name: String,
    /// Whether it is a part of the stroke; otherwise it is a load.
    pub is_of_stroke: bool,
    /// Integral gain that it would allow, V/(m s).
    pub integral_gain: f64,
}

impl Tuning {
    /// The operating point at which a sensitivity is largest, on plants that the controller does not know.
    pub fn worst(&self) -> &PointMargins {
        worst(&self.margins)
    }

    /// By how much gains that are scheduled over the contraction could be larger where they are smallest.
    pub fn gain_of_scheduling(&self) -> f64 {
        let parts = self.scheduling.iter().filter(|part| part.is_of_stroke);
        let smallest = parts.map(|part| part.integral_gain).fold(f64::INFINITY, f64::min);
        smallest / self.parameters.controller.integral_gain
    }
}

/// The one with the largest sensitivity.
pub fn worst(margins: &[PointMargins]) -> &PointMargins {
    let by_peak = |a: &&PointMargins, b: &&PointMargins| a.uncertain.sensitivity.total_cmp(&b.uncertain.sensitivity);
    margins.iter().max_by(by_peak).expect("there are operating points")
}

/// Whether the loop of a controller and the muscle that it knows is stable with the load around a contraction in m.
pub fn is_stable(parameters: &Parameters, contraction: f64) -> bool {
    let plant = OperatingPoint { mass: parameters.load.mass, contraction }.plant(parameters);
    closed_loop_poles(&plant, &parameters.controller, 1.0).iter().all(|pole| pole.re < 0.0)
}

/// The operating points of the working range, by load and contraction.
pub fn operating_points(parameters: &Parameters, masses: &[f64]) -> Vec<OperatingPoint> {
    let largest = RANGE * parameters.muscle.rest_length;
    let at = |mass: f64| {
        (0..CONTRACTIONS)
            .map(move |k| OperatingPoint { mass, contraction: largest * k as f64 / (CONTRACTIONS - 1) as f64 })
    };
    masses.iter().copied().flat_map(at).collect()
}

/// Plants at an operating point that differ from the known one: load ± 20 %, force ± 10 %, all with a dead time of
/// 10 ms, and with dry friction that sticks.
pub fn uncertain(parameters: &Parameters, point: &OperatingPoint) -> Vec<LinearPlant> {
    let mut all = Vec::new();
    for load in [0.8, 1.2] {
        for force in [0.9, 1.1] {
            let mut plant = *parameters;
            plant.muscle.area_scale *= force;
            plant.muscle.elastic_scale *= force;
            let plant = OperatingPoint { mass: point.mass * load, ..*point }.plant(&plant).delayed(DEAD_TIME);
            all.extend([plant, plant.stiffened(STUCK)]);
        }
    }
    all
}

/// A plant whose response is at hand at the frequencies that matter.
struct Sampled {
    plant: LinearPlant,
    response: Vec<(f64, Complex<f64>)>,
}

impl Sampled {
    fn of(plant: LinearPlant) -> Self {
        let response = frequencies(&plant, 600).into_iter().map(|at| (at, plant.response(at))).collect();
        Self { plant, response }
    }

    /// Whether a loop keeps its distance from the point −1 everywhere, and is stable.
    fn bears(&self, controller: &Controller) -> bool {
        let distance = |(frequency, plant): &(f64, Complex<f64>)| {
            (plant * controller_response(controller, *frequency) + 1.0).norm_sqr()
        };
        self.response.iter().all(|at| distance(at) >= SENSITIVITY_BOUND.powi(-2))
            && closed_loop_poles(&self.plant, controller, 1.0).iter().all(|pole| pole.re < 0.0)
    }
}

/// Tunes the controller of some parameters for a range of loads in kg, over that part of the working range in which the
/// muscle can hold them.
///
/// # Errors
/// [`Error::Tuning`] where the muscle holds no position, or no gains satisfy the bound; [`Error::OutOfRange`] for what is no load.
pub fn tune(parameters: &Parameters, masses: &[f64]) -> Result<Tuning> {
    let with_load = |mass: f64| -> Result<Parameters> {
        let mut parameters = *parameters;
        parameters.set("load.mass", mass)?;
        Ok(parameters)
    };
    let mut points = Vec::new();
    for point in operating_points(parameters, masses) {
        if can_hold(&with_load(point.mass)?, point.contraction) {
            points.push(point);
        }
    }
    if let Some(mass) = masses.iter().find(|mass| points.iter().all(|point| point.mass != **mass)) {
        let Controller { minimum_command, maximum_command, .. } = parameters.controller;
        let problem = format!(
            "from {minimum_command} to {maximum_command} V the muscle holds {mass} kg nowhere in its working range; try other loads"
        );
        return Err(Error::Tuning { problem });
    }
    let soft = points.iter().find(|point| point.plant(parameters).natural_frequency().max(0.0) == 0.0);
    if let Some(OperatingPoint { mass, contraction }) = soft {
        let problem = format!(
            "the muscle holds no position with {mass} kg at a contraction of {contraction:.3} m; try other loads"
        );
        return Err(Error::Tuning { problem });
    }
    let (design, placement) = place(parameters, &points)?;
    let mut tuned = *parameters;
    tuned.controller = placement.controller(&design.plant(parameters), &parameters.controller);
    let judged = |parameters: &Parameters| points.par_iter().map(|point| judge(parameters, point)).collect();
    Ok(Tuning {
        parameters: tuned,
        design,
        placement,
        margins: judged(&tuned),
        before: judged(parameters),
        scheduling: scheduling(&tuned, masses, &points),
        out_of_reach: masses.len() * CONTRACTIONS - points.len(),
    })
}

/// What gains of their own would bring to thirds of the stroke, and to each load, where the parameters have the gains for all.
fn scheduling(parameters: &Parameters, masses: &[f64], points: &[OperatingPoint]) -> Vec<Part> {
    let third = RANGE * parameters.muscle.rest_length / THIRDS as f64;
    let rounding = 1e-9;
    let mut parts: Vec<(String, Vec<OperatingPoint>)> = Vec::new();
    for k in 0..THIRDS {
        let (low, high) = (k as f64 * third, (k + 1) as f64 * third);
        let within = |p: &&OperatingPoint| p.contraction >= low - rounding && p.contraction <= high + rounding;
        let name = format!("{CONTRACTION} {:.0} to {:.0} mm", 1e3 * low, 1e3 * high);
        parts.push((name, points.iter().filter(within).copied().collect()));
    }
    if masses.len() > 1 {
        for mass in masses {
            parts.push((format!("load {mass} kg"), points.iter().filter(|p| p.mass == *mass).copied().collect()));
        }
    }
    parts.retain(|(_, points)| !points.is_empty()); // nothing is held in the others
    let tuned = |(name, points): (String, Vec<OperatingPoint>)| {
        let (design, placement) = place(parameters, &points).ok()?;
        let own = placement.controller(&design.plant(parameters), &parameters.controller);
        // The search ends at a local optimum; a part bears what the whole does.
        let integral_gain = own.integral_gain.max(parameters.controller.integral_gain);
        Some(Part { is_of_stroke: name.starts_with(CONTRACTION), name, integral_gain })
    };
    parts.into_par_iter().filter_map(tuned).collect()
}

/// Margins at an operating point.
fn judge(parameters: &Parameters, point: &OperatingPoint) -> PointMargins {
    let of = |plant: &LinearPlant| Margins::of(plant, &parameters.controller);
    let worst = uncertain(parameters, point).iter().map(of).max_by(|a, b| {
        (!a.is_stable(), a.sensitivity)
            .partial_cmp(&(!b.is_stable(), b.sensitivity))
            .expect("sensitivities are numbers")
    });
    PointMargins {
        point: *point,
        known: of(&point.plant(parameters)),
        uncertain: worst.expect("there are uncertain plants"),
    }
}

/// The placement with the largest integral gain that all plants bear, and the operating point that it refers to.
fn place(parameters: &Parameters, points: &[OperatingPoint]) -> Result<(OperatingPoint, Placement)> {
    let design = points[points.len() / 2];
    let known = points.iter().map(|point| point.plant(parameters));
    let others = points.iter().flat_map(|point| uncertain(parameters, point));
    let plants: Vec<Sampled> = others.chain(known).map(Sampled::of).collect();
    let at_design = design.plant(parameters);
    let controller = |placement: &Placement| placement.controller(&at_design, &parameters.controller);
    let gain = |placement: &Placement| controller(placement).integral_gain;
    // The first of some placements, by falling integral gain, that all plants bear.
    let best_of = |mut placements: Vec<Placement>| {
        placements.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        placements.into_par_iter().find_first(|placement| {
            let controller = controller(placement);
            controller.proportional_gain >= 0.0 && plants.iter().all(|plant| plant.bears(&controller))
        })
    };
    let natural_frequency = at_design.natural_frequency();
    let spread = |low: f64, high: f64, count: i32| {
        (0..count).map(move |k| low * (high / low).powf(f64::from(k) / f64::from(count - 1)))
    };
    let mut grid = Vec::new();
    for frequency in spread(0.3, 3.0, 20) {
        for damping_ratio in spread(0.02, 1.0, 14) {
            grid.extend(spread(0.003, 3.0, 20).map(|product| Placement {
                natural_frequency: frequency * natural_frequency,
                damping_ratio,
                other_product: product * natural_frequency.powi(2),
            }));
        }
    }
    let Some(mut best) = best_of(grid) else {
        let problem = "no gains hold all loads with 20 % of load, 10 % of force and 10 ms unknown: choose a smaller range of loads";
        return Err(Error::Tuning { problem: problem.to_owned() });
    };
    // Compass search from the best of the grid; all directions at once, so that edges of the bound can be followed.
    let mut size: f64 = 0.15;
    while size > 1e-3 {
        let directions = [-1.0, 0.0, 1.0];
        let all = directions.iter().flat_map(|a| directions.iter().flat_map(|b| directions.map(|c| [*a, *b, c])));
        let around = all.map(|exponents| best.scaled(exponents.map(|exponent| (size * exponent).exp())));
        match best_of(around.filter(|placement| gain(placement) > gain(&best)).collect()) {
            Some(better) => best = better,
            None => size *= 0.5,
        }
    }
    Ok((design, best))
}
