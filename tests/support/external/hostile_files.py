"""Files designed to harm their reader: bags, logs of PX4 and tables. Each is created on demand.

Their content is known from the formats alone: "ROS 2 bag" (rosbag2's metadata.yaml and sqlite3 storage), "MCAP File
Format" (mcap.dev/spec), "ULog File Format" (docs.px4.io).
"""

import gzip
import json
import os
import socket
import sqlite3
import struct
import sys
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lz4.frame

from support.external.packed import pack_zeros, zstd

IMU, POSE = "sensor_msgs/msg/Imu", "geometry_msgs/msg/PoseStamped"
MAGIC = b"\x89MCAP0\r\n"
GIGABYTE = 1 << 30
TIMES = "time_s,x_rad_s,y_rad_s,z_rad_s\n"
Makes = Callable[[Path], Path]  # the file made in that folder, by the path to read


def reading(length: int = 0) -> bytes:
    """Return a message of an IMU at rest in CDR; its frame claims a name of this length."""
    frame = b"\0" if length == 0 else b""
    head = b"\0\1\0\0" + struct.pack("<iII", 1, 0, length or 1) + frame
    return head + bytes(-(len(head) - 4) % 8) + struct.pack("<37d", *[0.0] * 37)


# -- MCAP ----------------------------------------------------------------------------------------------------------
def record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def text(words: str | bytes) -> bytes:
    encoded = words.encode() if isinstance(words, str) else words
    return struct.pack("<I", len(encoded)) + encoded


def schema(number: int = 1, name: str = IMU, definition: str | bytes = "") -> bytes:
    return record(3, struct.pack("<H", number) + text(name) + text("ros2msg" if definition else "") + text(definition))


def channel(topic: str | bytes, number: int = 1, qos: str | None = None, schema_number: int = 1) -> bytes:
    profile = b"" if qos is None else text("offered_qos_profiles") + text(qos)
    return record(4, struct.pack("<HH", number, schema_number) + text(topic) + text("cdr") + text(profile))


def message(data: bytes, time_ns: int = 1, number: int = 1) -> bytes:
    return record(5, struct.pack("<HIQQ", number, 0, time_ns, time_ns) + data)


def chunk(packed: bytes, size: int, packing: str = "zstd", end_ns: int = 2) -> bytes:
    return record(6, struct.pack("<QQQI", 0, end_ns, size, 0) + text(packing) + struct.pack("<Q", len(packed)) + packed)


def mcap(*records: bytes, summary: bytes = b"", ends: bytes | None = None, **said: Any) -> Makes:
    """Make a file of these records in a bag with metadata; `ends` replaces the footer."""

    def make(folder: Path) -> Path:
        head = MAGIC + record(1, text("ros2") + text("nobody"))
        start = len(head) + sum(map(len, records)) if summary else 0
        foot = record(2, struct.pack("<QQI", start, 0, 0)) + MAGIC
        (folder / "bag_0.mcap").write_bytes(b"".join([head, *records, summary, foot if ends is None else ends]))
        return metadata(folder, "mcap", "bag_0.mcap", **said)

    return make


def make_indexed(*chunks: bytes) -> Makes:
    """Make a file of these chunks with an index, all for the same time."""
    header = schema() + channel("/imu")
    head, index = len(MAGIC + record(1, text("ros2") + text("nobody"))) + len(header), b""
    for chunk in chunks:
        (packed_size,) = struct.unpack_from("<Q", chunk, 9 + 28 + 8)
        (size,) = struct.unpack_from("<Q", chunk, 9 + 16)
        chunk_index = struct.pack("<QQQQ", 0, 2, head, len(chunk)) + text(b"") + struct.pack("<Q", 0) + text("zstd")
        index += record(8, chunk_index + struct.pack("<QQ", packed_size, size))
        head += len(chunk)
    return mcap(header, *chunks, summary=header + index)


def topics(count: int, definition: bytes = b"") -> Makes:
    records = [
        schema(n, f"my_msgs/msg/T{n}", definition) + channel(f"/t{n}", n, schema_number=n) for n in range(1, count + 1)
    ]
    return mcap(*records, offers=[f"/t{n}" for n in range(count)])


# -- metadata and SQLite -------------------------------------------------------------------------------------------
def metadata(
    folder: Path, storage: str, *files: str, packed: str = "", start: str = "1", offers: Sequence[object] = ("/imu",),
    kind: str = IMU,
) -> Path:  # fmt: skip
    """Write a bag's metadata: it `offers` these topics, all of one kind."""
    mode = f'  compression_format: zstd\n  compression_mode: "{packed}"\n' if packed else ""
    listing = "".join(f"    - {file}\n" for file in files)
    topics = "".join(
        f"    - topic_metadata: {{name: {json.dumps(topic)}, type: {json.dumps(kind)}, serialization_format: cdr,"
        " offered_qos_profiles: ''}\n      message_count: 1\n"
        for topic in offers
    )
    (folder / "metadata.yaml").write_text(
        f"rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: {storage}\n"
        f"  duration: {{nanoseconds: 100}}\n  starting_time: {{nanoseconds_since_epoch: {start}}}\n"
        f"  message_count: 1\n  topics_with_message_count:\n{topics}{mode}"
        f"  relative_file_paths:\n{listing or '    []'}"
    )
    return folder


def database(folder: Path, *statements: str, data: bytes | None = None, name: str = "bag_0.db3") -> Path:
    """Write a bag of ROS 2 in SQLite, with these statements before its one message."""
    with sqlite3.connect(folder / name) as connection:
        connection.execute("CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT,"
                     " offered_qos_profiles TEXT)")  # fmt: skip
        connection.execute("CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        connection.execute("INSERT INTO topics VALUES(1, '/imu', ?, 'cdr', '')", [IMU])
        for statement in statements:
            connection.execute(statement)
        connection.execute("INSERT INTO messages VALUES(1, 1, 1, ?)", [reading() if data is None else data])
    connection.close()
    return folder / name


def db3(*statements: str, data: bytes | None = None, packed: str = "", **said: Any) -> Makes:
    def make(folder: Path) -> Path:
        database(folder, *statements, data=data)
        return metadata(folder, "sqlite3", "bag_0.db3", packed=packed, **said)

    return make


def pack_db3(folder: Path) -> Path:
    (folder / "bag_0.db3.zstd").write_bytes(pack_zeros(2 * GIGABYTE))
    return metadata(folder, "sqlite3", "bag_0.db3.zstd", packed="FILE")


def add_to_db3(lay: Callable[[Path], object], name: str = "bag_1.db3") -> Makes:
    """Make a bag of two files, the second of which is not a regular file."""

    def make(folder: Path) -> Path:
        database(folder)
        lay(folder / name)
        return metadata(folder, "sqlite3", "bag_0.db3", name)

    return make


def replace_metadata(lay: Callable[[Path], object]) -> Makes:
    def make(folder: Path) -> Path:
        database(folder)
        lay(folder / "metadata.yaml")
        return folder

    return make


def deep(path: Path) -> None:
    path.write_text("[" * 500_000)


def laughs(name: str = "", levels: int = 9, times: int = 9) -> str:
    """Return YAML in which every line expands to many times the previous one (billion laughs)."""
    lines = [f"a0: &a0 [{', '.join(['lol'] * times)}]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * times)}]" for n in range(1, levels)]
    return "\n".join([*lines, name]) + "\n"


# -- no regular files ----------------------------------------------------------------------------------------------
def pipe(path: Path) -> None:
    os.mkfifo(path)


def zeros(path: Path) -> None:
    path.symlink_to("/dev/zero")


def loop(path: Path) -> None:
    path.symlink_to(path.name)


def hole(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(GIGABYTE << 10)


def listener(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listening:
        before = Path.cwd()
        os.chdir(path.parent)  # the address of a socket has room for a hundred letters
        listening.bind(path.name)
        os.chdir(before)


def alone(name: str, lay: Callable[[Path], object]) -> Makes:
    def make(folder: Path) -> Path:
        lay(folder / name)
        return folder / name

    return make


def crowd(folder: Path) -> Path:
    """Make a bag among twenty thousand other files."""
    for number in range(20_000):
        os.mknod(folder / f"{number}")
    return db3()(folder)


# -- ULog ----------------------------------------------------------------------------------------------------------
def ulog(*messages: tuple[str, bytes], tail: bytes = b"") -> Makes:
    def make(folder: Path) -> Path:
        path = folder / "log.ulg"
        body = b"".join(struct.pack("<HB", len(payload), ord(kind)) + payload for kind, payload in messages)
        path.write_bytes(b"ULog\x01\x12\x35\x01" + bytes(8) + body + tail)
        return path

    return make


def form(line: str) -> tuple[str, bytes]:
    return "F", line.encode()


FLAGS = ("B", bytes(40))
ADDED = ("A", bytes(3) + b"sensor_gyro")
GYRO = form("sensor_gyro:uint64_t timestamp;float x;float y;float z;")


# -- tables --------------------------------------------------------------------------------------------------------
def table(content: bytes, name: str = "log.csv") -> Makes:
    return alone(name, lambda path: path.write_bytes(content))


def gzip_repetitions(start: bytes, repeated: bytes, size: int) -> Makes:
    """Make a table of `size` bytes that consists of repetitions."""

    def lay(path: Path) -> None:
        block = repeated * (1_000_000 // len(repeated))
        with path.open("wb") as file:  # one member after the other, of which all but the first are the same
            file.write(gzip.compress(start))
            file.write(gzip.compress(block) * (size // len(block)))

    return alone("log.csv.gz", lay)


def make_on_demand(make: Callable[[], Makes]) -> Makes:
    """Create on demand a file that takes long to compress."""

    def create(folder: Path) -> Path:
        return make()(folder)

    return create


NASTY = "\x1b]0;owned\x07\x1b[2J\n\r\u202e"


# -- MATLAB, version 5 ("MAT-File Format", MathWorks) ------------------------------------------------------------------
MAT_HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM"


def element(kind: int, body: bytes) -> bytes:
    return struct.pack("<II", kind, len(body)) + body + bytes(-len(body) % 8)


def matrix(shape: tuple[int, int]) -> bytes:
    """Return the beginning of a matrix of this shape, without its numbers."""
    head = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", *shape)) + element(1, b"time_s")
    content = head + struct.pack("<II", 9, 8 * shape[0] * shape[1] & 0xFFFFFFFF)
    return struct.pack("<II", 14, len(content)) + content


def packed_matrix(size: int) -> bytes:
    """Return a file with one matrix of zeros, packed by zlib to a thousandth."""
    packer = zlib.compressobj()
    head = matrix((size // 8, 1))
    head = struct.pack("<II", 14, len(head) - 8 + size) + head[8:]
    packed = (
        packer.compress(head) + b"".join(packer.compress(bytes(1 << 20)) for _ in range(size >> 20)) + packer.flush()
    )
    return MAT_HEAD + struct.pack("<II", 15, len(packed)) + packed


FILES: dict[str, Makes] = {
    # bags
    "a packed file of 2 GB of zeros": pack_db3,
    "a chunk of 2 GB": make_on_demand(lambda: mcap(
        schema(), channel("/imu"), chunk(pack_zeros(2 * GIGABYTE), 2 * GIGABYTE)
    )),
    "a chunk of 2 GB by lz4": make_on_demand(lambda: mcap(
        schema(), channel("/imu"), chunk(lz4.frame.compress(bytes(GIGABYTE // 4)), GIGABYTE // 4, "lz4")
    )),
    "a chunk that is another size": mcap(schema(), channel("/imu"), chunk(zstd(b"\0" * 9), 1 << 62)),
    "a thousand chunks of 8 MB at once": make_on_demand(lambda: make_indexed(
        *[chunk(pack_zeros(8 << 20), 8 << 20)] * 1000
    )),
    "a chunk in a chunk": mcap(schema(), channel("/imu"), chunk(zstd(chunk(zstd(b""), 0)), len(chunk(zstd(b""), 0)))),
    "a chunk of a million records": make_on_demand(lambda: mcap(
        schema(), channel("/imu"), chunk(zstd(record(9, b"") * 20_000_000), 9 * 20_000_000)
    )),
    "a record of 2^62 bytes": mcap(schema(), struct.pack("<BQ", 5, 1 << 62)),
    "topics of 1 MB": make_on_demand(lambda: mcap(offers=["/" + "t" * 1_000_000, "/" + "u" * 1_000_000])),
    "three thousand topics": make_on_demand(lambda: topics(3000, b"float64 x\nstd_msgs/Header header\n")),
    "topics that write on the terminal": mcap(offers=["/a" + NASTY, "/b" + NASTY]),
    "types that write on the terminal": mcap(offers=["/a", "/b"], kind=IMU + NASTY),
    "a definition of a million fields": make_on_demand(lambda: mcap(
        schema(definition="float64 x\n" * 1_000_000), channel("/imu"), message(reading())
    )),
    "a definition nested without end": make_on_demand(lambda: mcap(
        schema(definition="float64[<=" * 100_000), channel("/imu"), message(reading())
    )),
    "a quality of service that laughs": mcap(schema(), channel("/imu", qos=laughs()), message(reading())),
    "an index that points nowhere": mcap(schema(), channel("/imu"), summary=record(8, b"\xff" * 200)),
    "no end": mcap(schema(), channel("/imu"), ends=b""),
    "a frame with a name of 4 GB": mcap(schema(), channel("/imu"), message(reading((1 << 32) - 1))),
    "a pipe in the bag": add_to_db3(pipe),
    "a device in the bag": add_to_db3(zeros),
    "a socket in the bag": add_to_db3(listener),
    "a link to itself in the bag": add_to_db3(loop),
    "a hole of a terabyte in the bag": add_to_db3(hole),
    "twenty thousand files": crowd,
    "a bag that is a pipe": alone("bag.mcap", pipe),
    "a bag that is a device": alone("bag.db3", zeros),
    "metadata of 50 MB": replace_metadata(lambda path: path.write_text("a: b\n" * 10_000_000)),
    "metadata that laughs": replace_metadata(lambda path: path.write_text(laughs())),
    "metadata nested without end": replace_metadata(deep),
    "metadata from a pipe": replace_metadata(pipe),
    "metadata from a device": replace_metadata(zeros),
    "a hundred thousand files that are not there": lambda folder: metadata(
        folder, "sqlite3", *map(str, range(100_000))
    ),
    "a beginning at infinity": db3(start=".inf"),
    "a topic that is no text": db3(offers=[{"a": 1}]),
    "a view without end": db3(
        "CREATE VIEW schema AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)"
        " SELECT 4 AS schema_version FROM c",
        "CREATE VIEW message_definitions AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)"
        " SELECT '/t' AS topic_type, 'ros2msg' AS encoding, hex(zeroblob(1000000)) AS encoded_message_definition,"
        " '' AS type_description_hash, x AS id FROM c",
    ),
    "a message that unpacks to 2 GB": make_on_demand(lambda: db3(data=pack_zeros(2 * GIGABYTE), packed="MESSAGE")),
    "a hundred thousand topics in SQLite": db3(
        "WITH RECURSIVE c(x) AS (SELECT 2 UNION ALL SELECT x + 1 FROM c WHERE x < 100000)"
        f" INSERT INTO topics SELECT x, '/t' || x, '{IMU}', 'cdr', '' FROM c"
    ),
    "a quality of service that laughs in SQLite": db3(f"UPDATE topics SET offered_qos_profiles = '{laughs()}'"),
    "no data base": alone("bag.db3", lambda path: path.write_bytes(os.urandom(100_000))),
    # logs of PX4
    "a log of 10 MB of nothing": make_on_demand(lambda: ulog(FLAGS, GYRO, ADDED, tail=bytes(10_000_000))),
    "a log of 10 MB of noise": make_on_demand(lambda: ulog(FLAGS, GYRO, ADDED, tail=bytes(range(256)) * 40_000)),
    "a form in itself": ulog(FLAGS, form("sensor_gyro:sensor_gyro x;"), ADDED),
    "forms that multiply": ulog(
        FLAGS, form("a:float[65535] x;"), form("b:a[65535] x;"), form("sensor_gyro:b[65535] x;"), ADDED
    ),
    "a form without readings": ulog(
        FLAGS, form("sensor_gyro:uint64_t timestamp;"), ADDED, ("D", bytes(2) + b"\1" + bytes(7))
    ),
    "appended data that lead back": ulog(
        ("B", bytes(8) + b"\1" + bytes(7) + struct.pack("<3Q", 16, 16, 16)), GYRO, ADDED,
        *[("D", bytes(22))] * 100, tail=b"\0",
    ),
    "a log that is a pipe": alone("log.ulg", pipe),
    "a log that is a device": alone("log.ulg", zeros),
    "a log of one byte": alone("log.ulg", lambda path: path.write_bytes(b"U")),
    # bags of ROS 1
    "a ROS 1 bag of noise": alone("log.bag", lambda path: path.write_bytes(b"#ROSBAG V2.0\n" + os.urandom(100_000))),
    "a ROS 1 bag that is a pipe": alone("log.bag", pipe),
    # MATLAB's files
    "a packed matrix of 1 GB": alone("log.mat", lambda path: path.write_bytes(packed_matrix(GIGABYTE))),
    "a matrix that claims 4 GB": alone("log.mat", lambda path: path.write_bytes(MAT_HEAD + matrix((1 << 29, 1)))),
    "matrices without end": alone("log.mat", lambda path: path.write_bytes(MAT_HEAD + b"\x0e" + bytes(400_000))),
    "a MATLAB file of noise": alone("log.mat", lambda path: path.write_bytes(MAT_HEAD + os.urandom(100_000))),
    "HDF5 of noise": alone("log.mat", lambda path: path.write_bytes(b"MATLAB 7.3 " + os.urandom(100_000))),
    "a MATLAB file that is a device": alone("log.mat", zeros),
    # tables
    "a packed line of 1 GB": gzip_repetitions(TIMES.encode(), b"1", GIGABYTE),
    "packed rows of 1 GB": gzip_repetitions(TIMES.encode(), b"0,0,0,0\n", GIGABYTE),
    "packed empty lines of 250 MB": gzip_repetitions(TIMES.encode(), b"\n", 250_000_000),
    "a packed cell over 250 MB": gzip_repetitions(TIMES.encode() + b'"', b"1\n", 250_000_000),
    "numbers beyond all": table((TIMES + "0,1e400,-1e400,nan\n" * 100).encode()),
    "headings that write on the terminal": table((",".join(f"{n}{NASTY[:-3]}" for n in range(300)) + "\n").encode()),
    "a table that is a pipe": alone("log.csv", pipe),
    "a table that is a device": alone("log.csv", zeros),
    "a table full of holes": alone("log.csv", hole),
}  # fmt: skip


if __name__ == "__main__":
    for name, make in FILES.items():
        folder = Path(sys.argv[1]) / name.replace(" ", "_")
        folder.mkdir(parents=True)
        print(name, make(folder), sep="\t", flush=True)
