//! Lines of a terminal, in colours.

use console::{Style, measure_text_width, truncate_str};
use flexid_pipeline::text::printable;

use crate::show::headline::Tone;

/// A line of text, of pieces that each have a style.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Line(Vec<(Style, String)>);

impl Line {
    /// A line of one style, or of that of a tone.
    pub(crate) fn toned(style: impl Into<Style>, text: impl Into<String>) -> Self {
        Self(vec![(style.into(), text.into())])
    }

    /// Appends a piece.
    pub(crate) fn push(&mut self, style: impl Into<Style>, text: impl Into<String>) {
        self.0.push((style.into(), text.into()));
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
        let pieces = self.0.iter().map(|(style, text)| style.apply_to(printable(text)).to_string());
        truncate_str(&pieces.collect::<String>(), columns, "…").into_owned()
    }
}

impl<T: Into<String>> From<T> for Line {
    fn from(text: T) -> Self {
        Self::toned(Tone::Neutral, text)
    }
}

impl From<Tone> for Style {
    fn from(tone: Tone) -> Self {
        match tone {
            Tone::Neutral => Self::new(),
            Tone::Faint => Self::new().dim(),
            Tone::Good => Self::new().green(),
            Tone::Caution => Self::new().yellow(),
            Tone::Bad => Self::new().red(),
        }
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
