//! Signs that a model is not that of a milling robot: masses that were never measured (placeholders, wrong units, wrong frames), limits in
//! degrees, no tool.
//!
//! They are doubts, since a real robot can have unusual masses.

use std::f64::consts::PI;
use std::fmt;

use flexid_core::chain::{Chain, INERTIA_TOLERANCE, Joint};
use flexid_pipeline::model::{Kind, Model, ModelJoint};
use nalgebra::{Matrix3, Vector3};

/// Range of the density of a machine's links, kg/m³, from sheet metal around air to solid lead.
const DENSITY: [f64; 2] = [50.0, 12_000.0];
/// Range of the moving mass over the reach squared, kg/m². Arms on the market lie between 15 and 200.
const MASS_PER_REACH_SQUARED: [f64; 2] = [5.0, 250.0];
/// A centre of mass beyond this many link lengths plus [`SLACK_M`] gives a doubt.
const LINK_LENGTHS: f64 = 1.5;
/// Length by which motors and counterweights may stand out of short links, m.
const SLACK_M: f64 = 0.25;
/// Part of the reach by which a link is thick, or stands out at either end. Chosen: castings of the arms in the tests are about a tenth of the reach
/// wide, and a doubt that is wrong costs a look at the data sheet.
const THICKNESS: f64 = 0.1;
/// Mass of the lightest spindle with its clamp and a tool, kg: router spindles of 1 kW weigh 1.7 kg.
const SPINDLE_KG: f64 = 2.0;
/// Names of the link at the flange, without any tool: those of ROS-Industrial and of REP 199.
const FLANGES: [&str; 2] = ["tool0", "flange"];
/// Distance of the TCP from the last joint, or from its axis, below which turning that joint hardly moves it, m. A tool is ten times as long.
const TOOL_M: f64 = 0.01;
/// Angle from 0 that hardly any joint reaches, rad: two turns tear the cables of all axes but some last ones.
const TWO_TURNS: f64 = 4.0 * PI;

const MASSES: &str = "compare masses and inertias with the robot's data sheet";
const TOOL: &str = "add a link for spindle, sensor and tool, up to its tip";

/// A doubt about a model, and what to do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Doubt {
    pub(crate) finding: String,
    pub(crate) mend: &'static str,
    /// A robot may be built so: it costs something, and nothing is wrong.
    pub(crate) is_choice: bool,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.finding, self.mend)
    }
}

impl Doubt {
    fn new(finding: String, mend: &'static str) -> Self {
        Self { finding, mend, is_choice: false }
    }
}

/// Names the joints whose limits are those of no robot in rad. Their angles are not known to lie within their limits.
pub(crate) fn limits_in_degrees(model: &Model) -> Option<Doubt> {
    let is_beyond = |limit: f64| limit.is_finite() && limit.abs() > TWO_TURNS;
    let joints = model.driven().filter(|joint| joint.kind == Kind::Revolute);
    let names: Vec<String> = joints
        .filter(|joint| joint.limits.into_iter().any(is_beyond))
        .map(|joint| {
            let [lower, upper] = joint.limits;
            format!("'{}' ({lower} to {upper} rad)", joint.name)
        })
        .collect();
    let finding =
        format!("limits beyond two turns (±12.57 rad) on joint {}: in degrees?", names.join(", "));
    let mend = "limits of turning joints are in rad: divide degrees by 57.2958";
    (!names.is_empty()).then(|| Doubt::new(finding, mend))
}

/// Doubts about the `chain` of a `model` whose joints are all driven.
pub(super) fn doubts(chain: &Chain, model: &Model) -> Vec<Doubt> {
    let mut doubts: Vec<Doubt> = limits_in_degrees(model).into_iter().collect();
    doubts.extend(of_masses(chain, model).into_iter().map(|finding| Doubt::new(finding, MASSES)));
    doubts.extend(of_tool(chain, model));
    doubts
}

/// Doubts about the TCP and what stands there.
fn of_tool(chain: &Chain, model: &Model) -> Option<Doubt> {
    let (last, name) = (chain.joints().last()?, &model.joints.last()?.name);
    let tip = chain.tcp().translation.vector;
    let off_axis = tip - last.axis.dot(&tip) * last.axis.into_inner();
    let is_on_axis = model.joints.last()?.kind == Kind::Revolute && off_axis.norm() < TOOL_M;
    let finding = if tip.norm() < TOOL_M {
        format!("the TCP lies at joint '{name}', so that a cut has no lever to turn that joint")
    } else if last.link.mass < SPINDLE_KG {
        format!("the link on joint '{name}' weighs {:.1} kg", last.link.mass)
    } else if FLANGES.contains(&model.tcp.name.as_str()) {
        format!("the TCP '{}' is by its name the flange, without a tool", model.tcp.name)
    } else if is_on_axis {
        return Some(Doubt {
            finding: format!(
                "the TCP lies on the axis of joint '{name}', so that a cut has no lever to turn that joint about it"
            ),
            mend: "right for a straight spindle, whose turning stiffness a torque in a static test shows",
            is_choice: true,
        });
    } else {
        return None;
    };
    Some(Doubt::new(finding, TOOL))
}

/// Doubts about masses and inertias.
fn of_masses(chain: &Chain, model: &Model) -> Vec<String> {
    let joints = chain.joints();
    let mut doubts = Vec::new();

    let first = joints[0].link.mass;
    let is_many = joints.len() > 2 || first == 1.0;
    if is_many && joints.iter().all(|joint| joint.link.mass == first) {
        doubts.push(format!("every moving link weighs {first} kg: are these placeholders?"));
    }

    let inertia = joints[0].link.inertia;
    if joints.len() > 2 && joints.iter().all(|joint| joint.link.inertia == inertia) {
        doubts.push("every moving link has the same inertia: are these placeholders?".to_owned());
    }

    // Distance from each joint to the next, and from the last one to the TCP.
    let next = joints[1..].iter().map(|joint| joint.origin.translation.vector.norm());
    let distances: Vec<f64> = next.chain([chain.tcp().translation.vector.norm()]).collect();
    let reach: f64 = distances.iter().sum();
    let mass: f64 = joints.iter().map(|joint| joint.link.mass).sum();
    let [least, most] = MASS_PER_REACH_SQUARED.map(|ratio| ratio * reach * reach);
    if !(least..=most).contains(&mass) {
        doubts.push(format!(
            "{mass:.0} kg of moving mass does not fit a reach of {reach:.2} m \
             (usual: {least:.0} to {most:.0} kg)"
        ));
    }

    for ((joint, ModelJoint { name, .. }), distance) in
        joints.iter().zip(&model.joints).zip(distances)
    {
        let length = distance + back(joint);
        let centre = joint.link.centre_of_mass.norm();
        if centre > LINK_LENGTHS * length + SLACK_M {
            doubts.push(format!(
                "the centre of mass of the link on joint '{name}' lies {centre:.2} m from the joint, \
                 though the link is {length:.2} m long"
            ));
        }
        // No distribution within a length scatters by more than half of it: then half of the mass lies at either end (Popoviciu).
        let longest = semi_axes(joint, 0.0).max();
        let scatter = longest / 5_f64.sqrt();
        if scatter > 0.5 * length + THICKNESS * reach {
            doubts.push(format!(
                "the inertia of the link on joint '{name}' is that of a solid ellipsoid of {:.2} m, though the link is {length:.2} m long",
                2.0 * longest
            ));
        }
        if joint.link.inertia == Matrix3::identity() {
            doubts.push(format!(
                "the link on joint '{name}' has an inertia of 1 kg m² about each axis: is this a placeholder?"
            ));
        }
        if let Some(density) = odd_density(joint) {
            doubts.push(format!(
                "mass and inertia of the link on joint '{name}' make a density of {density:.0} kg/m³"
            ));
        }
    }
    doubts
}

/// How far the link of a joint may lie behind the joint's origin, m. The origin is any point of the joint's axis, and the bearing is on the
/// axis up to where the joint before is nearest: the forearm of a robot turns about its length, and its origin is often the wrist.
fn back(joint: &Joint) -> f64 {
    let before = joint.origin.inverse().translation.vector;
    joint.axis.dot(&before).abs()
}

/// Semi-axes of the solid ellipsoid that has the link's mass and inertia, m, none thinner than that of a moment of this part of the largest.
fn semi_axes(joint: &Joint, least: f64) -> Vector3<f64> {
    let link = &joint.link;
    let moments = link.inertia.symmetric_eigenvalues();
    let (half_trace, least) = (0.5 * moments.sum(), 0.5 * least * moments.max());
    moments.map(|moment| (5.0 * (half_trace - moment).max(least) / link.mass).sqrt())
}

/// Density of the solid ellipsoid that has the link's mass and inertia, if it is that of no machine, kg/m³. An inertia is known within its
/// tolerance, and that of a flat body, rounded, leaves it no thickness.
fn odd_density(joint: &Joint) -> Option<f64> {
    let [most, least] = [0.0, INERTIA_TOLERANCE].map(|tolerance| {
        joint.link.mass / (4.0 / 3.0 * PI * semi_axes(joint, tolerance).product())
    });
    let odd = if least > DENSITY[1] { least } else { most };
    (least > DENSITY[1] || most < DENSITY[0]).then_some(odd)
}
