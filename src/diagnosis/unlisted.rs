//! Causes that are in no library, but known well enough to tell how they show: an error of one reading with a course of its own,
//! and of any size. Where one of them explains far more than effects of the library do, these are makeshifts.

use super::residuals::Data;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::{Replay, replay_within, slopes};

/// Speeds in m/s above which a measuring wheel may slip.
const SLIPPING: [f64; 7] = [0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.07];
/// Frequencies in Hz at which a post may rock, the first and the last, and the step between them, as a ratio.
const ROCKING: (f64, f64, f64) = (1.5, 12.0, 1.08);
/// Steps to either side of the best of them, fine enough for a post that rocks on for some time.
const FINE_STEPS: i32 = 8;
/// Damping ratios of a post: of the first look, and then.
const DAMPING: f64 = 0.05;
const DAMPINGS: [f64; 4] = [0.01, 0.025, 0.05, 0.1];
/// Longest step in radians of the oscillation with which a post is simulated.
const LONGEST_STEP: f64 = 0.1;

/// A cause in no library.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unlisted {
    /// A measuring wheel or belt that loses a share of the way where it moves faster than a speed in m/s: up (1), down (−1) or both (0).
    Slip { direction: f64, speed: f64 },
    /// The line of the command talks into an amplifier.
    CrossTalk(Signal),
    /// The post of the position sensor rocks when the load is accelerated: frequency in Hz, damping ratio.
    Rocking { frequency: f64, damping: f64 },
}

impl Unlisted {
    /// One of each, in different forms.
    pub fn all() -> Vec<Self> {
        let slips = [-1.0, 0.0, 1.0].into_iter().flat_map(|direction| {
            // All of the way in both directions is a gain.
            let speeds = SLIPPING.into_iter().filter(move |speed| direction != 0.0 || *speed > 0.0);
            speeds.map(move |speed| Self::Slip { direction, speed })
        });
        let talks = [Signal::Force, Signal::Contraction].map(Self::CrossTalk);
        let (lowest, highest, ratio) = ROCKING;
        let frequencies =
            std::iter::successors(Some(lowest), move |f| Some(f * ratio)).take_while(move |f| *f <= highest);
        let rocking = frequencies.map(|frequency| Self::Rocking { frequency, damping: DAMPING });
        slips.chain(talks).chain(rocking).collect()
    }

    /// Forms between those of [`Self::all`].
    pub fn nearby(self) -> Vec<Self> {
        match self {
            Self::Rocking { frequency, .. } => {
                let fine = ROCKING.2.powf(1.0 / f64::from(FINE_STEPS));
                let all = (-FINE_STEPS..=FINE_STEPS).flat_map(|k| {
                    DAMPINGS.map(|damping| Self::Rocking { frequency: frequency * fine.powi(k), damping })
                });
                all.collect()
            }
            _ => vec![self],
        }
    }

    /// Whether two are the same cause, be it in other forms.
    pub fn is_like(self, other: Self) -> bool {
        match (self, other) {
            (Self::CrossTalk(own), Self::CrossTalk(others)) => own == others,
            _ => std::mem::discriminant(&self) == std::mem::discriminant(&other),
        }
    }

    /// The reading that it spoils.
    pub fn signal(self) -> Signal {
        if let Self::CrossTalk(signal) = self { signal } else { Signal::Contraction }
    }

    /// Smallest and largest size: no wheel gains way, or loses more than all.
    pub fn sizes(self) -> (f64, f64) {
        if matches!(self, Self::Slip { .. }) { (0.0, 1.0) } else { (f64::NEG_INFINITY, f64::INFINITY) }
    }

    /// How many parameters it has, its size among them.
    pub fn parameters(self) -> usize {
        match self {
            Self::Slip { .. } => 2,
            Self::CrossTalk(_) => 1,
            Self::Rocking { .. } => 3,
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
        }
    }

    /// Error of the reading at the samples of a recording at size one; `None` where what it goes with is not known.
    fn course(self, recording: &Recording, simulated: &Replay) -> Option<Vec<f64>> {
        let time = &recording.time;
        match self {
            Self::CrossTalk(_) => recording.bridged(Signal::Command),
            Self::Slip { direction, speed } => {
                let velocity = slopes(time, simulated.get(Signal::Contraction)?);
                let slips = |v: f64| v.abs() > speed && v * direction >= 0.0;
                let lost = velocity.iter().map(|v| if slips(*v) { -*v } else { 0.0 });
                Some(integral(time, &lost.collect::<Vec<_>>()))
            }
            Self::Rocking { frequency, damping } => {
                Some(rocking(time, simulated.get(Signal::Contraction)?, frequency, damping))
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
        let replayed = data.recordings().iter().map(|recording| replay_within(model, recording, data.integration).ok());
        Some(Self { data, simulated: replayed.collect::<Option<_>>()? })
    }

    /// What a cause of size one adds to the readings, one value per residual; `None` where it cannot show.
    pub fn by(&self, cause: Unlisted) -> Option<Vec<f64>> {
        let recordings = self.data.recordings().iter().zip(&self.simulated);
        let courses: Vec<Option<Vec<f64>>> =
            recordings.map(|(recording, replay)| cause.course(recording, replay)).collect();
        self.data.at_residuals(cause.signal(), &courses)
    }
}

/// Integral over time by trapezia, zero at the start.
fn integral(time: &[f64], rate: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps =
        time.windows(2).zip(rate.windows(2)).map(|(time, rate)| 0.5 * (time[1] - time[0]) * (rate[0] + rate[1]));
    let sums = steps.map(|step| {
        sum += step;
        sum
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// Deflection y of a post whose foot is accelerated as x is, ÿ + 2ζωẏ + ω²y = ẍ, at rest at the start. With z = y − x no derivative of x
/// is needed but its slope between samples; steps of Runge and Kutta's fourth order.
fn rocking(time: &[f64], x: &[f64], frequency: f64, damping: f64) -> Vec<f64> {
    let rate = std::f64::consts::TAU * frequency;
    let (mut z, mut speed) = (-x[0], 0.0);
    // From rest z = −x would be kept in place by x alone.
    let mut deflections = vec![0.0];
    for k in 1..time.len() {
        let span = time[k] - time[k - 1];
        let slope = (x[k] - x[k - 1]) / span;
        let steps = (rate * span / LONGEST_STEP).ceil().max(1.0);
        let step = span / steps;
        let acceleration = |after: f64, z: f64, speed: f64| {
            -2.0 * damping * rate * (speed + slope) - rate * rate * (z + x[k - 1] + slope * after)
        };
        let mut after = 0.0;
        while after < span - 0.5 * step {
            let half = 0.5 * step;
            let (v1, a1) = (speed, acceleration(after, z, speed));
            let (v2, a2) = (speed + half * a1, acceleration(after + half, z + half * v1, speed + half * a1));
            let (v3, a3) = (speed + half * a2, acceleration(after + half, z + half * v2, speed + half * a2));
            let (v4, a4) = (speed + step * a3, acceleration(after + step, z + step * v3, speed + step * a3));
            z += step / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            speed += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            after += step;
        }
        deflections.push(z + x[k]);
    }
    deflections
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
    fn a_wheel_loses_way_in_one_direction_only() {
        let time = [0.0, 1.0, 2.0, 3.0];
        assert_eq!(integral(&time, &[0.0, 2.0, 2.0, 0.0]), [0.0, 1.0, 3.0, 4.0]);
    }
}
