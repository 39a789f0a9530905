"""The XL330 servo: does `identify` find the best free run, or does CMA-ES?

python problems/benchmarks/xl330_cmaes.py [MODEL ...] [--evaluations 10000] [--quick]

Both minimise the mean absolute position error of the free run over the training recordings, with the same compiled
simulator, start, bounds and constraints; `identify` rounds |error| off below a hundredth of its mean. CMA-ES is the
better of two seeds, run side by side, one processor each, with restarts until all evaluations are spent ("best at" is
the last one that gained more than 1e-6 rad); `identify` simulates on both. Code generation and compilation, which both
need once, are done beforehand and printed.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import cma
import numpy as np
from checks import Check, print_rows, tell_status
from parameter_box import FloatArray, ParameterBox

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import free_run
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.losses import Squares
from friction_ocp.simulation.sweep import Sweep

FOLDER = Path(__file__).parents[1] / "xl330"
MODELS = ("coulomb_viscous", "stribeck", "load_dependent", "stribeck_load")
SEEDS = (1, 2)
SPREAD = 0.15
"""First standard deviation of CMA-ES over the span of the bounds."""
BROKEN = 1e3
"""Objective, rad, of a simulation that breaks down."""
EQUAL = 1e-6
WORSE_VALIDATION = 1.05


@dataclass(frozen=True)
class Outcome:
    """What one method reached."""

    method: str
    train: float
    """Mean absolute error, rad."""
    validation: float
    seconds: float
    evaluations: str
    values: dict[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True)
class FreeRunError:
    """Mean absolute position error, rad, of the exact free run over some recordings."""

    program: Program

    @classmethod
    def over(cls, model: Model, experiments: tuple[Experiment, ...]) -> FreeRunError:
        """Return the error over recordings that start where they were measured to be."""
        program = free_run(model, experiments, 0.0, Squares(), None)
        assert all(cut.measured == cut.count == 1 for cut in program.segments)
        return cls(program)

    def __call__(self, theta: FloatArray) -> float:
        program = self.program
        unset = np.zeros((1, len(program.drive.state_names)))
        point = Point(theta, (unset,) * len(program.experiments))
        errors = [np.abs(program.simulate(k, point).y - item.measured) for k, item in enumerate(program.experiments)]
        return float(np.nanmean(np.concatenate(errors)))


@dataclass(frozen=True)
class Job:
    """One seed of CMA-ES."""

    problem: Path
    seed: int
    evaluations: int


class Objective:
    """The free-run error in coordinates of the bounds; remembers the best point and when it came."""

    def __init__(self, model: Model) -> None:
        self.box = ParameterBox(model.space)
        self.error = FreeRunError.over(model, model.train)
        self.best, self.best_theta = np.inf, model.space.guess
        self.evaluations, self.best_at = 0, 0

    def __call__(self, unit: FloatArray) -> float:
        """Return the error of the nearest point that obeys the constraints, plus the squared way to it."""
        theta = self.box.repaired(self.box.from_unit(np.asarray(unit)))
        value = self.error(theta)
        self.evaluations += 1
        if value < self.best - EQUAL:
            self.best_at = self.evaluations
        if value < self.best:
            self.best, self.best_theta = value, theta
        moved = float(np.sum((self.box.to_unit(theta) - unit) ** 2))
        return value + moved if np.isfinite(value) else BROKEN


def search(objective: Objective, job: Job) -> None:
    """Spend all evaluations: first from the guess, then, where CMA-ES stops before, from random points.

    Each restart doubles the population (Auger & Hansen 2005).
    """
    rng = np.random.default_rng(job.seed)
    start, population = objective.box.to_unit(objective.best_theta), 4 + int(3 * np.log(objective.best_theta.size))
    while (left := job.evaluations - objective.evaluations) >= population:
        options = {"bounds": [0, 1], "maxfevals": left, "seed": job.seed, "verbose": -9, "popsize": population}
        strategy: Any = cma.CMAEvolutionStrategy(start, SPREAD, options)
        while not strategy.stop():
            points = strategy.ask()
            strategy.tell(points, [objective(point) for point in points])
        start, population = rng.uniform(0.0, 1.0, start.size), 2 * population


def run_cmaes(job: Job) -> Outcome:
    """Minimise with one seed on one processor."""
    os.environ["FRICTION_OCP_THREADS"] = "1"
    began = time.perf_counter()
    model = prepare(load_problem(job.problem))
    objective = Objective(model)
    search(objective, job)
    seconds = time.perf_counter() - began
    theta = objective.best_theta
    validation = FreeRunError.over(model, model.validation)(theta)
    evaluations = f"{objective.evaluations} (best at {objective.best_at})"
    return Outcome("CMA-ES", objective.best, validation, seconds, evaluations, _named(model, theta))


def best_of_seeds(problem: Path, evaluations: int, pool: ProcessPoolExecutor) -> Outcome:
    """Run the seeds side by side; the time is that of the slower one."""
    runs = list(pool.map(run_cmaes, [Job(problem, seed, evaluations) for seed in SEEDS]))
    best = min(runs, key=lambda run: run.train)
    seconds = max(run.seconds for run in runs)
    evaluations_of_all = " + ".join(run.evaluations for run in runs)
    return Outcome(best.method, best.train, best.validation, seconds, evaluations_of_all, best.values)


def run_identify(problem: Path) -> Outcome:
    """Fit with the package; the time includes preparation, uncertainty and the final free runs."""
    with counted_sweeps() as counts:
        began = time.perf_counter()
        estimate = identify(load_problem(problem))
        seconds = time.perf_counter() - began
    model = prepare(estimate.problem)
    theta = np.array([estimate.values[name] for name in model.space.names])
    train, validation = (FreeRunError.over(model, group)(theta) for group in (model.train, model.validation))
    recordings = len(model.train)
    evaluations = f"{counts[False] // recordings} + {counts[True] // recordings} with derivatives"
    return Outcome("identify", train, validation, seconds, evaluations, _named(model, theta))


@contextmanager
def counted_sweeps() -> Generator[dict[bool, int]]:
    """Count the recordings that are simulated meanwhile, without and with derivatives."""
    counts, original = {False: 0, True: 0}, Sweep.run_many

    def counting(self: Sweep, requests: Sequence[Any]) -> Any:
        for request in requests:
            counts[bool(request.derivatives)] += 1
        return original(self, requests)

    with patch.object(Sweep, "run_many", counting):
        yield counts


def _named(model: Model, theta: FloatArray) -> dict[str, float]:
    return dict(zip(model.space.names, (float(value) for value in theta), strict=True))


def compile_beforehand(problem: Path) -> float:
    """Return the seconds that code generation and compilation take; little where the code is in the cache."""
    began = time.perf_counter()
    prepare(load_problem(problem))
    return time.perf_counter() - began


def judge(model: str, ours: Outcome, theirs: Outcome) -> list[Check]:
    """Compare the two methods: training, validation, time."""
    return [
        Check(
            f"{model}: training no worse",
            f"{ours.train:.6f} rad, CMA-ES {theirs.train:.6f} rad",
            ours.train <= theirs.train + EQUAL,
        ),
        Check(
            f"{model}: validation within 5 %",
            f"{ours.validation:.6f} rad, CMA-ES {theirs.validation:.6f} rad",
            ours.validation <= WORSE_VALIDATION * theirs.validation,
        ),
        Check(
            f"{model}: no more time",
            f"{ours.seconds:.2f} s, CMA-ES {theirs.seconds:.2f} s",
            ours.seconds <= theirs.seconds,
        ),
    ]


HEADER = ("model", "method", "MAE training, rad", "MAE validation, rad", "s", "evaluations")


def row(model: str, run: Outcome) -> tuple[str, ...]:
    """Return one row of the table."""
    return (model, run.method, f"{run.train:.6f}", f"{run.validation:.6f}", f"{run.seconds:.2f}", run.evaluations)


def compare(models: Sequence[str], evaluations: int) -> list[Check]:
    """Run both methods on every model and print the table."""
    checks: list[Check] = []
    rows: list[tuple[str, ...]] = []
    for model in models:
        problem = FOLDER / f"{model}.yaml"
        print(f"{model}: code made and compiled in {compile_beforehand(problem):.2f} s", flush=True)
        with ProcessPoolExecutor(len(SEEDS)) as pool:
            theirs = best_of_seeds(problem, evaluations, pool)
        ours = run_identify(problem)
        rows += [row(model, ours), row(model, theirs)]
        for run in (ours, theirs):
            print("  ", run.method, ", ".join(f"{name} {value:.5g}" for name, value in run.values.items()))
        checks += judge(model, ours, theirs)
    print()
    print_rows(HEADER, rows)
    return checks


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table and the lines; 1 where one fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", metavar="MODEL", help=", ".join(MODELS))
    parser.add_argument("--evaluations", type=int, default=10_000, help="of each of the two seeds")
    parser.add_argument("--quick", action="store_true", help="500 evaluations, one model")
    options = parser.parse_args(arguments)
    models = options.models or (MODELS[:1] if options.quick else MODELS)
    return tell_status(compare(models, 500 if options.quick else options.evaluations))


if __name__ == "__main__":
    raise SystemExit(main())
