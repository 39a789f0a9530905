"""Lines that a benchmark checks, and how they are printed."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "NO", "not measured", "by eye"]


@dataclass(frozen=True)
class Check:
    """One line, what was measured for it and whether that is enough."""

    line: str
    measured: str
    passed: bool | None
    """None where nothing was measured."""
    by_eye: bool = False
    """Whether only a person can judge it."""

    @property
    def verdict(self) -> Verdict:
        """Return the word that is printed."""
        if self.by_eye:
            return "by eye"
        return "not measured" if self.passed is None else "ok" if self.passed else "NO"


def status(checks: Iterable[Check]) -> int:
    """Return the exit status: 1 where a line failed or was not measured."""
    return int(any(check.verdict in ("NO", "not measured") for check in checks))


def print_check(check: Check) -> None:
    """Print a line, what was measured, and the verdict."""
    print(f"\n{textwrap.fill(check.line, 110, initial_indent='- ', subsequent_indent='  ')}")
    for row in check.measured.splitlines():
        print(f"    {row}")
    print(f"    {check.verdict}", flush=True)


def print_rows(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table; the first column is aligned left, all others right."""
    table = [header, *rows]
    widths = [max(len(row[k]) for row in table) for k in range(len(header))]
    for row in table:
        cells = [cell.ljust(widths[0]) if k == 0 else cell.rjust(widths[k]) for k, cell in enumerate(row)]
        print("  ".join(cells).rstrip())
    sys.stdout.flush()


def tell_status(checks: Sequence[Check]) -> int:
    """Print one row a check and return the exit status."""
    print()
    for check in checks:
        print(f"{check.verdict:<12} {check.line}: {check.measured}")
    return status(checks)
