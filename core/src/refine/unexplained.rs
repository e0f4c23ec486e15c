//! Residuals of one record, bin by bin.

use heapless::Vec;

use super::batch::{Batch, Bins};
use super::equations::{Accelerance, Assembly, Equations, Noise, Reading, by_lane};
use super::model::Model;
use super::modelled::Place;
use super::plant::columns::Columns;
use super::record::Workspace;
use super::seam::Seam;
use super::sizes::{COLUMNS, OF_RECORD};
use super::whitening::Whitening;
use super::{Plant, Problem, Refinement};
use crate::chain::linearise::LinearisationError;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, Response};
use crate::sought::Coordinates;
use crate::spectrum::{Experiment, Part, Spectrum};

/// Residuals of the acceleration of one record, and the noise there.
#[derive(Clone, Debug)]
pub(crate) struct Unexplained<const B: usize> {
    /// Bin number of the first bin of each part.
    pub(crate) first_bin: usize,
    /// Length of a part of the record, s.
    pub(crate) length: f64,
    /// Residuals along the accelerometer's axes, m/s.
    pub(crate) residual: Spectrum<B>,
    /// Mean square of the noise of both sensors in each bin, without lines of the acceleration, (m/s)².
    pub(crate) noise: [Vec<f32, B>; 3],
    /// Sum of the squares of the accelerance of all axes in each bin, 1/kg².
    pub(crate) response: Vec<f32, B>,
}

/// Residual of the acceleration in one bin of a record, and the noise there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BinLeft {
    /// Number of the record, from 0.
    pub record: usize,
    /// Number of the bin among those of the band, from 0.
    pub bin: usize,
    /// Measured less modelled acceleration, real and imaginary part along each of the accelerometer's axes, m/s.
    pub left: [[f64; 2]; 3],
    /// Mean square of the noise of both sensors along each axis, (m/s)².
    pub noise: [f64; 3],
}

impl Refinement {
    /// Calls `take` with what is left in each bin of the records from number `first` on at some coordinates, or where a plant stands, if
    /// there is one.
    ///
    /// # Errors
    /// Gravity leaves the robot no equilibrium.
    pub(crate) fn each_bin<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        plant: Option<&Plant>,
        experiments: &[Experiment<B>],
        first: usize,
        take: &mut dyn FnMut(&BinLeft),
    ) -> Result<(), LinearisationError> {
        for (record, experiment) in experiments.iter().enumerate().skip(first) {
            let mut bin = 0;
            for part in experiment.parts() {
                let model = self.model_of(problem, coordinates, plant, &part, record)?;
                let bins = Bins::of(experiment, &part);
                self.workspace.each_left(problem, &model, experiment, &part, bins, &mut |left| {
                    let (mut own, mut noise) = (*left.left, left.mean_square());
                    for axis in (0..3).filter(|axis| !experiment.measures(*axis)) {
                        (own[axis], noise[axis]) = ([0.0; 2], 0.0);
                    }
                    take(&BinLeft { record, bin, left: own, noise });
                    bin += 1;
                });
            }
        }
        Ok(())
    }

    /// Returns the residuals of a record of this number at some coordinates, or, if there is a plant, at the point of its fit. `None` where
    /// gravity leaves the robot no equilibrium.
    pub(crate) fn unexplained<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        plant: Option<&Plant>,
        experiment: &Experiment<B>,
        record: usize,
    ) -> Option<Unexplained<B>> {
        let mut unexplained = Unexplained {
            first_bin: experiment.first_bin,
            length: experiment.length(),
            residual: Spectrum::EMPTY,
            noise: [const { Vec::new() }; 3],
            response: Vec::new(),
        };
        let Unexplained { residual, noise, response, .. } = &mut unexplained;
        for part in experiment.parts() {
            let model = self.model_of(problem, coordinates, plant, &part, record).ok()?;
            let bins = Bins::without_lines(experiment, &part);
            self.workspace.each_left(problem, &model, experiment, &part, bins, &mut |bin| {
                // There is room: the experiment has as many bins.
                let _ = response.push(bin.response() as f32);
                // Nothing is left along an axis that is not measured.
                let is_read: [bool; 3] = core::array::from_fn(|axis| experiment.measures(axis));
                let mean_square = bin.mean_square();
                residual.push(&core::array::from_fn(|axis| {
                    if is_read[axis] { bin.left[axis] } else { [0.0; 2] }
                }));
                for axis in 0..3 {
                    let own = if is_read[axis] { mean_square[axis] } else { 1.0 };
                    let _ = noise[axis].push(own as f32);
                }
            });
        }
        Some(unexplained)
    }

    /// The model in a part of a record of this number, at some coordinates, or where a plant stands, if there is one.
    pub(super) fn model_of(
        &self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        plant: Option<&Plant>,
        part: &Part<'_>,
        record: usize,
    ) -> Result<Model, LinearisationError> {
        match plant {
            Some(plant) => plant.model(problem, part.site, record),
            None => {
                let place = Place { coordinates, site: part.site, record };
                self.workspace.model(problem, place)
            }
        }
    }
}

impl Workspace {
    /// Calls `take` with what a model leaves in each of the `bins` of a part of an experiment, with the seam that fits the part best.
    pub(super) fn each_left<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        experiment: &Experiment<B>,
        part: &Part<'_>,
        bins: Bins<'_>,
        take: Take<'_>,
    ) {
        let (seam, _) = self.fit_seam(problem, model, Bins::of(experiment, part));
        self.each_left_by(problem, model, &seam, bins, take);
    }

    /// [`Workspace::each_left`] with this seam.
    pub(super) fn each_left_by(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        seam: &Seam,
        bins: Bins<'_>,
        take: Take<'_>,
    ) {
        let assembly = Assembly {
            model,
            record: bins,
            equations: Equations::All(seam),
            sought: problem.sought,
            columns: Columns::NONE,
            normal: &mut self.record,
            level: problem.level,
        };
        run(assembly, take);
    }
}

/// Residual in one bin.
pub(super) struct LeftInBin<'a> {
    /// Real and imaginary part along each axis, m/s.
    left: &'a Reading,
    accelerance: &'a Accelerance,
    noise: &'a Noise,
}

impl LeftInBin<'_> {
    /// Returns the whitened residual.
    pub(super) fn white(&self) -> [Complex<f64>; 3] {
        let [force, acceleration] = self.noise;
        Whitening::new(acceleration, force, self.accelerance).white(self.left)
    }

    /// Mean square of its noise along each axis, (m/s)².
    fn mean_square(&self) -> [f64; 3] {
        let [force, acceleration] = self.noise;
        core::array::from_fn(|axis| {
            let of_force = self.accelerance[axis].iter().zip(force);
            acceleration[axis] + of_force.map(|(a, noise)| a.square() * noise).sum::<f64>()
        })
    }

    /// Sum of the squares of the accelerance, 1/kg².
    fn response(&self) -> f64 {
        self.accelerance.as_flattened().iter().map(|a| a.square()).sum()
    }
}

/// Consumer of residuals, bin by bin.
type Take<'a> = &'a mut dyn FnMut(&LeftInBin<'_>);

/// [`Left::run`], compiled once: not again for each number of bins, in each crate.
#[inline(never)]
fn run(assembly: Assembly<'_, COLUMNS, OF_RECORD>, take: Take<'_>) {
    f64::dispatch(assembly.level, Left { assembly, take });
}

struct Left<'a, 'b> {
    assembly: Assembly<'a, COLUMNS, OF_RECORD>,
    take: Take<'b>,
}

impl Kernel<f64> for Left<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) {
        let Self { assembly, take } = self;
        let bins = assembly.record.bins();
        let mut response = Response::new(like);
        for first in (0..bins).step_by(V::WIDTH) {
            let lanes = first..bins.min(first + V::WIDTH);
            let batch = Batch::new(like, &assembly.record, assembly.model, first);
            let unexplained = assembly.read(&mut response, &batch, lanes.clone());
            let accelerance = by_lane(&response.per_force);
            let noise = assembly.noise(lanes.clone());
            for lane in 0..lanes.len() {
                take(&LeftInBin {
                    left: &unexplained[lane],
                    accelerance: &accelerance[lane],
                    noise: &noise[lane],
                });
            }
        }
    }
}
