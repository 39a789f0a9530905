"""How fast a drive moves by itself: the rates of its linearised motion, and the step that resolves them."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from friction_ocp.drive.linear import ComplexArray
from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.simulation.grid import FloatArray

STEP_PER_RADIAN = 0.1
"""Integrator step over the inverse of the fastest oscillation."""
STEP_PER_DECAY = 0.1
"""Integrator step over the shortest decay time."""

NEVER = 1e12
"""Speed, rad/s, up to which friction keeps its level at rest where its fall does not count."""

MOST_STEPS = 1000
"""Integrator steps in a usual sampling interval: beyond them the guesses make no sense."""


def integrator_step(drive: SteppedDrive, space: ParameterSpace, problem: Problem, most: int = MOST_STEPS) -> float:
    """Return the longest step, s, that resolves the fastest mode of the drive at the guesses, at standstill.

    It is taken at `most` so many times in a usual sampling interval.
    """
    longest = 10.0
    for use in problem.train:
        rates = _rates(drive, space.numbers(space.guess, use.name), _inputs_at_rest(drive, use))
        fastest = float(np.max(np.abs(rates.imag), initial=0.0))
        decay = float(np.max(-rates.real, initial=0.0))
        longest = min(longest, STEP_PER_RADIAN / max(fastest, 1e-6), STEP_PER_DECAY / max(decay, 1e-6))
    intervals = [np.diff(channel.time) for use in problem.train for channel in use.recording.channels.values()]
    usual = min((float(np.median(steps)) for steps in intervals if steps.size), default=0.0)
    return max(longest, usual / most)


def slowest_period(drive: SteppedDrive, space: ParameterSpace, problem: Problem) -> float:
    """Return the period, s, of the slowest oscillation at the guesses; infinite where nothing oscillates."""
    if not problem.train:
        return np.inf
    use = problem.train[0]
    frequencies = np.abs(_rates(drive, space.numbers(space.guess, use.name), _inputs_at_rest(drive, use)).imag)
    oscillating = frequencies[frequencies > 1e-3]
    return float(2.0 * np.pi / np.min(oscillating)) if oscillating.size else np.inf


def _inputs_at_rest(drive: SteppedDrive, use: RecordingUse) -> list[float]:
    """Return a typical value of every input, and zero for what the controller is to reach: it has reached that.

    Far from it, the effort of the controller is at its limit, where the loop has no mode.
    """
    wanted = {channel.name for channel in drive.mechanism.drive.channels if channel.part == "reference"}
    return [0.0 if name in wanted else _typical(use, name) for name in drive.input_names]


def _typical(use: RecordingUse, name: str) -> float:
    channel = use.recording.channels.get(name)
    return float(np.nanquantile(channel.values, 0.75)) if channel is not None else 0.0


def _rates(drive: SteppedDrive, numbers: FloatArray, inputs: list[float]) -> ComplexArray:
    """Return the eigenvalues, 1/s, of the motion about standstill without dry friction.

    What follows a command late is left out: the step is exact in it, however short its times.
    """
    late = drive.mechanism.following_names
    kept = [k for k, name in enumerate(drive.state_names) if name not in late]
    (slope,) = slopes_at(drive, numbers, inputs, [np.zeros(len(drive.state_names))])
    return np.linalg.eigvals(slope[np.ix_(kept, kept)]).astype(complex)


def slopes_at(
    drive: SteppedDrive, numbers: FloatArray, inputs: list[float], at: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return (states, states) for each of some states: how the rates depend on them there, without dry friction.

    Nor with its fall beyond standstill, which is infinitely steep there for exponents below 1: what rests sticks.
    """
    slope = _slope_function(drive, inputs)
    return [np.asarray(slope(each, numbers)) for each in at]


def _slope_function(drive: SteppedDrive, inputs: list[float]) -> ca.Function:
    """Return (states, numbers) -> (states, states) what `slopes_at` gives."""
    tiny, states = 1e-6, len(drive.state_names)
    x, numbers = ca.SX.sym("x", states), ca.SX.sym("numbers", len(drive.parameter_names))
    falls = [".omega_s" in name for name in drive.parameter_names]
    steady = ca.vertcat(*[ca.SX(NEVER) if falls[k] else numbers[k] for k in range(len(falls))])
    width = np.full(len(drive.mechanism.topology.roots) + 1, 1e9)
    after = drive.step.call([x, ca.DM(inputs), steady, ca.DM(tiny), ca.DM(width)], True, False)[0]
    slope = (ca.jacobian(after, x) - ca.SX.eye(states)) / tiny
    return ca.Function("slope", [x, numbers], [ca.densify(slope)])


def typical_inputs(problem: Problem, drive: SteppedDrive) -> list[float]:
    """Return a typical value of every input in the first training recording."""
    return [_typical(problem.train[0], name) for name in drive.input_names]
