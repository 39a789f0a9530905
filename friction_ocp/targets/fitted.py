"""A result on disk as a drive with plain numbers, and its free runs."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.drive.live_terms import live_terms
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.estimate import Estimate, Simulation, simulate_model
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.horizon import horizon
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.score import FreeRun
from friction_ocp.estimation.stages import windows
from friction_ocp.parameters import Directional, Free, Tie
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.targets.doubts import doubts_of

PROBLEMS = ("fitted.yaml", "augmented.yaml", "base.yaml")
"""Files of a result folder that hold a drive, the best first."""
RESULTS = ("result.json", "result.h5", "report.html", "next_experiment.h5")
"""Further files of a result folder."""


@dataclass(frozen=True)
class Run:
    """One recording simulated freely, and where its windows begin."""

    item: Experiment
    free: FreeRun
    first: IntArray
    """(windows + 1,) first node of each window."""
    numbers: FloatArray
    """All numbers of the drive in this recording."""


@dataclass(frozen=True)
class Fitted:
    """A fitted drive."""

    model: Model
    theta: FloatArray
    """(parameters,) the answer."""
    drive: Drive
    """With plain numbers: those of the first recording, where recordings differ."""
    name: str
    """An identifier in any language."""
    source: Path
    doubts: tuple[str, ...] = ()
    """Why its numbers may be no answer."""

    @cached_property
    def simulation(self) -> Simulation:
        """Free runs of all recordings."""
        return simulate_model(self.model, self.theta)

    def runs(self) -> tuple[Run, ...]:
        """Return the free runs by which an export is judged: validation recordings, else those of the training."""
        judged = self.model.validation or self.model.train
        free = {run.name: run for run in (*self.simulation.train, *self.simulation.validation)}
        span = horizon(self.model)
        return tuple(Run(item, free[item.name], windows(item, span), self.numbers(item.name)) for item in judged)

    def numbers(self, recording: str) -> FloatArray:
        """Return all numbers of the drive in a recording."""
        return self.model.space.numbers(self.theta, recording)


def load_fitted(result: str | Path) -> Fitted:
    """Read a result folder, its result.json, or a problem file that holds its answer."""
    path = _problem_of(Path(result))
    model = prepare(load_problem(path))
    theta = model.space.guess
    fitted = _fitted(model, theta, path.parent.name if path.name in PROBLEMS else path.stem, path)
    return replace(fitted, doubts=doubts_of(model.space.names, theta, result_document(fitted)))


def fitted_of(estimate: Estimate) -> Fitted:
    """Return the drive that an identification found."""
    problem = estimate.problem
    same_steps = replace(problem.estimation, max_step=estimate.simulation.max_step)
    model = prepare(replace(problem, estimation=same_steps))
    theta = np.array([estimate.values[name] for name in model.space.names])
    path = problem.path or Path("drive")
    return _fitted(model, theta, path.stem, path)


def _fitted(model: Model, theta: FloatArray, title: str, path: Path) -> Fitted:
    numbers = model.space.numbers_by_path(theta, model.problem.fitted[0].name)
    stated = {leaf.path: leaf.value for leaf in drive_leaves(model.problem.drive)}
    plain = {name: float(value) for name, value in stated.items() if isinstance(value, (int, float))}
    drive = live_terms(bind_drive(model.problem.drive, plain | numbers))
    for leaf in drive_leaves(drive):
        assert not isinstance(leaf.value, (Free, Tie)), leaf.path
    name = re.sub(r"\W+", "_", title).strip("_") or "drive"
    return Fitted(model, theta, drive, name if not name[0].isdigit() else f"drive_{name}", path)


def _problem_of(result: Path) -> Path:
    """Return the problem file that holds the answer of a result."""
    if result.suffix in (".yaml", ".yml"):
        return result
    folder = result if result.is_dir() else result.parent
    if not result.exists():
        raise FrictionOcpError(Finding(str(result), "there is no such result", "a result folder, or its fitted.yaml"))
    if not result.is_dir() and result.suffix != ".json":
        raise FrictionOcpError(Finding(str(result), "this is no result", "a folder, its result.json or fitted.yaml"))
    found = next((folder / name for name in PROBLEMS if (folder / name).is_file()), None)
    if found is None:
        what = f"there is neither of {', '.join(PROBLEMS)} beside it"
        raise FrictionOcpError(Finding(str(result), what, "a folder of identify or diagnose", "run identify first"))
    return found


def result_document(fitted: Fitted) -> Mapping[str, Any]:
    """Return result.json beside a fitted problem, {} where there is none."""
    path = fitted.source.parent / "result.json"
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return cast(dict[str, Any], content) if isinstance(content, dict) else {}


def files_of(fitted: Fitted) -> tuple[Path, ...]:
    """Return the files from which a fitted drive was read, and those that belong to its result."""
    folder, problem = fitted.source.parent, fitted.model.problem
    read = [use.recording.path for use in problem.recordings]
    read += [use.points.path for use in (*problem.static, *problem.static_validation)]
    beside = [folder / name for name in (*PROBLEMS, *RESULTS)] if (folder / "result.json").is_file() else []
    return (fitted.source, *beside, *(path for path in read if path is not None))


def both_ways(value: Any) -> tuple[float, float]:
    """Return a number of friction in both directions."""
    if isinstance(value, Directional):
        return float(value.positive), float(value.negative)
    return float(value), float(value)


def flat(values: Any) -> FloatArray:
    """Return the numbers of a function's result as one vector."""
    return np.asarray(values, dtype=np.float64).ravel()


def rms(values: FloatArray) -> float:
    """Return the root mean square of what is finite, 0 for nothing."""
    present = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(present**2))) if present.size else 0.0
