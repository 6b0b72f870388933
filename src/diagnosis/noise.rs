//! Noise of a sensor, from residuals that may still hold slow errors of the model.
//!
//! # Model
//! A residual is white noise of variance w, noise with a memory τ of variance c, and something smooth. The second
//! difference over a lag h, y(t) − 2 y(t + h) + y(t + 2h), then has the variance 6 w + c (6 − 8 ρ + 2 ρ²) + m h⁴ with
//! ρ = exp(−h/τ). Its trimmed variances over many lags give w, c and m by non-negative least squares, for each of a
//! range of τ; the best τ counts.
//!
//! # Reference
//! Variogram of increments of higher order, G. Matheron (1973), doi 10.2307/1425829; trimmed so that jumps and
//! reversals do not count.

use nalgebra::{DMatrix, DVector};

/// Noise of one signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation in the unit of the signal.
    pub level: f64,
    /// How many samples are worth one independent one, where something slow is to be told from the noise.
    pub inflation: f64,
}

/// Longest lag in s: longer ones see the motion, shorter ones miss the memory.
const LONGEST_LAG: f64 = 0.15;
/// Most lags that are looked at.
const MOST_LAGS: usize = 16;
/// Memories in s that are tried.
const MEMORIES: [f64; 9] = [0.004, 0.007, 0.012, 0.02, 0.03, 0.045, 0.065, 0.1, 0.2];
/// Share of the smallest squares that is kept, and the mean of those squares for a normal variable of variance 1.
const TRIMMED: (f64, f64) = (0.7, 0.309_55);

/// Estimates the noise of residuals sampled every `period` s; NaN where a sample is missing.
pub fn estimate(residuals: &[f64], period: f64) -> Noise {
    let lags = lags(period, residuals.len());
    let seen: Vec<(usize, f64)> =
        lags.into_iter().filter_map(|lag| Some((lag, bend_variance(residuals, lag)?))).collect();
    if seen.iter().all(|(_, variance)| *variance <= 0.0) {
        return Noise { level: 0.0, inflation: 1.0 };
    }
    let fits = MEMORIES.iter().filter_map(|memory| fit(&seen, period, *memory));
    let best = fits.min_by(|a, b| a.2.total_cmp(&b.2));
    let Some((memory, [white, coloured, _], _)) = best else { return Noise { level: 0.0, inflation: 1.0 } };
    let kept = (-period / memory).exp();
    let variance = white + coloured;
    let slow = white + coloured * (1.0 + kept) / (1.0 - kept);
    Noise { level: variance.sqrt(), inflation: if variance > 0.0 { slow / variance } else { 1.0 } }
}

/// Lags in samples, from one on.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn lags(period: f64, samples: usize) -> Vec<usize> {
    let longest = ((LONGEST_LAG / period) as usize).clamp(3, (samples / 4).max(3));
    let stride = longest.div_ceil(MOST_LAGS);
    (1..=3).chain((3 + stride..=longest).step_by(stride)).collect()
}

/// Trimmed variance of second differences over a lag; `None` where there are none.
fn bend_variance(values: &[f64], lag: usize) -> Option<f64> {
    let bends = (2 * lag..values.len()).map(|k| (values[k] - 2.0 * values[k - lag] + values[k - 2 * lag]).powi(2));
    let mut squares: Vec<f64> = bends.filter(|square| square.is_finite()).collect();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let kept = (TRIMMED.0 * squares.len() as f64) as usize;
    if kept == 0 {
        return None;
    }
    squares.select_nth_unstable_by(kept, f64::total_cmp);
    Some(squares[..kept].iter().sum::<f64>() / kept as f64 / TRIMMED.1)
}

/// Memory, the three parts, and the misfit.
fn fit(seen: &[(usize, f64)], period: f64, memory: f64) -> Option<(f64, [f64; 3], f64)> {
    let longest = seen.last()?.0 as f64;
    let row = |lag: usize| {
        let kept = (-(lag as f64) * period / memory).exp();
        [6.0, 6.0 - 8.0 * kept + 2.0 * kept * kept, (lag as f64 / longest).powi(4)]
    };
    // Relative errors count: a variance is known to a share of itself.
    let largest = seen.iter().map(|(_, variance)| *variance).fold(0.0, f64::max);
    let weight = |variance: f64| 1.0 / variance.max(1e-12 * largest);
    let subsets = (1..8_usize).map(|mask| (0..3).filter(|k| mask >> k & 1 == 1).collect::<Vec<usize>>());
    let solutions = subsets.filter_map(|used| {
        let matrix = DMatrix::from_fn(seen.len(), used.len(), |i, j| row(seen[i].0)[used[j]] * weight(seen[i].1));
        let ones = DVector::from_element(seen.len(), 1.0);
        let solution = matrix.clone().svd(true, true).solve(&ones, 1e-12).ok()?;
        let misfit = (&matrix * &solution - ones).norm_squared();
        let mut parts = [0.0; 3];
        used.iter().zip(solution.iter()).for_each(|(k, value)| parts[*k] = *value);
        parts.iter().all(|part| *part >= 0.0).then_some((memory, parts, misfit))
    });
    solutions.min_by(|a, b| a.2.total_cmp(&b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal variables from sums of uniform ones of a linear congruential generator.
    fn normal(seed: &mut u64) -> f64 {
        let mut uniform = || {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    fn series(white: f64, coloured: f64, memory: f64, slow: f64) -> Vec<f64> {
        let (mut seed, mut state) = (7, 0.0);
        let kept = (-0.01 / memory).exp();
        (0..6000)
            .map(|k| {
                state = kept * state + (1.0 - kept * kept).sqrt() * normal(&mut seed);
                white * normal(&mut seed) + coloured * state + slow * (f64::from(k) * 0.02).sin()
            })
            .collect()
    }

    #[test]
    fn white_and_coloured_noise_is_told_from_slow_errors() {
        for (white, coloured, memory, slow) in [(1.0, 0.0, 0.02, 0.0), (1.0, 0.0, 0.02, 30.0), (0.5, 1.0, 0.04, 10.0)] {
            let noise = estimate(&series(white, coloured, memory, slow), 0.01);
            let level = f64::hypot(white, coloured);
            assert!((noise.level / level - 1.0).abs() < 0.15, "{noise:?} instead of {level}");
        }
        assert!(estimate(&series(0.3, 1.0, 0.04, 10.0), 0.01).inflation > 3.0);
    }

    #[test]
    fn a_constant_signal_has_no_noise() {
        assert_eq!(estimate(&[1.0; 50], 0.01).level, 0.0);
    }
}
