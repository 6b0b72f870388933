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

crate::variables::variables! {
    /// How the load moves where a simulation starts.
    pub struct InitialMotion in "initial_motion." as Fixed {
        /// Contraction at the start beyond the one at which the load hangs still
        contraction_offset: f64 = 0.0, METRE, (-1.0..=1.0);
        /// Rate of the contraction at the start
        contraction_velocity: f64 = 0.0, METRE_PER_SECOND, (-10.0..=10.0);
    }
}
