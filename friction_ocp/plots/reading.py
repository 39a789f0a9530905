"""Read parts of a result; what is absent or null is empty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

Json = Mapping[str, Any]


def part(content: Json, key: str) -> Json:
    """Return the object under a key."""
    found = content.get(key)
    return cast("Json", found) if isinstance(found, Mapping) else {}


def objects(content: Json, key: str) -> Mapping[str, Json]:
    """Return the object of objects under a key."""
    found = part(content, key)
    return {name: part(found, name) for name in found}


def rows(content: Json, key: str) -> Sequence[Any]:
    """Return the list under a key."""
    found = content.get(key)
    return cast("Sequence[Any]", found) if isinstance(found, list | tuple) else ()
