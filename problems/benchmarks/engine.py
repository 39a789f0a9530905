"""The lines of the estimation engine, measured; `acceptance.py engine` prints them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import speed
from checks import Check
from servo import script_check

MOST_SECONDS = {"polyline": 0.25, "lugre": 0.5}
MOST_OVER_FLOOR, MOST_WITH_IPOPT = 3.0, 2.5
LONGEST, MOST_MEMORY, MOST_GROWTH = 40.0, 3.0, 1.05
"""Seconds and GB for 10^6 samples, and the exponent of growth."""


def speeds(line: str, quick: bool) -> Check:
    """Fit the telescope axis from random starts; peers are not measured here."""
    starts = 4 if quick else 20
    rows = [speed.row(law, 10_000, starts) for law in MOST_SECONDS]
    ipopt = speed.row("polyline", 10_000, 1 if quick else 3, solver="ipopt")
    held = all(row.solved == len(row.runs) and row.median <= MOST_SECONDS[row.law] for row in rows)
    held = held and rows[0].over_floor <= MOST_OVER_FLOOR and ipopt.median <= MOST_WITH_IPOPT
    told = [f"{row.law}: {row.solved} of {len(row.runs)}, median {row.median:.2f} s" for row in rows]
    told += [f"{rows[0].over_floor:.1f} times the floor; with Ipopt {ipopt.median:.1f} s; peers not measured"]
    return Check(line, "\n".join(told), None if held else False)


def long_logs(line: str, quick: bool) -> Check:
    """Fit up to 10^6 samples, in a process each."""
    fits = speed.long_fits()
    last, growth = fits[-1], speed.growth(fits)
    held = last.converged and last.seconds <= LONGEST and last.memory <= MOST_MEMORY and growth <= MOST_GROWTH
    text = f"{last.samples} samples in {last.seconds:.0f} s and {last.memory:.1f} GB, growth {growth:.2f}"
    return Check(line, text, held)


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {
    "speed": speeds,
    "long_logs": long_logs,
    "no_smoothing_left": lambda line, quick: script_check(line, "smoothing.py"),
    "nist": lambda line, quick: script_check(line, "nist.py"),
}
"""By ID in done_when.yaml."""
