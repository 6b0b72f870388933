use super::{Description, Effect, Holds, Point};

crate::variables::variables! {
    /// Pressure that is lost before the muscle responds.
    ///
    /// # Model
    /// The area feels p − (l₀ + l exp(−(p/f)ᵉ)) exp(−d x/0.1 m), but nothing below zero: `lost` l, `fade` f, `exponent` e,
    /// `decrease_with_contraction` d, as a bladder comes to the braid while the muscle grows thick; `lasting` l₀ does not fade with the
    /// pressure and, with an `onset` o, is l₀ (1 − exp(−p/o)).
    ///
    /// # In the data
    /// The force falls short at low pressure only, by the same in both directions; above a bar or two nothing is wrong.
    /// An offset of the pressure sensor does not fade, and shows in its readings; a dead band of the valve has a direction.
    ///
    /// # Validity
    /// 0.2 to 1 bar are usual. With a large exponent the loss ends at once.
    ///
    /// # Reference
    /// C. Chou, B. Hannaford (1996), Measurement and modeling of McKibben pneumatic artificial muscles,
    /// doi 10.1109/70.481753 (bladder that does not touch the braid yet); deviation: the loss fades.
    pub struct ThresholdPressure in "threshold_pressure." as Tunable {
        /// Pressure that is lost at zero pressure
        lost: f64 = 0.0, PASCAL, (0.0..=4e5);
        /// Pressure over which the loss fades
        fade: f64 = 0.8e5, PASCAL, (0.2e5..=2.5e5);
        /// How suddenly the loss fades: 1 gradually
        exponent: f64 = 1.0, ONE, (0.5..=6.0);
        /// Decrease of the loss over 0.1 m of contraction, as a logarithm
        decrease_with_contraction: f64 = 0.0, ONE, (-1.0..=3.0);
        /// Pressure that is lost at any pressure
        lasting: f64 = 0.0, PASCAL, (0.0..=4e5);
        /// Pressure over which that sets in
        onset: f64 = 0.0, PASCAL, (0.0..=2e5);
    }
}

impl ThresholdPressure {
    /// What is lost for good at a gauge pressure in Pa, Pa.
    fn lasts(&self, gauge_pressure: f64) -> f64 {
        if self.onset == 0.0 {
            return self.lasting;
        }
        self.lasting * (1.0 - (-gauge_pressure.max(0.0) / self.onset).exp())
    }
}

impl Effect for ThresholdPressure {
    const DESCRIPTION: Description = Description {
        name: "threshold_pressure",
        meaning: "pressure lost before the muscle responds, which matters at low pressure",
        equation: "p <- max(0, p - (l0 (1 - exp(-p/o)) + l exp(-(p/f)^e)) exp(-d x/0.1 m))",
        signature: "force falls short at low pressure only, the same in both directions",
        experiment: "slow ramps of the pressure from zero at two lengths",
        reference: "Chou and Hannaford 1996",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("threshold_pressure.lost", &[0.4e5, 1e5]), ("threshold_pressure.fade", &[0.6e5, 1.2e5])],
            &[
                ("threshold_pressure.lost", &[0.3e5]),
                ("threshold_pressure.fade", &[0.8e5, 1.3e5]),
                ("threshold_pressure.exponent", &[4.0]),
            ],
        ],
        further_forms: &[
            &[("threshold_pressure.lasting", &[0.3e5])],
            &[("threshold_pressure.lasting", &[0.3e5]), ("threshold_pressure.onset", &[0.3e5])],
            &[("threshold_pressure.lasting", &[0.3e5]), ("threshold_pressure.decrease_with_contraction", &[0.5])],
        ],
        refinements: &[
            ("threshold_pressure.exponent", &[1.5, 2.5]),
            ("threshold_pressure.decrease_with_contraction", &[0.2]),
        ],
    };

    fn is_neutral(&self) -> bool {
        self.lost == 0.0 && self.lasting == 0.0
    }

    fn effective_pressure(&self, at: &Point, pressure: f64) -> f64 {
        if self.is_neutral() {
            return pressure;
        }
        let relative = at.gauge_pressure.max(0.0) / self.fade;
        let power = if self.exponent == 1.0 { relative } else { relative.powf(self.exponent) };
        let contracted = (-self.decrease_with_contraction * at.relative_contraction()).exp();
        // A pressure that was negative before is no business of this effect.
        let lost = (self.lasts(at.gauge_pressure) + self.lost * (-power).exp()) * contracted;
        (pressure - lost).max(pressure.min(0.0))
    }

    fn sentence(&self) -> String {
        if self.lost == 0.0 {
            let at_once = 1e-5 * self.lasting;
            let word = if self.decrease_with_contraction > 0.0 { "less" } else { "more" };
            let percent = 100.0 * (-self.decrease_with_contraction).exp_m1().abs();
            let then = if percent == 0.0 {
                String::new()
            } else {
                format!(" at rest length, {percent:.0} % {word} at 0.1 m of contraction")
            };
            return format!("The muscle responds late: {at_once:.2} bar are lost before it does{then}.");
        }
        let at_one_bar = self.lasts(1e5) + self.lost * (-(1e5 / self.fade).powf(self.exponent)).exp();
        format!(
            "At low pressure the muscle responds late: {:.2} bar are lost at first, {:.2} bar at 1 bar.",
            (self.lasts(0.0) + self.lost) * 1e-5,
            at_one_bar * 1e-5
        )
    }
}
