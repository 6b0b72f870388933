use super::{Description, Effect, Point};

crate::variables::variables! {
    /// Dry friction between threads and rubber, in the form of Dahl.
    ///
    /// # Model
    /// F ← F − (w₀ + w₁ p) z, dz/dt = (v − |v| z) / s: half width w₀ (`half_width`), its growth with pressure w₁
    /// (`half_width_per_pressure`), presliding displacement s, contraction velocity v. z stays within ±1.
    ///
    /// # In the data
    /// The force residual changes sign at every reversal; its width does not depend on speed. Triangles of shrinking
    /// amplitude separate it from viscous damping (three speeds) and from a valve lag (vanishes when slow).
    ///
    /// # Validity
    /// Smooth loops, as of FESTO muscles whose threads are embedded in rubber; no stick-slip (Stribeck).
    ///
    /// # Reference
    /// P. Dahl (1968), A solid friction model, TOR-0158(3107-18)-1; pressure dependence as in Tondu and Lopez,
    /// thesis eq. 4.20, with the sign function replaced by z.
    pub struct FrictionHysteresis in "friction_hysteresis." as Tunable {
        /// Half width of the loop at zero pressure
        half_width: f64 = 0.0, NEWTON, (0.0..=2000.0);
        /// Growth of the half width with gauge pressure
        half_width_per_pressure: f64 = 0.0, SQUARE_METRE, (0.0..=0.02);
        /// Displacement after a reversal at which most of the loop is passed
        presliding_displacement: f64 = 2e-3, METRE, (1e-5..=0.1);
    }
}

impl FrictionHysteresis {
    fn width(&self, gauge_pressure: f64) -> f64 {
        self.half_width + self.half_width_per_pressure * gauge_pressure.max(0.0)
    }
}

impl Effect for FrictionHysteresis {
    const DESCRIPTION: Description = Description {
        name: "friction_hysteresis",
        meaning: "dry friction in the braid: a loss that does not depend on speed",
        equation: "F <- F - (w0 + w1 p) z,  dz/dt = (v - |v| z)/s",
        signature: "force residual changes sign at reversals, width independent of speed",
        experiment: "triangles of shrinking amplitude at three pressures",
        reference: "Dahl 1968; thesis eq. 4.20",
        of_load: false,
        forms: &[&[
            ("friction_hysteresis.half_width", &[10.0]),
            ("friction_hysteresis.half_width_per_pressure", &[3e-5]),
            ("friction_hysteresis.presliding_displacement", &[2e-3]),
        ]],
        refinements: &[],
    };
    const STATES: usize = 1;

    fn muscle_force(&self, at: &Point, own: &[f64], force: f64) -> f64 {
        force - self.width(at.gauge_pressure) * own[0]
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        // Without friction the state rests, so that it cannot touch the step size of the integrator.
        let active = self.half_width != 0.0 || self.half_width_per_pressure != 0.0;
        let velocity = if active { at.contraction_velocity } else { 0.0 };
        rates[0] = (velocity - velocity.abs() * own[0]) / self.presliding_displacement;
    }

    fn sentence(&self) -> String {
        let at_three_bar = 2.0 * self.width(3e5);
        format!(
            "Dry friction in the braid: at 3 bar the muscle pulls {at_three_bar:.0} N less when it shortens than when it lengthens."
        )
    }
}
