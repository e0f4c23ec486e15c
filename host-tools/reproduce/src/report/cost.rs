//! The cost of the sensitivities, and the parts and the time of every method.

use maud::{Markup, html};

use super::format::{count, seconds, times};
use super::{Origin, Tables};
use crate::tables::SensitivityCost;

pub(super) fn section(tables: &Tables) -> Markup {
    html! {
        section {
            h2 { "What it costs" }
            (claim(&tables.sensitivity_cost))
            table.narrow {
                caption { strong { "Table 5. " } "Cost of the sensitivities of one robot; wall time on one core." }
                thead { tr { th.left { "Sensitivities" } th { "model evaluations" } th { "share of a search" } th { "time" } } }
                tbody {
                    @for cost in &tables.sensitivity_cost {
                        tr {
                            th scope="row" { (cost.name) }
                            td { (count(cost.evaluations)) }
                            td { (share(cost.evaluations, tables.run.evaluations)) }
                            td { (seconds(cost.seconds)) }
                        }
                    }
                }
            }
            table.text {
                caption { strong { "Table 6. " } "The methods; wall time of one robot on one core, mean." }
                thead { tr { th.left { "Method" } th.left { "What it consists of" } th.left { "From" } th { "time" } } }
                tbody {
                    @for row in &tables.methods {
                        tr {
                            th scope="row" { (row.name) }
                            td.left { (row.description) }
                            td.left { (origin(row.origin)) }
                            td { (seconds(row.seconds)) }
                        }
                    }
                }
            }
        }
    }
}

/// The paper's claim, decided by the evaluations, which are the same in every run. The times are not.
fn claim(costs: &[SensitivityCost]) -> Markup {
    let find = |word: &str| costs.iter().find(|cost| cost.name.to_lowercase().contains(word));
    let (Some(jacobian), Some(gsa)) =
        (find("jacobian"), find("gsa").or_else(|| find("global sensitivity")))
    else {
        return html! {};
    };
    html! {
        p {
            "The paper says that the Jacobian needs “less computing time” than the global sensitivity analysis: "
            @if jacobian.evaluations < gsa.evaluations { "we agree. " } @else { "we do not agree. " }
            "For one robot the analysis takes " (count(gsa.evaluations)) " evaluations of the model (" (seconds(gsa.seconds))
            "), the Jacobian "
            @if jacobian.evaluations == 0 { "none" } @else { (count(jacobian.evaluations)) }
            " (" (seconds(jacobian.seconds)) ")"
            @if gsa.seconds > 0.0 && jacobian.seconds > 0.0 {
                span.seconds { ", " (times(gsa.seconds / jacobian.seconds)) " times less" }
            }
            "."
        }
    }
}

/// `evaluations` as a multiple of those that the search itself may spend.
fn share(evaluations: u64, budget: u64) -> String {
    if evaluations == 0 {
        return "0".to_owned();
    }
    let share = evaluations as f64 / budget as f64;
    if share < 1.0 { super::format::percent(share) } else { format!("{} ×", times(share)) }
}

fn origin(origin: Origin) -> &'static str {
    match origin {
        Origin::Paper => "paper",
        Origin::Rival => "rival",
        Origin::Flexid => "flexid",
    }
}
