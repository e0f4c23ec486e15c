//! Lines of a terminal, in colours.

use console::{Style, measure_text_width, truncate_str};
use flexid_pipeline::text::printable;

use crate::show::headline::Tone;

/// A line of text, of pieces that each have a tone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Line(Vec<(Tone, String)>);

impl Line {
    /// A line of one tone.
    pub(crate) fn toned(tone: Tone, text: impl Into<String>) -> Self {
        Self(vec![(tone, text.into())])
    }

    /// Appends a piece.
    pub(crate) fn push(&mut self, tone: Tone, text: impl Into<String>) {
        self.0.push((tone, text.into()));
    }

    /// The text alone.
    pub(crate) fn text(&self) -> String {
        self.0.iter().map(|(_, text)| text.as_str()).collect()
    }

    /// Number of columns.
    pub(crate) fn width(&self) -> usize {
        measure_text_width(&self.text())
    }

    /// The line for standard output, cut off at `columns`. Text that does not come from this program is escaped. There are colours
    /// on a terminal without NO_COLOR.
    pub(crate) fn styled(&self, columns: usize) -> String {
        let pieces =
            self.0.iter().map(|(tone, text)| style(*tone).apply_to(printable(text)).to_string());
        truncate_str(&pieces.collect::<String>(), columns, "…").into_owned()
    }
}

impl<T: Into<String>> From<T> for Line {
    fn from(text: T) -> Self {
        Self::toned(Tone::Neutral, text)
    }
}

fn style(tone: Tone) -> Style {
    match tone {
        Tone::Neutral => Style::new(),
        Tone::Good => Style::new().green(),
        Tone::Caution => Style::new().yellow(),
        Tone::Bad => Style::new().red(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_escaped_and_cut() {
        let mut line = Line::from("a\x1b[2J");
        line.push(Tone::Bad, "bcdef");
        assert_eq!(line.width(), "a\x1b[2Jbcdef".len() - "\x1b[2J".len());
        let shown = line.styled(10);
        assert_eq!(console::strip_ansi_codes(&shown), "a\\u001b[2…");
    }
}
