"""Sizes and motions from a fitted base model, for the initial guesses of effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.linear import LinearRecording
from friction_ocp.drive.gearing import relative_speeds
from friction_ocp.drive.input_noise import NOISE
from friction_ocp.drive.mechanism import column
from friction_ocp.drive.motors import motor_torque
from friction_ocp.drive.parts import Drive, Motor
from friction_ocp.drive.stepping import state_symbols
from friction_ocp.drive.torques import elastic_torque, plain_twist
from friction_ocp.drive.units import DRIVE_TORQUE
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.estimation.drive_noise import group_inertias
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.stages import relaxed
from friction_ocp.estimation.static_points import StaticTerm
from friction_ocp.estimation.torque_noise import driving, speed_ratio
from friction_ocp.execution.effort import once
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.losses import Squares

SMOOTHING_STEPS = 4
FINE, MOST_FINE = 4, 3000
"""Samples in the segments that show what torque is missing as finely as recordings tell; most such segments in one."""

SHARP_CORNER = 1e-6
"""Rounding of the flanks over the play, where what a joint carries is looked at."""
MISSED = 0.1
"""Torque that may be missing over that which moves a shaft, unless recordings need more."""
LARGER = 3
"""Times that it grows to what was found with less."""

_Watch = Callable[[Experiment, FloatArray, IntArray], dict[str, FloatArray]]

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
    missing = _torques(fitted, watch, typical)
    names = [item.name for item in fitted.linear.program.experiments]
    tracks = tuple(_track(fitted, *parts) for parts in zip(names, tables, *missing, strict=True))
    shafts = fitted.model.problem.drive.shafts
    linear = frozenset(shaft.name for shaft in shafts if shaft.motion == "linear")
    return Clues(tracks, by_path, typical, _steady_speeds(fitted, by_path), linear)


def _torques(fitted: FittedModel, watch: _Watch, typical: Mapping[str, float]) -> tuple[list[Missing], list[Missing]]:
    """Return what torque is missing in every recording, over the segments of the fit and over a few samples each."""

    def pulled(samples: int, size: Mapping[str, float]) -> list[Missing]:
        return [_missing(fitted, item, watch) for item in _smoothers(fitted, samples, size)]

    items = fitted.linear.program.experiments
    fine = max(FINE, max(item.grid.time.size for item in items) // MOST_FINE)
    size = {shaft: MISSED * torque for shaft, torque in typical.items()}
    finely = pulled(fine, size)
    for _ in range(LARGER):
        seen = {shaft: _rms([item.torque[shaft] for item in finely]) for shaft in size}
        if not any(seen[shaft] > size[shaft] for shaft in size):
            break
        size = {shaft: max(size[shaft], seen[shaft]) for shaft in size}
        finely = pulled(fine, size)
    if not fitted.footing.joined:
        return pulled(fitted.model.problem.estimation.samples, size), finely
    return [_missing(fitted, item, watch) for item in fitted.linear.recordings], finely


def _rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if any(part.size for part in parts) else 0.0


def _steady_speeds(fitted: FittedModel, numbers: Mapping[str, float]) -> dict[str, FloatArray]:
    """Return the speeds of all shafts at static points, which state that of the first shaft."""
    drive, terms = fitted.model.problem.drive, fitted.model.static
    if not terms:
        return {}
    first = np.concatenate([term.speed for term in terms])
    return {name: ratio * first for name, ratio in relative_speeds(drive, numbers).items()}


def _watch(fitted: FittedModel) -> _Watch:
    """Return (recording, (n, states), (n,) nodes of its grid) -> (n,) motions of shafts and torques of motors."""
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


def _table(fitted: FittedModel, index: int, watch: _Watch) -> dict[str, FloatArray]:
    """Return (n,) time, motions of all shafts and torques of all motors along a recording, by name."""
    item = fitted.linear.program.experiments[index]
    seen = watch(item, states_along(fitted, index), np.arange(item.grid.time.size))
    return {"time": item.grid.time, **seen}


def _track(fitted: FittedModel, name: str, table: Mapping[str, FloatArray], missing: Missing, finely: Missing) -> Track:
    drive = fitted.model.problem.drive
    torque = {motor.name: table[f"{motor.name}.torque"] for motor in drive.motors}
    since = table["time"] - next(use.recording.zero for use in fitted.model.problem.train if use.name == name)
    return Track(since, _of(drive, table, "theta"), _of(drive, table, "omega"), torque, missing, finely, name)


def _of(drive: Drive, table: Mapping[str, FloatArray], kind: str) -> dict[str, FloatArray]:
    return {shaft.name: table[f"{shaft.name}.{kind}"] for shaft in drive.shafts}


def _missing(fitted: FittedModel, smoother: LinearRecording, watch: _Watch) -> Missing:
    """Return the mean torque that would close the gap behind each segment, and the motion with all these torques."""
    mech, first = fitted.model.drive.mechanism, smoother.cut.first
    middle = ((first[:-2] + first[1:-1]) // 2).astype(np.int64)
    name, hidden = smoother.item.name, _hidden_by_noise(fitted, smoother)
    inertias = group_inertias(mech, {**fitted.footing.numbers[name], **fitted.values})
    spans = np.diff(smoother.item.grid.time[first])[:-1]
    missing: dict[str, FloatArray] = {}
    for shaft in mech.drive.shafts:
        group = mech.topology.group_of[shaft.name]
        torque = np.zeros(middle.size)
        if group in mech.free_groups and middle.size:
            at = len(mech.angle_groups) + mech.free_groups.index(group)
            jump = smoother.nodes[1:, at] - smoother.end[:-1, at]
            ratio = speed_ratio(mech, fitted.footing.numbers[name], shaft.name)
            torque = float(inertias[group]) * jump / spans / ratio
        missing[shaft.name] = torque + hidden.get(shaft.name, 0.0)
    nodes = watch(smoother.item, smoother.nodes[:, : len(mech.state_names)], first[:-1])
    motion = {name: 0.5 * (values[1:] + values[:-1]) for name, values in nodes.items()}
    joints = [item.name for item in mech.topology.elastic]
    twist, torque = ({name: motion[f"{name}.{kind}"] for name in joints} for kind in ("twist", "carried"))
    return Missing(middle, missing, _of(mech.drive, motion, "theta"), _of(mech.drive, motion, "omega"), twist, torque)


def _hidden_by_noise(fitted: FittedModel, smoother: LinearRecording) -> dict[str, FloatArray]:
    """Return by shaft (segments - 1,) the mean torque that a fit calls noise of a measured input."""
    drive, found = smoother.drive, dict[str, FloatArray]()
    numbers = {**fitted.footing.numbers[smoother.item.name], **fitted.values}
    for shaft, channel, factor in driving(fitted.model.problem.drive, numbers):
        if channel.name in drive.noisy_inputs:
            noise = smoother.nodes[:, drive.state_names.index(channel.name + NOISE)]
            mean = noise[:-1] if channel.hold == "zero" else 0.5 * (noise[:-1] + noise[1:])
            found[shaft] = found.get(shaft, 0.0) - factor * mean
    return found


def _smoothers(fitted: FittedModel, samples: int, size: Mapping[str, float]) -> tuple[LinearRecording, ...]:
    """Return recordings cut into segments between which torques may pull, to see which would make the recordings.

    The torques are taken to be noise of the size that may be missing, a new one in every segment. Of noise in the
    measurement then only as much is left as such torques could make of it: what the speed is off by from one segment
    to the next, an encoder hardly sees, and jumps that bind nothing would be all noise. What the sum of these torques
    and a wave have in common is what tells the wave best from noise (Wiener's filter is the matched filter, for a
    torque that is as large at all frequencies).
    """
    items = fitted.linear.program.experiments
    span = samples * float(np.median(np.diff(items[0].grid.time)))
    density = {shaft: torque * float(np.sqrt(span)) for shaft, torque in size.items()}
    options = replace(fitted.model.problem.estimation, segment=samples, process_noise=density, estimated_noise=())
    model = replace(fitted.model, problem=replace(fitted.model.problem, estimation=options), noise_levels=())
    program = relaxed(model, items, 0.0, Squares())
    start = suggested_point(program, fitted.theta)
    point = solve_nodes(program, start, SMOOTHING_STEPS)
    return tuple(LinearRecording(program, index, point) for index in range(len(items)))


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
        found[motor.shaft] = max(_rms([values]), 1e-12)
    for k, channel in enumerate(drive.outputs):
        if channel.signal == DRIVE_TORQUE:
            gain = abs(numbers.get(f"{channel.name}.gain", 1.0)) or 1.0
            columns = [item.measured[:, k] / gain for item in fitted.model.train]
            found.setdefault(channel.part, max(_rms([values[np.isfinite(values)] for values in columns]), 1e-12))
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
    return max(abs(numbers[f"{shaft}.inertia"]) * _rms(rates), 1e-12)
