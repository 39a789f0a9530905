"""How much effort a search may take, and whether it has."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.execution.effort import Limit, effort

Tell = Callable[[str, float], None]
"""Called with what is being done and the share of a round that is done."""
LONG = 300.0
"""Seconds from which it is told beforehand how long a search may take."""
MOST_STEPS, MOST_RUNS = 2e9, 2900.0
"""Integrator steps, as `effort` counts them, or simulations of the base model with derivatives if that is more, from
which nothing further is tried: about two minutes on two processors, and longer for logs of more than 130,000 steps."""
LEAST = 0.05
"""Share of it that each way around the kinks of a fit may take, whatever is left."""
OF_BASE = 0.2
"""The same of the base model, on whose end all depends."""


@dataclass
class Allowance:
    """What a search may take, counted from when it was measured out."""

    began: float
    """Effort of this process then."""
    most: float
    spent: bool = False
    """Whether it was asked for when nothing was left of it, with things left to try."""

    @property
    def taken(self) -> float:
        """What the search has taken, over what it may take."""
        return (effort() - self.began) / self.most

    @property
    def limit(self) -> Limit:
        """What is left of it for the ways around kinks."""
        return Limit(max(1.0 - self.taken, 0.0) * self.most, LEAST * self.most)

    def exhausted(self) -> bool:
        """Whether nothing further is to be tried; whoever asks had something to try."""
        if self.taken < 1.0:
            return False
        self.spent = True
        return True


def measured_out(base: FittedModel, patience: float, tell: Tell) -> Allowance:
    """Return what a search from a base model may take, `patience` times the usual; tell how long that is if it is."""
    began = time.perf_counter()
    once = _once(base)
    took = time.perf_counter() - began
    most = patience * _usual(once)
    longest = took * most / max(once, 1.0)
    if longest > LONG:
        shorter = "`effort` or `samples` under `diagnosis:`, or `from` and `to` beside a file, make it shorter"
        tell(f"the search may take about {longest / 60.0:.0f} min on one processor; {shorter}", 0.0)
    return Allowance(effort(), most)


def of_base(fitted: FittedModel) -> Limit:
    """Return what each way around the kinks of a base model may take."""
    return Limit(0.0, OF_BASE * _usual(_once(fitted)))


def _usual(once: float) -> float:
    return max(MOST_STEPS, MOST_RUNS * once)


def _once(fitted: FittedModel) -> float:
    """Return the effort of a simulation with derivatives."""
    before = effort()
    fitted.linear.program.linearise(fitted.linear.point)
    return effort() - before
