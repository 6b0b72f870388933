use super::{ForceModel, Muscle};

crate::variables::variables! {
    /// Contractile element, spring and damper in parallel, each of which depends on pressure.
    ///
    /// # Model
    /// F = F_ce − K x − B v, F_ce = f₀ + f₁ p, K = k₀ + k₁ p, B = b₀ + b₁ p with one pair for inflation, v > 0, and one
    /// for deflation: `contraction_force` f₀, `contraction_area` f₁, `stiffness`, `stiffness_per_pressure`,
    /// `inflation_damping`, `inflation_damping_per_pressure`, `deflation_damping`, `deflation_damping_per_pressure`.
    ///
    /// # In the data
    /// Force linear in contraction at every pressure, and a loop of the force that grows with speed, wider or narrower
    /// while shortening than while lengthening.
    ///
    /// # Validity
    /// Above 1 bar. `muscle.damping` acts beside B, and is zero in the presets of this model. Inflation and deflation are
    /// told by the motion, because the model knows no rate of pressure; B never falls below zero.
    ///
    /// # Reference
    /// D. B. Reynolds et al. (2003), Modeling the dynamic characteristics of pneumatic muscle,
    /// doi 10.1114/1.1554921; thesis eq. 3.47. The thesis prints no coefficients: F_ce and K are identified on the forces of
    /// the virtual-area model over 1–4.5 bar and 90–820 N (44 N rms); B is the nominal damping at every pressure, both ways.
    pub struct ThreeElement in "three_element." as Tunable {
        /// Force of the contractile element without pressure
        contraction_force: f64 = -160.552, NEWTON, (-1e6..=1e6);
        /// Force of the contractile element per pressure
        contraction_area: f64 = 7.584_01e-3, SQUARE_METRE, (-1.0..=1.0);
        /// Stiffness of the spring without pressure
        stiffness: f64 = 2596.2, NEWTON_PER_METRE, (-1e8..=1e8);
        /// Stiffness of the spring per pressure
        stiffness_per_pressure: f64 = 1.805_55e-2, METRE, (-100.0..=100.0);
        /// Damping of inflation without pressure
        inflation_damping: f64 = 80.0, NEWTON_SECOND_PER_METRE, (-1e6..=1e6);
        /// Damping of inflation per pressure
        inflation_damping_per_pressure: f64 = 0.0, METRE_SECOND, (-10.0..=10.0);
        /// Damping of deflation without pressure
        deflation_damping: f64 = 80.0, NEWTON_SECOND_PER_METRE, (-1e6..=1e6);
        /// Damping of deflation per pressure
        deflation_damping_per_pressure: f64 = 0.0, METRE_SECOND, (-10.0..=10.0);
    }
}

impl ForceModel for ThreeElement {
    fn virtual_area(&self, _muscle: &Muscle, _gauge_pressure: f64, contraction: f64) -> f64 {
        self.contraction_area - self.stiffness_per_pressure * contraction
    }

    fn elastic_force(&self, _muscle: &Muscle, contraction: f64) -> f64 {
        self.contraction_force - self.stiffness * contraction
    }

    fn resistance(&self, _muscle: &Muscle, gauge_pressure: f64, _contraction: f64, velocity: f64) -> f64 {
        let damping = if velocity > 0.0 {
            self.inflation_damping + self.inflation_damping_per_pressure * gauge_pressure
        } else {
            self.deflation_damping + self.deflation_damping_per_pressure * gauge_pressure
        };
        damping.max(0.0) * velocity
    }
}
