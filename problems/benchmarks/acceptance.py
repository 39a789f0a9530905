"""What each piece of work is done with: every line beside what was measured for it.

python problems/benchmarks/acceptance.py NAME [--quick] [--only ID]

NAME is servo, engine, telescopes, diagnosis or users. The lines and their IDs stand in done_when.yaml. `--quick`
reduces draws, starts and evaluations: it shows that the measurements run, not that the lines hold. The exit status is
1 where a line fails or was not measured.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import diagnosis
import engine
import servo
import telescopes
import users
import yaml
from checks import Check, print_check, status

LINES = Path(__file__).with_name("done_when.yaml")
Measure = Callable[[str, bool], Check]
MEASURES: Mapping[str, Mapping[str, Measure]] = {
    "servo": servo.MEASURES,
    "engine": engine.MEASURES,
    "users": users.MEASURES,
    "diagnosis": diagnosis.MEASURES,
    "telescopes": telescopes.MEASURES,
}
"""By piece of work and ID: (line, quick) -> check."""


def lines() -> Mapping[str, Mapping[str, str]]:
    """Return the lines of all pieces of work, by name and ID."""
    return yaml.safe_load(LINES.read_text(encoding="utf-8"))


def checks_of(name: str, only: str, quick: bool) -> Iterator[Check]:
    """Measure the lines of a piece of work whose ID contains `only`, one after another."""
    measures = MEASURES.get(name, {})
    for key, line in lines()[name].items():
        if only in key:
            measure = measures.get(key)
            yield Check(line, "not measured yet", None) if measure is None else measure(line, quick)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the lines of a piece of work; 1 where one fails or was not measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=lines())
    parser.add_argument("--quick", action="store_true", help="few draws, starts and evaluations")
    parser.add_argument("--only", default="", metavar="ID", help="only lines whose ID contains this")
    options = parser.parse_args(arguments)
    if options.quick:
        print("--quick: fewer draws, starts and evaluations than the lines ask for")
    checks: list[Check] = []
    for check in checks_of(options.name, options.only, options.quick):
        print_check(check)
        checks.append(check)
    held = sum(check.verdict == "ok" for check in checks)
    print(f"\n{held} of {len(checks)} lines hold")
    return status(checks) if checks else 1


if __name__ == "__main__":
    raise SystemExit(main())
