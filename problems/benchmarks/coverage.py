"""How often do 95 % intervals cover? Five friction laws whose noise levels are unknown, and a model that is wrong.

python problems/benchmarks/coverage.py [--draws 500] [--wrong 200] [--only LAW] [--out FOLDER]

Data of the plant, one mass, white noise on the encoder of a size that the problem does not state. Printed are the
coverage of every interval beside its Bonferroni band (99 % for all intervals together) and the pooled coverage beside
its cluster bootstrap band (99 %; the intervals of one draw are not independent). The wrong model has Coulomb and
viscous friction where the plant has Stribeck's; the parameters that fit it best are those of one recording a hundred
times as long. Seeds are fixed. Draws are kept in FOLDER, and a run goes on from there.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import calibration
import numpy as np
import scipy.stats
from calibration import TRUTH, Case, make_problem
from checks import Check, print_rows, tell_status

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.problem import Problem
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.whole_file import write_text

FOLDER = Path("results") / "coverage"
LAWS = {"linear": "viscous", "coulomb": "coulomb", "stribeck": "stribeck", "lugre": "lugre", "polyline": "polyline"}
SEED, WRONG_SEED, LONG_SEED = 20_000, 60_000, 90_000
CONFIDENCE, BAND = 0.95, 0.99
LONG = 100
"""Times as long is the recording that says which parameters fit best."""
MISFIT_BAND = (0.90, 0.98)
RESAMPLES = 4000
WRONG = "wrong model"

Draw = Mapping[str, Any]
"""What is kept of one draw: `covered` and `z` by parameter, `converged`, `kind`, `warned`."""


def unknown_noise(problem: Problem) -> Problem:
    """Return a problem that says nothing about the noise of its channels."""
    channels = tuple(replace(channel, noise_std=None) for channel in problem.drive.channels)
    return replace(problem, drive=replace(problem.drive, channels=channels))


def law_draw(law: str, number: int) -> Draw:
    """Identify one run of the plant with the right model."""
    case, seed = Case(LAWS[law], 1), SEED + number
    recording, hold = calibration.record(case, seed)
    problem, truth = make_problem(case, recording, hold, np.random.default_rng([seed, 7]))
    return drawn(unknown_noise(problem), truth)


def wrong_problem(seed: int, seconds: float) -> Problem:
    """Return a run of the plant with Stribeck friction, to be fitted without."""
    case = Case("stribeck", 1)
    before = calibration.SECONDS
    calibration.SECONDS = seconds
    try:
        recording, hold = calibration.record(case, seed)
    finally:
        calibration.SECONDS = before
    problem, _ = make_problem(Case("coulomb_viscous", 1), recording, hold, np.random.default_rng([seed, 7]))
    (shaft,) = problem.drive.shafts
    law = CoulombViscous(Free(0.1, 0.0, 2.0), Free(1.5e-3, 0.0, 0.03))
    friction = replace(shaft.friction, law=law)
    drive = replace(problem.drive, shafts=(replace(shaft, friction=friction),))
    return unknown_noise(replace(problem, drive=drive))


def best_fitting(folder: Path) -> Mapping[str, float]:
    """Return the parameters that fit the wrong model best, from one very long recording."""
    path = folder / "best_fitting.json"
    if not path.is_file():
        problem = wrong_problem(LONG_SEED, LONG * calibration.SECONDS)
        options = replace(problem.estimation, horizon_s=calibration.SECONDS)
        estimate = identify(replace(problem, estimation=options))
        folder.mkdir(parents=True, exist_ok=True)
        write_text(path, json.dumps(dict(estimate.values)))
    return json.loads(path.read_text(encoding="utf-8"))


def drawn(problem: Problem, truth: Mapping[str, float]) -> Draw:
    """Identify a problem and compare its intervals with the truth."""
    estimate = identify(problem)
    told = [item for item in estimate.parameters if np.isfinite(item.std_error)]
    return {
        "covered": {item.name: bool(item.interval95[0] <= truth[item.name] <= item.interval95[1]) for item in told},
        "z": {item.name: float((item.value - truth[item.name]) / item.std_error) for item in told},
        "converged": estimate.converged,
        "kind": estimate.uncertainty.kind,
        "warned": any("white" in warning for warning in estimate.warnings),
    }


def draws_of(name: str, one: Callable[[int], Draw], count: int, folder: Path) -> list[Draw]:
    """Return draws, those on disk first; each is on disk when it ends."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name.replace(' ', '_')}.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    found: list[Draw] = [json.loads(line) for line in lines[:count]]
    with path.open("a", encoding="utf-8") as stream:
        for number in range(len(found), count):
            draw = one(number)
            stream.write(json.dumps(draw) + "\n")
            stream.flush()
            found.append(draw)
    return found


@dataclass(frozen=True)
class Interval:
    """The intervals of one parameter over all draws."""

    law: str
    name: str
    hits: int
    draws: int

    def band(self, intervals: int) -> tuple[float, float]:
        """Return where its coverage lies with `BAND` for all intervals together, were each right."""
        share = 0.5 * (1.0 - BAND) / intervals
        low, high = scipy.stats.binom.ppf([share, 1.0 - share], self.draws, CONFIDENCE)
        return float(low) / self.draws, float(high) / self.draws

    def cells(self, intervals: int) -> tuple[str, ...]:
        """Return a table row."""
        low, high = self.band(intervals)
        word = "ok" if self.is_right(intervals) else "NO"
        return self.law, self.name, f"{self.hits / self.draws:.3f}", f"{low:.3f} to {high:.3f}", word

    def is_right(self, intervals: int) -> bool:
        """Whether its coverage lies in its band."""
        low, high = self.band(intervals)
        return low <= self.hits / self.draws <= high


def intervals_of(law: str, draws: Sequence[Draw]) -> list[Interval]:
    """Return the intervals of every parameter of a law."""
    names = list(dict.fromkeys(name for draw in draws for name in draw["covered"]))
    return [
        Interval(
            law, name, sum(draw["covered"].get(name, False) for draw in draws), sum(name in d["covered"] for d in draws)
        )
        for name in names
    ]


def pooled(draws: Iterable[Draw]) -> tuple[float, float, float]:
    """Return pooled coverage and its band, were the intervals right: draws are resampled whole."""
    counts = np.array([(sum(draw["covered"].values()), len(draw["covered"])) for draw in draws], dtype=float)
    rng = np.random.default_rng(0)
    chosen = rng.integers(len(counts), size=(RESAMPLES, len(counts)))
    sums = counts[chosen].sum(axis=1)
    coverage = float(counts[:, 0].sum() / counts[:, 1].sum())
    ends = np.quantile(sums[:, 0] / sums[:, 1] - coverage, [0.5 * (1.0 - BAND), 0.5 * (1.0 + BAND)])
    return coverage, CONFIDENCE + float(ends[0]), min(1.0, CONFIDENCE + float(ends[1]))


def right_models(laws: Sequence[str], count: int, folder: Path) -> list[Check]:
    """Measure the coverage of right models."""
    draws = {law: draws_of(law, lambda k, law=law: law_draw(law, k), count, folder) for law in laws}
    intervals = [item for law, found in draws.items() for item in intervals_of(law, found)]
    print_rows(("law", "parameter", "coverage", "band", ""), [item.cells(len(intervals)) for item in intervals])
    together = [draw for found in draws.values() for draw in found]
    coverage, low, high = pooled(together)
    right = sum(item.is_right(len(intervals)) for item in intervals)
    robust = sum(draw["kind"] == "sandwich" for draw in together)
    lost = sum(not draw["converged"] for draw in together)
    return [
        Check("every interval inside its Bonferroni band", f"{right} of {len(intervals)}", right == len(intervals)),
        Check(
            f"pooled coverage of {len(together)} draws inside its cluster-bootstrap band",
            f"{coverage:.4f} in {low:.4f} to {high:.4f}; {robust} robust, {lost} not converged",
            low <= coverage <= high,
        ),
    ]


def wrong_model(count: int, folder: Path) -> list[Check]:
    """Measure the coverage of the best-fitting parameters of a wrong model."""
    best = best_fitting(folder)
    draws = draws_of(WRONG, lambda k: drawn(wrong_problem(WRONG_SEED + k, calibration.SECONDS), best), count, folder)
    intervals = intervals_of(WRONG, draws)
    low, high = MISFIT_BAND
    warned = sum(draw["warned"] for draw in draws)
    told = ", ".join(f"{item.name} {item.hits / item.draws:.3f}" for item in intervals)
    inside = all(low <= item.hits / item.draws <= high for item in intervals)
    line = f"wrong model: sandwich intervals cover in {low:.0%} to {high:.0%}, and the report says why"
    return [Check(line, f"{told}; {warned} of {count} warn of it", inside and warned == count)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print both tables; 1 where a line fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=500, help="of each law")
    parser.add_argument("--wrong", type=int, default=200, help="draws of the wrong model")
    parser.add_argument("--only", choices=LAWS, help="one law")
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args(arguments)
    laws = [options.only] if options.only else list(LAWS)
    checks = right_models(laws, options.draws, options.out) if options.draws else []
    if options.wrong:
        checks += wrong_model(options.wrong, options.out)
    return tell_status(checks)


assert set(LAWS.values()) <= set(TRUTH)

if __name__ == "__main__":
    raise SystemExit(main())
