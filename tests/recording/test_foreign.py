"""Import of the formats of other programs, from files that their own libraries wrote."""

from __future__ import annotations

import importlib
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from foreign_files import CASES, START_NS, ForeignCase, angle, current, fast, slow

from friction_ocp.cli import DONE, WRONG_INPUT, main
from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording import foreign
from friction_ocp.recording.foreign import MAX_SAMPLES, Signal, check_sizes
from friction_ocp.recording.hdf5 import read_recording, read_static_points
from friction_ocp.recording.import_recording import READERS, import_file, import_recording, inspect_file

ROUNDING = 1e-12
NANOSECOND = 1.1e-9
"""Times in files of ns since 1970 are kept to the ns."""


@pytest.mark.parametrize("name", CASES)
def test_a_run_comes_back_as_it_was(tmp_path: Path, name: str) -> None:
    """Values are those that were written, in SI, each channel on its own time axis, in the file that is written too."""
    case = CASES[name]
    source = case.write(tmp_path)
    arguments = ["import", str(source), "--map", str(case.map(tmp_path)), "--out", str(tmp_path / "out.h5")]
    assert main(arguments) == DONE
    recording = read_recording(tmp_path / "out.h5")
    seen = recording.channels["angle"]
    np.testing.assert_allclose(seen.values, np.deg2rad(angle()), rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_allclose(seen.time - seen.time[0], fast(), atol=NANOSECOND)
    assert (seen.unit, seen.clock) == ("rad", "time")
    if "current" in recording.channels:
        also = recording.channels["current"]
        np.testing.assert_allclose(also.values, 1e-3 * current(), rtol=ROUNDING, atol=ROUNDING)
        np.testing.assert_allclose(also.time - seen.time[0], slow(), atol=NANOSECOND)
        assert (also.unit, also.clock != "time") == ("A", True)
    assert len(recording.attributes["imported_sha256"]) == 64


@pytest.mark.parametrize("name", CASES)
def test_inspection_tells_name_unit_rate_and_length(tmp_path: Path, name: str) -> None:
    """`--inspect` names every column of the map, with its unit where the file has it, its rate and its length."""
    case = CASES[name]
    rows = inspect_file(case.write(tmp_path)).splitlines()
    for entry in case.channels.values():
        row = next(row for row in rows if f"  {entry['column']}  " in row).split()
        assert ("deg" in row or "mA" in row) == case.units_in_file
        assert {"400", "100"} & set(row)
        assert {"200", "50"} & set(row)


def test_units_and_times_in_the_names_of_columns_are_taken(tmp_path: Path) -> None:
    """Columns of Parquet that are called `angle [deg]` need no unit in the map, and give rates in the unit of time."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    late = np.where(np.arange(400) % 4 == 0, np.repeat(current(), 4), np.nan)
    table = pa.table({"time [ms]": 1e3 * fast(), "angle [deg]": angle(), "current (mA)": late})
    pq.write_table(table, tmp_path / "run.parquet")
    told = [row.split() for row in inspect_file(tmp_path / "run.parquet").splitlines()]
    assert told[1][-2:] == ["[ms]'", "(ms)."]
    assert [row[3:6] for row in told[3:]] == [["ms", "400", "200"], ["deg", "400", "200"], ["mA", "400", "50"]]
    assert told[5][-2:] == ["300", "empty"]
    case = ForeignCase(lambda folder: folder / "run.parquet", {"angle": {"column": 1}}, {"column": 0})
    seen = import_recording(tmp_path / "run.parquet", case.map(tmp_path)).channels["angle"]
    np.testing.assert_allclose(seen.time, fast(), rtol=ROUNDING)
    np.testing.assert_allclose(seen.values, np.deg2rad(angle()), rtol=ROUNDING)


def test_a_scale_alone_is_that_of_counts(tmp_path: Path) -> None:
    """A channel that its file calls counts needs no more than the scale."""
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(np.arange(400, dtype=np.uint16), fast(), name="encoder", unit="counts")])
        file.save(tmp_path / "run.mf4")
    entry = {"column": "encoder", "scale": "2*pi/400 rad"}
    case = ForeignCase(lambda folder: folder / "run.mf4", {"angle": entry})
    values = import_recording(tmp_path / "run.mf4", case.map(tmp_path)).channels["angle"].values
    np.testing.assert_allclose(values, 2.0 * np.pi / 400.0 * np.arange(400), rtol=ROUNDING)
    without = ForeignCase(case.write, {"angle": {"column": "encoder"}})
    assert "unit 'counts' has no scale; counts need a stated scale" in refusal(without, tmp_path)


def test_dates_count_from_the_first(tmp_path: Path) -> None:
    """Times of a bag, of a column of dates and of integers since 1970 begin near 0, and the file says when that was."""
    recordings = []
    for name in ("parquet", "parquet counts", "ros mcap"):
        folder = tmp_path / name.replace(" ", "_")
        folder.mkdir()
        recordings.append(import_recording(CASES[name].write(folder), CASES[name].map(folder)))
    assert all(item.channels["angle"].time[0] == 0.0 for item in recordings)
    origins = [item.attributes["time_origin"] for item in recordings]
    assert origins == ["2023-11-14T22:13:20.123456789Z", str(START_NS), "2023-11-14T22:13:20.123456789Z"]


SECONDS: Any = fast()
AXES: dict[str, Any] = {
    "us": np.round(SECONDS * 1e6).astype(np.int64) + START_NS // 1000 + 1,
    "s": SECONDS + START_NS * 1e-9,
    "ms": np.round(SECONDS * 1e3).astype(np.uint64) + np.uint64(START_NS // 10**6),
}
"""The same instants as in ns since 1970, in other units: whole, or as floats."""


@pytest.mark.parametrize(("unit", "rounding"), [("us", 1e-6), ("s", 1e-6), ("ms", 1e-3)])
def test_axes_in_different_units_count_from_the_same_instant(tmp_path: Path, unit: str, rounding: float) -> None:
    """Times since 1970 in ns and in another unit are the same times, up to what the coarser one can tell."""
    nanoseconds = START_NS + np.round(fast() * 1e9).astype(np.int64)
    np.savez(tmp_path / "run.npz", t_ns=nanoseconds, t=AXES[unit], x=angle())
    channels = {
        "a": {"column": "x", "unit": "deg", "time": {"column": "t_ns", "unit": "ns"}},
        "b": {"column": "x", "unit": "deg", "time": {"column": "t", "unit": unit}},
    }
    case = ForeignCase(lambda folder: folder / "run.npz", channels)
    found = import_recording(tmp_path / "run.npz", case.map(tmp_path))
    ours, theirs = (found.channels[name].time for name in "ab")
    assert 0.0 <= min(ours[0], theirs[0]) < rounding
    np.testing.assert_allclose(theirs, ours, atol=rounding)
    origin = int(found.attributes["time_origin"])
    assert abs(origin - START_NS) < rounding * 1e9


def test_an_axis_that_counts_from_its_own_start_is_left_alone(tmp_path: Path) -> None:
    """Beside times since 1970, whole seconds since the start stay what they are."""
    nanoseconds = START_NS + np.round(fast() * 1e9).astype(np.int64)
    np.savez(tmp_path / "run.npz", t_ns=nanoseconds, x=angle(), t=np.arange(5), y=np.arange(5.0))
    channels = {
        "a": {"column": "x", "unit": "deg", "time": {"column": "t_ns", "unit": "ns"}},
        "b": {"column": "y", "unit": "A", "time": {"column": "t", "unit": "s"}},
    }
    case = ForeignCase(lambda folder: folder / "run.npz", channels)
    found = import_recording(tmp_path / "run.npz", case.map(tmp_path))
    np.testing.assert_allclose(found.channels["a"].time, fast(), atol=NANOSECOND)
    np.testing.assert_array_equal(found.channels["b"].time, np.arange(5.0))


@pytest.mark.parametrize(
    ("name", "module", "extra"),
    [
        ("parquet", "pyarrow.parquet", "parquet"),
        ("mdf", "asammdf", "mdf"),
        ("tdms", "nptdms", "tdms"),
        ("ros mcap", "rosbags.highlevel", "ros"),
        ("spreadsheet", "python_calamine", "spreadsheet"),
    ],
)
def test_a_missing_library_is_said_with_its_install_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, module: str, extra: str
) -> None:
    """Without the optional package the file is not read, and the command that installs it is given."""
    source = CASES[name].write(tmp_path)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(FrictionOcpError, match=rf"is not installed; pip install 'friction-ocp\[{extra}\]'"):
        inspect_file(source)


def test_every_extra_that_is_named_exists() -> None:
    """The install commands name extras of this project; `formats` has all of them."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    assert extras["formats"] == ["friction-ocp[parquet,mdf,ros,tdms,matlab,spreadsheet]"]
    assert all(len(extras[name]) == 1 for name in ("parquet", "mdf", "ros", "tdms", "matlab", "spreadsheet"))


def refusal(case: ForeignCase, folder: Path, **changes: Any) -> str:
    """Return the findings about a run under a map whose channel `angle` is changed."""
    changed = {**case.channels, "angle": {**case.channels["angle"], **changes}}
    with pytest.raises(FrictionOcpError) as caught:
        import_recording(case.write(folder), ForeignCase(case.write, changed, case.time).map(folder))
    return str(caught.value)


def test_units_that_contradict_the_file_are_refused(tmp_path: Path) -> None:
    """A unit that is not that of the file is taken only where the map says that it replaces it."""
    case = CASES["mdf"]
    said = refusal(case, tmp_path, unit="rad")
    assert "channels.angle: the unit is 'rad', but the file says 'deg' of 'angle'" in said
    assert "leave the unit out, or confirm it with instead_of: deg" in said
    assert "furlong" in refusal(case, tmp_path, unit="furlong")
    for unit, expected in (("degree", np.deg2rad(angle())), ("rad", angle())):
        entry = {"column": "angle", "unit": unit} | ({"instead_of": "deg"} if unit == "rad" else {})
        recording = import_recording(case.write(tmp_path), ForeignCase(case.write, {"angle": entry}).map(tmp_path))
        np.testing.assert_allclose(recording.channels["angle"].values, expected, rtol=ROUNDING)


@pytest.mark.parametrize("unit", ["", "Skt", "-"])
def test_units_that_cannot_be_read_are_refused(tmp_path: Path, unit: str) -> None:
    """A unit of the file that no exact conversion is known for is not guessed."""
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(angle(), fast(), name="angle", unit=unit)])
        file.save(tmp_path / "run.mf4")
    said = refusal(ForeignCase(lambda folder: folder / "run.mf4", {"angle": {"column": "angle"}}), tmp_path)
    assert f"unknown unit '{unit}'" in said or "the file states none for 'angle'" in said


def test_samples_that_a_logger_marks_invalid_are_missing(tmp_path: Path) -> None:
    """Invalidation bits of MDF become NaN."""
    from asammdf import MDF, Signal

    bits = fast() > 1.0
    with MDF(version="4.10") as file:
        file.append([Signal(angle(), fast(), name="angle", unit="deg", invalidation_bits=bits)])
        file.save(tmp_path / "run.mf4")
    case = ForeignCase(lambda folder: folder / "run.mf4", {"angle": {"column": "angle"}})
    values = import_recording(tmp_path / "run.mf4", case.map(tmp_path)).channels["angle"].values
    np.testing.assert_array_equal(np.isnan(values), bits)


@pytest.mark.parametrize("kind", ["bool_", "int16", "float32"])
def test_missing_values_of_parquet_are_missing(tmp_path: Path, kind: str) -> None:
    """A null in a column of numbers or truth values becomes NaN."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    make: Any = getattr(pa, kind)
    table = pa.table({"t": pa.array([0.0, 1.0, 2.0]), "x": pa.array([1, None, 0], pa.int8()).cast(make())})
    pq.write_table(table, tmp_path / "run.parquet")
    channels, time = {"x": {"column": "x", "unit": "1"}}, {"column": "t", "unit": "s"}
    case = ForeignCase(lambda folder: folder / "run.parquet", channels, time)
    values = import_recording(tmp_path / "run.parquet", case.map(tmp_path)).channels["x"].values
    np.testing.assert_array_equal(values, [1.0, np.nan, 0.0])


@pytest.mark.parametrize("turn", [360.0, 65536.0])
def test_wraps_are_unrolled(tmp_path: Path, turn: float) -> None:
    """A counter that starts over is a straight motion again, past missing samples, and is found by --inspect."""
    true = turn * 0.07 * np.arange(200.0)
    shown = np.where(np.arange(200) % 50 == 49, np.nan, true % turn)
    cells = ["" if np.isnan(value) else f"{value!r}" for value in shown.tolist()]
    (tmp_path / "run.csv").write_text("t,n\n" + "".join(f"{k * 0.01:.2f},{cell}\n" for k, cell in enumerate(cells)))
    assert f"starts over: wrap: {turn:g}?" in inspect_file(tmp_path / "run.csv")
    entry = {"column": "n", "unit": "counts", "scale": "1 deg", "wrap": turn}
    case = ForeignCase(lambda folder: folder / "run.csv", {"angle": entry}, {"column": "t", "unit": "s"})
    values = import_recording(tmp_path / "run.csv", case.map(tmp_path)).channels["angle"].values
    np.testing.assert_allclose(values, np.deg2rad(np.where(np.isnan(shown), np.nan, true)), rtol=1e-9, atol=1e-9)
    assert f"near half of wrap = {0.15 * turn:.6g}; steps of" in refusal(case, tmp_path, wrap=0.15 * turn)


def test_a_forgotten_wrap_is_told_with_what_to_write(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The import of an encoder of 16 bits that starts over says how often, and what the map lacks; with it, nothing."""
    turns = np.round(2e5 * np.sin(6.0 * fast()) + 1e5).astype(int) % 65536
    rows = "".join(f"{t:.3f},{n}\n" for t, n in zip(fast(), turns, strict=True))
    (tmp_path / "run.csv").write_text("t,n\n" + rows)
    entry = {"column": "n", "unit": "counts", "scale": "2*pi/4096 rad"}
    time = {"column": "t", "unit": "s"}
    jumps = np.count_nonzero(np.abs(np.diff(turns)) > 32768)
    for more, told in (({}, True), ({"wrap": 65536}, False)):
        case = ForeignCase(lambda folder: folder / "run.csv", {"angle": {**entry, **more}}, time)
        arguments = ["--map", str(case.map(tmp_path)), "--out", str(tmp_path / "out.h5")]
        assert main(["import", str(tmp_path / "run.csv"), *arguments]) == DONE
        said = capsys.readouterr().err
        assert (f"map.yaml: channels.angle: channel 'angle' jumps {jumps} times by 100.531 rad" in said) == told
        assert ("write `wrap: 65536` there" in said) == told


def test_an_interrupted_log_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The import of a log that pauses for 0.8 s says where, and what becomes of it."""
    kept = np.delete(np.arange(400), slice(100, 260))
    rows = "".join(f"{fast()[k]:.3f},{angle()[k]}\n" for k in kept.tolist())
    (tmp_path / "run.csv").write_text("t,x\n" + rows)
    channels = {"angle": {"column": "x", "unit": "deg"}}
    case = ForeignCase(lambda folder: folder / "run.csv", channels, {"column": "t", "unit": "s"})
    arguments = ["--map", str(case.map(tmp_path)), "--out", str(tmp_path / "out.h5")]
    assert main(["import", str(tmp_path / "run.csv"), *arguments]) == DONE
    said = capsys.readouterr().err
    assert "run.csv: no samples of 'angle' from 0.4950 s to 1.3000 s, 0.805 s where 0.005 s is usual; inputs" in said


@pytest.mark.parametrize("ending", ["dat", "log", "asc"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
def test_text_is_read_whatever_its_ending(tmp_path: Path, ending: str, encoding: str) -> None:
    """Loggers write text with endings of measurement files."""
    path = tmp_path / f"run.{ending}"
    rows = zip(fast().tolist(), angle().tolist(), strict=True)
    path.write_text("t [s];x [°]\n" + "".join(f"{t:.3f};{x}\n" for t, x in rows), encoding=encoding)
    case = ForeignCase(lambda folder: path, {"angle": {"column": 1, "unit": "deg"}}, {"column": 0, "unit": "s"})
    seen = import_recording(path, case.map(tmp_path)).channels["angle"]
    np.testing.assert_allclose(seen.values, np.deg2rad(angle()), rtol=ROUNDING, atol=ROUNDING)
    assert "x" in inspect_file(path)


def test_a_logger_that_starts_late_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A current with stamps of its own that begins 0.5 s after the encoder is told with what to do about it."""
    stamps = [
        f"{t:.3f},{i}" for t, i in zip(fast()[100:].tolist(), np.repeat(current(), 4)[100:].tolist(), strict=True)
    ]
    rows = zip(fast().tolist(), angle().tolist(), [*stamps, *[","] * 100], strict=True)
    (tmp_path / "run.csv").write_text("t,x,t2,i\n" + "".join(f"{t:.3f},{x},{row}\n" for t, x, row in rows))
    channels = {
        "angle": {"column": "x", "unit": "deg"},
        "current": {"column": "i", "unit": "mA", "held": 4, "time": {"column": "t2", "unit": "s"}},
    }
    case = ForeignCase(lambda folder: folder / "run.csv", channels, {"column": "t", "unit": "s"})
    arguments = ["--map", str(case.map(tmp_path)), "--out", str(tmp_path / "out.h5")]
    assert main(["import", str(tmp_path / "run.csv"), *arguments]) == DONE
    said = capsys.readouterr().err
    assert "no samples of 'current' from 0.0000 s to 0.5000 s, before its first: 0.5 s" in said
    assert "state `from: 0.5` beside the file" in said and "'angle'" not in said


def test_values_of_a_slower_logger_are_told_and_thinned(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A current of 50 Hz in rows of 200 Hz is told by --inspect and by the import; `held` keeps each value once."""
    rows = zip(fast().tolist(), angle().tolist(), np.repeat(current(), 4).tolist(), strict=True)
    (tmp_path / "run.csv").write_text("t,x,i\n" + "".join(f"{t:.3f},{x},{i}\n" for t, x, i in rows))
    listed = inspect_file(tmp_path / "run.csv").splitlines()
    assert [" held: " in row for row in listed[3:]] == [False, False, True]
    assert listed[5].endswith("repeats every value: held: 4?, 50 new ones per s")
    for more, told in (({}, True), ({"held": 4}, False)):
        channels = {"angle": {"column": "x", "unit": "deg"}, "current": {"column": "i", "unit": "mA", **more}}
        case = ForeignCase(lambda folder: folder / "run.csv", channels, {"column": "t", "unit": "s"})
        arguments = ["--map", str(case.map(tmp_path)), "--out", str(tmp_path / "out.h5")]
        assert main(["import", str(tmp_path / "run.csv"), *arguments]) == DONE
        said = capsys.readouterr().err
        assert (
            "channel 'current' repeats every value 4 times: a new one comes every 0.02 s, not every" in said
        ) == told
        assert ("write `held: 4` there" in said) == told
    values = read_recording(tmp_path / "out.h5").channels["current"].values
    np.testing.assert_allclose(values[::4], 1e-3 * current(), rtol=ROUNDING)
    assert np.count_nonzero(np.isfinite(values)) == 100


def test_empty_cells_beside_a_time_of_its_own_are_no_samples(tmp_path: Path) -> None:
    """Of two loggers in one table the slower one fills few rows: it gets a clock with those alone."""
    cells = [f"{t:.3f},{i}" for t, i in zip(slow().tolist(), current().tolist(), strict=True)]
    for layout in ("spread", "first"):
        beside = {4 * k if layout == "spread" else k: text for k, text in enumerate(cells)}
        rows = (f"{t:.3f},{x},{beside.get(k, ',')}\n" for k, (t, x) in enumerate(zip(fast(), angle(), strict=True)))
        (tmp_path / "run.csv").write_text("t,x,t2,i\n" + "".join(rows))
        own = {"column": "t2", "unit": "s"}
        channels = {"angle": {"column": "x", "unit": "deg"}, "current": {"column": "i", "unit": "mA", "time": own}}
        case = ForeignCase(lambda folder: folder / "run.csv", channels, {"column": "t", "unit": "s"})
        seen = import_recording(tmp_path / "run.csv", case.map(tmp_path)).channels
        np.testing.assert_allclose(seen["current"].time, slow(), atol=ROUNDING)
        np.testing.assert_allclose(seen["current"].values, 1e-3 * current(), rtol=ROUNDING)
        assert (seen["angle"].time.size, seen["current"].clock) == (400, "t2")
    (tmp_path / "run.csv").write_text("t,x,t2,i\n0,1,0,1\n1,2,,2\n2,3,2,3\n")
    with pytest.raises(FrictionOcpError, match=r"clock 't2' is not finite at sample 1 \(1 of 3 samples\)"):
        import_recording(tmp_path / "run.csv", tmp_path / "map.yaml")


def test_a_filter_of_the_logger_is_undone(tmp_path: Path) -> None:
    """A step seen through a first-order filter is a step again, and a time constant of zero is refused."""
    time = 0.01 * np.arange(100)
    shown = np.where(time > 0.3, 2.0 * (1.0 - np.exp(-(time - 0.3) / 0.1)), 0.0)
    rows = "".join(f"{t:.2f},{value!r}\n" for t, value in zip(time, shown.tolist(), strict=True))
    (tmp_path / "run.csv").write_text("t,i\n" + rows)
    entry = {"column": "i", "unit": "rad", "low_pass": 0.1}
    case = ForeignCase(lambda folder: folder / "run.csv", {"angle": entry}, {"column": "t", "unit": "s"})
    values = import_recording(tmp_path / "run.csv", case.map(tmp_path)).channels["angle"].values
    np.testing.assert_allclose(values, np.where(time > 0.295, 2.0, 0.0), atol=1e-9)
    assert "low_pass is 0; a number above 0" in refusal(case, tmp_path, low_pass=0)


def test_clocks_that_start_over_go_on(tmp_path: Path) -> None:
    """A counter of us that wraps at 2^32, and one that a restart sets to 0, give times that only grow."""
    steps = 10_000 * np.arange(100)
    wrapped = (2**32 - 500_000 + steps) % 2**32
    restarted = np.where(np.arange(100) < 60, 7_000_000 + steps, steps - steps[60])
    rows = "".join(f"{a},{b},{k}\n" for k, (a, b) in enumerate(zip(wrapped, restarted, strict=True)))
    (tmp_path / "run.csv").write_text("a,b,x\n" + rows)
    for column, repair in (("a", {"wrap": 2**32}), ("b", {"reset": 0})):
        time = {"column": column, "unit": "us", **repair}
        case = ForeignCase(lambda folder: folder / "run.csv", {"x": {"column": "x", "unit": "A"}}, time)
        found = import_recording(tmp_path / "run.csv", case.map(tmp_path)).channels["x"].time
        np.testing.assert_allclose(np.diff(found), 0.01, rtol=1e-9)
    case = ForeignCase(case.write, {"angle": {"column": "x", "unit": "A"}}, {"column": "a", "unit": "us"})
    assert "'a' starts over at sample 50 (0 after 4294957296); times that only grow; state `wrap: 4294967296`" in (
        refusal(case, tmp_path)
    )


def test_a_reset_counter_goes_on_at_its_speed(tmp_path: Path) -> None:
    """An encoder that its index sets to zero is unrolled with the step that it had."""
    true = 40.0 * np.arange(100.0) + 5000.0
    shown = np.where(np.arange(100) < 30, true, true - true[30])
    (tmp_path / "run.csv").write_text("t,n\n" + "".join(f"{k},{value}\n" for k, value in enumerate(shown)))
    entry = {"column": "n", "unit": "counts", "scale": "1 rad", "reset": 0}
    case = ForeignCase(lambda folder: folder / "run.csv", {"n": entry}, {"column": "t", "unit": "s"})
    np.testing.assert_allclose(import_recording(tmp_path / "run.csv", case.map(tmp_path)).channels["n"].values, true)


def test_sizes_are_refused_before_anything_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Declared lengths are held against the limit and the free memory; the file is not touched for it."""
    with pytest.raises(FrictionOcpError, match=r"'x' declares 100000000 samples; at most 50000000; split or thin"):
        check_sizes(tmp_path / "a.mf4", [Signal("x", 100_000_000)])
    monkeypatch.setattr(foreign, "free_memory", lambda: 10**6)
    with pytest.raises(FrictionOcpError, match=r"about 1.6 GB of memory are needed, 0.001 GB are free"):
        check_sizes(tmp_path / "a.mf4", [Signal("x", MAX_SAMPLES)])
    with h5py.File(tmp_path / "big.h5", "w") as file:
        file.create_dataset("t", shape=(10**8,), dtype=np.float64, chunks=(1000,))
    content = {"format": "friction-ocp-map/1", "channels": {"x": {"column": "t", "unit": "A"}}}
    content["time"] = {"column": "t", "unit": "s"}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(FrictionOcpError, match="'t' declares 100000000 samples"):
        import_recording(tmp_path / "big.h5", tmp_path / "map.yaml")


@pytest.mark.parametrize("suffix", [suffix for suffix in READERS if suffix not in (".csv", ".tsv", ".txt")])
def test_damaged_files_are_findings(tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing, noise and a beginning without its end are told as one finding each, without a traceback."""
    noise = np.random.default_rng(5).bytes(4000)
    begun = {".mf4": b"MDF     4.10    ", ".parquet": b"PAR1", ".mcap": b"\x89MCAP0\r\n"}
    for content in {b"", noise, begun.get(suffix, b"") + noise}:
        (tmp_path / f"run{suffix}").write_bytes(content)
        assert main(["import", str(tmp_path / f"run{suffix}"), "--inspect"]) == WRONG_INPUT
        said = capsys.readouterr()
        assert said.err.startswith(str(tmp_path)) and "Traceback" not in said.err + said.out


def test_libraries_are_loaded_only_for_their_formats() -> None:
    """The optional packages are not needed to import this package's readers."""
    names = ("parquet", "mdf", "tdms", "rosbag", "matlab")
    modules = [importlib.import_module(f"friction_ocp.recording.{name}") for name in names]
    assert not any(hasattr(module, name) for module in modules for name in ("pyarrow", "asammdf", "nptdms", "rosbags"))


def test_json_tells_single_values_and_tables_of_number_over_number(tmp_path: Path) -> None:
    """What is no series stands beside them; an object of numbers is two series; gaps and texts are seen."""
    path = tmp_path / "run.json"
    path.write_text('{"mass": 0.49, "speed": {"1.0": 0.53, "2.5": 1.12}, "t": [0, 1, null], "mode": ["a", "b"]}')
    shown = inspect_file(path)
    assert "4 columns, JSON; beside them mass = 0.49" in shown
    rows = {row.split()[1]: row.split() for row in shown.splitlines()[1:] if row[:1].isdigit()}
    assert rows["speed.key"][-2:] == ["1", "2.5"] and rows["speed.value"][-2:] == ["0.53", "1.12"]
    assert rows["t"][-4:] == ["0", "1", "1", "empty"] and rows["mode"][-2:] == ["no", "numbers"]


def test_objects_of_numpy_are_not_unpickled(tmp_path: Path) -> None:
    """An array of objects is refused: reading it would run what it says."""
    np.save(tmp_path / "run.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(FrictionOcpError, match="cannot be read as a NumPy file"):
        inspect_file(tmp_path / "run.npy")


def test_cells_of_matlab_are_series(tmp_path: Path) -> None:
    """A cell array holds a series a cell: runs of different lengths."""
    import scipy.io

    cells = np.empty((2, 1), dtype=object)
    cells[0, 0], cells[1, 0] = np.arange(5.0), np.arange(7.0)
    scipy.io.savemat(tmp_path / "run.mat", {"runs": cells})
    shown = inspect_file(tmp_path / "run.mat")
    assert "runs{0}" in shown and "runs{1}" in shown and shown.splitlines()[-1].split()[2] == "7"


def write_scope(path: Path) -> None:
    """Write what a scope of Simulink saves as a structure with time, as MATLAB does up to version 7."""
    import scipy.io

    signals = np.zeros((1, 2), dtype=[("values", object), ("label", object)])
    signals[0, 0], signals[0, 1] = (angle()[:, None], "position"), (fast()[:, None] ** 2, "current")
    scipy.io.savemat(path, {"ScopeData": {"time": fast()[:, None], "signals": signals, "blockName": "bench/Scope"}})


def write_scope_73(path: Path) -> None:
    """Write the same as MATLAB 7.3 does: the fields of a struct array are references; some here have no end."""
    with h5py.File(path, "w", userblock_size=512) as file:
        scope, signals = file.create_group("ScopeData"), file.create_group("ScopeData/signals")
        scope["time"] = fast()[None, :]
        names = [np.frombuffer(name.encode("utf-16-le"), np.uint16)[:, None] for name in ("position", "current")]
        fields = {"values": [angle()[None, :], fast()[None, :] ** 2], "label": names}
        for field, (first, second) in fields.items():
            kept = [file.create_dataset(f"#refs#/{field}{k}", data=data) for k, data in enumerate((first, second))]
            signals.create_dataset(field, (2, 1), h5py.ref_dtype)[:, 0] = [item.ref for item in kept]
            for item in kept if field == "label" else ():
                item.attrs["MATLAB_class"] = np.bytes_("char")
        inner = file.create_group("#refs#/inner")
        for holder, name, target in ((scope, "outside", scope), (scope, "inside", inner), (inner, "loop", inner)):
            holder.create_dataset(name, (1, 1), h5py.ref_dtype)[0, 0] = target.ref
            holder[name].attrs["MATLAB_class"] = np.bytes_("cell")
        for name, kind, dtype in (("none", "cell", h5py.ref_dtype), ("empty", "char", np.dtype(np.uint16))):
            scope.create_dataset(name, data=h5py.Empty(dtype)).attrs["MATLAB_class"] = np.bytes_(kind)


@pytest.mark.parametrize("write", [write_scope, write_scope_73])
def test_struct_arrays_of_matlab_are_series(tmp_path: Path, write: Callable[[Path], None]) -> None:
    """A scope of Simulink holds a struct for each signal, whose label is shown."""
    write(tmp_path / "run.mat")
    entry = {"column": "ScopeData.signals{1}.values", "unit": "A"}
    channels = {"angle": {"column": "ScopeData.signals{0}.values", "unit": "deg"}, "current": entry}
    case = ForeignCase(lambda folder: folder / "run.mat", channels, {"column": "ScopeData.time", "unit": "s"})
    read = import_recording(tmp_path / "run.mat", case.map(tmp_path)).channels
    np.testing.assert_allclose(read["angle"].values, np.deg2rad(angle()), rtol=ROUNDING)
    np.testing.assert_allclose(read["current"].values, fast() ** 2, rtol=ROUNDING)
    labels = [line.split()[1:] for line in inspect_file(tmp_path / "run.mat").splitlines() if "label" in line]
    assert [(name, text) for name, _, text in labels] == [
        ("ScopeData.signals{0}.label", "'position'"),
        ("ScopeData.signals{1}.label", "'current'"),
    ]


def test_a_map_of_points_makes_static_points(tmp_path: Path) -> None:
    """Steady speeds and torques of a table become static points in SI units, which a problem file can list."""
    (tmp_path / "curve.csv").write_text("rpm,torque [mN m],runs\n60,120,3\n120,130,4\n-60,-118,3\n")
    content = {
        "format": "friction-ocp-map/1",
        "points": {
            "speed": {"column": "rpm", "unit": "rpm"},
            "torque": {"column": "torque [mN m]"},
            "runs": {"column": "runs", "unit": "1"},
        },
        "source": "bench",
    }
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content))
    arguments = ["import", str(tmp_path / "curve.csv"), "--map", str(tmp_path / "map.yaml")]
    assert main([*arguments, "--out", str(tmp_path / "curve.h5")]) == DONE
    points = read_static_points(tmp_path / "curve.h5")
    np.testing.assert_allclose(points.speed, np.array([60, 120, -60]) * np.pi / 30)
    assert points.torque is not None and points.runs is not None
    np.testing.assert_allclose(points.torque, [0.12, 0.13, -0.118])
    assert points.units["torque"] == "N m" and points.source == "bench"
    content["points"] = {"speed": {"column": "rpm", "unit": "rpm"}, "force": {"column": "runs", "unit": "N"}}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(FrictionOcpError, match="points: unknown key 'force'; available: speed, torque, current"):
        import_file(tmp_path / "curve.csv", tmp_path / "map.yaml")
