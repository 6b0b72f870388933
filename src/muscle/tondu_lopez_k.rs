use super::tondu_lopez::section;
use super::{ForceModel, Muscle};

crate::variables::variables! {
    /// Model of Tondu and Lopez in which the contraction counts k times, because the ends are no cylinder.
    ///
    /// # Model
    /// F = p π D₀²/4 (α (1 − k ε)² − β), ε = x/L₀, k = k₀ + k₁ p: `alpha`, `beta`, `k_0`, `k_per_pressure`.
    ///
    /// # In the data
    /// The stroke ends at ε = (1 − √(β/α))/k: earlier at low pressure than at high pressure when k₁ < 0, which stands
    /// for the elasticity that this model has not got.
    ///
    /// # Validity
    /// Up to ε = 1/k, beyond which the pull stays −β; linear in a range of pressure; not affine in pressure. No elastic force: a load hangs only under pressure. α and β
    /// fix the pull at rest and k the stroke; fitted at once they are told apart only by the curvature over the
    /// contraction.
    ///
    /// # Reference
    /// B. Tondu and P. Lopez (2000), doi 10.1109/37.833638; thesis eqs. 3.12 and 4.19. The thesis prints no k: with the
    /// printed α and β, k is identified on the forces of the virtual-area model over 1–4.5 bar and 90–820 N
    /// (89 N rms, 187 N without k).
    pub struct TonduLopezK in "tondu_lopez_k." as Tunable {
        /// Coefficient of the braid that drives, 3/tan² of its angle
        alpha: f64 = 8.3095, ONE, (0.0..=1e3);
        /// Coefficient of the braid that resists, 1/sin² of its angle
        beta: f64 = 3.7698, ONE, (0.0..=1e3);
        /// How many times the contraction counts, without pressure
        k_0: f64 = 1.65727, ONE, (-100.0..=100.0);
        /// Change with pressure of how many times the contraction counts
        k_per_pressure: f64 = -1.6328e-6, PER_PASCAL, (-1e-3..=1e-3);
    }
}

impl TonduLopezK {
    /// Length of the braid by the length at rest, the contraction counted k times; zero where the threads lie around.
    pub(super) fn length_ratio(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        (1.0 - (self.k_0 + self.k_per_pressure * gauge_pressure) * contraction / muscle.rest_length).max(0.0)
    }
}

impl ForceModel for TonduLopezK {
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        let ratio = self.length_ratio(muscle, gauge_pressure, contraction);
        let change = -self.k_per_pressure * contraction / muscle.rest_length;
        section(muscle) * (self.alpha * ratio * (ratio + 2.0 * gauge_pressure * change) - self.beta)
    }

    fn pressure_force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        let ratio = self.length_ratio(muscle, gauge_pressure, contraction);
        gauge_pressure * section(muscle) * (self.alpha * ratio.powi(2) - self.beta)
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }
}
