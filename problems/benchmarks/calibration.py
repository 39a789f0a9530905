"""Are the standard errors honest? Every friction law on one and two masses, data from the independent plant.

python problems/benchmarks/calibration.py [--draws 20] [--coverage 500] [--seed 11]

For each case: chi-square of the estimation errors with their full covariance over all draws against its 99 % band,
and the largest single z-score. Then the pooled coverage of 95 % intervals over many draws of a linear and a friction
case against its 99 % band. Nothing here is fitted by the program that made the data.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.stats

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from plant import (
    Plant,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    steps_and_multisine,
)

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft, Transmission
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.registry import friction_laws
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

SECONDS, RATE = 4.0, 1000.0
TORQUE_CONSTANT, MOTOR_INERTIA, LOAD_INERTIA, RATIO = 0.35, 0.002, 4.0, 50.0
STIFFNESS, DAMPING, LOAD_VISCOUS = 2.0e4, 20.0, 5.0
ENCODER_NOISE = {"motor": 1.0e-2, "load": 2.0e-4}
FINER = {"dahl": 0.1, "lugre": 0.05}
"""Noise over ENCODER_NOISE where a bristle's deflection, 5e-3 rad, has to be seen."""

TRUTH: dict[str, dict[str, Any]] = {
    "none": {},
    "coulomb": {"tau_c": 0.1},
    "viscous": {"viscous": 1.5e-3},
    "coulomb_viscous": {"tau_c": 0.1, "viscous": 1.5e-3},
    "stribeck": {"tau_c": 0.08, "tau_s": 0.13, "omega_s": 4.0, "viscous": 1.5e-3},
    "polyline": {"tau_c": 0.1, "slopes": (2.5e-3, 5.0e-4), "breaks": (15.0,)},
    "quadratic": {"tau_c": 0.1, "viscous": 1.0e-3, "quadratic": 1.0e-5},
    "dahl": {"tau_c": 0.1, "sigma0": 20.0},
    "lugre": {"tau_c": 0.08, "tau_s": 0.12, "omega_s": 4.0, "sigma0": 20.0, "sigma1": 0.05, "sigma2": 1.5e-3},
}
"""Friction of the motor shaft by law, SI."""


@dataclass(frozen=True)
class Case:
    """One law on one or two masses."""

    law: str
    masses: int

    def noise(self, shaft: str) -> float:
        """Return the standard deviation of the encoder on a shaft, rad."""
        return ENCODER_NOISE[shaft] * FINER.get(self.law, 1.0)

    @property
    def name(self) -> str:
        """How the table calls it."""
        return f"{self.law}, {self.masses} mass{'es' * (self.masses > 1)}"


def make_plant(case: Case) -> Plant:
    """Return the machine: exact friction, 1 kHz sensors with white noise."""
    values = dict(TRUTH[case.law])
    if "sigma2" in values:
        values["viscous"] = values.pop("sigma2")
    motor = PlantShaft("motor", MOTOR_INERTIA, PlantFriction(case.law, **values))
    sensors = [PlantSensor("motor_position", "motor.theta", period=1 / RATE, noise_std=case.noise("motor"))]
    shafts, transmissions = [motor], []
    if case.masses == 2:
        shafts.append(PlantShaft("load", LOAD_INERTIA, PlantFriction("viscous", viscous=LOAD_VISCOUS)))
        transmissions.append(PlantTransmission("motor", "load", ratio=RATIO, stiffness=STIFFNESS, damping=DAMPING))
        sensors.append(PlantSensor("load_position", "load.theta", period=1 / RATE, noise_std=case.noise("load")))
    return Plant(
        shafts=tuple(shafts),
        transmissions=tuple(transmissions),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=tuple(sensors),
    )


def record(case: Case, seed: int) -> tuple[Recording, str]:
    """Return one run: reversing current steps with a multisine, known exactly."""
    rng = np.random.default_rng(seed)
    current = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.1, 0.25), 0.3, (0.5, 40.0), SECONDS, rng)
    run = make_plant(case).simulate(SECONDS, {"drive.current": current}, rng)
    channels = {name: Channel(name, stamps, values, "rad") for name, (stamps, values) in run.channels.items()}
    channels["current"] = Channel("current", np.asarray(current.time), np.asarray(current.value), "A")
    return Recording(f"draw{seed}", channels), current.hold


def make_problem(
    case: Case, recording: Recording, hold: str, rng: np.random.Generator
) -> tuple[Problem, dict[str, float]]:
    """Return the problem with starts up to a factor 1.5 off, and the true values."""
    truth: dict[str, float] = {"motor.inertia": MOTOR_INERTIA}

    def free(path: str, value: float) -> Free:
        truth[path] = value
        return Free(value * 1.5 ** rng.uniform(-1, 1), value / 20.0, value * 20.0)

    law = friction_laws()[case.law]
    fields: dict[str, Any] = {}
    for key, value in TRUTH[case.law].items():
        path = f"motor.friction.{key}"
        if isinstance(value, tuple):
            fields[key] = tuple(free(f"{path}.{k}", item) for k, item in enumerate(value))
        else:
            fields[key] = free(path, value)
    shafts = [Shaft("motor", free("motor.inertia", MOTOR_INERTIA), FrictionElement(law(**fields)))]
    transmissions: list[Transmission] = []
    channels = [
        Sensor("current", "drive.current", role="input", hold=hold),  # pyright: ignore[reportArgumentType]
        Sensor("motor_position", "motor.theta", noise_std=case.noise("motor")),
    ]
    if case.masses == 2:
        viscous = friction_laws()["viscous"](viscous=free("load.friction.viscous", LOAD_VISCOUS))  # pyright: ignore[reportCallIssue]
        shafts.append(Shaft("load", free("load.inertia", LOAD_INERTIA), FrictionElement(viscous)))
        stiffness = free("motor-load.stiffness", STIFFNESS)
        damping = free("motor-load.damping", DAMPING)
        transmissions.append(Transmission("motor", "load", ratio=RATIO, stiffness=stiffness, damping=damping))
        channels.append(Sensor("load_position", "load.theta", noise_std=case.noise("load")))
    drive = Drive(
        tuple(shafts), tuple(transmissions), (Motor("drive", "motor", TORQUE_CONSTANT),), channels=tuple(channels)
    )
    options = EstimationOptions(fit="simulation")
    return Problem(case.name, drive, (RecordingUse(recording),), estimation=options), truth


@dataclass(frozen=True)
class Draw:
    """The outcome of one draw."""

    z: np.ndarray
    chi_square: float
    freedom: int
    covered: int
    converged: bool
    kind: str


def one_draw(job: tuple[Case, int]) -> Draw:
    """Identify one draw and compare with the truth."""
    case, seed = job
    recording, hold = record(case, seed)
    problem, truth = make_problem(case, recording, hold, np.random.default_rng([seed, 7]))
    estimate = identify(problem)
    error = np.array([item.value - truth[item.name] for item in estimate.parameters])
    free = estimate.uncertainty.std_error > 0
    covariance = estimate.uncertainty.covariance[np.ix_(free, free)]
    z = error[free] / np.sqrt(np.diag(covariance))
    inside = [item.interval95[0] <= truth[item.name] <= item.interval95[1] for item in estimate.parameters]
    return Draw(
        z,
        float(error[free] @ np.linalg.solve(covariance, error[free])),
        int(free.sum()),
        int(np.sum(inside)),
        estimate.converged,
        estimate.uncertainty.kind,
    )


def run(case: Case, draws: int, seed: int, pool: ProcessPoolExecutor) -> list[Draw]:
    """Return all draws of a case."""
    return list(pool.map(one_draw, [(case, 1000 * seed + k) for k in range(draws)]))


def chi_square_row(case: Case, draws: list[Draw]) -> tuple[str, bool]:
    """Return a table row and whether it passes."""
    total, freedom = sum(d.chi_square for d in draws), sum(d.freedom for d in draws)
    low, high = scipy.stats.chi2.ppf([0.005, 0.995], freedom)
    worst = max(float(np.max(np.abs(d.z))) for d in draws)
    robust = sum(d.kind == "sandwich" for d in draws)
    passed = low <= total <= high and worst <= 4.5 and all(d.converged for d in draws)
    row = f"{case.name:<28} {total:8.1f} [{low:6.1f}, {high:6.1f}] {worst:6.2f} {robust:4d} {'ok' if passed else 'NO'}"
    return row, passed


def main() -> int:
    """Print both tables; exit 1 where a line fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--coverage", type=int, default=500)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    began, passed = time.perf_counter(), True
    os.environ.setdefault("FRICTION_OCP_THREADS", "1")  # two processes share two processors
    with ProcessPoolExecutor(2) as pool:
        if options.draws:
            print(f"{'case':<28} {'chi2':>8} {'99 % band':>16} {'max|z|':>6} {'robust':>4}")
        for case in [Case(law, masses) for masses in (1, 2) for law in TRUTH] if options.draws else []:
            if options.only and options.only != case.law:
                continue
            row, good = chi_square_row(case, run(case, options.draws, options.seed, pool))
            passed &= good
            print(row, flush=True)
        for case in [Case("viscous", 1), Case("coulomb_viscous", 1)] if options.coverage else []:
            draws = run(case, options.coverage, options.seed + 1, pool)
            hits, count = sum(d.covered for d in draws), sum(d.freedom for d in draws)
            low, high = scipy.stats.binom.ppf([0.005, 0.995], count, 0.95) / count
            good = low <= hits / count <= high
            passed &= bool(good)
            print(f"coverage {case.name}: {hits / count:.4f} in [{low:.4f}, {high:.4f}] {'ok' if good else 'NO'}")
    print(f"{time.perf_counter() - began:.0f} s")
    return 0 if passed else 1


if __name__ == "__main__":
    raise SystemExit(main())
