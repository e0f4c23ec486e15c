//! Sensors without a common counter: what a daemon says to them, and how wide accuracies become.

use std::fs;

use flexid_core::imperfection::Accuracies;
use flexid_pipeline::clocks::{Delay, FoundClock, FoundClocks};
use flexid_pipeline::config::Config;

use super::{DBC, EDGE, MODEL, load};

/// A line of the reference scenario that names a counter.
fn counter(sensor: &str) -> String {
    let line = EDGE.lines().find(|line| line.starts_with(&format!("{sensor}_counter")));
    line.unwrap_or_else(|| panic!("{sensor} has no counter")).to_owned()
}

#[test]
fn a_daemon_needs_a_common_counter() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("edge.toml");
    fs::write(folder.path().join("mill3-model.toml"), MODEL).unwrap();
    fs::write(folder.path().join("mill3.dbc"), DBC).unwrap();
    fs::write(&file, EDGE).unwrap();
    assert!(Config::load_live(&file).is_ok());
    fs::write(&file, EDGE.replace(&counter("force"), "")).unwrap();
    assert!(Config::load(&file).is_ok());
    let error = Config::load_live(&file).unwrap_err().to_string();
    assert!(error.contains("names no counter") && error.contains("candump -L"), "{error}");
}

#[test]
fn accuracies_are_as_wide_as_clocks_are_uncertain() {
    let clock = FoundClock {
        rate_hz: 2000.0,
        ppm: 0.0,
        ppm_std: 0.1,
        frames: 30_000,
        late: 30,
        lost: 0,
        runs: 1,
    };
    let delay = Delay { delay_s: 1e-3, std_s: 21e-6, spread_s: 1e-5, pieces: 3, share: 0.98 };
    let found = FoundClocks {
        sensors: [clock; 2],
        delay: Some(delay),
        drift_std: 1e-6,
        record_delay_std_s: 12e-6,
    };
    let widened = |accuracy: &str| {
        let config = load("edge.toml", "assume = \"perfect\"", accuracy).unwrap();
        let Accuracies { delay, delay_drift, record_delay, .. } =
            config.with_clocks(&found).accuracies;
        [delay, delay_drift, record_delay].map(|own| (own * 1e9).round() * 1e-3)
    };
    assert_eq!(widened("assume = \"perfect\""), [21.0, 1.0, 12.0]);
    assert_eq!(widened("assume = \"typical\""), [29.0, 2.236, 13.0]);
    let wider = "assume = \"typical\"\ndelay_s = 5e-4\ndelay_drift = 1e-5";
    assert_eq!(widened(wider), [500.0, 10.0, 13.0]);
    // What is sought has its width there.
    let sought = "assume = \"typical\"\n[calibration]\ndelay_s = 1e-3";
    assert_eq!(widened(sought), [0.0, 2.236, 13.0]);
}
