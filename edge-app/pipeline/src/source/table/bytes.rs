//! Numbers in the bytes of a file, in either order.

use std::fmt;

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// The least byte comes first.
    Little,
    /// The greatest byte comes first.
    Big,
}

/// What a number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Unsigned,
    Signed,
    Float,
}

/// A type of numbers, of 64 bits at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Number {
    pub(super) form: Form,
    pub(super) bits: u32,
}

/// The bytes end before what they must hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CutOff;

/// Reads numbers one behind the other.
#[derive(Clone, Debug)]
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    place: usize,
    order: Order,
    /// Largest multiple at which a number begins.
    alignment: usize,
}

/// Returns the N bytes at a place.
pub(super) fn field<const N: usize>(bytes: &[u8], place: usize) -> Result<[u8; N], CutOff> {
    bytes.get(place..).and_then(|rest| rest.first_chunk()).copied().ok_or(CutOff)
}

impl Order {
    /// Returns the bits of a number of 8 bytes at most.
    pub(super) fn bits(self, bytes: &[u8]) -> u64 {
        let next = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        match self {
            Self::Little => bytes.iter().rev().fold(0, next),
            Self::Big => bytes.iter().fold(0, next),
        }
    }
}

impl Number {
    /// Returns the number of bytes that hold the bits.
    pub(super) const fn size(self) -> usize {
        self.bits.div_ceil(8) as usize
    }

    /// Returns the number that the lowest of these bits are.
    pub(super) fn value(self, bits: u64) -> f64 {
        let unused = 64 - self.bits;
        let high = bits << unused;
        match self.form {
            Form::Unsigned => (high >> unused) as f64,
            Form::Signed => (high as i64 >> unused) as f64,
            Form::Float if self.bits == 32 => f32::from_bits((high >> unused) as u32).into(),
            Form::Float => f64::from_bits(high),
        }
    }
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8], order: Order) -> Self {
        Self::aligned(bytes, order, 1)
    }

    /// Reads numbers each of which begins at a multiple of its size, or of `alignment` where that is less.
    pub(super) fn aligned(bytes: &'a [u8], order: Order, alignment: usize) -> Self {
        Self { bytes, place: 0, order, alignment }
    }

    pub(super) fn order(&self) -> Order {
        self.order
    }

    /// Returns the next bytes, as many as `length`.
    pub(super) fn take(&mut self, length: usize) -> Result<&'a [u8], CutOff> {
        let own = self.bytes.get(self.place..).and_then(|rest| rest.get(..length));
        let own = own.ok_or(CutOff)?;
        self.place += length;
        Ok(own)
    }

    /// Returns all bytes behind.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.place..).unwrap_or_default()
    }

    fn number(&mut self, size: usize) -> Result<u64, CutOff> {
        self.place = self.place.next_multiple_of(size.min(self.alignment));
        self.take(size).map(|own| self.order.bits(own))
    }

    pub(super) fn u16(&mut self) -> Result<u16, CutOff> {
        self.number(2).map(|own| own as u16)
    }

    pub(super) fn u32(&mut self) -> Result<u32, CutOff> {
        self.number(4).map(|own| own as u32)
    }

    pub(super) fn u64(&mut self) -> Result<u64, CutOff> {
        self.number(8)
    }

    pub(super) fn f64(&mut self) -> Result<f64, CutOff> {
        self.number(8).map(f64::from_bits)
    }

    /// Returns the bytes of a text, before which their number stands in 32 bits.
    pub(super) fn text(&mut self) -> Result<&'a [u8], CutOff> {
        let length = self.u32()?;
        self.take(length as usize)
    }
}

impl fmt::Display for CutOff {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str("is cut off or damaged: copy, save or record it again")
    }
}

impl From<CutOff> for String {
    fn from(own: CutOff) -> Self {
        own.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_form_a_length_and_an_order() {
        for (form, bits, bytes, expected) in [
            (Form::Unsigned, 8, &[0xFE][..], 254.0),
            (Form::Signed, 8, &[0xFE], -2.0),
            (Form::Unsigned, 16, &[0x01, 0xFF], 65281.0),
            (Form::Signed, 16, &[0x01, 0xFF], -255.0),
            (Form::Signed, 12, &[0xFF, 0xF7], 2047.0),
            (Form::Signed, 12, &[0x00, 0x08], -2048.0),
            (Form::Float, 32, &[0, 0, 0x40, 0xC0], -3.0),
            (Form::Signed, 64, &[0xFF; 8], -1.0),
            (Form::Float, 64, &[0, 0, 0, 0, 0, 0, 0xF8, 0x3F], 1.5),
        ] {
            let number = Number { form, bits };
            assert_eq!(number.size(), bytes.len());
            assert_eq!(number.value(Order::Little.bits(bytes)), expected, "{number:?}");
            let bytes: Vec<u8> = bytes.iter().rev().copied().collect();
            assert_eq!(number.value(Order::Big.bits(&bytes)), expected, "{number:?}");
        }
    }

    #[test]
    fn a_reader_goes_on_and_ends() {
        let bytes = [7, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', b'c', 9, 8];
        let mut reader = Reader::new(&bytes, Order::Little);
        assert_eq!((reader.u32(), reader.text()), (Ok(7), Ok(&b"abc"[..])));
        assert_eq!((reader.u32(), reader.rest()), (Err(CutOff), &[9, 8][..]));
        assert_eq!((reader.u16(), reader.u16()), (Ok(0x0809), Err(CutOff)));
        let mut aligned = Reader::aligned(&bytes, Order::Big, 4);
        assert_eq!((aligned.take(1), aligned.u32()), (Ok(&[7][..]), Ok(0x0300_0000)));
        assert_eq!(field::<2>(&bytes, 11), Ok([9, 8]));
        assert_eq!(field::<2>(&bytes, 12), Err(CutOff));
    }
}
