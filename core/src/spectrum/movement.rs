//! Movement of the robot in the parts of a record.
//!
//! A part is fitted at the mean pose of its time, while the robot moves on. A model tells to the first order what the reading differs by
//! (`refine::plant::movement`). Until there is one, all of it is an error that the weights of the residuals allow for: a part of the reading.

use core::ops::Range;

use heapless::Vec;

use super::experiment::Experiment;
use super::signals::Spectrum;
use crate::stream::Stage;

/// Relative change of a reading as a joint moves, 1/rad (1/m). Chosen: a turn by an angle turns the reading by as much.
const PER_MOVEMENT: f32 = 1.0;

/// Reading of the parts of a record beyond that at their mean poses. Empty where the robot stands.
#[derive(Clone, Debug)]
pub(crate) struct Movement<const B: usize> {
    /// Its first order, which is subtracted from the acceleration, m/s. Empty until there is a model.
    pub(crate) order: Spectrum<B>,
    /// Mean square of what is left of it in each bin, per axis, (m/s)².
    pub(crate) left: [Vec<f32, B>; 3],
}

impl<const B: usize> Movement<B> {
    pub(crate) const NONE: Self = Self { order: Spectrum::EMPTY, left: [const { Vec::new() }; 3] };

    /// Movement before there is a model: the pose is anywhere along the movement with the same probability, and the error as likely along each axis.
    pub(super) fn without_a_model(acceleration: &Spectrum<B>, path: &[Stage]) -> Self {
        let each = acceleration.re[0].len() / path.len();
        let error = |bin: usize| {
            let moves = PER_MOVEMENT * path[bin / each].moves as f32;
            let parts = acceleration.re.iter().chain(&acceleration.im);
            let square: f32 = parts.map(|part| part[bin] * part[bin]).sum();
            moves * moves / 12.0 * square / 3.0
        };
        let left = core::array::from_fn(|_| (0..each * path.len()).map(error).collect());
        Self { left, ..Self::NONE }
    }

    /// Takes the first order of the next bin of an experiment.
    pub(crate) fn push(&mut self, experiment: &Experiment<B>, order: &[[f64; 2]; 3]) {
        // Nothing is read along an axis that is not measured.
        self.order.push(&core::array::from_fn(|axis| {
            if experiment.measures(axis) { order[axis] } else { [0.0; 2] }
        }));
    }

    /// Takes the next order in the bins of a part to be as much smaller than the first as that is than the reading.
    pub(crate) fn leave_next_order(&mut self, experiment: &Experiment<B>, bins: Range<usize>) {
        let of = |spectrum: &Spectrum<B>| {
            bins.clone().flat_map(|bin| squares(spectrum, bin)).sum::<f32>()
        };
        let smaller = of(&self.order) / of(&experiment.acceleration).max(f32::MIN_POSITIVE);
        for bin in bins.clone() {
            for (left, square) in self.left.iter_mut().zip(squares(&self.order, bin)) {
                // There is room: the experiment has as many bins.
                let _ = left.push(smaller * square);
            }
        }
    }
}

/// Square of each axis in a bin.
fn squares<const B: usize>(spectrum: &Spectrum<B>, bin: usize) -> [f32; 3] {
    spectrum.at(bin).map(|[re, im]| (re * re + im * im) as f32)
}
