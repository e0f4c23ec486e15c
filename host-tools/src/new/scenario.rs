//! The scenario: a plausible robot, and cuts like those of the shipped scenarios.

use std::fmt::Write as _;

use flexid_core::chain::{Chain, Joint};
use flexid_core::parameters::Bushing;
use flexid_pipeline::model::Model;
use flexid_simulation::plausible;

use super::{MODEL, quoted};
use crate::place::tool;

/// Largest steady turn of a drive under the force of a tooth at the end of the stretched arm, rad. The shipped scenario of six joints has a
/// third of it. There at four times the force the robot swings so far that its geometry changes, by more than the noise.
const TURN: f64 = 3e-4;
/// Least force of a tooth, N. Less than a newton is taken for a force in kN.
const LEAST_FORCE_N: f64 = 5.0;
/// Amplitude density of the force sensor's noise over that force, 1/√Hz, as in the shipped scenario of six joints.
const FORCE_NOISE: f64 = 5e-5;
/// Spindle speeds and feeds of the cuts, one after the other: those of the shipped scenarios.
const CUTS: [(&str, [u32; 2], &str); 3] =
    [("slot", [600, 4200], "x"), ("face", [900, 5400], "y"), ("plunge", [600, 3000], "z")];

/// The scenario of a `robot`, one bushing per joint of `model`, with a cut in each of `poses` by a tooth of `force`, N.
pub(super) fn text(
    model: &Model,
    chain: &Chain,
    robot: &[Bushing],
    force: f64,
    poses: &[Vec<f64>],
) -> String {
    let mut text = format!(
        "# A plausible robot and its cuts, for `flexid simulate`, `plan` and `identify --truth`: nothing of it is known of the real one.\n\
         # Joint-frame DOF order everywhere: tx ty tz rx ry rz (translation first, then rotation about the joint frame's own x, y, z).\n\
         robot = {}\n\
         tcp = {}\n\n\
         # Drawn: each drive with a natural frequency of {} to {} Hz with what it carries, its bearing 5 to 9 times stiffer against tilting and stiffer\n\
         # yet along its axes, all damped by {} to {} % there. `flexid simulate --truth drawn:2` draws another. N/m, Nm/rad; Ns/m, Nms/rad.\n",
        quoted(MODEL),
        quoted(&model.tcp.name),
        plausible::DRIVE_HZ[0],
        plausible::DRIVE_HZ[1],
        100.0 * plausible::DAMPING_RATIO[0],
        100.0 * plausible::DAMPING_RATIO[1],
    );
    for (joint, bushing) in model.joints.iter().zip(robot) {
        let numbers = |numbers: [f64; 6]| numbers.map(|number| format!("{number:.2e}")).join(", ");
        // Nothing fails where text grows.
        let _ = write!(
            text,
            "[[truth]]\njoint = {}\nstiffness = [{}]\ndamping   = [{}]\n",
            quoted(&joint.name),
            numbers(bushing.stiffness),
            numbers(bushing.damping)
        );
    }
    text += "\n# Experiments: joint angles in rad (m), spindle run in rpm, feed direction in the TCP frame. The names say where the tool is in the base, m.\n";
    for (pose, (cut, [from, to], feed)) in poses.iter().zip(CUTS.into_iter().cycle()) {
        let at = tool(chain, pose);
        let _ = write!(
            text,
            "[[experiment]]\nname = \"{cut}, tool at {:.2} {:.2} {:.2}\"\npose = {pose:?}\nspindle_rpm = [{from}, {to}]\nfeed = \"{feed}\"\n",
            at.x, at.y, at.z
        );
    }
    let _ = write!(
        text,
        "\n# Two-flute cutter, quarter immersion, peak tangential force per tooth, radial 0.4, axial 0.3; 5 % broadband roughness. The cut is light, so\n\
         # that the robot stays linear.\n\
         [force]\nteeth = 2\nimmersion_deg = 90\npeak_tangential_n = {force}\nradial_ratio = 0.4\naxial_ratio = 0.3\nroughness = 0.05\n\n\
         # rate_hz as in edge.toml\n\
         [measurement]\nrate_hz = 2000.0\nduration_s = 4.096\nband_hz = [2.0, 200.0]\n\
         acceleration_noise_g_per_sqrt_hz = 5.0e-5\nforce_noise_n_per_sqrt_hz = {:e}\n",
        FORCE_NOISE * force
    );
    text
}

/// Force of a tooth that turns no drive by more than [`TURN`], with one digit, N.
pub(super) fn force(chain: &Chain, robot: &[Bushing]) -> f64 {
    let next = chain.joints().iter().skip(1).map(|joint| &joint.origin).chain([chain.tcp()]);
    let lengths: Vec<f64> = next.map(|pose| pose.translation.vector.norm()).collect();
    let bears = |(index, (joint, bushing)): (usize, (&Joint, &Bushing))| match joint.drive() {
        Some(drive) if drive >= 3 => {
            TURN * bushing.stiffness[drive] / lengths[index..].iter().sum::<f64>()
        }
        _ => f64::INFINITY,
    };
    let least = chain.joints().iter().zip(robot).enumerate().map(bears).fold(1e3, f64::min);
    let force = least.max(LEAST_FORCE_N);
    format!("{force:.0e}").parse().unwrap_or(force)
}
