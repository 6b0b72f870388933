use super::{Description, Effect, Holds, of_recording, told_anew};

crate::variables::variables! {
    /// A load that is not what was entered.
    ///
    /// # Model
    /// M ← M (1 + m) + ΔM + ΔM_k + q x: `additional_mass` ΔM, the same with every load (a hanger that was not weighed), ΔM_k by which a load was
    /// entered wrongly in the `second` or the `third` recording, `relative_error` m of what was entered (a wrong scale), `per_length` q of a chain that is lifted from the floor. `inertia` ΔI moves along without a weight: a pulley's moment of
    /// inertia over its radius squared, or twice a counterweight −ΔM, whose weight is taken away and whose mass moves along.
    ///
    /// # In the data
    /// The force residual is in proportion to g + d²x/dt², also at rest; the resonance shifts. With one load only it
    /// looks like a force gain; a second known load separates them.
    ///
    /// # Validity
    /// What is lifted comes to speed without a jerk: its momentum flow q (dx/dt)² is left out.
    ///
    /// # Reference
    /// Thesis eq. 5.4.
    pub struct PayloadMass in "payload_mass." as Tunable {
        /// Mass beyond the entered one
        additional_mass: f64 = 0.0, KILOGRAM, (-500.0..=500.0);
        /// By how much more in the second of several recordings
        second: f64 = 0.0, KILOGRAM, (-500.0..=500.0), of 2;
        /// By how much more in the third
        third: f64 = 0.0, KILOGRAM, (-500.0..=500.0), of 3;
        /// Which of the recordings is simulated: from the fourth on as the first
        recording: f64 = 1.0, ONE, (1.0..=1000.0);
        /// Relative error of the entered mass
        relative_error: f64 = 0.0, ONE, (-0.9..=3.0);
        /// Mass per metre of contraction that is lifted, too
        per_length: f64 = 0.0, KILOGRAM_PER_METRE, (-200.0..=200.0);
        /// Mass that moves along and does not weigh
        inertia: f64 = 0.0, KILOGRAM, (-500.0..=500.0);
    }
}

impl Effect for PayloadMass {
    const DESCRIPTION: Description = Description {
        name: "payload_mass",
        meaning: "the load is not what was entered",
        equation: "M <- M (1 + m) + dM + dM_k + q x;  weight M g, inertia M + dI",
        signature: "force residual in proportion to g + acceleration, also at rest",
        experiment: "two known masses, static and dynamic",
        reference: "thesis eq. 5.4",
        of_load: true,
        holds: Holds::Exactly,
        forms: &[
            &[("payload_mass.additional_mass", &[2.0, -2.0])],
            &[("payload_mass.relative_error", &[0.1, -0.1])],
            // A pulley that was not thought of.
            &[("payload_mass.inertia", &[5.0, -2.0])],
        ],
        further_forms: &[
            &[("payload_mass.additional_mass", &[0.5]), ("payload_mass.per_length", &[20.0, -20.0])],
            &[("payload_mass.additional_mass", &[0.5]), ("payload_mass.second", &[2.0, -2.0])],
            &[
                ("payload_mass.additional_mass", &[0.5]),
                ("payload_mass.second", &[2.0, -2.0, 0.5]),
                ("payload_mass.third", &[0.5, 0.5, 2.0, -2.0]),
            ],
        ],
        refinements: &[
            ("payload_mass.additional_mass", &[0.5]),
            ("payload_mass.relative_error", &[0.02]),
            ("payload_mass.inertia", &[1.0]),
        ],
    };

    fn is_neutral(&self) -> bool {
        [self.additional_mass, self.second, self.third, self.relative_error, self.per_length, self.inertia] == [0.0; 6]
    }

    fn mass(&self, mass: f64, contraction: f64) -> f64 {
        let own = of_recording(self.recording, [self.second, self.third]);
        mass * (1.0 + self.relative_error) + self.additional_mass + own + self.per_length * contraction
    }

    fn inertia(&self, mass: f64) -> f64 {
        mass + self.inertia
    }

    fn sentence(&self) -> String {
        let word = |change: f64| if change < 0.0 { "lighter" } else { "heavier" };
        let (mass, percent) = (self.additional_mass, 100.0 * self.relative_error);
        let if_any = |size: f64, text: String| if size == 0.0 { String::new() } else { text };
        let how = if self.inertia < 0.0 { "weigh and do not move" } else { "move along and do not weigh" };
        let inertia = if_any(self.inertia, format!("; {:.2} kg {how}", self.inertia.abs()));
        let anew = told_anew([self.second, self.third], |own, recording| {
            format!(", {:+.2} kg in the {recording} recording", mass + own)
        });
        let lifted = if_any(self.per_length, format!(", {:+.1} kg per metre that it is lifted", self.per_length));
        if [percent, mass] == [0.0; 2] && self.inertia != 0.0 {
            return format!("The load weighs what was entered{anew}{lifted}{inertia}.");
        }
        if percent == 0.0 {
            return format!("The load is {:.2} kg {} than entered{anew}{lifted}{inertia}.", mass.abs(), word(mass));
        }
        let beyond = if_any(mass, format!(", and {mass:+.2} kg"));
        format!("The load is {:.1} % {} than entered{beyond}{anew}{lifted}{inertia}.", percent.abs(), word(percent))
    }
}
