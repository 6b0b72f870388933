use super::{Description, Effect, Holds, Readings};
use crate::zero::{as_its_course, zero};

zero! {
    /// A pressure sensor whose zero is not at ambient pressure.
    ///
    /// # Model
    /// p_measured ← p_measured + o + o_k + s exp(−t/τ) + a sin(2π t/T + φ) + j r, t since the start: `offset` o, `second` and `third` o_k in recording k, `settling` s,
    /// `settling_time` τ, `swing` a, `swing_period` T, `swing_phase` φ, `shift` j, `second_shift` and `third_shift` in these recordings, in those
    /// that follow all of it; r goes from 0 to 1 within `shift_span` around `shift_time`.
    ///
    /// # In the data
    /// A constant residual of the measured pressure with a force that fits the command; with an offset of the valve the
    /// force follows the pressure.
    ///
    /// # Validity
    /// A sensor of absolute pressure is one bar off. Constant, settling while the sensor warms up from the start of the recording, swinging with what is around it, or shifted
    /// once by a shock in one of up to three recordings, at the same time where in several; else in every recording alike, from its start, but
    /// for a constant that may be another one in each.
    ///
    /// # Reference
    /// Definition of an offset.
    pub struct PressureSensorOffset in "pressure_sensor_offset." from 1e4 {
        /// What the pressure sensor shows at ambient pressure
        offset: PASCAL, 2e5;
    }
}

impl Effect for PressureSensorOffset {
    const DESCRIPTION: Description = Description {
        name: "pressure_sensor_offset",
        meaning: "the zero of the pressure sensor is not at ambient pressure",
        equation: "p_measured <- p_measured + o + o_k + s exp(-t/tau) + a sin(2 pi t/T + phi) + j clamp((t - t_j)/d + 1/2, 0, 1)",
        signature: "constant residual of the pressure, also at rest",
        experiment: "read the sensor with the muscle open to the air",
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
        Readings { gauge_pressure: readings.gauge_pressure + self.course().at(readings.time), ..readings }
    }

    fn true_pressure(&self, reading: f64, time: f64) -> f64 {
        reading - self.course().at(time)
    }

    fn sentence(&self) -> String {
        let amount = |value: f64| format!("{:+.3} bar", value * 1e-5);
        format!("The pressure sensor shows {} at ambient pressure{}.", amount(self.offset), self.course().told(amount))
    }
}
