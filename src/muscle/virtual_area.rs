use super::{ForceModel, Muscle};

crate::variables::variables! {
    /// Virtual-area model: the muscle as a cylinder whose piston shrinks as it shortens.
    ///
    /// # Model
    /// F = p A(x) + b(x), with A(x) = a₀ + a₁ x + a₂ x² + a₃ x³ and b(x) = b₀ + b₁ x + b₂ x² + b₃ x³;
    /// x is the contraction, aᵢ are `area_i`, bᵢ are `elastic_i`. A coefficient of zero lowers the degree.
    ///
    /// # Validity
    /// Identified at 0.5–4.5 bar, 100–800 N, up to 22 cm (6.8 cm for the short muscle); below 0.5 bar it
    /// predicts force where the real muscle has none yet.
    ///
    /// # Reference
    /// Thesis eqs. 4.5–4.11. Defaults are those of DMSP-40-1000, eqs. 4.6 and 4.8: A of first and b of third degree, which the
    /// thesis chose among the first three.
    pub struct VirtualArea in "virtual_area." as Tunable {
        /// Virtual area at rest
        area_0: f64 = 0.0091, SQUARE_METRE, (1e-6..=1.0);
        /// Change of the virtual area with contraction
        area_1: f64 = -0.0266, METRE, (-10.0..=10.0);
        /// Virtual area, quadratic in contraction
        area_2: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Virtual area, cubic in contraction
        area_3: f64 = 0.0, PER_METRE, (-1e5..=1e5);
        /// Elastic force at rest
        elastic_0: f64 = -113.29, NEWTON, (-1e5..=1e5);
        /// Elastic force, linear in contraction
        elastic_1: f64 = -8808.9, NEWTON_PER_METRE, (-1e7..=1e7);
        /// Elastic force, quadratic in contraction
        elastic_2: f64 = 5.2111e4, NEWTON_PER_METRE2, (-1e9..=1e9);
        /// Elastic force, cubic in contraction
        elastic_3: f64 = -1.0067e5, NEWTON_PER_METRE3, (-1e11..=1e11);
    }
}

impl ForceModel for VirtualArea {
    fn virtual_area(&self, _muscle: &Muscle, _gauge_pressure: f64, contraction: f64) -> f64 {
        let x = contraction;
        self.area_0 + x * (self.area_1 + x * (self.area_2 + x * self.area_3))
    }

    fn elastic_force(&self, _muscle: &Muscle, contraction: f64) -> f64 {
        let x = contraction;
        self.elastic_0 + x * (self.elastic_1 + x * (self.elastic_2 + x * self.elastic_3))
    }
}
