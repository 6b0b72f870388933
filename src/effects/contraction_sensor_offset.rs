use super::{Description, Effect, Holds, Readings};
use crate::zero::{as_its_course, zero};

zero! {
    /// A position sensor whose zero is not at the rest length.
    ///
    /// # Model
    /// x_measured ← x_measured + o + o_k + s exp(−t/τ) + a sin(2π t/T + φ) + j r, t since the start: `offset` o, `second` and `third` o_k in recording k, `settling` s,
    /// `settling_time` τ, `swing` a, `swing_period` T, `swing_phase` φ, `shift` j, `second_shift` and `third_shift` in these recordings, in those
    /// that follow all of it; r goes from 0 to 1 within `shift_span` around `shift_time`.
    ///
    /// # In the data
    /// A constant residual of the contraction, also at rest. Without it in the force, it is not a change of the muscle.
    ///
    /// # Validity
    /// Constant, settling while the sensor warms up from the start of the recording, swinging with what is around it, or shifted
    /// once by a shock in one of up to three recordings, at the same time where in several; else in every recording alike, from its start, but
    /// for a constant that may be another one in each.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct ContractionSensorOffset in "contraction_sensor_offset." from 5e-3 {
        /// What the position sensor shows at rest length
        offset: METRE, 0.2;
    }
}

impl Effect for ContractionSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_offset",
        meaning: "the zero of the position sensor is not at the rest length",
        equation: "x_measured <- x_measured + o + o_k + s exp(-t/tau) + a sin(2 pi t/T + phi) + j clamp((t - t_j)/d + 1/2, 0, 1)",
        signature: "constant residual of the contraction, also at rest",
        experiment: "read the sensor with the muscle empty and unloaded",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[
            Self::CONSTANT,
            Self::OF_TWO,
            Self::OF_THREE,
            // Corrections of the muscle take a constant offset over, and leave how it settles.
            &[
                ("contraction_sensor_offset.offset", &[5e-3, -5e-3, 5e-3, -5e-3]),
                ("contraction_sensor_offset.settling", &[2.5e-3, -2.5e-3, 2.5e-3, -2.5e-3]),
                ("contraction_sensor_offset.settling_time", &[4.0, 4.0, 15.0, 15.0]),
            ],
        ],
        further_forms: Self::FURTHER_FORMS,
        refinements: Self::REFINEMENTS,
    };
    const IS_OF_READING: bool = true;

    as_its_course!();

    fn readings(&self, readings: Readings) -> Readings {
        Readings { contraction: readings.contraction + self.course().at(readings.time), ..readings }
    }

    fn true_contraction(&self, reading: f64, _force: f64, time: f64) -> f64 {
        reading - self.course().at(time)
    }

    fn sentence(&self) -> String {
        let amount = |value: f64| format!("{:+.2} mm", value * 1e3);
        format!("The position sensor shows {} at the rest length{}.", amount(self.offset), self.course().told(amount))
    }
}
