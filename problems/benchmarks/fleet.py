"""200 simulated nights of ten machines, with a friction that grows by 20 % in one of them.

python problems/benchmarks/fleet.py [--machines N] [--nights N] [--out DIR]

Prints every flag that `friction-ocp batch` raises and whether it is due: the drift must be found, with at most one
false alarm. The exit status is 1 otherwise.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "fleet"))

from checks import Check, tell_status
from simulated_fleet import Change, machine_name, write_axis, write_fleet

MACHINES, NIGHTS, GROWTH, SEED = 10, 20, 0.2, 20261101
DRIFTING, PARAMETER = 6, "motor.friction.tau_c"
MOST_FALSE_ALARMS = 1


@dataclass(frozen=True)
class Verdict:
    """What a batch flagged."""

    found: bool
    text: str
    """The drift that was planted, as it was found."""
    false_alarms: tuple[str, ...]


def run(folder: Path, machines: int, nights: int) -> Verdict:
    """Simulate a fleet, fit it from the command line, and compare its flags with what was planted."""
    drifting = min(DRIFTING, machines - 1)
    files = write_fleet(folder / "nights", machines, nights, (Change(drifting, GROWTH),), SEED)
    problem = write_axis(folder / "axis.yaml", files[0])
    out = folder / "out"
    command = [sys.executable, "-m", "friction_ocp", "batch", str(problem), str(folder / "nights"), "--out", str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return verdict(json.loads((out / "result.json").read_text(encoding="utf-8")), machine_name(drifting))


def verdict(result: dict[str, Any], machine: str) -> Verdict:
    """Sort the flags of a result into what was planted and false alarms."""
    flags = [item for item in result["drifts"] if item["flagged"]]
    due = [item for item in flags if (item["machine"], item["parameter"]) == (machine, PARAMETER)]
    rest = [item for item in flags if item not in due]
    names = [f"{item['machine']} {item['parameter']} drifts" for item in rest]
    names += [f"{item['machine']} {item['parameter']} stands out" for item in result["outliers"]]
    text = "not found"
    if due:
        low, high = due[0]["interval95"]
        before = due[0]["before"]
        size = f"{due[0]['relative']:.1%} ({low / before:.1%} to {high / before:.1%})"
        text = f"{due[0]['shape']} of {size}, adjusted p = {due[0]['adjusted_p_value']:.2g}"
    return Verdict(bool(due), text, tuple(names))


def check(line: str, machines: int = MACHINES, nights: int = NIGHTS, out: Path | None = None) -> Check:
    """Measure the line of the fleets."""
    with tempfile.TemporaryDirectory() as kept:
        found = run(out or Path(kept), machines, nights)
    alarms = f"{len(found.false_alarms)} false alarms" + "".join(f"; {name}" for name in found.false_alarms)
    text = f"{machines * nights} nights, planted growth of {GROWTH:.0%}: {found.text}; {alarms}"
    return Check(line, text, found.found and len(found.false_alarms) <= MOST_FALSE_ALARMS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the flags; 1 where the line fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=MACHINES)
    parser.add_argument("--nights", type=int, default=NIGHTS)
    parser.add_argument("--out", type=Path, help="keep nights and result here")
    options = parser.parse_args(arguments)
    return tell_status([check("planted drift found", options.machines, options.nights, options.out)])


if __name__ == "__main__":
    raise SystemExit(main())
