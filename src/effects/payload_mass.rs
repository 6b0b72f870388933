use super::{Description, Effect};

crate::variables::variables! {
    /// A load that is not what was entered.
    ///
    /// # Model
    /// M ← M + ΔM: `additional_mass` ΔM.
    ///
    /// # In the data
    /// The force residual is in proportion to g + d²x/dt², also at rest; the resonance shifts. With one load only it
    /// looks like a force gain; a second known load separates them.
    ///
    /// # Reference
    /// Thesis eq. 5.4.
    pub struct PayloadMass in "payload_mass." as Tunable {
        /// Mass beyond the entered one
        additional_mass: f64 = 0.0, KILOGRAM, (-500.0..=500.0);
    }
}

impl Effect for PayloadMass {
    const DESCRIPTION: Description = Description {
        name: "payload_mass",
        meaning: "the load is not what was entered",
        equation: "M <- M + dM",
        signature: "force residual in proportion to g + acceleration, also at rest",
        experiment: "two known masses, static and dynamic",
        reference: "thesis eq. 5.4",
        of_load: true,
        forms: &[&[("payload_mass.additional_mass", &[1.0])]],
        refinements: &[],
    };

    fn mass(&self, mass: f64) -> f64 {
        mass + self.additional_mass
    }

    fn sentence(&self) -> String {
        let (size, word) = (self.additional_mass.abs(), if self.additional_mass < 0.0 { "lighter" } else { "heavier" });
        format!("The load is {size:.2} kg {word} than entered.")
    }
}
