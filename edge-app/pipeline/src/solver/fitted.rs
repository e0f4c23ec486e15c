//! The records of an estimate bin by bin: what was measured, what the fit leaves of it, and the noise.

use std::f64::consts::TAU;

use flexid_core::refine::BinLeft;
use flexid_core::spectrum::{Kind, Spectrum};

use super::Solver;
use crate::check::Excitation;
use crate::record::{BINS, Experiment, Record};

/// A record that an estimate rests on. That of a robot that feeds is its middle part.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedRecord {
    /// Number among all receptances and records that came, from 1.
    pub number: u64,
    /// Decay of the exponential window of a measured receptance, 1/s: its force is 1 Ns along its direction. `None` of a record.
    pub decay: Option<f64>,
    /// Time of the first sample, on the clock of the readings, s.
    pub start_s: f64,
    /// Sampling rate, Hz.
    pub rate_hz: f64,
    /// True if the measured rate contradicts the configured one.
    pub has_doubtful_rate: bool,
    /// Number of samples of each signal, of the part.
    pub samples: usize,
    /// True if the robot rests when the record starts.
    pub starts_at_rest: bool,
    /// Joint angles of the part, rad (m).
    pub pose: Vec<f64>,
    /// Joint angles of all parts that the fit takes, in their order, rad (m). Empty where the robot stands.
    pub path: Vec<Vec<f64>>,
    /// Number of tones that have been subtracted from the acceleration.
    pub tones: usize,
    /// The parts of the band in which the force stands clear of its noise.
    pub excitation: Excitation,
    /// Bins of the band, in ascending order, 1/T apart.
    pub bins: Vec<FittedBin>,
}

/// A bin of a record. The spectra are DFTs times the sample period, real and imaginary part along each axis of their sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedBin {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Force, Ns.
    pub force: [[f64; 2]; 3],
    /// Mean square of the noise of the force, (Ns)².
    pub force_noise: [f64; 3],
    /// Acceleration, tones subtracted, m/s.
    pub measured: [[f64; 2]; 3],
    /// Measured less modelled acceleration, m/s.
    pub left: [[f64; 2]; 3],
    /// Mean square of what the noise of both sensors leaves, (m/s)².
    pub noise: [f64; 3],
}

impl Solver {
    /// Returns the records that the present estimate rests on. It is empty without an estimate, and while records are unsettled.
    pub fn fitted_records(&mut self) -> Vec<FittedRecord> {
        self.fitted_from(0)
    }

    /// Returns the newest of [`Solver::fitted_records`].
    pub(super) fn newest_fitted(&mut self) -> Option<FittedRecord> {
        self.fitted_from(self.experiments.len().saturating_sub(1)).pop()
    }

    /// Returns [`Solver::fitted_records`] without the `first` oldest.
    fn fitted_from(&mut self, first: usize) -> Vec<FittedRecord> {
        if self.is_unsettled() {
            return Vec::new();
        }
        let Some(estimate) = self.estimate().cloned() else { return Vec::new() };
        let Self { identifier, experiments, plant, of_plant, .. } = self;
        let plant = plant.as_deref().filter(|_| of_plant.is_some());
        let mut left: Vec<Vec<BinLeft>> = vec![Vec::new(); experiments.len()];
        let mut take = |own: &BinLeft| left[own.record].push(*own);
        if identifier.each_bin(experiments, plant, &estimate, first, &mut take).is_err() {
            return Vec::new();
        }
        let records = self.experiments.iter().zip(&self.sources).zip(&self.numbers).zip(&left);
        let band_hz = self.measurement.band_hz;
        records
            .skip(first)
            .map(|(((experiment, record), number), left)| {
                FittedRecord::new(*number, record.as_deref(), experiment, left, band_hz)
            })
            .collect()
    }
}

impl FittedRecord {
    fn new(
        number: u64,
        record: Option<&Record>,
        experiment: &Experiment,
        left: &[BinLeft],
        band_hz: [f64; 2],
    ) -> Self {
        let middle = experiment.path.len() / 2;
        let part = experiment.parts().nth(middle).map_or(0..0, |part| part.bins);
        let bin = |own: &BinLeft| {
            let at = |parts: &[heapless::Vec<f32, BINS>; 3], axis: usize| {
                f64::from(parts[axis][own.bin])
            };
            let both = |spectrum: &Spectrum<BINS>| {
                std::array::from_fn(|axis| [at(&spectrum.re, axis), at(&spectrum.im, axis)])
            };
            FittedBin {
                frequency_hz: experiment.omega(own.bin) / TAU,
                force: both(&experiment.force),
                force_noise: std::array::from_fn(|axis| at(&experiment.force_noise, axis)),
                measured: both(&experiment.acceleration),
                left: own.left,
                noise: own.noise,
            }
        };
        // A receptance has no samples: so many would show its band.
        let last_bin = (experiment.omega(experiment.bins() - 1) / experiment.spacing) as usize + 1;
        let spacing_hz = experiment.spacing / TAU;
        let samples = record.map_or((2 * last_bin).next_power_of_two(), |record| {
            record.force[0].len() / experiment.divided
        });
        Self {
            number,
            decay: match experiment.kind {
                Kind::Record => None,
                Kind::Receptance { decay, .. } => Some(decay),
            },
            start_s: record.map_or(0.0, |record| record.start_s),
            rate_hz: record.map_or(samples as f64 * spacing_hz, |record| record.rate_hz),
            has_doubtful_rate: record.is_some_and(|record| record.has_doubtful_rate),
            samples,
            starts_at_rest: record.is_some_and(|record| record.starts_at_rest),
            pose: experiment.path[middle].pose.to_vec(),
            path: match experiment.divided {
                1 => Vec::new(),
                _ => experiment.path.iter().map(|part| part.pose.to_vec()).collect(),
            },
            tones: experiment.tones.len(),
            excitation: Excitation::of(experiment, band_hz),
            bins: left.iter().filter(|own| part.contains(&own.bin)).map(bin).collect(),
        }
    }
}
