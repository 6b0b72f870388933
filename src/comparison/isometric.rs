//! Isometric curves from points at other conditions (thesis section 4.2.3): the length–pressure–force relation, interpolated.
//!
//! # Model
//! Points lie on curves of one load (isotonic) or one pressure (isobaric). Along each, pressure or force is a modified
//! Akima spline of the contraction; at a fixed contraction every curve that reaches it gives one point of force over
//! pressure. A curve that does not reach it gives none: nothing is extrapolated.
//!
//! # Reference
//! H. Akima (1970), doi 10.1145/321607.321609, with the modified weights that do not overshoot where the data are flat. The
//! thesis uses a cubic spline on a grid, which does.

use super::errors::{Class, classes, force, levels, pressure};
use crate::identification::points::{Branch, Point, range};
use makima_spline::Spline;

/// What is constant along the curves that points lie on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constant {
    /// Curves of one load: pressure over contraction.
    Load,
    /// Curves of one pressure: force over contraction.
    Pressure,
}

/// A curve through points of one load or pressure.
pub struct Along {
    /// The load in N or pressure in Pa.
    pub value: f64,
    /// Smallest and largest contraction, m.
    pub span: [f64; 2],
    spline: Spline,
}

/// The curves of a muscle.
pub struct Relation {
    /// What is constant along them.
    pub constant: Constant,
    /// Curve after curve, ascending.
    pub curves: Vec<Along>,
}

/// Fewest places that make a curve.
const FEWEST: usize = 3;
/// Places nearer than this share of the range of contraction are one.
const SAME: f64 = 0.005;

impl Relation {
    /// The relation through points; branches of a hysteresis are averaged unless one is asked for.
    pub fn of(points: &[Point], branch: Option<Branch>) -> Self {
        let asked = |point: &Point| branch.is_none_or(|branch| point.branch == branch);
        let points: Vec<Point> = points.iter().filter(|point| asked(point)).copied().collect();
        let loads = levels(&points, force).filter(|levels| FEWEST * levels.len() <= points.len());
        let (constant, classes, of): (_, Vec<Class>, fn(&Point) -> f64) = match loads {
            Some(loads) => (Constant::Load, loads, pressure),
            None => {
                let pressures = levels(&points, pressure).unwrap_or_else(|| classes(&points, pressure));
                (Constant::Pressure, pressures, force)
            }
        };
        let contractions: Vec<f64> = points.iter().map(|point| point.contraction).collect();
        let near = SAME * range(&contractions);
        let curve = |class: Class| {
            let mut places: Vec<(f64, f64)> =
                class.members.iter().map(|&k| (points[k].contraction, of(&points[k]))).collect();
            places.sort_by(|a, b| a.0.total_cmp(&b.0));
            let places = merged(&places, near);
            let span = [places.first()?.0, places.last()?.0];
            (places.len() >= FEWEST).then(|| Along { value: class.value, span, spline: Spline::from_vec(places) })
        };
        Self { constant, curves: classes.into_iter().filter_map(curve).collect() }
    }

    /// Force in N over pressure in Pa at a contraction in m: one pair per curve that reaches it, by rising pressure.
    pub fn isometric(&self, contraction: f64) -> Vec<(f64, f64)> {
        let at = |along: &Along| {
            let other = along.at(contraction)?;
            Some(if self.constant == Constant::Load { (other, along.value) } else { (along.value, other) })
        };
        let mut pairs: Vec<(f64, f64)> = self.curves.iter().filter_map(at).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs
    }

    /// Contractions in m at which isometric curves are worth drawing: `count` of them, evenly over where at least two
    /// thirds of the curves reach.
    pub fn contractions(&self, count: usize) -> Vec<f64> {
        let reach = |x: f64| self.curves.iter().filter(|along| along.at(x).is_some()).count();
        let low = self.curves.iter().map(|along| along.span[0]).fold(f64::INFINITY, f64::min);
        let high = self.curves.iter().map(|along| along.span[1]).fold(f64::NEG_INFINITY, f64::max);
        let steps = 200;
        let places = (0..=steps).map(|k| low + (high - low) * f64::from(k) / f64::from(steps));
        let good: Vec<f64> = places.filter(|x| 3 * reach(*x) >= 2 * self.curves.len().max(1)).collect();
        let (Some(first), Some(last)) = (good.first(), good.last()) else { return Vec::new() };
        let share = |k: usize| k as f64 / (count.max(2) - 1) as f64;
        (0..count).map(|k| first + (last - first) * share(k)).collect()
    }
}

impl Along {
    /// Pressure in Pa or force in N at a contraction in m; `None` where the curve does not reach.
    pub fn at(&self, contraction: f64) -> Option<f64> {
        (self.span[0]..=self.span[1]).contains(&contraction).then(|| self.spline.sample(contraction))
    }
}

/// Means of places that are closer together than `near`.
fn merged(places: &[(f64, f64)], near: f64) -> Vec<(f64, f64)> {
    let mut all: Vec<(f64, f64, f64)> = Vec::new();
    for (x, y) in places {
        match all.last_mut() {
            Some((sum_x, sum_y, count)) if *x - *sum_x / *count <= near => {
                (*sum_x, *sum_y, *count) = (*sum_x + x, *sum_y + y, *count + 1.0);
            }
            _ => all.push((*x, *y, 1.0)),
        }
    }
    all.into_iter().map(|(x, y, count)| (x / count, y / count)).collect()
}
