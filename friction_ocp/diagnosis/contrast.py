"""What a candidate does to the residuals of the base model: its simulation from the base model's states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from friction_ocp.diagnosis.linear import LinearProgram
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.stepping import stepped
from friction_ocp.estimation.model import Model, seen_by
from friction_ocp.estimation.parameter_space import ParameterSpace, parameter_space
from friction_ocp.estimation.static_points import StaticTerm, static_term
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.kernel import SweepRequest
from friction_ocp.simulation.sweep import Sweep, sweep_of


@dataclass(frozen=True)
class Track:
    """What a candidate does in one recording."""

    y: FloatArray
    """(n, outputs)."""
    end: FloatArray
    """(segments, states) where segments end, in the states of the base model."""
    nodes: FloatArray
    """(segments, states) its own states where they begin."""


@dataclass(frozen=True)
class Contrast:
    """A candidate drive, to be simulated from the states of the base model."""

    model: Model
    """The base model."""
    base: LinearProgram
    space: ParameterSpace
    sweep: Sweep
    known: Mapping[str, float]
    """Fitted values of the base model by parameter name."""
    static: tuple[StaticTerm, ...] = ()
    """Static points under the candidate."""

    def columns(self, values: list[Mapping[str, float]]) -> FloatArray:
        """Return (rows, k) what each set of added values does, nodes solved for, parameters not yet absorbed."""
        recordings = self.base.recordings
        tracks = self.simulate([(index, self.theta(at)) for index in range(len(recordings)) for at in values])
        parts: list[FloatArray] = []
        for index, item in enumerate(recordings):
            own = tracks[index * len(values) : (index + 1) * len(values)]
            by_y, by_end = (np.stack(column, axis=2) for column in zip(*((t.y, t.end) for t in own), strict=True))
            parts.append(item.change(by_y - item.y[:, :, None], by_end - item.end[:, :, None]))
        parts += [self._static_change(k, values) for k in range(len(self.static))]
        prior = self.base.rows.residual.size - sum(part.shape[0] for part in parts)
        return np.concatenate([*parts, np.zeros((prior, len(values)))])

    def theta(self, values: Mapping[str, float]) -> FloatArray:
        """Return all fitted parameters of the candidate: those of the base model and the added ones."""
        at = {**self.known, **values}
        return np.array([at.get(name, self.space.guess[k]) for k, name in enumerate(self.space.names)])

    def _static_change(self, index: int, values: list[Mapping[str, float]]) -> FloatArray:
        """Return (points, k) what each set of added values does to static points."""
        term, before = self.static[index], self.base.program.static[index]
        still = before.predict(self.model.space, self.base.point.theta)
        moved = [term.predict(self.space, self.theta(at)) for at in values]
        return np.column_stack([(one - still) / before.std_error for one in moved])

    def simulate(self, wanted: Sequence[tuple[int, FloatArray]]) -> list[Track]:
        """Return the candidate with some parameters in some recordings, side by side.

        States that the base model does not have go on from segment to segment.
        """
        requests = [self._started(index, theta) for index, theta in wanted]
        shared, extra = self._states
        tracks: list[Track] = []
        for request, result in zip(requests, self.sweep.run_many(requests), strict=True):
            nodes = request.x0.copy()
            nodes[1:, extra] = result.end[:-1, extra]
            tracks.append(Track(result.y, result.end[:, shared], nodes))
        return tracks

    @cached_property
    def _states(self) -> tuple[list[int], IntArray]:
        """Return the states that the base model has, in its order, and those that it does not have."""
        names = self.sweep.drive.state_names
        shared = [names.index(name) for name in self.base.program.drive.state_names]
        return shared, np.setdiff1d(np.arange(len(names)), shared)

    def _started(self, index: int, theta: FloatArray) -> SweepRequest:
        """Return the simulation of a recording from the nodes of the base model."""
        item, drive = self.base.recordings[index], self.sweep.drive
        shared, extra = self._states
        own = seen_by(self.model, drive, item.item)
        numbers = self.space.numbers(theta, own.name)
        width = np.zeros(len(drive.mechanism.topology.roots) + 1)
        nodes = np.zeros((item.cut.count, len(drive.state_names)))
        if extra.size:
            at = own.signals(int(item.cut.first[0]))
            nodes[0] = np.asarray(self.sweep.start.call([*at, numbers])[0]).ravel()
        nodes[:, shared] = item.nodes
        return SweepRequest(own.grid, item.cut.first, nodes, numbers, width, carried=extra if extra.size else None)


def contrast(model: Model, base: LinearProgram, drive: Drive) -> Contrast:
    """Build the simulation of a candidate drive; its code gives values only."""
    after, noisy = stepped(drive), base.program.drive.noisy_inputs
    space = parameter_space(replace(model.problem, drive=drive), after.parameter_names)
    known = dict(zip(model.space.names, base.point.theta, strict=True))
    static = tuple(static_term(use, drive, space) for use in model.problem.static)
    return Contrast(model, base, space, sweep_of(drive, (), values_only=True, noisy=noisy), known, static)
