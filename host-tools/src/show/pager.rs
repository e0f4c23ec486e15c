//! The pages of `watch`, one at a time, with the keys below.

use super::keys::Key;
use super::line::Line;
use super::page;
use super::spectra;
use super::view::View;

/// The pages, by their keys.
const PAGES: [&str; 6] = ["overview", "parameters", "spectra", "fit", "warnings", "bus"];

/// The page that is shown, and the number of lines above its window.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pager {
    page: usize,
    above: usize,
    /// Number of lines that a long page moves by.
    step: usize,
}

impl Pager {
    /// Obeys a key.
    pub(crate) fn press(&mut self, key: Key) {
        let turn = |page| Self { page, above: 0, ..*self };
        *self = match key {
            Key::Page(page) if page < PAGES.len() => turn(page),
            Key::Next => turn((self.page + 1) % PAGES.len()),
            Key::Previous => turn((self.page + PAGES.len() - 1) % PAGES.len()),
            Key::Up => Self { above: self.above.saturating_sub(1), ..*self },
            Key::Down => Self { above: self.above + 1, ..*self },
            Key::PageUp => Self { above: self.above.saturating_sub(self.step), ..*self },
            Key::PageDown => Self { above: self.above + self.step, ..*self },
            Key::Page(_) | Key::Quit => *self,
        };
    }

    /// The lines for a window of `rows` and `columns`: the page, and the keys in the last row but one. The cursor needs the last.
    pub(crate) fn lines(&mut self, view: &View, rows: usize, columns: usize) -> Vec<Line> {
        let rows = rows.saturating_sub(2);
        let mut lines = match self.page {
            0 => page::overview(view, rows, columns),
            1 => page::parameters(view, columns),
            2 => spectra::lines(view, rows, columns),
            3 => page::confidence(view, columns),
            4 => page::warnings(view, columns),
            _ => page::bus(view, columns),
        };
        let all = lines.len();
        self.step = rows.max(1);
        self.above = self.above.min(all.saturating_sub(rows));
        lines.drain(..self.above);
        lines.truncate(rows);
        let shown = (all > rows).then(|| (self.above + 1, self.above + lines.len(), all));
        lines.resize(rows, Line::default());
        lines.push(self.keys(shown));
        lines
    }

    /// The keys, the page that is shown in brackets.
    fn keys(&self, shown: Option<(usize, usize, usize)>) -> Line {
        let key = |(index, name): (usize, &&str)| {
            let key = format!("{} {name}", index + 1);
            if index == self.page { format!("[{key}]") } else { key }
        };
        let mut keys = PAGES.iter().enumerate().map(key).collect::<Vec<_>>().join(" ");
        if let Some((first, last, all)) = shown {
            keys += &format!(" ↑↓ {first}-{last}/{all}");
        }
        Line::from(keys + " q quit")
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::warning::Warning;

    use super::*;
    use crate::show::page::tests::view;

    #[test]
    fn every_page_fits_and_has_its_keys() {
        let view = view(6, &[Warning::ImposedParameters]);
        for (page, said) in
            ["consistent", "stiffness", "measured", "residuals", "what [parameters]", "frames/s"]
                .into_iter()
                .enumerate()
        {
            let mut pager = Pager::default();
            pager.press(Key::Page(page));
            let lines = pager.lines(&view, 24, 80);
            assert_eq!(lines.len(), 23, "{lines:#?}");
            let keys = lines[22].text();
            for line in &lines {
                assert!(line.width() <= 80, "{line:?}");
            }
            assert!(keys.contains(&format!("[{} {}]", page + 1, PAGES[page])), "{keys}");
            assert!(keys.ends_with("q quit"), "{keys}");
            let text: Vec<_> = lines.iter().map(Line::text).collect();
            assert!(text.join("\n").contains(said), "{said:?} is not in {text:#?}");
        }
    }

    #[test]
    fn a_long_page_moves_and_stops_at_its_ends() {
        let view = view(6, &[]);
        let mut pager = Pager::default();
        pager.press(Key::Next);
        let all = page::parameters(&view, 80).len();
        let top = pager.lines(&view, 24, 80);
        assert!(top[22].text().contains(&format!("1-22/{all}")), "{}", top[22].text());
        pager.press(Key::Up);
        assert_eq!(pager.lines(&view, 24, 80), top);
        pager.press(Key::Down);
        assert_eq!(pager.lines(&view, 24, 80)[0], top[1]);
        for _ in 0..9 {
            pager.press(Key::PageDown);
        }
        let end = pager.lines(&view, 24, 80);
        assert!(end[22].text().contains(&format!("-{all}/{all}")), "{}", end[22].text());
        pager.press(Key::Next);
        pager.press(Key::Previous);
        assert_eq!(pager.lines(&view, 24, 80), top, "a page begins at its top");
    }
}
