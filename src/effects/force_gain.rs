use super::{Description, Effect, Holds, REFERENCE_FORCE, scaled};

crate::variables::variables! {
    /// A muscle that is stronger or weaker as a whole.
    ///
    /// # Model
    /// F_static ← F_static (1 + g + b (F_static/400 N − 1)): `relative_error` g, `bend` b where it changes with the force.
    ///
    /// # In the data
    /// The force residual is in proportion to the force, whatever pressure and contraction; the motion goes with it,
    /// unlike with a gain of the force sensor. One load alone cannot tell it from a wrong mass.
    ///
    /// # Validity
    /// Wrong bore or number of threads, ageing; damping and friction stay.
    ///
    /// # Reference
    /// Definition of a gain.
    pub struct ForceGain in "force_gain." as Tunable {
        /// Relative error of the static force
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the gain per 400 N away from 400 N: threads that stretch
        bend: f64 = 0.0, ONE, (-0.05..=0.05);
    }
}

impl Effect for ForceGain {
    const DESCRIPTION: Description = Description {
        name: "force_gain",
        meaning: "the whole force is scaled: wrong bore, ageing",
        equation: "F_static <- F_static (1 + g + b (F_static/400 N - 1))",
        signature: "force residual in proportion to the force, and the motion with it",
        experiment: "two known masses, static and dynamic",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[&[("force_gain.relative_error", &[0.08, -0.08, 0.02, -0.02])]],
        refinements: &[("force_gain.bend", &[0.005])],
    };

    fn is_neutral(&self) -> bool {
        self.relative_error == 0.0 && self.bend == 0.0
    }

    fn static_force(&self, force: f64) -> f64 {
        scaled(force, self.relative_error, self.bend, REFERENCE_FORCE)
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "weaker" } else { "stronger" };
        format!("The muscle is {:.1} % {word} than nominal.", 100.0 * self.relative_error.abs())
    }
}
