use super::{Description, Effect, Holds, REFERENCE_PRESSURE, Readings};
use crate::scale::{as_its_scale, forms_of_scale};

crate::variables::variables! {
    /// A pressure sensor whose scale is off.
    ///
    /// # Model
    /// p_measured ← p_measured (1 + g + b (r − 1) + c (r² − 1) + s exp(−t/τ)), r = p_measured/2 bar, t since the start: `relative_error` g,
    /// `bend` b, `curvature` c, `settling` s, `settling_time` τ.
    ///
    /// # In the data
    /// The residual of the pressure is in proportion to the pressure with a force that fits the command; with a gain of the
    /// valve the force follows the pressure.
    ///
    /// # Validity
    /// Constant over a recording, or settling while the amplifier warms up from its start, in every recording alike; slightly bent scales.
    ///
    /// # Reference
    /// Definition of a gain; linearity errors in data sheets of sensors (up to 1 % of full scale).
    pub struct PressureSensorGain in "pressure_sensor_gain." as Tunable {
        /// Relative error of the pressure sensor
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the scale per 2 bar away from 2 bar
        bend: f64 = 0.0, ONE, (-0.1..=0.1);
        /// Change of the scale with the square of the pressure, per that of 2 bar
        curvature: f64 = 0.0, ONE, (-0.03..=0.03);
        /// Excess of the scale at the start, which settles
        settling: f64 = 0.0, ONE, (-0.3..=0.3);
        /// Time constant of the settling
        settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
    }
}

impl PressureSensorGain {
    forms_of_scale!("pressure_sensor_gain.", REFERENCE_PRESSURE);
}

impl Effect for PressureSensorGain {
    const DESCRIPTION: Description = Description {
        name: "pressure_sensor_gain",
        meaning: "the scale of the pressure sensor is off",
        equation: "p_measured <- p_measured (1 + g + b (r - 1) + c (r^2 - 1) + s exp(-t/tau)), r = p_measured/2 bar",
        signature: "residual of the pressure in proportion to it",
        experiment: "compare with a second gauge at two pressures",
        reference: "definition",
        of_load: false,
        holds: Holds::Exactly,
        forms: Self::FORMS,
        further_forms: Self::FURTHER_FORMS,
        refinements: Self::REFINEMENTS,
    };
    const ENDS_INSIDE: &'static [&'static str] = Self::SHAPES;
    const IS_OF_READING: bool = true;

    as_its_scale!();

    fn readings(&self, readings: Readings) -> Readings {
        Readings { gauge_pressure: self.scale().shown(readings.gauge_pressure, readings.time), ..readings }
    }

    fn true_pressure(&self, reading: f64, time: f64) -> f64 {
        self.scale().behind(reading, time)
    }

    fn sentence(&self) -> String {
        format!("The pressure sensor shows {}.", self.scale().told("2 bar"))
    }
}
