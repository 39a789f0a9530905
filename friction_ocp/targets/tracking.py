"""What friction compensation buys: tracking error before and after, simulated on the identified drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.drive.parts import Drive, ExternalTorque
from friction_ocp.drive.steady import reference_shaft, steady_speeds
from friction_ocp.drive.stepping import stepped
from friction_ocp.recording.conditioning import smooth_motion
from friction_ocp.simulation.grid import APPLY, COMPUTE, FloatArray
from friction_ocp.targets.c_source import compensation, compensation_width
from friction_ocp.targets.fitted import Fitted, Run, flat, rms


@dataclass(frozen=True)
class Tracking:
    """How far a drive stays behind its reference in one recording, root mean square."""

    recording: str
    unit: str
    before: float
    after: float

    @property
    def gain(self) -> float:
        """The share of the error that the compensation takes away."""
        return 1.0 - self.after / self.before if self.before > 0 else 0.0


def tracking_gain(fitted: Fitted) -> tuple[Tracking, ...]:
    """Simulate the closed loop with and without the exported compensation, fed with the speed of the reference.

    The compensation acts as a torque on the shaft of the first motor beside that of the controller; what saturates
    there, lags or has no power is not seen. Empty where no controller follows a recorded angle.
    """
    feedback = _feedback(fitted.drive)
    if feedback is None:
        return ()
    name, unit = feedback
    column = list(fitted.simulation.units).index(name)
    rows: list[Tracking] = []
    for run in fitted.runs():
        reference = _reference(fitted, run)
        errors = [_closed_loop(fitted, run, share)[:, column] - reference for share in (0.0, 1.0)]
        rows.append(Tracking(run.item.name, unit, *(rms(error) for error in errors)))
    return tuple(rows)


def tracking_text(rows: Sequence[Tracking]) -> str:
    """Return the prediction in words."""
    lines = ["Friction compensation, simulated on the identified drive (rms distance to the reference):"]
    for row in rows:
        sizes = f"{row.before:.4g} {row.unit} before, {row.after:.4g} after"
        lines.append(f"  {row.recording}: {sizes} ({row.gain:.0%} less)")
    return "\n".join(lines)


def _feedback(drive: Drive) -> tuple[str, str] | None:
    """Return the output channel by which a controller follows a recorded angle, and its unit."""
    follows = any(channel.measures == "reference.theta" for channel in drive.inputs)
    if drive.controller is None or not follows or drive.controller.type == "pi_velocity":
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


def _closed_loop(fitted: Fitted, run: Run, share: float) -> FloatArray:
    """Return (n, outputs) with a share of the compensating torque on the motor's shaft."""
    shaft = reference_shaft(fitted.drive)
    drive = stepped(_with_torque(fitted.model.problem.drive, shaft))
    names = fitted.model.drive.parameter_names
    known = dict(zip(names, run.numbers, strict=True))
    constant = drive.parameter_names.index(f"{shaft}.external_torque.constant")
    p = np.array([known.get(name, 0.0) for name in drive.parameter_names])
    base = p[constant]
    friction = compensation(fitted).map(run.item.grid.time.size)
    torque = flat(friction(_wanted_speed(fitted, run)[None, :], compensation_width(fitted), run.numbers))
    width = np.zeros(len(drive.mechanism.topology.roots) + 1)
    grid, y = run.item.grid, np.full_like(run.free.simulated, np.nan)
    x = run.free.states[0].copy()
    for k in range(grid.time.size):
        for kind in (APPLY, COMPUTE):
            if drive.tick is not None and k and grid.ticks[k] & kind:
                x = flat(drive.tick(x, grid.at_node[k], p, kind))
        p[constant] = base + share * torque[k]
        steps = int(grid.substeps[k])
        h = float(grid.dt[k] or grid.dt[k - 1]) / steps
        y[k] = flat(drive.output(x, grid.at_node[k], p, h, width))
        for sub in range(steps if grid.dt[k] > 0 else 0):
            u = grid.between(k, (sub + 0.5) / steps)
            x = flat(drive.step(x, u, p, h, width))
    return y


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
