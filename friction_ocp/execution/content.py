"""Fingerprints of values: equal content, equal text, on any machine and in any process."""

from __future__ import annotations

import dataclasses
import hashlib
import types
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np

_PACKAGE = Path(__file__).parents[1]


def fingerprint(*values: Any) -> str:
    """Return a SHA-256 over the content of values: numbers, text, arrays, containers and dataclasses of these.

    Raises TypeError for anything else, whose content it could only guess.
    """
    digest = hashlib.sha256()
    for piece in _pieces(values):
        digest.update(piece)
    return digest.hexdigest()


@cache
def toolkit_fingerprint() -> str:
    """Return the fingerprint of this package's own code: results of other code are not reused."""
    sources = sorted(path for ending in ("py", "c") for path in _PACKAGE.rglob(f"*.{ending}"))
    return fingerprint([(path.relative_to(_PACKAGE).as_posix(), path.read_bytes()) for path in sources])


def _pieces(value: Any) -> Iterator[bytes]:
    if value is None or isinstance(value, (bool, int, float, str, np.generic)):
        # np.generic first becomes a plain number, so that 1.0 is 1.0 whoever made it
        plain: Any = cast("Any", value).item() if isinstance(value, np.generic) else value
        yield f"{type(plain).__name__}:{plain!r};".encode()
    elif isinstance(value, bytes):
        yield b"bytes:%d:" % len(value) + value
    elif isinstance(value, np.ndarray):
        array = np.ascontiguousarray(cast("Any", value))
        yield f"array:{array.dtype.str}:{array.shape}:".encode() + array.tobytes()
    elif isinstance(value, Mapping):
        items = cast("Mapping[Any, Any]", value)
        yield from _listed("map", [(key, items[key]) for key in sorted(items, key=repr)])
    elif isinstance(value, (list, tuple)):
        yield from _listed("list", cast("list[Any]", value))
    elif isinstance(value, (type, types.FunctionType)):
        yield f"name:{value.__module__}.{value.__qualname__};".encode()
    elif dataclasses.is_dataclass(value):
        yield from _pieces(type(value))
        yield from _listed("fields", [(item.name, getattr(value, item.name)) for item in dataclasses.fields(value)])
    else:
        raise TypeError(f"no fingerprint for {type(value).__qualname__}")


def _listed(kind: str, items: list[Any] | tuple[Any, ...]) -> Iterator[bytes]:
    yield f"{kind}:{len(items)}[".encode()
    for item in items:
        yield from _pieces(item)
    yield b"]"
