"""What models are compared with: the blocks and held-out costs of one of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from friction_ocp.diagnosis.blocks import Blocks
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.held_out import held_out
from friction_ocp.diagnosis.rival import Standing
from friction_ocp.diagnosis.select import resamples, schwarz
from friction_ocp.estimation.node_ends import UNIMPORTANT
from friction_ocp.simulation.grid import FloatArray


@dataclass(frozen=True)
class Benchmark:
    """A model that others are compared with on recordings left out; it is looked at once."""

    fitted: FittedModel

    @property
    def blocks(self) -> Blocks:
        """Blocks of its residuals."""
        return self.fitted.blocks

    @cached_property
    def _costs(self) -> FloatArray:
        return self.blocks.sums(held_out(self.fitted))

    def dearer(self, other: FittedModel) -> FloatArray:
        """Return (blocks,) what another model costs more than this one."""
        return blocks_like(self.fitted, other) - self._costs

    def simpler(self, other: FittedModel | Standing) -> bool:
        """Whether another model has fewer parameters and costs no more than they are worth (Schwarz 1978)."""
        fewer = self.fitted.determined - other.determined
        return fewer > 0 and other.cost - self.fitted.cost < schwarz(self.blocks) * fewer

    def beaten(self, other: FittedModel, gains: FloatArray, level: float, rng: np.random.Generator) -> bool:
        """Whether another model explains more, and its (blocks,) gains are more than chance."""
        return other.cost < self.fitted.cost - UNIMPORTANT and self.certain(gains, level, rng)

    def yields(self, other: FittedModel, gains: FloatArray, level: float, rng: np.random.Generator) -> bool:
        """Whether another model, with its (blocks,) gains, takes the place of this one: it beats it, or is simpler."""
        return self.beaten(other, gains, level, rng) or self.simpler(other)

    def certain(self, gains: FloatArray, level: float, rng: np.random.Generator) -> bool:
        """Whether gains in the blocks of this model are more than chance makes of nothing."""
        return bool(np.quantile(resamples(self.blocks, rng) @ gains, level) > 0)


def beats(other: FittedModel, current: FittedModel, level: float, rng: np.random.Generator) -> bool:
    """Whether another model explains more than the current one for certain, on recordings left out."""
    benchmark = Benchmark(current)
    return benchmark.beaten(other, -benchmark.dearer(other), level, rng)


def blocks_like(current: FittedModel, fitted: FittedModel) -> FloatArray:
    """Return (blocks,) held-out costs of another model over the blocks of the current one."""
    blocks, rows, reference = current.blocks, fitted.linear.rows, current.linear.rows
    costs = held_out(fitted)
    totals = np.zeros(blocks.count)
    for recording in np.unique(blocks.recording):
        own = (reference.recording == recording) & (blocks.of_row >= 0)
        numbers, starts = blocks.of_row[own], reference.time[own]
        mine = rows.recording == recording
        order = np.argsort(starts, kind="stable")
        at = np.clip(np.searchsorted(starts[order], rows.time[mine], side="right") - 1, 0, order.size - 1)
        np.add.at(totals, numbers[order][at], costs[mine])
    return totals
