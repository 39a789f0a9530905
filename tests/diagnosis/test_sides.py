"""A diagnosis says on which side of a rigid joint it takes the sensors to be."""

from __future__ import annotations

import pytest

from friction_ocp.diagnosis_document import sides
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft, Transmission


def _drive(stiffness: float | None, *measured: str) -> Drive:
    channels = [Channel(name.replace(".", "_"), name) for name in measured]
    joint = Transmission("motor", "link", 101.0, stiffness)
    shafts = (Shaft("motor", 8e-5), Shaft("link", 2.0))
    return Drive(
        shafts,
        (joint,),
        (Motor("drive", "motor", 0.1),),
        None,
        (Channel("current", "drive.current", "input"), *channels),
    )


def test_what_is_behind_a_rigid_joint_alone_is_told():
    (line,) = sides(_drive(None, "link.theta", "link.omega"))
    assert line.startswith("link_theta, link_omega: behind motor-link") and "`motor`" in line and "`gain`" in line


@pytest.mark.parametrize(
    ("stiffness", "measured"),
    [
        (None, ("motor.theta",)),
        (None, ("motor.theta", "link.theta")),
        (None, ("drive.voltage",)),
        (3e4, ("link.theta",)),
    ],
)
def test_nothing_is_said_where_it_is_known_or_makes_a_difference_already(
    stiffness: float | None, measured: tuple[str, ...]
) -> None:
    assert sides(_drive(stiffness, *measured)) == []
