//! The plant linearised at rest, and the loop that a controller closes around it.

use crate::GRAVITY;
use crate::controller::Controller;
use crate::parameters::Parameters;
use crate::plant::{masses, quasi_steady_rates, resting_pressure};
use nalgebra::{Complex, DMatrix};

/// Polynomial in s: coefficients of 1, s, s², …
pub type Polynomial = Vec<f64>;

/// Product of two polynomials.
pub fn product(a: &[f64], b: &[f64]) -> Polynomial {
    let mut product = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        b.iter().enumerate().for_each(|(j, b)| product[i + j] += a * b);
    }
    product
}

/// Sum of two polynomials.
pub fn sum(a: &[f64], b: &[f64]) -> Polynomial {
    let at = |polynomial: &[f64], k| polynomial.get(k).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).map(|k| at(a, k) + at(b, k)).collect()
}

/// Value of a polynomial.
pub fn value(polynomial: &[f64], s: Complex<f64>) -> Complex<f64> {
    polynomial.iter().rev().fold(Complex::new(0.0, 0.0), |sum, coefficient| sum * s + coefficient)
}

/// Derivative of a polynomial.
pub fn derivative(polynomial: &[f64]) -> Polynomial {
    polynomial.iter().enumerate().skip(1).map(|(k, coefficient)| k as f64 * coefficient).collect()
}

/// Roots of a polynomial whose highest coefficient is not zero, as eigenvalues of its companion matrix.
pub fn roots(polynomial: &[f64]) -> Vec<Complex<f64>> {
    let degree = polynomial.len() - 1;
    // In units of the mean size of the roots, so that the coefficients are of one magnitude.
    let size = (polynomial[0] / polynomial[degree]).abs().powf(1.0 / degree as f64);
    let size = if size > 0.0 { size } else { 1.0 };
    let scaled = |k: usize| polynomial[k] / polynomial[degree] * size.powf(k as f64 - degree as f64);
    let companion = DMatrix::from_fn(degree, degree, |row, column| match (row, column) {
        (_, column) if column == degree - 1 => -scaled(row),
        (row, column) if row == column + 1 => 1.0,
        _ => 0.0,
    });
    companion.complex_eigenvalues().iter().map(|root| root * size).collect()
}

/// Velocity in m/s at which dry friction slips: the fastest of thesis section 5.4.
const SLIPPING: f64 = 0.05;

/// Valve, muscle and load at rest, linearised.
///
/// # Model
/// d/dt (p, x, v) = `rates` (p, x, v) + `input` u: deviations of gauge pressure in Pa, contraction in m, its velocity in m/s and the command in
/// V; the command acts after a `dead_time`. The transfer function from u to x is b e^(−sθ)/(s³ + d₂ s² + d₁ s + d₀).
///
/// # Validity
/// States of effects follow at once, but what comes after a first order of the valve is dead time, as long as it is late on average: a valve
/// that rings is taken for one that does not. Damping is the least of that at rest and that in motion.
///
/// # Reference
/// Thesis eq. 5.5 drops the stiffness −∂F/∂x, the damping and the area ∂F/∂p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearPlant {
    /// Derivatives of the rates by the states.
    pub rates: [[f64; 3]; 3],
    /// Derivative of the rate of the pressure by the command, Pa/(V s).
    pub input: f64,
    /// Dead time of the command, s.
    pub dead_time: f64,
    /// Mass that moves, kg.
    pub mass: f64,
}

impl LinearPlant {
    /// The plant with its load at rest at a contraction in m; by central differences of the model's own equations.
    pub fn at(parameters: &Parameters, contraction: f64) -> Self {
        let (weighing, mass) = masses(parameters, contraction);
        let pressure = resting_pressure(parameters, contraction, weighing * GRAVITY);
        let rest = [pressure, contraction, 0.0];
        let command = pressure / parameters.valve.gain;
        let rates_at = |states: &[f64; 3], command: f64| quasi_steady_rates(parameters, *states, command);
        let mut rates = [[0.0; 3]; 3];
        for (column, step) in [1.0, 1e-6, 1e-6].into_iter().enumerate() {
            let (mut above, mut below) = (rest, rest);
            above[column] += step;
            below[column] -= step;
            let (above, below) = (rates_at(&above, command), rates_at(&below, command));
            (0..3).for_each(|row| rates[row][column] = (above[row] - below[row]) / (2.0 * step));
        }
        // Of dry friction only what is left while it slips: at rest it looks like damping that is gone when the load moves.
        let slope_at = |velocity: f64| {
            let [above, below] =
                [1e-6, -1e-6].map(|step| rates_at(&[pressure, contraction, velocity + step], command)[2]);
            (above - below) / 2e-6
        };
        rates[2][2] = [SLIPPING, -SLIPPING].map(slope_at).into_iter().fold(rates[2][2], f64::max);
        let step = 1e-4;
        let input = (rates_at(&rest, command + step)[0] - rates_at(&rest, command - step)[0]) / (2.0 * step);
        let effects = &parameters.effects;
        let dead_time = effects.command_delay() + effects.lateness(parameters.valve.bandwidth);
        Self { rates, input, dead_time, mass }
    }

    /// The plant with something in parallel to the muscle that pulls back, N/m.
    pub fn stiffened(mut self, stiffness: f64) -> Self {
        self.rates[2][1] -= stiffness / self.mass;
        self
    }

    /// The plant with more dead time, s.
    pub fn delayed(mut self, dead_time: f64) -> Self {
        self.dead_time += dead_time;
        self
    }

    /// Gain b of the transfer function.
    pub fn gain(&self) -> f64 {
        self.rates[2][0] * self.input
    }

    /// Denominator of the transfer function: d₀, d₁, d₂, 1.
    pub fn denominator(&self) -> Polynomial {
        let [[a, b, c], _, [d, e, f]] = self.rates;
        let own = product(&[-a, 1.0], &[-e, -f, 1.0]);
        sum(&own, &[-d * b, -d * c])
    }

    /// Natural frequency of the load on the muscle, rad/s; zero where the muscle holds no position.
    pub fn natural_frequency(&self) -> f64 {
        (-self.rates[2][1]).max(0.0).sqrt()
    }

    /// Contraction per command in m/V at a frequency in rad/s.
    pub fn response(&self, frequency: f64) -> Complex<f64> {
        let s = Complex::new(0.0, frequency);
        (-s * self.dead_time).exp() * self.gain() / value(&self.denominator(), s)
    }
}

/// Numerator and denominator of the controller from error in m to command in V.
pub fn controller_polynomials(controller: &Controller) -> (Polynomial, Polynomial) {
    let Controller {
        proportional_gain: kp, integral_gain: ki, derivative_gain: kd, filter_time_constant: filter, ..
    } = *controller;
    (vec![ki, kp + ki * filter, kp * filter + kd], vec![0.0, 1.0, filter])
}

/// Response of the controller in V/m at a frequency in rad/s.
pub fn controller_response(controller: &Controller, frequency: f64) -> Complex<f64> {
    let s = Complex::new(0.0, frequency);
    let derivative = s * controller.derivative_gain / (s * controller.filter_time_constant + 1.0);
    s.inv() * controller.integral_gain + controller.proportional_gain + derivative
}

/// Numerator and characteristic polynomial of the closed loop from setpoint to contraction, with the controller's gains
/// multiplied by a factor. A dead time is that of Padé of second order.
pub fn closed_loop_polynomials(plant: &LinearPlant, controller: &Controller, factor: f64) -> (Polynomial, Polynomial) {
    let (numerator, denominator) = controller_polynomials(controller);
    let half = 0.5 * plant.dead_time;
    let (late, on_time) = if half > 0.0 {
        (vec![1.0, -half, half * half / 3.0], vec![1.0, half, half * half / 3.0])
    } else {
        (vec![1.0], vec![1.0])
    };
    let forward = product(&product(&numerator, &late), &[factor * plant.gain()]);
    let characteristic = sum(&product(&product(&plant.denominator(), &denominator), &on_time), &forward);
    (forward, characteristic)
}

/// Poles of the closed loop, 1/s.
pub fn closed_loop_poles(plant: &LinearPlant, controller: &Controller, factor: f64) -> Vec<Complex<f64>> {
    roots(&closed_loop_polynomials(plant, controller, factor).1)
}

/// How far a loop is from instability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Smallest factor above one on the gain that makes it unstable.
    pub gain: f64,
    /// Smallest loss of phase that makes it unstable, rad.
    pub phase: f64,
    /// Smallest dead time that makes it unstable, s.
    pub delay: f64,
    /// Largest amplification of a disturbance, at any frequency: peak of |1/(1 + L)|.
    pub sensitivity: f64,
    /// Where that peak is, rad/s.
    pub peak_frequency: f64,
    /// Largest real part of the poles of the closed loop, 1/s.
    pub slowest_pole: f64,
}

impl Margins {
    /// Whether the loop is stable.
    pub fn is_stable(&self) -> bool {
        self.slowest_pole < 0.0
    }

    /// Margins of the loop of a controller and a plant that is stable by itself.
    pub fn of(plant: &LinearPlant, controller: &Controller) -> Self {
        let frequencies = frequencies(plant, 3000);
        let response = |frequency: &f64| plant.response(*frequency) * controller_response(controller, *frequency);
        let open: Vec<_> = frequencies.iter().map(response).collect();
        let poles = closed_loop_poles(plant, controller, 1.0);
        let slowest_pole = poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max);
        let mut margins = Self {
            gain: f64::INFINITY,
            phase: f64::INFINITY,
            delay: f64::INFINITY,
            sensitivity: 0.0,
            peak_frequency: 0.0,
            slowest_pole,
        };
        for (here, frequency) in open.iter().zip(&frequencies) {
            let sensitivity = (here + 1.0).norm().recip();
            if sensitivity > margins.sensitivity {
                (margins.sensitivity, margins.peak_frequency) = (sensitivity, *frequency);
            }
        }
        for (pair, at) in open.windows(2).zip(frequencies.windows(2)) {
            let [here, next] = [pair[0], pair[1]];
            if here.im * next.im < 0.0 {
                let crossing = here.re + (next.re - here.re) * here.im / (here.im - next.im);
                if (-1.0..0.0).contains(&crossing) {
                    margins.gain = margins.gain.min(-crossing.recip());
                }
            }
            if (here.norm() - 1.0) * (next.norm() - 1.0) < 0.0 {
                let share = (1.0 - here.norm()) / (next.norm() - here.norm());
                let phase = (here + (next - here) * share).arg().rem_euclid(std::f64::consts::TAU);
                let lead = (phase - std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
                margins.phase = margins.phase.min(lead.min(std::f64::consts::TAU - lead));
                margins.delay = margins.delay.min(lead / (at[0] + (at[1] - at[0]) * share));
            }
        }
        margins
    }
}

/// Frequencies in rad/s at which a loop is looked at: evenly in logarithm, and closer around the resonance.
pub fn frequencies(plant: &LinearPlant, count: usize) -> Vec<f64> {
    let spread = |low: f64, high: f64, count: usize| {
        (0..count).map(move |k| low * (high / low).powf(k as f64 / (count - 1) as f64))
    };
    let resonance = plant.natural_frequency().max(1.0);
    let mut all: Vec<f64> =
        spread(0.1, 500.0, count / 2).chain(spread(0.7 * resonance, 1.6 * resonance, count / 2)).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Course of a linear system that was at rest before a step of its input: `numerator`/`denominator` as transfer function,
/// its poles all different; at the given times, shape `(n_times,)`.
pub fn step_response(numerator: &[f64], denominator: &[f64], times: &[f64]) -> Vec<f64> {
    let slope = derivative(denominator);
    let poles = roots(denominator);
    let residues: Vec<_> = poles.iter().map(|pole| value(numerator, *pole) / (pole * value(&slope, *pole))).collect();
    let at = |time: &f64| {
        let decaying = poles.iter().zip(&residues).map(|(pole, residue)| (residue * (pole * *time).exp()).re);
        numerator[0] / denominator[0] + decaying.sum::<f64>()
    };
    times.iter().map(at).collect()
}
