//! Zeros of sensors and of the valve, which need not stay where they are while one records.

use crate::effects::{each_for, of_recording, told_anew};
use crate::scale::settled;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Period in s of the fastest swing that is still a zero's, and not a signal.
pub(crate) const FASTEST: f64 = 8.0;
/// Time constant in s of the fastest settling: what is over sooner is how the recording starts.
const FASTEST_SETTLING: f64 = 1.0;
/// Period in s of the slowest swing.
pub(crate) const SLOWEST: f64 = 1000.0;

/// How a zero goes on over time, in the unit of the offset.
pub struct Course {
    /// The most that any of its parts can be.
    pub most: f64,
    /// Where it stays when nothing else is at work.
    pub offset: f64,
    /// By how much it is higher in the second and in the third recording.
    pub anew: [f64; 2],
    /// Which recording it is, from 1.
    pub recording: f64,
    /// Excess at the start, and time constant in s of its settling.
    pub settling: (f64, f64),
    /// Amplitude by which it swings, period in s and phase in rad at the start.
    pub swing: (f64, f64, f64),
    /// By how much it shifts once and for all in each recording, time in s of the middle of that, and how long in s it takes.
    pub shifts: ([f64; 3], f64, f64),
}

impl Course {
    /// o + o_k + s exp(−t/τ) + a sin(2π t/T + φ) + the j of earlier recordings + j_k times how far a ramp over d around t_j has come; before the
    /// start as there.
    #[inline]
    pub fn at(&self, time: f64) -> f64 {
        let time = time.max(0.0);
        let (swing, period, phase) = self.swing;
        let mut zero = self.offset + of_recording(self.recording, self.anew) + settled(self.settling, time);
        if swing != 0.0 {
            zero += swing * (TAU * time / period + phase).sin();
        }
        if self.shifts() {
            zero += self.shifted(time);
        }
        zero
    }

    /// By how much it has shifted.
    fn shifted(&self, time: f64) -> f64 {
        let ([first, second, third], middle, lasts) = self.shifts;
        let (before, now) = match self.recording {
            ..1.5 => (0.0, first),
            ..2.5 => (first, second),
            ..3.5 => (first + second, third),
            _ => (first + second + third, 0.0),
        };
        before + now * ((time - middle) / lasts + 0.5).clamp(0.0, 1.0)
    }

    /// Whether it stays where it is.
    pub fn is_constant(&self) -> bool {
        self.settling.0 == 0.0 && self.swing.0 == 0.0 && !self.shifts()
    }

    /// Whether it shifts in any recording.
    fn shifts(&self) -> bool {
        self.shifts.0 != [0.0; 3]
    }

    /// Whether it is always right.
    pub fn is_neutral(&self) -> bool {
        self.offset == 0.0 && self.anew == [0.0; 2] && self.is_constant()
    }

    /// Whether its parts are such as zeros have: inside their bounds, and slow.
    pub fn is_plausible(&self) -> bool {
        let ((settling, constant), (swing, period, _)) = (self.settling, self.swing);
        let [second, third] = self.anew;
        let are_inside =
            [settling, swing, second, third].iter().chain(&self.shifts.0).all(|part| part.abs() < self.most);
        let settles_slowly = settling == 0.0 || constant > FASTEST_SETTLING;
        are_inside && settles_slowly && (swing == 0.0 || (period > FASTEST && period < SLOWEST))
    }

    /// What follows a sentence about the offset, whose amounts are told with their unit; nothing of what is too small to be told.
    pub fn told(&self, amount: impl Fn(f64) -> String) -> String {
        let (settling, constant) = self.settling;
        let (swing, period, _) = self.swing;
        let (shifts, middle, _) = self.shifts;
        let shows = |value: f64| amount(value).contains(|digit: char| ('1'..='9').contains(&digit));
        let anew = |own, recording: &str| format!(", {} in the {recording} recording", amount(self.offset + own));
        let mut told =
            told_anew(self.anew, |own, recording| if shows(own) { anew(own, recording) } else { String::new() });
        if shows(settling) {
            let _ = write!(told, ", {} on top at the start, which settles within {constant:.1} s", amount(settling));
        }
        if shows(swing) {
            let either_way = amount(swing).replace('+', "±");
            let _ = write!(told, ", swinging by {either_way} with a period of {period:.0} s");
        }
        for (shift, recording) in shifts.into_iter().zip(["", " of the second recording", " of the third recording"]) {
            if shows(shift) {
                let _ = write!(told, ", shifted by {} from {middle:.1} s{recording} on", amount(shift));
            }
        }
        told
    }
}

/// The form of a zero that shifts once, by the parameter of a name, from an offset of a usual size.
macro_rules! shifts_once {
    ($prefix:literal, $shift:literal, $size:literal) => {
        &[
            (concat!($prefix, "offset"), &[$size]),
            (concat!($prefix, $shift), &$crate::zero::either_way(0.2 * $size)),
            (concat!($prefix, "shift_time"), $crate::zero::TIMES),
            (concat!($prefix, "shift_span"), &[2.0]),
        ]
    };
}
pub(crate) use shifts_once;

/// Parameters of an offset with its course over time, and how fits look for them from an offset of a usual size.
macro_rules! zero {
    (
        $(#[$attribute:meta])*
        pub struct $Struct:ident in $prefix:literal from $size:literal {
            #[doc = $description:literal]
            offset: $unit:ident, $most:literal;
        }
    ) => {
        $crate::variables::variables! {
            $(#[$attribute])*
            pub struct $Struct in $prefix as Tunable {
                #[doc = $description]
                offset: f64 = 0.0, $unit, (-$most..=$most);
                /// By how much the offset is higher in the second of several recordings
                second: f64 = 0.0, $unit, (-$most..=$most), of 2;
                /// By how much it is higher in the third
                third: f64 = 0.0, $unit, (-$most..=$most), of 3;
                /// Which of the recordings is simulated: from the fourth on as the first
                recording: f64 = 1.0, ONE, (1.0..=1000.0);
                /// Excess of the offset at the start, which settles
                settling: f64 = 0.0, $unit, (-$most..=$most);
                /// Time constant of the settling
                settling_time: f64 = 10.0, SECOND, (0.5..=1000.0);
                /// Amplitude by which the offset swings, as an air conditioner makes it
                swing: f64 = 0.0, $unit, (0.0..=$most);
                /// Period of the swing
                swing_period: f64 = 30.0, SECOND, ($crate::zero::FASTEST..=$crate::zero::SLOWEST);
                /// Phase of the swing at the start, in rad
                swing_phase: f64 = 0.0, ONE, (-10.0..=10.0);
                /// By how much the offset shifts once, as after a shock, in the first of several recordings
                shift: f64 = 0.0, $unit, (-$most..=$most), since 1;
                /// By how much it shifts in the second
                second_shift: f64 = 0.0, $unit, (-$most..=$most), since 2;
                /// By how much it shifts in the third
                third_shift: f64 = 0.0, $unit, (-$most..=$most), since 3;
                /// When it shifts: the middle of the shift
                shift_time: f64 = 10.0, SECOND, (0.0..=10000.0);
                /// How long the shift takes
                shift_span: f64 = 0.1, SECOND, (0.01..=10.0);
            }
        }

        impl $Struct {
            const CONSTANT: &'static [$crate::effects::Freed] = &[(concat!($prefix, "offset"), &[$size, -$size])];
            /// Set anew in the second recording.
            const OF_TWO: &'static [$crate::effects::Freed] =
                &[(concat!($prefix, "offset"), &[$size]), (concat!($prefix, "second"), &[$size, -2.0 * $size])];
            /// Set anew in the second recording and in the third.
            const OF_THREE: &'static [$crate::effects::Freed] = &[
                (concat!($prefix, "offset"), &[$size]),
                (concat!($prefix, "second"), &[$size, -2.0 * $size]),
                (concat!($prefix, "third"), &[-$size]),
            ];
            const FURTHER_FORMS: &'static [&'static [$crate::effects::Freed]] = &[
                &[
                    (concat!($prefix, "offset"), &[$size]),
                    (concat!($prefix, "swing"), &[0.1 * $size]),
                    (concat!($prefix, "swing_period"), $crate::zero::PERIODS),
                    (concat!($prefix, "swing_phase"), $crate::zero::PHASES),
                ],
                $crate::zero::shifts_once!($prefix, "shift", $size),
                $crate::zero::shifts_once!($prefix, "second_shift", $size),
                $crate::zero::shifts_once!($prefix, "third_shift", $size),
            ];
            const REFINEMENTS: &'static [$crate::effects::Freed] =
                &[(concat!($prefix, "settling"), &[0.3 * $size]), (concat!($prefix, "settling_time"), &[5.0])];

            fn course(&self) -> $crate::zero::Course {
                $crate::zero::Course {
                    most: $most,
                    offset: self.offset,
                    anew: [self.second, self.third],
                    recording: self.recording,
                    settling: (self.settling, self.settling_time),
                    swing: (self.swing, self.swing_period, self.swing_phase),
                    shifts: ([self.shift, self.second_shift, self.third_shift], self.shift_time, self.shift_span),
                }
            }
        }
    };
}
pub(crate) use zero;

/// What an effect says of itself that is nothing but its course over time.
macro_rules! as_its_course {
    () => {
        fn is_neutral(&self) -> bool {
            self.course().is_neutral()
        }

        fn is_plausible(&self) -> bool {
            self.course().is_plausible()
        }

        fn own_course(&self, time: f64) -> f64 {
            self.course().at(time)
        }
    };
}
pub(crate) use as_its_course;

/// Where fits of a swing start: periods in s, each with four phases.
pub(crate) const PERIODS: &[f64] = &each_for::<20>(&[10.0, 16.0, 25.0, 40.0, 65.0], 4);
pub(crate) const PHASES: &[f64] = &each_for::<20>(&[0.0, 1.5, 3.0, -1.5], 1);
/// Where fits of a shift start: times in s, each twice.
pub(crate) const TIMES: &[f64] =
    &each_for::<32>(&[3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 21.0, 24.0, 27.0, 30.0, 34.0, 38.0, 43.0, 50.0, 60.0, 75.0], 2);

/// A shift up and one down for each of these times.
pub(crate) const fn either_way(size: f64) -> [f64; TIMES.len()] {
    each_for(&[size, -size], 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_shifted_stays_so_in_the_recordings_that_follow() {
        let course = |recording, shifts| Course {
            most: 1.0,
            offset: 0.5,
            anew: [0.0; 2],
            recording,
            settling: (0.0, 1.0),
            swing: (0.0, 1.0, 0.0),
            shifts: (shifts, 3.0, 0.1),
        };
        let ends = |recording, shifts| [0.0, 9.0].map(|time| course(recording, shifts).at(time));
        let each = |shifts| [1.0, 2.0, 3.0, 4.0].map(|recording| ends(recording, shifts));
        assert_eq!(each([0.25, 0.0, 0.0]), [[0.5, 0.75], [0.75, 0.75], [0.75, 0.75], [0.75, 0.75]]);
        assert_eq!(each([0.0, 0.25, 0.0]), [[0.5, 0.5], [0.5, 0.75], [0.75, 0.75], [0.75, 0.75]]);
        assert_eq!(each([0.0, 0.0, -0.25]), [[0.5, 0.5], [0.5, 0.5], [0.5, 0.25], [0.25, 0.25]]);
    }
}
