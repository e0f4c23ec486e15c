//! Types of values in TDMS files.

use super::super::bytes::{Form, Number, Order};

/// A type of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Number(Number),
    /// Seconds since the start of 1904, UTC: 64 bits of whole ones with a sign, and 64 bits of 2^-64 s.
    Stamp,
    Text,
}

impl Kind {
    /// Returns the type of a number in the file. `None` if it is not known.
    pub(super) fn of(code: u32) -> Option<Self> {
        let number = |form, bits| Some(Self::Number(Number { form, bits }));
        match code {
            1..=4 => number(Form::Signed, 8 << (code - 1)),
            5..=8 => number(Form::Unsigned, 8 << (code - 5)),
            // With a unit, and without one.
            9 | 0x19 => number(Form::Float, 32),
            10 | 0x1A => number(Form::Float, 64),
            // A truth value.
            0x21 => number(Form::Unsigned, 8),
            0x20 => Some(Self::Text),
            0x44 => Some(Self::Stamp),
            _ => None,
        }
    }

    /// Returns the type of a number in the file where it describes data of DAQmx. `None` if it is not known.
    pub(super) fn of_daqmx(code: u32) -> Option<Self> {
        let (form, bits) = match code {
            0..8 if code.is_multiple_of(2) => (Form::Unsigned, 8 << (code / 2)),
            0..8 => (Form::Signed, 8 << (code / 2)),
            8 | 9 => (Form::Float, 32 << (code - 8)),
            _ => return None,
        };
        Some(Self::Number(Number { form, bits }))
    }

    /// Returns the size of a value, bytes. `None` of texts, which have any.
    pub(super) fn size(self) -> Option<usize> {
        match self {
            Self::Number(number) => Some(number.size()),
            Self::Stamp => Some(16),
            Self::Text => None,
        }
    }

    /// Returns the value in bytes of its size, a stamp in s. NaN of a text.
    pub(super) fn value(self, bytes: &[u8], order: Order) -> f64 {
        match self {
            Self::Number(number) => number.value(order.bits(bytes)),
            Self::Stamp => {
                let (first, second) = bytes.split_at(bytes.len() / 2);
                let [seconds, parts] = match order {
                    Order::Little => [second, first],
                    Order::Big => [first, second],
                }
                .map(|own| order.bits(own));
                seconds as i64 as f64 + parts as f64 * 2_f64.powi(-64)
            }
            Self::Text => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_times() {
        let half = [&(1_u64 << 63).to_le_bytes()[..], &7_u64.to_le_bytes()].concat();
        assert_eq!(Kind::Stamp.value(&half, Order::Little), 7.5);
        let half: Vec<u8> = half.into_iter().rev().collect();
        assert_eq!(Kind::Stamp.value(&half, Order::Big), 7.5);
    }

    /// The types that NI numbers in `tdsDataType` and in the scalers of DAQmx.
    #[test]
    fn types_are_those_of_ni() {
        let minus = |code, of: fn(u32) -> Option<Kind>| {
            let kind = of(code)?;
            Some((kind.size()?, kind.value(&[0xFF; 8][..kind.size()?], Order::Big)))
        };
        let plain = [1, 2, 3, 4, 5, 6, 7].map(|code| minus(code, Kind::of));
        let expected = [
            (1, -1.0),
            (2, -1.0),
            (4, -1.0),
            (8, -1.0),
            (1, 255.0),
            (2, 65535.0),
            (4, 4294967295.0),
        ];
        assert_eq!(plain, expected.map(Some));
        let raw = [1, 3, 5, 7, 0, 2, 4].map(|code| minus(code, Kind::of_daqmx));
        assert_eq!(raw, expected.map(Some));
        let sizes = [9, 0x19, 10, 0x1A, 0x21, 0x44, 0x20, 11].map(|code| Kind::of(code)?.size());
        assert_eq!(sizes, [Some(4), Some(4), Some(8), Some(8), Some(1), Some(16), None, None]);
        assert_eq!([8, 9, 10].map(|code| Kind::of_daqmx(code)?.size()), [Some(4), Some(8), None]);
    }
}
