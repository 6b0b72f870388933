use super::{Description, Effect, Holds, Point};

crate::variables::variables! {
    /// A valve of second order, which overshoots.
    ///
    /// # Model
    /// d²q/dt² = ω² e (1 + k tanh(|e|/1 bar)) − 2 ζ ω dq/dt, e = p_target − q, in place of the first-order valve:
    /// `natural_frequency` ω, `damping_ratio` ζ, `stiffening` k with the size of the error. While q falls, what damps dq/dt is
    /// 1 + `emptying_excess` times as large. There is no resonance at ω = 0. A regulator with a proportional part acts on the error by the share l of its damping: 2 ζ ω l dp_target/dt more, `lead` l; from l = 1 on nothing else damps it, and it is proportional and integral. The pressure is q itself, or follows it as a main stage follows its pilot, τ dp/dt = q − p, `main_stage` τ.
    ///
    /// # In the data
    /// The pressure rings after a step; its gain exceeds one near ω.
    ///
    /// # Validity
    /// 15 to 100 rad/s and 0.3 to 0.8 are usual; beyond, nothing rings: a regulator whose integral part dominates overshoots once, anything else is a
    /// valve with a lag. Bandwidth and lag of the first-order valve mean nothing while it acts.
    ///
    /// # Reference
    /// Second-order models of proportional valves, e.g. manufacturers' frequency responses; definition.
    pub struct ValveResonance in "valve_resonance." as Tunable {
        /// Natural frequency of the valve; zero where it is of first order
        natural_frequency: f64 = 0.0, RADIAN_PER_SECOND, (0.0..=500.0);
        /// Damping ratio
        damping_ratio: f64 = 0.4, ONE, (0.02..=0.8);
        /// Relative excess of the damping while emptying
        emptying_excess: f64 = 0.0, ONE, (-0.9..=5.0);
        /// Relative growth of the stiffness with errors far beyond 1 bar
        stiffening: f64 = 0.0, ONE, (-0.5..=2.0);
        /// Share of the damping that acts on the error and not on the pressure, as the proportional part of a regulator does; from 1 on all does
        lead: f64 = 0.0, ONE, (0.0..=10.0);
        /// Time constant of a main stage behind the pilot that rings; none at zero
        main_stage: f64 = 0.0, SECOND, (0.0..=1.0);
    }
}

/// Overshoot of a step below which it is a valve with a lag: that of one that rings with a damping ratio of 0.8.
const LEAST_OVERSHOOT: f64 = 0.015;

/// Natural frequency in rad/s from which on no proportional valve rings; what is fitted then is no ringing, but how fast its main stage is.
const FASTEST: f64 = 150.0;

/// Time constant in s below which a main stage shows nothing.
const SHORTEST: f64 = 1e-3;

/// Error in Pa at which most of the stiffening has come.
const LARGE_ERROR: f64 = 1e5;

impl ValveResonance {
    /// Error of the pilot in Pa.
    fn error(&self, at: &Point, own: &[f64]) -> f64 {
        at.target_pressure - at.gauge_pressure - own[1]
    }

    /// Rate of the pilot in Pa/s: the integrated part, and the proportional one.
    fn pilot_rate(&self, at: &Point, own: &[f64]) -> f64 {
        own[0] + 2.0 * self.damping_ratio * self.natural_frequency * self.lead * self.error(at, own)
    }

    /// Damping ratio of the whole, which is larger where the proportional part is more than all.
    fn whole_damping(&self) -> f64 {
        self.damping_ratio * self.lead.max(1.0)
    }

    /// By which share of a small step the pilot overshoots: the error then has ë + 2 ζ ω ė + ω² e = 0, from e = 1 and ė = −2 ζ ω l, with the
    /// damping ratio of the whole.
    fn overshoot(&self) -> f64 {
        let (damping, first_rate) = (self.whole_damping(), 2.0 * self.damping_ratio * self.lead);
        // In units of 1/ω; two equal roots are told apart a little.
        let root = (damping.powi(2) - 1.0).abs().max(1e-6).sqrt();
        if damping < 1.0 {
            let sine = (damping - first_rate) / root;
            let angle = std::f64::consts::PI - first_rate.atan2(damping * sine + root);
            return -(-damping / root * angle).exp() * (angle.cos() + sine * angle.sin());
        }
        let (slow, fast) = (damping - root, damping + root);
        let of_slow = (fast - first_rate) / (fast - slow);
        if of_slow >= 0.0 {
            return 0.0;
        }
        let turn = ((1.0 - of_slow) * fast / (-of_slow * slow)).ln() / (fast - slow);
        -of_slow * (-slow * turn).exp() * (1.0 - slow / fast)
    }
}

impl Effect for ValveResonance {
    const DESCRIPTION: Description = Description {
        name: "valve_resonance",
        meaning: "the valve is of second order and overshoots",
        equation: "d2q/dt2 = w^2 e - 2 zeta w (dq/dt - l d(p_target)/dt), e = p_target - q;  p = q, or tau dp/dt = q - p",
        signature: "overshoot and ringing of the pressure after steps",
        experiment: "steps, and sines of two amplitudes around the natural frequency",
        reference: "definition",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("valve_resonance.damping_ratio", &[0.3, 0.5]), ("valve_resonance.natural_frequency", &[20.0, 35.0])],
            &[
                ("valve_resonance.damping_ratio", &[0.2, 0.4]),
                ("valve_resonance.natural_frequency", &[20.0, 35.0]),
                ("valve_resonance.main_stage", &[0.06]),
            ],
            // A regulator that is proportional and integral.
            &[
                ("valve_resonance.damping_ratio", &[0.5]),
                ("valve_resonance.natural_frequency", &[5.0]),
                ("valve_resonance.lead", &[3.0]),
            ],
        ],
        further_forms: &[],
        refinements: &[
            ("valve_resonance.stiffening", &[0.2]),
            ("valve_resonance.lead", &[0.5]),
            ("valve_resonance.emptying_excess", &[0.3]),
        ],
    };
    // Integrated rate of the pilot, and how far it is ahead of the pressure.
    const STATE_SCALES: &'static [f64] = &[1e6, 1e4];

    fn is_neutral(&self) -> bool {
        self.natural_frequency == 0.0
    }

    fn is_plausible(&self) -> bool {
        self.is_neutral() || self.overshoot() > LEAST_OVERSHOOT && self.natural_frequency < FASTEST
    }

    /// A valve that rings comes to rest where one of first order does.
    fn at_rest(self) -> Self {
        Self::default()
    }

    /// It takes the place of the valve of first order.
    fn lateness(&self, bandwidth: f64) -> f64 {
        if self.is_neutral() {
            return 0.0;
        }
        let of_pilot = 2.0 * self.damping_ratio * (1.0 - self.lead) / self.natural_frequency;
        (of_pilot + self.main_stage - 1.0 / bandwidth).max(0.0)
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let (frequency, rate) = (self.natural_frequency, self.pilot_rate(at, own));
        let mut error = self.error(at, own);
        if self.stiffening != 0.0 {
            error *= 1.0 + self.stiffening * (error.abs() / LARGE_ERROR).tanh();
        }
        let emptying = if rate < 0.0 { 1.0 + self.emptying_excess } else { 1.0 };
        rates[0] =
            frequency * (frequency * error - 2.0 * self.damping_ratio * emptying * (1.0 - self.lead).max(0.0) * rate);
        rates[1] = if self.main_stage < SHORTEST { 0.0 } else { rate - own[1] / self.main_stage };
    }

    fn pressure_rate(&self, at: &Point, own: &[f64], rate: f64) -> f64 {
        if self.is_neutral() {
            return rate;
        }
        if self.main_stage < SHORTEST { self.pilot_rate(at, own) } else { own[1] / self.main_stage }
    }

    fn sentence(&self) -> String {
        let (damping, overshoot) = (self.whole_damping(), 100.0 * self.overshoot());
        let then = if damping < 1.0 {
            format!(
                "rings at {:.1} Hz",
                self.natural_frequency * (1.0 - damping.powi(2)).sqrt() / std::f64::consts::TAU
            )
        } else {
            let slow = self.natural_frequency * (damping - (damping.powi(2) - 1.0).sqrt());
            format!("comes back with a time constant of {:.2} s", 1.0 / slow)
        };
        format!("The valve overshoots by {overshoot:.0} % of a step and {then}.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The overshoot of ë + 2 ζ ė + e = 0 from e = 1, ė = −r by the method of Heun with small steps.
    fn simulated(damping: f64, first_rate: f64) -> f64 {
        let (mut error, mut rate, mut least) = (1.0, -first_rate, 0.0_f64);
        let step = 1e-4;
        for _ in 0..2_000_000 {
            let next_rate = rate - step * (2.0 * damping * rate + error);
            let next = error + step * rate;
            rate -= 0.5 * step * (2.0 * damping * (rate + next_rate) + error + next);
            error += 0.5 * step * (2.0 * next_rate + step * (2.0 * damping * next_rate + next));
            least = least.min(error);
        }
        -least
    }

    #[test]
    fn overshoot_is_that_of_a_simulated_step() {
        for (damping, lead) in [(0.3, 0.0), (0.8, 0.0), (0.4, 0.7), (0.8, 1.0), (0.5, 2.0), (0.77, 2.0), (0.3, 10.0)] {
            let valve =
                ValveResonance { damping_ratio: damping, lead, natural_frequency: 20.0, ..ValveResonance::default() };
            let (own, other) = (valve.overshoot(), simulated(valve.whole_damping(), 2.0 * damping * lead));
            assert!((own - other).abs() < 1e-3, "{damping} {lead}: {own} {other}");
        }
    }
}
