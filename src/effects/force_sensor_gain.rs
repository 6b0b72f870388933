use super::{Description, Effect, Holds, REFERENCE_CONTRACTION, REFERENCE_FORCE, Readings};
use crate::scale::{Scale, forms_of_scale, settled};

crate::variables::variables! {
    /// A force sensor whose scale is off.
    ///
    /// # Model
    /// F_measured ← F_measured (1 + g + b (r − 1) + c (r² − 1) + s exp(−t/τ) + a x/0.1 m + a₂ (x/0.1 m)²), r = F_measured/400 N, t since the start:
    /// `relative_error` g, `bend` b, `curvature` c, `settling` s, `settling_time` τ; of a cell that is pulled at an angle which changes with the
    /// contraction `change_with_contraction` a and `change_with_its_square` a₂.
    ///
    /// # In the data
    /// The residual of the force is in proportion to the force, while the motion is as nominal; with a gain of the muscle the
    /// motion follows.
    ///
    /// # Validity
    /// Constant over a recording, or settling while the amplifier warms up from its start, in every recording alike; slightly bent scales; the
    /// curvature is that of a cell or an amplifier whose scale falls with the force. At an angle it shows the cosine: 4 % less at 17°.
    ///
    /// # Reference
    /// Definition of a gain; linearity errors in data sheets of sensors (up to 1 % of full scale).
    pub struct ForceSensorGain in "force_sensor_gain." as Tunable {
        /// Relative error of the force sensor
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the scale per 400 N away from 400 N
        bend: f64 = 0.0, ONE, (-0.1..=0.1);
        /// Change of the scale with the square of the force, per that of 400 N
        curvature: f64 = 0.0, ONE, (-0.03..=0.03);
        /// Excess of the scale at the start, which settles
        settling: f64 = 0.0, ONE, (-0.3..=0.3);
        /// Time constant of the settling
        settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
        /// Change of the scale at 0.1 m of contraction
        change_with_contraction: f64 = 0.0, ONE, (-0.1..=0.1);
        /// Further change of the scale with the square of the contraction, at 0.1 m
        change_with_its_square: f64 = 0.0, ONE, (-0.05..=0.05);
    }
}

impl ForceSensorGain {
    forms_of_scale!("force_sensor_gain.");

    fn scale(&self) -> Scale {
        let Self { relative_error, bend, curvature, settling, settling_time, .. } = *self;
        Scale { middle: REFERENCE_FORCE, relative_error, bend, curvature, settling: (settling, settling_time) }
    }

    /// What an angle changes of the scale at a contraction in m.
    fn of_angle(&self, contraction: f64) -> f64 {
        let s = contraction / REFERENCE_CONTRACTION;
        s * (self.change_with_contraction + s * self.change_with_its_square)
    }
}

impl Effect for ForceSensorGain {
    const DESCRIPTION: Description = Description {
        name: "force_sensor_gain",
        meaning: "the scale of the force sensor is off",
        equation: "F_measured <- F_measured (1 + g + b (r - 1) + c (r^2 - 1) + s exp(-t/tau) + a x/0.1 m + a2 (x/0.1 m)^2), r = F_measured/400 N",
        signature: "residual of the force in proportion to it",
        experiment: "hang two known masses on the sensor",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: Self::FORMS,
        further_forms: Self::FURTHER_FORMS,
        refinements: &[
            ("force_sensor_gain.bend", &[0.005]),
            ("force_sensor_gain.curvature", &[0.002]),
            ("force_sensor_gain.change_with_contraction", &[-0.01]),
            ("force_sensor_gain.change_with_its_square", &[-0.01]),
        ],
    };
    const ENDS_INSIDE: &'static [&'static str] = &[
        "force_sensor_gain.bend",
        "force_sensor_gain.curvature",
        "force_sensor_gain.settling",
        "force_sensor_gain.settling_time",
        "force_sensor_gain.change_with_contraction",
        "force_sensor_gain.change_with_its_square",
    ];
    const IS_OF_READING: bool = true;

    fn is_neutral(&self) -> bool {
        self.scale().is_neutral() && [self.change_with_contraction, self.change_with_its_square] == [0.0; 2]
    }

    fn own_course(&self, time: f64) -> f64 {
        settled(self.scale().settling, time)
    }

    fn readings(&self, readings: Readings) -> Readings {
        let force = self.scale().shown(readings.force, readings.time);
        Readings { force: force + self.of_angle(readings.contraction) * readings.force, ..readings }
    }

    fn sentence(&self) -> String {
        let of_angle = self.of_angle(REFERENCE_CONTRACTION);
        let tilted = if of_angle == 0.0 {
            String::new()
        } else {
            format!(", and {:+.1} % on top at 10 cm of contraction, as at an angle", 100.0 * of_angle)
        };
        format!("The force sensor shows {}{tilted}.", self.scale().told("400 N"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_at_an_angle_shows_its_cosine() {
        // cos(atan(x/L)) = 1 − x²/(2 L²) + …, here with L = 0.6 m.
        let cell =
            ForceSensorGain { change_with_its_square: -0.5 * (0.1_f64 / 0.6).powi(2), ..ForceSensorGain::default() };
        for contraction in [0.0, 0.05, 0.1, 0.2] {
            let at = Readings { time: 0.0, contraction, gauge_pressure: 2e5, force: 500.0 };
            let cosine = (contraction / 0.6).atan().cos();
            assert!((cell.readings(at).force - 500.0 * cosine).abs() < 3.0, "{contraction}");
        }
        assert!(
            !cell.is_neutral()
                && cell.sentence().ends_with(", and -1.4 % on top at 10 cm of contraction, as at an angle.")
        );
    }
}
