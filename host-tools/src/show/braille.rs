//! Curves of the dots of Braille characters: a cell has two dots beside each other and four above each other.

use std::cmp::Ordering;

/// A field of dots. The cells are in rows from above; each has the greatest of the layers of its dots.
#[derive(Clone, Debug)]
pub(crate) struct Dots<L> {
    columns: usize,
    cells: Vec<(u8, Option<L>)>,
}

impl<L: Copy + Ord> Dots<L> {
    /// An empty field of so many rows and columns of cells.
    pub(crate) fn new(rows: usize, columns: usize) -> Self {
        Self { columns, cells: vec![(0, None); rows * columns] }
    }

    /// Number of dots beside each other, and above each other.
    pub(crate) fn size(&self) -> [usize; 2] {
        [2 * self.columns, 4 * (self.cells.len() / self.columns.max(1))]
    }

    /// Sets a dot: `x` from the left, `y` from below. What lies outside is left out.
    pub(crate) fn set(&mut self, layer: L, x: usize, y: usize) {
        /// Bits of the dots from above, for the left and the right column (Unicode, block 2800).
        const BITS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
        let [width, height] = self.size();
        if x >= width || y >= height {
            return;
        }
        let above = height - 1 - y;
        let (dots, own) = &mut self.cells[above / 4 * self.columns + x / 2];
        *dots |= BITS[x % 2][above % 4];
        *own = (*own).max(Some(layer));
    }

    /// Draws a line through points with ascending `x`, where `is_drawn` holds for its place. Jumps are filled.
    pub(crate) fn line(&mut self, layer: L, points: &[[f64; 2]], is_drawn: impl Fn(usize) -> bool) {
        let mut before = None;
        for pair in points.windows(2) {
            let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
            for x in x0.round() as usize..=x1.round() as usize {
                let part =
                    if x1 > x0 { ((x as f64 - x0) / (x1 - x0)).clamp(0.0, 1.0) } else { 1.0 };
                let y = (y0 + part * (y1 - y0)).round() as usize;
                let from = before.replace(y).unwrap_or(y);
                let reached = match from.cmp(&y) {
                    Ordering::Less => from + 1..=y,
                    Ordering::Equal => y..=y,
                    Ordering::Greater => y..=from - 1,
                };
                if is_drawn(x) {
                    reached.for_each(|y| self.set(layer, x, y));
                }
            }
        }
    }

    /// Rows of characters from above, with their layers. A cell without dots is a space.
    pub(crate) fn rows(&self) -> impl Iterator<Item = Vec<(char, Option<L>)>> {
        let character = |dots: u8| match dots {
            0 => ' ',
            // All of the block are characters.
            _ => char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' '),
        };
        self.cells
            .chunks(self.columns.max(1))
            .map(move |row| row.iter().map(|(dots, layer)| (character(*dots), *layer)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(dots: &Dots<u8>) -> Vec<String> {
        dots.rows().map(|row| row.iter().map(|(character, _)| character).collect()).collect()
    }

    #[test]
    fn a_dot_has_its_place_in_its_cell() {
        let mut dots = Dots::new(2, 2);
        assert_eq!(dots.size(), [4, 8]);
        for (x, y) in [(0, 7), (3, 7), (0, 4), (1, 0), (4, 0), (0, 8)] {
            dots.set(1, x, y);
        }
        assert_eq!(text(&dots), ["⡁⠈", "⢀ "]);
        dots.set(0, 0, 7);
        assert_eq!(dots.rows().next().unwrap()[0], ('⡁', Some(1)), "the greatest layer stays");
    }

    #[test]
    fn a_line_has_no_gaps_but_where_it_is_dashed() {
        let mut dots = Dots::new(1, 4);
        dots.line(0, &[[0.0, 0.0], [4.0, 0.0], [7.0, 3.0]], |_| true);
        assert_eq!(text(&dots), ["⣀⣀⡠⠊"]);
        let mut dots = Dots::new(1, 2);
        dots.line(0, &[[0.0, 0.0], [1.0, 3.0], [2.0, 0.0], [3.0, 0.0]], |_| true);
        assert_eq!(text(&dots), ["⡸⣆"]);
        let mut dots = Dots::new(1, 4);
        dots.line(0, &[[0.0, 0.0], [7.0, 0.0]], |x| x % 4 < 2);
        assert_eq!(text(&dots), ["⣀ ⣀ "]);
    }
}
