//! The proportional pressure valve.

crate::variables::variables! {
    /// Proportional valve as a first-order low-pass filter.
    ///
    /// # Model
    /// dp/dt = ω (K_v u − p): gauge pressure p, command u, `gain` K_v, `bandwidth` ω. The target K_v u is never below
    /// ambient pressure. A valve that is shut has the smallest `bandwidth`: the pressure then stays for years.
    ///
    /// # Reference
    /// Thesis eq. 5.3; the measured cut-off is 2.5 Hz, which is 15.7 rad/s (the printed transfer function reads
    /// 2.5 as rad/s and is 6.3 times too slow).
    pub struct Valve in "valve." as Tunable {
        /// Pressure per volt of command
        gain: f64 = 1e5, PASCAL_PER_VOLT, (1.0..=1e9);
        /// Cut-off (-3 dB) of the valve
        bandwidth: f64 = 2.5 * std::f64::consts::TAU, RADIAN_PER_SECOND, (1e-9..=1e4);
    }
}

impl Valve {
    /// Gauge pressure in Pa that a command in V asks for.
    pub fn target_pressure(&self, command: f64) -> f64 {
        (self.gain * command).max(0.0)
    }

    /// Whether it is shut for all that a recording of so many seconds can tell: slower than that lasts.
    pub fn is_shut(&self, duration: f64) -> bool {
        self.bandwidth * duration <= 1.0
    }
}
