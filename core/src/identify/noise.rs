//! The noise of the cut, which differs from that at rest.

use super::{Estimate, Identifier};
use crate::refine::Plant;
use crate::spectrum::Experiment;

/// Most fits that follow each other because the noise was read again. Chosen: a fit that strong tones have biased shows others; the second
/// is without that bias, and the level of the noise follows.
pub const MAX_NOISE_ROUNDS: u32 = 4;

impl<R> Identifier<R> {
    /// Reads the noise in `experiments` again, from the residuals of a settled `estimate`, which is that of `plant`, if there is one, or else
    /// the identifier's own. Tones are subtracted. Without new ones, the level is raised where the cut has more noise than the rest.
    ///
    /// Returns whether that changes the experiments; then they are to be [renewed](Identifier::renew) and fitted again, up to
    /// [`MAX_NOISE_ROUNDS`] times. Nothing is changed where the noise at rest explains the residuals.
    pub fn read_noise_again<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        plant: Option<&Plant>,
        estimate: &Estimate,
    ) -> bool {
        // Tones are narrow. In a level they would cost a whole band.
        self.subtract_tones(experiments, plant, estimate)
            || self.raise_noise(experiments, plant, estimate)
    }
}
