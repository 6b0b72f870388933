use super::{Description, Effect};

crate::variables::variables! {
    /// A valve whose zero is off.
    ///
    /// # Model
    /// u ← u + o: `offset` o.
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
    }
}

impl Effect for ValveOffset {
    const DESCRIPTION: Description = Description {
        name: "valve_offset",
        meaning: "the zero of the valve is off",
        equation: "u <- u + o",
        signature: "constant residual of the pressure, and of the force with it",
        experiment: "stairs of the command with the pressure recorded by a second sensor",
        reference: "definition",
        of_load: false,
        forms: &[&[("valve_offset.offset", &[0.1, -0.1])]],
        refinements: &[],
    };

    fn is_neutral(&self) -> bool {
        self.offset == 0.0
    }

    fn command(&self, command: f64) -> f64 {
        command + self.offset
    }

    fn sentence(&self) -> String {
        format!("The valve acts as if its command were {:+.3} V off.", self.offset)
    }
}
