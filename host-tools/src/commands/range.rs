//! Ranges of numbers on the command line, beyond which no robot and no cutter is.

use flexid_console::exit::BadArgument;

use crate::numbers::Numbers;

/// Largest force on the tool, N. No robot bears more.
pub(super) const LARGEST_FORCE_N: f64 = 1e6;

/// Refuses what lies outside of a range, both ends included, in this unit.
pub(super) fn within(
    name: &str,
    value: f64,
    [least, most]: [f64; 2],
    unit: &str,
) -> Result<(), BadArgument> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    Err(BadArgument(format!("{name} is {value}: must lie between {least} and {most}{unit}")))
}

/// The force of `--force` along three axes, N.
///
/// # Errors
/// It has not three numbers, or one that no robot bears.
pub(super) fn force(given: &Numbers) -> Result<[f64; 3], BadArgument> {
    let force = given.exactly("--force")?;
    force
        .iter()
        .try_for_each(|own| within("--force", *own, [-LARGEST_FORCE_N, LARGEST_FORCE_N], "N"))?;
    Ok(force)
}
