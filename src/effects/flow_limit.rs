use super::{
    AMBIENT_PRESSURE, Description, Effect, Holds, LEAST_VOLUME, Point, REFERENCE_CONTRACTION, REFERENCE_PRESSURE,
};

/// Rate in Pa/s from which on there is no limit.
const NONE: f64 = 1e9;
/// Pressure in Pa from which on a supply counts as unlimited.
const NO_SUPPLY: f64 = 1e8;

crate::variables::variables! {
    /// Filling and emptying that are limited in rate.
    ///
    /// # Model
    /// The rate r of pressure becomes r / (1 + |r/m|ⁿ)^(1/n), n = 1/`roundness`; for zero roundness it is clipped at m.
    /// The limit m is `filling` or `emptying`; the latter changes with absolute pressure by the share
    /// `emptying_with_pressure` c, m (1 − c + c (p + 1 bar)/3 bar), and both shrink with the volume V, m V₀/V,
    /// V/V₀ = 1 + g y (1 − h y), y = x/0.1 m, `volume_growth` g, `volume_bend` h, and grow with what is missing,
    /// m (|p_target − p|/1 bar)^e, `exponent` e. Where the pressure p_s of the supply is known, `supply_pressure`, filling fades
    /// towards it by ψ(p/p_s), absolute, and emptying is in proportion to absolute pressure and fades towards the ambient one by
    /// ψ(p_0/p): ψ(r) = √(1 − ((r − b)/(1 − b))²) above `critical_ratio` b, 1 below. What is limited is a flow of mass: where the
    /// muscle moves, κ (p + 1 bar) dV/dt / V of it only keeps the pressure, `polytropic_exponent` κ; for none, r alone is limited.
    ///
    /// # In the data
    /// After large steps the pressure rises along a ramp whose slope does not depend on the size of the step, and falls
    /// along another; small steps are as nominal.
    ///
    /// # Validity
    /// A stand-in for ISO 6358: choked inflow gives a constant rate, choked outflow one in proportion to absolute
    /// pressure; the roundness in between is no physical constant. With a pressure of the supply it is the standard itself for a muscle that
    /// rests, and for one that moves with the exponent of its air, 1 isothermal; of other air the rates hold only nearly. The limits are
    /// those of a muscle at its initial length. A long narrow hose with turbulent flow lets through what goes with the root of the difference in
    /// pressure, `exponent` 0.5.
    ///
    /// # Reference
    /// ISO 6358-1:2013, Pneumatic fluid power; deviation: rates instead of conductances.
    pub struct FlowLimit in "flow_limit." as Tunable {
        /// Largest rate of filling; there is no limit at the largest value
        filling: f64 = NONE, PASCAL_PER_SECOND, (1e3..=NONE);
        /// Largest rate of emptying, at 2 bar; there is no limit at the largest value
        emptying: f64 = NONE, PASCAL_PER_SECOND, (1e3..=NONE);
        /// How gently the limit sets in: 0 at once, 0.5 as a square root
        roundness: f64 = 0.0, ONE, (0.0..=1.0);
        /// Share of the emptying that is in proportion to absolute pressure
        emptying_with_pressure: f64 = 0.0, ONE, (0.0..=1.0);
        /// Relative growth of the volume at 0.1 m of contraction along its slope at rest
        volume_growth: f64 = 0.0, ONE, (0.0..=10.0);
        /// By which share it grows less than along a straight line there
        volume_bend: f64 = 0.0, ONE, (0.0..=1.0);
        /// Polytropic exponent of the air that the muscle displaces as it moves; that needs no flow for 0
        polytropic_exponent: f64 = 0.0, ONE, (0.0..=2.0);
        /// Power of the missing pressure, in bar, with which the limits grow
        exponent: f64 = 0.0, ONE, (0.0..=1.0);
        /// Gauge pressure of the supply; the flow does not fade towards it at the largest value
        supply_pressure: f64 = NO_SUPPLY, PASCAL, (2e5..=NO_SUPPLY);
        /// Ratio of pressures below which the flow is choked
        critical_ratio: f64 = 0.3, ONE, (0.05..=0.9);
    }
}

/// Power of the missing pressure from which on what is limited goes with it nearly as in a valve of first order, as in laminar flow: that is a
/// lag.
const LAMINAR: f64 = 0.9;
/// Pressure in Pa that is taken to be missing at least; not physical, it keeps a limit that goes with it above zero.
const LEAST_MISSING: f64 = 10.0;
/// Share of the choked flow that there is at least; not physical, it keeps a limit above zero.
const LEAST_SHARE: f64 = 1e-3;

impl FlowLimit {
    fn limit(&self, at: &Point, rate: f64) -> f64 {
        let absolute = at.gauge_pressure + AMBIENT_PRESSURE;
        let relative = absolute / (REFERENCE_PRESSURE + AMBIENT_PRESSURE);
        let is_nozzle = self.supply_pressure < NO_SUPPLY;
        let most = match (rate > 0.0, is_nozzle) {
            (true, true) => self.filling * self.share_of_choked(absolute / (self.supply_pressure + AMBIENT_PRESSURE)),
            (true, false) => self.filling,
            (false, true) => self.emptying * relative * self.share_of_choked(AMBIENT_PRESSURE / absolute),
            (false, false) => self.emptying * (1.0 + self.emptying_with_pressure * (relative - 1.0)),
        };
        let most = most / self.volume(at).0;
        if self.exponent == 0.0 {
            return most;
        }
        let missing = (at.target_pressure - at.gauge_pressure).abs() + LEAST_MISSING;
        most * (missing / 1e5).powf(self.exponent)
    }

    /// Rate in Pa/s that the flow must make up for because the volume grows.
    fn displaced(&self, at: &Point) -> f64 {
        let (volume, slope) = self.volume(at);
        let growth = slope / volume * at.contraction_velocity;
        self.polytropic_exponent * (at.gauge_pressure + AMBIENT_PRESSURE) * growth
    }

    /// Volume relative to that at rest, and what it grows by per metre of contraction.
    fn volume(&self, at: &Point) -> (f64, f64) {
        let contraction = at.relative_contraction();
        let bend = self.volume_bend * contraction;
        let volume = 1.0 + self.volume_growth * contraction * (1.0 - bend);
        if volume < LEAST_VOLUME {
            return (LEAST_VOLUME, 0.0);
        }
        (volume, self.volume_growth * (1.0 - 2.0 * bend) / REFERENCE_CONTRACTION)
    }

    fn limited(&self, at: &Point, rate: f64) -> f64 {
        let most = self.limit(at, rate);
        // Below 1 % roundness nobody could tell the curve from the corner.
        if self.roundness < 0.01 {
            return rate.max(-most).min(most);
        }
        let excess = (rate / most).abs();
        if self.roundness == 0.5 {
            return rate / (1.0 + excess * excess).sqrt();
        }
        rate / (1.0 + excess.powf(1.0 / self.roundness)).powf(self.roundness)
    }

    /// Flow through a nozzle at a ratio of absolute pressures, as a share of what flows when choked.
    fn share_of_choked(&self, ratio: f64) -> f64 {
        let beyond = (ratio - self.critical_ratio) / (1.0 - self.critical_ratio);
        (1.0 - beyond.clamp(0.0, 1.0).powi(2)).sqrt().max(LEAST_SHARE)
    }
}

impl Effect for FlowLimit {
    const DESCRIPTION: Description = Description {
        name: "flow_limit",
        meaning: "filling and emptying are limited in rate",
        equation: "r + d <- (r + d)/(1 + |(r + d)/m|^n)^(1/n),  m = filling or emptying, times V0/V;  d = kappa (p + p_a) dV/dt / V",
        signature: "ramps of the pressure after large steps, unlike up and down; small steps as nominal",
        experiment: "steps of several sizes, up and down",
        reference: "ISO 6358",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("flow_limit.filling", &[0.5e5, 1.2e5, 3e5]), ("flow_limit.emptying", &[0.5e5, 1.2e5, 3e5])],
            &[
                ("flow_limit.filling", &[0.5e5, 1.2e5, 3e5]),
                ("flow_limit.emptying", &[0.5e5, 1.2e5, 3e5]),
                ("flow_limit.roundness", &[0.5]),
            ],
            &[
                ("flow_limit.filling", &[0.5e5, 1.2e5, 3e5]),
                ("flow_limit.emptying", &[0.5e5, 1.2e5, 3e5]),
                ("flow_limit.roundness", &[0.5]),
                ("flow_limit.exponent", &[0.5]),
            ],
            &[
                ("flow_limit.filling", &[0.5e5, 1.2e5, 3e5]),
                ("flow_limit.emptying", &[0.5e5, 1.2e5, 3e5]),
                ("flow_limit.supply_pressure", &[5e5]),
                ("flow_limit.critical_ratio", &[0.3]),
            ],
        ],
        further_forms: &[],
        refinements: &[
            ("flow_limit.roundness", &[0.3]),
            ("flow_limit.emptying_with_pressure", &[0.3]),
            ("flow_limit.volume_growth", &[0.5]),
            ("flow_limit.volume_bend", &[0.1]),
            ("flow_limit.polytropic_exponent", &[1.2]),
            ("flow_limit.exponent", &[0.3]),
        ],
    };
    const ENDS_INSIDE: &'static [&'static str] = &["flow_limit.critical_ratio"];

    fn is_neutral(&self) -> bool {
        self.filling >= NONE && self.emptying >= NONE
    }

    fn is_plausible(&self) -> bool {
        self.exponent < LAMINAR
    }

    fn pressure_rate(&self, at: &Point, _own: &[f64], rate: f64) -> f64 {
        if self.is_neutral() {
            return rate;
        }
        let displaced = self.displaced(at);
        self.limited(at, rate + displaced) - displaced
    }

    fn sentence(&self) -> String {
        let say = |rate: f64| {
            if rate >= NONE { "without limit".to_owned() } else { format!("at most {:.2} bar/s", rate * 1e-5) }
        };
        format!("The muscle fills {} and empties {}.", say(self.filling), say(self.emptying))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_with_the_missing_pressure_is_a_lag() {
        let hose =
            |exponent| FlowLimit { filling: 1e5, emptying: 1e5, roundness: 1.0, exponent, ..FlowLimit::default() };
        assert!(hose(0.0).is_plausible() && hose(0.57).is_plausible() && !hose(1.0).is_plausible());
        // r/(1 + r/(m e)) with r = w e is in proportion to the error e.
        let rate_at = |missing: f64| {
            let at = Point { target_pressure: 2e5 + missing, gauge_pressure: 2e5, ..Point::default() };
            hose(1.0).limited(&at, 15.0 * missing)
        };
        assert!((rate_at(1e5) / rate_at(1e4) - 10.0).abs() < 1e-2);
    }
}
