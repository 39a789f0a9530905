"""SI units of the numbers and signals of rotary and linear drives, and of controllers."""

from __future__ import annotations

from dataclasses import replace

import pytest

from friction_ocp.drive.parts import (
    Channel,
    Cogging,
    Controller,
    ControllerType,
    Disturbance,
    Drive,
    Eccentricity,
    Gravity,
    Hysteresis,
    KinematicError,
    Motor,
    SecondStage,
    Shaft,
    TorqueRipple,
    Transmission,
)
from friction_ocp.drive.units import signal_unit, unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import FrictionOcpError
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.modifiers import Ripple, WarmUp
from friction_ocp.friction.static import Quadratic

RIPPLE, WARM_UP = Ripple(0.1, 0.1, 1.0), WarmUp(0.1, 0.1, 1.0)
QUADRATIC = FrictionElement(Quadratic(1.0, 1.0, 1.0), LoadDependence(viscous=0.1), RIPPLE, WARM_UP)
SCREW = Drive(
    shafts=(
        Shaft("motor", 1.0, QUADRATIC, Gravity(1.0)),
        Shaft("slide", 1.0, QUADRATIC, Gravity(1.0), motion="linear", disturbance=Disturbance(1.0, 1.0, 1.0)),
    ),
    transmissions=(
        Transmission(
            "motor",
            "slide",
            100.0,
            1.0,
            stiffening=1.0,
            second_stage=SecondStage(1.0, 1.0),
            hysteresis=Hysteresis(1.0, 1.0),
            kinematic_error=KinematicError(1.0, 1.0, 1.0),
        ),
    ),
    motors=(
        Motor(
            "servo",
            "motor",
            resistance=1.0,
            inductance=1.0,
            cogging=Cogging(1.0, 1.0, 1.0),
            torque_ripple=TorqueRipple(1.0, 1.0, 1.0),
            lag=1.0,
            saturation=1.0,
        ),
    ),
    channels=(
        Channel("angle", "motor.theta", eccentricity=Eccentricity(0.1, 0.1)),
        Channel("place", "slide.theta"),
        Channel("push", "slide.alpha"),
        Channel("amps", "servo.current"),
    ),
)
EXPECTED = {
    "motor.friction.ripple.cosine": "1",
    "slide.friction.ripple.period": "m",
    "motor.friction.warm_up.per_kelvin": "1/K",
    "motor.friction.warm_up.reference_temperature": "degC",
    "motor.friction.warm_up.time_constant": "s",
    "slide.disturbance.sine": "N",
    "slide.disturbance.period": "s",
    "servo.cogging.cosine": "N m",
    "servo.cogging.period": "rad",
    "servo.torque_ripple.sine": "1",
    "angle.eccentricity.sine": "rad",
    "servo.lag": "s",
    "servo.saturation": "1/A^2",
    "motor-slide.stiffening": "N/m^3",
    "motor-slide.second_stage.stiffness": "N/m",
    "motor-slide.second_stage.twist": "m",
    "motor-slide.second_stage.rounding": "1",
    "motor-slide.hysteresis.torque": "N",
    "motor-slide.hysteresis.twist": "m",
    "motor-slide.kinematic_error.sine": "m",
    "motor-slide.kinematic_error.period": "rad",
    "motor.inertia": "kg m^2",
    "slide.inertia": "kg",
    "motor.gravity.torque": "N m",
    "slide.gravity.phase": "m",
    "motor.friction.tau_c": "N m",
    "slide.friction.tau_c": "N",
    "motor.friction.viscous": "N m s/rad",
    "slide.friction.viscous": "N s/m",
    "motor.friction.quadratic": "N m s^2/rad^2",
    "motor.friction.load.coulomb": "1",
    "motor.friction.load.viscous": "s/rad",
    "slide.friction.load.viscous": "s/m",
    "motor-slide.ratio": "rad/m",
    "motor-slide.stiffness": "N/m",
    "motor-slide.backlash": "m",
    "servo.torque_constant": "N m/A",
    "servo.resistance": "ohm",
    "servo.inductance": "H",
    "servo.share": "1",
    "angle.offset": "rad",
    "place.offset": "m",
    "push.offset": "m/s^2",
    "amps.offset": "A",
    "amps.gain": "1",
    "amps.delay": "s",
}
GAINS: dict[tuple[ControllerType, str], tuple[str, str, str]] = {
    ("duty", "voltage"): ("1/rad", "1/rad", "s/rad"),
    ("p", "voltage"): ("V/rad", "V/rad", "V s/rad"),
    ("pd", "torque"): ("N m/rad", "N m/rad", "N m s/rad"),
    ("pi_velocity", "voltage"): ("V s/rad", "V/rad", "V s/rad"),
    ("cascade", "current"): ("1/s", "A/rad", "A s/rad"),
}


def units(drive: Drive) -> dict[str, str]:
    return {leaf.path: unit_of(leaf, drive) for leaf in drive_leaves(drive)}


def test_units_follow_kind_and_motion() -> None:
    """Each number has the SI unit of its kind, of its own side of a screw."""
    found = units(SCREW)
    assert {path: found[path] for path in EXPECTED} == EXPECTED


@pytest.mark.parametrize("case", GAINS, ids=lambda case: case[0])
def test_gains_turn_errors_into_commands(case: tuple[ControllerType, str]) -> None:
    """A gain is the unit of the command over that of the error which it multiplies."""
    controller = Controller(case[0], "angle", case[1], saturation=(-1.0, 1.0))  # pyright: ignore[reportArgumentType]
    found = units(replace(SCREW, controller=controller))
    assert tuple(found[f"controller.{key}"] for key in ("kp", "ki", "kd")) == GAINS[case]


def test_gain_of_a_linear_feedback() -> None:
    """A controller that watches the slide has gains over metres, and a saturation in its output's unit."""
    controller = Controller("p", "place", "voltage", saturation=(-1.0, 1.0))
    found = units(replace(SCREW, controller=controller))
    assert (found["controller.kp"], found["controller.saturation.0"]) == ("V/m", "V")


def test_signals_have_units() -> None:
    """Signals of shafts, motors and the set point have units; others do not exist."""
    names = ("motor.omega", "slide.alpha", "servo.torque", "servo.enable", "reference.theta", "temperature")
    assert [signal_unit(SCREW, name) for name in names] == ["rad/s", "m/s^2", "N m", "1", "rad", "degC"]
    with pytest.raises(FrictionOcpError, match="no such signal"):
        signal_unit(SCREW, "servo.omega")
