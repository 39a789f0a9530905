"""The Leighton telescope's friction by grid search, as in its paper, against one call of identify on the same data.

python problems/benchmarks/lto_grid.py [--seed 1] [--draws 5] [--picture FILE]

The grid: Tables 2 and 3 vary c0h over [0, c0] and R c1l over [0, c2] (eq. 10 with c2h >= 0); the other numbers follow
from the curve by eq. 9, the stiffness is that of Table 1, and the stop response is compared with the measured one.
Spacing: seven values of each. Refinement, as the search for the least distance of eq. 15: seven values of each again
between the neighbours of the best one, until a spacing is below a thousandth of its range. An evaluation is one
simulation of one recording; a sweep with sensitivities counts 1 + parameters.

Identify fits all eight numbers, stiffness and scale of the accelerometer included, from curve, start and stop.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np
from tracing import Trace, counted

from friction_ocp.estimation.agreement import curve_distance
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import Problem, RecordingUse, StaticUse
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Report
from friction_ocp.estimation.stages import free_run
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.losses import Squares

HERE = Path(__file__).resolve()
ROOT = HERE.parents[2]
VALUES, FINEST = 7, 1e-3
JUDGED = ("c0h", "c1h", "c2h", "R c0l", "R c1l")
Numbers = dict[str, float]


def make_data() -> ModuleType:
    """Import the script that makes the data."""
    path = ROOT / "problems" / "lto" / "make_data.py"
    spec = importlib.util.spec_from_file_location("lto_make_data", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


DATA = make_data()
RATIO = DATA.leighton.RATIO


def numbers_of(values: Numbers) -> Numbers:
    """Return the paper's numbers of the parameters of problems/lto/joint.yaml."""
    return {
        "c0h": values["motor.friction.tau_c"],
        "c1h": values["motor.friction.slopes.0"],
        "c2h": values["motor.friction.slopes.1"],
        "R c0l": values["load.friction.tau_c"] / RATIO,
        "R c1l": values["load.friction.viscous"] / RATIO**2,
    }


def error_of(values: Numbers, truth: Numbers) -> float:
    """Return the mean relative error of the judged numbers."""
    found, wanted = numbers_of(values), numbers_of(truth)
    return float(np.mean([abs(found[name] - wanted[name]) / abs(wanted[name]) for name in JUDGED]))


@dataclass(frozen=True)
class GridSearch:
    """What a grid search needs: the model, the numbers of the curve, and the known stiffness."""

    model: Model
    curve: Numbers
    program: Program
    measured: np.ndarray
    time: np.ndarray

    @classmethod
    def of(cls, problem: Problem, curve: Numbers) -> GridSearch:
        """Prepare the search on the stop response alone."""
        stop = tuple(use for use in problem.train if use.name == "stop")
        model = prepare(replace(problem, train=stop, static=(), validation=(), static_validation=()))
        program = free_run(model, model.train, 0.0, Squares(), None)
        return cls(model, curve, program, model.train[0].measured[:, 0], model.train[0].grid.time)

    def values(self, c0h: float, slow_viscous: float) -> Numbers:
        """Return all parameters by eq. 9; the scale of the accelerometer follows from the curve's peak."""
        c = self.curve
        return {
            "motor.friction.tau_c": c0h,
            "motor.friction.slopes.0": c["c1"] - slow_viscous,
            "motor.friction.slopes.1": c["c2"] - slow_viscous,
            "motor.friction.breaks.0": c["break"],
            "load.friction.tau_c": RATIO * (c["c0"] - c0h),
            "load.friction.viscous": RATIO**2 * slow_viscous,
            "motor-load.stiffness": DATA.leighton.STIFFNESS,
            "acceleration.gain": 1.0,
        }

    def misfit(self, values: Numbers) -> float:
        """Return the distance d of eq. 15, both curves scaled to equal rms: the accelerometer's scale is unknown."""
        theta = np.array([values[name] for name in self.model.space.names])
        point = Point(theta, self.program.suggested_nodes(theta))
        simulated = self.program.simulate(0, point).y[:, 0]
        scale = np.sqrt(np.mean(self.measured**2) / max(float(np.mean(simulated**2)), 1e-12))
        window = (self.time > DATA.STOP_AT - 0.05) & (self.time < DATA.STOP_AT + 3.0)
        return curve_distance(self.time[window], self.measured[window], scale * simulated[window])

    def search(self, trace: Trace, truth: Numbers) -> Numbers:
        """Return the best parameters of the grid and its refinements."""
        ranges = [(0.0, self.curve["c0"]), (0.0, self.curve["c2"])]
        spans = [high - low for low, high in ranges]
        best, best_misfit = self.values(*(low for low, _ in ranges)), np.inf
        while True:
            axes = [np.linspace(low, high, VALUES) for low, high in ranges]
            for c0h in axes[0]:
                for slow_viscous in axes[1]:
                    values = self.values(float(c0h), float(slow_viscous))
                    misfit = self.misfit(values)
                    if misfit < best_misfit:
                        best, best_misfit = values, misfit
                    trace.note(error_of(best, truth))
            spacing = [(high - low) / (VALUES - 1) for low, high in ranges]
            if all(gap < FINEST * span for gap, span in zip(spacing, spans, strict=True)):
                return best
            centres = (best["motor.friction.tau_c"], best["load.friction.viscous"] / RATIO**2)
            ranges = [
                (max(centre - gap, 0.0), min(centre + gap, span))
                for centre, gap, span in zip(centres, spacing, spans, strict=True)
            ]


def polyline_of(problem: Problem) -> Numbers:
    """Return the numbers of eq. 6, fitted to the curve: what the paper reads off its Fig. 9."""
    estimate = identify(
        replace(load_problem(ROOT / "problems" / "lto" / "curve.yaml"), static=problem.static, static_validation=())
    )
    names = ("tau_c", "slopes.0", "slopes.1", "breaks.0")
    return dict(
        zip(("c0", "c1", "c2", "break"), (estimate.values[f"motor.friction.{name}"] for name in names), strict=True)
    )


@dataclass(frozen=True)
class Contest:
    """Both ways on one draw."""

    grid: Trace
    fit: Trace
    grid_values: Numbers
    fit_values: Numbers
    truth: Numbers
    distance: tuple[float, float]
    """d of grid and fit on the stop."""
    held_out: tuple[float, float]
    """rms error on another stop, rad/s^2."""


def contest(seed: int) -> Contest:
    """Run both ways on one draw of the data."""
    telescope = DATA.high_speed_polyline()
    base = load_problem(ROOT / "problems" / "lto" / "joint.yaml")
    uses = tuple(
        RecordingUse(DATA.response(telescope, kind, seed + k, kind)) for k, kind in enumerate(("start", "stop"))
    )
    again = (RecordingUse(DATA.response(telescope, "stop", seed + 5, "stop_again")),)
    points = (StaticUse(DATA.curve(telescope, seed + 9)),)
    problem = replace(base, train=uses, static=points, validation=again, static_validation=())
    truth = telescope.truth | {"acceleration.gain": DATA.ACCELEROMETER_GAIN}
    curve = polyline_of(problem)
    grid, restore = Trace(), (lambda: None)
    searching = GridSearch.of(problem, curve)
    prepare(problem)  # compiles the model, so that neither way is charged for it
    grid = Trace()
    restore = counted(grid)
    grid_values = searching.search(grid, truth)
    restore()
    found = Trace()
    restore = counted(found)

    def watch(report: Report) -> None:
        if report.point.theta.size == len(base_names):
            found.note(error_of(dict(zip(base_names, report.point.theta, strict=True)), truth))

    base_names = prepare(problem).space.names
    found.evaluations, found.begun = 0, time.perf_counter()
    estimate = identify(problem, watch)
    restore()
    fit_values = dict(estimate.values)
    found.note(error_of(fit_values, truth))
    gain = {"acceleration.gain": fit_values["acceleration.gain"]}
    held_out = tuple(_held_out(problem, values | gain) for values in (grid_values, fit_values))
    distance = (searching.misfit(grid_values), searching.misfit(fit_values))
    return Contest(grid, found, grid_values, fit_values, truth, distance, (held_out[0], held_out[1]))


def _held_out(problem: Problem, values: Numbers) -> float:
    model = prepare(replace(problem, train=problem.validation, validation=(), static=(), static_validation=()))
    program = free_run(model, model.train, 0.0, Squares(), None)
    theta = np.array([values[name] for name in model.space.names])
    errors = program.simulate(0, Point(theta, program.suggested_nodes(theta))).y[:, 0] - model.train[0].measured[:, 0]
    return float(np.sqrt(np.nanmean(errors**2)))


def rows(contests: Sequence[Contest]) -> list[str]:
    """Return the table, medians over the draws."""

    def median(values: Sequence[float]) -> float:
        return float(np.median(values))

    lines = [f"{'':34} {'grid':>12} {'identify':>12}"]
    best = [min(point[2] for point in item.grid.points) for item in contests]
    pairs = [(item.grid.until(level), item.fit.until(level)) for item, level in zip(contests, best, strict=True)]
    reached = [item.fit.points[-1][2] <= level for item, level in zip(contests, best, strict=True)]
    table = {
        "evaluations to the grid's best error": ([p[0][0] for p in pairs], [p[1][0] for p in pairs]),
        "seconds to the grid's best error": ([p[0][1] for p in pairs], [p[1][1] for p in pairs]),
        "evaluations in all": ([c.grid.evaluations for c in contests], [c.fit.evaluations for c in contests]),
        "mean relative error at the end": (
            [c.grid.points[-1][2] for c in contests],
            [c.fit.points[-1][2] for c in contests],
        ),
        "distance d of eq. 15": ([c.distance[0] for c in contests], [c.distance[1] for c in contests]),
        "held-out rms, rad/s^2": ([c.held_out[0] for c in contests], [c.held_out[1] for c in contests]),
    }
    lines += [f"{name:34} {median(left):12.4g} {median(right):12.4g}" for name, (left, right) in table.items()]
    lines.append(f"identify ends at or below the grid's best error in {sum(reached)} of {len(reached)} draws")
    for name in JUDGED:
        left, right = (
            median(
                [
                    abs(numbers_of(values)[name] / numbers_of(c.truth)[name] - 1.0)
                    for c, values in zip(contests, side, strict=True)
                ]
            )
            for side in ([c.grid_values for c in contests], [c.fit_values for c in contests])
        )
        lines.append(f"error of {name:25} {left:12.2%} {right:12.2%}")
    return lines


def draw(contests: Sequence[Contest], path: Path) -> None:
    """Draw error over evaluations of both ways."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 4.5))
    for index, item in enumerate(contests):
        for trace, colour, label in ((item.grid, "tab:orange", "grid"), (item.fit, "tab:blue", "identify")):
            points = np.array(trace.points)
            axes.loglog(points[:, 0], points[:, 2], color=colour, label=label if index == 0 else None)
    axes.set_xlabel("evaluations (a sensitivity sweep counts 1 + parameters)")
    axes.set_ylabel("mean relative error of c0h c1h c2h R c0l R c1l")
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=150)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--draws", type=int, default=5)
    parser.add_argument("--picture", type=Path, default=None)
    asked = parser.parse_args()
    print(f"grid: {VALUES} x {VALUES} values, refined between neighbours to {FINEST:g} of the range; seed {asked.seed}")
    contests = [contest(5000 * asked.seed + 100 * k) for k in range(asked.draws)]
    print("\n".join(rows(contests)))
    if asked.picture is not None:
        draw(contests, asked.picture)


if __name__ == "__main__":
    main()
