//! The cells of a margin, and which of them differs from all others.
//!
//! The logarithm of the mean square of n residuals that are noise has the variance 2/n (Bartlett and Kendall, "The statistical analysis
//! of variance-heterogeneity and the logarithmic transformation", Supplement to the Journal of the Royal Statistical Society 8, 1946).
//! Over the mean square of the m others of its margin it is therefore
//!
//! ```text
//! ln F = 0 ± √(2/n + 2/m)
//! ```
//!
//! It exceeds z of these standard deviations with a chance below `e^(−z²/2)/2` (Chernoff), any of c cells with one of c times that
//! (Bonferroni).

/// Chance that noise is taken for more than noise in a margin. Chosen: one false line in two hundred reports of five margins.
const CHANCE: f64 = 1e-3;
/// Least factor that is worth a look. Chosen: many residuals make a smaller one significant, and it points nowhere.
const LEAST: f64 = 1.5;

/// Sum of the squares of some residuals.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    pub(super) squares: f64,
    /// Number of independent real residuals.
    pub(super) count: f64,
}

impl Cell {
    /// Adds the square of a complex residual.
    pub(super) fn add(&mut self, square: f64) {
        self.squares += square;
        self.count += 2.0;
    }

    pub(super) fn mean_square(&self) -> f64 {
        self.squares / self.count.max(1.0)
    }
}

/// The cell that has the most significant excess over all others of its margin, and how many times their mean square it has. `None` if
/// noise does that, or nearly.
pub(super) fn worst(cells: &[Cell]) -> Option<(usize, f64)> {
    let limit = libm::sqrt(2.0 * libm::log(cells.len() as f64 / (2.0 * CHANCE)));
    let excess = |(index, cell): (usize, &Cell)| {
        let others = cells.iter().enumerate().filter(|(other, _)| *other != index);
        let rest = others.fold(Cell::default(), |sum, (_, other)| Cell {
            squares: sum.squares + other.squares,
            count: sum.count + other.count,
        });
        let times = cell.mean_square() / rest.mean_square();
        let deviation = libm::sqrt(2.0 / cell.count + 2.0 / rest.count);
        (index, times, libm::log(times) / deviation)
    };
    let all = cells.iter().enumerate().map(excess);
    let certain = all.filter(|(_, times, deviations)| *times >= LEAST && *deviations > limit);
    let worst = certain.max_by(|(.., one), (.., other)| one.total_cmp(other));
    worst.map(|(index, times, _)| (index, times))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(all: &[[f64; 2]]) -> std::vec::Vec<Cell> {
        all.iter().map(|&[mean, count]| Cell { squares: mean * count, count }).collect()
    }

    #[test]
    fn the_worst_is_the_most_significant_one() {
        assert_eq!(worst(&cells(&[[1.0, 900.0], [1.0, 900.0]])), None);
        // 0.41 is 8.6 of √(2/900 + 2/900 …).
        let one = worst(&cells(&[[1.0, 900.0], [1.6, 900.0], [1.0, 900.0]]));
        assert!(matches!(one, Some((1, times)) if (times - 1.6).abs() < 1e-9), "{one:?}");
        // As large a factor of few residuals is noise, and a small one of many is not worth a look.
        assert_eq!(worst(&cells(&[[1.0, 90.0], [1.6, 30.0], [1.0, 90.0]])), None);
        assert_eq!(worst(&cells(&[[1.0, 1e6], [1.4, 1e6], [1.0, 1e6]])), None);
        // Neither a margin of one cell nor an empty cell says anything.
        assert_eq!(worst(&cells(&[[7.0, 900.0]])), None);
        assert_eq!(worst(&cells(&[[1.0, 900.0], [0.0, 0.0]])), None);
    }
}
