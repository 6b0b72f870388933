use super::{ForceModel, McKibben, Muscle};
use std::f64::consts::PI;

crate::variables::variables! {
    /// Ideal McKibben muscle whose two ends are caps of a sphere in place of a cylinder.
    ///
    /// # Model
    /// F = p (A + M), A of the ideal muscle, M = d(V_v − V_a)/dL. With q = R − R₀ beyond the fittings, R = b sin θ/(2πn):
    /// the ends take V_a = 2π/3 (3 q/(2 sin² θ) − q) q² of the V_v = 2π q³ cot θ that a cylinder would have, hence
    /// M = −(3 q² R cot θ g + q³ g′)/(b sin θ), g = 2π cot θ − π/sin² θ + 2π/3, g′ = 2π (cot θ − 1)/sin² θ.
    /// `end_diameter` is 2R₀.
    ///
    /// # In the data
    /// Nearly the ideal muscle at rest; weaker by a few per cent of the area towards the end of the stroke.
    ///
    /// # Validity
    /// Below about 35° V_v − V_a is negative: the caps of these equations are wider than the cylinder. No elastic force: a load hangs
    /// only under pressure.
    ///
    /// # Reference
    /// Thesis eqs. 3.16–3.20 (3.16 is V_v, printed as V_a). Deviation: M is derived from 3.16–3.18; the printed
    /// eq. 3.20, M = q³ (2π − π cot θ)/(nπR), lacks the change of q, which is the larger part, and has another sign.
    /// The thesis prints no R₀, and forces of a muscle whose membrane this model has not got do not tell it: the bore of
    /// 40 mm.
    pub struct RoundedEnds in "rounded_ends." as Tunable {
        /// Diameter of the fittings
        end_diameter: f64 = 0.04, METRE, (0.0..=1.0);
    }
}

impl ForceModel for RoundedEnds {
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        let (thread, cosine) = (muscle.thread_length, (muscle.rest_length - contraction) / muscle.thread_length);
        let sine_squared = 1.0 - cosine * cosine;
        let sine = sine_squared.sqrt();
        let cotangent = cosine / sine;
        let radius = 0.5 * muscle.diameter(contraction);
        let beyond = radius - 0.5 * self.end_diameter;
        let missing = 2.0 * PI * cotangent - PI / sine_squared + 2.0 * PI / 3.0;
        let missing_slope = 2.0 * PI * (cotangent - 1.0) / sine_squared;
        let of_angle = 3.0 * beyond.powi(2) * radius * cotangent * missing + beyond.powi(3) * missing_slope;
        McKibben.virtual_area(muscle, gauge_pressure, contraction) - of_angle / (thread * sine)
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }
}
