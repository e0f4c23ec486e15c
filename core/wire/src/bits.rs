//! CAN signal codec: the place of a number in a payload, and its scaling.
//!
//! The conventions are those of DBC files. Bit `b` of the payload is bit `b % 8` of byte `b / 8`, and bit 0 is the least
//! significant one. An Intel signal starts at its least significant bit and grows upwards. A Motorola signal starts at its
//! most significant bit and runs down through its byte, then on from bit 7 of the next byte (sawtooth numbering).

use core::fmt;
use core::ops::{Range, RangeInclusive};

/// Order of the bytes of a signal in the payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// Least significant byte first; `@1` in a DBC file.
    Intel,
    /// Most significant byte first; `@0` in a DBC file.
    Motorola,
}

/// Kind of a number in the payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// Integer without a sign.
    Unsigned,
    /// Integer in two's complement.
    Signed,
    /// IEEE 754 number of 32 or 64 bits; `SIG_VALTYPE_` in a DBC file.
    Float,
}

/// One row of the signal table: a number in the payload, whose physical value is `scale · number + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Bit number of the least (Intel) or most (Motorola) significant bit.
    pub start_bit: u16,
    /// Width in bits, 1 to 64.
    pub length: u8,
    /// Order of the bytes.
    pub byte_order: ByteOrder,
    /// Kind of the number.
    pub number: Number,
    /// Physical unit per unit of the number; may be negative.
    pub scale: f64,
    /// Physical value of the number 0.
    pub offset: f64,
}

/// Reason why a signal cannot be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalError {
    /// The width, in bits, is not 1 to 64.
    Length(u8),
    /// The width of a floating-point number, in bits, is not 32 or 64.
    FloatLength(u8),
    /// Scale or offset is not finite, or the scale is 0.
    Scaling,
    /// The signal does not end within the payload.
    OutsidePayload {
        /// Number of bytes that the signal needs.
        needed: usize,
        /// Number of bytes of the payload.
        payload: usize,
    },
    /// The value to be written is not a number.
    NotANumber,
}

impl fmt::Display for SignalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(length) => write!(f, "length is {length} bits: must be 1 to 64"),
            Self::FloatLength(length) => {
                write!(f, "length is {length} bits: a floating-point number has 32 or 64")
            }
            Self::Scaling => f.write_str("scale must be finite and not 0, offset finite"),
            Self::OutsidePayload { needed, payload } => {
                write!(
                    f,
                    "reaches to byte {needed} of a payload of {payload}: mend start bit or length"
                )
            }
            Self::NotANumber => f.write_str("value is not a number: cannot be sent"),
        }
    }
}

impl core::error::Error for SignalError {}

impl Signal {
    /// Checks that the signal is valid and fits into a payload of `payload_len` bytes (8 in CAN, up to 64 in CAN FD).
    ///
    /// The other functions make the same check. This one serves to reject a table before the first frame.
    ///
    /// # Errors
    ///
    /// Returns an error if the width or the scaling is invalid, or if the signal does not end within the payload.
    pub fn check(&self, payload_len: usize) -> Result<(), SignalError> {
        self.window(payload_len).map(drop)
    }

    /// Range of the integers that the signal can carry. The bits of a floating-point number are one without a sign.
    pub fn raw_range(&self) -> RangeInclusive<i128> {
        let length = self.length.clamp(1, 64);
        match self.number {
            Number::Signed => -1 << (length - 1)..=(1 << (length - 1)) - 1,
            Number::Unsigned | Number::Float => 0..=(1 << length) - 1,
        }
    }

    /// Smallest step of the physical value. That of a floating-point number is the one at 1, of 32 bits.
    pub fn step(&self) -> f64 {
        match self.number {
            Number::Unsigned | Number::Signed => self.scale.abs(),
            Number::Float => f64::from(f32::EPSILON) * self.scale.abs(),
        }
    }

    /// The integer in the payload (`i128` holds both `u64` and `i64`), or the bits of a floating-point number.
    ///
    /// # Errors
    ///
    /// The errors are those of [`Signal::check`].
    pub fn decode_raw(&self, payload: &[u8]) -> Result<i128, SignalError> {
        let window = self.window(payload.len())?;
        let unused = 64 - self.length;
        let field = ((self.load(&payload[window.bytes]) >> window.shift) as u64) << unused;
        Ok(match self.number {
            Number::Signed => i128::from(field as i64 >> unused),
            Number::Unsigned | Number::Float => i128::from(field >> unused),
        })
    }

    /// The physical value in the payload, `scale · number + offset`. It is finite, unless the number is floating-point.
    ///
    /// # Errors
    ///
    /// The errors are those of [`Signal::check`].
    pub fn decode(&self, payload: &[u8]) -> Result<f64, SignalError> {
        let raw = self.decode_raw(payload)?;
        let number = match (self.number, self.length) {
            (Number::Float, 32) => f32::from_bits(raw as u32).into(),
            (Number::Float, _) => f64::from_bits(raw as u64),
            (Number::Unsigned | Number::Signed, _) => raw as f64,
        };
        Ok(number * self.scale + self.offset)
    }

    /// Writes the integer of [`raw_range`](Self::raw_range) that is nearest to `raw`. Bits of other signals do not change.
    ///
    /// # Errors
    ///
    /// The errors are those of [`Signal::check`]. The payload does not change then.
    pub fn encode_raw(&self, raw: i128, payload: &mut [u8]) -> Result<(), SignalError> {
        let window = self.window(payload.len())?;
        let raw = raw.clamp(*self.raw_range().start(), *self.raw_range().end());
        let mask = u128::MAX >> (128 - u32::from(self.length));
        let bytes = &mut payload[window.bytes];
        let others = self.load(bytes) & !(mask << window.shift);
        self.store(others | (raw as u128 & mask) << window.shift, bytes);
        Ok(())
    }

    /// Writes a physical value, rounded to the nearest step (ties to even) and limited to the range of the signal. Bits of
    /// other signals do not change.
    ///
    /// # Errors
    ///
    /// Returns an error as [`Signal::check`] does, or if `physical` is not a number. The payload does not change then.
    pub fn encode(&self, physical: f64, payload: &mut [u8]) -> Result<(), SignalError> {
        self.check(payload.len())?;
        if physical.is_nan() {
            return Err(SignalError::NotANumber);
        }
        let number = (physical - self.offset) / self.scale;
        let raw = match (self.number, self.length) {
            (Number::Float, 32) => {
                (number.clamp(f32::MIN.into(), f32::MAX.into()) as f32).to_bits().into()
            }
            (Number::Float, _) => number.clamp(f64::MIN, f64::MAX).to_bits().into(),
            (Number::Unsigned | Number::Signed, _) => libm::rint(number) as i128,
        };
        self.encode_raw(raw, payload)
    }

    /// Place of the signal in a payload, after a check that it fits.
    fn window(&self, payload_len: usize) -> Result<Window, SignalError> {
        if !(1..=64).contains(&self.length) {
            return Err(SignalError::Length(self.length));
        }
        if self.number == Number::Float && !matches!(self.length, 32 | 64) {
            return Err(SignalError::FloatLength(self.length));
        }
        if !self.scale.is_finite() || self.scale == 0.0 || !self.offset.is_finite() {
            return Err(SignalError::Scaling);
        }
        // Counted in the direction of the byte order, the bits of a signal are consecutive.
        let start = usize::from(self.start_bit);
        let first = match self.byte_order {
            ByteOrder::Intel => start,
            ByteOrder::Motorola => start / 8 * 8 + 7 - start % 8,
        };
        let end = first + usize::from(self.length);
        let bytes = first / 8..end.div_ceil(8);
        if bytes.end > payload_len {
            return Err(SignalError::OutsidePayload { needed: bytes.end, payload: payload_len });
        }
        let shift = match self.byte_order {
            ByteOrder::Intel => first % 8,
            ByteOrder::Motorola => bytes.end * 8 - end,
        };
        Ok(Window { bytes, shift })
    }

    /// Reads at most 9 bytes as one integer, in the byte order of the signal.
    fn load(&self, bytes: &[u8]) -> u128 {
        let append = |word: u128, &byte: &u8| word << 8 | u128::from(byte);
        match self.byte_order {
            ByteOrder::Intel => bytes.iter().rev().fold(0, append),
            ByteOrder::Motorola => bytes.iter().fold(0, append),
        }
    }

    fn store(&self, word: u128, bytes: &mut [u8]) {
        let mut word = word;
        let mut put = |byte: &mut u8| {
            *byte = word as u8;
            word >>= 8;
        };
        match self.byte_order {
            ByteOrder::Intel => bytes.iter_mut().for_each(&mut put),
            ByteOrder::Motorola => bytes.iter_mut().rev().for_each(&mut put),
        }
    }
}

/// Place of a signal: bytes of the payload, read as one integer, and the number of the signal's lowest bit in this integer.
struct Window {
    bytes: Range<usize>,
    shift: usize,
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;

    const FORCE_X: Signal = Signal {
        start_bit: 0,
        length: 16,
        byte_order: ByteOrder::Intel,
        number: Number::Signed,
        scale: 0.1,
        offset: 0.0,
    };

    /// Payload bit that holds bit `i` of the integer, by the definition, one bit at a time.
    fn bit_number(signal: &Signal, i: u8) -> usize {
        let mut bit = usize::from(signal.start_bit);
        match signal.byte_order {
            ByteOrder::Intel => bit + usize::from(i),
            ByteOrder::Motorola => {
                for _ in i + 1..signal.length {
                    bit = if bit % 8 == 0 { bit + 15 } else { bit - 1 };
                }
                bit
            }
        }
    }

    fn bit(payload: &[u8], number: usize) -> bool {
        payload[number / 8] >> (number % 8) & 1 == 1
    }

    prop_compose! {
        /// A signal and a payload that holds it.
        fn placed()(
            payload in prop_oneof![
                prop::collection::vec(any::<u8>(), 1..=8),
                prop::collection::vec(any::<u8>(), 9..=64),
            ],
            start in any::<prop::sample::Index>(),
            length in 1u8..=64,
            intel in any::<bool>(),
            signed in any::<bool>(),
            scale in prop_oneof![1e-6..1e3, -1e3..-1e-6],
            offset in -1e3..1e3,
        ) -> (Signal, std::vec::Vec<u8>) {
            let start = start.index(payload.len() * 8);
            let byte_order = if intel { ByteOrder::Intel } else { ByteOrder::Motorola };
            let before = if intel { start } else { start / 8 * 8 + 7 - start % 8 };
            let length = usize::from(length).min(payload.len() * 8 - before) as u8;
            let number = if signed { Number::Signed } else { Number::Unsigned };
            (Signal { start_bit: start as u16, length, byte_order, number, scale, offset }, payload)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..Default::default() })]

        #[test]
        fn decoding_follows_the_definition_bit_by_bit((signal, payload) in placed()) {
            let mut expected: i128 = 0;
            for i in 0..signal.length {
                expected |= i128::from(bit(&payload, bit_number(&signal, i))) << i;
            }
            if signal.number == Number::Signed && expected >> (signal.length - 1) == 1 {
                expected -= 1 << signal.length;
            }
            prop_assert_eq!(signal.decode_raw(&payload), Ok(expected));
        }

        #[test]
        fn what_is_written_is_read_and_other_bits_stay((signal, mut payload) in placed(), raw in any::<i128>()) {
            let before = payload.clone();
            let (low, high) = signal.raw_range().into_inner();
            let raw = low + raw.rem_euclid(high - low + 1);
            prop_assert_eq!(signal.encode_raw(raw, &mut payload), Ok(()));
            prop_assert_eq!(signal.decode_raw(&payload), Ok(raw));
            let own: std::vec::Vec<_> = (0..signal.length).map(|i| bit_number(&signal, i)).collect();
            for number in (0..payload.len() * 8).filter(|number| !own.contains(number)) {
                prop_assert_eq!(bit(&payload, number), bit(&before, number));
            }
        }

        #[test]
        fn physical_values_return_to_half_a_step((signal, mut payload) in placed(), at in 0.0..1.0) {
            prop_assume!(signal.length <= 48);
            let (low, high) = signal.raw_range().into_inner();
            let steps = low as f64 + at * (high - low) as f64;
            let physical = steps * signal.scale + signal.offset;
            prop_assert_eq!(signal.encode(physical, &mut payload), Ok(()));
            let error = (signal.decode(&payload).unwrap() - physical).abs();
            let rounding = 1e-15 * (physical.abs() + signal.offset.abs());
            prop_assert!(error <= 0.5 * signal.scale.abs() + 4.0 * rounding, "{error}");
        }

        #[test]
        fn no_layout_panics(
            start_bit in any::<u16>(),
            length in any::<u8>(),
            intel in any::<bool>(),
            number in prop_oneof![Just(Number::Unsigned), Just(Number::Signed), Just(Number::Float)],
            scale in any::<f64>(),
            offset in any::<f64>(),
            value in any::<f64>(),
            mut payload in prop::collection::vec(any::<u8>(), 0..=64),
        ) {
            let byte_order = if intel { ByteOrder::Intel } else { ByteOrder::Motorola };
            let signal = Signal { start_bit, length, byte_order, number, scale, offset };
            let checked = signal.check(payload.len());
            prop_assert_eq!(signal.decode(&payload).map(drop), checked);
            prop_assert_eq!(signal.encode(value, &mut payload), checked);
        }
    }

    #[test]
    fn saturates_at_the_raw_range() {
        let mut payload = [0; 8];
        for (physical, expected) in [
            (3276.7, 3276.7),
            (3276.8, 3276.7),
            (f64::INFINITY, 3276.7),
            (-3276.8, -3276.8),
            (-1e300, -3276.8),
            (f64::NEG_INFINITY, -3276.8),
        ] {
            FORCE_X.encode(physical, &mut payload).unwrap();
            assert!((FORCE_X.decode(&payload).unwrap() - expected).abs() < 1e-9, "{physical}");
        }
        let widest = Signal { length: 64, number: Number::Unsigned, scale: 1.0, ..FORCE_X };
        widest.encode(1e30, &mut payload).unwrap();
        assert_eq!(widest.decode_raw(&payload), Ok(u64::MAX.into()));
        widest.encode_raw(-1, &mut payload).unwrap();
        assert_eq!(widest.decode_raw(&payload), Ok(0));
    }

    #[test]
    fn floating_point_numbers_are_those_of_their_bits() {
        let motorola = |length| Signal {
            start_bit: 7,
            length,
            byte_order: ByteOrder::Motorola,
            number: Number::Float,
            scale: 2.0,
            offset: 1.0,
        };
        // Bits of -1.5 and of infinity.
        let payload = [0xBF, 0xC0, 0, 0, 0, 0, 0, 0];
        assert_eq!(motorola(32).decode(&payload), Ok(-2.0));
        assert_eq!(motorola(32).decode(&[0x7F, 0x80, 0, 0]), Ok(f64::INFINITY));
        assert_eq!(motorola(64).decode(&[0xBF, 0xF8, 0, 0, 0, 0, 0, 0]), Ok(-2.0));
        for length in [32, 64] {
            let mut written = [0xA5; 8];
            motorola(length).encode(-2.0, &mut written).unwrap();
            assert_eq!(motorola(length).decode(&written), Ok(-2.0));
            motorola(length).encode(f64::INFINITY, &mut written).unwrap();
            assert!(motorola(length).decode(&written).unwrap() >= f64::from(f32::MAX));
        }
        assert_eq!(motorola(32).step(), 2.0_f64.powi(-22));
    }

    #[test]
    fn rounds_to_nearest_and_ties_to_even() {
        let whole = Signal { scale: 1.0, ..FORCE_X };
        let mut payload = [0; 2];
        for (physical, expected) in [(1.4, 1), (1.5, 2), (2.5, 2), (-0.5, 0), (-1.5, -2)] {
            whole.encode(physical, &mut payload).unwrap();
            assert_eq!(whole.decode_raw(&payload), Ok(expected), "{physical}");
        }
    }

    #[test]
    fn refuses_what_it_cannot_carry_and_leaves_the_payload() {
        let mut payload = [0xA5; 8];
        let cases = [
            (Signal { length: 0, ..FORCE_X }, 1.0, "length is 0 bits: must be 1 to 64"),
            (Signal { length: 65, ..FORCE_X }, 1.0, "length is 65 bits: must be 1 to 64"),
            (
                Signal { number: Number::Float, ..FORCE_X },
                1.0,
                "length is 16 bits: a floating-point number has 32 or 64",
            ),
            (
                Signal { scale: 0.0, ..FORCE_X },
                1.0,
                "scale must be finite and not 0, offset finite",
            ),
            (
                Signal { offset: f64::NAN, ..FORCE_X },
                1.0,
                "scale must be finite and not 0, offset finite",
            ),
            (
                Signal { start_bit: 49, ..FORCE_X },
                1.0,
                "reaches to byte 9 of a payload of 8: mend start bit or length",
            ),
            (FORCE_X, f64::NAN, "value is not a number: cannot be sent"),
        ];
        for (signal, value, message) in cases {
            assert_eq!(signal.encode(value, &mut payload).unwrap_err().to_string(), message);
            assert_eq!(payload, [0xA5; 8]);
        }
        assert_eq!(
            FORCE_X.decode(&[0]),
            Err(SignalError::OutsidePayload { needed: 2, payload: 1 })
        );
    }
}
