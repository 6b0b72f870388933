use super::{Description, Effect, Holds, REFERENCE_CONTRACTION, Readings, scaled, unscaled};

crate::variables::variables! {
    /// A position sensor whose scale is off.
    ///
    /// # Model
    /// x_measured ← x_measured (1 + g + b (x_measured/0.1 m − 1)): `relative_error` g, `bend` b.
    ///
    /// # In the data
    /// The residual of the contraction is in proportion to the contraction; the force is as it should be for the true one.
    ///
    /// # Validity
    /// Constant over a recording; slightly bent scales.
    ///
    /// # Reference
    /// Definition of a gain; linearity errors in data sheets of sensors (up to 1 % of full scale).
    pub struct ContractionSensorGain in "contraction_sensor_gain." as Tunable {
        /// Relative error of the position sensor
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the scale per 0.1 m away from 0.1 m
        bend: f64 = 0.0, ONE, (-0.1..=0.1);
    }
}

impl Effect for ContractionSensorGain {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_gain",
        meaning: "the scale of the position sensor is off",
        equation: "x_measured <- x_measured (1 + g + b (x_measured/0.1 m - 1))",
        signature: "residual of the contraction in proportion to it",
        experiment: "compare with a ruler at two lengths",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[
            &[("contraction_sensor_gain.relative_error", &[0.05, -0.05])],
            // A gain alone may be what the coefficients of the muscle stand for.
            &[("contraction_sensor_gain.bend", &[0.02]), ("contraction_sensor_gain.relative_error", &[0.0])],
        ],
        further_forms: &[],
        refinements: &[("contraction_sensor_gain.bend", &[0.005])],
    };
    const ENDS_INSIDE: &'static [&'static str] = &["contraction_sensor_gain.bend"];

    fn is_neutral(&self) -> bool {
        self.relative_error == 0.0 && self.bend == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings {
            contraction: scaled(readings.contraction, self.relative_error, self.bend, REFERENCE_CONTRACTION),
            ..readings
        }
    }

    fn true_contraction(&self, reading: f64, _force: f64, _time: f64) -> f64 {
        unscaled(reading, self.relative_error, self.bend, REFERENCE_CONTRACTION)
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "less" } else { "more" };
        format!("The position sensor shows {:.1} % {word} than there is.", 100.0 * self.relative_error.abs())
    }
}
