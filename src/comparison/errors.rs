//! Errors of modelled forces: overall, and by classes of pressure, load and contraction.

use crate::identification::points::{Point, range};
use serde::Serialize;

/// Errors at some of the points.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Errors {
    /// How many points.
    pub points: usize,
    /// Root mean square of measured less modelled force, N.
    pub rms: f64,
    /// Largest absolute error, N.
    pub max: f64,
    /// Mean absolute error over mean absolute force.
    pub relative: f64,
    /// Mean of measured less modelled force, N.
    pub bias: f64,
}

impl Errors {
    /// Errors of residuals, measured less modelled, beside the measured forces; `None` without points.
    pub fn of(pairs: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let (mut count, mut squares, mut max, mut absolute, mut sum, mut size) = (0_usize, 0.0, 0.0_f64, 0.0, 0.0, 0.0);
        for (residual, force) in pairs {
            count += 1;
            squares += residual * residual;
            max = max.max(residual.abs());
            absolute += residual.abs();
            sum += residual;
            size += force.abs();
        }
        let points = count as f64;
        (count > 0).then(|| Self {
            points: count,
            rms: (squares / points).sqrt(),
            max,
            relative: absolute / size.max(f64::MIN_POSITIVE),
            bias: sum / points,
        })
    }
}

/// Points that share a pressure, a load or a contraction.
#[derive(Debug, Clone, Serialize)]
pub struct Class {
    /// Mean of what they share, SI.
    pub value: f64,
    /// Least and greatest, SI.
    pub span: [f64; 2],
    /// Positions of its points.
    #[serde(skip)]
    pub members: Vec<usize>,
}

/// A gap of such a share of the range parts two levels.
const GAP: f64 = 0.01;
/// More levels than this are a continuum.
const MOST_LEVELS: usize = 32;
/// A continuum is cut into so many classes of equal width.
const CUTS: usize = 8;

/// Levels of a quantity where it has few, at least two points each on average, or else classes of equal width; ascending.
pub fn classes(points: &[Point], of: fn(&Point) -> f64) -> Vec<Class> {
    levels(points, of).filter(|levels| 2 * levels.len() <= points.len()).unwrap_or_else(|| cut(points, of))
}

/// Levels of a quantity; `None` where there are too many.
pub fn levels(points: &[Point], of: fn(&Point) -> f64) -> Option<Vec<Class>> {
    let values: Vec<f64> = points.iter().map(of).collect();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let gap = GAP * range(&values);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in order {
        match groups.last_mut() {
            Some(group) if values[k] - values[group[group.len() - 1]] <= gap => group.push(k),
            _ => groups.push(vec![k]),
        }
    }
    let wide = groups.iter().any(|group| values[group[group.len() - 1]] - values[group[0]] > 5.0 * gap);
    (groups.len() <= MOST_LEVELS && !(wide && groups.len() < 3))
        .then(|| groups.into_iter().map(|members| class(members, &values)).collect())
}

fn cut(points: &[Point], of: fn(&Point) -> f64) -> Vec<Class> {
    let values: Vec<f64> = points.iter().map(of).collect();
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let width = range(&values) / CUTS as f64;
    let mut groups = vec![Vec::new(); CUTS];
    for (k, value) in values.iter().enumerate() {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let place = ((value - low) / width) as usize;
        groups[place.min(CUTS - 1)].push(k);
    }
    groups.into_iter().filter(|members| !members.is_empty()).map(|members| class(members, &values)).collect()
}

fn class(mut members: Vec<usize>, values: &[f64]) -> Class {
    let inside = || members.iter().map(|k| values[*k]);
    let (low, high) = (inside().fold(f64::INFINITY, f64::min), inside().fold(f64::NEG_INFINITY, f64::max));
    let value = inside().sum::<f64>() / members.len() as f64;
    members.sort_unstable();
    Class { value, span: [low, high], members }
}

/// The contraction of a point.
pub fn contraction(point: &Point) -> f64 {
    point.contraction
}

/// The gauge pressure of a point.
pub fn pressure(point: &Point) -> f64 {
    point.gauge_pressure
}

/// The force of a point.
pub fn force(point: &Point) -> f64 {
    point.force
}
