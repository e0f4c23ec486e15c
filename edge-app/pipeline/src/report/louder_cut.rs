//! Noise of the acceleration that only the cut has.

use flexid_wire::warning::Warning;

use crate::record::Experiment;

/// Returns the warning about the noise in the cuts of `experiments`, with the band that has most over the rest. Returns `None` if no cut has
/// more noise than the rest.
pub(crate) fn louder_cut(experiments: &[Experiment]) -> Option<Warning> {
    let records = experiments.iter().filter(|one| one.cut_noise.is_louder()).count() as u32;
    let bands = experiments.iter().flat_map(Experiment::louder_bands);
    let (axis, [from_hz, to_hz], power) = bands.max_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(Warning::LouderCut { axis: axis as u8, from_hz, to_hz, times: power.sqrt(), records })
}
