//! Faults of a record that make it useless.

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::spectrum::SpectrumError;
use flexid_wire::unused::RecordFault;

use crate::model::Model;
use crate::names::joint_name;

/// Returns the fault of a record at whose pose a robot as stiff as the bounds allow has no equilibrium.
pub(crate) fn without_equilibrium(
    error: LinearisationError,
    model: &Model,
    pose: &[f64],
) -> RecordFault {
    match error {
        // There is one bushing for each joint.
        LinearisationError::Angles(angles) | LinearisationError::Bushings(angles) => {
            RecordFault::Pose(angles as u64)
        }
        LinearisationError::NoEquilibrium(joint) | LinearisationError::QuarterTurn(joint) => {
            let pose = pose.iter().copied().collect();
            RecordFault::NoEquilibrium { joint: joint_name(model, joint), pose }
        }
    }
}

/// Returns the fault of a record without a spectrum.
pub(crate) fn without_spectrum(error: SpectrumError) -> RecordFault {
    match error {
        SpectrumError::Length(samples) => RecordFault::Samples(samples as u64),
        SpectrumError::Bins(bins) => RecordFault::Bins(bins as u64),
        SpectrumError::Pose(angles) => RecordFault::Pose(angles as u64),
        SpectrumError::NotFinite => RecordFault::NotFinite,
        SpectrumError::NoForce => RecordFault::NoForce,
        SpectrumError::Uneven => RecordFault::Uneven,
    }
}
