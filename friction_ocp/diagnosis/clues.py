"""Sizes and motions from a fitted base model, for the initial guesses of effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from friction_ocp.diagnosis.fitting import FittedModel
from friction_ocp.diagnosis.footing import group_inertias, speed_ratio
from friction_ocp.diagnosis.linear import LinearRecording
from friction_ocp.drive.mechanism import Mechanism, column
from friction_ocp.drive.motors import motor_torque
from friction_ocp.drive.parts import Motor
from friction_ocp.drive.stepping import state_symbols
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.score import solve_nodes
from friction_ocp.estimation.stages import relaxed
from friction_ocp.estimation.static_points import StaticTerm
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

SMOOTHING_STEPS = 4
FINE, MOST_FINE = 4, 3000
"""Samples in the segments that show what torque is missing as finely as recordings tell; most such segments in one."""


def clues_of(fitted: FittedModel) -> Clues:
    """Return what the fitted model says about motions and torques."""
    mech = fitted.model.drive.mechanism
    watch, names = _watch(mech)
    free = fitted.footing.segment_s is None
    coarse = _smoothers(fitted, fitted.model.problem.estimation.segment) if free else fitted.linear.recordings
    longest = max(item.grid.time.size for item in fitted.linear.program.experiments)
    pairs = zip(coarse, _smoothers(fitted, max(FINE, longest // MOST_FINE)), strict=True)
    tracks = tuple(_track(fitted, index, watch, names, *pair) for index, pair in enumerate(pairs))
    first = fitted.model.train[0].name
    numbers = fitted.model.space.numbers(fitted.theta, first)
    by_path = dict(zip(fitted.model.space.leaf_names, map(float, numbers), strict=True))
    return Clues(tracks, by_path, _typical_torques(fitted, tracks, by_path), _steady_speeds(fitted, by_path))


def _steady_speeds(fitted: FittedModel, numbers: Mapping[str, float]) -> dict[str, FloatArray]:
    """Return the speeds of all shafts at static points, which state that of the first shaft."""
    drive, terms = fitted.model.problem.drive, fitted.model.static
    if not terms:
        return {}
    found = {drive.shafts[0].name: np.concatenate([term.speed for term in terms])}
    for _ in drive.transmissions:
        for item in drive.transmissions:
            ratio = numbers.get(f"{item.from_shaft}-{item.to_shaft}.ratio", 1.0)
            if item.from_shaft in found and item.to_shaft not in found:
                found[item.to_shaft] = found[item.from_shaft] / ratio
            elif item.to_shaft in found and item.from_shaft not in found:
                found[item.from_shaft] = found[item.to_shaft] * ratio
    return found


def _watch(mech: Mechanism) -> tuple[ca.Function, list[str]]:
    """Return (x, u, p) -> motions of all shafts and torques of all motors, and their names."""
    state = state_symbols(mech)
    at = state.motion(mech)
    shafts, motors = mech.drive.shafts, mech.drive.motors
    values = [mech.shaft_angle(shaft.name, at) for shaft in shafts]
    values += [mech.shaft_speed(shaft.name, at) for shaft in shafts]
    values += [motor_torque(mech, motor, at) for motor in motors]
    names = [f"{shaft.name}.{kind}" for kind in ("theta", "omega") for shaft in shafts]
    names += [f"{motor.name}.torque" for motor in motors]
    u, p = column(list(mech.inputs.values())), column(list(mech.parameters.values()))
    return ca.Function("watch", [state.x, u, p], [column(values)]), names


def states_along(fitted: FittedModel, index: int) -> FloatArray:
    """Return (n, states) of a recording as the fitted model passes through it."""
    result = fitted.linear.program.simulate(index, fitted.linear.point, with_states=True)
    assert result.states is not None
    return result.states


def _track(
    fitted: FittedModel,
    index: int,
    watch: ca.Function,
    names: list[str],
    coarse: LinearRecording,
    fine: LinearRecording,
) -> Track:
    item = fitted.linear.program.experiments[index]
    numbers = fitted.model.space.numbers(fitted.theta, item.name)
    states = states_along(fitted, index)
    seen = np.asarray(watch.map(item.grid.time.size)(states.T, item.grid.at_node.T, numbers))
    table = {name: seen[k] for k, name in enumerate(names)}
    mech = fitted.model.drive.mechanism

    def of(kind: str) -> dict[str, FloatArray]:
        return {shaft.name: table[f"{shaft.name}.{kind}"] for shaft in mech.drive.shafts}

    torque = {motor.name: table[f"{motor.name}.torque"] for motor in mech.drive.motors}
    missing, finely = _missing(fitted, coarse), _missing(fitted, fine)
    return Track(item.grid.time, of("theta"), of("omega"), torque, missing, finely)


def _missing(fitted: FittedModel, smoother: LinearRecording) -> Missing:
    """Return the middle samples of segments and the mean torque that would close the gap behind each, by shaft."""
    mech, first = fitted.model.drive.mechanism, smoother.cut.first
    middle = ((first[:-2] + first[1:-1]) // 2).astype(np.int64)
    name = smoother.item.name
    inertias = group_inertias(mech, {**fitted.footing.numbers[name], **fitted.values})
    spans = np.diff(smoother.item.grid.time[first])[:-1]
    missing: dict[str, FloatArray] = {}
    for shaft in mech.drive.shafts:
        group = mech.topology.group_of[shaft.name]
        torque = np.zeros(middle.size)
        if group in mech.free_groups and middle.size:
            at = len(mech.angle_groups) + mech.free_groups.index(group)
            jump = smoother.nodes[1:, at] - smoother.end[:-1, at]
            ratio = speed_ratio(fitted.model, fitted.footing, name, shaft.name)
            torque = float(inertias[group]) * jump / spans / ratio
        missing[shaft.name] = torque
    return Missing(middle, missing)


def _smoothers(fitted: FittedModel, samples: int) -> tuple[LinearRecording, ...]:
    """Return recordings cut into segments between which the states may jump, to see what torque would make them."""
    options = replace(fitted.model.problem.estimation, segment=samples)
    model = replace(fitted.model, problem=replace(fitted.model.problem, estimation=options))
    items = fitted.linear.program.experiments
    program = relaxed(model, items, 0.0, Squares())
    start = Point(fitted.theta, program.suggested_nodes(fitted.theta))
    point = solve_nodes(program, start, SMOOTHING_STEPS)
    return tuple(LinearRecording(program, index, point) for index in range(len(items)))


def _per_unit(term: StaticTerm, motor: Motor, numbers: Mapping[str, float]) -> float:
    """Return the torque of a motor per unit of what static points hold."""
    return numbers.get(f"{motor.name}.torque_constant", 1.0) if term.effort == "current" else 1.0


def _typical_torques(fitted: FittedModel, tracks: tuple[Track, ...], numbers: dict[str, float]) -> dict[str, float]:
    """Return the rms of motor torques, carried through the ratios to every shaft; 1 where there is no motor.

    A motor without current, whose shaft is moved by an input, does what static points say.
    """
    drive = fitted.model.problem.drive
    found: dict[str, float] = {}
    for motor in drive.motors:
        values = np.concatenate([track.torque[motor.name] for track in tracks])
        if not np.any(values) and fitted.model.static:
            values = np.concatenate([term.measured * _per_unit(term, motor, numbers) for term in fitted.model.static])
        found[motor.shaft] = max(float(np.sqrt(np.mean(values**2))), 1e-12)
    for _ in drive.transmissions:
        for item in drive.transmissions:
            ratio = abs(numbers.get(f"{item.from_shaft}-{item.to_shaft}.ratio", 1.0))
            if item.from_shaft in found and item.to_shaft not in found:
                found[item.to_shaft] = found[item.from_shaft] * ratio
            elif item.to_shaft in found and item.from_shaft not in found:
                found[item.from_shaft] = found[item.to_shaft] / ratio
    return {shaft.name: found.get(shaft.name, 1.0) for shaft in drive.shafts}
