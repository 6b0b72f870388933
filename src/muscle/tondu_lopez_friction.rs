use super::{ForceModel, Muscle, TonduLopezK};
use std::f64::consts::PI;

/// Length ratio at which the rhombi stop growing; threads that lie around would touch all along.
const LEAST_RATIO: f64 = 0.05;

crate::variables::variables! {
    /// Model of Tondu and Lopez with dry friction where the threads of the braid cross.
    ///
    /// # Model
    /// F = F_t − f/n π D₀ L₀ sin θ₀ / ((1 − k ε) √(1 − cos² θ₀ (1 − k ε)²)) p tanh(v/v₀), with F_t that of
    /// [`TonduLopezK`]: `friction` f/n, `smoothing_velocity` v₀. The threads touch in rhombi, whose size goes with
    /// 1/(sin θ cos θ); at rest they cover the whole cylinder.
    ///
    /// # In the data
    /// A loop of the force over contraction as wide as the pressure is high, the same at every speed.
    ///
    /// # Validity
    /// Far slower than v₀ the model creeps where a muscle sticks: tanh stands for the sign, and v₀ is no property of the
    /// muscle. Friction with presliding and memory is the effect `friction_hysteresis`.
    ///
    /// # Reference
    /// B. Tondu and P. Lopez (2000), doi 10.1109/37.833638; thesis eq. 4.20. Only the quotient f/n can be told from forces.
    /// The thesis prints no f and its forces have no loop: the default, 13 N per bar at rest length, is assumed;
    /// k as in [`TonduLopezK`].
    pub struct TonduLopezFriction in "tondu_lopez_friction." as Tunable {
        /// Coefficient of the braid that drives, 3/tan² of its angle
        alpha: f64 = 8.3095, ONE, (0.0..=1e3);
        /// Coefficient of the braid that resists, 1/sin² of its angle
        beta: f64 = 3.7698, ONE, (0.0..=1e3);
        /// How many times the contraction counts, without pressure
        k_0: f64 = 1.65727, ONE, (-100.0..=100.0);
        /// Change with pressure of how many times the contraction counts
        k_per_pressure: f64 = -1.6328e-6, PER_PASCAL, (-1e-3..=1e-3);
        /// Coefficient of friction by the number of layers of threads
        friction: f64 = 1e-3, ONE, (0.0..=1.0);
        /// Velocity at which three quarters of the friction have come
        smoothing_velocity: f64 = 1e-3, METRE_PER_SECOND, (1e-5..=1.0);
    }
}

impl TonduLopezFriction {
    /// The same without friction.
    fn frictionless(&self) -> TonduLopezK {
        let Self { alpha, beta, k_0, k_per_pressure, .. } = *self;
        TonduLopezK { alpha, beta, k_0, k_per_pressure }
    }
}

impl ForceModel for TonduLopezFriction {
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        self.frictionless().virtual_area(muscle, gauge_pressure, contraction)
    }

    fn pressure_force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        self.frictionless().pressure_force(muscle, gauge_pressure, contraction)
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }

    fn resistance(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64, velocity: f64) -> f64 {
        let ratio = self.frictionless().length_ratio(muscle, gauge_pressure, contraction).max(LEAST_RATIO);
        let cosine_squared = (muscle.rest_length / muscle.thread_length).powi(2);
        let of_rest = (1.0 - cosine_squared).sqrt() / (ratio * (1.0 - cosine_squared * ratio.powi(2)).sqrt());
        let contact = PI * muscle.diameter(0.0) * muscle.rest_length * of_rest;
        self.friction * contact * gauge_pressure * (velocity / self.smoothing_velocity).tanh()
    }
}
