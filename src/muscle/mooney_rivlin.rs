use super::{ForceModel, McKibben, Muscle};
use std::f64::consts::PI;

crate::variables::variables! {
    /// McKibben braid around a bladder of rubber after Mooney and Rivlin.
    ///
    /// # Model
    /// F = p (3L² − b²)/(4πn²) + V_b dW/dL, W = C₁₀ (I₁ − 3) + C₀₁ (I₂ − 3), in the stretches L/L₀ and D/D₀ of an
    /// incompressible bladder: with s = (L/L₀)², u = (D/D₀)², I₁ = s + u + 1/(su), I₂ = 1/s + 1/u + su.
    /// `c10`, `c01`; V_b = π D₀ L₀ δ of the `membrane_thickness` δ.
    ///
    /// # In the data
    /// An elastic force that depends on contraction alone and is zero at rest.
    ///
    /// # Validity
    /// Only the products C δ can be told from forces; δ is fixed at 1 mm. The muscle must stay shorter than its thread. One
    /// bladder without threads in it: of a FESTO membrane the constants are not those of its rubber.
    ///
    /// # Reference
    /// G. K. Klute and B. Hannaford (2000), Accounting for elastic energy storage in McKibben artificial muscle actuators,
    /// Journal of Dynamic Systems, Measurement, and Control 122, 386–388; thesis eqs. 3.24–3.31. Deviations: the sign of V_b dW/dL (printed −) is that of the energy
    /// balance p dV = −F dL + V_b dW, by which a stretched bladder lessens the pull; the factor 1/(2 L₀³ λ³) of eq. 3.28
    /// belongs to all four terms S₁ to S₄, as differentiating W shows. The thesis prints no constants: they are
    /// identified on the forces of the virtual-area model over 1–4.5 bar and 90–820 N (48 N rms), and come out positive; with
    /// the printed sign no positive ones fit.
    pub struct MooneyRivlin in "mooney_rivlin." as Tunable {
        /// Thickness of the bladder
        membrane_thickness: f64 = 1e-3, METRE, (1e-5..=0.1);
        /// First constant of the rubber
        c10: f64 = 2.357_22e5, PASCAL, (-1e13..=1e13);
        /// Second constant of the rubber
        c01: f64 = 1.2698e6, PASCAL, (-1e13..=1e13);
    }
}

impl ForceModel for MooneyRivlin {
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        McKibben.virtual_area(muscle, gauge_pressure, contraction)
    }

    fn elastic_force(&self, muscle: &Muscle, contraction: f64) -> f64 {
        let (rest, rest_diameter) = (muscle.rest_length, muscle.diameter(0.0));
        let along = 1.0 - contraction / rest;
        let widening = (rest / (PI * muscle.turns * rest_diameter)).powi(2);
        let s = along * along;
        let u = 1.0 + widening * (1.0 - s);
        // Derivatives of the invariants over s, with du/ds = -widening.
        let first = 1.0 - widening - (u - widening * s) / (s * u).powi(2);
        let second = -1.0 / s.powi(2) + widening / u.powi(2) + u - widening * s;
        let volume = PI * rest_diameter * rest * self.membrane_thickness;
        volume * (self.c10 * first + self.c01 * second) * 2.0 * along / rest
    }
}
