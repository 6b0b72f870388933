use super::{ForceModel, Muscle};

crate::variables::variables! {
    /// Spring whose stiffness depends on pressure and stretch.
    ///
    /// # Model
    /// F = K L_S, K = C₀ + C₁ L_S² + C₂ p L_S + C₃ p²: L_S = x₀(p) − x is how much longer the muscle is than without a
    /// load, x₀ = u₀ + u₁ p + u₂ p². One set of coefficients below 1 bar, `low_*`, one above, `high_*`; between
    /// `blend_start` and `blend_end` both forces are mixed, F = F_low + w (F_high − F_low), w = 3t² − 2t³.
    ///
    /// # In the data
    /// Zero force at x₀(p), and a slope over contraction that changes with pressure; it pushes beyond x₀.
    ///
    /// # Validity
    /// 0–4.5 bar and 100–800 N; it is not affine in pressure. Away from there the polynomials lead anywhere.
    ///
    /// # Reference
    /// K. C. Wickramatunge and T. Leephakpreeda (2010), Study on mechanical behaviors of pneumatic artificial muscle,
    /// International Journal of Engineering Science 48, 188–198; thesis eqs. 3.44, 4.12 and 4.13, Table 4.1. Deviations: the exponent of L_S in the C₁ term
    /// (printed 1) is 2, as in the cited source: with the printed coefficients and the strokes of the virtual-area model
    /// that leaves 74 N rms over 1–4.5 bar, exponent 1 leaves 344 N (short muscle: 155 and 332 N). The thesis plots x₀
    /// (Fig. 4.32) and prints no u: they are identified, given the printed C, on the forces of the virtual-area model over
    /// 0.25–4.5 bar and 90–820 N. Mixing is an addition: the printed coefficients jump at 1 bar.
    pub struct Spring in "spring." as Tunable {
        /// Contraction without load below 1 bar, constant term
        low_u0: f64 = -5.981_92e-3, METRE, (-10.0..=10.0);
        /// Contraction without load below 1 bar, linear in pressure
        low_u1: f64 = -1.143_02e-7, METRE_PER_PASCAL, (-1e-3..=1e-3);
        /// Contraction without load below 1 bar, quadratic in pressure
        low_u2: f64 = 1.118_92e-11, METRE_PER_PASCAL2, (-1e-8..=1e-8);
        /// Stiffness below 1 bar, constant term
        low_c0: f64 = 2.3983e4, NEWTON_PER_METRE, (-1e8..=1e8);
        /// Stiffness below 1 bar, quadratic in stretch
        low_c1: f64 = 8.0126e5, NEWTON_PER_METRE3, (-1e11..=1e11);
        /// Stiffness below 1 bar, per pressure and stretch
        low_c2: f64 = -0.9883, NEWTON_PER_METRE2_PASCAL, (-1e5..=1e5);
        /// Stiffness below 1 bar, quadratic in pressure
        low_c3: f64 = -1.4085e-6, NEWTON_PER_METRE_PASCAL2, (-1.0..=1.0);
        /// Contraction without load above 1 bar, constant term
        high_u0: f64 = 1.505_75e-2, METRE, (-10.0..=10.0);
        /// Contraction without load above 1 bar, linear in pressure
        high_u1: f64 = 1.298_31e-6, METRE_PER_PASCAL, (-1e-3..=1e-3);
        /// Contraction without load above 1 bar, quadratic in pressure
        high_u2: f64 = -1.583_41e-12, METRE_PER_PASCAL2, (-1e-8..=1e-8);
        /// Stiffness above 1 bar, constant term
        high_c0: f64 = 5.2159e3, NEWTON_PER_METRE, (-1e8..=1e8);
        /// Stiffness above 1 bar, quadratic in stretch
        high_c1: f64 = -5.2663e4, NEWTON_PER_METRE3, (-1e11..=1e11);
        /// Stiffness above 1 bar, per pressure and stretch
        high_c2: f64 = 0.0138, NEWTON_PER_METRE2_PASCAL, (-1e5..=1e5);
        /// Stiffness above 1 bar, quadratic in pressure
        high_c3: f64 = 4.0050e-8, NEWTON_PER_METRE_PASCAL2, (-1.0..=1.0);
        /// Gauge pressure below which the low range holds alone
        blend_start: f64 = 0.8e5, PASCAL, (0.0..=2e6);
        /// Gauge pressure above which the high range holds alone
        blend_end: f64 = 1.2e5, PASCAL, (0.0..=2e6);
    }
}

/// Force in N of one range and its derivative over pressure in m².
fn range(p: f64, x: f64, [u0, u1, u2]: [f64; 3], [c0, c1, c2, c3]: [f64; 4]) -> (f64, f64) {
    let stretch = u0 + p * (u1 + p * u2) - x;
    let stretch_slope = u1 + 2.0 * p * u2;
    let force = stretch * (c0 + c3 * p * p + stretch * (c2 * p + stretch * c1));
    let of_stretch = c0 + c3 * p * p + stretch * (2.0 * c2 * p + 3.0 * stretch * c1);
    (force, of_stretch * stretch_slope + stretch * (2.0 * c3 * p + stretch * c2))
}

impl Spring {
    /// Force in N and its derivative over pressure in m².
    fn force_and_area(&self, gauge_pressure: f64, contraction: f64) -> (f64, f64) {
        let (p, x) = (gauge_pressure, contraction);
        let low = || {
            let c = [self.low_c0, self.low_c1, self.low_c2, self.low_c3];
            range(p, x, [self.low_u0, self.low_u1, self.low_u2], c)
        };
        let high = || {
            let c = [self.high_c0, self.high_c1, self.high_c2, self.high_c3];
            range(p, x, [self.high_u0, self.high_u1, self.high_u2], c)
        };
        if p <= self.blend_start {
            return low();
        }
        if p >= self.blend_end {
            return high();
        }
        let ((low, low_area), (high, high_area)) = (low(), high());
        let span = self.blend_end - self.blend_start;
        let t = (p - self.blend_start) / span;
        let (weight, slope) = (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / span);
        (low + weight * (high - low), low_area + weight * (high_area - low_area) + slope * (high - low))
    }
}

impl ForceModel for Spring {
    fn virtual_area(&self, _muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        self.force_and_area(gauge_pressure, contraction).1
    }

    fn pressure_force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        self.force_and_area(gauge_pressure, contraction).0 - self.elastic_force(muscle, contraction)
    }

    fn elastic_force(&self, _muscle: &Muscle, contraction: f64) -> f64 {
        self.force_and_area(0.0, contraction).0
    }
}
