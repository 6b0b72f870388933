use super::{Description, Effect, Readings};

crate::variables::variables! {
    /// A pressure sensor whose scale is off.
    ///
    /// # Model
    /// p_measured ← p_measured (1 + g): `relative_error` g.
    ///
    /// # In the data
    /// The residual of the pressure is in proportion to the pressure with a force that fits the command; with a gain of the
    /// valve the force follows the pressure.
    ///
    /// # Validity
    /// Constant over a recording.
    ///
    /// # Reference
    /// Definition of a gain.
    pub struct PressureSensorGain in "pressure_sensor_gain." as Tunable {
        /// Relative error of the pressure sensor
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
    }
}

impl Effect for PressureSensorGain {
    const DESCRIPTION: Description = Description {
        name: "pressure_sensor_gain",
        meaning: "the scale of the pressure sensor is off",
        equation: "p_measured <- p_measured (1 + g)",
        signature: "residual of the pressure in proportion to it",
        experiment: "compare with a second gauge at two pressures",
        reference: "definition",
        of_load: false,
        forms: &[&[("pressure_sensor_gain.relative_error", &[0.05, -0.05])]],
        refinements: &[],
    };

    fn is_neutral(&self) -> bool {
        self.relative_error == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { gauge_pressure: readings.gauge_pressure * (1.0 + self.relative_error), ..readings }
    }

    fn true_pressure(&self, reading: f64, _time: f64) -> f64 {
        reading / (1.0 + self.relative_error)
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "less" } else { "more" };
        format!("The pressure sensor shows {:.1} % {word} than there is.", 100.0 * self.relative_error.abs())
    }
}
