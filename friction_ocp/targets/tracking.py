"""What friction compensation buys: tracking error before and after, simulated on the identified drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from friction_ocp.drive.parts import Drive, ExternalTorque
from friction_ocp.drive.steady import reference_shaft, steady_speeds
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.recording.conditioning import smooth_motion
from friction_ocp.simulation.grid import BoolArray, FloatArray
from friction_ocp.simulation.interpreted import schedule
from friction_ocp.targets.c_source import compensation, compensation_width
from friction_ocp.targets.fitted import Fitted, Run, flat, rms

MOST_NODES = 20_000
"""Nodes that are simulated of all recordings together; of longer ones the beginning."""


@dataclass(frozen=True)
class Tracking:
    """How far a drive stays behind its reference in one recording while its motor is on, root mean square."""

    recording: str
    unit: str
    measured: float
    """As it was recorded."""
    before: float
    """In the simulation."""
    after: float
    """In the simulation with the compensation."""
    seconds: float
    """How much of the recording was simulated, from its start."""

    @property
    def gain(self) -> float:
        """The share of the error that the compensation takes away."""
        return 1.0 - self.after / self.before if self.before > 0 else 0.0


def tracking_gain(fitted: Fitted) -> tuple[Tracking, ...]:
    """Simulate the closed loop with and without the exported compensation, fed with the speed of the reference.

    The compensation acts as a torque on the shaft of the first motor beside that of the controller, while the motor is
    on; that it saturates or lags is not seen. Empty where no controller follows a recorded angle.
    """
    feedback = _feedback(fitted.drive)
    if feedback is None:
        return ()
    name, unit = feedback
    column = list(fitted.simulation.units).index(name)
    runs = fitted.runs()
    most = MOST_NODES // max(len(runs), 1)
    return tuple(_tracking(fitted, run, unit, column, most) for run in runs)


def _tracking(fitted: Fitted, run: Run, unit: str, column: int, most: int) -> Tracking:
    time, reference, on = run.item.grid.time[:most], _reference(fitted, run)[:most], _enabled(fitted, run)[:most]
    measured = rms((run.free.measured[:most, column] - reference)[on])
    without, with_it = (_closed_loop(fitted, run, share, most)[:, column] - reference for share in (0.0, 1.0))
    before, after = (float(np.sqrt(np.mean(error[on] ** 2))) if on.any() else 0.0 for error in (without, with_it))
    return Tracking(run.item.name, unit, measured, before, after, float(time[-1] - time[0]))


def tracking_document(fitted: Fitted, rows: Sequence[Tracking]) -> dict[str, Any]:
    """Return what a result says of it, {} where nothing is predicted."""
    if not rows:
        return {}
    found = {
        row.recording: {
            "unit": row.unit,
            **{key: _number(getattr(row, key)) for key in ("measured", "before", "after", "gain")},
            "seconds": row.seconds,
        }
        for row in rows
    }
    return {"shaft": reference_shaft(fitted.drive), "tracking_rms": found}


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def tracking_text(rows: Sequence[Tracking]) -> str:
    """Return the prediction in words."""
    lines = ["Friction compensation, simulated on the identified drive (rms distance to the reference):"]
    for row in rows:
        sizes = f"{row.before:.3g} {row.unit} before, {row.after:.3g} {row.unit} after"
        lines.append(f"  {row.recording}: {sizes}, {_change(row.gain)} (measured: {row.measured:.3g} {row.unit})")
    return "\n".join(lines)


def _change(gain: float) -> str:
    return f"{abs(gain):.1%} {'less' if gain >= 0 else 'more'}"


def follows(drive: Drive) -> bool:
    """Whether a controller makes a drive follow a recorded angle."""
    return _feedback(drive) is not None


def _feedback(drive: Drive) -> tuple[str, str] | None:
    """Return the output channel by which a controller follows a recorded angle, and its unit."""
    led = any(channel.measures == "reference.theta" for channel in drive.inputs)
    if drive.controller is None or not led or drive.controller.type == "pi_velocity":
        return None
    for channel in drive.outputs:
        if channel.name == drive.controller.feedback and channel.signal == "theta":
            return channel.name, "m" if drive.shaft(channel.part).motion == "linear" else "rad"
    return None


def _reference(fitted: Fitted, run: Run) -> FloatArray:
    names = fitted.model.drive.input_names
    channel = next(item for item in fitted.drive.inputs if item.measures == "reference.theta")
    return (run.item.grid.at_node[:, names.index(channel.name)] - float(channel.offset)) / float(channel.gain)


def _wanted_speed(fitted: Fitted, run: Run) -> FloatArray:
    """Return (n,) the speed of the reference at the motor's shaft."""
    controller = fitted.drive.controller
    assert controller is not None
    shaft = next(item.part for item in fitted.drive.channels if item.name == controller.feedback)
    _, rate, _ = smooth_motion(run.item.grid.time, _reference(fitted, run))
    return rate / steady_speeds(fitted.drive)[shaft]


def _enabled(fitted: Fitted, run: Run) -> BoolArray:
    """Return (n,) whether the first motor is on."""
    motor = fitted.drive.motors[0].name
    names = fitted.model.drive.input_names
    channels = [item.name for item in fitted.drive.inputs if item.measures == f"{motor}.enable"]
    signals = run.item.grid.at_node
    return signals[:, names.index(channels[0])] > 0.5 if channels else np.ones(len(signals), dtype=np.bool_)


def _closed_loop(fitted: Fitted, run: Run, share: float, most: int) -> FloatArray:
    """Return (nodes, outputs) with a share of the compensating torque on the motor's shaft, `most` nodes at most."""
    shaft = reference_shaft(fitted.drive)
    drive = stepped(_with_torque(fitted.model.problem.drive, shaft))
    p = _numbers(fitted, run, drive.parameter_names)
    constant = drive.parameter_names.index(f"{shaft}.external_torque.constant")
    grid, nodes = run.item.grid, min(most, run.item.grid.time.size)
    operations = schedule(grid, 0, nodes - 1, True)
    torque = share * _compensating(fitted, run)[:nodes]
    first = int(operations.node[0])  # the states of a free run are those after the ticks of its first node
    later = np.arange(first, operations.controls.shape[1], dtype=np.int64)
    owner = np.searchsorted(operations.node, later, side="right") - 1
    controls = np.vstack([operations.controls[:, first:], torque[owner]])
    x0 = run.free.states[0]
    advance = _advance(drive, p, constant).mapaccum(controls.shape[1])
    course = np.column_stack([x0, _array(advance(x0, controls))])
    numbers = np.repeat(p[:, None], nodes, axis=1)
    numbers[constant] += torque
    width = np.zeros((_widths(drive), nodes))
    states = course[:, operations.node - first]
    return _array(drive.output.map(nodes)(states, grid.at_node[:nodes].T, numbers, operations.h[None, :], width)).T


def _array(value: Any) -> FloatArray:
    return np.asarray(value, dtype=np.float64)


def _widths(drive: SteppedDrive) -> int:
    return len(drive.mechanism.topology.roots) + 1


def _advance(drive: SteppedDrive, p: FloatArray, constant: int) -> ca.Function:
    """Return (state, operation) -> state after a step or a tick; the last row of an operation is a torque."""
    inputs = len(drive.input_names)
    x, operation = ca.MX.sym("x", len(drive.state_names)), ca.MX.sym("operation", inputs + 3)
    u, (h, kind, torque) = operation[:inputs], (operation[inputs + k] for k in range(3))
    numbers = ca.MX(ca.DM(p)) + ca.DM(np.eye(p.size)[constant]) * torque
    after = drive.step(x, u, numbers, h, ca.DM.zeros(_widths(drive)))
    if drive.tick is not None:
        after = ca.if_else(kind > 0, drive.tick(x, u, numbers, kind), after, True)
    return ca.Function("advance", [x, operation], [after])


def _numbers(fitted: Fitted, run: Run, names: Sequence[str]) -> FloatArray:
    known = dict(zip(fitted.model.drive.parameter_names, run.numbers, strict=True))
    return np.array([known.get(name, 0.0) for name in names])


def _compensating(fitted: Fitted, run: Run) -> FloatArray:
    """Return (n,) the torque that cancels the friction at the speed of the reference, none while the motor is off."""
    friction = compensation(fitted).map(run.item.grid.time.size)
    torque = flat(friction(_wanted_speed(fitted, run)[None, :], compensation_width(fitted), run.numbers))
    return torque * _enabled(fitted, run)


def _with_torque(drive: Drive, name: str) -> Drive:
    return replace(
        drive,
        shafts=tuple(
            replace(shaft, external_torque=shaft.external_torque or ExternalTorque(0.0))
            if shaft.name == name
            else shaft
            for shaft in drive.shafts
        ),
    )
