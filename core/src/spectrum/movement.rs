//! Error of the parts of a record by their movement.
//!
//! A part is fitted at the mean pose of its time, while the robot moves on. What the reading differs by is an error that the weights of the residuals
//! allow for. A model tells its mean square (`refine::movement`); until there is one, it is a part of the reading.

use heapless::Vec;

use super::part::Pose;
use super::signals::Spectrum;
use crate::stream::{MAX_PARTS, Stage};

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

/// Change of the joint angles in each even stage: that between its neighbours, by their distance.
pub(super) fn travel(stages: &[Stage]) -> Vec<Pose, MAX_PARTS> {
    let of = |at: usize| -> Pose {
        let (before, after) = (at.saturating_sub(1), (at + 1).min(stages.len() - 1));
        let distance = (after - before).max(1) as f64;
        let ends = stages[before].pose.iter().zip(&stages[after].pose);
        ends.map(|(before, after)| (after - before) / distance).collect()
    };
    (0..stages.len()).filter(|at| stages[*at].is_even).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(at: f64, is_even: bool) -> Stage {
        let pose = [0.1 * at * at, -at].into_iter().collect();
        Stage { pose, moves: 0.0, is_even }
    }

    /// Poses of a parabola, whose change over a part is that of its derivative in the middle; the first part has one neighbour, and so has the last.
    #[test]
    fn a_part_travels_as_between_its_neighbours() {
        let stages: std::vec::Vec<Stage> = (0..5).map(|at| stage(f64::from(at), at != 2)).collect();
        let travel = travel(&stages);
        let expected = [[0.1, -1.0], [0.2, -1.0], [0.6, -1.0], [0.7, -1.0]];
        assert_eq!(travel.len(), expected.len());
        for (own, expected) in travel.iter().zip(expected) {
            for (own, expected) in own.iter().zip(expected) {
                assert!((own - expected).abs() < 1e-12, "{travel:?}");
            }
        }
        assert_eq!(super::travel(&stages[..1])[0].as_slice(), [0.0, 0.0]);
    }
}
