use super::{Description, Effect, Holds, NEARLY, Point};

crate::variables::variables! {
    /// Creep: the membrane gives way slowly, or settles into the braid slowly.
    ///
    /// # Model
    /// Braid and membrane feel x − d₁ − d₂ + n (a₁ + a₂) x, with τᵢ ddᵢ/dt + dᵢ = aᵢ (x − x_r): two Kelvin–Voigt elements in series with it,
    /// `amplitude_1`, `time_1`, `amplitude_2`, `time_2`. x_r = `relaxed_share` x(0) is the contraction at which nothing drifts, and
    /// dᵢ(0) = `settled_share` aᵢ (x(0) − x_r). The nominal coefficients have the share n of all drift from the rest length already,
    /// `nominal_share`: all of it if they are those of a muscle that was held for long. The pressure pulls by d_F more, with
    /// τ₁ dd_F/dt + d_F = a_F (A p − A(0) p(0)), `pull_amplitude` a_F, and by the share n of where that goes less. While a drift goes back, its time is `return_ratio` τ; the drift
    /// of the pull does while the pull falls short of it.
    /// Where pressure drives it, dᵢ goes for aᵢ (x − x_r) + bᵢ (p − p_r)/2 bar, `pressure_drift_1` b₁ and `pressure_drift_2` b₂, and
    /// braid and membrane feel n (b₁ + b₂) p/2 bar more; p_r is to p what x_r is to x, and dᵢ(0) the settled share of all of that. A braid
    /// that goes on widening has b > 0, threads that go on stretching b < 0.
    /// Rubber often creeps with no single time, as a power of time or its logarithm: six more elements share `spectrum_amplitude` a,
    /// sₖ a each, with sₖ ∝ τₖ^e, Σ sₖ = 1, e the `spectrum_exponent`, and fixed times τₖ from 0.2 s to 300 s at equal ratios. Each of them has settled at the
    /// start as far as it would in the time in which one of 10 s settles by `settled_share`.
    /// A standard linear solid is stiffer for fast changes: springs kᵢ in parallel with the membrane, `relaxing_stiffness_1` and
    /// `relaxing_stiffness_2`, pull back with kᵢ eᵢ, deᵢ/dt = dx/dt − sinh(β eᵢ)/(β τᵢ), with `return_ratio` τᵢ while eᵢ < 0: β is
    /// `activation`, by which what yields thermally yields more readily under stress.
    ///
    /// # In the data
    /// Contraction drifts for seconds at constant measured pressure, unlike up and down; in a prescribed motion the force
    /// does, with the parts of pull and pressure also where the muscle is locked. A leak drifts in the pressure; hysteresis does not
    /// depend on time.
    ///
    /// # Validity
    /// 2 to 20 % of a step over 0.5 to 100 s. By default the muscle counts as relaxed where it starts, so that a
    /// simulation starts at rest; a relaxed share of zero is a muscle that comes from its rest length.
    ///
    /// # Reference
    /// Kelvin–Voigt model and standard linear solid of viscoelasticity; for muscles T. Minh et al. (2010),
    /// doi 10.1016/j.mechatronics.2010.04.003 (creep and hysteresis of a McKibben muscle). That rubber recovers at another
    /// pace than it gives way, and Eyring's activated flow: I. Ward, J. Sweeney (2012), Mechanical Properties of Solid Polymers,
    /// ch. 11 and 12. Power law of time: W. Findley, J. Lai, K. Onaran (1976), Creep and Relaxation of Nonlinear Viscoelastic Materials.
    pub struct Creep in "creep." as Tunable {
        /// Drift per contraction, first element
        amplitude_1: f64 = 0.0, ONE, (AHEAD..=1.0);
        /// Time constant, first element
        time_1: f64 = 3.0, SECOND, (0.05..=SLOWEST);
        /// Drift per contraction, second element
        amplitude_2: f64 = 0.0, ONE, (AHEAD..=1.0);
        /// Time constant, second element
        time_2: f64 = 20.0, SECOND, (0.05..=SLOWEST);
        /// Share of the contraction at the start that no drift belongs to
        relaxed_share: f64 = 1.0, ONE, (0.0..=1.0);
        /// Share of the remaining drift that lies before the start
        settled_share: f64 = 0.0, ONE, (0.0..=1.0);
        /// Share of the drift from the rest length that the nominal coefficients have already
        nominal_share: f64 = 0.0, ONE, (0.0..=1.0);
        /// Drift of the pull of the pressure, per pull
        pull_amplitude: f64 = 0.0, ONE, (AHEAD..=1.0);
        /// Drift of the contraction at 2 bar, first element
        pressure_drift_1: f64 = 0.0, METRE, (-0.1..=0.1);
        /// Drift of the contraction at 2 bar, second element
        pressure_drift_2: f64 = 0.0, METRE, (-0.1..=0.1);
        /// Stiffness that relaxes with the first time constant
        relaxing_stiffness_1: f64 = 0.0, NEWTON_PER_METRE, (0.0..=5e4);
        /// Stiffness that relaxes with the second time constant
        relaxing_stiffness_2: f64 = 0.0, NEWTON_PER_METRE, (0.0..=5e4);
        /// Drift per contraction, all elements of the spectrum
        spectrum_amplitude: f64 = 0.0, ONE, (AHEAD..=1.0);
        /// Power of its time with which the share of an element of the spectrum grows
        spectrum_exponent: f64 = 0.0, ONE, (-1.0..=1.0);
        /// Time in which a drift goes back, relative to that in which it grows
        return_ratio: f64 = 1.0, ONE, (0.05..=20.0);
        /// Activation of the flow of what relaxes, per stretch; zero is a linear dashpot
        activation: f64 = 0.0, PER_METRE, (0.0..=1e4);
    }
}

/// Times in s from which on something gives way slowly; before, it is viscous.
const SLOW: f64 = 0.2;
/// Longest time constant in s; a stiffness that takes that long to relax is a spring that was put in at the start.
const SLOWEST: f64 = 300.0;
/// Elements of a spectrum of times, and the time of its first one in s. From there to [`SLOWEST`] they follow powers of time up to 0.5, and its
/// logarithm, between 0.3 and 60 s to 0.3 % rms.
const ELEMENTS: usize = 6;
const FASTEST: f64 = 0.2;
/// Time in s of the element for which the settled share is stated.
const SETTLING: f64 = 10.0;
/// Where the states of the spectrum begin.
const SPECTRUM: usize = 8;
/// Argument beyond which flow grows no more, 6800 times as fast as a linear dashpot's: an integration can still follow it.
const LARGEST_SINH: f64 = 12.0;
/// Share of the larger of two opposite drifts that the smaller one takes back from which on it is no creep: nothing gives way for good, and
/// what comes and goes may have any course.
const TAKEN_BACK: f64 = 0.8;
/// Drift per contraction of a membrane that would push ahead of its load for good.
const AHEAD: f64 = -0.5;

/// Whether one of two drifts takes most of the other one back.
fn is_taken_back([first, second]: [f64; 2]) -> bool {
    first * second < 0.0 && first.abs().min(second.abs()) > TAKEN_BACK * first.abs().max(second.abs())
}

/// Values of the elements of the spectrum, each so many times the one before.
fn geometric(first: f64, ratio: f64) -> [f64; ELEMENTS] {
    let mut value = first / ratio;
    [(); ELEMENTS].map(|()| {
        value *= ratio;
        value
    })
}

impl Creep {
    /// What both drifts go for at a contraction in m and a pressure relative to the reference.
    fn aims(&self, contraction: f64, pressure: f64) -> [f64; 2] {
        [
            self.amplitude_1 * contraction + self.pressure_drift_1 * pressure,
            self.amplitude_2 * contraction + self.pressure_drift_2 * pressure,
        ]
    }

    /// Rate of a drift that goes for `aim` with a time constant.
    fn rate(&self, drift: f64, aim: f64, time: f64) -> f64 {
        let lack = aim - drift;
        lack / self.time(drift * lack < 0.0, time)
    }

    /// A time constant while something goes back, or does not.
    fn time(&self, goes_back: bool, time: f64) -> f64 {
        if goes_back { self.return_ratio * time } else { time }
    }

    /// Share in the amplitude and time in s of each element of the spectrum.
    fn spectrum(&self) -> [(f64, f64); ELEMENTS] {
        let spacing = (SLOWEST / FASTEST).powf(1.0 / (ELEMENTS - 1) as f64);
        let relative = geometric(1.0, spacing.powf(self.spectrum_exponent));
        let sum: f64 = relative.iter().sum();
        let times = geometric(FASTEST, spacing);
        std::array::from_fn(|k| (relative[k] / sum, times[k]))
    }

    /// Share of its amplitude by which the spectrum has given way at a time in s after a step.
    fn given_way(&self, time: f64) -> f64 {
        self.spectrum().into_iter().map(|(share, own)| share * -(-time / own).exp_m1()).sum()
    }

    /// Stretch in m that flows off within a time constant, from a stretch in m.
    fn flow(&self, stretch: f64) -> f64 {
        let argument = self.activation * stretch;
        if argument == 0.0 {
            return stretch;
        }
        let argument = argument.abs().min(LARGEST_SINH);
        stretch * argument.sinh() / argument
    }
}

impl Effect for Creep {
    const DESCRIPTION: Description = Description {
        name: "creep",
        meaning: "slow visco-elastic drift of the membrane at constant pressure",
        equation: "x <- x - d1 - d2 + n (a_1 + a_2) x;  tau_i d(d_i)/dt + d_i = a_i (x - x_r) + b_i (p - p_r)/2 bar;  x <- x + n (b_1 + b_2) p/2 bar;  x <- x - sum d_k, tau_k d(d_k)/dt + d_k = s_k a (x - x_r), s_k ~ tau_k^e;  A p <- A p + d_F;  F <- F - k_i e_i",
        signature: "drift over seconds at constant measured pressure",
        experiment: "hold for a minute after a step, up and down",
        reference: "Kelvin-Voigt; Minh et al. 2010",
        of_load: false,
        holds: Holds::AsLaw,
        forms: &[
            &[("creep.amplitude_1", &[0.08]), ("creep.time_1", &[1.5, 10.0])],
            &[("creep.pull_amplitude", &[0.15]), ("creep.time_1", &[1.5, 10.0])],
            &[("creep.relaxing_stiffness_1", &[1e3]), ("creep.time_1", &[1.5, 10.0])],
            &[("creep.pressure_drift_1", &[0.01, 0.01, -0.01, -0.01]), ("creep.time_1", &[1.5, 10.0, 1.5, 10.0])],
        ],
        further_forms: &[
            &[("creep.spectrum_amplitude", &[0.15]), ("creep.spectrum_exponent", &[0.3])],
            &[
                ("creep.spectrum_amplitude", &[0.15]),
                ("creep.spectrum_exponent", &[0.3]),
                ("creep.relaxed_share", &[0.5]),
                ("creep.settled_share", &[0.5]),
            ],
        ],
        refinements: &[
            ("creep.amplitude_2", &[0.05]),
            ("creep.time_2", &[15.0, 0.5]),
            ("creep.relaxed_share", &[0.5]),
            ("creep.settled_share", &[0.5]),
            ("creep.nominal_share", &[0.3]),
            ("creep.pull_amplitude", &[0.05]),
            ("creep.pressure_drift_2", &[5e-3]),
            ("creep.return_ratio", &[1.5]),
            ("creep.relaxing_stiffness_2", &[500.0]),
            ("creep.activation", &[100.0]),
        ],
    };
    /// Both drifts of the contraction, contraction and pull where nothing drifts, the drift of the pull, how far both springs are stretched,
    /// the relative pressure at which nothing drifts, and the drifts of the spectrum.
    const STATE_SCALES: &'static [f64] = &[0.1, 0.1, 0.1, 1e3, 1e3, 0.1, 0.1, 1.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1];
    const ENDS_INSIDE: &'static [&'static str] = &[
        "creep.amplitude_1",
        "creep.amplitude_2",
        "creep.pull_amplitude",
        "creep.pressure_drift_1",
        "creep.pressure_drift_2",
        "creep.spectrum_amplitude",
        "creep.spectrum_exponent",
        "creep.return_ratio",
    ];

    fn is_neutral(&self) -> bool {
        let Self { amplitude_1, amplitude_2, pull_amplitude, pressure_drift_1, pressure_drift_2, .. } = *self;
        let of_stretch = [self.relaxing_stiffness_1, self.relaxing_stiffness_2];
        [amplitude_1, amplitude_2, self.spectrum_amplitude, pull_amplitude, pressure_drift_1, pressure_drift_2]
            == [0.0; 6]
            && of_stretch == [0.0; 2]
    }

    // The second element may be a small part of the whole, and fast.
    fn is_plausible(&self) -> bool {
        let relaxing = [(self.relaxing_stiffness_1, self.time_1), (self.relaxing_stiffness_2, self.time_2)];
        let never_relaxes = |(stiffness, time): &(f64, f64)| *stiffness != 0.0 && *time > (1.0 - NEARLY) * SLOWEST;
        let drifts = [[self.amplitude_1, self.amplitude_2], [self.pressure_drift_1, self.pressure_drift_2]];
        self.time_1 > SLOW && !relaxing.iter().any(never_relaxes) && !drifts.into_iter().any(is_taken_back)
    }

    fn start(&self, at: &Point, own: &mut [f64]) {
        let [contraction, pressure] = [at.contraction, at.relative_pressure()];
        let settled = self.settled_share * (1.0 - self.relaxed_share);
        own[..2].copy_from_slice(&self.aims(contraction, pressure).map(|aim| settled * aim));
        own[2..4].copy_from_slice(&[self.relaxed_share * contraction, at.pressure_pull]);
        own[7] = self.relaxed_share * pressure;
        let aim = self.spectrum_amplitude * (1.0 - self.relaxed_share) * contraction;
        for (drift, (share, time)) in own[SPECTRUM..].iter_mut().zip(self.spectrum()) {
            *drift = share * aim * (1.0 - (1.0 - self.settled_share).powf(SETTLING / time));
        }
    }

    fn rates(&self, at: &Point, own: &[f64], rates: &mut [f64]) {
        let aims = self.aims(at.contraction - own[2], at.relative_pressure() - own[7]);
        rates[0] = self.rate(own[0], aims[0], self.time_1);
        rates[1] = self.rate(own[1], aims[1], self.time_2);
        let lack = self.pull_amplitude * (at.pressure_pull - own[3]) - own[4];
        rates[4] = lack / self.time(lack * self.pull_amplitude < 0.0, self.time_1);
        for (k, time) in [(5, self.time_1), (6, self.time_2)] {
            rates[k] = at.contraction_velocity - self.flow(own[k]) / self.time(own[k] < 0.0, time);
        }
        if self.spectrum_amplitude != 0.0 {
            let aim = self.spectrum_amplitude * (at.contraction - own[2]);
            for (k, (share, time)) in self.spectrum().into_iter().enumerate() {
                rates[SPECTRUM + k] = self.rate(own[SPECTRUM + k], share * aim, time);
            }
        }
    }

    fn area_force(&self, _at: &Point, own: &[f64], force: f64) -> f64 {
        if self.pull_amplitude == 0.0 {
            return force;
        }
        let known = self.nominal_share * self.pull_amplitude;
        force + own[4] - known * (force - own[3])
    }

    fn elastic_force(&self, _at: &Point, own: &[f64], force: f64) -> f64 {
        if self.is_neutral() {
            return force;
        }
        force - self.relaxing_stiffness_1 * own[5] - self.relaxing_stiffness_2 * own[6]
    }

    fn effective_contraction(&self, at: &Point, own: &[f64], contraction: f64) -> f64 {
        if self.is_neutral() {
            return contraction;
        }
        let known: f64 = self.aims(at.contraction, at.relative_pressure()).iter().sum();
        let known = known + self.spectrum_amplitude * at.contraction;
        let of_spectrum: f64 = own[SPECTRUM..].iter().sum();
        contraction - own[0] - own[1] - of_spectrum + self.nominal_share * known
    }

    fn sentence(&self) -> String {
        let one = |amplitude: f64, time: f64| format!("{:.1} % within {time:.1} s", 100.0 * amplitude);
        let mut parts = Vec::new();
        if self.amplitude_1 != 0.0 {
            parts.push(one(self.amplitude_1, self.time_1));
        }
        if self.amplitude_2 != 0.0 {
            parts.push(one(self.amplitude_2, self.time_2));
        }
        let mut all = Vec::new();
        if !parts.is_empty() {
            all.push(format!("of every change of length it gives way by {}", parts.join(" and ")));
        }
        if self.spectrum_amplitude != 0.0 {
            let [after_one, after_all] = [1.0, 30.0].map(|time| 100.0 * self.spectrum_amplitude * self.given_way(time));
            all.push(format!(
                "of every change of length it gives way by {after_one:.1} % within 1 s and {after_all:.1} % within 30 s"
            ));
        }
        if self.pull_amplitude != 0.0 {
            all.push(format!("the pull of the pressure grows by {}", one(self.pull_amplitude, self.time_1)));
        }
        for (drift, time) in [(self.pressure_drift_1, self.time_1), (self.pressure_drift_2, self.time_2)] {
            if drift != 0.0 {
                let way = if drift < 0.0 { "lengthens" } else { "shortens" };
                all.push(format!("2 bar {way} the muscle by {:.1} mm within {time:.1} s", 1e3 * drift.abs()));
            }
        }
        let readily = if self.activation == 0.0 { "" } else { ", the more readily the further it is stretched" };
        for (stiffness, time) in [(self.relaxing_stiffness_1, self.time_1), (self.relaxing_stiffness_2, self.time_2)] {
            if stiffness != 0.0 {
                all.push(format!("a stiffness of {:.2} N/mm relaxes within {time:.1} s{readily}", 1e-3 * stiffness));
            }
        }
        format!("The membrane creeps: {}.", all.join(", and "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drifts_that_take_each_other_back_are_no_creep() {
        let creep =
            |first: f64, second: f64| Creep { pressure_drift_1: first, pressure_drift_2: second, ..Creep::default() };
        assert!([(0.02, 0.02), (0.02, -0.01), (-0.03, 0.0)].into_iter().all(|(a, b)| creep(a, b).is_plausible()));
        assert!(!creep(-0.067, 0.064).is_plausible());
    }

    #[test]
    fn a_spectrum_gives_way_as_a_power_of_time() {
        // Exponents of the spectrum that come nearest to powers of time between 0.3 s and 60 s, by least squares.
        for (exponent, power) in [(0.117, 0.1), (0.343, 0.3), (0.607, 0.5)] {
            let creep = Creep { spectrum_amplitude: 0.1, spectrum_exponent: exponent, ..Creep::default() };
            let times: Vec<f64> = (0..=40).map(|k| 0.3 * 200.0_f64.powf(f64::from(k) / 40.0)).collect();
            let share = |of: &dyn Fn(f64) -> f64, time: f64| (of(time) - of(0.3)) / (of(60.0) - of(0.3));
            for time in times {
                let given = share(&|time| creep.given_way(time), time);
                let expected = share(&|time: f64| time.powf(power), time);
                assert!((given - expected).abs() < 0.02, "{power}: {given} for {expected} at {time} s");
            }
            assert!((creep.spectrum().iter().map(|(share, _)| share).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
