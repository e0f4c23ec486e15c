//! The blows of a hammer in a record: how many, when, and whether one was too hard for its channel.
//!
//! A fit needs one blow no more than another force: it takes the force as it was measured. Two blows leave gaps in the band, and one that is cut
//! off is measured wrongly.

use flexid_core::stream::Record;

/// Part of the largest force from which on the hammer touches. A second touch of this part changes the spectrum of the force by no more than it,
/// 1 dB.
const TOUCHES: f32 = 0.1;
/// Standard deviations that noise does not exceed: once in two million samples.
const NOISE: f32 = 5.0;
/// Time without touch between two blows, s. A blow is one arch; with a steel tip it lasts 0.2 ms.
const APART_S: f64 = 2e-3;
/// Longest blow, s: that of a soft tip.
const LONGEST_S: f64 = 10e-3;
/// Blows that a hand strikes in a second, at most: as often as it taps. What comes faster has bounced.
const FASTEST_HZ: f64 = 7.0;
/// Largest part of a record in which a hammer touches. A shaker is above [`TOUCHES`] of its largest force for 94 % of the time with a sine, and for 69 %
/// with normal noise that reaches four standard deviations.
const MOST: f64 = FASTEST_HZ * LONGEST_S;

/// Blows of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Blows {
    /// Time of each peak from the start of the record, s.
    pub peaks_s: Vec<f64>,
    /// Force at which the hardest blow that is cut off ends, N. `None` if none is.
    pub cut_off_n: Option<f32>,
}

impl Blows {
    /// Finds the blows of a record. Returns `None` if its force is that of no hammer.
    pub(crate) fn of<const N: usize>(record: &Record<N>) -> Option<Self> {
        let axis = (0..3).max_by(|a, b| largest(record, *a).total_cmp(&largest(record, *b)))?;
        let (signal, peak) = (&record.force[axis], largest(record, axis));
        let least = (TOUCHES * peak).max(NOISE * record.force_noise[axis]);
        let touches = |sample: &usize| signal[*sample].abs() > least;
        let touching: Vec<usize> = (0..signal.len()).filter(touches).collect();
        if touching.is_empty() || touching.len() as f64 > MOST * signal.len() as f64 {
            return None;
        }
        let apart = (APART_S * record.rate_hz).max(1.0) as usize;
        let blows = || touching.chunk_by(|one, next| next - one <= apart);
        let at_peak = |blow: &[usize]| {
            blow.iter().copied().max_by(|a, b| signal[*a].abs().total_cmp(&signal[*b].abs()))
        };
        let steps = signal.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let step = steps.filter(|step| *step > 0.0).fold(f32::INFINITY, f32::min);
        let is_flat = |peak: &usize, samples: usize| {
            let end = signal[*peak];
            // An arch A sin(πt/T) is within a rounding step s of its peak for (2T/π) √(s/A), and two samples may be equal by chance.
            let round = std::f32::consts::FRAC_2_PI * samples as f32 * (step / end.abs()).sqrt();
            let before = signal[..*peak].iter().rev().take_while(|value| **value == end).count();
            let behind = signal[*peak..].iter().take_while(|value| **value == end).count();
            (before + behind) as f32 > round + 2.0
        };
        let peaks: Vec<(usize, usize)> =
            blows().filter_map(|blow| Some((at_peak(blow)?, blow.len()))).collect();
        let flat = peaks.iter().filter(|(peak, samples)| is_flat(peak, *samples));
        let cut_off = flat.map(|(peak, _)| signal[*peak].abs());
        Some(Self {
            cut_off_n: cut_off.reduce(f32::max),
            peaks_s: peaks.iter().map(|(peak, _)| *peak as f64 / record.rate_hz).collect(),
        })
    }

    /// Returns the shortest time from a blow to one that no hand strikes so soon, s: the hammer has bounced. `None` if it has not.
    pub fn rebound_s(&self) -> Option<f64> {
        let apart = self.peaks_s.windows(2).map(|pair| pair[1] - pair[0]).reduce(f64::min);
        apart.filter(|apart| *apart < 1.0 / FASTEST_HZ)
    }
}

/// Largest force of a record along an axis, N.
fn largest<const N: usize>(record: &Record<N>, axis: usize) -> f32 {
    record.force[axis].iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use flexid_core::noise::NoiseShape;

    use super::*;

    const RATE_HZ: f64 = 10_000.0;
    const SAMPLES: usize = 8192;

    /// A record with half a sine of 1 ms at each of these times, s, along −y, limited to so many newtons.
    fn record(blows: &[(f64, f64)], limit: f64) -> Record<SAMPLES> {
        let force = |sample: u32| {
            let time = f64::from(sample) / RATE_HZ;
            let noise = 0.2
                * (f64::from(sample.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5);
            let arch = |(begin, peak): &(f64, f64)| {
                let part = (time - begin) / 1e-3;
                if (0.0..1.0).contains(&part) { peak * (PI * part).sin() } else { 0.0 }
            };
            -(blows.iter().map(arch).sum::<f64>() + noise).clamp(-limit, limit) as f32
        };
        let none = || (0..SAMPLES).map(|_| 0.0).collect();
        Record {
            start_s: 0.0,
            pose: Default::default(),
            path: Default::default(),
            since_s: 0.0,
            rate_hz: RATE_HZ,
            has_doubtful_rate: false,
            force: [none(), (0..SAMPLES as u32).map(force).collect(), none()],
            acceleration: [none(), none(), none()],
            force_noise: [0.0, 0.06, 0.0],
            acceleration_noise: [0.02; 3],
            force_noise_shape: [NoiseShape::WHITE; 3],
            acceleration_noise_shape: [NoiseShape::WHITE; 3],
            starts_at_rest: true,
            point: [0.0; 3],
        }
    }

    #[test]
    fn blows_are_counted_and_cut_off_ones_are_seen() {
        let of = |blows: &[(f64, f64)], limit| Blows::of(&record(blows, limit)).unwrap();
        let one = of(&[(0.2, 500.0)], 1e3);
        assert_eq!((one.peaks_s.len(), one.cut_off_n, one.rebound_s()), (1, None, None));
        assert!((one.peaks_s[0] - 0.2005).abs() < 2e-4, "{one:?}");
        let double = of(&[(0.2, 500.0), (0.235, 90.0)], 1e3);
        assert!((double.rebound_s().unwrap() - 0.035).abs() < 4e-4, "{double:?}");
        let two = of(&[(0.2, 500.0), (0.4, 450.0)], 1e3);
        assert_eq!((two.peaks_s.len(), two.rebound_s()), (2, None));
        assert_eq!(of(&[(0.2, 500.0)], 450.0).cut_off_n, Some(450.0));
    }

    #[test]
    fn a_shaker_and_silence_have_no_blows() {
        let steady: Vec<(f64, f64)> =
            (0..400).map(|blow| (2e-3 * f64::from(blow), 100.0)).collect();
        assert_eq!(Blows::of(&record(&steady, 1e3)), None);
        assert_eq!(Blows::of(&record(&[], 1e3)), None);
    }
}
