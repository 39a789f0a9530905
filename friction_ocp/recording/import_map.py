"""The map of an import: which column is which channel, and in what unit; the only place here that reads YAML."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import yaml

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.quantities import dimension_of, to_si
from friction_ocp.recording.static_points import COLUMNS

MAX_CHARACTERS = 500_000
MAX_BRACKETS = 20
MAP_FORMAT = "friction-ocp-map/1"
_TEXTS = ("title", "source", "licence", "delimiter", "decimal")
_KEYS = ("format", "time", "channels", "points", *_TEXTS)
_STEP_KEYS = {"step": ("time", "a time, such as 1 ms"), "rate": ("frequency", "a frequency, such as 1000 Hz")}
_COLUMN_KEYS = ("column", "unit", "scale", "wrap", "reset", "instead_of")
_CHANNEL_KEYS = (*_COLUMN_KEYS, "held", "low_pass", "time")
_NUMBERS = ("wrap", "reset", "held", "low_pass")
_POSITIVE = {"wrap": "65536 or 360", "low_pass": "0.01 s"}


@dataclass(frozen=True)
class Column:
    """One column of a table and its unit."""

    column: str | int
    """Its header, or its index from 0."""
    unit: str = ""
    """"" takes the unit that the file states."""
    scale: str | None = None
    """What one count is, such as "2*pi/4096 rad"; the unit is "counts" then, stated or not."""
    wrap: float | None = None
    """How much a counter loses when it starts over, in the numbers of the column."""
    reset: float | None = None
    """The value to which a counter is set, in the numbers of the column."""
    instead_of: str = ""
    """The unit that the file states, where `unit` is to be taken instead."""
    held: float | None = None
    """How many times each value is repeated until the next one comes; the repeats become missing samples."""
    low_pass: float | None = None
    """Time constant, s, of the first-order filter through which the logger reports it; it is undone."""
    time: Column | None = None
    """The times of this channel alone."""


@dataclass(frozen=True)
class ImportMap:
    """How the columns of a table become the channels of a recording."""

    time: Column | None
    """The times of all channels; None takes the time axes that the file itself has."""
    channels: Mapping[str, Column]
    step: float | None = None
    """s between the rows of a file without times, the first being at 0."""
    title: str = ""
    source: str = ""
    licence: str = ""
    delimiter: str | None = None
    """Sniffed when None; " " is any run of spaces and tabs."""
    decimal: str | None = None
    """A point when None; once it is stated, the other one of point and comma groups thousands."""
    points: Mapping[str, Column] = field(default_factory=dict[str, Column])
    """Columns of static points, in place of channels."""
    where: str = "map"
    """The file of the map, for findings."""


def load_import_map(path: str | Path) -> ImportMap:
    """Read a map from YAML; raises FrictionOcpError with everything that is wrong with it."""
    where = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
        _refuse_monsters(text, where)
        loader: Any = yaml.SafeLoader(text)
        node = loader.get_single_node()
        _refuse_repeated_keys(node, where)
        content: object = None if node is None else loader.construct_document(node)
    except FileNotFoundError as error:
        raise FrictionOcpError(Finding(where, "there is no such map", remedy="correct the path")) from error
    except RecursionError as error:
        raise FrictionOcpError(Finding(where, "this is nested too deeply")) from error
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise FrictionOcpError(Finding(where, f"this is not YAML ({' '.join(str(error).split())})")) from error
    except (ValueError, KeyError, AttributeError, OverflowError) as error:
        what = "a value is not what its tag says, or no possible date"
        raise FrictionOcpError(Finding(where, what, remedy="leave tags out, or quote the value")) from error
    reader = _MapReader(where)
    result = reader.read(content)
    if result is None or reader.findings:
        raise FrictionOcpError(reader.findings)
    return result


def _refuse_monsters(text: str, where: str) -> None:
    """Refuse what would keep the parser busy for long: maps are short and flat."""
    if len(text) > MAX_CHARACTERS:
        raise FrictionOcpError(Finding(where, f"the map has {len(text)} characters", f"at most {MAX_CHARACTERS}"))
    if re.search(r"[\[{]\s*" * MAX_BRACKETS, text):
        raise FrictionOcpError(Finding(where, "this is nested too deeply"))


def _refuse_repeated_keys(root: yaml.Node | None, where: str) -> None:
    """Refuse keys that stand twice in a mapping: YAML would keep the last of them alone."""
    mappings = () if root is None else mapping_nodes(root)
    findings = [item for node in mappings for item in repeated_keys([key for key, _ in node.value], where)]
    if findings:
        raise FrictionOcpError(findings)


def mapping_nodes(root: yaml.Node) -> Iterator[yaml.MappingNode]:
    """Yield every mapping of a document once, outer ones before those in them."""
    seen: set[int] = set()
    todo = [root]
    while todo:
        node = todo.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        todo += reversed(children(node))
        if isinstance(node, yaml.MappingNode):
            yield node


def children(node: yaml.Node) -> list[yaml.Node]:
    """Return the keys and values of a mapping in their order, or the items of a list."""
    if isinstance(node, yaml.MappingNode):
        return [item for pair in node.value for item in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def repeated_keys(keys: Sequence[yaml.Node], where: str) -> list[Finding]:
    """Return a finding for every key of a mapping that stands there before."""
    findings: list[Finding] = []
    first_line: dict[str, int] = {}
    for key in keys:
        name, line = str(key.value), key.start_mark.line + 1
        if name in first_line:
            what = f"key '{name}' stands here again, first in line {first_line[name]}"
            findings.append(Finding(f"{where}: line {line}", what, remedy="keep one of them"))
        first_line.setdefault(name, line)
    return findings


@dataclass
class _MapReader:
    where: str
    findings: list[Finding] = field(default_factory=list[Finding])

    def report(self, place: str, what: str, allowed: str = "", remedy: str = "") -> None:
        where = f"{self.where}: {place}" if place else self.where
        self.findings.append(Finding(where, what, allowed, remedy))

    def read(self, content: object) -> ImportMap | None:
        keys = self.mapping("", content, _KEYS)
        if keys is None:
            return None
        if keys.get("format") != MAP_FORMAT:
            self.report("format", f"format is '{keys.get('format', '')}'", f"'{MAP_FORMAT}' is read here")
        texts = {key: self.text(key, keys[key]) for key in _TEXTS if key in keys}
        if len(texts.get("delimiter", ",")) != 1:
            what = f"the delimiter is {texts['delimiter']!r}"
            self.report("delimiter", what, "one character; ' ' is any spaces and tabs", "leave it out to have it found")
        if texts.get("decimal", ".") not in (".", ","):
            self.report("decimal", f"unknown decimal sign '{texts['decimal']}'", "available: '.', ','")
        step = self.step(keys.get("time"))
        time = self.time("time", keys["time"]) if "time" in keys and step is None else None
        points = self.points(keys["points"]) if "points" in keys else {}
        if points and ("time" in keys or "channels" in keys):
            self.report("points", "static points have no times and no channels", "", "leave time and channels out")
        channels = {} if "points" in keys else self.channels(keys.get("channels"))
        if not channels and not points:
            return None
        return ImportMap(time, channels, step, points=points, where=self.where, **cast(dict[str, Any], texts))

    def step(self, content: object) -> float | None:
        """Return the s between rows that are stated in place of a column of times, as `step` or as `rate`."""
        stated = cast(dict[object, object], content) if isinstance(content, dict) else {}
        for key, (kind, allowed) in _STEP_KEYS.items():
            if key not in stated:
                continue
            place, text = f"time.{key}", self.text(f"time.{key}", stated[key])
            for other in stated.keys() - {key}:
                self.report("time", f"'{other}' stands beside {key}", f"{key} alone, or a column of times")
            try:
                size, unit = to_si(1.0, "counts", f"{self.where}: {place}", scale=text)
                if dimension_of(unit) == kind and float(size) > 0.0:
                    return float(size) if key == "step" else 1.0 / float(size)
                self.report(place, f"{key} is {text!r}", allowed)
            except FrictionOcpError as error:
                self.findings += error.findings
            return 1.0
        return None

    def points(self, content: object) -> dict[str, Column]:
        found = self.mapping("points", content, COLUMNS) or {}
        columns: dict[str, Column] = {}
        for name, entry in found.items():
            column = self.column(f"points.{name}", entry, _COLUMN_KEYS) if name in COLUMNS else None
            if column is not None:
                self.dimension(f"points.{name}", column)
                columns[name] = column
        if "speed" not in found:
            self.report("points", "there is no speed", "speed: {column, unit}, with torque or current")
        return columns

    def channels(self, content: object) -> dict[str, Column]:
        found = self.mapping("channels", content)
        if found == {}:
            self.report("channels", "there are no channels", "name: {column, unit}")
        channels: dict[str, Column] = {}
        for name, entry in (found or {}).items():
            if "/" in name:
                self.report(f"channels.{name}", "the name has a slash", "text without a slash", "rename it")
            column = self.column(f"channels.{name}", entry, _CHANNEL_KEYS)
            if column is not None:
                self.dimension(f"channels.{name}", column)
                channels[name] = column
        return channels

    def time(self, place: str, content: object) -> Column | None:
        time = self.column(place, content, _COLUMN_KEYS)
        if time is not None and self.dimension(place, time) not in ("time", None):
            self.report(place, f"unit '{time.unit}' does not measure time", "a unit such as s, ms or us")
        return time

    def column(self, place: str, content: object, known: tuple[str, ...]) -> Column | None:
        keys = self.mapping(place, content, known)
        if keys is None:
            return None
        if "column" not in keys:
            self.report(place, "there is no column", "{column, unit}")
            return None
        name = keys["column"]
        if isinstance(name, bool) or not isinstance(name, str | int) or name == "" or str(name).startswith("-"):
            self.report(f"{place}.column", f"column is {name!r}", "a header, or an index from 0")
            return None
        texts = {key: self.text(f"{place}.{key}", keys[key]) for key in ("unit", "scale", "instead_of") if key in keys}
        numbers = {key: self.number(f"{place}.{key}", keys[key]) for key in _NUMBERS if key in keys}
        for key, example in _POSITIVE.items():
            if numbers.get(key) is not None and not cast(float, numbers[key]) > 0.0:
                self.report(f"{place}.{key}", f"{key} is {keys[key]!r}", f"a number above 0, such as {example}")
        held = numbers.get("held")
        if held is not None and not (held >= 2.0 and held.is_integer()):
            self.report(f"{place}.held", f"held is {keys['held']!r}", "a whole number of samples from 2 on, such as 10")
        if "scale" in texts:
            texts.setdefault("unit", "counts")
        time = self.time(f"{place}.time", keys["time"]) if "time" in keys else None
        return Column(name, **cast(dict[str, Any], texts | numbers), time=time)

    def number(self, place: str, content: object) -> float | None:
        with suppress(OverflowError):
            if isinstance(content, int | float) and not isinstance(content, bool) and math.isfinite(content):
                return float(content)
        self.report(place, f"this is {_kind(content)}", "a number")
        return None

    def dimension(self, place: str, column: Column) -> str | None:
        if not column.unit:
            return None
        try:
            return dimension_of(to_si((), column.unit, f"{self.where}: {place}", scale=column.scale)[1])
        except FrictionOcpError as error:
            self.findings += error.findings
            return None

    def text(self, place: str, content: object) -> str:
        if isinstance(content, bool) or not isinstance(content, str | int | float):
            self.report(place, f"this is {_kind(content)}", "text")
            return ""
        return str(content)

    def mapping(self, place: str, content: object, keys: tuple[str, ...] = ()) -> dict[str, object] | None:
        if not isinstance(content, dict):
            what = "there is nothing" if content is None else f"this is {_kind(content)}"
            self.report(place, what, f"a mapping of {', '.join(keys)}" if keys else "a mapping")
            return None
        found = {str(key): value for key, value in cast(dict[object, object], content).items()}
        for key in found.keys() - set(keys) if keys else ():
            self.report(place, f"unknown key '{key}'", f"available: {', '.join(keys)}")
        return found


def _kind(content: object) -> str:
    kinds: dict[type, str] = {list: "a list", dict: "a mapping", type(None): "empty", str: "text"}
    return kinds.get(type(content), repr(content))
