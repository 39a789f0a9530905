"""Torque noise of a shaft is told from the noise of its encoder, against the plant whose torque noise is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import COULOMB, INERTIA, TORQUE_CONSTANT, VISCOUS, axis, problem
from plant import (
    Plant,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    steps_and_multisine,
)
from scipy import stats

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft, Transmission
from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.estimation.problem import Problem
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous, Viscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.result_document import estimate_document

RATE, SECONDS = 500.0, 8.0
DENSITY = {"motor": 1.0e-3, "load": 0.05}
ENCODER = {"motor": 1.0e-3, "load": 1.0e-4}
RATIO, LOAD_INERTIA, STIFFNESS, DAMPING, LOAD_VISCOUS = 50.0, 4.0, 2.0e4, 20.0, 5.0
HELD = Sensor("current", "drive.current", role="input", hold="zero")


def recorded(plant: Plant, noise: dict[str, float], seed: int) -> Recording:
    """Run the plant with torque noise under a current that is known exactly."""
    rng = np.random.default_rng(seed)
    current = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 40.0), SECONDS, rng)
    run = plant.simulate(SECONDS, {"drive.current": current}, rng, process_noise=noise)
    channels = {name: Channel(name, stamps, values, "rad") for name, (stamps, values) in run.channels.items()}
    channels["current"] = Channel("current", np.asarray(current.time), np.asarray(current.value), "A")
    return Recording(f"run{seed}", channels)


def motor_shaft() -> PlantShaft:
    """One shaft with Coulomb and viscous friction."""
    return PlantShaft("motor", INERTIA, PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS))


def one_mass(seed: int, level: float, **options: object) -> Problem:
    """Return the problem of one noisy shaft."""
    plant = Plant(
        shafts=(motor_shaft(),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=ENCODER["motor"]),),
    )
    law = CoulombViscous(Free(0.07, 0.0, 2.0), Free(2.2e-3, 0.0, 0.03))
    drive = axis(law, inertia=Free(0.003, 1e-4, 0.04))
    position = Sensor("position", "motor.theta", noise_std=ENCODER["motor"])
    drive = Drive(drive.shafts, (), drive.motors, None, (HELD, position))
    return problem(drive, recorded(plant, {"motor": level}, seed), fit="relaxed", **options)


def two_masses(seed: int) -> Problem:
    """Return the problem of a motor and a load with noise on both."""
    plant = Plant(
        shafts=(motor_shaft(), PlantShaft("load", LOAD_INERTIA, PlantFriction("viscous", viscous=LOAD_VISCOUS))),
        transmissions=(PlantTransmission("motor", "load", ratio=RATIO, stiffness=STIFFNESS, damping=DAMPING),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=tuple(
            PlantSensor(name, f"{name}.theta", period=1 / RATE, noise_std=ENCODER[name]) for name in ("motor", "load")
        ),
    )
    law = CoulombViscous(Free(0.07, 0.0, 2.0), Free(2.2e-3, 0.0, 0.03))
    shafts = (
        Shaft("motor", Free(0.003, 1e-4, 0.04), FrictionElement(law)),
        Shaft("load", Free(3.0, 0.1, 100.0), FrictionElement(Viscous(Free(4.0, 0.0, 100.0)))),
    )
    joint = Transmission("motor", "load", ratio=RATIO, stiffness=Free(1.5e4, 1e3, 1e6), damping=DAMPING)
    sensors = tuple(Sensor(name, f"{name}.theta", noise_std=ENCODER[name]) for name in ("motor", "load"))
    drive = Drive(shafts, (joint,), (Motor("drive", "motor", TORQUE_CONSTANT),), None, (HELD, *sensors))
    run = recorded(plant, DENSITY, seed)
    return problem(drive, run, fit="relaxed", estimated_noise=("motor", "load"))


def covers(estimate: Estimate, shaft: str, truth: float) -> bool:
    """Whether the interval of a level covers the truth."""
    level = {item.shaft: item for item in estimate.noise_levels}[shaft]
    return level.verdict == "ok" and level.interval95[0] <= truth <= level.interval95[1]


@pytest.mark.parametrize("seed", [1, 2])
def test_torque_noise_of_a_shaft_is_found(seed: int) -> None:
    """The level comes out within its interval, which is narrow, and the friction with it."""
    estimate = identify(one_mass(seed, DENSITY["motor"], estimated_noise=("motor",)))
    assert estimate.converged
    assert covers(estimate, "motor", DENSITY["motor"])
    assert estimate.noise_levels[0].std_error < 0.1 * DENSITY["motor"]
    assert estimate.values["motor.friction.tau_c"] == pytest.approx(COULOMB, rel=0.05)
    told = estimate_document(estimate)["process_noise"]["motor"]
    assert told["value"] == estimate.noise_levels[0].value and told["unit"] == "N m/sqrt(Hz)"
    assert told["interval95"][0] < told["value"] < told["interval95"][1]


@pytest.mark.slow
def test_noise_of_two_shafts_is_told_apart() -> None:
    """With an encoder on each shaft both levels are found, their errors inside the joint 99.9 % region."""
    estimate = identify(two_masses(3))
    assert estimate.converged
    errors = [np.log(item.value / DENSITY[item.shaft]) * item.value / item.std_error for item in estimate.noise_levels]
    assert [item.verdict for item in estimate.noise_levels] == ["ok", "ok"]
    assert np.sum(np.square(errors)) <= stats.chi2.ppf(0.999, 2)
    assert all(item.std_error < 0.15 * item.value for item in estimate.noise_levels)


def test_level_does_not_depend_on_its_guess() -> None:
    """Guesses a hundred times apart end at the same level."""
    bare = one_mass(1, DENSITY["motor"], estimated_noise=("motor",))
    found = []
    for guess in (0.1, 10.0):
        options = replace(bare.estimation, process_noise={"motor": guess * DENSITY["motor"]})
        found.append(identify(replace(bare, estimation=options)).noise_levels[0].value)
    assert found[0] == pytest.approx(found[1], rel=0.02)


def test_no_torque_noise_is_no_level() -> None:
    """A drive without torque noise gets no interval: any small level explains it."""
    estimate = identify(one_mass(1, 0.0, estimated_noise=("motor",)))
    level = estimate.noise_levels[0]
    assert level.verdict != "ok" or level.interval95[0] < 0.05 * DENSITY["motor"]
    assert level.value < 0.1 * DENSITY["motor"]
