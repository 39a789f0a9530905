"""Every friction law in motion: the stepped drive against the plant with its exact sign friction."""

from __future__ import annotations

import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantShaft, PlantTransmission, Trajectory, reversing_steps
from twin import Twin, worst

CURVATURE = 2e-4
"""What a friction curve linearised over a step of 1 ms costs a rigid shaft with a dozen stops, relative."""
PHASE = 4e-4
"""Phase error of steps of 1 ms on a joint that vibrates at 49 rad/s, and of its stops, relative."""
BRISTLE = 2e-3
"""Bristles with up to 200 rad/s of their own, and rates frozen over a step of 1 ms, relative."""
SLIP = 4e-3
"""Springs that slip within a step of 1 ms, with up to 228 rad/s of their own, relative; it falls with its square."""
LOST_SAMPLES = 4
"""Samples by which the times spent sticking may differ: one at either end of a standstill."""

LAWS = {
    "none": PlantFriction(),
    "coulomb": PlantFriction("coulomb", tau_c=(0.2, 0.25)),
    "viscous": PlantFriction("viscous", viscous=(0.03, 0.02)),
    "coulomb_viscous": PlantFriction("coulomb_viscous", tau_c=(0.2, 0.3), viscous=(0.01, 0.02)),
    "stribeck": PlantFriction("stribeck", tau_c=0.2, tau_s=(0.3, 0.35), omega_s=(2.0, 3.0), delta=0.8, viscous=0.03),
    "polyline": PlantFriction("polyline", tau_c=0.2, slopes=(0.02, (0.004, 0.003), 0.01), breaks=(5.0, (15.0, 12.0))),
    "quadratic": PlantFriction("quadratic", tau_c=0.2, viscous=0.01, quadratic=(0.001, 0.002)),
    "dahl": PlantFriction("dahl", tau_c=(0.2, 0.25), sigma0=500.0, viscous=0.01),
    "lugre": PlantFriction(
        "lugre",
        tau_c=0.2,
        tau_s=(0.3, 0.35),
        omega_s=2.0,
        delta=1.5,
        viscous=(0.01, 0.02),
        sigma0=(500.0, 400.0),
        sigma1=0.5,
    ),
    "gms": PlantFriction(
        "gms",
        tau_c=(0.2, 0.25),
        tau_s=0.3,
        omega_s=2.0,
        delta=1.5,
        viscous=(0.01, 0.02),
        elements=((400.0, 0.3), (100.0, 0.5), (20.0, 0.2)),
    ),
    "polyline_hysteresis": PlantFriction(
        "polyline_hysteresis", tau_c=(0.2, 0.25), slopes=(0.02, 0.01), breaks=(5.0,), width=(1e-3, 2e-3)
    ),
}
SPRINGS = ("dahl", "lugre", "gms", "polyline_hysteresis")
"""Laws whose friction at rest is a spring, so that nothing ever sticks."""
MOTOR = (PlantMotor("drive", "motor", torque_constant=0.5),)


def reversals() -> Trajectory:
    """Current steps of three sizes and both signs, some below breakaway."""
    return reversing_steps(np.array([0.2, 0.5, 1.0]), (0.1, 0.3), 2.0, np.random.default_rng(0))


def tolerance_of(law: str, static: float) -> float:
    """Return how far a law may be from the plant; `static` for one that is a function of the speed alone."""
    return {"dahl": BRISTLE, "lugre": BRISTLE, "gms": SLIP, "polyline_hysteresis": SLIP}.get(law, static)


@pytest.mark.parametrize("law", LAWS)
def test_one_mass_follows_the_plant(law: str) -> None:
    """Driven by reversing current steps, one mass moves as in the plant and sticks as long."""
    twin = Twin(Plant((PlantShaft("motor", 0.01, LAWS[law]),), (), MOTOR), {"drive.current": reversals()})
    truth, run = twin.run(2.0)
    tolerance = tolerance_of(law, CURVATURE)
    assert worst(truth, run, "motor.theta", "motor.omega") < tolerance
    stuck = [int(np.sum(source["motor.omega"] == 0.0)) for source in (truth, run)]
    assert abs(stuck[0] - stuck[1]) <= LOST_SAMPLES
    assert stuck[1] > 300 or law in ("none", "viscous", *SPRINGS)


@pytest.mark.parametrize("law", LAWS)
def test_two_masses_follow_the_plant(law: str) -> None:
    """With the load on a gear and a spring, with dry friction of its own, both shafts move as in the plant."""
    load = PlantShaft("load", 0.5, PlantFriction("coulomb_viscous", tau_c=0.3, viscous=0.05))
    joint = PlantTransmission("motor", "load", 5.0, 400.0, 0.5)
    twin = Twin(Plant((PlantShaft("motor", 0.01, LAWS[law]), load), (joint,), MOTOR), {"drive.current": reversals()})
    truth, run = twin.run(2.0)
    tolerance = tolerance_of(law, PHASE)
    assert worst(truth, run, "motor.theta", "motor.omega", "load.theta", "load.omega") < tolerance


@pytest.mark.parametrize("law", ["dahl", pytest.param("lugre", marks=pytest.mark.slow)])
def test_bristles_follow_the_plant_through_fast_motion(law: str) -> None:
    """From 20 rad/s with a slack bristle, the deflection settles at once, turns with the motion and does not ring."""
    twin = Twin(Plant((PlantShaft("motor", 0.01, LAWS[law]),), (), MOTOR), {"drive.current": reversals()})
    truth, run = twin.run(2.0, {"motor.omega": 20.0})
    error = np.abs(run["motor.friction.z"] - truth["motor.z"])
    presliding_instants = 0.95
    assert np.quantile(error, presliding_instants) < 0.02 * np.max(np.abs(truth["motor.z"]))


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_shaft_sticks_exactly_up_to_breakaway(direction: float) -> None:
    """Under a slow ramp the speed is exactly 0 and the angle unchanged until the torque passes tau_s of that way."""
    friction = PlantFriction("stribeck", tau_c=0.2, tau_s=(0.3, 0.35), omega_s=1.0)
    ramp = Trajectory(np.array([0.0, 1.0]), np.array([0.0, direction * 0.8]), "linear")
    twin = Twin(Plant((PlantShaft("motor", 0.01, friction),), (), MOTOR), {"drive.current": ramp})
    truth, run = twin.run(1.0)
    breakaway = (0.3 if direction > 0 else 0.35) / (0.5 * 0.8)
    held = run.time < breakaway - 1e-3
    assert np.all(run["motor.omega"][held] == 0.0) and np.all(run["motor.theta"][held] == 0.0)
    assert np.all(direction * run["motor.omega"][run.time > breakaway + 2e-3] > 0.0)
    growth = 2e-2
    """A step of 1 ms in the moment of release, grown with the falling Stribeck friction."""
    assert worst(truth, run, "motor.omega") < growth
