"""Free runs of a drive that noise alone sets as far apart as they err."""

from __future__ import annotations

import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import aries
import pytest
from diagnosis_cases import axis, diagnosed, with_stribeck, write_case

from friction_ocp.diagnosis import straying
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.diagnose import Diagnosis
from friction_ocp.diagnosis.free_gap import free_errors
from friction_ocp.diagnosis.straying import strays_as_far
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.score import simulate_recordings
from friction_ocp.friction.composite import SHARES
from friction_ocp.problem_file.load import load_problem

sys.path.insert(0, str(Path(__file__).parents[2] / "problems" / "benchmarks"))
import gaps

LEVEL = 0.01
RISE = {"law": "stribeck", "tau_s": 0.3, "omega_s": 0.5}


def test_what_a_model_lacks_is_more_than_noise_makes_of_free_runs(tmp_path: Path) -> None:
    """Runs of a model without the Stribeck friction of its plant err by far more than noise sets them apart."""
    fitted = fit_base(prepare(load_problem(write_case(tmp_path, axis(**RISE)))))
    errors = free_errors(fitted, held_out=True)
    assert errors.excess() > 10.0
    assert not strays_as_far(fitted, errors, 0, LEVEL)


@pytest.mark.parametrize(("held_out", "share"), [(True, 1.0), (False, 0.1)])
def test_what_noise_makes_of_free_runs_is_the_bound(tmp_path: Path, held_out: bool, share: float) -> None:
    """A model of the kind of its plant errs no more than that; errors of a thousand times the power are more.

    One rest in a fitted recording that ends a little late makes all but a tenth of what its runs err by.
    """
    path = with_stribeck(write_case(tmp_path, axis(**RISE)), 0.3, 0.5)
    fitted = fit_base(prepare(load_problem(path)))
    errors = free_errors(fitted, held_out)
    assert strays_as_far(fitted, replace(errors, power=share * errors.power), 0, LEVEL, held_out)
    assert not strays_as_far(fitted, replace(errors, power=1e3 * errors.power), 0, LEVEL, held_out)


@pytest.mark.parametrize(("times", "fewest", "most"), [(1e6, 5, 5), (30.0, 6, 99)])
def test_noise_is_drawn_as_often_as_the_level_asks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: float, fewest: int, most: int
) -> None:
    """Up to 99 times at a level of a hundredth, and five where what noise makes is far from the errors."""
    path = with_stribeck(write_case(tmp_path, axis(**RISE)), 0.3, 0.5)
    fitted = fit_base(prepare(load_problem(path)))
    errors, calls = free_errors(fitted, held_out=True), list[int]()

    def counted(*args: Any, **kwargs: Any) -> Any:
        calls.append(1)
        return simulate_recordings(*args, **kwargs)

    monkeypatch.setattr(straying, "simulate_recordings", counted)
    assert not strays_as_far(fitted, replace(errors, power=times * errors.power), 0, LEVEL)
    assert fewest <= len(calls) <= most


def test_runs_are_drawn_once_for_a_diagnosis() -> None:
    """What free runs told is kept where the rounds are seen in hindsight, or the problem is stated otherwise."""
    nothing: dict[str, Any] = {item.name: None for item in fields(Diagnosis)}
    found = Diagnosis(**nothing)
    vars(found)["stray"] = True  # as it is once it has been asked for, which takes a base fit here
    later = found.changed(rounds=()).changed(stated=None)
    assert later.stray and later.rounds == ()


@pytest.mark.slow
def test_friction_by_direction_of_a_telescope_is_found_though_its_free_runs_part(tmp_path: Path) -> None:
    """The axis is unstable where its friction falls; the mean over both directions comes out as that of its plant."""
    found = diagnosed(gaps.aries_axis("asymmetry", tmp_path))
    assert found["verdict"] == "explained"
    assert [(item["effect"], item["component"]) for item in found["accepted"]] == [("asymmetry", "axis")]
    assert found["remainder"]["stray"]
    assert load_problem(tmp_path / "out" / "augmented.yaml").drive.shafts[0].friction.law.has_bristle
    values = {name: item["value"] for name, item in found["accepted"][0]["parameters"].items()}
    odd = {name: 0.5 * (pair[0] - pair[1]) for name, pair in aries.NUMBERS.items()}
    mean = {name: 0.5 * sum(pair) for name, pair in aries.NUMBERS.items()}
    stem = "axis.friction.added"
    assert values[f"{stem}.coulomb.positive"] == pytest.approx(odd["tau_c"], rel=0.1)
    assert values[f"{stem}.viscous.positive"] == pytest.approx(odd["viscous"], rel=0.1)
    for name in ("omega_s", "sigma0"):
        assert values[f"{stem}.{SHARES[name]}.positive"] == pytest.approx(odd[name] / mean[name], abs=0.03)
