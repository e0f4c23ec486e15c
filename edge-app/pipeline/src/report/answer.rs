//! The answer of a finding: the robot as a whole at the pose of its newest record.

use flexid_core::chain::Chain;
use flexid_core::identify::Estimate;
use flexid_core::parameters::Bushing;
use flexid_core::verdict::WEAK;
use flexid_wire::answer::{Answer, Drive, LowestMode, Number, ToolStiffness};
use flexid_wire::confidence::{Confidence, JointIntervals};
use flexid_wire::report::{JointReport, Report, Verdict};

use super::residuals::Residuals;
use crate::dynamics::statics::PrincipalCompliance;
use crate::dynamics::{Dynamics, PositiveEstimate, Robot};
use crate::robot::FoundRobot;

/// The place at which an answer holds.
pub(crate) struct Place<'a> {
    /// Joint angles, rad (m).
    pub(crate) pose: &'a [f64],
    /// Number of the record of this pose; `None` of a static test.
    pub(crate) record: Option<u64>,
}

/// True if the fit allows intervals.
#[derive(Clone, Copy)]
struct Allowed(bool);

/// Makes the answer of an estimate, of which these are the robot, the report and the confidence. Returns `None` if the robot does not stand
/// at the pose.
pub(crate) fn answer(
    robot: FoundRobot,
    estimate: &Estimate,
    report: &Report,
    confidence: &Confidence,
    place: Place<'_>,
) -> Option<Answer> {
    // Residuals that are no response to the force decide on no interval.
    let allowed = Allowed(Residuals::of(estimate, None).allow_intervals());
    let bushing =
        |joint: &JointReport| Bushing { stiffness: joint.stiffness, damping: joint.damping };
    let robot = Robot::new(robot, report.joints.iter().map(bushing).collect()).ok()?;
    let at = robot.at(place.pose).ok()?;
    let [softest, _, stiffest] = at.principal(&at.compliance()?);
    Some(Answer {
        pose: place.pose.iter().copied().collect(),
        record: place.record,
        softest: allowed.tool_stiffness(softest),
        stiffest: allowed.tool_stiffness(stiffest),
        lowest_mode: allowed.lowest_mode(&at, report.fit.records > 0),
        drives: drives(robot.chain(), &report.joints, &confidence.joints).collect(),
    })
}

impl Allowed {
    /// A number that the records determine as well as a parameter of the verdict weak.
    fn number(self, own: PositiveEstimate) -> Option<Number> {
        let PositiveEstimate { value, interval, .. } = own;
        let interval = Some(interval).filter(|_| self.0);
        own.is_observable().then_some(Number { value, interval })
    }

    fn tool_stiffness(self, own: PrincipalCompliance) -> ToolStiffness {
        let PrincipalCompliance { compliance, direction, direction_std } = own;
        ToolStiffness {
            stiffness: self.number(compliance.inverse()),
            // A unit vector, as a number of size 1.
            direction: (direction_std <= WEAK).then_some(direction),
        }
    }

    /// Static tests determine no mode, and the model extrapolates where records were not fitted.
    fn lowest_mode(self, at: &Dynamics<'_>, has_records: bool) -> LowestMode {
        let [lower, upper] = at.robot().band_hz();
        let mode = if has_records { at.lowest_mode(upper) } else { None };
        let mode = mode.filter(|own| own.frequency_hz.value >= lower);
        let frequency_hz = mode.as_ref().and_then(|own| self.number(own.frequency_hz));
        let damping_ratio = mode.and_then(|own| self.number(own.damping_ratio));
        LowestMode { frequency_hz, damping_ratio: damping_ratio.filter(|_| frequency_hz.is_some()) }
    }
}

/// Stiffnesses and intervals as the report has them.
fn drives(
    chain: &Chain,
    joints: &[JointReport],
    intervals: &[JointIntervals],
) -> impl Iterator<Item = Drive> {
    let joints = chain.joints().iter().zip(joints).zip(intervals);
    joints.filter_map(|((own, joint), intervals)| {
        let dof = own.drive()?;
        let number =
            Number { value: joint.stiffness[dof], interval: intervals.stiffness_interval[dof] };
        let is_known = joint.stiffness_verdict[dof] != Verdict::NotObservable;
        Some(Drive {
            joint: joint.name.clone(),
            dof: dof as u8,
            stiffness: is_known.then_some(number),
        })
    })
}
