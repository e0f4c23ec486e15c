//! The robot at its pose: frames, links, bushings, elongations at rest.

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::chain::{Joint, Link, inertia_excess};
use flexid_core::refine::{Mechanics, Places};
use flexid_wire::report::Verdict;
use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::body::Body;
use crate::error::ExportError;
use crate::robot::{Robot, check};
use crate::text::{numbers, one_line};
use crate::{imperfect, remark};

/// Relative distance of a principal moment from the sum of the two others within which the moments are raised. A model may
/// exceed the sum because its file rounds. Other programs refuse any excess, or replace the inertia.
const ROUNDING: f64 = 1e-9;

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
