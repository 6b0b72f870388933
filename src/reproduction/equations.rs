//! Formulas as printed, beside what is used here.

use crate::muscle::{ForceModelName, Muscle};
use crate::parameters::Parameters;
use std::f64::consts::PI;

/// Gauge pressure in Pa at which formulas are evaluated, on the long muscle.
pub const PRESSURE: f64 = 1e5;
/// Contraction in m at which they are.
pub const CONTRACTION: f64 = 0.1;

/// The long muscle where formulas are evaluated.
struct At {
    parameters: Parameters,
    length: f64,
    diameter: f64,
    rest_diameter: f64,
    angle: f64,
    rest_angle: f64,
}

impl At {
    fn new() -> Self {
        let parameters = Parameters::default();
        let muscle = &parameters.muscle;
        let length = muscle.rest_length - CONTRACTION;
        Self {
            parameters,
            length,
            diameter: muscle.diameter(CONTRACTION),
            rest_diameter: muscle.diameter(0.0),
            angle: (length / muscle.thread_length).acos(),
            rest_angle: (muscle.rest_length / muscle.thread_length).acos(),
        }
    }

    fn muscle(&self, model: ForceModelName) -> Muscle {
        Muscle { force_model: model, ..self.parameters.muscle }
    }

    /// Virtual area of a model, m².
    fn area(&self, model: ForceModelName) -> f64 {
        self.parameters.force_models.virtual_area(&self.muscle(model), PRESSURE, CONTRACTION)
    }

    /// Elastic force of a model, N.
    fn elastic(&self, model: ForceModelName) -> f64 {
        self.parameters.force_models.elastic_force(&self.muscle(model), CONTRACTION)
    }

    /// Force of a model, N.
    fn force(&self, model: ForceModelName) -> f64 {
        self.parameters.force_models.force(&self.muscle(model), PRESSURE, CONTRACTION)
    }
}

/// A formula as printed and what holds, SI, at [`PRESSURE`] and [`CONTRACTION`] of the long muscle.
///
/// # Panics
/// For a number that is not there.
pub fn both(number: &str) -> [f64; 2] {
    let at = At::new();
    let Muscle { rest_length, thread_length: b, turns: n, .. } = at.parameters.muscle;
    let (length, diameter, rest_diameter, angle) = (at.length, at.diameter, at.rest_diameter, at.angle);
    let ideal = PRESSURE * at.area(ForceModelName::McKibben);
    // Strains along the muscle, around it, and after Pythagoras.
    let along = (length - rest_length) / rest_length;
    let around = (diameter - rest_diameter) / rest_diameter;
    let rubber = along.hypot(around);
    // Ends after eqs. 3.16 to 3.18.
    let radius = 0.5 * diameter;
    let beyond = radius - 0.5 * at.parameters.force_models.rounded_ends.end_diameter;
    match number {
        "3.2" => [-ideal, ideal],
        "3.6" => {
            let volume = b.powi(3) * angle.cos() * angle.sin().powi(2) / (4.0 * n * n * PI);
            [volume, at.parameters.muscle.volume(CONTRACTION)]
        }
        "3.7" => [PRESSURE * b * b * (angle.cos().powi(2) - 1.0) / (4.0 * PI * n * n), ideal],
        "3.8" => {
            let turns = (rest_length.powi(2) - length.powi(2)).sqrt()
                / (PI * (diameter.powi(2) - rest_diameter.powi(2)).sqrt());
            [turns, n]
        }
        "3.9" => [(n * PI * rest_diameter / (rest_length * n)).atan(), at.rest_angle],
        "3.10" => {
            let ratio = (rest_length.powi(2) - length.powi(2)) / (diameter.powi(2) - rest_diameter.powi(2));
            [(ratio * rest_diameter / rest_length).atan(), at.rest_angle]
        }
        "3.11" => {
            let mut parameters = at.parameters;
            parameters.muscle.force_model = ForceModelName::TonduLopez;
            parameters.force_models.tondu_lopez.alpha = 3.0 / at.rest_angle.tan().powi(2);
            parameters.force_models.tondu_lopez.beta = 1.0 / at.rest_angle.sin().powi(2);
            [parameters.force_models.force(&parameters.muscle, PRESSURE, CONTRACTION), ideal]
        }
        "3.16" => {
            let cap = 0.5 * beyond / angle.sin().powi(2);
            [2.0 * PI * beyond.powi(3) / angle.tan(), 2.0 * PI / 3.0 * (3.0 * cap - beyond) * beyond.powi(2)]
        }
        "3.20" => {
            let printed = beyond.powi(3) * (2.0 * PI - PI / angle.tan()) / (n * PI * radius);
            [printed, at.area(ForceModelName::RoundedEnds) - ideal / PRESSURE]
        }
        "3.23" => {
            let end = at.parameters.force_models.variable_diameter.end_diameter;
            let volume = |length: f64| {
                let around = (b * b - length * length).sqrt();
                let sum = 3.0 * (end * PI * n).powi(2) + 4.0 * end * PI * n * around + 8.0 * around * around;
                length * sum / (60.0 * PI * n * n)
            };
            let step = 1e-5;
            let change = (volume(length + step) - volume(length - step)) / (2.0 * step);
            [-change, at.area(ForceModelName::VariableDiameter)]
        }
        "3.24" => {
            let elastic = at.elastic(ForceModelName::MooneyRivlin);
            [-elastic, elastic]
        }
        "3.28" => [mooney_rivlin_as_printed(&at), at.elastic(ForceModelName::MooneyRivlin)],
        "3.35" => [rubber * angle.sin(), along.abs()],
        "3.36" => [rubber * angle.cos(), around],
        "3.37" => {
            let thickness = at.parameters.force_models.improved_mckibben.membrane_thickness;
            let exact = PI / 4.0 * (diameter.powi(2) - (diameter - 2.0 * thickness).powi(2));
            [PI * diameter * thickness, exact]
        }
        "3.40" => {
            let membrane = &at.parameters.force_models.improved_mckibben;
            let stress = membrane.modulus(length / rest_length) * along;
            let elastic = at.elastic(ForceModelName::ImprovedMcKibben);
            [elastic - 2.0 * stress * PI * diameter * membrane.membrane_thickness, elastic]
        }
        "3.43" => [PRESSURE * (3.0 * length.powi(2) + b * b) / (4.0 * PI * n * n), ideal],
        "4.13" => {
            let spring = &at.parameters.force_models.spring;
            // Above the low range alone.
            let pressure = 2e5;
            let stretch = spring.high_u0 + pressure * (spring.high_u1 + pressure * spring.high_u2) - CONTRACTION;
            let muscle = at.muscle(ForceModelName::Spring);
            let force = at.parameters.force_models.force(&muscle, pressure, CONTRACTION);
            [force + spring.high_c1 * (stretch.powi(2) - stretch.powi(3)), force]
        }
        "4.21" => {
            let mut parameters = at.parameters;
            parameters.muscle.force_model = ForceModelName::TonduLopezKq;
            let kq = &mut parameters.force_models.tondu_lopez_kq;
            (kq.high_k, kq.high_q) =
                kq.two_points(&parameters.muscle, PRESSURE, at.force(ForceModelName::VirtualArea), 0.1);
            let force = |contraction| parameters.force_models.force(&parameters.muscle, PRESSURE, contraction);
            [force(0.0) - force(0.1), at.force(ForceModelName::VirtualArea)]
        }
        _ => panic!("there is no formula {number}"),
    }
}

/// V_b (S₁ + S₂ + S₃ + S₄) of eqs. 3.28 to 3.31 to the letter, N, with the sign that lessens the pull.
fn mooney_rivlin_as_printed(at: &At) -> f64 {
    let rubber = &at.parameters.force_models.mooney_rivlin;
    let Muscle { rest_length: l, turns: n, .. } = at.parameters.muscle;
    let (c10, c01) = (rubber.c10, rubber.c01);
    let stretch = at.length / l;
    let around = n * n * PI * PI * (0.5 * at.rest_diameter).powi(2);
    let narrowing = -4.0 * around + l * l * (stretch * stretch - 1.0);
    let s1 = 4.0 * (c10 + c01) * l * l * (stretch.powi(4) - 1.0) / (2.0 * (l * stretch).powi(3));
    let s2 = 4.0 * l.powi(6) * (stretch - 1.0) * stretch.powi(2) * (1.0 + stretch) * (c10 + c01 * stretch * stretch)
        / narrowing.powi(2);
    let s3 = -4.0 * l.powi(4) * (c10 + c01 * stretch.powi(4)) / narrowing;
    let s4 = -l.powi(4) * stretch.powi(4) * (c10 + c01 * (2.0 * stretch * stretch - 1.0)) / around;
    let volume = PI * at.rest_diameter * l * rubber.membrane_thickness;
    volume * (s1 + s2 + s3 + s4)
}
