"""Which shafts move together, by what ratios, and which arrangements are refused."""

from __future__ import annotations

import numpy as np
import pytest
from plant import Plant, PlantShaft, PlantTransmission
from twin import Bench, drive_of

from friction_ocp.drive.mechanism import mechanism
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft, Transmission
from friction_ocp.drive.topology import topology
from friction_ocp.drive.units import signal_unit, unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import FrictionOcpError
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous

ROUNDING = 1e-12


def shafts(*names: str) -> tuple[Shaft, ...]:
    """Frictionless shafts of equal inertia."""
    return tuple(Shaft(name, 0.1) for name in names)


def test_rigid_joints_make_groups_with_ratios() -> None:
    """Shafts joined rigidly share the coordinate of the first of them; elastic joints divide groups."""
    joints = (
        Transmission("a", "b", 4.0),
        Transmission("c", "b", -2.0),
        Transmission("b", "d", 3.0, 100.0),
        Transmission("d", "e", 0.5),
    )
    found = topology(Drive(shafts("a", "b", "c", "d", "e"), joints))
    assert found.roots == ("a", "d")
    assert found.group_of == {"a": 0, "b": 0, "c": 0, "d": 1, "e": 1}
    assert found.speed_ratio == {"a": 1.0, "b": 0.25, "c": -0.5, "d": 1.0, "e": 2.0}
    assert set(found.beyond(joints[0])) == {"b", "c"} and set(found.beyond(joints[1])) == {"a", "b"}


def test_a_rigid_loop_is_refused() -> None:
    """Rigid joints in a loop fix the same speed twice: an error names them and says what to do."""
    joints = (Transmission("a", "b", 2.0), Transmission("b", "c", 2.0), Transmission("a", "c", 4.0))
    with pytest.raises(FrictionOcpError, match="a-b, b-c, a-c form a loop; give one of them a stiffness"):
        topology(Drive(shafts("a", "b", "c"), joints))


def test_a_loop_with_a_spring_in_it_moves() -> None:
    """The same loop with one elastic joint is a drive: consistent ratios turn together without winding it up."""
    joints = (Transmission("a", "b", 2.0), Transmission("b", "c", 2.0), Transmission("a", "c", 4.0, 50.0))
    drive = Drive(shafts("a", "b", "c"), joints, channels=(Channel("c", "c.omega"),))
    assert mechanism(drive).state_names == ("a.theta", "a.omega")
    run = Bench(drive).run(0.5, {}, {"a.omega": 4.0})
    assert run["c"] == pytest.approx(np.ones(501), rel=ROUNDING)


def test_momentum_is_kept_across_elastic_joints() -> None:
    """Free of outer torques, the angular momentum of a branched elastic drive stays what it was."""
    plant = Plant(
        (PlantShaft("a", 0.01), PlantShaft("b", 0.02), PlantShaft("gear", 1.0)),
        (PlantTransmission("a", "gear", 10.0, 2e3), PlantTransmission("b", "gear", -20.0, 2e3)),
    )
    run = Bench(drive_of(plant, {})).run(1.0, {}, {"a.omega": 5.0, "gear.omega": 0.1})
    momentum = 10.0 * 0.01 * run["a.omega"] - 20.0 * 0.02 * run["b.omega"] + run["gear.omega"]
    assert momentum == pytest.approx(np.full(1001, 0.6), rel=ROUNDING)


def carriage(stiffness: float | None) -> Drive:
    """A motor that moves a carriage of 20 kg by a screw of 200 rad/m."""
    return Drive(
        (
            Shaft("motor", 1e-4),
            Shaft("carriage", 20.0, FrictionElement(CoulombViscous(30.0, 100.0)), motion="linear"),
        ),
        (Transmission("motor", "carriage", 200.0, stiffness, 500.0 if stiffness else 0.0),),
        (Motor("drive", "motor"),),
        None,
        (Channel("torque", "drive.torque", "input"), Channel("x", "carriage.theta"), Channel("v", "carriage.omega")),
    )


@pytest.mark.parametrize("stiffness", [None, 1e6], ids=["rigid", "elastic"])
def test_a_linear_drive_settles_at_the_speed_of_its_force(stiffness: float | None) -> None:
    """A screw turns torque into force by its ratio in rad/m; the carriage settles where friction balances it."""
    run = Bench(carriage(stiffness)).run(3.0, {"torque": 0.2}, step=2e-4)
    speed = (0.2 * 200.0 - 30.0) / 100.0
    time_constant = (20.0 + 1e-4 * 200.0**2) / 100.0
    settled = np.exp(-3.0 / time_constant)
    assert run["v"][-1] == pytest.approx(speed * (1 - settled), rel=1e-6)
    assert run["motor.omega"][-1] == pytest.approx(200.0 * speed, rel=1.01 * settled)


def test_a_linear_drive_has_units_of_length_and_force() -> None:
    """Everything on the carriage is in m, N and kg, the ratio in rad/m, everything on the motor in rad and N m."""
    drive = carriage(1e6)
    units = {leaf.path: unit_of(leaf, drive) for leaf in drive_leaves(drive)}
    assert units["carriage.inertia"] == "kg" and units["carriage.friction.tau_c"] == "N"
    assert units["carriage.friction.viscous"] == "N s/m" and units["motor-carriage.stiffness"] == "N/m"
    assert units["motor.inertia"] == "kg m^2" and units["motor-carriage.ratio"] == "rad/m"
    assert signal_unit(drive, "carriage.omega") == "m/s" and signal_unit(drive, "drive.torque") == "N m"
