use super::{Description, Effect, Point};

/// Command in V at which the gain is stated when the characteristic is bent: the middle of the usual range.
const MIDDLE: f64 = 2.0;

crate::variables::variables! {
    /// A valve whose calibration is off: pressure per volt.
    ///
    /// # Model
    /// u ← u (1 + g + b (u − 2 V)): `relative_error` g, `bend` b of the characteristic.
    ///
    /// # In the data
    /// At rest the pressure residual is in proportion to the command. An offset of the valve is constant; a gain of the
    /// pressure sensor does the same to the pressure but leaves the force alone.
    ///
    /// # Validity
    /// Slightly bent characteristics: |b| up to 5 % per volt.
    ///
    /// # Reference
    /// Linearity errors in data sheets of proportional pressure regulators (1 to 3 % of full scale).
    pub struct ValveGain in "valve_gain." as Tunable {
        /// Relative error of the pressure per volt
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the gain per volt away from 2 V
        bend: f64 = 0.0, PER_VOLT, (-0.05..=0.05);
    }
}

impl Effect for ValveGain {
    const DESCRIPTION: Description = Description {
        name: "valve_gain",
        meaning: "the valve gives more or less pressure per volt than nominal",
        equation: "u <- u (1 + g + b (u - 2 V))",
        signature: "pressure residual at rest in proportion to the command",
        experiment: "stairs of the command with the pressure recorded by a second sensor",
        reference: "definition",
        of_load: false,
        exact: true,
        forms: &[&[("valve_gain.relative_error", &[0.05, -0.05])]],
        refinements: &[("valve_gain.bend", &[0.003])],
    };

    fn is_neutral(&self) -> bool {
        self.relative_error == 0.0 && self.bend == 0.0
    }

    fn command(&self, _at: &Point, _own: &[f64], command: f64) -> f64 {
        command * (1.0 + self.relative_error + self.bend * (command - MIDDLE))
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "less" } else { "more" };
        format!("The valve gives {:.1} % {word} pressure per volt than nominal.", 100.0 * self.relative_error.abs())
    }
}
