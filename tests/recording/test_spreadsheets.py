"""Spreadsheets as engineers keep logs in them: settings above the table, dates, empty and odd cells."""

from __future__ import annotations

from datetime import datetime, time, timedelta
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording.import_recording import import_recording, inspect_file

MAP = "format: friction-ocp-map/1\ntime: {column: t}\nchannels: {position: {column: x, unit: deg}}\n"


def put(path: Path, *rows: list[object]) -> Path:
    """Write rows into the one sheet of a file, and the map beside it."""
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    for row in rows:
        sheet.append(row)
    book.save(path)
    stated = MAP.replace("column: t}", 'column: "t [s]"}') if any("t [s]" in row for row in rows) else MAP
    path.with_suffix(".yaml").write_text(stated, encoding="utf-8")
    return path


STAMPS = {
    "dates": [datetime(2026, 11, 30, 23, 59, 59, 990_000) + timedelta(milliseconds=5 * k) for k in range(4)],
    "times": [time(23, 59, 59, 990_000), time(23, 59, 59, 995_000), time(0, 0), time(0, 0, 0, 5000)],
    "spans": [timedelta(milliseconds=5 * k) for k in range(4)],
    "texts": [f"11/30/2026 11:59:59.{990 + 5 * k} PM" for k in range(2)]
    + [f"12/01/2026 12:00:00.{5 * k:03d} AM" for k in range(2)],
}


@pytest.mark.parametrize("kind", STAMPS)
def test_dates_of_a_spreadsheet_are_a_time_axis(tmp_path: Path, kind: str) -> None:
    """Dates, times of day, spans, and dates as texts become s, over midnight, too."""
    path = put(tmp_path / "log.xlsx", ["t", "x"], *[[stamp, 2 * k] for k, stamp in enumerate(STAMPS[kind])])
    read = import_recording(path, path.with_suffix(".yaml")).channels["position"]
    np.testing.assert_allclose(read.time - read.time[0], 0.005 * np.arange(4), atol=1e-9)
    np.testing.assert_allclose(read.values, np.deg2rad(2.0 * np.arange(4)))


def test_a_cell_that_is_no_number_is_told_with_its_row(tmp_path: Path) -> None:
    """A word among numbers is refused where the map asks for it, not where the file is listed; empty cells are gaps."""
    rows: list[list[object]] = [
        ["rig 7"],
        [],
        ["t [s]", "x", "why"],
        [0.0, 1, "a"],
        [0.1, "overload", "b"],
        [0.2, None, ""],
    ]
    path = put(tmp_path / "log.xlsx", *rows, [0.3, True, "c"], [0.4, 5, "d"])
    shown = inspect_file(path)
    assert "why" in shown and "no numbers" in shown.splitlines()[-1] and "2 empty" in shown
    with pytest.raises(FrictionOcpError, match=r"row 5: 'overload' in column 'x' is not a number; correct or empty"):
        import_recording(path, path.with_suffix(".yaml"))
    rows[4][1] = None
    put(path, *rows, [0.3, True, "c"], [0.4, 5, "d"])
    values = import_recording(path, path.with_suffix(".yaml")).channels["position"].values
    np.testing.assert_allclose(np.rad2deg(values[np.isfinite(values)]), [1.0, 1.0, 5.0])


def test_a_book_without_a_table_and_columns_of_one_name(tmp_path: Path) -> None:
    """Words alone are no series; of two columns with one name each has its place."""
    with pytest.raises(FrictionOcpError, match="there is no series in it"):
        inspect_file(put(tmp_path / "words.xlsx", ["nothing", "here"]))
    shown = inspect_file(put(tmp_path / "twice.xlsx", ["t", "x", "x"], [0, 1, 2], [1, 1, 3]))
    assert "x (column 1)" in shown and "x (column 2)" in shown
