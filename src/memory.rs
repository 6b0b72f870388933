//! What a plant remembers beyond its state: past commands and contractions, and where the pilot of the valve stuck.
//!
//! Inputs come as straight lines over one communication step. What is kept of them are their pieces, so that delay, play
//! and stiction are exact and do not depend on how a line was cut into steps. Nothing is kept of an effect that is not
//! at work.

use std::array::from_fn;
use std::collections::VecDeque;

/// Instants that are closer than this, in s, count as the same: far below any step.
const SAME_INSTANT: f64 = 1e-12;
/// A command on which a pilot would rest for less than this, in s, before it breaks loose again may be a step, which a recording
/// shows as a steep line between two samples.
const SHORTEST_REST: f64 = 0.02;
/// A command that stays as steep for longer than this, in s, is no step.
const LONGEST_STEP: f64 = 0.025;

/// Jumps that follow each other faster than this, in s, are told as the line that they follow.
const FASTEST_JUMPS: f64 = 1e-3;

/// Most cubics that what a filter shows during one step is made of.
const MOST_PARTS: f64 = 1000.0;

/// Nodes and weights of Gauss's rule of three points on an interval of length 1.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Plays of different widths that share a pilot.
const PLAYS: usize = 5;

/// What a model remembers beyond its state.
pub trait Memory: Default + Clone + Send {
    /// What brings it back to how it was before a step that failed.
    type Mark: Copy;
    /// See [`Memory::Mark`]; `time` in s is the present one.
    fn mark(&self, time: f64) -> Self::Mark;
    /// Forgets everything since the mark.
    fn roll_back(&mut self, mark: Self::Mark);
    /// Moves all that it remembers by a span in s.
    fn shift(&mut self, span: f64);
    /// Appends all that it remembers.
    fn save(&self, saved: &mut Vec<f64>);
    /// What [`Memory::save`] wrote; `None` for numbers that it cannot have written.
    fn load(saved: &[f64]) -> Option<Self>;
}

impl Memory for () {
    type Mark = ();
    fn mark(&self, _: f64) {}
    fn roll_back(&mut self, (): ()) {}
    fn shift(&mut self, _: f64) {}
    fn save(&self, _: &mut Vec<f64>) {}
    fn load(saved: &[f64]) -> Option<Self> {
        saved.is_empty().then_some(())
    }
}

/// A straight line over some time.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    /// Where it starts, s.
    pub start: f64,
    /// How long it lasts, s.
    pub span: f64,
    /// Value at the start.
    pub value: f64,
    /// Change per second.
    pub slope: f64,
}

impl Line {
    fn at(&self, after: f64) -> f64 {
        self.value + self.slope * after
    }

    /// The part from `after` seconds on; its length is clipped at zero.
    fn from(&self, after: f64) -> Self {
        Self { start: self.start + after, span: (self.span - after).max(0.0), value: self.at(after), ..*self }
    }
}

/// A polynomial of third order that holds from an instant on until the next piece starts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// Where it starts, s.
    start: f64,
    /// Coefficients of 1, s, s², s³, with s the time since the start.
    coefficients: [f64; 4],
}

impl Piece {
    const NUMBERS: usize = 5;

    /// The cubic between two instants with their values and rates (Hermite); `None` where there is no time between them.
    fn hermite([start, end]: [f64; 2], [x0, x1]: [f64; 2], [v0, v1]: [f64; 2]) -> Option<Self> {
        let span = end - start;
        let mean = (x1 - x0) / span;
        let coefficients = [x0, v0, (3.0 * mean - 2.0 * v0 - v1) / span, (v0 + v1 - 2.0 * mean) / (span * span)];
        (span > 0.0).then_some(Self { start, coefficients })
    }

    fn at(&self, after: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * after + coefficient)
    }

    fn slope(&self, after: f64) -> f64 {
        let [_, b, c, d] = self.coefficients;
        b + after * (2.0 * c + after * 3.0 * d)
    }

    /// Integral between two times.
    fn integral(&self, from: f64, to: f64) -> f64 {
        let [a, b, c, d] = self.coefficients;
        let until = |time: f64| {
            let after = time - self.start;
            after * (a + after * (b / 2.0 + after * (c / 3.0 + after * d / 4.0)))
        };
        until(to) - until(from)
    }
}

/// The past of one signal.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    pieces: VecDeque<Piece>,
}

impl History {
    /// Whether nothing is remembered.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Starts a past in which the signal has always had this value, where there is no past yet.
    pub fn begin(&mut self, time: f64, value: f64) {
        if self.pieces.is_empty() {
            // A second before anything that follows.
            self.pieces.push_back(Piece { start: time - 1.0, coefficients: [value, 0.0, 0.0, 0.0] });
        }
    }

    /// Adds a straight line; one that only goes on as the last did adds nothing.
    pub fn push_line(&mut self, line: &Line) {
        let goes_on = self.pieces.back().is_some_and(|last| {
            let expected = last.at(line.start - last.start);
            let rounding = 1e-14 * (expected.abs() + (last.coefficients[1] * (line.start - last.start)).abs());
            last.coefficients[1] == line.slope
                && last.coefficients[2..] == [0.0; 2]
                && (expected - line.value).abs() <= rounding
        });
        if !goes_on {
            self.push(Piece { start: line.start, coefficients: [line.value, line.slope, 0.0, 0.0] });
        }
    }

    /// Adds the cubic between two instants with their values and rates.
    pub fn push_cubic(&mut self, times: [f64; 2], values: [f64; 2], rates: [f64; 2]) {
        if let Some(piece) = Piece::hermite(times, values, rates) {
            self.push(piece);
        }
    }

    /// Adds what a filter of first order with a time constant τ in s makes of such a cubic: in parts that are short beside it
    /// (unless the step is longer than 250 τ), y(h) = x(h) + (y(0) − x(0)) exp(−h/τ) − ∫ exp((s − h)/τ) dx/ds ds by Gauss's
    /// rule, and cubics between.
    pub fn push_filtered(&mut self, [start, end]: [f64; 2], values: [f64; 2], rates: [f64; 2], constant: f64) {
        let Some(input) = Piece::hermite([start, end], values, rates) else { return };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = ((end - start) / (0.25 * constant)).ceil().clamp(1.0, MOST_PARTS) as u32;
        let span = (end - start) / f64::from(parts);
        let remembered = |share: f64| (-share * span / constant).exp();
        let whole = remembered(1.0);
        let weights = GAUSS.map(|(share, weight)| (share * span, weight * span * remembered(1.0 - share)));
        let mut shown = self.look_up(start).0;
        for part in 0..parts {
            let from = f64::from(part) * span;
            let (before, after) = (input.at(from), input.at(from + span));
            let forgotten: f64 = weights.iter().map(|(at, weight)| weight * input.slope(from + at)).sum();
            let next = after + (shown - before) * whole - forgotten;
            let ends = [start + from, if part + 1 == parts { end } else { start + from + span }];
            self.push_cubic(ends, [shown, next], [(before - shown) / constant, (after - next) / constant]);
            shown = next;
        }
    }

    fn push(&mut self, piece: Piece) {
        self.drop_since(piece.start);
        self.pieces.push_back(piece);
    }

    /// Drops the pieces that start at a time or later.
    fn drop_since(&mut self, time: f64) {
        while self.pieces.back().is_some_and(|last| last.start >= time) {
            self.pieces.pop_back();
        }
    }

    /// Drops what ends before a time.
    pub fn drop_before(&mut self, time: f64) {
        while self.pieces.get(1).is_some_and(|second| second.start <= time) {
            self.pieces.pop_front();
        }
    }

    /// Value and slope at a time, and how long the piece there still lasts, s (infinite for the last one); zeros where
    /// nothing is remembered.
    pub fn look_up(&self, time: f64) -> (f64, f64, f64) {
        let next = self.pieces.partition_point(|piece| piece.start <= time + SAME_INSTANT);
        let lasts = self.pieces.get(next).map_or(f64::INFINITY, |piece| piece.start - time);
        self.pieces.get(next.saturating_sub(1)).map_or((0.0, 0.0, lasts), |piece| {
            let after = (time - piece.start).max(0.0);
            (piece.at(after), piece.slope(after), lasts)
        })
    }

    /// Mean between two times, the value there where they are the same; zero where nothing is remembered.
    fn mean(&self, from: f64, to: f64) -> f64 {
        if to - from <= SAME_INSTANT {
            return self.look_up(to).0;
        }
        let first = self.pieces.partition_point(|piece| piece.start <= from).saturating_sub(1);
        let ends = self.pieces.iter().skip(first + 1).map(|next| next.start).chain([f64::INFINITY]);
        let pieces = self.pieces.iter().skip(first).zip(ends).take_while(|(piece, _)| piece.start < to);
        let integrals = pieces.map(|(piece, end)| piece.integral(piece.start.max(from), end.min(to)));
        integrals.sum::<f64>() / (to - from)
    }

    fn save(&self, saved: &mut Vec<f64>) {
        saved.push(self.pieces.len() as f64);
        for piece in &self.pieces {
            saved.push(piece.start);
            saved.extend(piece.coefficients);
        }
    }

    /// Reads what was saved from the front of a slice; gives what follows.
    fn load(saved: &[f64]) -> Option<(Self, &[f64])> {
        let (count, rest) = saved.split_first()?;
        let possible = count.fract() == 0.0 && (0.0..=(rest.len() / Piece::NUMBERS) as f64).contains(count);
        let (numbers, rest) =
            rest.split_at_checked(if possible { *count as usize * Piece::NUMBERS } else { usize::MAX })?;
        let (pieces, _) = numbers.as_chunks::<{ Piece::NUMBERS }>();
        let pieces: VecDeque<_> =
            pieces.iter().map(|&[start, a, b, c, d]| Piece { start, coefficients: [a, b, c, d] }).collect();
        let in_order = pieces.iter().zip(pieces.iter().skip(1)).all(|(one, next)| one.start < next.start);
        in_order.then_some((Self { pieces }, rest))
    }

    fn shift(&mut self, span: f64) {
        self.pieces.iter_mut().for_each(|piece| piece.start += span);
    }
}

/// How the pilot stage of a valve fails to follow its command; zeros where it does follow.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Slack {
    /// Half width of the play, V: the mean of those that share the pilot.
    pub play: f64,
    /// By which share of it the widths differ at most.
    pub play_spread: f64,
    /// By how much the half widths grow with the command, V/V; below one.
    pub play_growth: f64,
    /// Deviation at which a stuck pilot jumps to the command, V.
    pub stiction: f64,
    /// How long a jump takes, s: it lands where the line is by then.
    pub jump_time: f64,
    /// Speed of the command above which a pilot that broke loose slides on, V/s.
    pub sliding_speed: f64,
    /// Where in its play the pilot starts, as a share of the half width.
    pub start: f64,
}

impl Slack {
    /// Whether the pilot just follows.
    pub fn is_none(&self) -> bool {
        self.play == 0.0 && self.play_growth == 0.0 && self.stiction == 0.0
    }

    /// Where the pilot starts under a command in V: the mean of its plays.
    pub fn start_at(&self, command: f64) -> f64 {
        command + self.start * (self.play + self.play_growth * command)
    }

    /// Half widths at a command in V of the plays that share the pilot, V.
    fn half_widths(&self, command: f64) -> [f64; PLAYS] {
        let share = |k: usize| 1.0 + self.play_spread * (2.0 * k as f64 / (PLAYS - 1) as f64 - 1.0);
        from_fn(|k| self.play * share(k) + self.play_growth * command)
    }
}

/// Where the pilot is: behind each of its plays, of which it follows the mean, and behind its stiction, V.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pilot {
    behind_play: [f64; PLAYS],
    stuck_at: f64,
    /// How long the command has been steep since the pilot broke loose, s, negative where it falls; 0 where it is not.
    steep: f64,
    /// Direction in which it slides: 1 up, -1 down; 0 where it sticks.
    slides: f64,
}

impl Pilot {
    fn at_rest(slack: &Slack, command: f64) -> Self {
        let behind_play = slack.half_widths(command).map(|half_width| command + half_width * slack.start);
        Self { behind_play, stuck_at: slack.start_at(command), steep: 0.0, slides: 0.0 }
    }

    /// Follows a line of the command, and tells the lines that come of it.
    fn follow(&mut self, slack: &Slack, line: Line, mut tell: impl FnMut(Line)) {
        let Self { behind_play, stuck_at, steep, slides } = self;
        follow_with_plays(behind_play, slack, line, |line| {
            let threshold = slack.stiction + slack.jump_time * line.slope.abs();
            if slack.stiction == 0.0 {
                tell(line);
            } else if line.slope.abs() > slack.sliding_speed {
                // On a steep line the pilot has come along.
                if *steep != 0.0 {
                    (*stuck_at, *steep) = (line.value, 0.0);
                }
                slide(stuck_at, slides, threshold, line, &mut tell);
            } else {
                *slides = 0.0;
                follow_with_stiction(stuck_at, steep, threshold, line, &mut tell);
            }
        });
    }
}

/// Plays side by side: each position moves only where the line pushes it, and their mean is told.
fn follow_with_plays(positions: &mut [f64; PLAYS], slack: &Slack, line: Line, mut tell: impl FnMut(Line)) {
    let direction = if line.slope < 0.0 { -1.0 } else { 1.0 };
    let half_widths = slack.half_widths(line.value);
    // The flank that pushes goes slower where the play grows, and faster where it shrinks.
    let slope = line.slope * (1.0 - direction * slack.play_growth);
    let flank = |k: usize, after: f64| line.value - direction * half_widths[k] + slope * after;
    // Until the pushing flank has come to each position.
    let rests: [f64; PLAYS] = from_fn(|k| {
        // Not `clamp`, which panics where a derivative tries a width below zero.
        positions[k] = positions[k].max(line.value - half_widths[k]).min(line.value + half_widths[k]);
        let gap = direction * (positions[k] - flank(k, 0.0));
        if slope == 0.0 { f64::INFINITY } else { gap / slope.abs() }
    });
    let is_pushed = |k: usize, after: f64| rests[k] <= after + SAME_INSTANT;
    let mut from = 0.0;
    while from < line.span {
        let later = rests.into_iter().filter(|rest| *rest > from + SAME_INSTANT && *rest < line.span - SAME_INSTANT);
        let until = later.fold(line.span, f64::min);
        let pushed = (0..PLAYS).filter(|k| is_pushed(*k, from)).count();
        let position = |k: usize| {
            if is_pushed(k, from) { flank(k, from) } else { positions[k] }
        };
        let value = (0..PLAYS).map(position).sum::<f64>() / PLAYS as f64;
        let slope = slope * (pushed as f64 / PLAYS as f64);
        tell(Line { start: line.start + from, span: until - from, value, slope });
        from = until;
    }
    for k in (0..PLAYS).filter(|k| rests[*k] < line.span - SAME_INSTANT) {
        positions[k] = flank(k, line.span);
    }
}

/// Stiction: the position stays until it is off by the threshold, and jumps to the line then.
///
/// A step of the command is one jump, however a recording shows it: on a steep line the pilot moves along from the first jump
/// on, and rests where that line ends. Where it does not end soon it was no step, and the jumps are looked up.
fn follow_with_stiction(position: &mut f64, steep: &mut f64, threshold: f64, line: Line, mut tell: impl FnMut(Line)) {
    let (speed, direction) = (line.slope.abs(), line.slope.signum());
    let is_steep = threshold < SHORTEST_REST * speed;
    let mut loose = line;
    if !(is_steep && *steep * direction > 0.0) {
        let was_step = *steep != 0.0 && steep.abs() <= LONGEST_STEP;
        *steep = 0.0;
        if was_step || (line.value - *position).abs() >= threshold {
            *position = line.value;
        }
        if !is_steep {
            return jump_along(position, threshold, line, tell);
        }
        let rest = rest_until_off(*position, threshold, &line);
        tell(Line { span: line.span.min(rest), value: *position, slope: 0.0, ..line });
        if rest >= line.span {
            return;
        }
        loose = line.from(rest);
        *position = loose.value;
    }
    let is_smooth = threshold < FASTEST_JUMPS * speed;
    let moves = if is_smooth { loose.span } else { (LONGEST_STEP - steep.abs()).clamp(0.0, loose.span) };
    *steep += direction * loose.span;
    if moves > 0.0 {
        tell(Line { span: moves, ..loose });
    }
    if moves < loose.span {
        jump_along(position, threshold, loose.from(moves), tell);
    }
}

/// Stiction of a pilot that, once it is loose, goes with the line for as long as that keeps its direction.
fn slide(position: &mut f64, slides: &mut f64, threshold: f64, line: Line, mut tell: impl FnMut(Line)) {
    let direction = line.slope.signum();
    let is_loose = *slides == direction || (line.value - *position).abs() >= threshold;
    let rest = if is_loose { 0.0 } else { rest_until_off(*position, threshold, &line) };
    if rest > 0.0 {
        *slides = 0.0;
        tell(Line { span: line.span.min(rest), value: *position, slope: 0.0, ..line });
    }
    if rest < line.span {
        (*slides, *position) = (direction, line.at(line.span));
        tell(line.from(rest));
    }
}

/// Time in s until a line is off a position by the threshold, on the side to which it goes.
fn rest_until_off(position: f64, threshold: f64, line: &Line) -> f64 {
    let off = line.slope.signum() * (line.value - position);
    if line.slope == 0.0 { f64::INFINITY } else { (threshold - off) / line.slope.abs() }
}

/// A position that is on its way to a line, by jumps each time that it is off by the threshold.
fn jump_along(position: &mut f64, threshold: f64, line: Line, mut tell: impl FnMut(Line)) {
    let (speed, direction) = (line.slope.abs(), line.slope.signum());
    *position += direction * threshold * (direction * (line.value - *position) / threshold).floor().max(0.0);
    let mut rest = rest_until_off(*position, threshold, &line);
    let mut left = line;
    while rest < left.span {
        tell(Line { span: rest, value: *position, slope: 0.0, ..left });
        left = left.from(rest);
        *position = left.value;
        rest = threshold / speed;
    }
    tell(Line { value: *position, slope: 0.0, ..left });
}

/// What a muscle with its valve remembers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlantMemory {
    pilot: Option<Pilot>,
    /// Command behind the pilot, as old as the dead time and one step.
    command: History,
    /// Contraction, as old as the delay of its sensor.
    contraction: History,
}

impl PlantMemory {
    /// Whether nothing is remembered.
    pub fn is_empty(&self) -> bool {
        self.pilot.is_none() && self.command.is_empty() && self.contraction.is_empty()
    }

    /// Takes note of the command of the coming step, which the valve will see after a delay in s.
    pub fn expect_command(&mut self, slack: &Slack, delay: f64, line: Line) {
        if slack.is_none() {
            self.pilot = None;
        }
        if delay == 0.0 {
            self.command.pieces.clear();
        }
        if slack.is_none() && delay == 0.0 {
            return;
        }
        let mut pilot = self.pilot.unwrap_or_else(|| Pilot::at_rest(slack, line.value));
        self.command.begin(line.start, pilot.stuck_at);
        pilot.follow(slack, line, |line| self.command.push_line(&line));
        self.pilot = (!slack.is_none()).then_some(pilot);
    }

    /// Command that the valve sees at a time in s, late by other times in s where it rises and where it falls: value, slope, and
    /// how long that holds; `None` where it sees the command itself.
    pub fn seen_command(&self, time: f64, [rising, falling]: [f64; 2]) -> Option<(f64, f64, f64)> {
        if self.command.is_empty() {
            return None;
        }
        if rising == falling {
            return Some(self.command.look_up(time - rising));
        }
        let [one, other] = [rising, falling].map(|delay| self.command.look_up(time - delay));
        // Which of the two leads tells the direction; they change places where their lines cross.
        let ahead = (one.0 - other.0, one.1 - other.1);
        let crossing = -ahead.0 / ahead.1;
        let until_crossing = if crossing > SAME_INSTANT { crossing } else { f64::INFINITY };
        let is_larger = if crossing.abs() <= SAME_INSTANT || ahead.0 == 0.0 { ahead.1 > 0.0 } else { ahead.0 > 0.0 };
        let (value, slope, _) = if is_larger == (rising < falling) { one } else { other };
        Some((value, slope, one.2.min(other.2).min(until_crossing)))
    }

    /// The past of the contraction, for sensors that show it late.
    pub fn contraction(&mut self) -> &mut History {
        &mut self.contraction
    }

    /// Mean contraction in m between two times in s; `None` where it is not remembered.
    pub fn mean_contraction(&self, from: f64, to: f64) -> Option<f64> {
        (!self.contraction.is_empty()).then(|| self.contraction.mean(from, to))
    }

    /// Forgets what no delay reaches any more.
    pub fn forget(&mut self, command_before: f64, contraction_before: f64) {
        self.command.drop_before(command_before);
        self.contraction.drop_before(contraction_before);
    }
}

/// Time and pilot when a step began.
#[derive(Debug, Clone, Copy)]
pub struct PlantMark {
    time: f64,
    pilot: Option<Pilot>,
}

impl Memory for PlantMemory {
    type Mark = PlantMark;

    fn mark(&self, time: f64) -> PlantMark {
        PlantMark { time, pilot: self.pilot }
    }

    fn roll_back(&mut self, mark: PlantMark) {
        // What a step adds starts when it does or later, and what was there before started earlier.
        self.command.drop_since(mark.time);
        self.contraction.drop_since(mark.time);
        self.pilot = mark.pilot;
    }

    fn shift(&mut self, span: f64) {
        self.command.shift(span);
        self.contraction.shift(span);
    }

    fn save(&self, saved: &mut Vec<f64>) {
        saved.push(f64::from(u8::from(self.pilot.is_some())));
        if let Some(Pilot { behind_play, stuck_at, steep, slides }) = self.pilot {
            saved.extend(behind_play);
            saved.extend([stuck_at, steep, slides]);
        }
        self.command.save(saved);
        self.contraction.save(saved);
    }

    fn load(saved: &[f64]) -> Option<Self> {
        let (pilot, rest) = match saved {
            [0.0, rest @ ..] => (None, rest),
            [1.0, rest @ ..] => {
                let (behind_play, rest) = rest.split_first_chunk()?;
                let (&[stuck_at, steep, slides], rest) = rest.split_first_chunk()?;
                (Some(Pilot { behind_play: *behind_play, stuck_at, steep, slides }), rest)
            }
            _ => return None,
        };
        let (command, rest) = History::load(rest)?;
        let (contraction, rest) = History::load(rest)?;
        rest.is_empty().then_some(Self { pilot, command, contraction })
    }
}
