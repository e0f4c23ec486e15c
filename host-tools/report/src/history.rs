//! The page on a history: what changed in a robot, and the course of each parameter.

use flexid_pipeline::names::{DAMPING_UNITS, STIFFNESS_UNITS};
use flexid_prediction::history::{Course, History, Parameter, Point, Step};
use flexid_prediction::parameter::Quantity;
use flexid_prediction::{PositiveEstimate, TWO_SIDED};
use maud::{Markup, html};

use crate::charts::panel::{Band, Curve, Labels, Panel};
use crate::charts::scale::Scale;
use crate::charts::{Colour, Mark, legend, svg, svg_of};
use crate::page::{DOFS, folded, format, whole};

/// Height of the picture of what has changed, and size of that of another parameter, pixels.
const HEIGHT: u32 = 760;
const SIZE: (u32, u32) = (1100, 560);
/// Radius of a dot among few and among many findings, pixels, and the room that dots share.
const DOTS: [u32; 2] = [4, 12];
const ROOM: u32 = 2400;
/// Most points of a curve. Chosen: more are not told apart in a picture of this width, and the page stays small.
const MOST_POINTS: usize = 400;
/// Half of a 95 % interval, standard deviations.
const WITHIN: f64 = TWO_SIDED;

/// A history, and what is said of it.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// The verdict, a line.
    pub verdict: &'a str,
    /// What to know before the numbers are believed, a line each.
    pub notes: &'a [String],
    /// Chance of a false change in the robot's life.
    pub level: f64,
    /// Unit of time: `day` or `finding`.
    pub per: &'a str,
    /// The findings, the oldest first.
    pub findings: &'a [Finding],
    /// The numbers.
    pub history: &'a History,
}

/// A finding, as the page names it.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Name of its file.
    pub name: String,
    /// Its day, or its name where it has none.
    pub when: String,
    /// Its time after the first, in the unit of the page.
    pub time: f64,
}

/// Renders the page.
pub fn render(page: &Page<'_>) -> String {
    let has_changed = |own: &&Parameter| !own.course.steps.is_empty();
    let changed: Vec<&Parameter> = page.history.parameters.iter().filter(has_changed).collect();
    let class = if changed.is_empty() { "good" } else { "caution" };
    whole(
        "flexid: history",
        &html! {
            header {
                p.file { "flexid history of " (format::count(page.findings.len(), "finding")) }
                h1 class=(class) { (page.verdict) }
            }
            main {
                @if !page.notes.is_empty() {
                    ul { @for note in page.notes { li { (note) } } }
                }
                @if !changed.is_empty() {
                    section #changed {
                        h2 { "What has changed" }
                        p {
                            "In a robot that stays the same, one such change in its whole life has a chance below "
                            (format::percent(page.level)) ". Errors that all findings share, such as gains and masses, cancel in a change."
                        }
                        (marks())
                        @for own in &changed { (changed_figure(page, own)) }
                        (table(page, &changed))
                    }
                }
                section #all {
                    h2 { "All parameters" }
                    p { "Change in per cent of the beginning, by the time. " (determined(page)) }
                    (marks())
                    @for (joint, own) in joints(page) {
                        (folded(joint, &html! {
                            div.panels { @for own in own { figure { (small(page, own)) } } }
                        }))
                    }
                }
                section #findings {
                    (folded("Findings", &html! {
                        table.narrow.files {
                            thead { tr { th.left { "from" } th.left { "file" } } }
                            tbody { @for own in page.findings { tr { td.left { (own.when) } td.left { (own.name) } } } }
                        }
                    }))
                }
            }
        },
    )
}

fn marks() -> Markup {
    legend(&[
        ("finding", Colour::Blue, Mark::Dot),
        ("its 95 % interval", Colour::Blue, Mark::Area),
        ("course", Colour::Orange, Mark::Line),
    ])
}

fn determined(page: &Page<'_>) -> String {
    let History { parameters, all, reference_hz } = page.history;
    let own = parameters.len();
    format!(
        "{own} of {all} are determined by two findings or more; with hysteresis they are the values at {reference_hz:.1} Hz."
    )
}

/// The parameters of each joint.
fn joints<'a>(page: &Page<'a>) -> Vec<(&'a str, &'a [Parameter])> {
    let all = page.history.parameters.chunk_by(|one, other| one.joint == other.joint);
    all.map(|own| (own[0].joint.as_str(), own)).collect()
}

fn name(own: &Parameter) -> String {
    let quantity = match own.quantity {
        Quantity::Stiffness => "stiffness",
        Quantity::Damping => "damping",
    };
    format!("{} {} {quantity}", own.joint, DOFS[own.dof])
}

fn changed_figure(page: &Page<'_>, own: &Parameter) -> Markup {
    let label = format!("Course of {}", name(own));
    let first = page.findings.first().map_or("", |own| own.when.as_str());
    let x = match page.per {
        "day" => format!("days since {first}"),
        _ => "number of the finding, from 0".to_owned(),
    };
    let panel = panel(page, own, Labels { x: Some(x), y: Some("change / %".into()) });
    html! {
        figure {
            figcaption { strong { (name(own)) } }
            (svg(HEIGHT, &label, |canvas| panel.draw(canvas)))
        }
    }
}

fn small(page: &Page<'_>, own: &Parameter) -> Markup {
    let labels = Labels { x: Some(String::new()), y: Some(String::new()) };
    let mut panel = panel(page, own, labels);
    panel.title = name(own);
    svg_of(SIZE, &format!("Course of {}", name(own)), |canvas| panel.draw(canvas))
}

/// The findings, their intervals, and the course through them, in per cent of the first value of the course.
fn panel(page: &Page<'_>, own: &Parameter, labels: Labels) -> Panel {
    let Course { points, steps, line, is_drift } = &own.course;
    let time = |finding: usize| page.findings.get(finding).map_or(0.0, |own| own.time);
    let newest = points.last().map_or(0.0, |own| time(own.finding));
    let by_line = || line.map(|line| vec![(0, line.values[0]), (points.len() - 1, line.values[1])]);
    // Corners of the course: number of the point, and value.
    let corners: Vec<(f64, f64)> = if steps.is_empty() || *is_drift {
        let ends = by_line().unwrap_or_default();
        ends.into_iter().map(|(point, value)| (time(points[point].finding), value)).collect()
    } else {
        stairs(steps, time, points.first().map_or(0.0, |own| time(own.finding)), newest)
    };
    let base = corners.first().map_or(1.0, |(_, value)| *value);
    let per_cent = |value: f64| 100.0 * (value / base - 1.0);
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    let drawn = points.iter().rev().step_by(every).collect::<Vec<_>>();
    let drawn = || drawn.iter().rev();
    let ends = |own: &Point| {
        [-WITHIN, WITHIN].map(|at| per_cent(own.value * (at * own.relative_std).exp()))
    };
    let band: Vec<(f64, [f64; 2])> = drawn().map(|own| (time(own.finding), ends(own))).collect();
    let dots = drawn().map(|own| (time(own.finding), per_cent(own.value)));
    let course: Vec<(f64, Option<f64>)> =
        corners.iter().map(|(at, value)| (*at, Some(per_cent(*value)))).collect();
    let all = band.iter().flat_map(|(_, ends)| ends.iter().copied());
    let all =
        all.chain(course.iter().filter_map(|(_, value)| *value)).filter(|own| own.is_finite());
    let [low, high] = [all.clone().fold(0.0, f64::min), all.fold(0.0, f64::max)];
    let room = 0.05 * (high - low);
    let last = page.findings.last().map_or(1.0, |own| own.time);
    let [few, many] = [DOTS[1], DOTS[0]];
    let radius = (ROOM / (4 * points.len().max(1) as u32)).clamp(many, few);
    Panel {
        x: Scale::round([0.0, last]),
        y: Scale::round([low - room, high + room]),
        title: String::new(),
        labels,
        bands: vec![Band { colour: Colour::Blue, points: band }],
        curves: vec![
            Curve::dots(Colour::Blue, radius, dots),
            Curve { colour: Colour::Orange, width: 6, points: course },
        ],
    }
}

/// The corners of a course by steps.
fn stairs(steps: &[Step], time: impl Fn(usize) -> f64, first: f64, newest: f64) -> Vec<(f64, f64)> {
    let mut corners = vec![(first, steps[0].values[0])];
    for step in steps {
        let at = time(step.since);
        corners.extend([(at, step.values[0]), (at, step.values[1])]);
    }
    corners.push((newest, steps[steps.len() - 1].values[1]));
    corners
}

fn table(page: &Page<'_>, changed: &[&Parameter]) -> Markup {
    let when = |finding: usize| page.findings.get(finding).map_or("", |own| own.when.as_str());
    let unit = |own: &Parameter| match own.quantity {
        Quantity::Stiffness => STIFFNESS_UNITS[own.dof],
        Quantity::Damping => DAMPING_UNITS[own.dof],
    };
    let row = |name: &str,
               since: &str,
               values: [f64; 2],
               unit: &str,
               ratio: &PositiveEstimate,
               found: &str| {
        let [low, high] = ratio.interval.map(|own| format::percent(own - 1.0));
        html! {
            tr {
                th.left scope="row" { (name) }
                td.left { (since) }
                td { (format::in_unit(values[0], unit)) }
                td { (format::in_unit(values[1], unit)) }
                td { (format::percent(ratio.value - 1.0)) }
                td { (low) " to " (high) }
                td.left { (found) }
            }
        }
    };
    html! {
        table {
            thead { tr {
                th.left { "parameter" } th.left { "since" } th { "from" } th { "to" } th { "change" } th { "95\u{a0}%" } th.left { "found by that of" }
            } }
            tbody {
                @for own in changed {
                    @match own.course.line.filter(|_| own.course.is_drift) {
                        Some(line) => {
                            (row(&name(own), "along a line", line.values, unit(own), &line.ratio, when(own.course.steps[0].found)))
                        }
                        None => {
                            @for step in &own.course.steps {
                                (row(&name(own), when(step.since), step.values, unit(own), &step.ratio, when(step.found)))
                            }
                        }
                    }
                }
            }
        }
    }
}
