use super::{Description, Effect, Holds, Point};
use crate::zero::{as_its_course, zero};

zero! {
    /// A valve whose zero is off.
    ///
    /// # Model
    /// u ← u + o + o_k + s exp(−t/τ) + a sin(2π t/T + φ) + j r, t since the start: `offset` o, `second` and `third` o_k in recording k, `settling` s,
    /// `settling_time` τ, `swing` a, `swing_period` T, `swing_phase` φ, `shift` j, `second_shift` and `third_shift` in these recordings, in those
    /// that follow all of it; r goes from 0 to 1 within `shift_span` around `shift_time`.
    ///
    /// # In the data
    /// A constant residual of the pressure, with the force that belongs to it. With an offset of the pressure sensor the
    /// force stays.
    ///
    /// # Validity
    /// Constant, settling, swinging or shifted once, as the zeros of sensors. Where it
    /// is constant at first and changed in the course of a simulation, t counts from that change.
    ///
    /// # Reference
    /// Zero errors in data sheets of proportional pressure regulators.
    pub struct ValveOffset in "valve_offset." from 0.1 {
        /// Voltage that acts beyond the command
        offset: VOLT, 2.0;
    }
}

impl Effect for ValveOffset {
    const DESCRIPTION: Description = Description {
        name: "valve_offset",
        meaning: "the zero of the valve is off",
        equation: "u <- u + o + o_k + s exp(-t/tau) + a sin(2 pi t/T + phi) + j clamp((t - t_j)/d + 1/2, 0, 1)",
        signature: "constant residual of the pressure, and of the force with it",
        experiment: "stairs of the command with the pressure recorded by a second sensor",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: &[Self::CONSTANT, Self::OF_TWO, Self::OF_THREE],
        further_forms: Self::FURTHER_FORMS,
        refinements: Self::REFINEMENTS,
    };
    const STATE_SCALES: &'static [f64] = &[1.0];

    as_its_course!();

    fn rests(&self) -> bool {
        self.course().is_constant()
    }

    // The state is that time.
    fn rates(&self, _at: &Point, _own: &[f64], rates: &mut [f64]) {
        rates[0] = 1.0;
    }

    fn command(&self, _at: &Point, own: &[f64], command: f64) -> f64 {
        command + self.course().at(own[0])
    }

    fn sentence(&self) -> String {
        let amount = |value: f64| format!("{:+.3} V", value);
        format!("The valve acts as if its command were {} off{}.", amount(self.offset), self.course().told(amount))
    }
}
