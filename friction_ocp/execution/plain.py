"""Values as JSON can hold them, to the last bit, and back: arrays, tuples, mappings and dataclasses that are named."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from friction_ocp.execution.task import Json

_KIND = "@"


def plain(value: Any) -> Json:
    """Return a value as JSON; raises TypeError for what `restored` could not give back."""
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, np.generic):
        return plain(cast("Any", value).item())
    if isinstance(value, float):
        return value if math.isfinite(value) else {_KIND: "float", "is": repr(value)}
    if isinstance(value, np.ndarray):
        array = cast("Any", value)
        return {
            _KIND: "array",
            "type": array.dtype.str,
            "shape": list(array.shape),
            "values": plain(array.ravel().tolist()),
        }
    if isinstance(value, list):
        return [plain(item) for item in cast("list[Any]", value)]
    if isinstance(value, tuple):
        return {_KIND: "tuple", "items": [plain(item) for item in cast("tuple[Any, ...]", value)]}
    if isinstance(value, Mapping):
        return {_KIND: "map", "items": [[plain(k), plain(v)] for k, v in cast("Mapping[Any, Any]", value).items()]}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {item.name: plain(getattr(value, item.name)) for item in dataclasses.fields(value)}
        return {_KIND: type(value).__name__, "fields": fields}
    raise TypeError(f"no plain form of {type(value).__qualname__}")


def restored(content: Json, classes: Sequence[type] = ()) -> Any:
    """Return the value that `plain` described; dataclasses are of these classes only."""
    if isinstance(content, list):
        return [restored(item, classes) for item in cast("list[Json]", content)]
    if not isinstance(content, dict):
        return content
    items = cast("dict[str, Any]", content)
    match items[_KIND]:
        case "float":
            return float(items["is"])
        case "array":
            values = restored(items["values"])
            return np.array(values, dtype=np.dtype(items["type"])).reshape(items["shape"])
        case "tuple":
            return tuple(restored(item, classes) for item in items["items"])
        case "map":
            return {restored(key, classes): restored(item, classes) for key, item in items["items"]}
        case name:
            found = next(kind for kind in classes if kind.__name__ == name)
            return found(**{key: restored(item, classes) for key, item in items["fields"].items()})
