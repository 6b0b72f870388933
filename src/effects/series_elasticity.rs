use super::{Description, Effect, Holds, Point, REFERENCE_FORCE, Readings, not_zero};

crate::variables::variables! {
    /// Something in series with the muscle that stretches: a cable, a fitting, the frame.
    ///
    /// # Model
    /// Between muscle and load: the load moves by x, the muscle contracts by x + c F₀ g(F) with F₀ = 400 N and a pull
    /// F > 0 in the cable; the position sensor shows x. Beside the path of the load, where the frame that carries the sensor gives way:
    /// x_measured ← x + s F₀ g(F). `load_compliance` c, `compliance` s of either sign; g(F) = ((F + F₁)ᵉ − F₁ᵉ)/((F₀ + F₁)ᵉ − F₁ᵉ),
    /// `exponent` e below 1 for a cable that hardens beyond a `toe_force` F₁: the smaller e, the sooner, as a logarithm for 0 and to an
    /// end below.
    ///
    /// # In the data
    /// The residual of the contraction is in proportion to the force; a load behind a cable also swings more slowly. A
    /// stiffer or softer bladder does not depend on pressure with the length locked; an elastic cable does.
    ///
    /// # Validity
    /// A cable without mass that pulls and does not push, but for a millisecond in which it goes slack. It loses as much as a damper of
    /// 0.5 ms times its stiffness, or, where that is more, of 3 ms times its stiffness less the nominal damping of the muscle. The
    /// muscle moves by itself: its damping, friction and creep are of its own contraction. 10⁵ to 10⁶ N/m are usual stiffnesses.
    ///
    /// # Reference
    /// Hooke's law; power law of strands that are taut one after the other.
    pub struct SeriesElasticity in "series_elasticity." as Tunable {
        /// Reading per pull, at 400 N
        compliance: f64 = 0.0, METRE_PER_NEWTON, (-1e-4..=1e-4);
        /// Stretch per pull, at 400 N, of what is between the muscle and its load
        load_compliance: f64 = 0.0, METRE_PER_NEWTON, (0.0..=1e-4);
        /// Power of the pull with which it stretches
        exponent: f64 = 1.0, ONE, (-3.0..=3.0);
        /// Pull beyond which it hardens
        toe_force: f64 = 10.0, NEWTON, (10.0..=MOST_TOE);
    }
}

/// Tension in N up to which a cable goes on as it is when slack: with a tension below zero for its slack the muscle has a state there, too.
const NEARLY_SLACK: f64 = 1.0;
/// Toe force in N from which on nothing is loaded beyond it.
const MOST_TOE: f64 = 5e3;

impl SeriesElasticity {
    /// Way in m that gives way at a pull in N, for a compliance in m/N, and how much more it gives way per N there.
    fn way(&self, compliance: f64, force: f64) -> (f64, f64) {
        if self.exponent == 1.0 || compliance == 0.0 {
            return (compliance * force, compliance);
        }
        let whole = compliance * REFERENCE_FORCE;
        let (course, slope) = self.course(force.max(0.0));
        (whole * course, whole * slope)
    }

    /// Way at a pull in N relative to that at the reference, and its slope in 1/N.
    fn course(&self, force: f64) -> (f64, f64) {
        let exponent = not_zero(self.exponent);
        let grown = |force: f64| (exponent * (force / self.toe_force).ln_1p()).exp_m1();
        let (here, whole) = (grown(force), grown(REFERENCE_FORCE));
        (here / whole, exponent * (1.0 + here) / (whole * (self.toe_force + force)))
    }
}

impl Effect for SeriesElasticity {
    const DESCRIPTION: Description = Description {
        name: "series_elasticity",
        meaning: "cable, fitting or frame stretches with force",
        equation: "x_muscle <- x + c F0 g(F);  x_measured <- x + s F0 g(F);  g = ((F + F1)^e - F1^e)/((F0 + F1)^e - F1^e)",
        signature: "residual of the contraction in proportion to the force",
        experiment: "lock the load and vary the pressure",
        reference: "Hooke",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("series_elasticity.load_compliance", &[5e-6])],
            &[("series_elasticity.compliance", &[-5e-6, 5e-6])],
            &[
                ("series_elasticity.load_compliance", &[5e-6]),
                ("series_elasticity.exponent", &[0.0]),
                ("series_elasticity.toe_force", &[100.0]),
            ],
            &[
                ("series_elasticity.compliance", &[-5e-6, 5e-6]),
                ("series_elasticity.exponent", &[0.0]),
                ("series_elasticity.toe_force", &[100.0]),
            ],
        ],
        further_forms: &[],
        refinements: &[("series_elasticity.exponent", &[0.8]), ("series_elasticity.toe_force", &[100.0])],
    };

    /// Tension of what stretches between muscle and load: at 10⁵ N/m it moves the load by the contraction's scale.
    const STATE_SCALES: &'static [f64] = &[1e4];

    fn is_neutral(&self) -> bool {
        self.compliance == 0.0 && self.load_compliance == 0.0
    }

    fn is_plausible(&self) -> bool {
        self.toe_force < MOST_TOE
    }

    fn rests(&self) -> bool {
        self.load_compliance == 0.0
    }

    fn start(&self, at: &Point, own: &mut [f64]) {
        own[0] = at.tension;
    }

    fn rates(&self, at: &Point, _own: &[f64], rates: &mut [f64]) {
        rates[0] = at.tension_rate;
    }

    fn tension(&self, own: &[f64]) -> Option<f64> {
        (!self.rests()).then(|| own[0])
    }

    fn stretch(&self, tension: f64) -> (f64, f64) {
        if tension >= NEARLY_SLACK {
            return self.way(self.load_compliance, tension);
        }
        let compliance = self.way(self.load_compliance, NEARLY_SLACK).0 / NEARLY_SLACK;
        (compliance * tension, compliance)
    }

    fn readings(&self, readings: Readings) -> Readings {
        Readings { contraction: readings.contraction + self.way(self.compliance, readings.force).0, ..readings }
    }

    fn true_contraction(&self, reading: f64, force: f64, _time: f64) -> f64 {
        reading - self.way(self.compliance, force).0
    }

    fn sentence(&self) -> String {
        let millimetres = |compliance: f64| 1e3 * self.way(compliance, REFERENCE_FORCE).0;
        if self.load_compliance != 0.0 {
            let stretch = millimetres(self.load_compliance);
            return format!(
                "What is between the muscle and its load stretches: by {stretch:.2} mm at 400 N, so that the load swings more slowly."
            );
        }
        let shown = millimetres(self.compliance);
        let word = if shown < 0.0 { "less" } else { "more" };
        format!(
            "Something in series with the muscle gives way: at 400 N the position sensor shows {:.2} mm {word} than the muscle contracts.",
            shown.abs()
        )
    }
}
