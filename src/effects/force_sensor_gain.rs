use super::{Description, Effect, Holds, REFERENCE_CONTRACTION, REFERENCE_FORCE, Readings, by_curvature, scaled};

crate::variables::variables! {
    /// A force sensor whose scale is off.
    ///
    /// # Model
    /// F_measured ← F_measured (1 + g + b (r − 1) + c (r² − 1) + a (s − 1)), r = F_measured/400 N, s = x_measured/0.1 m: `relative_error` g,
    /// `bend` b, `curvature` c, `with_contraction` a.
    ///
    /// # In the data
    /// The residual of the force is in proportion to the force, while the motion is as nominal; with a gain of the muscle the
    /// motion follows.
    ///
    /// # Validity
    /// Constant over a recording; slightly bent scales; the curvature is that of a cell or an amplifier whose scale falls with the force; with
    /// the contraction goes the scale of a cell that is pulled at an angle, which then changes.
    ///
    /// # Reference
    /// Definition of a gain; linearity errors in data sheets of sensors (up to 1 % of full scale).
    pub struct ForceSensorGain in "force_sensor_gain." as Tunable {
        /// Relative error of the force sensor
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the scale per 400 N away from 400 N
        bend: f64 = 0.0, ONE, (-0.1..=0.1);
        /// Change of the scale with the square of the force, per that of 400 N
        curvature: f64 = 0.0, ONE, (-0.03..=0.03);
        /// Change of the scale per 0.1 m of contraction away from 0.1 m
        with_contraction: f64 = 0.0, ONE, (-0.1..=0.1);
    }
}

impl Effect for ForceSensorGain {
    const DESCRIPTION: Description = Description {
        name: "force_sensor_gain",
        meaning: "the scale of the force sensor is off",
        equation: "F_measured <- F_measured (1 + g + b (r - 1) + c (r^2 - 1) + a (s - 1)), r = F_measured/400 N, s = x_measured/0.1 m",
        signature: "residual of the force in proportion to it",
        experiment: "hang two known masses on the sensor",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[
            &[("force_sensor_gain.relative_error", &[0.05, -0.05])],
            // A gain alone may be what the coefficients of the muscle stand for.
            &[("force_sensor_gain.bend", &[0.02]), ("force_sensor_gain.relative_error", &[0.0])],
        ],
        further_forms: &[],
        refinements: &[
            ("force_sensor_gain.bend", &[0.005]),
            ("force_sensor_gain.curvature", &[0.002]),
            ("force_sensor_gain.with_contraction", &[0.01]),
        ],
    };
    const ENDS_INSIDE: &'static [&'static str] =
        &["force_sensor_gain.bend", "force_sensor_gain.curvature", "force_sensor_gain.with_contraction"];

    fn is_neutral(&self) -> bool {
        [self.relative_error, self.bend, self.curvature, self.with_contraction] == [0.0; 4]
    }

    fn readings(&self, readings: Readings) -> Readings {
        let curved = by_curvature(readings.force, self.curvature, REFERENCE_FORCE);
        let at_angle = self.with_contraction * (readings.contraction / REFERENCE_CONTRACTION - 1.0);
        let relative_error = self.relative_error + curved + at_angle;
        Readings { force: scaled(readings.force, relative_error, self.bend, REFERENCE_FORCE), ..readings }
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "less" } else { "more" };
        format!("The force sensor shows {:.1} % {word} than there is.", 100.0 * self.relative_error.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_that_is_pulled_at_an_angle_is_one_whose_scale_goes_with_the_contraction() {
        let angle = |contraction: f64| 0.42 - 0.8 * contraction;
        let (relative_error, with_contraction) = (angle(0.1).cos() - 1.0, 0.08 * angle(0.1).sin());
        let cell = ForceSensorGain { relative_error, with_contraction, ..ForceSensorGain::default() };
        for contraction in [0.0, 0.05, 0.1, 0.15, 0.2] {
            let at = Readings { time: 0.0, contraction, gauge_pressure: 2e5, force: 400.0 };
            let [shown, should] = [cell.readings(at).force, 400.0 * angle(contraction).cos()];
            assert!((shown - should).abs() < 1.4, "{contraction}: {shown} {should}");
        }
    }
}
