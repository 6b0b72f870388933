use super::{ForceModel, McKibben, Muscle};
use std::f64::consts::PI;

crate::variables::variables! {
    /// Improved McKibben model: inextensible threads around an elastic membrane.
    ///
    /// # Model
    /// F = p (3L² − b²) / (4πn²) + E ε_L δ π D − E ε_D 2δL² / (D n² π²), with
    /// ε_L = (L − L₀)/L₀, ε_D = (D − D₀)/D₀ and E = C₀ + C₁ r + C₂ r² + C₃ r³ at r = L/L₀.
    /// b is `muscle.thread_length`, n `muscle.turns`, δ `membrane_thickness`, Cᵢ `modulus_i`.
    ///
    /// # Validity
    /// Only the product E δ can be told from forces; δ is fixed at 1 mm. The muscle must stay shorter than its thread.
    ///
    /// # Reference
    /// Thesis eqs. 3.43, 4.17 and 4.18. Deviations: the sign of b² (printed +) is that of −dV/dL of eq. 3.6; the printed
    /// cubic of Table 4.3 does not reproduce the thesis' own forces, so the defaults are re-identified on the forces
    /// of the virtual-area model over 1–4.5 bar and 90–820 N (49 N rms for DMSP-40-1000).
    pub struct ImprovedMcKibben in "improved_mckibben." as Tunable {
        /// Thickness of the membrane
        membrane_thickness: f64 = 1e-3, METRE, (1e-5..=0.1);
        /// Elastic modulus, constant term
        modulus_0: f64 = -3.213_932_084e8, PASCAL, (-1e13..=1e13);
        /// Elastic modulus, linear in L/L0
        modulus_1: f64 = 1.227_953_001e9, PASCAL, (-1e13..=1e13);
        /// Elastic modulus, quadratic in L/L0
        modulus_2: f64 = -1.551_987_184e9, PASCAL, (-1e13..=1e13);
        /// Elastic modulus, cubic in L/L0
        modulus_3: f64 = 6.596_738_589e8, PASCAL, (-1e13..=1e13);
    }
}

impl ImprovedMcKibben {
    /// Elastic modulus in Pa at a length ratio L/L₀ (thesis eq. 4.18).
    pub fn modulus(&self, length_ratio: f64) -> f64 {
        let r = length_ratio;
        self.modulus_0 + r * (self.modulus_1 + r * (self.modulus_2 + r * self.modulus_3))
    }
}

impl ForceModel for ImprovedMcKibben {
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        McKibben.virtual_area(muscle, gauge_pressure, contraction)
    }

    fn elastic_force(&self, muscle: &Muscle, contraction: f64) -> f64 {
        let length = muscle.rest_length - contraction;
        let (diameter, rest_diameter) = (muscle.diameter(contraction), muscle.diameter(0.0));
        let modulus = self.modulus(length / muscle.rest_length);
        let stress_along = modulus * (length - muscle.rest_length) / muscle.rest_length;
        let stress_around = modulus * (diameter - rest_diameter) / rest_diameter;
        let section_along = PI * diameter * self.membrane_thickness;
        let section_around = 2.0 * self.membrane_thickness * length;
        let widening = -length / (diameter * (muscle.turns * PI).powi(2));
        stress_along * section_along + stress_around * section_around * widening
    }
}
