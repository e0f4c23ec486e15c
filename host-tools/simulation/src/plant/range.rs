//! Limits of the entries of a plant file.

/// Checks that `value` lies between two limits. The error names its place and the limits.
pub(super) fn between(place: &str, value: f64, [least, most]: [f64; 2]) -> Result<(), String> {
    if (least..=most).contains(&value) {
        Ok(())
    } else {
        Err(format!("{place} is {value:?}: must lie between {least:?} and {most:?}"))
    }
}

/// [`between`] for each of several values.
pub(super) fn all_between(place: &str, values: &[f64], limits: [f64; 2]) -> Result<(), String> {
    values.iter().try_for_each(|&value| between(place, value, limits))
}
