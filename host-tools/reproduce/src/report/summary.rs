//! The summary: what was run, where the results agree with the paper, and how far flexid goes beyond it.

use maud::{Markup, html};

use super::format::{self, count, times, value, value_interval};
use super::{Comparison, Measure, MethodRow, Origin, Tables, name, words};
use crate::tables::Verdict;

/// Number of iterations after which the paper takes its figures.
const PAPER_ITERATIONS: u32 = 500;

pub(super) fn section(tables: &Tables) -> Markup {
    html! {
        section {
            p { (run(tables)) " It took " (format::seconds(tables.seconds)) "." }
            p { (count_of_verdicts(tables)) }
            @if tables.run.iterations != PAPER_ITERATIONS {
                p { strong {
                    "The paper's figures are those after " (PAPER_ITERATIONS) " iterations; this run has "
                    (tables.run.iterations) ", so nothing below is a verdict on them."
                } }
            }
            (list(tables, Verdict::Agrees, "Where the direction is the paper's"))
            (list(tables, Verdict::Contradicts, "Where it is not"))
            (list(tables, Verdict::Undecided, "Where our robots do not decide it"))
            (beyond(tables))
        }
    }
}

fn run(tables: &Tables) -> String {
    let run = &tables.run;
    format!(
        "{} robots with {} parameters each were drawn uniformly from the bounds of {}, and identified from {} experiments; \
         the tables say how many of them each method met. Every search of the paper and every rival had {} evaluations of the model to spend on a robot (the \
         random search: {} iterations of {} samples); those for sensitivities come on top (Table 5). The fits were tried \
         on {} experiments that no method had seen. Seed {}, SIMD level {}.",
        run.robots,
        run.parameters,
        run.scenario.as_deref().unwrap_or("the reference scenario"),
        run.experiments,
        count(run.evaluations),
        run.iterations,
        run.samples,
        run.unseen,
        run.seed,
        run.simd,
    )
}

fn paper_comparisons(
    tables: &Tables,
    verdict: Verdict,
) -> impl Iterator<Item = &Comparison> + Clone {
    tables.comparisons.iter().filter(move |comparison| comparison.verdict == Some(verdict))
}

fn count_of_verdicts(tables: &Tables) -> String {
    let [agree, contradict, undecided] =
        [Verdict::Agrees, Verdict::Contradicts, Verdict::Undecided]
            .map(|verdict| paper_comparisons(tables, verdict).count());
    let of_another_size = |comparison: &&Comparison| {
        let [low, high] = comparison.interval;
        comparison.paper_effect.is_some_and(|effect| effect < low || effect > high)
    };
    let other = paper_comparisons(tables, Verdict::Agrees).filter(of_another_size).count();
    format!(
        "Of {} comparisons that the paper makes, {agree} are significant and as in the paper ({other} of them not in size: the \
         paper's effect lies outside our interval), {contradict} significant and the other way, {undecided} not significant. All are paired tests over the robots; negative is better. Differences \
         of the parameter deviation are percent of the bound range, those of the displacement error are relative.",
        agree + contradict + undecided,
    )
}

fn list(tables: &Tables, verdict: Verdict, title: &str) -> Markup {
    let comparisons = paper_comparisons(tables, verdict);
    html! {
        @if comparisons.clone().next().is_some() {
            h3 { (title) }
            ul class={ "findings " (words::verdict(verdict)) } {
                @for comparison in comparisons {
                    li { (words::sentence(tables, comparison)) }
                }
            }
        }
    }
}

fn beyond(tables: &Tables) -> Markup {
    let own = tables.methods.iter().filter(|row| row.origin == Origin::Flexid);
    html! {
        @if own.clone().next().is_some() {
            h3 { "How far flexid goes beyond" }
            ul.findings {
                @for row in own {
                    li {
                        strong { (row.name) } " (" (row.description) "): "
                        (against_best(tables, row, Measure::ParameterDeviation)) "; "
                        (against_best(tables, row, Measure::DisplacementError)) "."
                        @for comparison in tables.comparisons.iter().filter(|c| c.method == row.key) {
                            " Against " (name(tables, &comparison.against)) " as run here, "
                            (words::measure(comparison.measure)) ": " (words::test(comparison)) "."
                        }
                    }
                }
            }
        }
    }
}

/// The sentence on one of flexid's own methods against the best figure in the paper.
fn against_best(tables: &Tables, row: &MethodRow, measure: Measure) -> String {
    let (ours, paper): (_, fn(&MethodRow) -> Option<f64>) = match measure {
        Measure::ParameterDeviation => (Some(row.deviation), |row| row.paper_deviation),
        Measure::DisplacementError => (row.displacement_error, |row| row.paper_displacement_error),
    };
    let Some(ours) = ours else { return format!("{} not tried", words::measure(measure)) };
    let found = format!(
        "{} {} (95\u{a0}%\u{a0}CI {})",
        words::measure(measure),
        value(measure, ours.mean),
        value_interval(measure, ours.interval)
    );
    // The levels of displacement errors depend on the robot.
    if measure == Measure::DisplacementError {
        return found;
    }
    let best = tables
        .methods
        .iter()
        .filter_map(|row| Some((paper(row)?, words::short(&row.name))))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((best, name)) if ours.mean.is_finite() && ours.mean > 0.0 => {
            let (ratio, relation) = if ours.mean < best {
                (best / ours.mean, "smaller")
            } else {
                (ours.mean / best, "larger")
            };
            format!(
                "{found}, {} times {relation} than the paper's best, {} ({name})",
                times(ratio),
                value(measure, best)
            )
        }
        _ => found,
    }
}
