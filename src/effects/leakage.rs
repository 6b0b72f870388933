use super::{AMBIENT_PRESSURE, Description, Effect, Holds, LEAST_VOLUME, Point, REFERENCE_CONTRACTION};

/// Ratio of pressures below which the flow through a hole is choked: a sharp edge.
const CRITICAL_RATIO: f64 = 0.3;
/// Pressure in Pa above the opening at which a porous wall leaks alike whatever its exponent.
const REFERENCE_PRESSURE: f64 = 2e5;
/// Contraction in m at which what a muscle loses is told beside that at its rest length.
const TOLD_CONTRACTION: f64 = 0.15;
/// Gauge pressure in Pa over which the last of the flow through a hole fades; not physical, it keeps the slope finite.
const FADE: f64 = 500.0;
/// Mean restlessness of the command in Pa up to which a valve shuts altogether, and from which it does not; and how many time constants
/// after a usual step it is so small.
const STILL: [f64; 2] = [500.0, 1000.0];
const TO_REST: f64 = 7.0;
/// Shortest time in s after which the valve shuts.
const SHORTEST: f64 = 0.01;

crate::variables::variables! {
    /// Air that is lost while the valve goes on blowing, or has shut.
    ///
    /// # Model
    /// dp/dt ← dp/dt − k ((1 − c) q (q/2 bar)^(e−1) + c (p + p_a) ψ(p)) (1 + o s) / (1 + `volume_growth` x/0.1 m), q = max(p − `opening_pressure`, 0):
    /// `rate` k, `exponent` e, `choked_share` c of the leak that is a hole and not a porous wall or a seal that pressure lifts,
    /// `opening_with_contraction` o of a tear that the growing girth opens from `opening_contraction` x_o on, s = max(x − x_o, 0)/0.1 m. ψ = 1 while
    /// the flow is choked, p_a/(p + p_a) < b = 0.3, and √(1 − ((p_a/(p + p_a) − b)/(1 − b))²) above. The pressure cannot fall below
    /// ambient. A valve that shuts where its command K u rests does nothing else, dp/dt ← 0, while m is below 5 to 10 mbar, where
    /// dr/dt = 7 (K u − r)/`shut_after` and dm/dt = 7 (|K u − r| − m)/`shut_after`.
    ///
    /// # In the data
    /// With the valve shut, the pressure decays; while it regulates, the pressure falls short by k p/ω and the response
    /// is faster than nominal, unlike with a lower gain of the valve.
    ///
    /// # Validity
    /// Isothermal; the volume of a short muscle is taken as linear in the contraction. e is 0.5 for turbulent flow through a wide gap and
    /// up to 2 for laminar flow through a narrow one.
    ///
    /// # Reference
    /// ISO 6358-1:2013 (ellipse of the flow through an orifice).
    pub struct Leakage in "leakage." as Tunable {
        /// Relative loss of pressure per time
        rate: f64 = 0.0, PER_SECOND, (0.0..=50.0);
        /// Share of the leak that is a hole, with flow in proportion to absolute pressure
        choked_share: f64 = 0.0, ONE, (0.0..=1.0);
        /// Power of the pressure in what is lost through a porous wall, 1 at 2 bar
        exponent: f64 = 1.0, ONE, (0.5..=3.0);
        /// Gauge pressure up to which a seal is tight
        opening_pressure: f64 = 0.0, PASCAL, (0.0..=1e5);
        /// Relative growth of the volume at 0.1 m of contraction
        volume_growth: f64 = 0.0, ONE, (0.0..=3.0);
        /// Relative growth of the hole per 0.1 m of contraction
        opening_with_contraction: f64 = 0.0, ONE, (0.0..=100.0);
        /// Contraction from which on the hole grows
        opening_contraction: f64 = 0.0, METRE, (0.0..=0.3);
        /// How long after a step of some bars, at rest, the valve shuts; 0 where it always regulates
        shut_after: f64 = 0.0, SECOND, (0.0..=10.0);
    }
}

/// Flow through a hole relative to the choked one, times absolute pressure in Pa.
fn hole(gauge_pressure: f64) -> f64 {
    let absolute = gauge_pressure + AMBIENT_PRESSURE;
    let ratio = AMBIENT_PRESSURE / absolute;
    let subsonic = ((ratio - CRITICAL_RATIO) / (1.0 - CRITICAL_RATIO)).max(0.0);
    absolute * (1.0 - subsonic * subsonic).max(0.0).sqrt() * gauge_pressure / (gauge_pressure + FADE)
}

impl Leakage {
    /// How far the valve is open, 0 to 1, while its command was restless by so many Pa.
    fn open(&self, restlessness: f64) -> f64 {
        let [still, moving] = STILL;
        if self.rests() { 1.0 } else { ((restlessness - still) / (moving - still)).clamp(0.0, 1.0) }
    }

    /// What is lost at a gauge pressure in Pa, in Pa: times the rate it is a loss per time.
    fn flow(&self, gauge_pressure: f64) -> f64 {
        let mut porous = (gauge_pressure - self.opening_pressure).max(0.0);
        if self.exponent != 1.0 {
            porous *= (porous / REFERENCE_PRESSURE).powf(self.exponent - 1.0).min(1e3);
        }
        if self.choked_share == 0.0 {
            return porous;
        }
        (1.0 - self.choked_share) * porous + self.choked_share * hole(gauge_pressure)
    }

    /// What is lost in Pa/s at a gauge pressure in Pa and a contraction in m.
    fn loss(&self, gauge_pressure: f64, contraction: f64) -> f64 {
        let opened = (contraction - self.opening_contraction).max(0.0) / REFERENCE_CONTRACTION;
        let opening = 1.0 + self.opening_with_contraction * opened;
        let volume = (1.0 + self.volume_growth * contraction / REFERENCE_CONTRACTION).max(LEAST_VOLUME);
        self.rate * self.flow(gauge_pressure) * opening / volume
    }
}

impl Effect for Leakage {
    const DESCRIPTION: Description = Description {
        name: "leakage",
        meaning: "pressure is lost in proportion to pressure",
        equation: "dp/dt <- dp/dt - k ((1 - c) q (q/2 bar)^(e-1) + c (p + p_a) psi(p)), q = max(p - p_o, 0), times (1 + o max(x - x_o, 0)/0.1 m)/(1 + g x/0.1 m)",
        signature: "decay with the valve shut; shortfall of the pressure while regulated, and a faster response",
        experiment: "shut the valve and watch the pressure for a minute",
        reference: "ISO 6358",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("leakage.rate", &[0.3, 1.0])],
            &[("leakage.rate", &[0.3, 1.0]), ("leakage.choked_share", &[0.5])],
            // A crack.
            &[
                ("leakage.rate", &[0.02]),
                ("leakage.opening_with_contraction", &[50.0]),
                ("leakage.opening_contraction", &[0.06, 0.1]),
            ],
            &[("leakage.rate", &[0.02]), ("leakage.shut_after", &[0.5])],
        ],
        further_forms: &[],
        refinements: &[
            ("leakage.choked_share", &[0.5]),
            ("leakage.volume_growth", &[0.3]),
            ("leakage.opening_with_contraction", &[0.5]),
            ("leakage.exponent", &[1.3]),
            ("leakage.opening_pressure", &[0.3e5]),
        ],
    };

    const STATE_SCALES: &'static [f64] = &[1e5, 1e5];

    fn is_neutral(&self) -> bool {
        self.rate == 0.0
    }

    fn rests(&self) -> bool {
        self.is_neutral() || self.shut_after == 0.0
    }

    /// It comes to rest where it does while it regulates.
    fn at_rest(self) -> Self {
        Self { shut_after: 0.0, ..self }
    }

    fn start(&self, at: &Point, own: &mut [f64]) {
        own[0] = at.commanded_pressure;
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        if !self.rests() {
            let (way, time) = (at.commanded_pressure - own[0], self.shut_after.max(SHORTEST) / TO_REST);
            rates.copy_from_slice(&[way / time, (way.abs() - own[1]) / time]);
        }
    }

    fn pressure_rate(&self, at: &Point, own: &[f64], rate: f64) -> f64 {
        if self.is_neutral() {
            return rate;
        }
        self.open(own[1]) * rate - self.loss(at.gauge_pressure.max(0.0), at.contraction)
    }

    fn sentence(&self) -> String {
        let told = |loss: f64| match loss {
            large if large >= 1e3 => format!("{:.2} bar", large * 1e-5),
            small if small >= 10.0 => format!("{:.1} mbar", small * 1e-2),
            tiny => format!("{tiny:.2} Pa"),
        };
        let at_rest_length = told(self.loss(REFERENCE_PRESSURE, 0.0));
        let shuts = match self.shut_after {
            0.0 => String::new(),
            after => format!("; its valve shuts {after:.1} s after the command came to rest"),
        };
        if self.opening_with_contraction == 0.0 && self.volume_growth == 0.0 {
            return format!("The muscle leaks: at 2 bar it loses {at_rest_length} per second{shuts}.");
        }
        let contracted = told(self.loss(REFERENCE_PRESSURE, TOLD_CONTRACTION));
        format!(
            "The muscle leaks: at 2 bar it loses {at_rest_length} per second at its rest length and {contracted} at {:.0} cm of contraction{shuts}.",
            100.0 * TOLD_CONTRACTION
        )
    }
}
