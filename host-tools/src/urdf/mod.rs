//! The import of a URDF file as a serial chain that can be simulated and identified.
//!
//! The chain runs from the root to the TCP link. The import removes fixed joints and lumps what they carry into the
//! link before them. It lumps side branches in as well, and holds their movable joints at 0.

mod body;
mod pedestal;
mod plausibility;
mod tree;

use flexid_core::MAX_JOINTS;
use flexid_pipeline::input;
use flexid_pipeline::model::{Kind, Model, ModelError, ModelJoint, Tcp};
use nalgebra::{Isometry3, Matrix3, Unit, Vector3};
use urdf_rs::JointType;

use body::Body;
use tree::{Tree, isometry};

/// Share by which a moment of inertia may miss the triangle inequality, since files carry rounded numbers.
const ROUNDING: f64 = 1e-3;

/// Largest mass of a link. A larger one is an error in the file.
const HEAVIEST_KG: f64 = 1e6;

/// Places of `[ixx, iyy, izz, ixy, ixz, iyz]` in the matrix.
const INERTIA_ORDER: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// A robot imported from a URDF file.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The model, whose chain can be simulated.
    pub model: Model,
    /// Warnings for the engineer, one sentence each.
    pub warnings: Vec<String>,
}

/// What the first driven joint stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// A ground that does not give way.
    Rigid,
    /// A body that gives way against the ground: base plate, pedestal, frame. It is a fixed joint of the model.
    Pedestal,
}

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
        "is a xacro, a template for URDF: expand it first with `xacro IN.xacro > robot.urdf` (ROS package xacro, or `pip install xacro`)"
    )]
    Xacro,
    /// Two links of one name.
    #[error("link '{0}' is defined twice: rename one")]
    DuplicateLink(String),
    /// Two joints of one name.
    #[error("joint '{0}' is defined twice: rename one")]
    DuplicateJoint(String),
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
        /// Its type, as in URDF.
        kind: &'static str,
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
        "the inertia of link '{link}' belongs to no body: principal moments {:.4}, {:.4}, {:.4} kg m² must be \
         positive and none above the sum of the two others",
        moments[0], moments[1], moments[2]
    )]
    Inertia {
        /// The link.
        link: String,
        /// Principal moments, ascending, kg m².
        moments: [f64; 3],
    },
    /// Any other fault of the model.
    #[error("{0}")]
    Model(ModelError),
}

/// Reads the chain from the root to the link `tcp` out of the text of a URDF file. On a pedestal, what the file has before the first
/// movable joint becomes the pedestal's body.
///
/// # Errors
/// The error names the link or the joint, and the correction.
pub fn import(text: &str, tcp: &str, base: Base) -> Result<Imported, UrdfError> {
    let robot = read(text)?;
    let tree = Tree::new(&robot)?;
    let path = tree.path(tcp)?;
    let mut importer = Importer { tree: &tree, warnings: Vec::new() };

    let mut joints: Vec<ModelJoint> = Vec::new();
    let (mut carried, mut massless) = (Vec::new(), Vec::new());
    // Pose of the present link in the frame of the last movable joint.
    let mut pose = Isometry3::identity();
    for (index, joint) in path.iter().enumerate() {
        pose *= isometry(&joint.origin);
        let Some(kind) = movable(joint)? else { continue };
        let (axis, link) = (axis(joint)?, &joint.child.link);
        let body = importer.carried(&path[index + 1..], link)?;
        if body.mass <= 0.0 {
            massless.push((link.clone(), joint.name.clone()));
        }
        let inertia = body.central_inertia();
        carried.push((link.clone(), inertia));
        joints.push(ModelJoint {
            name: joint.name.clone(),
            kind,
            origin_xyz_m: tidy(pose.translation.vector.into()),
            origin_rpy_rad: tidy(pose.rotation.euler_angles().into()),
            axis,
            limits: importer.limits(joint),
            mass_kg: body.mass,
            centre_of_mass_m: tidy(body.centre_of_mass().into()),
            inertia_kg_m2: tidy(INERTIA_ORDER.map(|at| inertia[at])),
        });
        pose = Isometry3::identity();
    }
    if joints.is_empty() {
        return Err(UrdfError::Rigid(tcp.to_owned()));
    }
    if !massless.is_empty() {
        return Err(UrdfError::NoMass(massless));
    }
    let tcp = Tcp {
        name: tcp.to_owned(),
        xyz_m: tidy(pose.translation.vector.into()),
        rpy_rad: tidy(pose.rotation.euler_angles().into()),
    };
    let mut model = Model { name: robot.name.clone(), joints, tcp };
    let refused = |error: ModelError, model: &Model, carried: &[(String, Matrix3<f64>)]| match error
    {
        ModelError::JointCount(count) => {
            UrdfError::TooManyJoints { count, tcp: model.tcp.name.clone() }
        }
        ModelError::Inertia(name) => {
            let at = model.joints.iter().position(|joint| joint.name == name).unwrap_or_default();
            let (link, inertia) = &carried[at];
            UrdfError::Inertia { link: link.clone(), moments: principal_moments(inertia) }
        }
        other => UrdfError::Model(other),
    };
    model.chain().map_err(|error| refused(error, &model, &carried))?;
    if base == Base::Pedestal {
        let count = model.joints.len();
        if count == MAX_JOINTS {
            return Err(UrdfError::NoRoomForPedestal(count));
        }
        if model.joints.iter().any(|joint| joint.name == pedestal::NAME) {
            return Err(UrdfError::DuplicateJoint(pedestal::NAME.to_owned()));
        }
        let moving_kg = model.joints.iter().map(|joint| joint.mass_kg).sum();
        let (pedestal, link, inertia) = importer.pedestal(&path, moving_kg)?;
        model.joints.insert(0, pedestal);
        carried.insert(0, (link, inertia));
        model.chain().map_err(|error| refused(error, &model, &carried))?;
    }
    let mut warnings = importer.warnings;
    warnings.extend(doubts(&model));
    // Names may hold line breaks.
    let warnings = warnings.iter().map(|warning| one_line(warning)).collect();
    Ok(Imported { model, warnings })
}

/// Why the text of a URDF file cannot be imported without a TCP: the links to choose from, or what is wrong with the file.
pub(crate) fn without_tcp(text: &str) -> UrdfError {
    let links = || {
        let robot = read(text)?;
        let tree = Tree::new(&robot)?;
        Ok(UrdfError::NoTcp { ends: tree.ends(), links: tree.names() })
    };
    links().unwrap_or_else(|fault| fault)
}

fn read(text: &str) -> Result<urdf_rs::Robot, UrdfError> {
    // An expanded file may still declare the name space, but uses no element of it.
    if text.contains("<xacro:") {
        return Err(UrdfError::Xacro);
    }
    let syntax = |error: urdf_rs::UrdfError| match input::seems(text) {
        Some(own) if !text.trim_start().starts_with('<') => UrdfError::OtherFile(own),
        _ => UrdfError::Syntax(one_line(&error.to_string())),
    };
    urdf_rs::read_from_string(text).map_err(syntax)
}

/// Signs that masses and inertias of a checked model were never measured, one sentence each. The pedestal is left out.
pub(crate) fn doubts(model: &Model) -> Vec<String> {
    let moving = Model { joints: model.driven().cloned().collect(), ..model.clone() };
    let names: Vec<&str> = moving.joints.iter().map(|joint| joint.name.as_str()).collect();
    moving.chain().map_or_else(
        |_| Vec::new(),
        |chain| plausibility::warnings(&chain, &names, &model.tcp.name),
    )
}

/// Collects the bodies that the chain carries, and the warnings.
struct Importer<'a> {
    tree: &'a Tree<'a>,
    warnings: Vec<String>,
}

impl Importer<'_> {
    /// The body that moves with the joint above `link`, in that link's frame: the links up to the next
    /// movable joint of `chain`, and every side branch.
    fn carried(&mut self, chain: &[&urdf_rs::Joint], link: &str) -> Result<Body, UrdfError> {
        let mut body = Body::default();
        let mut open = vec![(link.to_owned(), Isometry3::identity(), None::<String>)];
        while let Some((link, pose, branch)) = open.pop() {
            let own = self.body(&link, &pose)?;
            if own.mass > 0.0
                && let Some(branch) = branch.as_ref()
            {
                self.warnings.push(format!(
                    "link '{link}' ({} kg) hangs beside the chain on '{branch}': lumped in rigidly",
                    own.mass
                ));
            }
            body.add(&own);
            for joint in self.tree.joints_below(&link) {
                let in_chain = chain.iter().any(|other| other.name == joint.name);
                let moves = movable(joint)?.is_some();
                if in_chain && moves {
                    continue;
                }
                if moves {
                    self.warnings.push(format!(
                        "joint '{}' is not between the root and the TCP: held at 0",
                        joint.name
                    ));
                }
                let branch = branch.clone().or_else(|| (!in_chain).then(|| joint.name.clone()));
                open.push((joint.child.link.clone(), pose * isometry(&joint.origin), branch));
            }
        }
        Ok(body)
    }

    /// The pedestal, with the name of the root and the inertia of what hangs on it up to the first movable joint.
    fn pedestal(
        &mut self,
        path: &[&urdf_rs::Joint],
        moving_kg: f64,
    ) -> Result<(ModelJoint, String, Matrix3<f64>), UrdfError> {
        let root = path.first().map(|joint| joint.parent.link.clone()).unwrap_or_default();
        let mut body = self.carried(path, &root)?;
        if body.mass <= 0.0 {
            body = pedestal::assumed(moving_kg);
            self.warnings.push(format!(
                "no mass before the first movable joint: the pedestal is taken as {:.1} kg, a fifth of what moves; put its own \
                 mass_kg and inertia_kg_m2 into the model file",
                body.mass
            ));
        }
        Ok((pedestal::joint(&body), root, body.central_inertia()))
    }

    /// The body of one link alone; `pose` is the pose of the link in the frame of the result.
    fn body(&mut self, name: &str, pose: &Isometry3<f64>) -> Result<Body, UrdfError> {
        let Some(link) = self.tree.link(name) else { return Ok(Body::default()) };
        let (mass, inertial) = (link.inertial.mass.value, &link.inertial.inertia);
        let inertia = Matrix3::new(
            inertial.ixx,
            inertial.ixy,
            inertial.ixz, //
            inertial.ixy,
            inertial.iyy,
            inertial.iyz, //
            inertial.ixz,
            inertial.iyz,
            inertial.izz,
        );
        if !(0.0..=HEAVIEST_KG).contains(&mass) {
            return Err(UrdfError::Mass { link: name.to_owned(), mass });
        }
        if mass == 0.0 {
            if inertia != Matrix3::zeros() {
                self.warnings.push(format!("link '{name}' has inertia but no mass: ignored"));
            }
            return Ok(Body::default());
        }
        let moments = principal_moments(&inertia);
        let [least, middle, largest] = moments;
        // A point mass without inertia on a larger body is physical. The chain checks the sum.
        if least < 0.0 || largest > (least + middle) * (1.0 + ROUNDING) {
            return Err(UrdfError::Inertia { link: name.to_owned(), moments });
        }
        Ok(Body::new(mass, &(pose * isometry(&link.inertial.origin)), &inertia))
    }

    /// The joint's limits, infinite where the file has none.
    fn limits(&mut self, joint: &urdf_rs::Joint) -> [f64; 2] {
        let limits = [joint.limit.lower, joint.limit.upper];
        if joint.joint_type == JointType::Continuous {
            return [-f64::INFINITY, f64::INFINITY];
        }
        if limits[0] < limits[1] {
            return limits;
        }
        self.warnings.push(format!("joint '{}' has no usable <limit>: left open", joint.name));
        [-f64::INFINITY, f64::INFINITY]
    }
}

/// The kind of a movable joint; `None` for a fixed joint.
fn movable(joint: &urdf_rs::Joint) -> Result<Option<Kind>, UrdfError> {
    let unsupported = |kind| Err(UrdfError::JointType { joint: joint.name.clone(), kind });
    let kind = match joint.joint_type {
        JointType::Fixed => return Ok(None),
        JointType::Revolute | JointType::Continuous => Kind::Revolute,
        JointType::Prismatic => Kind::Prismatic,
        JointType::Floating => return unsupported("floating"),
        JointType::Planar => return unsupported("planar"),
        JointType::Spherical => return unsupported("spherical"),
    };
    Ok(Some(kind))
}

/// The axis of a joint with a drive of its own, of length 1.
fn axis(joint: &urdf_rs::Joint) -> Result<[f64; 3], UrdfError> {
    if let Some(mimic) = &joint.mimic {
        return Err(UrdfError::Mimic { joint: joint.name.clone(), leader: mimic.joint.clone() });
    }
    match Unit::try_new(Vector3::from(*joint.axis.xyz), 1e-9) {
        Some(axis) => Ok(axis.into_inner().into()),
        None => Err(UrdfError::ZeroAxis(joint.name.clone())),
    }
}

fn principal_moments(inertia: &Matrix3<f64>) -> [f64; 3] {
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments
}

/// The numbers rounded to 12 digits of the largest one, for a file that people read.
fn tidy<const N: usize>(numbers: [f64; N]) -> [f64; N] {
    let largest = numbers.iter().fold(f64::MIN_POSITIVE, |most, number| most.max(number.abs()));
    let decimals = (11.0 - largest.log10().floor()).clamp(0.0, 300.0) as usize;
    numbers.map(|number| format!("{number:.decimals$}").parse().unwrap_or(number) + 0.0)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
