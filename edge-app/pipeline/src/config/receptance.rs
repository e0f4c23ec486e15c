//! Section `[receptance]`: how modal tests were made.

use super::sections::ReceptanceSection;
use crate::poses::Direction;
use crate::receptance::{Settings, Unit};

/// Checks the section.
pub(super) fn settings(section: &ReceptanceSection) -> Result<Settings, String> {
    let unit = section.unit.as_ref().map(|text| {
        Unit::parse(text).ok_or_else(|| {
            format!(
                "[receptance] unit is {text:?}: write a motion per force, such as {}",
                Unit::EXAMPLES
            )
        })
    });
    let mut axes = [(0, 1.0), (1, 1.0), (2, 1.0)];
    if let Some(names) = &section.axes {
        for (own, name) in axes.iter_mut().zip(names) {
            let direction = Direction::parse(name).ok_or_else(|| {
                format!("[receptance] axes has {name:?}: write x, y or z of the TCP, or -x, -y or -z, for each axis of the test")
            })?;
            *own = (direction.axis, f64::from(direction.sign));
        }
        if (0..3).any(|axis| !axes.iter().any(|(own, _)| *own == axis)) {
            return Err("[receptance] axes names an axis of the TCP twice: name each once".into());
        }
    }
    let points = section.points_m.iter().map(|(node, point)| {
        let number = node.parse().ok().filter(|_| point.iter().all(|own| own.is_finite()));
        let number = number.ok_or_else(|| {
            format!(
                "[receptance.points_m] {node}: must be the number of a node, and its place in m"
            )
        })?;
        Ok((number, *point))
    });
    let settings = Settings {
        averages: section.averages,
        relative_floor: section.relative_floor,
        absolute_floor: section.absolute_floor_per_kg,
        decay: section.decay_per_s,
        unit: unit.transpose()?,
        axes,
        response_node: section.response_node,
        points: points.collect::<Result<_, String>>()?,
    };
    settings.check()?;
    Ok(settings)
}
