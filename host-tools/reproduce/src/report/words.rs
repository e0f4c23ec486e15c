//! Comparisons in words.

use super::format::{change, change_interval, count, number, p_in_words, probability};
use super::{Comparison, Measure, MethodRow, Tables, name};
use crate::statistics::POWER;
use crate::tables::Verdict;

/// Name of a measure.
pub(super) fn measure(measure: Measure) -> &'static str {
    match measure {
        Measure::ParameterDeviation => "parameter deviation",
        Measure::DisplacementError => "displacement error",
    }
}

/// The verdict on the paper's claim, in one word.
pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "agrees",
        Verdict::Contradicts => "contradicts",
        Verdict::Undecided => "undecided",
    }
}

/// The part of "Look Outside (LO)" that is in brackets; the whole of a name without brackets.
pub(super) fn short(name: &str) -> &str {
    brackets(name).map_or(name, |(_, short)| short)
}

/// The long names of methods with a short name.
pub(super) fn abbreviations(rows: &[&MethodRow]) -> String {
    let explained = rows.iter().filter_map(|row| brackets(&row.name));
    explained.map(|(long, short)| format!("{short}: {long}")).collect::<Vec<_>>().join("; ")
}

fn brackets(name: &str) -> Option<(&str, &str)> {
    let (long, short) = name.strip_suffix(')')?.split_once(" (")?;
    (!short.is_empty()).then_some((long, short))
}

/// One sentence on the result of a comparison and on the paper's claim.
pub(super) fn sentence(tables: &Tables, comparison: &Comparison) -> String {
    let [method, against] =
        [&comparison.method, &comparison.against].map(|key| name(tables, key.as_str()));
    let measure = measure(comparison.measure);
    let subject = match comparison.verdict {
        Some(Verdict::Undecided) => format!("{method} against {against}, {measure}"),
        _ if comparison.effect < 0.0 => format!("{method} has a lower {measure} than {against}"),
        _ => format!("{method} has a higher {measure} than {against}"),
    };
    let [low, high] = comparison.interval;
    let paper = match comparison.paper_effect {
        Some(effect) if effect < low || effect > high => {
            format!("the paper has {}, outside this interval", change(effect))
        }
        Some(effect) => format!("the paper has {}", change(effect)),
        None => "the paper says without figures that random search is better".to_owned(),
    };
    let mut sentence = format!("{subject}: {}; {paper}", test(comparison));
    if let Some(doubt) = doubt(comparison) {
        sentence += &format!(". {doubt}");
    }
    sentence + "."
}

/// Effect, interval and p of a comparison.
pub(super) fn test(comparison: &Comparison) -> String {
    format!(
        "{} (95\u{a0}%\u{a0}CI {}, {})",
        change(comparison.effect),
        change_interval(comparison.interval),
        p_in_words(comparison.p)
    )
}

/// A sentence on the power of an undecided test.
fn doubt(comparison: &Comparison) -> Option<String> {
    let power = comparison.power.filter(|power| power.is_finite())?;
    if comparison.verdict != Some(Verdict::Undecided) {
        return None;
    }
    if power >= POWER {
        let [low, high] = comparison.interval;
        let excluded = comparison.paper_effect.is_some_and(|effect| effect < low || effect > high);
        return Some(format!(
            "The test would have seen the paper's effect with a probability of {}: {}",
            probability(power),
            if excluded {
                "here it is smaller, or the other way"
            } else {
                "it has not, and does not exclude it"
            },
        ));
    }
    let seen = format!(
        "The test would have seen the paper's effect with a probability of {} only",
        probability(power)
    );
    Some(match comparison.pairs_for_power {
        Some(pairs) => {
            format!("{seen}; {} robots would be needed for {}", count(pairs), number(POWER, 1))
        }
        None => seen,
    })
}
