use super::{Description, Effect, Holds};

crate::variables::variables! {
    /// A position sensor that is late.
    ///
    /// # Model
    /// x_measured(t) is the mean of x from t − d − a to t − d: `delay` d, `averaging` a. Before the start the contraction has
    /// been what it was at the start.
    ///
    /// # In the data
    /// The residual of the contraction is in proportion to the velocity, while pressure and force are as they should be.
    ///
    /// # Validity
    /// Filters and buses of sensors: up to some tenths of a second. Between steps of the integration the contraction is
    /// interpolated by cubics, whose mean is exact. Motion that is prescribed by readings is moved by d + a/2.
    ///
    /// # Reference
    /// Definition of a delay, and of a moving average.
    pub struct ContractionSensorDelay in "contraction_sensor_delay." as Tunable {
        /// Time by which the position sensor is late
        delay: f64 = 0.0, SECOND, (0.0..=0.5);
        /// Time over which the position sensor averages
        averaging: f64 = 0.0, SECOND, (0.0..=0.5);
    }
}

impl Effect for ContractionSensorDelay {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_delay",
        meaning: "the position sensor is late",
        equation: "x_measured(t) = mean of x from t - d - a to t - d",
        signature: "residual of the contraction in proportion to the velocity; pressure and force as nominal",
        experiment: "fast motion with force recorded, or a second position sensor",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("contraction_sensor_delay.delay", &[0.02, 0.06])],
            &[("contraction_sensor_delay.averaging", &[0.04, 0.12])],
        ],
        further_forms: &[],
        refinements: &[("contraction_sensor_delay.averaging", &[0.02])],
    };

    fn is_neutral(&self) -> bool {
        self.delay == 0.0 && self.averaging == 0.0
    }

    fn contraction_delay(&self) -> f64 {
        self.delay
    }

    fn contraction_averaging(&self) -> f64 {
        self.averaging
    }

    fn sentence(&self) -> String {
        let late = format!("The position sensor is {:.0} ms late", (self.delay + 0.5 * self.averaging) * 1e3);
        if self.averaging == 0.0 {
            return format!("{late}.");
        }
        format!("{late}: it shows a mean over {:.0} ms.", self.averaging * 1e3)
    }
}
