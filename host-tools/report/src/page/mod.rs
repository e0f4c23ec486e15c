//! The page: one file for each section, in the order in which a reader asks.

mod correlations;
mod course;
mod format;
mod held_out;
mod modes;
mod origin;
mod parameters;
mod quality;
mod receptance;
mod residuals;
mod verdict;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::document::Document;

const STYLE: &str = include_str!("style.css");
/// Names of the axes of the tool centre point.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Degrees of freedom of a joint.
const DOFS: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];
/// Most poses that are drawn. Chosen: with their charts the page stays below 2 MiB; a result has at most 16.
const MOST_POSES: usize = 6;

/// Renders the page of a result, of a file of this name and with this SHA-256.
///
/// Parts that the file does not have leave a sentence.
pub fn render(document: &Document, name: &str, sha256: Option<&str>) -> String {
    let poses = poses(document);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "flexid: " (name) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                (verdict::section(document, name))
                main {
                    (receptance::section(document, &poses))
                    (residuals::section(document))
                    (modes::section(document, &poses))
                    (parameters::section(document))
                    (correlations::section(document))
                    (held_out::section(document))
                    (course::section(document))
                    (quality::section(document))
                    (origin::section(document, name, sha256))
                }
            }
        }
    };
    page.into_string()
}

/// Each pose of the records once, in their order.
fn poses(document: &Document) -> Vec<Vec<f64>> {
    let mut poses: Vec<Vec<f64>> = Vec::new();
    for pose in &document.found.robot.found().poses {
        let is_known = |own: &Vec<f64>| own.iter().zip(pose).all(|(a, b)| (a - b).abs() <= 1e-3);
        if !poses.iter().any(is_known) {
            poses.push(pose.clone());
        }
    }
    poses
}

/// What stands where an entry of the file is missing.
fn missing(entry: &str) -> Markup {
    html! {
        p.missing {
            "The file has no entry " code { (entry) } ": an older flexid, or a fit without records, wrote it. Run "
            code { "flexid identify --json" } " again to see this part."
        }
    }
}
