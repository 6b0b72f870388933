use super::{Description, Effect, Holds, Point};

crate::variables::variables! {
    /// A valve whose zero is off.
    ///
    /// # Model
    /// u ← u + o (1 + s w), τ dw/dt = −w from w = 1 at the start: `offset` o, `settling_share` s, `settling_time` τ.
    ///
    /// # In the data
    /// A constant residual of the pressure, with the force that belongs to it. With an offset of the pressure sensor the
    /// force stays.
    ///
    /// # Reference
    /// Zero errors in data sheets of proportional pressure regulators.
    pub struct ValveOffset in "valve_offset." as Tunable {
        /// Voltage that acts beyond the command
        offset: f64 = 0.0, VOLT, (-2.0..=2.0);
        /// Excess of the offset at the start, relative to the offset that settles
        settling_share: f64 = 0.0, ONE, (-1.0..=2.0);
        /// Time constant of the settling
        settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
    }
}

impl Effect for ValveOffset {
    const DESCRIPTION: Description = Description {
        name: "valve_offset",
        meaning: "the zero of the valve is off",
        equation: "u <- u + o (1 + s exp(-t/tau))",
        signature: "constant residual of the pressure, and of the force with it",
        experiment: "stairs of the command with the pressure recorded by a second sensor",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[&[("valve_offset.offset", &[0.1, -0.1])]],
        refinements: &[("valve_offset.settling_share", &[0.3]), ("valve_offset.settling_time", &[5.0])],
    };
    const STATE_SCALES: &'static [f64] = &[1.0];

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn rests(&self) -> bool {
        self.is_neutral() || self.settling_share == 0.0
    }

    fn start(&self, _at: &Point, own: &mut [f64]) {
        own[0] = 1.0;
    }

    fn rates(&self, _at: &Point, own: &[f64], rates: &mut [f64]) {
        rates[0] = -own[0] / self.settling_time;
    }

    fn command(&self, _at: &Point, own: &[f64], command: f64) -> f64 {
        command + self.offset * (1.0 + self.settling_share * own[0])
    }

    fn sentence(&self) -> String {
        format!("The valve acts as if its command were {:+.3} V off.", self.offset)
    }
}
