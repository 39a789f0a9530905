"""Friction that differs by direction, near standstill above all."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from diagnosis_cases import COULOMB, OFF, VISCOUS, axis, write_case

from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.effects.registry import effects
from friction_ocp.execution.executor import InProcess
from friction_ocp.friction.composite import StribeckRise, added_terms
from friction_ocp.parameters import Directional, Tie
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution

BREAKAWAY, SPEED = (0.30, 0.18), 4.0
"""N m forward and backward, and rad/s."""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return the problem of an axis that breaks away harder in one direction, and whose model breaks away evenly."""
    plant = axis(law="stribeck", tau_s=BREAKAWAY, omega_s=SPEED)
    path = write_case(tmp_path, plant, effects=["asymmetry", "constant_torque", "unbalance"])
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["friction"] = {
        "law": "stribeck",
        "tau_c": {"guess": OFF * COULOMB, "min": 0, "max": 2},
        "tau_s": {"guess": 0.24 * OFF, "min": 0, "max": 2},
        "omega_s": {"guess": OFF * SPEED, "min": 0.1, "max": 40},
        "viscous": {"guess": OFF * VISCOUS, "min": 0, "max": 0.1},
    }
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


def test_the_rise_near_standstill_differs_where_the_law_has_one(path: Path) -> None:
    """Its speed is that of the law, and what is added forward is taken off backward."""
    bench = open_bench(load_problem(path), Execution(InProcess()))
    found = effects()["asymmetry"].addition(bench.problem.drive, "motor", bench.clues)
    terms = added_terms(found.drive.shaft("motor").friction.law)
    assert terms is not None
    rise = terms.stribeck
    assert isinstance(rise, StribeckRise)
    assert isinstance(rise.torque, Directional)
    assert rise.omega_s == Tie("motor.friction.omega_s")
    assert rise.torque.negative == Tie("-1 * motor.friction.added.stribeck.torque.positive")
    assert set(found.off) == {f"motor.friction.added.{x}.positive" for x in ("coulomb", "viscous", "stribeck.torque")}


def test_a_law_without_a_rise_gets_none(tmp_path: Path) -> None:
    """Coulomb and viscous friction differ, nothing else."""
    bench = open_bench(load_problem(write_case(tmp_path, axis())), Execution(InProcess()))
    found = effects()["asymmetry"].addition(bench.problem.drive, "motor", bench.clues)
    terms = added_terms(found.drive.shaft("motor").friction.law)
    assert terms is not None
    assert terms.stribeck is None


@pytest.mark.slow
def test_breakaway_that_differs_by_direction_is_found(path: Path) -> None:
    """As an asymmetry, with half the difference as its size; the Coulomb friction does not differ."""
    found = diagnose(load_problem(path))
    assert found.accepted == (("asymmetry", "motor"),)
    values = found.final.values
    half = 0.5 * (BREAKAWAY[0] - BREAKAWAY[1])
    assert values["motor.friction.added.stribeck.torque.positive"] == pytest.approx(half, rel=0.15)
    assert values["motor.friction.added.coulomb.positive"] == pytest.approx(0.0, abs=0.1 * COULOMB)
