use super::{Description, Effect, Holds, Point, REFERENCE_CONTRACTION, REFERENCE_FORCE, of_recording};

/// Smallest velocity in m/s over which a friction without a loop changes its sign, which fits approach without ever losing sight of it.
const LEAST_SMOOTHING: f64 = 2e-4;

/// Share of a friction without a loop with which it starts at most: what is nearer to all of it is a matter of high speeds.
const FULLY: f64 = 0.99;

crate::variables::variables! {
    /// Dry friction between threads and rubber: a loss that depends on the way, not on its speed.
    ///
    /// # Model
    /// F ← F − (w₀ + w₁ p + μ |F|) (1 + b (x/0.1 m − 1)) h (1 + c exp(−(v/v_s)²)), with the loop h = (1 − m) z₁ + m z₂ of two
    /// elements that pass it within the displacements s and r s: s dz/dx = 1 − (γ sgn(v z) + 1 − γ) |z|ⁿ. `half_width` w₀,
    /// `half_width_per_pressure` w₁, `half_width_per_pull` μ, `with_contraction` b, `presliding_displacement` s,
    /// `second_share` m, `second_ratio` r, `knee` n, `unloading` γ, `stribeck_share` c, `stribeck_velocity` v_s. n = γ = 1 is
    /// the law of Dahl. Both z stay within ±1. With a `smoothing_velocity` v₀ it is Coulomb's law without a memory,
    /// h = tanh(v/v₀). A hanging load starts in balance with h at `start`, by `second_start` and `third_start` more in these
    /// recordings.
    ///
    /// # In the data
    /// The force residual changes sign at every reversal; its width does not depend on speed. Triangles of shrinking
    /// amplitude separate it from viscous damping (three speeds) and from a valve lag (vanishes when slow).
    ///
    /// # Validity
    /// Smooth loops, as of FESTO muscles whose threads are embedded in rubber. With the Stribeck term the load may creep
    /// in jerks, but it never sticks for good; with v₀ it sinks slowly where it should stick.
    /// v₀ acts as √(v₀² + (0.2 mm/s)²), so that no step of the integration becomes too short.
    ///
    /// # Reference
    /// P. Dahl (1968), A solid friction model, TOR-0158(3107-18)-1; Y. Wen (1976), Method for random vibration of
    /// hysteretic systems (n, γ); pressure dependence and Stribeck term as in Tondu and Lopez, thesis eq. 4.20, with the
    /// sign function replaced by h; tanh(v/v₀): S. Andersson, A. Söderberg, S. Björklund (2007), Friction models for sliding
    /// dry, boundary and mixed lubricated contacts, doi 10.1016/j.triboint.2005.11.014.
    pub struct FrictionHysteresis in "friction_hysteresis." as Tunable {
        /// Half width of the loop at zero pressure and pull
        half_width: f64 = 0.0, NEWTON, (0.0..=300.0);
        /// Growth of the half width with gauge pressure
        half_width_per_pressure: f64 = 0.0, NEWTON_PER_PASCAL, (0.0..=1e-3);
        /// Growth of the half width with the pull, as of a cord around a bolt
        half_width_per_pull: f64 = 0.0, ONE, (0.0..=0.5);
        /// Relative growth of the half width with contraction, at 0.1 m: the threads cross at another angle there
        with_contraction: f64 = 0.0, ONE, (-0.9..=0.9);
        /// Displacement after a reversal at which most of the loop is passed
        presliding_displacement: f64 = 2e-3, METRE, (1e-5..=0.1);
        /// Share of the second element in the loop
        second_share: f64 = 0.0, ONE, (0.0..=1.0);
        /// Presliding displacement of the second element, relative to the first
        second_ratio: f64 = 4.0, ONE, (1.0..=50.0);
        /// Sharpness of the knee of the loop
        knee: f64 = 1.0, ONE, (0.5..=6.0);
        /// How much steeper the loop is right after a reversal: 1 twice as steep, 0.5 not at all
        unloading: f64 = 1.0, ONE, (0.0..=1.0);
        /// Velocity at which most of a friction without a loop is there; 0: there is a loop
        smoothing_velocity: f64 = 0.0, METRE_PER_SECOND, (0.0..=0.1);
        /// Relative excess of the friction at rest over that in motion
        stribeck_share: f64 = 0.0, ONE, (-0.5..=2.0);
        /// Velocity over which that excess fades
        stribeck_velocity: f64 = 0.01, METRE_PER_SECOND, (1e-4..=1.0);
        /// Where in the loop the friction starts: -1 after lengthening, 1 after shortening
        start: f64 = 0.0, ONE, (-1.0..=1.0);
        /// By how much more in the second of several recordings: each begins with a past of its own
        second_start: f64 = 0.0, ONE, (-2.0..=2.0), of 2;
        /// By how much more in the third
        third_start: f64 = 0.0, ONE, (-2.0..=2.0), of 3;
        /// Which of the recordings is simulated: from the fourth on as the first
        recording: f64 = 1.0, ONE, (1.0..=1000.0);
    }
}

/// Longest way in m within which the second element is passed: a measured seal takes 18 mm.
const LONGEST: f64 = 0.05;

impl FrictionHysteresis {
    fn width(&self, at: &Point, pull: f64) -> f64 {
        let of_pressure = self.half_width + self.half_width_per_pressure * at.gauge_pressure.max(0.0);
        let place = 1.0 + self.with_contraction * (at.relative_contraction() - 1.0);
        // A friction that would drive the muscle is none.
        (of_pressure + self.half_width_per_pull * pull.abs()) * place.max(0.0)
    }

    /// Share of the half width that acts at the start of the recording that is simulated, with its sign.
    fn engaged_at_start(&self) -> f64 {
        (self.start + of_recording(self.recording, [self.second_start, self.third_start])).clamp(-1.0, 1.0)
    }

    /// Rate of an element at `z` while the muscle moves by `velocity` in units of its displacement per second.
    fn rate(&self, velocity: f64, z: f64) -> f64 {
        let speed = velocity.abs();
        if self.knee == 1.0 && self.unloading == 1.0 {
            return velocity - speed * z;
        }
        let loading = if velocity * z > 0.0 { 1.0 } else { 1.0 - 2.0 * self.unloading };
        velocity * (1.0 - loading * z.abs().powf(self.knee))
    }

    /// Velocity in m/s within which it sets in, where it goes by velocity.
    fn smoothing(&self) -> f64 {
        // No `hypot`, which asks for a newer C library than all else does.
        (self.smoothing_velocity.powi(2) + LEAST_SMOOTHING.powi(2)).sqrt()
    }

    /// Share of the half width that acts, with its sign.
    fn engaged(&self, velocity: f64, own: &[f64]) -> f64 {
        if self.smoothing_velocity > 0.0 {
            return (velocity / self.smoothing()).tanh();
        }
        (1.0 - self.second_share) * own[0] + self.second_share * own[1]
    }

    fn stribeck(&self, velocity: f64) -> f64 {
        if self.stribeck_share == 0.0 {
            return 1.0;
        }
        1.0 + self.stribeck_share * (-(velocity / self.stribeck_velocity).powi(2)).exp()
    }
}

impl Effect for FrictionHysteresis {
    const DESCRIPTION: Description = Description {
        name: "friction_hysteresis",
        meaning: "dry friction in the braid: a loss that does not depend on speed",
        equation: "F <- F - (w0 + w1 p + mu |F|) (1 + b (x/x0 - 1)) h (1 + c exp(-(v/v_s)^2)),  h of two elements s dz/dx = 1 - z sgn(v), or h = tanh(v/v0)",
        signature: "force residual changes sign at reversals, width independent of speed",
        experiment: "triangles of shrinking amplitude at three pressures",
        reference: "Dahl 1968; Wen 1976; Andersson et al. 2007; thesis eq. 4.20",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[
                ("friction_hysteresis.half_width", &[10.0, 25.0]),
                ("friction_hysteresis.half_width_per_pressure", &[3e-5, 1e-4]),
                ("friction_hysteresis.presliding_displacement", &[1e-3, 4e-3]),
            ],
            &[
                ("friction_hysteresis.half_width", &[10.0]),
                ("friction_hysteresis.half_width_per_pressure", &[5e-5]),
                ("friction_hysteresis.smoothing_velocity", &[2e-3]),
            ],
        ],
        further_forms: &[],
        refinements: &[
            ("friction_hysteresis.second_share", &[0.4]),
            ("friction_hysteresis.second_ratio", &[5.0]),
            ("friction_hysteresis.knee", &[1.5]),
            ("friction_hysteresis.unloading", &[0.7]),
            ("friction_hysteresis.stribeck_share", &[0.1]),
            ("friction_hysteresis.half_width_per_pull", &[0.01]),
            ("friction_hysteresis.with_contraction", &[0.3, -0.3]),
            ("friction_hysteresis.start", &[0.3, -0.3]),
            ("friction_hysteresis.second_start", &[0.3, -0.3]),
            ("friction_hysteresis.third_start", &[0.3, -0.3]),
        ],
    };
    const STATE_SCALES: &'static [f64] = &[1.0, 1.0];
    const ENDS_INSIDE: &'static [&'static str] = &["friction_hysteresis.with_contraction"];

    fn is_neutral(&self) -> bool {
        self.half_width == 0.0 && self.half_width_per_pressure == 0.0 && self.half_width_per_pull == 0.0
    }

    fn rests(&self) -> bool {
        self.is_neutral() || self.smoothing_velocity > 0.0
    }

    // What gives way over such a way is a spring.
    fn is_plausible(&self) -> bool {
        self.second_share == 0.0 || self.presliding_displacement * self.second_ratio < LONGEST
    }

    fn start(&self, _at: &Point, own: &mut [f64]) {
        own.fill(self.engaged_at_start());
    }

    fn start_velocity(&self) -> f64 {
        if self.is_neutral() || self.smoothing_velocity == 0.0 {
            return 0.0;
        }
        self.smoothing() * self.engaged_at_start().clamp(-FULLY, FULLY).atanh()
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let velocity = at.contraction_velocity / self.presliding_displacement;
        rates[0] = self.rate(velocity, own[0]);
        // A second element that does not count rests, so that it cannot touch the step size of the integrator.
        if self.second_share != 0.0 {
            rates[1] = self.rate(velocity / self.second_ratio, own[1]);
        }
    }

    fn muscle_force(&self, at: &Point, own: &[f64], force: f64) -> f64 {
        if self.is_neutral() {
            return force;
        }
        let engaged = self.engaged(at.contraction_velocity, own);
        force - self.width(at, force) * engaged * self.stribeck(at.contraction_velocity)
    }

    fn sentence(&self) -> String {
        let usual = Point { gauge_pressure: 3e5, contraction: REFERENCE_CONTRACTION, ..Point::default() };
        let loop_width = 2.0 * self.width(&usual, REFERENCE_FORCE);
        let depends_on_pull = 2.0 * self.half_width_per_pull * REFERENCE_FORCE > 0.5;
        let pull = if depends_on_pull { format!(" and {REFERENCE_FORCE:.0} N") } else { String::new() };
        format!(
            "Dry friction in the braid: at 3 bar{pull} the muscle pulls {loop_width:.0} N less when it shortens than when it lengthens."
        )
    }
}
