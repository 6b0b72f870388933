use super::{Description, Effect};

crate::variables::variables! {
    /// A position sensor that is late.
    ///
    /// # Model
    /// x_measured(t) = x(t − d): `delay` d. Before the start the contraction has been what it was at the start.
    ///
    /// # In the data
    /// The residual of the contraction is in proportion to the velocity, while pressure and force are as they should be.
    ///
    /// # Validity
    /// Filters and buses of sensors: up to some tenths of a second. Between steps of the integration the contraction is
    /// interpolated by cubics.
    ///
    /// # Reference
    /// Definition of a delay.
    pub struct ContractionSensorDelay in "contraction_sensor_delay." as Tunable {
        /// Time by which the position sensor is late
        delay: f64 = 0.0, SECOND, (0.0..=0.5);
    }
}

impl Effect for ContractionSensorDelay {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_delay",
        meaning: "the position sensor is late",
        equation: "x_measured(t) = x(t - d)",
        signature: "residual of the contraction in proportion to the velocity; pressure and force as nominal",
        experiment: "fast motion with force recorded, or a second position sensor",
        reference: "definition",
        of_load: false,
        exact: false,
        forms: &[&[("contraction_sensor_delay.delay", &[0.02, 0.06])]],
        refinements: &[],
    };

    fn is_neutral(&self) -> bool {
        self.delay == 0.0
    }

    fn contraction_delay(&self) -> f64 {
        self.delay
    }

    fn sentence(&self) -> String {
        format!("The position sensor is {:.0} ms late.", self.delay * 1e3)
    }
}
