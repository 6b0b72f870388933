//! When the command jumped between two samples: somewhere on the way, as where a logger runs by itself, or at the very sample that shows it,
//! as where one program sets and logs the command. No column tells which; half a sampling interval makes errors that flows, delays and dead
//! bands can stand for, so that what explains the data better with the same causes decides.

use super::Fitting;
use super::fits::{Bench, Changes, Fitted};
use super::hypothesis::{Hypothesis, Off};
use super::residuals::{self, Data, Scope};
use super::selection::evidence::{gain, odds};
use super::selection::{LEAST_EVIDENCE, MOST_EFFECTS};
use super::ways::{Begun, Found, Way};
use crate::Result;
use crate::effects::Effects;
use crate::integrator::Accuracy;
use crate::measurement::Recording;
use crate::parameters::Parameters;

/// Seconds between samples that fits use, about: two hundred a second resolve the fastest effect, and more only take longer.
/// Of long recordings a hundred do, where more would be above [`MANY_SAMPLES`] in all.
const PERIODS: (f64, f64) = (5e-3, 1e-2);
const MANY_SAMPLES: f64 = 13e3;

/// Accuracy of the integration in fits. Ten times the tolerance is far below all noise, too, but makes derivatives by differences so rough
/// that fits of dry friction get stuck; with [`Accuracy::USUAL`] it takes half as long again. No start of an effect takes as
/// many steps a second; a cable beside stiff friction took 16 s for one recording, and nothing came of it.
pub const INTEGRATION: Accuracy = Accuracy { tolerance: 1e-7, most_steps: 3e4 };

/// Single effects with which both are tried before more are looked for.
const TRIED: usize = 2;

/// The recordings with as many samples as fits need.
pub fn thinned(recordings: &[Recording]) -> Vec<Recording> {
    let period = recordings.iter().map(Recording::duration).sum::<f64>() / MANY_SAMPLES;
    recordings.iter().map(|recording| recording.thinned(period.clamp(PERIODS.0, PERIODS.1))).collect()
}

/// Recordings, taken in one way, with what is asked of them.
pub struct Taken<'r> {
    nominal: &'r Parameters,
    tolerance: f64,
    recordings: &'r [Recording],
    /// With as many samples as fits need.
    thinned: Vec<Recording>,
    changes: Changes,
}

impl<'r> Taken<'r> {
    /// Recordings against a nominal model that is good to `tolerance`.
    pub fn new(recordings: &'r [Recording], nominal: &'r Parameters, tolerance: f64) -> Self {
        // A single way asks for each once.
        let changes = Changes::new(if is_off_in_two_ways(nominal) { usize::MAX } else { 0 });
        Self { nominal, tolerance, recordings, thinned: thinned(recordings), changes }
    }

    /// All samples.
    fn data(&self) -> Result<Data<'_>> {
        Data::new(self.recordings, self.nominal, self.tolerance)
    }

    fn bench(&self, off: Off) -> Result<Bench<'_>> {
        let mut for_fits = Data::new(&self.thinned, self.nominal, self.tolerance)?;
        for_fits.integration = INTEGRATION;
        for_fits.doubt_starts(self.nominal);
        Ok(Bench::new(for_fits, self.nominal, self.tolerance, off, &self.changes))
    }

    fn way(&self, off: Off) -> Result<Way<'_>> {
        let way = Way::new(self.bench(off)?, off == Off::most(self.nominal));
        way.ok_or_else(|| residuals::cannot_follow(self.recordings))
    }

    fn first_way(&self) -> Result<Way<'_>> {
        self.way(Off::ways(self.nominal)[0])
    }

    fn wide_way(&self) -> Result<Way<'_>> {
        self.way(Off::most(self.nominal))
    }

    fn begun<'a>(&'a self, first: Way<'a>, fitting: &'a Fitting<'a>) -> Result<Begun<'a>> {
        Begun::of(first, || self.wide_way(), fitting)
    }

    fn ended<'a>(&'a self, begun: Begun<'a>, fitting: &'a Fitting<'a>) -> Result<Found<'a>> {
        let found = begun.better(|| self.wide_way(), fitting)?;
        found.ok_or_else(|| residuals::cannot_follow(self.recordings))
    }

    /// What there is to find.
    fn searched<'a>(&'a self, fitting: &'a Fitting<'a>) -> Result<Found<'a>> {
        let first = self.first_way()?;
        if is_off_in_two_ways(self.nominal) {
            return self.ended(self.begun(first, fitting)?, fitting);
        }
        first.searched(MOST_EFFECTS, fitting).ok_or_else(|| residuals::cannot_follow(self.recordings))
    }
}

/// Whether there are two ways in which the coefficients of a nominal model may be off.
fn is_off_in_two_ways(nominal: &Parameters) -> bool {
    Off::ways(nominal).len() > 1
}

/// What is found in recordings with jumps on the way, or at samples where that explains them better; with all samples of these.
///
/// # Errors
/// Those of the simulation of the nominal model.
pub fn better<'a>(
    on_the_way: &'a Taken<'a>,
    at_samples: &'a Taken<'a>,
    fitting: &'a Fitting<'a>,
) -> Result<(Found<'a>, Data<'a>)> {
    let data = on_the_way.data()?; // a model that cannot be simulated at all is the user's to mend
    if !is_off_in_two_ways(on_the_way.nominal) || !on_the_way.recordings.iter().any(Recording::jumps_far) {
        return Ok((on_the_way.searched(fitting)?, data));
    }
    let way = on_the_way.first_way()?;
    let (others, anew) = (at_samples.data()?, at_samples.bench(way.bench().off)?);
    if !needs_jumps_at_samples(&way, &anew, &data, &others) {
        let begun = on_the_way.begun(way, fitting)?;
        if !is_mistimed(&begun, &anew, &data, &others) {
            return in_turn((on_the_way.ended(begun, fitting)?, data), at_samples, others, fitting);
        }
    }
    in_turn((at_samples.searched(fitting)?, others), on_the_way, data, fitting)
}

/// Whether one of the best single effects explains the data far better with jumps at samples; `anew` fits it there.
fn is_mistimed(begun: &Begun, anew: &Bench, data: &Data, others: &Data) -> bool {
    let is_better = |single: &Fitted| explains_better((data, single), (others, &anew.rough_fit_again(single)?));
    begun.singles().take(TRIED).any(|single| is_better(single) == Some(true))
}

/// What was found, or what is found where jumps come as in `other`, if the same causes explain the data better there.
fn in_turn<'a>(
    (found, data): (Found<'a>, Data<'a>),
    other: &'a Taken<'a>,
    others: Data<'a>,
    fitting: &'a Fitting<'a>,
) -> Result<(Found<'a>, Data<'a>)> {
    if found.leaves_nothing_by_one() {
        return Ok((found, data));
    }
    let best = &found.chosen.best;
    let fitted = other.bench(found.bench().off)?.exact_fit(&best.hypothesis, &best.parameters, Scope::All);
    if fitted.and_then(|fitted| explains_better((&data, best), (&others, &fitted))) == Some(true) {
        return Ok((other.searched(fitting)?, others));
    }
    Ok((found, data))
}

/// Whether jumps at samples explain what the nominal model leaves far better than jumps on the way, and no worse than a dead time would;
/// `anew` fits it there.
fn needs_jumps_at_samples(way: &Way, anew: &Bench, data: &Data, others: &Data) -> bool {
    let is_needed = || {
        let (bench, baseline) = (way.bench(), way.baseline());
        let [own, jumping] = losses(data, [(data, baseline), (others, &anew.rough_fit_again(baseline)?)])?;
        if gain(&own, &jumping) <= LEAST_EVIDENCE {
            return Some(false);
        }
        let dead_time = Effects::description("valve_dead_time")?;
        let start = bench.starts(baseline, dead_time).into_iter().next()?;
        let late = Hypothesis::default().with(start.part);
        let [late] = losses(data, [(data, &bench.exact_fit(&late, &start.parameters, Scope::All)?)])?;
        Some(odds(&late, &jumping, -1.0) >= 0.0)
    };
    is_needed() == Some(true)
}

/// Whether the second of two fits of the same causes to recordings that were taken in different ways is far better.
fn explains_better(one: (&Data, &Fitted), other: (&Data, &Fitted)) -> Option<bool> {
    let [without, with] = losses(one.0, [one, other])?;
    Some(gain(&without, &with) > LEAST_EVIDENCE)
}

/// Losses of fits to recordings that were taken in one way or another, as the noise of the first one has them.
fn losses<const N: usize>(judge: &Data, fits: [(&Data, &Fitted); N]) -> Option<[Vec<residuals::Loss>; N]> {
    let each = fits.map(|(data, fitted)| Some(judge.losses(&data.residuals(&fitted.parameters)?, Scope::All)));
    each.into_iter().collect::<Option<Vec<_>>>()?.try_into().ok()
}
