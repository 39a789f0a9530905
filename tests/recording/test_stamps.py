"""Dates and times of day as loggers write them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording.import_recording import import_recording, inspect_file
from friction_ocp.recording.stamps import Writing, first_instant, is_stamp, past_midnight, stamped, writing_of

NOON = 1_796_040_000_000_000_000
"""2026-11-30 12:00:00, UTC, ns since 1970."""
WAYS = [
    ["2026-11-30 12:00:00.000000", "2026-11-30 12:00:00.012500", "2026-11-30 12:00:00.025000"],
    ["2026-11-30T12:00:00Z", "2026-11-30T12:00:00.0125Z", "2026-11-30T12:00:00.025Z"],
    ["2026-11-30T13:00:00+01:00", "2026-11-30T13:00:00.0125+01:00", "2026-11-30T13:00:00.025+01:00"],
    ["2026/11/30 12:00:00,000", "2026/11/30 12:00:00,0125", "2026/11/30 12:00:00,025"],
    ["30.11.2026 12:00:00.0000", "30.11.2026 12:00:00.0125", "30.11.2026 12:00:00.0250"],
    ["30/11/2026 12:00:00.0000", "30/11/2026 12:00:00.0125", "30/11/2026 12:00:00.0250"],
    ["11/30/2026 12:00:00.0000 PM", "11/30/2026 12:00:00.0125 PM", "11/30/2026 12:00:00.0250 PM"],
    ["30-Nov-2026 12:00:00", "30-Nov-2026 12:00:00.0125", "30-Nov-2026 12:00:00.025"],
    ["November 30 2026 12:00:00 p.m.", "Nov 30 2026 12:00:00.0125 p.m.", "nov 30 2026 12:00:00.025 p.m."],
]
MAP = "format: friction-ocp-map/1\ntime: {column: t}\nchannels: {position: {column: x, unit: deg}}\n"


def put(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


@pytest.mark.parametrize("stamps", WAYS)
def test_a_column_of_dates_is_a_time_axis(tmp_path: Path, stamps: list[str]) -> None:
    """Dates become s since the first of them, whose instant is kept, and the file states their unit."""
    path = put(tmp_path / "log.csv", "\n".join(["t;x", *(f"{stamp};{k}" for k, stamp in enumerate(stamps))]))
    recording = import_recording(path, put(tmp_path / "map.yaml", MAP))
    np.testing.assert_allclose(recording.channels["position"].time, [0.0, 0.0125, 0.025], atol=1e-12)
    assert recording.attributes["time_origin"] == "2026-11-30T12:00:00.000000000Z"
    assert first_instant([(writing_of(stamps), stamps)]) == NOON
    told = inspect_file(path)
    assert "Times count from 2026-11-30T12:00:00.000000000Z" in told and "80" in told


def test_times_of_day_go_on_after_midnight(tmp_path: Path) -> None:
    """A log over midnight has one time axis, beside a column of days that holds no numbers."""
    rows = ["day,t,x", "2026-11-30,23:59:59.990,1", "2026-11-30,23:59:59.995,2", "2026-12-01,00:00:00.000,3"]
    path = put(tmp_path / "log.csv", "\n".join([*rows, "2026-12-01,0:00:00.005,4"]))
    time = import_recording(path, put(tmp_path / "map.yaml", MAP)).channels["position"].time
    np.testing.assert_allclose(time, 86_399.99 + 0.005 * np.arange(4), atol=1e-9)
    assert "no numbers" in inspect_file(path).splitlines()[-3]


def test_days_are_counted_over_missing_times() -> None:
    """A missing time of day neither begins nor hides a new day."""
    grown = past_midnight(np.array([86_399.0, np.nan, 1.0, np.nan, 2.0, 86_399.0, 0.0]))
    np.testing.assert_array_equal(grown, [86_399.0, np.nan, 86_401.0, np.nan, 86_402.0, 172_799.0, 172_800.0])


def test_a_cell_that_is_no_date_is_told(tmp_path: Path) -> None:
    """What is neither a date nor missing is refused with its line; an unknown day is such a cell."""
    rows = ["t,x", "2026-11-30 12:00:00,1", "yesterday,2", "2026-02-30 12:00:00,3", "2026-11-30 12:00:01,4"]
    path = put(tmp_path / "log.csv", "\n".join([*rows, "2026-11-30 12:00:02,5"]))
    with pytest.raises(FrictionOcpError) as caught:
        import_recording(path, put(tmp_path / "map.yaml", MAP))
    first, second = str(caught.value).splitlines()
    assert "line 3: 'yesterday' in column 't' is no date and no time of day; correct or empty the cell" in first
    assert "line 4: '2026-02-30 12:00:00'" in second


def test_dates_of_json_and_numpy_are_time_axes(tmp_path: Path) -> None:
    """Texts in JSON and datetime64 in NumPy are read to the nanosecond."""
    put(tmp_path / "log.jsonl", "\n".join(f'{{"t": "{stamp}", "x": {k}}}' for k, stamp in enumerate(WAYS[1])))
    dates = np.datetime64("2026-11-30T12:00:00.000000000", "ns") + np.array([0, 12_500_001, 25_000_002])
    np.savez(tmp_path / "log.npz", t=dates, x=np.arange(3.0))
    expected = {"log.jsonl": [0.0, 0.0125, 0.025], "log.npz": [0.0, 0.012_500_001, 0.025_000_002]}
    for name, times in expected.items():
        recording = import_recording(tmp_path / name, put(tmp_path / "map.yaml", MAP))
        np.testing.assert_allclose(recording.channels["position"].time, times, rtol=0.0, atol=1e-15)
        assert recording.attributes["time_origin"] == "2026-11-30T12:00:00.000000000Z"


@pytest.mark.parametrize(
    ("first", "last", "day_first", "seconds"),
    [
        ("03/04/2026 23:59:59", "03/05/2026 00:00:01", False, 2.0),
        ("03/04/2026 23:59:59", "04/04/2026 00:00:01", True, 2.0),
        ("11/30/2026 11:59:59 PM", "12/01/2026 12:00:01 AM", False, 2.0),
        ("30-11-2026 23:59:59", "01-12-2026 00:00:01", True, 2.0),
        ("03/04/2026 10:00:00 am", "03/04/2026 1:00:00 pm", False, 10_800.0),
    ],
)
def test_the_last_row_tells_day_and_month_apart(
    tmp_path: Path, first: str, last: str, day_first: bool, seconds: float
) -> None:
    """Days that exist and are near tell which number is the month, be it at the end of a long log; else it is first."""
    joint = " " if first[-1] == "m" else ""
    begun = [f"{first[:19]}.{k:03d}{joint}{first[20:]}" for k in range(400)]
    rows = ["t;x", *(f"{stamp};1" for stamp in begun), f"{last};2"]
    assert writing_of([*begun, last]) == Writing(dated=True, day_first=day_first)
    assert writing_of([first, last]).nanoseconds("yesterday") is None
    for encoding in ("utf-8", "utf-16", "utf-16-be"):
        mark = "\ufeff" if encoding == "utf-16-be" else ""
        (tmp_path / "log.csv").write_text(mark + "\n".join(rows) + "\n\n", encoding=encoding)
        time = import_recording(tmp_path / "log.csv", put(tmp_path / "map.yaml", MAP)).channels["position"].time
        assert time[-1] == seconds


def test_texts_in_a_parquet_file_are_time_axes(tmp_path: Path) -> None:
    """Columns of dates and times of day as text, with gaps in them; a column with other words stays one of words."""
    pyarrow: Any = pytest.importorskip("pyarrow")
    parquet: Any = pytest.importorskip("pyarrow.parquet")
    columns = {
        "t": ["11/30/2026 11:59:59 PM", "12/01/2026 12:00:00 AM", "12/01/2026 12:00:01 AM"],
        "sent": [None, "12/01/2026 12:00:00 AM", "12/01/2026 12:00:01 AM"],
        "clock": ["23:59:59", "23:59:59.5", "0:00:01"],
        "note": ["23:59:59", "start", "0:00:01"],
        "x": [1.0, 2.0, 3.0],
    }
    parquet.write_table(pyarrow.table(columns), tmp_path / "log.parquet")
    told = inspect_file(tmp_path / "log.parquet")
    assert "Times count from 2026-11-30T23:59:59.000000000Z" in told and "no numbers" in told
    recording = import_recording(tmp_path / "log.parquet", put(tmp_path / "map.yaml", MAP))
    np.testing.assert_array_equal(recording.channels["position"].time, [0.0, 1.0, 2.0])
    by_clock = import_recording(tmp_path / "log.parquet", put(tmp_path / "map.yaml", MAP.replace(": t}", ": clock}")))
    np.testing.assert_array_equal(by_clock.channels["position"].time, 86_399.0 + np.array([0.0, 0.5, 2.0]))


def test_a_text_that_is_no_stamp_keeps_a_column_from_being_times() -> None:
    """Texts that are not all stamps, or all missing, are none."""
    assert stamped(["12:00:00", "", "12:00:01"]) == Writing(dated=False)
    assert stamped(["12:00:00", "later"]) is None and stamped(["", "nan"]) is None


@given(
    st.datetimes(datetime(1900, 1, 1), datetime(2099, 12, 31)),
    st.integers(-14 * 60, 14 * 60).filter(lambda minutes: minutes != 0),
    st.sampled_from(["T", " "]),
)
def test_dates_of_the_standard_library_are_read_to_the_microsecond(moment: datetime, ahead: int, joint: str) -> None:
    """Every date with a time zone that Python writes is the instant that Python takes it for."""
    zoned = moment.replace(tzinfo=timezone(timedelta(minutes=ahead)))
    since = zoned - datetime(1970, 1, 1, tzinfo=UTC)
    expected = (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1000
    assert Writing(dated=True).nanoseconds(zoned.isoformat(joint)) == expected


@given(st.text(alphabet="0123456789:.,-/TZ+ apmNovy", max_size=30))
def test_no_text_breaks_the_reader(text: str) -> None:
    """A text is a stamp and has a time, or is missing, or is told."""
    values, bad = writing_of([text]).seconds_of([text], 0)
    assert np.isfinite(values[0]) == is_stamp(text)
    assert not (bad and is_stamp(text))


@pytest.mark.parametrize(
    "text",
    [
        "12.5",
        "1:30",
        "2026-11-30",
        "2026-13-01 12:00:00",
        "12:60:00",
        "30.11.26 12:00:00",
        "13/13/2026 12:00:00",
        "11/30/2026 13:00:00 PM",
        "30-Nov 12:00:00",
    ],
)
def test_what_might_be_something_else_is_no_stamp(text: str) -> None:
    """Numbers, days alone, impossible dates, minutes and seconds, and years of two digits are left alone."""
    assert not is_stamp(text)
