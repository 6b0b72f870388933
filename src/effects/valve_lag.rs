use super::{Description, Effect, Holds, Point};
use std::fmt::Write;

/// The time constant stays above this share of what it is at the reference pressure.
const LEAST_SHARE: f64 = 0.05;

/// Shortest time constant of a pole of its own, s: no sample shows less, and it keeps the integrator from tiny steps.
const SHORTEST: f64 = 1e-3;

/// What comes out of a pole with so long a time constant: of a shorter one than the shortest, as much of that as delays by it, so that a
/// fit finds its way back from there.
fn passed(input: f64, own: f64, time_constant: f64) -> f64 {
    let share = (time_constant / SHORTEST).min(1.0);
    if share == 1.0 { own } else { input + share * (own - input) }
}

crate::variables::variables! {
    /// A valve that follows more slowly than nominal.
    ///
    /// # Model
    /// 1/ω ← 1/ω + τ (1 + g (p/p₀ − 1) + h x/0.1 m), times 1 + e while emptying: `time_constant` τ of a long muscle at
    /// p₀ = 2 bar, its `growth_with_pressure` g and, with the volume, `growth_with_contraction` h, `emptying_excess` e; of a pilot that
    /// opens little for small errors times 1 + n/(1 + |p_target − p|/pₙ), `excess_near_target` n, `near_target` pₙ. A
    /// hose or pilot stage before the valve is a pole of its own: τ₂ dq/dt = p_target − q, and the valve goes for q:
    /// `second_time_constant` τ₂; with both, one after the other, `third_time_constant` τ₃. Where only a `second_share` c of the way takes the
    /// second pole, as of a stage that is adjusted slowly, the valve goes for p_target + c (q − p_target).
    ///
    /// # In the data
    /// The pressure residual is in proportion to the rate of pressure and vanishes when the command is slow; steps of
    /// several sizes separate it from a dead time (whose onset shifts) and from a rate limit (large steps only).
    ///
    /// # Validity
    /// The time constant is kept above 5 % of its value at 2 bar. A pole of its own below 1 ms is one of 1 ms that lets the rest
    /// through, so that the mean delay is the same. These poles start settled at the first pressure.
    ///
    /// # Reference
    /// Thesis eq. 5.3.
    pub struct ValveLag in "valve_lag." as Tunable {
        /// Time constant beyond the nominal one, at 2 bar
        time_constant: f64 = 0.0, SECOND, (0.0..=10.0);
        /// Time constant of a second pole before the valve
        second_time_constant: f64 = 0.0, SECOND, (0.0..=10.0);
        /// Share of the way that the second pole delays
        second_share: f64 = 1.0, ONE, (0.0..=1.0);
        /// Time constant of a third pole, after the second
        third_time_constant: f64 = 0.0, SECOND, (0.0..=10.0);
        /// Relative change of the additional time constant from 0 to 2 bar
        growth_with_pressure: f64 = 0.0, ONE, (-0.9..=3.0);
        /// Relative change of the additional time constant from 0 to 0.1 m of contraction
        growth_with_contraction: f64 = 0.0, ONE, (-0.9..=5.0);
        /// Relative excess of the additional time constant while emptying
        emptying_excess: f64 = 0.0, ONE, (-0.9..=5.0);
        /// Relative excess of the additional time constant at the target
        excess_near_target: f64 = 0.0, ONE, (0.0..=20.0);
        /// Missing pressure at which half of that excess is gone
        near_target: f64 = 2e4, PASCAL, (5e2..=5e5);
    }
}

impl ValveLag {
    /// Gauge pressure in Pa behind the second pole.
    fn behind_second(&self, target: f64, own: &[f64]) -> f64 {
        if self.second_time_constant == 0.0 {
            return target; // (1 - c) p + c p need not be p to the last bit
        }
        (1.0 - self.second_share) * target + self.second_share * passed(target, own[0], self.second_time_constant)
    }
}

impl Effect for ValveLag {
    const DESCRIPTION: Description = Description {
        name: "valve_lag",
        meaning: "the valve is slower than nominal",
        equation: "1/w <- 1/w + tau (1 + g (p/p0 - 1) + h x/0.1 m) (1 + n/(1 + |p_target - p|/p_n));  tau2 dq/dt = p_target - q;  tau3 dr/dt = q - r",
        signature: "pressure residual in proportion to the rate of pressure, gone when slow",
        experiment: "steps of several sizes with pressure recorded",
        reference: "thesis eq. 5.3",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("valve_lag.time_constant", &[0.05])],
            &[("valve_lag.second_time_constant", &[0.05])],
            &[
                ("valve_lag.time_constant", &[0.03]),
                ("valve_lag.excess_near_target", &[1.5]),
                ("valve_lag.near_target", &[2e4]),
            ],
        ],
        further_forms: &[&[
            ("valve_lag.second_time_constant", &[0.3, 1.0]),
            ("valve_lag.second_share", &[0.1]),
            ("valve_lag.time_constant", &[0.0]),
        ]],
        refinements: &[
            ("valve_lag.time_constant", &[0.02]),
            ("valve_lag.second_time_constant", &[0.02]),
            ("valve_lag.third_time_constant", &[0.02]),
            ("valve_lag.growth_with_pressure", &[0.2, -0.2]),
            ("valve_lag.emptying_excess", &[0.2]),
            ("valve_lag.growth_with_contraction", &[0.3]),
        ],
    };
    const ENDS_INSIDE: &'static [&'static str] = &["valve_lag.near_target"];
    const STATE_SCALES: &'static [f64] = &[1e5, 1e5];

    fn is_neutral(&self) -> bool {
        self.time_constant == 0.0 && self.second_time_constant == 0.0 && self.third_time_constant == 0.0
    }

    fn rests(&self) -> bool {
        self.second_time_constant == 0.0 && self.third_time_constant == 0.0
    }

    /// A delay before the valve does not change where it comes to rest.
    fn at_rest(self) -> Self {
        Self { second_time_constant: 0.0, third_time_constant: 0.0, ..self }
    }

    fn lateness(&self, _bandwidth: f64) -> f64 {
        self.second_share * self.second_time_constant + self.third_time_constant
    }

    fn start(&self, at: &Point, own: &mut [f64]) {
        own.fill(at.gauge_pressure);
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let second = self.behind_second(at.commanded_pressure, own);
        if self.second_time_constant > 0.0 {
            rates[0] = (at.commanded_pressure - own[0]) / self.second_time_constant.max(SHORTEST);
        }
        if self.third_time_constant > 0.0 {
            rates[1] = (second - own[1]) / self.third_time_constant.max(SHORTEST);
        }
    }

    fn target_pressure(&self, _at: &Point, own: &[f64], target: f64) -> f64 {
        let second = self.behind_second(target, own);
        passed(second, own[1], self.third_time_constant)
    }

    fn valve_bandwidth(&self, at: &Point, bandwidth: f64) -> f64 {
        if self.time_constant == 0.0 {
            return bandwidth; // 1/(1/w) need not be w to the last bit
        }
        let with_pressure = self.growth_with_pressure * (at.relative_pressure() - 1.0);
        let with_contraction = self.growth_with_contraction * at.relative_contraction();
        let growth = (1.0 + with_pressure + with_contraction).max(LEAST_SHARE);
        let missing = at.target_pressure - at.gauge_pressure;
        let emptying = if missing < 0.0 { 1.0 + self.emptying_excess } else { 1.0 };
        let near_target = 1.0 + self.excess_near_target / (1.0 + missing.abs() / self.near_target);
        1.0 / (1.0 / bandwidth + self.time_constant * growth * emptying * near_target)
    }

    fn sentence(&self) -> String {
        let mut longer = format!("its time constant is {:.0} ms longer", 1e3 * self.time_constant);
        if self.excess_near_target > 0.0 {
            let _ = write!(
                longer,
                ", {:.0} ms near its target",
                1e3 * self.time_constant * (1.0 + self.excess_near_target)
            );
        }
        let before =
            |what: &str, time: f64| format!("a {what} delay of first order, {:.0} ms, comes before it", 1e3 * time);
        let mut second = before("second", self.second_time_constant);
        if self.second_share < 1.0 {
            let _ = write!(second, " for {:.1} % of the way", 100.0 * self.second_share);
        }
        let parts = [
            (self.time_constant, longer),
            (self.second_time_constant, second),
            (self.third_time_constant, before("third", self.third_time_constant)),
        ];
        let said: Vec<String> = parts.into_iter().filter(|(time, _)| *time != 0.0).map(|(_, words)| words).collect();
        format!("The valve is slower than nominal: {}.", said.join(", and "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pole_is_late_by_its_time_constant_on_a_ramp_however_short_it_is() {
        for time_constant in [0.0, 2e-4, SHORTEST, 0.05] {
            let (now, settled) = (3.0, time_constant.max(SHORTEST));
            let out = passed(now, now - settled, time_constant);
            assert!((now - out - time_constant).abs() < 1e-12, "{time_constant}");
        }
    }
}
