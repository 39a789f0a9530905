"""Speeds of shafts over one another."""

from __future__ import annotations

from friction_ocp.drive.gearing import relative_speeds
from friction_ocp.drive.parts import Drive, Shaft, Transmission


def test_ratios_multiply_along_a_chain_whatever_its_order() -> None:
    """And against it; a shaft that nothing joins to the first one has none."""
    shafts = tuple(Shaft(name, 1.0) for name in ("gear", "motor", "load", "alone"))
    joints = (Transmission("gear", "load", 5.0), Transmission("motor", "gear", 10.0))
    drive = Drive(shafts, joints)
    speeds = relative_speeds(drive, {"motor-gear.ratio": 10.0, "gear-load.ratio": 5.0})
    assert speeds == {"gear": 1.0, "motor": 10.0, "load": 0.2}
