//! Places of the parts of a robot with imperfections.

use heapless::Vec;

use crate::MAX_JOINTS;
use crate::chain::Chain;

/// A robot with imperfections before its bushings give way.
#[derive(Clone, Debug)]
pub struct Places {
    /// The chain. Its elastic centres are the origins of its joint frames. This holds at this pose alone.
    pub chain: Chain,
    /// Joint angles, one per driven joint, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Mass of the base, a point on the ground, kg. It counts where the ground gives way.
    pub base_mass: f64,
}
