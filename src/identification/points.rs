//! Points at which a muscle rests, found in recordings.
//!
//! # Model
//! A recording whose rows stand for themselves, as a static map does, is all points: its rows are half a second or more
//! apart, or the contraction leaps from row to row. In any other recording the muscle rests where the means of pressure and
//! contraction over 50 ms stay within 0.4 % of their ranges for half a second, which is eight time constants of the valve; the last
//! half of such a plateau is one point. Where there are too few plateaus, the means over 50 ms are the points themselves,
//! with the velocity of the contraction and, where the force was not measured, the load's weight and inertia, M (g + a).
//! Points that repeat another to the last digit are worth one.

use crate::measurement::{Recording, Signal};
use crate::simulation::{mean, slopes};
use crate::{Error, GRAVITY, Result};
use serde::Serialize;

/// Which way the muscle moved to where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Branch {
    /// The contraction grew.
    Shortening,
    /// The contraction became smaller.
    Lengthening,
    /// The first point of a recording.
    Unknown,
}

/// One measured pull.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Position of its recording.
    pub recording: usize,
    /// Line of the file, that of the middle sample; 0 where there is no file.
    pub line: u64,
    /// Pa.
    pub gauge_pressure: f64,
    /// m.
    pub contraction: f64,
    /// m/s; zero at rest.
    pub contraction_velocity: f64,
    /// N; where it was not measured, that of the hanging load.
    pub force: f64,
    /// Which way it was reached.
    pub branch: Branch,
}

/// Where points come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Every row stands for itself.
    Rows,
    /// Stretches at which pressure and contraction rest.
    Plateaus,
    /// A muscle in motion.
    Motion,
}

impl Source {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Rows => "every row is a static point",
            Self::Plateaus => "static points where pressure and contraction rest",
            Self::Motion => "samples in motion, as there are too few static points; the damping is fitted along",
        }
    }
}

/// The points of one muscle.
#[derive(Debug, Clone)]
pub struct Points {
    /// In the order of recordings and time.
    pub all: Vec<Point>,
    /// Where those of each recording come from.
    pub sources: Vec<Source>,
    /// What a person should know.
    pub notes: Vec<String>,
}

/// Rows so far apart in s stand for themselves.
const APART: f64 = 0.5;
/// A motion by such a share of its range from row to row is not followed.
const LEAP: f64 = 0.05;
/// Means are taken over so many seconds.
const CHUNK: f64 = 0.05;
/// A plateau lasts at least so many seconds.
const REST: f64 = 0.5;
/// Within a plateau the means stay within this share of the range of a signal.
const STILL: f64 = 0.004;

impl Points {
    /// The points of recordings of one muscle; `fewest` is how many static ones a fit needs.
    ///
    /// # Errors
    /// [`Error::Recording`] where pressure, contraction or what tells the force are missing.
    pub fn of(recordings: &[Recording], fewest: usize) -> Result<Self> {
        let columns = recordings.iter().map(Columns::of).collect::<Result<Vec<_>>>()?;
        let resting: Vec<(Source, Vec<Point>)> = columns.iter().enumerate().map(|(k, c)| c.resting(k)).collect();
        let enough = resting.iter().map(|(_, points)| distinct(points)).sum::<usize>() >= fewest;
        let mut found = Self { all: Vec::new(), sources: Vec::new(), notes: Vec::new() };
        for (k, ((source, points), columns)) in resting.into_iter().zip(&columns).enumerate() {
            let moving = !enough && source == Source::Plateaus;
            let (source, points) = if moving { (Source::Motion, columns.moving(k)) } else { (source, points) };
            let before = points.len();
            let mut points = without_copies(points);
            if points.len() < before {
                let copies = before - points.len();
                found.notes.push(format!("{}: {copies} points repeat others and count once", recordings[k].name()));
            }
            mark_branches(&mut points, source == Source::Rows);
            found.notes.push(format!("{}: {}, {} of them", recordings[k].name(), source.words(), points.len()));
            found.all.extend(points);
            found.sources.push(source);
        }
        if found.all.len() < FEWEST {
            let path = recordings.first().map_or_else(Default::default, |recording| recording.path.clone());
            let problem = format!(
                "{} points are too few for any model: at least {FEWEST} with pressure, contraction and force are needed",
                found.all.len()
            );
            return Err(Error::Recording { path, problem });
        }
        Ok(found)
    }

    /// Whether some of them are of a muscle in motion.
    pub fn in_motion(&self) -> bool {
        self.sources.contains(&Source::Motion)
    }

    /// Measured forces in N, shape `(n_points,)`.
    pub fn forces(&self) -> Vec<f64> {
        self.all.iter().map(|point| point.force).collect()
    }
}

/// Fewest points that are worth a fit.
const FEWEST: usize = 10;

/// The columns that points are made of, as far as they were measured; SI units, NaN where a sample is missing.
struct Columns<'a> {
    recording: &'a Recording,
    pressure: &'a [f64],
    contraction: &'a [f64],
    force: Option<&'a [f64]>,
    mass: Option<f64>,
}

/// Means over a short stretch.
#[derive(Clone, Copy)]
struct Chunk {
    first: usize,
    last: usize,
    time: f64,
    pressure: f64,
    contraction: f64,
    force: f64,
}

impl<'a> Columns<'a> {
    fn of(recording: &'a Recording) -> Result<Self> {
        let measured = |signal: Signal| {
            recording.get(signal).filter(|values| values.iter().any(|v| !v.is_nan())).ok_or_else(|| Error::Recording {
                path: recording.path.clone(),
                problem: format!("a force model needs the column `{} [{}]`", signal.name(), signal.unit()),
            })
        };
        let mass = recording.load_mass();
        let force = measured(Signal::Force);
        if mass.is_none() {
            measured(Signal::Force)?;
        }
        let (pressure, contraction) = (measured(Signal::GaugePressure)?, measured(Signal::Contraction)?);
        Ok(Self { recording, pressure, contraction, force: force.ok(), mass })
    }

    /// Force in N of a resting muscle at a sample.
    fn force(&self, sample: usize) -> f64 {
        self.force.map_or(self.mass.unwrap_or(f64::NAN) * GRAVITY, |force| force[sample])
    }

    fn resting(&self, recording: usize) -> (Source, Vec<Point>) {
        if self.rows_stand_for_themselves() {
            let whole =
                |k: &usize| ![self.pressure[*k], self.contraction[*k], self.force(*k)].iter().any(|v| v.is_nan());
            let point = |k: usize| Point {
                recording,
                line: self.recording.line(k),
                gauge_pressure: self.pressure[k],
                contraction: self.contraction[k],
                contraction_velocity: 0.0,
                force: self.force(k),
                branch: Branch::Unknown,
            };
            return (Source::Rows, (0..self.pressure.len()).filter(whole).map(point).collect());
        }
        (Source::Plateaus, self.plateaus(recording))
    }

    fn rows_stand_for_themselves(&self) -> bool {
        let intervals: Vec<f64> = self.recording.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let moves: Vec<f64> = self.contraction.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        median(&intervals) >= APART || median(&moves) > LEAP * range(self.contraction)
    }

    /// Means over stretches of about 50 ms, those without gaps.
    fn chunks(&self) -> Vec<Chunk> {
        let time = &self.recording.time;
        let mut chunks = Vec::new();
        let mut first = 0;
        while first < time.len() {
            let end = first + time[first..].partition_point(|t| *t < time[first] + CHUNK);
            let mean = |value: &dyn Fn(usize) -> f64| {
                let known = (first..end).map(value).filter(|v| !v.is_nan());
                let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
                sum / count
            };
            let chunk = Chunk {
                first,
                last: end - 1,
                time: mean(&|k| time[k]),
                pressure: mean(&|k| self.pressure[k]),
                contraction: mean(&|k| self.contraction[k]),
                force: mean(&|k| self.force(k)),
            };
            if ![chunk.pressure, chunk.contraction, chunk.force].iter().any(|v| v.is_nan()) {
                chunks.push(chunk);
            }
            first = end;
        }
        chunks
    }

    fn plateaus(&self, recording: usize) -> Vec<Point> {
        let chunks = self.chunks();
        let near = [STILL * range(self.pressure), STILL * range(self.contraction)];
        let mut points = Vec::new();
        let mut start = 0;
        while start < chunks.len() {
            let end = end_of_rest(&chunks, start, near);
            if chunks[end - 1].time - chunks[start].time >= REST {
                // What is left of the way there, and of creep, is least at the end.
                let rest = &chunks[start + (end - start) / 2..end];
                points.push(mean_point(rest, recording, self.recording));
                start = end;
            } else {
                start += 1;
            }
        }
        points
    }

    /// Means in motion. At both ends of a recording there are no derivatives, and no points.
    fn moving(&self, recording: usize) -> Vec<Point> {
        let chunks = self.chunks();
        let contraction = self.recording.bridged(Signal::Contraction).unwrap_or_default();
        let velocity = slopes(&self.recording.time, &contraction);
        let acceleration = slopes(&self.recording.time, &velocity);
        let inside = 2..chunks.len().saturating_sub(2);
        inside
            .filter(|&k| chunks[k + 2].time - chunks[k - 2].time < 8.0 * CHUNK)
            .map(|k| {
                let mut point = mean_point(&chunks[k..=k], recording, self.recording);
                let samples = chunks[k].first..=chunks[k].last;
                point.contraction_velocity = mean(&velocity[samples.clone()]);
                if let (None, Some(mass)) = (self.force, self.mass) {
                    point.force = mass * (GRAVITY + mean(&acceleration[samples]));
                }
                point
            })
            .collect()
    }
}

/// Where the rest that starts with a chunk ends: all means from there on lie within a band.
fn end_of_rest(chunks: &[Chunk], start: usize, near: [f64; 2]) -> usize {
    let values = |chunk: &Chunk| [chunk.pressure, chunk.contraction];
    let (mut low, mut high) = (values(&chunks[start]), values(&chunks[start]));
    let mut end = start + 1;
    for chunk in &chunks[end..] {
        for (k, value) in values(chunk).into_iter().enumerate() {
            (low[k], high[k]) = (low[k].min(value), high[k].max(value));
        }
        if (0..2).any(|k| high[k] - low[k] > near[k]) {
            break;
        }
        end += 1;
    }
    end
}

fn mean_point(chunks: &[Chunk], recording: usize, from: &Recording) -> Point {
    let mean = |value: fn(&Chunk) -> f64| chunks.iter().map(value).sum::<f64>() / chunks.len() as f64;
    Point {
        recording,
        line: from.line(usize::midpoint(chunks[0].first, chunks[chunks.len() - 1].last)),
        gauge_pressure: mean(|c| c.pressure),
        contraction: mean(|c| c.contraction),
        contraction_velocity: 0.0,
        force: mean(|c| c.force),
        branch: Branch::Unknown,
    }
}

/// The digits of a point, to find copies.
fn digits(point: &Point) -> [u64; 4] {
    [point.gauge_pressure, point.contraction, point.contraction_velocity, point.force].map(f64::to_bits)
}

fn without_copies(points: Vec<Point>) -> Vec<Point> {
    let mut seen = std::collections::HashSet::new();
    points.into_iter().filter(|point| seen.insert(digits(point))).collect()
}

/// How many points differ in pressure or contraction by more than 2 % of the ranges.
fn distinct(points: &[Point]) -> usize {
    let of = |value: fn(&Point) -> f64| {
        let values: Vec<f64> = points.iter().map(value).collect();
        0.02 * range(&values).max(f64::MIN_POSITIVE)
    };
    let (pressure, contraction) = (of(|p| p.gauge_pressure), of(|p| p.contraction));
    let cell =
        |p: &Point| [(p.gauge_pressure / pressure).round(), (p.contraction / contraction).round()].map(f64::to_bits);
    points.iter().map(cell).collect::<std::collections::HashSet<_>>().len()
}

/// Which way each point was reached. Where rows stand for themselves, a leap over half the range starts another curve, and
/// its first point is of the branch that follows, as the first of all is.
fn mark_branches(points: &mut [Point], rows: bool) {
    let values: Vec<f64> = points.iter().map(|point| point.contraction).collect();
    let near = 1e-3 * range(&values);
    let mut branch = Branch::Unknown;
    for k in 1..points.len() {
        let change = values[k] - values[k - 1];
        if change.abs() > near {
            branch = if change > 0.0 { Branch::Shortening } else { Branch::Lengthening };
        }
        points[k].branch = branch;
    }
    let leaps = |k: usize| rows && (values[k] - values[k - 1]).abs() > 0.5 * range(&values);
    for k in 0..points.len().saturating_sub(1) {
        if k == 0 || leaps(k) {
            points[k].branch = points[k + 1].branch;
        }
    }
}

/// At most `most` of so many positions, ascending: without a stride, which on a grid would meet few of its columns.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub(crate) fn thinned(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    let place = |k: usize| ((0.618_033_988_749_895 * k as f64).fract() * count as f64) as usize;
    let mut places: Vec<usize> = (0..most).map(place).collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// Largest less smallest of the values that are known.
pub(crate) fn range(values: &[f64]) -> f64 {
    let known = values.iter().filter(|v| !v.is_nan());
    let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    (high - low).max(0.0)
}

/// Median of the values that are known; 0 where there are none.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut known: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
    let middle = known.len() / 2;
    if known.is_empty() { 0.0 } else { *known.select_nth_unstable_by(middle, f64::total_cmp).1 }
}
