"""What a search costs: evaluations and seconds beside the error of its best parameters so far."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.simulation.kernel import SweepRequest
from friction_ocp.simulation.sweep import Sweep


@dataclass
class Trace:
    """Evaluations and seconds at which a search had which parameter error."""

    begun: float = field(default_factory=time.perf_counter)
    evaluations: int = 0
    points: list[tuple[int, float, float]] = field(default_factory=list)

    def note(self, error: float) -> None:
        """Add the error of the best parameters so far."""
        self.points.append((self.evaluations, time.perf_counter() - self.begun, error))

    def until(self, error: float) -> tuple[int, float]:
        """Return evaluations and seconds after which the error is that small for good."""
        small = [point[2] <= error for point in self.points]
        last = max((k for k, good in enumerate(small) if not good), default=-1)
        at = self.points[min(last + 1, len(small) - 1)]
        return at[0], at[1]


def counted(trace: Trace) -> Callable[[], None]:
    """Count every simulation in a trace until the function returned is called."""
    original = Sweep.run_many

    def run_many(self: Sweep, requests: Sequence[SweepRequest]) -> Any:
        for request in requests:
            trace.evaluations += 1 + (len(self.active) if request.derivatives else 0)
        return original(self, requests)

    Sweep.run_many = run_many  # type: ignore[method-assign]

    def restore() -> None:
        Sweep.run_many = original  # type: ignore[method-assign]

    return restore


@dataclass(frozen=True)
class Curve:
    """The errors of one way in a picture: a search, or the level that a way without one ends at."""

    colour: str
    name: str | None
    trace: Trace | None
    level: float = 0.0


def draw(curves: Sequence[Curve], what: str, path: Path) -> None:
    """Draw error over evaluations; `what` the error is of."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 4.5))
    for curve in curves:
        if curve.trace is None:
            axes.axhline(curve.level, color=curve.colour, ls="--", label=curve.name)
        else:
            points = np.array(curve.trace.points)
            axes.loglog(points[:, 0], points[:, 2], color=curve.colour, label=curve.name)
    axes.set_xlabel("evaluations (a sensitivity sweep counts 1 + parameters)")
    axes.set_ylabel(f"mean relative error of {what}")
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=150)
