//! The page: one file for each section, in the order in which a reader asks.

mod answer;
mod correlations;
mod course;
mod direction;
pub(crate) mod format;
mod held_out;
mod imperfections;
mod modes;
mod origin;
mod parameters;
mod path;
mod quality;
mod receptance;
mod residuals;
mod spectra;
mod verdict;

use flexid_pipeline::same_pose;
use flexid_prediction::Dynamics;
use flexid_prediction::modes::Mode;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::document::Document;

const STYLE: &str = include_str!("style.css");
/// Names of the axes of the tool centre point.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Degrees of freedom of a joint.
pub(crate) const DOFS: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];
/// Most poses and records that are drawn. Chosen: with their charts the page stays below 2 MiB; a result has at most 16.
const MOST_POSES: usize = 4;
const MOST_RECORDS: usize = MOST_POSES;

/// Renders the page of a result, of a file of this name and with this SHA-256.
///
/// Parts that the file does not have leave a sentence.
pub fn render(document: &Document, name: &str, sha256: Option<&str>) -> String {
    let (poses, others) = poses(document);
    let body = html! {
        header {
            p.file { "flexid report on " code { (name) } ": " (verdict::robot(document)) }
            (answer::section(document))
        }
        main {
            (verdict::section(document))
            @if document.is_static() {
                (parameters::section(document))
                h2 { "Details" }
                (correlations::section(document))
            } @else {
                (spectra::section(document))
                (parameters::section(document))
                (modes::section(document, &poses))
                (path::section(document))
                (residuals::section(document))
                (imperfections::section(document))
                h2 { "Details" }
                (receptance::section(document, &poses, others))
                (correlations::section(document))
                (held_out::section(document))
                (course::section(document))
                (quality::section(document))
            }
            (origin::section(document, name, sha256))
        }
    };
    whole(&format!("flexid: {name}"), &body)
}

/// A page with this title and body.
pub(crate) fn whole(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}

/// The robot in a pose of the records.
struct Pose<'a> {
    /// Joint angles, rad (m).
    angles: Vec<f64>,
    /// Motion of the robot there. `None` where it does not stand.
    dynamics: Option<Dynamics<'a>>,
    /// Modes up to the end of the band, the lowest first.
    modes: Vec<Mode>,
}

impl<'a> Pose<'a> {
    fn new(document: &'a Document, angles: Vec<f64>) -> Self {
        let robot = &document.found.robot;
        let [_, upper] = robot.band_hz();
        let dynamics = robot.at(&angles).ok();
        let modes = dynamics.as_ref().map(|own| own.modes(upper)).unwrap_or_default();
        Self { angles, dynamics, modes }
    }
}

/// The poses of the records that differ most, each once, and the number of others: the first, then again and again the one that is farthest from those
/// before it.
fn poses(document: &Document) -> (Vec<Pose<'_>>, usize) {
    let mut poses: Vec<&Vec<f64>> = Vec::new();
    for pose in &document.found.robot.found().poses {
        if !poses.iter().any(|own| same_pose(own, pose)) {
            poses.push(pose);
        }
    }
    let others = poses.len().saturating_sub(MOST_POSES);
    let distance = |one: &[f64], other: &[f64]| -> f64 {
        one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum()
    };
    let mut drawn: Vec<usize> = (0..poses.len().min(1)).collect();
    while drawn.len() < poses.len().min(MOST_POSES) {
        let nearest = |index: usize| {
            let all = drawn.iter().map(|own| distance(poses[*own], poses[index]));
            all.fold(f64::INFINITY, f64::min)
        };
        let farthest = (0..poses.len()).max_by(|a, b| nearest(*a).total_cmp(&nearest(*b)));
        drawn.extend(farthest);
    }
    drawn.sort_unstable();
    let drawn = drawn.into_iter().map(|index| Pose::new(document, poses[index].clone()));
    (drawn.collect(), others)
}

/// Contents that open by their title.
pub(crate) fn folded(title: &str, contents: &Markup) -> Markup {
    html! { details { summary { (title) } (contents) } }
}

/// A section that opens by its title.
fn folded_section(id: &str, title: &str, contents: &Markup) -> Markup {
    html! { section id=(id) { (folded(title, contents)) } }
}

/// A sentence where an entry of the file is missing.
fn missing(entry: &str) -> Markup {
    html! {
        p.missing {
            "The file has no entry " code { (entry) } ": an older flexid, or a fit without records, wrote it. Run "
            code { "flexid identify --json" } " again to see this part."
        }
    }
}
