//! Numbers of a table, with decimal points or decimal commas.

/// Reads the numbers of a table. A table has points or commas, never both: one of them would be a separator of thousands.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    /// Mark of decimals that the cells so far have: a point or a comma.
    mark: Option<u8>,
    /// True if cells are separated by commas.
    commas_separate: bool,
}

/// A cell that holds text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NoNumber;

impl Numbers {
    pub(super) fn new(separator: u8) -> Self {
        Self { mark: None, commas_separate: separator == b',' }
    }

    /// Returns the number in a cell without white space around it. Returns `None` if the cell is empty, or says that there is no number.
    pub(super) fn read(&mut self, cell: &[u8]) -> Result<Option<f64>, NoNumber> {
        if cell.is_empty() {
            return Ok(None);
        }
        let mark = cell.iter().copied().find(|byte| matches!(byte, b'.' | b','));
        let text = str::from_utf8(cell).map_err(|_| NoNumber)?;
        let number = match mark {
            Some(b',') if self.commas_separate => None,
            Some(b',') => text.replacen(',', ".", 1).parse().ok(),
            _ => text.parse().ok(),
        };
        match number {
            Some(number) if f64::is_finite(number) => {
                let is_other = mark.is_some_and(|own| *self.mark.get_or_insert(own) != own);
                if is_other { Err(NoNumber) } else { Ok(Some(number)) }
            }
            Some(_) => Ok(None),
            None if is_missing(text) => Ok(None),
            None => Err(NoNumber),
        }
    }
}

/// Returns whether a text says that there is no number, as the C library of Windows does: `-nan(ind)`, `1.#QNAN`.
fn is_missing(text: &str) -> bool {
    let text = text.trim_start_matches(['-', '+']).to_ascii_lowercase();
    text.starts_with("nan") || text.starts_with("1.#") || text.starts_with("1,#")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_points_or_commas() {
        for (separator, cells, expected) in [
            (b',', &["1.5", "-2e-3", "+7", ".5", "0"][..], Ok(0.0)),
            (b';', &["1,5", "-2,5E-03"], Ok(-2.5e-3)),
            (b'\t', &["1.5", "1,5"], Err(NoNumber)),
            (b';', &["1,5", "1.234"], Err(NoNumber)),
            (b';', &["1.234,5"], Err(NoNumber)),
            (b',', &["1,234"], Err(NoNumber)),
            (b',', &["abc"], Err(NoNumber)),
            (b',', &["1.5 N"], Err(NoNumber)),
            (b',', &["--"], Err(NoNumber)),
        ] {
            let mut numbers = Numbers::new(separator);
            let read: Vec<_> = cells.iter().map(|cell| numbers.read(cell.as_bytes())).collect();
            assert_eq!(read.last(), Some(&expected.map(Some)), "{cells:?}");
        }
    }

    #[test]
    fn a_cell_may_hold_no_number() {
        for cell in
            ["", "NaN", "nan", "-nan(ind)", "1.#QNAN", "1,#INF", "inf", "-Infinity", "1e999"]
        {
            assert_eq!(Numbers::new(b';').read(cell.as_bytes()), Ok(None), "{cell}");
        }
    }
}
