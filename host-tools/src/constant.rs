//! The error of an export: how far the modes of a robot with constant springs and dampers, and without hoses, lie from those of the robot
//! that was found.

use flexid_core::imperfection::{Group, Imperfection};
use flexid_export::{ExportError, Robot, bushings};
use flexid_pipeline::robot::FoundRobot;
use flexid_prediction::Robot as Predicted;
use flexid_prediction::document::Found;
use flexid_prediction::modes::Mode;

/// Relative difference of a natural frequency that is not worth a line. Chosen: a tenth of a per cent, as an export is right to.
const SAME: f64 = 1e-3;
/// Such a difference of a damping ratio. Chosen: the standard deviation of one that is well identified.
const DAMPED_ALIKE: f64 = 0.02;

/// A line on how far they lie from each other. `None` if they are the same.
///
/// # Errors
/// Those of an export.
pub(crate) fn differences(found: &Found, exported: &Robot) -> Result<Option<String>, ExportError> {
    let whole = found.robot.found();
    let imperfections: Vec<_> =
        whole.imperfections.iter().filter(|own| !is_left_out(own.imperfection)).copied().collect();
    let size = 12 * whole.model.joints.len() + imperfections.len();
    let constant =
        FoundRobot { imperfections, covariance: vec![0.0; size * (size + 1) / 2], ..whole.clone() };
    let Ok(constant) = Predicted::new(constant, bushings(exported)?) else { return Ok(None) };
    let [_, upper] = found.robot.band_hz();
    let modes =
        |robot: &Predicted| robot.at(exported.pose).map(|at| at.modes(upper)).unwrap_or_default();
    let (own, theirs) = (modes(&found.robot), modes(&constant));
    let off = farthest(&own, &theirs, |mode| mode.frequency_hz.value);
    let damped = farthest(&own, &theirs, |mode| mode.damping_ratio.value);
    if (off.times - 1.0).abs() < SAME && (damped.times - 1.0).abs() < DAMPED_ALIKE {
        return Ok(None);
    }
    Ok(Some(format!(
        "natural frequencies up to {upper} Hz are up to {:.1} % off those of flexid (the mode at {:.1} Hz), and damping ratios up to {:.2} times as \
         large (the mode at {:.1} Hz; they are right at {:.1} Hz): the fit has \
         found springs and dampers that change with frequency, or hoses, which the file does not carry",
        100.0 * (off.times - 1.0).abs(),
        off.of_hz,
        damped.times,
        damped.of_hz,
        exported.at_hz
    )))
}

/// Returns whether an imperfection is in the constant bushings already, or in no format.
fn is_left_out(imperfection: Imperfection) -> bool {
    matches!(imperfection.facts().group, Group::Impedance | Group::Hose | Group::Record)
}

/// How far a number of a mode is off.
struct Off {
    /// Times as large.
    times: f64,
    /// Natural frequency of the mode, Hz.
    of_hz: f64,
}

/// A number of the mode with the nearest natural frequency to that of each mode, where the two are farthest apart, by their ratio.
fn farthest(own: &[Mode], theirs: &[Mode], of: fn(&Mode) -> f64) -> Off {
    let nearest = |own: &Mode| {
        let off = |theirs: &Mode| (theirs.frequency_hz.value / own.frequency_hz.value).ln().abs();
        theirs.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let all = own.iter().filter_map(|own| {
        Some(Off { times: of(nearest(own)?) / of(own), of_hz: own.frequency_hz.value })
    });
    let size = |off: &Off| off.times.ln().abs();
    all.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(Off { times: 1.0, of_hz: 0.0 })
}
