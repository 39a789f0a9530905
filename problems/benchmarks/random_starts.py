"""Does a fit reach the same optimum from wherever it starts?

python problems/benchmarks/random_starts.py [PROBLEM ...] [--starts 20] [--seed 1] [--quick]

Each start moves every fitted parameter by a factor of up to sqrt(10), log-uniform (by a tenth of its bounds where the
guess is zero). A start succeeds where its objective is within 0.1 % of the best one and its parameters are within 0.1
standard error of the best ones. A parameter that strays although its verdict said so (traded, not identifiable, at a
bound) is a flat direction with a name, and is listed.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from checks import Check, print_rows, tell_status
from parameter_box import FloatArray, ParameterBox

from friction_ocp.estimation.estimate import conclude
from friction_ocp.estimation.fit import settled
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.rounds import Fitted
from friction_ocp.estimation.stages import mean_error
from friction_ocp.problem_file.load import load_problem

XL330 = Path(__file__).parents[1] / "xl330"
DEFAULT = tuple(XL330 / f"{name}.yaml" for name in ("coulomb_viscous", "stribeck", "load_dependent", "stribeck_load"))
SAME_OBJECTIVE = 1e-3
SAME_PARAMETER = 0.1
"""Of a standard error."""
NEEDED = 0.95
FLAT = ("traded", "not_identifiable", "at_bound")


@dataclass(frozen=True)
class Job:
    """One start of one problem."""

    problem: Path
    seed: int
    number: int


@dataclass(frozen=True)
class End:
    """Where one start led."""

    theta: FloatArray
    objective: float
    seconds: float
    converged: bool
    message: str
    std_error: FloatArray
    verdicts: tuple[str, ...]


@dataclass(frozen=True)
class Summary:
    """What all starts of one problem led to."""

    problem: str
    starts: int
    same_objective: int
    successes: int
    converged: int
    best: float
    worst_excess: float
    """Largest objective over the best, less 1."""
    flat: tuple[str, ...]
    """Parameters that strayed along a direction that the verdicts name."""
    strayed: tuple[str, ...]
    """Parameters that strayed and were not flagged, among starts with the same objective."""
    median_seconds: float
    worst_seconds: float

    @property
    def passed(self) -> bool:
        """Whether enough starts succeeded."""
        return self.successes >= NEEDED * self.starts


@lru_cache(maxsize=1)
def prepared(problem: Path) -> Model:
    """Return the model of a problem, made once in each process."""
    return prepare(load_problem(problem))


def run_start(job: Job) -> End:
    """Fit from one random start, on one processor."""
    os.environ["FRICTION_OCP_THREADS"] = "1"
    model = prepared(job.problem)
    box = ParameterBox(model.space)
    start = box.repaired(box.random_start(np.random.default_rng([job.seed, job.number])))
    began = time.perf_counter()
    moved = replace(model, space=model.space.moved(start))
    moved, fitted = settled(moved)
    seconds = time.perf_counter() - began
    estimate = conclude(moved, fitted, 0.0, seconds)
    return End(
        theta=fitted.solution.point.theta,
        objective=comparable_objective(fitted, model.problem.estimation.loss),
        seconds=seconds,
        converged=fitted.solution.converged,
        message=fitted.solution.message,
        std_error=estimate.uncertainty.std_error,
        verdicts=tuple(item.verdict.word for item in estimate.parameters),
    )


def comparable_objective(fitted: Fitted, loss: str) -> float:
    """Return the objective without the rounding of the absolute loss, which differs from fit to fit."""
    if loss == "absolute":
        return mean_error(fitted.program, fitted.solution.point)
    return fitted.solution.objective


def strays(end: End, best: End) -> FloatArray:
    """Return which parameters are further than a tenth of a standard error from the best ones."""
    distance = np.abs(end.theta - best.theta)
    known = np.isfinite(best.std_error)
    return np.where(known, distance > SAME_PARAMETER * best.std_error, distance > 1e-6 * (np.abs(best.theta) + 1e-12))


def summarise(problem: str, names: Sequence[str], ends: Sequence[End]) -> Summary:
    """Compare all ends with the best one."""
    best = min(ends, key=lambda end: end.objective)
    flagged = np.array([word in FLAT for word in best.verdicts])
    same = [end for end in ends if end.objective <= best.objective * (1.0 + SAME_OBJECTIVE)]
    astray = np.array([strays(end, best) for end in same])
    seconds = [end.seconds for end in ends]
    return Summary(
        problem=problem,
        starts=len(ends),
        same_objective=len(same),
        successes=int(np.sum(~np.any(astray & ~flagged, axis=1))),
        converged=sum(end.converged for end in ends),
        best=best.objective,
        worst_excess=max(end.objective for end in ends) / best.objective - 1.0,
        flat=_chosen(names, np.any(astray & flagged, axis=0)),
        strayed=_chosen(names, np.any(astray & ~flagged, axis=0)),
        median_seconds=float(np.median(seconds)),
        worst_seconds=max(seconds),
    )


def _chosen(names: Sequence[str], mask: FloatArray) -> tuple[str, ...]:
    return tuple(name for name, take in zip(names, mask, strict=True) if take)


def run_problem(problem: Path, starts: int, seed: int, pool: ProcessPoolExecutor) -> Summary:
    """Fit one problem from all starts and print those that fail."""
    names = prepared(problem).space.names
    ends = list(pool.map(run_start, [Job(problem, seed, number) for number in range(starts)]))
    summary = summarise(f"{problem.parent.name}/{problem.stem}", names, ends)
    for number, end in enumerate(ends):
        excess = end.objective / summary.best - 1.0
        if excess > SAME_OBJECTIVE or not end.converged:
            print(f"{summary.problem}, start {number}: {100 * excess:.2f} % above the best; {end.message}")
    print(f"{summary.problem}: {measured(summary)}", flush=True)
    return summary


HEADER = (
    "problem",
    "best objective",
    "same objective",
    "and parameters",
    "converged",
    "worst excess",
    "median s",
    "worst s",
)


def row(item: Summary) -> tuple[str, ...]:
    """Return one row of the table."""
    counts = (item.same_objective, item.successes, item.converged)
    return (
        item.problem,
        f"{item.best:.6g}",
        *(f"{count} of {item.starts}" for count in counts),
        f"{100 * item.worst_excess:.2f} %",
        f"{item.median_seconds:.2f}",
        f"{item.worst_seconds:.2f}",
    )


def measured(item: Summary) -> str:
    """Return what a check says about a problem."""
    text = f"{item.successes} of {item.starts}"
    if item.flat:
        text += f"; flat, and named so: {', '.join(item.flat)}"
    if item.strayed:
        text += f"; strayed at the same objective: {', '.join(item.strayed)}"
    return text


def compare(problems: Sequence[Path], starts: int, seed: int) -> list[Check]:
    """Run all problems and print the table."""
    summaries: list[Summary] = []
    for problem in problems:
        with ProcessPoolExecutor(2) as pool:
            summaries.append(run_problem(problem.resolve(), starts, seed, pool))
    print()
    print_rows(HEADER, [row(item) for item in summaries])
    return [Check(f"{item.problem}: same optimum", measured(item), item.passed) for item in summaries]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table and the lines; 1 where one fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "problems", nargs="*", type=Path, metavar="PROBLEM", help="files; the four of the XL330 if none"
    )
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="four starts, one problem")
    options = parser.parse_args(arguments)
    problems = options.problems or (DEFAULT[:1] if options.quick else DEFAULT)
    return tell_status(compare(problems, min(4, options.starts) if options.quick else options.starts, options.seed))


if __name__ == "__main__":
    raise SystemExit(main())
