//! Causes that are in no library, but known well enough to tell how they show: an error of one reading with a course of its own,
//! and of any size. Where one of them explains far more than effects of the library do, these are makeshifts.

use super::residuals::Data;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::simulation::{Replay, slopes};

/// Speeds in m/s above which a measuring wheel may slip.
const SLIPPING: [f64; 7] = [0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.07];
/// Frequencies in Hz at which a post may rock, the first and the last, and the step between them, as a ratio.
const ROCKING: (f64, f64, f64) = (1.5, 12.0, 1.08);
/// Steps to either side of the best of them, fine enough for a post that rocks on for some time.
const FINE_STEPS: i32 = 8;
/// Damping ratios of a post: of the first look, and then.
const DAMPING: f64 = 0.05;
const DAMPINGS: [f64; 4] = [0.01, 0.025, 0.05, 0.1];

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
                Some(lost_way(time, &velocity, direction, speed))
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
        Some(Self { data, simulated: data.replays(data.recordings(), model)? })
    }

    /// What a cause of size one adds to the readings, one value per residual; `None` where it cannot show.
    pub fn by(&self, cause: Unlisted) -> Option<Vec<f64>> {
        let recordings = self.data.recordings().iter().zip(&self.simulated);
        let courses: Vec<Option<Vec<f64>>> =
            recordings.map(|(recording, replay)| cause.course(recording, replay)).collect();
        self.data.at_residuals(cause.signal(), &courses)
    }
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
    fn a_wheel_loses_way_in_one_direction_and_above_a_speed_only() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let velocity = [0.0, -2.0, -2.0, -0.5, 3.0, 3.0];
        assert_eq!(lost_way(&time, &velocity, -1.0, 1.0), [0.0, 1.0, 3.0, 4.0, 4.0, 4.0]);
        assert_eq!(lost_way(&time, &velocity, 1.0, 1.0), [0.0, 0.0, 0.0, 0.0, -1.5, -4.5]);
        assert_eq!(lost_way(&time, &velocity, 0.0, 1.0), [0.0, 1.0, 3.0, 4.0, 2.5, -0.5]);
    }
}
