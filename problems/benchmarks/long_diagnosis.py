"""Diagnoses of long logs: what is found, and how long it takes by pieces of them and by all of them.

python problems/benchmarks/long_diagnosis.py [--samples N ...] [--whole]

A model of a linear axis lacks Stribeck friction. Recordings are those of the simulator of the tests: two for training
and one for validation, N samples each, at 1 kHz. `--whole` adds a search by all samples, which takes long. Compiled
models are left by a short log before, so that no other has to make them.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind.cases import EFFECTS
from blind.document import handbook
from blind.folder import write_problem
from blind.machines import MACHINES
from blind.recording import Hidden, run
from blind.scales import measure
from blind.site import Site
from jobs import diagnosed

SIZE, SEED = 0.3, 7
WARM, USUAL = 3_000, (30_000, 120_000)
EFFECT = "stribeck"


def case(samples: int, folder: Path, searched: float | None = None) -> Path:
    """Write the axis with recordings of so many samples, and by how many the search goes; return the problem file."""
    machine = replace(MACHINES["feed"](), samples=samples)
    shaft = machine.plant().shafts[0].name
    scales = measure(MACHINES["feed"](), "steps", (SEED, 0))
    site = Site(machine, scales, Hidden(machine.plant()), shaft, SIZE)
    hidden = EFFECTS[EFFECT].inject(site, np.random.default_rng(SEED))
    motions = {"train0": "steps", "train1": "multisine", "check0": "steps"}
    made = {name: run(machine, hidden, kind, (SEED, k))[0] for k, (name, kind) in enumerate(motions.items())}
    document: dict[str, Any] = handbook(machine.document, np.random.default_rng(SEED))
    if searched is not None:
        document["diagnosis"] = {"samples": searched}
    train = {name: made[name] for name in ("train0", "train1")}
    folder.mkdir(parents=True)
    return write_problem(folder, machine, document, train, {"check0": made["check0"]})


def row(samples: int, folder: Path, searched: float | None = None) -> str:
    """Diagnose the axis with recordings of so many samples and return a line of the table."""
    seconds, result = diagnosed(case(samples, folder / "case", searched), folder / "out", 2, {})
    by = result["searched"]
    found = ", ".join(f"{item['effect']} at {item['component']}" for item in result["accepted"]) or "nothing"
    went = 2 * samples if by is None else by["samples"]
    shrink = result["gap"]["shrink"]["overall"]
    return f"{2 * samples:>9} {went:>9} {seconds:>9.1f} {shrink:>9.4f}  {result['verdict']}: {found}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, nargs="+", default=USUAL, help="samples of a recording")
    parser.add_argument("--whole", action="store_true", help="search by all samples, too")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        row(WARM, folder / "warm")
        print(f"{'samples':>9} {'searched':>9} {'seconds':>9} {'shrink':>9}  found", flush=True)
        for samples in options.samples:
            print(row(samples, folder / str(samples)), flush=True)
            if options.whole:
                print(row(samples, folder / f"{samples}-whole", float("inf")), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
