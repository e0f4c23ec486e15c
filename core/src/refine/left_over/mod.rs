//! Places where a fit leaves more than elsewhere: in which band, along which direction, in which record and part of the records; and whether that
//! goes with the force.
//!
//! Each points to another family of causes: a filter or a resonance, a sensor's axis, a clock, drift, and joints that are not linear. The
//! squares of the whitened residuals are summed into the cells of each margin (`cells`, `time`), from where the last fit has ended. The
//! cell that differs most from all others of its margin is named, if noise does not make it so.

mod cells;
mod force;
mod time;

use core::f64::consts::TAU;

use heapless::Vec;

use super::batch::Bins;
use super::{Plant, Problem, Refinement};
use crate::search::MAX_EXPERIMENTS;
use crate::sought::Coordinates;
use crate::spectrum::Experiment;
use cells::{Cell, worst};
use force::{OfRecord, exponent, stiffening};
use time::{EIGHTHS, InTime};

/// Largest number of places: one for each margin, the stiffness, and the distortion.
pub const MAX_LEFT_OVER: usize = 7;
/// Most bands: those of eight octaves.
const MAX_BANDS: usize = 16;
/// Bands in an octave. Chosen: the half width of a resonance that the band shows well is less.
const PER_OCTAVE: f64 = 2.0;

/// A place with larger residuals. `times` is the mean square of the whitened residuals there over that of all others, at least 1.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeftOver {
    /// In a band.
    Frequency {
        /// Lower end, Hz.
        from_hz: f64,
        /// Upper end, Hz.
        to_hz: f64,
        /// Mean square over that of the residuals elsewhere.
        times: f64,
    },
    /// Along an axis of the accelerometer.
    Direction {
        /// Number of the axis, 0 to 2.
        axis: usize,
        /// Mean square over that of the residuals along the others.
        times: f64,
    },
    /// In a record.
    Record {
        /// Its number, from 0.
        record: usize,
        /// Mean square over that of the residuals of the others.
        times: f64,
    },
    /// In a part of every record.
    Time {
        /// Start, as a part of the record, 0 to 1.
        from: f64,
        /// End, likewise.
        to: f64,
        /// Mean square over that of the residuals in the rest.
        times: f64,
    },
    /// The residuals at the same pose grow as the force to another power than 1. An error of a linear model would give 1.
    Force {
        /// This power.
        exponent: f64,
        /// Its standard deviation.
        deviation: f64,
    },
    /// All stiffnesses at the same pose go with the force.
    Stiffness {
        /// Part by which they grow where the force doubles.
        growth: f64,
        /// Its standard deviation.
        deviation: f64,
    },
    /// The residuals are no response to the force, so that no linear model explains them.
    Distortion {
        /// The part of it that no smooth response to the force explains: of its mean square beyond noise, the median over
        /// records and axes of medians over narrow bands.
        part: f64,
    },
}

impl Refinement {
    /// Returns the places with larger residuals at some coordinates, or, if there is a plant, at the point of its fit. The list is empty where
    /// gravity leaves the robot no equilibrium.
    pub(crate) fn left_over<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        plant: Option<&Plant>,
        experiments: &[Experiment<B>],
    ) -> Vec<LeftOver, MAX_LEFT_OVER> {
        let mut margins = Margins::new(problem.measurement.band_hz);
        for (record, experiment) in experiments.iter().enumerate().take(MAX_EXPERIMENTS) {
            let is_in_time = experiment.is_whole() && experiment.is_record();
            // The force of a modal test is not known.
            let rms_force = if experiment.is_record() { experiment.rms_force() } else { f64::NAN };
            margins.begin(OfRecord::new(&experiment.pose, rms_force), is_in_time);
            let mut index = 0;
            for part in experiment.parts() {
                let model = self.model_of(problem, coordinates, plant, &part, record);
                let Ok(model) = model else { return Vec::new() };
                let bins = Bins::of(experiment, &part);
                self.workspace.each_left(problem, &model, experiment, &part, bins, &mut |bin| {
                    let white = bin.white().map(|value| [value.re, value.im]);
                    margins.take(experiment.omega(index) / TAU, &white);
                    index += 1;
                });
            }
        }
        let mut places = margins.left_over();
        let growth = plant.and_then(|plant| stiffening(&margins.records, &plant.found()));
        places.extend(growth.map(|[growth, deviation]| LeftOver::Stiffness { growth, deviation }));
        places
    }
}

/// Sums of the squares along each margin.
#[derive(Clone, Debug)]
struct Margins {
    band_hz: [f64; 2],
    bands: Vec<Cell, MAX_BANDS>,
    directions: [Cell; 3],
    records: Vec<OfRecord, MAX_EXPERIMENTS>,
    time: InTime,
    is_in_time: bool,
}

impl Margins {
    fn new(band_hz: [f64; 2]) -> Self {
        // A band from zero on has no octaves. Its lowest cell begins there.
        let lower = band_hz[0].max(band_hz[1] / libm::exp2(MAX_BANDS as f64 / PER_OCTAVE));
        let bands = libm::round(PER_OCTAVE * libm::log2(band_hz[1] / lower));
        let bands = (bands as usize).clamp(1, MAX_BANDS);
        Self {
            band_hz: [lower, band_hz[1]],
            bands: (0..bands).map(|_| Cell::default()).collect(),
            directions: [Cell::default(); 3],
            records: Vec::new(),
            time: InTime::default(),
            is_in_time: true,
        }
    }

    /// Begins the next record. One that is not whole, but has parts, says nothing of time, nor does a measured receptance.
    fn begin(&mut self, record: OfRecord, is_in_time: bool) {
        self.time.begin();
        self.is_in_time = is_in_time;
        // There is room for every record.
        let _ = self.records.push(record);
    }

    /// Takes the next bin of the record: real and imaginary part of the whitened residual along each axis.
    fn take(&mut self, hz: f64, white: &[[f64; 2]; 3]) {
        let [lower, upper] = self.band_hz;
        let place = libm::log(hz / lower) / libm::log(upper / lower) * self.bands.len() as f64;
        // The conversion saturates.
        let band = (place as usize).min(self.bands.len() - 1);
        for (axis, [re, im]) in white.iter().enumerate() {
            let square = re * re + im * im;
            // Of an axis that is not measured exactly nothing is left.
            if square == 0.0 {
                continue;
            }
            self.directions[axis].add(square);
            self.bands[band].add(square);
            if let Some(record) = self.records.last_mut() {
                record.left.add(square);
            }
        }
        if self.is_in_time {
            self.time.take(white);
        }
    }

    fn left_over(&self) -> Vec<LeftOver, MAX_LEFT_OVER> {
        let [lower, upper] = self.band_hz;
        let edge =
            |index: usize| lower * libm::pow(upper / lower, index as f64 / self.bands.len() as f64);
        let part = |index: usize| index as f64 / EIGHTHS as f64;
        let records: Vec<Cell, MAX_EXPERIMENTS> = self.records.iter().map(|it| it.left).collect();
        let found = [
            worst(&self.bands).map(|(band, times)| LeftOver::Frequency {
                from_hz: edge(band),
                to_hz: edge(band + 1),
                times,
            }),
            worst(&self.directions).map(|(axis, times)| LeftOver::Direction { axis, times }),
            worst(&records).map(|(record, times)| LeftOver::Record { record, times }),
            worst(&self.time.cells()).map(|(eighth, times)| LeftOver::Time {
                from: part(eighth),
                to: part(eighth + 1),
                times,
            }),
            exponent(&self.records)
                .map(|[exponent, deviation]| LeftOver::Force { exponent, deviation }),
        ];
        found.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests;
