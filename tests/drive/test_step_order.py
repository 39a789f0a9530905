"""Order of the time step by halving it: 2 on smooth motion, at least 1 across events."""

from __future__ import annotations

import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantShaft, PlantTransmission, Trajectory
from twin import Bench, drive_of

STEPS = np.array([4e-3, 2e-3, 1e-3])
REFERENCE = 1.25e-4
"""Step of the reference: 64 times smaller errors than the finest step under test."""
SMOOTH_ORDER = 1.8
"""Order 2 less what the third order contributes at 4 ms."""
EVENT_ORDER = 1.0

STRIBECK = PlantFriction("stribeck", tau_c=0.1, tau_s=0.15, omega_s=4.0, viscous=0.01)
LUGRE = PlantFriction("lugre", tau_c=0.1, tau_s=0.15, omega_s=2.0, viscous=0.01, sigma0=20.0, sigma1=0.05)
QUADRATIC = PlantFriction("quadratic", tau_c=0.1, viscous=0.01, quadratic=0.002)
TORQUE = (PlantMotor("drive", "motor", "torque"),)


def two_masses(friction: PlantFriction) -> Plant:
    """Motor and load with ratio 5 and a spring that lets them vibrate at 49 rad/s."""
    load = PlantShaft("load", 0.5, PlantFriction("viscous", viscous=0.1), gravity=(1.0, 0.2))
    joint = PlantTransmission("motor", "load", 5.0, 400.0, 0.5)
    return Plant((PlantShaft("motor", 0.01, friction), load), (joint,), TORQUE)


SMOOTH: dict[str, tuple[Plant, str, dict[str, float]]] = {
    "stribeck": (Plant((PlantShaft("motor", 0.01, STRIBECK),), (), TORQUE), "torque", {"motor.omega": 5.0}),
    "two masses": (two_masses(QUADRATIC), "torque", {"motor.omega": 20.0, "load.omega": 3.0}),
    "lugre": (Plant((PlantShaft("motor", 0.01, LUGRE),), (), TORQUE), "torque", {"motor.friction.z": 1e-3}),
    "two masses, lugre": (two_masses(LUGRE), "torque", {"motor.friction.z": 1e-3}),
    "loaded rigid joint": (
        Plant(
            (
                PlantShaft("motor", 0.01, PlantFriction("stribeck", 0.1, 0.15, 4.0, 2.0, 0.01, load_coulomb=0.1)),
                PlantShaft("load", 0.5, QUADRATIC, gravity=(1.0, 0.2)),
            ),
            (PlantTransmission("motor", "load", -5.0),),
            TORQUE,
        ),
        "torque",
        {"motor.omega": 5.0},
    ),
    "winding": (
        Plant(
            (PlantShaft("motor", 1e-3, QUADRATIC),),
            (),
            (PlantMotor("drive", "motor", "voltage", 0.1, 2.0, 0.02),),
        ),
        "voltage",
        {"motor.omega": 30.0},
    ),
}


def errors(bench: Bench, signal: str, level: Trajectory | float, initial: dict[str, float]) -> np.ndarray:
    """Return (steps, states) errors over 0.4 s: root mean square, relative to that of the state."""

    def states(step: float) -> np.ndarray:
        run = bench.run(0.4, {f"drive.{signal}": level}, initial, step, every=4e-3)
        return np.array([run[name] for name in bench.stepped.state_names])

    exact = states(REFERENCE)
    squares = np.array([np.mean((states(step) - exact) ** 2, axis=1) for step in STEPS])
    return np.sqrt(squares / np.mean(exact**2, axis=1))


@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_motion_is_of_second_order(name: str) -> None:
    """Halving the step quarters the error of every state while no shaft stops."""
    plant, signal, initial = SMOOTH[name]
    bench = Bench(drive_of(plant, {f"drive.{signal}": 0.0}))
    level = 6.0 if signal == "voltage" else Trajectory(np.array([0.0, 0.4]), np.array([0.3, 0.8]), "linear")
    found = errors(bench, signal, level, initial)
    assert np.log2(found[:-1] / found[1:]).min() > SMOOTH_ORDER


@pytest.mark.parametrize(
    "friction", [PlantFriction("coulomb", tau_c=(0.2, 0.25)), STRIBECK], ids=["coulomb", "stribeck"]
)
@pytest.mark.parametrize("masses", [1, 2])
def test_order_holds_across_stops(masses: int, friction: PlantFriction) -> None:
    """With stops, sticking and reversals inside the steps the error still falls at least with the step."""
    plant = two_masses(friction) if masses == 2 else Plant((PlantShaft("motor", 0.01, friction),), (), TORQUE)
    bench = Bench(drive_of(plant, {"drive.torque": 0.0}))
    time = np.linspace(0.0, 0.4, 401)
    swing = Trajectory(time, 0.6 * np.sin(2 * np.pi * 7.3 * time), "linear")
    run = bench.run(0.4, {"drive.torque": swing})
    assert np.any(run["motor.omega"] > 0) and np.any(run["motor.omega"] < 0) and np.sum(run["motor.omega"] == 0) > 2
    worst = errors(bench, "torque", swing, {}).max(axis=1)
    assert np.log2(worst[0] / worst[-1]) / np.log2(STEPS[0] / STEPS[-1]) > EVENT_ORDER


def test_a_step_across_a_stop_is_exact() -> None:
    """A shaft that stops within a step covers omega^2 / (2 a) in it and then stands still for good."""
    bench = Bench(
        drive_of(
            Plant((PlantShaft("motor", 0.01, PlantFriction("coulomb", tau_c=0.2)),), (), TORQUE), {"drive.torque": 0.0}
        )
    )
    run = bench.run(0.2, {"drive.torque": 0.05}, {"motor.omega": 1.003}, step=0.01)
    deceleration, rounding = 15.0, 1e-14
    assert run["motor.omega"] == pytest.approx(np.maximum(1.003 - deceleration * run.time, 0.0), abs=rounding)
    assert run["motor.theta"][-1] == pytest.approx(1.003**2 / (2 * deceleration), abs=rounding)
    assert np.all(run["motor.omega"][run.time > 0.07] == 0.0)
