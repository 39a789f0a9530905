"""Files without time axes that have been read whole."""

from __future__ import annotations

from collections.abc import Mapping

from friction_ocp.recording.foreign import ForeignFile, Signal, Values, instant, is_real, no_clock
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.stamps import as_seconds


def in_memory(columns: Mapping[str, Values], summary: str) -> ForeignFile:
    """Return such a file; a name may state the unit, and columns of dates become s since the earliest of the first."""
    found, dates, origin = as_seconds(columns)
    names = tuple(found)
    signals = tuple(_signal(name, values, name in dates) for name, values in found.items())
    return ForeignFile(signals, lambda wanted: {k: found[names[k]] for k in wanted}, no_clock, summary, instant(origin))


def _signal(name: str, values: Values, is_date: bool) -> Signal:
    text = str(values[0]) if values.dtype.kind == "U" and values.size == 1 else ""
    return Signal(name, len(values), "s" if is_date else header_unit(name), numeric=is_real(values), text=text)
