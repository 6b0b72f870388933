use super::{ForceModel, Muscle};
use std::f64::consts::PI;

crate::variables::variables! {
    /// Model of Tondu and Lopez with the coefficients α and β in place of the braid angle; "McKibben II" of the thesis.
    ///
    /// # Model
    /// F = p π D₀²/4 (α (1 − ε)² − β), ε = x/L₀, D₀ the diameter at rest: `alpha`, `beta`. With α = 3/tan² θ₀ and
    /// β = 1/sin² θ₀ at the angle of the braid it is [`McKibben`](super::McKibben).
    ///
    /// # In the data
    /// As an ideal muscle, but weaker at rest and with a shorter stroke: the pull ends at ε = 1 − √(β/α).
    ///
    /// # Validity
    /// As [`McKibben`](super::McKibben): no elastic force, so that a load hangs only under pressure. With a fitted angle
    /// the threads of this model are not those of the geometry.
    ///
    /// # Reference
    /// B. Tondu and P. Lopez (2000), Modeling and control of McKibben artificial muscle robot actuators,
    /// doi 10.1109/37.833638; thesis eqs. 3.11 and 4.16. Defaults are the printed α and β: they belong to 31.0°, not to
    /// the 30° that the thesis names (which gives 9 and 4).
    pub struct TonduLopez in "tondu_lopez." as Tunable {
        /// Coefficient of the braid that drives, 3/tan² of its angle
        alpha: f64 = 8.3095, ONE, (0.0..=1e3);
        /// Coefficient of the braid that resists, 1/sin² of its angle
        beta: f64 = 3.7698, ONE, (0.0..=1e3);
    }
}

impl ForceModel for TonduLopez {
    fn virtual_area(&self, muscle: &Muscle, _gauge_pressure: f64, contraction: f64) -> f64 {
        section(muscle) * (self.alpha * (1.0 - contraction / muscle.rest_length).powi(2) - self.beta)
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }
}

/// Section in m² of the muscle at rest.
pub(super) fn section(muscle: &Muscle) -> f64 {
    PI / 4.0 * muscle.diameter(0.0).powi(2)
}
