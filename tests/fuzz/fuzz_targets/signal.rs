//! Any row of a signal table on any payload.
//!
//! A signal that does not fit is refused and the payload stays; one that fits reads the integer that was written,
//! keeps the bits of its neighbours, and brings a physical value back to half a step.
#![no_main]

use flexid_wire::bits::{ByteOrder, Number, Signal, SignalError};
use libfuzzer_sys::fuzz_target;

/// Start bit, length, Intel's byte order, kind of number, scale, offset, a physical value, a payload.
type Input<'a> = (u16, u8, bool, u8, f64, f64, f64, &'a [u8]);

fuzz_target!(|input: Input<'_>| {
    let (start_bit, length, intel, number, scale, offset, physical, payload) = input;
    let signal = Signal {
        // Mostly near a payload, at times far outside.
        start_bit: if start_bit < 0xF000 { start_bit % 520 } else { start_bit },
        length: if length < 0xF0 { length % 66 } else { length },
        byte_order: if intel { ByteOrder::Intel } else { ByteOrder::Motorola },
        number: [Number::Unsigned, Number::Signed, Number::Float][usize::from(number % 3)],
        scale,
        offset,
    };
    let before = &payload[..payload.len().min(64)];
    let mut payload = before.to_vec();

    let raw = match signal.decode_raw(before) {
        Ok(raw) => raw,
        Err(error) => {
            assert_eq!(signal.check(before.len()), Err(error));
            assert_eq!(signal.decode(before), Err(error));
            assert_eq!(signal.encode(physical, &mut payload), Err(error));
            assert_eq!(payload, before);
            return;
        }
    };
    assert!(signal.raw_range().contains(&raw));
    signal.encode_raw(raw, &mut payload).unwrap();
    assert_eq!(payload, before);

    match signal.encode(physical, &mut payload) {
        Ok(()) if signal.number == Number::Float => {}
        Ok(()) => returns_to_half_a_step(&signal, physical, &payload),
        Err(error) => {
            assert!(error == SignalError::NotANumber && physical.is_nan());
            assert_eq!(payload, before);
        }
    }
    // Written back, the first integer restores every bit: the others were not touched.
    signal.encode_raw(raw, &mut payload).unwrap();
    assert_eq!(payload, before);
});

/// Checks that a reading returns to half a step, or the nearest end of the range, where f64 resolves a step at all.
fn returns_to_half_a_step(signal: &Signal, physical: f64, payload: &[u8]) {
    let ends = signal.raw_range();
    let [a, b] = [*ends.start(), *ends.end()].map(|raw| raw as f64 * signal.scale + signal.offset);
    let rounding = 4.0 * f64::EPSILON * (a.abs() + b.abs() + signal.offset.abs());
    let step = signal.scale.abs();
    if !rounding.is_finite() || rounding > 0.01 * step || step < f64::MIN_POSITIVE {
        return;
    }
    let nearest = physical.clamp(a.min(b), a.max(b));
    let error = (signal.decode(payload).unwrap() - nearest).abs();
    assert!(error <= 0.5 * step + rounding, "{signal:?}: {physical} came back {error} away");
}
