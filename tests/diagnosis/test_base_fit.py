"""The base model of a diagnosis is fitted, or it is said why not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import yaml
from diagnosis_cases import COULOMB, INERTIA, OFF, VISCOUS, axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.effects.effect import change_shaft
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.model import prepare
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.smoothing import sqrt
from friction_ocp.parameters import Value, quantity
from friction_ocp.problem_file.load import load_problem

BREAKAWAY, STRIBECK_SPEED, EXPONENT = 0.16, 8.0, 0.85


def test_friction_that_falls_infinitely_steep_from_rest_is_fitted(tmp_path: Path) -> None:
    """With an exponent below 1 the Stribeck curve has no slope at standstill; noise of torque is weighed without it."""
    path = write_case(
        tmp_path, axis(law="stribeck", tau_s=BREAKAWAY, omega_s=STRIBECK_SPEED, delta=EXPONENT), effects=["asymmetry"]
    )
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    law: dict[str, Any] = document["drive"]["shafts"][0]["friction"]
    law |= {"law": "stribeck", "delta": EXPONENT, "tau_s": {"guess": OFF * BREAKAWAY, "min": 0, "max": 2}}
    law["omega_s"] = {"guess": OFF * STRIBECK_SPEED, "min": 0.1, "max": 100}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    fitted = fit_base(prepare(load_problem(path)))
    assert np.all(np.isfinite(fitted.footing.noise))
    assert not innovations(fitted).significant(0.01)
    truth = {"tau_c": COULOMB, "tau_s": BREAKAWAY, "viscous": VISCOUS}
    found = {name: fitted.values[f"motor.friction.{name}"] for name in truth}
    assert found == pytest.approx(truth, rel=0.1)


@dataclass(frozen=True)
class UpToASpeed(AbstractFrictionLaw):
    """Friction that is no number beyond a speed."""

    tau_c: Value = quantity("torque", "Coulomb friction")
    top: Value = quantity("speed", "speed beyond which there is no friction to speak of")
    name: ClassVar[str] = "up_to_a_speed"

    def magnitude(self, speed: Any) -> Any:
        return self.tau_c * sqrt(1.0 - speed / self.top)


def test_a_model_that_cannot_be_simulated_is_an_error(tmp_path: Path) -> None:
    """A base model whose simulation breaks down along the recordings is no answer, and it is said what to do."""
    problem = load_problem(write_case(tmp_path, axis()))
    tau_c = problem.drive.shaft("motor").friction.law.tau_c  # pyright: ignore[reportAttributeAccessIssue]
    drive = change_shaft(problem.drive, "motor", friction=FrictionElement(UpToASpeed(tau_c, 1.0)))
    with pytest.raises(FrictionOcpError, match=r"problem.yaml: diagnose: .*breaks down.*start from other guesses"):
        fit_base(prepare(replace(problem, drive=drive)))


@pytest.mark.parametrize(("off", "at_odds"), [(1.0, False), (OFF, True)])
def test_a_fit_that_has_left_its_prior_is_told_from_one_that_has_not(tmp_path: Path, off: float, at_odds: bool) -> None:
    """An inertia that is off by 4 %, and was said to be known to a thousandth, against one that is right."""
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["inertia"] |= {"guess": off * INERTIA, "prior_std": 1e-3 * INERTIA}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    assert fit_base(prepare(load_problem(path))).at_odds == at_odds
