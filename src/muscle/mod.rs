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
        /// Correction of the virtual area that rises, falls and rises again over the stroke
        area_wave: f64 = 0.0, ONE, (-1.0..=1.0);
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
        let (bend, wave) = (1.5 * stroke * stroke - 0.5, stroke * (2.5 * stroke * stroke - 1.5));
        self.area_scale + self.area_tilt * stroke + self.area_bend * bend + self.area_wave * wave
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

/// A force model: F = F_p(p, x) + F_e(x) − R(p, x, v), the pull of the pressure, that of the membrane without pressure,
/// and what resists motion.
///
/// In most models the pressure works on an area that depends on the contraction alone, F_p = p A(x), and nothing resists
/// motion but `muscle.damping`: these give A and F_e, and no more.
pub trait ForceModel {
    /// Virtual area A = ∂F/∂p in m² at a gauge pressure in Pa and a contraction in m: newtons gained per pascal at rest.
    /// Without elasticity it is −dV/dL.
    fn virtual_area(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64;

    /// Force in N without pressure at a contraction in m; negative where the membrane resists shortening.
    fn elastic_force(&self, muscle: &Muscle, contraction: f64) -> f64;

    /// Pull in N of a gauge pressure in Pa at a contraction in m; none without pressure.
    #[inline]
    fn pressure_force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        gauge_pressure * self.virtual_area(muscle, gauge_pressure, contraction)
    }

    /// Force in N against a motion with a rate of the contraction in m/s, beside `muscle.damping`; none at rest.
    #[inline]
    fn resistance(&self, _muscle: &Muscle, _gauge_pressure: f64, _contraction: f64, _velocity: f64) -> f64 {
        0.0
    }

    /// Pull in N with the muscle's corrections of area and elastic force.
    #[inline]
    fn force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64, velocity: f64) -> f64 {
        muscle.area_correction(contraction) * self.pressure_force(muscle, gauge_pressure, contraction)
            + muscle.elastic_correction(contraction) * self.elastic_force(muscle, contraction)
            - self.resistance(muscle, gauge_pressure, contraction, velocity)
    }
}

macro_rules! force_models {
    ($($Variant:ident($Model:ident, $field:ident) = $number:literal, $name:literal, $description:literal,
        $equation:literal;)*) => {
        $(
            mod $field;
            pub use $field::$Model;
        )*

        /// The equation of every model, a line each; as a literal, for `concat!`.
        macro_rules! force_equations {
            () => { concat!($($name, "\n    ", $equation, "\n",)*) };
        }
        pub(crate) use force_equations;

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

// One entry per model: adding a model is its file and an entry here.
force_models! {
    VirtualArea(VirtualArea, virtual_area) = 1, "virtual-area",
        "pressure times a virtual area, plus an elastic force, both polynomials of the contraction (thesis eq. 4.5)",
        "p (area_0 + area_1 x + area_2 x^2 + area_3 x^3) + elastic_0 + elastic_1 x + elastic_2 x^2 + elastic_3 x^3";
    ImprovedMcKibben(ImprovedMcKibben, improved_mckibben) = 2, "improved-mckibben",
        "McKibben braid with the elasticity of the membrane (thesis eq. 4.17, corrected)",
        "p (3 L^2 - b^2)/(4 pi n^2) + E(L/L0) (eps_L delta pi D - 2 eps_D delta L^2/(D n^2 pi^2))";
    McKibben(McKibben, mckibben) = 3, "mckibben",
        "ideal McKibben braid, without any elasticity (thesis eq. 4.15, corrected)",
        "p (3 L^2 - b^2)/(4 pi n^2)";
    TonduLopez(TonduLopez, tondu_lopez) = 4, "tondu-lopez",
        "ideal braid with two free coefficients in place of its angle (thesis eq. 4.16)",
        "p pi/4 D0^2 (alpha (1 - x/L0)^2 - beta)";
    TonduLopezK(TonduLopezK, tondu_lopez_k) = 5, "tondu-lopez-k",
        "tondu-lopez, the contraction counted k times, k linear in pressure (thesis eq. 4.19)",
        "p pi/4 D0^2 (alpha (1 - k x/L0)^2 - beta), k = k_0 + k_per_pressure p";
    TonduLopezKq(TonduLopezKq, tondu_lopez_kq) = 6, "tondu-lopez-kq",
        "tondu-lopez for low pressure, with k and a factor q known at two pressures (thesis eqs. 4.21 to 4.23)",
        "p q pi/4 D0^2 (alpha (1 - k x/L0)^2 - beta), 1/k and q linear between low_pressure and high_pressure";
    TonduLopezFriction(TonduLopezFriction, tondu_lopez_friction) = 7, "tondu-lopez-friction",
        "tondu-lopez-k with dry friction between the threads (thesis eq. 4.20)",
        "tondu-lopez-k - friction pi D0 L0 sin(theta_0)/(r sqrt(1 - cos(theta_0)^2 r^2)) p tanh(v/smoothing_velocity), r = 1 - k x/L0";
    FrustumEnds(FrustumEnds, frustum_ends) = 8, "frustum-ends",
        "ideal braid between two cones (thesis eqs. 3.13 to 3.15)",
        "-p dV/dL, L = L_m + 2 sqrt(end_length^2 - (D - end_diameter)^2/4), D of a braid of length L_m";
    RoundedEnds(RoundedEnds, rounded_ends) = 9, "rounded-ends",
        "ideal braid with caps of a sphere at its ends (thesis eqs. 3.16 to 3.19)",
        "p ((3 L^2 - b^2)/(4 pi n^2) + M), M = d(V_v - V_a)/dL of the ends";
    VariableDiameter(VariableDiameter, variable_diameter) = 10, "variable-diameter",
        "barrel with parabolic staves (thesis eqs. 3.21 to 3.23)",
        "-p dV/dL, V = L (3 d^2 pi^2 n^2 + 4 d pi n c + 8 c^2)/(60 pi n^2), c^2 = b^2 - L^2, d = end_diameter";
    MooneyRivlin(MooneyRivlin, mooney_rivlin) = 11, "mooney-rivlin",
        "McKibben braid around a bladder of Mooney-Rivlin rubber (thesis eqs. 3.24 to 3.31, corrected)",
        "p (3 L^2 - b^2)/(4 pi n^2) + pi D0 L0 delta d(c10 (I1 - 3) + c01 (I2 - 3))/dL";
    Spring(Spring, spring) = 12, "spring",
        "spring whose stiffness depends on pressure and stretch, in two ranges of pressure (thesis eqs. 4.12 and 4.13)",
        "K s, K = c0 + c1 s^2 + c2 p s + c3 p^2, s = u0 + u1 p + u2 p^2 - x, mixed from blend_start to blend_end";
    ThreeElement(ThreeElement, three_element) = 13, "three-element",
        "contractile element, spring and damper in parallel (thesis eq. 3.47)",
        "contraction_force + contraction_area p - (stiffness + stiffness_per_pressure p) x - B(p) v";
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
    pub fn pressure_force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        let force = self.chosen(muscle.force_model).pressure_force(muscle, gauge_pressure, contraction);
        muscle.area_correction(contraction) * force
    }

    /// Elastic force in N of the chosen model, with the muscle's correction.
    #[inline]
    pub fn elastic_force(&self, muscle: &Muscle, contraction: f64) -> f64 {
        muscle.elastic_correction(contraction) * self.chosen(muscle.force_model).elastic_force(muscle, contraction)
    }

    /// Force in N with which the chosen model resists a motion, beside `muscle.damping`.
    #[inline]
    pub fn resistance(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64, velocity: f64) -> f64 {
        self.chosen(muscle.force_model).resistance(muscle, gauge_pressure, contraction, velocity)
    }

    /// Pull in N of the chosen model in motion, without `muscle.damping`.
    #[inline]
    pub fn moving_force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64, velocity: f64) -> f64 {
        self.chosen(muscle.force_model).force(muscle, gauge_pressure, contraction, velocity)
    }

    /// Pull in N of the chosen model at rest.
    #[inline]
    pub fn force(&self, muscle: &Muscle, gauge_pressure: f64, contraction: f64) -> f64 {
        self.moving_force(muscle, gauge_pressure, contraction, 0.0)
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
        if reached && first >= 0.0 || first.is_nan() || lack(0.0) <= 0.0 {
            return first;
        }
        let samples = 50;
        let at = |k: i32| HIGHEST_PRESSURE * f64::from(k) / f64::from(samples);
        match (0..samples).find(|&k| lack(at(k)) > 0.0 && lack(at(k + 1)) <= 0.0) {
            Some(k) => bisect(lack, at(k), at(k + 1)),
            None if reached => first,
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
