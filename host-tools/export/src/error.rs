//! Why a robot cannot be exported.

use std::io;

use flexid_pipeline::model::ModelError;

/// Why a robot cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The model is invalid.
    #[error("the model {0}")]
    Model(#[from] ModelError),
    /// The fit has another number of joints than the model.
    #[error("the fit has {fit} joints, and the model {model}: both must be of the same robot")]
    JointCount {
        /// Number of joints of the fit.
        fit: usize,
        /// Number of joints of the model.
        model: usize,
    },
    /// A joint of the fit is another one than that of the model in its place.
    #[error(
        "the fit has joint {fit:?} where the model has {model:?}: both must be of the same robot"
    )]
    JointName {
        /// Name in the fit.
        fit: String,
        /// Name in the model.
        model: String,
    },
    /// The pose has another number of angles than the model has drives.
    #[error("the pose has {angles} angles: give one per driven joint, {driven}")]
    AngleCount {
        /// Number of angles of the pose.
        angles: usize,
        /// Number of driven joints of the model.
        driven: usize,
    },
    /// An imperfection is of a joint that the model does not have, or out of its range.
    #[error("imperfections[{0}] is of another robot, or out of its range")]
    Imperfection(usize),
    /// A number of the pose or of gravity is NaN or infinite.
    #[error("the {0} has a number that is not finite")]
    NotFinite(&'static str),
    /// A stiffness or damping is negative, NaN or infinite.
    #[error("joint {joint:?}: {kind} {dof} is {value}: must be finite and not negative")]
    Parameter {
        /// Name of the joint.
        joint: String,
        /// `stiffness` or `damping`.
        kind: &'static str,
        /// Degree of freedom, `tx` to `rz`.
        dof: &'static str,
        /// Value, N/m or Nm/rad (stiffness), Ns/m or Nms/rad (damping).
        value: f64,
    },
    /// The text could not be written. In memory that does not occur.
    #[error("the text could not be written: {0}")]
    Write(#[from] io::Error),
}
