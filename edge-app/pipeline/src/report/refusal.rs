//! Reasons why a record is not used, in words.

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::spectrum::SpectrumError;
use flexid_wire::text::{Name, clipped};

use crate::model::Model;

/// Returns in words why a robot as stiff as the bounds allow has no equilibrium at a pose.
pub(crate) fn no_equilibrium(error: LinearisationError, model: &Model, pose: &[f64]) -> String {
    let name = |joint: usize| -> Name {
        model.joints.get(joint).map_or_else(Name::new, |joint| clipped(&joint.name))
    };
    let angles: Vec<String> = pose.iter().map(|angle| format!("{angle:.2}")).collect();
    let angles = angles.join(", ");
    match error {
        LinearisationError::Angles(_) | LinearisationError::Bushings(_) => error.to_string(),
        LinearisationError::NoEquilibrium(joint) | LinearisationError::QuarterTurn(joint) => {
            let name = name(joint);
            format!("{name} gives way under gravity at ({angles}): raise [bounds] or check masses")
        }
    }
}

/// Returns in words why a record has no spectrum.
pub(crate) fn reason(error: SpectrumError) -> String {
    match error {
        SpectrumError::Length(samples) => format!("{samples} samples are too few"),
        SpectrumError::Bins(bins) => format!("its band holds {bins} bins"),
        SpectrumError::Pose(angles) => format!("its pose has {angles} angles"),
        SpectrumError::NotFinite => "it has values that are not finite".into(),
        SpectrumError::NoForce => "in the band it has hardly more force than noise".into(),
    }
}
