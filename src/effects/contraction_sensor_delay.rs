use super::{Description, Effect, Holds};

/// Time constant in s below which a filter shows nothing.
const SHORTEST: f64 = 1e-3;

crate::variables::variables! {
    /// A position sensor that is late.
    ///
    /// # Model
    /// x_measured(t) is the mean of y from t − d − a to t − d: `delay` d, `averaging` a. y is x behind a filter of first order,
    /// τ dy/dt = x − y, `filter_time` τ. Before the start the contraction has been what it was at the start.
    ///
    /// # In the data
    /// The residual of the contraction is in proportion to the velocity, while pressure and force are as they should be.
    ///
    /// # Validity
    /// Filters and buses of sensors: up to some tenths of a second. Between steps of the integration the contraction is
    /// interpolated by cubics, whose mean is exact, and whose response is but for steps above 250 τ; τ below 1 ms counts as
    /// none. Motion that is prescribed by readings is moved by d + a/2 + τ.
    ///
    /// # Reference
    /// Definition of a delay, of a moving average and of a filter.
    pub struct ContractionSensorDelay in "contraction_sensor_delay." as Tunable {
        /// Time by which the position sensor is late
        delay: f64 = 0.0, SECOND, (0.0..=0.5);
        /// Time over which the position sensor averages
        averaging: f64 = 0.0, SECOND, (0.0..=0.5);
        /// Time constant of a filter of first order in the position sensor
        filter_time: f64 = 0.0, SECOND, (0.0..=0.5);
    }
}

impl Effect for ContractionSensorDelay {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_delay",
        meaning: "the position sensor is late",
        equation: "x_measured(t) = mean of y from t - d - a to t - d,  tau dy/dt = x - y",
        signature: "residual of the contraction in proportion to the velocity; pressure and force as nominal",
        experiment: "fast motion with force recorded, or a second position sensor",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("contraction_sensor_delay.delay", &[0.02, 0.06])],
            &[("contraction_sensor_delay.averaging", &[0.04, 0.12])],
            &[("contraction_sensor_delay.filter_time", &[0.02, 0.06])],
        ],
        further_forms: &[],
        refinements: &[
            ("contraction_sensor_delay.averaging", &[0.02]),
            ("contraction_sensor_delay.filter_time", &[0.01]),
        ],
    };

    fn is_neutral(&self) -> bool {
        self.delay == 0.0 && self.averaging == 0.0 && self.filter_time == 0.0
    }

    fn contraction_delay(&self) -> f64 {
        self.delay
    }

    fn contraction_averaging(&self) -> f64 {
        self.averaging
    }

    fn contraction_filter(&self) -> f64 {
        if self.filter_time < SHORTEST { 0.0 } else { self.filter_time }
    }

    fn sentence(&self) -> String {
        let milliseconds = |time: f64| format!("{:.0} ms", time * 1e3);
        let late = milliseconds(self.delay + 0.5 * self.averaging + self.filter_time);
        let mut parts = Vec::new();
        if self.averaging > 0.0 {
            parts.push(format!("shows a mean over {}", milliseconds(self.averaging)));
        }
        if self.contraction_filter() > 0.0 {
            parts.push(format!("has a filter of {}", milliseconds(self.filter_time)));
        }
        let shows = if parts.is_empty() { String::new() } else { format!(": it {}", parts.join(" and ")) };
        format!("The position sensor is {late} late{shows}.")
    }
}
