use super::{Description, Effect};

crate::variables::variables! {
    /// A valve that sees its command late.
    ///
    /// # Model
    /// u(t) ← u(t − θ): `delay` θ. Before the start the command has been what it was at the start.
    ///
    /// # In the data
    /// The response to steps of any size begins later by the same time; the phase falls in proportion to frequency
    /// without loss of amplitude. A second pole rounds the beginning instead.
    ///
    /// # Validity
    /// Exact for a command of straight lines.
    ///
    /// # Reference
    /// Transport delay of field buses and of air lines; definition.
    pub struct ValveDeadTime in "valve_dead_time." as Tunable {
        /// Time by which the valve sees its command late
        delay: f64 = 0.0, SECOND, (0.0..=0.5);
    }
}

impl Effect for ValveDeadTime {
    const DESCRIPTION: Description = Description {
        name: "valve_dead_time",
        meaning: "the valve sees its command late",
        equation: "u(t) <- u(t - theta)",
        signature: "the same shift of the pressure for steps of all sizes, no loss of amplitude",
        experiment: "steps of several sizes, sampled fast",
        reference: "definition",
        of_load: false,
        exact: false,
        forms: &[&[("valve_dead_time.delay", &[0.03, 0.1])]],
        refinements: &[],
    };

    fn is_neutral(&self) -> bool {
        self.delay == 0.0
    }

    fn command_delay(&self) -> f64 {
        self.delay
    }

    fn sentence(&self) -> String {
        format!("The valve reacts {:.0} ms after its command.", self.delay * 1e3)
    }
}
