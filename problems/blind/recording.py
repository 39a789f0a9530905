"""Simulated recordings of a machine, with and without what is hidden in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from plant import Plant, PlantRipple, PlantSensor, Trajectory

from blind.machines import LOOP_ENCODER, SUPPLY, Machine
from blind.motions import reference
from friction_ocp.recording.recording import Channel, Recording

Inputs = Mapping[str, Trajectory]
Extra = Callable[[np.random.Generator, float], Inputs]
"""Inputs that nobody records, from a generator and the duration."""
UNITS = {"theta": "rad", "omega": "rad/s", "alpha": "rad/s^2", "current": "A", "supply_voltage": "V"}


def nothing(rng: np.random.Generator, duration: float) -> Inputs:
    """Return no inputs."""
    return {}


@dataclass(frozen=True)
class Hidden:
    """The machine as it really is: the plant, and what acts on it from outside."""

    plant: Plant
    extra: Extra = nothing


def silent(plant: Plant) -> Plant:
    """Return a plant whose sensors have neither noise nor steps, save the one that its loop sees."""
    sensors = [s if s.name == LOOP_ENCODER else replace(s, noise_std=0.0, resolution=0.0) for s in plant.sensors]
    return replace(plant, sensors=tuple(sensors))


def begun_anywhere(plant: Plant, rng: np.random.Generator) -> Plant:
    """Return a plant whose periodic torques from outside have gone on for a part of their period already."""
    shafts = [
        shaft if shaft.disturbance is None else replace(shaft, disturbance=gone_on(shaft.disturbance, rng.uniform()))
        for shaft in plant.shafts
    ]
    return replace(plant, shafts=tuple(shafts))


def gone_on(ripple: PlantRipple, share: float) -> PlantRipple:
    """Return a wave that begins where another one is after a share of its period."""
    turned = [
        complex(cosine, sine) * np.exp(-2j * np.pi * order * share)
        for order, (cosine, sine, _) in enumerate(ripple.rows(), start=1)
    ]
    cosine, sine = (tuple(float(getattr(one, part)) for one in turned) for part in ("real", "imag"))
    return PlantRipple(ripple.period, cosine, sine)


def run(
    machine: Machine,
    hidden: Hidden,
    kind: str,
    seed: tuple[int, ...],
    truth_rate: float = 0.0,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the recorded channels, all on the grid of the samples, and the truth.

    Reference, what acts from outside and noise have generators of their own: none depends on the others. What acts from
    outside periodically is somewhere in its period when a recording begins.
    """
    streams = [np.random.default_rng([*seed, k]) for k in range(4)]
    wanted = reference(machine, kind, streams[0])
    inputs = dict(wanted) | dict(hidden.extra(streams[1], machine.duration))
    plant = begun_anywhere(hidden.plant, streams[3])
    done = plant.simulate(machine.duration, inputs, streams[2], step=machine.step, truth_rate=truth_rate)
    time = machine.sample_time * np.arange(machine.samples)
    channels = {"time": time}
    for name, item in machine.document["channels"].items():
        if item["measures"].startswith("reference"):
            channels[name] = next(iter(wanted.values())).at(time)
        elif "supply" in item["measures"]:
            channels[name] = np.full(time.size, SUPPLY)
        else:
            channels[name] = done.channels[name][1]
    return channels, done.truth


def as_recording(machine: Machine, name: str, channels: Mapping[str, np.ndarray]) -> Recording:
    """Return channels as a recording."""
    linear = {s["name"] for s in machine.document["drive"]["shafts"] if s.get("motion") == "linear"}
    made = {}
    for key, item in machine.document["channels"].items():
        part, _, signal = item["measures"].partition(".")
        unit = UNITS[signal].replace("rad", "m") if part in linear else UNITS[signal]
        made[key] = Channel(key, channels["time"], channels[key], unit)
    title = f"{machine.document['title']}, simulated"
    return Recording(name, made, title=title, source="problems/blind", licence="MIT")


def log_encoders(plant: Plant, measures: str, **changes: object) -> Plant:
    """Return a plant with changes to every sensor of a signal: the log and the loop share the instrument."""

    def changed(sensor: PlantSensor) -> PlantSensor:
        return replace(sensor, **changes) if sensor.measures == measures else sensor

    return replace(plant, sensors=tuple(changed(sensor) for sensor in plant.sensors))
