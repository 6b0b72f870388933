use super::{Description, Effect, Holds, Readings, settling};

crate::variables::variables! {
    /// A position sensor whose zero is not at the rest length.
    ///
    /// # Model
    /// x_measured ← x_measured + o (1 + s exp(−t/τ)): `offset` o, `settling_share` s, `settling_time` τ, t since the start.
    ///
    /// # In the data
    /// A constant residual of the contraction, also at rest. Without it in the force, it is not a change of the muscle.
    ///
    /// # Validity
    /// Constant, or settling while the sensor warms up from the start of the recording.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct ContractionSensorOffset in "contraction_sensor_offset." as Tunable {
        /// What the position sensor shows at rest length
        offset: f64 = 0.0, METRE, (-0.2..=0.2);
        /// Excess of the offset at the start, relative to the offset that settles
        settling_share: f64 = 0.0, ONE, (-1.0..=2.0);
        /// Time constant of the settling
        settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
    }
}

impl ContractionSensorOffset {
    /// What the sensor adds at a time in s since the start.
    fn zero(&self, time: f64) -> f64 {
        settling(self.offset, self.settling_share, self.settling_time, time)
    }
}

impl Effect for ContractionSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_offset",
        meaning: "the zero of the position sensor is not at the rest length",
        equation: "x_measured <- x_measured + o (1 + s exp(-t/tau))",
        signature: "constant residual of the contraction, also at rest",
        experiment: "read the sensor with the muscle empty and unloaded",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[
            &[("contraction_sensor_offset.offset", &[5e-3, -5e-3])],
            // Corrections of the muscle take a constant offset over, and leave how it settles.
            &[
                ("contraction_sensor_offset.offset", &[5e-3, -5e-3, 5e-3, -5e-3]),
                ("contraction_sensor_offset.settling_share", &[0.5]),
                ("contraction_sensor_offset.settling_time", &[4.0, 4.0, 15.0, 15.0]),
            ],
        ],
        refinements: &[
            ("contraction_sensor_offset.settling_share", &[0.3]),
            ("contraction_sensor_offset.settling_time", &[5.0]),
        ],
    };

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { contraction: readings.contraction + self.zero(readings.time), ..readings }
    }

    fn true_contraction(&self, reading: f64, _force: f64, time: f64) -> f64 {
        reading - self.zero(time)
    }

    fn sentence(&self) -> String {
        format!("The position sensor shows {:+.2} mm at the rest length.", self.offset * 1e3)
    }
}
