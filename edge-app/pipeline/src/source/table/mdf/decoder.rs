//! Numbers of channels in their records.

use super::super::bytes::{Form, Number, Order};
use super::blocks::Block;
use super::conversion::Law;

/// Kind of channel whose values are counted.
pub(super) const COUNTED: u8 = 3;

/// How a channel lies in its record, and what its numbers mean.
pub(super) struct Decoder {
    /// True if the values are the numbers of the rows.
    is_counted: bool,
    place: usize,
    shift: u32,
    order: Order,
    number: Number,
    /// Bit that says that a value is not valid.
    invalid: Option<usize>,
    is_invalid: bool,
    law: Law,
}

impl Decoder {
    pub(super) fn new(
        channel: &Block,
        conversion: Option<&Block>,
        name: &str,
        length: usize,
    ) -> Result<Self, String> {
        let [kind, _, number, shift]: [u8; 4] = channel.data(0)?;
        let [place, bits, flags, invalid] =
            [4, 8, 12, 16].map(|place| channel.data(place).map(u32::from_le_bytes));
        let (place, bits, flags, invalid) = (place? as usize, bits?, flags?, invalid? as usize);
        let form = match number {
            0 | 1 => Form::Unsigned,
            2 | 3 => Form::Signed,
            4 | 5 => Form::Float,
            _ => {
                return Err(format!(
                    "channel {name:?} holds no numbers: name another in [signals]"
                ));
            }
        };
        let own = Self {
            is_counted: kind == COUNTED,
            place,
            shift: shift.into(),
            // Types come in pairs, Intel's order first.
            order: if number % 2 == 0 { Order::Little } else { Order::Big },
            number: Number { form, bits },
            invalid: (flags & 2 != 0).then_some(invalid),
            is_invalid: flags & 1 != 0,
            law: Law::new(conversion, name)?,
        };
        let is_known = match form {
            Form::Float => shift == 0 && (bits == 32 || bits == 64),
            _ => (1..=64).contains(&bits) && shift < 8 && own.shift + bits <= 64,
        };
        let fits = || place.checked_add(own.bytes()).is_some_and(|end| end <= length);
        if own.is_counted || (is_known && fits()) {
            Ok(own)
        } else {
            Err(format!(
                "channel {name:?} has {bits} bits at byte {place} of {length}, which cannot be: record it again"
            ))
        }
    }

    fn bytes(&self) -> usize {
        (self.shift + self.number.bits).div_ceil(8) as usize
    }

    /// Returns the value in a record, NaN if it is not valid.
    pub(super) fn value(&self, record: &[u8], validity: &[u8], row: usize) -> f64 {
        let is_set =
            |bit: usize| validity.get(bit / 8).is_some_and(|own| own >> (bit % 8) & 1 == 1);
        if self.is_invalid || self.invalid.is_some_and(is_set) {
            return f64::NAN;
        }
        if self.is_counted {
            return self.law.value(row as f64);
        }
        let own = record.get(self.place..).and_then(|rest| rest.get(..self.bytes()));
        own.map_or(f64::NAN, |own| {
            self.law.value(self.number.value(self.order.bits(own) >> self.shift))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel of this type that begins at a bit of byte 1, and is invalid where bit 9 says so.
    fn decoder(number: u8, shift: u8, bits: u32) -> Result<Decoder, String> {
        let whole = [1, bits, 2, 9].map(u32::to_le_bytes).concat();
        let data = [&[0, 0, number, shift][..], &whole].concat();
        let channel = Block { id: *b"##CN", links: &[], data: &data };
        Decoder::new(&channel, None, "Fx", 9)
    }

    #[test]
    fn numbers_have_an_order_and_a_shift() {
        let record = [0xEE, 0x3F, 0xF8, 0, 0, 0, 0, 0, 0];
        for (number, shift, bits, expected) in [
            (0, 0, 16, 63_551.0),
            (1, 0, 16, 16_376.0),
            (2, 0, 16, -1_985.0),
            (3, 4, 12, 1_023.0),
            (2, 4, 12, -125.0),
            (5, 0, 64, 1.5),
        ] {
            let own = decoder(number, shift, bits).unwrap();
            assert_eq!(own.value(&record, &[0, 0], 0), expected, "{number} {shift} {bits}");
            assert!(own.value(&record, &[0, 2], 0).is_nan());
        }
    }

    #[test]
    fn numbers_that_cannot_be_are_refused() {
        for (number, shift, bits) in
            [(0, 7, u32::MAX), (0, 0, 0), (0, 8, 8), (4, 0, 16), (1, 1, 64)]
        {
            let error = decoder(number, shift, bits).err().unwrap();
            let expected =
                format!("channel \"Fx\" has {bits} bits at byte 1 of 9, which cannot be");
            assert!(error.starts_with(&expected), "{error}");
        }
        assert!(decoder(6, 0, 8).err().unwrap().contains("holds no numbers"));
    }
}
