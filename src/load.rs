//! The hanging load.

crate::variables::variables! {
    /// A mass that hangs from the muscle.
    ///
    /// # Model
    /// M d²x/dt² = F − M g − F_ext: contraction x (upwards), pull of the muscle F, downward force F_ext.
    ///
    /// # Reference
    /// Thesis eq. 5.4.
    pub struct Load in "load." as Tunable {
        /// Mass of the load and of what moves with it
        mass: f64 = 20.0, KILOGRAM, (1e-3..=1e5);
    }
}

crate::variables::variables! {
    /// Where a simulation starts.
    pub struct Initial in "initial." as Fixed {
        /// Gauge pressure at the start, at which the load hangs still
        gauge_pressure: f64 = 0.0, PASCAL, (0.0..=2e6);
    }
}
