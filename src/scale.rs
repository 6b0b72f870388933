//! Scales of sensors and of forces, which need be neither straight nor at once what they become.

use std::fmt::Write;

/// Steps of Newton's method to the value behind a reading, which is nearly straight.
const NEWTON_STEPS: usize = 4;

/// By how much a scale is off, over its values and over time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scale {
    /// Value at which the error is stated, the middle of the usual range.
    pub middle: f64,
    /// Relative error there.
    pub relative_error: f64,
    /// Change of the error from the middle to twice that, in proportion to the value.
    pub bend: f64,
    /// A third of the change of the error from the middle to twice that, with the square of the value.
    pub curvature: f64,
    /// Excess of the error at the start, and time constant in s of its settling.
    pub settling: (f64, f64),
}

impl Scale {
    /// y (1 + g + b (r − 1) + c (r² − 1) + s exp(−t/τ)) with r = y/middle, t the time in s since the start.
    #[inline]
    pub fn shown(&self, value: f64, time: f64) -> f64 {
        let ratio = value / self.middle;
        let of_value = self.bend * (ratio - 1.0) + self.curvature * (ratio.powi(2) - 1.0);
        value * (1.0 + self.relative_error + of_value + settled(self.settling, time))
    }

    /// The value behind a reading at a time in s since the start: without a curvature the root of a quadratic that is near to the reading, with one
    /// found from there by Newton's method.
    pub fn behind(&self, reading: f64, time: f64) -> f64 {
        let slope = 1.0 + self.relative_error + settled(self.settling, time) - self.bend;
        let value = 2.0 * reading / (slope + (slope * slope + 4.0 * self.bend / self.middle * reading).max(0.0).sqrt());
        if self.curvature == 0.0 {
            return value;
        }
        (0..NEWTON_STEPS).fold(value, |value, _| value - (self.shown(value, time) - reading) / self.slope(value, time))
    }

    /// Change of what is shown with the value.
    fn slope(&self, value: f64, time: f64) -> f64 {
        let ratio = value / self.middle;
        let of_value = self.bend * (2.0 * ratio - 1.0) + self.curvature * (3.0 * ratio.powi(2) - 1.0);
        1.0 + self.relative_error + of_value + settled(self.settling, time)
    }

    /// Whether it is always right.
    pub fn is_neutral(&self) -> bool {
        [self.relative_error, self.bend, self.curvature, self.settling.0] == [0.0; 4]
    }

    /// Change of the error from the middle to twice that.
    pub fn at_twice(&self) -> f64 {
        self.bend + 3.0 * self.curvature
    }

    /// What a sensor shows at the middle of its range, which is given in words, and what differs from that elsewhere and at the start.
    pub fn told(&self, middle: &str) -> String {
        let word = if self.relative_error < 0.0 { "less" } else { "more" };
        let mut told = format!("{:.1} % {word} than there is", 100.0 * self.relative_error.abs());
        let at_twice = self.at_twice();
        if at_twice != 0.0 {
            let _ = write!(told, " at {middle}, and {:+.1} % on top at twice that", 100.0 * at_twice);
        }
        let (excess, constant) = self.settling;
        if excess != 0.0 {
            let _ = write!(told, ", {:+.1} % on top at the start, which settle within {constant:.1} s", 100.0 * excess);
        }
        told
    }
}

/// What is left at a time in s of an excess at the start that settles with a time constant in s; before the start all of it.
#[inline]
pub fn settled((excess, constant): (f64, f64), time: f64) -> f64 {
    if excess == 0.0 { 0.0 } else { excess * (-time.max(0.0) / constant).exp() }
}

/// The scale of a sensor with such a middle, and how fits look for it where it is off: `SHAPES` are what must end inside its bounds.
macro_rules! forms_of_scale {
    ($prefix:literal, $middle:expr) => {
        fn scale(&self) -> $crate::scale::Scale {
            let Self { relative_error, bend, curvature, settling, settling_time } = *self;
            $crate::scale::Scale {
                middle: $middle,
                relative_error,
                bend,
                curvature,
                settling: (settling, settling_time),
            }
        }

        const FORMS: &'static [&'static [$crate::effects::Freed]] = &[
            &[(concat!($prefix, "relative_error"), &[0.05, -0.05])],
            // A gain alone may be what the coefficients of the muscle stand for.
            &[(concat!($prefix, "bend"), &[0.02]), (concat!($prefix, "relative_error"), &[0.0])],
        ];
        const FURTHER_FORMS: &'static [&'static [$crate::effects::Freed]] = &[&[
            (concat!($prefix, "relative_error"), &[0.05]),
            (concat!($prefix, "settling"), &[0.02, -0.02, 0.02, -0.02]),
            (concat!($prefix, "settling_time"), &[4.0, 4.0, 15.0, 15.0]),
        ]];
        const REFINEMENTS: &'static [$crate::effects::Freed] =
            &[(concat!($prefix, "bend"), &[0.005]), (concat!($prefix, "curvature"), &[0.002])];
        const SHAPES: &'static [&'static str] = &[
            concat!($prefix, "bend"),
            concat!($prefix, "curvature"),
            concat!($prefix, "settling"),
            concat!($prefix, "settling_time"),
        ];
    };
}
pub(crate) use forms_of_scale;

/// What an effect says of itself that is nothing but a scale.
macro_rules! as_its_scale {
    () => {
        fn is_neutral(&self) -> bool {
            self.scale().is_neutral()
        }

        fn own_course(&self, time: f64) -> f64 {
            $crate::scale::settled(self.scale().settling, time)
        }
    };
}
pub(crate) use as_its_scale;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_of_a_bent_scale_is_its_error_at_the_middle_and_at_twice_that() {
        let scale = Scale { middle: 400.0, relative_error: -0.06, bend: 0.01, curvature: -0.02, ..Scale::default() };
        assert!((scale.shown(800.0, 0.0) - 800.0 * (1.0 - 0.06 - 0.05)).abs() < 1e-9);
        assert_eq!(scale.told("400 N"), "6.0 % less than there is at 400 N, and -5.0 % on top at twice that");
    }

    #[test]
    fn what_is_behind_a_reading_shows_it() {
        let bent = Scale { middle: 0.1, relative_error: 0.04, bend: -0.03, settling: (0.05, 2.0), curvature: 0.0 };
        for scale in [bent, Scale { curvature: 0.03, ..bent }, Scale { curvature: -0.02, ..bent }] {
            for (value, time) in [(0.0, 0.0), (0.07, 0.5), (0.21, 30.0)] {
                assert!((scale.behind(scale.shown(value, time), time) - value).abs() < 1e-15, "{scale:?} {value}");
            }
        }
    }
}
