use super::{Description, Effect, Holds, Point, exponential};

/// Beyond these it is no tube of rubber that adds its force: a stop, or something else that begins at some contraction.
const LEAST_GROWTH: f64 = -1.0;
const MOST_GROWTH: f64 = 3.0;
const MOST_CURVATURE: f64 = 1.0;
/// Relative change of the nominal force at 0.1 m beyond which a tube that adds its force does not go with one the other way: these would
/// cancel, and what is left of both may have any course.
const MOST_OPPOSED: f64 = 0.1;

crate::variables::variables! {
    /// A membrane that is stiffer or softer than nominal.
    ///
    /// # Model
    /// F_e ← F_e (1 + c + c₁ x/0.1 m) − f (eᵍˢ − 1)/(eᵍ − 1) (1 + h (s − 1)²), s = x/0.1 m: `relative_change` c,
    /// `change_with_contraction` c₁. What a tube of rubber beside the nominal one pulls back begins with zero: `added_force` f,
    /// `added_growth` g, `added_curvature` h.
    ///
    /// # In the data
    /// The force residual is a single-valued function of the contraction, the same at every pressure, also at none. A
    /// gain of the force would grow with pressure; series elasticity shows with the length locked.
    ///
    /// # Validity
    /// ± 35 % are usual between specimens and with age.
    ///
    /// # Reference
    /// Thesis eqs. 4.5 and 4.17 (elastic term). Y. Fung (1967), Elasticity of soft tissues in simple elongation,
    /// doi 10.1152/ajplegacy.1967.213.6.1532 (exponential), and what differs from it in a neo-Hookean or Gent tube.
    pub struct BladderStiffness in "bladder_stiffness." as Tunable {
        /// Relative change of the elastic force
        relative_change: f64 = 0.0, ONE, (-0.9..=1.0);
        /// Further relative change at 0.1 m of contraction
        change_with_contraction: f64 = 0.0, ONE, (-0.9..=0.9);
        /// Force beside the nominal one with which the membrane pulls back at 0.1 m of contraction
        added_force: f64 = 0.0, NEWTON, (-500.0..=500.0);
        /// Growth of its stiffness over 0.1 m, as a logarithm
        added_growth: f64 = 0.0, ONE, (LEAST_GROWTH..=MOST_GROWTH);
        /// Further relative change of that force 0.1 m away from there, to either side
        added_curvature: f64 = 0.0, ONE, (-MOST_CURVATURE..=MOST_CURVATURE);
    }
}

impl BladderStiffness {
    /// What the tube pulls back with at a contraction in 0.1 m, relative to that at 0.1 m.
    fn grown(&self, s: f64) -> f64 {
        exponential(self.added_growth, s, 1.0)
    }
}

impl Effect for BladderStiffness {
    const DESCRIPTION: Description = Description {
        name: "bladder_stiffness",
        meaning: "the passive elastic force differs from nominal",
        equation: "F_e <- F_e (1 + c + c1 s) - f (exp(g s) - 1)/(exp(g) - 1) (1 + h (s - 1)^2), s = x/0.1 m",
        signature: "force residual depends on contraction alone, also at zero pressure",
        experiment: "stretch the muscle without pressure; the same motion at two constant pressures",
        reference: "thesis eqs. 4.5, 4.17",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("bladder_stiffness.relative_change", &[0.15, -0.15, 0.03, -0.03])],
            &[
                ("bladder_stiffness.added_force", &[60.0, -60.0, 12.0, -12.0]),
                ("bladder_stiffness.added_growth", &[0.6]),
            ],
        ],
        further_forms: &[],
        refinements: &[
            ("bladder_stiffness.change_with_contraction", &[0.1]),
            ("bladder_stiffness.added_curvature", &[0.1]),
        ],
    };

    const ENDS_INSIDE: &'static [&'static str] =
        &["bladder_stiffness.added_growth", "bladder_stiffness.added_curvature"];

    fn is_neutral(&self) -> bool {
        [self.relative_change, self.change_with_contraction, self.added_force] == [0.0; 3]
    }

    fn is_plausible(&self) -> bool {
        let change = self.relative_change + self.change_with_contraction;
        change.abs() <= MOST_OPPOSED || change * self.added_force >= 0.0
    }

    fn elastic_force(&self, at: &Point, _own: &[f64], force: f64) -> f64 {
        if self.is_neutral() {
            return force;
        }
        let s = at.relative_contraction();
        let added = self.added_force * self.grown(s) * (1.0 + self.added_curvature * (s - 1.0).powi(2));
        force * (1.0 + self.relative_change + self.change_with_contraction * s) - added
    }

    fn sentence(&self) -> String {
        let change = 100.0 * (self.relative_change + self.change_with_contraction);
        let word = |change: f64| if change < 0.0 { "softer" } else { "stiffer" };
        let percent = format!("{:.0} % {} than nominal", change.abs(), word(change));
        let newtons = format!("{:.0} N {}", self.added_force.abs(), word(self.added_force));
        let how = match (change, self.added_force) {
            (_, 0.0) => percent,
            (0.0, _) => newtons,
            _ => format!("{percent} and {newtons}"),
        };
        format!("The membrane is {how} at 10 cm of contraction.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_that_cancel_are_no_membrane() {
        let membrane = |change_with_contraction, added_force| BladderStiffness {
            change_with_contraction,
            added_force,
            ..BladderStiffness::default()
        };
        assert!(
            [(0.3, 0.0), (0.3, 100.0), (-0.3, -100.0), (0.05, -100.0)]
                .into_iter()
                .all(|(c, f)| membrane(c, f).is_plausible())
        );
        assert!(![(0.3, -100.0), (-0.3, 100.0)].into_iter().any(|(c, f)| membrane(c, f).is_plausible()));
    }
}
