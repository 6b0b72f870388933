use super::{Description, Effect, Holds, Point};

/// Velocity in m/s at which the damping is stated.
const REFERENCE_VELOCITY: f64 = 0.05;
/// What a muscle may damp less than a nominal one of 80 N s/m, in N s/m: rubber and threads never move without a loss.
const LEAST: f64 = -60.0;
/// Velocity in m/s below which a power law goes over into a straight line; not physical, it keeps the slope finite.
const SMALL_VELOCITY: f64 = 1e-3;

crate::variables::variables! {
    /// Viscous damping beyond the nominal one, different for shortening and lengthening.
    ///
    /// # Model
    /// F ← F − B asinh(k v)/k |v/v₀|ᵃ (1 + b (p/2 bar − 1) + c (x/0.1 m − 1)), with B = `contraction` for v > 0 and
    /// `extension` for v < 0, stated at v₀ = 0.05 m/s, 2 bar and 0.1 m; `thinning` k, for none B v; `exponent` a,
    /// `with_pressure` b, `with_contraction` c.
    ///
    /// # In the data
    /// A loop of the force residual that grows with speed; the same triangle at three speeds separates it from dry
    /// friction.
    ///
    /// # Validity
    /// Together with `muscle.damping`, 80 N s/m by default, the sum must not be negative for the motion to be damped.
    /// Below 1 mm/s the power law is rounded to a straight line. A loss that hardly grows with speed, a below -0.6, is dry
    /// friction.
    ///
    /// # Reference
    /// D. Reynolds et al. (2003), Modeling the dynamic characteristics of pneumatic muscle, doi 10.1114/1.1554921
    /// (damping of inflation and deflation); thesis eq. 3.47. Thinning: H. Eyring (1936), doi 10.1063/1.1749836.
    pub struct ViscousDamping in "viscous_damping." as Tunable {
        /// Additional damping while the muscle shortens
        contraction: f64 = 0.0, NEWTON_SECOND_PER_METRE, (-80.0..=1e4);
        /// Additional damping while the muscle lengthens
        extension: f64 = 0.0, NEWTON_SECOND_PER_METRE, (-80.0..=1e4);
        /// Growth of the additional damping with speed: 0 none, 1 in proportion
        exponent: f64 = 0.0, ONE, (-0.6..=2.0);
        /// Inverse of the velocity beyond which the loss grows with its logarithm only
        thinning: f64 = 0.0, SECOND_PER_METRE, (0.0..=100.0);
        /// Relative growth of the additional damping with pressure, at 2 bar
        with_pressure: f64 = 0.0, ONE, (-1.0..=1.0);
        /// Relative growth of the additional damping with contraction, at 0.1 m
        with_contraction: f64 = 0.0, ONE, (-1.0..=1.0);
    }
}

impl Effect for ViscousDamping {
    const DESCRIPTION: Description = Description {
        name: "viscous_damping",
        meaning: "a loss that grows with velocity, unlike in shortening and lengthening",
        equation: "F <- F - B asinh(k v)/k |v/v0|^a (1 + b (p/p0 - 1) + c (x/x0 - 1)),  B = B_contraction (v > 0) or B_extension (v < 0)",
        signature: "loop of the force residual grows with speed",
        experiment: "the same triangle at three speeds",
        reference: "Reynolds et al. 2003; thesis eq. 3.47",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[&[("viscous_damping.contraction", &[200.0]), ("viscous_damping.extension", &[200.0])]],
        further_forms: &[],
        refinements: &[
            ("viscous_damping.exponent", &[0.2, -0.2]),
            ("viscous_damping.thinning", &[10.0]),
            ("viscous_damping.with_pressure", &[0.3]),
            ("viscous_damping.with_contraction", &[0.3]),
        ],
    };

    fn is_neutral(&self) -> bool {
        self.contraction == 0.0 && self.extension == 0.0
    }

    fn is_plausible(&self) -> bool {
        // At up to 4 bar and 0.2 m.
        let most_grown = 1.0 + self.with_pressure.abs() + self.with_contraction.abs();
        self.contraction.min(self.extension) * most_grown > LEAST
    }

    fn muscle_force(&self, at: &Point, _own: &[f64], force: f64) -> f64 {
        if self.is_neutral() {
            return force;
        }
        let v = at.contraction_velocity;
        let growth = match self.exponent {
            0.0 => 1.0,
            exponent => (v.hypot(SMALL_VELOCITY) / REFERENCE_VELOCITY).powf(exponent),
        };
        let rate = if self.thinning == 0.0 { v } else { (self.thinning * v).asinh() / self.thinning };
        let place = 1.0
            + self.with_pressure * (at.relative_pressure() - 1.0)
            + self.with_contraction * (at.relative_contraction() - 1.0);
        // Damping that would drive the muscle is none.
        force - rate * growth * place.max(0.0) * if v > 0.0 { self.contraction } else { self.extension }
    }

    fn sentence(&self) -> String {
        let [up, down] = [self.contraction, self.extension].map(|more| {
            let word = if more < 0.0 { "less" } else { "more" };
            format!("{:.0} N s/m {word}", more.abs())
        });
        format!("Viscous damping: {up} than nominal while shortening, {down} while lengthening.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_muscle_that_hardly_damps_is_none() {
        let damping = |less: f64, with_pressure: f64| ViscousDamping {
            extension: -less,
            with_pressure,
            ..ViscousDamping::default()
        };
        assert!(
            [(20.0, 0.0), (50.0, 0.0), (25.0, 1.0)].into_iter().all(|(less, with)| damping(less, with).is_plausible())
        );
        assert!(![(70.0, 0.0), (40.0, -1.0)].into_iter().any(|(less, with)| damping(less, with).is_plausible()));
    }
}
