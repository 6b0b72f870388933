use super::{Description, Effect};

crate::variables::variables! {
    /// A valve that follows more slowly than nominal.
    ///
    /// # Model
    /// 1/ω ← 1/ω + τ: the time constant of the first-order valve grows by τ (`time_constant`).
    ///
    /// # In the data
    /// The pressure residual is in proportion to the rate of pressure and vanishes when the command is slow; steps of
    /// several sizes separate it from a dead time (whose onset shifts) and from a rate limit (large steps only).
    ///
    /// # Reference
    /// Thesis eq. 5.3.
    pub struct ValveLag in "valve_lag." as Tunable {
        /// Time constant beyond the nominal one
        time_constant: f64 = 0.0, SECOND, (0.0..=10.0);
    }
}

impl Effect for ValveLag {
    const DESCRIPTION: Description = Description {
        name: "valve_lag",
        meaning: "the valve is slower than nominal",
        equation: "1/w <- 1/w + tau",
        signature: "pressure residual in proportion to the rate of pressure, gone when slow",
        experiment: "steps of several sizes with pressure recorded",
        reference: "thesis eq. 5.3",
        of_load: false,
        forms: &[&[("valve_lag.time_constant", &[0.05])]],
        refinements: &[],
    };

    fn valve_bandwidth(&self, bandwidth: f64) -> f64 {
        if self.time_constant == 0.0 {
            return bandwidth; // 1/(1/w) need not be w to the last bit
        }
        1.0 / (1.0 / bandwidth + self.time_constant)
    }

    fn sentence(&self) -> String {
        format!("The valve is slower than nominal: its time constant is {:.0} ms longer.", self.time_constant * 1e3)
    }
}
