"""The constant-speed reduction of a chain, against the plant turning steadily."""

from __future__ import annotations

import leighton
import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantShaft, PlantTransmission
from twin import drive_of

from friction_ocp.drive.parts import Drive, ExternalTorque, Gravity, Shaft, Transmission
from friction_ocp.drive.steady import Effort, steady_drive
from friction_ocp.drive.values import drive_leaves
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.modifiers import Ripple
from friction_ocp.friction.static import CoulombViscous

SETTLED = 1e-6
"""Relative rest of the start after the times simulated here."""
SLOW = PlantFriction("stribeck", tau_c=(0.2, 0.3), tau_s=0.4, omega_s=0.5, viscous=0.1)
FAST = PlantFriction("polyline", tau_c=(0.02, 0.03), slopes=(0.004, 0.001), breaks=(20.0,))
LOADED = PlantFriction("coulomb_viscous", 0.02, viscous=0.003, load_coulomb=0.3, load_viscous=0.01)


def motors(*shafts: str, share: float = 1.0) -> tuple[PlantMotor, ...]:
    shares = (1.0, share)
    return tuple(
        PlantMotor(f"m{k}", shaft, "current", torque_constant=0.5, share=shares[k]) for k, shaft in enumerate(shafts)
    )


CHAINS: dict[str, Plant] = {
    "one shaft": Plant((PlantShaft("a", 0.001, FAST),), (), motors("a")),
    "spring": Plant(
        (PlantShaft("a", 0.001, FAST), PlantShaft("b", 0.02, SLOW)),
        (PlantTransmission("a", "b", 5.0, 400.0, 5.0),),
        motors("a"),
    ),
    "reversing gear": Plant(
        (PlantShaft("a", 0.001, FAST), PlantShaft("b", 0.02, SLOW)), (PlantTransmission("a", "b", -5.0),), motors("a")
    ),
    "loaded": Plant(
        (PlantShaft("a", 0.001, LOADED), PlantShaft("b", 0.02, SLOW)), (PlantTransmission("a", "b", 5.0),), motors("a")
    ),
    "loaded alone": Plant((PlantShaft("a", 0.001, LOADED),), (), motors("a")),
    "two chains": Plant(
        (PlantShaft("a", 0.001, FAST), PlantShaft("b", 0.02, SLOW), PlantShaft("c", 0.001, LOADED)),
        (PlantTransmission("a", "b", 5.0, 400.0, 5.0), PlantTransmission("c", "b", 5.0, 400.0, 5.0)),
        motors("a", "c", share=0.7),
    ),
}


@pytest.mark.parametrize("current", [0.9, -0.9])
@pytest.mark.parametrize("name", CHAINS)
def test_the_plant_turns_steadily_under_the_predicted_current(name: str, current: float) -> None:
    """Under a constant current the plant settles at a speed, for which the reduction returns that current."""
    plant = CHAINS[name]
    inputs = {f"{motor.name}.current": current for motor in plant.motors}
    done = plant.simulate(20.0, inputs, step=1e-4, truth_rate=10)
    speed = done.truth["a.omega"]
    assert abs(speed[-1] - speed[-50]) < SETTLED * abs(speed[-1])
    assert effort(drive_of(plant, inputs), "current", speed[-1]) == pytest.approx(current, rel=1e-5)


def effort(drive: Drive, kind: Effort, speed: float, angle: float = 0.0, placed: bool = False) -> float:
    """Return what the motors of a drive with plain numbers deliver at constant speed."""
    steady = steady_drive(drive, kind, placed)
    values = {leaf.path: float(leaf.value) for leaf in drive_leaves(drive)}
    return float(steady.effort(speed, angle, np.array([values[path] for path in steady.parameter_names])))


@pytest.mark.parametrize("speed", [50.0, 104.25, 266.0])
def test_both_parts_of_the_leighton_telescope_add_up_at_its_motor(speed: float) -> None:
    """T_load = T_rh + R T_rl (eq. 7): both parts of eq. 13 together are the polyline of eqs. 5, 6, break at 0.5826 N m.

    Beyond the break c2h + R c1l = 0.0004, which eq. 6 has as 0.000417.
    """
    plant = leighton.lumped(leighton.fast_polyline(), leighton.slow_friction())
    found = effort(drive_of(plant, {"motor.current": 0.0}), "torque", speed)
    assert found == pytest.approx(0.1447 + 0.0042 * min(speed, 104.25) + 0.0004 * max(speed - 104.25, 0.0), rel=1e-9)
    if speed == leighton.BREAK:
        assert found == pytest.approx(0.5826, abs=1e-4)


def test_friction_that_loads_itself_is_solved_for() -> None:
    """The last shaft's friction grows with the torque that overcomes it: T = 0.2 + 0.1 omega + 0.2 T."""
    shafts = (
        Shaft("a", 0.001),
        Shaft("b", 0.02, FrictionElement(CoulombViscous(0.2, 0.1), LoadDependence(coulomb=0.2))),
    )
    drive = Drive(shafts, (Transmission("a", "b", 5.0, 400.0, 5.0),))
    assert effort(drive, "torque", 30.0) == pytest.approx((0.2 + 0.1 * 6.0) / 0.8 / 5.0, rel=1e-12)


def test_gravity_and_outer_torques_count_at_their_angle() -> None:
    """What gravity and a constant torque do on the load stands against the motor, over the ratio."""
    load = Shaft("b", 0.02, gravity=Gravity(2.0, 0.1), external_torque=ExternalTorque(-0.5))
    drive = Drive((Shaft("a", 0.001), load), (Transmission("a", "b", 5.0),))
    wanted = (2.0 * np.sin(1.5 / 5.0 + 0.1) + 0.5) / 5.0
    assert effort(drive, "torque", 30.0, 1.5) == pytest.approx(wanted, rel=1e-12)


def test_the_wave_of_a_friction_counts_only_at_a_place() -> None:
    """Dry friction of the load times 1 + a wave over its angle, where the angle is stated; without it the mean."""
    friction = FrictionElement(CoulombViscous(0.2, 0.1), ripple=Ripple(0.3, -0.1, 0.7))
    drive = Drive((Shaft("a", 0.001), Shaft("b", 0.02, friction)), (Transmission("a", "b", 5.0),))
    turn = 2.0 * np.pi * (1.5 / 5.0) / 0.7
    wave = 1.0 + 0.3 * np.cos(turn) - 0.1 * np.sin(turn)
    assert effort(drive, "torque", 30.0, 1.5, placed=True) == pytest.approx((0.2 * wave + 0.6) / 5.0, rel=1e-12)
    assert effort(drive, "torque", 30.0, 1.5) == pytest.approx((0.2 + 0.6) / 5.0, rel=1e-12)
