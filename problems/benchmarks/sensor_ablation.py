"""What each trace is worth: standard errors of problems/two_mass/joint.yaml with all traces and with each left out.

python problems/benchmarks/sensor_ablation.py. One fit with all traces, then one without each channel in turn.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.problem import Problem
from friction_ocp.problem_file.load import load_problem

PROBLEM = Path(__file__).parents[1] / "two_mass" / "joint.yaml"


@dataclass(frozen=True)
class Column:
    """One fit of the table."""

    left_out: str
    converged: bool
    values: dict[str, float]
    std_errors: dict[str, float]
    verdicts: dict[str, str]


def without(problem: Problem, name: str) -> Problem:
    """Return the problem without one output channel; the controller keeps seeing its own."""
    controller = problem.drive.controller
    if controller is not None and controller.feedback == name:
        blind = [replace(item, noise_std=1e6) if item.name == name else item for item in problem.drive.channels]
        return replace(problem, drive=replace(problem.drive, channels=tuple(blind)))
    kept = tuple(item for item in problem.drive.channels if item.name != name)
    return replace(problem, drive=replace(problem.drive, channels=kept))


def fit(left_out: str) -> Column:
    """Fit the problem without one channel; '' leaves none out."""
    problem = load_problem(PROBLEM)
    estimate = identify(without(problem, left_out) if left_out else problem)
    return Column(
        left_out,
        estimate.converged,
        {item.name: item.value for item in estimate.parameters},
        {item.name: item.std_error for item in estimate.parameters},
        {item.name: item.verdict.word for item in estimate.parameters},
    )


def measure() -> list[Column]:
    """Return the columns of the table."""
    outputs = [item.name for item in load_problem(PROBLEM).drive.outputs]
    os.environ.setdefault("FRICTION_OCP_THREADS", "1")  # two processes share two processors
    with ProcessPoolExecutor(2) as pool:
        return list(pool.map(fit, ["", *outputs]))


def table(columns: list[Column]) -> str:
    """Return the table: relative standard errors, and what the verdict is where it is not ok."""
    titles = ["all traces", *(f"no {column.left_out}" for column in columns[1:])]
    lines = [f"{'standard error over value, %':<32}" + "".join(f"{title:>26}" for title in titles)]
    for name in columns[0].values:
        cells = [_cell(column, name) for column in columns]
        lines.append(f"{name:<32}" + "".join(f"{cell:>26}" for cell in cells))
    return "\n".join(lines)


def _cell(column: Column, name: str) -> str:
    error, verdict = column.std_errors[name], column.verdicts[name]
    shown = "-" if math.isnan(error) else f"{100 * error / abs(column.values[name]):.3g}"
    return shown if verdict == "ok" else f"{shown} ({verdict})"


def main() -> int:
    """Print the table; exit 1 where a fit did not converge."""
    columns = measure()
    print(table(columns))
    failed = [column.left_out or "all traces" for column in columns if not column.converged]
    for name in failed:
        print(f"not converged: {name}")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
