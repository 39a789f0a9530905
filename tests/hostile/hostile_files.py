"""Files that were made to break readers, one function each: folder -> the arguments of the command that reads it."""

from __future__ import annotations

import os
import pickle
import shutil
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from problem_workshop import PROBLEM, Workshop

from friction_ocp.problem_file.document import dump_document

Make = Callable[[Path], list[str]]
BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


def text(content: str | bytes, name: str = "problem.yaml") -> Make:
    """A problem file that is only this text."""

    def make(folder: Path) -> list[str]:
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        return ["check", str(folder / name)]

    return make


def problem(edit: Callable[[dict[str, Any]], object]) -> Make:
    """The sound problem of the workshop after an edit, with its sound recording."""

    def make(folder: Path) -> list[str]:
        workshop = Workshop(folder)
        workshop.recording()
        return ["check", str(workshop.problem(edit))]

    return make


def recording(spoil: Callable[[Any], object], after: Callable[[Path], object] = lambda path: None) -> Make:
    """The sound problem with a recording that was spoilt in the file, then as bytes."""

    def make(folder: Path) -> list[str]:
        workshop = Workshop(folder)
        after(workshop.recording(spoil=spoil))
        return ["check", str(workshop.problem())]

    return make


def log(name: str, content: Callable[[Path], object] | bytes, *columns: object) -> Make:
    """A foreign log and a map that names its time and one series."""

    def make(folder: Path) -> list[str]:
        path = folder / name
        if isinstance(content, bytes):
            path.write_bytes(content)
        else:
            content(path)
        time, series = columns or (0, 1)
        channels = f"{{x: {{column: {series!r}, unit: A}}}}"
        lines = ["format: friction-ocp-map/1", f"time: {{column: {time!r}, unit: s}}", f"channels: {channels}"]
        (folder / "map.yaml").write_text("\n".join(lines), encoding="utf-8")
        return ["import", str(path), "--map", str(folder / "map.yaml"), "--out", str(folder / "out.h5")]

    return make


def numpy_bomb(path: Path) -> None:
    """Zeros that are small as long as nobody unpacks them, by what the archive says."""
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000,), }".ljust(117) + b"\n"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("t.npy", "w") as entry:
        entry.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
        for _ in range(8):
            entry.write(b"\0" * 1000)
    content = bytearray(path.read_bytes())
    place = content.rindex(b"PK\x01\x02")
    content[place + 24 : place + 28] = struct.pack("<I", 0xFFFFFFF0)
    path.write_bytes(bytes(content))


def import_map(content: str) -> Make:
    """A hostile map for a sound log."""

    def make(folder: Path) -> list[str]:
        (folder / "log.csv").write_text("t,x\n0,1\n1,2\n", encoding="utf-8")
        (folder / "map.yaml").write_text(content, encoding="utf-8")
        return ["import", str(folder / "log.csv"), "--map", str(folder / "map.yaml"), "--out", str(folder / "out.h5")]

    return make


def put(place: str, value: Any) -> Callable[[dict[str, Any]], None]:
    """Return an edit that puts a value at a place such as drive/shafts/0/inertia."""

    def edit(content: dict[str, Any]) -> None:
        node: Any = content
        *keys, last = [int(key) if key.isdigit() else key for key in place.split("/")]
        for key in keys:
            node = node[key]
        node[last] = value

    return edit


def replaced(name: str, **new: Any) -> Callable[[Any], None]:
    """Return a spoiler that puts another dataset in the place of one."""

    def spoil(file: Any) -> None:
        unit = file[name].attrs.get("unit", "rad")
        del file[name]
        file.create_dataset(name, **new).attrs["unit"] = unit

    return spoil


def only(samples: int) -> Callable[[Any], None]:
    """Return a spoiler that leaves so many samples."""

    def spoil(file: Any) -> None:
        for name in ("time", "channels/current", "channels/position"):
            replaced(name, data=file[name][:samples])(file)

    return spoil


def packed_then_broken(path: Path) -> None:
    """Put noise into the chunk of a compressed dataset."""
    with h5py.File(path, "r+") as file:
        values = file["channels/position"][()]
        replaced("channels/position", data=values, chunks=(500,), compression="gzip")(file)
        offset = file["channels/position"].id.get_chunk_info(1).byte_offset
    with path.open("r+b") as raw:
        raw.seek(offset)
        raw.write(b"\xde\xad\xbe\xef" * 8)


def cut_in_half(path: Path) -> None:
    """Keep the first half of a file."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def matlab_bomb(path: Path) -> None:
    """A compressed MATLAB variable of some hundred bytes that declares 8 GB."""
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    matrix = struct.pack("<II", 14, 8_000_000_000 % 2**32 | 0x80000000)
    packed = zlib.compress(matrix + b"\0" * 10_000)
    path.write_bytes(head + struct.pack("<II", 15, len(packed)) + packed)


def endless_mdf(path: Path) -> None:
    """An MDF file whose first block points to itself."""
    head = b"MDF     4.10    fuzz    " + b"\0" * 4 + struct.pack("<H", 410) + b"\0" * 34
    block = b"##HD" + b"\0" * 4 + struct.pack("<QQ", 104, 6) + struct.pack("<6Q", *([64] * 6)) + b"\0" * 32
    path.write_bytes(head + block)


def mcap_of_2_to_the_63(path: Path) -> None:
    """An MCAP file whose first record declares more bytes than there are."""
    path.write_bytes(b"\x89MCAP0\r\n" + b"\x01" + struct.pack("<Q", 2**63 - 1) + b"\0" * 40)


def parquet_of_lies(path: Path) -> None:
    """A Parquet file whose footer was moved."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({"t": np.arange(60.0), "x": np.arange(60.0)}), path)
    content = path.read_bytes()
    path.write_bytes(content[:-8] + struct.pack("<I", 0x7FFFFFFF) + b"PAR1")


def declared(samples: int) -> Callable[[Path], None]:
    """An HDF5 log of a few kB that declares very many samples."""

    def make(path: Path) -> None:
        with h5py.File(path, "w") as file:
            for name in ("t", "x"):
                file.create_dataset(name, shape=(samples,), dtype=np.float64, chunks=(1024,), compression="gzip")

    return make


def outside(path: Path) -> None:
    """An HDF5 log whose series lie in another file."""
    with h5py.File(path.with_name("secret.h5"), "w") as file:
        file["x"] = np.arange(60.0)
    with h5py.File(path, "w") as file:
        file["t"] = np.arange(60.0)
        file["x"] = h5py.ExternalLink("secret.h5", "/x")


def rosbag_elsewhere(folder: Path) -> None:
    """The folder of a bag whose data lie outside of it."""
    folder.mkdir()
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
        "  relative_file_paths: [../../../../etc/passwd]\n  duration: {nanoseconds: 1}\n"
        "  starting_time: {nanoseconds_since_epoch: 1}\n  message_count: 1\n  topics_with_message_count: []\n"
        "  compression_format: ''\n  compression_mode: ''\n"
    )


def pipe(folder: Path) -> list[str]:
    """A recording that is a pipe, from which reading would wait for ever."""
    workshop = Workshop(folder)
    os.mkfifo(folder / "sweep.h5")
    return ["check", str(workshop.problem())]


def device(folder: Path) -> list[str]:
    """A recording that never ends."""
    workshop = Workshop(folder)
    return ["check", str(workshop.problem(put("recordings/train", ["/dev/zero"])))]


DATA = Path(__file__).parent / "data"
"""Files that the fuzzer found: one hung the HDF5 library, one crashed SciPy."""
SOUND = dump_document(PROBLEM)
SHAFT = "drive/shafts/0"
TRANSMISSION = [{"ratio": 0, "stiffness": "rigid"}]
TWO = [{"name": "load", "inertia": 0.1}, {"name": "arm", "inertia": 0.1}]


class Command:
    """What a pickle would run."""

    def __reduce__(self) -> Any:
        return os.system, ("touch pickled",)


HOSTILE: dict[str, tuple[Make, str]] = {
    "json nested deeply": (
        log("log.json", b'{"t": ' + b"[" * 100_000 + b"]" * 100_000 + b"}"),
        "this cannot be read as JSON (maximum recursion depth exceeded",
    ),
    "json cut off": (log("log.json", b'{"t": [0, 1, 2'), "this cannot be read as JSON (Expecting ',' delimiter"),
    "json number of 5000 digits": (
        log("log.json", b'{"t": [0, ' + b"9" * 5000 + b'], "x": [1, 2]}'),
        "this cannot be read as JSON (Exceeds the limit",
    ),
    "numpy archive that unpacks to 4 GB": (
        log("log.npz", numpy_bomb, "t", "x"),
        "its arrays declare 4294967280 bytes; at most",
    ),
    "yaml tag that runs code": (
        text(SOUND + "title2: !!python/object/apply:os.system ['touch owned']\n"),
        "this is not YAML: line 19, column 9: could not determine a constructor for the tag",
    ),
    "yaml alias bomb": (
        text(SOUND + BOMB),
        "its aliases stand for 490329134 values; at most 200000; write the content out",
    ),
    "yaml alias of itself": (text(SOUND + "x: &x [*x]\n"), "an alias contains itself; write its content out"),
    "yaml merge bomb": (
        text(SOUND + BOMB.replace("[x,", "[{y: 1},").replace("a: &a", "<<: &a")),
        "its aliases stand for 587184256 values; at most 200000; write the content out",
    ),
    "yaml nested deeply": (text("format: " + "[" * 20_000), "this is nested too deeply"),
    "yaml of zeros": (
        text(b"\0" * 1000),
        "this is not YAML: unacceptable character #x0000: special characters are not allowed",
    ),
    "yaml in Latin-1": (text("title: Träger\n".encode("latin-1")), "the file cannot be read as text ('utf-8'"),
    "yaml of 6 MB": (text("# " + "x" * 6_000_000), "the file is too large; at most 5000000 bytes"),
    "yaml key twice": (
        text(SOUND + "title: again\n"),
        "line 19: key 'title' stands here again, first in line 2; keep one of them",
    ),
    "yaml number of 400 digits": (
        problem(put(f"{SHAFT}/inertia", 10**400)),
        "drive.shafts[0].inertia: this is inf; a number, {guess, min, max, prior_std,",
    ),
    "inertia NaN": (
        problem(put(f"{SHAFT}/inertia", float("nan"))),
        "drive.shafts[0].inertia: this is nan; a number, {guess, min, max, prior_std,",
    ),
    "inertia infinite": (
        problem(put(f"{SHAFT}/inertia", float("inf"))),
        "drive.shafts[0].inertia: this is inf; a number, {guess, min, max, prior_std,",
    ),
    "inertia zero": (
        problem(put(f"{SHAFT}/inertia", 0)),
        "drive.shafts[0].inertia: inertia = 0 kg m^2; an inertia is positive",
    ),
    "guess infinite": (
        problem(put(f"{SHAFT}/inertia", {"guess": float("-inf")})),
        "drive.shafts[0].inertia.guess: this is -inf; a finite number",
    ),
    "ratio zero": (
        problem(lambda c: c["drive"].update(shafts=TWO, transmissions=TRANSMISSION)),
        "drive.transmissions[0].ratio: ratio = 0; must not be zero",
    ),
    "shaft name out of the folder": (
        problem(put(f"{SHAFT}/name", "../../load")),
        "drive.shafts[0].name: this is '../../load'; a name without spaces and without . / @",
    ),
    "shaft name of HTML": (
        problem(put(f"{SHAFT}/name", "<script>alert(1)</script>")),
        "drive.shafts[0].name: this is '<script>alert(1)</script>'; a name without spaces",
    ),
    "channel name of HTML": (
        problem(put("channels/<img src=x onerror=alert(1)>", {"measures": "load.omega"})),
        "the recording has no channel '<img src=x onerror=alert(1)>'; it has current,",
    ),
    "expression that runs code": (
        problem(put(f"{SHAFT}/inertia", {"expr": "__import__('os').system('true')"})),
        "drive.shafts[0].inertia.expr: unknown name '__import__' at position 1 of",
    ),
    "expression that never ends": (
        problem(put(f"{SHAFT}/inertia", {"expr": "9**9**9**9**9"})),
        "drive.shafts[0].inertia.expr: '9**9**9**9**9' has no value (math range error)",
    ),
    "expression nested deeply": (
        problem(put(f"{SHAFT}/inertia", {"expr": "(" * 5000 + "1" + ")" * 5000})),
        "drive.shafts[0].inertia.expr: the expression has 10001 characters; at most 500",
    ),
    "recording of one sample": (recording(only(1)), "time has 1 sample; at least 2 are needed"),
    "recording of no sample": (recording(only(0)), "time has no samples; at least 2 are needed"),
    "recording NaN everywhere": (
        recording(lambda f: f["channels/position"].write_direct(np.full(3000, np.nan))),
        "channel 'position' has no value: all 3000 samples are NaN; remove the channel or",
    ),
    "recording infinite": (
        recording(lambda f: f["channels/position"].write_direct(np.full(3000, np.inf))),
        "channel 'position' is infinite at sample 0 (3000 of 3000 samples); write NaN for a",
    ),
    "time NaN": (
        recording(lambda f: f["time"].write_direct(np.full(3000, np.nan))),
        "time is not finite at sample 0 (3000 of 3000 samples); remove these samples",
    ),
    "time backwards": (
        recording(lambda f: f["time"].write_direct(-np.arange(3000.0))),
        "time is not increasing at sample 1 (-1.0000 s after -0.0000 s), and at 2998 more;",
    ),
    "external link": (
        recording(lambda f: (f.__delitem__("time"), f.__setitem__("time", h5py.ExternalLink("/etc/passwd", "/t")))),
        "/time is a link out of the file or in a circle; data inside the file; copy it there",
    ),
    "link in a circle": (
        recording(lambda f: (f.__delitem__("time"), f.__setitem__("time", h5py.SoftLink("/time")))),
        "/time is a link out of the file or in a circle; data inside the file; copy it there",
    ),
    "data in another file": (
        recording(replaced("time", shape=(3000,), dtype="f8", external=[("/etc/passwd", 0, 24000)])),
        "time keeps its data in other files; data inside the file; copy it there",
    ),
    "texts for numbers": (
        recording(replaced("channels/position", data=["<b>1</b>"] * 3000)),
        "channel 'position' is not numeric but object; real numbers, NaN where a sample is",
    ),
    "10^8 samples declared": (
        recording(replaced("channels/position", shape=(10**8,), dtype="f8", chunks=(1024,))),
        "channel 'position' declares 100000000 samples; at most 50000000; split the recording",
    ),
    "2^60 samples declared": (
        recording(replaced("channels/position", shape=(2**60,), dtype="f8", chunks=(1024,))),
        "channel 'position' declares 1152921504606846976 samples; at most 50000000; split",
    ),
    "broken chunk": (recording(lambda f: None, packed_then_broken), "channel 'position' cannot be read ("),
    "half a file": (recording(lambda f: None, cut_in_half), "the file cannot be opened ("),
    "pipe for a recording": (pipe, "there is no such file; correct the path"),
    "device for a recording": (device, "recordings.train[0]: /dev/zero: there is no such file; correct the path"),
    "map with a tag": (
        import_map("format: !!python/object/apply:os.system ['touch owned']"),
        "this is not YAML (could not determine a constructor for the tag",
    ),
    "map nested deeply": (import_map("format: " + "[" * 20_000), "this is nested too deeply"),
    "map with an alias bomb": (
        import_map(BOMB),
        "unknown key 'e'; available: format, time, channels, points, title, source, licence,",
    ),
    "map with a channel out of the folder": (
        import_map("format: friction-ocp-map/1\ntime: {column: t, unit: s}\nchannels: {../x: {column: x, unit: A}}"),
        "channels.../x: the name has a slash; text without a slash; rename it",
    ),
    "csv of zeros": (
        log("log.csv", b"\0" * 4000),
        "there are no rows of numbers; at least two columns, separated by comma, semicolon,",
    ),
    "csv of one endless line": (
        log("log.csv", b"1," * 200_000),
        "there are no rows of numbers; at least two columns, separated by comma, semicolon,",
    ),
    "csv with infinities": (
        log("log.csv", b"t,x\n0,inf\n1,-inf\n2,nan\n"),
        "channel 'x' is infinite at sample 0 (2 of 3 samples); write NaN for a missing sample",
    ),
    "pickle as MATLAB": (log("log.mat", pickle.dumps(Command())), "this cannot be read as a MATLAB file ("),
    "MATLAB variable of gigabytes": (log("log.mat", matlab_bomb), "its variables declare 3705032704 bytes; at most "),
    "HDF5 log of 10^8 samples": (
        log("log.h5", declared(10**8)),
        "'t' declares 100000000 samples; at most 50000000; split or thin the file",
    ),
    "HDF5 log with an external link": (
        log("log.h5", outside, "t", "x"),
        "channels.x: there is no column 'x'; columns: 0 't'",
    ),
    "MDF in a circle": (
        log("log.mf4", endless_mdf),
        "reading it has no end within 2 s; the file may be damaged",
    ),
    "MCAP of 2^63 bytes": (log("log.mcap", mcap_of_2_to_the_63), "this cannot be read as a ROS bag ("),
    "TDMS without sense": (log("log.tdms", b"TDSm" + b"\xff" * 400), "there is no series in it (TDMS); at least one"),
    "HDF5 that never ends": (
        recording(lambda f: None, lambda path: shutil.copy(DATA / "endless.h5", path)),
        "reading it has no end within 2 s; the file may be damaged",
    ),
    "MATLAB that kills": (
        log("log.mat", (DATA / "crash.mat").read_bytes()),
        "the file may be damaged; copy it again",
    ),
    "Parquet without its footer": (log("log.parquet", parquet_of_lies), "this cannot be read as a Parquet file ("),
    "ROS bag of another place": (log("bag", rosbag_elsewhere), "this cannot be read as a ROS bag ("),
    "suffix that no reader takes": (
        log("log.pkl", pickle.dumps(Command())),
        "no reader for '.pkl'; available: .csv, .tsv",
    ),
    "pickle in the place of an array": (
        log("log.npy", pickle.dumps(Command())),
        "this cannot be read as a NumPy file (",
    ),
}
"""What is wrong -> how to make it, and what is said about it."""
