"""When the sensors sample, and what controllers see when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .layout import (
    ALPHA,
    CASCADE,
    DUTY,
    MOTOR_COMMAND,
    MOTOR_CURRENT,
    MOTOR_TORQUE,
    MOTOR_VOLTAGE,
    OMEGA,
    PD,
    PI_VELOCITY,
    THETA,
    P,
)
from .parts import PlantController, PlantMotor, PlantSensor, PlantShaft
from .trajectories import Trajectory

SHAFT_SIGNALS = {"theta": THETA, "omega": OMEGA, "alpha": ALPHA}
MOTOR_SIGNALS = {"current": MOTOR_CURRENT, "torque": MOTOR_TORQUE, "voltage": MOTOR_VOLTAGE, "command": MOTOR_COMMAND}
TYPES = {"p": P, "pd": PD, "pi_velocity": PI_VELOCITY, "cascade": CASCADE, "duty": DUTY}
SLACK = 1e-6
"""Share of a step by which a time may miss a grid point through rounding."""


@dataclass(frozen=True)
class Samples:
    """The samples of one sensor: kernel place, noise, true and recorded times, and which are lost."""

    sensor: PlantSensor
    place: tuple[int, int] | None
    taken: np.ndarray
    stamps: np.ndarray
    noise: np.ndarray
    lost: np.ndarray


def _place(
    sensor: PlantSensor, shafts: Sequence[PlantShaft], motors: Sequence[PlantMotor], inputs: Mapping[str, Trajectory]
) -> tuple[int, int] | None:
    owner, _, signal = sensor.measures.rpartition(".")
    for parts, signals in ((shafts, SHAFT_SIGNALS), (motors, MOTOR_SIGNALS)):
        names = [part.name for part in parts]
        if signal in signals and owner in names:
            return signals[signal], names.index(owner)
    if sensor.measures not in inputs:
        raise ValueError(f"{sensor.name}: nothing to measure at '{sensor.measures}'; inputs are {', '.join(inputs)}")
    return None


def draw_samples(
    sensor: PlantSensor,
    duration: float,
    rng: np.random.Generator | None,
    shafts: Sequence[PlantShaft],
    motors: Sequence[PlantMotor],
    inputs: Mapping[str, Trajectory],
) -> Samples:
    """Draw the sampling instants and the noise of a sensor."""
    nominal = np.arange(int(np.floor(duration / sensor.period + 1e-9)) + 1) * sensor.period
    random = (sensor.noise_std, sensor.jitter, sensor.stamp_error, sensor.dropout)
    if rng is None and any(random):
        raise ValueError(f"{sensor.name}: a noisy sensor needs rng")

    def scatter(std: float, limit: float) -> np.ndarray:
        return (
            np.clip(std * rng.standard_normal(nominal.size), -limit, limit) if rng and std else np.zeros(nominal.size)
        )

    taken = np.clip(nominal + scatter(sensor.jitter, 0.4 * sensor.period), 0.0, duration)
    room = 0.05 if sensor.jitter > 0 else 0.4
    stamps = taken + scatter(sensor.stamp_error, room * sensor.period)
    noise = scatter(sensor.noise_std, np.inf)
    lost = rng.uniform(size=nominal.size) < sensor.dropout if rng and sensor.dropout else np.zeros(nominal.size, bool)
    return Samples(sensor, _place(sensor, shafts, motors, inputs), taken, stamps, noise, lost)


def record_input(samples: Samples, inputs: Mapping[str, Trajectory]) -> np.ndarray:
    """Return the record of an input signal, through the same formula as any sensor."""
    sensor = samples.sensor
    value = sensor.gain * inputs[sensor.measures].at(samples.taken - sensor.delay) + sensor.offset + samples.noise
    return np.floor(value / sensor.resolution + 0.5) * sensor.resolution if sensor.resolution > 0 else value


@dataclass(frozen=True)
class SensorArrays:
    """Fields of `layout.Model` about sensors, and all samples."""

    sensor: np.ndarray
    scaling: np.ndarray
    sample: np.ndarray
    sample_step: np.ndarray
    sample_fraction: np.ndarray
    sample_ready: np.ndarray
    recorded: np.ndarray
    """Holds the noise until the run adds the signals."""
    sensors: int


def lay_out_sensors(drawn: Sequence[Samples], step: float) -> SensorArrays:
    """Find for every sample the step it falls into, and the step at which a controller may see it."""
    steps, fractions, ready = [], [], []
    for samples in drawn:
        assert samples.place is not None
        position = np.maximum(samples.taken - samples.sensor.delay, 0.0) / step
        continuous = samples.place[0] in (THETA, OMEGA)
        index = np.ceil(position - SLACK) - 1 if continuous else np.floor(position + SLACK)
        steps.append(index.astype(np.int64))
        fractions.append(np.clip(position - index, 0.0, 1.0))
        ready.append(np.ceil(samples.taken / step - SLACK).astype(np.int64))
    scaling = [(s.sensor.gain, s.sensor.offset, s.sensor.resolution) for s in drawn]
    return SensorArrays(
        sensor=np.array([s.place for s in drawn], dtype=np.int64).reshape(-1, 2),
        scaling=np.array(scaling, dtype=float).reshape(-1, 3),
        sample=np.concatenate(([0], np.cumsum([s.taken.size for s in drawn]))).astype(np.int64),
        sample_step=np.concatenate([np.zeros(0, np.int64), *steps]),
        sample_fraction=np.concatenate([np.zeros(0), *fractions]),
        sample_ready=np.concatenate([np.zeros(0, np.int64), *ready]),
        sensors=len(drawn),
        recorded=np.concatenate([np.zeros(0), *(s.noise for s in drawn)]),
    )


@dataclass(frozen=True)
class ControllerArrays:
    """Fields of `layout.Model` about controllers."""

    controller: np.ndarray
    gain: np.ndarray
    tick: np.ndarray
    reference: np.ndarray


def _feedback(controller: PlantController, name: str, drawn: Sequence[Samples]) -> int:
    for index, samples in enumerate(samples for samples in drawn if samples.place is not None):
        if samples.sensor.name == name and samples.place is not None and samples.place[0] in (THETA, OMEGA):
            return index
    raise ValueError(f"{controller.name}: feedback '{name}' must be a sensor of theta or omega")


def _measures_speed(drawn: Sequence[Samples], index: int) -> bool:
    return [samples.place[0] for samples in drawn if samples.place is not None][index] == OMEGA


def lay_out_controllers(
    controllers: Sequence[PlantController],
    drawn: Sequence[Samples],
    inputs: Mapping[str, Trajectory],
    duration: float,
    step: float,
) -> ControllerArrays:
    """Number the feedback sensors and sample the references at the ticks."""
    rows, gains, references = [], [], [np.zeros((0, 2))]
    for c in controllers:
        feedback = _feedback(c, c.feedback, drawn)
        rate = feedback if c.rate_feedback is None else _feedback(c, c.rate_feedback, drawn)
        if not _measures_speed(drawn, rate):
            rate = -1
        late = int(np.ceil(c.delay / step - SLACK))
        rows.append((TYPES[c.type], feedback, rate, late, int(c.derivative == "two_tap_mean"), int(c.anti_windup)))
        gains.append((c.kp, c.ki, c.kd, *c.saturation, c.supply, c.sample_time))
        ticks = np.arange(int(np.floor(duration / c.sample_time + 1e-9)) + 1) * c.sample_time
        wanted = [inputs.get(f"{c.reference}.{name}") for name in ("theta", "omega")]
        references.append(np.column_stack([np.zeros_like(ticks) if w is None else w.at(ticks) for w in wanted]))
    return ControllerArrays(
        controller=np.array(rows, dtype=np.int64).reshape(-1, 6),
        gain=np.array(gains, dtype=float).reshape(-1, 7),
        tick=np.concatenate(([0], np.cumsum([len(r) for r in references[1:]]))).astype(np.int64),
        reference=np.ascontiguousarray(np.concatenate(references)),
    )


def collect(
    drawn: Sequence[Samples], arrays: SensorArrays, inputs: Mapping[str, Trajectory]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the recordings {channel: (time, values)}, NaN where a sample is lost."""
    channels = {}
    place = 0
    for samples in drawn:
        if samples.place is None:
            values = record_input(samples, inputs)
        else:
            values = arrays.recorded[arrays.sample[place] : arrays.sample[place + 1]].copy()
            place += 1
        values[samples.lost] = np.nan
        channels[samples.sensor.name] = (samples.stamps, values)
    return channels
