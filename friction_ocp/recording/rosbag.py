"""ROS 2 bags (SQLite and MCAP) and ROS 1 bags: fields of messages over the stamps of their headers."""

from __future__ import annotations

import importlib
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.foreign import (
    MAX_SAMPLES,
    ForeignFile,
    Library,
    Signal,
    Values,
    free_memory,
    instant,
    opened,
    seconds_since,
)
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.recording import FloatArray

KIND = "a ROS bag"
LIBRARY = Library("rosbags.highlevel", "rosbags", "ros")
MAX_FIELDS = 200
"""Numbers of one message that are listed; images and point clouds have more and are left out."""
RECEIVED, STAMP = "received", "header.stamp"


@dataclass
class _Topic:
    """The numbers of the messages of one topic, as far as they have been read."""

    columns: dict[str, list[float]] = field(default_factory=dict[str, list[float]])
    received: list[int] = field(default_factory=list[int])
    stamped: list[int] = field(default_factory=list[int])

    @property
    def times(self) -> Values:
        """ns at which messages were stamped, where all of them were, else received."""
        stamped = len(self.stamped) == len(self.received) and all(self.stamped)
        return np.asarray(self.stamped if stamped else self.received, dtype=np.int64)

    def add(self, message: Any, received: int) -> None:
        """Take the numbers of a message; what it lacks or has in excess of those before is NaN there."""
        seen = len(self.received)
        self.received.append(received)
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        if stamp is not None:
            self.stamped.append(int(stamp.sec) * 10**9 + int(stamp.nanosec))
        for name, number in _numbers(message, "", 0):
            column = self.columns.get(name)
            if column is None and len(self.columns) < MAX_FIELDS:
                column = self.columns[name] = [np.nan] * seen
            if column is not None:
                column.append(number)
        for column in self.columns.values():
            column += [np.nan] * (seen + 1 - len(column))


@contextmanager
def open_rosbag(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the numbers of all topics as `/topic.field`; elements of arrays as `/topic.field[0]`, or by their `name`."""
    highlevel: Any = LIBRARY.load(path)
    typesys: Any = importlib.import_module("rosbags.typesys")
    known = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with opened(path, KIND, lambda: highlevel.AnyReader([path], default_typestore=known)) as bag:
        _refuse_too_many(path, int(bag.message_count))
        topics = _read_topics(bag)
    origin = min((int(topic.times[0]) for topic in topics.values() if topic.received), default=0)
    columns = [(topic, name) for topic, content in topics.items() for name in content.columns]
    signals = [Signal(f"{topic}.{name}", len(topics[topic].received), clock=topic) for topic, name in columns]
    signals += [Signal(f"{topic}.{RECEIVED}", len(content.received), "s", topic) for topic, content in topics.items()]

    def read(wanted: Sequence[int]) -> Mapping[int, Values]:
        return {k: column(k) for k in wanted}

    def column(k: int) -> FloatArray:
        if k < len(columns):
            topic, name = columns[k]
            return np.asarray(topics[topic].columns[name], dtype=np.float64)
        received = np.asarray(list(topics.values())[k - len(columns)].received, dtype=np.int64)
        return seconds_since(received, origin)

    def clock(name: str) -> FloatArray:
        return seconds_since(topics[name].times, origin)

    yield ForeignFile(tuple(signals), read, clock, _summary(topics), instant(origin))


def _summary(topics: Mapping[str, _Topic]) -> str:
    stamped = [name for name, topic in topics.items() if topic.stamped and all(topic.stamped)]
    return f"{len(topics)} topics" + (f", times from {STAMP} in {', '.join(stamped)}" if stamped else "")


def _refuse_too_many(path: Path, messages: int) -> None:
    if messages > min(MAX_SAMPLES, free_memory() // 2000):
        what = f"the bag declares {messages} messages"
        raise FrictionOcpError(Finding(str(path), what, "fewer, or more free memory", "split the bag"))


def _read_topics(bag: Any) -> dict[str, _Topic]:
    """Read all messages that can be understood."""
    topics: dict[str, _Topic] = {}
    for connection, received, raw in bag.messages():
        message = bag.deserialize(raw, connection.msgtype)
        topics.setdefault(str(connection.topic), _Topic()).add(message, int(received))
    return {name: topic for name, topic in topics.items() if topic.columns}


def _numbers(value: Any, name: str, depth: int) -> Iterator[tuple[str, float]]:
    """Yield the numbers in a message and the paths that name them; the header's stamp is a time axis, not a number."""
    fields = getattr(value, "__dataclass_fields__", None)
    if fields is not None and depth < 20:
        labels = _labels(value)
        for key in fields:
            if key in ("__msgtype__", "header"):
                continue
            inner = getattr(value, key)
            path = f"{name}.{key}" if name else key
            yield from _elements(inner, path, labels) if _is_list(inner) else _numbers(inner, path, depth + 1)
    elif isinstance(value, bool | int | float | np.number):
        yield name, float(cast(float, value))


def _is_list(value: Any) -> bool:
    return isinstance(value, list | np.ndarray)


def _labels(message: Any) -> Sequence[str]:
    """Return the names that a message such as JointState or DynamicJointState gives to the elements of its arrays."""
    for key in ("name", "joint_names"):
        names = getattr(message, key, None)
        if isinstance(names, list) and all(isinstance(item, str) for item in cast(list[Any], names)):
            return cast(list[str], names)
    return ()


def _elements(values: Any, path: str, labels: Sequence[str]) -> Iterator[tuple[str, float]]:
    if len(values) > MAX_FIELDS:
        return
    names = labels if len(labels) == len(values) else [str(k) for k in range(len(values))]
    for name, item in zip(names, values, strict=True):
        yield from _numbers(item, f"{path}[{name}]", 1)
