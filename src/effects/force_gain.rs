use super::{Description, Effect, Holds, Point, REFERENCE_FORCE, of_recording, told_anew};
use crate::scale::Scale;

/// Relative error below which nothing would be left of the muscle.
const LEAST: f64 = -0.9;

crate::variables::variables! {
    /// A muscle that is stronger or weaker as a whole.
    ///
    /// # Model
    /// F_static ← F_static (1 + g + b (r − 1) + c (r² − 1)), r = F_static/400 N: `relative_error` g, `bend` b and `curvature` c where it
    /// changes with the force. Of the elastic force 1 + m g counts in place of 1 + g: `elastic_share` m. By `second` and `third` g is more in these recordings.
    ///
    /// # In the data
    /// The force residual is in proportion to the force, whatever pressure and contraction; the motion goes with it,
    /// unlike with a gain of the force sensor. One load alone cannot tell it from a wrong mass.
    ///
    /// # Validity
    /// Wrong bore or number of threads, ageing; damping and friction stay. The area goes with the square of the bore and the
    /// membrane with its first power, m ≈ 0.5; broken threads leave the membrane as it is, m = 0.
    ///
    /// # Reference
    /// Definition of a gain.
    pub struct ForceGain in "force_gain." as Tunable {
        /// Relative error of the static force
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the gain per 400 N away from 400 N: threads that stretch
        bend: f64 = 0.0, ONE, (-0.05..=0.05);
        /// Change of the gain with the square of the force, per that of 400 N
        curvature: f64 = 0.0, ONE, (-0.03..=0.03);
        /// By how much more in the second of several recordings: it ages from one to the next
        second: f64 = 0.0, ONE, (-0.5..=0.5), of 2;
        /// By how much more in the third
        third: f64 = 0.0, ONE, (-0.5..=0.5), of 3;
        /// Which of the recordings is simulated: from the fourth on as the first
        recording: f64 = 1.0, ONE, (1.0..=1000.0);
        /// Share of the relative error that the elastic force has, too
        elastic_share: f64 = 1.0, ONE, (0.0..=1.0);
    }
}

impl ForceGain {
    /// Relative error in the recording that is simulated.
    fn error(&self) -> f64 {
        (self.relative_error + of_recording(self.recording, [self.second, self.third])).max(LEAST)
    }
}

impl Effect for ForceGain {
    const DESCRIPTION: Description = Description {
        name: "force_gain",
        meaning: "the whole force is scaled: wrong bore, ageing",
        equation: "F_static <- F_static (1 + g + b (r - 1) + c (r^2 - 1)), r = F_static/400 N, of the elastic force 1 + m g for 1 + g",
        signature: "force residual in proportion to the force, and the motion with it",
        experiment: "two known masses, static and dynamic",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[&[("force_gain.relative_error", &[0.08, -0.08, 0.02, -0.02])]],
        further_forms: &[
            &[("force_gain.relative_error", &[0.05, -0.05]), ("force_gain.second", &[-0.03])],
            &[
                ("force_gain.relative_error", &[0.05, -0.05]),
                ("force_gain.second", &[-0.03]),
                ("force_gain.third", &[-0.06]),
            ],
        ],
        refinements: &[
            ("force_gain.bend", &[0.005]),
            ("force_gain.curvature", &[0.002]),
            ("force_gain.elastic_share", &[0.5]),
        ],
    };
    const ENDS_INSIDE: &'static [&'static str] = &["force_gain.bend", "force_gain.curvature"];

    fn is_neutral(&self) -> bool {
        [self.relative_error, self.second, self.third, self.bend, self.curvature] == [0.0; 5]
    }

    fn elastic_force(&self, _at: &Point, _own: &[f64], force: f64) -> f64 {
        if self.elastic_share == 1.0 {
            return force;
        }
        // All of it is scaled by 1 + g after this.
        let error = self.error();
        force * (1.0 + self.elastic_share * error) / (1.0 + error)
    }

    fn static_force(&self, force: f64) -> f64 {
        if self.is_neutral() {
            return force;
        }
        let Self { bend, curvature, .. } = *self;
        let scale =
            Scale { middle: REFERENCE_FORCE, relative_error: self.error(), bend, curvature, ..Scale::default() };
        scale.shown(force, 0.0)
    }

    fn sentence(&self) -> String {
        let word = if self.relative_error < 0.0 { "weaker" } else { "stronger" };
        let percent = 100.0 * self.relative_error.abs();
        let anew = told_anew([self.second, self.third], |more, recording| {
            format!(", {:+.1} % in the {recording} recording", 100.0 * (self.relative_error + more))
        });
        if self.elastic_share == 1.0 {
            return format!("The muscle is {percent:.1} % {word} than nominal{anew}.");
        }
        let of_membrane = self.elastic_share * percent;
        format!(
            "The pull of the pressure is {percent:.1} % {word} than nominal, that of the membrane {of_membrane:.1} %{anew}."
        )
    }
}
