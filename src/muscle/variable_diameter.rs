use super::{ForceModel, Muscle};
use std::f64::consts::PI;

crate::variables::variables! {
    /// Barrel: the muscle bulges in a parabola between its fittings.
    ///
    /// # Model
    /// F = −p dV/dL of a barrel with `end_diameter` d at its ends and the braid's diameter in its middle,
    /// V = L (3 d² π² n² + 4 d π n c + 8 c²)/(60 π n²), c = √(b² − L²), hence
    /// −dV/dL = −(3 d² π² n² + 4 d π n (c − L²/c) + 8 (b² − 3L²))/(60 π n²).
    ///
    /// # In the data
    /// Weaker than the ideal muscle by about half, and it ends earlier: more volume is at the ends, which do not widen.
    ///
    /// # Validity
    /// L < b, where the force has a pole. Fitted to forces, d also stands for the membrane that the model has not got: it
    /// comes out wider than the fittings, and then is no diameter. No elastic force: a load hangs only under pressure.
    ///
    /// # Reference
    /// Thesis eqs. 3.21–3.23, in whose symbols 2L is b, h is L and N is n. The volume holds: it is that of a barrel with
    /// parabolic staves. The thesis prints no d: it is identified on the forces of the virtual-area model over 1–4.5 bar and
    /// 90–820 N (154 N rms; 167 N with the bore of 40 mm).
    pub struct VariableDiameter in "variable_diameter." as Tunable {
        /// Diameter at the ends
        end_diameter: f64 = 0.060_367_6, METRE, (0.0..=1.0);
    }
}

impl ForceModel for VariableDiameter {
    fn virtual_area(&self, muscle: &Muscle, _gauge_pressure: f64, contraction: f64) -> f64 {
        let length_squared = (muscle.rest_length - contraction).powi(2);
        let thread_squared = muscle.thread_length.powi(2);
        let around = (thread_squared - length_squared).sqrt();
        let end = self.end_diameter * PI * muscle.turns;
        let of_ends = 3.0 * end.powi(2) + 4.0 * end * (around - length_squared / around);
        -(of_ends + 8.0 * (thread_squared - 3.0 * length_squared)) / (60.0 * PI * muscle.turns.powi(2))
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }
}
