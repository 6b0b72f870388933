use super::{Description, Effect, Holds, Point, Readings, of_recording, told_anew};

/// Power in W of the motion for which changes by work are stated.
const REFERENCE_POWER: f64 = 10.0;

/// Speed in m/s of the motion for which changes by motion are stated.
const REFERENCE_SPEED: f64 = 0.1;

/// How far warmth may begin the wrong way: two exponentials are only nearly what begins slowly.
const MOST_ASTRAY: f64 = 0.1;
/// Time constant in s within which no muscle warms up.
const FASTEST: f64 = 3.0;

crate::variables::variables! {
    /// Slow change while the muscle warms up, or its valve or a sensor.
    ///
    /// # Model
    /// τ₁ dw₁/dt = 1 − k + k ((1 − m) |P|/(10 W) + m |dx/dt|/(0.1 m/s)) − w₁, and w₂ alike with τ₂; P = F_p dx/dt the power of the pressure's
    /// pull F_p without effects, `speed_share` m of what goes with the way alone, as the work of dry friction does. With
    /// w = (1 − s) w₁ + s w₂ the area counts 1 + a w times, the elastic force 1 + e w times, the command of the valve 1 + v w times, and the
    /// muscle is contracted by l w more, as one whose rest length grew: `time_constant` τ₁, `time_constant_2` τ₂, `share_2` s, `work_share` k,
    /// `area_change` a, `elastic_change` e, `valve_change` v, `length_change` l. A force
    /// sensor shows f w more and a pressure sensor q w, both with k = 0: `force_zero` f, `pressure_zero` q. Heat that spreads begins sooner
    /// and ends later than one exponential, 0 < s < 1; heat that first has to come through something begins slowly, s < 0 with τ₂ < τ₁. At
    /// the start w₁ = w₂ = 0, but for a second and a third recording that begin warm, `second` and `third`.
    ///
    /// # In the data
    /// One cycle differs from the next, the less the later; the residual grows from zero at the start and stays. Creep comes back after
    /// every step. No data tell the zero of a sensor that is right when cold and drifts from one that settles, nor from that of the position
    /// sensor a rest length that grows, where the motion is prescribed or slow.
    ///
    /// # Validity
    /// The first recording starts cold. Its surroundings warm the muscle, or its own work or way, of which a fixed share becomes heat; no muscle
    /// warms within less than 3 s.
    ///
    /// # Reference
    /// Newton's law of cooling; definition.
    pub struct TemperatureDrift in "temperature_drift." as Tunable {
        /// Relative change of the area when warm
        area_change: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Relative change of the elastic force when warm
        elastic_change: f64 = 0.0, ONE, (-0.9..=2.0);
        /// Relative change of the gain of the valve when warm, as of its coil
        valve_change: f64 = 0.0, ONE, (-0.5..=0.5);
        /// Change of the rest length of the muscle when warm
        length_change: f64 = 0.0, METRE, (-0.05..=0.05);
        /// What the force sensor shows without pull when warm
        force_zero: f64 = 0.0, NEWTON, (-500.0..=500.0);
        /// What the pressure sensor shows in an open muscle when warm
        pressure_zero: f64 = 0.0, PASCAL, (-1e5..=1e5);
        /// Time constant of the warming
        time_constant: f64 = 15.0, SECOND, (FASTEST..=1000.0);
        /// Share of the warming that goes with the power of its motion, stated for 10 W
        work_share: f64 = 0.0, ONE, (0.0..=1.0);
        /// Share of that which goes with its speed instead, stated for 0.1 m/s
        speed_share: f64 = 0.0, ONE, (0.0..=1.0);
        /// Share of the warming that has another time constant
        share_2: f64 = 0.0, ONE, (-2.0..=1.0);
        /// That time constant
        time_constant_2: f64 = 60.0, SECOND, (FASTEST..=3000.0);
        /// How warm the muscle is at the start of the second of several recordings
        second: f64 = 0.0, ONE, (0.0..=1.0), of 2;
        /// How warm it is at the start of the third
        third: f64 = 0.0, ONE, (0.0..=1.0), of 3;
        /// Which of the recordings is simulated: from the fourth on as the first
        recording: f64 = 1.0, ONE, (1.0..=1000.0);
    }
}

impl TemperatureDrift {
    /// What muscle and valve change when warm.
    fn changes(&self) -> [f64; 4] {
        [self.area_change, self.elastic_change, self.valve_change, self.length_change]
    }

    /// The least warmth on the way from cold to warm, by which it begins the wrong way; 0 where it does not.
    fn deepest(&self) -> f64 {
        let (share, one, other) = (self.share_2, self.time_constant, self.time_constant_2);
        // Its rate (1 − s)/τ₁ exp(−t/τ₁) + s/τ₂ exp(−t/τ₂) is zero where the ratio of the parts is one.
        let ratio = (1.0 - share) * other / (-share * one);
        if share >= 0.0 || other < one && ratio >= 1.0 {
            return 0.0;
        }
        if other >= one {
            return f64::NEG_INFINITY; // it ends the wrong way
        }
        let turns = -ratio.ln() / (1.0 / other - 1.0 / one);
        1.0 - (1.0 - share) * (-turns / one).exp() - share * (-turns / other).exp()
    }

    fn warmth(&self, own: &[f64]) -> f64 {
        own[0] + self.share_2 * (own[1] - own[0])
    }

    fn warmth_at_start(&self) -> f64 {
        of_recording(self.recording, [self.second, self.third])
    }

    /// Warmth of a sensor at a time in s since the start: it does no work.
    fn warmth_of_sensor(&self, time: f64) -> f64 {
        let of_one = |constant: f64| 1.0 - (1.0 - self.warmth_at_start()) * (-time.max(0.0) / constant).exp();
        self.warmth(&[of_one(self.time_constant), of_one(self.time_constant_2)])
    }
}

impl Effect for TemperatureDrift {
    const DESCRIPTION: Description = Description {
        name: "temperature_drift",
        meaning: "slow change while the muscle, its valve or a sensor warms up",
        equation: "tau_i dw_i/dt = 1 - k + k ((1 - m) |P|/(10 W) + m |v|/(0.1 m/s)) - w_i;  w = (1 - s) w_1 + s w_2;  A <- A (1 + a w);  F_e <- F_e (1 + e w);  u <- u (1 + v w);  x_e <- x_e + l w;  F_measured <- F_measured + f w;  p_measured <- p_measured + q w",
        signature: "force residual that grows from zero and stays: the first cycle differs from the last",
        experiment: "the same cycle for several minutes, from cold",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("temperature_drift.area_change", &[0.05, -0.05]), ("temperature_drift.time_constant", &[10.0, 25.0])],
            &[
                ("temperature_drift.area_change", &[0.05, -0.05]),
                ("temperature_drift.time_constant", &[15.0]),
                ("temperature_drift.work_share", &[1.0]),
            ],
            &[("temperature_drift.force_zero", &[20.0, -20.0]), ("temperature_drift.time_constant", &[15.0])],
            &[("temperature_drift.valve_change", &[0.05, -0.05]), ("temperature_drift.time_constant", &[15.0])],
            &[("temperature_drift.length_change", &[5e-3, -5e-3]), ("temperature_drift.time_constant", &[15.0])],
        ],
        // A leak of a shut chamber looks like it.
        further_forms: &[&[
            ("temperature_drift.pressure_zero", &[5e3, -5e3]),
            ("temperature_drift.time_constant", &[15.0]),
        ]],
        refinements: &[
            ("temperature_drift.elastic_change", &[0.05]),
            ("temperature_drift.speed_share", &[0.5]),
            ("temperature_drift.share_2", &[0.3]),
            ("temperature_drift.time_constant_2", &[100.0]),
            ("temperature_drift.second", &[0.5]),
            ("temperature_drift.third", &[0.7]),
        ],
    };
    /// Both parts of its warmth.
    const STATE_SCALES: &'static [f64] = &[1.0, 1.0];

    fn is_neutral(&self) -> bool {
        self.changes() == [0.0; 4] && self.force_zero == 0.0 && self.pressure_zero == 0.0
    }

    fn is_plausible(&self) -> bool {
        self.time_constant > FASTEST && self.deepest() > -MOST_ASTRAY
    }

    // How warm a sensor is goes by time.
    fn rests(&self) -> bool {
        self.changes() == [0.0; 4]
    }

    fn start(&self, _at: &Point, own: &mut [f64]) {
        own.fill(self.warmth_at_start());
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let power = (at.pressure_pull * at.contraction_velocity).abs() / REFERENCE_POWER;
        let speed = at.contraction_velocity.abs() / REFERENCE_SPEED;
        let aim = 1.0 + self.work_share * (power + self.speed_share * (speed - power) - 1.0);
        rates[0] = (aim - own[0]) / self.time_constant;
        rates[1] = (aim - own[1]) / self.time_constant_2;
    }

    fn own_course(&self, time: f64) -> f64 {
        self.warmth_of_sensor(time)
    }

    fn command(&self, _at: &Point, own: &[f64], command: f64) -> f64 {
        command * (1.0 + self.valve_change * self.warmth(own))
    }

    fn effective_contraction(&self, _at: &Point, own: &[f64], contraction: f64) -> f64 {
        contraction + self.length_change * self.warmth(own)
    }

    fn area_force(&self, _at: &Point, own: &[f64], force: f64) -> f64 {
        force * (1.0 + self.area_change * self.warmth(own))
    }

    fn elastic_force(&self, _at: &Point, own: &[f64], force: f64) -> f64 {
        force * (1.0 + self.elastic_change * self.warmth(own))
    }

    fn readings(&self, readings: Readings) -> Readings {
        if self.force_zero == 0.0 && self.pressure_zero == 0.0 {
            return readings;
        }
        let warmth = self.warmth_of_sensor(readings.time);
        Readings {
            force: readings.force + self.force_zero * warmth,
            gauge_pressure: readings.gauge_pressure + self.pressure_zero * warmth,
            ..readings
        }
    }

    fn true_pressure(&self, reading: f64, time: f64) -> f64 {
        reading - self.pressure_zero * self.warmth_of_sensor(time)
    }

    fn sentence(&self) -> String {
        let by_work = match 100.0 * self.work_share {
            0.0 => String::new(),
            share if self.speed_share == 0.0 => format!(", {share:.0} % of it by its own work, told for 10 W"),
            share => format!(", {share:.0} % of it by its own work and way, told for 10 W and 0.1 m/s"),
        };
        let slowly = match 100.0 * self.share_2 {
            0.0 => String::new(),
            share if share < 0.0 => format!(" and, slowly at first, within {:.0} s", self.time_constant_2),
            share => format!(", {share:.0} % of it within {:.0} s", self.time_constant_2),
        };
        let parts = [
            (self.area_change != 0.0, format!("the area of the muscle by {:+.1} %", 100.0 * self.area_change)),
            (self.elastic_change != 0.0, format!("its elastic force by {:+.1} %", 100.0 * self.elastic_change)),
            (self.valve_change != 0.0, format!("the gain of the valve by {:+.1} %", 100.0 * self.valve_change)),
            (
                self.length_change != 0.0,
                format!("the rest length of the muscle by {:+.2} mm", 1e3 * self.length_change),
            ),
            (self.force_zero != 0.0, format!("the zero of the force sensor by {:+.1} N", self.force_zero)),
            (
                self.pressure_zero != 0.0,
                format!("the zero of the pressure sensor by {:+.3} bar", 1e-5 * self.pressure_zero),
            ),
        ];
        let parts: Vec<_> = parts.into_iter().filter_map(|(is_there, part)| is_there.then_some(part)).collect();
        let anew = told_anew([self.second, self.third], |warm, recording| {
            format!("; the {recording} recording starts {:.0} % warm", 100.0 * warm)
        });
        format!("Warming up within {:.0} s{slowly}{by_work} changes {}{anew}.", self.time_constant, parts.join(", "))
    }
}
