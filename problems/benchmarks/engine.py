"""The lines of the estimation engine, measured; `acceptance.py engine` prints them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping

import numpy as np
import peers
import speed
from checks import Check
from servo import ROOT, TEST_RESULT, script_check

MOST_SECONDS = {"polyline": 0.25, "lugre": 0.5}
MOST_HERE = {"telescope": 0.5, "emps": 0.3, "xl330": 0.5}
"""Seconds of this package, by case of peers.py."""
LEAST_RATIO = 10.0
MOST_OVER_FLOOR, MOST_WITH_IPOPT = 3.0, 2.5
LONGEST, MOST_MEMORY, MOST_GROWTH = 40.0, 3.0, 1.05
"""Seconds and GB for 10^6 samples, and the exponent of growth."""


def speeds(line: str, quick: bool) -> Check:
    """Fit the telescope axis from random starts, and let peers fit it from the first of them."""
    starts = 4 if quick else 20
    rows = [speed.row(law, 10_000, starts) for law in MOST_SECONDS]
    ipopt = speed.row("polyline", 10_000, 1 if quick else 3, solver="ipopt")
    held = all(row.solved == len(row.runs) and row.median <= MOST_SECONDS[row.law] for row in rows)
    held = held and rows[0].over_floor <= MOST_OVER_FLOOR and ipopt.median <= MOST_WITH_IPOPT
    told = [f"{row.law}: {row.solved} of {len(row.runs)}, median {row.median:.2f} s" for row in rows]
    told += [f"{rows[0].over_floor:.1f} times the floor; with Ipopt {ipopt.median:.1f} s"]
    ratio, text = ratio_to_peers(quick)
    told.append(text)
    held = held and ratio is not None and ratio >= LEAST_RATIO
    return Check(line, "\n".join(told), None if ratio is None else held)


def ratio_to_peers(quick: bool) -> tuple[float | None, str]:
    """Return how many times longer the fastest peer takes on the polyline axis that ends at the same optimum."""
    found = peers.measure_case("polyline", list(peers.TOOLS)[:1] if quick else peers.TOOLS, peers.FOLDER)
    timed = [item for item in found[1:] if np.isfinite(item.seconds)]
    if not timed:
        return None, "no peer was measured: " + "; ".join(dict.fromkeys(item.note for item in found[1:]))
    equal = [item for item in timed if peers.same_optimum(item, found)]
    near = min(equal or timed, key=lambda item: item.seconds if equal else item.merit)
    ratio = near.seconds / found[0].seconds
    name = peers.TOOLS[near.tool].name
    which = "the fastest at the same optimum" if equal else "none ends at the same optimum, the nearest"
    return ratio, f"{len(timed)} peers measured, {which}: {name}, {ratio:.0f} times longer"


def faster_than_peers(line: str, quick: bool) -> Check:
    """Time this package on the cases that others were measured on before, and those others beside it."""
    told: list[str] = []
    held = True
    for name in ("xl330",) if quick else MOST_HERE:
        found = peers.measure_case(name, () if quick else peers.TOOLS, peers.FOLDER)
        ours = found[0]
        timed = [item for item in found[1:] if np.isfinite(item.seconds)]
        others = ", ".join(f"{peers.TOOLS[item.tool].name} {item.seconds:.1f} s" for item in timed)
        told.append(f"{name}: {ours.seconds:.2f} s here, at most {MOST_HERE[name]} s; {others or 'no peer measured'}")
        held = held and ours.seconds <= min([MOST_HERE[name], *(item.seconds for item in timed)])
    models = peers.servo_models()
    told.append("servo models: " + ", ".join(f"{name} {seconds:.2f} s" for name, seconds in models.items()))
    return Check(line, "\n".join(told), held and max(models.values()) <= MOST_HERE["xl330"])


def long_logs(line: str, quick: bool) -> Check:
    """Fit up to 10^6 samples, in a process each."""
    fits = speed.long_fits()
    last, growth = fits[-1], speed.growth(fits)
    held = last.converged and last.seconds <= LONGEST and last.memory <= MOST_MEMORY and growth <= MOST_GROWTH
    text = f"{last.samples} samples in {last.seconds:.0f} s and {last.memory:.1f} GB, growth {growth:.2f}"
    return Check(line, text, held)


def cover(line: str, quick: bool) -> Check:
    """Measure the coverage of intervals; draws that are on disk count."""
    draws = ("--draws", "4", "--wrong", "0", "--only", "linear") if quick else ()
    return script_check(line, "coverage.py", *draws)


def tested(*tests: str) -> Callable[[str, bool], Check]:
    """Return what measures a line by the tests that state it."""

    def measure(line: str, quick: bool) -> Check:
        del quick
        command = [sys.executable, "-m", "pytest", "-v", "-o", "addopts=", "-p", "no:cacheprovider", *tests]
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        results = TEST_RESULT.findall(run.stdout)
        rows = [f"{result.lower()}: {name.rpartition('::')[2]}" for name, result in results]
        return Check(line, "\n".join(rows), bool(results) and all(result == "PASSED" for _, result in results))

    return measure


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {
    "speed": speeds,
    "peers": faster_than_peers,
    "long_logs": long_logs,
    "no_smoothing_left": lambda line, quick: script_check(line, "smoothing.py"),
    "coverage": cover,
    "nist": lambda line, quick: script_check(line, "nist.py"),
    "outliers": tested("tests/estimation/test_outliers.py"),
    "statistics": tested("tests/test_cli_statistics.py", "tests/statistics"),
}
"""By ID in done_when.yaml."""
