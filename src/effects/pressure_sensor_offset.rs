use super::{Description, Effect, Readings};

crate::variables::variables! {
    /// A pressure sensor whose zero is not at ambient pressure.
    ///
    /// # Model
    /// p_measured ← p_measured + o: `offset` o.
    ///
    /// # In the data
    /// A constant residual of the measured pressure with a force that fits the command; with an offset of the valve the
    /// force follows the pressure.
    ///
    /// # Validity
    /// Constant over a recording.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct PressureSensorOffset in "pressure_sensor_offset." as Tunable {
        /// What the pressure sensor shows at ambient pressure
        offset: f64 = 0.0, PASCAL, (-1e5..=1e5);
    }
}

impl Effect for PressureSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "pressure_sensor_offset",
        meaning: "the zero of the pressure sensor is not at ambient pressure",
        equation: "p_measured <- p_measured + o",
        signature: "constant residual of the pressure, also at rest",
        experiment: "read the sensor with the muscle open to the air",
        reference: "definition",
        of_load: false,
        forms: &[&[("pressure_sensor_offset.offset", &[1e4, -1e4])]],
        refinements: &[],
    };

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { gauge_pressure: readings.gauge_pressure + self.offset, ..readings }
    }

    fn true_pressure(&self, reading: f64) -> f64 {
        reading - self.offset
    }

    fn sentence(&self) -> String {
        format!("The pressure sensor shows {:+.3} bar at ambient pressure.", self.offset * 1e-5)
    }
}
