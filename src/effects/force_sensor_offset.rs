use super::{Description, Effect, Readings};

crate::variables::variables! {
    /// A force sensor that shows a force where there is none.
    ///
    /// # Model
    /// F_measured ← F_measured + o: `offset` o.
    ///
    /// # In the data
    /// A constant residual of the force, also with the muscle empty; the motion is as nominal.
    ///
    /// # Validity
    /// Constant over a recording.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct ForceSensorOffset in "force_sensor_offset." as Tunable {
        /// What the force sensor shows without pull
        offset: f64 = 0.0, NEWTON, (-500.0..=500.0);
    }
}

impl Effect for ForceSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "force_sensor_offset",
        meaning: "the force sensor shows a force where there is none",
        equation: "F_measured <- F_measured + o",
        signature: "constant residual of the force, also at rest",
        experiment: "read the sensor with nothing attached",
        reference: "definition",
        of_load: false,
        forms: &[&[("force_sensor_offset.offset", &[20.0, -20.0])]],
        refinements: &[],
    };

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { force: readings.force + self.offset, ..readings }
    }

    fn sentence(&self) -> String {
        format!("The force sensor shows {:+.1} N without pull.", self.offset)
    }
}
