"""The relaxed multiple-shooting program: residuals and Gauss-Newton blocks of all recordings.

Variables are the fitted parameters and the state at the start of every segment. Residuals are measurement
errors over their noise floors, continuity gaps over their process noise, and priors. With one segment a
recording the gaps vanish and the program is the free run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.normal_equations import NormalEquations
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.segments import Segments
from friction_ocp.estimation.static_points import StaticTerm
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.kernel import Score, SweepRequest, SweepResult, Yardstick
from friction_ocp.simulation.losses import AbstractLoss, Squares
from friction_ocp.simulation.sweep import Sweep


@dataclass(frozen=True)
class Point:
    """Values of all variables."""

    theta: FloatArray
    """(parameters,)."""
    nodes: tuple[FloatArray, ...]
    """By recording (segments, states)."""


@dataclass(frozen=True)
class Blocks:
    """Gauss-Newton system of one recording: gradient and block-tridiagonal Hessian with a parameter border."""

    node_node: FloatArray
    """(segments, states, states)."""
    node_next: FloatArray
    """(segments - 1, states, states): rows of segment j, columns of segment j + 1."""
    node_theta: FloatArray
    """(segments, states, parameters)."""
    node_gradient: FloatArray
    """(segments, states)."""


@dataclass(frozen=True)
class Linearisation:
    """Objective, gradient and Gauss-Newton Hessian at a point."""

    objective: float
    theta_theta: FloatArray
    theta_gradient: FloatArray
    blocks: tuple[Blocks, ...]


@dataclass(frozen=True)
class Tether:
    """What holds parameters near a point, beside their priors: what is known of them from elsewhere."""

    theta: FloatArray
    """(parameters,) the point."""
    information: FloatArray
    """(parameters, parameters)."""

    def pull(self, theta: FloatArray) -> tuple[float, FloatArray]:
        """Return the cost of parameters elsewhere and its (parameters,) gradient."""
        moved = theta - self.theta
        gradient: FloatArray = self.information @ moved
        return 0.5 * float(moved @ gradient), gradient


@dataclass(frozen=True)
class Program:
    """A least-squares program over parameters and node states."""

    space: ParameterSpace
    drive: SteppedDrive
    sweep: Sweep
    experiments: tuple[Experiment, ...]
    segments: tuple[Segments, ...]
    noise: FloatArray
    """(outputs,) noise floors."""
    width: FloatArray
    """(groups + 1,) smoothing of the sign by group and of backlash corners; zeros are exact."""
    loss: AbstractLoss = Squares()
    static: tuple[StaticTerm, ...] = ()
    """Static points: residuals of the parameters alone, always squared."""
    tether: Tether | None = None

    @property
    def without_nodes(self) -> bool:
        """Whether no start state is a variable: each is what the measurement says."""
        return all(cut.measured == cut.count for cut in self.segments)

    @property
    def samples(self) -> int:
        """How many samples there are in all recordings."""
        return sum(int(np.isfinite(item.measured).sum()) for item in self.experiments)

    def measured_states(self, item: Experiment, theta: FloatArray, nodes: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return (k, states) and its derivative (k, states, parameters) at the given grid nodes."""
        states, active = self.sweep.start.size1_out(0), len(self.space.active)
        if not states or not len(nodes):
            return np.zeros((len(nodes), states)), np.zeros((len(nodes), states, theta.size))
        numbers, slope = self.space.numbers_and_slope(theta, item.name)
        many = self.sweep.starts(len(nodes))
        value, by_active = many(*(signal.T for signal in item.signals(nodes)), numbers)
        by_active = np.asarray(by_active).reshape(states, len(nodes), active).transpose(1, 0, 2)
        with np.errstate(invalid="ignore"):  # a start state may be undefined; the objective there is infinite
            return np.asarray(value).T, by_active @ slope

    def measured_starts(self, theta: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Return by recording the states (measured, states) of nodes that are no variables, and their derivatives.

        The derivatives are (measured, states, parameters). All recordings are computed at once.
        """
        states, counts = len(self.drive.state_names), [cut.measured for cut in self.segments]
        if not states or not any(counts):
            return [(np.zeros((count, states)), np.zeros((count, states, theta.size))) for count in counts]
        pairs = [self.space.numbers_and_slope(theta, item.name) for item in self.experiments]
        many, signals = self._starting
        value, by_active = many(*signals, np.repeat([pair[0] for pair in pairs], counts, axis=0).T)
        edges = np.cumsum(counts)[:-1]
        shape = (states, sum(counts), len(self.space.active))
        with np.errstate(invalid="ignore"):  # a start state may be undefined; the objective there is infinite
            slopes = np.split(np.asarray(by_active).reshape(shape).transpose(1, 0, 2), edges)
            return [
                (state, slope @ pair[1])
                for state, slope, pair in zip(np.split(np.asarray(value).T, edges), slopes, pairs, strict=True)
            ]

    @cached_property
    def _starting(self) -> tuple[ca.Function, tuple[FloatArray, ...]]:
        """The start states of all measured nodes as one function, and their signals, one column a node."""
        pairs = zip(self.experiments, self.segments, strict=True)
        columns = [item.signals(cut.first[: cut.measured]) for item, cut in pairs]
        signals = tuple(np.concatenate(signal).T for signal in zip(*columns, strict=True))
        return self.sweep.starts(sum(cut.measured for cut in self.segments)), signals

    def placed(self, point: Point) -> Point:
        """Return a point whose nodes that are no variables are where the measurement says under its parameters."""
        starts = self.measured_starts(point.theta)
        pairs = zip(starts, point.nodes, strict=True)
        return Point(point.theta, tuple(np.concatenate([start, own[len(start) :]]) for (start, _), own in pairs))

    def point_along(self, other: Program, at: Point) -> Point:
        """Return the parameters of `at` with every node where the simulation of another program at `at` passes it.

        States that this one has beyond those of the other are zero: noise of inputs. Those it lacks are left out.
        """
        nodes: list[FloatArray] = []
        for index, cut in enumerate(self.segments):
            track = other.simulate(index, at, with_states=True).states
            assert track is not None
            passed = np.zeros((cut.count, len(self.drive.state_names)))
            known = min(passed.shape[1], track.shape[1])
            passed[:, :known] = track[cut.first[:-1], :known]
            nodes.append(passed)
        return Point(at.theta, tuple(nodes))

    def simulate(self, index: int, point: Point, derivatives: bool = False, with_states: bool = False) -> SweepResult:
        """Simulate the segments of one recording from their nodes."""
        start = self.measured_starts(point.theta)[index][0]
        return self.sweep.run_many([self._request(index, point, start, derivatives, with_states)])[0]

    def simulate_all(self, point: Point, derivatives: bool = False) -> list[SweepResult]:
        """Simulate all recordings, side by side."""
        starts = self.measured_starts(point.theta)
        return self.sweep.run_many([self._request(k, point, start, derivatives) for k, (start, _) in enumerate(starts)])

    def simulate_trial(self, point: Point) -> list[SweepResult]:
        """Simulate all recordings and keep what `differentiate` has a use for."""
        starts = self.measured_starts(point.theta)
        requests = [self._request(k, point, start, derivatives=False) for k, (start, _) in enumerate(starts)]
        return self.sweep.run_many([replace(request, with_course=True) for request in requests])

    def differentiate(self, point: Point, trial: Sequence[SweepResult]) -> list[tuple[SweepResult, FloatArray]]:
        """Return by recording results with derivatives at a point that was simulated before.

        Beside each (n, outputs, parameters) the derivatives of its outputs over their noise floors.
        """
        starts = self.measured_starts(point.theta)
        requests = [
            replace(self._request(k, point, start, derivatives=True), course=known.course)
            for k, ((start, _), known) in enumerate(zip(starts, trial, strict=True))
        ]
        results = self.sweep.run_many(requests)
        slopes = [self.space.numbers_and_slope(point.theta, item.name)[1] for item in self.experiments]
        return [(result, self.output_slopes(k, result, slopes[k], starts[k][1])) for k, result in enumerate(results)]

    def _scored(
        self,
        point: Point,
        starts: list[tuple[FloatArray, FloatArray]],
        derivatives: bool = False,
        by_theta: bool = True,
    ) -> list[tuple[SweepResult, Score]]:
        """Simulate all recordings, comparing with their measurements on the way."""
        requests = [
            replace(
                self._request(k, point, start, derivatives),
                by_active=by_theta,
                yardstick=Yardstick(self.experiments[k].measured, self.noise, self.loss),
            )
            for k, (start, _) in enumerate(starts)
        ]
        results = self.sweep.run_many(requests)
        return [(result, result.score) for result in results if result.score is not None]

    def _request(
        self, index: int, point: Point, start: FloatArray, derivatives: bool, with_states: bool = False
    ) -> SweepRequest:
        item, cut = self.experiments[index], self.segments[index]
        nodes = point.nodes[index]
        if cut.measured:
            nodes = np.concatenate([start, nodes[cut.measured :]])
        numbers = self.space.numbers(point.theta, item.name)
        return SweepRequest(item.grid, cut.first, nodes, numbers, self.width, derivatives, with_states)

    def output_slopes(self, index: int, result: SweepResult, slope: FloatArray, nodes: FloatArray) -> FloatArray:
        """Return (n, outputs, parameters) the derivatives of a recording's outputs over their noise floors.

        `slope` (active, parameters) is that of its numbers, `nodes` (segments, states, parameters) that of its nodes.
        """
        assert result.dy is not None
        states, owner = nodes.shape[1], self.segments[index].owner(np.arange(len(result.y)))
        full = result.dy[:, :, :states] @ nodes[owner] + result.dy[:, :, states:] @ slope
        return full / self.noise[:, None]

    def residuals(self, index: int, y: FloatArray) -> FloatArray:
        """Return (n, outputs) errors over the noise floor, NaN where there is no sample."""
        return (y - self.experiments[index].measured) / self.noise

    def seen_errors(self, index: int, y: FloatArray) -> FloatArray:
        """Return (samples,) errors over the noise floor of all samples that there are."""
        return self.residuals(index, y)[np.isfinite(self.experiments[index].measured)]

    def sample_errors(self, index: int, y: FloatArray) -> FloatArray:
        """Return (n, outputs) errors over the noise floor, zero where there is no sample."""
        return np.where(np.isfinite(self.experiments[index].measured), self.residuals(index, y), 0.0)

    def lost_costs(self, index: int) -> FloatArray:
        """Return (n, outputs) what noise costs for each sample that lies outside of the recording where it is read.

        Without it, reading a late channel earlier would look like a gain.
        """
        one = float(self.loss.cost(np.ones(1))[0])
        return np.where(self.experiments[index].lost, one, 0.0)

    def objective(self, point: Point) -> float:
        """Return the cost of a point; infinite where the simulation breaks down."""
        with np.errstate(over="ignore", invalid="ignore"):
            total = self._parameter_cost(point.theta)
            for index, (result, score) in enumerate(self._scored(point, self.measured_starts(point.theta))):
                total += float(np.sum(score.cost)) + 0.5 * float(np.sum(self.start_errors(index, point) ** 2))
                total += 0.5 * float(np.sum(self.gap_errors(index, point, result.end) ** 2))
        return total if np.isfinite(total) else np.inf

    def _parameter_cost(self, theta: FloatArray) -> float:
        """Return the cost of what hangs on the parameters alone."""
        held = 0.0 if self.tether is None else self.tether.pull(theta)[0]
        return _prior_cost(self.space, theta) + sum(term.cost(self.space, theta) for term in self.static) + held

    def gap_errors(self, index: int, point: Point, end: FloatArray) -> FloatArray:
        """Return (gaps, states) how far segments end from where the next begin, over what torque noise allows."""
        return self.segments[index].weighed(end[:-1] - point.nodes[index][1:], point.theta)

    def start_errors(self, index: int, point: Point) -> FloatArray:
        """Return (tied, states) how far tied nodes are from what was measured, over their deviations."""
        cut, nodes = self.segments[index], point.nodes[index]
        if cut.start_weight is None:
            return np.zeros((0, nodes.shape[1]))
        return cut.start_weight[cut.tied] * (nodes[cut.tied] - self.expected(index, point.theta)[0])

    def expected(self, index: int, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (tied, states) what is known of tied nodes beforehand, and its derivatives (tied, states, parameters).

        The motion as it was measured, and no noise of inputs.
        """
        cut, states = self.segments[index], len(self.drive.state_names)
        value, slope = np.zeros((cut.tied.size, states)), np.zeros((cut.tied.size, states, theta.size))
        if cut.start_weight is None:
            return value, slope
        moving = len(self.drive.mechanism.state_names)
        shown = np.any(cut.start_weight[cut.tied, :moving] > 0, axis=1)
        value[shown], slope[shown] = self.measured_states(self.experiments[index], theta, cut.first[cut.tied[shown]])
        return value, slope

    def parameter_terms(self, theta: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return cost, Hessian and gradient of what hangs on the parameters alone: priors, static points, a tether."""
        stated = np.isfinite(self.space.prior_std)
        pull = np.where(stated, np.where(stated, self.space.prior_std, 1.0) ** -2.0, 0.0)
        hessian, gradient = np.diag(pull), pull * (theta - self.space.prior_mean)
        total = _prior_cost(self.space, theta)
        if self.tether is not None:
            held, slope = self.tether.pull(theta)
            total, hessian, gradient = total + held, hessian + self.tether.information, gradient + slope
        for term in self.static:
            errors, slope = term.residuals(self.space, theta)
            total += 0.5 * float(errors @ errors)
            hessian += slope.T @ slope
            gradient += slope.T @ errors
        return total, hessian, gradient

    def linearise(self, point: Point, by_theta: bool = True) -> Linearisation:
        """Return objective, gradient and Gauss-Newton Hessian at a point.

        Without `by_theta`, which takes less time, what they are by the parameters means nothing.
        """
        total, hessian, gradient = self.parameter_terms(point.theta)
        blocks: list[Blocks] = []
        starts = self.measured_starts(point.theta)
        for index, (result, score) in enumerate(self._scored(point, starts, True, by_theta)):
            # derivatives outgrow all numbers where a simulation breaks down; the objective there is infinite
            with np.errstate(over="ignore", invalid="ignore"):
                part = self._linearise_recording(index, point, (result, score), starts[index][1], by_theta)
            cost, curvature, slope, block = part
            total += cost
            hessian += curvature
            gradient += slope
            blocks.append(block)
        return Linearisation(total if np.isfinite(total) else np.inf, hessian, gradient, tuple(blocks))

    def _linearise_recording(
        self, index: int, point: Point, scored: tuple[SweepResult, Score], start_slope: FloatArray, by_theta: bool
    ) -> tuple[float, FloatArray, FloatArray, Blocks]:
        (result, score), cut, nodes = scored, self.segments[index], point.nodes[index]
        assert score.gradient is not None and score.square is not None
        _, slope = self.space.numbers_and_slope(point.theta, self.experiments[index].name)
        slope = slope if by_theta else slope[:0]
        states, count = nodes.shape[1], point.theta.size
        system = NormalEquations.empty(cut.count, states, count)
        system.cost += float(np.sum(score.cost))
        system.add_squares(slice(0, cut.count), score.square, score.gradient, slope)
        self._add_gaps(index, point, result, slope, system)
        self._add_start(index, point, start_slope, system)
        blocks = Blocks(system.node_node, system.node_next, system.node_theta, system.node_gradient)
        return system.cost, system.theta_theta, system.theta_gradient, blocks

    def _add_gaps(
        self, index: int, point: Point, result: SweepResult, slope: FloatArray, system: NormalEquations
    ) -> None:
        cut, nodes = self.segments[index], point.nodes[index]
        if cut.gap_weight is None or cut.count < 2:
            return
        assert result.dend is not None
        weight, states, jumps = cut.weights(point.theta), nodes.shape[1], result.end[:-1] - nodes[1:]
        before, after = slice(0, cut.count - 1), slice(1, cut.count)
        gap: FloatArray = np.einsum("kij,kj->ki", weight, jumps)
        jacobian = weight @ result.dend[:-1]
        system.cost += 0.5 * float(np.sum(gap**2))
        if cut.slopes is not None and len(slope):
            jacobian = np.concatenate([jacobian, cut.weighed_slopes(jumps, point.theta.size)], axis=2)
            slope = np.concatenate([slope, np.eye(point.theta.size)])
        system.add(before, jacobian, gap, np.ones(gap.shape), slope)
        back = weight.transpose(0, 2, 1)
        system.node_next -= jacobian[:, :, :states].transpose(0, 2, 1) @ weight
        system.node_node[after] += back @ weight
        system.node_theta[after] -= back @ (jacobian[:, :, states:] @ slope)
        system.node_gradient[after] -= np.einsum("kij,kj->ki", back, gap)

    def _add_start(self, index: int, point: Point, start_slope: FloatArray, system: NormalEquations) -> None:
        cut = self.segments[index]
        if cut.measured:
            system.fold_nodes(start_slope)
        if cut.start_weight is not None:
            weight = cut.start_weight[cut.tied]
            expected, slopes = self.expected(index, point.theta)
            error = weight * (point.nodes[index][cut.tied] - expected)
            system.cost += 0.5 * float(np.sum(error**2))
            jacobian = np.concatenate([weight[:, :, None] * np.eye(weight.shape[1]), -weight[:, :, None] * slopes], 2)
            system.add(cut.tied, jacobian, error, np.ones(error.shape), np.eye(point.theta.size))


def _prior_cost(space: ParameterSpace, theta: FloatArray) -> float:
    return 0.5 * float(np.sum(space.prior_deviations(theta) ** 2))
