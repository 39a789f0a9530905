"""Gaps that the noise of a measured torque makes, as wide as it makes them whatever the numbers of the drive.

A sensor's noise is in the measured torque and not in the true one: a drive does not answer to it. Judged by motion
alone, a rotor that is too heavy, or a joint that is damped too much, answers less and misses less. Judged by the torque
that motion and model leave over, all numbers answer alike. Source: Fuller 1987, Measurement error models (functional
models).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np

from friction_ocp.diagnosis.gathered_noise import alike, sampled_covariances
from friction_ocp.drive.mechanism import Mechanism
from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.modes import slope_function, typical_inputs
from friction_ocp.estimation.torque_noise import driving, input_power
from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class TorqueGaps:
    """The weights of the gaps of one recording."""

    model: Model
    noise: Mapping[str, tuple[float, float]]
    """By input channel: deviation and sampling interval, s."""
    shafts: tuple[str, ...]
    """Shafts that noise turns."""
    spans: FloatArray
    """(distinct,) lengths of segments, s, of which others are much alike."""
    motions: FloatArray
    """(distinct, states) the motion in them."""
    like: IntArray
    """(kinds,) the distinct segment before each kind of gap."""
    jumps: FloatArray
    """(shafts, kinds) power density, (N m)^2/Hz, of torque that jumps of inputs hide."""
    kind: IntArray
    """(gaps,) the kind of each."""
    still: FloatArray
    """(states,) how far states may jump that no noise enters."""
    width: float = 1.0
    """Factor by which all gaps are wider."""
    _latest: dict[bytes, FloatArray] = field(init=False, repr=False, default_factory=dict[bytes, FloatArray])

    @classmethod
    def laid(
        cls,
        model: Model,
        noise: Mapping[str, tuple[float, float]],
        spans: FloatArray,
        motions: FloatArray,
        jumps: Mapping[str, FloatArray],
        still: FloatArray,
    ) -> TorqueGaps:
        """Lay the gaps behind segments but the last: `spans` (segments,) s, `motions` (segments, states) in them.

        `jumps` (segments,) by shaft: the power density, (N m)^2/Hz, of torque that jumps of inputs hide.
        """
        distinct, means, which = alike(spans, motions)
        shafts = tuple(sorted({motor.shaft for motor in model.problem.drive.motors} | set(jumps)))
        power = np.array([jumps.get(shaft, np.zeros(spans.size)) for shaft in shafts])[:, :-1]
        keys = np.column_stack([which[:-1], power.T])
        kinds, kind = np.unique(keys, axis=0, return_inverse=True)
        like, own = kinds[:, 0].astype(np.int64), np.asarray(kinds[:, 1:].T, dtype=np.float64)
        return cls(model, noise, shafts, distinct, means, like, own, kind.ravel().astype(np.int64), still)

    def widened(self, factor: float) -> TorqueGaps:
        """Return wider gaps."""
        return replace(self, width=self.width * factor)

    def weights(self, numbers: FloatArray) -> FloatArray:
        """Return (gaps, states, states) W with W'W the inverse covariance of each gap, at numbers of the drive."""
        key = numbers.tobytes()
        if key not in self._latest:
            self._latest.clear()
            self._latest[key] = self._roots(numbers[None])[0][self.kind]
        return self._latest[key]

    def changes(self, numbers: FloatArray, moves: FloatArray, gaps: FloatArray) -> FloatArray:
        """Return (gaps, states, moves) how weighed `gaps` (gaps, states) change with `moves` (moves, numbers)."""
        found = np.zeros((*gaps.shape, len(moves)))
        told = np.flatnonzero(np.any(moves[:, self._matters] != 0.0, axis=1))
        if told.size:
            roots = self._roots(np.concatenate([numbers[None], numbers + moves[told]]))
            found[:, :, told] = np.einsum("pkij,kj->kip", (roots[1:] - roots[0])[:, self.kind], gaps)
        return found

    # what a trial step makes of an inertia may outgrow all numbers; the objective there is infinite
    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def _roots(self, many: FloatArray) -> FloatArray:
        """Return (k, kinds, states, states) the weights at `many` (k, numbers) numbers of the drive."""
        states, count = self.still.size, len(many)
        slope = self._slope.map(count * self.spans.size)
        at = np.tile(self.motions, (count, 1)).T, np.repeat(many, self.spans.size, axis=0).T
        slopes = np.asarray(slope(*at)).reshape(states, -1, states).transpose(1, 0, 2)
        if not np.all(np.isfinite(slopes)):
            return np.full((count, self.like.size, states, states), np.nan)
        units = sampled_covariances(self.model, slopes, np.tile(self.spans, count), self._step)
        units = units.reshape(-1, count, self.spans.size, states, states)[:, :, self.like]
        spread = np.einsum("qgs,qsk->gqk", self._moved(many), self._torque(many))
        covariance: FloatArray = np.einsum("gqk,gqkij->qkij", spread, units) + np.diag(self.still**2)
        try:
            return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), dtype=np.float64) / self.width
        except np.linalg.LinAlgError:
            return np.full_like(covariance, np.nan)

    def _torque(self, many: FloatArray) -> FloatArray:
        """Return (k, shafts, kinds) the power density of torque noise, (N m)^2/Hz."""
        names = self.model.space.leaf_names

        def known(channel: Channel) -> tuple[float, float]:
            return self.noise[channel.name]

        tables = (dict(zip(names, map(float, numbers), strict=True)) for numbers in many)
        powers = [input_power(self.model.problem.drive, table, known) for table in tables]
        return np.array([[power.get(shaft, 0.0) for shaft in self.shafts] for power in powers])[:, :, None] + self.jumps

    def _moved(self, many: FloatArray) -> FloatArray:
        """Return (k, groups, shafts) the square of the acceleration of each group by the torque on each shaft."""
        found = np.asarray(self._answer.map(len(many))(many.T))
        groups = len(self.model.drive.mechanism.topology.roots)
        return found.reshape(groups, len(many), len(self.shafts)).transpose(1, 0, 2) ** 2

    @property
    def _step(self) -> float:
        """Sampling interval of the inputs, s."""
        return min((step for _, step in self.noise.values()), default=np.inf)

    @cached_property
    def _slope(self) -> ca.Function:
        return slope_function(self.model.drive, typical_inputs(self.model.problem, self.model.drive))

    @cached_property
    def _answer(self) -> ca.Function:
        return _answer(self.model.drive.mechanism, self.shafts)

    @cached_property
    def _matters(self) -> BoolArray:
        """(numbers,) whether the width of gaps hangs on each number of the drive."""
        names = self.model.space.leaf_names
        slope, answer = self._slope, self._answer
        by_slope = np.asarray(ca.DM(slope.jac_sparsity(0, 1), 1.0)).any(axis=0)
        by_answer = np.asarray(ca.DM(answer.jac_sparsity(0, 0), 1.0)).any(axis=0)
        usual = dict.fromkeys(names, 1.0)
        driven = [self._factors({**usual, name: 2.0}) != self._factors(usual) for name in names]
        return np.asarray(by_slope | by_answer | np.array(driven))

    def _factors(self, table: Mapping[str, float]) -> list[float]:
        return [factor for _, _, factor in driving(self.model.problem.drive, table)]


def _answer(mech: Mechanism, shafts: Sequence[str]) -> ca.Function:
    """Return numbers of the drive -> (groups, shafts) the acceleration of each group by a torque on each shaft."""
    moved = ca.SX.zeros(len(mech.topology.roots), len(shafts))
    for k, shaft in enumerate(shafts):
        group = mech.topology.group_of[shaft]
        moved[group, k] = mech.topology.speed_ratio[shaft] / ca.fmax(mech.inertia(group), 1e-300)
    return ca.Function("answer", [ca.vertcat(*mech.parameters.values())], [ca.densify(moved)])
