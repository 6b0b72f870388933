use super::{Description, Effect, Holds, Readings, settling};

crate::variables::variables! {
    /// A pressure sensor whose zero is not at ambient pressure.
    ///
    /// # Model
    /// p_measured ← p_measured + o (1 + s exp(−t/τ)): `offset` o, `settling_share` s, `settling_time` τ, t since the start.
    ///
    /// # In the data
    /// A constant residual of the measured pressure with a force that fits the command; with an offset of the valve the
    /// force follows the pressure.
    ///
    /// # Validity
    /// Constant, or settling while the sensor warms up from the start of the recording.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct PressureSensorOffset in "pressure_sensor_offset." as Tunable {
        /// What the pressure sensor shows at ambient pressure
        offset: f64 = 0.0, PASCAL, (-1e5..=1e5);
        /// Excess of the offset at the start, relative to the offset that settles
        settling_share: f64 = 0.0, ONE, (-1.0..=2.0);
        /// Time constant of the settling
        settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
    }
}

impl PressureSensorOffset {
    /// What the sensor adds at a time in s since the start.
    fn zero(&self, time: f64) -> f64 {
        settling(self.offset, self.settling_share, self.settling_time, time)
    }
}

impl Effect for PressureSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "pressure_sensor_offset",
        meaning: "the zero of the pressure sensor is not at ambient pressure",
        equation: "p_measured <- p_measured + o (1 + s exp(-t/tau))",
        signature: "constant residual of the pressure, also at rest",
        experiment: "read the sensor with the muscle open to the air",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[&[("pressure_sensor_offset.offset", &[1e4, -1e4])]],
        refinements: &[
            ("pressure_sensor_offset.settling_share", &[0.3]),
            ("pressure_sensor_offset.settling_time", &[5.0]),
        ],
    };

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { gauge_pressure: readings.gauge_pressure + self.zero(readings.time), ..readings }
    }

    fn true_pressure(&self, reading: f64, time: f64) -> f64 {
        reading - self.zero(time)
    }

    fn sentence(&self) -> String {
        format!("The pressure sensor shows {:+.3} bar at ambient pressure.", self.offset * 1e-5)
    }
}
