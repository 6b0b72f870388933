//! Causes that are in no library, but known well enough to tell how they show: an error of one reading with a course of its own,
//! and of any size. Where one of them explains far more than effects of the library do, these are makeshifts.

use super::residuals::Data;
use crate::effects::REFERENCE_FORCE;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::{Replay, slopes};

/// Speeds in m/s above which a measuring wheel may slip, the last one and their spacing; and the finer spacing around the best.
const SLIPPING: (f64, f64, f64) = (0.1, 0.01, 0.001);
/// Frequencies in Hz at which a post may rock, the first and the last, and the step between them, as a ratio.
const ROCKING: (f64, f64, f64) = (1.5, 12.0, 1.08);
/// Steps to either side of the best of them, fine enough for a post that rocks on for some time.
const FINE_STEPS: i32 = 8;
/// Damping ratios of a post: of the first look, and then.
const DAMPING: f64 = 0.05;
const DAMPINGS: [f64; 4] = [0.01, 0.025, 0.05, 0.1];

/// Times in s within which the charge of a cell may leak, the first and the last, and the step between them, as a ratio.
const FADING: (f64, f64, f64) = (1.0, 150.0, 1.25);
/// Gauge pressures in Pa, the last one and their spacing, at one of which a hose leaves a sensor alone; and the finer spacing around the best.
const AT_EASE: (f64, f64, f64) = (4e5, 5e4, 5e3);

/// Half widths in m of the play of a sensor's bracket or wire, the first and the last, and the step between them, as a ratio.
const PLAY: (f64, f64, f64) = (2e-4, 1e-2, 1.25);
/// Where the sensor hangs in its play at the start, in half widths.
const HANGING: [f64; 3] = [-1.0, 0.0, 1.0];

/// A cause in no library.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unlisted {
    /// A measuring wheel or belt that loses a share of the way where it moves faster than a speed in m/s: up (1), down (−1) or both (0).
    Slip { direction: f64, speed: f64 },
    /// The line of the command talks into an amplifier.
    CrossTalk(Signal),
    /// The post of the position sensor rocks when the load is accelerated: frequency in Hz, damping ratio.
    Rocking { frequency: f64, damping: f64 },
    /// The charge of a piezoelectric force cell leaks: a share of what the force was is lost within a time in s.
    Fading { time: f64 },
    /// A hose stiffens under pressure and pushes a sensor aside: in proportion to the gauge pressure in Pa above one at which it does not.
    Hose { signal: Signal, at_ease: f64 },
    /// The position sensor follows with play of a half width in m, where it hangs at the `start`; or its bracket gives way so far, in
    /// proportion to the pull.
    Play { half_width: f64, start: f64, with_pull: bool },
}

impl Unlisted {
    /// One of each, in different forms.
    pub fn all() -> Vec<Self> {
        let (last, spacing, _) = SLIPPING;
        let slips = [-1.0, 0.0, 1.0].into_iter().flat_map(|direction| Self::slips(direction, multiples(spacing, last)));
        let talks = [Signal::Force, Signal::Contraction].map(Self::CrossTalk);
        let rocking = steps(ROCKING).map(|frequency| Self::Rocking { frequency, damping: DAMPING });
        let fading = steps(FADING).map(|time| Self::Fading { time });
        let (last, spacing, _) = AT_EASE;
        let hoses = [Signal::Force, Signal::Contraction]
            .into_iter()
            .flat_map(|signal| multiples(spacing, last).map(move |at_ease| Self::Hose { signal, at_ease }));
        let plays = [false, true]
            .into_iter()
            .flat_map(|with_pull| steps(PLAY).map(move |half_width| Self::Play { half_width, start: 0.0, with_pull }));
        slips.chain(talks).chain(rocking).chain(fading).chain(hoses).chain(plays).collect()
    }

    /// Wheels that slip above one of several speeds, as far as they can: all of the way in both directions is a gain.
    fn slips(direction: f64, speeds: impl Iterator<Item = f64>) -> impl Iterator<Item = Self> {
        let can_be = move |speed: &f64| *speed > 0.0 || direction != 0.0 && *speed == 0.0;
        speeds.filter(can_be).map(move |speed| Self::Slip { direction, speed })
    }

    /// Forms between those of [`Self::all`].
    pub fn nearby(self) -> Vec<Self> {
        match self {
            Self::Rocking { frequency, .. } => {
                let all = around(frequency, ROCKING.2)
                    .flat_map(|frequency| DAMPINGS.map(|damping| Self::Rocking { frequency, damping }));
                all.collect()
            }
            Self::Fading { time } => around(time, FADING.2).map(|time| Self::Fading { time }).collect(),
            Self::Slip { direction, speed } => Self::slips(direction, between(speed, SLIPPING)).collect(),
            Self::Hose { signal, at_ease } => {
                between(at_ease, AT_EASE).map(|at_ease| Self::Hose { signal, at_ease }).collect()
            }
            Self::Play { half_width, with_pull, .. } => {
                let all = around(half_width, PLAY.2)
                    .flat_map(|half_width| HANGING.map(|start| Self::Play { half_width, start, with_pull }));
                all.collect()
            }
            Self::CrossTalk(_) => vec![self],
        }
    }

    /// Whether two are the same cause, be it in other forms.
    pub fn is_like(self, other: Self) -> bool {
        match (self, other) {
            (Self::CrossTalk(own), Self::CrossTalk(others)) => own == others,
            (Self::Hose { signal: own, .. }, Self::Hose { signal: others, .. }) => own == others,
            _ => std::mem::discriminant(&self) == std::mem::discriminant(&other),
        }
    }

    /// The reading that it spoils.
    pub fn signal(self) -> Signal {
        match self {
            Self::CrossTalk(signal) | Self::Hose { signal, .. } => signal,
            Self::Fading { .. } => Signal::Force,
            Self::Slip { .. } | Self::Rocking { .. } | Self::Play { .. } => Signal::Contraction,
        }
    }

    /// Smallest and largest size: no wheel gains way nor a cell charge, or loses more than all.
    pub fn sizes(self) -> (f64, f64) {
        match self {
            Self::Slip { .. } | Self::Fading { .. } | Self::Play { with_pull: false, .. } => (0.0, 1.0),
            Self::Play { with_pull: true, .. } => (0.0, f64::INFINITY),
            Self::CrossTalk(_) | Self::Rocking { .. } | Self::Hose { .. } => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    /// How many parameters it has, its size among them.
    pub fn parameters(self) -> usize {
        match self {
            Self::Slip { .. } | Self::Fading { .. } | Self::Hose { .. } => 2,
            Self::CrossTalk(_) => 1,
            Self::Rocking { .. } | Self::Play { .. } => 3,
        }
    }

    /// What the error goes with, in words.
    pub fn on(self) -> &'static str {
        match self {
            Self::Slip { direction, .. } if direction < 0.0 => "the way moved down, as if a measuring wheel slipped",
            Self::Slip { direction, .. } if direction > 0.0 => "the way moved up, as if a measuring wheel slipped",
            Self::Slip { .. } => "the way moved fast, as if a measuring wheel slipped",
            Self::CrossTalk(_) => "the command, as if its line talked into the sensor's",
            Self::Rocking { .. } => "the acceleration, as if the post of the sensor rocked",
            Self::Fading { .. } => "what the force was before, as if the charge of a piezoelectric cell leaked",
            Self::Hose { .. } => "the pressure, as if a hose pushed the sensor",
            Self::Play { .. } => "the way back, as if the sensor followed with play",
        }
    }

    /// Error of the reading at the samples of a recording at size one; `None` where what it goes with is not known.
    fn course(self, recording: &Recording, simulated: &Replay) -> Option<Vec<f64>> {
        let time = &recording.time;
        match self {
            Self::CrossTalk(_) => recording.bridged(Signal::Command),
            Self::Slip { direction, speed } => {
                let velocity = slopes(time, simulated.get(Signal::Contraction)?);
                Some(lost_way(time, &velocity, direction, speed))
            }
            Self::Rocking { frequency, damping } => {
                Some(rocking(time, simulated.get(Signal::Contraction)?, frequency, damping))
            }
            Self::Fading { time: constant } => {
                let remembered = lagging(time, simulated.get(Signal::Force)?, constant);
                Some(remembered.into_iter().map(|force| -force).collect())
            }
            Self::Hose { at_ease, .. } => {
                let measured = || recording.bridged(Signal::GaugePressure);
                let pressures = simulated.get(Signal::GaugePressure).map(<[f64]>::to_vec).or_else(measured)?;
                Some(pressures.into_iter().map(|pressure| pressure - at_ease).collect())
            }
            Self::Play { half_width, start, with_pull } => {
                let lost = lost_in_play(simulated.get(Signal::Contraction)?, half_width, start);
                if !with_pull {
                    return Some(lost);
                }
                let pulls = simulated.get(Signal::Force)?.iter().map(|force| force.max(0.0) / REFERENCE_FORCE);
                Some(lost.into_iter().zip(pulls).map(|(lost, pull)| lost * pull).collect())
            }
        }
    }
}

/// Simulations of a model, and how causes in no library would show beside them.
pub struct Shown<'d> {
    data: &'d Data<'d>,
    simulated: Vec<Replay>,
}

impl<'d> Shown<'d> {
    /// `None` where the model cannot be simulated.
    pub fn beside(data: &'d Data<'d>, model: &Parameters) -> Option<Self> {
        Some(Self { data, simulated: data.replays(model)? })
    }

    /// What a cause of size one adds to the readings, one value per residual; `None` where it cannot show.
    pub fn by(&self, cause: Unlisted) -> Option<Vec<f64>> {
        let recordings = self.data.recordings().iter().zip(&self.simulated);
        let courses: Vec<Option<Vec<f64>>> =
            recordings.map(|(recording, replay)| cause.course(recording, replay)).collect();
        self.data.at_residuals(cause.signal(), &courses)
    }
}

/// Values from a first one to a last one, by a ratio.
fn steps((first, last, ratio): (f64, f64, f64)) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(first), move |value| Some(value * ratio)).take_while(move |value| *value <= last)
}

/// Multiples of a spacing from zero to a last one.
fn multiples(spacing: f64, last: f64) -> impl Iterator<Item = f64> {
    (0..).map(move |k| f64::from(k) * spacing).take_while(move |value| *value <= last)
}

/// Values around one of such multiples, up to the next ones, in the finer spacing.
fn between(value: f64, (_, spacing, fine): (f64, f64, f64)) -> impl Iterator<Item = f64> {
    let steps = (spacing / fine).round() as i32;
    (-steps..=steps).map(move |k| value + f64::from(k) * fine)
}

/// Values around one of such steps, up to the next ones.
fn around(value: f64, ratio: f64) -> impl Iterator<Item = f64> {
    let fine = ratio.powf(1.0 / f64::from(FINE_STEPS));
    (-FINE_STEPS..=FINE_STEPS).map(move |k| value * fine.powi(k))
}

/// What a lag of first order, τ dl/dt + l = y with τ in s, makes of lines between the samples from l = 0 on; exact.
fn lagging(time: &[f64], y: &[f64], constant: f64) -> Vec<f64> {
    let mut lag = 0.0;
    let lags = time.windows(2).zip(y.windows(2)).map(|(time, y)| {
        let behind = constant * (y[1] - y[0]) / (time[1] - time[0]);
        lag = y[1] - behind + (lag - y[0] + behind) * (-(time[1] - time[0]) / constant).exp();
        lag
    });
    std::iter::once(0.0).chain(lags).collect()
}

/// What a reading is off by that misses all of the way which is moved in a direction faster than a speed; integrated by trapezia.
fn lost_way(time: &[f64], velocity: &[f64], direction: f64, speed: f64) -> Vec<f64> {
    let slipping = |v: f64| if v.abs() > speed && v * direction >= 0.0 { -v } else { 0.0 };
    let mut lost = 0.0;
    let sums = time.windows(2).zip(velocity.windows(2)).map(|(time, v)| {
        lost += 0.5 * (time[1] - time[0]) * (slipping(v[0]) + slipping(v[1]));
        lost
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// What a reading is off by that follows with play of a half width, where it hangs at the start in half widths.
fn lost_in_play(x: &[f64], half_width: f64, start: f64) -> Vec<f64> {
    let mut behind = start * half_width;
    let mut before = x[0];
    let lost = x.iter().map(|x| {
        behind = (behind - (x - before)).clamp(-half_width, half_width);
        before = *x;
        behind
    });
    lost.collect()
}

/// Deflection y of a post whose foot is accelerated as x is, ÿ + 2ζωẏ + ω²y = ẍ with ζ < 1, at rest at the start. Where x goes along
/// straight lines between its samples the foot's speed jumps there, and in between the post swings freely: that is exact.
fn rocking(time: &[f64], x: &[f64], frequency: f64, damping: f64) -> Vec<f64> {
    let rate = std::f64::consts::TAU * frequency;
    let (decay, swing) = (damping * rate, rate * (1.0 - damping * damping).sqrt());
    let (mut y, mut speed, mut slope) = (0.0, 0.0, 0.0);
    let swung = (1..time.len()).map(|k| {
        let span = time[k] - time[k - 1];
        let next = (x[k] - x[k - 1]) / span;
        speed += next - slope;
        slope = next;
        let (sine, cosine) = (swing * span).sin_cos();
        let (left, sine) = ((-decay * span).exp(), sine / swing);
        (y, speed) = (
            left * ((cosine + decay * sine) * y + sine * speed),
            left * ((cosine - decay * sine) * speed - rate * rate * sine * y),
        );
        y
    });
    std::iter::once(0.0).chain(swung).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_post_follows_a_swing_as_the_textbook_says() {
        // Steady state under x = sin Ωt: amplitude Ω² / √((ω² − Ω²)² + (2ζωΩ)²).
        let (frequency, damping, swing) = (3.0, 0.1, 2.0 * std::f64::consts::TAU);
        let time: Vec<f64> = (0..4000).map(|k| 5e-3 * f64::from(k)).collect();
        let x: Vec<f64> = time.iter().map(|t| (swing * t).sin()).collect();
        let rate = std::f64::consts::TAU * frequency;
        let expected = swing.powi(2) / (rate.powi(2) - swing.powi(2)).hypot(2.0 * damping * rate * swing);
        let largest = rocking(&time, &x, frequency, damping)[3000..].iter().fold(0.0, |most: f64, y| most.max(y.abs()));
        assert!((largest - expected).abs() < 0.01 * expected, "{largest} {expected}");
    }

    #[test]
    fn a_post_that_was_knocked_swings_on_by_itself() {
        // From the start on the foot moves with 1 m/s: y = e^(−ζωt) sin(ω_d t) / ω_d.
        let (frequency, damping) = (2.5, 0.05);
        let time: Vec<f64> = (0..200).map(|k| 1e-2 * f64::from(k) + 2e-3 * f64::from(k % 3)).collect();
        let rate = std::f64::consts::TAU * frequency;
        let swing = rate * f64::sqrt(1.0 - damping * damping);
        for (t, y) in time.iter().zip(rocking(&time, &time, frequency, damping)) {
            let expected = (-damping * rate * t).exp() * (swing * t).sin() / swing;
            assert!((y - expected).abs() < 1e-12, "{t} s: {y} {expected}");
        }
    }

    #[test]
    fn a_lag_of_a_ramp_is_as_the_textbook_says() {
        // l = t − τ (1 − e^(−t/τ)) under y = t; under a constant y its part 1 − e^(−t/τ).
        let time: Vec<f64> = (0..200).map(|k| 5e-2 * f64::from(k) + 1e-2 * f64::from(k % 3)).collect();
        let y: Vec<f64> = time.iter().map(|t| 3.0 + t).collect();
        for (t, lag) in time.iter().zip(lagging(&time, &y, 2.0)) {
            let of_step = 1.0 - (-t / 2.0).exp();
            assert!((lag - (t - 2.0 * of_step + 3.0 * of_step)).abs() < 1e-12, "{t} s");
        }
    }

    #[test]
    fn what_has_play_rests_on_the_way_back() {
        let x = [0.0, 0.5, 3.0, 2.0, 1.5, 0.0, 0.5];
        let shown =
            |start| -> Vec<f64> { x.iter().zip(lost_in_play(&x, 1.0, start)).map(|(x, lost)| x + lost).collect() };
        assert_eq!(shown(0.0), [0.0, 0.0, 2.0, 2.0, 2.0, 1.0, 1.0]);
        assert_eq!(shown(-1.0), [-1.0, -0.5, 2.0, 2.0, 2.0, 1.0, 1.0]);
    }

    #[test]
    fn a_wheel_loses_way_in_one_direction_and_above_a_speed_only() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let velocity = [0.0, -2.0, -2.0, -0.5, 3.0, 3.0];
        assert_eq!(lost_way(&time, &velocity, -1.0, 1.0), [0.0, 1.0, 3.0, 4.0, 4.0, 4.0]);
        assert_eq!(lost_way(&time, &velocity, 1.0, 1.0), [0.0, 0.0, 0.0, 0.0, -1.5, -4.5]);
        assert_eq!(lost_way(&time, &velocity, 0.0, 1.0), [0.0, 1.0, 3.0, 4.0, 2.5, -0.5]);
    }
}
