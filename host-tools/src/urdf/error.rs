//! Why a URDF file is refused.

use std::path::PathBuf;

use flexid_core::MAX_JOINTS;
use flexid_pipeline::model::ModelError;

use crate::mesh::MeshError;

/// Largest mass of a link. A larger one is an error in the file.
pub(super) const HEAVIEST_KG: f64 = 1e6;

/// Why a URDF file is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UrdfError {
    /// XML that is no URDF.
    #[error("not a URDF: {0}")]
    Syntax(String),
    /// A file of another kind.
    #[error("is {0}, and no URDF: name the robot's URDF file")]
    OtherFile(&'static str),
    /// A xacro file, which must be expanded to a URDF first.
    #[error(
        "is a xacro, a template for URDF: expand it first with `xacro IN.xacro > robot.urdf` (ROS package xacro, or `pip install xacro` and a folder in place of each $(find PACKAGE))"
    )]
    Xacro,
    /// Two links of one name.
    #[error("link '{0}' is defined twice: rename one")]
    DuplicateLink(String),
    /// Two joints of one name.
    #[error("joint '{0}' is defined twice: rename one")]
    DuplicateJoint(String),
    /// A link or joint without a name.
    #[error("line {line}: a <{kind}> has no name")]
    Nameless {
        /// Line, from 1.
        line: u32,
        /// "link" or "joint".
        kind: &'static str,
    },
    /// An element that lacks what it needs, or has what cannot be read.
    #[error("line {line}: {kind} '{name}': {fault}")]
    Malformed {
        /// Line, from 1.
        line: u32,
        /// "link" or "joint".
        kind: &'static str,
        /// Name of the link or joint.
        name: String,
        /// The fault.
        fault: String,
    },
    /// A number that is NaN or infinite.
    #[error("{kind} '{name}' has the number {number}: must be finite")]
    NotFinite {
        /// "link" or "joint".
        kind: &'static str,
        /// Name of the link or joint.
        name: String,
        /// The number in the file.
        number: f64,
    },
    /// A joint to a link that is not defined.
    #[error("joint '{joint}' names link '{link}', which the file does not define")]
    NoSuchEnd {
        /// The joint.
        joint: String,
        /// The missing link.
        link: String,
    },
    /// A link below two joints.
    #[error("link '{link}' is the child of two joints, '{}' and '{}': a tree is needed", joints[0], joints[1])]
    TwoParents {
        /// The link.
        link: String,
        /// Both joints above it.
        joints: [String; 2],
    },
    /// Joints that form a ring.
    #[error("link '{0}' hangs on a ring of joints: a tree is needed, cut the ring at one joint")]
    Cycle(String),
    /// More than one link without a joint above it.
    #[error("the file has {} roots ({}): join them, one root is needed", .0.len(), .0.join(", "))]
    Roots(Vec<String>),
    /// No `--tcp`.
    #[error("--tcp is missing: name the link at the tool's tip: the chains end in {}; all links are {}", .ends.join(", "), .links.join(", "))]
    NoTcp {
        /// Links behind a movable joint that carry no other link.
        ends: Vec<String>,
        /// The links of the file.
        links: Vec<String>,
    },
    /// `--tcp` names no link.
    #[error("--tcp {name}: no such link; the file has {}", .links.join(", "))]
    NoSuchTcp {
        /// The requested name.
        name: String,
        /// The links of the file.
        links: Vec<String>,
    },
    /// No joint between root and TCP is movable.
    #[error("no movable joint between the root and '{0}': choose a --tcp beyond the joints")]
    Rigid(String),
    /// More movable joints than flexid supports.
    #[error(
        "{count} movable joints between the root and '{tcp}': at most {MAX_JOINTS} are supported"
    )]
    TooManyJoints {
        /// Movable joints.
        count: usize,
        /// The TCP link.
        tcp: String,
    },
    /// No room for the pedestal beside the movable joints.
    #[error(
        "{0} movable joints and a pedestal: at most {MAX_JOINTS} joints are supported in all; leave out --pedestal, and state \
         ground_m_per_n in [accuracy]"
    )]
    NoRoomForPedestal(usize),
    /// A joint that does not have exactly one driven axis.
    #[error(
        "joint '{joint}' is {kind}: only revolute, continuous, prismatic and fixed joints are supported"
    )]
    JointType {
        /// The joint.
        joint: String,
        /// Its type, as in the file.
        kind: String,
    },
    /// A joint that follows another.
    #[error(
        "joint '{joint}' mimics '{leader}': a coupled drive cannot be simulated; remove <mimic> if it is \
         driven by itself"
    )]
    Mimic {
        /// The follower.
        joint: String,
        /// The joint that it follows.
        leader: String,
    },
    /// An axis of length 0.
    #[error("joint '{0}' has a zero <axis>: give its direction, such as xyz=\"0 0 1\"")]
    ZeroAxis(String),
    /// Moving links without mass.
    #[error(
        "no mass on {}: give each an <inertial> with <mass value=\"kg\"/> and \
         <inertia ixx=.../> about its centre of mass",
        .0.iter().map(|(link, joint)| format!("link '{link}' (moved by '{joint}')")).collect::<Vec<_>>().join(", ")
    )]
    NoMass(Vec<(String, String)>),
    /// A mass that is negative, or larger than that of any robot's link.
    #[error("link '{link}' has the mass {mass:?} kg: must be positive and at most {HEAVIEST_KG:e}")]
    Mass {
        /// The link.
        link: String,
        /// Mass, kg.
        mass: f64,
    },
    /// An inertia that no body has.
    #[error(
        "the inertia of link '{link}' belongs to no body: principal moments {} kg m² must be positive and none above the sum of \
         the two others",
        shown(moments)
    )]
    Inertia {
        /// The link.
        link: String,
        /// Principal moments, ascending, kg m².
        moments: [f64; 3],
    },
    /// A mass that cannot be spread over the links.
    #[error("{0}")]
    Spread(String),
    /// A mesh that is not there.
    #[error("link '{link}': no mesh {file:?}: {mend}")]
    NoMesh {
        /// The link.
        link: String,
        /// The name in the file.
        file: String,
        /// Places that were searched, and the mend.
        mend: String,
    },
    /// A mesh that gives no body.
    #[error("link '{link}': {}: {fault}", file.display())]
    Mesh {
        /// The link.
        link: String,
        /// The mesh.
        file: PathBuf,
        /// The fault.
        fault: MeshError,
    },
    /// A shape that is no body.
    #[error("link '{0}' has a box, cylinder or sphere whose sizes are not all positive")]
    Shape(String),
    /// A mesh that is far larger or smaller than the arm.
    #[error(
        "the largest shape, of link '{link}', is {size:.3} m across, and the arm {arm:.2} m long: put the right scale into its <mesh>, for a mesh in \
         millimetres scale=\"0.001 0.001 0.001\""
    )]
    Scale {
        /// The link.
        link: String,
        /// Diagonal of the mesh, m.
        size: f64,
        /// Length of the arm, m.
        arm: f64,
    },
    /// Links that have no mass, and no shape from which one follows.
    #[error(
        "no mass on {}, and no <collision> or <visual> from whose volume it follows: give each an <inertial>",
        .0.iter().map(|(link, joint)| format!("link '{link}' (moved by '{joint}')")).collect::<Vec<_>>().join(", ")
    )]
    NoShape(Vec<(String, String)>),
    /// Any other fault of the model.
    #[error("{0}")]
    Model(ModelError),
}

/// Principal moments, each with the digits that tell it from others.
pub(super) fn shown(moments: &[f64; 3]) -> String {
    let digits = |moment: &f64| match moment.abs() {
        ..1e-3 if *moment != 0.0 => format!("{moment:.3e}"),
        _ => format!("{moment:.4}"),
    };
    moments.iter().map(digits).collect::<Vec<_>>().join(", ")
}
