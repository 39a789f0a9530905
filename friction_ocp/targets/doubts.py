"""What is to be doubted of numbers that are exported: guesses, a fit that did not end, what recordings do not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from friction_ocp.simulation.grid import FloatArray

_SAME = 1e-6
"""Relative difference up to which a number is the one that was fitted."""
_MOST = 8
"""Names that are listed."""


def doubts_of(names: Sequence[str], values: FloatArray, result: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what the result.json beside a problem does not vouch for; {} where there is none.

    `names` are the parameters with a guess, `values` (parameters,) what is exported of them.
    """
    if str(result.get("format", "")).startswith("friction-ocp-diagnosis"):
        return ()  # whose problems hold fitted values, that result.json does not repeat
    fitted = _mapping(result.get("parameters"))
    found: list[str] = []
    if result.get("status") == "not_converged":
        why = str(result.get("message") or "").partition(".")[0].removeprefix("Not converged: ")
        found.append(f"the fit did not converge ({why or 'no reason stated'}): its last iterate is not an answer")
    guesses = [name for name, value in zip(names, values, strict=True) if not _is_fitted(fitted.get(name), value)]
    if guesses:
        found.append(f"{_listed(guesses)}: guesses, no result beside the problem says that they were fitted")
    blind = [
        name for name in names if name not in guesses and _mapping(fitted[name]).get("verdict") == "not_identifiable"
    ]
    if blind:
        found.append(f"{_listed(blind)}: the recordings do not tell them")
    return tuple(found)


def _is_fitted(found: Any, value: float) -> bool:
    stated = _mapping(found).get("value")
    return isinstance(stated, (int, float)) and bool(np.isclose(float(stated), value, rtol=_SAME, atol=0.0))


def _mapping(content: Any) -> Mapping[str, Any]:
    """Return what a file holds where a mapping is expected, {} where it is none."""
    return cast(Mapping[str, Any], content) if isinstance(content, dict) else {}


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return ", ".join(names[:_MOST]) + more
