use super::{Description, Effect, Holds, Point, REFERENCE_FORCE};

/// Share of the loss, and of the pressure over which it fades, that no pull takes away; not physical, it keeps them above zero.
const LEAST_SHARE: f64 = 0.05;

crate::variables::variables! {
    /// Pressure that is lost before the muscle responds.
    ///
    /// # Model
    /// The area feels p − (l₀ + l exp(−(p/f)ᵉ)) exp(−d x/0.1 m) (1 + w F/400 N), but nothing below zero: `lost` l, `exponent` e,
    /// `decrease_with_contraction` d, as a bladder comes to the braid while the muscle grows thick, `increase_with_pull` w of the static
    /// nominal pull F, as a stretched muscle is thin; f = `fade` (1 + v F/400 N), `wider_with_pull` v. `lasting` l₀ does not fade with
    /// the pressure and, with an `onset` o, is l₀ (1 − exp(−p/o)). Of a bladder that comes to the braid bit by bit p/(1 + (p/c)ⁿ) is lost as well:
    /// at the pressure `contact` c half of it is there, the more suddenly the larger `contact_exponent` n.
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
        /// Increase of the loss with a pull of 400 N
        increase_with_pull: f64 = 0.0, ONE, (-0.3..=3.0);
        /// Increase of the pressure over which the loss fades with a pull of 400 N
        wider_with_pull: f64 = 0.0, ONE, (-0.3..=3.0);
        /// Pressure that is lost at any pressure
        lasting: f64 = 0.0, PASCAL, (0.0..=4e5);
        /// Pressure over which that sets in
        onset: f64 = 0.0, PASCAL, (0.0..=2e5);
        /// Pressure at which half of a bladder is in contact with the braid that comes to it bit by bit
        contact: f64 = 0.0, PASCAL, (0.0..=3e5);
        /// How suddenly it comes into contact: 2 gradually
        contact_exponent: f64 = 2.0, ONE, (1.2..=6.0);
    }
}

impl ThresholdPressure {
    /// What is lost at a gauge pressure in Pa and a static pull in N, at rest length, Pa.
    fn lost_at(&self, gauge_pressure: f64, pull: &impl Fn() -> f64) -> f64 {
        let [more, wider] = self.grown(pull);
        let pressure = gauge_pressure.max(0.0);
        let set_in = if self.onset == 0.0 { 1.0 } else { 1.0 - (-pressure / self.onset).exp() };
        let relative = pressure / (self.fade * wider);
        let power = if self.exponent == 1.0 { relative } else { relative.powf(self.exponent) };
        (self.lasting * set_in + self.lost * (-power).exp() + self.out_of_contact(pressure)) * more
    }

    /// What is lost at a pressure in Pa as a part of the bladder is not in contact yet, Pa.
    fn out_of_contact(&self, pressure: f64) -> f64 {
        if self.contact == 0.0 {
            return 0.0;
        }
        pressure / (1.0 + (pressure / self.contact).powf(self.contact_exponent))
    }

    /// Factors of the loss and of the pressure over which it fades at a pull in N.
    fn grown(&self, pull: &impl Fn() -> f64) -> [f64; 2] {
        let shares = [self.increase_with_pull, self.wider_with_pull];
        if shares == [0.0; 2] {
            return [1.0; 2];
        }
        let relative = pull().max(0.0) / REFERENCE_FORCE;
        shares.map(|share| (1.0 + share * relative).max(LEAST_SHARE))
    }
}

impl Effect for ThresholdPressure {
    const DESCRIPTION: Description = Description {
        name: "threshold_pressure",
        meaning: "pressure lost before the muscle responds, which matters at low pressure",
        equation: "p <- max(0, p - (l0 (1 - exp(-p/o)) + l exp(-(p/(f (1 + v F/400 N)))^e) + p/(1 + (p/c)^n)) exp(-d x/0.1 m) (1 + w F/400 N))",
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
            &[("threshold_pressure.lasting", &[0.2e5]), ("threshold_pressure.increase_with_pull", &[0.5])],
            &[
                ("threshold_pressure.lost", &[0.6e5]),
                ("threshold_pressure.fade", &[0.6e5]),
                ("threshold_pressure.exponent", &[1.5]),
                ("threshold_pressure.wider_with_pull", &[0.5]),
            ],
            &[("threshold_pressure.contact", &[0.3e5, 0.8e5]), ("threshold_pressure.contact_exponent", &[2.5])],
        ],
        refinements: &[
            ("threshold_pressure.exponent", &[1.5, 2.5]),
            ("threshold_pressure.decrease_with_contraction", &[0.2]),
            ("threshold_pressure.increase_with_pull", &[0.2]),
            ("threshold_pressure.wider_with_pull", &[0.2]),
        ],
    };

    fn is_neutral(&self) -> bool {
        self.lost == 0.0 && self.lasting == 0.0 && self.contact == 0.0
    }

    fn effective_pressure(&self, at: &Point, pull: &impl Fn() -> f64, pressure: f64) -> f64 {
        if self.is_neutral() {
            return pressure;
        }
        let contracted = (-self.decrease_with_contraction * at.relative_contraction()).exp();
        // A pressure that was negative before is no business of this effect.
        (pressure - self.lost_at(at.gauge_pressure, pull) * contracted).max(pressure.min(0.0))
    }

    fn sentence(&self) -> String {
        let bar = |gauge_pressure: f64, pull: f64| 1e-5 * self.lost_at(gauge_pressure, &|| pull);
        let lasting = |pull: f64| 1e-5 * self.lasting * self.grown(&|| pull)[0];
        let (fades, low) = (self.lost != 0.0 || self.contact != 0.0, self.contact);
        let told = if !fades {
            let word = if self.decrease_with_contraction > 0.0 { "less" } else { "more" };
            let percent = 100.0 * (-self.decrease_with_contraction).exp_m1().abs();
            let then = if percent == 0.0 {
                String::new()
            } else {
                format!(" at rest length, {percent:.0} % {word} at 0.1 m of contraction")
            };
            format!("The muscle responds late: {:.2} bar are lost before it does{then}", lasting(0.0))
        } else {
            let at_low = if low == 0.0 { "at first".to_owned() } else { format!("at {:.2} bar", 1e-5 * low) };
            format!(
                "At low pressure the muscle responds late: {:.2} bar are lost {at_low}, {:.2} bar at 1 bar",
                bar(low, 0.0),
                bar(1e5, 0.0)
            )
        };
        if [self.increase_with_pull, self.wider_with_pull] == [0.0; 2] {
            return format!("{told}.");
        }
        let pulled = if fades {
            format!("{:.2} and {:.2} bar", bar(low, REFERENCE_FORCE), bar(1e5, REFERENCE_FORCE))
        } else {
            format!("{:.2} bar", lasting(REFERENCE_FORCE))
        };
        format!("{told}; under a pull of {REFERENCE_FORCE:.0} N {pulled}.")
    }
}
