use super::{Description, Effect, Holds, REFERENCE_CONTRACTION, Readings};
use crate::scale::{as_its_scale, forms_of_scale};

crate::variables::variables! {
    /// A position sensor whose scale is off.
    ///
    /// # Model
    /// x_measured ← x_measured (1 + g + b (r − 1) + c (r² − 1) + s exp(−t/τ)), r = x_measured/0.1 m, t since the start: `relative_error` g,
    /// `bend` b, `curvature` c, `settling` s, `settling_time` τ.
    ///
    /// # In the data
    /// The residual of the contraction is in proportion to the contraction; the force is as it should be for the true one.
    ///
    /// # Validity
    /// Constant over a recording, or settling while the amplifier warms up from its start, in every recording alike; slightly bent scales.
    ///
    /// # Reference
    /// Definition of a gain; linearity errors in data sheets of sensors (up to 1 % of full scale).
    pub struct ContractionSensorGain in "contraction_sensor_gain." as Tunable {
        /// Relative error of the position sensor
        relative_error: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the scale per 0.1 m away from 0.1 m
        bend: f64 = 0.0, ONE, (-0.1..=0.1);
        /// Change of the scale with the square of the way, per that of 0.1 m
        curvature: f64 = 0.0, ONE, (-0.03..=0.03);
        /// Excess of the scale at the start, which settles
        settling: f64 = 0.0, ONE, (-0.3..=0.3);
        /// Time constant of the settling
        settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
    }
}

impl ContractionSensorGain {
    forms_of_scale!("contraction_sensor_gain.", REFERENCE_CONTRACTION);
}

impl Effect for ContractionSensorGain {
    const DESCRIPTION: Description = Description {
        name: "contraction_sensor_gain",
        meaning: "the scale of the position sensor is off",
        equation: "x_measured <- x_measured (1 + g + b (r - 1) + c (r^2 - 1) + s exp(-t/tau)), r = x_measured/0.1 m",
        signature: "residual of the contraction in proportion to it",
        experiment: "compare with a ruler at two lengths",
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
        Readings { contraction: self.scale().shown(readings.contraction, readings.time), ..readings }
    }

    fn true_contraction(&self, reading: f64, _force: f64, time: f64) -> f64 {
        self.scale().behind(reading, time)
    }

    fn sentence(&self) -> String {
        format!("The position sensor shows {}.", self.scale().told("0.1 m"))
    }
}
