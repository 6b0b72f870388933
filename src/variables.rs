//! Declaring a variable once.
//!
//! The macro `variables!` turns one list of fields into the struct, its defaults, and the table from which
//! the FMU description, the parameter file, the bounds of a fit and the documentation follow.

/// A unit as FMI wants it: a symbol and exponents of the base units.
#[derive(Debug, PartialEq)]
pub struct Unit {
    /// Symbol, as written in files.
    pub symbol: &'static str,
    /// Name of the quantity; also the name of the declared type in the FMU.
    pub quantity: &'static str,
    /// Usual magnitude of such a quantity in a muscle, in this unit.
    pub nominal: f64,
    /// Exponents of kg, m, s, A, rad.
    pub base: [i8; 5],
}

macro_rules! units {
    ($($name:ident = $symbol:literal, $quantity:literal, $nominal:literal, $base:expr;)*) => {
        $(
            #[doc = concat!($quantity, " in ", $symbol, ".")]
            pub const $name: Unit = Unit { symbol: $symbol, quantity: $quantity, nominal: $nominal, base: $base };
        )*
    };
}

/// The units that variables may carry. Exponents are of kg, m, s, A, rad.
pub mod units {
    use super::Unit;
    units! {
        ONE = "1", "Ratio", 1.0, [0, 0, 0, 0, 0];
        METRE = "m", "Length", 0.1, [0, 1, 0, 0, 0];
        SQUARE_METRE = "m2", "Area", 1e-3, [0, 2, 0, 0, 0];
        NEWTON_PER_PASCAL = "N/Pa", "ForcePerPressure", 1e-3, [0, 2, 0, 0, 0];
        SECOND_PER_METRE = "s/m", "InverseVelocity", 10.0, [0, -1, 1, 0, 0];
        PER_METRE = "1/m", "Curvature", 1.0, [0, -1, 0, 0, 0];
        SECOND = "s", "Time", 1.0, [0, 0, 1, 0, 0];
        KILOGRAM = "kg", "Mass", 10.0, [1, 0, 0, 0, 0];
        KILOGRAM_PER_METRE = "kg/m", "LinearDensity", 10.0, [1, -1, 0, 0, 0];
        METRE_PER_SECOND = "m/s", "Velocity", 0.1, [0, 1, -1, 0, 0];
        METRE_PER_SECOND2 = "m/s2", "Acceleration", 1.0, [0, 1, -2, 0, 0];
        NEWTON = "N", "Force", 100.0, [1, 1, -2, 0, 0];
        NEWTON_PER_METRE = "N/m", "Stiffness", 1e4, [1, 0, -2, 0, 0];
        NEWTON_PER_METRE2 = "N/m2", "StiffnessSlope", 1e5, [1, -1, -2, 0, 0];
        NEWTON_PER_METRE3 = "N/m3", "StiffnessCurvature", 1e6, [1, -2, -2, 0, 0];
        NEWTON_SECOND_PER_METRE = "N.s/m", "Damping", 100.0, [1, 0, -1, 0, 0];
        METRE_SECOND = "m.s", "DampingSlope", 1e-4, [0, 1, 1, 0, 0];
        METRE_PER_NEWTON = "m/N", "Compliance", 1e-5, [-1, 0, 2, 0, 0];
        PASCAL = "Pa", "Pressure", 1e5, [1, -1, -2, 0, 0];
        PASCAL_PER_SECOND = "Pa/s", "PressureRate", 1e5, [1, -1, -3, 0, 0];
        PER_PASCAL = "1/Pa", "PressureSlope", 1e-6, [-1, 1, 2, 0, 0];
        METRE_PER_PASCAL = "m/Pa", "LengthSlope", 1e-6, [-1, 2, 2, 0, 0];
        METRE_PER_PASCAL2 = "m/Pa2", "LengthCurvature", 1e-12, [-2, 3, 4, 0, 0];
        NEWTON_PER_METRE2_PASCAL = "N/(m2.Pa)", "StiffnessSlopePerPressure", 1.0, [0, 0, 0, 0, 0];
        NEWTON_PER_METRE_PASCAL2 = "N/(m.Pa2)", "StiffnessPerPressure2", 1e-7, [-1, 2, 2, 0, 0];
        PER_SECOND = "1/s", "Rate", 1.0, [0, 0, -1, 0, 0];
        PER_VOLT = "1/V", "GainSlope", 0.1, [-1, -2, 3, 1, 0];
        VOLT = "V", "Voltage", 1.0, [1, 2, -3, -1, 0];
        VOLT_PER_SECOND = "V/s", "VoltageRate", 1.0, [1, 2, -4, -1, 0];
        PASCAL_PER_VOLT = "Pa/V", "ValveGain", 1e5, [0, -3, 1, 1, 0];
        RADIAN_PER_SECOND = "rad/s", "AngularFrequency", 10.0, [0, 0, -1, 0, 1];
        VOLT_PER_METRE = "V/m", "ProportionalGain", 1.0, [1, 1, -3, -1, 0];
        VOLT_PER_METRE_SECOND = "V/(m.s)", "IntegralGain", 1.0, [1, 1, -4, -1, 0];
        VOLT_SECOND_PER_METRE = "V.s/m", "DerivativeGain", 1.0, [1, 1, -2, -1, 0];
    }
}

/// What a variable is to the model that carries it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Set from outside at any time.
    Input,
    /// Computed by the model.
    Output,
    /// A parameter that may change while simulating.
    Tunable,
    /// A parameter that counts only at the start.
    Fixed,
}

impl Role {
    /// Whether this is a parameter of either sort.
    pub fn is_parameter(self) -> bool {
        matches!(self, Role::Tunable | Role::Fixed)
    }
}

/// One choice of an enumeration variable.
#[derive(Debug)]
pub struct Choice {
    /// Name as written in files.
    pub name: &'static str,
    /// One line on what it means.
    pub description: &'static str,
}

/// What values a variable takes.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// A real number.
    Real,
    /// One of named choices; its number counts from 1.
    Enumeration(&'static str, &'static [Choice]),
}

/// The declaration of one variable: everything that is known of it in one place.
#[derive(Debug)]
pub struct Variable {
    /// Full, structured name.
    pub name: &'static str,
    /// One line.
    pub description: &'static str,
    /// Unit of the value and its bounds.
    pub unit: Unit,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// Input, output or parameter.
    pub role: Role,
    /// Real or enumeration.
    pub kind: Kind,
    /// Which of several recordings it is of, by its number from 1; 0 where it is of all alike.
    pub of_recording: usize,
    /// Whether it stays so in the recordings that follow.
    pub stays: bool,
}

impl Variable {
    /// First part of the name: the group it belongs to.
    pub fn group(&self) -> &'static str {
        self.name.split('.').next().unwrap_or(self.name)
    }

    /// Whether it makes a difference to one of several recordings, by its number from 1.
    pub fn is_felt_in(&self, recording: usize) -> bool {
        self.of_recording == 0 || self.of_recording == recording || self.stays && self.of_recording < recording
    }

    /// Whether a parameter may change while simulating.
    pub fn is_tunable(&self) -> bool {
        self.role == Role::Tunable && matches!(self.kind, Kind::Real)
    }

    /// Name of the choice that a value stands for; `None` for a real number.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn choice(&self, value: f64) -> Option<&'static str> {
        match self.kind {
            Kind::Real => None,
            Kind::Enumeration(_, choices) => choices.get((value as usize).saturating_sub(1)).map(|choice| choice.name),
        }
    }

    /// What it is to the model, in a word.
    pub fn role_name(&self) -> &'static str {
        match self.role {
            Role::Input => "input",
            Role::Output => "output",
            _ if self.is_tunable() => "tunable",
            _ => "fixed",
        }
    }

    /// Checks a value against this declaration.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] when the value is not finite, below `min` or above `max`;
    /// [`crate::Error::NotFinite`] where there are no such bounds; [`crate::Error::NoSuchChoice`] for an enumeration.
    pub fn check(&self, value: f64) -> crate::Result<()> {
        let whole = matches!(self.kind, Kind::Real) || value.fract() == 0.0;
        if value.is_finite() && whole && (self.min..=self.max).contains(&value) {
            return Ok(());
        }
        if let Kind::Enumeration(_, choices) = self.kind {
            let (variable, choices) = (self.name.to_owned(), choices.len());
            return Err(crate::Error::NoSuchChoice { variable, value, choices });
        }
        if self.min == f64::NEG_INFINITY && self.max == f64::INFINITY {
            return Err(crate::Error::NotFinite { variable: self.name.to_owned(), value });
        }
        Err(crate::Error::OutOfRange {
            variable: self.name.to_owned(),
            value,
            min: self.min,
            max: self.max,
            unit: self.unit.symbol,
        })
    }
}

/// A type that a variable's value can have. Every value travels as `f64`.
pub trait Scalar: Copy {
    /// Real or which enumeration.
    const KIND: Kind;
    /// The value as a number; an enumeration counts from 1.
    fn to_number(self) -> f64;
    /// The value from a number that [`Variable::check`] has accepted.
    fn from_number(number: f64) -> Self;
}

impl Scalar for f64 {
    const KIND: Kind = Kind::Real;
    fn to_number(self) -> f64 {
        self
    }
    fn from_number(number: f64) -> Self {
        number
    }
}

/// A struct whose fields are declared variables, or a composition of such structs.
pub trait Declared: Sized {
    /// Shows each variable with its value, in order of declaration.
    fn visit(&self, see: &mut dyn FnMut(&'static Variable, f64));
    /// Offers each variable with its value, and stores what comes back.
    fn visit_mut(&mut self, change: &mut dyn FnMut(&'static Variable, f64) -> f64);
}

/// A [`Declared`] struct of reals that can also be read by position, fast: the inputs or outputs of a model.
pub trait Signals: Declared + Copy + Default + Send {
    /// The declarations, in order.
    const VARIABLES: &'static [Variable];
    /// The value at a position of [`Signals::VARIABLES`].
    fn get(&self, position: usize) -> f64;
    /// Stores a value at a position.
    fn set(&mut self, position: usize, value: f64);
    /// `self + slope * span`, field by field.
    fn along(&self, slope: &Self, span: f64) -> Self;
}

/// Start, unit and range of every field of a group: `name: type = start, UNIT, min..=max;`, with `of 2` behind the range where it is of the second
/// of several recordings, or `since 2` where it stays so in those that follow. What is of a recording does nothing at zero.
macro_rules! variables {
    (
        $(#[$attribute:meta])*
        pub struct $Struct:ident in $prefix:literal as $role:ident {
            $(
                #[doc = $description:literal]
                $field:ident: $type:ty = $start:expr, $unit:ident, $range:expr $(, of $recording:literal)? $(, since $first:literal)?;
            )*
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $Struct {
            $(#[doc = concat!($description, " `", stringify!($unit), "`")] pub $field: $type,)*
        }

        impl Default for $Struct {
            fn default() -> Self {
                Self { $($field: $start,)* }
            }
        }

        impl $Struct {
            const DECLARATIONS: &'static [$crate::variables::Variable] = &[$(
                $crate::variables::Variable {
                    name: concat!($prefix, stringify!($field)),
                    description: $description.trim_ascii(),
                    unit: $crate::variables::units::$unit,
                    min: *$range.start(),
                    max: *$range.end(),
                    role: $crate::variables::Role::$role,
                    kind: <$type as $crate::variables::Scalar>::KIND,
                    of_recording: 0 $(+ $recording)? $(+ $first)?,
                    stays: false $(|| $first > 0)?,
                },
            )*];
        }

        impl $crate::variables::Declared for $Struct {
            fn visit(&self, see: &mut dyn FnMut(&'static $crate::variables::Variable, f64)) {
                let mut declarations = Self::DECLARATIONS.iter();
                $(
                    if let Some(variable) = declarations.next() {
                        see(variable, $crate::variables::Scalar::to_number(self.$field));
                    }
                )*
            }
            fn visit_mut(&mut self, change: &mut dyn FnMut(&'static $crate::variables::Variable, f64) -> f64) {
                let mut declarations = Self::DECLARATIONS.iter();
                $(
                    if let Some(variable) = declarations.next() {
                        let old = $crate::variables::Scalar::to_number(self.$field);
                        self.$field = $crate::variables::Scalar::from_number(change(variable, old));
                    }
                )*
            }
        }
    };
}

/// A group of inputs or outputs: reals of which any value is accepted.
macro_rules! signals {
    (
        $(#[$attribute:meta])*
        pub struct $Struct:ident in $prefix:literal as $role:ident {
            $( #[doc = $description:literal] $field:ident: $unit:ident; )*
        }
    ) => {
        $crate::variables::signals! {
            $(#[$attribute])*
            pub struct $Struct as $role {
                $( #[doc = $description] $field = concat!($prefix, stringify!($field)), $unit; )*
            }
        }
    };
    (
        $(#[$attribute:meta])*
        pub struct $Struct:ident as $role:ident {
            $( #[doc = $description:literal] $field:ident = $name:expr, $unit:ident; )*
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct $Struct {
            $(#[doc = concat!($description, " `", stringify!($unit), "`")] pub $field: f64,)*
        }

        impl $crate::variables::Declared for $Struct {
            fn visit(&self, see: &mut dyn FnMut(&'static $crate::variables::Variable, f64)) {
                use $crate::variables::Signals;
                let values: &[f64] = &[$(self.$field),*];
                Self::VARIABLES.iter().zip(values).for_each(|(variable, value)| see(variable, *value));
            }
            fn visit_mut(&mut self, change: &mut dyn FnMut(&'static $crate::variables::Variable, f64) -> f64) {
                use $crate::variables::Signals;
                let values: &mut [&mut f64] = &mut [$(&mut self.$field),*];
                for (variable, value) in Self::VARIABLES.iter().zip(values) {
                    **value = change(variable, **value);
                }
            }
        }

        impl $crate::variables::Signals for $Struct {
            const VARIABLES: &'static [$crate::variables::Variable] = &[$(
                $crate::variables::Variable {
                    name: $name,
                    description: $description.trim_ascii(),
                    unit: $crate::variables::units::$unit,
                    min: f64::NEG_INFINITY,
                    max: f64::INFINITY,
                    role: $crate::variables::Role::$role,
                    kind: $crate::variables::Kind::Real,
                    of_recording: 0,
                    stays: false,
                },
            )*];
            fn get(&self, position: usize) -> f64 {
                let values: &[f64] = &[$(self.$field),*];
                values[position]
            }
            fn set(&mut self, position: usize, value: f64) {
                let values: &mut [&mut f64] = &mut [$(&mut self.$field),*];
                *values[position] = value;
            }
            fn along(&self, slope: &Self, span: f64) -> Self {
                let _ = (slope, span); // unused where there are no fields
                Self { $($field: self.$field + slope.$field * span,)* }
            }
        }
    };
}

pub(crate) use {signals, variables};
