//! Findings that a daemon left at the end of its epochs. Later versions must read them.

use std::path::Path;

use flexid_prediction::comparison::LEVEL;
use flexid_prediction::document::Found;
use flexid_prediction::history::history;

/// Two days of a robot that stays the same, left by the first daemon that had epochs: `edge-app/tests/pipeline/epochs.rs` makes them.
const DAYS: [&str; 2] = ["2001-09-09T01-46-40.383Z.json", "2001-09-10T01-47-20.383Z.json"];

#[test]
fn days_of_a_daemon_are_read_and_nothing_has_changed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/epochs");
    let found = DAYS.map(|name| Found::load(&folder.join(name)).unwrap());
    assert_eq!(found[1].date.as_deref(), Some("2001-09-10T01:47:20Z"));
    for own in &found {
        let shared = own.shared.as_ref().unwrap();
        assert!(shared.imperfections.len() > 5, "{:?}", shared.imperfections);
    }
    let history = history(&found.each_ref(), &[0.0, 1.0], LEVEL).unwrap();
    let determined = history.parameters.iter().filter(|own| own.course.points.len() == 2).count();
    assert!(determined >= 5, "{determined} of 36 parameters");
    assert!(history.parameters.iter().all(|own| own.course.steps.is_empty()));
}
