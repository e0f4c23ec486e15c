//! What changed in a robot over many results, in words.

pub(crate) mod findings;
pub(crate) mod table;

use flexid_pipeline::text::count;
use flexid_prediction::PositiveEstimate;
use flexid_prediction::history::{History, Parameter};
use serde::Serialize;

use crate::compare::{in_words, name};
use findings::Findings;

/// Changes named in the verdict, at most.
const NAMED: usize = 3;

/// A history in words and numbers.
#[derive(Debug, Serialize)]
pub(crate) struct Told {
    /// The verdict, a line.
    pub(crate) verdict: String,
    /// True if something has changed.
    pub(crate) changed: bool,
    /// True if the newest finding has brought a change to light.
    pub(crate) newly: bool,
    /// Chance of a false change in the robot's life.
    pub(crate) level: f64,
    /// What to know before the numbers are believed, a line each.
    pub(crate) notes: Vec<String>,
    /// Unit of the growth of a line: `day`, or `finding` where findings have no date.
    pub(crate) per: &'static str,
    /// The findings, the oldest first.
    pub(crate) findings: Vec<Label>,
    /// The numbers.
    #[serde(flatten)]
    pub(crate) history: History,
}

/// Name of a finding.
#[derive(Debug, Serialize)]
pub(crate) struct Label {
    pub(crate) file: String,
    /// Date of its first record. `None` if the clock of its log shows none.
    pub(crate) date: Option<String>,
}

impl Told {
    /// Puts a history of these findings into words.
    pub(crate) fn new(findings: &Findings, history: History, level: f64) -> Self {
        let all = findings.used.iter().map(|(file, found)| Label {
            file: file.display().to_string(),
            date: found.date.clone(),
        });
        let all: Vec<Label> = all.collect();
        let newest = all.len() - 1;
        let mut steps = history.parameters.iter().flat_map(|own| &own.course.steps);
        Self {
            changed: history.parameters.iter().any(has_changed),
            newly: steps.any(|step| step.found == newest),
            level,
            notes: findings.notes.clone(),
            per: if findings.are_dated { "day" } else { "finding" },
            verdict: verdict(&history, &all),
            findings: all,
            history,
        }
    }

    /// The day of a finding, or its name where it has no date.
    pub(crate) fn when(&self, finding: usize) -> &str {
        when(&self.findings[finding])
    }
}

pub(crate) fn has_changed(parameter: &Parameter) -> bool {
    !parameter.course.steps.is_empty()
}

/// What happened to a parameter: the change to be shown, and its values before and after.
pub(crate) fn change(parameter: &Parameter) -> Option<(PositiveEstimate, [f64; 2])> {
    let course = &parameter.course;
    let newest = course.steps.last().filter(|_| !course.is_drift);
    newest
        .map(|step| (step.ratio, step.values))
        .or_else(|| course.line.map(|line| (line.ratio, line.values)))
}

/// Says that a change lies along a line, and how well.
fn along(parameter: &Parameter) -> String {
    let line = parameter.course.line.filter(|line| line.freedoms > 0);
    line.map_or(String::new(), |own| {
        format!(" along a line (χ²/dof {:.2})", own.chi_squared / own.freedoms as f64)
    })
}

fn when(label: &Label) -> &str {
    let day = label.date.as_deref().and_then(|date| date.split('T').next());
    day.unwrap_or(&label.file)
}

fn verdict(history: &History, findings: &[Label]) -> String {
    let [first, last] = [findings.first(), findings.last()].map(|own| own.map_or("", when));
    let over = format!("{}, {first} to {last}", count(findings.len() as u64, "finding"));
    let size = |own: &Parameter| {
        own.course.steps.iter().map(|step| step.deviations.abs()).fold(0.0, f64::max)
    };
    let mut changed: Vec<&Parameter> =
        history.parameters.iter().filter(|own| has_changed(own)).collect();
    changed.sort_by(|a, b| size(b).total_cmp(&size(a)));
    if changed.is_empty() {
        let of = history.parameters.len();
        return format!("unchanged: none of {of} parameters in {over}");
    }
    let named = changed.iter().take(NAMED).filter_map(|own| {
        let (ratio, _) = change(own)?;
        let name = name(&own.joint, own.dof, own.quantity);
        let since = match own.course.steps.last() {
            Some(step) if !own.course.is_drift => format!(" since {}", when(&findings[step.since])),
            _ => along(own),
        };
        Some(in_words(&name, &ratio) + &since)
    });
    let named: Vec<String> = named.collect();
    let more = match changed.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    format!("changed: {}{more}, in {over}", named.join("; "))
}
