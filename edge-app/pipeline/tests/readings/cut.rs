//! The cut that is in the seeds of tables: `tests/fuzz/seeds/write.py` says what it is.

use flexid_pipeline::source::TableLog;

use crate::readings::{accelerations, all, angles, forces};

/// Checks that a table holds the cut of the seeds.
pub(crate) fn is_the_cut(name: &str, table: Result<TableLog<'_>, String>, has_joints: bool) {
    let table = table.unwrap_or_else(|error| panic!("{name}: {error}"));
    let rate_hz = table.shown().rate_hz.unwrap();
    // A time since 1970 has steps of 0.2 us.
    assert!((rate_hz - 1000.0).abs() < 0.1, "{name}: {rate_hz}");
    let (arrivals, error) = all(table);
    let expected: Vec<_> = (0..40).map(|row| (row, [row as f32, 2.0, -3.0])).collect();
    assert_eq!((forces(&arrivals), error), (expected, None), "{name}");
    let expected: Vec<_> = (0..40).map(|row| [0.5, row as f32 / 8.0, -9.5]).collect();
    assert_eq!(accelerations(&arrivals), expected, "{name}");
    if has_joints {
        assert_eq!(angles(&arrivals, 0)[0].1, 0.1, "{name}");
        assert_eq!(angles(&arrivals, 1)[0].1, -0.2, "{name}");
    }
}
