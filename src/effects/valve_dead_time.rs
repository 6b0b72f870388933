use super::{Description, Effect, Holds};

crate::variables::variables! {
    /// A valve that sees its command late.
    ///
    /// # Model
    /// u(t) ← u(t − θ): `delay` θ, and θ (1 + e) of a command that falls, `falling_excess` e: of both the smaller one for
    /// e < 0, the larger one for e > 0. Before the start the command has been what it was at the start.
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
        /// Relative excess of that time for a command that falls
        falling_excess: f64 = 0.0, ONE, (-0.9..=3.0);
    }
}

impl Effect for ValveDeadTime {
    const DESCRIPTION: Description = Description {
        name: "valve_dead_time",
        meaning: "the valve sees its command late",
        equation: "u(t) <- u(t - theta), or u(t - theta (1 + e)) where it falls",
        signature: "the same shift of the pressure for steps of all sizes, no loss of amplitude",
        experiment: "steps of several sizes, sampled fast",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[&[("valve_dead_time.delay", &[0.03, 0.1])]],
        further_forms: &[],
        refinements: &[("valve_dead_time.falling_excess", &[0.3, -0.3])],
    };

    fn is_neutral(&self) -> bool {
        self.delay == 0.0
    }

    fn command_delays(&self) -> [f64; 2] {
        [self.delay, self.delay * (1.0 + self.falling_excess)]
    }

    fn sentence(&self) -> String {
        let [rising, falling] = self.command_delays().map(|delay| delay * 1e3);
        if rising == falling {
            return format!("The valve reacts {rising:.0} ms after its command.");
        }
        format!("The valve reacts {rising:.0} ms after its command where it rises, {falling:.0} ms where it falls.")
    }
}
