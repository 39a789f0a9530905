"""Static points and result series in HDF5."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording.hdf5 import (
    read_result_series,
    read_static_points,
    write_result_series,
    write_static_points,
)
from friction_ocp.recording.result_series import ChannelSeries, RecordingSeries, StateSeries
from friction_ocp.recording.static_points import StaticPoints

SPEED = np.array([-1.0, 1.0, 2.0])
POINTS = StaticPoints(
    "points",
    SPEED,
    {"speed": "rad/s", "torque": "N m", "std_error": "N m", "direction": "1", "runs": "1"},
    torque=np.array([-0.5, 0.5, 0.7]),
    std_error=np.full(3, 0.01),
    direction=np.sign(SPEED),
    runs=np.array([3.0, 3.0, 4.0]),
    title="bench",
    attributes={"temperature_degC": "21"},
)


def write_by_hand(path: Path, **columns: tuple[Any, str]) -> Path:
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "friction-ocp-static/1"
        for name, (values, unit) in columns.items():
            file[name] = values
            if unit:
                file[name].attrs["unit"] = unit
    return path


def test_static_points_survive_writing_and_reading(tmp_path: Path) -> None:
    """Every column, unit, title and attribute of static points is read as written."""
    path = tmp_path / "points.h5"
    write_static_points(POINTS, path)
    found = read_static_points(path)
    assert found.columns.keys() == POINTS.columns.keys()
    assert all(np.array_equal(found.columns[name], values) for name, values in POINTS.columns.items())
    assert (found.units, found.title, found.attributes) == (POINTS.units, "bench", POINTS.attributes)
    assert (found.name, found.path, len(found.sha256)) == ("points", path, 64)


def test_static_points_become_si(tmp_path: Path) -> None:
    """Columns in rpm and mA are read in rad/s and A; direction and runs need no unit."""
    path = write_by_hand(tmp_path / "p.h5", speed=([60.0], "rpm"), current=([200.0], "mA"), direction=([1], ""))
    points = read_static_points(path)
    assert points.speed[0] == pytest.approx(2.0 * np.pi)
    assert points.current is not None and points.current[0] == pytest.approx(0.2)
    assert points.direction is not None and points.direction.tolist() == [1.0]


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"torque": ([1.0], "N m")}, "there is no /speed"),
        ({"speed": ([1.0], "rad/s")}, "there is neither /torque nor /current; one of them beside /speed"),
        ({"speed": ([1.0, 2.0], "rad/s"), "current": ([1.0], "A")}, "/current has 1 samples, but /speed has 2"),
        ({"speed": ([1.0], "Hz"), "current": ([1.0], "A")}, "/speed is in Hz; a unit that converts to rad/s or m/s"),
        ({"speed": ([1.0], "m/s"), "torque": ([1.0], "N m")}, "/torque is in N m; a unit that converts to N"),
        (
            {"speed": ([1.0], "rad/s"), "current": ([1.0], "A"), "std_error": ([1.0], "N m")},
            "/std_error is in N m; a unit that converts to A",
        ),
        ({"speed": ([1.0], ""), "torque": ([1.0], "N m")}, "/speed has no unit"),
    ],
)
def test_each_fault_of_static_points_is_told(tmp_path: Path, columns: dict[str, Any], message: str) -> None:
    """What is missing, of another length or in a foreign unit is told."""
    with pytest.raises(FrictionOcpError) as caught:
        read_static_points(write_by_hand(tmp_path / "p.h5", **columns))
    assert message in str(caught.value)


def test_static_points_without_unit_are_not_written(tmp_path: Path) -> None:
    """Writing refuses a column without unit."""
    with pytest.raises(FrictionOcpError, match="/torque has no unit"):
        write_static_points(replace(POINTS, units={"speed": "rad/s"}), tmp_path / "p.h5")


TIME = np.array([0.0, 0.1, 0.2])
SERIES = {
    "a": RecordingSeries(
        {"motor_position": ChannelSeries(TIME, np.array([0.0, np.nan, 2.0]), np.ones(3), "rad")},
        StateSeries(TIME[:2], {"motor.theta": np.zeros(2), "motor.omega": np.ones(2)}, {"motor.theta": "rad"}),
    ),
    "b": RecordingSeries({"current": ChannelSeries(TIME, TIME, TIME, "A")}),
}


def test_result_series_survive_writing_and_reading(tmp_path: Path) -> None:
    """Measured, simulated, states and units are read as written."""
    path = tmp_path / "result.h5"
    write_result_series(path, SERIES)
    found = read_result_series(path)
    assert found.keys() == SERIES.keys()
    channel = found["a"].channels["motor_position"]
    np.testing.assert_array_equal(channel.measured, [0.0, np.nan, 2.0])
    assert (channel.unit, channel.simulated.tolist()) == ("rad", [1.0, 1.0, 1.0])
    states = found["a"].states
    assert states is not None and states.time.tolist() == [0.0, 0.1]
    assert {name: values.tolist() for name, values in states.values.items()} == {
        "motor.theta": [0.0, 0.0],
        "motor.omega": [1.0, 1.0],
    }
    assert states.units == {"motor.theta": "rad", "motor.omega": ""}
    assert found["b"].states is None


def test_result_series_has_the_published_layout(tmp_path: Path) -> None:
    """Outside programs find /<recording>/<channel>/{time,measured,simulated} and /<recording>/states."""
    path = tmp_path / "result.h5"
    write_result_series(path, SERIES)
    with h5py.File(path, "r") as file:
        paths: list[str] = []
        file.visit(paths.append)
        assert {"a/motor_position/time", "a/motor_position/measured", "a/motor_position/simulated"} <= set(paths)
        assert {"a/states/time", "a/states/motor.theta", "b/current/measured"} <= set(paths)


@pytest.mark.parametrize(
    ("series", "message"),
    [
        ({"x/y": SERIES["b"]}, "'x/y' cannot be a name"),
        ({"x": RecordingSeries({"states": SERIES["b"].channels["current"]})}, "a channel is called 'states'"),
        ({"x": RecordingSeries({}, StateSeries(TIME, {"time": TIME}))}, "a state is called 'time'"),
        (
            {"x": RecordingSeries({"c": ChannelSeries(TIME, TIME, TIME[:2])})},
            "x/c/simulated has 2 samples, but its time has 3; one value per time",
        ),
    ],
)
def test_each_fault_of_series_is_told(tmp_path: Path, series: dict[str, RecordingSeries], message: str) -> None:
    """Series that could not be read again are not written."""
    with pytest.raises(FrictionOcpError) as caught:
        write_result_series(tmp_path / "r.h5", series)
    assert message in str(caught.value)


def test_incomplete_series_are_told(tmp_path: Path) -> None:
    """A channel without its simulated values is told by name."""
    path = tmp_path / "r.h5"
    write_result_series(path, SERIES)
    with h5py.File(path, "r+") as file:
        del file["b/current/simulated"]
    with pytest.raises(FrictionOcpError, match="/b/current has no simulated"):
        read_result_series(path)
