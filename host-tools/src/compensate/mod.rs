//! A path of the tool under its forces: deflection, and the joint offsets that take it back.

mod table;

use anyhow::Result;
use flexid_pipeline::path::Place;
use flexid_prediction::compensation::Compensation;
use flexid_prediction::statics::Deflection;
use flexid_prediction::{Estimate, Robot};
use serde::Serialize;

pub(crate) use table::text;

/// Offset of a joint from which on it is no compensation of a deflection, rad (m). Chosen: 20 mrad move a tool at 1 m by 20 mm, ten times
/// the deflection of machining robots.
const TOO_LARGE: f64 = 0.02;

/// A place of the path.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Compensated {
    /// Line in the file of the path, from 1.
    pub(crate) line: usize,
    /// Joint angles, base first, rad (m).
    pub(crate) pose: Vec<f64>,
    /// Force, N, and torque, Nm, on the tool along its axes.
    pub(crate) wrench: [f64; 6],
    /// Deflection and offsets.
    #[serde(flatten)]
    pub(crate) compensation: Compensation,
}

impl Compensated {
    /// # Errors
    /// The robot does not stand in this pose: a line that says why.
    pub(crate) fn new(robot: &Robot, place: Place) -> Result<Self, String> {
        let Place { line, pose, wrench } = place;
        let dynamics = robot.at(&pose).map_err(|error| error.to_string())?;
        let compliance =
            dynamics.compliance().ok_or("the robot does not stand there: it has no stiffness")?;
        let compensation = Compensation::of(&dynamics, &compliance, wrench);
        Ok(Self { line, pose, wrench, compensation })
    }
}

/// A number whose interval has this half width, with three digits more than that shows. Where the interval has no end, it has two digits.
fn justified(number: f64, half: f64) -> String {
    let digits = (number.abs() / half).log10().floor() + 3.0;
    // Chosen: no more digits than a double has.
    let digits = if digits.is_nan() { 15 } else { digits.clamp(1.0, 15.0) as usize };
    format!("{number:.digits$e}")
}

/// The first line with an offset above [`TOO_LARGE`], and a warning of it.
pub(crate) fn too_large(path: &[Compensated]) -> Option<(usize, String)> {
    let is_wrong = |offset: &Estimate| offset.value.abs() > TOO_LARGE;
    let all = path.iter().filter(|own| own.compensation.offsets.iter().any(is_wrong));
    let (first, count) = (all.clone().next()?, all.count());
    let (joint, offset) = (1..).zip(&first.compensation.offsets).find(|(_, own)| is_wrong(own))?;
    let more =
        if count > 1 { format!(" (and in {} more places)", count - 1) } else { String::new() };
    Some((
        first.line,
        format!(
            "offset of q{joint} is {:.3} rad (m){more}: no compensation of a deflection: check the forces, in N, or the stiffnesses of the fit",
            offset.value
        ),
    ))
}

/// A line for each place.
///
/// # Errors
/// None for places of one robot.
pub(crate) fn csv(path: &[Compensated]) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let joints = path.first().map_or(0, |own| own.pose.len());
    let mut header: Vec<String> = (1..=joints).map(|joint| format!("q{joint}")).collect();
    header.extend(["fx", "fy", "fz", "mx", "my", "mz"].map(str::to_owned));
    let axes = ["x", "y", "z"];
    let moves = ["", "_base", "_left"].into_iter().flat_map(|end| {
        ["d", "r"].into_iter().flat_map(move |of| axes.map(|axis| format!("{of}{axis}{end}")))
    });
    let offsets = (1..=joints).map(|joint| format!("q{joint}_offset"));
    for name in moves.chain(offsets) {
        let ends = ["low", "high", "determined"].map(|end| format!("{name}_{end}"));
        header.push(name);
        header.extend(ends);
    }
    header.push("singular".into());
    writer.write_record(&header)?;
    for Compensated { pose, wrench, compensation, .. } in path {
        let Compensation { deflection, along_base, offsets, left, is_singular } = compensation;
        let mut line: Vec<String> = pose.iter().chain(wrench).map(f64::to_string).collect();
        let moves = [deflection, along_base, left].into_iter();
        let moves = moves
            .flat_map(|Deflection { translation, rotation }| translation.iter().chain(rotation));
        for Estimate { value, interval: [low, high], determined, .. } in moves.chain(offsets) {
            line.extend([value, low, high].map(|own| justified(*own, (high - low) / 2.0)));
            line.push(u8::from(*determined).to_string());
        }
        line.push(u8::from(*is_singular).to_string());
        writer.write_record(&line)?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_digits_that_its_interval_justifies() {
        for (number, half, expected) in [
            (1.234_567_89e-3, 1e-5, "1.23457e-3"),
            (-4.445_678e-4, 3e-8, "-4.4456780e-4"),
            (2.345e-9, 1e-6, "2.3e-9"),
            (0.0, 1e-6, "0.0e0"),
            (5.0, f64::INFINITY, "5.0e0"),
            (1.5, 0.0, "1.500000000000000e0"),
        ] {
            assert_eq!(justified(number, half), expected, "{number} {half}");
        }
    }
}
