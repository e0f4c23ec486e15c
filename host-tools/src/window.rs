//! The window that tables and lines must fit.
//!
//! A table has the width of the window, or that of the narrowest one where standard output is none: a file is read in some window, too.
//! Lines of text are folded between words in a window alone, since programs read them whole.

use comfy_table::{ContentArrangement, LineStyle, Row, Table, TableStyle};
use console::{Term, measure_text_width};
use textwrap::{Options, fill};

/// A line below the header, and no other.
const STYLE: TableStyle =
    TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));
/// Columns of the narrowest window: those of the VT100 terminal.
const COLUMNS: usize = 80;

/// Columns of a table.
pub(crate) fn columns() -> usize {
    window().unwrap_or(COLUMNS)
}

/// Columns of the window. `None` where standard output is a file or a pipe.
fn window() -> Option<usize> {
    let columns = Term::stdout().size_checked().map(|(_, columns)| usize::from(columns));
    columns.filter(|columns| *columns > 0)
}

/// A table without rows that has at most so many columns of text: its cells are folded.
pub(crate) fn table(columns: usize, header: impl Into<Row>) -> Table {
    let mut table = Table::new();
    table.load_style(STYLE).set_content_arrangement(ContentArrangement::Dynamic);
    table.set_width(columns.try_into().unwrap_or(u16::MAX)).set_header(header);
    table
}

/// The text as it is printed: folded in a window.
pub(crate) fn fit(text: &str) -> String {
    window().map_or_else(|| text.to_owned(), |columns| folded(text, columns))
}

/// The text with no line wider than this. What follows the first part of a line stands below its words.
fn folded(text: &str, columns: usize) -> String {
    let fold = |line: &str| {
        if measure_text_width(line) <= columns {
            return line.to_owned();
        }
        let indent = " ".repeat(indent(line).min(columns / 2));
        fill(line, Options::new(columns).subsequent_indent(&indent))
    };
    text.split('\n').map(fold).collect::<Vec<_>>().join("\n")
}

/// Column at which the words of a line begin: behind its margin, or behind a heading that two blanks or more set apart.
fn indent(line: &str) -> usize {
    let blanks = |text: &str| text.len() - text.trim_start_matches(' ').len();
    match (blanks(line), line.split_once("  ")) {
        (0, Some((heading, rest))) => measure_text_width(heading) + 2 + blanks(rest),
        (margin, _) => margin,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_is_folded_between_words_below_its_own() {
        let text = "residuals    noise explains them\n legend: one two three\nshort\n";
        let expected =
            "residuals    noise\n             explains them\n legend: one two three\nshort\n";
        assert_eq!(folded(text, 26), expected);
        assert_eq!(folded("  a b c d e f g", 9), "  a b c d\n  e f g");
        assert_eq!(folded("", 22), "");
    }

    #[test]
    fn a_table_fits() {
        let mut all = table(30, ["name", "what there is to say of it"]);
        all.add_row(["joint_1 tx stiffness", "trades off with another one"]);
        let text = all.to_string();
        assert!(text.lines().all(|line| measure_text_width(line) <= 30), "{text}");
        assert!(text.lines().count() > 4, "{text}");
    }
}
