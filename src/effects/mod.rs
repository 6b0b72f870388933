//! What makes a nominal model wrong: one file per physical effect.
//!
//! Every effect is always compiled in and exactly neutral at its default, so that extending a model is freeing
//! parameters. An effect acts through the hooks of [`Effect`] that concern it and leaves the others as they are. The
//! hooks follow the signal: command, pressure, force, motion, readings; where several effects share one, they act in the
//! order of the list.

use crate::memory::Slack;
use crate::variables::{Declared, Variable};

/// The plant at one instant, as the hooks of an effect see it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Point {
    /// Gauge pressure that the command asks for, Pa; with a measured pressure, that one.
    pub commanded_pressure: f64,
    /// Gauge pressure that the valve goes for, Pa: the commanded one after all effects on it.
    pub target_pressure: f64,
    /// Gauge pressure in the muscle, Pa.
    pub gauge_pressure: f64,
    /// Contraction, m.
    pub contraction: f64,
    /// Rate of the contraction, m/s.
    pub contraction_velocity: f64,
    /// Pull of the pressure on the virtual area without effects, N; known only to the hooks of the states, `start` and `rates`.
    pub pressure_pull: f64,
    /// Tension of what stretches between muscle and load, N; known only to `start`.
    pub tension: f64,
    /// Its rate, N/s; known only to `rates`.
    pub tension_rate: f64,
}

impl Point {
    /// Gauge pressure in units of the one at which sizes that grow with it are stated, [`REFERENCE_PRESSURE`].
    fn relative_pressure(&self) -> f64 {
        self.gauge_pressure / REFERENCE_PRESSURE
    }

    /// Contraction in units of the one at which sizes that grow with it are stated, [`REFERENCE_CONTRACTION`].
    fn relative_contraction(&self) -> f64 {
        self.contraction / REFERENCE_CONTRACTION
    }
}

/// Gauge pressure in Pa at which sizes that change with pressure are stated: the middle of the usual range.
pub const REFERENCE_PRESSURE: f64 = 2e5;
/// Contraction in m at which sizes that change with contraction are stated.
pub const REFERENCE_CONTRACTION: f64 = 0.1;
/// Share of the volume at rest that a muscle has at least; not physical, it keeps what goes with one over the volume finite.
pub const LEAST_VOLUME: f64 = 0.1;
/// Force in N at which sizes that change with force are stated.
pub const REFERENCE_FORCE: f64 = 400.0;
/// Ambient pressure in Pa, for what depends on absolute pressure.
pub const AMBIENT_PRESSURE: f64 = 1e5;

/// (eʳᵃ − 1)/(eʳᵇ − 1): how far an exponential of a rate r has come at a, relative to b; a straight line for none.
fn exponential(rate: f64, at: f64, reference: f64) -> f64 {
    let rate = not_zero(rate);
    (rate * at).exp_m1() / (rate * reference).exp_m1()
}

/// The rate of an exponential: nearer to zero the differences from one are those of rounding.
fn not_zero(rate: f64) -> f64 {
    rate.abs().max(1e-6).copysign(rate)
}

/// By how much a value is more in the recording with a number from 1, given that for the second and the third; in all others by nothing.
pub(crate) fn of_recording(number: f64, [second, third]: [f64; 2]) -> f64 {
    // Comparisons, as rounding is a call where the processor may be an old one, and this is asked for in every step of a simulation.
    if (1.5..2.5).contains(&number) {
        second
    } else if (2.5..3.5).contains(&number) {
        third
    } else {
        0.0
    }
}

/// Leaves out of an effect what makes no difference to one of several recordings, by its number from 1.
fn leave_out_others(effect: &mut impl Declared, number: usize) {
    effect.visit_mut(&mut |variable, old| match variable {
        _ if variable.name.ends_with(".recording") => number as f64,
        _ if variable.is_felt_in(number) => old,
        _ => 0.0,
    });
}

/// What is told of a second and a third recording where their values are not zero, by `told` from a value and the recording's name.
pub(crate) fn told_anew(values: [f64; 2], told: impl Fn(f64, &str) -> String) -> String {
    let named = values.into_iter().zip(["second", "third"]).filter(|(value, _)| *value != 0.0);
    named.map(|(value, recording)| told(value, recording)).collect()
}

/// What the sensors show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readings {
    /// Time since the start, s.
    pub time: f64,
    /// Contraction, m.
    pub contraction: f64,
    /// Gauge pressure, Pa.
    pub gauge_pressure: f64,
    /// Pull on the load, N.
    pub force: f64,
}

/// How well an equation of an effect can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Holds {
    /// It is a scale or a zero, and its equation is its definition.
    Exactly,
    /// It is a law of nature, which is always simpler than nature.
    AsLaw,
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
    /// How well its equation can hold at all.
    pub holds: Holds,
    /// Common forms of the effect, each the parameters that a fit frees, its size first; the best form stands for the cause.
    pub forms: &'static [&'static [Freed]],
    /// Forms that are rarer, and looked at only where one of the common ones leads and leaves something; not refined, and no
    /// cause where what they do over time goes with the command.
    pub further_forms: &'static [&'static [Freed]],
    /// Parameters that are freed as well once the effect leads, and stay free only where the data pay for them.
    pub refinements: &'static [Freed],
}

/// A parameter that a fit frees, and values away from neutral where fits start: start k of a form takes the k-th value of
/// each parameter, or its last.
pub type Freed = (&'static str, &'static [f64]);

/// Each of some values for so many starts in turn, and so on, for `N` starts in all: what all combinations of several lists are made of.
pub(crate) const fn each_for<const N: usize>(values: &[f64], times: usize) -> [f64; N] {
    let mut all = [0.0; N];
    let mut k = 0;
    while k < N {
        all[k] = values[k / times % values.len()];
        k += 1;
    }
    all
}

impl Description {
    /// All forms, the common ones first.
    pub fn all_forms(&self) -> impl Iterator<Item = &'static [Freed]> {
        self.forms.iter().chain(self.further_forms).copied()
    }

    /// Where the first fit of the first form starts: the effect at work, at a usual size.
    pub fn typical(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.forms[0].iter().map(|(name, starts)| (*name, starts[0]))
    }
}

/// A physical effect: its parameters, its states, and the places where it acts.
///
/// `own` are the states of the effect. Every hook must return what it was given, to the last bit, while the effect is
/// neutral.
pub trait Effect: Declared + Default {
    /// What it is.
    const DESCRIPTION: Description;
    /// Usual sizes of the states that it adds to the plant, one each.
    const STATE_SCALES: &'static [f64] = &[];
    /// Parameters whose bounds are neither neutral nor limits of nature: a fit that ends there wanted more, and did not find the cause.
    const ENDS_INSIDE: &'static [&'static str] = &[];
    /// Whether it only changes readings of a hanging load, each for itself, after all effects that change more.
    const IS_OF_READING: bool = false;

    /// Whether it changes nothing, whatever its shape parameters are.
    fn is_neutral(&self) -> bool;
    /// Whether its states do not count.
    fn rests(&self) -> bool {
        self.is_neutral()
    }
    /// Whether its values are such as the cause can have, where [`Effect::ENDS_INSIDE`] does not say it: fits may try more.
    fn is_plausible(&self) -> bool {
        true
    }
    /// Whether part of what it does hangs on chance and cannot be foretold.
    fn hangs_on_chance(&self) -> bool {
        false
    }
    /// Has it be as it is in one of several recordings, by its number from 1, without what makes no difference to that one.
    fn in_recording(&mut self, number: usize) {
        leave_out_others(self, number);
    }
    /// By how much later in s the valve answers on average than one of first order with a bandwidth in rad/s.
    fn lateness(&self, _bandwidth: f64) -> f64 {
        0.0
    }
    /// As it acts on where the valve comes to rest, but for what [`Effect::rests_off`] says.
    fn at_rest(self) -> Self {
        self
    }
    /// Gauge pressure in Pa by which the valve rests off its target.
    fn rests_off(&self) -> f64 {
        0.0
    }
    /// Velocity in m/s, of contraction, by which a load that hangs is off its rest at the start, more slowly than inertia would matter.
    fn start_velocity(&self) -> f64 {
        0.0
    }
    /// What it does at a time in s since the start whatever the muscle does, where it goes its own way over time; SI.
    fn own_course(&self, _time: f64) -> f64 {
        0.0
    }
    /// One sentence for a person about the size that was found.
    fn sentence(&self) -> String;

    /// Sets the states at the start; they are zero before.
    fn start(&self, _at: &Point, _own: &mut [f64]) {}
    /// Rates of the states, per second; they are zero before.
    fn rates(&self, _at: &Point, _own: &[f64], _rates: &mut [f64]) {}

    /// How the pilot of the valve fails to follow its command.
    fn slack(&self) -> Slack {
        Slack::default()
    }
    /// Times in s by which the valve sees its command late, one that rises and one that falls.
    fn command_delays(&self) -> [f64; 2] {
        [0.0; 2]
    }
    /// Command in V on which the valve acts; the pressures that it asks for are not known yet.
    fn command(&self, _at: &Point, _own: &[f64], command: f64) -> f64 {
        command
    }
    /// Gauge pressure in Pa that the valve goes for; that of the point is not known yet.
    fn target_pressure(&self, _at: &Point, _own: &[f64], target: f64) -> f64 {
        target
    }
    /// Cut-off of the valve in rad/s.
    fn valve_bandwidth(&self, _at: &Point, bandwidth: f64) -> f64 {
        bandwidth
    }
    /// Rate of the gauge pressure in Pa/s.
    fn pressure_rate(&self, _at: &Point, _own: &[f64], rate: f64) -> f64 {
        rate
    }

    // Nothing from here to the static force may depend on the velocity: behind a cable this part is computed once, and the velocity at its end
    // is then looked for.

    /// Gauge pressure in Pa that drives the muscle, which without effects would pull with the given static force in N.
    fn effective_pressure(&self, _at: &Point, _pull: &impl Fn() -> f64, pressure: f64) -> f64 {
        pressure
    }
    /// Contraction in m that braid and membrane feel, where the membrane's is not another one.
    fn effective_contraction(&self, _at: &Point, _own: &[f64], contraction: f64) -> f64 {
        contraction
    }
    /// Contraction in m that what resists elastically feels, where the braid feels the given one.
    fn elastic_contraction(&self, _at: &Point, _own: &[f64], contraction: f64) -> f64 {
        contraction
    }
    /// Pull in N of the pressure on the virtual area.
    fn area_force(&self, _at: &Point, _own: &[f64], force: f64) -> f64 {
        force
    }
    /// Pull in N of the elastic membrane.
    fn elastic_force(&self, _at: &Point, _own: &[f64], force: f64) -> f64 {
        force
    }
    /// Static pull in N, of pressure and membrane together.
    fn static_force(&self, force: f64) -> f64 {
        force
    }

    /// Pull of the muscle in N.
    fn muscle_force(&self, _at: &Point, _own: &[f64], force: f64) -> f64 {
        force
    }
    /// Tension in N of what stretches between muscle and load, below zero where it is slack; `None` where nothing does.
    fn tension(&self, _own: &[f64]) -> Option<f64> {
        None
    }
    /// Length in m by which what is between muscle and load stretches under a tension in N, and by how much more per N.
    fn stretch(&self, _tension: f64) -> (f64, f64) {
        (0.0, 0.0)
    }
    /// Mass in kg that weighs at a contraction in m.
    fn mass(&self, mass: f64, _contraction: f64) -> f64 {
        mass
    }
    /// Mass in kg that moves, given the one that weighs.
    fn inertia(&self, mass: f64) -> f64 {
        mass
    }

    /// Time in s by which the position sensor is late.
    fn contraction_delay(&self) -> f64 {
        0.0
    }
    /// Time in s before that over which it averages.
    fn contraction_averaging(&self) -> f64 {
        0.0
    }
    /// Time constant in s of its filter of first order.
    fn contraction_filter(&self) -> f64 {
        0.0
    }
    /// What the sensors show.
    fn readings(&self, readings: Readings) -> Readings {
        readings
    }
    /// Contraction in m behind a reading of the position sensor at a time in s since the start, while the muscle pulls with a
    /// force in N.
    fn true_contraction(&self, reading: f64, _force: f64, _time: f64) -> f64 {
        reading
    }
    /// Gauge pressure in Pa behind a reading of the pressure sensor at a time in s since the start.
    fn true_pressure(&self, reading: f64, _time: f64) -> f64 {
        reading
    }
}

/// How near to a bound a fit still ends at it, relative to the bound: it may stop on its way there.
const NEARLY: f64 = 0.01;

/// Names of the parameters at whose bounds a fit ended that must end inside.
fn at_ends<E: Effect>(effect: &E) -> Vec<&'static str> {
    let mut names = Vec::new();
    effect.visit(&mut |variable, value| {
        let (lower, upper) = (variable.min + NEARLY * variable.min.abs(), variable.max - NEARLY * variable.max.abs());
        if E::ENDS_INSIDE.contains(&variable.name) && !(lower < value && value < upper) {
            names.push(variable.name);
        }
    });
    names
}

/// What is done with each effect that is not left out, one after the other.
macro_rules! each_at_work {
    ($self:ident; $($Effect:ident $do:block)*) => {
        $(if !$self.is_left_out(Place::$Effect) $do)*
    };
}

/// A hook of all effects that have states, one after the other; `states` are those of all effects.
macro_rules! chained {
    ($doc:literal; $hook:ident; $($field:ident: $Effect:ident;)*) => {
        #[doc = concat!($doc, " `states` are those of all effects.")]
        #[inline]
        pub fn $hook(&self, at: &Point, states: &[f64], mut value: f64) -> f64 {
            let mut rest = states;
            $(
                let (own, others) = rest.split_at($Effect::STATE_SCALES.len());
                rest = others;
                if !self.is_left_out(Place::$Effect) {
                    value = self.$field.$hook(at, own, value);
                }
            )*
            let _ = rest;
            value
        }
    };
}

macro_rules! effects {
    ($($field:ident: $Effect:ident;)*) => {
        $(
            mod $field;
            pub use $field::$Effect;
        )*

        /// Place of each effect in the list.
        #[derive(Clone, Copy)]
        enum Place {
            $($Effect,)*
        }

        /// All effects with their parameters.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Effects {
            $(#[doc = concat!("See [`", stringify!($Effect), "`].")] pub $field: $Effect,)*
            /// Those that are left out, each a bit by its place; see [`Effects::without_neutral`].
            left_out: u32,
        }

        impl Effects {
            /// States that all effects together add to the plant.
            pub const STATES: usize = 0 $(+ $Effect::STATE_SCALES.len())*;
            /// What each effect is, in the order of the list.
            pub const DESCRIPTIONS: &'static [Description] = &[$($Effect::DESCRIPTION,)*];
            const STATE_SCALES: &'static [&'static [f64]] = &[$($Effect::STATE_SCALES,)*];

            /// The same, where those that are neutral are not asked at every instant what they do: they must stay neutral.
            pub fn without_neutral(mut self) -> Self {
                $(
                    if self.$field.is_neutral() {
                        self.left_out |= 1 << Place::$Effect as u32;
                    }
                )*
                self
            }

            #[inline]
            fn is_left_out(&self, place: Place) -> bool {
                self.left_out & 1 << place as u32 != 0
            }

            /// Whether no effect is at work.
            #[inline]
            pub fn are_neutral(&self) -> bool {
                true $(&& (self.is_left_out(Place::$Effect) || self.$field.is_neutral()))*
            }

            /// Whether the values of the effect with this name are such as its cause can have.
            pub fn is_plausible(&self, name: &str) -> bool {
                true $(&& ($Effect::DESCRIPTION.name != name || self.$field.is_plausible() && at_ends(&self.$field).is_empty()))*
            }

            /// Names of the parameters at whose bounds a fit ended that must end inside.
            pub fn at_ends(&self) -> Vec<&'static str> {
                [$(at_ends(&self.$field),)*].concat()
            }

            /// Whether what the effect with this name does hangs on chance in part.
            pub fn hangs_on_chance(&self, name: &str) -> bool {
                false $(|| $Effect::DESCRIPTION.name == name && self.$field.hangs_on_chance())*
            }

            /// Has all effects be as they are in one of several recordings, by its number from 1, without what makes no difference to that one.
            pub fn in_recording(&mut self, number: usize) {
                $(self.$field.in_recording(number);)*
            }

            /// All effects as they act on where the valve comes to rest, but for what [`Self::rests_off`] says.
            pub fn at_rest(self) -> Self {
                Self { $($field: self.$field.at_rest(),)* ..self }
            }

            /// Those with which a hanging load is simulated, and those that only change its readings then.
            pub fn apart(&self) -> [Self; 2] {
                let mut apart = [*self; 2];
                $(apart[usize::from(!$Effect::IS_OF_READING)].$field = $Effect::default();)*
                apart
            }

            /// Gauge pressure in Pa by which the valve rests off its target.
            pub fn rests_off(&self) -> f64 {
                0.0 $(+ self.$field.rests_off())*
            }

            /// By how much later in s the valve answers on average than one of first order with a bandwidth in rad/s.
            pub fn lateness(&self, bandwidth: f64) -> f64 {
                0.0 $(+ self.$field.lateness(bandwidth))*
            }

            /// Velocity in m/s with which a load that hangs starts.
            pub fn start_velocity(&self) -> f64 {
                0.0 $(+ self.$field.start_velocity())*
            }

            /// What the effect with this name does at a time in s since the start whatever the muscle does; SI.
            pub fn own_course(&self, name: &str, time: f64) -> f64 {
                $(if $Effect::DESCRIPTION.name == name { return self.$field.own_course(time); })*
                0.0
            }

            /// The states that move, each a bit by its position: those of effects that do not rest.
            #[inline]
            pub fn moving(&self) -> u64 {
                let (mut moving, mut position) = (0, 0);
                $(
                    if !$Effect::STATE_SCALES.is_empty() && !self.is_left_out(Place::$Effect) && !self.$field.rests() {
                        moving |= ((1 << $Effect::STATE_SCALES.len()) - 1) << position;
                    }
                    position += $Effect::STATE_SCALES.len();
                )*
                let _ = position;
                moving
            }

            /// The sentence of the effect with this name.
            pub fn sentence(&self, name: &str) -> Option<String> {
                $(if $Effect::DESCRIPTION.name == name { return Some(self.$field.sentence()); })*
                None
            }

            /// States of all effects at the start.
            pub fn start(&self, at: &Point) -> [f64; Self::STATES] {
                let mut states = [0.0; Self::STATES];
                let mut rest = &mut states[..];
                $(
                    let (own, others) = rest.split_at_mut($Effect::STATE_SCALES.len());
                    rest = others;
                    self.$field.start(at, own);
                )*
                let _ = rest;
                states
            }

            /// Rates of the states of all effects, per second; those that rest keep the ones that they have.
            #[inline]
            pub fn rates(&self, at: &Point, states: &[f64], rates: &mut [f64]) {
                let (mut rest, mut rest_rates) = (states, rates);
                $(
                    let (own, others) = rest.split_at($Effect::STATE_SCALES.len());
                    let (own_rates, other_rates) = rest_rates.split_at_mut($Effect::STATE_SCALES.len());
                    (rest, rest_rates) = (others, other_rates);
                    if !own.is_empty() && !self.is_left_out(Place::$Effect) && !self.$field.rests() {
                        own_rates.fill(0.0);
                        self.$field.rates(at, own, own_rates);
                    }
                )*
                let _ = (rest, rest_rates);
            }

            /// How the pilot of the valve fails to follow its command: as the first effect says that has it fail.
            pub fn slack(&self) -> Slack {
                $(
                    let slack = self.$field.slack();
                    if !slack.is_none() {
                        return slack;
                    }
                )*
                Slack::default()
            }

            /// Times in s by which the valve sees its command late, one that rises and one that falls.
            #[inline]
            pub fn command_delays(&self) -> [f64; 2] {
                let mut all = [0.0; 2];
                $(
                    let [rising, falling] = self.$field.command_delays();
                    all = [all[0] + rising, all[1] + falling];
                )*
                all
            }

            /// The longer of both.
            #[inline]
            pub fn command_delay(&self) -> f64 {
                let [rising, falling] = self.command_delays();
                rising.max(falling)
            }

            /// Time in s by which the position sensor is late.
            #[inline]
            pub fn contraction_delay(&self) -> f64 {
                0.0 $(+ self.$field.contraction_delay())*
            }

            /// Time in s before that over which it averages.
            #[inline]
            pub fn contraction_averaging(&self) -> f64 {
                0.0 $(+ self.$field.contraction_averaging())*
            }

            /// Time constant in s of the filter of first order of the position sensor.
            #[inline]
            pub fn contraction_filter(&self) -> f64 {
                0.0 $(+ self.$field.contraction_filter())*
            }

            /// Time in s from which on the past of the contraction is not seen any more.
            #[inline]
            pub fn contraction_reach(&self) -> f64 {
                self.contraction_delay() + self.contraction_averaging()
            }

            /// Time in s by which the position sensor is late where the contraction moves at a constant rate.
            #[inline]
            pub fn contraction_lateness(&self) -> f64 {
                self.contraction_delay() + 0.5 * self.contraction_averaging() + self.contraction_filter()
            }

            chained! { "Command in V on which the valve acts."; command; $($field: $Effect;)* }
            chained! { "Gauge pressure in Pa that the valve goes for."; target_pressure; $($field: $Effect;)* }
            chained! { "Rate of the gauge pressure in Pa/s."; pressure_rate; $($field: $Effect;)* }
            chained! {
                "Contraction in m that braid and membrane feel, where the membrane's is not another one.";
                effective_contraction; $($field: $Effect;)*
            }
            chained! {
                "Contraction in m that what resists elastically feels, where the braid feels the given one.";
                elastic_contraction; $($field: $Effect;)*
            }
            chained! { "Pull in N of the pressure on the virtual area."; area_force; $($field: $Effect;)* }
            chained! { "Pull in N of the elastic membrane."; elastic_force; $($field: $Effect;)* }
            chained! { "Pull of the muscle in N."; muscle_force; $($field: $Effect;)* }

            /// Cut-off of the valve in rad/s.
            #[inline]
            pub fn valve_bandwidth(&self, at: &Point, mut bandwidth: f64) -> f64 {
                each_at_work!(self; $($Effect { bandwidth = self.$field.valve_bandwidth(at, bandwidth); })*);
                bandwidth
            }

            /// Gauge pressure in Pa that drives the muscle, which without effects would pull with the given static force in N.
            #[inline]
            pub fn effective_pressure(&self, at: &Point, pull: &impl Fn() -> f64, mut pressure: f64) -> f64 {
                each_at_work!(self; $($Effect { pressure = self.$field.effective_pressure(at, pull, pressure); })*);
                pressure
            }

            /// Static pull in N, of pressure and membrane together.
            #[inline]
            pub fn static_force(&self, mut force: f64) -> f64 {
                each_at_work!(self; $($Effect { force = self.$field.static_force(force); })*);
                force
            }

            /// Tension in N of what stretches between muscle and load, by the states of all effects; `None` where nothing does.
            #[inline]
            pub fn tension(&self, states: &[f64]) -> Option<f64> {
                let mut rest = states;
                $(
                    let (own, others) = rest.split_at($Effect::STATE_SCALES.len());
                    rest = others;
                    if let Some(tension) = self.$field.tension(own) {
                        return Some(tension);
                    }
                )*
                let _ = rest;
                None
            }

            /// Length in m by which what is between muscle and load stretches under a tension in N, and by how much more per N.
            #[inline]
            pub fn stretch(&self, tension: f64) -> (f64, f64) {
                let (mut length, mut compliance) = (0.0, 0.0);
                $(
                    let (stretch, more) = self.$field.stretch(tension);
                    length += stretch;
                    compliance += more;
                )*
                (length, compliance)
            }

            /// Masses in kg of a load that weigh and that move at a contraction in m, in this order, where one was entered.
            #[inline]
            pub fn masses(&self, entered: f64, contraction: f64) -> (f64, f64) {
                let mut weighing = entered;
                $(weighing = self.$field.mass(weighing, contraction);)*
                let mut moving = weighing;
                $(moving = self.$field.inertia(moving);)*
                (weighing, moving)
            }

            /// What the sensors show.
            #[inline]
            pub fn readings(&self, mut readings: Readings) -> Readings {
                each_at_work!(self; $($Effect { readings = self.$field.readings(readings); })*);
                readings
            }

            /// Contraction in m behind a reading of the position sensor at a time in s since the start, while the muscle
            /// pulls with a force in N; a delay is not undone.
            pub fn true_contraction(&self, reading: f64, force: f64, time: f64) -> f64 {
                // The last effect on a reading is the first to be undone.
                let undo = |reading: f64| reading;
                $(let undo = |reading: f64| undo(self.$field.true_contraction(reading, force, time));)*
                undo(reading)
            }

            /// Gauge pressure in Pa behind a reading of the pressure sensor at a time in s since the start.
            pub fn true_pressure(&self, reading: f64, time: f64) -> f64 {
                let undo = |reading: f64| reading;
                $(let undo = |reading: f64| undo(self.$field.true_pressure(reading, time));)*
                undo(reading)
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

// One line per effect: adding one is its file and a line here. In the order of the signal: the ports of the valve act behind its poles, and
// what stretches does so by the true pull, whatever a warm sensor shows of it.
effects! {
    valve_dead_time: ValveDeadTime;
    valve_gain: ValveGain;
    valve_offset: ValveOffset;
    valve_lag: ValveLag;
    valve_dead_band: ValveDeadBand;
    supply_saturation: SupplySaturation;
    valve_resonance: ValveResonance;
    flow_limit: FlowLimit;
    leakage: Leakage;
    threshold_pressure: ThresholdPressure;
    end_effects: EndEffects;
    creep: Creep;
    series_elasticity: SeriesElasticity;
    temperature_drift: TemperatureDrift;
    bladder_stiffness: BladderStiffness;
    force_gain: ForceGain;
    friction_hysteresis: FrictionHysteresis;
    viscous_damping: ViscousDamping;
    payload_mass: PayloadMass;
    contraction_sensor_gain: ContractionSensorGain;
    contraction_sensor_offset: ContractionSensorOffset;
    contraction_sensor_delay: ContractionSensorDelay;
    pressure_sensor_gain: PressureSensorGain;
    pressure_sensor_offset: PressureSensorOffset;
    force_sensor_gain: ForceSensorGain;
    force_sensor_offset: ForceSensorOffset;
}

impl Effects {
    /// What the effect with this name is.
    pub fn description(name: &str) -> Option<&'static Description> {
        Self::DESCRIPTIONS.iter().find(|effect| effect.name == name)
    }

    /// Usual sizes of the states of a plant: those of its own states, then those of the effects.
    pub(crate) const fn scales<const N: usize>(own: &[f64]) -> [f64; N] {
        let mut all = [1.0; N];
        let (mut filled, mut group) = (0, 0);
        while filled < own.len() {
            all[filled] = own[filled];
            filled += 1;
        }
        while group < Self::STATE_SCALES.len() {
            let mut k = 0;
            while k < Self::STATE_SCALES[group].len() {
                all[filled] = Self::STATE_SCALES[group][k];
                (filled, k) = (filled + 1, k + 1);
            }
            group += 1;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::{Effects, Point, Readings};

    #[test]
    fn a_curved_scale_is_a_cubic_through_its_error_at_the_middle() {
        let mut effects = Effects::default();
        let own = &mut effects.force_sensor_gain;
        (own.relative_error, own.bend, own.curvature) = (-0.06, 0.01, -0.02);
        // F = r 400 N reads 400 (r (1 − 0.06 − 0.01 + 0.02) + 0.01 r² − 0.02 r³).
        for (ratio, reading) in [(0.0, 0.0), (0.5, 190.0), (1.0, 376.0), (2.0, 712.0)] {
            let force = 400.0 * ratio;
            let shown = effects.readings(Readings { time: 0.0, contraction: 0.0, gauge_pressure: 0.0, force });
            assert!((shown.force - reading).abs() < 1e-9, "{ratio}: {}", shown.force);
        }
    }

    #[test]
    fn a_port_stays_shut_for_small_errors_behind_a_second_pole_too() {
        let mut effects = Effects::default();
        effects.valve_lag.second_time_constant = 0.05;
        effects.valve_dead_band.pressure_overlap = 5e3;
        let at = |gauge_pressure| Point { gauge_pressure, ..Point::default() };
        let behind_pole = effects.start(&at(2.03e5));
        assert_eq!(effects.target_pressure(&at(2e5), &behind_pole, 3e5), 2e5);
        assert_eq!(effects.target_pressure(&at(1.9e5), &behind_pole, 3e5), 1.98e5);
    }

    #[test]
    fn a_frame_stretches_by_the_true_pull_whatever_a_warm_sensor_shows() {
        let readings = Readings { time: 1e3, contraction: 0.1, gauge_pressure: 2e5, force: 400.0 };
        let mut effects = Effects::default();
        effects.series_elasticity.compliance = 1e-5;
        let cold = effects.readings(readings);
        effects.temperature_drift.force_zero = 50.0;
        let warm = effects.readings(readings);
        assert!(warm.force > cold.force && warm.contraction == cold.contraction && cold.contraction != 0.1);
    }

    #[test]
    fn what_ends_at_a_bound_is_no_cause_but_for_limits_of_nature() {
        let neutral = Effects::default();
        assert!(Effects::DESCRIPTIONS.iter().all(|effect| neutral.is_plausible(effect.name)));
        let mut creeps = neutral;
        (creeps.creep.pull_amplitude, creeps.creep.settled_share) = (0.9, 1.0);
        assert!(creeps.is_plausible("creep"));
        creeps.creep.pull_amplitude = 1.0;
        assert!(!creeps.is_plausible("creep") && creeps.is_plausible("leakage"));
        assert_eq!(creeps.at_ends(), ["creep.pull_amplitude"]);
    }
}
