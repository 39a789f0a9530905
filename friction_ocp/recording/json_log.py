"""JSON logs: lists of numbers, lists of records, objects of number over number; one document, or one a line."""

from __future__ import annotations

import json
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.foreign import ForeignFile, Values, free_memory, reading
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.in_memory import in_memory

KIND = "JSON"
MAX_DEPTH = 20
BYTES_PER_BYTE = 40
"""Memory that a byte of text takes while it is read, at most: small numbers in objects of their own."""
MAX_FACTS = 12
LINES = (".jsonl", ".ndjson")


@contextmanager
def open_json(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the series of a JSON file; parts of a name are joined by dots, and single values are told beside them."""
    _refuse_too_large(path)
    with reading(path, KIND):
        found = _Found()
        found.collect("", _content(path), 0)
    yield in_memory(found.series, found.summary)


def _refuse_too_large(path: Path) -> None:
    needed, free = BYTES_PER_BYTE * path.stat().st_size, free_memory()
    if needed > free:
        what = f"reading it may take {needed / 1e9:.3g} GB of memory, {free / 1e9:.3g} GB are free"
        raise FrictionOcpError(Finding(str(path), what, remedy="split the file, or export it as CSV"))


def _content(path: Path) -> Any:
    text = path.read_text(encoding="utf-8-sig")
    if path.suffix.lower() in LINES:
        return _of_lines(text)
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        if error.msg != "Extra data":
            raise
        return _of_lines(text)


def _of_lines(text: str) -> list[Any]:
    return [json.loads(line) for line in text.splitlines() if line.strip()]


@dataclass
class _Found:
    """What a document holds."""

    series: dict[str, Values] = field(default_factory=dict[str, Values])
    facts: dict[str, str] = field(default_factory=dict[str, str])
    """Single values, such as the mass of what was moved."""

    @property
    def summary(self) -> str:
        if not self.facts:
            return KIND
        shown = [f"{name} = {value}" for name, value in list(self.facts.items())[:MAX_FACTS]]
        more = len(self.facts) - len(shown)
        return f"{KIND}; beside them {', '.join(shown)}" + (f", and {more} more" if more else "")

    def collect(self, name: str, content: Any, depth: int) -> None:
        """Take in what stands under a name."""
        if depth > MAX_DEPTH:
            return
        if isinstance(content, dict):
            self._object(name, cast(dict[str, Any], content), depth)
        elif isinstance(content, list) and content:
            self._list(name, cast(list[Any], content))
        elif name and isinstance(content, int | float | str):
            self.facts[name] = f"{content:.6g}" if isinstance(content, float) else str(content)[:40]

    def _object(self, name: str, content: Mapping[str, Any], depth: int) -> None:
        pairs = [(_number(key), value) for key, value in content.items()]
        if len(pairs) > 1 and all(key is not None and _is_number(value) for key, value in pairs):
            self.series[_joined(name, "key")] = np.array([key for key, _ in pairs], dtype=np.float64)
            self.series[_joined(name, "value")] = _array([value for _, value in pairs])
            return
        for key, value in content.items():
            self.collect(_joined(name, key), value, depth + 1)

    def _list(self, name: str, content: list[Any]) -> None:
        if not any(isinstance(item, dict | list) for item in content):
            self.series[name or "value"] = _array(content)
            return
        rows = [dict(_flat("", item, 0)) for item in content]
        for key in dict.fromkeys(key for row in rows for key in row):
            self.series[_joined(name, key) if not key.startswith("[") else name + key] = _array(
                [row.get(key) for row in rows]
            )


def _flat(name: str, content: Any, depth: int) -> Iterator[tuple[str, Any]]:
    """Yield the single values of one record by name: `imu.rate`, `joints[2]`."""
    if depth > MAX_DEPTH:
        return
    if isinstance(content, dict):
        for key, value in cast(dict[str, Any], content).items():
            yield from _flat(_joined(name, key), value, depth + 1)
    elif isinstance(content, list):
        for index, value in enumerate(cast(list[Any], content)):
            yield from _flat(f"{name}[{index}]", value, depth + 1)
    else:
        yield name or "value", content


def _joined(name: str, key: str) -> str:
    return f"{name}.{key}" if name else key


def _is_number(value: Any) -> bool:
    return value is None or isinstance(value, int | float)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _array(values: Sequence[Any]) -> Values:
    """Return numbers, integers as they are unless one is missing (NaN then); texts where there is anything else."""
    if not all(map(_is_number, values)):
        return np.array([str(value)[:40] for value in values])
    if all(isinstance(value, int) and abs(value) < 2**63 for value in values):
        return np.array(values, dtype=np.int64)
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
