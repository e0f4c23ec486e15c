//! Natural frequencies, damping ratios, and which joints move.

use flexid_prediction::PositiveEstimate;
use flexid_prediction::modes::Mode;
use maud::{Markup, html};

use super::format::{count, number, percent, pose, uncertainty};
use super::{AXES, DOFS, Pose, folded};
use crate::document::Document;

/// Words that stand in place of a number that says nothing.
const OPEN: &str = "not determined";
/// Most modes of a pose that are listed.
const MOST_MODES: usize = 12;
/// Least share of the strain energy of a degree of freedom that is named, and most of them.
const NAMED: f64 = 0.1;
const MOST_NAMED: usize = 4;

pub(super) fn section(document: &Document, poses: &[Pose<'_>]) -> Markup {
    let [_, upper] = document.found.robot.band_hz();
    html! {
        section #modes {
            h2 { "Modes" }
            p {
                "Modes up to " (number(upper)) "\u{a0}Hz, the end of the band that was fitted, with 95\u{a0}% intervals; a dash is what the \
                 records do not determine, and where the standard deviation is larger than the number itself, there is none. A mode moves what holds its strain energy."
            }
            @if let [first, others @ ..] = poses {
                (of_pose(document, 0, first))
                @if !others.is_empty() {
                    @let others = html! {
                        @for (index, pose) in others.iter().enumerate() { (of_pose(document, index + 1, pose)) }
                    };
                    (folded(&count(poses.len() - 1, "further pose"), &others))
                }
            }
        }
    }
}

fn of_pose(document: &Document, index: usize, pose: &Pose<'_>) -> Markup {
    html! {
        (table(document, index, pose))
        (stiffness(pose))
    }
}

fn table(document: &Document, index: usize, own: &Pose<'_>) -> Markup {
    let modes = &own.modes;
    html! {
        table {
            caption { strong { "Pose " (index + 1) } ", " (pose(&own.angles)) " rad (m)" }
            thead {
                tr {
                    th { "mode" } th { "frequency / Hz" } th { "interval" } th { "damping ratio" } th { "interval" }
                    th.left { "strain energy in" }
                }
            }
            tbody {
                @for (number, mode) in modes.iter().take(MOST_MODES).enumerate() {
                    tr {
                        td { (number + 1) }
                        (estimate(&mode.frequency_hz, 1.0, ""))
                        (estimate(&mode.damping_ratio, 100.0, " %"))
                        td.left { (movers(document, mode)) }
                    }
                }
                @if modes.is_empty() {
                    tr { td.left colspan="6" { "none in the band" } }
                }
            }
        }
        @if modes.len() > MOST_MODES {
            p.note { (count(modes.len() - MOST_MODES, "further mode")) " up to the end of the band." }
        }
    }
}

/// The static stiffness of the tool along each of its axes, as the inverse of its compliance there.
fn stiffness(own: &Pose<'_>) -> Markup {
    let compliance = own.dynamics.as_ref().and_then(|dynamics| {
        let compliance = dynamics.compliance()?;
        Some(dynamics.compliance_estimates(&compliance))
    });
    let Some(compliance) = compliance else { return Markup::default() };
    html! {
        p.note {
            "Stiffness at the tool along the axes of the tool centre point, N/µm, one axis loaded at a time: "
            @for axis in 0..3 {
                @let own = compliance[axis][axis];
                @let [most_stiff, least_stiff] = own.interval.map(|compliance| 1e-6 / compliance);
                @if axis > 0 { ", " }
                (AXES[axis]) " "
                @if !own.determined {
                    (OPEN)
                } @else {
                    (number(1e-6 / own.value))
                    // A compliance whose interval reaches zero has no largest stiffness.
                    @if most_stiff > 0.0 {
                        " (" (uncertainty(1e-6 / own.value, [least_stiff, most_stiff])) ")"
                    } @else {
                        " (above " (number(least_stiff)) ")"
                    }
                }
            }
            "."
        }
    }
}

/// The cells of a value and its interval.
fn estimate(estimate: &PositiveEstimate, times: f64, unit: &str) -> Markup {
    html! {
        @if estimate.is_observable() {
            td.ours { (number(times * estimate.value)) (unit) }
            td { (uncertainty(estimate.value, estimate.interval)) }
        } @else if estimate.determined {
            td { (number(times * estimate.value)) (unit) }
            td { "–" }
        } @else {
            td { "–" }
            td { (OPEN) }
        }
    }
}

/// The degrees of freedom that hold most of the strain energy.
fn movers(document: &Document, mode: &Mode) -> String {
    let joints = document.found.joints.iter().zip(&mode.energy);
    let mut all: Vec<(f64, String)> = joints
        .flat_map(|(joint, energy)| {
            DOFS.into_iter()
                .zip(energy)
                .map(|(dof, share)| (*share, format!("{} {dof}", joint.name)))
        })
        .collect();
    all.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    let named = all.iter().take(MOST_NAMED).enumerate();
    let named = named.filter(|(place, (share, _))| *place == 0 || *share >= NAMED);
    let named: Vec<String> =
        named.map(|(_, (share, name))| format!("{name} {}", percent(*share))).collect();
    named.join(", ")
}
