"""Effects that the plant has and the model lacks are named, among those that resemble them."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnosis_cases import COULOMB, VISCOUS, write_case
from effect_cases import CASES, shaft
from plant import PlantFriction, PlantWarmUp

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.effects.registry import effects
from friction_ocp.problem_file.load import load_problem


def test_every_effect_has_a_case() -> None:
    """The catalogue holds nothing that is not injected with the plant."""
    assert CASES.keys() == effects().keys()


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_what_the_plant_has_is_named(name: str, tmp_path: Path) -> None:
    """The effect is accepted at its place, by itself or at the head of an alias set, and nothing before it."""
    case = CASES[name]
    found = diagnose(load_problem(case.write(name, tmp_path)))
    assert found.accepted[:1] == ((name, case.place),)


@pytest.mark.slow
def test_loaded_friction_that_falls_with_the_speed_gets_that_shape(tmp_path: Path) -> None:
    """A share of the load that fades with the speed is named as load dependence, and its size and speed are found."""
    share, speed = 0.3, 15.0
    loads = {"load_coulomb": share / 3.0, "load_stribeck": share}
    falling = PlantFriction("stribeck", COULOMB, COULOMB, speed, viscous=VISCOUS, **loads)
    path = write_case(tmp_path, shaft(friction=falling), effects=["load_dependence", "stribeck", "quadratic_drag"])
    found = diagnose(load_problem(path))
    assert found.accepted == (("load_dependence", "motor"),)
    assert found.final.values["motor.friction.load.stribeck"] == pytest.approx(share, rel=0.1)
    assert found.final.values["motor.friction.load.omega_s"] == pytest.approx(speed, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("power", "share", "change"), [(0.0, 0.0, -0.4), (8.0, 1.0, -0.4), (2.0, 1.0, -0.8)])
def test_what_warms_friction_is_told(power: float, share: float, change: float, tmp_path: Path) -> None:
    """Friction that its own losses warm is told from friction that time alone does, and how fast it settles.

    Losses may be larger than those at which it would lose almost all if they stayed as they are.
    """
    settles = 1.5
    path = write_case(
        tmp_path,
        shaft(warm_up=PlantWarmUp(settles, change, change, power)),
        effects=["warm_up", "quadratic_drag", "asymmetry"],
    )
    found = diagnose(load_problem(path))
    assert found.accepted == (("warm_up", "motor"),)
    values = found.final.values
    assert values["motor.friction.warm_up.loss_share"] == pytest.approx(share, abs=0.1)
    assert values["motor.friction.warm_up.time_constant"] == pytest.approx(settles, rel=0.1)
