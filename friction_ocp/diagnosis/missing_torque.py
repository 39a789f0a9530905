"""Which torque a fitted model lacks: what would have to pull from segment to segment for recordings to come about."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.linear import LinearRecording
from friction_ocp.drive.input_noise import NOISE
from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import Missing
from friction_ocp.estimation.drive_noise import group_inertias
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.factors import inverse_roots
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gap import gap_covariance
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.estimation.stages import relaxed
from friction_ocp.estimation.torque_noise import driving, speed_ratio
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.losses import Squares

SMOOTHING_STEPS = 4
FINE, MOST_FINE = 4, 3000
"""Samples in the segments that show what torque is missing as finely as recordings tell; most such segments in one."""
MISSED = 0.1
"""Torque that may be missing over that which moves a shaft, unless recordings need more."""
LARGER = 3
"""Times that it grows to what was found with less."""
ELSEWHERE = 0.01
"""Torque that may be missing elsewhere over what is, where one shaft alone is to lack it."""
STIFF = 1e-8
"""Of what may jump without a torque, the share that then may: a stiff spring that jumps a little pulls much."""

Watch = Callable[[Experiment, FloatArray, IntArray], dict[str, FloatArray]]
"""(recording, (n, states), (n,) nodes of its grid) -> (n,) motions of shafts and torques of motors, by name."""


@dataclass(frozen=True)
class Lacking:
    """What torque is missing along a recording."""

    missing: Missing
    """Over the segments of the fit."""
    finely: Missing
    """Over a few samples each."""
    alone: Mapping[str, Missing]
    """The same by shaft, where no other one lacks any; empty where one turns as all others do."""


def lacking(fitted: FittedModel, watch: Watch, typical: Mapping[str, float]) -> list[Lacking]:
    """Return what torque is missing in every recording; `typical` moves each shaft, N m."""

    def pulled(samples: int, size: Mapping[str, float], stiff: bool = False) -> list[Missing]:
        return [_missing(fitted, item, watch) for item in _smoothers(fitted, samples, size, stiff)]

    items = fitted.linear.program.experiments
    fine = max(FINE, max(item.grid.time.size for item in items) // MOST_FINE)
    size = {shaft: MISSED * torque for shaft, torque in typical.items()}
    finely = pulled(fine, size)
    for _ in range(LARGER):
        seen = {shaft: rms([item.torque[shaft] for item in finely]) for shaft in size}
        if not any(seen[shaft] > size[shaft] for shaft in size):
            break
        size = {shaft: max(size[shaft], seen[shaft]) for shaft in size}
        finely = pulled(fine, size)
    alone: list[dict[str, Missing]] = [{} for _ in items]
    for shafts in _apart(fitted):
        there = {shaft: torque if shaft in shafts else ELSEWHERE * torque for shaft, torque in size.items()}
        for known, found in zip(alone, pulled(fine, there, stiff=True), strict=True):
            known |= dict.fromkeys(shafts, found)
    if fitted.footing.joined:
        coarsely = [_missing(fitted, item, watch) for item in fitted.linear.recordings]
    else:
        coarsely = pulled(fitted.model.problem.estimation.samples, size)
    return [Lacking(*each) for each in zip(coarsely, finely, alone, strict=True)]


def _apart(fitted: FittedModel) -> list[tuple[str, ...]]:
    """Return the shafts of groups that can turn apart from others, group by group."""
    mech = fitted.model.drive.mechanism
    groups = mech.free_groups if len(mech.free_groups) > 1 else ()
    shafts = [shaft.name for shaft in mech.drive.shafts]
    return [tuple(shaft for shaft in shafts if mech.topology.group_of[shaft] == group) for group in groups]


def rms(parts: Sequence[FloatArray]) -> float:
    """Return the root mean square of all parts together; 0 for none."""
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if any(part.size for part in parts) else 0.0


def shaft_motion(drive: Drive, table: Mapping[str, FloatArray], kind: str) -> dict[str, FloatArray]:
    """Return by shaft (n,) its angles ("theta") or speeds ("omega") out of a table by name."""
    return {shaft.name: table[f"{shaft.name}.{kind}"] for shaft in drive.shafts}


def _missing(fitted: FittedModel, smoother: LinearRecording, watch: Watch) -> Missing:
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
    return Missing(
        middle,
        missing,
        shaft_motion(mech.drive, motion, "theta"),
        shaft_motion(mech.drive, motion, "omega"),
        twist,
        torque,
    )


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


def _smoothers(
    fitted: FittedModel, samples: int, size: Mapping[str, float], stiff: bool
) -> tuple[LinearRecording, ...]:
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
    if stiff:
        program = _stiffened(model, program)
    start = suggested_point(program, fitted.theta)
    point = solve_nodes(program, start, SMOOTHING_STEPS)
    return tuple(LinearRecording(program, index, point) for index in range(len(items)))


def _stiffened(model: Model, program: Program) -> Program:
    """Return a program in which hardly anything jumps but what torques move."""

    def stiff(item: Experiment, cut: Segments) -> Segments:
        spans = np.diff(item.grid.time[cut.first])[:-1]
        return replace(cut, gap_weight=inverse_roots(gap_covariance(model, item, spans, STIFF**2)))

    return replace(program, segments=tuple(map(stiff, program.experiments, program.segments)))
