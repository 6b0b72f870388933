//! Residuals of the links of the chain command → pressure → force → motion → reading, each cut off from the others where
//! its input was measured, and what these residuals go with.
//!
//! # Model
//! With command u, gauge pressure p, contraction x, force F (all as measured), load M and the model's own functions:
//!
//! | link | from | to | residual |
//! |---|---|---|---|
//! | [`Link::Valve`] | u | p | p − p̂(u), the valve started at the first measured pressure |
//! | [`Link::Muscle`] | p, x | F | F − F̂(p, x, dx/dt), [`replay_muscle`] |
//! | [`Link::Load`] | x | F | ⟨F⟩ − M g − I d²x/dt², I what moves of the load: the force that the motion of the load takes |
//! | [`Link::Reading`] | p, F | x | (F − F̂) / \|∂F̂/∂x\|: how far the reading of x is from where F belongs, to first order |
//! | [`Link::Whole`] | u | x or F | measured − [`replay`] |
//!
//! dx/dt and d²x/dt² are those of the parabola through the samples within [`HALF_WINDOW`] (A. Savitzky and M. Golay
//! 1964, doi 10.1021/ac60214a047, for uneven sampling). The curvature of that parabola is the mean of the true acceleration
//! with weights (1 − (Δt/w)²)² over the window of half width w; ⟨F⟩ is the same mean of the force, so that fast motion is
//! smoothed alike on both sides. How much of a residual goes with a variable is the share of its
//! mean square that is gone when the mean is taken off in each of [`BINS`] classes of the variable with equally many
//! samples (correlation ratio, K. Pearson 1905, about zero rather than the mean: a constant error counts too).

use crate::GRAVITY;
use crate::effects::Readings;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::{Replay, in_recording, replay, replay_muscle};
use std::ops::Range;

/// Time in s on either side that velocity and acceleration are taken from: it keeps a noise of 0.1 mm at 80 Hz below
/// 0.02 m/s².
const HALF_WINDOW: f64 = 0.1;
/// Fewest samples on either side, where sampling is slow.
const FEWEST_NEIGHBOURS: usize = 3;
/// Classes of a variable.
const BINS: usize = 20;
/// Classes of time: few, or it would stand for every slow motion.
const TIME_BINS: usize = 5;
/// A variable must tell this much more than one before it in the list to be preferred.
const CLEARLY: f64 = 0.05;
/// Step in m for the slope of the force over the contraction.
const STEP: f64 = 1e-4;

/// A part of the chain whose input and output were both measured; see the table above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Link {
    /// Command → pressure.
    Valve,
    /// Pressure and contraction → force.
    Muscle,
    /// Motion of the hanging load → force.
    Load,
    /// Pressure and force → reading of the contraction.
    Reading,
    /// Everything from the inputs to one signal.
    Whole(Signal),
}

impl Link {
    /// All links, along the chain.
    pub const ALL: [Self; 6] = [
        Self::Valve,
        Self::Muscle,
        Self::Load,
        Self::Reading,
        Self::Whole(Signal::Contraction),
        Self::Whole(Signal::Force),
    ];

    /// The signal whose residual it is.
    pub fn output(self) -> Signal {
        match self {
            Self::Valve => Signal::GaugePressure,
            Self::Muscle | Self::Load => Signal::Force,
            Self::Reading => Signal::Contraction,
            Self::Whole(signal) => signal,
        }
    }

    /// Variables that the residual may go with, those nearest to the link first. The reading whose noise is in the
    /// residual is none of them: the two go together by that alone.
    fn variables(self) -> Vec<Variable> {
        let mut variables = Variable::ALL.to_vec();
        if self == Self::Valve {
            // The valve knows nothing of the motion.
            variables.sort_by_key(|v| matches!(v, Variable::Contraction | Variable::Velocity | Variable::Time));
        }
        let own = match self {
            Self::Valve => Some(Variable::GaugePressure),
            Self::Whole(Signal::Contraction) => Some(Variable::Contraction),
            _ => None,
        };
        variables.retain(|variable| Some(*variable) != own);
        variables
    }

    /// The link in a few words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Valve => "Valve: command → pressure",
            Self::Muscle => "Muscle: pressure and contraction → force",
            Self::Load => "Load: force → motion",
            Self::Reading => "Position sensor: motion → reading",
            Self::Whole(Signal::Contraction) => "Whole simulation: contraction",
            Self::Whole(_) => "Whole simulation: force",
        }
    }

    /// What is subtracted from what.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Valve => "Measured gauge pressure − pressure that the valve makes of the command.",
            Self::Muscle => "Measured force − force of the muscle at the measured pressure and contraction.",
            Self::Load => "Measured force − force that the measured motion of the load takes, M g + I a.",
            Self::Reading => "Measured contraction − contraction that the measured pressure and force belong to.",
            Self::Whole(_) => "Measured − simulated from the inputs of the experiment alone, every link in it.",
        }
    }
}

/// What a residual may go with, the more physical first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Variable {
    Contraction,
    Velocity,
    GaugePressure,
    PressureRate,
    Command,
    CommandRate,
    Time,
}

impl Variable {
    /// All of them, in order of preference.
    pub const ALL: [Self; 7] = [
        Self::Contraction,
        Self::Velocity,
        Self::GaugePressure,
        Self::PressureRate,
        Self::Command,
        Self::CommandRate,
        Self::Time,
    ];

    /// Name for people, unit for people and its size in SI.
    pub fn label(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::Contraction => ("contraction", "mm", 1e-3),
            Self::Velocity => ("velocity of contraction", "mm/s", 1e-3),
            Self::GaugePressure => ("gauge pressure", "bar", 1e5),
            Self::PressureRate => ("rate of pressure", "bar/s", 1e5),
            Self::Command => ("command", "V", 1.0),
            Self::CommandRate => ("rate of command", "V/s", 1.0),
            Self::Time => ("time", "s", 1.0),
        }
    }

    /// Its values at the samples of a recording, SI, shape `(n_samples,)`; `None` where it was not measured.
    pub fn values(self, recording: &Recording) -> Option<Vec<f64>> {
        let rate = |signal| Some(parabolas(&recording.time, &recording.bridged(signal)?).map(|p| p.slope).collect());
        match self {
            Self::Contraction => recording.bridged(Signal::Contraction),
            Self::Velocity => rate(Signal::Contraction),
            Self::GaugePressure => recording.bridged(Signal::GaugePressure),
            Self::PressureRate => rate(Signal::GaugePressure),
            Self::Command => recording.bridged(Signal::Command),
            Self::CommandRate => rate(Signal::Command),
            Self::Time => Some(recording.since_start()),
        }
    }

    fn bins(self) -> usize {
        if self == Self::Time { TIME_BINS } else { BINS }
    }
}

/// A model laid over a recording, whole and cut.
pub struct Chain<'a> {
    parameters: Parameters,
    recording: &'a Recording,
    whole: Option<Replay>,
    muscle: Option<Replay>,
}

impl<'a> Chain<'a> {
    /// Simulates the model over the recording. What cannot be simulated, because measured inputs are too wild or the
    /// model is too far off, has no residual.
    pub fn new(parameters: &Parameters, recording: &'a Recording) -> Self {
        let measured = |signal| recording.get(signal).is_some();
        let cut = measured(Signal::GaugePressure) && measured(Signal::Contraction) && measured(Signal::Force);
        let muscle = cut.then(|| replay_muscle(parameters, recording).ok()).flatten();
        let whole = replay(parameters, recording).ok();
        Self { parameters: in_recording(parameters, recording), recording, whole, muscle }
    }

    /// Residual of a link in SI, shape `(n_samples,)`, NaN where a sample is missing; `None` where the link was not
    /// measured or its residual would be that of another link.
    pub fn residual(&self, link: Link) -> Option<Vec<f64>> {
        match link {
            Link::Valve => self.against(self.whole.as_ref()?, Signal::GaugePressure),
            Link::Muscle => self.against(self.muscle.as_ref()?, Signal::Force),
            Link::Load => self.load(),
            Link::Reading => self.reading(),
            Link::Whole(signal) => {
                // Without a command the whole simulation is the muscle alone.
                self.recording.get(Signal::Command)?;
                self.against(self.whole.as_ref()?, signal)
            }
        }
    }

    fn against(&self, simulated: &Replay, signal: Signal) -> Option<Vec<f64>> {
        Some(difference(self.recording.get(signal)?, simulated.get(signal)?))
    }

    fn load(&self) -> Option<Vec<f64>> {
        let (force, mass) = (self.recording.get(Signal::Force)?, self.recording.load_mass()?);
        let contraction = self.true_contraction()?;
        let effects = &self.parameters.effects;
        let needed = parabolas(&self.recording.time, &contraction).zip(&contraction).map(|(motion, contraction)| {
            let (weighing, moving) = effects.masses(mass, *contraction);
            let force = weighing * GRAVITY + moving * motion.curvature;
            (contraction, force)
        });
        let time = self.recording.since_start();
        let shown = needed.zip(&time).map(|((contraction, force), time)| {
            effects.readings(Readings { time: *time, contraction: *contraction, gauge_pressure: 0.0, force }).force
        });
        Some(difference(&smoothed(&self.recording.time, force), &shown.collect::<Vec<_>>()))
    }

    fn reading(&self) -> Option<Vec<f64>> {
        let Parameters { muscle, force_models, .. } = &self.parameters;
        let pressure = self.recording.bridged(Signal::GaugePressure)?;
        let force = self.residual(Link::Muscle)?;
        let at = pressure.iter().zip(self.true_contraction()?);
        let stiffness = at.map(|(pressure, contraction)| {
            let force = |contraction| force_models.force(muscle, *pressure, contraction);
            (force(contraction - STEP) - force(contraction + STEP)) / (2.0 * STEP)
        });
        // Where the muscle has no stiffness its force says nothing of the contraction.
        let shift = |(force, stiffness): (&f64, f64)| if stiffness > 0.0 { force / stiffness } else { f64::NAN };
        Some(force.iter().zip(stiffness).map(shift).collect())
    }

    fn true_contraction(&self) -> Option<Vec<f64>> {
        let readings = self.recording.bridged(Signal::Contraction)?;
        let pull = self.recording.bridged(Signal::Force).unwrap_or_else(|| vec![0.0; readings.len()]);
        let all = readings.into_iter().zip(pull).zip(self.recording.since_start());
        let effects = &self.parameters.effects;
        Some(all.map(|((reading, pull), time)| effects.true_contraction(reading, pull, time)).collect())
    }
}

/// A residual and a variable over all recordings.
#[derive(Debug, Clone, Copy)]
pub struct Exposure {
    /// Which variable.
    pub variable: Variable,
    /// Share of the mean square of the residual that goes with it.
    pub share: f64,
}

/// The variable that the residual of a link goes with most; `None` where nothing can be compared. Both series run over
/// all recordings.
pub fn most_telling<'a>(
    link: Link,
    residual: &[f64],
    values: impl Fn(Variable) -> Option<&'a [f64]>,
) -> Option<Exposure> {
    let all = link.variables().into_iter().filter_map(|variable| {
        Some(Exposure { variable, share: dependence(residual, values(variable)?, variable.bins()) })
    });
    all.reduce(|best, next| if next.share > best.share + CLEARLY { next } else { best })
}

/// Share of the mean square of `residual` that goes with `variable`, from 0 to 1; samples missing in either are left
/// out.
fn dependence(residual: &[f64], variable: &[f64], bins: usize) -> f64 {
    let both = variable.iter().copied().zip(residual.iter().copied());
    let (values, residuals): (Vec<f64>, Vec<f64>) = both.filter(|(x, r)| x.is_finite() && r.is_finite()).unzip();
    let total: f64 = residuals.iter().map(|r| r * r).sum();
    if total == 0.0 {
        return 0.0;
    }
    let mut classes = vec![(0.0, 0.0); bins];
    for (class, residual) in binned(&values, bins).into_iter().zip(residuals) {
        let (sum, count) = &mut classes[class];
        (*sum, *count) = (*sum + residual, *count + 1.0);
    }
    let taken_off = classes.into_iter().filter(|(_, count)| *count > 0.0).map(|(sum, count)| sum * sum / count);
    taken_off.sum::<f64>() / total
}

/// Number of the bin of each value, below `bins`; bins hold about equally many values, and equal values share one.
pub fn binned(values: &[f64], bins: usize) -> Vec<usize> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let edges: Vec<f64> = (1..bins).map(|k| sorted[k * sorted.len() / bins]).collect();
    values.iter().map(|value| edges.partition_point(|edge| edge <= value)).collect()
}

/// Mean square of the samples that are there; `None` where there are none.
pub fn mean_square(values: &[f64]) -> Option<f64> {
    let squares: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v * v).collect();
    (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64)
}

fn difference(measured: &[f64], simulated: &[f64]) -> Vec<f64> {
    measured.iter().zip(simulated).map(|(measured, simulated)| measured - simulated).collect()
}

/// Rates of a series at one sample.
struct Motion {
    slope: f64,
    curvature: f64,
}

/// First and second derivative at every sample, from the parabola of least squares through its neighbours. At the ends,
/// where neighbours are on one side only, the curvature is NaN: it would be mostly noise.
fn parabolas(time: &[f64], values: &[f64]) -> impl Iterator<Item = Motion> {
    (0..time.len()).map(|k| {
        let window = window(time, k);
        let (slope, curvature) = derivatives(&time[window.clone()], &values[window.clone()], time[k]);
        let at_end = window.start == 0 || window.end == time.len();
        Motion { slope, curvature: if at_end { f64::NAN } else { curvature } }
    })
}

/// Means with the weights that the curvature of a parabola gives to the acceleration; NaN where the sample is missing.
fn smoothed(time: &[f64], values: &[f64]) -> Vec<f64> {
    let mean = |k: usize| {
        let window = window(time, k);
        let steps = (window.len() - 1) as f64;
        // Half a step beyond the outermost samples, as the sums of the discrete weights have it.
        let half = 0.5 * (time[window.end - 1] - time[window.start]) * (1.0 + 1.0 / steps);
        let weight = |j: usize| (1.0 - ((time[j] - time[k]) / half).powi(2)).max(0.0).powi(2);
        let present = || window.clone().filter(|j| values[*j].is_finite());
        present().map(|j| weight(j) * values[j]).sum::<f64>() / present().map(weight).sum::<f64>()
    };
    (0..time.len()).map(|k| if values[k].is_finite() { mean(k) } else { f64::NAN }).collect()
}

/// Positions around a sample that its rates are taken from.
fn window(time: &[f64], k: usize) -> Range<usize> {
    let start = time.partition_point(|t| *t < time[k] - HALF_WINDOW).min(k.saturating_sub(FEWEST_NEIGHBOURS));
    let end = time.partition_point(|t| *t <= time[k] + HALF_WINDOW).max(k + FEWEST_NEIGHBOURS + 1);
    start..end.min(time.len())
}

/// Derivatives at `at` of the parabola of least squares, by orthogonal polynomials on the given times.
fn derivatives(time: &[f64], values: &[f64], at: f64) -> (f64, f64) {
    let mean = |f: &dyn Fn(usize) -> f64| (0..time.len()).map(f).sum::<f64>() / time.len() as f64;
    let middle = mean(&|k| time[k]);
    let t = |k: usize| time[k] - middle;
    let (square, cube) = (mean(&|k| t(k).powi(2)), mean(&|k| t(k).powi(3)));
    // P1 = t, P2 = t² − (cube/square) t − square, orthogonal to each other and to 1.
    let tilt = cube / square;
    let second = |k: usize| t(k).powi(2) - tilt * t(k) - square;
    let linear = mean(&|k| t(k) * values[k]) / square;
    let quadratic = mean(&|k| second(k) * values[k]) / mean(&|k| second(k).powi(2));
    (linear + quadratic * (2.0 * (at - middle) - tilt), 2.0 * quadratic)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;
    use std::path::Path;

    const MASS: f64 = 40.0;

    /// Half a minute of a hanging load in slow sines, simulated by the model itself with some parameters changed.
    fn simulated(changes: &[(&str, f64)]) -> Recording {
        let time: Vec<f64> = (0..3000).map(|k| 0.01 * f64::from(k)).collect();
        let command: Vec<f64> = time.iter().map(|t| 2.0 + 0.6 * (2.1 * t).sin() + 0.3 * (0.7 * t).sin()).collect();
        let text = |replayed: Option<&Replay>| {
            let mut text =
                "time [s],command [V],load_mass [kg],gauge_pressure [Pa],contraction [m],force [N]\n".to_owned();
            for (k, (time, command)) in time.iter().zip(&command).enumerate() {
                let at = |signal| replayed.and_then(|r| r.get(signal)).map_or(2e5, |values| values[k]);
                let [p, x, f] = [Signal::GaugePressure, Signal::Contraction, Signal::Force].map(at);
                let _ = writeln!(text, "{time},{command},{MASS},{p},{x},{f}");
            }
            text
        };
        let read = |text: String| Recording::parse(text.as_bytes(), Path::new("simulated.csv"), &[]).unwrap();
        let mut parameters = Parameters::default();
        changes.iter().for_each(|(name, value)| parameters.set(name, *value).unwrap());
        read(text(Some(&replay(&parameters, &read(text(None))).unwrap())))
    }

    fn residual(recording: &Recording, link: Link) -> Vec<f64> {
        Chain::new(&Parameters::default(), recording).residual(link).unwrap()
    }

    fn exposure_of(link: Link, changes: &[(&str, f64)]) -> Exposure {
        let recording = simulated(changes);
        let values = Variable::ALL.map(|variable| variable.values(&recording));
        let value = |variable| values[Variable::ALL.iter().position(|v| *v == variable)?].as_deref();
        most_telling(link, &residual(&recording, link), value).unwrap()
    }

    fn rms(values: &[f64]) -> f64 {
        mean_square(values).unwrap().sqrt()
    }

    #[test]
    fn equal_values_share_a_bin_and_others_are_spread() {
        assert_eq!(binned(&[0.0, 0.0, 0.0, 0.0, 1.0, 2.0], 3), [1, 1, 1, 1, 2, 2]);
        assert_eq!(binned(&[3.0, 1.0, 2.0], 3), [2, 0, 1]);
    }

    #[test]
    fn what_drifts_under_a_constant_command_does_not_go_with_it() {
        let drift: Vec<f64> = (0..1000).map(|k| (-0.01 * f64::from(k % 250)).exp() - 0.4).collect();
        let stairs: Vec<f64> = (0..1000).map(|k| f64::from(k / 250)).collect();
        let level = drift[..250].iter().sum::<f64>() / 250.0;
        let of_level = level.powi(2) / mean_square(&drift).unwrap();
        assert!((dependence(&drift, &stairs, 20) - of_level).abs() < 1e-12);
        assert!(dependence(&drift, &[1.0; 1000], 20) < of_level + 1e-12);
    }

    #[test]
    fn links_of_a_true_model_have_no_residual() {
        let recording = simulated(&[]);
        // What is left comes from rates of change, which are means over some hundredths of a second.
        for (link, limit) in [(Link::Valve, 50.0), (Link::Muscle, 0.1), (Link::Load, 0.5), (Link::Reading, 2e-5)] {
            let size = rms(&residual(&recording, link));
            assert!(size < limit, "{link:?}: {size}");
        }
    }

    #[test]
    fn an_effect_shows_in_its_own_link_alone() {
        let recording = simulated(&[("payload_mass.additional_mass", 5.0)]);
        let load = residual(&recording, Link::Load);
        assert!((rms(&load) - 5.0 * GRAVITY).abs() < 1.0, "{}", rms(&load));
        assert!(rms(&residual(&recording, Link::Muscle)) < 0.1);
        let recording = simulated(&[("valve_lag.time_constant", 0.1)]);
        assert!(rms(&residual(&recording, Link::Valve)) > 1e3);
        assert!(rms(&residual(&recording, Link::Muscle)) < 0.1);
    }

    #[test]
    fn a_shifted_reading_is_told_in_metres() {
        let recording = simulated(&[("contraction_sensor_offset.offset", 2e-3)]);
        let shift = residual(&recording, Link::Reading);
        assert!((rms(&shift) - 2e-3).abs() < 1e-4, "{}", rms(&shift));
    }

    #[test]
    fn a_slow_valve_goes_with_the_rate_of_pressure() {
        let found = exposure_of(Link::Valve, &[("valve_lag.time_constant", 0.1)]);
        assert_eq!(found.variable, Variable::PressureRate);
        assert!(found.share > 0.95, "{}", found.share);
    }

    #[test]
    fn damping_goes_with_velocity() {
        let changes = [("viscous_damping.contraction", 300.0), ("viscous_damping.extension", 300.0)];
        assert_eq!(exposure_of(Link::Muscle, &changes).variable, Variable::Velocity);
    }

    #[test]
    fn missing_samples_are_left_out() {
        let missing = f64::NAN;
        assert_eq!(mean_square(&[3.0, missing]), Some(9.0));
        assert_eq!(mean_square(&[missing]), None);
        assert_eq!(dependence(&[1.0, missing, -1.0, 1.0], &[1.0, 2.0, missing, 4.0], 2), 1.0);
        assert_eq!(dependence(&[missing], &[1.0], 2), 0.0);
    }

    #[test]
    fn derivatives_of_a_parabola_are_exact_on_uneven_times() {
        let time: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k) + 0.003 * f64::from(k % 3)).collect();
        let values: Vec<f64> = time.iter().map(|t| 1.0 + 2.0 * t - 3.0 * t * t).collect();
        let motion: Vec<Motion> = parabolas(&time, &values).collect();
        assert!((0..200).all(|k| (motion[k].slope - (2.0 - 6.0 * time[k])).abs() < 1e-8));
        assert!((20..180).all(|k| (motion[k].curvature + 6.0).abs() < 1e-6));
        assert!(motion[0].curvature.is_nan());
    }
}
