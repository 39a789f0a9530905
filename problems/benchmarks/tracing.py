"""What a search costs: evaluations and seconds beside the error of its best parameters so far."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

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
