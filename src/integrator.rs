//! Adaptive Runge–Kutta integration of a small system whose size is known to the compiler.
//!
//! # Model
//! The pair 5(4) of Dormand and Prince with a proportional step controller. The step that the controller proposes is
//! part of the state of a simulation, so that saving and restoring reproduces a run bit for bit. The largest scaled
//! error of any state decides, not their mean: a state that rests changes nothing.
//!
//! # Reference
//! J. Dormand, P. Prince (1980), A family of embedded Runge–Kutta formulae, doi 10.1016/0771-050X(80)90013-3;
//! E. Hairer, S. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, II.4 and II.6.

/// How precisely a system is integrated, and how long that may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Error of one step, relative to the scale of each state, that is accepted.
    pub tolerance: f64,
    /// Steps per second beyond which a call gives up; a few are allowed to each besides.
    pub most_steps: f64,
}

impl Accuracy {
    /// Where nothing else is asked for.
    pub const USUAL: Self = Self { tolerance: 5e-9, most_steps: f64::INFINITY };

    /// Most steps of a call over a duration in s.
    fn most_steps_over(self, duration: f64) -> usize {
        (FEW_STEPS + self.most_steps * duration).min(MOST_STEPS) as usize
    }
}

const LARGEST_STEP: f64 = 0.05;
const SMALLEST_STEP: f64 = 1e-9;
/// Share of the step that the error allows which is taken, and the error below which no longer one is.
const SAFETY: f64 = 0.9;
const LEAST_ERROR: f64 = 1e-4;
/// A call that needs more steps than this would keep its caller waiting for seconds: the parameters make no sense.
const MOST_STEPS: f64 = 1e7;
/// What a corner of the course takes, and much more.
const FEW_STEPS: f64 = 500.0;

/// Coefficients of the stages (Butcher tableau), without the first row.
const A: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Instants of the stages, as fractions of the step.
const C: [f64; 6] = [1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
/// Difference of the two solutions: the error estimate.
const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Coefficients of the solution within a step, which is of order four (Hairer et al., II.6).
const D: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// Derivatives at the present state, per second, from the call before.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Now<S> {
    /// Whether they are known.
    pub is_known: bool,
    /// The derivatives.
    pub rates: S,
}

/// Integration left the range of numbers, no step was small enough, or there were too many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Failed {
    /// Time since the start of the interval, s.
    pub after: f64,
    /// Index of the state to blame; `None` where there were too many steps.
    pub state: Option<usize>,
}

/// Advances `state` over `duration` seconds.
///
/// `rates(t, y, dy)` gives the derivatives at `t` seconds after the start of the interval; `witness([t0, t1], ends, y)` is
/// told of every accepted step, with the states `ends()` at both ends and the solution `y(t)` within it; `scale` is the usual size of each state, and
/// `accuracy` the error of one step relative to it, and how many may be made; `step` is the step proposed by the last call and is updated;
/// `now` holds the derivatives at `state`, if they are known before, and in any case after.
///
/// # Errors
/// [`Failed`] when a state is not finite, the step would fall below a nanosecond, or the steps are too many; `state` is
/// then meaningless.
#[inline]
#[allow(clippy::too_many_arguments)]
pub fn advance<const N: usize>(
    mut rates: impl FnMut(f64, &[f64; N], &mut [f64; N]),
    mut witness: impl FnMut([f64; 2], &dyn Fn() -> [[f64; N]; 2], &dyn Fn(f64) -> [f64; N]),
    scale: &[f64; N],
    accuracy: Accuracy,
    state: &mut [f64; N],
    step: &mut f64,
    now: &mut Now<[f64; N]>,
    duration: f64,
) -> Result<(), Failed> {
    let mut time = 0.0;
    let mut stages = [[0.0; N]; 7];
    if std::mem::take(&mut now.is_known) {
        stages[0] = now.rates;
    } else {
        rates(0.0, state, &mut stages[0]);
    }
    for _ in 0..accuracy.most_steps_over(duration) {
        let rest = duration - time;
        // A rest that is hardly longer than the step is done in one, not in one and a sliver.
        let last = rest <= *step * 1.000_001;
        let h = if last { rest } else { *step };
        let next = one_step(&mut rates, time, h, state, &mut stages);
        let (error, worst) = scaled_error(&stages, h, scale, state, &next);
        let error = error / accuracy.tolerance;
        if error <= 1.0 {
            let within = |t: f64| within_step((t - time) / h, h, state, &next, &stages);
            witness([time, time + h], &|| [*state, next], &within);
            *state = next;
            time += h;
            stages[0] = stages[6]; // first same as last
        }
        // A step cut short by the end of the interval says nothing against the longer one.
        if error > 1.0 || !last {
            *step = (h * growth(error)).min(LARGEST_STEP);
        } else if may_lengthen(error, h, *step) {
            *step = step.max((h * growth(error)).min(LARGEST_STEP));
        }
        if error <= 1.0 && last {
            *now = Now { is_known: true, rates: stages[0] };
            return Ok(());
        }
        if *step < SMALLEST_STEP {
            return Err(Failed { after: time, state: Some(worst) });
        }
    }
    Err(Failed { after: time, state: None })
}

/// By how much the step changes after an error.
#[inline]
fn growth(error: f64) -> f64 {
    // The power takes longer than all the rest of a step, and most steps are far better than they need be.
    if error < LEAST_ERROR { 5.0 } else { (SAFETY * error.powf(-0.2)).clamp(0.2, 5.0) }
}

/// Whether the step after one of length h with an error may be longer than another one; where not, its power is not worth its time.
#[inline]
fn may_lengthen(error: f64, h: f64, step: f64) -> bool {
    error < LEAST_ERROR || error < 1.001 * (SAFETY * h / step).powi(5)
}

#[inline]
fn one_step<const N: usize>(
    rates: &mut impl FnMut(f64, &[f64; N], &mut [f64; N]),
    time: f64,
    h: f64,
    state: &[f64; N],
    stages: &mut [[f64; N]; 7],
) -> [f64; N] {
    let mut trial = *state;
    for s in 0..6 {
        let slope = combined(A[s], stages);
        for i in 0..N {
            trial[i] = state[i] + h * slope[i];
        }
        rates(time + C[s] * h, &trial, &mut stages[s + 1]);
    }
    trial // the last stage is the solution of order five
}

/// Solution at a share of a step.
fn within_step<const N: usize>(
    share: f64,
    h: f64,
    state: &[f64; N],
    next: &[f64; N],
    stages: &[[f64; N]; 7],
) -> [f64; N] {
    let bend = combined(&D, stages);
    std::array::from_fn(|i| {
        let whole = next[i] - state[i];
        let [first, last] = [0, 6].map(|stage: usize| h * stages[stage][i] - whole);
        state[i] + share * (whole + (1.0 - share) * (first + share * (-last - first + (1.0 - share) * h * bend[i])))
    })
}

/// Sum of the stages, weighted. State by state inside, so that the compiler can do several at once.
#[inline]
fn combined<const N: usize>(weights: &[f64], stages: &[[f64; N]; 7]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (weight, stage) in weights.iter().zip(stages) {
        for i in 0..N {
            sum[i] += weight * stage[i];
        }
    }
    sum
}

#[inline]
fn scaled_error<const N: usize>(
    stages: &[[f64; N]; 7],
    h: f64,
    scale: &[f64; N],
    state: &[f64; N],
    next: &[f64; N],
) -> (f64, usize) {
    let difference = combined(&E, stages);
    let (mut largest, mut worst) = (0.0_f64, 0);
    for i in 0..N {
        if !next[i].is_finite() {
            return (f64::INFINITY, i);
        }
        let size = scale[i].max(state[i].abs()).max(next[i].abs());
        let error = (h * difference[i]).abs() / size;
        if error > largest {
            (largest, worst) = (error, i);
        }
    }
    (largest, worst)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oscillator with known solution, and a state that decays.
    fn rates(_: f64, y: &[f64; 3], dy: &mut [f64; 3]) {
        *dy = [y[1], -100.0 * y[0], -3.0 * y[2]];
    }

    #[test]
    fn closed_form_is_met_whatever_the_calls() {
        for call in [1e-4, 1e-3, 1e-2, 0.25, 1.0] {
            let (mut state, mut step, mut now) = ([1.0, 0.0, 1.0], 1e-3, Now::default());
            for _ in 0..(1.0_f64 / call).round() as usize {
                let scale = &[1.0, 10.0, 1.0];
                advance(rates, |_, _, _| {}, scale, Accuracy::USUAL, &mut state, &mut step, &mut now, call).unwrap();
            }
            let exact = [10.0_f64.cos(), -10.0 * 10.0_f64.sin(), (-3.0_f64).exp()];
            for (is, should) in state.iter().zip(exact) {
                assert!((is - should).abs() < 1e-6, "{call}: {is} {should}");
            }
            let mut anew = [0.0; 3];
            rates(0.0, &state, &mut anew);
            assert_eq!(now, Now { is_known: true, rates: anew });
        }
    }

    #[test]
    fn the_solution_within_a_step_is_of_order_four() {
        let largest_error = |h: f64| {
            let mut most = 0.0_f64;
            let witness = |_: [f64; 2], _: &dyn Fn() -> [[f64; 3]; 2], within: &dyn Fn(f64) -> [f64; 3]| {
                for k in 0..=10 {
                    let t = h * f64::from(k) / 10.0;
                    let exact = [(10.0 * t).cos(), -10.0 * (10.0 * t).sin(), (-3.0 * t).exp()];
                    most = within(t).iter().zip(exact).fold(most, |most, (is, should)| most.max((is - should).abs()));
                }
            };
            advance(
                rates,
                witness,
                &[1.0, 10.0, 1.0],
                Accuracy { tolerance: 1.0, ..Accuracy::USUAL },
                &mut [1.0, 0.0, 1.0],
                &mut h.clone(),
                &mut Now::default(),
                h,
            )
            .unwrap();
            most
        };
        let (whole, half) = (largest_error(0.04), largest_error(0.02));
        assert!(half < 1e-5 && (whole / half).log2() > 4.5, "{whole} {half}");
    }

    #[test]
    fn an_explosion_is_reported_with_its_time() {
        let explode = |_: f64, y: &[f64; 1], dy: &mut [f64; 1]| dy[0] = y[0] * y[0];
        let failed =
            advance(explode, |_, _, _| {}, &[1.0], Accuracy::USUAL, &mut [1.0], &mut 1e-3, &mut Now::default(), 2.0)
                .unwrap_err();
        assert!((failed.after - 1.0).abs() < 1e-3, "1/(1 - t) ends at 1 s, not {}", failed.after);
    }

    #[test]
    fn a_stiffness_without_sense_ends() {
        let stiff = |_: f64, y: &[f64; 1], dy: &mut [f64; 1]| dy[0] = -1e12 * y[0];
        assert!(
            advance(stiff, |_, _, _| {}, &[1.0], Accuracy::USUAL, &mut [1.0], &mut 1e-3, &mut Now::default(), 1.0)
                .is_err()
        );
    }

    #[test]
    fn what_takes_too_many_steps_ends_early() {
        let stiff = |_: f64, y: &[f64; 1], dy: &mut [f64; 1]| dy[0] = -1e6 * y[0];
        let within = |most_steps: f64| {
            let accuracy = Accuracy { most_steps, ..Accuracy::USUAL };
            advance(stiff, |_, _, _| {}, &[1.0], accuracy, &mut [1.0], &mut 1e-6, &mut Now::default(), 0.1)
        };
        // Stability allows steps of 3.3 µs.
        assert_eq!(within(1e6), Ok(()));
        let failed = within(1e5).unwrap_err();
        assert!(failed.state.is_none() && failed.after < 0.05, "{failed:?}");
    }
}
