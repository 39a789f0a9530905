"""The same run of a machine, written by the libraries of each format: what an import has to give back."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import yaml

START_NS = 1_700_000_000_123_456_789
"""When the run began, ns since 1970: a float would lose its last digits."""


def fast() -> Any:
    """Times of the encoder, s: 200 Hz."""
    return 5e-3 * np.arange(400)


def slow() -> Any:
    """Times of the current, s: 50 Hz, on a clock that starts 3 ms later."""
    return 3e-3 + 20e-3 * np.arange(100)


def angle() -> Any:
    """Angle in deg."""
    return 90.0 * np.sin(3.0 * fast())


def current() -> Any:
    """Current in mA."""
    return 1000.0 * np.cos(3.0 * slow())


@dataclass(frozen=True)
class ForeignCase:
    """A way to write the run, and the map that reads it."""

    write: Callable[[Path], Path]
    """Folder -> file."""
    channels: Mapping[str, Any]
    time: Mapping[str, Any] | None = None
    units_in_file: bool = True

    def map(self, folder: Path) -> Path:
        """Write the map of the case."""
        content = {"format": "friction-ocp-map/1", "channels": dict(self.channels)}
        if self.time is not None:
            content["time"] = dict(self.time)
        path = folder / "map.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        return path


def _parquet(folder: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    dates = START_NS + np.round(fast() * 1e9).astype(np.int64)
    fields = [
        pa.field("stamp", pa.timestamp("ns")),
        pa.field("count", pa.int64()),
        pa.field("angle", pa.float64(), metadata={"unit": "deg"}),
        pa.field("note", pa.string()),
    ]
    columns = [pa.array(dates.astype("datetime64[ns]")), pa.array(dates), pa.array(angle()), pa.array(["x"] * 400)]
    pq.write_table(pa.table(columns, schema=pa.schema(fields)), folder / "run.parquet")
    return folder / "run.parquet"


def _matlab5(folder: Path) -> Path:
    import scipy.io

    log = {"t": fast()[:, None], "angle": angle()[None, :], "both": np.column_stack([slow(), current()])}
    scipy.io.savemat(folder / "run.mat", {"log": log, "rig": "bench"}, do_compression=True)
    return folder / "run.mat"


def _matlab73(folder: Path) -> Path:
    with h5py.File(folder / "run.mat", "w", userblock_size=512) as file:
        file["log/t"], file["log/angle"] = fast()[None, :], angle()[None, :]
        file["log/both"] = np.stack([slow(), current()])
        file["rig"] = np.frombuffer(b"bench", dtype=np.uint8).astype(np.uint16)[:, None]
        file["rig"].attrs["MATLAB_class"] = np.bytes_("char")
    return folder / "run.mat"


def _mdf(folder: Path) -> Path:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(angle(), fast(), name="angle", unit="deg")])
        file.append([Signal(current(), slow(), name="current", unit="mA")])
        file.save(folder / "run.mf4")
    return folder / "run.mf4"


def _tdms(folder: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    start = np.datetime64("2026-01-01T00:00:00.000000", "us")
    waves = ((angle(), "angle", "deg", 5e-3, 0), (current(), "current", "mA", 20e-3, 3000))
    with TdmsWriter(folder / "run.tdms") as file:
        for values, name, unit, step, late in waves:
            facts = {"wf_increment": step, "wf_start_time": start + np.timedelta64(late, "us"), "unit_string": unit}
            file.write_segment([ChannelObject("run", name, values, properties=facts)])
    return folder / "run.tdms"


def _rosbag(storage: str, inside: str = "") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        joints, number = (store.types[name] for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Float64"))
        header, stamp = (store.types[name] for name in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
        with Writer(folder / "run", version=9, storage_plugin=StoragePlugin[storage]) as bag:
            topics = [
                bag.add_connection(topic, kind.__msgtype__, typestore=store)
                for topic, kind in (("/joints", joints), ("/current", number))
            ]
            none = np.empty(0)
            for t, value in zip(START_NS + np.round(fast() * 1e9).astype(np.int64), angle(), strict=True):
                moment = stamp(sec=int(t) // 10**9, nanosec=int(t) % 10**9)
                arm = joints(header(stamp=moment, frame_id=""), ["base", "arm"], np.array([0.0, value]), none, none)
                bag.write(topics[0], int(t) + 700_000, store.serialize_cdr(arm, joints.__msgtype__))
            for t, value in zip(START_NS + np.round(slow() * 1e9).astype(np.int64), current(), strict=True):
                bag.write(topics[1], int(t), store.serialize_cdr(number(data=value), number.__msgtype__))
        return folder / "run" / inside

    return write


def _json(folder: Path) -> Path:
    rows = [{"t": float(t), "arm": {"angle": float(value)}} for t, value in zip(fast(), angle(), strict=True)]
    content = {"rig": "bench", "mass": 0.49, "log": rows, "drive": {"t": slow().tolist(), "mA": current().tolist()}}
    (folder / "run.json").write_text(json.dumps(content), encoding="utf-8")
    return folder / "run.json"


def _json_lines(folder: Path) -> Path:
    rows = [{"t": float(t), "angle [deg]": float(value)} for t, value in zip(fast(), angle(), strict=True)]
    (folder / "run.jsonl").write_text("\n".join(map(json.dumps, rows)), encoding="utf-8")
    return folder / "run.jsonl"


def _npy(folder: Path) -> Path:
    log = np.zeros(400, dtype=[("t", "f8"), ("angle", "f8")])
    log["t"], log["angle"] = fast(), angle()
    np.save(folder / "run.npy", log)
    return folder / "run.npy"


def _npz(folder: Path) -> Path:
    np.savez_compressed(folder / "run.npz", t=fast(), angle=angle()[:, None], both=np.stack([slow(), current()]))
    return folder / "run.npz"


_ROS_CHANNELS = {
    "angle": {"column": "/joints.position[arm]", "unit": "deg"},
    "current": {"column": "/current.data", "unit": "mA"},
}
_MATLAB_CHANNELS = {
    "angle": {"column": "log.angle", "unit": "deg"},
    "current": {"column": "log.both[1]", "unit": "mA", "time": {"column": "log.both[0]", "unit": "s"}},
}
_MATLAB_TIME = {"column": "log.t", "unit": "s"}
_JSON_CHANNELS = {
    "angle": {"column": "log.arm.angle", "unit": "deg"},
    "current": {"column": "drive.mA", "unit": "mA", "time": {"column": "drive.t", "unit": "s"}},
}
_NPZ_CHANNELS = {
    "angle": {"column": "angle", "unit": "deg"},
    "current": {"column": "both[1]", "unit": "mA", "time": {"column": "both[0]", "unit": "s"}},
}
_SECONDS = {"column": "t", "unit": "s"}
_OWN = {"angle": {"column": "angle"}, "current": {"column": "current"}}


def _spreadsheet(folder: Path) -> Path:
    import openpyxl

    book = openpyxl.Workbook()
    facts = {"encoder": (fast(), "angle", "deg", angle()), "drive": (slow(), "current", "mA", current())}
    for name, (time, channel, unit, values) in facts.items():
        sheet = book.create_sheet(name)
        for row in (["bench", "A 7"], ["rate", 200, "Hz"], ["t", channel, "note"], ["s", unit, ""]):
            sheet.append(row)
        for at, value in zip(time.tolist(), values.tolist(), strict=True):
            sheet.append([at, value, None])
    book.save(folder / "run.xlsx")
    return folder / "run.xlsx"


_SHEETS = {
    "angle": {"column": "encoder.angle", "time": {"column": "encoder.t"}},
    "current": {"column": "drive.current", "time": {"column": "drive.t"}},
}
CASES = {
    "spreadsheet": ForeignCase(_spreadsheet, _SHEETS),
    "parquet": ForeignCase(_parquet, {"angle": {"column": "angle"}}, {"column": "stamp"}),
    "parquet counts": ForeignCase(_parquet, {"angle": {"column": "angle"}}, {"column": "count", "unit": "ns"}),
    "matlab 5": ForeignCase(_matlab5, _MATLAB_CHANNELS, _MATLAB_TIME, False),
    "matlab 7.3": ForeignCase(_matlab73, _MATLAB_CHANNELS, _MATLAB_TIME, False),
    "mdf": ForeignCase(_mdf, _OWN),
    "tdms": ForeignCase(_tdms, {name: {"column": f"run/{name}"} for name in _OWN}),
    "json": ForeignCase(_json, _JSON_CHANNELS, {"column": "log.t", "unit": "s"}, False),
    "json lines": ForeignCase(_json_lines, {"angle": {"column": "angle [deg]"}}, _SECONDS),
    "npy": ForeignCase(
        _npy, {"angle": {"column": "data.angle", "unit": "deg"}}, {"column": "data.t", "unit": "s"}, False
    ),
    "npz": ForeignCase(_npz, _NPZ_CHANNELS, _SECONDS, False),
    "ros sqlite": ForeignCase(_rosbag("SQLITE3"), _ROS_CHANNELS, units_in_file=False),
    "ros mcap": ForeignCase(_rosbag("MCAP", "run.mcap"), _ROS_CHANNELS, units_in_file=False),
}
