"""Tables, timetables, dates and durations in MATLAB files, written by the library that knows how MATLAB keeps them."""

from __future__ import annotations

import importlib
import sys
import warnings
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording.import_recording import import_recording, inspect_file

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of pandas, about an option that it sets
    matio: Any = importlib.import_module("matio")
    matio_class: Any = importlib.import_module("matio.utils.matclass").MatlabOpaque
VERSIONS = ("v7", "v7.3")
STEP = np.timedelta64(100, "us")
MAP = (
    "format: friction-ocp-map/1\ntime: {column: log.Time}\n"
    "channels: {position: {column: log.angle, unit: deg}, current: {column: log.amps}}\n"
)


def write(path: Path, version: str, **variables: Any) -> Path:
    """Write variables as MATLAB does."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a display format is chosen
        matio.save_to_mat(str(path), variables, version=version)
    return path


def timetable(times: Any) -> Any:
    """Return a table of an angle in deg and a current in mA over the times of its rows."""
    table = pd.DataFrame({"angle": 90.0 * np.sin(np.arange(50.0)), "amps": np.arange(50.0)}, index=pd.Index(times))
    table.index.name = "Time"
    table.attrs["varUnits"] = ["", "mA"]
    return table


def channels_of(path: Path, entries: str) -> Any:
    """Return the channels that a map reads."""
    stated = path.with_suffix(".yaml")
    stated.write_text(entries, encoding="utf-8")
    return import_recording(path, stated)


@pytest.mark.parametrize("version", VERSIONS)
def test_timetables_have_their_times(tmp_path: Path, version: str) -> None:
    """Durations of 0.1 ms and dates are time axes; nothing of a step is lost."""
    spans, begun = STEP * np.arange(50), np.datetime64("2026-11-30T12:00:00", "ns")
    path = write(tmp_path / "log.mat", version, log=timetable(spans.astype("timedelta64[ns]")))
    read = channels_of(path, MAP.replace("log.amps}", "log.amps, unit: mA}"))
    np.testing.assert_allclose(read.channels["position"].time, 1e-4 * np.arange(50), atol=1e-12)
    np.testing.assert_allclose(read.channels["position"].values, np.pi / 2 * np.sin(np.arange(50.0)))
    np.testing.assert_allclose(read.channels["current"].values, 1e-3 * np.arange(50))
    write(path, version, log=timetable(begun + 20 * spans))
    read = channels_of(path, MAP.replace("log.amps}", "log.amps, unit: mA}"))
    np.testing.assert_allclose(read.channels["position"].time, 2e-3 * np.arange(50), atol=1e-6)
    assert read.attributes["time_origin"].startswith("2026-11-30T12:00:00.000")


@pytest.mark.parametrize("version", VERSIONS)
def test_tables_in_structs_and_cells_are_listed(tmp_path: Path, version: str) -> None:
    """Columns of tables have the names and places that vectors there have; dates in them are times, words are words."""
    dates = np.datetime64("2026-11-30T12:00:00", "ns") + 10 * STEP * np.arange(5)
    table = pd.DataFrame({"x": np.arange(5.0), "count": np.arange(5), "when": dates, "note": list("abcde")})
    runs = np.empty((2, 1), dtype=object)
    runs[0, 0], runs[1, 0] = np.arange(3.0), table
    path = write(tmp_path / "log.mat", version, bench={"log": table, "mass": 0.5}, runs=runs, plain=np.arange(7.0))
    shown = {
        line.split()[1]: line.split()[2:] for line in inspect_file(path).splitlines() if line.strip()[:1].isdigit()
    }
    assert {"bench.log.x", "bench.log.count", "bench.mass", "runs{0}", "runs{1}.x", "plain"} <= set(shown)
    assert shown["bench.log.when"][:2] == ["s", "5"] and shown["bench.log.note"][-2:] == ["no", "numbers"]


@pytest.mark.parametrize("version", VERSIONS)
def test_other_objects_are_listed_by_their_properties(tmp_path: Path, version: str) -> None:
    """A `timeseries` shows what it keeps; by their names, the times of each are those beside its data."""
    runs = np.empty((1, 2), dtype=object)
    for k in range(2):
        inner = matio_class({"Increment": np.array([[1e-3]])}, "tsdata.timemetadata")
        kept = {"Data_": np.arange(5.0)[:, None], "Time_": (k + 1) * 1e-3 * np.arange(5.0)[:, None], "TimeInfo_": inner}
        runs[0, k] = matio_class(kept, "timeseries")
    shown = inspect_file(write(tmp_path / "log.mat", version, runs=runs))
    rows = {line.split()[1]: line.split()[2:] for line in shown.splitlines() if line[:1].isdigit()}
    assert [rows[f"runs{{{k}}}.Data_"][:3] for k in range(2)] == [["5", "1000", "0.004"], ["5", "500", "0.008"]]
    assert rows["runs{1}.TimeInfo_.Increment"] == ["1", "0.001", "0.001"]


@pytest.mark.parametrize("version", VERSIONS)
def test_variables_beside_objects_are_read_without_the_library(
    tmp_path: Path, version: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where mat-io is missing what needs it is told with the command, and nothing of an object looks like numbers."""
    spans = (STEP * np.arange(50)).astype("timedelta64[ns]")
    path = write(tmp_path / "log.mat", version, log=timetable(spans), t=np.arange(50.0), x=np.arange(50.0))
    monkeypatch.setitem(sys.modules, "matio", None)
    shown = inspect_file(path)
    assert "which is not installed: pip install 'friction-ocp[matlab]'" in shown
    assert not [line for line in shown.splitlines() if " log" in line and "no numbers" not in line]
    entries = "format: friction-ocp-map/1\ntime: {column: t, unit: s}\nchannels: {position: {column: x, unit: rad}}\n"
    np.testing.assert_array_equal(channels_of(path, entries).channels["position"].values, np.arange(50.0))


@pytest.mark.parametrize("version", VERSIONS)
def test_objects_that_the_library_cannot_read_are_told(
    tmp_path: Path, version: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A class of a later MATLAB takes nothing else of the file with it."""

    def unknown(path: str, **_: Any) -> Any:
        raise NotImplementedError(f"version 99 in {Path(path).name}")

    spans = (STEP * np.arange(50)).astype("timedelta64[ns]")
    path = write(tmp_path / "log.mat", version, log=timetable(spans), x=np.arange(50.0))
    monkeypatch.setattr(matio, "load_from_mat", unknown)
    shown = inspect_file(path)
    assert "objects in it cannot be read (version 99 in log.mat)" in shown and " x " in shown


@pytest.mark.parametrize("how", ["link", "storage"])
def test_objects_may_not_lie_in_other_files(tmp_path: Path, how: str) -> None:
    """A file with objects whose data lie elsewhere is refused: nothing outside of it is opened."""
    spans = (STEP * np.arange(50)).astype("timedelta64[ns]")
    path = write(tmp_path / "log.mat", "v7.3", log=timetable(spans))
    (tmp_path / "other.bin").write_bytes(bytes(80))
    with h5py.File(path, "a") as file:
        if how == "link":
            file["secret"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/x")
        else:
            file.create_dataset("secret", (10,), "f8", external=[(str(tmp_path / "other.bin"), 0, 80)])
    with pytest.raises(
        FrictionOcpError, match="'secret' keeps its data elsewhere; data inside the file; copy it there"
    ):
        inspect_file(path)
