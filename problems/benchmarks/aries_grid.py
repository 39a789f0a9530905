"""The ARIES telescope's friction in two steps and by grid search, against one call of identify on the same runs.

python problems/benchmarks/aries_grid.py [--direction east_west] [--picture FILE]

Two steps, as the paper has them ("steps, all"): the Stribeck curve fitted to the averaged runs (eqs. 8, 9; all 30
speeds, limit cycles included), then sigma0 and sigma1 from the second-order response to steps of 50 N m (eqs. 12 to
15), the inertia known. "Even" is the same from the runs alone that are no limit cycles, as identify has them.
The grid: with the same curve and the inertia known, the LuGre model is simulated over the small torque steps for seven
values of sigma0 and sigma1 each, spaced evenly in the logarithm over the bounds of the problem. Refinement: seven
values each again between the neighbours of the best one, until the spacing is below a hundredth. An evaluation is one
simulation of one recording; a sweep with sensitivities counts 1 + parameters.

Identify fits all eight numbers, the inertia included, from curve, steps, ramp and motion. Errors are means of the
seven relative errors against the plant; held-out is the free run over other steps.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from tracing import Curve, Trace, counted, draw

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.progress import Report
from friction_ocp.estimation.stages import free_run
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import read_recording
from friction_ocp.simulation.losses import Squares

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "problems" / "aries")]

import aries  # noqa: E402
import two_step  # noqa: E402

VALUES, FINEST = 7, 1e-2
SIDES = {"east_west": 0, "west_east": 1}
JUDGED = ("tau_c", "tau_s", "omega_s", "delta", "sigma0", "sigma1", "sigma2")
Numbers = Mapping[str, float]


def truth_of(direction: str) -> dict[str, float]:
    """Return the plant's numbers of a direction."""
    side = {name: values[SIDES[direction]] for name, values in aries.NUMBERS.items()}
    side["sigma2"] = side.pop("viscous")
    return side | {"delta": aries.DELTA}


def error_of(found: Numbers, truth: Numbers) -> float:
    """Return the mean relative error of the seven numbers of the friction."""
    return float(np.mean([abs(found[name] / truth[name] - 1.0) for name in JUDGED]))


@dataclass(frozen=True)
class FreeRun:
    """The free run over one recording for any numbers of the friction."""

    model: Model
    program: Program

    @classmethod
    def over(cls, problem: Problem, name: str) -> FreeRun:
        """Prepare the free run over one of a problem's recordings."""
        use = next(use for use in problem.recordings if use.name == name)
        alone = replace(problem, train=(use,), validation=(), static=(), static_validation=())
        model = prepare(alone)
        return cls(model, free_run(model, model.train, 0.0, Squares(), None))

    def rms(self, numbers: Numbers) -> float:
        """Return the root mean square of the error of the angle, rad."""
        theta = np.array([numbers[name.rpartition(".")[2]] for name in self.model.space.names])
        point = suggested_point(self.program, theta)
        errors = self.program.simulate(0, point).y[:, 0] - self.model.train[0].measured[:, 0]
        return float(np.sqrt(np.nanmean(errors**2)))


def grid_search(steps: FreeRun, known: Numbers, trace: Trace, truth: Numbers) -> dict[str, float]:
    """Return the numbers with the best sigma0 and sigma1 of the grid and its refinements."""
    place = [steps.model.space.names.index(f"axis.friction.{name}") for name in ("sigma0", "sigma1")]
    bounds = [(np.log(steps.model.space.lower[k]), np.log(steps.model.space.upper[k])) for k in place]
    ranges, best, least = list(bounds), dict(known), np.inf
    while True:
        first, second = (np.exp(np.linspace(low, high, VALUES)) for low, high in ranges)
        for sigma0 in first:
            for sigma1 in second:
                numbers = dict(known) | {"sigma0": float(sigma0), "sigma1": float(sigma1)}
                misfit = steps.rms(numbers)
                if misfit < least:
                    best, least = numbers, misfit
                trace.note(error_of(best, truth))
        spacing = [(high - low) / (VALUES - 1) for low, high in ranges]
        if max(spacing) < FINEST:
            return best
        centres = [np.log(best["sigma0"]), np.log(best["sigma1"])]
        ranges = [
            (max(centre - gap, low), min(centre + gap, high))
            for centre, gap, (low, high) in zip(centres, spacing, bounds, strict=True)
        ]


@dataclass(frozen=True)
class Way:
    """One way to the numbers: what it costs and where it ends."""

    name: str
    numbers: Numbers
    seconds: float
    held_out: float
    """rms of the free run over other steps, rad."""
    trace: Trace | None = None


def contest(direction: str) -> list[Way]:
    """Run all ways on the runs of one direction; identify is the last."""
    folder = ROOT / "problems" / "aries"
    problem, truth = load_problem(folder / f"joint_{direction}.yaml"), truth_of(direction)
    steps, others = (FreeRun.over(problem, f"{name}_{direction}") for name in ("steps", "steps_again"))
    others.rms(truth | {"inertia": aries.INERTIA})  # compiles the model, so that no way is charged for it
    small = read_recording(ROOT / "data" / "aries" / f"small_steps_{direction}.h5")
    ways: list[Way] = []
    for curve, word in (("curve_all", "all"), ("curve", "even")):
        begun = time.perf_counter()
        known = two_step.static_numbers(load_problem(folder / f"{curve}_{direction}.yaml"))
        known |= {"inertia": aries.INERTIA}
        static_seconds = time.perf_counter() - begun
        numbers = known | two_step.second_order(small, aries.INERTIA, known["sigma2"])
        ways.append(Way(f"steps, {word}", numbers, time.perf_counter() - begun, others.rms(numbers)))
        trace = Trace()
        trace.begun -= static_seconds
        restore = counted(trace)
        numbers = grid_search(steps, known, trace, truth)
        restore()
        ways.append(Way(f"grid, {word}", numbers, trace.points[-1][1], others.rms(numbers), trace))
    trace, numbers = identified(problem, truth)
    return [*ways, Way("identify", numbers, trace.points[-1][1], others.rms(numbers), trace)]


def identified(problem: Problem, truth: Numbers) -> tuple[Trace, dict[str, float]]:
    """Return what one call of identify costs, and its numbers."""
    names = [name.rpartition(".")[2] for name in prepare(problem).space.names]
    trace = Trace()
    restore = counted(trace)

    def watch(report: Report) -> None:
        trace.note(error_of(dict(zip(names, report.point.theta, strict=True)), truth))

    values = identify(problem, watch).values
    restore()
    numbers = {name.rpartition(".")[2]: value for name, value in values.items()}
    trace.note(error_of(numbers, truth))
    return trace, numbers


def rows(ways: Sequence[Way], truth: Numbers) -> list[str]:
    """Return the table."""
    best = min(error_of(way.numbers, truth) for way in ways if way.name.startswith("grid"))
    reached = [way.trace.until(best) if way.trace and error_of(way.numbers, truth) <= best else None for way in ways]
    lines = [
        _row("", [way.name for way in ways]),
        _row("evaluations to the best grid's error", ["-" if at is None else f"{at[0]}" for at in reached]),
        _row("seconds to the best grid's error", ["-" if at is None else f"{at[1]:.1f}" for at in reached]),
        _row("evaluations in all", [f"{way.trace.evaluations}" if way.trace else "-" for way in ways]),
        _row("seconds in all", [f"{way.seconds:.1f}" for way in ways]),
        _row("mean relative error at the end", [f"{error_of(way.numbers, truth):.2%}" for way in ways]),
        _row("held-out rms, microrad", [f"{1e6 * way.held_out:.3f}" for way in ways]),
    ]
    errors = [two_step.errors_of(way.numbers, {**truth, "inertia": aries.INERTIA}) for way in ways]
    lines += [_row(f"error of {name}", [f"{error[name]:.2%}" for error in errors]) for name in (*JUDGED, "inertia")]
    return lines


def _row(name: str, cells: Sequence[str]) -> str:
    return f"{name:38}" + "".join(f"{cell:>12}" for cell in cells)


def curves_of(ways: Sequence[Way], truth: Numbers) -> list[Curve]:
    """Return error over evaluations, and the levels of the two steps."""
    colours = ("tab:red", "tab:orange", "tab:purple", "tab:green", "tab:blue")
    return [
        Curve(colour, way.name, way.trace, error_of(way.numbers, truth))
        for way, colour in zip(ways, colours, strict=True)
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--direction", choices=SIDES, default="east_west")
    parser.add_argument("--picture", type=Path, default=None)
    asked = parser.parse_args()
    print(f"{asked.direction}; grid: {VALUES} x {VALUES} values, refined between neighbours to {FINEST:g}, logarithmic")
    ways, truth = contest(asked.direction), truth_of(asked.direction)
    print("\n".join(rows(ways, truth)))
    if asked.picture is not None:
        draw(curves_of(ways, truth), "the seven numbers", asked.picture)


if __name__ == "__main__":
    main()
