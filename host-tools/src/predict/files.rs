//! The receptance as a file: CSV, or a universal file.
//!
//! A universal file holds a data set of type 58 for each entry of the receptance of each pose, as modal analysis programs read it
//! (Structural Dynamics Research Corporation, _Universal File Formats_; the records are those of `pyuff`).

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;
use flexid_console::exit::BadArgument;
use flexid_edge::console::complain;
use flexid_pipeline::input::BadInput;
use flexid_prediction::receptance::Grid;
use flexid_wire::report::Fit;

use super::Prediction;
use super::table::{lacks_damping, verdict};

/// Kind of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Comma-separated values.
    Csv,
    /// Universal file, data set 58.
    Uff,
}

impl Format {
    /// The format of a file's name.
    ///
    /// # Errors
    /// The name ends otherwise.
    pub(crate) fn of(file: &Path) -> Result<Self, BadArgument> {
        match file.extension().and_then(|end| end.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("uff" | "unv") => Ok(Self::Uff),
            _ => Err(BadArgument(format!(
                "{}: a receptance is written as .csv or .uff: name such a file",
                file.display()
            ))),
        }
    }

    /// Checks that what the file would hold is known of a fit in the result `found`. A universal file cannot mark what is not.
    ///
    /// # Errors
    /// The fit rests on static tests alone, and the file is a universal one.
    pub(crate) fn holds(self, found: &Path, fit: &Fit) -> Result<(), BadInput> {
        match lacks_damping(fit).filter(|_| self == Self::Uff) {
            Some(why) => Err(BadInput::new(
                found,
                format!(
                    "{why}, or write a .csv by `flexid predict --receptance`, which marks what is not determined"
                ),
            )),
            None => Ok(()),
        }
    }

    /// Says on stderr which part of the receptances in `file` is not determined, where the file does not mark them.
    pub(crate) fn warn_of_open(self, file: &Path, predictions: &[Prediction]) {
        let points = predictions.iter().flat_map(|own| &own.receptance);
        let all: Vec<bool> = points
            .flat_map(|point| point.magnitude.iter().flatten().map(|own| own.determined))
            .collect();
        let open = all.iter().filter(|is_determined| !**is_determined).count();
        if self == Self::Uff && open > 0 {
            let (file, share) = (file.display(), 100.0 * open as f64 / all.len() as f64);
            complain(&format!(
                "warning: {file}: {share:.1} % of the receptances are not determined, and a universal file does not mark them: a .csv does"
            ));
        }
    }

    /// The frequencies that show each mode: a universal file has them equally far apart.
    pub(crate) fn grid(self) -> Grid {
        match self {
            Self::Csv => Grid::Resolved,
            Self::Uff => Grid::EvenlyResolved,
        }
    }

    /// The contents of the file, of a fit with this verdict, for which a CSV file has no place.
    ///
    /// # Errors
    /// None for predictions of one robot.
    pub(crate) fn text(self, predictions: &[Prediction], fit: &Fit) -> Result<String> {
        match self {
            Self::Csv => csv(predictions),
            Self::Uff => Ok(uff(predictions, verdict(fit))),
        }
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// A line for each frequency of each pose.
fn csv(predictions: &[Prediction]) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let angles = predictions.first().map_or(0, |own| own.pose.len());
    let mut header: Vec<String> = (1..=angles).map(|angle| format!("q{angle}")).collect();
    header.push("frequency_hz".into());
    for row in AXES {
        for column in AXES {
            let names =
                ["m_per_n", "low", "high", "phase_rad", "phase_low", "phase_high", "determined"];
            header.extend(names.map(|name| format!("h_{row}{column}_{name}")));
        }
    }
    writer.write_record(&header)?;
    for prediction in predictions {
        for point in &prediction.receptance {
            let mut line: Vec<String> = prediction.pose.iter().map(f64::to_string).collect();
            line.push(point.frequency_hz.to_string());
            for row in 0..3 {
                for column in 0..3 {
                    let (magnitude, phase) =
                        (point.magnitude[row][column], point.phase[row][column]);
                    let [low, high] = magnitude.interval;
                    let [phase_low, phase_high] = phase.interval;
                    let numbers = [magnitude.value, low, high, phase.value, phase_low, phase_high];
                    line.extend(numbers.map(|number| format!("{number:.9e}")));
                    line.push(u8::from(magnitude.determined).to_string());
                }
            }
            writer.write_record(&line)?;
        }
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// A data set 58 for each entry: displacement at node 1 for a force there, evenly spaced, complex, double precision.
fn uff(predictions: &[Prediction], verdict: &str) -> String {
    let mut text = String::new();
    for (number, prediction) in (1..).zip(predictions) {
        let points = &prediction.receptance;
        let (Some(first), Some(second)) = (points.first(), points.get(1)) else { continue };
        let spacing = second.frequency_hz - first.frequency_hz;
        let pose: Vec<String> = prediction.pose.iter().map(|angle| format!("{angle:.5}")).collect();
        for row in 0..3 {
            for column in 0..3 {
                let name = format!("receptance {}{} at the tool", AXES[row], AXES[column]);
                let pose = clipped(&format!("pose {}", pose.join(" ")));
                let lines = [
                    "    -1".to_owned(),
                    "    58".to_owned(),
                    clipped(&name),
                    pose,
                    clipped(&format!("fit {verdict}")),
                    "NONE".to_owned(),
                    "NONE".to_owned(),
                    // Function type 4, frequency response; node and direction of response and reference.
                    format!(
                        "{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}",
                        4,
                        number,
                        0,
                        0,
                        "TCP",
                        1,
                        row + 1,
                        "TCP",
                        1,
                        column + 1
                    ),
                    // Complex double, evenly spaced.
                    format!(
                        "{:10}{:10}{:10}{:>13}{:>13}{:>13}",
                        6,
                        points.len(),
                        1,
                        exponent(first.frequency_hz, 5),
                        exponent(spacing, 5),
                        exponent(0.0, 5)
                    ),
                    axis(18, "Frequency", "Hz"),
                    axis(8, "Displacement", "m"),
                    axis(13, "Force", "N"),
                    axis(0, "NONE", "NONE"),
                ];
                for line in lines {
                    text += &line;
                    text.push('\n');
                }
                let mut parts = points.iter().flat_map(|point| {
                    let (size, phase) =
                        (point.magnitude[row][column].value, point.phase[row][column].value);
                    [size * phase.cos(), size * phase.sin()]
                });
                while let Some(first) = parts.next() {
                    let _ = write!(text, "{:>20}", exponent(first, 12));
                    for part in parts.by_ref().take(3) {
                        let _ = write!(text, "{:>20}", exponent(part, 12));
                    }
                    text.push('\n');
                }
                text += "    -1\n";
            }
        }
    }
    text
}

/// A line about an axis: specific data type, length, force and temperature exponents, label, unit.
fn axis(kind: u32, label: &str, unit: &str) -> String {
    format!("{kind:10}{:5}{:5}{:5} {label:<20} {unit:<20}", 0, 0, 0)
}

/// A number as Fortran writes it.
fn exponent(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{mantissa}E{sign}{:02}", exponent.abs())
}

/// A line of the format, which has at most 80 characters.
fn clipped(line: &str) -> String {
    line.chars().take(80).collect()
}
