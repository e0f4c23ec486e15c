//! Records that come while those before them are not settled.

use std::cell::Cell;

use flexid_pipeline::config::Config;
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Counts, Record, Solver};

use super::frames::{POSES, block, frames_with};
use super::state::{config, on_a_large_stack, records, visits};

/// Records of a block of a ton, which no start explains.
fn unexplained(config: &Config, poses: &[[f64; 3]]) -> Vec<Record> {
    let records = records(config, frames_with(config, poses, u32::MAX, 0.2, block));
    assert!(records.len() >= poses.len());
    records
}

fn records_in(solver: &Solver) -> Option<u64> {
    Some(solver.finding(&Counts::default(), &[])?.report.fit.records)
}

#[test]
fn a_record_joins_another_that_the_first_start_does_not_settle() {
    on_a_large_stack(|| {
        let (config, go_on) = (config(), Stop::new());
        let records = unexplained(&config, &POSES);
        let mut solver = Solver::new(&config).unwrap();
        solver.admit(&records[0], &go_on, |_| {});
        assert!(!solver.work(&go_on, || true, |_| {}));
        assert_eq!(solver.progress().starts, 0, "the other record is at hand");
        let has_begun = Cell::new(false);
        let comes_later = || has_begun.replace(true);
        assert!(!solver.work(&go_on, comes_later, |_| {}), "settled at the first start");
        assert_eq!(solver.progress().starts, 2, "the second has just begun");
        assert_eq!(records_in(&solver), None);
        solver.admit(&records[1], &go_on, |_| {});
        assert!(solver.work(&go_on, || false, |_| {}));
        assert_eq!(records_in(&solver), Some(2));
        assert!(solver.progress().starts > 3, "{:?}", solver.progress());
    });
}

/// A record that makes room for another is settled on first, so that its information may stay.
#[test]
fn records_settle_before_one_makes_room() {
    on_a_large_stack(|| {
        let (config, go_on) = (config(), Stop::new());
        let records = unexplained(&config, &[POSES[0]; 3]);
        assert!(records.len() > 5, "not more than are kept of a pose");
        let mut solver = Solver::new(&config).unwrap();
        for record in &records[..5] {
            solver.admit(record, &go_on, |_| {});
            solver.work(&go_on, || true, |_| {});
        }
        assert_eq!(records_in(&solver), None);
        solver.admit(&records[5], &go_on, |_| {});
        assert_eq!(records_in(&solver), Some(5));
    });
}

/// Above 100 Hz the cuts of one pose leave stiffnesses undetermined, so that rivals of the accepted minimum are searched.
#[test]
fn an_accepted_minimum_is_published_although_more_records_come() {
    on_a_large_stack(|| {
        let config = Config {
            record_samples: 512,
            band_hz: [100.0, 300.0],
            ..super::config_with("[bus]", "[bus]")
        };
        let records = records(&config, visits(&config, &[POSES[1]; 4]));
        let (mut solver, go_on) = (Solver::new(&config).unwrap(), Stop::new());
        let mut settles = records[..4].iter().map(|record| {
            solver.admit(record, &go_on, |_| {});
            solver.work(&go_on, || true, |_| {})
        });
        assert!(settles.any(|settled| settled));
    });
}
