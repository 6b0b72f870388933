use super::{Description, Effect, Holds, Point};
use crate::scale::Scale;
use std::fmt::Write;

/// Command in V at which the gain is stated when the characteristic is bent: the middle of the usual range.
const MIDDLE: f64 = 2.0;

crate::variables::variables! {
    /// A valve whose calibration is off: pressure per volt.
    ///
    /// # Model
    /// u ← u (1 + g + b (u − 2 V) + c (r² − 1)) + s max(u − u_k, 0), r = u/2 V: `relative_error` g, `bend` b and `curvature` c of the
    /// characteristic, `slope_change` s above `knee` u_k.
    ///
    /// # In the data
    /// At rest the pressure residual is in proportion to the command. An offset of the valve is constant; a gain of the
    /// pressure sensor does the same to the pressure but leaves the force alone.
    ///
    /// # Validity
    /// Slightly bent characteristics: |b| up to 5 % per volt, |c| up to 5 %; ranges that were adjusted apart by up to 10 %.
    ///
    /// # Reference
    /// Linearity errors in data sheets of proportional pressure regulators (1 to 3 % of full scale).
    pub struct ValveGain in "valve_gain." as Tunable {
        /// Relative error of the pressure per volt
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the gain per volt away from 2 V
        bend: f64 = 0.0, PER_VOLT, (-0.05..=0.05);
        /// Change of the gain with the square of the command, per that of 2 V
        curvature: f64 = 0.0, ONE, (-0.05..=0.05);
        /// By how much the gain changes at the knee
        slope_change: f64 = 0.0, ONE, (-0.1..=0.1);
        /// Command from which on the gain is another one
        knee: f64 = 2.0, VOLT, (0.2..=9.0);
    }
}

impl ValveGain {
    /// The characteristic without its knee.
    fn scale(&self) -> Scale {
        let Self { relative_error, bend, curvature, .. } = *self;
        Scale { middle: MIDDLE, relative_error, bend: bend * MIDDLE, curvature, ..Scale::default() }
    }
}

impl Effect for ValveGain {
    const DESCRIPTION: Description = Description {
        name: "valve_gain",
        meaning: "the valve gives more or less pressure per volt than nominal",
        equation: "u <- u (1 + g + b (u - 2 V) + c (r^2 - 1)) + s max(u - u_k, 0), r = u/2 V",
        signature: "pressure residual at rest in proportion to the command",
        experiment: "stairs of the command with the pressure recorded by a second sensor",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[
            &[("valve_gain.relative_error", &[0.05, -0.05])],
            // In the mean it may be right.
            &[("valve_gain.bend", &[0.01]), ("valve_gain.relative_error", &[0.0])],
            &[
                ("valve_gain.relative_error", &[0.05]),
                ("valve_gain.slope_change", &[-0.04, -0.04, -0.04, 0.04, 0.04, 0.04]),
                ("valve_gain.knee", &[1.2, 1.8, 2.6, 1.2, 1.8, 2.6]),
            ],
        ],
        further_forms: &[],
        refinements: &[("valve_gain.bend", &[0.003]), ("valve_gain.curvature", &[0.002])],
    };
    const ENDS_INSIDE: &'static [&'static str] = &["valve_gain.bend", "valve_gain.curvature"];

    fn is_neutral(&self) -> bool {
        [self.relative_error, self.bend, self.curvature, self.slope_change] == [0.0; 4]
    }

    fn command(&self, _at: &Point, _own: &[f64], command: f64) -> f64 {
        self.scale().shown(command, 0.0) + self.slope_change * (command - self.knee).max(0.0)
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "less" } else { "more" };
        let mut told =
            format!("The valve gives {:.1} % {word} pressure per volt than nominal", 100.0 * self.relative_error.abs());
        let at_twice = self.scale().at_twice();
        if at_twice != 0.0 {
            let _ = write!(told, " at 2 V, and {:+.1} % on top at 4 V", 100.0 * at_twice);
        }
        if self.slope_change != 0.0 {
            let _ =
                write!(told, ", and from {:.1} V on {:+.1} % for what is beyond", self.knee, 100.0 * self.slope_change);
        }
        format!("{told}.")
    }
}
