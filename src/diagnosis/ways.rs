//! How the coefficients of a nominal muscle are off decides what is an effect: off as a whole, most muscles show small ones; coefficients
//! that are each off by themselves can stand for many. Bayes' rule weighs both.

use super::Fitting;
use super::fits::{Bench, Fitted};
use super::hypothesis::{Hypothesis, neutralised};
use super::residuals::{Data, Scope};
use super::selection::evidence::{is_unsound, may_be_form, odds, takes_off};
use super::selection::{Chosen, LEAST_BESIDE_OTHERS, LEAST_EVIDENCE, MOST_EFFECTS, Search};
use crate::Result;

/// Effects that are looked for in both ways before more are in either.
const AT_FIRST: usize = 2;

/// A way in which the coefficients of the nominal model may be off, before any effect is looked for.
pub struct Way<'a> {
    bench: Bench<'a>,
    /// The nominal model with its corrections.
    baseline: Fitted,
    /// Whether no way allows more.
    allows_most: bool,
}

impl<'a> Way<'a> {
    /// Fits the nominal model with its corrections, which tell the noise; `None` where it cannot be simulated.
    pub fn new(mut bench: Bench<'a>, allows_most: bool) -> Option<Self> {
        let first = bench.baseline()?;
        bench.refine_noise(&first.residuals);
        let baseline = bench.baseline()?;
        Some(Self { bench, baseline, allows_most })
    }

    /// The hypotheses' fits.
    pub fn bench(&self) -> &Bench<'a> {
        &self.bench
    }

    /// The nominal model with its corrections.
    pub fn baseline(&self) -> &Fitted {
        &self.baseline
    }

    /// Whether no more is left than a sound model may leave.
    fn says_all(&self) -> bool {
        !is_unsound(&self.baseline.losses, &self.bench.data)
    }

    /// Looks for at most so many effects; `fitting` is told those of each fit. `None` where a model cannot be simulated.
    pub fn searched(self, most: usize, fitting: &'a Fitting<'a>) -> Option<Found<'a>> {
        Found::of(self.looked_over(None, fitting), most).map(|found| found.or_two(None))
    }

    /// Two effects that were found elsewhere, or what is as good as they are, with what there is to find beside; `None` where that does not come to
    /// two, or a model cannot be simulated.
    pub fn searched_from_two(self, found: &Fitted, fitting: &'a Fitting<'a>) -> Option<Found<'a>> {
        let mut search = self.looked_over(None, fitting);
        search.take_two(found)?;
        Found::of(search, MOST_EFFECTS).filter(|found| found.best().causes() > 1)
    }

    /// A search that has looked for single causes, also from one that was found in another way.
    fn looked_over(self, found: Option<&Fitted>, fitting: &'a Fitting<'a>) -> Search<'a> {
        let mut search = self.singles(fitting);
        if let Some(found) = found {
            search.take_single(found);
        }
        search.look_beyond();
        search
    }

    /// A search that has not looked for causes in no library yet.
    fn singles(self, fitting: &'a Fitting<'a>) -> Search<'a> {
        Search::new(self.bench, self.baseline, self.allows_most, fitting)
    }
}

/// What was found, and the search in the other way, if there was one.
type Both<'a> = (Found<'a>, Option<Search<'a>>);

/// The better one of two ways, of which the second allows more: what is known of the first one's single effects, before either is searched.
pub struct Begun<'a> {
    narrow: Search<'a>,
    /// The second one, where the first one's coefficients do not say all.
    at_once: Option<Way<'a>>,
}

impl<'a> Begun<'a> {
    /// Looks over the first way's single effects; the second way is prepared where it is needed.
    ///
    /// # Errors
    /// Those of preparing the second one.
    pub fn of(narrow: Way<'a>, wide: impl Fn() -> Result<Way<'a>>, fitting: &'a Fitting<'a>) -> Result<Self> {
        let at_once = if narrow.says_all() { None } else { Some(wide()?) };
        Ok(Self { narrow: narrow.singles(fitting), at_once })
    }

    /// Fits of the first way's single effects, not refined, the best first.
    pub fn singles(&self) -> impl Iterator<Item = &Fitted> {
        self.narrow.singles().iter().map(|single| &single.fitted)
    }

    /// Whether the nominal model leaves no more than a sound one may, by all that is known of the noise.
    pub fn needs_no_cause(&self) -> bool {
        let Search { baseline, bench, .. } = &self.narrow;
        !is_unsound(&baseline.losses, &bench.data)
    }

    /// What was found; `None` where a model cannot be simulated.
    ///
    /// # Errors
    /// Those of preparing the second way.
    pub fn better(self, wide: impl Fn() -> Result<Way<'a>>, fitting: &'a Fitting<'a>) -> Result<Option<Found<'a>>> {
        Ok(self.both(wide, fitting)?.map(|(found, other)| found.or_two(other)))
    }

    /// What was found, and the search in the way where less was, if there was one.
    fn both(self, wide: impl Fn() -> Result<Way<'a>>, fitting: &'a Fitting<'a>) -> Result<Option<Both<'a>>> {
        let Self { mut narrow, at_once } = self;
        narrow.look_beyond();
        // Against coefficients that explain all by themselves several causes would hardly have the odds, and take minutes to find.
        let most = if at_once.as_ref().is_some_and(Way::says_all) { 1 } else { MOST_EFFECTS };
        if at_once.is_none() {
            let Some(found) = Found::of(narrow, 1) else { return Ok(None) };
            if found.finds_nothing() {
                return Ok(Some((found, None)));
            }
            narrow = found.search;
        }
        let own = narrow.best_single();
        let mut wide = at_once.map_or_else(wide, Ok)?.looked_over(own.as_ref(), fitting);
        if let Some(wins) = wins_alone(&narrow, own.as_ref(), &mut wide) {
            let winner = if wins { &mut narrow } else { &mut wide };
            if let Some(chosen) = winner.up_to(1).filter(Chosen::names_causes) {
                let (search, other) = if wins { (narrow, wide) } else { (wide, narrow) };
                return Ok(Some((Found { search, chosen }, Some(other))));
            }
        }
        let Some(mut found) = Found::of(narrow, most.min(AT_FIRST)) else { return Ok(None) };
        let Some(mut other) = Found::of(wide, found.most_beside().min(AT_FIRST)) else { return Ok(None) };
        // Where another cause leads than was found, as many may be others.
        if other.search.leads_away_from(&found.chosen.best.hypothesis) {
            other.up_to(found.best().causes().min(AT_FIRST));
        }
        // A third one takes minutes to find, and none is missing where two say all.
        if !other.best().says_all() {
            found.up_to(most);
            other.up_to(found.most_beside());
        }
        let wins =
            found.best().beats(&other.best()) && other.refused().is_none_or(|refused| found.best().beats(&refused));
        let (found, other) = if wins { (found, other) } else { (other, found) };
        Ok(Some((found, Some(other.search))))
    }
}

/// Whether the single cause that looks best beats the one of a way that allows more, where that one has a name and leaves nothing, and neither
/// does the better one; `None` where that is not so. Then several effects would hardly have the odds, and others alone need only be looked for
/// in full where the better one was found.
fn wins_alone(narrow: &Search, own: Option<&Fitted>, wide: &mut Search) -> Option<bool> {
    let other = wide.best_single()?;
    let other = Best { search: wide, fitted: &other };
    if other.is_unlisted() || !other.says_all() {
        return None;
    }
    let Some(own) = own else { return Some(false) };
    let own = Best { search: narrow, fitted: own };
    let wins = own.beats(&other);
    (!wins || own.says_all()).then_some(wins)
}

/// What was found where the coefficients of the nominal model may be off in one way.
pub struct Found<'a> {
    /// Where it was looked for.
    search: Search<'a>,
    /// What came of it.
    pub chosen: Chosen,
}

impl<'a> Found<'a> {
    /// What comes of a search for at most so many effects; `None` where a model cannot be simulated.
    fn of(mut search: Search<'a>, most: usize) -> Option<Self> {
        let chosen = search.up_to(most)?;
        Some(Self { search, chosen })
    }

    /// The hypotheses' fits.
    pub fn bench(&self) -> &Bench<'a> {
        &self.search.bench
    }

    /// Whether it names two causes.
    pub fn names_two(&self) -> bool {
        self.chosen.names_causes() && self.chosen.best.hypothesis.parts.len() == 2
    }

    /// With what may rival several causes in its best form, and the choice anew: where to look and how many causes there are does not hang on that.
    pub fn beside_rivals(mut self) -> Self {
        self.chosen = self.search.with_rivals().unwrap_or(self.chosen);
        self
    }

    /// Whether one cause or none leaves no more than a sound model may.
    pub fn leaves_nothing_by_one(&self) -> bool {
        self.best().causes() <= 1 && self.best().says_all()
    }

    /// Its best fit to all samples.
    fn best(&self) -> Best<'_, 'a> {
        Best { search: &self.search, fitted: &self.chosen.best }
    }

    /// What leads, where it is refused a name.
    fn refused(&self) -> Option<Best<'_, 'a>> {
        Some(Best { search: &self.search, fitted: self.chosen.refused.as_ref()? })
    }

    /// Whether nothing is wrong, so that nothing can be where the coefficients may be off in a way that allows more.
    fn finds_nothing(&self) -> bool {
        self.best().causes() == 0 && self.best().says_all()
    }

    /// How many causes are worth looking for where the coefficients may be off in a way that allows more: where this says all, fewer causes
    /// than here, but a single one that may be another; where no second one explains a good part of what one leaves, hardly does it there.
    /// Where coefficients would have to be off here as they hardly are, causes may stand for what they are.
    fn most_beside(&self) -> usize {
        match self.best().causes() {
            _ if self.search.ends_at_one() => 1,
            0 => MOST_EFFECTS,
            _ if !self.best().says_all() || self.bench().strain(&self.chosen.best) > LEAST_EVIDENCE => MOST_EFFECTS,
            causes => (causes - 1).max(1),
        }
    }

    /// Two causes in plain forms in the place of a single one in no plain form, where they are better. Coefficients that are off may stand for the
    /// second one, so that it is looked for where they may be in the way that allows most: here, or in another search.
    fn or_two(mut self, other: Option<Search<'a>>) -> Self {
        let [part] = self.chosen.best.hypothesis.parts[..] else { return self };
        if part.is_plain() {
            return self;
        }
        let single = self.chosen.best.clone();
        if self.search.allows_most() {
            let two = self.search.as_two(&single);
            let is_better = |two: &Chosen| Best { search: &self.search, fitted: &two.best }.beats(&self.best());
            self.chosen = two.filter(is_better).unwrap_or(self.chosen);
            return self;
        }
        let Some(mut search) = other else { return self };
        match search.as_two(&single) {
            Some(chosen) if (Best { search: &search, fitted: &chosen.best }).beats(&self.best()) => {
                Self { search, chosen }
            }
            _ => self,
        }
    }

    /// Looks for more effects, at most so many, where that is worth it.
    fn up_to(&mut self, most: usize) {
        if self.search.goes_on(most)
            && let Some(chosen) = self.search.up_to(most)
        {
            self.chosen = chosen;
        }
    }
}

/// The best fit of a search.
struct Best<'s, 'a> {
    search: &'s Search<'a>,
    fitted: &'s Fitted,
}

impl Best<'_, '_> {
    fn data(&self) -> &Data<'_> {
        &self.search.bench.data
    }

    /// How many causes it has, one in no library among them.
    fn causes(&self) -> usize {
        self.fitted.hypothesis.causes()
    }

    /// Whether it has a cause in no library.
    fn is_unlisted(&self) -> bool {
        self.fitted.hypothesis.beside.is_some()
    }

    /// Whether no more is left than a sound model may leave and, of several causes, their forms.
    fn says_all(&self) -> bool {
        match self.causes() {
            0 | 1 => !is_unsound(&self.fitted.losses, self.data()),
            _ => may_be_form(&self.search.baseline.losses, &self.fitted.losses, self.data()),
        }
    }

    /// Whether its causes are better than what was found where the coefficients may be off in a way that allows more. Each cause more must be
    /// worth it, and against coefficients alone they must take off so much that these need not be what they stand for. A cause in no library
    /// must be worth it against one that has a name, and is none against coefficients that say all.
    fn beats(&self, other: &Self) -> bool {
        let more = self.causes() as f64 - other.causes() as f64;
        let (may_be, stranger) = match other.causes() {
            0 if self.is_unlisted() && other.says_all() => (false, 0.0),
            0 => {
                let without = &self.search.baseline.losses;
                (takes_off(without, &self.fitted.losses, self.data(), LEAST_BESIDE_OTHERS), 0.0)
            }
            _ => (true, f64::from(self.is_unlisted()) - f64::from(other.is_unlisted())),
        };
        self.causes() > 0 && may_be && self.odds_against(other) > LEAST_EVIDENCE * (more + stranger)
    }

    /// Logarithm of the odds against that of another way, be it with the causes that both found in the forms that they have here: which form
    /// fits best hangs on how the coefficients may be off.
    fn odds_against(&self, other: &Self) -> f64 {
        let in_these_forms = other.in_forms_of(self);
        let each = [Some(other.fitted), in_these_forms.as_ref()];
        each.into_iter()
            .flatten()
            .map(|fitted| self.odds_against_fit(&Best { fitted, ..*other }))
            .fold(f64::INFINITY, f64::min)
    }

    /// The best fit with the causes that were found elsewhere, too, in the forms that they have there; `None` where none was, or where they
    /// cannot be so.
    fn in_forms_of(&self, other: &Self) -> Option<Fitted> {
        let [own, others] = [self.fitted, other.fitted];
        let shared = others.hypothesis.parts.iter().copied().filter(|part| own.hypothesis.has(part.effect.name));
        let shared = Hypothesis { parts: shared.collect(), beside: None };
        if shared.parts.is_empty() || own.hypothesis.names() == others.hypothesis.names() {
            return None;
        }
        let hypothesis = shared.parts.iter().fold(own.hypothesis.clone(), |all, part| all.in_form_of(*part));
        let without = shared.parts.iter().fold(own.parameters, |model, part| neutralised(&model, part.effect));
        let start = shared.at_work_in(&without, &others.parameters);
        self.search.bench.exact_fit(&hypothesis, &start, Scope::All).filter(Fitted::is_possible)
    }

    /// The odds against one fit of the other way; the likelihoods are those of the other one's data.
    fn odds_against_fit(&self, other: &Self) -> f64 {
        let losses = |fitted: &Fitted| other.data().losses(&fitted.residuals, Scope::All);
        let (mut with, without) = (losses(self.fitted), losses(other.fitted));
        // The whiter residuals say how much a sample is worth, but no shape of a sound muscle is worth more than once in a block.
        for (a, b) in with.iter_mut().zip(&without) {
            a.effective = a.effective.max(b.effective).min(a.effective_beside_structure);
        }
        let more = self.fitted.hypothesis.size() as f64 - other.fitted.hypothesis.size() as f64;
        let price = |best: &Self| best.search.bench.price(best.fitted);
        odds(&without, &with, more) - price(self) + price(other)
    }
}
