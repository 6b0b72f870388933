use super::{Description, Effect, Readings};

crate::variables::variables! {
    /// A position sensor whose zero is not at the rest length.
    ///
    /// # Model
    /// x_measured ← x_measured + o: `offset` o.
    ///
    /// # In the data
    /// A constant residual of the contraction, also at rest. Without it in the force, it is not a change of the muscle.
    ///
    /// # Validity
    /// Constant over a recording.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct ContractionSensorOffset in "contraction_sensor_offset." as Tunable {
        /// What the position sensor shows at rest length
        offset: f64 = 0.0, METRE, (-0.2..=0.2);
    }
}

impl Effect for ContractionSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_offset",
        meaning: "the zero of the position sensor is not at the rest length",
        equation: "x_measured <- x_measured + o",
        signature: "constant residual of the contraction, also at rest",
        experiment: "read the sensor with the muscle empty and unloaded",
        reference: "definition",
        of_load: false,
        forms: &[&[("contraction_sensor_offset.offset", &[5e-3, -5e-3])]],
        refinements: &[],
    };

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { contraction: readings.contraction + self.offset, ..readings }
    }

    fn true_contraction(&self, reading: f64, _force: f64) -> f64 {
        reading - self.offset
    }

    fn sentence(&self) -> String {
        format!("The position sensor shows {:+.2} mm at the rest length.", self.offset * 1e3)
    }
}
