//! Tests of the whole page.

use super::super::tables::{Mean, Measure, Tables};
use super::fixture;
use super::render;

/// The body of the page. Only the head has void elements, so that the body is also XML.
fn body(page: &str) -> &str {
    let start = page.find("<body>").expect("a body");
    let end = page.find("</html>").expect("an end");
    &page[start..end]
}

/// All text that is read, without attributes and drawings.
fn words(page: &str) -> String {
    let body = roxmltree::Document::parse(body(page)).expect("well-formed");
    body.descendants().filter(|node| node.is_text()).filter_map(|node| node.text()).collect()
}

/// Tables in which everything is undefined that a short or failed run may leave undefined.
fn broken() -> Tables {
    let mut tables = fixture::tables();
    for row in &mut tables.methods {
        row.deviation.interval = [f64::NEG_INFINITY, f64::INFINITY];
        row.displacement_error = Some(Mean { mean: f64::NAN, interval: [f64::NAN; 2] });
        row.largest_displacement_error = Some(f64::INFINITY);
        row.curve.truncate(1);
        row.curve[0].spread = f64::NAN;
        row.seconds = f64::NAN;
    }
    tables.methods[0].curve.clear();
    tables.methods[1].deviation.mean = f64::NAN;
    for comparison in &mut tables.comparisons {
        comparison.effect = f64::NAN;
        comparison.interval = [f64::NAN; 2];
        comparison.p = f64::NAN;
        comparison.power = Some(f64::NAN);
        comparison.pairs_for_power = None;
    }
    for row in &mut tables.search.loss {
        row[3] = f64::NAN;
    }
    tables.search.truth = [f64::NAN; 2];
    tables.search.iterations[1].best = [1.5, f64::INFINITY];
    tables.search.iterations[0].radius = f64::NAN;
    tables.displacement.models_m[0].1[7] = f64::NAN;
    tables.displacement.models_m[0].1.truncate(100);
    tables.seconds = f64::NAN;
    tables
}

fn empty() -> Tables {
    let mut tables = fixture::tables();
    tables.methods.clear();
    tables.comparisons.clear();
    tables.sensitivity_cost.clear();
    tables.search.loss.clear();
    tables.search.iterations.clear();
    tables.displacement.time_s.clear();
    tables.displacement.reference_m.clear();
    tables.displacement.models_m.clear();
    tables.choices.clear();
    tables
}

#[test]
fn the_same_tables_give_the_same_bytes() {
    assert_eq!(render(&fixture::tables()), render(&fixture::tables()));
}

#[test]
fn nothing_undefined_leaks() {
    for tables in [fixture::tables(), broken(), empty()] {
        let page = render(&tables);
        let body = body(&page);
        for leak in ["NaN", "None", "Some(", "Infinity", "-inf", ">inf"] {
            assert!(!body.contains(leak), "{leak}");
        }
        // A point drawn from an undefined value would lie far outside.
        assert!(!body.contains("2147483647") && !body.contains("-2147483648"));
        words(&page);
    }
}

#[test]
fn the_page_needs_nothing_else() {
    let page = render(&fixture::tables());
    for outside in ["<script", "<link", "<img", "url(", "@import", " src=", "href="] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn every_table_and_figure_is_there() {
    let page = render(&fixture::tables());
    let words = words(&page);
    for title in
        (1..=7).map(|i| format!("Table {i}. ")).chain((3..=6).map(|i| format!("Fig. {i}. ")))
    {
        assert_eq!(words.matches(&title).count(), 1, "{title}");
    }
    assert_eq!(page.matches("<svg").count(), 4);
    assert_eq!(page.matches("role=\"img\" aria-label=\"").count(), 4);
}

#[test]
fn every_number_of_a_table_is_shown_beside_the_papers() {
    let tables = fixture::tables();
    let words = words(&render(&tables)).replace('\u{a0}', " ");
    for row in &tables.methods {
        assert!(words.contains(&row.name), "{}", row.name);
        let deviation = format!("{:.2} %", 100.0 * row.deviation.mean);
        assert!(words.contains(&deviation), "{deviation}");
        if let Some(paper) = row.paper_deviation {
            assert!(words.contains(&format!("{:.2} %", 100.0 * paper)), "{paper}");
        }
        if let Some(paper) = row.paper_displacement_error {
            assert!(words.contains(&format!("{paper:.4}")), "{paper}");
        }
    }
    for comparison in &tables.comparisons {
        let Some(paper) = comparison.paper_effect else { continue };
        let paper = format!("{:.2} %", 100.0 * paper.abs());
        assert!(words.contains(&paper), "{paper}");
    }
    for number in ["12 345", "0.012", "−3.00 to −1.00 %", "−38.18 %"] {
        assert!(words.replace('\u{202f}', " ").contains(number), "{number}");
    }
}

#[test]
fn the_words_follow_the_verdicts() {
    let words = words(&render(&fixture::tables())).replace('\u{a0}', " ");
    assert!(words.contains(
        "Of 10 comparisons that the paper makes, 8 are significant and as in the paper (5 of them not in size: the \
         paper's effect lies outside our interval), 1 significant and the other way, \
         1 not significant"
    ));
    assert!(words.contains(
        "The test would have seen the paper's effect with a probability of 0.34 only; 41 robots would be needed for 0.8."
    ));
    assert!(words.contains("Search & refinement (MAE, scheduled): parameter deviation 7.00 %"));
    assert!(words.contains("3.0 times smaller than the paper's best, 21.24 % (Jacobian)"));
}

#[test]
fn only_what_is_marked_as_seconds_depends_on_the_clock() {
    let blank = |mut tables: Tables, seconds: f64| {
        tables.seconds *= seconds;
        tables.methods.iter_mut().for_each(|row| row.seconds *= seconds);
        tables.sensitivity_cost.iter_mut().for_each(|cost| cost.seconds *= seconds);
        let page = render(&tables);
        let mut parts = page.split("<span class=\"seconds\">");
        let mut left = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            left += part.split_once("</span>").expect("a closed span").1;
        }
        left
    };
    assert_eq!(blank(fixture::tables(), 1.0), blank(fixture::tables(), 77.0));
}

#[test]
fn a_comparison_that_is_missing_leaves_a_dash() {
    let mut tables = fixture::tables();
    tables.comparisons.retain(|comparison| comparison.measure == Measure::DisplacementError);
    let page = render(&tables);
    assert!(words(&page).contains("Of 1 comparisons"));
    assert!(page.contains("<td class=\"verdict\">–</td>"));
}
