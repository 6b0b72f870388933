use super::{Description, Effect, Holds, Readings};
use crate::zero::{as_its_course, zero};

zero! {
    /// A force sensor that shows a force where there is none.
    ///
    /// # Model
    /// F_measured ← F_measured + o + o_k + s exp(−t/τ) + a sin(2π t/T + φ) + j r, t since the start: `offset` o, `second` and `third` o_k in recording k, `settling` s,
    /// `settling_time` τ, `swing` a, `swing_period` T, `swing_phase` φ, `shift` j, `second_shift` and `third_shift` in these recordings, in those
    /// that follow all of it; r goes from 0 to 1 within `shift_span` around `shift_time`.
    ///
    /// # In the data
    /// A constant residual of the force, also with the muscle empty; the motion is as nominal.
    ///
    /// # Validity
    /// Constant, settling while the sensor warms up from the start of the recording, swinging with what is around it, or shifted
    /// once by a shock in one of up to three recordings, at the same time where in several; else in every recording alike, from its start, but
    /// for a constant that may be another one in each.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct ForceSensorOffset in "force_sensor_offset." from 20.0 {
        /// What the force sensor shows without pull
        offset: NEWTON, 500.0;
    }
}

impl Effect for ForceSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "force_sensor_offset",
        meaning: "the force sensor shows a force where there is none",
        equation: "F_measured <- F_measured + o + o_k + s exp(-t/tau) + a sin(2 pi t/T + phi) + j clamp((t - t_j)/d + 1/2, 0, 1)",
        signature: "constant residual of the force, also at rest",
        experiment: "read the sensor with nothing attached",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[Self::CONSTANT, Self::OF_TWO, Self::OF_THREE],
        further_forms: Self::FURTHER_FORMS,
        refinements: Self::REFINEMENTS,
    };
    const IS_OF_READING: bool = true;

    as_its_course!();

    fn readings(&self, readings: Readings) -> Readings {
        Readings { force: readings.force + self.course().at(readings.time), ..readings }
    }

    fn sentence(&self) -> String {
        let amount = |value: f64| format!("{:+.1} N", value);
        format!("The force sensor shows {} without pull{}.", amount(self.offset), self.course().told(amount))
    }
}
