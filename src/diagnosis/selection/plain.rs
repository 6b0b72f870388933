//! Two causes in plain forms where the refinements of a single one may stand for the second: a shape more fits what a cause of its own does.

use super::evidence::is_unsound;
use super::{Chosen, Judged, MAY_GO_FURTHER, Search, first_of_each, possible, sorted};
use crate::diagnosis::fits::Fitted;
use crate::diagnosis::hypothesis::Part;
use rayon::prelude::*;

impl Search<'_> {
    /// The single cause of a fit in a plain form, and one beside it that explains all that it leaves then, as they are told; `None` where it leaves
    /// nothing, in the form that it has or in the one that does best, or no other cause explains it: where both leave something, the second may as
    /// well stand for the first one's form. Measured seals got a second cause so. Two causes that would have no fewer parameters than the single
    /// one are not looked for.
    pub fn as_two(&mut self, single: &Fitted) -> Option<Chosen> {
        let [part] = single.hypothesis.parts[..] else { return None };
        let may_save = |plain: Part| plain.freed().count() + 1 < part.freed().count();
        if !self.bench.forms(part.effect).chain([part.refined_as(|_| false)]).any(may_save) {
            return None;
        }
        let leaves_nothing = |plain: &Judged| !is_unsound(&plain.fitted.losses, &self.bench.data);
        let own = self.judge(self.bench.less_refined(single, |_| false)?);
        if leaves_nothing(&own) {
            return None;
        }
        let plain = self.in_best_plain_form(own);
        if !may_save(plain.fitted.hypothesis.parts[0]) || leaves_nothing(&plain) {
            return None;
        }
        let mut both = self.extend(&plain.fitted, true, &self.from);
        both.retain(|both| self.further(&plain, both) > MAY_GO_FURTHER);
        // The form that does best alone need not be the one that does beside another cause.
        let is_of_first = |form: Part| form.effect.name == part.effect.name;
        let others = both.par_iter().filter_map(|both| self.in_other_forms(both, is_of_first)).collect::<Vec<_>>();
        both.extend(others);
        let both = both.into_par_iter().map(|both| self.finished(both)).collect();
        let both = first_of_each(sorted(both).into_iter());
        let best = possible(&both).filter(|both| leaves_nothing(both))?.clone();
        self.is_done_with_rivals = true; // two in plain forms have none
        self.levels.truncate(1);
        self.levels.push(both);
        self.chosen(best).filter(|chosen| chosen.best.hypothesis.parts.len() == 2)
    }

    /// A cause without refinements in the form that does best so.
    fn in_best_plain_form(&self, own: Judged) -> Judged {
        let other = self.in_other_forms(&own, |_| true).map(|other| self.finished(other));
        other.filter(|other| other.score > own.score).unwrap_or(own)
    }
}
