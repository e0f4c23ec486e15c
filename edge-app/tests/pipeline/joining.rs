//! Records that come while those before them are not settled.

use super::state::{config, on_a_large_stack, records};
use super::*;
use flexid_edge::pipeline::{Counts, Record};

/// Of a block of a ton, which no start explains.
fn unexplained(config: &Config, poses: &[[f64; 3]]) -> Vec<Record> {
    let records = records(config, frames_with(config, poses, u32::MAX, 0.2, block));
    assert!(records.len() >= poses.len());
    records
}

fn records_in(solver: &Solver) -> Option<u64> {
    Some(solver.finding(&Counts::default(), "")?.report.fit.records)
}

#[test]
fn a_record_joins_another_that_the_first_start_does_not_settle() {
    on_a_large_stack(|| {
        let (config, go_on) = (config(), Stop::new());
        let records = unexplained(&config, &POSES);
        let mut solver = Solver::new(&config).unwrap();
        solver.admit(&records[0], &go_on, |_| {});
        assert!(!solver.work(&go_on, || true, |_| {}), "settled at the first start");
        assert_eq!(solver.progress().starts, 2, "the second has just begun");
        assert_eq!(records_in(&solver), None);
        solver.admit(&records[1], &go_on, |_| {});
        assert!(solver.work(&go_on, || false, |_| {}));
        assert_eq!(records_in(&solver), Some(2));
        assert!(solver.progress().starts > 3, "{:?}", solver.progress());
    });
}

/// A record that makes room for another is settled on first, so that what it tells may stay.
#[test]
fn records_settle_before_one_makes_room() {
    on_a_large_stack(|| {
        let (config, go_on) = (config(), Stop::new());
        let records = unexplained(&config, &[POSES[0]; 2]);
        assert!(records.len() > 4, "not more than are kept of a pose");
        let mut solver = Solver::new(&config).unwrap();
        for record in &records[..4] {
            solver.admit(record, &go_on, |_| {});
            solver.work(&go_on, || true, |_| {});
        }
        assert_eq!(records_in(&solver), None);
        solver.admit(&records[4], &go_on, |_| {});
        assert_eq!(records_in(&solver), Some(4));
    });
}
