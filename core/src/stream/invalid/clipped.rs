//! Clipped samples: the quantity is beyond the range of the sensor, whose signal stays at the end of its range.
//!
//! A signal that is not clipped has few samples in the last step of its range, and many in the steps below it: of the samples of a sine
//! in the last w steps, `1 / √w` are in the last one; of anything with noise in it fewer are. A clipped axis has more there than chance
//! explains, in runs that the signal enters by more than a small difference: it creeps into the top of a slow oscillation, which coarse
//! steps make flat. A sensor stays where it is while it rests, too: samples count only while another axis moves, and no end counts that is
//! the force at rest.

use super::motion::Motion;
use super::{Rest, beyond_chance, other_moves};

/// Part of the range of an axis that counts as near its end.
const NEAR_END: f32 = 0.025;

/// Makes the clipped samples of the axes missing (NaN). Returns how many each axis has.
pub(super) fn remove(
    signals: &mut [&mut [f32]; 3],
    motions: &[Motion; 3],
    rest: &Rest,
) -> [usize; 3] {
    core::array::from_fn(|axis| {
        [1.0, -1.0].into_iter().map(|sign| remove_end(signals, motions, rest, axis, sign)).sum()
    })
}

/// Makes those at one end of the range of one axis missing: the upper one if `sign` is 1, the lower one if it is −1.
fn remove_end(
    signals: &mut [&mut [f32]; 3],
    motions: &[Motion; 3],
    rest: &Rest,
    axis: usize,
    sign: f32,
) -> usize {
    let signal = &signals[axis];
    let of = |sign: f32| signal.iter().map(|value| sign * value).fold(f32::NEG_INFINITY, f32::max);
    let end = of(sign);
    if rest.is_at(axis, sign * end) {
        return 0;
    }
    let near = NEAR_END * (end + of(-sign));
    let (mut stays, mut below) = (0, 0);
    // Whether the signal has entered the present run by more than a small difference.
    let mut is_entered = false;
    for sample in 1..signal.len() {
        let [before, distance] = [sample - 1, sample].map(|at| end - sign * signal[at]);
        if distance == 0.0 && before != 0.0 {
            is_entered = before > motions[axis].small();
        }
        if distance < near && other_moves(signals, motions, axis, sample) {
            stays += usize::from(distance == 0.0 && before == 0.0 && is_entered);
            below += usize::from(distance > 0.0);
        }
    }
    let share = libm::sqrtf(motions[axis].step / near);
    if !beyond_chance(stays, stays + below, share) {
        return 0;
    }
    let clipped = signals[axis].iter_mut().filter(|value| sign * **value == end);
    clipped.map(|value| *value = f32::NAN).count()
}
