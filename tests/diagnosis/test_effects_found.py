"""Effects that the plant has and the model lacks are named, among those that resemble them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diagnosis_cases import COULOMB, TORQUE_CONSTANT, VISCOUS, axis, write_case
from plant import Plant, PlantAmplifier, PlantFriction, PlantRipple, PlantSaturation, PlantWarmUp

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.problem_file.load import load_problem


def shaft(**changes: Any) -> Callable[[], Plant]:
    """Return what makes the axis with changes to its shaft."""
    return lambda: replace(axis(), shafts=(replace(axis().shafts[0], **changes),))


def motor(**changes: Any) -> Callable[[], Plant]:
    """Return what makes the axis with changes to its motor."""
    return lambda: replace(axis(), motors=(replace(axis().motors[0], **changes),))


def late(seconds: float) -> Callable[[], Plant]:
    """Return what makes the axis whose motor follows late what is recorded: the command."""
    lagging = motor(amplifier=PlantAmplifier(time_constant=seconds))()
    command = replace(lagging.sensors[1], measures="motor.command", noise_std=0.0)
    return lambda: replace(lagging, sensors=(lagging.sensors[0], command))


def sensor(**changes: Any) -> Callable[[], Plant]:
    """Return what makes the axis with changes to its encoder."""
    plain = axis()
    return lambda: replace(plain, sensors=(replace(plain.sensors[0], **changes), *plain.sensors[1:]))


BREAK = PlantFriction("polyline", tau_c=COULOMB, slopes=(3.0 * VISCOUS, VISCOUS), breaks=(40.0,))
TORQUE = 0.5 * TORQUE_CONSTANT
"""Of half an ampere, N m: what moves the axis at least."""
CASES: dict[str, tuple[Callable[[], Plant], str, tuple[str, ...]]] = {
    "polyline_break": (shaft(friction=BREAK), "motor", ("quadratic_drag", "stribeck")),
    "quadratic_drag": (lambda: axis(law="quadratic", quadratic=1e-5), "motor", ("polyline_break", "asymmetry")),
    "asymmetry": (lambda: axis(viscous=(1.3 * VISCOUS, 0.7 * VISCOUS)), "motor", ("constant_torque", "unbalance")),
    "load_dependence": (
        shaft(friction=PlantFriction("coulomb_viscous", COULOMB, viscous=VISCOUS, load_coulomb=0.15)),
        "motor",
        ("quadratic_drag", "torque_saturation"),
    ),
    "position_ripple": (shaft(ripple=PlantRipple(7.0, (0.4,), (0.0,))), "motor", ("cogging", "torque_ripple")),
    "warm_up": (shaft(warm_up=PlantWarmUp(2.0, -0.3, -0.5, 0.0)), "motor", ("quadratic_drag", "drive_lag")),
    "cogging": (motor(cogging=PlantRipple(3.1, (0.1 * TORQUE,), (0.0,))), "motor", ("torque_ripple", "unbalance")),
    "torque_ripple": (motor(torque_ripple=PlantRipple(3.1, (0.2,), (0.0,))), "motor", ("cogging", "unbalance")),
    "drive_lag": (late(0.006), "motor", ("torque_saturation", "sensor_delay")),
    "torque_saturation": (motor(saturation=PlantSaturation(3.0)), "motor", ("quadratic_drag", "drive_lag")),
    "unbalance": (shaft(gravity=(0.1 * TORQUE, 0.7)), "motor", ("position_ripple", "constant_torque")),
    "periodic_disturbance": (shaft(disturbance=PlantRipple(0.9, (0.1 * TORQUE,), (0.0,))), "motor", ("cogging",)),
    "sensor_delay": (sensor(delay=0.005), "position", ("drive_lag", "quadratic_drag")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_what_the_plant_has_is_named(name: str, tmp_path: Path) -> None:
    """The effect is accepted at its place, by itself or at the head of an alias set, and nothing before it."""
    plant, place, rivals = CASES[name]
    path = write_case(tmp_path, plant(), effects=[name, *rivals])
    found = diagnose(load_problem(path))
    assert found.accepted[:1] == ((name, place),)


@pytest.mark.slow
def test_loaded_friction_that_falls_with_the_speed_gets_that_shape(tmp_path: Path) -> None:
    """A share of the load that fades with the speed is named as load dependence, and its size and speed are found."""
    share, speed = 0.3, 15.0
    loads = {"load_coulomb": share / 3.0, "load_stribeck": share}
    falling = PlantFriction("stribeck", COULOMB, COULOMB, speed, viscous=VISCOUS, **loads)
    path = write_case(tmp_path, shaft(friction=falling)(), effects=["load_dependence", "stribeck", "quadratic_drag"])
    found = diagnose(load_problem(path))
    assert found.accepted == (("load_dependence", "motor"),)
    assert found.final.values["motor.friction.load.stribeck"] == pytest.approx(share, rel=0.1)
    assert found.final.values["motor.friction.load.omega_s"] == pytest.approx(speed, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("power", "share"), [(0.0, 0.0), (8.0, 1.0)])
def test_what_warms_friction_is_told(power: float, share: float, tmp_path: Path) -> None:
    """Friction that its own losses warm is told from friction that time alone does, and how fast it settles."""
    settles, change = 1.5, -0.4
    path = write_case(
        tmp_path,
        shaft(warm_up=PlantWarmUp(settles, change, change, power))(),
        effects=["warm_up", "quadratic_drag", "asymmetry"],
    )
    found = diagnose(load_problem(path))
    assert found.accepted == (("warm_up", "motor"),)
    values = found.final.values
    assert values["motor.friction.warm_up.loss_share"] == pytest.approx(share, abs=0.1)
    assert values["motor.friction.warm_up.time_constant"] == pytest.approx(settles, rel=0.1)
