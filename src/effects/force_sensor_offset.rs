use super::{Description, Effect, Holds, Readings, settling};

crate::variables::variables! {
    /// A force sensor that shows a force where there is none.
    ///
    /// # Model
    /// F_measured ← F_measured + o (1 + s exp(−t/τ)): `offset` o, `settling_share` s, `settling_time` τ, t since the start.
    ///
    /// # In the data
    /// A constant residual of the force, also with the muscle empty; the motion is as nominal.
    ///
    /// # Validity
    /// Constant, or settling while the sensor warms up from the start of the recording.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct ForceSensorOffset in "force_sensor_offset." as Tunable {
        /// What the force sensor shows without pull
        offset: f64 = 0.0, NEWTON, (-500.0..=500.0);
        /// Excess of the offset at the start, relative to the offset that settles
        settling_share: f64 = 0.0, ONE, (-1.0..=2.0);
        /// Time constant of the settling
        settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
    }
}

impl ForceSensorOffset {
    /// What the sensor adds at a time in s since the start.
    fn zero(&self, time: f64) -> f64 {
        settling(self.offset, self.settling_share, self.settling_time, time)
    }
}

impl Effect for ForceSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "force_sensor_offset",
        meaning: "the force sensor shows a force where there is none",
        equation: "F_measured <- F_measured + o (1 + s exp(-t/tau))",
        signature: "constant residual of the force, also at rest",
        experiment: "read the sensor with nothing attached",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[&[("force_sensor_offset.offset", &[20.0, -20.0])]],
        refinements: &[("force_sensor_offset.settling_share", &[0.3]), ("force_sensor_offset.settling_time", &[5.0])],
    };

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { force: readings.force + self.zero(readings.time), ..readings }
    }

    fn sentence(&self) -> String {
        format!("The force sensor shows {:+.1} N without pull.", self.offset)
    }
}
