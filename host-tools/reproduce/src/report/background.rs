//! The points that the paper leaves open, and how the tests were made.

use maud::{Markup, html};

use super::Tables;
use crate::statistics::POWER;

pub(super) fn choices(tables: &Tables) -> Markup {
    html! {
        section {
            h2 { "What the paper leaves open" }
            table.text {
                caption { strong { "Table 7. " } "What the paper does not say, and what is done here." }
                thead { tr { th.left { "Open" } th.left { "Here" } th.left { "Why" } } }
                tbody {
                    @for choice in &tables.choices {
                        tr {
                            th scope="row" { (choice.open) }
                            td.left { (choice.chosen) }
                            td.left { (choice.why) }
                        }
                    }
                }
            }
        }
    }
}

pub(super) fn tests(tables: &Tables) -> Markup {
    let robots = tables.run.robots;
    html! {
        section {
            h2 { "How the numbers were made" }
            p {
                strong { "Parameter deviation" }
                " (section 5.1 of the paper): " i { "E" } " = 1/" i { "n" } " Σ |" i { "P" } sub { "i" } " − "
                i { "P̂" } sub { "i" } "| / " i { "R" } sub { "i" }
                ", the mean over the " i { "n" } " parameters of the absolute error, divided by the range of the parameter's \
                 bounds."
            }
            p {
                strong { "Displacement error" }
                " (section 5.2): RMS(" i { "x̂" } " − " i { "x" } ") / RMS(" i { "x" } ") of the displacement of the tool \
                 centre point, for every direction and experiment; of one robot, the median over them; of all, the geometric \
                 mean."
            }
            p {
                strong { "Tests. " }
                "There were " (robots) " robots, and a method met the first so many of them as its table says. Two methods are \
                 compared over the robots that both met, from the same experiments and with the same budget of evaluations; what \
                 sensitivities cost comes on top, and flexid has data and a budget of its own. The test is a two-sided paired "
                i { "t" } " test over the robots, of the differences of the parameter deviation and of the differences of the \
                 logarithm of the displacement error. Intervals are 95\u{a0}% confidence intervals of Student's "
                i { "t" } ", those of single means included; p is not corrected for the number of tests. A comparison "
                em { "agrees" } " if p < 0.05 and the sign is the paper's, " em { "contradicts" }
                " if p < 0.05 and the sign is the other, and is " em { "undecided" }
                " otherwise. Power is the probability that this test, with this scatter and so many robots, finds p < 0.05 if \
                 the paper's effect is the true one; " (POWER) " is the usual demand."
            }
        }
    }
}
