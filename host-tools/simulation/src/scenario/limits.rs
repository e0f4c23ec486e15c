//! Ranges of the numbers of a scenario file.

/// Checks that a value is above 0 and at most `most`.
pub(super) fn within(place: &str, value: f64, most: f64) -> Result<(), String> {
    if value > 0.0 && value <= most {
        Ok(())
    } else {
        Err(format!("{place} is {value}: must be above 0 and at most {most}"))
    }
}

/// Checks that a value lies between 0 and a million. A larger value is an error in the file.
pub(super) fn not_negative(place: &str, value: f64) -> Result<(), String> {
    if (0.0..=1e6).contains(&value) {
        Ok(())
    } else {
        Err(format!("{place} is {value:e}: must lie between 0 and 1e6"))
    }
}
