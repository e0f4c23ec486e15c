//! The import of a URDF file as a serial chain that can be simulated and identified.
//!
//! The chain runs from the root to the TCP link. The import removes fixed joints and lumps what they carry into the
//! link before them. It lumps side branches in as well, and holds their movable joints at 0.

#[cfg(test)]
mod arms;
mod body;
mod document;
mod error;
mod pedestal;
mod plausibility;
mod spread;
mod tree;

use flexid_core::MAX_JOINTS;
use flexid_core::chain::{INERTIA_TOLERANCE, inertia_excess};
use flexid_pipeline::model::{Kind, Model, ModelError, ModelJoint, Tcp};
use nalgebra::{Isometry3, Matrix3, Unit};

use body::Body;
use document::{Inertial, Joint, Robot};
pub use error::UrdfError;
use error::{HEAVIEST_KG, shown};
pub(crate) use plausibility::{Doubt, limits_in_degrees};
use tree::Tree;

/// Places of `[ixx, iyy, izz, ixy, ixz, iyz]` in the matrix.
const INERTIA_ORDER: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// A robot imported from a URDF file.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The model, whose chain can be simulated.
    pub model: Model,
    /// Warnings for the engineer, one sentence each.
    pub warnings: Vec<String>,
    /// How far masses may be off that are not the file's, but spread over its links; `None` if there are none.
    pub spread: Option<SpreadAccuracy>,
}

/// How far masses that were spread may be off, one standard deviation each: root mean squares over 20 published arms of six and seven joints,
/// each met by a shape that the others give. Last links are left out, since what counts there is the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpreadAccuracy {
    /// Mass of each link, relative.
    pub mass: f64,
    /// Its moments of inertia beside its mass, as a logarithm: a factor of two.
    pub inertia: f64,
    /// Its centre of mass along each axis, m.
    pub centre_of_mass_m: f64,
}

/// Support of the first driven joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// A ground that does not give way.
    Rigid,
    /// A body that gives way against the ground: base plate, pedestal, frame. It is a fixed joint of the model.
    Pedestal,
}

/// Reads the chain from the root to the link `tcp` out of the text of a URDF file. On a pedestal, what the file has before the first
/// movable joint becomes the pedestal's body.
///
/// # Errors
/// The error names the link or the joint, and the correction.
pub fn import(text: &str, tcp: &str, base: Base) -> Result<Imported, UrdfError> {
    import_with_mass(text, tcp, base, None)
}

/// [`import`] with a mass: where links have no mass, `total_kg`, the mass of the robot by its data sheet, is spread over them.
///
/// # Errors
/// Those of [`import`]; also if there is no link to spread the mass over, or no mass left.
pub fn import_with_mass(
    text: &str,
    tcp: &str,
    base: Base,
    total_kg: Option<f64>,
) -> Result<Imported, UrdfError> {
    let robot = Robot::read(text)?;
    let tree = Tree::new(&robot)?;
    let path = tree.path(tcp)?;
    let mut importer = Importer { tree: &tree, warnings: Vec::new() };

    let mut joints: Vec<ModelJoint> = Vec::new();
    let (mut carried, mut massless, mut borrowing) = (Vec::new(), Vec::new(), Vec::new());
    // Pose of the present link in the frame of the last movable joint.
    let mut pose = Isometry3::identity();
    for (index, joint) in path.iter().enumerate() {
        pose *= joint.origin;
        let Some(kind) = movable(joint)? else { continue };
        let (axis, link) = (axis(joint)?, &joint.child);
        let body = importer.carried(&path[index + 1..], link)?;
        if body.mass <= 0.0 {
            massless.push((link.clone(), joint.name.clone()));
        } else if !tree.has_mass(link) {
            borrowing.push((link.clone(), body.mass));
        }
        let inertia = body.central_inertia();
        carried.push((link.clone(), inertia));
        joints.push(ModelJoint {
            name: joint.name.clone(),
            kind,
            origin_xyz_m: tidy(pose.translation.vector.into()),
            origin_rpy_rad: tidy(pose.rotation.euler_angles().into()),
            axis,
            limits: importer.limits(joint, kind),
            mass_kg: body.mass,
            centre_of_mass_m: tidy(body.centre_of_mass().into()),
            inertia_kg_m2: tidy(INERTIA_ORDER.map(|at| inertia[at])),
        });
        pose = Isometry3::identity();
    }
    if joints.is_empty() {
        return Err(UrdfError::Rigid(tcp.to_owned()));
    }
    let tcp = Tcp {
        name: tcp.to_owned(),
        xyz_m: tidy(pose.translation.vector.into()),
        rpy_rad: tidy(pose.rotation.euler_angles().into()),
    };
    let spread = match total_kg {
        Some(kg) => Some(spread::spread(&mut joints, &tcp, kg).map_err(UrdfError::Spread)?),
        None if massless.is_empty() => None,
        None => return Err(UrdfError::NoMass(massless)),
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
    if spread.is_some() {
        warnings.extend(borrowing.iter().map(|(link, mass)| {
            format!(
                "link '{link}' has no mass of its own, and gets none of --mass: it moves with the {mass:.1} kg of what is fixed to it alone"
            )
        }));
    }
    warnings.extend(doubts(&model).iter().map(Doubt::to_string));
    // Names may hold line breaks.
    let warnings = warnings.iter().map(|warning| one_line(warning)).collect();
    Ok(Imported { model, warnings, spread })
}

/// Why the text of a URDF file cannot be imported without a TCP: the links to choose from, or what is wrong with the file.
pub(crate) fn without_tcp(text: &str) -> UrdfError {
    let links = || {
        let robot = Robot::read(text)?;
        let tree = Tree::new(&robot)?;
        Ok(UrdfError::NoTcp { ends: tree.ends(), links: tree.names() })
    };
    links().unwrap_or_else(|fault| fault)
}

/// Signs that a checked model is not that of the robot. The pedestal is left out.
pub(crate) fn doubts(model: &Model) -> Vec<Doubt> {
    let moving = Model { joints: model.driven().cloned().collect(), ..model.clone() };
    moving.chain().map_or_else(|_| Vec::new(), |chain| plausibility::doubts(&chain, &moving))
}

/// The doubts about a checked model, but for what is right for some robots: one sentence each.
pub(crate) fn warnings(model: &Model) -> Vec<String> {
    let doubts = doubts(model).into_iter().filter(|doubt| !doubt.is_choice);
    doubts.map(|doubt| doubt.to_string()).collect()
}

/// Collects the bodies that the chain carries, and the warnings.
struct Importer<'a> {
    tree: &'a Tree<'a>,
    warnings: Vec<String>,
}

impl Importer<'_> {
    /// The body that moves with the joint above `link`, in that link's frame: the links up to the next
    /// movable joint of `chain`, and every side branch.
    fn carried(&mut self, chain: &[&Joint], link: &str) -> Result<Body, UrdfError> {
        let mut body = Body::default();
        let mut impossible = Vec::new();
        let mut open = vec![(link.to_owned(), Isometry3::identity(), None::<String>)];
        while let Some((link, pose, branch)) = open.pop() {
            let (own, moments) = self.body(&link, &pose)?;
            if own.mass > 0.0
                && let Some(branch) = branch.as_ref()
            {
                self.warnings.push(format!(
                    "link '{link}' ({} kg) hangs beside the chain on '{branch}': lumped in rigidly",
                    own.mass
                ));
            }
            if inertia_excess(moments) > INERTIA_TOLERANCE * moments[2] {
                impossible.push((link.clone(), moments));
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
                open.push((joint.child.clone(), pose * joint.origin, branch));
            }
        }
        // What matters is the body as a whole: frames of no size are given any inertia.
        let largest = principal_moments(&body.central_inertia())[2];
        for (link, moments) in impossible {
            if inertia_excess(moments) > INERTIA_TOLERANCE * largest {
                return Err(UrdfError::Inertia { link, moments });
            }
            self.warnings.push(format!(
                "the inertia of link '{link}' belongs to no body (principal moments {} kg m²), and is too small to matter: lumped in",
                shown(&moments)
            ));
        }
        Ok(body)
    }

    /// The pedestal, with the name of the root and the inertia of what hangs on it up to the first movable joint.
    fn pedestal(
        &mut self,
        path: &[&Joint],
        moving_kg: f64,
    ) -> Result<(ModelJoint, String, Matrix3<f64>), UrdfError> {
        let root = path.first().map(|joint| joint.parent.clone()).unwrap_or_default();
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

    /// The body of one link alone, and its principal moments, ascending, kg m²; `pose` is the pose of the link in the frame of the result.
    fn body(&mut self, name: &str, pose: &Isometry3<f64>) -> Result<(Body, [f64; 3]), UrdfError> {
        let inertial = self.tree.link(name).and_then(|link| link.inertial.as_ref());
        let Some(&Inertial { mass, ref centre, ref inertia }) = inertial else {
            return Ok(Default::default());
        };
        if !(0.0..=HEAVIEST_KG).contains(&mass) {
            return Err(UrdfError::Mass { link: name.to_owned(), mass });
        }
        if mass == 0.0 {
            if *inertia != Matrix3::zeros() {
                self.warnings.push(format!("link '{name}' has inertia but no mass: ignored"));
            }
            return Ok(Default::default());
        }
        Ok((Body::new(mass, &(pose * centre), inertia), principal_moments(inertia)))
    }

    /// The joint's limits, infinite where the file has none.
    fn limits(&mut self, joint: &Joint, kind: Kind) -> [f64; 2] {
        let Joint { name, limits, .. } = joint;
        let is_continuous = joint.kind == CONTINUOUS;
        match *limits {
            Some([lower, upper]) if lower < upper => {
                if is_continuous && (lower.is_finite() || upper.is_finite()) {
                    self.warnings.push(format!(
                        "joint '{name}' is continuous, and its <limit> says {lower} to {upper} rad: taken as its limits"
                    ));
                }
                return [lower, upper];
            }
            // A `<limit>` without lower and upper limits speed and effort.
            None | Some([0.0, 0.0]) if is_continuous => {}
            _ => {
                let unit = if kind == Kind::Prismatic { "m" } else { "rad" };
                let given = match limits {
                    Some([lower, upper]) => format!(" ({lower} to {upper} {unit})"),
                    None => String::new(),
                };
                self.warnings
                    .push(format!("joint '{name}' has no usable <limit>{given}: left open"));
            }
        }
        [-f64::INFINITY, f64::INFINITY]
    }
}

/// The type of a joint that turns without end.
const CONTINUOUS: &str = "continuous";

/// The kind of a movable joint; `None` for a fixed joint.
fn movable(joint: &Joint) -> Result<Option<Kind>, UrdfError> {
    match joint.kind.as_str() {
        document::FIXED => Ok(None),
        "revolute" | CONTINUOUS => Ok(Some(Kind::Revolute)),
        "prismatic" => Ok(Some(Kind::Prismatic)),
        other => Err(UrdfError::JointType { joint: joint.name.clone(), kind: other.to_owned() }),
    }
}

/// The axis of a joint with a drive of its own, of length 1.
fn axis(joint: &Joint) -> Result<[f64; 3], UrdfError> {
    if let Some(leader) = &joint.leader {
        return Err(UrdfError::Mimic { joint: joint.name.clone(), leader: leader.clone() });
    }
    match Unit::try_new(joint.axis, 1e-9) {
        Some(axis) => Ok(axis.into_inner().into()),
        None => Err(UrdfError::ZeroAxis(joint.name.clone())),
    }
}

/// Principal moments of an inertia, ascending.
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
