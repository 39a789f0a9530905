"""HDF5 files: recordings, static points and the series of a result; what MATLAB writes is in `matlab_hdf5`."""

from __future__ import annotations

import hashlib
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict

import h5py as _h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.quantities import to_si
from friction_ocp.recording.attribute_text import attribute_text
from friction_ocp.recording.checks import (
    check_attributes,
    check_recording,
    check_series,
    check_static_points,
    check_values,
    check_written_names,
)
from friction_ocp.recording.foreign import MAX_SAMPLES
from friction_ocp.recording.probe import probed
from friction_ocp.recording.recording import Channel, FloatArray, Recording
from friction_ocp.recording.result_series import RecordingSeries, datasets_of, series_of
from friction_ocp.recording.static_points import COLUMNS, StaticPoints
from friction_ocp.whole_file import whole_file

h5py: Any = _h5py  # its own types are incomplete

RECORDING_FORMAT = "friction-ocp-recording/1"
STATIC_FORMAT = "friction-ocp-static/1"
SERIES_FORMAT = "friction-ocp-series/1"
_DAMAGE = (KeyError, OSError, RuntimeError, ValueError, TypeError, OverflowError, MemoryError)
"""What h5py raises about damaged files."""
_PROVENANCE = ("title", "source", "licence")
_ASSUMED_UNITS = {"direction": "1", "runs": "1"}


@probed
def read_recording(path: str | Path) -> Recording:
    """Read a recording into SI units; raises FrictionOcpError with everything that is wrong with the file."""
    return _read_recording(path)


@probed
def read_static_points(path: str | Path) -> StaticPoints:
    """Read static points into SI units; raises FrictionOcpError with everything that is wrong with the file."""
    return _read_static_points(path)


def _read_recording(path: str | Path) -> Recording:
    path = Path(path)
    channels: dict[str, Channel] = {}
    with _reading(path, RECORDING_FORMAT) as reader:
        names = reader.children("/channels")
        clock_of = {name: reader.clock(name) for name in names}
        times = {clock: reader.time(clock) for clock in dict.fromkeys(clock_of.values() if names else ["time"])}
        for name, clock in clock_of.items():
            time, found = times[clock], reader.quantity(f"/channels/{name}", f"channel '{name}'")
            if found is not None and time is not None:
                channels[name] = Channel(name, time, *found, clock=clock)
            elif found is not None:
                reader.findings += check_values(reader.where, f"channel '{name}'", found[0], found[0].size)
        recording = Recording(path.stem, channels, **reader.provenance())
        if channels or not names:
            reader.findings += check_recording(recording, reader.where)
    return recording


def write_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording whole or not at all; raises FrictionOcpError if it could not be read again."""
    _raise(check_recording(recording, str(path)) + check_written_names(recording, str(path)))
    with _writing(Path(path), RECORDING_FORMAT) as file:
        _write_provenance(file, recording)
        file.create_group("channels", track_order=True)
        for name, channel in recording.channels.items():
            attributes = {"unit": channel.unit}
            clock_path = "/time" if channel.clock == "time" else f"/clocks/{channel.clock}"
            if channel.clock != "time":
                attributes["clock"] = clock_path
            if clock_path not in file:
                _write_dataset(file, clock_path, channel.time, {"unit": "s"})
            _write_dataset(file, f"/channels/{name}", channel.values, attributes)


def _read_static_points(path: str | Path) -> StaticPoints:
    path = Path(path)
    with _reading(path, STATIC_FORMAT) as reader:
        columns: dict[str, FloatArray] = {}
        units: dict[str, str] = {}
        for name in COLUMNS:
            found = None
            if reader.node(f"/{name}") is not None:
                found = reader.quantity(f"/{name}", f"/{name}", _ASSUMED_UNITS.get(name, ""))
            elif name == "speed":
                reader.report("there is no /speed")
            if found is not None:
                columns[name], units[name] = found
        speed = columns.pop("speed", np.empty(0))
        points = StaticPoints(path.stem, speed, units, **columns, **reader.provenance())
        if not reader.findings:
            reader.findings += check_static_points(points, reader.where)
    return points


@probed
def read_either(path: str | Path) -> Recording | StaticPoints:
    """Read a recording, or static points where the file says that it holds them."""
    return _read_static_points(path) if is_static_points(path) else _read_recording(path)


def is_static_points(path: str | Path) -> bool:
    """Return whether a file says that it holds static points; False also where it cannot be read."""
    if not Path(path).is_file():  # reading a pipe would wait for ever
        return False
    try:
        with h5py.File(path, "r") as file:
            stated = file.attrs.get("format", "")
    except _DAMAGE:
        return False
    return str(stated.decode() if isinstance(stated, bytes) else stated) == STATIC_FORMAT


def write_static_points(points: StaticPoints, path: str | Path) -> None:
    """Write static points whole or not at all."""
    _raise(check_static_points(points, str(path)) + check_attributes(points.attributes, str(path)))
    with _writing(Path(path), STATIC_FORMAT) as file:
        _write_provenance(file, points)
        for name, values in points.columns.items():
            _write_dataset(file, f"/{name}", values, {"unit": points.units[name]})


def write_result_series(path: str | Path, series: Mapping[str, RecordingSeries]) -> None:
    """Write measured and simulated channels and estimated states by recording, whole or not at all."""
    _raise(check_series(series, str(path)))
    with _writing(Path(path), SERIES_FORMAT) as file:
        for names, (values, unit) in datasets_of(series).items():
            _write_dataset(file, "/".join(names), values, {"unit": unit})


@probed
def read_result_series(path: str | Path) -> dict[str, RecordingSeries]:
    """Read back what `write_result_series` wrote."""
    with _reading(Path(path), SERIES_FORMAT) as reader:
        datasets: dict[tuple[str, str, str], tuple[FloatArray, str]] = {}
        for recording in reader.children("/"):
            for name in reader.children(f"/{recording}"):
                for column in reader.children(f"/{recording}/{name}"):
                    dataset = f"/{recording}/{name}/{column}"
                    values = reader.array(dataset, dataset)
                    if values is not None:
                        datasets[recording, name, column] = (values, reader.text(reader.node(dataset), "unit"))
        series, findings = series_of(datasets, reader.where)
        reader.findings += findings
    return series


class _Provenance(TypedDict):
    title: str
    source: str
    licence: str
    path: Path
    sha256: str
    attributes: Mapping[str, str]


@dataclass
class _Reader:
    """Looks into an open file: every fault becomes a finding, and nothing outside the file is opened."""

    file: Any
    where: str
    findings: list[Finding] = field(default_factory=list[Finding])

    def report(self, what: str, allowed: str = "", remedy: str = "") -> None:
        self.findings.append(Finding(self.where, what, allowed, remedy))

    def node(self, path: str, links: int = 0) -> Any:
        """Return what stands at an absolute path, or None; links are followed inside the file only."""
        node: Any = self.file
        parts = [part for part in path.split("/") if part not in ("", ".")]
        for index, part in enumerate(parts):
            link: Any = node.get(part, getlink=True) if isinstance(node, h5py.Group) else None
            if link is None:
                return None
            if isinstance(link, h5py.ExternalLink) or links > 20:
                self.report(f"{path} is a link out of the file or in a circle", "data inside the file", "copy it there")
                return None
            if isinstance(link, h5py.SoftLink):
                target = link.path if link.path.startswith("/") else "/".join([*parts[:index], link.path])
                return self.node("/".join([target, *parts[index + 1 :]]), links + 1)
            node = node[part]
        return node

    def children(self, path: str) -> list[str]:
        """Return the names in a group, in the order in which they were written."""
        group = self.node(path)
        if isinstance(group, h5py.Group):
            return [str(name) for name in group]
        if group is not None:
            self.report(f"{path} is not a group")
        return []

    def text(self, node: Any, key: str) -> str:
        """Return an attribute as text, "" where there is none."""
        return attribute_text(node.attrs.get(key, ""))

    def array(self, path: str, label: str) -> FloatArray | None:
        """Return a one-dimensional numeric dataset, or report why it cannot be had."""
        node = self.node(path)
        count = len(self.findings)
        if not isinstance(node, h5py.Dataset):
            self.report(f"{label} is not a dataset" if node else f"there is no {path}")
        elif node.is_virtual or node.external:
            self.report(f"{label} keeps its data in other files", "data inside the file", "copy it there")
        elif node.dtype.kind not in "fiub":
            self.report(f"{label} is not numeric but {node.dtype}", "real numbers, NaN where a sample is missing")
        elif len(node.shape or ()) != 1:
            self.report(f"{label} has the shape {node.shape}", "one value per sample")
        elif node.size > MAX_SAMPLES:
            self.report(f"{label} declares {node.size} samples", f"at most {MAX_SAMPLES}", "split the recording")
        if len(self.findings) > count:
            return None
        try:
            return np.asarray(node[()], dtype=np.float64)
        except (OSError, RuntimeError) as error:
            self.report(f"{label} cannot be read ({error})", remedy="the file is damaged; copy it again")
            return None

    def quantity(self, path: str, label: str, assumed_unit: str = "") -> tuple[FloatArray, str] | None:
        """Return values in SI and their unit, or report why they cannot be had."""
        values, node = self.array(path, label), self.node(path)
        if values is None:
            return None
        unit = self.text(node, "unit") or assumed_unit
        if not unit:
            self.report(f"{label} has no unit", "an attribute unit such as rad or A", "set it")
            return None
        try:
            return to_si(values, unit, f"{self.where}: {label}", scale=self.text(node, "scale") or None)
        except FrictionOcpError as error:
            self.findings += error.findings
            return None

    def clock(self, channel: str) -> str:
        """Return the name of the time axis of a channel."""
        node = self.node(f"/channels/{channel}")
        path = self.text(node, "clock") if node is not None else ""
        if path and path != "/time" and not path.startswith("/clocks/"):
            self.report(f"channel '{channel}' has the clock '{path}'", "/clocks/<name>")
        return path.removeprefix("/clocks/").strip("/") or "time"

    def time(self, clock: str) -> FloatArray | None:
        """Return a time axis in s."""
        label = "time" if clock == "time" else f"clock '{clock}'"
        found = self.quantity("/time" if clock == "time" else f"/clocks/{clock}", label, "s")
        if found is not None and found[1] != "s":
            self.report(f"{label} is in {found[1]}", "a unit of time, such as s or ms")
        return None if found is None else found[0]

    def provenance(self) -> _Provenance:
        """Return title, source, licence, every further attribute, and the fingerprint of the file."""
        with Path(self.where).open("rb") as file:
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        texts = {str(key): self.text(self.file, key) for key in self.file.attrs if key != "format"}
        title, source, licence = (texts.pop(key, "") for key in _PROVENANCE)
        return _Provenance(
            title=title, source=source, licence=licence, path=Path(self.where), sha256=sha256, attributes=texts
        )


@contextmanager
def _reading(path: Path, expected: str) -> Generator[_Reader]:
    """Open a file of one format; raises every finding at the end."""
    where = str(path)
    if not path.is_file():
        raise FrictionOcpError(Finding(where, "there is no such file", remedy="correct the path"))
    if not h5py.is_hdf5(path):
        remedy = "friction-ocp import turns other formats into one"
        raise FrictionOcpError(Finding(where, "this is not an HDF5 file", f"a file of format {expected}", remedy))
    try:
        file: Any = h5py.File(path, "r")
    except OSError as error:
        what = f"the file cannot be opened ({error})"
        raise FrictionOcpError(Finding(where, what, remedy="it may be damaged; copy it again")) from error
    with file:
        reader = _Reader(file, where)
        try:
            found = reader.text(file, "format")
            if found != expected:
                what = f"attribute format is '{found}'" if found else "there is no attribute format"
                reader.report(what, f"'{expected}' is read here")
            yield reader
        except FrictionOcpError:
            raise
        except _DAMAGE as error:
            what = f"the file cannot be read ({' '.join(str(error).split())})"
            raise FrictionOcpError(Finding(where, what, remedy="it is damaged; copy it again")) from error
    _raise(reader.findings)


@contextmanager
def _writing(path: Path, format_name: str) -> Generator[Any]:
    """Open a file under a temporary name, which becomes `path` once everything is written."""
    with whole_file(path) as staged, h5py.File(staged, "w", track_order=True) as file:
        file.attrs["format"] = format_name
        yield file


def _write_dataset(file: Any, path: str, values: FloatArray, attributes: Mapping[str, str]) -> None:
    compression = {"compression": "gzip", "shuffle": True} if values.size else {}
    dataset = file.create_dataset(path, data=np.asarray(values, dtype=np.float64), **compression)
    dataset.attrs.update(attributes)


def _write_provenance(file: Any, content: Recording | StaticPoints) -> None:
    file.attrs.update({key: getattr(content, key) for key in _PROVENANCE})
    file.attrs.update(dict(content.attributes))


def _raise(findings: list[Finding]) -> None:
    if findings:
        raise FrictionOcpError(findings)
