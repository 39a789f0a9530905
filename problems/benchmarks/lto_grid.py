"""The Leighton telescope's friction by grid search, as in its paper, against one call of identify on the same data.

python problems/benchmarks/lto_grid.py [--seed 1] [--draws 5] [--picture FILE]

The grid: Tables 2 and 3 vary c0h over [0, c0] and R c1l over [0, c2] (eq. 10 with c2h >= 0); the other numbers follow
from the curve by eq. 9, the stiffness is that of Table 1, and the stop response is compared with the measured one.
Spacing: seven values of each. Refinement, as the search for the least distance of eq. 15: seven values of each again
between the neighbours of the best one, until a spacing is below a thousandth of its range. "Grid, K" searches the
stiffness, too, seven values evenly in the logarithm over the bounds that identify has: the plant's is that of Table 1
to the last digit, which no telescope's is, and identify is not told it.

Identify fits all eight numbers, stiffness and scale of the accelerometer included, from curve, start and stop. An
evaluation is one simulation of one recording; a sweep with sensitivities counts 1 + parameters. What a grid reaches is
the error of the point that it ends with: it cannot know which of those that it passed was nearest to the truth. Its
cost is that until its error stays as small; that of identify likewise.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from tracing import Curve, Trace, counted, draw

from friction_ocp.estimation.agreement import curve_distance
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import Problem, RecordingUse, StaticUse
from friction_ocp.estimation.program import Program
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

    def values(self, c0h: float, slow_viscous: float, stiffness: float = DATA.leighton.STIFFNESS) -> Numbers:
        """Return all parameters by eq. 9; the scale of the accelerometer follows from the curve's peak."""
        c = self.curve
        return {
            "motor.friction.tau_c": c0h,
            "motor.friction.slopes.0": c["c1"] - slow_viscous,
            "motor.friction.slopes.1": c["c2"] - slow_viscous,
            "motor.friction.breaks.0": c["break"],
            "load.friction.tau_c": RATIO * (c["c0"] - c0h),
            "load.friction.viscous": RATIO**2 * slow_viscous,
            "motor-load.stiffness": stiffness,
            "acceleration.gain": 1.0,
        }

    def misfit(self, values: Numbers) -> float:
        """Return the distance d of eq. 15, both curves scaled to equal rms: the accelerometer's scale is unknown."""
        theta = np.array([values[name] for name in self.model.space.names])
        point = suggested_point(self.program, theta)
        simulated = self.program.simulate(0, point).y[:, 0]
        scale = np.sqrt(np.mean(self.measured**2) / max(float(np.mean(simulated**2)), 1e-12))
        window = (self.time > DATA.STOP_AT - 0.05) & (self.time < DATA.STOP_AT + 3.0)
        return curve_distance(self.time[window], self.measured[window], scale * simulated[window])

    def search(self, trace: Trace, truth: Numbers, stiffness: bool) -> Numbers:
        """Return the best parameters of the grid and its refinements; `stiffness` searches that one, too."""
        spans = [(0.0, self.curve["c0"]), (0.0, self.curve["c2"])]
        if stiffness:
            k = self.model.space.names.index("motor-load.stiffness")
            spans.append((np.log(self.model.space.lower[k]), np.log(self.model.space.upper[k])))
        ranges, best, best_misfit = spans, (0.0, 0.0), np.inf
        while True:
            for place in itertools.product(*(np.linspace(low, high, VALUES) for low, high in ranges)):
                misfit = self.misfit(self._at(place))
                if misfit < best_misfit:
                    best, best_misfit = place, misfit
                trace.note(error_of(self._at(best), truth))
            spacing = [(high - low) / (VALUES - 1) for low, high in ranges]
            if all(gap < FINEST * (high - low) for gap, (low, high) in zip(spacing, spans, strict=True)):
                return self._at(best)
            ranges = [
                (max(centre - gap, low), min(centre + gap, high))
                for centre, gap, (low, high) in zip(best, spacing, spans, strict=True)
            ]

    def _at(self, place: Sequence[float]) -> Numbers:
        """Return all parameters at a point of the grid: c0h, R c1l and, where it is searched, log K."""
        c0h, slow_viscous, *log_stiffness = (float(value) for value in place)
        return self.values(c0h, slow_viscous, *np.exp(log_stiffness))


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
class Way:
    """One way to the numbers: what it cost and where it ended."""

    points: list[tuple[int, float, float]]
    """Evaluations, seconds and error of the best parameters so far."""
    values: Numbers
    distance: float
    """d of eq. 15 on the stop."""
    held_out: float
    """rms error on another stop, rad/s^2."""

    @property
    def error(self) -> float:
        """Mean relative error of the judged numbers at the end."""
        return self.points[-1][2]


@dataclass(frozen=True)
class Contest:
    """All ways on one draw, by name; identify is the last."""

    ways: dict[str, Way]
    truth: Numbers

    def cost(self, grid: str, way: str) -> tuple[float, float]:
        """Return evaluations and seconds that a way needs to where a grid ends; infinite where it never gets there."""
        level, trace = self.ways[grid].error, Trace(points=self.ways[way].points)
        return trace.until(level) if self.ways[way].error <= level else (np.inf, np.inf)


GRIDS = ("grid", "grid, K")


def contest(seed: int) -> Contest:
    """Run all ways on one draw of the data."""
    telescope = DATA.high_speed_polyline()
    base = load_problem(ROOT / "problems" / "lto" / "joint.yaml")
    uses = tuple(
        RecordingUse(DATA.response(telescope, kind, seed + k, kind)) for k, kind in enumerate(("start", "stop"))
    )
    again = (RecordingUse(DATA.response(telescope, "stop", seed + 5, "stop_again")),)
    points = (StaticUse(DATA.curve(telescope, seed + 9)),)
    problem = replace(base, train=uses, static=points, validation=again, static_validation=())
    truth = telescope.truth | {"acceleration.gain": DATA.ACCELEROMETER_GAIN}
    searching = GridSearch.of(problem, polyline_of(problem))
    prepare(problem)  # compiles the model, so that no way is charged for it
    found: dict[str, tuple[Trace, Numbers]] = {}
    for name, stiffness in zip(GRIDS, (False, True), strict=True):
        trace = Trace()
        restore = counted(trace)
        found[name] = trace, searching.search(trace, truth, stiffness)
        restore()
    found["identify"] = _identified(problem, truth)
    gain = {"acceleration.gain": found["identify"][1]["acceleration.gain"]}
    ways = {
        name: Way(trace.points, values, searching.misfit(values), _held_out(problem, values | gain))
        for name, (trace, values) in found.items()
    }
    return Contest(ways, truth)


def _identified(problem: Problem, truth: Numbers) -> tuple[Trace, Numbers]:
    """Return what one call of identify costs, and its numbers."""
    names, trace = prepare(problem).space.names, Trace()
    restore = counted(trace)

    def watch(report: Report) -> None:
        if report.point.theta.size == len(names):
            trace.note(error_of(dict(zip(names, report.point.theta, strict=True)), truth))

    values = dict(identify(problem, watch).values)
    restore()
    trace.note(error_of(values, truth))
    return trace, values


def _held_out(problem: Problem, values: Numbers) -> float:
    model = prepare(replace(problem, train=problem.validation, validation=(), static=(), static_validation=()))
    program = free_run(model, model.train, 0.0, Squares(), None)
    theta = np.array([values[name] for name in model.space.names])
    errors = program.simulate(0, suggested_point(program, theta)).y[:, 0] - model.train[0].measured[:, 0]
    return float(np.sqrt(np.nanmean(errors**2)))


def kept(found: Contest) -> dict[str, Any]:
    """Return a contest as JSON has it."""
    return asdict(found)


def read(record: Mapping[str, Any]) -> Contest:
    """Return the contest that a record holds."""
    ways = {
        name: Way(**way | {"points": [tuple(point) for point in way["points"]]}) for name, way in record["ways"].items()
    }
    return Contest(ways, record["truth"])


def shares(contests: Sequence[Contest]) -> dict[str, tuple[float, float]]:
    """Return by grid the median share of its evaluations, and of its time, that identify needs to where it ends."""
    return {
        grid: tuple(
            float(np.median([c.cost(grid, "identify")[k] / c.cost(grid, grid)[k] for c in contests])) for k in (0, 1)
        )
        for grid in GRIDS
    }


def rows(contests: Sequence[Contest]) -> list[str]:
    """Return the table, medians over the draws."""
    names = tuple(contests[0].ways)

    def line(text: str, cell: Callable[[Contest, str], float], form: str = ".4g", ways: Sequence[str] = names) -> str:
        cells = [
            format(float(np.median([cell(c, way) for c in contests])), form) if way in ways else "" for way in names
        ]
        return f"{text:38}" + "".join(f"{text:>12}" for text in cells)

    lines = [f"{'':38}" + "".join(f"{name:>12}" for name in names)]
    for grid in GRIDS:
        for k, what in enumerate(("evaluations", "seconds")):
            text = f"{what} to the end of {grid}"
            lines.append(line(text, lambda c, way, k=k, g=grid: c.cost(g, way)[k], ways=(grid, "identify")))
    lines += [
        line("evaluations in all", lambda c, way: c.ways[way].points[-1][0]),
        line("seconds in all", lambda c, way: c.ways[way].points[-1][1]),
        line("mean relative error at the end", lambda c, way: c.ways[way].error, ".2%"),
        line("distance d of eq. 15", lambda c, way: c.ways[way].distance),
        line("held-out rms, rad/s^2", lambda c, way: c.ways[way].held_out),
    ]
    for name in JUDGED:
        lines.append(line(f"error of {name}", lambda c, way, name=name: _off(c, way, name), ".2%"))
    return lines


def _off(found: Contest, way: str, name: str) -> float:
    return abs(numbers_of(found.ways[way].values)[name] / numbers_of(found.truth)[name] - 1.0)


def curves_of(contests: Sequence[Contest]) -> list[Curve]:
    """Return error over evaluations of all ways; the first contest names them."""
    colours = ("tab:orange", "tab:red", "tab:blue")
    return [
        Curve(colour, name if index == 0 else None, way)
        for index, item in enumerate(contests)
        for (name, way), colour in zip(item.ways.items(), colours, strict=True)
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--draws", type=int, default=5)
    parser.add_argument("--picture", type=Path, default=None)
    asked = parser.parse_args()
    print(f"grid: {VALUES} values of each, refined between neighbours to {FINEST:g} of the range; seed {asked.seed}")
    contests = [contest(5000 * asked.seed + 100 * k) for k in range(asked.draws)]
    print("\n".join(rows(contests)))
    if asked.picture is not None:
        draw(curves_of(contests), "c0h c1h c2h R c0l R c1l", asked.picture)


if __name__ == "__main__":
    main()
