use super::{Description, Effect, Holds, Point};

crate::variables::variables! {
    /// Slow change while the muscle warms up.
    ///
    /// # Model
    /// τ dw/dt = 1 − w from w = 0 at the start; the area counts 1 + a w times, the elastic force 1 + e w times:
    /// `time_constant` τ, `area_change` a, `elastic_change` e.
    ///
    /// # In the data
    /// One cycle differs from the next, the less the later; the force residual grows from zero at the start and stays.
    /// Creep comes back after every step.
    ///
    /// # Validity
    /// The recording starts cold. Warmth from work is lumped into one time constant; no muscle warms within less than 3 s.
    ///
    /// # Reference
    /// Newton's law of heating; definition.
    pub struct TemperatureDrift in "temperature_drift." as Tunable {
        /// Relative change of the area when warm
        area_change: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Relative change of the elastic force when warm
        elastic_change: f64 = 0.0, ONE, (-0.9..=2.0);
        /// Time constant of the warming
        time_constant: f64 = 15.0, SECOND, (3.0..=1000.0);
    }
}

impl Effect for TemperatureDrift {
    const DESCRIPTION: Description = Description {
        name: "temperature_drift",
        meaning: "slow change of the muscle while it warms up",
        equation: "tau dw/dt = 1 - w;  A <- A (1 + a w);  F_e <- F_e (1 + e w)",
        signature: "force residual that grows from zero and stays: the first cycle differs from the last",
        experiment: "the same cycle for several minutes, from cold",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[&[
            ("temperature_drift.area_change", &[0.05, -0.05]),
            ("temperature_drift.time_constant", &[10.0, 25.0]),
        ]],
        refinements: &[("temperature_drift.elastic_change", &[0.05])],
    };
    const STATE_SCALES: &'static [f64] = &[1.0];

    fn is_neutral(&self) -> bool {
        self.area_change == 0.0 && self.elastic_change == 0.0
    }

    fn rates(&self, _at: &Point, own: &[f64], rates: &mut [f64]) {
        rates[0] = (1.0 - own[0]) / self.time_constant;
    }

    fn area_force(&self, _at: &Point, own: &[f64], force: f64) -> f64 {
        force * (1.0 + self.area_change * own[0])
    }

    fn elastic_force(&self, _at: &Point, own: &[f64], force: f64) -> f64 {
        force * (1.0 + self.elastic_change * own[0])
    }

    fn sentence(&self) -> String {
        format!(
            "The muscle changes as it warms up, within {:.0} s: its area by {:+.1} %, its elastic force by {:+.1} %.",
            self.time_constant,
            100.0 * self.area_change,
            100.0 * self.elastic_change
        )
    }
}
