"""Fits of fresh data of the two telescopes, one draw after another, kept on disk.

python problems/benchmarks/telescope_draws.py [PART ...] [--count N] [--out FOLDER]

Parts: lto (25 draws with the break at the high-speed part, 25 at the low, 10 quadratic, each fitted by all three
models, the first also with a 3 % prior on the inertia), grid (the paper's grid search beside identify, 25 draws), aries
(20 draws of all experiments, each direction jointly and in the paper's two steps, then limit cycle and presliding loop
simulated with what was found), starts (joint.yaml and joint_east_west.yaml from 20 random starts each). A draw that is
on disk is not made again, so that a run can be done in pieces; `--count` stops after so many draws of each kind.
`acceptance.py telescopes` makes what is missing and prints the lines.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import aries_grid
import lto_grid
import numpy as np
import random_starts

from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.estimation.problem import Problem, RecordingUse, StaticUse
from friction_ocp.execution.content import toolkit_fingerprint
from friction_ocp.problem_file.load import load_problem
from friction_ocp.whole_file import write_text

sys.path.insert(0, str(aries_grid.ROOT / "problems" / "aries"))

import cycles
import make_data as aries_data

FOLDER = Path("results") / "telescopes"
LTO = aries_grid.ROOT / "problems" / "lto"
KINDS = {"high": 25, "low": 25, "quadratic": 10}
"""Draws by where the nonlinear part of the friction is."""
MODELS = {"high": "joint", "low": "low_speed_part", "quadratic": "quadratic_on_polyline"}
"""Problem file of each model."""
GRID_DRAWS, ARIES_DRAWS, STARTS = 25, 20, 20
LTO_SEED, GRID_SEED, ARIES_SEED, START_SEED = 9000, 5000, 100, 1
STARTED = {
    "lto": LTO / "joint.yaml",
    "aries": aries_grid.ROOT / "problems" / "aries" / "joint_east_west.yaml",
}
"""Problems that are fitted from random starts."""
Record = Mapping[str, Any]


def fitted(problem: Problem) -> dict[str, Any]:
    """Fit a problem; return what is judged of it."""
    began = time.perf_counter()
    estimate = identify(problem)
    return told_of(estimate) | {"seconds": time.perf_counter() - began}


def told_of(estimate: Estimate) -> dict[str, Any]:
    """Return the numbers of an estimate that a draw keeps."""
    return {
        "objective": estimate.solver.objective,
        "converged": estimate.converged,
        "values": dict(estimate.values),
        "intervals": {item.name: item.interval95 for item in estimate.parameters},
        "verdicts": {item.name: [item.verdict.word, *item.verdict.traded_with] for item in estimate.parameters},
    }


def lto_draw(kind: str, number: int) -> Record:
    """Fit all models to one draw of the Leighton telescope."""
    telescope = next(made for make in lto_grid.DATA.TELESCOPES if (made := make()).name == kind)
    seed = LTO_SEED + 10 * (100 * list(KINDS).index(kind) + number)
    kinds = enumerate(("start", "stop"))
    uses = tuple(RecordingUse(lto_grid.DATA.response(telescope, word, seed + k, word)) for k, word in kinds)
    points = (StaticUse(lto_grid.DATA.curve(telescope, seed + 2)),)
    names = MODELS | ({"prior": "inertia_prior"} if kind == "high" else {})
    given = {"train": uses, "static": points, "validation": (), "static_validation": ()}
    fits = {key: fitted(replace(load_problem(LTO / f"{name}.yaml"), **given)) for key, name in names.items()}
    return {"fits": fits, "truth": telescope.truth}


def grid_draw(number: int) -> Record:
    """Run the grid search and identify on one draw."""
    return lto_grid.kept(lto_grid.contest(GRID_SEED + 100 * number))


def aries_draw(number: int) -> Record:
    """Fit one draw of all experiments of the Schmidt telescope, and simulate its slow run and its loop with it."""
    seed = ARIES_SEED + number
    curves, made = aries_data.curves(seed), {item.name: item for item in aries_data.responses(seed)}
    sides = {direction: _side(direction, curves, made) for direction in aries_grid.SIDES}
    found = {direction: side["joint"]["values"] for direction, side in sides.items()}
    return {"sides": sides, "motions": cycles.repeated(found, made)}


def _side(direction: str, curves: Mapping[str, Any], made: Mapping[str, Any]) -> dict[str, Any]:
    """Fit one direction jointly, and in the paper's two steps."""
    folder = aries_grid.ROOT / "problems" / "aries"
    base = load_problem(folder / f"joint_{direction}.yaml")
    uses = tuple(RecordingUse(made[use.name]) for use in base.train)
    points = (StaticUse(curves[f"curve_{direction}"]),)
    joint = fitted(replace(base, train=uses, static=points, validation=(), static_validation=()))
    averaged = load_problem(folder / f"curve_all_{direction}.yaml")
    averaged = replace(averaged, static=(StaticUse(curves[f"curve_all_{direction}"]),), static_validation=())
    steps = aries_grid.two_step.static_numbers(averaged)
    small = made[f"small_steps_{direction}"]
    steps |= aries_grid.two_step.second_order(small, aries_grid.aries.INERTIA, steps["sigma2"])
    return {"joint": joint, "two_steps": steps}


def start_draw(telescope: str, number: int) -> Record:
    """Fit a problem from one random start."""
    end = random_starts.run_start(random_starts.Job(STARTED[telescope], START_SEED, number))
    return asdict(end) | {"theta": end.theta.tolist(), "std_error": end.std_error.tolist()}


def end_of(record: Record) -> random_starts.End:
    """Return where the start of a record led."""
    kept = {name: value for name, value in record.items() if name != "code"}
    arrays = {name: np.array(kept[name], dtype=float) for name in ("theta", "std_error")}
    return random_starts.End(**kept | arrays | {"verdicts": tuple(kept["verdicts"])})


def parts() -> dict[str, list[tuple[str, Callable[[], Record]]]]:
    """Return the draws of every part: name and what makes it; kinds take turns, so that a part of them is fair."""
    lto = [(number, kind) for kind, count in KINDS.items() for number in range(count)]
    return {
        "lto": [(f"lto-{kind}-{n:02d}", lambda kind=kind, n=n: lto_draw(kind, n)) for n, kind in sorted(lto)],
        "grid": [(f"grid-{n:02d}", lambda n=n: grid_draw(n)) for n in range(GRID_DRAWS)],
        "aries": [(f"aries-{n:02d}", lambda n=n: aries_draw(n)) for n in range(ARIES_DRAWS)],
        "starts": [
            (f"start-{key}-{n:02d}", lambda key=key, n=n: start_draw(key, n)) for n in range(STARTS) for key in STARTED
        ],
    }


def draws(part: str, count: int, folder: Path = FOLDER) -> Iterator[tuple[str, Record]]:
    """Yield name and record of the first draws of a part, those of each kind counted; make what is not on disk."""
    seen: dict[str, int] = {}
    for name, make in parts()[part]:
        kind = name.rpartition("-")[0]
        seen[kind] = seen.get(kind, 0) + 1
        if seen[kind] <= count:
            yield name, kept(folder / f"{name}.json", make)


def kept(path: Path, make: Callable[[], Record]) -> Record:
    """Return what a file holds; make and write it first where it is not there."""
    if not path.is_file():
        write_text(path, json.dumps(dict(make()) | {"code": toolkit_fingerprint()}))
    return json.loads(path.read_text(encoding="utf-8"))


def versions(records: Sequence[Record]) -> str:
    """Return by how many versions of the code some draws were made."""
    count = len({record["code"] for record in records})
    return "" if count == 1 else f", made by {count} versions of the code"


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the draws asked for and say how long each took."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[[], *parts()], metavar="PART", help="all if none")
    parser.add_argument("--count", type=int, default=max(KINDS.values()))
    parser.add_argument("--out", type=Path, default=FOLDER)
    asked = parser.parse_args(arguments)
    for part in asked.parts or parts():
        began = time.perf_counter()
        for name, _ in draws(part, asked.count, asked.out):
            print(f"{name}: {time.perf_counter() - began:.0f} s", flush=True)
            began = time.perf_counter()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
