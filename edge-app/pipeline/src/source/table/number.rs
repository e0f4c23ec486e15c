//! Numbers of a table, with decimal points or decimal commas.

/// Reads the numbers of a table. A table has points or commas, never both: one of them would be a separator of thousands. Where commas separate cells
/// too, the cells stand in quotes.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    /// Mark of decimals that the cells so far have: a point or a comma.
    mark: Option<u8>,
    /// True if cells are separated by commas.
    commas_separate: bool,
}

/// A cell that is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoNumber {
    /// It holds text.
    Text,
    /// Its comma may be decimal, or separate thousands.
    Ambiguous,
}

impl Numbers {
    pub(super) fn new(separator: u8) -> Self {
        Self { mark: None, commas_separate: separator == b',' }
    }

    /// Takes commas for decimal ones, if nothing is known yet and a cell of these has one that cannot separate thousands.
    pub(super) fn settle<'a>(&mut self, cells: impl IntoIterator<Item = &'a [u8]>) {
        if self.commas_separate && self.mark.is_none() {
            let is_decimal = |cell: &[u8]| {
                let text = str::from_utf8(cell).unwrap_or_default();
                let parts = text.split_once(',').filter(|_| !may_be_of_thousands(text));
                parts.is_some_and(|(whole, part)| format!("{whole}.{part}").parse::<f64>().is_ok())
            };
            self.mark = cells.into_iter().any(is_decimal).then_some(b',');
        }
    }

    /// Returns the number in a cell without white space around it. Returns `None` if the cell is empty, or says that there is no number.
    pub(super) fn read(&mut self, cell: &[u8]) -> Result<Option<f64>, NoNumber> {
        if cell.is_empty() {
            return Ok(None);
        }
        let mark = cell.iter().copied().find(|byte| matches!(byte, b'.' | b','));
        let text = str::from_utf8(cell).map_err(|_| NoNumber::Text)?;
        let number = match mark {
            Some(b',')
                if self.commas_separate && self.mark.is_none() && may_be_of_thousands(text) =>
            {
                return Err(NoNumber::Ambiguous);
            }
            Some(b',') => text.replacen(',', ".", 1).parse().ok(),
            _ => text.parse().ok(),
        };
        match number {
            Some(number) if f64::is_finite(number) => {
                let is_other = mark.is_some_and(|own| *self.mark.get_or_insert(own) != own);
                if is_other { Err(NoNumber::Text) } else { Ok(Some(number)) }
            }
            Some(_) => Ok(None),
            None if is_missing(text) => Ok(None),
            None => Err(NoNumber::Text),
        }
    }
}

/// Returns whether the comma of a number may separate thousands: `1,234`, and neither `0,234` nor `1,5`.
fn may_be_of_thousands(text: &str) -> bool {
    let is_of_digits = |own: &str| own.bytes().all(|byte| byte.is_ascii_digit());
    text.trim_start_matches(['-', '+']).split_once(',').is_some_and(|(whole, part)| {
        (1..=3).contains(&whole.len())
            && part.len() == 3
            && !whole.starts_with('0')
            && is_of_digits(whole)
            && is_of_digits(part)
    })
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
            (b'\t', &["1.5", "1,5"], Err(NoNumber::Text)),
            (b';', &["1,5", "1.234"], Err(NoNumber::Text)),
            (b';', &["1.234,5"], Err(NoNumber::Text)),
            (b',', &["1,234"], Err(NoNumber::Ambiguous)),
            (b',', &["7", "-12,345"], Err(NoNumber::Ambiguous)),
            (b',', &["1,5", "1,234"], Ok(1.234)),
            (b',', &["-0,250", "1,234"], Ok(1.234)),
            (b',', &["1,2345E-3", "1,234"], Ok(1.234)),
            (b',', &["0.5", "1,5"], Err(NoNumber::Text)),
            (b',', &["1,5", "0.5"], Err(NoNumber::Text)),
            (b',', &["1,234,567"], Err(NoNumber::Text)),
            (b',', &["1,234.5"], Err(NoNumber::Text)),
            (b',', &["abc"], Err(NoNumber::Text)),
            (b',', &["1.5 N"], Err(NoNumber::Text)),
            (b',', &["--"], Err(NoNumber::Text)),
        ] {
            let mut numbers = Numbers::new(separator);
            let read: Vec<_> = cells.iter().map(|cell| numbers.read(cell.as_bytes())).collect();
            assert_eq!(read.last(), Some(&expected.map(Some)), "{cells:?}");
        }
    }

    /// Cells of a line say together what their commas are.
    #[test]
    fn commas_of_a_line_are_decimal_if_one_is() {
        for (cells, expected) in [
            (&["1,234", "0,500"][..], Ok(Some(1.234))),
            (&["1,234", "2,500"], Err(NoNumber::Ambiguous)),
            (&["1,234", "1,x", "x,5"], Err(NoNumber::Ambiguous)),
        ] {
            let mut numbers = Numbers::new(b',');
            numbers.settle(cells.iter().map(|cell| cell.as_bytes()));
            assert_eq!(numbers.read(b"1,234"), expected, "{cells:?}");
        }
        let mut numbers = Numbers::new(b',');
        assert_eq!(numbers.read(b"1.5"), Ok(Some(1.5)));
        numbers.settle([&b"1,5"[..]]);
        assert_eq!(numbers.read(b"1,5"), Err(NoNumber::Text));
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
