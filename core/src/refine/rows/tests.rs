//! The room that rows take.

use super::*;

/// Where there is one lane, as on a microcontroller, the rows of a bin take the stack of one lane.
#[test]
fn rows_take_no_more_room_than_there_are_lanes() {
    let bytes = size_of_val(&<f64 as Lanes>::each([[0.0_f64; COLUMNS]; 6]));
    assert_eq!(bytes, 8 * 6 * COLUMNS);
    assert!(bytes < 10_000, "{bytes}");
}
