"""Sizes and motions from a fitted base model, for the initial guesses of effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.lateness import latenesses
from friction_ocp.diagnosis.missing_torque import Lacking, Watch, lacking, rms, shaft_motion
from friction_ocp.drive.gearing import relative_speeds
from friction_ocp.drive.mechanism import column
from friction_ocp.drive.motors import motor_torque
from friction_ocp.drive.parts import Motor
from friction_ocp.drive.stepping import state_symbols
from friction_ocp.drive.torques import elastic_torque, plain_twist
from friction_ocp.drive.units import DRIVE_TORQUE
from friction_ocp.effects.effect import Clues, Track
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.static_points import StaticTerm
from friction_ocp.execution.effort import once
from friction_ocp.simulation.grid import FloatArray, IntArray

SHARP_CORNER = 1e-6
"""Rounding of the flanks over the play, where what a joint carries is looked at."""

_known: WeakKeyDictionary[FittedModel, Clues] = WeakKeyDictionary()


def clues_of(fitted: FittedModel) -> Clues:
    """Return what the fitted model says about motions and torques; it is worked out once for every fit."""
    if fitted not in _known:
        _known[fitted] = _clues_of(fitted)
    return _known[fitted]


@once
def _clues_of(fitted: FittedModel) -> Clues:
    watch = _watch(fitted)
    tables = [_table(fitted, index, watch) for index in range(len(fitted.linear.recordings))]
    by_path = fitted.model.space.numbers_by_path(fitted.theta, fitted.model.train[0].name)
    typical = _typical_torques(fitted, tables, by_path)
    names = [item.name for item in fitted.linear.program.experiments]
    lacked = lacking(fitted, watch, typical)
    tracks = tuple(_track(fitted, *parts) for parts in zip(names, tables, lacked, strict=True))
    shafts = fitted.model.problem.drive.shafts
    linear = frozenset(shaft.name for shaft in shafts if shaft.motion == "linear")
    late = latenesses(fitted.model.problem.drive, fitted.linear.program.experiments, by_path)
    return Clues(tracks, by_path, typical, _steady_speeds(fitted, by_path), linear, late)


def _steady_speeds(fitted: FittedModel, numbers: Mapping[str, float]) -> dict[str, FloatArray]:
    """Return the speeds of all shafts at static points, which state that of the first shaft."""
    drive, terms = fitted.model.problem.drive, fitted.model.static
    if not terms:
        return {}
    first = np.concatenate([term.speed for term in terms])
    return {name: ratio * first for name, ratio in relative_speeds(drive, numbers).items()}


def _watch(fitted: FittedModel) -> Watch:
    """Return what tells motions of shafts and torques of motors from the states of a recording."""
    mech = fitted.model.drive.mechanism
    state = state_symbols(mech)
    at = state.motion(mech)
    shafts, motors = mech.drive.shafts, mech.drive.motors
    values = [mech.shaft_angle(shaft.name, at) for shaft in shafts]
    values += [mech.shaft_speed(shaft.name, at) for shaft in shafts]
    values += [motor_torque(mech, motor, at) for motor in motors]
    values += [plain_twist(mech, item, at) for item in mech.topology.elastic]
    values += [elastic_torque(mech, item, at, SHARP_CORNER) for item in mech.topology.elastic]
    names = [f"{shaft.name}.{kind}" for kind in ("theta", "omega") for shaft in shafts]
    names += [f"{motor.name}.torque" for motor in motors]
    names += [f"{item.name}.{kind}" for kind in ("twist", "carried") for item in mech.topology.elastic]
    u, p = column(list(mech.inputs.values())), column(list(mech.parameters.values()))
    function = ca.Function("watch", [state.x, u, p], [column(values)])

    def watch(item: Experiment, states: FloatArray, nodes: IntArray) -> dict[str, FloatArray]:
        numbers = fitted.model.space.numbers(fitted.theta, item.name)
        seen = np.asarray(function.map(nodes.size)(states.T, item.grid.at_node[nodes].T, numbers))
        return {name: seen[k] for k, name in enumerate(names)}

    return watch


def states_along(fitted: FittedModel, index: int) -> FloatArray:
    """Return (n, states) of a recording as the fitted model passes through it, without noise of inputs."""
    result = fitted.linear.program.simulate(index, fitted.linear.point, with_states=True)
    assert result.states is not None
    return result.states[:, : len(fitted.model.drive.state_names)]


def _table(fitted: FittedModel, index: int, watch: Watch) -> dict[str, FloatArray]:
    """Return (n,) time, motions of all shafts and torques of all motors along a recording, by name."""
    item = fitted.linear.program.experiments[index]
    seen = watch(item, states_along(fitted, index), np.arange(item.grid.time.size))
    return {"time": item.grid.time, **seen}


def _track(fitted: FittedModel, name: str, table: Mapping[str, FloatArray], lacked: Lacking) -> Track:
    drive = fitted.model.problem.drive
    motion = shaft_motion(drive, table, "theta"), shaft_motion(drive, table, "omega")
    torque = {motor.name: table[f"{motor.name}.torque"] for motor in drive.motors}
    since = table["time"] - next(use.recording.zero for use in fitted.model.problem.train if use.name == name)
    return Track(since, *motion, torque, lacked.missing, lacked.finely, name, lacked.alone)


def _per_unit(term: StaticTerm, motor: Motor, numbers: Mapping[str, float]) -> float:
    """Return the torque of a motor per unit of what static points hold."""
    return numbers.get(f"{motor.name}.torque_constant", 1.0) if term.effort == "current" else 1.0


def _typical_torques(
    fitted: FittedModel, tables: Sequence[Mapping[str, FloatArray]], numbers: dict[str, float]
) -> dict[str, float]:
    """Return the rms of motor torques, carried through the ratios to every shaft.

    A motor without current, whose shaft is moved by an input, does what static points say. Where there is no motor it
    is what a prescribed motion was seen to take, else what accelerates the shaft.
    """
    drive = fitted.model.problem.drive
    found: dict[str, float] = {}
    for motor in drive.motors:
        values = np.concatenate([table[f"{motor.name}.torque"] for table in tables])
        if not np.any(values) and fitted.model.static:
            values = np.concatenate([term.measured * _per_unit(term, motor, numbers) for term in fitted.model.static])
        found[motor.shaft] = max(rms([values]), 1e-12)
    for k, channel in enumerate(drive.outputs):
        if channel.signal == DRIVE_TORQUE:
            gain = abs(numbers.get(f"{channel.name}.gain", 1.0)) or 1.0
            columns = [item.measured[:, k] / gain for item in fitted.model.train]
            found.setdefault(channel.part, max(rms([values[np.isfinite(values)] for values in columns]), 1e-12))
    for _ in drive.transmissions:
        for item in drive.transmissions:
            ratio = abs(numbers.get(f"{item.from_shaft}-{item.to_shaft}.ratio", 1.0))
            if item.from_shaft in found and item.to_shaft not in found:
                found[item.to_shaft] = found[item.from_shaft] * ratio
            elif item.to_shaft in found and item.from_shaft not in found:
                found[item.from_shaft] = found[item.to_shaft] / ratio
    return {shaft.name: found.get(shaft.name) or _accelerating(shaft.name, tables, numbers) for shaft in drive.shafts}


def _accelerating(shaft: str, tables: Sequence[Mapping[str, FloatArray]], numbers: Mapping[str, float]) -> float:
    """Return the rms of what accelerates a shaft by itself, N m."""
    rates = [np.gradient(table[f"{shaft}.omega"], table["time"]) for table in tables]
    return max(abs(numbers[f"{shaft}.inertia"]) * rms(rates), 1e-12)
