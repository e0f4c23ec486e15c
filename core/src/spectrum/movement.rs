//! Error of the parts of a record by their movement.
//!
//! A part is fitted at the mean pose of its time, while the robot moves on. What the reading differs by is an error that the weights of the residuals
//! allow for. A model tells its mean square (`refine::movement`); until there is one, it is a part of the reading.

use heapless::Vec;

use super::signals::Spectrum;
use crate::stream::Stage;

/// Relative change of a reading as a joint moves, 1/rad (1/m). Chosen: a turn by an angle turns the reading by as much.
const PER_MOVEMENT: f32 = 1.0;

/// Mean square of the error in each bin of the parts, per axis, (m/s)²: the pose is anywhere along the movement with the same probability, and the
/// error as likely along each axis.
pub(super) fn without_a_model<const B: usize>(
    acceleration: &Spectrum<B>,
    path: &[Stage],
) -> [Vec<f32, B>; 3] {
    let each = acceleration.re[0].len() / path.len();
    let error = |bin: usize| {
        let moves = PER_MOVEMENT * path[bin / each].moves as f32;
        let parts = acceleration.re.iter().chain(&acceleration.im);
        let square: f32 = parts.map(|part| part[bin] * part[bin]).sum();
        moves * moves / 12.0 * square / 3.0
    };
    core::array::from_fn(|_| (0..each * path.len()).map(error).collect())
}
