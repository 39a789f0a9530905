"""What the page's script draws: plain values, thinned, rounded and safe inside a script element."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from friction_ocp.plots.curves import curve_label
from friction_ocp.plots.numbers import percent, unit_text
from friction_ocp.plots.reading import Json
from friction_ocp.plots.series import ChannelColumns, rounded, traces_of

_ESCAPES = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026"}


def embedded_json(value: Any) -> str:
    """Return JSON that can end no script element and open no comment; what is not finite becomes null."""
    text = json.dumps(_finite(value), ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.translate(_ESCAPES)


def recording_payload(channels: Mapping[str, ChannelColumns], units: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return the traces of one recording."""
    return [
        {
            "name": name,
            "unit": unit_text(units.get(name, "")),
            "time": rounded(trace.time, 7),
            "measured": rounded(trace.measured),
            "simulated": rounded(trace.simulated),
            "residual": rounded(trace.residual, 4),
            "shown": len(trace.time),
            "samples": trace.samples,
        }
        for name, trace in traces_of(channels)
    ]


def friction_payload(curves: Sequence[Json]) -> list[dict[str, Any]]:
    """Return one plot a shaft, in order, with its curves."""
    plots: list[dict[str, Any]] = []
    for shaft in dict.fromkeys(str(curve["shaft"]) for curve in curves):
        own = [curve for curve in curves if str(curve["shaft"]) == shaft]
        first = own[0]
        plots.append(
            {
                "shaft": shaft,
                "laws": ", ".join(dict.fromkeys(str(curve.get("law", "")) for curve in own)),
                "speed_unit": unit_text(str(first.get("speed_unit", ""))),
                "torque_unit": unit_text(str(first.get("torque_unit", ""))),
                "curves": [{"label": curve_label(curve, own)} | _columns(curve) for curve in own],
            }
        )
    return plots


def residual_payload(channels: Mapping[str, Json]) -> list[dict[str, Any]]:
    """Return the autocorrelations of one recording."""
    return [
        {
            "name": name,
            "lag": _rounded(residual.get("lag_s")),
            "autocorrelation": _rounded(residual.get("autocorrelation"), 4),
            "band": residual.get("band"),
            "white": bool(residual.get("white")),
        }
        for name, residual in channels.items()
    ]


def coherence_payload(channels: Mapping[str, Json]) -> list[dict[str, Any]]:
    """Return the coherences of one recording."""
    return [
        {
            "name": name,
            "frequency": _rounded(found.get("frequency_hz")),
            "share": _rounded(found.get("share"), 4),
            "explained": percent(found.get("explained")),
        }
        for name, found in channels.items()
    ]


def _columns(curve: Json) -> dict[str, list[float | None]]:
    return {key: _rounded(curve.get(key)) for key in ("speed", "torque", "lower", "upper")}


def _rounded(values: Sequence[float | None] | None, digits: int = 6) -> list[float | None]:
    numbers = [math.nan if value is None else value for value in values or ()]
    return rounded(np.array(numbers, dtype=np.float64), digits)


def _finite(value: Any) -> Any:
    """Return the value with None for every number that JSON cannot hold."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _finite(item) for key, item in cast("Mapping[Any, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in cast("Sequence[Any]", value)]
    return value
