use super::{Description, Effect, Readings};

/// Pull in N at which the compliance is stated when it depends on the pull.
const REFERENCE_FORCE: f64 = 400.0;

crate::variables::variables! {
    /// Something in series with the muscle that stretches: a cable, a fitting, the frame.
    ///
    /// # Model
    /// x_measured ← x + s F₀ (F/F₀)ᵉ, F₀ = 400 N, for a pull F > 0: `compliance` s, `exponent` e (below 1 a cable that
    /// hardens). s < 0 where the position sensor sits behind what stretches and so shows less contraction than the muscle
    /// has; s > 0 where what gives way moves the sensor up.
    ///
    /// # In the data
    /// The residual of the contraction is in proportion to the force. A stiffer or softer bladder does not depend on
    /// pressure with the length locked; an elastic cable does.
    ///
    /// # Validity
    /// The stretch adds to the reading only: its rate is neglected in the motion of the load, and so is its work. 10⁵ to
    /// 10⁶ N/m are usual stiffnesses.
    ///
    /// # Reference
    /// Hooke's law; power law of slack strands.
    pub struct SeriesElasticity in "series_elasticity." as Tunable {
        /// Reading per pull, at 400 N
        compliance: f64 = 0.0, METRE_PER_NEWTON, (-1e-4..=1e-4);
        /// Power of the pull with which it stretches
        exponent: f64 = 1.0, ONE, (0.3..=3.0);
    }
}

impl SeriesElasticity {
    /// What the reading gains in m at a pull in N.
    fn gain(&self, force: f64) -> f64 {
        if self.exponent == 1.0 || self.compliance == 0.0 {
            return self.compliance * force;
        }
        self.compliance * REFERENCE_FORCE * (force.max(0.0) / REFERENCE_FORCE).powf(self.exponent)
    }
}

impl Effect for SeriesElasticity {
    const DESCRIPTION: Description = Description {
        name: "series_elasticity",
        meaning: "cable, fitting or frame stretches with force",
        equation: "x_measured <- x + s F0 (F/F0)^e",
        signature: "residual of the contraction in proportion to the force",
        experiment: "lock the load and vary the pressure",
        reference: "Hooke",
        of_load: false,
        forms: &[&[("series_elasticity.compliance", &[-5e-6, 5e-6])]],
        refinements: &[("series_elasticity.exponent", &[0.8])],
    };

    fn is_neutral(&self) -> bool {
        self.compliance == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { contraction: readings.contraction + self.gain(readings.force), ..readings }
    }

    fn true_contraction(&self, reading: f64, force: f64) -> f64 {
        reading - self.gain(force)
    }

    fn sentence(&self) -> String {
        let millimetres = 1e3 * self.gain(REFERENCE_FORCE);
        let word = if millimetres < 0.0 { "less" } else { "more" };
        format!(
            "Something in series with the muscle gives way: at 400 N the position sensor shows {:.2} mm {word} than the muscle contracts.",
            millimetres.abs()
        )
    }
}
