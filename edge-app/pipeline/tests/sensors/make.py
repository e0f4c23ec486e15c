#!/usr/bin/env python3
"""Writes the logs of the sensors beside this file, and what cantools reads in them.

    NAME.log   frames as candump -L writes them; cantools encodes them by NAME.dbc
    NAME.csv   sensor, counter, x, y, z of each sample of which every frame is in the log, SI units: as cantools decodes them

A sensor without a counter has the number of the sample among those. To write them again (the seed is fixed):

    pip install cantools && python3 edge-app/pipeline/tests/sensors/make.py
"""

import math
import pathlib
import random

import cantools

HERE = pathlib.Path(__file__).parent
G = 9.80665
SAMPLES = 100
# The matrix of ati-xsens.toml: forces and moments of the gauges.
MATRIX = [
    [-0.0021, 0.0412, 0.0935, -1.1402, -0.0871, 1.1267],
    [-0.0732, 1.3183, 0.0415, -0.6594, 0.0508, -0.6501],
    [1.8612, -0.0412, 1.8823, -0.0331, 1.8714, -0.0256],
    [0.0012, 0.0161, -0.0334, -0.0078, 0.0342, -0.0081],
    [0.0381, -0.0005, -0.0192, 0.0141, -0.0187, -0.0139],
    [0.0009, -0.0201, 0.0011, -0.0197, 0.0005, -0.0203],
]


def log(name, messages, sensors, lost):
    """Writes a log of the messages of each sample, and the samples.

    messages   (message, values by sample, delay in s), sent at each sample; None sends an empty request
    sensors    (sensor, messages of it, axes by their decoded values, counter or None)
    lost       (sample, message) that are not in the log
    """
    db = cantools.database.load_file(HERE / f"{name}.dbc")
    lines, rows, counts = [], [], {}
    for sample in range(SAMPLES):
        read = {}
        for message, values, delay in messages:
            layout = db.get_message_by_name(message)
            data = b"" if values is None else layout.encode(values(sample), strict=False)
            if (sample, message) in lost:
                continue
            if values is not None:
                read[message] = layout.decode(data)
            fd = len(data) > 8
            if fd:
                data = data.ljust(next(n for n in (12, 16, 20, 24, 32, 48, 64) if n >= len(data)), b"\0")
            width = 8 if layout.is_extended_frame else 3
            time = 1767000000 + sample * 1e-3 + delay
            mark = "##1" if fd else "#"
            lines.append((time, f"({time:.6f}) can0 {layout.frame_id:0{width}X}{mark}{data.hex().upper()}"))
        for sensor, own, axes, counter in sensors:
            if any((sample, message) in lost for message in own):
                continue
            values = {key: value for message in own for key, value in read[message].items()}
            count = counts.get(sensor, 0)
            counts[sensor] = count + 1
            number = count if counter is None else values[counter]
            rows.append(",".join([sensor, str(number), *(f"{axis:.9g}" for axis in axes(values))]))
    lines.sort()
    (HERE / f"{name}.log").write_text("".join(line + "\n" for _, line in lines))
    (HERE / f"{name}.csv").write_text("".join(row + "\n" for row in rows))


def raw(rng, deviation):
    """Values of a channel, one a sample."""
    return [rng.gauss(0, deviation) for _ in range(SAMPLES)]


def main():
    rng = random.Random(53)
    gauges = [[round(value) for value in raw(rng, 3000)] for _ in range(6)]
    acceleration = [raw(rng, 20) for _ in range(3)]
    milli_g = [[1e3 / G * value for value in axis] for axis in acceleration]
    force = [raw(rng, 100) for _ in range(3)]

    def of(names, channels):
        return lambda sample: {name: channel[sample] for name, channel in zip(names, channels)}

    # The frames of the sensors overlap in time. Either half of a sample is lost, one after the other, and two in a row of both orders.
    log(
        "ati-xsens",
        [
            ("ATI_0", None, 0),
            ("ATI_0", lambda n: {"Status": 0, **of(("sg0", "sg2", "sg4"), gauges[::2])(n)}, 150e-6),
            ("ATI_1", of(("sg1", "sg3", "sg5"), gauges[1::2]), 300e-6),
            ("XCDI_SampleTime", lambda n: {"SampleTime": n * 1e-3}, 500e-6),
            ("XCDI_GroupCounter", lambda n: {"GroupCounter": (65500 + n) % 65536}, 600e-6),
            ("XCDI_Acceleration", of(("accX", "accY", "accZ"), acceleration), 700e-6),
        ],
        [
            (
                "force",
                ["ATI_0", "ATI_1"],
                lambda v: [sum(m * v[f"sg{k}"] for k, m in enumerate(row)) for row in MATRIX[:3]],
                None,
            ),
            (
                "acceleration",
                ["XCDI_GroupCounter", "XCDI_Acceleration"],
                lambda v: [v["accX"], v["accY"], v["accZ"]],
                "GroupCounter",
            ),
        ],
        {
            (72, "ATI_0"),
            (75, "ATI_1"),
            (78, "ATI_1"),
            (79, "ATI_0"),
            (82, "ATI_0"),
            (83, "ATI_1"),
            (86, "XCDI_Acceleration"),
            (87, "XCDI_GroupCounter"),
            (90, "XCDI_GroupCounter"),
            (92, "XCDI_Acceleration"),
        },
    )
    log(
        "wacoh-pcan",
        [
            ("WACOH_FORCE", of(("Fx", "Fy", "Fz"), force), 0),
            (
                "BMC_Acceleration",
                lambda n: {
                    "Temperature": 30,
                    "VerticalAxis": 2,
                    **of(("Acceleration_X", "Acceleration_Y", "Acceleration_Z"), milli_g)(n),
                },
                200e-6,
            ),
        ],
        [
            ("force", ["WACOH_FORCE"], lambda v: [v["Fx"], v["Fy"], v["Fz"]], None),
            (
                "acceleration",
                ["BMC_Acceleration"],
                lambda v: [v[f"Acceleration_{axis}"] * 1e-3 * G for axis in "XYZ"],
                None,
            ),
        ],
        set(),
    )
    # The second frame of a float sample comes first.
    nan = [*acceleration[2][:80], math.nan, *acceleration[2][81:]]
    log(
        "robotous-floats",
        [
            ("RFT_1", lambda n: {"Kind": 16, "Tx_high": 7, **of(("Fx", "Fy", "Fz"), force)(n)}, 0),
            ("RFT_2", lambda n: {"Tx_low": 7, "Ty": 0, "Tz": 0, "Overload": 0}, 100e-6),
            ("DAQ_2", lambda n: {"az": nan[n], "DaqCounter": n}, 300e-6),
            ("DAQ_1", of(("ax", "ay"), acceleration), 450e-6),
        ],
        [
            ("force", ["RFT_1"], lambda v: [v["Fx"], v["Fy"], v["Fz"]], None),
            (
                "acceleration",
                ["DAQ_1", "DAQ_2"],
                lambda v: [v["ax"] * G, v["ay"] * G, v["az"] * G],
                "DaqCounter",
            ),
        ],
        {(70, "DAQ_2"), (73, "DAQ_1"), (76, "DAQ_1"), (77, "DAQ_2")},
    )
    log(
        "can-fd",
        [
            (
                "TOOL",
                lambda n: {
                    "Status": 1,
                    "Count": 4294967290 + n if n < 6 else n - 6,
                    "Temperature": 30,
                    **of(("Fx", "Fy", "Fz"), [[value / 1000 for value in axis] for axis in force])(n),
                    **of(("ax", "ay", "az"), acceleration)(n),
                },
                0,
            )
        ],
        [
            ("force", ["TOOL"], lambda v: [1000 * v[axis] for axis in ("Fx", "Fy", "Fz")], "Count"),
            ("acceleration", ["TOOL"], lambda v: [G * v[axis] for axis in ("ax", "ay", "az")], "Count"),
        ],
        {(50, "TOOL")},
    )
    # Both count 16 bits, from numbers of their own.
    log(
        "jr3-mbed",
        [
            (
                "JR3_FORCE",
                lambda n: {
                    "ForceFrame": (65480 + n) % 65536,
                    **of(("Fx", "Fy", "Fz"), [[value / 2 for value in axis] for axis in force])(n),
                },
                0,
            ),
            (
                "JR3_MOMENT",
                lambda n: {
                    "MomentFrame": (65480 + n) % 65536,
                    **of(("Mx", "My", "Mz"), [[value / 50 for value in axis] for axis in force])(n),
                },
                120e-6,
            ),
            ("XCDI_SampleTime", lambda n: {"SampleTime": n * 1e-3}, 400e-6),
            ("XCDI_GroupCounter", lambda n: {"GroupCounter": 12345 + n}, 550e-6),
            ("XCDI_Acceleration", of(("accX", "accY", "accZ"), acceleration), 700e-6),
        ],
        [
            ("force", ["JR3_FORCE"], lambda v: [v["Fx"], v["Fy"], v["Fz"]], "ForceFrame"),
            (
                "acceleration",
                ["XCDI_GroupCounter", "XCDI_Acceleration"],
                lambda v: [v["accX"], v["accY"], v["accZ"]],
                "GroupCounter",
            ),
        ],
        {(70, "JR3_FORCE"), (75, "JR3_MOMENT"), (80, "XCDI_Acceleration"), (85, "XCDI_GroupCounter")},
    )


main()
