"""Small sound files of every format that is read, written by the libraries of the formats."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

SUFFIXES: Mapping[str, str] = {
    "problem": ".yaml",
    "map": ".yaml",
    "recording": ".h5",
    "static": ".h5",
    "csv": ".csv",
    "hdf5": ".h5",
    "matlab5": ".mat",
    "matlab73": ".mat",
    "parquet": ".parquet",
    "mdf": ".mf4",
    "mdf3": ".mdf",
    "tdms": ".tdms",
    "mcap": ".mcap",
    "rosbag": ".db3",
    "json": ".json",
    "numpy": ".npz",
    "spreadsheet": ".xlsx",
    "matlab_objects": ".mat",
}
"""Readers, and the suffix of what they read."""
TEXT = ("problem", "map", "csv", "json")
"""Readers of text."""

PROBLEM = """# Asked: the friction of an axis.
format: friction-ocp-problem/1
title: Axis
drive:
  motor: {torque_constant: 0.35}
  shafts:
    - {name: motor, inertia: {guess: 0.002, min: 1.0e-5, max: 1},
       friction: {law: stribeck, tau_c: {guess: 0.1}, tau_s: 0.12, omega_s: 1, viscous: {guess: 0.01}}}
    - name: load
      inertia: 1.5
      gravity: {torque: 2.0, phase: 0.1}
      friction: {law: lugre, tau_c: 1, tau_s: {positive: 1.2, negative: 1.1}, omega_s: 0.1, sigma0: 100, sigma1: 1,
                 sigma2: {expr: 2 * load.inertia}}
  transmissions: [{ratio: 50, stiffness: {guess: 9.0e3, prior_std: 100}, damping: 1, backlash: 0.001}]
controller: {type: cascade, feedback: position, output: current, kp: 20, ki: 6, kd: 0.3, sample_time: 1e-3}
channels:
  reference: {measures: reference.theta, role: input, hold: zero}
  position: {measures: motor.theta, resolution: 1.5e-3}
recordings: {train: [{file: ../sound/run.h5, set: {load.inertia: 1.6}}], validation: [../sound/run.h5]}
estimation: {segment: 50, loss: huber, process_noise: {load: 0.1}}
constraints: [motor.friction.tau_s >= motor.friction.tau_c]
"""
MAP = """format: friction-ocp-map/1
time: {column: t, unit: us, wrap: 4294967296}
channels:
  position: {column: encoder, unit: counts, scale: 2*pi/4096 rad, wrap: 65536}
  current: {column: 3, unit: mA, time: {column: t2, unit: ms, reset: 0}}
  speed: {column: "rate [rpm]", instead_of: deg/s}
title: Bench
decimal: ","
"""


_TIME, _UNIT = "time: {column: 0, unit: s}\n", "unit: A, instead_of: deg"
MAPS: Mapping[str, str] = {
    name: "format: friction-ocp-map/1\n" + content
    for name, content in {
        "csv": _TIME + f"channels: {{x: {{column: 1, {_UNIT}}}}}",
        "hdf5": _TIME + "channels: {x: {column: 1, unit: mA}}",
        "matlab5": _TIME + "channels: {x: {column: 1, unit: A}}",
        "matlab73": _TIME + "channels: {x: {column: log.x, unit: A}}",
        "parquet": "time: {column: date}\nchannels: {x: {column: 1, unit: s}, t: {column: 0, unit: s}}",
        "mdf": "channels: {x: {column: 0}, n: {column: 1, unit: counts, scale: 1 rad, wrap: 65536}, y: {column: 2}}",
        "mdf3": "channels: {x: {column: 0}, n: {column: 1, unit: counts, scale: 1 rad, wrap: 65536}, y: {column: 2}}",
        "tdms": "channels: {x: {column: g/x}}",
        "mcap": "channels: {x: {column: 0, unit: A}, y: {column: 1, unit: V}}",
        "rosbag": "channels: {x: {column: 0, unit: A}, y: {column: 1, unit: V}}",
        "json": _TIME + f"channels: {{x: {{column: 1, {_UNIT}}}}}",
        "numpy": _TIME + "channels: {x: {column: 1, unit: A}}",
        "spreadsheet": "time: {column: date}\nchannels: {x: {column: 1}}",
        "matlab_objects": "time: {column: log.Time}\nchannels: {x: {column: log.x, unit: A}}",
    }.items()
}
"""The map of each format's sound file."""


def sound_files(reader: str, folder: Path) -> list[bytes]:
    """Write sound files for a reader into a folder and return their contents."""
    folder.mkdir(parents=True, exist_ok=True)
    _recording(folder / "run.h5")
    return [path.read_bytes() for path in WRITERS[reader](folder)]


def _time() -> Any:
    return 0.01 * np.arange(60)


def _dates() -> Any:
    return np.datetime64(1_700_000_000, "s") + (10_000_000 * np.arange(60)).astype("timedelta64[ns]")


def _texts(name: str, *contents: str) -> Callable[[Path], list[Path]]:
    def write(folder: Path) -> list[Path]:
        paths = [folder / f"{k}-{name}" for k in range(len(contents))]
        for path, content in zip(paths, contents, strict=True):
            path.write_text(content, encoding="utf-8")
        return paths

    return write


def _recording(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "friction-ocp-recording/1", "title": "<b>run</b>"})
        columns = {"position": ("rad", np.sin), "reference": ("rad", np.cos)}
        file["time"] = _time()
        file["clocks/late"] = _time() + 0.001
        for name, (unit, wave) in columns.items():
            file.create_dataset(f"channels/{name}", data=wave(_time()), compression="gzip", chunks=(16,))
            file[f"channels/{name}"].attrs["unit"] = unit
        file["channels/reference"].attrs["clock"] = "/clocks/late"
    return path


def _static(folder: Path) -> list[Path]:
    with h5py.File(folder / "static.h5", "w") as file:
        file.attrs["format"] = "friction-ocp-static/1"
        for name, unit in (("speed", "rpm"), ("torque", "N m"), ("std_error", "mN m"), ("direction", "1")):
            file[name] = 1.0 + np.arange(20.0)
            file[name].attrs["unit"] = unit
    return [folder / "static.h5"]


def _hdf5(folder: Path) -> list[Path]:
    with h5py.File(folder / "log.h5", "w") as file:
        file["a_time"], file["b/current"] = _time(), np.sin(_time())
        file["b/current"].attrs["unit"] = "mA"
        file.create_dataset("b/many", data=np.ones((60, 3)), chunks=(20, 3), compression="gzip")
    return [folder / "log.h5"]


def _matlab5(folder: Path) -> list[Path]:
    import scipy.io

    content = {"a_time": _time(), "log": {"x": np.sin(_time()), "y": np.ones((60, 2))}, "name": "rig", "n": np.int16(3)}
    paths = [folder / "plain.mat", folder / "packed.mat"]
    for path, packed in zip(paths, (False, True), strict=True):
        scipy.io.savemat(path, content, do_compression=packed)
    scipy.io.savemat(folder / "four.mat", {"a_time": _time(), "x": _time()}, format="4")
    return [*paths, folder / "four.mat"]


def _matlab73(folder: Path) -> list[Path]:
    with h5py.File(folder / "seven.mat", "w", userblock_size=512) as file:
        file["a_time"], file["log/x"] = _time()[None, :], np.sin(_time())[None, :]
        file["log/name"] = np.frombuffer(b"rig", dtype=np.uint8).astype(np.uint16)[:, None]
        file["log/name"].attrs["MATLAB_class"] = np.bytes_("char")
        parts = [file.create_dataset(f"#refs#/{name}", data=_time()[None, :]) for name in "ab"]
        file.create_dataset("log/parts/values", (2, 1), h5py.ref_dtype)[:, 0] = [part.ref for part in parts]
    return [folder / "seven.mat"]


def _parquet(folder: Path) -> list[Path]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [("t", pa.float64()), ("x", pa.float32()), ("date", pa.timestamp("ns")), ("s", pa.string())]
    columns = [pa.array(_time()), pa.array(np.sin(_time()), pa.float32()), pa.array(_dates()), pa.array(["a"] * 60)]
    table = pa.table(columns, schema=pa.schema([pa.field(*item, metadata={"unit": "s"}) for item in fields]))
    paths = [folder / "plain.parquet", folder / "packed.parquet"]
    pq.write_table(table, paths[0], compression="none", use_dictionary=False)
    pq.write_table(table, paths[1], compression="zstd")
    return paths


def _mdf(version: str, suffix: str) -> Callable[[Path], list[Path]]:
    def write(folder: Path) -> list[Path]:
        from asammdf import MDF, Signal

        with MDF(version=version) as file:
            wave, count = np.sin(_time()), np.arange(60, dtype=np.uint16)
            file.append([Signal(wave, _time(), name="x", unit="A"), Signal(count, _time(), name="count")])
            file.append([Signal(np.cos(_time()), _time() + 0.001, name="y", unit="deg")])
            file.save(folder / f"log{suffix}")
        return [folder / f"log{suffix}"]

    return write


def _tdms(folder: Path) -> list[Path]:
    from nptdms import ChannelObject, TdmsWriter

    facts = {"wf_increment": 0.01, "wf_start_time": np.datetime64("2026-01-01T00:00:00", "us"), "unit_string": "A"}
    with TdmsWriter(folder / "log.tdms") as file:
        file.write_segment([ChannelObject("g", "t", _time()), ChannelObject("g", "x", np.sin(_time()), facts)])
        file.write_segment([ChannelObject("g", "t", _time() + 1.0)])
    return [folder / "log.tdms"]


def _rosbag(storage: str, suffix: str) -> Callable[[Path], list[Path]]:
    def write(folder: Path) -> list[Path]:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        number = store.types["std_msgs/msg/Float64"]
        with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin[storage]) as bag:
            topics = [bag.add_connection(name, number.__msgtype__, typestore=store) for name in ("/a", "/b")]
            for k in range(20):
                for topic in topics:
                    message = store.serialize_cdr(number(data=float(k)), number.__msgtype__)
                    bag.write(topic, 1_700_000_000_000_000_000 + k * 10_000_000, message)
        return [folder / "bag" / f"bag{suffix}"]

    return write


def _numpy(folder: Path) -> list[Path]:
    np.savez(folder / "plain.npz", t=_time(), x=np.sin(_time()))
    np.savez_compressed(folder / "packed.npz", t=_time(), x=np.sin(_time()), both=np.ones((60, 2)))
    log = np.zeros(60, dtype=[("t", "f8"), ("x", "f4")])
    log["t"] = _time()
    with (folder / "array.npz").open("wb") as file:
        np.save(file, log)
    np.savez(folder / "dated.npz", t=_dates(), x=np.sin(_time()))
    return [folder / "plain.npz", folder / "packed.npz", folder / "array.npz", folder / "dated.npz"]


def _spreadsheet(folder: Path) -> list[Path]:
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.create_sheet("log")
    sheet.append(["rig", 7])
    sheet.append(["date", "x [A]", "note"])
    for date, value in zip(_dates().astype("datetime64[us]").tolist(), _time().tolist(), strict=True):
        sheet.append([date, value, "a"])
    book.save(folder / "log.xlsx")
    return [folder / "log.xlsx"]


def _matlab_objects(folder: Path) -> list[Path]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of pandas, about an option that the library sets
        import matio
        import pandas as pd

        table = pd.DataFrame({"x": np.sin(_time()), "note": ["a"] * 60}, index=pd.Index(_dates(), name="Time"))
        for name in ("v7", "v7.3"):
            matio.save_to_mat(str(folder / f"{name}.mat"), {"log": table, "plain": _time()}, version=name)
    return [folder / "v7.mat", folder / "v7.3.mat"]


_JSON = json.dumps({"t": _time().tolist(), "x [deg]": np.sin(_time()).tolist(), "mass": 0.5, "curve": {"1": 2, "3": 4}})
_RECORDS = json.dumps([{"t": float(t), "x": float(np.sin(t)), "arm": {"y": [1, None]}} for t in _time()])
_CSV = "".join(f"{t:.2f},{np.sin(t):.6f},{k % 7}\n" for k, t in enumerate(_time()))
_DATED = "date;x\n" + "".join(f"30.11.2026 23:59:{59.0 + t:06.3f};{np.sin(t):.6f}\n" for t in _time())
_DATED_RECORDS = json.dumps([{"t": f"{date}Z", "x": 1.0} for date in _dates()])
_AMERICAN = "date,x\n" + "".join(f"11/30/2026 11:59:{t:06.3f} PM,{np.sin(t):.6f}\n" for t in _time())
_GERMAN = "# Bench\nt [s];x [deg];n\n" + _CSV.replace(",", ";").replace(".", ",")

WRITERS: Mapping[str, Callable[[Path], list[Path]]] = {
    "problem": _texts("problem.yaml", PROBLEM),
    "map": _texts("map.yaml", MAP),
    "recording": lambda folder: [_recording(folder / "run.h5")],
    "static": _static,
    "csv": _texts("log.csv", "t,x [deg],n\n" + _CSV, _CSV, _GERMAN, _DATED, _AMERICAN),
    "hdf5": _hdf5,
    "matlab5": _matlab5,
    "matlab73": _matlab73,
    "parquet": _parquet,
    "mdf": _mdf("4.10", ".mf4"),
    "mdf3": _mdf("3.30", ".mdf"),
    "tdms": _tdms,
    "mcap": _rosbag("MCAP", ".mcap"),
    "rosbag": _rosbag("SQLITE3", ".db3"),
    "json": _texts("log.json", _JSON, _RECORDS, _DATED_RECORDS),
    "numpy": _numpy,
    "spreadsheet": _spreadsheet,
    "matlab_objects": _matlab_objects,
}
