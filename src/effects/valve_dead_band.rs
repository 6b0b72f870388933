use super::{Description, Effect, Holds, Point};
use crate::memory::Slack;

crate::variables::variables! {
    /// A pilot stage that does not follow small changes of the command.
    ///
    /// # Model
    /// Play: the pilot w moves only where the command u pushes it, |u − w| ≤ `play`; with `play_spread` d it is the mean of five
    /// plays from 1 − d to 1 + d times as wide, as dry friction at a spring that sets in gradually; by `play_growth` b it is
    /// wider by b u, as friction that the pressure presses on. Stiction: it rests until
    /// |u − w| reaches `stiction`, and jumps to where u is after `jump_time`; it sticks again at once or, where u is faster than
    /// `sliding_speed`, once u turns. Behind a play of (S − J)/2, a stiction of J then makes the band S and the slip jump J of
    /// Choudhury, and without sliding a play of f_d and a stiction of f_s − f_d the pilot of He, which moves from f_s on and falls
    /// short by f_d. Overlap: the spool opens no port while the
    /// pressure is off its target by less than `pressure_overlap` h; beyond, the valve goes for the share
    /// min(|e|, s (|e| − h)) of that error e, `overlap_steepness` s: for one it misses the target by h, for more the port
    /// opens the more abruptly. Rounded edges let |e| − h set in gradually, about a share of h around it: `overlap_rounding`. The port for
    /// emptying may have another overlap, h (1 + a): `emptying_excess` a. Regulation that rests: the valve shuts while |e| has not reached
    /// `waking` H, then goes for its target until |e| is r H, `resting_share` r. All may be there, in this order.
    ///
    /// # In the data
    /// The pressure residual in slow stairs with the muscle locked: a constant that changes sign with the direction
    /// (play), or steps of one size (stiction). Unlike hysteresis of the muscle it is in the pressure.
    ///
    /// # Validity
    /// Exact for a command of straight lines, but for steps: where a sticking pilot would rest for less than 20 ms between its
    /// jumps it moves along with the command, and stays where that slows down within 25 ms, so that a step is one jump. A command
    /// that is held between communication points rests there: a pilot slides only where its derivative is given. What rests wakes and falls
    /// asleep some 6 ms late, about a cycle of a digital regulator.
    ///
    /// # Reference
    /// M. Choudhury, N. Thornhill, S. Shah (2005), Modelling valve stiction, doi 10.1016/j.conengprac.2004.05.005;
    /// Q. He, J. Wang, M. Pottmann, S. Qin (2007), A curve fitting method for detecting valve stiction in oscillating control loops, Industrial &
    /// Engineering Chemistry Research 46, 4549.
    pub struct ValveDeadBand in "valve_dead_band." as Tunable {
        /// Half width of the play of the pilot
        play: f64 = 0.0, VOLT, (0.0..=2.0);
        /// By which share of its mean the play's width differs at most
        play_spread: f64 = 0.0, ONE, (0.0..=1.0);
        /// By how much the half width of the play grows with the command
        play_growth: f64 = 0.0, ONE, (0.0..=0.3);
        /// Deviation from the command at which a stuck pilot jumps to it
        stiction: f64 = 0.0, VOLT, (0.0..=2.0);
        /// How long a jump of a stuck pilot takes
        jump_time: f64 = 0.0, SECOND, (0.0..=0.1);
        /// Speed of the command above which a pilot that has broken loose slides along until the command turns
        sliding_speed: f64 = 1e9, VOLT_PER_SECOND, (0.0..=1e9);
        /// Deviation from the target pressure below which the port for filling does not open, nor the one for emptying
        pressure_overlap: f64 = 0.0, PASCAL, (0.0..=2e5);
        /// How abruptly a port opens beyond the overlap
        overlap_steepness: f64 = 1.0, ONE, (1.0..=30.0);
        /// Share of the overlap within which the edges of a port are rounded
        overlap_rounding: f64 = 0.0, ONE, (0.0..=3.0);
        /// By which share the overlap of the port for emptying is wider
        emptying_excess: f64 = 0.0, ONE, (-0.95..=10.0);
        /// Deviation from the target pressure at which a valve that rests begins to regulate
        waking: f64 = 0.0, PASCAL, (0.0..=2e5);
        /// Share of that deviation at which it rests again
        resting_share: f64 = 0.15, ONE, (0.0..=0.9);
        /// Where in its play the pilot starts, or in its overlap the pressure: -1 lower end, 1 upper end
        start: f64 = 0.0, ONE, (-1.0..=1.0);
    }
}

/// Every jump depends on the ones before, so that the error of a fit has many minima: the starts are close, in V.
#[rustfmt::skip]
const STICTION_STARTS: &[f64] = &[
    0.010, 0.011, 0.012, 0.013, 0.014, 0.015, 0.016, 0.017, 0.018, 0.020,
    0.021, 0.023, 0.024, 0.026, 0.028,
    0.030, 0.032, 0.035, 0.037, 0.040, 0.043, 0.047, 0.050, 0.054, 0.058,
    0.062, 0.067, 0.072, 0.078, 0.083, 0.090, 0.097, 0.104, 0.112, 0.120,
    0.129, 0.139, 0.150, 0.161, 0.173, 0.187, 0.201, 0.216, 0.232, 0.250,
    0.269, 0.290, 0.312, 0.336, 0.362, 0.390, 0.420, 0.452, 0.487,
];

/// Play and stiction of a pilot that falls short where it jumps to, together, each time half and half or in a ratio of 1 to 3.
const SHORT_STARTS: &[f64] =
    &[0.03, 0.036, 0.043, 0.052, 0.062, 0.075, 0.09, 0.107, 0.13, 0.154, 0.185, 0.222, 0.267, 0.32];

/// Each of two shares of each of those.
const fn shares(shares: [f64; 2]) -> [f64; 2 * SHORT_STARTS.len()] {
    let mut all = [0.0; 2 * SHORT_STARTS.len()];
    let mut k = 0;
    while k < all.len() {
        all[k] = SHORT_STARTS[k / 2] * shares[k % 2];
        k += 1;
    }
    all
}

/// Time constant in s with which it is found that a valve must regulate, or need not, and with which it begins, or ends.
const WAKES_WITHIN: f64 = 4e-3;

/// What the pressure does depends on every time that the valve woke, and sizes nearby are looked at as well: from one of these starts to the
/// next, in Pa.
#[rustfmt::skip]
const WAKING_STARTS: &[f64] = &[
    1.5e3, 1.8e3, 2.1e3, 2.5e3, 2.9e3, 3.4e3, 4.0e3, 4.8e3,
    5.6e3, 6.7e3, 7.9e3, 9.3e3, 1.1e4, 1.3e4, 1.5e4, 1.8e4,
];

impl ValveDeadBand {
    /// Deviation in Pa above the target below which the port for emptying does not open.
    fn overlap_of_emptying(&self) -> f64 {
        self.pressure_overlap * (1.0 + self.emptying_excess)
    }

    /// By how much in Pa an error is beyond an overlap: a hyperbola between 0 and error − overlap.
    fn opening(&self, error: f64, overlap: f64) -> f64 {
        let rounding = self.overlap_rounding * overlap;
        let rounded = |beyond: f64| 0.5 * (beyond + beyond.hypot(rounding));
        rounded(error - overlap) - rounded(-overlap)
    }

    /// The target in Pa as what is open of the ports goes for it.
    fn beyond_overlap(&self, at: &Point, target: f64) -> f64 {
        let error = target - at.gauge_pressure;
        let overlap = if error < 0.0 { self.overlap_of_emptying() } else { self.pressure_overlap };
        let beyond = self.overlap_steepness * self.opening(error.abs(), overlap);
        at.gauge_pressure + error.signum() * beyond.min(error.abs())
    }

    /// Whether a pilot that has broken loose goes on until the command turns.
    fn slides(&self) -> bool {
        self.sliding_speed < Self::default().sliding_speed
    }
}

impl Effect for ValveDeadBand {
    const DESCRIPTION: Description = Description {
        name: "valve_dead_band",
        meaning: "small changes of the command do nothing: play or stiction of the pilot",
        equation: "|u - w| <= play;  w <- u where |u - w| >= stiction, and then for as long as u keeps its direction;  dp/dt = 0 where -h (1 + a) < K w - p < h, or from |K w - p| < r H until |K w - p| > H",
        signature: "pressure residual of constant size that follows the direction of the command, or steps",
        experiment: "slow stairs and ramps of the command, up and down, with the muscle locked",
        reference: "Choudhury et al. 2005",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("valve_dead_band.play", &[0.03, 0.08, 0.15])],
            // The command was raised before the recording.
            &[("valve_dead_band.play", &[0.03, 0.08, 0.15]), ("valve_dead_band.start", &[-0.9])],
            &[("valve_dead_band.play", &[0.03, 0.08, 0.15]), ("valve_dead_band.play_spread", &[0.7])],
            &[("valve_dead_band.stiction", STICTION_STARTS)],
            &[("valve_dead_band.pressure_overlap", &[5e3])],
            &[("valve_dead_band.pressure_overlap", &[3e3, 8e3, 2e4]), ("valve_dead_band.overlap_steepness", &[10.0])],
            // Unlike ports.
            &[
                ("valve_dead_band.pressure_overlap", &[5e3, 2e4]),
                ("valve_dead_band.overlap_steepness", &[10.0]),
                ("valve_dead_band.emptying_excess", &[1.5, -0.6]),
            ],
            &[("valve_dead_band.waking", WAKING_STARTS), ("valve_dead_band.resting_share", &[0.15])],
        ],
        further_forms: &[
            &[
                ("valve_dead_band.stiction", &[0.03, 0.08, 0.15, 0.03, 0.08, 0.15, 0.03, 0.08, 0.15]),
                ("valve_dead_band.play", &[0.01, 0.01, 0.01, 0.03, 0.03, 0.03, 0.08, 0.08, 0.08]),
                ("valve_dead_band.sliding_speed", &[1e-3]),
            ],
            // A pilot that jumps to where it falls short of its command.
            &[("valve_dead_band.stiction", &shares([0.5, 0.75])), ("valve_dead_band.play", &shares([0.5, 0.25]))],
        ],
        refinements: &[
            ("valve_dead_band.start", &[0.3]),
            ("valve_dead_band.play_growth", &[0.01]),
            ("valve_dead_band.jump_time", &[2.5e-4, 5e-4, 1e-3, 2.5e-3]),
            ("valve_dead_band.overlap_rounding", &[0.5]),
        ],
    };

    /// Whether the valve is to be awake, from −1 to 1, and how far it is. Were the first also the second, half a valve would follow a slow
    /// ramp.
    const STATE_SCALES: &'static [f64] = &[100.0, 100.0];

    fn is_neutral(&self) -> bool {
        [self.play, self.play_growth, self.stiction, self.pressure_overlap, self.waking] == [0.0; 5]
    }

    fn rests(&self) -> bool {
        self.waking == 0.0
    }

    fn start(&self, _at: &Point, own: &mut [f64]) {
        own.copy_from_slice(&[-1.0, 0.0]);
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let error = (at.commanded_pressure - at.gauge_pressure).abs();
        let asked = if error > self.waking {
            1.0
        } else if error < self.resting_share * self.waking {
            -1.0
        } else {
            own[0].signum()
        };
        rates[0] = (asked - own[0]) / WAKES_WITHIN;
        rates[1] = (f64::from(own[0] > 0.0) - own[1]) / WAKES_WITHIN;
    }

    /// A pilot that sticks ends each fast move anywhere within its threshold; one that slides goes on to its end.
    fn hangs_on_chance(&self) -> bool {
        self.stiction > 0.0 && !self.slides()
    }

    /// A valve that opens no port near its target rests where it started.
    fn at_rest(self) -> Self {
        Self { pressure_overlap: 0.0, waking: 0.0, ..self }
    }

    /// Rounded edges let nothing rest off its target.
    fn rests_off(&self) -> f64 {
        if self.overlap_rounding > 0.0 {
            return 0.0;
        }
        self.start * if self.start > 0.0 { self.overlap_of_emptying() } else { self.pressure_overlap }
    }

    fn slack(&self) -> Slack {
        let Self { play, play_spread, play_growth, stiction, jump_time, sliding_speed, start, .. } = *self;
        Slack { play, play_spread, play_growth, stiction, jump_time, sliding_speed, start }
    }

    fn target_pressure(&self, at: &Point, own: &[f64], target: f64) -> f64 {
        let target = if self.pressure_overlap > 0.0 { self.beyond_overlap(at, target) } else { target };
        if self.waking > 0.0 { at.gauge_pressure + own[1] * (target - at.gauge_pressure) } else { target }
    }

    fn sentence(&self) -> String {
        let mut parts = Vec::new();
        if self.play > 0.0 || self.play_growth > 0.0 {
            let growth = match self.play_growth {
                0.0 => String::new(),
                growth => format!(" and {:.0} mV more per volt of the command", 2e3 * growth),
            };
            parts.push(format!("its pilot has a play of {:.0} mV{growth}", 2e3 * self.play));
        }
        if self.stiction > 0.0 {
            let off = if self.play > 0.0 { "beyond it by" } else { "off by" };
            let then = if self.slides() { " and slides until it turns" } else { "" };
            parts.push(format!("its pilot sticks until the command is {off} {:.0} mV{then}", 1e3 * self.stiction));
        }
        if self.pressure_overlap > 0.0 {
            let emptying = match self.emptying_excess {
                0.0 => String::new(),
                _ => format!(" where it fills and {:.3} bar where it empties", 1e-5 * self.overlap_of_emptying()),
            };
            parts.push(format!("no port opens for errors below {:.3} bar{emptying}", 1e-5 * self.pressure_overlap));
        }
        if self.waking > 0.0 {
            let [waking, rests] = [1.0, self.resting_share].map(|share| 1e-5 * share * self.waking);
            parts.push(format!("it regulates from errors of {waking:.3} bar on, down to {rests:.3} bar"));
        }
        format!("The valve ignores small changes of the command: {}.", parts.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_pilot_that_sticks_again_at_once_is_left_to_chance() {
        let of = |play, stiction, sliding_speed| {
            ValveDeadBand { play, stiction, sliding_speed, ..ValveDeadBand::default() }.hangs_on_chance()
        };
        assert!(of(0.0, 0.1, 1e9));
        assert!(!of(0.0, 0.1, 1e-3));
        assert!(!of(0.1, 0.0, 1e9));
    }
}
