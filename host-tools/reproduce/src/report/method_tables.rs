//! Tables 1 to 4: the results of the methods, beside those of the paper.

use maud::{Markup, html};

use super::format::{self, NOTHING, change, change_interval, count, probability, value};
use super::{BASELINE, Comparison, Measure, MethodRow, Origin, Tables, comparison, name, words};
use crate::statistics::POWER;
use crate::tables::Verdict;

/// One row for each method: its measure, and its difference to the baseline.
pub(super) fn methods(
    tables: &Tables,
    number: &str,
    caption: &str,
    rows: &[&MethodRow],
    measure: Measure,
) -> Markup {
    let largest = measure == Measure::DisplacementError;
    let difference = match measure {
        Measure::ParameterDeviation => "Delta baseline",
        Measure::DisplacementError => "Relative to baseline",
    };
    html! {
        table {
            caption { strong { (number) ". " } (caption) }
            thead {
                tr {
                    th.left rowspan="2" { "Method" }
                    th.group colspan=(if largest { 5 } else { 4 }) { (capitalised(words::measure(measure))) }
                    th.group colspan="5" { (difference) }
                    th.verdict rowspan="2" { "Verdict" }
                }
                tr {
                    th.first { "ours" } th { "95\u{a0}% CI" } th { "robots" }
                    @if largest { th { "largest" } }
                    th { "paper" }
                    (test_heads())
                }
            }
            tbody {
                @for (i, row) in rows.iter().enumerate() {
                    @let starts_own = row.origin == Origin::Flexid && i > 0 && rows[i - 1].origin != Origin::Flexid;
                    tr.own[starts_own] { (method_cells(tables, row, measure)) }
                }
            }
        }
        @let abbreviations = words::abbreviations(rows);
        @if !abbreviations.is_empty() { p.note { (abbreviations) "." } }
    }
}

fn method_cells(tables: &Tables, row: &MethodRow, measure: Measure) -> Markup {
    let (mean, paper, robots) = match measure {
        Measure::ParameterDeviation => {
            (Some(row.deviation), row.paper_deviation, row.deviations.len())
        }
        Measure::DisplacementError => {
            let robots = row.displacement_errors.len();
            (row.displacement_error, row.paper_displacement_error, robots)
        }
    };
    let shown = |x: Option<f64>| x.map_or(NOTHING.to_owned(), |x| value(measure, x));
    html! {
        th scope="row" { (words::short(&row.name)) }
        td.first.ours { (shown(mean.map(|mean| mean.mean))) }
        td { (mean.map_or(NOTHING.to_owned(), |m| format::value_interval(measure, m.interval))) }
        td { (robots) }
        @if measure == Measure::DisplacementError {
            td { (shown(row.largest_displacement_error)) }
        }
        td.paper { (shown(paper)) }
        @if row.key == BASELINE {
            td.first colspan="5" {} td {}
        } @else {
            (test_cells(comparison(tables, &row.key, BASELINE, measure)))
        }
    }
}

/// The comparisons of these methods among themselves; those with the baseline stand in the table above.
pub(super) fn against_each_other(tables: &Tables, rows: &[&MethodRow], measure: Measure) -> Markup {
    let among = |key: &str| key != BASELINE && rows.iter().any(|row| row.key == key);
    let comparisons: Vec<_> = tables
        .comparisons
        .iter()
        .filter(|c| c.measure == measure && among(&c.method) && among(&c.against))
        .collect();
    html! {
        @if !comparisons.is_empty() {
            table.each-other {
                caption { "The same methods against each other: difference of the " (words::measure(measure)) "." }
                thead {
                    tr { th.left { "Method" } th.left { "against" } (test_heads()) th.verdict { "Verdict" } }
                }
                tbody {
                    @for comparison in comparisons {
                        tr {
                            th scope="row" { (name(tables, &comparison.method)) }
                            td.left { (name(tables, &comparison.against)) }
                            (test_cells(Some(comparison)))
                        }
                    }
                }
            }
        }
    }
}

fn test_heads() -> Markup {
    html! { th.first { "ours" } th { "95\u{a0}% CI" } th { "p" } th { "paper" } th { "power" } }
}

/// A paired test beside the paper's figure, and the verdict.
fn test_cells(comparison: Option<&Comparison>) -> Markup {
    let Some(comparison) = comparison else {
        return html! {
            td.first { (NOTHING) } @for _ in 0..4 { td { (NOTHING) } } td.verdict { (NOTHING) }
        };
    };
    let or_dash = |x: Option<f64>, text: fn(f64) -> String| x.map_or(NOTHING.to_owned(), text);
    html! {
        td.first.ours { (change(comparison.effect)) }
        td { (change_interval(comparison.interval)) }
        td { (format::p(comparison.p)) }
        td.paper { (or_dash(comparison.paper_effect, change)) }
        td { (or_dash(comparison.power, probability)) }
        td.verdict { (verdict(comparison)) }
    }
}

fn verdict(comparison: &Comparison) -> Markup {
    let Some(verdict) = comparison.verdict else { return html! { (NOTHING) } };
    let word = words::verdict(verdict);
    let weak = comparison.power.is_some_and(|power| power < POWER);
    html! {
        span class=(word) { (word) }
        @if let (Verdict::Undecided, true, Some(pairs)) =
            (verdict, weak, comparison.pairs_for_power)
        {
            small { (count(pairs)) " robots needed" }
        }
    }
}

fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
