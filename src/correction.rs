//! A correction without a cause: what to add to a model where something is wrong that no effect accounts for.

use crate::effects::Point;
use crate::variables::{Choice, Declared, Kind, Scalar};

/// Number of polynomials per variable.
const ORDER: usize = 4;
/// Number of coefficients.
pub const COEFFICIENTS: usize = ORDER * ORDER;

macro_rules! choices {
    ($(#[$attribute:meta])* $Name:ident { $($Variant:ident = $number:literal, $name:literal, $description:literal;)* }) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $Name {
            $(#[doc = $description] $Variant = $number,)*
        }

        impl $Name {
            /// All choices, in the order of their numbers.
            pub const CHOICES: &'static [Choice] = &[$(Choice { name: $name, description: $description },)*];
            const NUMBERS: std::ops::RangeInclusive<f64> = 1.0..=Self::CHOICES.len() as f64;

            /// Name as written in files.
            pub fn name(self) -> &'static str {
                Self::CHOICES[self as usize - 1].name
            }
        }

        impl Scalar for $Name {
            const KIND: Kind = Kind::Enumeration(stringify!($Name), Self::CHOICES);
            fn to_number(self) -> f64 {
                f64::from(self as i32)
            }
            fn from_number(number: f64) -> Self {
                let all = [$(Self::$Variant),*];
                all.into_iter().find(|choice| choice.to_number() == number).unwrap_or(all[0])
            }
        }
    };
}

choices! {
    /// What a correction is added to.
    ActsOn {
        Nothing = 1, "nothing", "no correction";
        Force = 2, "force", "the pull of the muscle";
        TargetPressure = 3, "target_pressure", "the gauge pressure that the valve goes for";
    }
}

choices! {
    /// What a correction depends on.
    Quantity {
        Contraction = 1, "contraction", "the contraction, in units of 0.1 m";
        ContractionVelocity = 2, "contraction_velocity", "the rate of the contraction, in units of 0.1 m/s";
        GaugePressure = 3, "gauge_pressure", "the gauge pressure in the muscle, in units of 1 bar";
        CommandedPressure = 4, "commanded_pressure", "the gauge pressure that the command asks for, in units of 1 bar";
    }
}

impl Quantity {
    /// What counts as one unit, SI.
    pub fn unit(self) -> f64 {
        match self {
            Quantity::Contraction | Quantity::ContractionVelocity => 0.1,
            Quantity::GaugePressure | Quantity::CommandedPressure => 1e5,
        }
    }

    fn of(self, at: &Point) -> f64 {
        let value = match self {
            Quantity::Contraction => at.contraction,
            Quantity::ContractionVelocity => at.contraction_velocity,
            Quantity::GaugePressure => at.gauge_pressure,
            Quantity::CommandedPressure => at.commanded_pressure,
        };
        value / self.unit()
    }
}

crate::variables::variables! {
    /// A smooth function of two variables that is added to the force or to the target pressure. It explains nothing.
    ///
    /// # Model
    /// Σ c_ij T_i(a) T_j(b) with Chebyshev polynomials T and the two variables scaled from their ranges to −1..1;
    /// outside the ranges the value at the edge holds. A force knows of no command: there the gauge pressure counts for the commanded one.
    ///
    /// # Validity
    /// Where the recordings were that it was fitted to, and nowhere else.
    pub struct UnknownCause in "unknown_cause." as Tunable {
        /// What the correction is added to
        acts_on: ActsOn = ActsOn::Nothing, ONE, (ActsOn::NUMBERS);
        /// First variable
        first: Quantity = Quantity::Contraction, ONE, (Quantity::NUMBERS);
        /// Second variable
        second: Quantity = Quantity::GaugePressure, ONE, (Quantity::NUMBERS);
        /// Lower end of the range of the first variable, in its unit
        first_low: f64 = 0.0, ONE, (-100.0..=100.0);
        /// Upper end of the range of the first variable, in its unit
        first_high: f64 = 2.0, ONE, (-100.0..=100.0);
        /// Lower end of the range of the second variable, in its unit
        second_low: f64 = 0.0, ONE, (-100.0..=100.0);
        /// Upper end of the range of the second variable, in its unit
        second_high: f64 = 4.0, ONE, (-100.0..=100.0);
        /// Constant, in units of 100 N or 0.1 bar, as all coefficients
        c00: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T1 of the second variable
        c01: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T2 of the second variable
        c02: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T3 of the second variable
        c03: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T1 of the first variable
        c10: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T1 of the first times T1 of the second variable
        c11: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T1 of the first times T2 of the second variable
        c12: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T1 of the first times T3 of the second variable
        c13: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T2 of the first variable
        c20: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T2 of the first times T1 of the second variable
        c21: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T2 of the first times T2 of the second variable
        c22: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T2 of the first times T3 of the second variable
        c23: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T3 of the first variable
        c30: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T3 of the first times T1 of the second variable
        c31: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T3 of the first times T2 of the second variable
        c32: f64 = 0.0, ONE, (-1e3..=1e3);
        /// Coefficient of T3 of the first times T3 of the second variable
        c33: f64 = 0.0, ONE, (-1e3..=1e3);
    }
}

/// What a coefficient of one adds to the force, N.
const FORCE_UNIT: f64 = 100.0;
/// What a coefficient of one adds to the target pressure, Pa.
const PRESSURE_UNIT: f64 = 1e4;

impl UnknownCause {
    /// Whether it changes nothing, whatever its coefficients are.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.acts_on == ActsOn::Nothing
    }

    /// The force in N with the correction.
    #[inline]
    pub(crate) fn force(&self, at: &Point, force: f64) -> f64 {
        if self.acts_on != ActsOn::Force {
            return force;
        }
        // What the muscle pulls with goes with what is in it, whatever the command asks for.
        force + FORCE_UNIT * self.value(&Point { commanded_pressure: at.gauge_pressure, ..*at })
    }

    /// The target pressure in Pa with the correction.
    #[inline]
    pub(crate) fn target_pressure(&self, at: &Point, target: f64) -> f64 {
        if self.acts_on == ActsOn::TargetPressure { target + PRESSURE_UNIT * self.value(at) } else { target }
    }

    fn value(&self, at: &Point) -> f64 {
        let first = polynomials(self.first.of(at), self.first_low, self.first_high);
        let second = polynomials(self.second.of(at), self.second_low, self.second_high);
        let coefficients = self.coefficients();
        (0..COEFFICIENTS).map(|k| coefficients[k] * first[k / ORDER] * second[k % ORDER]).sum()
    }

    /// The coefficients, those of one polynomial of the first variable after the other.
    pub fn coefficients(&self) -> [f64; COEFFICIENTS] {
        [
            self.c00, self.c01, self.c02, self.c03, self.c10, self.c11, self.c12, self.c13, self.c20, self.c21,
            self.c22, self.c23, self.c30, self.c31, self.c32, self.c33,
        ]
    }

    /// With other coefficients, kept within their bounds.
    #[must_use]
    pub fn with_coefficients(mut self, coefficients: &[f64]) -> Self {
        let mut rest = coefficients.iter();
        self.visit_mut(&mut |variable, old| {
            let is_one = variable.name.starts_with("unknown_cause.c");
            if is_one { rest.next().map_or(old, |new| new.clamp(variable.min, variable.max)) } else { old }
        });
        self
    }
}

/// Chebyshev polynomials of a value scaled from its range to −1..1.
fn polynomials(value: f64, low: f64, high: f64) -> [f64; ORDER] {
    let span = high - low;
    let x = if span > 0.0 { (2.0 * (value - low) / span - 1.0).clamp(-1.0, 1.0) } else { 0.0 };
    [1.0, x, 2.0 * x * x - 1.0, x * (4.0 * x * x - 3.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_those_of_chebyshev_and_end_at_the_range() {
        for angle in [0.3_f64, 1.1, 2.5] {
            let values = polynomials(3.0 + angle.cos(), 2.0, 4.0);
            values.iter().enumerate().for_each(|(n, value)| assert!((value - (n as f64 * angle).cos()).abs() < 1e-12));
        }
        assert_eq!(polynomials(9.0, 2.0, 4.0), [1.0; 4]);
    }

    #[test]
    fn coefficients_come_back() {
        let coefficients: Vec<f64> = (0..16).map(f64::from).collect();
        assert_eq!(UnknownCause::default().with_coefficients(&coefficients).coefficients()[..], coefficients);
    }
}
