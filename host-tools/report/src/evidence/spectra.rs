//! Spectra of one record: measured, modelled, what is left, and the noise.
//!
//! An amplitude spectral density is that of one side, over the record of length T, as a root mean square over the bins of a band:
//!
//! ```text
//! √( 2/T · mean |X|² )        X the DFT times the sample period
//! ```
//!
//! That of a modal test is the size |A| of its response, (m/s²)/N, beside a force of 1 N.

use flexid_pipeline::solver::{FittedBin, FittedRecord, bands};
use serde::{Deserialize, Serialize};

use super::curve::{POINTS, rounded};

/// A record that the fit rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordEvidence {
    /// Number among all records that came, from 1.
    pub number: u64,
    /// True of the responses to one force of a modal test: the spectra are accelerations per force.
    #[serde(default)]
    pub is_of_test: bool,
    /// Time of the first sample, on the clock of the readings, s.
    pub start_s: f64,
    /// Length, s.
    pub seconds: f64,
    /// Sampling rate, Hz.
    pub rate_hz: f64,
    /// True if the measured rate contradicts the configured one.
    pub has_doubtful_rate: bool,
    /// True if the robot rests when the record starts.
    pub starts_at_rest: bool,
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Joint angles of the parts of a record along a path, in their order, without those that are left out, rad (m): `pose`, `seconds` and `spectra` are
    /// those of the middle one. Empty where the robot stands.
    #[serde(default)]
    pub path: Vec<Vec<f64>>,
    /// Number of the pose, from 1, in the order in which they came.
    pub pose_number: usize,
    /// Root mean square of the force in the band, all axes together, N.
    pub rms_force_n: f64,
    /// Number of lines that were subtracted from the acceleration.
    pub lines: usize,
    /// Excitation of each octave of the band.
    pub octaves: Vec<Octave>,
    /// Spectra along the band.
    pub spectra: RecordSpectra,
}

/// Excitation of a part of the band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Octave {
    /// Lower and upper edge, Hz.
    pub band_hz: [f64; 2],
    /// Share of the bins in which the power of the force is more than ten times that of its noise, 0 to 1.
    pub clear: f64,
}

/// Amplitude spectral densities of a record, for each axis of the sensors.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordSpectra {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Force, N/√Hz.
    pub force: [Vec<f64>; 3],
    /// Noise of the force, N/√Hz.
    pub force_noise: [Vec<f64>; 3],
    /// Measured acceleration, (m/s²)/√Hz.
    pub measured: [Vec<f64>; 3],
    /// Modelled acceleration, (m/s²)/√Hz.
    pub modelled: [Vec<f64>; 3],
    /// Measured less modelled acceleration, (m/s²)/√Hz.
    pub residual: [Vec<f64>; 3],
    /// Acceleration that the noise of both sensors leaves, (m/s²)/√Hz.
    pub noise: [Vec<f64>; 3],
}

impl RecordEvidence {
    pub(super) fn new(record: &FittedRecord, pose_number: usize) -> Self {
        let seconds = record.samples as f64 / record.rate_hz;
        let octave = |own: &flexid_pipeline::check::Octave| Octave {
            band_hz: own.band_hz.map(rounded),
            clear: rounded(own.share()),
        };
        Self {
            number: record.number,
            is_of_test: record.decay.is_some(),
            start_s: record.start_s,
            seconds,
            rate_hz: record.rate_hz,
            has_doubtful_rate: record.has_doubtful_rate,
            starts_at_rest: record.starts_at_rest,
            pose: record.pose.clone(),
            path: record.path.clone(),
            pose_number,
            rms_force_n: rounded(record.excitation.rms_force_n),
            lines: record.tones,
            octaves: record.excitation.octaves.iter().map(octave).collect(),
            // Of a response the density over 2 s is its size.
            spectra: RecordSpectra::new(&record.bins, record.decay.map_or(seconds, |_| 2.0)),
        }
    }
}

impl RecordSpectra {
    fn new(bins: &[FittedBin], seconds: f64) -> Self {
        let mut spectra = Self::default();
        let square = |[re, im]: [f64; 2]| re * re + im * im;
        for band in bands(bins, seconds, POINTS) {
            spectra.frequency_hz.push(rounded(band.frequency_hz()));
            for axis in 0..3 {
                let density = |power: &dyn Fn(&FittedBin) -> f64| rounded(band.density(power));
                spectra.force[axis].push(density(&|bin| square(bin.force[axis])));
                spectra.force_noise[axis].push(density(&|bin| bin.force_noise[axis]));
                spectra.measured[axis].push(rounded(band.measured(axis)));
                spectra.modelled[axis].push(rounded(band.modelled(axis)));
                spectra.residual[axis].push(density(&|bin| square(bin.left[axis])));
                spectra.noise[axis].push(rounded(band.noise(axis)));
            }
        }
        spectra
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of a known density, in bins of a record of 4 s, has that density whatever the bands.
    #[test]
    fn densities_are_those_of_the_bins() {
        let bin = |index: usize| FittedBin {
            frequency_hz: index as f64 / 4.0,
            force: [[6.0, 8.0]; 3],
            force_noise: [8.0; 3],
            measured: [[3.0, 0.0], [0.0, 3.0], [0.0, 0.0]],
            left: [[1.0, 0.0]; 3],
            noise: [2.0; 3],
        };
        let bins: Vec<FittedBin> = (8..2000).map(bin).collect();
        let spectra = RecordSpectra::new(&bins, 4.0);
        let points = spectra.frequency_hz.len();
        assert!((POINTS / 2..=POINTS).contains(&points), "{points}");
        assert!(spectra.frequency_hz.windows(2).all(|pair| pair[0] < pair[1]));
        for point in 0..points {
            // √(2 · 100 / 4)
            assert_eq!(spectra.force[0][point], rounded(50.0_f64.sqrt()));
            assert_eq!(spectra.force_noise[1][point], 2.0);
            assert_eq!(spectra.modelled[0][point], rounded(2.0_f64.sqrt()));
            assert_eq!(spectra.modelled[1][point], rounded(5.0_f64.sqrt()));
            assert_eq!(spectra.noise[2][point], 1.0);
        }
    }
}
