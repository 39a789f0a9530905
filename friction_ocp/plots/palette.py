"""Colours of the figures and of the HTML report, told apart with any colour vision."""

from __future__ import annotations

from collections.abc import Mapping

INK = "#1c2330"
MUTED = "#5a6475"
GRID = "#e3e7ed"
MEASURED = "#3c4657"
SIMULATED = "#d55e00"
RESIDUAL = "#0072b2"

SEQUENCE = ("#0072b2", "#d55e00", "#009e73", "#b0508a", "#a87800", "#2f9fd8", "#3c4657")
"""Curves of one plot, in order; Okabe & Ito 2008, yellow and pink darkened for thin lines on white."""

NEGATIVE = "#0072b2"
POSITIVE = "#b84a00"
"""Ends of a diverging scale about white."""

VERDICTS: Mapping[str, str] = {
    "ok": "#00704f",
    "at_bound": "#9a5b00",
    "traded": "#8a3a6b",
    "not_identifiable": "#b3261e",
}

VERDICT_WORDS: Mapping[str, str] = {
    "ok": "ok",
    "at_bound": "at bound",
    "traded": "traded",
    "not_identifiable": "not identifiable",
}


def colour(index: int) -> str:
    """Return the colour of curve `index`, starting over after the last."""
    return SEQUENCE[index % len(SEQUENCE)]
