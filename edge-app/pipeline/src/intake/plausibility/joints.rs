//! Joint angles and strokes beyond the limits of the joints, and those that are no measurement.

use std::f64::consts::{PI, TAU};

use flexid_core::MAX_JOINTS;
use flexid_wire::bits::Number;
use flexid_wire::implausible::BeyondLimits;
use flexid_wire::text::clipped;

use crate::SAMPLES;
use crate::config::Config;
use crate::model::{Kind, Model, ModelJoint};
use crate::signals::SignalTable;

/// Margin beyond the limits of a joint, rad (m). Limits are published in whole degrees and millimetres.
const MARGIN: [f64; 2] = [PI / 180.0, 1e-3];

/// Number of force frames over which a single angle beyond the limits must hold to count: the samples of the longest record.
/// Until then it may be the mistake of one frame.
const HOLDS: u64 = SAMPLES as u64;

/// Reading of a joint beyond its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// Reading, rad (m).
    pub value: f64,
    /// Distance beyond the limit and its margin, rad (m).
    pub by: f64,
}

/// Readings of a joint that are no measurement: the smallest or largest number of the signal, and beyond the limits of the joint. Senders
/// have it for "not available".
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoMeasurement {
    /// Number of such readings.
    pub frames: u64,
    /// The newest of them, rad (m).
    pub value: f64,
}

/// Checks the angles of each joint against its limits, base first.
#[derive(Clone, Debug)]
pub(super) struct Joints {
    /// Range of each joint with its margin, rad (m). Infinite where no limit is known.
    ranges: Vec<[f64; 2]>,
    /// Smallest and largest value of each signal, rad (m).
    ends: Vec<[f64; 2]>,
    /// Readings that are no measurement.
    pub(super) none: [NoMeasurement; MAX_JOINTS],
    beyond: [Option<Beyond>; MAX_JOINTS],
}

/// A joint whose newest angle is beyond its limits.
#[derive(Clone, Copy, Debug)]
struct Beyond {
    newest: Excess,
    /// True if the angle before was beyond the limits, too.
    again: bool,
    /// Number of force frames when the first angle beyond the limits in a row came.
    since: u64,
}

impl Excess {
    /// Returns the reading that is farther beyond its limits.
    pub(super) fn worse(self, other: Option<Self>) -> Self {
        other.filter(|other| other.by > self.by).unwrap_or(self)
    }
}

impl Joints {
    pub(super) fn new(model: &Model, signals: &SignalTable) -> Self {
        let range = |joint: &ModelJoint| {
            let [lower, upper] = limits(joint);
            let margin = MARGIN[usize::from(joint.kind == Kind::Prismatic)];
            [lower - margin, upper + margin]
        };
        let ends = |joint: usize| {
            let Some(signal) = signals.joint(joint) else {
                return [f64::NEG_INFINITY, f64::INFINITY];
            };
            if signal.number == Number::Float {
                return [f64::MIN, f64::MAX];
            }
            let (low, high) = signal.raw_range().into_inner();
            let [one, other] = [low, high].map(|raw| signal.scale * raw as f64 + signal.offset);
            let half = 0.5 * signal.scale.abs();
            [one.min(other) + half, one.max(other) - half]
        };
        Self {
            ranges: model.driven().map(range).collect(),
            ends: (0..model.driven().count()).map(ends).collect(),
            none: [NoMeasurement::default(); MAX_JOINTS],
            beyond: [None; MAX_JOINTS],
        }
    }

    /// Returns whether a reading is a measurement, and counts it if it is not.
    pub(super) fn is_measurement(&mut self, joint: usize, value: f64) -> bool {
        let (Some([lower, upper]), Some([low, high])) =
            (self.ranges.get(joint), self.ends.get(joint))
        else {
            return true;
        };
        // A value that is not finite is in no range.
        let is_none = !(*lower..=*upper).contains(&value) && !(*low..=*high).contains(&value);
        if is_none && let Some(none) = self.none.get_mut(joint) {
            *none = NoMeasurement { frames: none.frames + 1, value };
        }
        !is_none
    }

    /// Takes an angle that came after `frames` force frames. Returns the worse of this angle and the one before, if both are
    /// beyond the limits. A single angle does not count: a controller may send it before it is referenced.
    pub(super) fn note(&mut self, joint: usize, value: f64, frames: u64) -> Option<Excess> {
        let [lower, upper] = self.ranges.get(joint)?;
        let before = self.beyond.get_mut(joint).filter(|_| value.is_finite())?;
        let newest = Excess { value, by: (value - upper).max(lower - value) };
        let last = before.filter(|_| newest.by > 0.0);
        let since = last.map_or(frames, |last| last.since);
        *before = (newest.by > 0.0).then_some(Beyond { newest, again: last.is_some(), since });
        last.map(|last| newest.worse(Some(last.newest)))
    }

    /// Returns the newest angle of each joint that stays beyond its limits. An angle that is sent only on change comes once and
    /// holds.
    pub(super) fn standing(&self, frames: u64) -> [Option<Excess>; MAX_JOINTS] {
        let is_odd = |beyond: &Beyond| beyond.again || frames - beyond.since >= HOLDS;
        self.beyond.map(|beyond| beyond.filter(is_odd).map(|beyond| beyond.newest))
    }
}

/// Returns the lower and upper limit, rad (m). A revolute joint without a limit may make one turn to that side.
fn limits(joint: &ModelJoint) -> [f64; 2] {
    let [lower, upper] = joint.limits;
    let known = |limit: f64, turn: f64| {
        if limit.is_infinite() && joint.kind == Kind::Revolute { turn } else { limit }
    };
    [known(lower, -TAU), known(upper, TAU)]
}

/// Returns the joint that is farthest beyond its limits, with the number of other joints beyond theirs.
pub(super) fn warning(
    joints: &[Option<Excess>; MAX_JOINTS],
    config: &Config,
) -> Option<BeyondLimits> {
    let all = config.signals.joints.iter().zip(config.model.driven()).zip(joints);
    let beyond = || all.clone().filter_map(|(joint, excess)| Some((joint, (*excess)?)));
    let ((signal, joint), Excess { value, .. }) =
        beyond().max_by(|(_, one), (_, other)| one.by.total_cmp(&other.by))?;
    let [lower, upper] = limits(joint);
    let slides = joint.kind == Kind::Prismatic;
    // Size of a degree, or of a millimetre. A value beyond `far` cannot come from a limit that is a little too narrow: it is more
    // than a turn, or twice the stroke.
    let (size, far) =
        if slides { (1e-3, 2.0 * upper.abs().max(lower.abs())) } else { (PI / 180.0, TAU) };
    Some(BeyondLimits {
        signal: clipped(signal),
        joint: clipped(&joint.name),
        slides,
        value,
        limits: [lower, upper].map(|limit| limit.is_finite().then_some(limit)),
        in_other_unit: (lower..=upper).contains(&(size * value)) && value.abs() > far,
        others: (beyond().count() - 1) as u8,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn config() -> Config {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        Config::load(&file).unwrap()
    }

    fn line(config: &Config, joint: usize, values: &[f64]) -> Option<String> {
        let mut joints = Joints::new(&config.model, &config.signals);
        let mut worst = [None; MAX_JOINTS];
        for value in values {
            if let Some(excess) = joints.note(joint, *value, 0) {
                worst[joint] = Some(excess.worse(worst[joint]));
            }
        }
        warning(&worst, config).map(|joint| joint.to_string())
    }

    #[test]
    fn angles_beyond_the_limits_are_asked_for_their_unit() {
        let mut config = config();
        config.model.joints[1].limits = [-2.1, 2.1];
        assert_eq!(
            line(&config, 1, &[2.1, -2.11, 0.0, f64::NAN, f64::INFINITY, f64::INFINITY]),
            None
        );
        assert_eq!(
            line(&config, 1, &[0.3, 57.3, 40.0]).unwrap(),
            "q2 reads 57.3000, beyond joint_2's limits, -2.1000 to 2.1000 rad: in degrees? give its unit in [bus] dbc"
        );
        let near = line(&config, 1, &[-2.3; 2]).unwrap();
        assert!(near.ends_with("or mend the limits in [model] file"), "{near}");
        // A joint without limits may turn once.
        config.model.joints[2].limits = [f64::NEG_INFINITY, f64::INFINITY];
        assert_eq!(line(&config, 2, &[6.0; 2]), None);
        assert!(line(&config, 2, &[-90.0; 2]).unwrap().contains("in degrees?"));
        let excess = |value| Some(Excess { value, by: value });
        let mut all = [None; MAX_JOINTS];
        (all[0], all[1], all[2]) = (excess(70.0), excess(90.0), excess(80.0));
        let line = warning(&all, &config).unwrap().to_string();
        assert!(line.starts_with("q2 reads 90.0000, beyond joint_2's limits"), "{line}");
        assert!(line.contains(" rad (and 2 other joints beyond theirs): in degrees?"), "{line}");
    }

    #[test]
    fn a_single_odd_angle_is_odd_only_if_it_holds() {
        let config = config();
        assert_eq!(line(&config, 1, &[0.3, 6.5535e4, 0.3, 6.5535e4, f64::NAN, 0.3]), None);
        assert!(line(&config, 1, &[0.3, 90.0, f64::NAN, 90.0, 0.3]).is_some());
        let mut joints = Joints::new(&config.model, &config.signals);
        let standing =
            |joints: &Joints, frames| joints.standing(frames)[1].map(|excess| excess.value);
        assert_eq!(joints.note(1, 90.0, 5000), None);
        assert_eq!(standing(&joints, 5000 + HOLDS - 1), None);
        assert_eq!(standing(&joints, 5000 + HOLDS), Some(90.0));
        assert_eq!(joints.note(1, 0.3, 5000 + HOLDS), None);
        assert_eq!(standing(&joints, 5000 + HOLDS), None);
    }

    #[test]
    fn the_end_of_a_signal_beyond_the_limits_is_no_measurement() {
        let mut config = config();
        let mut joints = Joints::new(&config.model, &config.signals);
        let largest = f64::from(i32::MAX) * 1e-6;
        for (value, is_measurement) in
            [(largest, false), (-largest - 1e-6, false), (largest - 1e-6, true), (0.0, true)]
        {
            assert_eq!(joints.is_measurement(2, value), is_measurement, "{value}");
        }
        assert_eq!(joints.none[2], NoMeasurement { frames: 2, value: -largest - 1e-6 });
        // The range of a signal may be that of the joint.
        config.model.joints[2].limits = [-3000.0, 3000.0];
        assert!(Joints::new(&config.model, &config.signals).is_measurement(2, largest));
    }

    #[test]
    fn strokes_are_asked_whether_they_are_in_millimetres() {
        let mut config = config();
        config.model.joints[0].kind = Kind::Prismatic;
        config.model.joints[0].limits = [0.0, 1.5];
        assert_eq!(line(&config, 0, &[1.5; 2]), None);
        let line = line(&config, 0, &[740.0; 2]).unwrap();
        assert!(line.ends_with("0.0000 to 1.5000 m: in mm? give its unit in [bus] dbc"), "{line}");
    }
}
