use super::{ForceModel, Muscle};
use std::f64::consts::PI;

crate::variables::variables! {
    /// Ideal McKibben muscle between two cones that lead to its fittings.
    ///
    /// # Model
    /// F = −p dV/dL. The middle is a cylinder of length L_m and D = √(b² − L_m²)/(π n); each end is the frustum of a cone
    /// from D to `end_diameter` d, whose side keeps its length `end_length` L_z:
    /// L = L_m + 2 √(L_z² − ((D − d)/2)²). b and n are the middle's shares of `muscle.thread_length` and `muscle.turns`,
    /// such that D is the muscle's diameter at rest.
    ///
    /// # In the data
    /// Nearly the ideal muscle; the pull ends a little earlier, more so in short muscles.
    ///
    /// # Validity
    /// L_z > (D − d)/2, or else there is no such cone and the simulation ends. No elastic force: a load hangs only under
    /// pressure.
    ///
    /// # Reference
    /// C. S. Kothera et al. (2009), Experimental characterization and static modeling of McKibben actuators,
    /// Journal of Mechanical Design 131, 091010; thesis eqs. 3.13–3.15, which give the geometry; the force is derived. The thesis prints neither
    /// L_z nor d, and forces of a muscle whose membrane this model has not got do not tell them: d is the bore of 40 mm, and
    /// L_z as long.
    pub struct FrustumEnds in "frustum_ends." as Tunable {
        /// Length of the side of a cone
        end_length: f64 = 0.04, METRE, (1e-4..=1.0);
        /// Diameter of the fittings
        end_diameter: f64 = 0.04, METRE, (0.0..=1.0);
    }
}

impl FrustumEnds {
    /// Height in m of a cone that ends in a cylinder of a diameter in m.
    fn height(&self, diameter: f64) -> f64 {
        (self.end_length.powi(2) - (0.5 * (diameter - self.end_diameter)).powi(2)).sqrt()
    }
}

impl ForceModel for FrustumEnds {
    fn virtual_area(&self, muscle: &Muscle, _gauge_pressure: f64, contraction: f64) -> f64 {
        let length = muscle.rest_length - contraction;
        let share = 1.0 - 2.0 * self.height(muscle.diameter(0.0)) / muscle.rest_length;
        let (thread, turns) = (share * muscle.thread_length, share * muscle.turns);
        // What follows from the length of the middle: diameter and its slope, height of a cone and its slope.
        let geometry = |middle: f64| {
            let diameter = (thread.powi(2) - middle.powi(2)).sqrt() / (PI * turns);
            let widening = -middle / (diameter * (PI * turns).powi(2));
            let height = self.height(diameter);
            (diameter, widening, height, -0.25 * (diameter - self.end_diameter) * widening / height)
        };
        // Newton's method from below; the length grows with the middle at least as fast as it.
        let mut middle = length - 2.0 * self.end_length;
        for _ in 0..MOST_ITERATIONS {
            let (_, _, height, slope) = geometry(middle);
            let change = (length - middle - 2.0 * height) / (1.0 + 2.0 * slope);
            middle += change;
            if change.abs() <= 1e-14 * length {
                break;
            }
        }
        let (diameter, widening, height, slope) = geometry(middle);
        let end = self.end_diameter;
        let cylinder = PI / 4.0 * (diameter.powi(2) + 2.0 * diameter * widening * middle);
        let round = diameter.powi(2) + diameter * end + end.powi(2);
        let cones = PI / 6.0 * (slope * round + height * (2.0 * diameter + end) * widening);
        -(cylinder + cones) / (1.0 + 2.0 * slope)
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }
}

/// Newton's method needs five or six.
const MOST_ITERATIONS: usize = 50;
