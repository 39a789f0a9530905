"""What a drive is doing at every instant: sticking, reversing, slow, fast, accelerating or under high load."""

from __future__ import annotations

import numpy as np

from friction_ocp.estimation.model import Model
from friction_ocp.estimation.score import FreeRun
from friction_ocp.recording.conditioning import smooth_motion
from friction_ocp.simulation.grid import FloatArray, IntArray

REGIMES = ("sticking", "reversal", "slow", "fast", "accelerating", "high_load")
STICKING, REVERSAL, SLOW, FAST, ACCELERATING, HIGH_LOAD = range(6)
STILL = 0.01
"""Speed over the fastest below which a shaft counts as at rest."""
SLOW_SHARE = 0.25
"""Speed over the fastest below which it counts as slow."""
UPPER_QUARTER = 0.75
AROUND_REVERSAL = 0.01
"""Share of the recording on either side of a change of direction."""


def regimes(model: Model, run: FreeRun) -> IntArray:
    """Return (n,) the regime of the first shaft whose motion is measured, from the measurement itself."""
    speed, acceleration = _motion(model, run)
    fastest = max(float(np.quantile(np.abs(speed), 0.98)), 1e-300)
    labels = np.full(run.time.size, FAST, dtype=np.int64)
    labels[np.abs(acceleration) > np.quantile(np.abs(acceleration), UPPER_QUARTER)] = ACCELERATING
    load = _load(model, run)
    if load is not None:
        labels[np.abs(load) > np.quantile(np.abs(load), UPPER_QUARTER)] = HIGH_LOAD
    labels[np.abs(speed) < SLOW_SHARE * fastest] = SLOW
    moving = np.where(np.abs(speed) < STILL * fastest, 0.0, np.sign(speed))
    turns = np.flatnonzero(moving[1:] * moving[:-1] < 0)
    reach = max(1, round(AROUND_REVERSAL * run.time.size))
    for turn in turns:
        labels[max(0, turn - reach) : turn + reach + 1] = REVERSAL
    labels[np.abs(speed) < STILL * fastest] = STICKING
    return labels


def _motion(model: Model, run: FreeRun) -> tuple[FloatArray, FloatArray]:
    """Return measured speed and acceleration of the first output that is a motion, else of the simulation."""
    for k, channel in enumerate(model.problem.drive.outputs):
        seen = np.isfinite(run.measured[:, k])
        if channel.signal in ("theta", "omega") and seen.sum() > 10:
            value, rate, bend = smooth_motion(run.time[seen], run.measured[seen, k])
            pair = (rate, bend) if channel.signal == "theta" else (value, rate)
            speed, acceleration = (np.interp(run.time, run.time[seen], item) for item in pair)
            return speed, acceleration
    mech = model.drive.mechanism
    speed = run.states[:, len(mech.angle_groups)] if mech.free_groups else np.zeros(run.time.size)
    return speed, np.gradient(speed, run.time)


def _load(model: Model, run: FreeRun) -> FloatArray | None:
    """Return the measured current, torque or voltage of the first motor, where there is one."""
    for use in model.problem.recordings:
        if use.name != run.name:
            continue
        for channel in model.problem.drive.channels:
            if channel.signal in ("current", "torque", "voltage"):
                recorded = use.recording.channels[channel.name]
                known = np.isfinite(recorded.values)
                return np.interp(run.time, recorded.time[known], recorded.values[known])
    return None
