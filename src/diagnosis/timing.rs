//! How the command went between two samples: somewhere on the way, as where a logger runs by itself; or it jumped at the very sample that
//! shows it, as where one program sets and logs it; or it was held from sample to sample, as by a digital controller. No column tells which;
//! half a sampling interval makes errors that flows, delays and dead bands can stand for, so that what explains the data better with the
//! same causes decides.

use super::Fitting;
use super::fits::{Bench, Changes, Fitted};
use super::hypothesis::{Hypothesis, Off, Part};
use super::residuals::{self, Data, Loss, Scope};
use super::selection::evidence::{explained, gain, odds};
use super::selection::{LEAST_EVIDENCE, MAY_COME_FURTHER, MOST_EFFECTS, OUT_OF_REACH};
use super::ways::{Begun, Found, Way};
use crate::Result;
use crate::effects::Effects;
use crate::integrator::Accuracy;
use crate::measurement::{Between, Recording};
use crate::parameters::Parameters;

/// Seconds between samples that fits use, about: two hundred a second resolve the fastest effect, and more only take longer.
/// Of long recordings a hundred do, where more would be above [`MANY_SAMPLES`] in all.
const PERIODS: (f64, f64) = (5e-3, 1e-2);
const MANY_SAMPLES: f64 = 1e4;

/// Accuracy of the integration in fits. Ten times the tolerance is far below all noise, too, but makes derivatives by differences so rough
/// that fits of dry friction get stuck; with [`Accuracy::USUAL`] it takes half as long again. No start of an effect takes as
/// many steps a second; a cable beside stiff friction took 16 s for one recording, and nothing came of it.
pub const INTEGRATION: Accuracy = Accuracy { tolerance: 1e-7, most_steps: 3e4 };

/// Single effects with which both are tried before more are looked for.
const TRIED: usize = 2;

/// Effects of a valve that answers late: half a sampling interval is hardly to be told from them.
const LATE: [&str; 2] = ["valve_dead_time", "valve_lag"];

/// The recordings with as many samples as fits need.
pub fn thinned(recordings: &[Recording]) -> Vec<Recording> {
    let period = recordings.iter().map(Recording::duration).sum::<f64>() / MANY_SAMPLES;
    recordings.iter().map(|recording| recording.thinned(period.clamp(PERIODS.0, PERIODS.1))).collect()
}

/// Recordings whose command went between samples in one way, with what is asked of them.
pub struct Taken<'r> {
    nominal: &'r Parameters,
    tolerance: f64,
    recordings: Vec<Recording>,
    /// With as many samples as fits need.
    thinned: Vec<Recording>,
    changes: Changes,
}

impl<'r> Taken<'r> {
    /// Recordings against a nominal model that is good to `tolerance`, in all ways that make a difference; straight lines come first.
    pub fn in_all_ways(recordings: &[Recording], nominal: &'r Parameters, tolerance: f64) -> Vec<Self> {
        let differs = |between: &Between| {
            *between == Between::Lines || is_off_in_two_ways(nominal) && recordings.iter().any(|r| r.can_go(*between))
        };
        let ways = [Between::Lines, Between::Jumps, Between::Held].into_iter().filter(differs);
        ways.map(|between| Self::new(recordings, between, nominal, tolerance)).collect()
    }

    fn new(recordings: &[Recording], between: Between, nominal: &'r Parameters, tolerance: f64) -> Self {
        // A single way asks for each once.
        let changes = Changes::new(if is_off_in_two_ways(nominal) { usize::MAX } else { 0 });
        let recordings: Vec<Recording> = recordings.iter().map(|recording| recording.going(between)).collect();
        let thinned = thinned(&recordings);
        Self { nominal, tolerance, recordings, thinned, changes }
    }

    /// All samples.
    fn data(&self) -> Result<Data<'_>> {
        Data::new(&self.recordings, self.nominal, self.tolerance)
    }

    fn bench(&self, off: Off) -> Result<Bench<'_>> {
        let mut for_fits = Data::new(&self.thinned, self.nominal, self.tolerance)?;
        for_fits.integration = INTEGRATION;
        for_fits.doubt_starts(self.nominal);
        Ok(Bench::new(for_fits, self.nominal, self.tolerance, off, &self.changes))
    }

    fn way(&self, off: Off) -> Result<Way<'_>> {
        let way = Way::new(self.bench(off)?, off == Off::most(self.nominal));
        way.ok_or_else(|| residuals::cannot_follow(&self.recordings))
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
        found.ok_or_else(|| residuals::cannot_follow(&self.recordings))
    }

    /// What there is to find.
    fn searched<'a>(&'a self, fitting: &'a Fitting<'a>) -> Result<Found<'a>> {
        let first = self.first_way()?;
        if is_off_in_two_ways(self.nominal) {
            return self.ended(self.begun(first, fitting)?, fitting);
        }
        first.searched(MOST_EFFECTS, fitting).ok_or_else(|| residuals::cannot_follow(&self.recordings))
    }

    /// The same after something was found in another way. Two causes that are two here, too, where the coefficients may be off most, are what there
    /// is: to look for all others again takes minutes.
    fn searched_again<'a>(&'a self, found: &Found<'a>, fitting: &'a Fitting<'a>) -> Result<Found<'a>> {
        let again =
            if found.names_two() { self.wide_way()?.searched_from_two(&found.chosen.best, fitting) } else { None };
        again.map_or_else(|| self.searched(fitting), Ok)
    }
}

/// Whether there are two ways in which the coefficients of a nominal model may be off.
fn is_off_in_two_ways(nominal: &Parameters) -> bool {
    Off::ways(nominal).len() > 1
}

/// What is found in recordings where the command went along straight lines, the first ones, or as explains them far better; with all samples
/// of these.
///
/// # Errors
/// Those of the simulation of the nominal model.
pub fn better<'a>(taken: &'a [Taken<'a>], fitting: &'a Fitting<'a>) -> Result<(Found<'a>, Data<'a>)> {
    let lines = &taken[0];
    // A model that cannot be simulated at all is the user's to mend.
    let mut data = taken.iter().map(Taken::data).collect::<Result<Vec<_>>>()?;
    if taken.len() == 1 {
        return Ok((lines.searched(fitting)?.beside_rivals(), data.remove(0)));
    }
    let first = lines.first_way()?;
    let benches = taken[1..].iter().map(|other| other.bench(first.bench().off)).collect::<Result<_>>()?;
    let mut compared = Compared { taken, data, benches };
    let anew = |way: usize| -> Result<_> { Ok((way, taken[way].searched(fitting)?)) };
    let (way, found) = if let Some(way) = compared.needed_at_once(&first) {
        anew(way)?
    } else {
        let begun = lines.begun(first, fitting)?;
        match compared.needed_by_singles(&begun) {
            Some(way) => anew(way)?,
            None => (0, lines.ended(begun, fitting)?),
        }
    };
    let (way, found) = match compared.needed_in_the_end(&found, way) {
        Some(other) => (other, taken[other].searched_again(&found, fitting)?),
        None => (way, found),
    };
    Ok((found.beside_rivals(), compared.data.swap_remove(way)))
}

/// Recordings as they were taken in all ways, straight lines first.
struct Compared<'a> {
    taken: &'a [Taken<'a>],
    /// All samples.
    data: Vec<Data<'a>>,
    /// Of the ways beside straight lines.
    benches: Vec<Bench<'a>>,
}

impl Compared<'_> {
    /// Which other way explains the data far better with the nominal model, and a good part of what it leaves: beside other errors half a sampling
    /// interval may be better by chance. No valve that is late by itself has the odds against it.
    fn needed_at_once(&self, way: &Way) -> Option<usize> {
        let (bench, baseline) = (way.bench(), way.baseline());
        let own = self.losses(0, 0, baseline)?;
        let far_better = self.far_better_again(std::slice::from_ref(&own), [baseline].into_iter());
        let (best, going) = far_better.filter(|(_, going)| self.is_worth_it(0, &own, going))?;
        let base = bench.base(baseline);
        let mut late = LATE.into_iter().filter_map(|name| {
            let start = bench.starts(&base, Effects::description(name)?).into_iter().next()?;
            let late = Hypothesis::default().with(start.part);
            let losses = self.losses(0, 0, &bench.exact_fit(&late, &start.parameters, Scope::All)?)?;
            Some(odds(&going, &losses, late.size() as f64))
        });
        late.all(|odds| odds <= LEAST_EVIDENCE).then_some(best)
    }

    /// Which other way explains the data far better with one of the best single effects than these do.
    fn needed_by_singles(&self, begun: &Begun) -> Option<usize> {
        // None is needed to explain more where the nominal model leaves nothing.
        if begun.needs_no_cause() {
            return None;
        }
        let singles: Vec<&Fitted> = begun.singles().take(TRIED).collect();
        let own = singles.iter().map(|single| self.losses(0, 0, single)).collect::<Option<Vec<_>>>()?;
        self.far_better_again(&own, singles.into_iter()).map(|(best, _)| best)
    }

    /// Which other way explains the data far better with the causes that were found in the one that was thought best, and a good part of what
    /// they leave there, or makes one of the causes needless.
    fn needed_in_the_end(&self, found: &Found, now: usize) -> Option<usize> {
        let own = self.losses(now, now, &found.chosen.best)?;
        let others: Vec<usize> = (0..self.taken.len()).filter(|other| *other != now).collect();
        let explains_more = || self.explains_more(found, now, &own, &others);
        // None is needed to explain more where at most one cause leaves nothing.
        let more = if found.leaves_nothing_by_one() { None } else { explains_more() };
        more.or_else(|| self.needs_less(found, now, &own, &others))
    }

    /// Which of some other ways explains the data far better with the causes that were found in one, and a good part of what they leave there.
    fn explains_more(&self, found: &Found, now: usize, own: &[Loss], others: &[usize]) -> Option<usize> {
        let again = others.iter().filter_map(|other| {
            let again = self.exact_fit_again(&found.chosen.best, *other, found.bench().off)?;
            Some((*other, self.losses(now, *other, &again)?))
        });
        let better = again.filter(|(_, other)| self.is_worth_it(now, own, other) && is_far_better(own, other));
        best(better).map(|(best, _)| best)
    }

    /// Whether a good part goes away of what losses leave, as the noise of a judging way has it.
    fn is_worth_it(&self, judge: usize, own: &[Loss], other: &[Loss]) -> bool {
        explained(own, other, &self.data[judge]) >= MAY_COME_FURTHER
    }

    /// Which of some other ways is so likely with one of the causes less than were found in one that this one has not the odds against it.
    fn needs_less(&self, found: &Found, now: usize, own: &[Loss], others: &[usize]) -> Option<usize> {
        let all = &found.chosen.best;
        let without = |part: &Part| found.bench().neutralised(all, part.effect);
        let fewer: Vec<Fitted> = all.hypothesis.parts.iter().filter_map(without).collect();
        let as_likely = others.iter().filter_map(|other| {
            let bench = self.taken[*other].bench(found.bench().off).ok()?;
            let each = fewer.iter().filter_map(|fewer| {
                let more = all.hypothesis.size() as f64 - fewer.hypothesis.size() as f64;
                let odds_against = |losses: &[Loss]| odds(losses, own, more);
                let rough = bench.rough_fit_again(fewer)?;
                // The end of a fit that is far away changes nothing.
                let samples: f64 = own.iter().map(|loss| loss.effective).sum();
                if odds_against(&self.losses(now, *other, &rough)?) > 0.5 * samples * OUT_OF_REACH.ln() {
                    return None;
                }
                let again = bench.exact_fit(&fewer.hypothesis, &rough.parameters, Scope::All)?;
                let losses = self.losses(now, *other, &again)?;
                (odds_against(&losses) <= LEAST_EVIDENCE).then_some((*other, losses))
            });
            best(each)
        });
        best(as_likely).map(|(best, _)| best)
    }

    /// The best way beside straight lines with one of several fits to these, if it explains the data far better than all own ones, and what a
    /// rough fit leaves there. Rough fits of coefficients that are off as a whole do not tell two such ways from each other.
    fn far_better_again<'f>(
        &self,
        own: &[Vec<Loss>],
        fits: impl Iterator<Item = &'f Fitted>,
    ) -> Option<(usize, Vec<Loss>)> {
        let each = fits.flat_map(|fitted| (1..).zip(&self.benches).map(move |(way, bench)| (way, bench, fitted)));
        let rough = each.filter_map(|(way, bench, fitted)| {
            let again = bench.rough_fit_again(fitted)?;
            Some((way, self.losses(0, way, &again)?, again))
        });
        let better: Vec<_> = rough.filter(|(_, losses, _)| own.iter().all(|own| is_far_better(own, losses))).collect();
        let are_of_one_way = better.iter().all(|(way, ..)| *way == better[0].0);
        let precise = better.iter().filter(|_| !are_of_one_way).filter_map(|(way, _, rough)| {
            let most = Off::most(self.taken[*way].nominal);
            Some((*way, self.losses(0, *way, &self.exact_fit_again(rough, *way, most)?)?))
        });
        let likely = best(precise).map(|(way, _)| way);
        let is_likely = |way: usize| likely.is_none_or(|likely| way == likely);
        best(better.into_iter().map(|(way, losses, _)| (way, losses)).filter(|(way, _)| is_likely(*way)))
    }

    /// A fit to the end of the same causes in another way.
    fn exact_fit_again(&self, fitted: &Fitted, way: usize, off: Off) -> Option<Fitted> {
        self.taken[way].bench(off).ok()?.exact_fit(&fitted.hypothesis, &fitted.parameters, Scope::All)
    }

    /// Losses of a fit to recordings that were taken in one way, as the noise of a judging one has them.
    fn losses(&self, judge: usize, way: usize, fitted: &Fitted) -> Option<Vec<Loss>> {
        Some(self.data[judge].losses(&self.data[way].residuals(&fitted.parameters)?, Scope::All))
    }
}

/// Whether a fit in another way explains the data far better than an own one. Where a jump may have come at any instant between two samples, what
/// that may leave is no reason for another way: a few that came late by chance would be.
fn is_far_better(own: &[Loss], other: &[Loss]) -> bool {
    let excused: Vec<Loss> = own.iter().map(|loss| Loss { excess: loss.doubtless, ..*loss }).collect();
    gain(&excused, other) > LEAST_EVIDENCE
}

/// The one of several fits in other ways that explains most.
fn best(others: impl Iterator<Item = (usize, Vec<Loss>)>) -> Option<(usize, Vec<Loss>)> {
    others.reduce(|best, next| if gain(&best.1, &next.1) > 0.0 { next } else { best })
}
