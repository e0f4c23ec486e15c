#!/usr/bin/env python3
"""Writes cantools_vectors.jsonl: what cantools makes of CAN payloads, for cantools.rs to compare with.

The messages of mill3.dbc, then 256 randomised ones of CAN and CAN FD lengths, no two signals in the same bit; their
first signals are every width from 1 to 64 bits in both byte orders, signed and unsigned. One JSON object a line:

    payload   random bytes, hexadecimal
    encoded   what cantools makes of the signals' `set`, all other bits 0
    signals   layout; `raw` and `physical` as cantools reads them in `payload`; `set`, off the signal's grid

To regenerate (the seed is fixed: the same file again, unless cantools changed):

    pip install cantools && python3 core/wire/tests/cantools_vectors.py
"""

import json
import pathlib
import random

import cantools
from cantools.database import conversion
from cantools.database.can import Message, Signal

HERE = pathlib.Path(__file__).parent
DBC = HERE / "../../../host-tools/scenario/mill3.dbc"
RANDOM_MESSAGES = 256
PAYLOADS_OF_DBC = 8

rng = random.Random(20240607)


def bits(start, length, big_endian):
    """Bit numbers that a signal occupies, one at a time by the DBC definition."""
    numbers = []
    for _ in range(length):
        numbers.append(start)
        if big_endian:
            start = start + 15 if start % 8 == 0 else start - 1
        else:
            start += 1
    return numbers


def random_message(number):
    """Up to 6 signals wherever there is room; width, byte order and sign of the first follow from the number."""
    first = (number % 64 + 1, number & 64 != 0, number & 128 != 0)
    lengths = [1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 8, 12, 16, 20, 24, 32, 48, 64]
    payload_length = rng.choice([length for length in lengths if 8 * length >= first[0]])
    free = set(range(8 * payload_length))
    signals = []
    attempts = rng.randint(1, 60)
    while not signals or (attempts > 0 and len(signals) < 6):
        attempts -= 1
        other = (rng.choice([rng.randint(1, 64), rng.randint(1, 16)]), rng.random() < 0.5, rng.random() < 0.5)
        length, big_endian, signed = other if signals else first
        start = rng.randrange(8 * payload_length)
        numbers = bits(start, length, big_endian)
        if not free.issuperset(numbers):
            continue
        free.difference_update(numbers)
        magnitude = rng.choice([1, 3, 0.5, 0.1, 0.002, 1e-6, 10 ** rng.uniform(-9, 6)])
        offset = rng.choice([0, 0, -40, 1000, rng.uniform(-1e3, 1e3)])
        signals.append(
            Signal(
                name=f"s{len(signals)}",
                start=start,
                length=length,
                byte_order="big_endian" if big_endian else "little_endian",
                is_signed=signed,
                conversion=conversion.BaseConversion.factory(rng.choice([1, 1, -1]) * magnitude, offset),
            )
        )
    return Message(
        frame_id=number,
        name=f"random_{number}",
        length=payload_length,
        signals=signals,
        is_fd=payload_length > 8,
        strict=True,
    )


def off_grid(signal):
    """A physical value that rounds to one raw value without doubt. Integers above 2^44 leave f64 no room for that."""
    low = -(1 << signal.length - 1) if signal.is_signed else 0
    high = low + (1 << signal.length) - 1
    low, high = max(low, -(1 << 44)), min(high, 1 << 44)
    return (rng.randint(low, high) + rng.uniform(-0.4, 0.4)) * signal.scale + signal.offset


def vector(message):
    payload = rng.randbytes(message.length)
    raw = message.decode(payload, decode_choices=False, scaling=False)
    physical = message.decode(payload, decode_choices=False)
    set_to = {signal.name: off_grid(signal) for signal in message.signals}
    return {
        "message": message.name,
        "payload": payload.hex(),
        "encoded": message.encode(set_to).hex(),
        "signals": [
            {
                "name": signal.name,
                "start_bit": signal.start,
                "length": signal.length,
                "intel": signal.byte_order == "little_endian",
                "signed": signal.is_signed,
                "scale": float(signal.scale),
                "offset": float(signal.offset),
                "raw": raw[signal.name],
                "physical": float(physical[signal.name]),
                "set": set_to[signal.name],
            }
            for signal in message.signals
        ],
    }


def main():
    messages = list(cantools.database.load_file(DBC).messages) * PAYLOADS_OF_DBC
    messages += [random_message(number) for number in range(RANDOM_MESSAGES)]
    with open(HERE / "cantools_vectors.jsonl", "w") as file:
        for message in messages:
            file.write(json.dumps(vector(message), separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
