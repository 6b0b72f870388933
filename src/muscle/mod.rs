//! The muscle at rest and its static force models, one file per model.

use crate::variables::{Choice, Kind, Scalar};
use std::f64::consts::PI;

crate::variables::variables! {
    /// The muscle: its braid at rest, its damping, and which force model holds.
    ///
    /// # Model
    /// A thread of length b winds n times around a cylinder of length L and diameter D:
    /// L = b cos θ, D = b sin θ / (n π), so D = √(b² − L²) / (n π).
    ///
    /// # Reference
    /// Thesis eqs. 3.4–3.5; n = 3.5, b = 1.0877 m, θ₀ = 25.7° from section 4.3.3.
    pub struct Muscle in "muscle." as Tunable {
        /// Which static force model is used
        force_model: ForceModelName = ForceModelName::VirtualArea, ONE, (ForceModelName::NUMBERS);
        /// Length at rest
        rest_length: f64 = 0.980_101_476, METRE, (0.02..=10.0);
        /// Length of one thread of the braid
        thread_length: f64 = 1.0877, METRE, (0.02..=12.0);
        /// Turns of one thread around the muscle
        turns: f64 = 3.5, ONE, (0.05..=100.0);
        /// Viscous damping inside the muscle
        damping: f64 = 80.0, NEWTON_SECOND_PER_METRE, (0.0..=1e5);
        /// Correction of the virtual area: this muscle against the coefficients
        area_scale: f64 = 1.0, ONE, (0.1..=10.0);
        /// Correction of the elastic force: this muscle against the coefficients
        elastic_scale: f64 = 1.0, ONE, (0.1..=10.0);
        /// Correction of the virtual area that grows with contraction
        area_tilt: f64 = 0.0, ONE, (-1.0..=1.0);
        /// Correction of the virtual area in the middle of the stroke against its ends
        area_bend: f64 = 0.0, ONE, (-1.0..=1.0);
        /// Correction of the elastic force that grows with contraction
        elastic_tilt: f64 = 0.0, ONE, (-1.0..=1.0);
    }
}

impl Muscle {
    /// Diameter in m of the braid at a contraction in m.
    ///
    /// NaN where the muscle would be longer than its thread.
    pub fn diameter(&self, contraction: f64) -> f64 {
        let length = self.rest_length - contraction;
        (self.thread_length.powi(2) - length.powi(2)).sqrt() / (self.turns * PI)
    }

    /// Place within the stroke: -1 at rest length, 1 at a quarter of it, which no FESTO muscle exceeds by much.
    #[inline]
    fn stroke(&self, contraction: f64) -> f64 {
        8.0 * contraction / self.rest_length - 1.0
    }

    /// Factor on the virtual area at a contraction in m: Legendre polynomials over the stroke.
    #[inline]
    fn area_correction(&self, contraction: f64) -> f64 {
        let stroke = self.stroke(contraction);
        self.area_scale + self.area_tilt * stroke + self.area_bend * (1.5 * stroke * stroke - 0.5)
    }

    /// Factor on the elastic force at a contraction in m.
    #[inline]
    fn elastic_correction(&self, contraction: f64) -> f64 {
        self.elastic_scale + self.elastic_tilt * self.stroke(contraction)
    }

    /// Volume in m³ of the braid, taken as a cylinder, at a contraction in m (thesis eq. 3.6).
    pub fn volume(&self, contraction: f64) -> f64 {
        PI / 4.0 * self.diameter(contraction).powi(2) * (self.rest_length - contraction)
    }
}

/// A static force model: F = F_p(p, x, v) + F_e(x), the pull of the pressure, and that of the membrane without pressure.
///
/// For most models the pressure works on an area that depends on the contraction alone, F_p = p A(x); these give A and
/// F_e, and no more.
pub trait ForceModel {
    /// Virtual area A = ∂F/∂p in m² of the resting muscle at a gauge pressure in Pa and a contraction in m: newtons gained
    /// per pascal. Without elasticity it is −dV/dL.
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64;

    /// Force in N without pressure at a contraction in m; negative where the membrane resists shortening.
    fn elastic_force(&self, muscle: &Muscle, contraction: f64) -> f64;

    /// Pull in N of a gauge pressure in Pa at a contraction in m and its rate in m/s; none without pressure.
    #[inline]
    fn pressure_force(
        &self,
        muscle: &Muscle,
        gauge_pressure: f64,
        contraction: f64,
        _contraction_velocity: f64,
    ) -> f64 {
        gauge_pressure * self.virtual_area(muscle, gauge_pressure, contraction)
    }
}

macro_rules! force_models {
    ($($Variant:ident($Model:ident, $field:ident) = $number:literal, $name:literal, $description:literal;)*) => {
        $(
            mod $field;
            pub use $field::$Model;
        )*

        /// The choice of a static force model.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum ForceModelName {
            $(#[doc = $description] $Variant = $number,)*
        }

        impl ForceModelName {
            /// All choices, in the order of their numbers.
            pub const CHOICES: &'static [Choice] = &[$(Choice { name: $name, description: $description },)*];
            const NUMBERS: std::ops::RangeInclusive<f64> = 1.0..=Self::CHOICES.len() as f64;
        }

        impl Scalar for ForceModelName {
            const KIND: Kind = Kind::Enumeration("ForceModel", Self::CHOICES);
            fn to_number(self) -> f64 {
                f64::from(self as i32)
            }
            fn from_number(number: f64) -> Self {
                let all = [$(Self::$Variant),*];
                all.into_iter().find(|choice| choice.to_number() == number).unwrap_or(all[0])
            }
        }

        /// The coefficients of every force model; [`Muscle::force_model`] says which of them are used.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct ForceModels {
            $(#[doc = concat!("Coefficients of `", $name, "`.")] pub $field: $Model,)*
        }

        impl ForceModels {
            /// The groups of parameters: one per model.
            pub const GROUPS: &'static [&'static str] = &[$(stringify!($field),)*];

            /// The model that is chosen.
            #[inline]
            fn chosen(&self, name: ForceModelName) -> &dyn ForceModel {
                match name { $(ForceModelName::$Variant => &self.$field,)* }
            }
        }

        impl crate::variables::Declared for ForceModels {
            fn visit(&self, see: &mut dyn FnMut(&'static crate::variables::Variable, f64)) {
                $(self.$field.visit(see);)*
            }
            fn visit_mut(&mut self, change: &mut dyn FnMut(&'static crate::variables::Variable, f64) -> f64) {
                $(self.$field.visit_mut(change);)*
            }
        }
    };
}

// One line per model: adding a model is its file and a line here.
force_models! {
    VirtualArea(VirtualArea, virtual_area) = 1, "virtual-area",
        "pressure times a virtual area, plus an elastic force, both polynomials of the contraction (thesis eq. 4.5)";
    ImprovedMcKibben(ImprovedMcKibben, improved_mckibben) = 2, "improved-mckibben",
        "McKibben braid with the elasticity of the membrane (thesis eq. 4.17, corrected)";
    McKibben(McKibben, mckibben) = 3, "mckibben", "ideal McKibben braid, without any elasticity (thesis eq. 4.15, corrected)";
}

/// Gauge pressure in Pa up to which [`ForceModels::holding_pressure`] looks for one that holds.
const HIGHEST_PRESSURE: f64 = 2e6;

impl ForceModels {
    /// Virtual area ∂F/∂p in m² of the chosen model at rest, with the muscle's correction.
    #[inline]
    pub fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        let area = self.chosen(muscle.force_model).virtual_area(muscle, gauge_pressure, contraction);
        muscle.area_correction(contraction) * area
    }

    /// Pull in N of the pressure in the chosen model, with the muscle's correction.
    #[inline]
    pub fn pressure_force(
        &self,
        muscle: &Muscle,
        gauge_pressure: f64,
        contraction: f64,
        contraction_velocity: f64,
    ) -> f64 {
        let model = self.chosen(muscle.force_model);
        muscle.area_correction(contraction)
            * model.pressure_force(muscle, gauge_pressure, contraction, contraction_velocity)
    }

    /// Elastic force in N of the chosen model, with the muscle's correction.
    #[inline]
    pub fn elastic_force(&self, muscle: &Muscle, contraction: f64) -> f64 {
        muscle.elastic_correction(contraction) * self.chosen(muscle.force_model).elastic_force(muscle, contraction)
    }

    /// Pull in N of the chosen model at rest.
    #[inline]
    pub fn force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        self.pressure_force(muscle, gauge_pressure, contraction, 0.0) + self.elastic_force(muscle, contraction)
    }

    /// Gauge pressure in Pa at which the resting muscle pulls with a force in N at a contraction in m: the lowest below
    /// 20 bar at which the pull grows with pressure. Where there is none it is extrapolated from 0 or 20 bar along the
    /// tangent.
    pub fn holding_pressure(&self, muscle: &Muscle, contraction: f64, pull: f64) -> f64 {
        let lack = |pressure: f64| pull - self.force(muscle, pressure, contraction);
        let along_tangent = |from: f64| from + lack(from) / self.virtual_area(muscle, from, contraction);
        let first = along_tangent(0.0);
        // Exact where the pressure works on an area that does not depend on it.
        let reached = lack(first).abs() <= 1e-9 * pull.abs().max(1.0);
        if reached || first.is_nan() || lack(0.0) <= 0.0 {
            return first;
        }
        let samples = 50;
        let at = |k: i32| HIGHEST_PRESSURE * f64::from(k) / f64::from(samples);
        match (0..samples).find(|&k| lack(at(k)) > 0.0 && lack(at(k + 1)) <= 0.0) {
            Some(k) => bisect(lack, at(k), at(k + 1)),
            None => along_tangent(HIGHEST_PRESSURE),
        }
    }
}

/// Root of a function that is positive at `low` and not at `high`, to the last bit.
pub(crate) fn bisect(function: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if function(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
}
