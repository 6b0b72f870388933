use super::{Description, Effect, Holds, Point};

/// Gauge pressure in Pa over which the part that belongs to low pressure fades.
const FADE: f64 = 1e5;

crate::variables::variables! {
    /// Ends that are no cylinder: the middle of the muscle contracts more than the whole.
    ///
    /// # Model
    /// The braid feels k x in place of the contraction x, k = 1 + (c + a exp(−p/1 bar)) (1 + g (x/0.1 m − 1)): `excess` c,
    /// `low_pressure_excess` a, `growth` g. What resists elastically feels x + m (k − 1) x: `elastic_share` m. Ends that taper
    /// while the muscle is long take off the area: p A ← p A (1 − t exp(−x/x_t)), `taper` t, `taper_length` x_t; no
    /// more than t where the muscle is longer than at rest.
    ///
    /// # In the data
    /// The force residual grows with the contraction and with pressure; with the rest length it shrinks.
    ///
    /// # Validity
    /// k of 1.0 to 1.3 is usual for muscles of 10 to 30 diameters.
    ///
    /// # Reference
    /// B. Tondu, P. Lopez (2000), Modeling and control of McKibben artificial muscle robot actuators,
    /// doi 10.1109/37.833638 (factor k); k(p) = a exp(−b p) + c: C. Kothera et al. (2009), doi 10.1115/1.3158982.
    pub struct EndEffects in "end_effects." as Tunable {
        /// By how much the contraction counts more than once
        excess: f64 = 0.0, ONE, (-0.5..=1.0);
        /// By how much more it counts without pressure
        low_pressure_excess: f64 = 0.0, ONE, (-0.5..=1.0);
        /// Relative growth of both from 0.1 m to 0.2 m of contraction
        growth: f64 = 0.0, ONE, (-1.0..=1.0);
        /// Share of the excess that the membrane feels, too
        elastic_share: f64 = 1.0, ONE, (0.0..=1.0);
        /// Share of the area that tapered ends take off at full length
        taper: f64 = 0.0, ONE, (-0.5..=0.9);
        /// Contraction over which that fades
        taper_length: f64 = 0.03, METRE, (0.005..=0.1);
    }
}

impl EndEffects {
    /// By how much the contraction counts more, m.
    fn beyond(&self, at: &Point) -> f64 {
        let mut excess = self.excess;
        if self.low_pressure_excess != 0.0 {
            excess += self.low_pressure_excess * (-at.gauge_pressure / FADE).exp();
        }
        if self.growth != 0.0 {
            excess *= 1.0 + self.growth * (at.relative_contraction() - 1.0);
        }
        excess * at.contraction
    }
}

impl Effect for EndEffects {
    const DESCRIPTION: Description = Description {
        name: "end_effects",
        meaning: "the ends are no cylinder: the contraction counts k times",
        equation: "x <- k x, k = 1 + (c + a exp(-p/1 bar)) (1 + g (x/0.1 m - 1));  membrane: x <- x + m (k - 1) x;  p A <- p A (1 - t exp(-x/x_t))",
        signature: "force residual grows with contraction and pressure",
        experiment: "compare two rest lengths",
        reference: "Tondu and Lopez 2000; Kothera et al. 2009",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("end_effects.excess", &[0.1, 0.02, -0.02])],
            &[("end_effects.excess", &[0.1, 0.02, -0.02]), ("end_effects.elastic_share", &[0.0])],
        ],
        further_forms: &[&[("end_effects.taper", &[0.15]), ("end_effects.taper_length", &[0.02, 0.05])]],
        refinements: &[("end_effects.low_pressure_excess", &[0.05]), ("end_effects.growth", &[0.3])],
    };
    const ENDS_INSIDE: &'static [&'static str] = &["end_effects.growth"];

    fn is_neutral(&self) -> bool {
        [self.excess, self.low_pressure_excess, self.taper] == [0.0; 3]
    }

    fn is_plausible(&self) -> bool {
        // At its bounds a taper is a wrong area, or none.
        self.taper == 0.0 || (0.0055..0.095).contains(&self.taper_length)
    }

    fn effective_contraction(&self, at: &Point, _own: &[f64], contraction: f64) -> f64 {
        contraction + self.beyond(at)
    }

    fn area_force(&self, at: &Point, _own: &[f64], force: f64) -> f64 {
        if self.taper == 0.0 {
            return force;
        }
        force * (1.0 - self.taper * (-at.contraction.max(0.0) / self.taper_length).exp())
    }

    fn elastic_contraction(&self, at: &Point, _own: &[f64], contraction: f64) -> f64 {
        if self.elastic_share == 1.0 { contraction } else { contraction - (1.0 - self.elastic_share) * self.beyond(at) }
    }

    fn sentence(&self) -> String {
        if self.taper != 0.0 {
            let (percent, length) = (100.0 * self.taper.abs(), 1e3 * self.taper_length);
            let word = if self.taper < 0.0 { "more" } else { "less" };
            return format!(
                "The ends of the muscle taper: at full length the pressure pulls {percent:.1} % {word}, which fades within {length:.0} mm."
            );
        }
        let at_two_bar = 1.0 + self.excess + self.low_pressure_excess * (-2e5 / FADE).exp();
        let membrane = if self.elastic_share == 1.0 {
            String::new()
        } else {
            format!(", for the membrane {:.2} times", 1.0 + self.elastic_share * (at_two_bar - 1.0))
        };
        let word = if at_two_bar < 1.0 { "more than nominal" } else { "less than its middle" };
        format!(
            "The ends of the muscle contract {word}: at 2 bar the contraction counts {at_two_bar:.2} times{membrane}."
        )
    }
}
