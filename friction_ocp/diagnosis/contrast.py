"""What a candidate does to the residuals of the base model: its simulation from the base model's states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.diagnosis.linear import LinearProgram, LinearRecording
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.stepping import stepped
from friction_ocp.estimation.model import Model, seen_by
from friction_ocp.estimation.parameter_space import ParameterSpace, parameter_space
from friction_ocp.estimation.static_points import StaticTerm, static_term
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.kernel import Piece, SweepRequest, empty_result
from friction_ocp.simulation.sweep import Sweep


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
        parts: list[FloatArray] = []
        for index, item in enumerate(self.base.recordings):
            changes = [self._change(index, item, self.theta(at)) for at in values]
            by_y, by_end = (np.stack(column, axis=2) for column in zip(*changes, strict=True))
            parts.append(item.change(by_y, by_end))
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

    def _change(self, index: int, item: LinearRecording, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        y, end, _ = self.simulate(index, item, theta)
        return y - item.y, end - item.end

    def simulate(
        self, index: int, item: LinearRecording, theta: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return outputs, segment ends in the states of the base model, and the candidate's states at all nodes."""
        base_names, names = self.base.program.drive.state_names, self.sweep.drive.state_names
        shared = [names.index(name) for name in base_names]
        own = seen_by(self.model, self.sweep.drive, item.item)
        numbers = self.space.numbers(theta, own.name)
        width = np.zeros(len(self.sweep.drive.mechanism.topology.roots) + 1)
        nodes = np.zeros((item.cut.count, len(names)))
        extra = np.setdiff1d(np.arange(len(names)), shared)
        if extra.size:
            at = own.signals(int(item.cut.first[0]))
            nodes[0] = np.asarray(self.sweep.start.call([*at, numbers])[0]).ravel()
        nodes[:, shared] = item.nodes
        request = SweepRequest(own.grid, item.cut.first, nodes, numbers, width)
        result = empty_result(request, len(names), len(self.sweep.drive.output_names), 0)
        if extra.size:
            for j in range(item.cut.count):
                self.sweep.kernel.run([Piece(request, j, j + 1, result)])
                if j + 1 < item.cut.count:
                    nodes[j + 1, extra] = result.end[j, extra]
        else:
            self.sweep.kernel.run([Piece(request, 0, item.cut.count, result)])
        return result.y, result.end[:, shared], nodes


def contrast(model: Model, base: LinearProgram, drive: Drive) -> Contrast:
    """Build the simulation of a candidate drive; its code gives values only."""
    after = stepped(drive)
    space = parameter_space(replace(model.problem, drive=drive), after.parameter_names)
    known = dict(zip(model.space.names, base.point.theta, strict=True))
    static = tuple(static_term(use, drive, space) for use in model.problem.static)
    return Contrast(model, base, space, Sweep(after, (), values_only=True), known, static)
