use super::{Description, Effect, Holds, REFERENCE_FORCE, Readings, by_curvature, scaled};

crate::variables::variables! {
    /// A force sensor whose scale is off.
    ///
    /// # Model
    /// F_measured ← F_measured (1 + g + b (r − 1) + c (r² − 1)), r = F_measured/400 N: `relative_error` g, `bend` b, `curvature` c.
    ///
    /// # In the data
    /// The residual of the force is in proportion to the force, while the motion is as nominal; with a gain of the muscle the
    /// motion follows.
    ///
    /// # Validity
    /// Constant over a recording; slightly bent scales; the curvature is that of a cell or an amplifier whose scale falls with the force.
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
    }
}

impl Effect for ForceSensorGain {
    const DESCRIPTION: Description = Description {
        name: "force_sensor_gain",
        meaning: "the scale of the force sensor is off",
        equation: "F_measured <- F_measured (1 + g + b (r - 1) + c (r^2 - 1)), r = F_measured/400 N",
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
        refinements: &[("force_sensor_gain.bend", &[0.005]), ("force_sensor_gain.curvature", &[0.002])],
    };
    const ENDS_INSIDE: &'static [&'static str] = &["force_sensor_gain.bend", "force_sensor_gain.curvature"];

    fn is_neutral(&self) -> bool {
        [self.relative_error, self.bend, self.curvature] == [0.0; 3]
    }

    fn readings(&self, readings: Readings) -> Readings {
        let curved = by_curvature(readings.force, self.curvature, REFERENCE_FORCE);
        Readings { force: scaled(readings.force, self.relative_error + curved, self.bend, REFERENCE_FORCE), ..readings }
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "less" } else { "more" };
        format!("The force sensor shows {:.1} % {word} than there is.", 100.0 * self.relative_error.abs())
    }
}
