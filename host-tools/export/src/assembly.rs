//! The robot at its pose: frames, links, bushings, elongations at rest.

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::chain::{Chain, Joint, Link, inertia_excess};
use flexid_core::imperfection::Imperfection;
use flexid_core::parameters::Bushing;
use flexid_core::refine::{Mechanics, Places};
use flexid_pipeline::names::DOF_NAMES;
use flexid_wire::report::{JointReport, Verdict};
use flexid_wire::text::{Name, clipped};
use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::text::{numbers, one_line};
use crate::{ExportError, Robot, imperfect, remark};

/// Relative distance of a principal moment from the sum of the two others within which the moments are raised. A model may
/// exceed the sum because its file rounds. Other programs refuse any excess, or replace the inertia.
const ROUNDING: f64 = 1e-9;

/// A link, its bushing, and the drive that carries the bushing.
pub(crate) struct Body<'a> {
    /// Name of the joint, in one line.
    pub(crate) name: String,
    /// Pose of the joint frame, with the drive locked at its angle, in the joint frame before or in the base.
    pub(crate) frame: Isometry3<f64>,
    /// The link in the joint frame.
    pub(crate) link: Link,
    /// The bushing, with what its drive and hysteresis add. A stiffness is infinite where the ground is rigid.
    pub(crate) bushing: Bushing,
    /// Values and verdicts of the bushing; `None` of the ground, which is no joint of the robot.
    pub(crate) report: Option<&'a JointReport>,
    /// Elongation of the bushing at rest under gravity, m and rad; `None` if the robot does not come to rest.
    pub(crate) sag: Option<[f64; 6]>,
    /// Lines on what differs from the model or is not identified.
    pub(crate) remarks: Vec<String>,
}

/// A robot at its pose, checked.
pub(crate) struct Assembly<'a> {
    /// Name of the robot, in one line.
    pub(crate) name: String,
    /// Bodies, base first.
    pub(crate) bodies: Vec<Body<'a>>,
    /// Pose of the TCP in the last joint frame.
    pub(crate) tcp: Isometry3<f64>,
    /// Gravity along the axes of the base, m/s².
    pub(crate) gravity: [f64; 3],
    /// Lines for the head of a file.
    pub(crate) heading: Vec<String>,
}

impl Body<'_> {
    /// Stiffnesses, all finite.
    pub(crate) fn finite_stiffness(&self) -> [f64; 6] {
        self.bushing.stiffness.map(|own| if own.is_finite() { own } else { 1.0 / imperfect::RIGID })
    }

    /// Degrees of freedom in which the bushing gives way.
    pub(crate) fn dofs(&self) -> impl Iterator<Item = usize> {
        (0..6).filter(|dof| self.bushing.stiffness[*dof].is_finite())
    }
}

impl<'a> Assembly<'a> {
    /// Checks the robot and places its bodies.
    pub(crate) fn new(robot: &Robot<'a>) -> Result<Self, ExportError> {
        let chain = robot.model.chain()?;
        check(robot, &chain)?;
        let Places { chain, pose, base_mass } =
            Mechanics::places(&chain, robot.pose, robot.imperfections).map_err(|_| {
                ExportError::AngleCount { angles: robot.pose.len(), driven: chain.driven() }
            })?;
        let bushings = imperfect::bushings(robot)?;
        let gravity = Vector3::from(robot.gravity_m_per_s2);
        let rest = chain.linearise(&pose, gravity, &bushings);
        let sag = |index: usize| rest.as_ref().ok().map(|linear| linear.joints[index].sag.into());
        let places = chain.joints().iter().zip(chain.angles(&pose));
        let mut bodies: Vec<Body> = places
            .zip(robot.joints)
            .enumerate()
            .map(|(index, ((joint, angle), report))| {
                let mut remarks = Vec::new();
                Body {
                    name: one_line(&robot.model.joints[index].name),
                    frame: joint.frame(angle),
                    link: admissible(joint, &mut remarks),
                    bushing: bushings[index],
                    report: Some(report),
                    sag: sag(index),
                    remarks,
                }
            })
            .collect();
        if let Some(ground) = imperfect::ground(robot, &bodies, base_mass, gravity) {
            bodies.insert(0, ground);
        }
        Ok(Self {
            name: one_line(&robot.model.name),
            heading: heading(robot, rest.err()),
            bodies,
            tcp: *chain.tcp(),
            gravity: robot.gravity_m_per_s2,
        })
    }
}

/// Checks that the parts of the robot are numbers, and of one robot.
pub(crate) fn check(robot: &Robot, chain: &Chain) -> Result<(), ExportError> {
    let (fit, model) = (robot.joints.len(), robot.model.joints.len());
    if fit != model {
        return Err(ExportError::JointCount { fit, model });
    }
    for (report, joint) in robot.joints.iter().zip(&robot.model.joints) {
        let name: Name = clipped(&joint.name);
        if report.name != name {
            let (fit, model) = (report.name.to_string(), joint.name.clone());
            return Err(ExportError::JointName { fit, model });
        }
        for kind in remark::kinds(report) {
            let is_wrong = |value: &f64| !(value.is_finite() && *value >= 0.0);
            if let Some(dof) = kind.values.iter().position(is_wrong) {
                let (joint, value) = (joint.name.clone(), kind.values[dof]);
                let (kind, dof) = (kind.name, DOF_NAMES[dof]);
                return Err(ExportError::Parameter { joint, kind, dof, value });
            }
        }
    }
    let (angles, driven) = (robot.pose.len(), chain.driven());
    if angles != driven {
        return Err(ExportError::AngleCount { angles, driven });
    }
    let is_right = |(own, value): &(Imperfection, f64)| {
        own.is_of(chain) && value.is_finite() && !(own.is_positive() && *value < 0.0)
    };
    if let Some(wrong) = robot.imperfections.iter().position(|own| !is_right(own)) {
        return Err(ExportError::Imperfection(wrong));
    }
    if !robot.pose.iter().all(|angle| angle.is_finite()) {
        return Err(ExportError::NotFinite("pose"));
    }
    if !robot.gravity_m_per_s2.iter().all(|g| g.is_finite()) {
        return Err(ExportError::NotFinite("gravity"));
    }
    Ok(())
}

/// Returns the link of a joint with principal moments of which none exceeds the sum of the two others.
fn admissible(joint: &Joint, remarks: &mut Vec<String>) -> Link {
    let moments = joint.link.inertia.symmetric_eigenvalues();
    let excess = inertia_excess(moments.into());
    let margin = ROUNDING * moments.max();
    if excess < -margin {
        return joint.link;
    }
    let raise = excess + 2.0 * margin;
    remarks.push(format!(
        "the moments of inertia are {raise:.1e} kg m^2 larger than in the model: there one exceeds the sum of the two others, \
         or equals it"
    ));
    Link { inertia: joint.link.inertia + Matrix3::identity() * raise, ..joint.link }
}

fn heading(robot: &Robot, error: Option<LinearisationError>) -> Vec<String> {
    let verdicts = robot.joints.iter().flat_map(remark::kinds).flat_map(|kind| *kind.verdicts);
    let open = verdicts.filter(|&verdict| verdict != Verdict::Identified).count();
    let mut lines = vec![
        format!("{}: a robot whose joints give way, identified by flexid.", robot.model.name),
        format!("Verdict on the fit: {}", robot.verdict),
        format!(
            "{open} of {} parameters are not identified. A comment marks each of them.",
            12 * robot.joints.len()
        ),
        format!(
            "The drives are locked at the pose [{}] (rad or m).",
            numbers(robot.pose.iter().copied(), ", ")
        ),
        "SI units, angles in rad. A bushing has slides along x, y and z of the joint frame, then turns about x, the new y and \
         the new z. Its springs are relaxed at 0, and the robot sags under gravity."
            .to_string(),
    ];
    lines.extend(imperfect::heading(robot, error.is_none()));
    lines.extend(error.map(|error| format!("No equilibrium is known with these values: {error}.")));
    lines.iter().map(|line| one_line(line)).collect()
}
