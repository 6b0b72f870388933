//! Hypotheses: the nominal model with its small corrections, and the parameters of some effects set free.

use super::unlisted::Unlisted;
use crate::effects::{Description, Freed};
use crate::least_squares::Free;
use crate::muscle::ForceModelName;
use crate::parameters::Parameters;
use crate::variables::{Declared, Variable};

/// Corrections that every fit may make, in units of the declared tolerance of the nominal value: a muscle and its valve
/// are never quite the preset. Damping is the least known coefficient, and other losses of a rig add to it.
const COEFFICIENTS: [(&str, f64); 2] = [("muscle.damping", 3.0), ("valve.bandwidth", 1.0)];
/// The same of a muscle whose force is a polynomial, where each of its coefficients may be off by itself.
const OF_POLYNOMIAL: [(&str, f64); 8] = [
    ("virtual_area.area_0", 1.0),
    ("virtual_area.area_1", 1.0),
    ("virtual_area.area_2", 1.0),
    ("virtual_area.area_3", 1.0),
    ("virtual_area.elastic_0", 1.0),
    ("virtual_area.elastic_1", 1.0),
    ("virtual_area.elastic_2", 1.0),
    ("virtual_area.elastic_3", 1.0),
];
/// Corrections of shape with their expected size in units of the tolerance: no polynomial is quite the muscle.
const SHAPE_OF_POLYNOMIAL: [(&str, f64); 2] = [("muscle.area_bend", 0.1), ("muscle.area_wave", 0.05)];
/// Corrections of a muscle that is off as a whole, be it a polynomial or not.
const AS_A_WHOLE: [(&str, f64); 2] = [("muscle.area_scale", 1.0), ("muscle.elastic_scale", 1.0)];
/// Corrections of shape of a polynomial that is off as a whole: its slope is not among the coefficients then.
const SHAPE_AS_A_WHOLE: [(&str, f64); 3] =
    [("muscle.area_tilt", 0.1), ("muscle.area_bend", 0.1), ("muscle.area_wave", 0.05)];
/// Corrections of shape of any other force, whose coefficients may all act alike or cancel each other.
const SHAPE_OF_COURSE: [(&str, f64); 3] =
    [("muscle.area_tilt", 0.4), ("muscle.area_bend", 0.2), ("muscle.elastic_tilt", 0.6)];
/// A form with at least so many starts has many minima.
const MANY_STARTS: usize = 10;
/// Share of its usual span below which a change of a parameter is too small to tell its slope.
const LEAST_TYPICAL: f64 = 1e-3;

/// Some of the parameters of a form, or of the refinements of an effect: a bit for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Which(u32);

impl Which {
    /// None.
    pub const NONE: Self = Self(0);

    /// The one at a position.
    pub const fn by(which: usize) -> Self {
        Self(1 << which)
    }

    /// Those whose position and parameter are wanted.
    pub fn those(freed: &[Freed], is_wanted: impl Fn(usize, &str) -> bool) -> Self {
        let every = freed.iter().enumerate();
        Self(every.filter(|(which, (name, _))| is_wanted(*which, name)).map(|(which, _)| Self::by(which).0).sum())
    }

    /// Each of these alone.
    pub fn each(self) -> impl Iterator<Item = Self> {
        (0..u32::BITS as usize).filter(move |which| self.has(*which)).map(Self::by)
    }

    const fn has(self, which: usize) -> bool {
        self.0 & Self::by(which).0 != 0
    }
}

/// An effect at work in one of its forms.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    /// The effect.
    pub effect: &'static Description,
    /// Which of its forms.
    pub form: usize,
    /// Which of its refinements are free as well.
    pub refined: Which,
    /// Which parameters of its form stay at their defaults after all.
    held: Which,
}

impl Part {
    /// An effect in one of its forms, without refinements.
    pub fn plain(effect: &'static Description, form: usize) -> Self {
        Self { effect, form, refined: Which::NONE, held: Which::NONE }
    }

    /// The parameters of its form, its size first.
    pub fn in_form(self) -> &'static [Freed] {
        self.effect.all_forms().nth(self.form).unwrap_or_default()
    }

    /// Whether it has a common form and no refinement.
    pub fn is_plain(self) -> bool {
        self.refined == Which::NONE && !self.is_rare()
    }

    /// Whether its form is none of the common ones.
    pub fn is_rare(self) -> bool {
        self.form >= self.effect.forms.len()
    }

    /// Whether the error of its form has many minima over its size.
    pub fn has_many_minima(self) -> bool {
        many_minima(self.size())
    }

    /// The parameter of its form that stands for its size.
    pub fn size(self) -> &'static Freed {
        &self.in_form()[0]
    }

    /// The free parameters; a refinement that the form has already is not counted twice.
    pub fn freed(self) -> impl Iterator<Item = &'static Freed> {
        let of_form = self.in_form().iter().enumerate().filter(move |(which, _)| !self.held.has(*which));
        of_form.map(|(_, freed)| freed).chain(self.refinements())
    }

    /// With some parameters at their defaults.
    pub fn holding(self, names: &[&str]) -> Self {
        let held = Which::those(self.in_form(), |which, name| self.held.has(which) || names.contains(&name));
        Self { held, ..self.refined_as(|name| !names.contains(&name)) }
    }

    /// The refinements that are free, but for those that the form has already.
    pub fn refinements(self) -> impl Iterator<Item = &'static Freed> {
        let form = self.in_form();
        let free = self.effect.refinements.iter().enumerate().filter(move |(which, _)| self.refined.has(*which));
        free.map(|(_, refinement)| refinement).filter(|(name, _)| form.iter().all(|(known, _)| known != name))
    }

    /// With only those of its refinements whose parameters are wanted.
    pub fn refined_as(self, is_wanted: impl Fn(&str) -> bool) -> Self {
        Self {
            refined: Which::those(self.effect.refinements, |which, name| self.refined.has(which) && is_wanted(name)),
            ..self
        }
    }

    /// How many starts its form has.
    pub fn starts(self) -> usize {
        count_starts(self.freed())
    }
}

/// Which of several recordings a parameter is of, by its number from 1; 0 where it is of all alike.
pub fn recording_of(name: &str) -> usize {
    declared(&Parameters::default(), name).0.of_recording
}

/// The most starts that any parameter has.
pub fn count_starts<'f>(freed: impl Iterator<Item = &'f Freed>) -> usize {
    freed.map(|(_, starts)| starts.len()).max().unwrap_or(0)
}

/// A model with parameters at one of their starts.
pub fn at_start<'f>(model: &Parameters, freed: impl Iterator<Item = &'f Freed>, choice: usize) -> Parameters {
    freed.fold(*model, |model, (name, values)| {
        let value = values.get(choice).or(values.last()).copied().unwrap_or_default();
        with_values(&model, &[declared(&model, name).0], &[value])
    })
}

/// The nominal model with its corrections and some effects at work, or with a cause that is in no library beside it.
#[derive(Debug, Clone, Default)]
pub struct Hypothesis {
    /// The effects.
    pub parts: Vec<Part>,
    /// What is beside the model: [`super::fits::Bench::fit_beside`] alone fits that.
    pub beside: Option<Unlisted>,
}

impl Hypothesis {
    /// With one effect more.
    pub fn with(&self, part: Part) -> Self {
        Self { parts: self.parts.iter().copied().chain([part]).collect(), ..*self }
    }

    /// With one effect less.
    pub fn without(&self, effect: &str) -> Self {
        Self { parts: self.parts.iter().copied().filter(|part| part.effect.name != effect).collect(), ..*self }
    }

    /// With one of its effects in the form of another part.
    pub fn in_form_of(&self, other: Part) -> Self {
        let exchanged = |part: &Part| if part.effect.name == other.effect.name { other } else { *part };
        Self { parts: self.parts.iter().map(exchanged).collect(), ..*self }
    }

    /// With only those of its refinements whose parameters are wanted.
    pub fn refined_as(&self, is_wanted: impl Fn(&str) -> bool) -> Self {
        Self { parts: self.parts.iter().map(|part| part.refined_as(&is_wanted)).collect(), ..*self }
    }

    /// Whether any refinement is free.
    pub fn is_refined(&self) -> bool {
        self.parts.iter().any(|part| part.refined != Which::NONE)
    }

    /// Names of the effects, sorted.
    pub fn names(&self) -> Vec<&'static str> {
        let mut names: Vec<_> = self.parts.iter().map(|part| part.effect.name).collect();
        names.sort_unstable();
        names
    }

    /// Whether an effect is at work.
    pub fn has(&self, effect: &str) -> bool {
        self.parts.iter().any(|part| part.effect.name == effect)
    }

    /// The free parameters of all effects.
    pub fn freed(&self) -> impl Iterator<Item = &'static Freed> {
        self.parts.iter().flat_map(|part| part.freed())
    }

    /// The declarations of the free parameters of all effects.
    pub fn variables(&self) -> Vec<&'static Variable> {
        self.freed().map(|(name, _)| declared(&Parameters::default(), name).0).collect()
    }

    /// A model with the effects as they are at work in another one.
    pub fn at_work_in(&self, model: &Parameters, other: &Parameters) -> Parameters {
        let (variables, values): (Vec<_>, Vec<_>) = self.freed().map(|(name, _)| declared(other, name)).unzip();
        with_values(model, &variables, &values)
    }

    /// Whether an effect would have to be other than it can be, or larger: the fit ended at a bound of its size.
    pub fn is_impossible(&self, parameters: &Parameters) -> bool {
        let is_too_large = |part: &Part| {
            let (size, _) = *part.size();
            let ((variable, value), neutral) = (declared(parameters, size), declared(&Parameters::default(), size).1);
            value != neutral && (value <= variable.min || value >= variable.max)
        };
        self.parts.iter().any(|part| !parameters.effects.is_plausible(part.effect.name) || is_too_large(part))
    }

    /// How many causes there are.
    pub fn causes(&self) -> usize {
        self.parts.len() + usize::from(self.beside.is_some())
    }

    /// How many parameters the causes have.
    pub fn size(&self) -> usize {
        self.freed().count() + self.beside.map_or(0, Unlisted::parameters)
    }
}

/// Declaration and value of a parameter by its name, which must be one.
pub fn declared(parameters: &Parameters, name: &str) -> (&'static Variable, f64) {
    parameters.find(name).unwrap_or_else(|| panic!("`{name}` is declared"))
}

/// Parameters with one effect at its neutral defaults.
pub fn neutralised(parameters: &Parameters, effect: &Description) -> Parameters {
    let (mut parameters, default) = (*parameters, Parameters::default());
    parameters.visit_mut(&mut |variable, old| {
        if variable.group() == effect.name { declared(&default, variable.name).1 } else { old }
    });
    parameters
}

/// Parameters with some of them set.
pub fn with_values(base: &Parameters, variables: &[&'static Variable], values: &[f64]) -> Parameters {
    let mut parameters = *base;
    parameters.visit_mut(&mut |variable, old| {
        variables.iter().position(|free| free.name == variable.name).map_or(old, |k| values[k])
    });
    parameters
}

/// How a nominal muscle may be off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Off {
    /// Area and elastic force as a whole.
    AsAWhole,
    /// Each coefficient of its polynomials by itself.
    Each,
    /// Area and elastic force as a whole, and a little in their course.
    InCourse,
}

impl Off {
    /// The ways in which the coefficients of a model may be off, the one that allows most last.
    pub fn ways(nominal: &Parameters) -> &'static [Self] {
        // A piston of constant area has no slope that could be off.
        let is_polynomial = nominal.muscle.force_model == ForceModelName::VirtualArea
            && nominal.force_models.virtual_area.area_1 != 0.0;
        if is_polynomial { &[Self::AsAWhole, Self::Each] } else { &[Self::InCourse] }
    }

    /// The way that allows most.
    pub fn most(nominal: &Parameters) -> Self {
        Self::ways(nominal).last().copied().unwrap_or(Self::InCourse)
    }
}

/// Corrections that every fit may make of a nominal model that is good to `tolerance`, with their bounds and priors.
pub fn corrections(nominal: &Parameters, tolerance: f64, off: Off) -> Vec<(&'static Variable, Free)> {
    let (own, shapes): (&[_], &[_]) = match off {
        Off::AsAWhole => (&AS_A_WHOLE, &SHAPE_AS_A_WHOLE),
        Off::Each => (&OF_POLYNOMIAL, &SHAPE_OF_POLYNOMIAL),
        Off::InCourse => (&AS_A_WHOLE, &SHAPE_OF_COURSE),
    };
    let relative = own.iter().chain(&COEFFICIENTS).filter_map(|(name, share)| {
        let (variable, start) = declared(nominal, name);
        let size = share * tolerance * start.abs();
        // The deviation of a uniform distribution over the tolerance.
        let prior = Some((start, size / 3.0_f64.sqrt()));
        let (lower, upper) = ((start - size).max(variable.min), (start + size).min(variable.max));
        (size > 0.0).then_some((variable, Free { start, lower, upper, typical: size, prior }))
    });
    let shapes = shapes.iter().map(|(name, share)| {
        let (variable, start) = declared(nominal, name);
        let size = share * tolerance;
        let (lower, upper) = (start - 3.0 * size, start + 3.0 * size);
        (variable, Free { start, lower, upper, typical: size, prior: Some((start, size)) })
    });
    relative.chain(shapes).collect()
}

/// Whether the error has many minima over the size of an effect in some form: it must be looked for anew when what else is at
/// work has changed.
pub fn has_many_minima(effect: &Description) -> bool {
    effect.forms.iter().any(|form| many_minima(&form[0]))
}

/// The same of the size of a form.
pub fn many_minima((_, starts): &Freed) -> bool {
    starts.len() >= MANY_STARTS
}

/// Bounds of parameters of effects; a change of the size of the start matters, unless that is next to nothing.
pub fn bounds(variables: &[&'static Variable], start: &Parameters) -> Vec<Free> {
    let bounds = |variable: &&'static Variable| {
        let start = declared(start, variable.name).1;
        let span = (variable.max - variable.min).min(2.0 * variable.unit.nominal);
        let typical = if start == 0.0 { 0.05 * span } else { start.abs().max(LEAST_TYPICAL * span) };
        Free { start, lower: variable.min, upper: variable.max, typical, prior: None }
    };
    variables.iter().map(bounds).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effects;

    #[test]
    fn what_is_held_is_neither_free_in_a_form_nor_as_a_refinement() {
        let effect = Effects::description("leakage").unwrap();
        let form =
            effect.all_forms().position(|form| form.iter().any(|(name, _)| *name == "leakage.choked_share")).unwrap();
        let refined =
            Which::those(effect.refinements, |_, name| name == "leakage.exponent" || name == "leakage.volume_growth");
        let part = Part { refined, ..Part::plain(effect, form) };
        let names = |part: Part| part.freed().map(|(name, _)| *name).collect::<Vec<_>>();
        assert_eq!(names(part), ["leakage.rate", "leakage.choked_share", "leakage.volume_growth", "leakage.exponent"]);
        let held = part.holding(&["leakage.choked_share", "leakage.exponent", "creep.amplitude_1"]);
        assert_eq!(names(held), ["leakage.rate", "leakage.volume_growth"]);
        assert_eq!(held.size().0, "leakage.rate");
    }
}
