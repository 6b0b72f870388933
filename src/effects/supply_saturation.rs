use super::{Description, Effect, Freed, Holds, Point, each_for, leave_out_others, of_recording, told_anew};

/// Ceiling in Pa from which on there is none: beyond what any muscle stands.
const NONE: f64 = 2e6;
/// Power below which a ceiling would take off much of any pressure.
const LEAST_SHARPNESS: f64 = 2.0;
/// Time constant in s from which on nothing recovers.
const FOREVER: f64 = 1e6;

crate::variables::variables! {
    /// A supply whose pressure is too low for the command.
    ///
    /// # Model
    /// p_target ← p_t = min(p_target, p_s − s − d max(p_target − p, 0)), ds/dt = f + u max(p_t − p, 0) − s/τ from s = 0 at the start:
    /// `gauge_pressure` p_s of the supply at the start, its `fall` f over time, its `droop` d while it fills the muscle; `usage` u is
    /// what filling takes from a small tank, `recovery_time` τ that of its compressor. With a `sharpness` n the minimum is
    /// a soft one, p_target (1 + (p_target/ceiling)ⁿ)^(−1/n). With a compressor between two switches p_s is the middle of a saw-tooth, which falls by
    /// `span` c and is back within the share `refill` ρ of its `period` T; at the start the share `phase` φ of a period is over. In these recordings
    /// p_s is higher by `second` and `third`, and φ by `second_phase` and `third_phase`.
    ///
    /// # In the data
    /// The pressure residual is zero below a ceiling and grows one to one with the command above it.
    ///
    /// # Validity
    /// A supply of constant pressure behind a regulator, or with a droop in proportion to what the muscle lacks, or a tank
    /// that others empty steadily, or one that the muscle itself empties, or one that a compressor fills between two switches while others
    /// use it steadily. Where it is constant at first and that is changed in the course of a simulation, its time counts from that change.
    ///
    /// # Reference
    /// Definition of saturation; droop as in data sheets of pressure regulators (0.5 to 1.75 bar). Two switches: balance of the
    /// tank's air at constant use, and full load or none (their pressures are 0.2 to 1 bar apart).
    pub struct SupplySaturation in "supply_saturation." as Tunable {
        /// Gauge pressure of the supply, in the mean; there is no limit at the largest value
        gauge_pressure: f64 = NONE, PASCAL, (1e3..=NONE);
        /// Power with which it sets in where it does so gradually from far below, 0 where at once
        sharpness: f64 = 0.0, ONE, (0.0..=1000.0);
        /// Loss of supply pressure per pressure that the muscle lacks
        droop: f64 = 0.0, ONE, (0.0..=1.0);
        /// Loss of supply pressure per time, of a tank that empties or a line that others use more and more
        fall: f64 = 0.0, PASCAL_PER_SECOND, (-1e4..=1e5);
        /// Loss of supply pressure per time and pressure that the muscle lacks: of a small tank
        usage: f64 = 0.0, PER_SECOND, (0.0..=20.0);
        /// Time constant in which a loss is made up for; none is at the largest value
        recovery_time: f64 = FOREVER, SECOND, (0.3..=FOREVER);
        /// Pressure between the two switches of a compressor
        span: f64 = 0.0, PASCAL, (0.0..=2e5);
        /// Period in which a compressor switches
        period: f64 = 10.0, SECOND, (1.0..=200.0);
        /// Share of a period that is over at the start
        phase: f64 = 0.0, ONE, (-2.0..=3.0);
        /// By how much more of it is over in the second of several recordings
        second_phase: f64 = 0.0, ONE, (-2.0..=3.0), of 2;
        /// By how much more of it is over in the third
        third_phase: f64 = 0.0, ONE, (-2.0..=3.0), of 3;
        /// By how much the supply gives more in the second of several recordings
        second: f64 = 0.0, PASCAL, (-NONE..=NONE), of 2;
        /// By how much it gives more in the third
        third: f64 = 0.0, PASCAL, (-NONE..=NONE), of 3;
        /// Which of the recordings is simulated: from the fourth on as the first
        recording: f64 = 1.0, ONE, (1.0..=1000.0);
        /// Share of a period that the compressor runs
        refill: f64 = 0.2, ONE, (0.02..=0.98);
    }
}

/// A ceiling shows only between the highest target and what a muscle rests at: the starts are close, in Pa.
#[rustfmt::skip]
const CEILINGS: &[f64] = &[
    0.80e5, 0.90e5, 1.00e5, 1.10e5, 1.20e5, 1.30e5, 1.40e5, 1.50e5, 1.60e5, 1.70e5,
    1.80e5, 1.90e5, 2.00e5, 2.15e5, 2.30e5, 2.45e5, 2.60e5, 2.75e5, 2.90e5, 3.10e5,
    3.30e5, 3.50e5, 3.70e5, 3.95e5, 4.20e5, 4.50e5, 4.80e5, 5.10e5, 5.40e5, 5.80e5,
];

/// Where fits of a supply that is another one in each recording start: in the first, and by how much more in a further one, in Pa.
const COARSELY: &[f64] = &[1.2e5, 1.5e5, 1.9e5, 2.4e5, 3.0e5, 3.8e5];
const FURTHER: &[f64] = &[-1.6e5, -0.8e5, -0.4e5, 0.4e5, 0.8e5, 1.6e5];

/// Where fits of a compressor's cycle start: periods in s, and the shares of one that are over at the start.
const PERIODS: &[f64] = &[4.0, 5.0, 6.3, 8.0, 10.0, 12.5, 16.0, 20.0, 25.0, 32.0];
const PHASES: &[f64] = &[0.0, 0.25, 0.5, 0.75];

const CEILING: Freed = ("supply_saturation.gauge_pressure", &[1.7e5]);
const SPAN: Freed = ("supply_saturation.span", &[2e4]);
const REFILL: Freed = ("supply_saturation.refill", &[0.2]);

impl SupplySaturation {
    /// Gauge pressure in Pa of the supply in the recording that is simulated, in the mean.
    fn given(&self) -> f64 {
        self.gauge_pressure + of_recording(self.recording, [self.second, self.third])
    }

    /// Share of a compressor's period that is over at the start of that.
    fn phase_at_start(&self) -> f64 {
        self.phase + of_recording(self.recording, [self.second_phase, self.third_phase])
    }

    /// What a compressor's switching takes off the supply at a time in s since the start, Pa.
    fn cycle(&self, time: f64) -> f64 {
        let passed = (time / self.period + self.phase_at_start()).rem_euclid(1.0);
        let emptying = 1.0 - self.refill;
        self.span * (if passed < emptying { passed / emptying } else { (1.0 - passed) / self.refill } - 0.5)
    }
}

impl Effect for SupplySaturation {
    const DESCRIPTION: Description = Description {
        name: "supply_saturation",
        meaning: "the supply pressure is too low for the command",
        equation: "p_target <- p_t = min(p_target, p_s - s - d max(p_target - p, 0) - c (saw(t/T + phi) - 1/2));  ds/dt = f + u max(p_t - p, 0) - s/tau",
        signature: "pressure residual above a ceiling only",
        experiment: "record the supply pressure; raise it",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[&[("supply_saturation.gauge_pressure", CEILINGS)]],
        further_forms: &[
            &[
                ("supply_saturation.gauge_pressure", &each_for::<36>(COARSELY, 6)),
                ("supply_saturation.second", &each_for::<36>(FURTHER, 1)),
            ],
            &[
                ("supply_saturation.gauge_pressure", &each_for::<216>(COARSELY, 36)),
                ("supply_saturation.second", &each_for::<216>(FURTHER, 6)),
                ("supply_saturation.third", &each_for::<216>(FURTHER, 1)),
            ],
            &[
                CEILING,
                SPAN,
                ("supply_saturation.period", &each_for::<40>(PERIODS, 4)),
                ("supply_saturation.phase", &each_for::<40>(PHASES, 1)),
                REFILL,
            ],
            &[
                CEILING,
                SPAN,
                ("supply_saturation.period", &each_for::<160>(PERIODS, 16)),
                ("supply_saturation.phase", &each_for::<160>(PHASES, 4)),
                ("supply_saturation.second_phase", &each_for::<160>(PHASES, 1)),
                REFILL,
            ],
            &[
                CEILING,
                SPAN,
                ("supply_saturation.period", &each_for::<640>(PERIODS, 64)),
                ("supply_saturation.phase", &each_for::<640>(PHASES, 16)),
                ("supply_saturation.second_phase", &each_for::<640>(PHASES, 4)),
                ("supply_saturation.third_phase", &each_for::<640>(PHASES, 1)),
                REFILL,
            ],
        ],
        refinements: &[
            ("supply_saturation.sharpness", &[50.0, 8.0]),
            ("supply_saturation.droop", &[0.01, 0.1]),
            ("supply_saturation.fall", &[300.0]),
            ("supply_saturation.usage", &[1.0, 5.0]),
            ("supply_saturation.recovery_time", &[10.0, 3.0]),
        ],
    };
    /// Pressure that was lost, and time since the start.
    const STATE_SCALES: &'static [f64] = &[1e4, 1.0];

    fn is_neutral(&self) -> bool {
        self.gauge_pressure >= NONE
    }

    fn is_plausible(&self) -> bool {
        self.span == 0.0 || (1.5..150.0).contains(&self.period)
    }

    // What was lost stays nothing, and the time does not count.
    fn rests(&self) -> bool {
        self.is_neutral() || [self.fall, self.usage, self.span] == [0.0; 3]
    }

    // The same supply whichever recording it is of: hundreds of starts for several recordings are few for each.
    fn in_recording(&mut self, number: usize) {
        leave_out_others(self, number);
        if self.is_neutral() {
            return;
        }
        (self.gauge_pressure, self.phase) = (self.given(), self.phase_at_start());
        [self.second, self.third, self.second_phase, self.third_phase] = [0.0; 4];
    }

    fn own_course(&self, time: f64) -> f64 {
        -self.cycle(time)
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let taken = self.usage * (at.target_pressure - at.gauge_pressure).max(0.0);
        rates[0] = self.fall + taken - if self.recovery_time < FOREVER { own[0] / self.recovery_time } else { 0.0 };
        rates[1] = 1.0;
    }

    fn target_pressure(&self, at: &Point, own: &[f64], target: f64) -> f64 {
        if self.is_neutral() {
            return target;
        }
        let lost = own[0] + self.cycle(own[1]);
        let ceiling = self.given() - lost - self.droop * (target - at.gauge_pressure).max(0.0);
        if self.sharpness == 0.0 || target <= 0.0 || ceiling <= 0.0 {
            return target.min(ceiling);
        }
        let (less, more, sharpness) = (target.min(ceiling), target.max(ceiling), self.sharpness.max(LEAST_SHARPNESS));
        less * (1.0 + (less / more).powf(sharpness)).powf(-1.0 / sharpness)
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
        let cycle = if self.span == 0.0 {
            String::new()
        } else {
            format!("; its compressor makes that ±{:.2} bar, each {:.1} s", 0.5e-5 * self.span, self.period)
        };
        let bar = |more: f64| format!("{:.2} bar", 1e-5 * (self.gauge_pressure + more));
        let anew = told_anew([self.second, self.third], |more, recording| {
            format!(", {} in the {recording} recording", bar(more))
        });
        format!("The supply gives no more than {}{anew}{falling}{taken}{made_up}{cycle}.", bar(0.0))
    }
}
