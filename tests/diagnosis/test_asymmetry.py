"""Friction that differs by direction, near standstill above all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import COULOMB, axis, with_stribeck, write_case

from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.registry import effects
from friction_ocp.execution.executor import InProcess
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.composite import SHARES, StribeckRise, added_terms, with_added
from friction_ocp.parameters import Directional, Tie
from friction_ocp.problem_file.load import load_problem
from friction_ocp.problem_file.write import write_problem
from friction_ocp.statistics.execution import Execution

BREAKAWAY, SPEED = (0.30, 0.18), 4.0
"""N m forward and backward, and rad/s."""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return the problem of an axis that breaks away harder in one direction, and whose model breaks away evenly."""
    plant = axis(law="stribeck", tau_s=BREAKAWAY, omega_s=SPEED)
    path = write_case(tmp_path, plant, effects=["asymmetry", "constant_torque", "unbalance"])
    return with_stribeck(path, 0.24, SPEED)


def test_the_rise_near_standstill_differs_where_the_law_has_one(path: Path) -> None:
    """What is added forward is taken off backward; the speed of the law differs by a share that has no unit."""
    bench = open_bench(load_problem(path), Execution(InProcess()))
    found = effects()["asymmetry"].addition(bench.problem.drive, "motor", bench.clues)
    terms = added_terms(found.drive.shaft("motor").friction.law)
    assert terms is not None
    rise = terms.stribeck
    assert isinstance(rise, StribeckRise)
    assert isinstance(rise.torque, Directional)
    share = "motor.friction.added.speed_share.positive"
    assert rise.omega_s == Directional(*(Tie(f"motor.friction.omega_s * (1 {sign} {share})") for sign in "+-"))
    assert rise.torque.negative == Tie("-1 * motor.friction.added.stribeck.torque.positive")
    names = ("coulomb", "viscous", "speed_share", "stribeck.torque")
    assert set(found.off) == {f"motor.friction.added.{name}.positive" for name in names}


def test_a_law_without_a_rise_gets_none(tmp_path: Path) -> None:
    """Coulomb and viscous friction differ, nothing else."""
    bench = open_bench(load_problem(write_case(tmp_path, axis())), Execution(InProcess()))
    found = effects()["asymmetry"].addition(bench.problem.drive, "motor", bench.clues)
    terms = added_terms(found.drive.shaft("motor").friction.law)
    assert terms is not None
    assert terms.stribeck is None


def test_what_it_adds_is_read_back_from_a_problem_file(path: Path) -> None:
    """Shares have either sign, and their names are none of those that must be positive."""
    bench = open_bench(load_problem(path), Execution(InProcess()))
    drive = effects()["asymmetry"].addition(bench.problem.drive, "motor", bench.clues).drive
    values = {f"motor.friction.added.{name}.positive": -0.1 for name in ("coulomb", "speed_share", "stribeck.torque")}
    written = path.with_name("augmented.yaml")
    written.write_text(write_problem(path, drive, values, path.parent), encoding="utf-8")
    read = {leaf.path: leaf.value for leaf in drive_leaves(load_problem(written).drive)}
    assert {name: read[name].guess for name in values} == values
    assert read["motor.friction.added.speed_share.negative"] == Tie("-1 * motor.friction.added.speed_share.positive")


def test_a_share_that_a_law_has_already_stays(path: Path) -> None:
    """It is no part of the addition."""
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["friction"]["added"] = {"speed_share": 0.1}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    bench = open_bench(load_problem(path), Execution(InProcess()))
    found = effects()["asymmetry"].addition(bench.problem.drive, "motor", bench.clues)
    terms = added_terms(found.drive.shaft("motor").friction.law)
    assert terms is not None and terms.stribeck is not None
    assert terms.speed_share == 0.1
    assert terms.stribeck.omega_s == Tie("motor.friction.omega_s")
    assert "motor.friction.added.speed_share.positive" not in found.off


def test_a_law_of_two_directions_is_what_its_mean_and_differences_make(path: Path) -> None:
    """Breakaway, Stribeck speed, bristle stiffness and damping of each direction come out as they were put in."""
    sides = {
        "tau_c": (0.2, 0.3),
        "tau_s": (0.5, 0.4),
        "omega_s": (2.0, 3.0),
        "sigma0": (90.0, 110.0),
        "sigma1": (0.5, 0.6),
        "sigma2": (0.01, 0.02),
    }
    mean = {name: 0.5 * sum(pair) for name, pair in sides.items()}
    odd = {name: 0.5 * (pair[0] - pair[1]) for name, pair in sides.items()}
    both = (1.0, -1.0)
    speeds = Directional(*sides["omega_s"])
    whole = with_added(
        LuGre(**mean),
        coulomb=Directional(*(sign * odd["tau_c"] for sign in both)),
        viscous=Directional(*(sign * odd["sigma2"] for sign in both)),
        stribeck=StribeckRise(Directional(*(sign * (odd["tau_s"] - odd["tau_c"]) for sign in both)), speeds),
        **{share: Directional(*(sign * odd[name] / mean[name] for sign in both)) for name, share in SHARES.items()},
    )
    plain = LuGre(**{name: Directional(*pair) for name, pair in sides.items()})
    for side in ("positive", "negative"):
        one, other = whole.along(side), plain.along(side)
        speed = np.array([0.0, 0.5, 2.0, 20.0])
        np.testing.assert_allclose(one.magnitude(speed), other.magnitude(speed), rtol=1e-12)
        np.testing.assert_allclose(one.weakening(speed), other.weakening(speed), rtol=1e-12)
        for name in ("sigma0", "sigma1"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-12)


@pytest.mark.slow
def test_breakaway_that_differs_by_direction_is_found(path: Path) -> None:
    """As an asymmetry, with half the difference as its size; the Coulomb friction does not differ."""
    found = diagnose(load_problem(path))
    assert found.accepted == (("asymmetry", "motor"),)
    values = found.final.values
    half = 0.5 * (BREAKAWAY[0] - BREAKAWAY[1])
    assert values["motor.friction.added.stribeck.torque.positive"] == pytest.approx(half, rel=0.15)
    assert values["motor.friction.added.coulomb.positive"] == pytest.approx(0.0, abs=0.1 * COULOMB)
