"""Writes the seeds of bags, MAT, MF4, TDMS and LVM files and of tables, with the programs that people use.

    pip install asammdf npTDMS scipy rosbags mcap lz4 zstandard pandas lvm_read; python3 tests/fuzz/seeds/write.py

Each holds the same cut: at row i of 40, at 1 kHz, force i, 2, -3 N, acceleration 0.5, i / 8, -9.5 m/s^2, angles 0.1, -0.2 rad.
"""

import struct
import sys
import tempfile
from pathlib import Path

import numpy as np

from hostile import hostile

HERE = Path(__file__).parent
ROWS = 40
row = np.arange(ROWS, dtype=float)
time = row * 1e-3
force = np.stack([row, 0 * row + 2, 0 * row - 3], axis=1)
acceleration = np.stack([0 * row + 0.5, row / 8, 0 * row - 9.5], axis=1)
angles = np.array([0.1, -0.2])
START_NS = 1_767_000_000_000_000_000


def bags():
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer
    from rosbags.rosbag2 import Writer as BagWriter
    from rosbags.rosbag2.enums import StoragePlugin
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    vector = types["geometry_msgs/msg/Vector3"]

    def header(i):
        stamp = types["builtin_interfaces/msg/Time"](sec=START_NS // 10**9, nanosec=i * 1_000_000)
        return types["std_msgs/msg/Header"](stamp=stamp, frame_id="tool0")

    def wrench(i):
        own = types["geometry_msgs/msg/Wrench"](force=vector(*force[i]), torque=vector(0.0, 0.0, 0.0))
        return types["geometry_msgs/msg/WrenchStamped"](header=header(i), wrench=own)

    def imu(i):
        return types["sensor_msgs/msg/Imu"](
            header=header(i), orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
            orientation_covariance=np.zeros(9), angular_velocity=vector(0.0, 0.0, 0.0),
            angular_velocity_covariance=np.zeros(9), linear_acceleration=vector(*acceleration[i]),
            linear_acceleration_covariance=np.zeros(9))

    def joints(i):
        return types["sensor_msgs/msg/JointState"](
            header=header(i), name=["joint_2", "gripper", "joint_1"], position=np.array([angles[1], 9.0, angles[0]]),
            velocity=np.zeros(3), effort=np.zeros(3))

    folder = HERE / "bag"
    folder.mkdir(exist_ok=True)
    made = Path(tempfile.mkdtemp()) / "bag"
    with BagWriter(made, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = [("/ft/wrench", "geometry_msgs/msg/WrenchStamped", wrench), ("/imu", "sensor_msgs/msg/Imu", imu),
                  ("/joint_states", "sensor_msgs/msg/JointState", joints)]
        connections = [writer.add_connection(topic, name, typestore=store) for topic, name, _ in topics]
        for i in range(ROWS):
            for connection, (_, name, message) in zip(connections, topics):
                if message is not joints or i % 10 == 0:
                    # Recorded late, as by a recorder: the stamp is in the header.
                    writer.write(connection, START_NS + i * 1_000_000 + 3_000_000, store.serialize_cdr(message(i), name))
    plain = next(made.glob("*.mcap"))
    (folder / "rosbags.mcap").write_bytes(plain.read_bytes())
    # The writer of MCAP's own package, in small chunks.
    for compression in CompressionType:
        with open(folder / f"mcap-{compression.name.lower()}.mcap", "wb") as file, open(plain, "rb") as source:
            writer = Writer(file, compression=compression, chunk_size=1500)
            writer.start(profile="ros2")
            ids = {}
            for schema, channel, message in make_reader(source).iter_messages():
                if channel.id not in ids:
                    own = writer.register_schema(schema.name, schema.encoding, b"")
                    ids[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, own)
                writer.add_message(ids[channel.id], message.log_time, message.data, message.publish_time)
            writer.finish()


def mat():
    from scipy.io import savemat

    folder = HERE / "mat"
    folder.mkdir(exist_ok=True)
    columns = {name: force[:, [i]] for i, name in enumerate(["Fx", "Fy", "Fz"])}
    columns |= {name: acceleration[:, [i]] for i, name in enumerate(["ax", "ay", "az"])}
    others = {"note": "a cut", "settings": {"rpm": 1200.0}, "empty": np.zeros((0, 0)), "q": angles.reshape(1, 2), "z": np.array([[1 + 2j]])}
    savemat(folder / "columns.mat", {"time": time} | others | columns)
    # MATLAB stores whole numbers of a double array as small integers.
    savemat(folder / "packed.mat", {"time": time.reshape(-1, 1)} | columns | others, do_compression=True)
    savemat(folder / "matrices.mat", {"F": force, "A": acceleration.T.astype(np.float32), "t": time.reshape(1, -1), "q": angles})


def mdf():
    from asammdf import MDF, Signal
    from asammdf.blocks import v4_constants

    folder = HERE / "mdf"
    folder.mkdir(exist_ok=True)

    def signals():
        names = [("Fx", "N", force[:, 0]), ("Fy", "N", force[:, 1]), ("Fz", "N", force[:, 2]),
                 ("ax", "m/s^2", acceleration[:, 0]), ("ay", "m/s^2", acceleration[:, 1]), ("az", "m/s^2", acceleration[:, 2])]
        made = [Signal(samples=samples, timestamps=time, name=name, unit=unit) for name, unit, samples in names]
        # A raw channel of a converter with a scale.
        made[0] = Signal(samples=(10 * row).astype(np.int16), timestamps=time, name="Fx", unit="N",
                         conversion={"a": 0.1, "b": 0.0})
        made.append(Signal(samples=np.array([b"a"] * ROWS), timestamps=time, name="note", encoding="latin-1"))
        return made

    for name, compression in [("plain", 0), ("deflate", 1), ("transposed", 2)]:
        mdf = MDF(version="4.10")
        mdf.append(signals(), comment="cut", common_timebase=True)
        mdf.save(folder / f"{name}.mf4", compression=compression, overwrite=True)
    # Numbers whose greatest byte comes first (Motorola), as control units send them: floats and whole ones.
    mdf = MDF(version="4.10")
    motorola = signals()[:6]
    for signal, kind in zip(motorola, [">i2", ">f8", ">i4", ">f4", ">f8", ">f8"]):
        signal.samples = signal.samples.astype(kind)
    mdf.append(motorola, comment="cut", common_timebase=True)
    mdf.save(folder / "motorola.mf4", overwrite=True)
    # A group for each channel.
    mdf = MDF(version="4.20")
    for signal in signals()[:6]:
        mdf.append([signal])
    mdf.save(folder / "groups.mf4", overwrite=True)


def tdms():
    from nptdms import ChannelObject, RootObject, GroupObject, TdmsWriter

    folder = HERE / "tdms"
    folder.mkdir(exist_ok=True)
    names = [("Fx", "N", force[:, 0]), ("Fy", "N", force[:, 1]), ("Fz", "N", force[:, 2]),
             ("ax", "m/s^2", acceleration[:, 0].astype(np.float32)), ("ay", "m/s^2", acceleration[:, 1]), ("az", "m/s^2", acceleration[:, 2])]

    def write(name, parts):
        with TdmsWriter(folder / name) as writer:
            for part in np.array_split(np.arange(ROWS), parts):
                channels = [ChannelObject("cut", own, values[part], {"wf_increment": 1e-3, "unit_string": unit}) for own, unit, values in names]
                writer.write_segment([RootObject({"author": "lab"}), GroupObject("cut", {"rpm": 1200}), *channels])

    write("whole.tdms", 1)
    write("segments.tdms", 4)
    daqmx(folder / "daqmx.tdms", names)
    together(folder / "big-endian.tdms", names)


def together(file, names):
    """Two chunks of values of an instant together, the greatest byte first, which LabVIEW writes and no Python package. npTDMS reads it back."""
    from nptdms import TdmsFile

    def text(own):
        return struct.pack(">I", len(own)) + own.encode()

    described = struct.pack(">I", 6)
    for name, unit, values in names:
        index = struct.pack(">IIIQ", 20, 9 if values.dtype == np.float32 else 10, 1, ROWS // 2)
        properties = text("wf_increment") + struct.pack(">Id", 10, 1e-3) + text("unit_string") + struct.pack(">I", 0x20) + text(unit)
        described += text(f"/'cut'/'{name}'") + index + struct.pack(">I", 2) + properties
    rows = np.empty(ROWS, dtype=[(name, values.dtype.newbyteorder(">")) for name, _, values in names])
    for name, _, values in names:
        rows[name] = values
    rows = rows.tobytes()
    contents = 1 << 1 | 1 << 2 | 1 << 3 | 1 << 5 | 1 << 6
    lead = b"TDSm" + struct.pack("<I", contents) + struct.pack(">IQQ", 4713, len(described) + len(rows), len(described))
    file.write_bytes(lead + described + rows)
    for name, _, values in names:
        assert np.array_equal(TdmsFile.read(file)["cut"][name][:], values), name


def daqmx(file, names):
    """Raw data as NI's drivers log them, which no Python package writes: int16 rows of one device, with a scale of each channel. npTDMS reads it back."""
    from nptdms import TdmsFile

    def text(own):
        return struct.pack("<I", len(own)) + own.encode()

    def number(name, own):
        return text(name) + (struct.pack("<II", 7, own) if isinstance(own, int) else struct.pack("<Id", 10, own))

    def word(name, own):
        return text(name) + struct.pack("<I", 0x20) + text(own)

    described = struct.pack("<I", 6)
    for place, (name, unit, _) in enumerate(names):
        scaler = struct.pack("<IIIII", 3, 0, 2 * place, 0, 0)
        index = struct.pack("<IIIQI", 0x1269, 0xFFFFFFFF, 1, ROWS // 2, 1) + scaler + struct.pack("<II", 1, 12)
        properties = [number("wf_increment", 1e-3), word("unit_string", unit), word("NI_Scaling_Status", "unscaled"), number("NI_Number_Of_Scales", 2),
                      word("NI_Scale[1]_Scale_Type", "Linear"), number("NI_Scale[1]_Linear_Slope", 1 / 16),
                      number("NI_Scale[1]_Linear_Y_Intercept", 1.0), number("NI_Scale[1]_Linear_Input_Source", 0)]
        described += text(f"/'cut'/'{name}'") + index + struct.pack("<I", len(properties)) + b"".join(properties)
    rows = np.stack([16 * (values - 1) for _, _, values in names], axis=1).astype("<i2").tobytes()
    lead = b"TDSm" + struct.pack("<IIQQ", 1 << 1 | 1 << 2 | 1 << 3 | 1 << 7, 4713, len(described) + len(rows), len(described))
    file.write_bytes(lead + described + rows)
    for name, _, values in names:
        assert np.array_equal(TdmsFile.read(file)["cut"][name][:], values), name


def tables():
    import csv

    import pandas

    names = ["time [s]", "Fx [N]", "Fy [N]", "Fz [N]", "ax [m/s^2]", "ay [m/s^2]", "az [m/s^2]", "q1 [rad]", "q2 [m]"]
    columns = np.hstack([time[:, None], force, acceleration, np.tile(angles, (ROWS, 1))])
    table, folder = pandas.DataFrame(columns, columns=names), HERE / "table"
    table.to_csv(folder / "pandas.csv", index=False)
    table.to_csv(folder / "pandas-semicolons.csv", index=False, sep=";", decimal=",")
    # Every cell in quotes, since commas separate and are decimal too.
    table.to_csv(folder / "pandas-quoted.csv", index=False, decimal=",", quoting=csv.QUOTE_ALL)


def lvm():
    """Files of LabVIEW's "Write To Measurement File", which no Python package writes. lvm_read reads them back."""
    import lvm_read

    names, values = ["Fx", "Fy", "Fz", "ax", "ay", "az"], np.hstack([force, acceleration])
    channels = [(name, "Newtons" if k < 3 else "m/s^2", values[:, k]) for k, name in enumerate(names)]

    def write(name, times, mark, channels, cuts, comments={}):
        """Channels are name, unit and values, or none. `times` are of No, One or Multi columns."""

        def number(own, form=".6f"):
            return format(own, form).replace(".", mark)

        def line(key, cells, between="", end=""):
            spread = [own for cell in cells for own in (cell, between)][:-1] if times == "Multi" else cells
            return "\t".join([key, *spread, end]) + "\n"

        each = [""] * len(channels)
        text = f"LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t{mark}\nMulti_Headings\tYes\n"
        text += f"X_Columns\t{times}\nTime_Pref\tAbsolute\nOperator\tlab\nDate\t2026/11/27\nTime\t13:44:15{mark}123456\n***End_of_Header***\t\n\t\n"
        for cut in cuts:
            text += "Notes\tno chatter\n" + line("Channels", [str(len(channels)), *each[1:]])
            text += line("Samples", [str(len(cut) if len(own) else 0) for *_, own in channels])
            text += line("Date", ["2026/11/27" for _ in each]) + line("Time", [f"13:44:15{mark}123456" for _ in each])
            text += line("Y_Unit_Label", [unit for _, unit, _ in channels]) + line("X_Dimension", ["Time" for _ in each])
            text += line("X0", [number(0, ".16E") for _ in each])
            text += line("Delta_X", [number(1e-3 if len(own) else 1) for *_, own in channels]) + line("***End_of_Header***", each)
            text += line("X_Value", [name for name, *_ in channels], "X_Value", "Comment")
            for i in cut:
                stamp = "" if times == "No" else number(time[i])
                cells = [number(own[i]) if len(own) else "" for *_, own in channels]
                own = line(stamp, cells, stamp, comments.get(i, ""))
                text += own if i in comments else own.replace("\t\n", "\n")
            text += "\n"
        file = HERE / "table" / name
        file.write_text(text, newline="\r\n")
        read = lvm_read.read(str(file), read_from_pickle=False, dump_file=False)
        cuts = [read[cut]["data"][:, [read[cut]["Channel names"].index(own) for own in names]] for cut in range(read["Segments"])]
        assert np.array_equal(np.vstack(cuts), values), name

    write("none.lvm", "No", ",", channels, [range(25), range(25, ROWS)])
    write("multi.lvm", "Multi", ",", channels, [range(ROWS)])
    empty = ("Untitled", "", [])
    write("gaps.lvm", "One", ".", [empty, *channels[:3], empty, *channels[3:]], [range(ROWS)], {0: "begins", 30: "a blow"})


if __name__ == "__main__":
    for make in [globals()[name] for name in sys.argv[1:] or ["bags", "mat", "mdf", "tdms", "tables", "lvm", "hostile"]]:
        make()
