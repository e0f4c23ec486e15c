"""Spoils the seeds that write.py writes: files that are cut off, that state more than they hold, and that point to themselves. All are small."""

import struct
from pathlib import Path

HERE = Path(__file__).parent
HUGE = 1 << 63


def patched(own, place, form, *values):
    """The bytes with other values at a place."""
    return own[:place] + struct.pack(form, *values) + own[place + struct.calcsize(form):]


def behind(own, mark, offset=0):
    """The place behind the first mark."""
    return own.index(mark) + len(mark) + offset


def zeros(blocks):
    """Zstandard of so many blocks of 128 KiB of zeros, of four bytes each."""
    size = 128 << 10
    block = [struct.pack("<I", size << 3 | 1 << 1 | (number == blocks - 1))[:3] + b"\0" for number in range(blocks)]
    return b"\x28\xb5\x2f\xfd" + bytes([0, 7 << 3]) + b"".join(block)


def bags():
    whole = (HERE / "bag/mcap-none.mcap").read_bytes()
    chunks, place = [], 8
    while place + 9 < len(whole):
        kind, length = struct.unpack_from("<BQ", whole, place)
        chunks += [place] * (kind == 6)
        place += 9 + length

    def chunk(stated, compression, content):
        body = struct.pack("<QQQII", 0, 0, stated, 0, len(compression)) + compression + struct.pack("<Q", len(content)) + content
        return struct.pack("<BQ", 6, len(body)) + body

    first = whole[:chunks[1]]
    yield "cut-off", whole[:chunks[2] - 560]
    yield "record", first + struct.pack("<BQ", 5, HUGE) + bytes(8)
    yield "states-much", first + chunk(HUGE, b"zstd", zeros(1))
    # 60 MiB of zeros behind a head that states 1000 bytes.
    yield "bomb", first + chunk(1000, b"zstd", zeros(480))


def mats():
    whole = (HERE / "mat/columns.mat").read_bytes()
    force = behind(whole, b"Fx\0\0")
    yield "cut-off", whole[:force + 100]
    yield "element", patched(whole, force + 4, "<I", 0xFFFF_FFF8)
    # As many rows as its element would have then, and the element around it.
    yield "states-much", patched(patched(patched(whole, force + 4, "<I", 0xFFFF_FFF8), force - 16, "<I", 0x1FFF_FFFF), force - 44, "<I", 0xFFFF_FFFF)
    packed = (HERE / "mat/packed.mat").read_bytes()
    yield "packed", patched(packed, 132, "<I", 0xFFFF_FFFF)


def mdfs():
    whole = (HERE / "mdf/deflate.mf4").read_bytes()
    channel = whole.index(b"##CN")
    group, data = whole.index(b"##DG"), whole.index(b"##DZ")
    yield "cut-off", whole[:channel + 100]
    yield "circle-channels", patched(whole, channel + 24, "<Q", channel)
    # A list of data that goes on with itself, and one that has the same block in all places.
    for name, links in [("circle-data", [len(whole), data]), ("shared-data", [0] + [data] * 40)]:
        lists = b"##DL" + struct.pack(f"<4xQQ{len(links)}Q", 24 + 8 * len(links), len(links), *links)
        yield name, patched(whole, group + 40, "<Q", len(whole)) + lists
    yield "states-much", patched(patched(whole, data + 32, "<Q", HUGE), whole.index(b"##CG") + 80, "<Q", HUGE)


def tdms():
    whole = (HERE / "tdms/whole.tdms").read_bytes()
    count = behind(whole, b"/'cut'/'Fx'", 12)
    described, = struct.unpack_from("<Q", whole, 20)
    yield "cut-off", whole[:28 + described + 700]
    yield "segment", patched(whole, 12, "<Q", HUGE)
    yield "description", patched(whole, 12, "<QQ", HUGE + 1, HUGE)
    yield "objects", patched(whole, 28, "<I", 0xFFFF_FFFF)
    yield "states-much", patched(whole, count, "<Q", HUGE)


def hostile():
    for folder, ending, made in [("bag", "mcap", bags()), ("mat", "mat", mats()), ("mdf", "mf4", mdfs()), ("tdms", "tdms", tdms())]:
        for name, own in made:
            assert len(own) < 4096, (folder, name, len(own))
            (HERE / folder / f"hostile-{name}.{ending}").write_bytes(own)
