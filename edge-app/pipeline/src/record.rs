//! Records and experiments of the pipeline, with their sizes and numbers.

use flexid_core::MAX_JOINTS;
use flexid_core::chain::poses_agree;
use flexid_core::stream::LEAP;

/// Most samples of a record.
pub const SAMPLES: usize = 32_768;
/// Most bins of a band.
pub const BINS: usize = 4096;
/// Most records that are kept. The newest records are kept.
pub use flexid_core::search::MAX_EXPERIMENTS;
/// Most records of one pose that are kept: three poses, as the paper has, share the room.
pub const MAX_PER_POSE: usize = MAX_EXPERIMENTS / 3;

/// A record of this pipeline.
pub type Record = flexid_core::stream::Record<SAMPLES>;
/// An experiment of this pipeline.
pub type Experiment = flexid_core::spectrum::Experiment<BINS>;
/// Joint angles, rad (m).
pub(crate) type Pose = heapless::Vec<f64, MAX_JOINTS>;

/// Largest difference between the angles of one pose, rad (m).
const SAME_POSE: f64 = 1e-3;

/// Returns whether two poses (rad, m) are the same.
pub fn same_pose(one: &[f64], other: &[f64]) -> bool {
    poses_agree(one, other, SAME_POSE)
}

/// Returns whether a path goes on from one pose to the next, rad (m): no joint leaps.
pub fn goes_on(one: &[f64], next: &[f64]) -> bool {
    poses_agree(one, next, LEAP)
}
