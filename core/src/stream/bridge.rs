//! Bridging of lost samples.
//!
//! A lost sample becomes a weighted sum of its neighbours. The weights have the smallest mean square error over the samples of the
//! same signal that were not lost: they are the best linear interpolator, fitted to the record itself. That error is the noise of a
//! bridged sample, and is added to the noise of the record.

use heapless::Vec;

use crate::linear::normal::Normal;
use crate::linear::packed::packed;

/// Neighbours used on each side of a gap.
const REACH: usize = 6;
const NEIGHBOURS: usize = 2 * REACH;
/// Mean distance of the positions at which the weights are fitted: twice the golden ratio. The multiples of an irrational number
/// are spread evenly over the phases of any period (Weyl, 1916), so that a periodic cut is met in all its phases.
const STRIDE: f64 = 3.236_067_977_499_79;
/// Least number of positions at which the weights are fitted: three for each. The mean square error of a bridged sample is then known to
/// √(2/24), a third.
const LEAST_POSITIONS: usize = 3 * NEIGHBOURS;
/// Most gaps of one signal in a record.
const MAX_GAPS: usize = 1024;
/// Number of rounds in which gaps close together settle.
const ROUNDS: usize = 6;
/// Samples on each side from which the change of a signal near an edge is read.
const NEARBY: usize = 32;
/// Longest gap that is bridged, samples.
pub const MAX_GAP: usize = 2;

/// Result of bridging one signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bridged {
    /// Samples bridged.
    pub(super) samples: usize,
    /// Mean square error of a bridged sample, as found on samples that were not lost; unit of the signal, squared.
    pub(super) mean_square_error: f32,
}

/// The signal has more gaps than can be bridged, a longer one, or no stretches without a gap from which to learn how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Unbridgeable;

/// Weights of the neighbours, those before the gap first, in order of time.
type Weights = [f32; NEIGHBOURS];

/// Fills the missing samples (NaN) of `signal`, in gaps of one or two.
pub(super) fn bridge(signal: &mut [f32]) -> Result<Bridged, Unbridgeable> {
    let gaps = gaps(signal)?;
    if gaps.is_empty() {
        return Ok(Bridged::default());
    }
    // The weights depend on the length of the gap and the place in it.
    let single = fit(signal, 1, 0)?;
    let double = if gaps.iter().any(|&(_, length)| length == 2) {
        [fit(signal, 2, 0)?, fit(signal, 2, 1)?]
    } else {
        [single; 2]
    };
    for &(first, length) in &gaps {
        draw_line(signal, first, length);
    }
    let (mut samples, mut squares) = (0, 0.0);
    for &(first, length) in &gaps {
        for place in 0..length {
            let error = if length == 1 { single.1 } else { double[place].1 };
            squares +=
                if is_inside(signal, first, length) { error } else { hold_error(signal, first) };
            samples += 1;
        }
    }
    // Gaps close together are neighbours of each other, and settle in a few rounds.
    for _ in 0..ROUNDS {
        for &(first, length) in &gaps {
            if !is_inside(signal, first, length) {
                continue;
            }
            for place in 0..length {
                let (weights, _) = if length == 1 { single } else { double[place] };
                signal[first + place] = weighted(signal, first, length, &weights);
            }
        }
    }
    Ok(Bridged { samples, mean_square_error: squares / samples as f32 })
}

/// True if a gap has all its neighbours. A gap at an edge keeps its straight line.
fn is_inside(signal: &[f32], first: usize, length: usize) -> bool {
    first >= REACH && first + length + REACH <= signal.len()
}

/// First sample and length of every gap.
fn gaps(signal: &[f32]) -> Result<Vec<(usize, usize), MAX_GAPS>, Unbridgeable> {
    let mut gaps = Vec::new();
    let mut next = 0;
    while let Some(offset) = signal[next..].iter().position(|value| value.is_nan()) {
        let first = next + offset;
        let length = signal[first..].iter().take_while(|value| value.is_nan()).count();
        if length > MAX_GAP {
            return Err(Unbridgeable);
        }
        gaps.push((first, length)).map_err(|_| Unbridgeable)?;
        next = first + length;
    }
    Ok(gaps)
}

/// The neighbours of a gap in order of time.
fn neighbours(signal: &[f32], first: usize, length: usize) -> impl Iterator<Item = f32> {
    let (before, after) = (&signal[first - REACH..first], &signal[first + length..][..REACH]);
    before.iter().chain(after).copied()
}

fn weighted(signal: &[f32], first: usize, length: usize, weights: &Weights) -> f32 {
    neighbours(signal, first, length).zip(weights).map(|(value, weight)| value * weight).sum()
}

/// The weights for place `place` of a gap of `length`, and their mean square error.
fn fit(signal: &[f32], length: usize, place: usize) -> Result<(Weights, f32), Unbridgeable> {
    const WIDTH: usize = NEIGHBOURS + 1;
    let mut normal = Normal::<{ packed(WIDTH) }>::new();
    normal.reset(NEIGHBOURS);
    let mut rows = [[0.0; WIDTH]; 6];
    let (mut filled, mut count) = (0, 0);
    let last = (signal.len() + 1).saturating_sub(REACH + length);
    let positions = (0..).map(|k| REACH + (f64::from(k) * STRIDE) as usize);
    for first in positions.take_while(|&first| first < last) {
        let mut known = !signal[first + place].is_nan();
        for (entry, value) in rows[filled].iter_mut().zip(neighbours(signal, first, length)) {
            known &= !value.is_nan();
            *entry = f64::from(value);
        }
        rows[filled][NEIGHBOURS] = f64::from(signal[first + place]);
        if known {
            filled += 1;
            count += 1;
        }
        if filled == rows.len() {
            normal.add(&rows);
            filled = 0;
        }
    }
    if count < LEAST_POSITIONS {
        return Err(Unbridgeable);
    }
    for row in &mut rows[filled..] {
        row.fill(0.0);
    }
    normal.add(&rows);
    normal.eliminate(NEIGHBOURS);
    let mut weights = [0.0; NEIGHBOURS];
    normal.substitute(NEIGHBOURS, &mut weights);
    let freedom = (count as f64 - NEIGHBOURS as f64).max(1.0);
    Ok((weights.map(|weight| weight as f32), (normal.sum_of_squares() / freedom) as f32))
}

/// Mean square of the difference of two samples [`MAX_GAP`] apart, near `place`.
fn hold_error(signal: &[f32], place: usize) -> f32 {
    let first = place.saturating_sub(NEARBY);
    let nearby = &signal[first..(place + NEARBY).min(signal.len())];
    let differences = nearby.iter().zip(&nearby[MAX_GAP..]).map(|(a, b)| a - b);
    let (mut sum, mut count) = (0.0, 0);
    for difference in differences {
        sum += difference * difference;
        count += 1;
    }
    sum / count.max(1) as f32
}

/// Draws a straight line across a gap; at an edge it takes the nearest value.
fn draw_line(signal: &mut [f32], first: usize, length: usize) {
    let before = first.checked_sub(1).map(|index| signal[index]);
    let after = signal.get(first + length).copied();
    let (start, end) = match (before, after) {
        (Some(start), Some(end)) => (start, end),
        (Some(only), None) | (None, Some(only)) => (only, only),
        (None, None) => (0.0, 0.0),
    };
    for place in 0..length {
        let part = (place + 1) as f32 / (length + 1) as f32;
        signal[first + place] = start + part * (end - start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec as StdVec;

    fn wave(n: usize) -> f32 {
        let t = n as f32 / 2000.0;
        (300.0 * libm::sinf(377.0 * t) + 80.0 * libm::sinf(1500.0 * t + 1.0)) * libm::expf(-0.3 * t)
    }

    fn holed(every: usize) -> (StdVec<f32>, StdVec<f32>) {
        let truth: StdVec<f32> = (0..4096).map(wave).collect();
        let mut signal = truth.clone();
        for n in (20..4080).step_by(every) {
            signal[n] = f32::NAN;
            if n % 3 == 0 {
                signal[n + 1] = f32::NAN;
            }
        }
        (truth, signal)
    }

    /// No stretch of thirteen samples is without a gap: nothing tells how to bridge.
    #[test]
    fn losses_that_leave_no_stretch_are_refused() {
        let mut signal: StdVec<f32> = (0..8192).map(wave).collect();
        for n in (20..8170).step_by(10) {
            signal[n] = f32::NAN;
        }
        assert_eq!(bridge(&mut signal), Err(Unbridgeable));
    }

    #[test]
    fn restores_what_the_neighbours_tell() {
        let (truth, mut signal) = holed(97);
        let bridged = bridge(&mut signal).expect("short gaps");
        assert!(bridged.samples > 40);
        let worst = truth.iter().zip(&signal).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 0.05, "{worst} of 300");
    }

    /// White noise cannot be restored, and the reported error is its power.
    #[test]
    fn reports_the_error_that_it_makes() {
        let mut state = 1_u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state as f32 / u32::MAX as f32 - 0.5
        };
        let truth: StdVec<f32> = (0..8192).map(|_| noise()).collect();
        let mut signal = truth.clone();
        for n in (31..8100).step_by(53) {
            signal[n] = f32::NAN;
        }
        let bridged = bridge(&mut signal).expect("short gaps");
        let made: f32 = truth.iter().zip(&signal).map(|(a, b)| (a - b) * (a - b)).sum();
        let ratio = bridged.mean_square_error * bridged.samples as f32 / made;
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
        assert!((bridged.mean_square_error - 1.0 / 12.0).abs() < 0.01);
    }

    /// In every period one sample is random and all others are zero. The mean square error is that of the random samples over the
    /// period, whatever their phase.
    #[test]
    fn a_periodic_cut_is_met_in_all_its_phases() {
        for (period, phase) in
            (2..=12_usize).flat_map(|period| (0..period).map(move |p| (period, p)))
        {
            let mut state = 5_u32;
            let mut signal: StdVec<f32> = (0..4096)
                .map(|n| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    let blow = (state >> 8) as f32 / (1 << 24) as f32 - 0.5;
                    if n % period == phase { blow } else { 0.0 }
                })
                .collect();
            signal[2000] = f32::NAN;
            let bridged = bridge(&mut signal).expect("a short gap");
            let expected = 1.0 / (12.0 * period as f32);
            let ratio = bridged.mean_square_error / expected;
            assert!((0.7..1.3).contains(&ratio), "period {period}, phase {phase}: {ratio}");
        }
    }

    #[test]
    fn edges_are_held_and_long_gaps_refused() {
        let mut signal: StdVec<f32> = (0..3000).map(|n| n as f32).collect();
        signal[0] = f32::NAN;
        signal[2999] = f32::NAN;
        let bridged = bridge(&mut signal).expect("short gaps");
        assert_eq!((signal[0], signal[2999], bridged.samples), (1.0, 2998.0, 2));
        signal[100..103].fill(f32::NAN);
        assert_eq!(bridge(&mut signal), Err(Unbridgeable));
    }
}
