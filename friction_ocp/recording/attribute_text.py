"""Attributes of HDF5 files as text, however the program that wrote them stored it."""

from __future__ import annotations

from typing import Any, cast


def attribute_text(value: Any) -> str:
    """Return an attribute as text; some programs, such as MATLAB and LabVIEW, store an array of one element."""
    plain: Any = value.tolist() if hasattr(value, "tolist") else value
    while isinstance(plain, list) and len(cast("list[Any]", plain)) == 1:
        plain = cast("list[Any]", plain)[0]
    return plain.decode(errors="replace") if isinstance(plain, bytes) else str(cast("object", plain))
