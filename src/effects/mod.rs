//! What makes a nominal model wrong: one file per physical effect.
//!
//! Every effect is always compiled in and exactly neutral at its default, so that extending a model is freeing
//! parameters. An effect acts through the hooks of [`Effect`] that concern it and leaves the others as they are.

use crate::variables::{Declared, Variable};

/// The plant at one instant, as the hooks of an effect see it.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Gauge pressure in the muscle, Pa.
    pub gauge_pressure: f64,
    /// Rate of the contraction, m/s.
    pub contraction_velocity: f64,
}

/// What the sensors show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readings {
    /// Contraction, m.
    pub contraction: f64,
    /// Gauge pressure, Pa.
    pub gauge_pressure: f64,
    /// Pull on the load, N.
    pub force: f64,
}

/// What a person needs to know of an effect.
#[derive(Debug)]
pub struct Description {
    /// Name as used in commands and files.
    pub name: &'static str,
    /// What it is, in one line.
    pub meaning: &'static str,
    /// The equation.
    pub equation: &'static str,
    /// What it looks like in a residual.
    pub signature: &'static str,
    /// Which experiment shows it and tells it from its look-alikes.
    pub experiment: &'static str,
    /// Where the equation comes from.
    pub reference: &'static str,
    /// Whether it concerns the load, and so means nothing to a muscle that is moved from outside.
    pub of_load: bool,
    /// Common forms of the effect, each the parameters that a fit frees; the best form stands for the cause.
    pub forms: &'static [&'static [Freed]],
    /// Parameters that are freed as well once the effect leads, and stay free only where the data pay for them.
    pub refinements: &'static [Freed],
}

/// A parameter that a fit frees, and values away from neutral where fits start: start k of a form takes the k-th value of
/// each parameter, or its last.
pub type Freed = (&'static str, &'static [f64]);

impl Description {
    /// Where the first fit of the first form starts: the effect at work, at a usual size.
    pub fn typical(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.forms[0].iter().map(|(name, starts)| (*name, starts[0]))
    }
}

/// A physical effect: its parameters, its states, and the places where it acts.
pub trait Effect: Declared + Default {
    /// What it is.
    const DESCRIPTION: Description;
    /// How many states it adds to the plant. They start at zero.
    const STATES: usize = 0;

    /// Cut-off of the valve in rad/s.
    fn valve_bandwidth(&self, bandwidth: f64) -> f64 {
        bandwidth
    }
    /// Moving mass in kg.
    fn mass(&self, mass: f64) -> f64 {
        mass
    }
    /// Pull of the muscle in N.
    fn muscle_force(&self, _at: &Point, _own: &[f64], force: f64) -> f64 {
        force
    }
    /// Rates of the effect's own states, per second.
    fn rates(&self, _at: &Point, _own: &[f64], _rates: &mut [f64]) {}
    /// What the sensors show.
    fn readings(&self, readings: Readings) -> Readings {
        readings
    }
    /// Contraction in m at which the position sensor shows what it does: undoes what this effect does to the reading.
    fn true_contraction(&self, measured: f64) -> f64 {
        measured
    }
    /// One sentence for a person about the size that was found.
    fn sentence(&self) -> String;
}

macro_rules! effects {
    ($($field:ident: $Effect:ident;)*) => {
        $(
            mod $field;
            pub use $field::$Effect;
        )*

        /// All effects with their parameters.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Effects {
            $(#[doc = concat!("See [`", stringify!($Effect), "`].")] pub $field: $Effect,)*
        }

        impl Effects {
            /// States that all effects together add to the plant.
            pub const STATES: usize = 0 $(+ $Effect::STATES)*;
            /// What each effect is, in the order of the list.
            pub const DESCRIPTIONS: &'static [Description] = &[$($Effect::DESCRIPTION,)*];

            /// Cut-off of the valve in rad/s, all effects applied.
            #[inline]
            pub fn valve_bandwidth(&self, mut bandwidth: f64) -> f64 {
                $(bandwidth = self.$field.valve_bandwidth(bandwidth);)*
                bandwidth
            }

            /// Moving mass in kg, all effects applied.
            #[inline]
            pub fn mass(&self, mut mass: f64) -> f64 {
                $(mass = self.$field.mass(mass);)*
                mass
            }

            /// Pull of the muscle in N, all effects applied; `states` are those of all effects.
            #[inline]
            pub fn muscle_force(&self, at: &Point, states: &[f64], mut force: f64) -> f64 {
                let mut rest = states;
                $(
                    let (own, others) = rest.split_at($Effect::STATES);
                    rest = others;
                    force = self.$field.muscle_force(at, own, force);
                )*
                let _ = rest;
                force
            }

            /// Rates of the states of all effects, per second.
            #[inline]
            pub fn rates(&self, at: &Point, states: &[f64], rates: &mut [f64]) {
                let (mut rest, mut rest_rates) = (states, rates);
                $(
                    let (own, others) = rest.split_at($Effect::STATES);
                    let (own_rates, other_rates) = rest_rates.split_at_mut($Effect::STATES);
                    (rest, rest_rates) = (others, other_rates);
                    self.$field.rates(at, own, own_rates);
                )*
                let _ = (rest, rest_rates);
            }

            /// What the sensors show, all effects applied.
            #[inline]
            pub fn readings(&self, mut readings: Readings) -> Readings {
                $(readings = self.$field.readings(readings);)*
                readings
            }

            /// Contraction in m at which the position sensor shows what it does, all effects undone.
            pub fn true_contraction(&self, mut measured: f64) -> f64 {
                $(measured = self.$field.true_contraction(measured);)*
                measured
            }

            /// The sentence of the effect with this name.
            pub fn sentence(&self, name: &str) -> Option<String> {
                $(if $Effect::DESCRIPTION.name == name { return Some(self.$field.sentence()); })*
                None
            }
        }

        impl Declared for Effects {
            fn visit(&self, see: &mut dyn FnMut(&'static Variable, f64)) {
                $(self.$field.visit(see);)*
            }
            fn visit_mut(&mut self, change: &mut dyn FnMut(&'static Variable, f64) -> f64) {
                $(self.$field.visit_mut(change);)*
            }
        }
    };
}

// One line per effect: adding one is its file and a line here.
effects! {
    friction_hysteresis: FrictionHysteresis;
    viscous_damping: ViscousDamping;
    valve_lag: ValveLag;
    payload_mass: PayloadMass;
    contraction_sensor_offset: ContractionSensorOffset;
}
