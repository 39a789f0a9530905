"""Channels that a recording does not have: what they would add to what it tells."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.drive.units import SHAFT_SIGNALS, signal_unit
from friction_ocp.estimation.program import Blocks, Linearisation, Point, Program
from friction_ocp.simulation.grid import FloatArray, IntArray

NOISE_SHARE = {"theta": 1e-3, "omega": 1e-2, "alpha": 1e-2, "current": 1e-2, "torque": 1e-2}
"""Noise of an ordinary sensor over the deviation of its signal: encoder, tachometer, accelerometer, shunt, cell."""
SAMPLES = 2000
"""Nodes a recording at which a probe is looked at; each stands for the others around it."""
STEP = 1e-5
"""Relative step of the differences."""


@dataclass(frozen=True)
class Probe:
    """A hypothetical output channel."""

    measures: str
    noise_std: float
    unit: str
    system: Linearisation
    """The linearised program as it would be with this channel."""


def probes(program: Program, point: Point, system: Linearisation, drive: Drive) -> tuple[Probe, ...]:
    """Return every channel that could be added to recordings of a drive, each with what it would add."""
    wanted = _unmeasured(drive)
    if not wanted or not program.experiments:
        return ()
    added = tuple(Channel(f"probe {measures}", measures) for measures in wanted)
    sensed = stepped(replace(drive, channels=(*drive.channels, *added)))
    seen = [_seen(program, point, index, sensed, len(added)) for index in range(len(program.experiments))]
    found: list[Probe] = []
    for column, measures in enumerate(wanted):
        deviation = float(np.std(np.concatenate([item.value[:, column] for item in seen])))
        noise = NOISE_SHARE[measures.partition(".")[2]] * deviation
        if noise > 0 and np.isfinite(noise):
            found.append(Probe(measures, noise, signal_unit(drive, measures), _with(system, seen, column, noise)))
    return tuple(found)


def _unmeasured(drive: Drive) -> list[str]:
    """Return the signals of shafts and motors that can be predicted and that no channel has."""
    there = {channel.measures for channel in drive.channels}
    signals = [f"{shaft.name}.{signal}" for shaft in drive.shafts for signal in SHAFT_SIGNALS]
    for motor in drive.motors:
        if motor.resistance is not None or (drive.controller is not None and drive.controller.output == "current"):
            signals.append(f"{motor.name}.current")
        signals.append(f"{motor.name}.torque")
    return [signal for signal in signals if signal not in there]


@dataclass(frozen=True)
class _Seen:
    """What the probes see of one recording at some of its nodes."""

    value: FloatArray
    """(nodes, probes)."""
    slope: FloatArray
    """(nodes, probes, states + parameters)."""
    segment: IntArray
    """(nodes,) index of the segment."""
    stride: int


def _seen(program: Program, point: Point, index: int, sensed: SteppedDrive, count: int) -> _Seen:
    """Difference what the probes see by the states at the start of every segment and by the parameters."""
    grid, cut = program.experiments[index].grid, program.segments[index]
    stride = max(1, grid.time.size // SAMPLES)
    nodes = np.arange(0, grid.time.size, stride)
    look = _Look(program, index, sensed, nodes, count)
    here, theta = point.nodes[index], point.theta
    value = look(here, theta)
    scale = np.maximum(np.std(here, axis=0), 1e-6)
    columns: list[FloatArray] = []
    for k, size in enumerate(scale):
        step = STEP * size * np.eye(scale.size)[k]
        columns.append((look(here + step, theta) - value) / (STEP * size))
    for k, size in enumerate(np.where(theta != 0, np.abs(theta), program.space.scale)):
        step = STEP * size * np.eye(theta.size)[k]
        columns.append((look(here, theta + step) - value) / (STEP * size))
    segment = cut.owner(nodes)
    return _Seen(value, np.stack(columns, axis=2), segment, stride)


@dataclass(frozen=True)
class _Look:
    """The probes' values at some nodes of a recording as a function of segment starts and parameters."""

    program: Program
    index: int
    sensed: SteppedDrive
    nodes: IntArray
    count: int

    def __call__(self, starts: FloatArray, theta: FloatArray) -> FloatArray:
        program, item = self.program, self.program.experiments[self.index]
        numbers = program.space.numbers(theta, item.name)
        cut = program.segments[self.index]
        run = program.sweep.run(item.grid, cut.first, starts, numbers, program.width, with_states=True)
        assert run.states is not None
        step = np.append(item.grid.dt[:-1], item.grid.dt[-2]) / item.grid.substeps
        output = self.sensed.output.map(self.nodes.size)
        arguments = (run.states[self.nodes].T, item.grid.at_node[self.nodes].T, self._numbers(numbers))
        y = output(*arguments, step[self.nodes][None], program.width)
        return np.asarray(y).T[:, -self.count :]

    def _numbers(self, numbers: FloatArray) -> FloatArray:
        """Return the numbers of the drive with probes: ideal gains beside those of the drive."""
        table = dict(zip(self.program.drive.parameter_names, numbers, strict=True))
        ideal = {"gain": 1.0}
        names = self.sensed.parameter_names
        return np.array([table.get(name, ideal.get(name.rpartition(".")[2], 0.0)) for name in names])


def _with(system: Linearisation, seen: list[_Seen], column: int, noise: float) -> Linearisation:
    """Return the linearised program with one probe's samples added."""
    theta_theta, blocks = system.theta_theta.copy(), list[Blocks]()
    for item, old in zip(seen, system.blocks, strict=True):
        states = old.node_node.shape[1]
        rows = item.slope[:, column] * (np.sqrt(item.stride) / noise)
        by_node, by_theta = rows[:, :states], rows[:, states:]
        node_node, node_theta = old.node_node.copy(), old.node_theta.copy()
        np.add.at(node_node, item.segment, by_node[:, :, None] * by_node[:, None, :])
        np.add.at(node_theta, item.segment, by_node[:, :, None] * by_theta[:, None, :])
        theta_theta += by_theta.T @ by_theta
        blocks.append(replace(old, node_node=node_node, node_theta=node_theta))
    return replace(system, theta_theta=theta_theta, blocks=tuple(blocks))
