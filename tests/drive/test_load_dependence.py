"""Friction that grows with the transmitted torque, across rigid and elastic joints."""

from __future__ import annotations

import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantShaft, PlantTransmission, Trajectory, reversing_steps
from twin import Bench, Twin, worst

from friction_ocp.drive.parts import Channel, Drive, ExternalTorque, Motor, Shaft, Transmission
from friction_ocp.drive.stepping import stepped
from friction_ocp.errors import FrictionOcpError
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.static import Coulomb, CoulombViscous, Stribeck

STEP_ERROR = 1e-3
"""Relative error of steps of 1 ms with a dozen stops, joints of up to 300 rad/s and bristles."""
ROUNDING = 1e-12

MOTOR = (PlantMotor("drive", "motor", torque_constant=0.5),)
LOADED = {
    "coulomb": PlantFriction("coulomb", tau_c=0.1, load_coulomb=(0.1, 0.15)),
    "stribeck": PlantFriction(
        "stribeck", 0.1, 0.15, 2.0, viscous=0.01, load_coulomb=0.1, load_stribeck=0.05, load_viscous=0.005
    ),
    "lugre": PlantFriction(
        "lugre", 0.1, 0.15, 2.0, viscous=0.01, sigma0=200.0, sigma1=0.05, load_coulomb=0.1, load_viscous=0.005
    ),
}


def reversals() -> Trajectory:
    """Current steps of three sizes and both signs."""
    return reversing_steps(np.array([0.2, 0.5, 1.0]), (0.1, 0.3), 2.0, np.random.default_rng(0))


@pytest.mark.parametrize("stiffness", [np.inf, 2000.0], ids=["rigid", "elastic"])
@pytest.mark.parametrize("ratio", [4.0, -4.0])
@pytest.mark.parametrize("law", LOADED)
def test_loaded_friction_follows_the_plant(law: str, ratio: float, stiffness: float) -> None:
    """A geared load with gravity and friction that differs by direction moves as in the plant, for both signs."""
    load = PlantShaft("load", 0.4, PlantFriction("coulomb_viscous", tau_c=(0.3, 0.2), viscous=0.05), (0.5, 0.3))
    joint = PlantTransmission("motor", "load", ratio, stiffness, 3.0 if np.isfinite(stiffness) else 0.0)
    twin = Twin(Plant((PlantShaft("motor", 0.01, LOADED[law]), load), (joint,), MOTOR), {"drive.current": reversals()})
    truth, run = twin.run(2.0)
    assert worst(truth, run, "motor.theta", "motor.omega", "load.theta", "load.omega") < STEP_ERROR


def test_three_rigid_shafts_follow_the_plant() -> None:
    """Two loaded rigid joints in a row, the first of them reversing, are solved together."""
    friction = PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.005, load_coulomb=0.1)
    shafts = (
        PlantShaft("motor", 0.01, friction),
        PlantShaft("middle", 0.05, friction),
        PlantShaft("load", 0.4, PlantFriction("coulomb", tau_c=(0.3, 0.2))),
    )
    joints = (PlantTransmission("motor", "middle", -2.0), PlantTransmission("middle", "load", 3.0))
    truth, run = Twin(Plant(shafts, joints, MOTOR), {"drive.current": reversals()}).run(2.0)
    assert worst(truth, run, "motor.theta", "motor.omega", "load.omega") < STEP_ERROR


def lift(motor_share: float, load_share: float) -> Bench:
    """A motor that lifts 8 N m through a rigid gear of 4; each shaft may have loaded friction."""
    shafts = (
        Shaft("motor", 0.01, FrictionElement(Coulomb(0.1), LoadDependence(motor_share))),
        Shaft("load", 0.4, FrictionElement(Coulomb(0.4), LoadDependence(load_share)), None, ExternalTorque(-8.0)),
    )
    torque = Channel("torque", "drive.torque", "input")
    omega = Channel("omega", "motor.omega")
    return Bench(
        Drive(shafts, (Transmission("motor", "load", 4.0),), (Motor("drive", "motor"),), None, (torque, omega))
    )


@pytest.mark.parametrize("shares", [(0.2, 0.0), (0.0, 0.3), (0.2, 0.3)])
def test_a_lift_accelerates_by_its_torque_balance(shares: tuple[float, float]) -> None:
    """The torque T through the gear solves the balances of both shafts, the friction of each being a share of it."""
    torque, (motor_share, load_share) = 6.0, shares
    # 0.01 a = torque - T / 4 - 0.1 - motor_share T / 4 and 0.4 a / 4 = T - 8 - 0.4 - load_share T
    lhs = np.array([[0.01, 0.25 * (1 + motor_share)], [0.1, -(1 - load_share)]])
    alpha, _ = np.linalg.solve(lhs, [torque - 0.1, -8.4])
    run = lift(*shares).run(0.1, {"torque": torque}, {"motor.omega": 1.0})
    assert run["motor.omega"] == pytest.approx(1.0 + alpha * run.time, rel=ROUNDING)


def test_a_lift_holds_between_its_limits() -> None:
    """At rest, T = 2 N m on the motor side is held from 0.8 T - tau_c up to 1.2 T + tau_c, and moves outside."""
    bench = lift(0.2, 0.0)
    hold, margin = ((8.0 - 0.4) / 4 * 0.8 - 0.1, (8.0 + 0.4) / 4 * 1.2 + 0.1), 1e-6
    torques = (hold[0] - margin, hold[0] + margin, hold[1] - margin, hold[1] + margin)
    speeds = [bench.run(0.1, {"torque": torque})["motor.omega"][-1] for torque in torques]
    assert speeds[0] < 0.0 and speeds[1] == 0.0 and speeds[2] == 0.0 and speeds[3] > 0.0


@pytest.mark.parametrize("law", LOADED)
def test_a_lone_shaft_is_loaded_by_its_motor(law: str) -> None:
    """A joint that is modelled as one inertia has its gear inside: friction grows with the torque of the motor."""
    shaft = PlantShaft("motor", 0.05, LOADED[law], (0.5, 0.3))
    truth, run = Twin(Plant((shaft,), (), MOTOR), {"drive.current": reversals()}).run(2.0)
    assert worst(truth, run, "motor.theta", "motor.omega") < STEP_ERROR


def test_load_dependence_needs_what_loads() -> None:
    """On a shaft that neither transmits a torque nor has a motor it is refused with the shaft's name."""
    lone = Drive((Shaft("axis", 0.01, FrictionElement(Coulomb(0.1), LoadDependence(0.1))),))
    with pytest.raises(FrictionOcpError, match=r"axis\.friction\.load: .*neither a transmission nor a motor"):
        stepped(lone)


def test_shares_are_finite_without_dry_friction() -> None:
    """Where no shaft of a rigid group has dry friction the shares are finite and the load still counts."""
    friction = PlantFriction("viscous", viscous=0.01, load_viscous=0.02)
    shafts = (PlantShaft("motor", 0.01, friction), PlantShaft("load", 0.4, PlantFriction("viscous", viscous=0.05)))
    plant = Plant(shafts, (PlantTransmission("motor", "load", 4.0),), MOTOR)
    truth, run = Twin(plant, {"drive.current": reversals()}).run(1.0)
    assert worst(truth, run, "motor.theta", "motor.omega") < STEP_ERROR


@pytest.mark.parametrize("seed", range(8))
def test_random_geared_loads_follow_the_plant(seed: int) -> None:
    """Whatever the shares, ratios and inertias, hoisting and lowering, the loaded gear moves as in the plant."""
    rng = np.random.default_rng(seed)
    shares = {name: rng.uniform(0.0, top) for name, top in (("coulomb", 0.3), ("stribeck", 0.2), ("viscous", 0.02))}
    motor = PlantFriction(
        "stribeck", rng.uniform(0.02, 0.2), 0.25, 2.0, viscous=0.01, **{f"load_{k}": v for k, v in shares.items()}
    )
    load = PlantFriction("stribeck", (rng.uniform(0.0, 0.5), rng.uniform(0.0, 0.5)), 0.6, 0.5, viscous=0.05)
    shafts = (
        PlantShaft("motor", rng.uniform(0.003, 0.02), motor, external_torque=rng.uniform(-0.2, 0.2)),
        PlantShaft("load", rng.uniform(0.1, 1.0), load, (rng.uniform(0.5, 3.0), rng.uniform(-3.0, 3.0))),
    )
    joint = PlantTransmission("motor", "load", rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 8.0))
    current = reversing_steps(np.array([0.2, 0.6, 1.5]), (0.05, 0.2), 1.0, rng)
    twin = Twin(Plant(shafts, (joint,), MOTOR), {"drive.current": current})
    truth, _ = twin.run(1.0)
    finer = twin.bench.run(1.0, {"drive.current": current}, step=2.5e-4)
    assert worst(truth, finer, "motor.theta", "motor.omega") < STEP_ERROR


@pytest.mark.parametrize("stiffness", [np.inf, 300.0], ids=["rigid", "elastic"])
def test_a_shaft_with_two_branches_carries_both_torques(stiffness: float) -> None:
    """The friction of a shaft that drives two loads grows with the sum of what it passes on to them."""
    damping = 0.5 if np.isfinite(stiffness) else 0.0
    shafts = (
        PlantShaft("motor", 0.01, PlantFriction("coulomb", 0.1, load_coulomb=0.3)),
        PlantShaft("left", 0.3, PlantFriction("coulomb", 0.2), (2.0, 0.3)),
        PlantShaft("right", 0.2, PlantFriction("viscous", viscous=0.1), (1.0, -0.5)),
    )
    joints = tuple(
        PlantTransmission("motor", name, ratio, stiffness, damping) for name, ratio in (("left", 4.0), ("right", -6.0))
    )
    twin = Twin(Plant(shafts, joints, MOTOR), {"drive.current": reversals()})
    truth, _ = twin.run(1.0)
    finer = twin.bench.run(1.0, {"drive.current": reversals()}, step=2.5e-4)
    assert worst(truth, finer, "motor.theta", "motor.omega") < STEP_ERROR


def test_a_stribeck_speed_of_the_load_is_that_of_a_law() -> None:
    """Loaded friction that falls with a speed of its own is that of a law with this speed and no rise of its own."""
    shares = (0.1, 0.05, 0.005)
    own = FrictionElement(CoulombViscous(0.1, 0.01), LoadDependence(*shares, omega_s=2.0))
    of_law = FrictionElement(Stribeck(0.1, 0.1, 2.0, 0.01), LoadDependence(*shares))
    for speed in np.linspace(0.0, 10.0, 21):
        wanted = float(of_law.magnitude("positive", float(speed), 3.0))
        assert float(own.magnitude("positive", float(speed), 3.0)) == pytest.approx(wanted, rel=ROUNDING)
