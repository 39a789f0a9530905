"""The 27 certified nonlinear regressions of NIST (StRD) through the solver of `identify`.

python problems/benchmarks/nist.py

For each set and start: certified digits of the worst parameter, iterations, and whether the solver calls itself
converged. The data stand in tests/estimation/nist_strd.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "estimation"))

from certified_regressions import DIGITS, FORMULAS, Certified, read
from checks import Check, print_rows, tell_status

from friction_ocp.estimation.gauss_newton import Solution

ASKED = {1: 24, 2: 26}
"""Sets to be solved to six digits, by start."""
Ends = dict[int, tuple[Certified, Solution]]


def row(ends: Ends) -> list[str]:
    """Return the cells of one data set."""
    cells = [ends[1][0].name, ends[1][0].level]
    for case, end in ends.values():
        word = "converged" if end.converged else "not converged"
        cells += [f"{case.digits(end.point.theta):.1f}", f"{end.iterations}", word]
    return cells


def checks_of(table: list[Ends]) -> list[Check]:
    """Count what is solved, and wrong answers that are called converged."""
    checks: list[Check] = []
    for start, asked in ASKED.items():
        digits = [ends[start][0].digits(ends[start][1].point.theta) for ends in table]
        converged = [ends[start][1].converged for ends in table]
        solved = sum(ok and found >= DIGITS for ok, found in zip(converged, digits, strict=True))
        wrong = sum(ok and found < DIGITS for ok, found in zip(converged, digits, strict=True))
        measured = f"{solved} of {len(table)}, {wrong} wrong ones called converged"
        line = f"six digits from start {start} in at least {asked}, no wrong answer called converged"
        checks.append(Check(line, measured, solved >= asked and wrong == 0))
    return checks


def main() -> int:
    """Print the table and the counts; 1 where a count is too small."""
    table: list[Ends] = []
    for name in FORMULAS:
        case = read(name)
        table.append({start: (case, case.solve(start)) for start in ASKED})
    header = ["set", "level", *(f"{word} {start}" for start in ASKED for word in ("digits", "iterations", "status"))]
    print_rows(header, [row(ends) for ends in table])
    return tell_status(checks_of(table))


if __name__ == "__main__":
    raise SystemExit(main())
