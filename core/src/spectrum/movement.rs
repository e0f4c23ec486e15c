//! Movement of the robot in the parts of a record.
//!
//! A part is fitted at the mean pose of its time, while the robot moves on. A model tells to the first order what the reading differs by
//! (`refine::plant::movement`). Until there is one, all of it is an error that the weights of the residuals allow for: a part of the reading.

use core::ops::Range;

use heapless::Vec;

use super::signals::Spectrum;
use crate::stream::Stage;

/// Relative change of a reading as a joint moves, 1/rad (1/m). Chosen: a turn by an angle turns the reading by as much.
const PER_MOVEMENT: f32 = 1.0;
/// Largest square of a first order, in that of the reading. Chosen: an order that is as much smaller as a tenth is less than a hundredth of the
/// reading. A model that makes it larger is a wrong one.
const LARGEST: f32 = 0.01;

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

    /// Movement before there is a model.
    pub(super) fn without_a_model(acceleration: &Spectrum<B>, path: &[Stage]) -> Self {
        let each = acceleration.re[0].len() / path.len();
        let error = |bin: usize| all_of(acceleration, &path[bin / each], bin);
        let left = core::array::from_fn(|_| (0..each * path.len()).map(error).collect());
        Self { left, ..Self::NONE }
    }

    /// Takes the next order in the bins of a part to be as much smaller than the first as that is than the reading. Where the first is not small, it is
    /// not that of the robot.
    pub(crate) fn leave_next_order(
        &mut self,
        acceleration: &Spectrum<B>,
        stage: &Stage,
        bins: Range<usize>,
    ) {
        let of = |spectrum: &Spectrum<B>| {
            bins.clone().flat_map(|bin| squares(spectrum, bin)).sum::<f32>()
        };
        let smaller = of(&self.order) / of(acceleration).max(f32::MIN_POSITIVE);
        for bin in bins {
            let mut left = squares(&self.order, bin).map(|square| smaller * square);
            if smaller > LARGEST {
                left = [all_of(acceleration, stage, bin); 3];
                self.order.re.iter_mut().chain(&mut self.order.im).for_each(|own| own[bin] = 0.0);
            }
            for (own, left) in self.left.iter_mut().zip(left) {
                // There is room: the experiment has as many bins.
                let _ = own.push(left);
            }
        }
    }
}

/// Mean square of the reading of a bin by a movement that no model tells, per axis, (m/s)²: the pose is anywhere along the movement with the same
/// probability, and the error as likely along each axis.
fn all_of<const B: usize>(acceleration: &Spectrum<B>, stage: &Stage, bin: usize) -> f32 {
    let moves = PER_MOVEMENT * stage.moves as f32;
    let square: f32 = squares(acceleration, bin).iter().sum();
    moves * moves / 12.0 * square / 3.0
}

/// Square of each axis in a bin.
fn squares<const B: usize>(spectrum: &Spectrum<B>, bin: usize) -> [f32; 3] {
    spectrum.at(bin).map(|[re, im]| (re * re + im * im) as f32)
}
