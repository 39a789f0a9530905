"""Parameters of a drive: what is fixed, fitted or tied, and the paths that name them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Scope = Literal["shared", "recording"]
Part = TypeVar("Part", bound="DataclassInstance")


@dataclass(frozen=True)
class Free:
    """A fitted parameter: its start, bounds and prior, in SI units."""

    guess: float
    min: float = -math.inf
    max: float = math.inf
    prior_std: float | None = None
    prior_mean: float | None = None
    scope: Scope = "shared"

    @property
    def centre(self) -> float:
        """Mean of the prior: `prior_mean`, else the guess of the file."""
        return self.guess if self.prior_mean is None else self.prior_mean


@dataclass(frozen=True)
class Tie:
    """A parameter computed from others by an arithmetic expression over their paths."""

    expr: str


@dataclass(frozen=True)
class Directional:
    """A friction parameter that differs by the direction of motion."""

    positive: Any
    negative: Any


Value = Any
"""float, Free, Tie or Directional in a drive as read; float or SX in a drive whose values are bound."""


def start_of(value: Value) -> Value:
    """Return where a number starts: itself, or its guess where it is fitted."""
    return value.guess if isinstance(value, Free) else value


def is_off(value: Value) -> bool:
    """Whether a number is plainly zero or absent: known, and neither fitted nor tied."""
    return value is None or (isinstance(value, (int, float)) and value == 0)


def quantity(kind: str, meaning: str, default: Any = dataclasses.MISSING, nested: str | float | None = None) -> Any:
    """Declare a numeric field of a part: `kind` names its unit, `meaning` is its sentence for the reader.

    `nested` says what the number is in the simpler model that is fitted first: the name of the field that it
    equals there, a value, "guess", or, in a list, "first". None: it takes part from the beginning.
    """
    return dataclasses.field(default=default, metadata={"kind": kind, "meaning": meaning, "nested": nested})


@dataclass(frozen=True)
class Leaf:
    """One number of a drive and the path that names it."""

    path: str
    value: Value
    kind: str
    meaning: str
    motion: str = "rotary"
    nested: str | float | None = None
    """Path of the number that it equals in the simpler model fitted first, or its value there, or "guess"."""


def inline() -> Any:
    """Declare a field whose part adds no name of its own to the paths of its numbers."""
    return dataclasses.field(metadata={"inline": True})


def _path(prefix: str, item: dataclasses.Field[Any]) -> str:
    return prefix if item.metadata.get("inline") else f"{prefix}.{item.name}"


def _is_part(value: Any) -> bool:
    return dataclasses.is_dataclass(value) and not isinstance(value, (type, Free, Tie, Directional))


def _split(value: Value, path: str) -> Iterator[tuple[str, Value]]:
    if isinstance(value, Directional):
        yield f"{path}.positive", value.positive
        yield f"{path}.negative", value.negative
    elif isinstance(value, tuple):
        for index, item in enumerate(value):  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
            yield from _split(item, f"{path}.{index}")
    else:
        yield path, value


def leaves(part: Any, prefix: str, motion: str = "rotary") -> Iterator[Leaf]:
    """Yield every number of a part, depth first; absent optional numbers (None) are left out."""
    for item in dataclasses.fields(part):
        value, path = getattr(part, item.name), _path(prefix, item)
        if "kind" in item.metadata:
            for leaf_path, leaf in _split(value, path):
                if leaf is not None and not isinstance(leaf, str):
                    nested = _nested_path(item, path, leaf_path)
                    yield Leaf(leaf_path, leaf, item.metadata["kind"], item.metadata["meaning"], motion, nested)
        else:
            for part_path, inner in _parts(value, path):
                yield from leaves(inner, part_path, motion)


def _parts(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Yield the part or the parts that a field holds, with their paths."""
    items: list[tuple[str, Any]] = [(path, value)]
    if isinstance(value, tuple):
        items = [(f"{path}.{k}", item) for k, item in enumerate(value)]  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    yield from ((name, item) for name, item in items if _is_part(item))


def _nested_path(item: dataclasses.Field[Any], path: str, leaf_path: str) -> str | float | None:
    nested = item.metadata["nested"]
    if nested == "first":
        return None if leaf_path == f"{path}.0" else f"{path}.0"
    if not isinstance(nested, str) or nested == "guess":
        return nested
    return f"{path.removesuffix(item.name)}{nested}{leaf_path.removeprefix(path)}"


def _bound(value: Value, path: str, values: Mapping[str, Any]) -> Any:
    if isinstance(value, Directional):
        return Directional(values[f"{path}.positive"], values[f"{path}.negative"])
    if isinstance(value, tuple):
        return tuple(_bound(item, f"{path}.{k}", values) for k, item in enumerate(value))  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    return values.get(path, value)


def bind(part: Part, prefix: str, values: Mapping[str, Any]) -> Part:
    """Return the part with every number replaced by `values[path]` (floats or SX)."""
    changes: dict[str, Any] = {}
    for item in dataclasses.fields(part):
        value, path = getattr(part, item.name), _path(prefix, item)
        if "kind" in item.metadata:
            changes[item.name] = _bound(value, path, values)
        else:
            inner = [bind(one, name, values) for name, one in _parts(value, path)]
            if inner:
                changes[item.name] = tuple(inner) if isinstance(value, tuple) else inner[0]
    return dataclasses.replace(part, **changes)
