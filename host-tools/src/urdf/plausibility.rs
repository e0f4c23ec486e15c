//! Signs that a model is not that of a milling robot: masses that were never measured (placeholders, wrong units, wrong frames), no tool.
//!
//! They are warnings, since a real robot can have unusual masses.

use flexid_core::chain::{Chain, Joint};
use nalgebra::Matrix3;

/// Range of the density of a machine's links, kg/m³, from sheet metal around air to solid lead.
const DENSITY: [f64; 2] = [50.0, 12_000.0];
/// Range of the moving mass over the reach squared, kg/m². Arms on the market lie between 15 and 200.
const MASS_PER_REACH_SQUARED: [f64; 2] = [5.0, 250.0];
/// A centre of mass or a radius of gyration beyond this many link lengths plus [`SLACK_M`] gives a warning.
const LINK_LENGTHS: f64 = 1.5;
/// Length by which motors and counterweights may stand out of short links, m.
const SLACK_M: f64 = 0.25;
/// Mass of the lightest spindle with its clamp and a tool, kg: router spindles of 1 kW weigh 1.7 kg.
const SPINDLE_KG: f64 = 2.0;
/// Names of the link at the flange, without any tool: those of ROS-Industrial and of REP 199.
const FLANGES: [&str; 2] = ["tool0", "flange"];
/// Distance of the TCP from the last joint below which turning that joint hardly moves it, m. A tool is ten times as long.
const TOOL_M: f64 = 0.01;

/// Warnings about the chain; `names` are the names of its joints, `tip` is that of the link at its TCP.
pub(super) fn warnings(chain: &Chain, names: &[&str], tip: &str) -> Vec<String> {
    let joints = chain.joints();
    let mut warnings = Vec::new();

    let first = joints[0].link.mass;
    let is_many = joints.len() > 2 || first == 1.0;
    if is_many && joints.iter().all(|joint| joint.link.mass == first) {
        warnings.push(format!("every moving link weighs {first} kg: are these placeholders?"));
    }

    let inertia = joints[0].link.inertia;
    if joints.len() > 2 && joints.iter().all(|joint| joint.link.inertia == inertia) {
        warnings.push("every moving link has the same inertia: are these placeholders?".to_owned());
    }

    // Distance from each joint to the next, and from the last one to the TCP.
    let lengths: Vec<f64> = joints[1..]
        .iter()
        .map(|joint| joint.origin.translation.vector.norm())
        .chain([chain.tcp().translation.vector.norm()])
        .collect();
    let reach: f64 = lengths.iter().sum();
    let mass: f64 = joints.iter().map(|joint| joint.link.mass).sum();
    let [least, most] = MASS_PER_REACH_SQUARED.map(|ratio| ratio * reach * reach);
    if !(least..=most).contains(&mass) {
        warnings.push(format!(
            "{mass:.0} kg of moving mass does not fit a reach of {reach:.2} m \
             (usual: {least:.0} to {most:.0} kg)"
        ));
    }

    let (last, name) = (joints.len() - 1, names[joints.len() - 1]);
    let mend = "add a link for spindle, sensor and tool, up to its tip";
    if lengths[last] < TOOL_M {
        warnings.push(format!(
            "the TCP lies at joint '{name}', so that no cut shows how that joint turns: {mend}"
        ));
    } else if joints[last].link.mass < SPINDLE_KG {
        let mass = joints[last].link.mass;
        warnings.push(format!("the link on joint '{name}' weighs {mass:.1} kg: {mend}"));
    } else if FLANGES.contains(&tip) {
        warnings.push(format!("the TCP '{tip}' is by its name the flange, without a tool: {mend}"));
    }

    for ((joint, name), &length) in joints.iter().zip(names).zip(&lengths) {
        let limit = LINK_LENGTHS * length + SLACK_M;
        let distance = joint.link.centre_of_mass.norm();
        if distance > limit {
            warnings.push(format!(
                "the centre of mass of the link on joint '{name}' lies {distance:.2} m from the joint, \
                 though the link is {length:.2} m long"
            ));
        }
        let moments = joint.link.inertia.symmetric_eigenvalues();
        let gyration = (moments.max() / joint.link.mass).sqrt();
        if gyration > limit {
            warnings.push(format!(
                "the inertia of the link on joint '{name}' is that of a body with a radius of gyration \
                 of {gyration:.2} m, though the link is {length:.2} m long"
            ));
        }
        if joint.link.inertia == Matrix3::identity() {
            warnings.push(format!(
                "the link on joint '{name}' has an inertia of 1 kg m² about each axis: is this a placeholder?"
            ));
        }
        let density = density(joint);
        if !(DENSITY[0]..=DENSITY[1]).contains(&density) {
            warnings.push(format!(
                "mass and inertia of the link on joint '{name}' make a density of {density:.0} kg/m³"
            ));
        }
    }
    warnings
}

/// Density of the solid ellipsoid that has the link's mass and inertia, kg/m³.
fn density(joint: &Joint) -> f64 {
    let link = &joint.link;
    let moments = link.inertia.symmetric_eigenvalues();
    let half_trace = 0.5 * moments.sum();
    let semi_axes = moments.map(|moment| (5.0 * (half_trace - moment) / link.mass).max(0.0).sqrt());
    link.mass / (4.0 / 3.0 * std::f64::consts::PI * semi_axes.product())
}
