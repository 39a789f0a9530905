"""Import of delimited text by a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording.csv import open_csv
from friction_ocp.recording.csv_layout import sniff_layout
from friction_ocp.recording.hdf5 import read_recording, write_recording
from friction_ocp.recording.import_map import Column, ImportMap, load_import_map
from friction_ocp.recording.import_recording import import_recording, inspect_file
from friction_ocp.recording.listing import list_signals
from friction_ocp.recording.recording import Recording
from friction_ocp.recording.table import recording_of

MAP = """
format: friction-ocp-map/1
time: {column: timestamp, unit: ms}
channels:
  position: {column: pos, unit: deg}
  current: {column: 2, unit: mA}
title: Bench
source: lab
licence: CC0
"""
ROWS = [("timestamp", "pos", "cur"), ("0", "180", "100"), ("10", "", "200"), ("20", "90", "nan")]


def put(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def faults(path: Path, content: str, import_map: str = MAP) -> str:
    with pytest.raises(FrictionOcpError) as caught:
        import_recording(put(path, content), put(path.with_suffix(".yaml"), import_map))
    return str(caught.value)


def read_csv(path: Path, import_map: ImportMap) -> Recording:
    """Return the mapped columns of delimited text as a recording."""
    with open_csv(path, import_map) as file:
        return recording_of(file, import_map, path)


@pytest.mark.parametrize(("suffix", "delimiter"), [("csv", ","), ("csv", ";"), ("tsv", "\t"), ("txt", ", ")])
def test_columns_become_channels_in_si(tmp_path: Path, suffix: str, delimiter: str) -> None:
    """Columns by header or index are read in SI units, empty cells as NaN, with their provenance."""
    path = put(tmp_path / f"log.{suffix}", "\n".join(delimiter.join(row) for row in ROWS))
    recording = import_recording(path, put(tmp_path / "map.yaml", MAP))
    position, current = recording.channels["position"], recording.channels["current"]
    np.testing.assert_allclose(position.time, [0.0, 0.01, 0.02])
    np.testing.assert_allclose(position.values, [np.pi, np.nan, np.pi / 2])
    np.testing.assert_allclose(current.values, [0.1, 0.2, np.nan])
    assert (position.unit, current.unit) == ("rad", "A")
    assert (recording.name, recording.title, recording.source, recording.licence) == ("log", "Bench", "lab", "CC0")
    write_recording(recording, tmp_path / "log.h5")
    assert read_recording(tmp_path / "log.h5").attributes["imported_from"] == f"log.{suffix}"


PLAIN = ImportMap(Column("t", "s"), {"x": Column("x", "A")})


@pytest.mark.parametrize(
    "content",
    [
        "t,x\n0,1\n1,2\n",
        '"t","x"\n0,1\n1,2\n',
        "# t x\n0 1\n1 2\n",
        "# bench of today\n#\n# t,x\n0,1\n# pause\n\n1,2\n",
        "Logger 5, made 2024\nrate\t1000\nt\tx\ns\tA\n0\t1\n1\t2\n",
        "  t     x\n  0.0   1e0\n  1.0   2.0\n",
        "t;x;state\n0;1;on\n1;2;off\n",
        "\ufefft,x\r\n0,1\r\n1,2\r\n",
        "t , x\n0 , 1\n1 , 2",
    ],
)
def test_layout_is_found(tmp_path: Path, content: str) -> None:
    """Delimiter, header, comments, line of units and byte order mark are found without being told."""
    channel = read_csv(put(tmp_path / "a.csv", content), PLAIN).channels["x"]
    assert (channel.time.tolist(), channel.values.tolist()) == ([0.0, 1.0], [1.0, 2.0])


NAMES, NONE = ("t", "pos", "cur"), ("", "", "")


@pytest.mark.parametrize(
    ("head", "end", "names", "units"),
    [
        ("Recorder;;\nt;pos;cur", "", NAMES, NONE),
        ("Recorder;;\nt [s];pos (rad);cur [A]", "", ("t [s]", "pos (rad)", "cur [A]"), ("s", "rad", "A")),
        ("Axis log;;\nDevice: axis 1;;\nt;pos;cur\nms;°;mA", "", NAMES, ("ms", "°", "mA")),
        ("Recorder;V2;\nRate;1000;\nt;pos;cur", "", NAMES, NONE),
        ("t;pos;cur", ";", (*NAMES, "column 3"), (*NONE, "")),
        ("t;pos;cur\ns;rad;A", ";", (*NAMES, "column 3"), ("s", "rad", "A", "")),
        ("t;pos;cur;", "", NAMES, NONE),
        ("t;pos;duty\ns;rad;1", "", ("t", "pos", "duty"), ("s", "rad", "1")),
        ("t;pos;cur\n[s];[Inkr];[mA]", "", NAMES, ("s", "", "mA")),
        (";pos;cur\n-;Grad;rpm", "", ("column 0", "pos", "cur"), ("", "Grad", "rpm")),
        ("s;m;A", "", ("s", "m", "A"), NONE),
        ("t;1;2", "", ("t", "1", "2"), NONE),
        ("rate;1000;5", "", ("column 0", "column 1", "column 2"), NONE),
    ],
)
def test_the_real_header_is_found(
    tmp_path: Path, head: str, end: str, names: tuple[str, ...], units: tuple[str, ...]
) -> None:
    """Padded lines above a header, a line of units below it, numbers in it and delimiters at line ends are seen."""
    rows = [f"{k / 100};{np.sin(k / 30):.5f};{k % 9}{end}" for k in range(300)]
    path = put(tmp_path / "a.csv", "\n".join([head, *rows]))
    layout = sniff_layout(path)
    assert layout.names == names
    with open_csv(path, ImportMap(None, {})) as file:
        assert len(file.read([1])[1]) == 300
        assert tuple(signal.unit for signal in file.signals) == units


@pytest.mark.parametrize(("encoding", "name"), [("utf-16", "x [°]"), ("cp1252", "x [°]")])
def test_other_encodings_are_read(tmp_path: Path, encoding: str, name: str) -> None:
    """Headers of spreadsheet programs are read in their encoding."""
    (tmp_path / "a.csv").write_bytes(f"t,{name}\n0,1\n1,2\n".encode(encoding))
    recording = read_csv(tmp_path / "a.csv", ImportMap(Column("t", "s"), {"x": Column(name, "°")}))
    assert recording.channels["x"].unit == "rad"


def test_a_decimal_comma_is_seen_by_inspect(tmp_path: Path) -> None:
    """A listing reads numbers with a comma, and says what the map has to state."""
    told = inspect_file(put(tmp_path / "a.csv", "Zeit [s];x [A]\n0,0;1,5\n0,5;2,5\n"))
    assert "decimal: ',' in the map" in told and "no numbers" not in told
    assert "2.5" in told


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_a_decimal_comma_beside_integers_is_seen_by_inspect(tmp_path: Path, delimiter: str) -> None:
    """Commas in one column alone, among whole numbers of its own and of others, are numbers of the listing too."""
    rows = [f"{k}{delimiter}{k % 3}{delimiter}{k / 4:g}".replace(".", ",") for k in range(12)]
    path = put(tmp_path / "a.csv", delimiter.join(["t [ms]", "n", "x [A]"]) + "\n" + "\n".join(rows))
    told = inspect_file(path)
    assert "decimal comma in 'x [A]' (decimal: ',' in the map)" in told
    with open_csv(path) as file:
        _, n, x = list_signals(file, path)
    assert (n.high, x.low, x.high) == (2.0, 0.0, 2.75)
    import_map = ImportMap(Column(0, "ms"), {"x": Column(2, "A"), "n": Column(1, "1")}, decimal=",")
    read = read_csv(path, import_map).channels
    assert (read["x"].values.tolist(), read["n"].values[:4].tolist()) == ([k / 4 for k in range(12)], [0, 1, 2, 0])


def test_decimal_comma_is_read_where_stated(tmp_path: Path) -> None:
    """With decimal: ',' a comma is the decimal sign; without it the finding says so."""
    content = "timestamp;pos;cur\n0,0;1,5;2\n0,5;2,5;3\n"
    put(tmp_path / "a.csv", content)
    recording = import_recording(tmp_path / "a.csv", put(tmp_path / "m.yaml", MAP + "decimal: ','\n"))
    np.testing.assert_allclose(recording.channels["position"].values, np.deg2rad([1.5, 2.5]))
    assert "line 2: '0,0' in column 'timestamp' is not a number; set decimal: ','" in faults(
        tmp_path / "b.csv", content
    )


def written(number: float, digits: int, decimal: str, group: str = "") -> str:
    """Return a number as a spreadsheet of some country writes it."""
    return f"{number:,.{digits}f}".translate(str.maketrans({".": decimal, ",": group}))


def grouped_log(delimiter: str, decimal: str, group: str, quote: str = "") -> str:
    """Return a log of a positioning move whose thousands are grouped."""
    seconds = np.arange(400) / 200.0
    rows = [
        delimiter.join(
            f"{quote}{cell}{quote}"
            for cell in (
                written(t, 3, decimal, group),
                written(3e6 * np.sin(t) - 2e5, 0, decimal, group),
                written(2500.0 * np.cos(t), 1, decimal, group),
            )
        )
        for t in seconds
    ]
    return "\n".join([delimiter.join(["time [s]", "position", "current [mA]"]), *rows])


GROUPED_MAP = """
format: friction-ocp-map/1
time: {column: 0}
channels:
  position: {column: position, scale: 2*pi/1048576 rad}
  current: {column: 2}
"""


@pytest.mark.parametrize(
    ("delimiter", "decimal", "group", "quote"),
    [(";", ",", ".", ""), ("\t", ",", ".", ""), (";", ".", ",", ""), (",", ".", ",", '"'), (",", ",", ".", '"')],
)
def test_grouped_thousands_are_no_decimals(
    tmp_path: Path, delimiter: str, decimal: str, group: str, quote: str
) -> None:
    """Beside a stated decimal sign the other one groups thousands; the listing says which one to state."""
    path = put(tmp_path / "a.csv", grouped_log(delimiter, decimal, group, quote))
    seconds = np.arange(400) / 200.0
    stated = put(tmp_path / "m.yaml", f"{GROUPED_MAP}decimal: '{decimal}'\n")
    read = import_recording(path, stated).channels
    expected = np.round(3e6 * np.sin(seconds) - 2e5) * 2.0 * np.pi / 2**20
    np.testing.assert_allclose(read["position"].values, expected, rtol=1e-12)
    np.testing.assert_allclose(read["current"].values, 2.5 * np.cos(seconds), atol=0.5001e-4)
    assert f"(decimal: '{decimal}' in the map)" in inspect_file(path)
    with open_csv(path) as file:
        assert list_signals(file, path)[2].high == 2500.0


@pytest.mark.parametrize(
    ("cell", "decimal", "message"),
    [
        ("0.125", ",", "beside decimal: ',', '.' groups thousands, as in 1.234,5; correct the cell, or decimal"),
        ("12.5", ",", "'.' groups thousands"),
        ("1.2345", ",", "'.' groups thousands"),
        ("1,5", ".", "beside decimal: '.', ',' groups thousands, as in 1,234.5"),
        ("1,234", "", "is not a number; set decimal: ',', or decimal: '.' if it groups thousands"),
        ("1,234.5", "", "is not a number; set decimal: '.'"),
        ("1,5", "", "is not a number; set decimal: ','"),
        ("1.2.3", ",", "is not a number; correct or empty the cell"),
    ],
)
def test_marks_that_do_not_group_thousands_are_refused(tmp_path: Path, cell: str, decimal: str, message: str) -> None:
    """A cell that is a number with the other decimal sign alone is told by its line, never read by a guess."""
    stated = MAP + (f"decimal: '{decimal}'\n" if decimal else "")
    told = faults(tmp_path / "a.csv", f"timestamp;pos;cur\n0;1;2\n10;{cell};2\n", stated)
    assert f"a.csv: line 3: '{cell}' in column 'pos'" in told and message in told


def test_counts_are_read_with_their_scale(tmp_path: Path) -> None:
    """A column of encoder counts needs the scale of its map."""
    counts = ImportMap(Column("t", "s"), {"x": Column("x", "counts", "2*pi/8 rad")})
    recording = read_csv(put(tmp_path / "a.csv", "t,x\n0,1\n1,2\n"), counts)
    np.testing.assert_allclose(recording.channels["x"].values, [np.pi / 4, np.pi / 2])


@given(st.lists(st.floats(-1e12, 1e12), min_size=2, max_size=20), st.sampled_from(",;\t "), st.sampled_from(".,"))
def test_numbers_survive_text(numbers: list[float], delimiter: str, decimal: str) -> None:
    """Numbers written with all their digits are read bit for bit, whatever delimiter and decimal sign."""
    import tempfile

    if delimiter == decimal:
        delimiter = ";"
    lines = [f"{index}{delimiter}{number!r}".replace(".", decimal) for index, number in enumerate(numbers)]
    with tempfile.TemporaryDirectory() as folder:
        path = put(Path(folder) / "a.csv", f"t{delimiter}x\n" + "\n".join(lines))
        import_map = ImportMap(PLAIN.time, PLAIN.channels, decimal=decimal, delimiter=delimiter)
        assert read_csv(path, import_map).channels["x"].values.tolist() == numbers


def test_many_rows_are_read_in_pieces(tmp_path: Path) -> None:
    """Files longer than one piece are joined in order."""
    n = 120_000
    path = put(tmp_path / "a.csv", "t,x\n" + "\n".join(f"{k},{-k}" for k in range(n)))
    assert np.array_equal(read_csv(path, PLAIN).channels["x"].values, -np.arange(n))


@pytest.mark.parametrize("start", [1_709_300_000_123_456_789, 2**53 - 200 * 55_000])
def test_nanoseconds_since_1970_keep_their_digits(tmp_path: Path, start: int) -> None:
    """Stamps at 5 MHz, beyond what floats hold, are read as integers, be they so from the first piece on or not."""
    n = 60_000
    stamps = start + 200 * np.arange(n)
    path = put(tmp_path / "a.csv", "t,x\n" + "\n".join(f"{stamp},{k % 7}" for k, stamp in enumerate(stamps)))
    with open_csv(path, PLAIN) as file:
        assert np.array_equal(file.read([0])[0], stamps)
    if start > 2**53:
        read = read_csv(path, ImportMap(Column("t", "ns"), PLAIN.channels))
        np.testing.assert_allclose(read.channels["x"].time, 200e-9 * np.arange(n), rtol=1e-12)
        assert read.attributes["time_origin"] == str(start)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "timestamp,pos\n0,1\n1,2\n",
            "a.yaml: channels.current: there is no column 2; columns: 0 'timestamp', 1 'pos'",
        ),
        (
            "timestamp,p,cur\n0,1,2\n1,2,3\n",
            "channels.position: there is no column 'pos'; columns: 0 'timestamp', 1 'p'",
        ),
        (
            "timestamp,pos,pos\n0,1,2\n1,2,3\n",
            "2 columns are called 'pos'; columns: 0 'timestamp', 1 'pos', 2 'pos'; give",
        ),
        ("timestamp,pos,cur\n0,1,2\n1,x,3\n", "a.csv: line 3: 'x' in column 'pos' is not a number; correct or empty"),
        (
            "timestamp,pos,cur\n0,1,2\n1,1,2\n2,1\n",
            "a.csv: line 4 has 2 cells where 3 are expected; complete or remove",
        ),
        ("timestamp,pos,cur\n0,1,2\n0,1,2\n", "a.csv: time is not increasing at sample 1 (0.0000 s after 0.0000 s)"),
        ("timestamp,pos,cur\n0,,2\n1,,2\n", "a.csv: channel 'position' has no value: all 2 samples are NaN"),
        ("timestamp,pos,cur\n0,inf,2\n1,1,2\n", "a.csv: channel 'position' is infinite at sample 0"),
        ("timestamp,pos,cur\n", "a.csv: there are no rows of numbers; at least two columns"),
        ("", "a.csv: there are no rows of numbers"),
    ],
)
def test_each_fault_of_a_file_is_told(tmp_path: Path, content: str, message: str) -> None:
    """A file that does not fit its map is told by line, cell and column."""
    assert message in faults(tmp_path / "a.csv", content)


SCOPE_MAP = """
format: friction-ocp-map/1
channels:
  position: {column: 1, unit: deg, time: {column: 0, unit: ms}}
  speed: {column: 3, unit: deg/s, time: {column: 2, unit: ms}}
"""


def scope_rows(samples: int, delimiter: str = ";") -> list[str]:
    """Return rows of a fast and of a slow signal with their own times, where empty cells at the end are left out."""
    fast = [f"{k}.0{delimiter}{np.sin(k / 50):.4f}" for k in range(samples)]
    slow = [f"{4 * k}.0{delimiter}{np.cos(k / 12.5):.3f}" for k in range(samples // 4)]
    return [row + (f"{delimiter}{slow[k]}" if k < len(slow) else "") for k, row in enumerate(fast)]


def test_columns_that_end_early_are_read(tmp_path: Path) -> None:
    """A scope that leaves out the cells of columns that have ended is read whole, and listed whole."""
    path = put(tmp_path / "a.csv", "\n".join(["t1;position;t2;speed", *scope_rows(800)]))
    read = import_recording(path, put(tmp_path / "m.yaml", SCOPE_MAP)).channels
    position, speed = read["position"], read["speed"]
    assert (len(position.values), len(speed.values), speed.time[-1]) == (800, 200, 0.796)
    np.testing.assert_allclose(position.values, np.deg2rad(np.sin(np.arange(800) / 50)), atol=1e-6)
    told = inspect_file(path)
    assert "not fit" not in told and "600 empty" in told


@pytest.mark.parametrize("line", [300, 1000])
def test_rows_that_were_cut_off_are_told(tmp_path: Path, line: int) -> None:
    """A row that ends early in the middle of a log, or as its last, is refused, and told by the listing."""
    rows = scope_rows(4000)[:999]
    rows[line - 2] = rows[line - 2].rsplit(";", 2)[0]
    content = "\n".join(["t1;position;t2;speed", *rows])
    what = f"line {line} has 2 cells where 4 are expected"
    assert f"a.csv: {what}; complete or remove the line" in faults(tmp_path / "a.csv", content, SCOPE_MAP)
    assert f"1 line does not fit into the table: {what}" in inspect_file(tmp_path / "a.csv")


def test_a_hole_between_spaces_is_no_column_that_ended(tmp_path: Path) -> None:
    """Between spaces any cell may be the missing one: such rows are refused, and told by the listing."""
    content = "\n".join(["t1 position t2 speed", *scope_rows(400, " ")])
    assert "line 102 has 2 cells where 4 are expected" in faults(tmp_path / "a.txt", content, SCOPE_MAP)
    assert "300 lines do not fit into the table: line 102" in inspect_file(tmp_path / "a.txt")


def test_rows_that_begin_with_a_missing_value_are_no_comments(tmp_path: Path) -> None:
    """The #N/A of a spreadsheet in the first column is a missing sample; a comment between rows is left out."""
    rows = [f"{'#N/A' if k % 7 == 3 else k / 8},{k / 100},{k % 5}" for k in range(350)]
    content = "\n".join(["speed [rpm],time [s],current [A]", *rows[:50], "# pause", "# torque off, again", *rows[50:]])
    path = put(tmp_path / "a.csv", content)
    channels = {"speed": Column(0), "current": Column(2)}
    speed = read_csv(path, ImportMap(Column(1), channels)).channels["speed"]
    assert (len(speed.values), np.count_nonzero(np.isnan(speed.values))) == (350, 50)
    assert "50 empty" in inspect_file(path)


def test_faults_are_told_together_but_not_by_the_thousand(tmp_path: Path) -> None:
    """Bad cells are told at once, ten of them at most."""
    assert len(faults(tmp_path / "a.csv", "timestamp,pos,cur\n0,1,2\n1,a,b\n2,3,4\n").splitlines()) == 2
    many = "timestamp,pos,cur\n0,1,2\n" + "1,a,b\n" * 1000
    assert len(faults(tmp_path / "a.csv", many).splitlines()) == 10


GOOD = {"time": "{column: timestamp, unit: s}", "channels": "{x: {column: x, unit: A}}", "format": "friction-ocp-map/1"}


def map_of(**changes: str) -> str:
    return "\n".join(f"{key}: {value}" for key, value in (GOOD | changes).items() if value != "-")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": "friction-ocp-map/9"}, "format: format is 'friction-ocp-map/9'; 'friction-ocp-map/1' is read here"),
        ({"format": "-"}, "format: format is ''; 'friction-ocp-map/1'"),
        (
            {"chanels": "{}"},
            "unknown key 'chanels'; available: format, time, channels, points, title, source, licence, delimiter",
        ),
        ({"time": "~"}, "time: there is nothing; a mapping of column, unit, scale"),
        ({"time": "{unit: s}"}, "time: there is no column; {column, unit}"),
        ({"time": "{column: t, unit: deg}"}, "time: unit 'deg' does not measure time; a unit such as s, ms or us"),
        ({"time": "{column: -1, unit: s}"}, "time.column: column is -1; a header, or an index from 0"),
        ({"time": "{column: true, unit: s}"}, "time.column: column is True; a header"),
        ({"channels": "{}"}, "channels: there are no channels; name: {column, unit}"),
        ({"channels": "[a]"}, "channels: this is a list; a mapping"),
        ({"channels": "{x: {column: x, unit: furlong}}"}, "channels.x: unknown unit 'furlong'; accepted: rad"),
        ({"channels": "{x: {column: x, unit: counts}}"}, "channels.x: unit 'counts' has no scale"),
        ({"channels": "{x: {column: x, unit: [A]}}"}, "channels.x.unit: this is a list; text"),
        (
            {"channels": "{x: {column: x, unit: A, gain: 2}}"},
            "channels.x: unknown key 'gain'; available: column, unit, scale",
        ),
        ({"channels": "{x: {column: x, unit: A, wrap: 0}}"}, "channels.x.wrap: wrap is 0; a number above 0"),
        ({"channels": "{x: {column: x, unit: A, held: 2.5}}"}, "channels.x.held: held is 2.5; a whole number of"),
        ({"channels": "{x: {column: x, unit: A, wrap: .nan}}"}, "channels.x.wrap: this is nan; a number"),
        ({"channels": "{x: {column: x, unit: A, time: {column: t, unit: A}}}"}, "channels.x.time: unit 'A' does not"),
        ({"channels": "{a/b: {column: x, unit: A}}"}, "channels.a/b: the name has a slash"),
        ({"decimal": "'#'"}, "decimal: unknown decimal sign '#'; available: '.', ','"),
        ({"delimiter": "'ab'"}, "delimiter: the delimiter is 'ab'; one character"),
        ({"title": "{a: 1}"}, "title: this is a mapping; text"),
        ({"title": "'open"}, "this is not YAML ("),
        (
            {"channels": "\n  x: {column: x, unit: A}\n  y: {column: y}\n  x: {column: z, unit: A}"},
            "line 5: key 'x' stands here again, first in line 3; keep one of them",
        ),
        ({"title": "a\ntitle: b"}, "line 5: key 'title' stands here again, first in line 4"),
        ({"channels": "{x: {column: x, unit: A, unit: mA}}"}, "line 2: key 'unit' stands here again, first in line 2"),
    ],
)
def test_each_fault_of_a_map_is_told(tmp_path: Path, changes: dict[str, str], message: str) -> None:
    """A map is checked strictly, and each finding names the key."""
    with pytest.raises(FrictionOcpError) as caught:
        load_import_map(put(tmp_path / "m.yaml", map_of(**changes)))
    assert f"m.yaml: {message}" in str(caught.value)


def test_all_faults_of_a_map_are_told_at_once(tmp_path: Path) -> None:
    """One reading of a map tells everything that is wrong with it."""
    content = map_of(format="x", time="{unit: s}", channels="{x: {column: x, unit: y}, z: 3}", colour="red")
    with pytest.raises(FrictionOcpError) as caught:
        load_import_map(put(tmp_path / "m.yaml", content))
    assert len(caught.value.findings) == 5


def test_what_the_file_has_to_say_is_asked_for(tmp_path: Path) -> None:
    """A map may leave times and units to the file; one that states neither is told so."""
    content = put(tmp_path / "a.csv", "t,x,y [mA]\n0,1,1000\n1,2,2000\n")
    with pytest.raises(FrictionOcpError) as caught:
        import_recording(content, put(tmp_path / "m.yaml", map_of(time="-", channels="{x: {column: x}}")))
    assert [str(item).partition("m.yaml: ")[2] for item in caught.value.findings] == [
        "channels.x: there is no unit, and the file states none for 'x'; {column, unit}",
        "channels.x: the file gives 'x' no times; name the column of the times, time: {column, unit}, "
        "or their step, time: {step: 1 ms} or {rate: 1000 Hz}",
    ]
    in_header = "{y: {column: 'y [mA]', time: {column: t, unit: s}}}"
    recording = import_recording(content, put(tmp_path / "m.yaml", map_of(time="-", channels=in_header)))
    assert (recording.channels["y"].values.tolist(), recording.channels["y"].unit) == ([1.0, 2.0], "A")


@pytest.mark.parametrize("time", ["{step: 0.5 ms}", "{rate: 2 kHz}"])
def test_a_log_of_a_fixed_rate_needs_no_column_of_times(time: str, tmp_path: Path) -> None:
    """Its rows are so far apart; a switch that is logged beside them is 1 or 0."""
    log = put(tmp_path / "a.csv", "x,enabled\n0.1,FALSE\n0.2,TRUE\n0.3,TRUE\n")
    channels = "{x: {column: x, unit: A}, enabled: {column: enabled, unit: '1'}}"
    recording = import_recording(log, put(tmp_path / "m.yaml", map_of(time=time, channels=channels)))
    assert recording.channels["x"].time == pytest.approx([0.0, 5e-4, 1e-3])
    assert recording.channels["enabled"].values.tolist() == [0.0, 1.0, 1.0]
    assert {item.clock for item in recording.channels.values()} == {"time"}


@pytest.mark.parametrize(
    ("time", "told"),
    [
        ("{step: 1 A}", "time.step: step is '1 A'; a time, such as 1 ms"),
        ("{rate: -2 Hz}", "time.rate: rate is '-2 Hz'; a frequency, such as 1000 Hz"),
        ("{rate: fast}", "time.rate: "),
        ("{step: 1 ms, unit: s}", "time: 'unit' stands beside step; step alone, or a column of times"),
    ],
)
def test_a_step_that_is_none_is_told(time: str, told: str, tmp_path: Path) -> None:
    """With what there may be."""
    with pytest.raises(FrictionOcpError) as caught:
        load_import_map(put(tmp_path / "m.yaml", map_of(time=time, channels="{x: {column: x, unit: A}}")))
    (finding,) = caught.value.findings
    assert str(finding).partition("m.yaml: ")[2].startswith(told)


def test_other_formats_and_missing_files_are_told(tmp_path: Path) -> None:
    """An unknown suffix lists the formats; a missing file or map is told as such."""
    with pytest.raises(FrictionOcpError, match=r"a.docx: no reader for '.docx'; available: .csv, .tsv, .txt, .parquet"):
        import_recording(tmp_path / "a.docx", tmp_path / "m.yaml")
    with pytest.raises(FrictionOcpError, match=r"m.yaml: there is no such map"):
        import_recording(tmp_path / "a.csv", tmp_path / "m.yaml")
    with pytest.raises(FrictionOcpError, match=r"a.csv: there is no such file"):
        read_csv(tmp_path / "a.csv", PLAIN)


def test_map_refuses_python_objects(tmp_path: Path) -> None:
    """YAML tags that would run code are an error, not a call."""
    content = map_of(title="!!python/object/apply:os.system ['true']")
    with pytest.raises(FrictionOcpError, match="this is not YAML"):
        load_import_map(put(tmp_path / "m.yaml", content))


def test_inspection_lists_columns_with_rate_and_range(tmp_path: Path) -> None:
    """Whoever writes a map sees names, units in headers, ranges, the rate, and which columns hold no numbers."""
    path = put(tmp_path / "a.csv", "state;t;x [deg]\non;0;5\non;0.01;\noff;0.02;7\noff;0.03;8\n")
    with open_csv(path) as file:
        state, t, x = list_signals(file, path)
    assert file.summary == "delimiter ';'"
    assert [item.signal.name for item in (state, t, x)] == ["state", "t", "x [deg]"]
    assert (state.signal.numeric, t.signal.samples, x.signal.unit) == (False, 4, "deg")
    assert x.rate == pytest.approx(100.0)
    assert (x.seconds, x.low, x.high) == (pytest.approx(0.03), 5.0, 8.0)


def test_columns_without_header_are_numbered(tmp_path: Path) -> None:
    """Without a header, columns are named by their index."""
    assert sniff_layout(put(tmp_path / "a.txt", "0 1\n1 2\n")).names == ("column 0", "column 1")
