"""Drives with a gap, made by the plant of the tests or converted, and what `diagnose` says of them."""

from __future__ import annotations

import copy
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import yaml

from friction_ocp.diagnosis.diagnose import Diagnosis, diagnose
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.conditioning import without_low_pass
from friction_ocp.recording.hdf5 import read_static_points, write_recording, write_static_points
from friction_ocp.recording.recording import Channel, Recording

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

import aries  # noqa: E402
from plant import (  # noqa: E402
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
    steps_and_multisine,
)

Document = dict[str, Any]
STEP = 1e-3
RUNS = ("a", "b", "c")
"""Two to fit and one to check."""
ODRIVE = "FRICTION_OCP_ODRIVE"
COUNTS = 8192.0


@dataclass(frozen=True)
class Named:
    """What a diagnosis says of a case."""

    case: str
    found: Diagnosis

    @property
    def sets(self) -> list[frozenset[tuple[str, str]]]:
        """What could be meant, in the order of the answer: each accepted effect with its alias set."""
        sets = [frozenset(keys) for keys in self.found.alias_sets]
        return [next((one for one in sets if key in one), frozenset([key])) for key in self.found.accepted]

    def names(self, effect: str, component: str) -> bool:
        """Whether an effect at a component is what was found first, by itself or with one alias."""
        return bool(self.sets) and (effect, component) in self.sets[0] and len(self.sets[0]) <= 2

    @property
    def told(self) -> str:
        """One line."""
        named = [" or ".join(f"{effect} at {place}" for effect, place in sorted(one)) for one in self.sets]
        return f"{self.case}: {self.found.verdict}; {', '.join(named) or 'nothing added'}"


def diagnosed(case: str, path: Path) -> Named:
    """Diagnose a problem file in this process."""
    return Named(case, diagnose(load_problem(path)))


def guessed(value: float) -> Document:
    """Return a parameter whose guess is 4 % off."""
    return {"guess": 1.04 * value, "min": 0.01 * value, "max": 100.0 * value}


def write(folder: Path, document: Document, recordings: Mapping[str, Recording], check: Sequence[str]) -> Path:
    """Write a problem and its recordings."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, recording in recordings.items():
        write_recording(recording, folder / f"{name}.h5")
    train = [f"{name}.h5" for name in recordings if name not in check]
    full = {
        "format": "friction-ocp-problem/1",
        **copy.deepcopy(document),
        "recordings": {"train": train, "validation": [f"{name}.h5" for name in check]},
    }
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(full, sort_keys=False), encoding="utf-8")
    return path


def recorded(plant: Plant, name: str, channels: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Recording:
    """Return what the sensors of a plant saw, in SI units."""
    units = {"theta": "rad", "omega": "rad/s", "alpha": "rad/s^2", "current": "A", "torque": "N m"}
    kinds = {item.name: units[item.measures.partition(".")[2]] for item in plant.sensors}
    seen = {key: Channel(key, *channels[key], kinds[key]) for key in kinds if not key.startswith("loop")}
    return Recording(name, seen)


def driven(plant: Plant, seconds: float, levels: np.ndarray, amplitude: float, seed: int) -> Mapping[str, Any]:
    """Run a plant on reversing steps of current with a multisine."""
    rng = np.random.default_rng(seed)
    steps = steps_and_multisine(levels, (0.2, 0.6), amplitude, (0.5, 20.0), seconds, rng)
    time = np.arange(0.0, seconds, STEP)
    current = Trajectory(time, np.interp(time, np.asarray(steps.time), np.asarray(steps.value)), "zero")
    return plant.simulate(seconds, {"motor.current": current}, rng).channels


def lto(kind: str, folder: Path) -> Path:
    """Write the Leighton telescope of `data/lto` with straight lines of friction on both sides as its model."""
    content = yaml.safe_load((ROOT / "problems" / "lto" / "joint.yaml").read_text(encoding="utf-8"))
    viscous = {"guess": 0.002, "min": -0.02, "max": 0.1}
    law = {"law": "coulomb_viscous", "tau_c": {"guess": 0.05, "min": 0, "max": 1}, "viscous": viscous}
    content["drive"]["shafts"][0]["friction"] = law
    data = ROOT / "data" / "lto" / kind
    used = content["recordings"].items()
    content["recordings"] = {split: [str(data / Path(file).name) for file in files] for split, files in used}
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def lto_with_rise(size: float, speed: float, folder: Path) -> Path:
    """Write the same with the break in the fast part, and there Stribeck friction of a size, N m, and speed, rad/s."""
    path = lto("high", folder)
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    constant = float(content["drive"]["motor"]["torque_constant"])
    for files in content["recordings"].values():
        points = read_static_points(files[0])
        assert points.current is not None
        current = points.current + size * np.exp(-((points.speed / speed) ** 2)) / constant
        files[0] = str(folder / Path(files[0]).name)
        write_static_points(replace(points, current=current), files[0])
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def aries_axis(left_out: str, folder: Path) -> Path:
    """Write the ARIES axis under its loop, its model without one of Stribeck friction, presliding and asymmetry."""
    one_way = {key: value[0] for key, value in aries.NUMBERS.items()}
    numbers = dict(aries.NUMBERS) if left_out == "asymmetry" else one_way
    law = {"stribeck": "lugre", "presliding": "lugre", "asymmetry": "lugre"}[left_out]
    plain = aries.axis(STEP)
    shaft = PlantShaft("axis", aries.INERTIA, PlantFriction(law, delta=aries.DELTA, **numbers))
    plant = Plant((shaft,), (), plain.motors, plain.controllers, plain.sensors)
    runs: dict[str, Recording] = {}
    for k, name in enumerate(RUNS):
        rng = np.random.default_rng(k + 1)
        time = np.arange(0.0, 12.0, 1.5)
        sizes = np.exp(rng.uniform(np.log(1.5e-3), np.log(4e-2), time.size))
        speed = np.where(time > 0, sizes * np.where(np.arange(time.size) % 2, -1.0, 1.0), 0.0)
        done = plant.simulate(12.0, {"reference.omega": Trajectory(time, speed, "linear")}, rng, step=aries.PLANT_STEP)
        seen = {key: Channel(key, *done.channels[key], unit) for key, unit in (("position", "rad"), ("torque", "N m"))}
        runs[name] = Recording(name, seen)
    return write(folder, _aries_model(left_out, one_way), runs, RUNS[2:])


def _aries_model(left_out: str, numbers: Mapping[str, float]) -> Document:
    law: Document = {"law": "lugre", "delta": aries.DELTA, "sigma2": guessed(numbers["viscous"])}
    law |= {key: guessed(numbers[key]) for key in ("tau_c", "tau_s", "omega_s", "sigma0", "sigma1")}
    if left_out == "presliding":
        law = {key: value for key, value in law.items() if not key.startswith("sigma")}
        law |= {"law": "stribeck", "viscous": guessed(numbers["viscous"])}
    if left_out == "stribeck":
        law = {"law": "coulomb_viscous", **{key: guessed(numbers[key]) for key in ("tau_c", "viscous")}}
        law["bristle"] = {key: guessed(numbers[key]) for key in ("sigma0", "sigma1")}
    return {
        "drive": {
            "motor": {"name": "motor", "torque_constant": 1},
            "shafts": [{"name": "axis", "inertia": guessed(aries.INERTIA), "friction": law}],
        },
        "channels": {
            "torque": {"measures": "motor.torque", "role": "input", "hold": "zero", "noise_std": aries.TORQUE_NOISE},
            "position": {"measures": "axis.theta", "noise_std": aries.LOG_NOISE},
        },
    }


GEAR = 50.0


def harmonic_drive(folder: Path) -> Path:
    """Write a joint on a compliant reducer, its model rigid with a delay of the joint encoder that is free."""
    friction = (
        PlantFriction("coulomb_viscous", tau_c=0.02, viscous=5e-5),
        PlantFriction("coulomb_viscous", tau_c=0.8, viscous=0.6),
    )
    plant = Plant(
        shafts=(PlantShaft("motor", 1e-4, friction[0]), PlantShaft("joint", 0.4, friction[1])),
        transmissions=(PlantTransmission("motor", "joint", GEAR, 800.0, 1.5),),
        motors=(PlantMotor("motor", "motor", torque_constant=0.05),),
        sensors=(
            PlantSensor("motor_position", "motor.theta", STEP, resolution=2.0 * np.pi / 2**14),
            PlantSensor("joint_position", "joint.theta", STEP, resolution=2.0 * np.pi / 2**18),
            PlantSensor("current", "motor.current", STEP, noise_std=0.005),
        ),
    )
    levels = np.array([0.8, 1.5, 2.5])
    runs = {n: recorded(plant, n, driven(plant, 4.0, levels, 0.5, k + 1)) for k, n in enumerate(RUNS)}
    fast = {"law": "coulomb_viscous", "tau_c": guessed(0.02), "viscous": guessed(5e-5)}
    slow = {"law": "coulomb_viscous", "tau_c": guessed(0.8), "viscous": guessed(0.6)}
    late = {"guess": 0.0, "min": 0, "max": 0.05}
    document = {
        "drive": {
            "motor": {"name": "motor", "torque_constant": 0.05},
            "shafts": [
                {"name": "motor", "inertia": 1e-4, "friction": fast},
                {"name": "joint", "inertia": guessed(0.4), "friction": slow},
            ],
            "transmissions": [{"ratio": GEAR, "stiffness": "rigid"}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero", "noise_std": 0.005},
            "motor_position": {"measures": "motor.theta", "resolution": 2.0 * np.pi / 2**14},
            "joint_position": {"measures": "joint.theta", "resolution": 2.0 * np.pi / 2**18, "delay": late},
        },
    }
    return write(folder, document, runs, RUNS[2:])


def slow_motion(folder: Path, seed: int) -> Path:
    """Write an axis with Coulomb and viscous friction that creeps and reverses, its model the same."""
    friction = PlantFriction("coulomb_viscous", tau_c=0.1, viscous=1.5e-3)
    plant = Plant(
        shafts=(PlantShaft("motor", 0.002, friction),),
        motors=(PlantMotor("motor", "motor", "current", 0.35, controller="loop"),),
        controllers=(PlantController("loop", "pi_velocity", "loop_encoder", kp=0.5, ki=5.0, sample_time=STEP),),
        sensors=(
            PlantSensor("position", "motor.theta", STEP, resolution=2.0 * np.pi / 2**14),
            PlantSensor("current", "motor.current", STEP, noise_std=0.005),
            PlantSensor("loop_encoder", "motor.theta", STEP, resolution=2.0 * np.pi / 2**20),
        ),
    )
    runs: dict[str, Recording] = {}
    for k, name in enumerate(RUNS):
        rng = np.random.default_rng([seed, k])
        time = np.arange(0.0, 6.0, 0.5)
        speed = rng.uniform(0.2, 3.0, time.size) * rng.choice([-1.0, 1.0], time.size)
        wanted = Trajectory(time, np.where(time > 0, speed, 0.0), "linear")
        runs[name] = recorded(plant, name, plant.simulate(6.0, {"reference.omega": wanted}, rng).channels)
    law = {"law": "coulomb_viscous", "tau_c": guessed(0.1), "viscous": guessed(1.5e-3)}
    document = {
        "drive": {
            "motor": {"name": "motor", "torque_constant": 0.35},
            "shafts": [{"name": "motor", "inertia": guessed(0.002), "friction": law}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero", "noise_std": 0.005},
            "position": {"measures": "motor.theta", "resolution": 2.0 * np.pi / 2**14},
        },
    }
    return write(folder, document, runs, RUNS[2:])


REPORT_FILTER = 0.125
"""s: the ODrive moves the current that it reports by 0.001 of each new sample at 8 kHz (`I_measured_report_filter_k` in
the notes of its user)."""
COGGING_MAP = "cogging_measure_final_a_4"
"""A, over the angle: the finest of the maps that the compensation was made from."""


def odrive(kind: str, folder: Path) -> Path | None:
    """Write the slow turns of a motor with (`comp`) or without (`nocomp`) compensation; None where there are no data.

    The current is what passed the report filter. In the compensated runs it holds the compensation too, since the motor
    itself cogs as before; the compensated drive is driven by the rest. Torque constant as its maker publishes it: 0.4 A
    are 3 mN m. The published inertia, 2.5e-4 kg m^2, is a guess: the runs begin with jerks that contradict it.
    """
    source = os.environ.get(ODRIVE)
    if not source:
        return None
    law = {"law": "coulomb_viscous", "tau_c": guessed(1e-3), "viscous": guessed(1e-4)}
    document = {
        "drive": {
            "motor": {"name": "motor", "torque_constant": 3e-3 / 0.4},
            "shafts": [{"name": "motor", "inertia": guessed(2.5e-4), "friction": law}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero"},
            "position": {"measures": "motor.theta", "resolution": 2.0 * np.pi / COUNTS},
        },
    }
    runs = {f"{kind}_{k}": _odrive_run(Path(source), f"{kind}_{k}") for k in range(3)}
    return write(folder, document, runs, [f"{kind}_2"])


def _odrive_run(source: Path, name: str) -> Recording:
    time, counts, reported = scipy.io.loadmat(source / "slow2" / f"{name}.mat")["data"]
    order = np.flatnonzero(np.diff(time, prepend=-np.inf) > 0)
    time, counts = time[order], counts[order]
    current = without_low_pass(time, reported[order], REPORT_FILTER)
    if name.startswith("comp"):
        current = current - _compensation(source, counts)
    angle = 2.0 * np.pi * np.unwrap(counts, period=COUNTS) / COUNTS
    channels = {"position": Channel("position", time, angle, "rad"), "current": Channel("current", time, current, "A")}
    title = "ODrive, very slow turns; G. Chen 2020, gchenfc/ODrive"
    return Recording(name, channels, title=title, source=str(source), licence="MIT")


def _compensation(source: Path, counts: np.ndarray) -> np.ndarray:
    """Return the current that the compensation adds, A; zeros of the map were not measured."""
    measured = np.load(source / "coggingmap_0" / f"{COGGING_MAP}.npy")
    at = np.flatnonzero(measured)
    return np.interp(np.mod(counts, COUNTS), at, measured[at], period=COUNTS)
