//! Stiffnesses and dampings: as a picture and as a table.

use flexid_pipeline::names::{DAMPING_UNITS, STIFFNESS_UNITS};
use flexid_wire::report::Verdict;
use maud::{Markup, html};
use plotters::prelude::*;

use super::DOFS;
use super::format::{in_unit, uncertainty};
use crate::charts::scale::Scale;
use crate::charts::{Canvas, Colour, Drawn, Mark, SOFT, legend, svg};
use crate::document::Document;

/// Height of a row of the picture, pixels; of axis and title.
const ROW: u32 = 35;
const AROUND: u32 = 190;
const FONT: f64 = 32.0;
/// Room for the names, and letters of a joint's name for which there is room beside its degree of freedom, pixels.
const NAMES: u32 = 400;
const LETTERS: usize = 18;

/// Class of a verdict in the style sheet.
pub(super) fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identified => "identified",
        Verdict::Weak => "weak",
        Verdict::NotObservable => "unobservable",
        Verdict::Fixed => "fixed",
    }
}

fn words(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identified => "identified",
        Verdict::Weak => "weak",
        Verdict::NotObservable => "not observable",
        Verdict::Fixed => "fixed",
    }
}

fn colour(verdict: Verdict) -> Colour {
    match verdict {
        Verdict::Identified => Colour::Green,
        Verdict::Weak => Colour::Orange,
        Verdict::NotObservable => Colour::Grey,
        Verdict::Fixed => Colour::Blue,
    }
}

/// A stiffness or a damping.
#[derive(Clone, Debug)]
struct Parameter {
    joint: String,
    dof: usize,
    is_damping: bool,
    value: f64,
    interval: Option<[f64; 2]>,
    verdict: Verdict,
}

impl Parameter {
    fn unit(&self) -> &'static str {
        let units = if self.is_damping { DAMPING_UNITS } else { STIFFNESS_UNITS };
        units[self.dof]
    }
}

pub(super) fn section(document: &Document) -> Markup {
    let parameters = parameters(document);
    let have_none = parameters.iter().all(|own| own.interval.is_none());
    html! {
        section #parameters {
            h2 { "Parameters" }
            p {
                "Each dot is a parameter, its whisker the 95\u{a0}% interval. Translations "
                code { "tx ty tz" } " are along, rotations " code { "rx ry rz" } " about the axes of the joint's frame."
                @if !document.is_static() {
                    (format!(" With hysteresis these are the values at {:.1} Hz.", document.found.robot.reference_hz()))
                }
                @if have_none { " There are no intervals: the fit is not trusted, or the file does not have them." }
            }
            (legend(&[
                ("identified", Colour::Green, Mark::Dot),
                ("weak", Colour::Orange, Mark::Dot),
                ("not observable (hollow)", Colour::Grey, Mark::Dot),
                ("fixed", Colour::Blue, Mark::Dot),
            ]))
            figure { (picture(document, &parameters)) }
            (table(document, &parameters))
        }
    }
}

fn parameters(document: &Document) -> Vec<Parameter> {
    let intervals = document.further.confidence.as_ref().map_or(&[][..], |own| &own.joints);
    let mut all = Vec::new();
    for (index, joint) in document.found.joints.iter().enumerate() {
        for is_damping in [false, true] {
            for dof in 0..6 {
                let (value, verdict) = if is_damping {
                    (joint.damping[dof], joint.damping_verdict[dof])
                } else {
                    (joint.stiffness[dof], joint.stiffness_verdict[dof])
                };
                let interval = intervals.get(index).and_then(|own| {
                    if is_damping { own.damping_interval[dof] } else { own.stiffness_interval[dof] }
                });
                let joint = joint.name.to_string();
                all.push(Parameter { joint, dof, is_damping, value, interval, verdict });
            }
        }
    }
    all
}

/// A panel for each unit. Static tests show no damping.
fn picture(document: &Document, parameters: &[Parameter]) -> Markup {
    let groups = [
        ("stiffness of translations / (N/m)", false, 0..3),
        ("stiffness of rotations / (Nm/rad)", false, 3..6),
        ("damping of translations / (Ns/m)", true, 0..3),
        ("damping of rotations / (Nms/rad)", true, 3..6),
    ];
    let of = |is_damping: bool, dofs: &std::ops::Range<usize>| -> Vec<&Parameter> {
        let wanted = |own: &&Parameter| own.is_damping == is_damping && dofs.contains(&own.dof);
        parameters.iter().filter(wanted).collect()
    };
    let rows = parameters.len() / 4;
    let lines = kinds(document);
    let height = lines as u32 * (rows as u32 * ROW + AROUND);
    svg(height, "Parameters with their 95 % intervals", |canvas| {
        let panels = canvas.split_evenly((lines, 2));
        for ((title, is_damping, dofs), panel) in groups.iter().zip(&panels) {
            draw(panel, title, &of(*is_damping, dofs))?;
        }
        Ok(())
    })
}

fn draw(canvas: &Canvas<'_>, title: &str, parameters: &[&Parameter]) -> Drawn {
    // What is hardly known would hide what is.
    let ends = |own: &&Parameter| {
        let [low, high] = own.interval.unwrap_or([own.value; 2]);
        [low.max(0.1 * own.value), high.min(10.0 * own.value), 0.5 * own.value, 2.0 * own.value]
    };
    let x = Scale::around(parameters.iter().flat_map(ends));
    // The first row is on top.
    let rows = (0..parameters.len()).map(|row| -(row as f64));
    let y = Scale::linear([0.4 - parameters.len() as f64, 0.6], rows.collect());
    let mut chart = ChartBuilder::on(canvas)
        .margin(8)
        .margin_right(40)
        .x_label_area_size(116)
        .y_label_area_size(NAMES)
        .build_cartesian_2d(x.clone(), y)?;
    let name = |row: &f64| {
        let own = parameters.get(-row.round() as usize);
        own.map_or_else(String::new, |own| format!("{} {}", short(&own.joint), DOFS[own.dof]))
    };
    chart
        .configure_mesh()
        .x_desc(title)
        .max_light_lines(0)
        .bold_line_style(SOFT.mix(0.25).stroke_width(2))
        .axis_style(SOFT.stroke_width(2))
        .label_style(("sans-serif", FONT))
        .axis_desc_style(("sans-serif", FONT))
        .set_all_tick_mark_size(8)
        .y_label_formatter(&name)
        .draw()?;
    for (row, own) in parameters.iter().enumerate() {
        let row = -(row as f64);
        let place = |value: f64| x.end_place(value);
        let style = colour(own.verdict).rgb();
        if let Some([low, high]) = own.interval
            && let (Some(low), Some(high)) = (place(low), place(high))
        {
            chart.draw_series([PathElement::new(
                [(low, row), (high, row)],
                style.stroke_width(5),
            )])?;
            for end in [low, high] {
                let cap = [(end, row - 0.22), (end, row + 0.22)];
                chart.draw_series([PathElement::new(cap, style.stroke_width(4))])?;
            }
        }
        if let Some(at) = x.place(own.value) {
            let filled = own.verdict != Verdict::NotObservable;
            let style = if filled { style.filled() } else { style.stroke_width(4) };
            chart.draw_series([Circle::new((at, row), 9, style)])?;
        }
    }
    Ok(())
}

/// Kinds of parameters that are shown: stiffnesses, and dampings if there are records.
fn kinds(document: &Document) -> usize {
    if document.is_static() { 1 } else { 2 }
}

/// A name that fits beside the picture.
fn short(name: &str) -> String {
    if name.chars().count() <= LETTERS {
        return name.to_owned();
    }
    let end: Vec<char> = name.chars().rev().take(LETTERS - 1).collect();
    format!("…{}", end.into_iter().rev().collect::<String>())
}

fn table(document: &Document, parameters: &[Parameter]) -> Markup {
    let kinds = kinds(document);
    html! {
        table.parameters {
            caption {
                strong { "Parameters with 95\u{a0}% intervals" }
            }
            thead {
                tr {
                    th {}
                    @for kind in &["stiffness", "damping"][..kinds] { th.group colspan="3" { (kind) } }
                }
                tr {
                    th {}
                    @for _ in 0..kinds {
                        th { "value" } th { "interval" } th.left { "verdict" }
                    }
                }
            }
            @for (index, joint) in document.found.joints.iter().enumerate() {
                tbody {
                    tr.joint { th.left colspan=(1 + 3 * kinds) { (joint.name) } }
                    @for dof in 0..6 {
                        tr {
                            th scope="row" { (DOFS[dof]) }
                            @for kind in 0..kinds {
                                (cells(&parameters[12 * index + 6 * kind + dof]))
                            }
                        }
                    }
                }
            }
        }
    }
}

fn cells(own: &Parameter) -> Markup {
    html! {
        td class=(if own.verdict == Verdict::NotObservable { "open" } else { "ours" }) { (in_unit(own.value, own.unit())) }
        td { (own.interval.map_or_else(|| "–".to_owned(), |ends| uncertainty(own.value, ends))) }
        td class={ "left " (class(own.verdict)) } { (words(own.verdict)) }
    }
}
