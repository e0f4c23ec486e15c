//! The parts of the band in which the force of a record stands clear of its noise.
//!
//! A bin is clear if the power of the force, all axes together, is more than ten times that of its noise: the measure by which a
//! record as a whole is of use ([`LEAST_FORCE`]). Noise alone has χ² of six degrees of freedom in a bin, and exceeds that once in
//! 10¹⁰ bins.

use std::f64::consts::{SQRT_2, TAU};

use flexid_core::spectrum::{Experiment, LEAST_FORCE};

/// Excitation of one record.
#[derive(Clone, Debug, PartialEq)]
pub struct Excitation {
    /// Root mean square of the force in the band, all axes together, N.
    pub rms_force_n: f64,
    /// Octaves of the band, from its lower edge up. The last one may have up to one and a half.
    pub octaves: Vec<Octave>,
}

/// Bins of a part of the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octave {
    /// Lower and upper edge, Hz.
    pub band_hz: [f64; 2],
    /// Number of bins.
    pub bins: u32,
    /// Number of bins in which the force stands clear of its noise.
    pub clear: u32,
}

impl Octave {
    /// Returns the share of the bins in which the force stands clear, 0 to 1. Without bins it is 1.
    pub fn share(&self) -> f64 {
        if self.bins == 0 { 1.0 } else { f64::from(self.clear) / f64::from(self.bins) }
    }
}

impl Excitation {
    /// Judges the bins of an experiment, whose band is `band_hz`.
    pub(crate) fn of<const B: usize>(experiment: &Experiment<B>, band_hz: [f64; 2]) -> Self {
        let mut octaves = octaves(band_hz);
        for bin in 0..experiment.bins() {
            let frequency_hz = experiment.omega(bin) / TAU;
            // The edges of the band are rounded to bins.
            let place = octaves.iter().position(|octave| frequency_hz < octave.band_hz[1]);
            let last = octaves.len() - 1;
            let octave = &mut octaves[place.unwrap_or(last)];
            octave.bins += 1;
            octave.clear += u32::from(is_clear(experiment, bin));
        }
        Self { rms_force_n: experiment.rms_force(), octaves }
    }

    /// Returns the share of the band's bins in which the force stands clear, 0 to 1.
    pub fn share(&self) -> f64 {
        let sum = |of: fn(&Octave) -> u32| self.octaves.iter().map(of).sum();
        Octave {
            band_hz: [0.0; 2],
            bins: sum(|octave| octave.bins),
            clear: sum(|octave| octave.clear),
        }
        .share()
    }
}

fn is_clear<const B: usize>(experiment: &Experiment<B>, bin: usize) -> bool {
    let force = experiment.force.re.iter().chain(&experiment.force.im);
    let power: f64 = force.map(|part| f64::from(part[bin]) * f64::from(part[bin])).sum();
    let noise: f64 = experiment.force_noise.iter().map(|axis| f64::from(axis[bin])).sum();
    power > LEAST_FORCE * noise
}

/// The octaves of a band, without bins. There is at least one.
fn octaves([lower, upper]: [f64; 2]) -> Vec<Octave> {
    let octave = |band_hz| Octave { band_hz, bins: 0, clear: 0 };
    let mut all = Vec::new();
    let mut from = lower;
    while from > 0.0 && 2.0 * SQRT_2 * from < upper {
        all.push(octave([from, 2.0 * from]));
        from *= 2.0;
    }
    all.push(octave([from, upper]));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octaves_cover_the_band() {
        let edges: Vec<_> = octaves([2.0, 200.0]).iter().map(|octave| octave.band_hz).collect();
        assert_eq!(edges.first(), Some(&[2.0, 4.0]));
        assert_eq!(edges.last(), Some(&[128.0, 200.0]));
        assert!(edges.windows(2).all(|pair| pair[0][1] == pair[1][0]));
        assert_eq!(octaves([5.0, 14.0]).len(), 1);
        assert_eq!(octaves([5.0, 15.0]).len(), 2);
    }

    #[test]
    fn the_share_is_that_of_all_bins() {
        let octave = |bins, clear| Octave { band_hz: [1.0, 2.0], bins, clear };
        let octaves = vec![octave(10, 1), octave(30, 29)];
        assert_eq!(Excitation { rms_force_n: 1.0, octaves }.share(), 0.75);
        assert_eq!(octave(0, 0).share(), 1.0);
    }
}
