//! Robots of one type as a population, in words.

pub(crate) mod robots;
pub(crate) mod table;

use flexid_pipeline::text::count;
use flexid_prediction::fleet::{Fleet, Judged, Parameter};
use serde::Serialize;

use crate::compare::{by, name};
use robots::Robots;

/// Robots named in the verdict, at most.
const NAMED: usize = 3;

/// A fleet in words and numbers.
#[derive(Debug, Serialize)]
pub(crate) struct Told {
    /// The verdict, a line.
    pub(crate) verdict: String,
    /// True if a robot is outside.
    pub(crate) outside: bool,
    /// Chance that a fleet without a robot outside has one called so.
    pub(crate) level: f64,
    /// What to know before the numbers are believed, a line each.
    pub(crate) notes: Vec<String>,
    /// The robots, in the order in which they are named.
    pub(crate) robots: Vec<Label>,
    /// The numbers.
    #[serde(flatten)]
    pub(crate) fleet: Fleet,
}

/// Name of a robot, and its result.
#[derive(Debug, Serialize)]
pub(crate) struct Label {
    pub(crate) name: String,
    pub(crate) file: String,
    /// Date of its first record. `None` if the clock of its log shows none.
    pub(crate) date: Option<String>,
}

/// A parameter in which a robot is outside.
pub(crate) struct Outside<'a> {
    pub(crate) robot: &'a str,
    pub(crate) parameter: &'a Parameter,
    /// In its unit.
    pub(crate) value: f64,
    pub(crate) judged: &'a Judged,
}

impl Told {
    /// Puts a fleet of these robots into words.
    pub(crate) fn new(robots: &Robots, fleet: Fleet, level: f64) -> Self {
        let all = robots.used.iter().map(|own| Label {
            name: own.name.clone(),
            file: own.file.display().to_string(),
            date: own.found.date.clone(),
        });
        let mut told = Self {
            verdict: String::new(),
            outside: false,
            level,
            notes: robots.notes.clone(),
            robots: all.collect(),
            fleet,
        };
        (told.verdict, told.outside) = (verdict(&told), !told.outside().is_empty());
        told
    }

    /// What is outside, the least likely first.
    pub(crate) fn outside(&self) -> Vec<Outside<'_>> {
        let parameters = self.fleet.parameters.iter();
        let members =
            parameters.flat_map(|own| own.shown.members.iter().map(move |member| (own, member)));
        let outside = members.filter(|(_, member)| member.is_outside);
        let mut outside: Vec<Outside<'_>> = outside
            .filter_map(|(parameter, member)| {
                let (robot, judged) = (&self.robots[member.robot].name, member.judged.as_ref()?);
                Some(Outside { robot, parameter, value: member.value, judged })
            })
            .collect();
        outside.sort_by(|a, b| b.judged.deviations.abs().total_cmp(&a.judged.deviations.abs()));
        outside
    }
}

fn verdict(told: &Told) -> String {
    let outside = told.outside();
    let robots = count(told.robots.len() as u64, "robot");
    let of = told.fleet.parameters.iter().filter(|own| own.shown.population.is_some()).count();
    if of == 0 {
        return format!("not compared: no parameter is determined by enough of {robots}");
    }
    if outside.is_empty() {
        return format!("alike: none of {robots} is outside in any of {of} parameters");
    }
    let named = outside.iter().take(NAMED).map(|own| {
        let Outside { robot, parameter, judged, .. } = own;
        let name = name(&parameter.joint, parameter.dof, parameter.quantity);
        let (is_less, by) = by(&judged.ratio);
        let side = if is_less { "below" } else { "above" };
        format!("{robot}: {name} {by} {side} the other {}", judged.others)
    });
    let named: Vec<String> = named.collect();
    let more = match outside.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    format!("outside: {}{more}, of {robots}", named.join("; "))
}
