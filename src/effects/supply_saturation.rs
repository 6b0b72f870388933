use super::{Description, Effect, Holds, Point};

/// Ceiling in Pa from which on there is none: beyond what any muscle stands.
const NONE: f64 = 2e6;
/// Time constant in s from which on nothing recovers.
const FOREVER: f64 = 1e6;

crate::variables::variables! {
    /// A supply whose pressure is too low for the command.
    ///
    /// # Model
    /// p_target ← p_t = min(p_target, p_s − s − d max(p_target − p, 0)), ds/dt = f + u max(p_t − p, 0) − s/τ from s = 0 at the start:
    /// `gauge_pressure` p_s of the supply at the start, its `fall` f over time, its `droop` d while it fills the muscle; `usage` u is
    /// what filling takes from a small tank, `recovery_time` τ that of its compressor. With `rounding` r the minimum is r-soft:
    /// p_target − r ln(1 + exp((p_target − ceiling)/r)).
    ///
    /// # In the data
    /// The pressure residual is zero below a ceiling and grows one to one with the command above it.
    ///
    /// # Validity
    /// A supply of constant pressure behind a regulator, or with a droop in proportion to what the muscle lacks, or a tank
    /// that others empty steadily, or one that the muscle itself empties.
    ///
    /// # Reference
    /// Definition of saturation; droop as in data sheets of pressure regulators (0.5 to 1.75 bar).
    pub struct SupplySaturation in "supply_saturation." as Tunable {
        /// Gauge pressure of the supply; there is no limit at the largest value
        gauge_pressure: f64 = NONE, PASCAL, (1e3..=NONE);
        /// Pressure over which the ceiling is rounded
        rounding: f64 = 0.0, PASCAL, (0.0..=1e5);
        /// Loss of supply pressure per pressure that the muscle lacks
        droop: f64 = 0.0, ONE, (0.0..=1.0);
        /// Loss of supply pressure per time, of a tank that empties or a line that others use more and more
        fall: f64 = 0.0, PASCAL_PER_SECOND, (-1e4..=1e5);
        /// Loss of supply pressure per time and pressure that the muscle lacks: of a small tank
        usage: f64 = 0.0, PER_SECOND, (0.0..=20.0);
        /// Time constant in which a loss is made up for; none is at the largest value
        recovery_time: f64 = FOREVER, SECOND, (0.3..=FOREVER);
    }
}

/// A ceiling shows only between the highest target and what a muscle rests at: the starts are close, in Pa.
#[rustfmt::skip]
const CEILINGS: &[f64] = &[
    0.80e5, 0.90e5, 1.00e5, 1.10e5, 1.20e5, 1.30e5, 1.40e5, 1.50e5, 1.60e5, 1.70e5,
    1.80e5, 1.90e5, 2.00e5, 2.15e5, 2.30e5, 2.45e5, 2.60e5, 2.75e5, 2.90e5, 3.10e5,
    3.30e5, 3.50e5, 3.70e5, 3.95e5, 4.20e5, 4.50e5, 4.80e5, 5.10e5, 5.40e5, 5.80e5,
];

impl Effect for SupplySaturation {
    const DESCRIPTION: Description = Description {
        name: "supply_saturation",
        meaning: "the supply pressure is too low for the command",
        equation: "p_target <- p_t = min(p_target, p_s - s - d max(p_target - p, 0));  ds/dt = f + u max(p_t - p, 0) - s/tau",
        signature: "pressure residual above a ceiling only",
        experiment: "record the supply pressure; raise it",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[&[("supply_saturation.gauge_pressure", CEILINGS)]],
        further_forms: &[],
        refinements: &[
            ("supply_saturation.rounding", &[3e3]),
            ("supply_saturation.droop", &[0.01, 0.1]),
            ("supply_saturation.fall", &[300.0]),
            ("supply_saturation.usage", &[1.0, 5.0]),
            ("supply_saturation.recovery_time", &[10.0, 3.0]),
        ],
    };
    const STATE_SCALES: &'static [f64] = &[1e4];

    fn is_neutral(&self) -> bool {
        self.gauge_pressure >= NONE
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let taken = self.usage * (at.target_pressure - at.gauge_pressure).max(0.0);
        rates[0] = self.fall + taken - if self.recovery_time < FOREVER { own[0] / self.recovery_time } else { 0.0 };
    }

    fn target_pressure(&self, at: &Point, own: &[f64], target: f64) -> f64 {
        if self.is_neutral() {
            return target;
        }
        let ceiling = self.gauge_pressure - own[0] - self.droop * (target - at.gauge_pressure).max(0.0);
        let excess = target - ceiling;
        if self.rounding == 0.0 || excess.abs() > 40.0 * self.rounding {
            return target.min(ceiling);
        }
        target - self.rounding * (excess / self.rounding).exp().ln_1p()
    }

    fn sentence(&self) -> String {
        let falling = if self.fall == 0.0 {
            String::new()
        } else {
            let word = if self.fall < 0.0 { "more" } else { "less" };
            format!(" at first, and {:.3} bar {word} each minute", 60e-5 * self.fall.abs())
        };
        let taken = if self.usage == 0.0 {
            String::new()
        } else {
            format!("; it is a small tank, which loses {:.2} bar/s while the muscle lacks 1 bar", self.usage)
        };
        let recovers = self.recovery_time < FOREVER && (self.usage != 0.0 || self.fall != 0.0);
        let made_up =
            if recovers { format!(", made up for within {:.1} s", self.recovery_time) } else { String::new() };
        format!("The supply gives no more than {:.2} bar{falling}{taken}{made_up}.", self.gauge_pressure * 1e-5)
    }
}
