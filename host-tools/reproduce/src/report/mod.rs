//! `report.html`: the results of a reproduction, as one page that needs no other file.
//!
//! The page is a pure function of the [`Tables`]: the same tables give the same bytes. Only wall times differ between
//! two runs. They stand in elements of the class `seconds`.

mod background;
mod cost;
mod figures;
mod format;
mod method_tables;
mod summary;
mod words;

#[cfg(test)]
mod fixture;
#[cfg(test)]
mod tests;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::tables::{Comparison, Measure, MethodRow, Origin, Tables};

const PAPER: &str = "Jacobian-Sensitivity Approach for Identifying Machine Dynamic Model Parameters of Robots with \
                     Flexible Joints";
const STYLE: &str = include_str!("style.css");

/// Key of the method with which the paper compares all others.
const BASELINE: &str = "baseline";
/// Rows of Table 1.
const ADAPTIONS: [&str; 6] = [BASELINE, "mse", "ssp", "lo", "abg", "abl"];
/// Rows of Tables 2 and 3, lines of Fig. 4.
const COMBINATIONS: [&str; 4] = [BASELINE, "adapted", "gsa", "jacobian"];

/// Renders the page. Values that are not finite, and lists that are empty, leave a dash or a sentence, never a broken
/// page.
pub fn render(tables: &Tables) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "flexid: the paper, reproduced" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "flexid: the paper, reproduced" }
                    p.subtitle { (PAPER) }
                }
                main {
                    (summary::section(tables))
                    (adaptions(tables))
                    (combinations(tables))
                    (validation(tables))
                    (rivals(tables))
                    (illustration(tables))
                    (cost::section(tables))
                    (background::choices(tables))
                    (background::tests(tables))
                }
            }
        }
    };
    page.into_string()
}

fn adaptions(tables: &Tables) -> Markup {
    let measure = Measure::ParameterDeviation;
    html! {
        section {
            h2 { "Adaptions to the baseline" }
            (method_tables::methods(
                tables,
                "Table 1",
                "Results from adaptions of Section 3: the baseline with one thing changed at a time.",
                &rows(tables, &ADAPTIONS),
                measure,
            ))
        }
    }
}

fn combinations(tables: &Tables) -> Markup {
    let measure = Measure::ParameterDeviation;
    let rows = rows_and_own(tables, &COMBINATIONS);
    html! {
        section {
            h2 { "Sensitivity-based optimization" }
            (method_tables::methods(
                tables,
                "Table 2",
                "Results from sensitivity-based optimization; below the line, what the paper does not have. Means are over the robots \
                 that a method met, differences over those that both met; the paper's are those of its own Table 1 and \
                 of the differences in its section 5.1.",
                &rows,
                measure,
            ))
            (method_tables::against_each_other(tables, &rows, measure))
            (figures::course::combinations(tables))
        }
    }
}

fn validation(tables: &Tables) -> Markup {
    let measure = Measure::DisplacementError;
    let rows = rows_and_own(tables, &COMBINATIONS);
    html! {
        section {
            h2 { "Validation on unseen experiments" }
            (method_tables::methods(
                tables,
                "Table 3",
                "Validation results: displacement error in experiments that were not identified from. Median over \
                 directions and experiments, geometric mean over the first robots, which all of these methods met; largest of any robot, direction \
                 and experiment. \
                 The paper's changes are computed from its rounded errors.",
                &rows,
                measure,
            ))
            (method_tables::against_each_other(tables, &rows, measure))
            p {
                "Compare changes, not levels: they depend on the damping, and that of the paper's robot is not known."
                @if tables.run.scenario.is_none() {
                    " The reference scenario's rings with a damping ratio of about 1\u{a0}%, where stiffnesses that are wrong \
                     by a thousandth are a displacement error of about a hundredth."
                }
            }
            (figures::displacement::figure(tables))
        }
    }
}

fn rivals(tables: &Tables) -> Markup {
    let of_origin = |origin| tables.methods.iter().filter(move |row| row.origin == origin);
    let rivals: Vec<_> =
        method(tables, BASELINE).into_iter().chain(of_origin(Origin::Rival)).collect();
    html! {
        section {
            h2 { "Rivals of the random search" }
            p {
                "The paper says that random search outperformed genetic algorithms and particle swarm optimization, \
                 and gives no figures. Here each may spend as many evaluations as the baseline, on the same loss."
            }
            (method_tables::methods(
                tables,
                "Table 4",
                "Other optimizers against the paper's baseline.",
                &rivals,
                Measure::ParameterDeviation,
            ))
            (figures::course::rivals(tables, &rivals))
        }
    }
}

fn illustration(tables: &Tables) -> Markup {
    html! {
        section {
            h2 { "How the search proceeds" }
            (figures::search::figure(&tables.search))
        }
    }
}

fn method<'a>(tables: &'a Tables, key: &str) -> Option<&'a MethodRow> {
    tables.methods.iter().find(|row| row.key == key)
}

/// The methods of these keys that were run.
fn rows<'a>(tables: &'a Tables, keys: &[&str]) -> Vec<&'a MethodRow> {
    keys.iter().filter_map(|key| method(tables, key)).collect()
}

/// The methods of these keys that were run, and flexid's own.
fn rows_and_own<'a>(tables: &'a Tables, keys: &[&str]) -> Vec<&'a MethodRow> {
    let own = tables.methods.iter().filter(|row| row.origin == Origin::Flexid);
    rows(tables, keys).into_iter().chain(own).collect()
}

/// The paper's name of a method, in short.
fn name<'a>(tables: &'a Tables, key: &'a str) -> &'a str {
    method(tables, key).map_or(key, |row| words::short(&row.name))
}

fn comparison<'a>(
    tables: &'a Tables,
    method: &str,
    against: &str,
    measure: Measure,
) -> Option<&'a Comparison> {
    tables.comparisons.iter().find(|comparison| {
        comparison.method == method
            && comparison.against == against
            && comparison.measure == measure
    })
}
