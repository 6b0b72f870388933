use super::{Description, Effect, Point};

crate::variables::variables! {
    /// A membrane that is stiffer or softer than nominal.
    ///
    /// # Model
    /// F_e ← F_e (1 + c + c₁ x/0.1 m): `relative_change` c, `change_with_contraction` c₁.
    ///
    /// # In the data
    /// The force residual is a single-valued function of the contraction, the same at every pressure, also at none. A
    /// gain of the force would grow with pressure; series elasticity shows with the length locked.
    ///
    /// # Validity
    /// ± 35 % are usual between specimens and with age.
    ///
    /// # Reference
    /// Thesis eqs. 4.5 and 4.17 (elastic term).
    pub struct BladderStiffness in "bladder_stiffness." as Tunable {
        /// Relative change of the elastic force
        relative_change: f64 = 0.0, ONE, (-0.9..=1.0);
        /// Further relative change at 0.1 m of contraction
        change_with_contraction: f64 = 0.0, ONE, (-0.9..=0.9);
    }
}

impl Effect for BladderStiffness {
    const DESCRIPTION: Description = Description {
        name: "bladder_stiffness",
        meaning: "the passive elastic force differs from nominal",
        equation: "F_e <- F_e (1 + c + c1 x/0.1 m)",
        signature: "force residual depends on contraction alone, also at zero pressure",
        experiment: "stretch the muscle without pressure; the same motion at two constant pressures",
        reference: "thesis eqs. 4.5, 4.17",
        of_load: false,
        exact: false,
        forms: &[&[("bladder_stiffness.relative_change", &[0.15, -0.15])]],
        refinements: &[("bladder_stiffness.change_with_contraction", &[0.1])],
    };

    fn is_neutral(&self) -> bool {
        self.relative_change == 0.0 && self.change_with_contraction == 0.0
    }

    fn elastic_force(&self, at: &Point, _own: &[f64], force: f64) -> f64 {
        force * (1.0 + self.relative_change + self.change_with_contraction * at.relative_contraction())
    }

    fn sentence(&self) -> String {
        let change = 100.0 * (self.relative_change + self.change_with_contraction);
        let word = if change < 0.0 { "softer" } else { "stiffer" };
        format!("The membrane is {:.0} % {word} than nominal at 10 cm of contraction.", change.abs())
    }
}
