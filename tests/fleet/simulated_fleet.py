"""Nights of machines of one kind, simulated by the plant: friction scatters from night to night, and may drift."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import yaml
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory, steps_and_multisine

from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

SECONDS, RATE = 1.5, 400.0
TORQUE_CONSTANT, INERTIA, COULOMB, VISCOUS = 0.35, 0.002, 0.1, 1.5e-3
ENCODER_NOISE = 1.0e-2
UNLIKE, SCATTER = 0.05, 0.02
"""Relative scatter of friction from machine to machine, and from night to night."""
FIRST_NIGHT = datetime(2026, 1, 10, 20, 0, tzinfo=UTC)


@dataclass(frozen=True)
class Change:
    """Coulomb friction of one machine that grows: steadily over all nights, or in one night alone."""

    machine: int
    size: float
    """Relative, at the last night."""
    only: int | None = None
    """The one night that it is in."""

    def factor(self, machine: int, night: int, nights: int) -> float:
        """Return what the friction of a night is multiplied by."""
        if machine != self.machine:
            return 1.0
        if self.only is not None:
            return 1.0 + self.size * (night == self.only)
        return 1.0 + self.size * night / (nights - 1)


def machine_name(machine: int) -> str:
    """Return the name of a machine."""
    return f"telescope-{machine + 1:02d}"


def simulate_night(rng: np.random.Generator, coulomb: float, viscous: float, **attributes: str) -> Recording:
    """Return a recording of steps and a multisine of the current."""
    wanted = steps_and_multisine(np.array([0.6, 1.2]), (0.15, 0.4), 0.3, (1.0, 40.0), SECONDS, rng)
    time = np.arange(0.0, SECONDS, 1 / RATE)
    current = Trajectory(time, wanted.at(time), "zero")
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, PlantFriction("coulomb_viscous", tau_c=coulomb, viscous=viscous)),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=ENCODER_NOISE),),
    )
    stamps, values = plant.simulate(SECONDS, {"drive.current": current}, rng).channels["position"]
    seen = slice(0, time.size)
    channels = {
        "position": Channel("position", stamps[seen], values[seen], "rad"),
        "current": Channel("current", stamps[seen], np.asarray(current.value), "A"),
    }
    return Recording("night", channels, attributes=attributes)


def write_fleet(
    folder: Path, machines: int, nights: int, changes: tuple[Change, ...] = (), seed: int = 1
) -> list[Path]:
    """Write a folder of nights for each machine and return all files."""
    files: list[Path] = []
    for machine in range(machines):
        rng = np.random.default_rng([seed, machine])
        own = 1.0 + UNLIKE * rng.standard_normal(2)
        for night in range(nights):
            scatter = own * (1.0 + SCATTER * rng.standard_normal(2))
            for change in changes:
                scatter[0] *= change.factor(machine, night, nights)
            started = (FIRST_NIGHT + timedelta(days=night)).isoformat()
            named = {"machine": machine_name(machine), "started": started}
            recording = simulate_night(rng, COULOMB * scatter[0], VISCOUS * scatter[1], **named)
            files.append(folder / machine_name(machine) / f"night-{night + 1:02d}.h5")
            files[-1].parent.mkdir(parents=True, exist_ok=True)
            write_recording(recording, files[-1])
    return files


def write_axis(path: Path, example: Path) -> Path:
    """Write the problem that is fitted to every night, with one of them as its example."""
    friction = {
        "law": "coulomb_viscous",
        "tau_c": {"guess": 0.07, "min": 0, "max": 2},
        "viscous": {"guess": 2.2e-3, "min": 0, "max": 0.03},
    }
    document = {
        "format": "friction-ocp-problem/1",
        "title": "Axis of a telescope, each night",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": [{"name": "motor", "inertia": {"guess": 0.003, "min": 1e-4, "max": 0.04}, "friction": friction}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero"},
            "position": {"measures": "motor.theta", "noise_std": ENCODER_NOISE},
        },
        "recordings": {"train": [str(example)]},
        "estimation": {"fit": "simulation"},
    }
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path
