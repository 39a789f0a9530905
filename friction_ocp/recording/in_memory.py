"""Files without time axes that have been read whole."""

from __future__ import annotations

from collections.abc import Mapping

from friction_ocp.recording.foreign import ForeignFile, Signal, Values, instant, is_real, no_clock
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.stamps import as_seconds


def in_memory(columns: Mapping[str, Values], summary: str, units: Mapping[str, str] = {}) -> ForeignFile:
    """Return such a file, and columns of dates as s since the earliest of the first; a name may state the unit, too."""
    found, dates, origin = as_seconds(columns)
    names = tuple(found)
    signals = tuple(
        _signal(name, values, "s" if name in dates else units.get(name) or header_unit(name))
        for name, values in found.items()
    )
    return ForeignFile(signals, lambda wanted: {k: found[names[k]] for k in wanted}, no_clock, summary, instant(origin))


def _signal(name: str, values: Values, unit: str) -> Signal:
    text = str(values[0]) if values.dtype.kind == "U" and values.size == 1 else ""
    return Signal(name, len(values), unit, numeric=is_real(values), text=text)
