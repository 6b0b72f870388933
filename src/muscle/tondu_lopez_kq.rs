use super::tondu_lopez::section;
use super::{ForceModel, Muscle};

crate::variables::variables! {
    /// Model of Tondu and Lopez for low pressure, with k and q known at two pressures.
    ///
    /// # Model
    /// F = p q π D₀²/4 (α (1 − k ε)² − β), ε = x/L₀. Between the two pressures 1/k, which is the longest stroke up to a
    /// factor, and q are linear in pressure; outside they stay what they are at the nearer one. `alpha`, `beta`;
    /// `low_pressure`, `low_k`, `low_q`; `high_pressure`, `high_k`, `high_q`. [`TonduLopezKq::two_points`] finds k and q.
    ///
    /// # In the data
    /// Right where every other model is wrong, near 0.5 and 1 bar; above, it stays at the stroke of 1 bar.
    ///
    /// # Validity
    /// From half the lower to the upper pressure, up to ε = 1/k, beyond which the pull stays −β. The slope of the force over pressure jumps at both.
    ///
    /// # Reference
    /// Thesis eqs. 4.21–4.23 and Table 4.4, the defaults, which hold at 0.5 and at 1 bar alone; what is between them is an
    /// addition. The printed k mean longest strokes of 2.6 and 9.9 % of the length.
    pub struct TonduLopezKq in "tondu_lopez_kq." as Tunable {
        /// Coefficient of the braid that drives, 3/tan² of its angle
        alpha: f64 = 8.3095, ONE, (0.0..=1e3);
        /// Coefficient of the braid that resists, 1/sin² of its angle
        beta: f64 = 3.7698, ONE, (0.0..=1e3);
        /// Lower gauge pressure at which k and q are known
        low_pressure: f64 = 0.5e5, PASCAL, (0.0..=2e6);
        /// How many times the contraction counts at the lower pressure
        low_k: f64 = 12.3268, ONE, (1e-2..=1e3);
        /// Factor on the force at the lower pressure
        low_q: f64 = 1.2838, ONE, (0.0..=100.0);
        /// Higher gauge pressure at which k and q are known
        high_pressure: f64 = 1e5, PASCAL, (0.0..=2e6);
        /// How many times the contraction counts at the higher pressure
        high_k: f64 = 3.3077, ONE, (1e-2..=1e3);
        /// Factor on the force at the higher pressure
        high_q: f64 = 1.3320, ONE, (0.0..=100.0);
    }
}

impl TonduLopezKq {
    /// k and q at one gauge pressure in Pa, from the pull in N at rest length and the contraction in m without load
    /// (thesis eqs. 4.22 and 4.23).
    pub fn two_points(&self, muscle: &Muscle, gauge_pressure: f64, pull: f64, contraction: f64) -> (f64, f64) {
        let k = muscle.rest_length / contraction * (1.0 - (self.beta / self.alpha).sqrt());
        (k, pull / (section(muscle) * gauge_pressure * (self.alpha - self.beta)))
    }

    /// 1/k and q at a gauge pressure in Pa, and their derivatives over pressure.
    fn at(&self, gauge_pressure: f64) -> ([f64; 2], [f64; 2]) {
        let (low, high) = ([1.0 / self.low_k, self.low_q], [1.0 / self.high_k, self.high_q]);
        let span = self.high_pressure - self.low_pressure;
        if gauge_pressure <= self.low_pressure {
            return (low, [0.0; 2]);
        }
        if gauge_pressure >= self.high_pressure {
            return (high, [0.0; 2]);
        }
        let slopes = [0, 1].map(|k| (high[k] - low[k]) / span);
        ([0, 1].map(|k| low[k] + slopes[k] * (gauge_pressure - self.low_pressure)), slopes)
    }

    /// Force in N by pressure in Pa, but for q.
    fn area(&self, muscle: &Muscle, reach: f64, contraction: f64) -> f64 {
        let ratio = (1.0 - contraction / (muscle.rest_length * reach)).max(0.0);
        section(muscle) * (self.alpha * ratio.powi(2) - self.beta)
    }
}

impl ForceModel for TonduLopezKq {
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        let ([reach, q], [reach_slope, q_slope]) = self.at(gauge_pressure);
        let strain = (contraction / (muscle.rest_length * reach)).min(1.0);
        let area_slope = section(muscle) * 2.0 * self.alpha * (1.0 - strain) * strain / reach * reach_slope;
        let area = self.area(muscle, reach, contraction);
        (q + gauge_pressure * q_slope) * area + gauge_pressure * q * area_slope
    }

    fn pressure_force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        let ([reach, q], _) = self.at(gauge_pressure);
        gauge_pressure * q * self.area(muscle, reach, contraction)
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }
}
