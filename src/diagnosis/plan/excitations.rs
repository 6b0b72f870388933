//! Courses of the command that make effects differ: each is there for pairs of effects that others confuse.

/// A course of the command.
pub struct Excitation {
    /// What people call it.
    pub name: &'static str,
    /// What it is good for.
    pub purpose: &'static str,
    course: fn(Course) -> Course,
}

/// All courses; the last one has something of all others, for a first recording.
pub const EXCITATIONS: &[Excitation] = &[
    Excitation { name: "slow stairs", purpose: "static errors of valve, muscle and sensors", course: stairs },
    Excitation {
        name: "triangles of shrinking amplitude",
        purpose: "dry friction: minor loops at three pressures",
        course: shrinking_triangles,
    },
    Excitation {
        name: "triangle at three speeds",
        purpose: "dry friction against viscous damping and lags",
        course: three_speeds,
    },
    Excitation { name: "steps of several sizes", purpose: "lag, delay, overshoot, limited flow", course: steps },
    Excitation { name: "hold after a step", purpose: "creep, leakage, warm-up", course: hold_after_step },
    Excitation { name: "multisine", purpose: "what depends on frequency", course: multisine },
    Excitation { name: "ramp to the limit and back", purpose: "supply pressure, end of the stroke", course: full_ramp },
    Excitation { name: "small reversals", purpose: "dead band of the valve", course: small_reversals },
    Excitation { name: PROGRAMME, purpose: "something of all", course: programme },
];

/// Name of the course that has something of all others.
pub const PROGRAMME: &str = "mixed programme";

impl Excitation {
    /// The course as shares of the range, every `period` s; it is squeezed where it would take longer than `most` s.
    pub fn samples(&self, period: f64, most: f64) -> Vec<f64> {
        let course = (self.course)(Course { knots: vec![(0.0, 0.0), (1.0, 0.0)] });
        let pace = (course.end().0 / most).max(1.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let count = (course.end().0 / pace / period + 1e-9) as usize + 1;
        (0..count).map(|k| course.at(k as f64 * period * pace)).collect()
    }
}

/// Straight lines between times in s and shares of the range.
struct Course {
    knots: Vec<(f64, f64)>,
}

/// What a step takes, s: the period of the samples, so that it is one sample wide.
const AT_ONCE: f64 = 0.01;

impl Course {
    fn end(&self) -> (f64, f64) {
        self.knots[self.knots.len() - 1]
    }

    fn ramp(mut self, share: f64, duration: f64) -> Self {
        self.knots.push((self.end().0 + duration, share));
        self
    }

    fn hold(self, duration: f64) -> Self {
        let (_, share) = self.end();
        self.ramp(share, duration)
    }

    fn step(self, share: f64, duration: f64) -> Self {
        self.ramp(share, AT_ONCE).hold(duration - AT_ONCE)
    }

    fn steps(self, shares: &[f64], duration: f64) -> Self {
        shares.iter().fold(self, |course, share| course.step(*share, duration))
    }

    /// To and fro around a share, from there and back, at a speed in shares per second.
    fn triangle(self, centre: f64, amplitude: f64, speed: f64) -> Self {
        let quarter = amplitude / speed;
        self.ramp(centre + amplitude, quarter).ramp(centre - amplitude, 2.0 * quarter).ramp(centre, quarter)
    }

    fn at(&self, time: f64) -> f64 {
        let after = self.knots.partition_point(|(knot, _)| *knot <= time);
        if after == self.knots.len() {
            return self.end().1;
        }
        let ((t0, y0), (t1, y1)) = (self.knots[after - 1], self.knots[after]);
        y0 + (y1 - y0) * (time - t0) / (t1 - t0)
    }
}

fn stairs(course: Course) -> Course {
    course.steps(&[0.2, 0.4, 0.6, 0.8, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0], 4.0)
}

fn shrinking_triangles(mut course: Course) -> Course {
    for centre in [0.25, 0.5, 0.75] {
        course = course.ramp(centre, 2.0);
        for amplitude in [0.22, 0.14, 0.07, 0.03] {
            course = course.triangle(centre, amplitude, 0.1);
        }
    }
    course
}

fn three_speeds(course: Course) -> Course {
    [0.05, 0.15, 0.6].into_iter().fold(course.ramp(0.5, 2.0), |c, v| c.triangle(0.5, 0.3, v).triangle(0.5, 0.3, v))
}

fn steps(course: Course) -> Course {
    course.steps(&[0.5, 0.55, 0.45, 0.65, 0.35, 0.8, 0.2, 1.0, 0.0], 3.0)
}

fn hold_after_step(course: Course) -> Course {
    course.step(0.8, 40.0).step(0.3, 19.0)
}

fn multisine(course: Course) -> Course {
    sines(course, 40.0)
}

/// Sines of Schroeder phases, from slow ones to what the valve just follows, for a duration in s.
fn sines(course: Course, duration: f64) -> Course {
    const FREQUENCIES: [f64; 7] = [0.05, 0.15, 0.35, 0.65, 1.05, 1.65, 2.55];
    const PERIOD: f64 = 0.02;
    let mut course = course.ramp(0.5, 2.0);
    let start = course.end().0;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let samples = (duration / PERIOD) as usize;
    for k in 1..=samples {
        let time = k as f64 * PERIOD;
        let wave = |(n, frequency): (usize, &f64)| {
            let phase = std::f64::consts::PI * (n * n) as f64 / FREQUENCIES.len() as f64;
            (std::f64::consts::TAU * frequency * time - phase).sin()
        };
        let sum: f64 = FREQUENCIES.iter().enumerate().map(wave).sum();
        course.knots.push((start + time, (0.5 + 0.11 * sum).clamp(0.0, 1.0)));
    }
    course
}

fn full_ramp(course: Course) -> Course {
    course.ramp(1.0, 18.0).hold(3.0).ramp(0.0, 18.0).hold(1.0)
}

fn small_reversals(mut course: Course) -> Course {
    for centre in [0.4, 0.7] {
        course = course.ramp(centre, 2.0);
        for size in [0.01, 0.02, 0.04, 0.08] {
            course = course.steps(&[centre + size, centre - size, centre + size, centre], 1.0);
        }
    }
    course
}

fn programme(course: Course) -> Course {
    let course = course.steps(&[0.3, 0.7, 0.4, 1.0], 2.0).ramp(0.5, 2.0).triangle(0.5, 0.35, 0.1);
    let course = course.triangle(0.5, 0.2, 0.4).triangle(0.5, 0.05, 0.1);
    sines(course, 12.0).step(0.8, 8.0).step(0.1, 5.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_course_stays_in_its_range_and_its_time() {
        for excitation in EXCITATIONS {
            for most in [20.0, 60.0] {
                let samples = excitation.samples(0.01, most);
                assert!(samples.iter().all(|share| (0.0..=1.0).contains(share)), "{}", excitation.name);
                assert!(samples.len() <= (most * 100.0) as usize + 1, "{}: {}", excitation.name, samples.len());
                assert!(samples.iter().any(|share| *share > 0.7), "{}", excitation.name);
            }
        }
    }
}
