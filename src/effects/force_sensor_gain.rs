use super::{Description, Effect, Holds, REFERENCE_FORCE, Readings};
use crate::scale::{as_its_scale, forms_of_scale};

crate::variables::variables! {
    /// A force sensor whose scale is off.
    ///
    /// # Model
    /// F_measured ← F_measured (1 + g + b (r − 1) + c (r² − 1) + s exp(−t/τ)), r = F_measured/400 N, t since the start: `relative_error` g, `bend` b,
    /// `curvature` c, `settling` s, `settling_time` τ.
    ///
    /// # In the data
    /// The residual of the force is in proportion to the force, while the motion is as nominal; with a gain of the muscle the
    /// motion follows.
    ///
    /// # Validity
    /// Constant over a recording, or settling while the amplifier warms up from its start, in every recording alike; slightly bent scales; the
    /// curvature is that of a cell or an amplifier whose scale falls with the force.
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
    }
}

impl ForceSensorGain {
    forms_of_scale!("force_sensor_gain.", REFERENCE_FORCE);
}

impl Effect for ForceSensorGain {
    const DESCRIPTION: Description = Description {
        name: "force_sensor_gain",
        meaning: "the scale of the force sensor is off",
        equation: "F_measured <- F_measured (1 + g + b (r - 1) + c (r^2 - 1) + s exp(-t/tau)), r = F_measured/400 N",
        signature: "residual of the force in proportion to it",
        experiment: "hang two known masses on the sensor",
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
        Readings { force: self.scale().shown(readings.force, readings.time), ..readings }
    }

    fn sentence(&self) -> String {
        format!("The force sensor shows {}.", self.scale().told("400 N"))
    }
}
