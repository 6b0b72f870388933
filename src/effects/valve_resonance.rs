use super::{Description, Effect, Holds, Point};

crate::variables::variables! {
    /// A valve of second order, which overshoots.
    ///
    /// # Model
    /// d²q/dt² = ω² e (1 + k tanh(|e|/1 bar)) − 2 ζ ω dq/dt, e = p_target − q, in place of the first-order valve:
    /// `natural_frequency` ω, `damping_ratio` ζ, `stiffening` k with the size of the error. While q falls, what damps dq/dt is
    /// 1 + `emptying_excess` times as large. There is no resonance at ω = 0. A regulator with a proportional part acts on the error by the share l of its damping: 2 ζ ω l dp_target/dt more, `lead` l. The pressure is q itself, or follows it as a main stage follows its pilot, τ dp/dt = q − p, `main_stage` τ.
    ///
    /// # In the data
    /// The pressure rings after a step; its gain exceeds one near ω.
    ///
    /// # Validity
    /// 15 to 100 rad/s and 0.3 to 0.8 are usual; beyond, nothing rings, and the valve is one with a lag. Bandwidth and lag of the first-order valve mean nothing while it acts.
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
        /// Share of the damping that acts on the error and not on the pressure, as the proportional part of a regulator does
        lead: f64 = 0.0, ONE, (0.0..=1.0);
        /// Time constant of a main stage behind the pilot that rings; none at zero
        main_stage: f64 = 0.0, SECOND, (0.0..=1.0);
    }
}

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

    /// A valve that rings comes to rest where one of first order does.
    fn at_rest(self) -> Self {
        Self::default()
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let (frequency, rate) = (self.natural_frequency, self.pilot_rate(at, own));
        let mut error = self.error(at, own);
        if self.stiffening != 0.0 {
            error *= 1.0 + self.stiffening * (error.abs() / LARGE_ERROR).tanh();
        }
        let emptying = if rate < 0.0 { 1.0 + self.emptying_excess } else { 1.0 };
        rates[0] = frequency * (frequency * error - 2.0 * self.damping_ratio * emptying * (1.0 - self.lead) * rate);
        rates[1] = if self.main_stage < SHORTEST { 0.0 } else { rate - own[1] / self.main_stage };
    }

    fn pressure_rate(&self, at: &Point, own: &[f64], rate: f64) -> f64 {
        if self.is_neutral() {
            return rate;
        }
        if self.main_stage < SHORTEST { self.pilot_rate(at, own) } else { own[1] / self.main_stage }
    }

    fn sentence(&self) -> String {
        let overshoot =
            100.0 * (-std::f64::consts::PI * self.damping_ratio / (1.0 - self.damping_ratio.powi(2)).sqrt()).exp();
        format!(
            "The valve overshoots by {overshoot:.0} % of a step and rings at {:.1} Hz.",
            self.natural_frequency * (1.0 - self.damping_ratio.powi(2)).sqrt() / std::f64::consts::TAU
        )
    }
}
