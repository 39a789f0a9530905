"""A recording that has not been made: the drive as a model has it, led through a motion within limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.drive.gearing import relative_speeds
from friction_ocp.drive.parts import Channel, Controller, Drive, Motor
from friction_ocp.drive.units import signal_unit
from friction_ocp.drive.values import bind_drive
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.modes import slowest_period
from friction_ocp.estimation.problem import EstimationOptions, RecordingUse
from friction_ocp.estimation.stages import free_run
from friction_ocp.excitation.limits import Limits
from friction_ocp.excitation.motions import Motion
from friction_ocp.recording import recording as log
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

LED = "led_"
"""What the names of channels begin with that only lead the drive or watch it."""
SHRINKS = 6
"""Attempts at an amplitude within the limits."""
MARGIN = 1.05
SLOWER_THAN_MODES, SLOWER_THAN_SAMPLES = 3.0, 20.0
"""Period of the leading loop over the slowest period of the drive, and over the sampling interval."""


@dataclass(frozen=True)
class TrialRun:
    """A motion as a model would record it, without noise."""

    motion: Motion
    amplitude: float
    """Share of the allowed speed at which all limits hold."""
    recording: log.Recording
    """All channels of the problem."""
    peaks: Mapping[str, float]
    """Largest speed and torque, and travel, of the first shaft."""


def trial_run(fitted: FittedModel, motion: Motion, limits: Limits) -> TrialRun | None:
    """Lead the drive through a motion; None where no amplitude keeps the limits or the simulation breaks down."""
    amplitude = 1.0
    for _ in range(SHRINKS):
        try:
            recording, peaks = _led(fitted, motion, amplitude * limits.speed, limits)
        except FrictionOcpError:
            return None
        excess = max(peaks[key] / getattr(limits, key) for key in peaks)
        if not np.isfinite(excess):
            return None
        if excess <= MARGIN:
            return TrialRun(motion, amplitude, recording, peaks)
        amplitude /= excess
    return None


def _led(fitted: FittedModel, motion: Motion, speed: float, limits: Limits) -> tuple[log.Recording, dict[str, float]]:
    """Return what the problem's channels record of a motion, and its peaks; raises FrictionOcpError.

    Where nothing in the model closes a loop, one that stands for whatever moves the machine finds the command; the
    recording is what that command does to the model.
    """
    problem = fitted.model.problem
    bound = bind_drive(problem.drive, fitted.model.space.numbers_by_path(fitted.theta, problem.train[0].name))
    time = _time(problem.train)
    share = speed * motion.speed(time / time[-1])
    drive = _watched(bound if bound.controller is not None else _looped(fitted, bound, limits))
    inputs = _inputs(drive, problem.train[0].recording, time, share, limits)
    seen = _simulated(fitted, drive, inputs, time)
    recorded = {**inputs, **seen}
    if bound.controller is None:
        known = {item.name: recorded[item.name] for item in bound.inputs}
        recorded = {**known, **_simulated(fitted, bound, known, time)}
    units = {item.name: signal_unit(problem.drive, item.measures) for item in problem.drive.channels}
    channels = {name: log.Channel(name, time, recorded[name], unit) for name, unit in units.items()}
    peaks = {
        "speed": float(np.max(np.abs(seen[f"{LED}omega"]))),
        "torque": float(np.max(np.abs(seen[f"{LED}torque"]))),
        "travel": float(np.ptp(seen[f"{LED}theta"])),
    }
    return log.Recording(motion.name, channels, title=motion.sentence), peaks


def _simulated(
    fitted: FittedModel, drive: Drive, inputs: Mapping[str, FloatArray], time: FloatArray
) -> dict[str, FloatArray]:
    """Return the outputs of a drive without free numbers, from rest at zero; raises FrictionOcpError."""
    problem = fitted.model.problem
    still = {item.name: np.zeros(time.size) for item in drive.outputs}
    channels = {name: log.Channel(name, time, values, "") for name, values in {**inputs, **still}.items()}
    use = RecordingUse(log.Recording(problem.train[0].name, channels), problem.train[0].set)
    options = EstimationOptions(initial_state="measured", max_step=fitted.model.max_step)
    model = prepare(replace(problem, drive=drive, train=(use,), validation=(), static=(), estimation=options))
    program = free_run(model, model.train, 0.0, Squares(), None)
    y = program.simulate(0, suggested_point(program, model.space.guess)).y
    if not np.all(np.isfinite(y)):
        raise FrictionOcpError(Finding(problem.title, "the simulation breaks down", "a motion that the model can make"))
    at = model.train[0].grid.time
    return {name: np.interp(time, at, y[:, k]) for k, name in enumerate(model.drive.output_names)}


def _time(uses: tuple[RecordingUse, ...]) -> FloatArray:
    """Return a time axis as long and as dense as the recordings at hand."""
    clocks = [max((c.time for c in use.recording.channels.values()), key=lambda one: one.size) for use in uses]
    step = float(np.median(np.concatenate([np.diff(clock) for clock in clocks])))
    span = float(np.median([clock[-1] - clock[0] for clock in clocks]))
    return np.asarray(step * np.arange(round(span / step) + 1), dtype=np.float64)


def _inputs(
    drive: Drive, recording: log.Recording, time: FloatArray, speed: FloatArray, limits: Limits
) -> dict[str, FloatArray]:
    """Return the inputs: the motion for the reference, motors switched on, of everything else a typical value."""
    found: dict[str, FloatArray] = {}
    for item in drive.inputs:
        if item.part == "reference":
            found[item.name] = speed if item.signal == "omega" else _within(time, speed, limits.travel)
        else:
            usual = np.nanmax if item.signal == "enable" else np.nanmedian
            found[item.name] = np.full(time.size, float(usual(recording.channels[item.name].values)))
    return found


def _within(time: FloatArray, speed: FloatArray, travel: float) -> FloatArray:
    """Return the angle of a motion, from rest at zero, within the travel."""
    steps: FloatArray = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    angle: FloatArray = np.concatenate([np.zeros(1), steps.cumsum()])
    level: FloatArray = angle - np.linspace(0.0, float(angle[-1]), angle.size)
    return level * min(1.0, travel / max(float(np.ptp(level)), 1e-300))


def _watched(drive: Drive) -> Drive:
    """Return the drive with sensors of its own for what the limits are about."""
    first, motor = drive.shafts[0].name, first_motor(drive)
    seen = {"theta": f"{first}.theta", "omega": f"{first}.omega", "torque": f"{motor.name}.torque"}
    known = {item.name for item in drive.channels}
    added = [Channel(LED + key, at, noise_std=1.0) for key, at in seen.items() if LED + key not in known]
    return replace(drive, channels=(*drive.channels, *added))


def is_driven(drive: Drive) -> bool:
    """Whether a command of the first motor makes the motion, so that another can be designed."""
    try:
        refuse_what_is_not_driven(drive)
    except FrictionOcpError:
        return False
    return True


def refuse_what_is_not_driven(drive: Drive) -> None:
    """Raise FrictionOcpError for a drive whose motion no command of its first motor makes."""
    motor = first_motor(drive)
    if drive.controller is None:
        _command(drive, motor)


def first_motor(drive: Drive) -> Motor:
    """Return the motor on the first shaft; raises FrictionOcpError where there is none."""
    first = drive.shafts[0].name
    for item in drive.motors:
        if item.shaft == first:
            return item
    raise FrictionOcpError(Finding(f"design: {first}", "no motor drives the first shaft", "a motor on it"))


def _command(drive: Drive, motor: Motor) -> Channel:
    """Return the channel that commands a motor; raises FrictionOcpError where the motion itself is an input."""
    for item in drive.inputs:
        if item.part == motor.name and item.signal in _PER_TORQUE:
            return item
    what = "its current, torque or voltage is no input: where the motion itself is an input, none can be designed"
    allowed = f"a channel that measures {motor.name}.current, role: input, or a controller"
    raise FrictionOcpError(Finding(f"design: {motor.name}", what, allowed))


def _looped(fitted: FittedModel, drive: Drive, limits: Limits) -> Drive:
    """Return a drive under a loop of speed that stands for whatever moves the machine: its command is recorded."""
    first, motor = drive.shafts[0].name, first_motor(drive)
    command = _command(drive, motor)
    constant = float(motor.torque_constant)
    per_torque = {"torque": 1.0, "current": 1.0 / constant, "voltage": float(motor.resistance or 1.0) / constant}
    kind = command.signal.removesuffix("_command")
    model = fitted.model
    step = float(np.median(np.diff(model.train[0].grid.time)))
    slowest = slowest_period(model.drive, model.space, model.problem)
    slowest = slowest if np.isfinite(slowest) else 0.0
    rate = 2.0 * np.pi / max(SLOWER_THAN_MODES * slowest, SLOWER_THAN_SAMPLES * step)
    gain = _inertia(fitted) * rate * per_torque[kind]
    most = limits.torque * abs(per_torque[kind])
    loop = Controller("pi_velocity", f"{LED}omega", kind, kp=gain, ki=0.25 * gain * rate, saturation=(-most, most))  # pyright: ignore[reportArgumentType]
    recorded = replace(command, role="output", noise_std=1.0)
    channels = tuple(recorded if item is command else item for item in drive.channels)
    reference = Channel(f"{LED}reference", "reference.omega", role="input")
    feedback = Channel(f"{LED}omega", f"{first}.omega", noise_std=1.0)
    return replace(drive, controller=loop, channels=(reference, feedback, *channels))


_PER_TORQUE = ("torque", "current", "current_command", "voltage")


def _inertia(fitted: FittedModel) -> float:
    """Return the inertia of the whole drive at its first shaft, kg m^2."""
    model, name = fitted.model, fitted.model.problem.train[0].name
    numbers = model.space.numbers_by_path(fitted.theta, name)
    speeds = relative_speeds(model.problem.drive, numbers)
    return sum(float(numbers.get(f"{name}.inertia", 0.0)) * speed**2 for name, speed in speeds.items())
