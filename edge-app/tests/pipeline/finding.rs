//! Findings, of parameters and of records.

use flexid_core::parameters::Bushing;
use flexid_pipeline::dynamics::Robot;
use flexid_pipeline::run_offline;
use flexid_pipeline::source::Arrival;
use flexid_wire::answer::{Answer, LowestMode, Number};
use flexid_wire::finding::Finding;
use flexid_wire::report::{JointReport, Verdict};
use flexid_wire::warning::Warning;

use super::frames::{POSES, Replay, block, frames, robot};
use super::{config, timeless};

/// A robot has intervals; a block of a ton, which is no robot, has none.
#[test]
fn a_confidence_goes_with_its_report() {
    let config = config();
    let intervals = |frames: Vec<Arrival>| {
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        counted_intervals(&timeless(run_offline(&config, &mut source, |_| {}, |_| {}).unwrap()))
    };
    assert_eq!(intervals(frames(&config, &POSES, block)), 0);
    let of_robot = intervals(frames(&config, &POSES, |pose| robot(&config, pose)));
    assert!(of_robot > 0, "a robot has no interval");
}

/// It is that of the newest record, and has the table's numbers for the drives, and those of the robot that was found for the rest. Where the
/// fit allows no interval, it has none.
#[test]
fn an_answer_is_that_of_the_newest_record() {
    let config = config();
    let outcome = |frames: Vec<Arrival>| {
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        run_offline(&config, &mut source, |_| {}, |_| {}).unwrap()
    };
    let is_interval = |own: &Option<Number>| own.is_some_and(|own| own.interval.is_some());
    let of_block = outcome(frames(&config, &POSES, block)).finding.expect("a finding").answer;
    let Answer { softest, stiffest, lowest_mode, drives, .. } = of_block.expect("an answer");
    let LowestMode { frequency_hz, damping_ratio } = lowest_mode;
    let all = [softest.stiffness, stiffest.stiffness, frequency_hz, damping_ratio];
    let all = all.into_iter().chain(drives.iter().map(|own| own.stiffness));
    assert!(!all.into_iter().any(|own| is_interval(&own)), "a block has an interval");

    let outcome = outcome(frames(&config, &POSES, |pose| robot(&config, pose)));
    let newest = outcome.records.last().expect("a record");
    let finding = outcome.finding.expect("a finding");
    let answer = finding.answer.expect("an answer");
    assert_eq!((&answer.pose[..], answer.record), (&newest.pose[..], Some(newest.number)));
    let joints = finding.report.joints.iter().zip(&finding.confidence.joints);
    for ((joint, intervals), (drive, dof)) in joints.zip(answer.drives.iter().zip([5, 4, 4])) {
        assert_eq!((&drive.joint, usize::from(drive.dof)), (&joint.name, dof));
        let stated = drive.stiffness.map(|own| (own.value, own.interval));
        let known = joint.stiffness_verdict[dof] != Verdict::NotObservable;
        let expected = (joint.stiffness[dof], intervals.stiffness_interval[dof]);
        assert_eq!(stated, known.then_some(expected));
    }
    let bushing = |own: &JointReport| Bushing { stiffness: own.stiffness, damping: own.damping };
    let bushings = finding.report.joints.iter().map(bushing).collect();
    let found = Robot::new(outcome.robot.expect("a robot"), bushings).unwrap();
    let at = found.at(&answer.pose).unwrap();
    let [soft, _, stiff] = at.principal(&at.compliance().unwrap());
    for (own, expected) in [(answer.softest, soft), (answer.stiffest, stiff)] {
        let stiffness = expected.compliance.inverse();
        let is_known = stiffness.is_observable();
        assert_eq!(own.stiffness.map(|own| own.value), is_known.then_some(stiffness.value));
    }
    let mode = at.lowest_mode(150.0).unwrap();
    let stated = answer.lowest_mode.frequency_hz.map(|own| own.value);
    let is_known = mode.frequency_hz.value >= 20.0 && mode.frequency_hz.is_observable();
    assert_eq!(stated, is_known.then_some(mode.frequency_hz.value));
}

/// The numbers of an answer are those of the robot that sent the frames, as far as their intervals say.
#[test]
fn an_answer_holds_the_truth() {
    let config = super::state::config();
    let frames = super::state::visits(&config, &POSES);
    let mut source = Replay { frames: frames.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut source, |_| {}, |_| {}).unwrap();
    let answer = outcome.finding.expect("a finding").answer.expect("an answer");
    let truth = Robot::new(outcome.robot.expect("a robot"), config.bounds.middle(3)).unwrap();
    let at = truth.at(&answer.pose).unwrap();
    let [soft, _, stiff] = at.principal(&at.compliance().unwrap());
    let mode = at.lowest_mode(150.0).unwrap();
    let drives = answer.drives.iter().zip(truth.bushings());
    let numbers = [
        (answer.softest.stiffness, soft.compliance.inverse().value),
        (answer.stiffest.stiffness, stiff.compliance.inverse().value),
        (answer.lowest_mode.frequency_hz, mode.frequency_hz.value),
        (answer.lowest_mode.damping_ratio, mode.damping_ratio.value),
    ];
    let of_drives =
        drives.map(|(drive, own)| (drive.stiffness, own.stiffness[usize::from(drive.dof)]));
    let mut known = 0;
    for (own, truth) in numbers.into_iter().chain(of_drives) {
        let Some(Number { value, interval: Some([lower, upper]) }) = own else { continue };
        let std = (upper / lower).ln() / (2.0 * 1.959_964);
        // Seven numbers are all within 4 standard deviations in 2000 of 2001 cases.
        assert!(
            (value / truth).ln().abs() < 4.0 * std,
            "{value} in {lower} to {upper} is not {truth}"
        );
        known += 1;
    }
    assert!(known >= 4, "{known} of 7 numbers are known");
}

/// Checks the shape of a confidence, whatever it says. Returns the number of intervals.
fn counted_intervals(Finding { report, confidence, .. }: &Finding) -> usize {
    let mut intervals = 0;
    for (joint, own) in report.joints.iter().zip(&confidence.joints) {
        assert_eq!(joint.name, own.name);
        let stiffness = joint.stiffness.iter().zip(&joint.stiffness_std);
        let damping = joint.damping.iter().zip(&joint.damping_std);
        let ends = own.stiffness_interval.iter().chain(&own.damping_interval);
        for ((value, std), ends) in stiffness.chain(damping).zip(ends) {
            let Some([lower, upper]) = ends else { continue };
            let relative = std.expect("an interval without a standard deviation") / value;
            assert!(lower < value && value < upper, "{value} is not in {lower} to {upper}");
            assert!(((upper / lower).ln() / (2.0 * 1.959_964 * relative) - 1.0).abs() < 1e-9);
            intervals += 1;
        }
    }
    println!("{intervals} intervals of 36, χ²/dof {}", report.fit.consistency);
    let verdicts = report
        .joints
        .iter()
        .flat_map(|joint| joint.stiffness_verdict.iter().chain(&joint.damping_verdict).copied());
    let observable = verdicts.filter(|verdict| *verdict != Verdict::NotObservable).count();
    assert_eq!(intervals, if report.fit.consistency <= 10.0 { observable } else { 0 });

    let correlations = &confidence.correlations;
    assert_eq!((correlations.unknowns.len(), correlations.percent.len()), (36, 36 * 35 / 2));
    assert_eq!(correlations.unknowns[0], "joint_1 tx stiffness");
    assert_eq!(correlations.unknowns[35], "joint_3 rz damping");
    assert!(correlations.percent.iter().all(|percent| (-100..=100).contains(percent)));
    assert!(
        !confidence.weak_directions.is_empty(),
        "an eighth of a second determines a whole robot"
    );
    for direction in &confidence.weak_directions {
        assert!(direction.relative_std.is_none_or(|std| std > 0.3), "{direction:?}");
        assert!(direction.to_string().contains(direction.shares[0].name.as_str()), "{direction:?}");
        for share in &direction.shares {
            assert!(correlations.unknowns.contains(&share.name), "{direction:?}");
        }
    }
    assert_eq!(confidence.held_out.len() as u64, report.fit.records);
    for held_out in &confidence.held_out {
        let near =
            |pose: &[f64; 3]| pose.iter().zip(&held_out.pose).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(POSES.iter().any(near), "{held_out:?}");
    }
    assert!(confidence.nuisances.is_empty(), "none is asked for");
    intervals
}

/// Eight records at one pose, of which five are kept, and a model so wrong that none of the others is folded in.
#[test]
fn records_that_are_lost_are_counted() {
    let config = config();
    let frames = frames(&config, &[[0.0, -0.45, 0.95]; 8], block);
    let mut source = Replay { frames: frames.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut source, |_| {}, |_| {}).unwrap();
    let taken = outcome.counts.stream.records;
    let Finding { report, confidence, .. } = outcome.finding.expect("a finding");
    assert!(taken >= 8 && !report.warnings.is_empty(), "{taken} records");
    assert_eq!((report.fit.records, confidence.retired, confidence.left_out), (5, 0, taken - 5));
    let lost = |warning: &Warning| matches!(warning, Warning::MadeRoom { .. });
    assert!(report.warnings.iter().any(lost), "{:?}", report.warnings);
}

/// The frames of one log twice: the numbers and their deviations are those of once, and a warning says why.
#[test]
fn a_log_that_is_given_twice_counts_once() {
    let config = config();
    let run = |frames: Vec<Arrival>| {
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        let outcome = run_offline(&config, &mut source, |_| {}, |_| {}).unwrap();
        let records = outcome.counts.stream.records;
        (timeless(outcome), records)
    };
    let log = frames(&config, &POSES, |pose| robot(&config, pose));
    let (once, records) = run(log.clone());
    let (twice, all) = run([log.clone(), log].concat());
    assert!(records >= 2 && all == 2 * records, "{records} and {all} records");
    assert_eq!(twice.report.fit.records, once.report.fit.records);
    assert_eq!(twice.report.joints, once.report.joints);
    let again = |finding: &Finding| {
        let repeated = |warning: &&Warning| matches!(warning, Warning::Repeated { .. });
        finding.report.warnings.iter().find(repeated).cloned()
    };
    assert_eq!(again(&twice), Some(Warning::Repeated { records, again: records + 1, original: 1 }));
    assert_eq!(again(&once), None);
}
