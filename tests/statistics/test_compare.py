"""Comparison: the right model wins, special cases are recognised, and other data are refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from runs import HERE, CoulombViscous, Free, right_problem, with_law

from friction_ocp.drive.parts import Drive, Gravity
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.problem import StaticUse
from friction_ocp.friction.static import Coulomb, Quadratic, Stribeck, Viscous
from friction_ocp.recording.static_points import StaticPoints
from friction_ocp.report.models_section import models_section
from friction_ocp.statistics.compare import Comparison, compare
from friction_ocp.statistics.nesting import is_nested
from friction_ocp.statistics.scores import scores_of
from friction_ocp.statistics_document import comparison_document

TAU_C, VISCOUS = Free(0.07, 0.0, 2.0), Free(2.2e-3, 0.0, 0.03)
RIGHT = CoulombViscous(TAU_C, VISCOUS)
SMALL, LARGE = Coulomb(TAU_C), Stribeck(TAU_C, Free(0.12, 0.0, 2.0), Free(1.0, 0.01, 50.0), VISCOUS)


@pytest.fixture(scope="module")
def compared() -> Comparison:
    """Too small, right and too large a model of the plant, judged on a third run."""
    laws = {"coulomb": SMALL, "right": RIGHT, "stribeck": LARGE}
    problems = [replace(with_law(law, 1, 2, validation=(3,)), title=name) for name, law in laws.items()]
    return compare(problems, execution=HERE)


def test_the_right_model_wins(compared: Comparison) -> None:
    """By AICc and BIC it does; held out, the larger one may tie with it, the smaller one cannot."""
    names = [item.name for item in compared.candidates]
    scores = {item.name: item.scores for item in compared.candidates}
    assert names[-1] == "coulomb"
    assert min(scores, key=lambda name: scores[name].bic) == "right"
    assert scores["right"].aicc < scores["coulomb"].aicc - 100
    assert compared.ranked_by == "held_out"
    held = [item.scores.held_out for item in compared.candidates]
    assert held == sorted(held, reverse=True)


def test_special_cases_are_recognised_and_tested(compared: Comparison) -> None:
    """Each of the three is nested in the next; the recordings refuse the smaller one only."""
    ratios = {(item.special, item.general): item for item in compared.ratios}
    assert set(ratios) == {("coulomb", "right"), ("right", "stribeck"), ("coulomb", "stribeck")}
    assert not any(item.stated for item in compared.ratios)
    refused = ratios["coulomb", "right"]
    assert (refused.added, refused.p_value) == (1, pytest.approx(0.0, abs=1e-10))
    kept = ratios["right", "stribeck"].p_value
    assert kept is None or kept > 1e-3


def test_the_lead_is_the_difference_of_held_out_likelihoods(compared: Comparison) -> None:
    """Sample by sample it sums to the same; no chance puts the smallest model beside the right one."""
    best = compared.candidates[0].scores.held_out
    assert best is not None
    for item in compared.candidates:
        assert item.scores.held_out is not None
        assert item.behind is not None
        assert item.behind.difference == pytest.approx(best - item.scores.held_out, rel=1e-6)
    assert {item.name for item in compared.candidates if item.behind and item.behind.tied} == {"right", "stribeck"}


def with_stribeck(omega_s: Free, train: tuple[int, ...], validation: tuple[int, ...], **estimation: Any) -> Comparison:
    """Compare the right model with one of which it is a special case."""
    laws = {"general": Stribeck(TAU_C, Free(0.12, 0.0, 2.0), omega_s, VISCOUS), "right": RIGHT}
    problems = [with_law(law, *train, validation=validation, **estimation) for law in laws.values()]
    return compare([replace(item, title=name) for item, name in zip(problems, laws, strict=True)], execution=HERE)


def test_a_lead_within_its_chance_is_a_tie_and_the_simpler_model_is_preferred() -> None:
    """A Stribeck speed below all speeds that were driven explains what was held out by a hair better."""
    found = with_stribeck(Free(0.03, 0.01, 0.05), (1, 2), (7,))
    first, second = found.candidates
    assert (first.name, second.name) == ("right", "general")
    assert first.scores.held_out is not None
    assert second.scores.held_out is not None
    assert first.scores.held_out < second.scores.held_out
    document = comparison_document(found)
    sentence = models_section(document["compare"], document).sentence
    assert sentence.startswith("right, general tie by held-out likelihood (a lead of 0.17")
    assert "and right is preferred as the simplest; so it is by AICc and BIC" in sentence


def test_ratios_that_say_little_are_flagged() -> None:
    """An added parameter at its bound, and a general model whose free run is less likely, both name what to do.

    Steps that are stated to be as long as the samples are apart leave the general model where it is.
    """
    found = with_stribeck(Free(1.0, 0.01, 20.0), (4,), (5,), max_step=1.0)
    (ratio,) = found.ratios
    assert ratio.at_bound == ("motor.friction.omega_s",)
    worse, stuck = found.warnings
    assert worse.startswith("general contains right, but its free run is less likely (log-likelihood 4296 to 4301)")
    assert stuck.startswith("general adds motor.friction.omega_s to right, at its bound")


def test_white_errors_are_all_independent(compared: Comparison) -> None:
    """The effective size of a right model's errors is near their number, 3000."""
    assert compared.effective_samples["position"] == pytest.approx(3000, rel=0.1)


def test_criteria_are_those_of_the_textbook(compared: Comparison) -> None:
    """-2 log L + 2 k n / (n - k - 1) and -2 log L + k log n, with the normal likelihood at its own spread."""
    (right,) = (item for item in compared.candidates if item.name == "right")
    runs = right.estimate.simulation.train
    errors = np.concatenate([run.simulated[:, 0] - run.measured[:, 0] for run in runs])
    errors = errors[np.isfinite(errors)]
    scores = scores_of(right.estimate, {"position": float(errors.size)})
    n, k, variance = errors.size, 4, float(np.mean(errors**2))
    log_likelihood = -0.5 * n * (np.log(2 * np.pi * variance) + 1.0)
    assert scores.log_likelihood == pytest.approx(log_likelihood)
    assert scores.aicc == pytest.approx(-2 * log_likelihood + 2 * k * n / (n - k - 1))
    assert scores.bic == pytest.approx(-2 * log_likelihood + k * np.log(n))


def test_too_few_independent_samples_have_no_aicc(compared: Comparison) -> None:
    """The correction for small samples grows without limit."""
    assert scores_of(compared.candidates[0].estimate, {"position": 3.0}).aicc == np.inf


def test_a_special_case_may_be_stated() -> None:
    """Two laws without a common name are nested only if someone says so; a name that is none is refused."""
    few = replace(with_law(Viscous(VISCOUS), 1), title="viscous")
    many = replace(with_law(Coulomb(TAU_C), 1), title="coulomb")
    assert compare([few, many], execution=HERE).ratios == ()
    with pytest.raises(FrictionOcpError, match="there is no problem 'dry'; one of viscous, coulomb"):
        compare([few, many], [("viscous", "dry")], HERE)


@pytest.mark.parametrize(("torque", "nested"), [(0.0, True), (0.5, False)])
def test_what_the_general_model_lacks_has_to_be_off(torque: float, nested: bool) -> None:
    """A known gravity torque is no special case of a drive without any; nor is a known Stribeck rise."""
    general = with_law(Quadratic(TAU_C, VISCOUS, Free(0.001, 0.0, 1.0)), 1)
    special = with_law(CoulombViscous(TAU_C, VISCOUS), 1)
    (shaft,) = special.drive.shafts
    hung = replace(special, drive=replace(special.drive, shafts=(replace(shaft, gravity=Gravity(torque, 0.0)),)))
    assert is_nested(prepare(hung), prepare(general)) is nested
    assert is_nested(prepare(special), prepare(general))
    assert not is_nested(prepare(with_law(Stribeck(TAU_C, 0.2, 1.0, VISCOUS), 1)), prepare(general))


def test_static_points_are_compared_like_recordings() -> None:
    """They alone are enough; their errors over their standard errors have a size of their own."""
    rng, error = np.random.default_rng(3), 2e-3
    speed = np.concatenate([side * np.geomspace(0.05, 20.0, 15) for side in (1.0, -1.0)])

    def points(name: str) -> StaticPoints:
        needed = np.sign(speed) * (0.07 + 0.05 * np.exp(-((speed / 0.8) ** 2))) + 2.2e-3 * speed
        torque = needed + error * rng.standard_normal(speed.size)
        units = {"speed": "rad/s", "torque": "N m", "std_error": "N m"}
        return StaticPoints(name, speed, units, torque=torque, std_error=np.full(speed.size, error))

    known = {"static": (StaticUse(points("first")),), "static_validation": (StaticUse(points("second")),)}
    laws = {"right": RIGHT, "stribeck": LARGE}
    bare = [replace(with_law(law), title=name, train=(), **known) for name, law in laws.items()]
    problems = [replace(item, drive=fixed_inertia(item.drive)) for item in bare]
    found = compare(problems, execution=HERE)
    assert found.effective_samples == {"torque of static points": speed.size}
    assert found.ranked_by == "held_out"
    best, other = found.candidates
    assert best.name == "stribeck"
    assert best.scores.held_out is not None
    assert other.scores.held_out is not None
    assert best.scores.held_out > other.scores.held_out + 10
    fitted, unseen = best.estimate.simulation.static
    size = fitted.noise_ratio
    expected = -speed.size * (0.5 * np.log(2 * np.pi) + np.log(size) + 0.5 * (unseen.noise_ratio / size) ** 2)
    assert best.scores.held_out == pytest.approx(expected)


def fixed_inertia(drive: Drive) -> Drive:
    """Return a drive whose inertia is known: static points say nothing about it."""
    return replace(drive, shafts=tuple(replace(shaft, inertia=1e-3) for shaft in drive.shafts))


def test_other_data_are_refused() -> None:
    """Recordings, loss and number of problems: every difference in a line of its own."""
    base = replace(right_problem(), title="a")
    with pytest.raises(FrictionOcpError, match="1 problem given; two or more"):
        compare([base], execution=HERE)
    other = replace(base, title="b", train=base.train[:1], estimation=replace(base.estimation, loss="huber"))
    with pytest.raises(FrictionOcpError) as caught:
        compare([base, other], execution=HERE)
    lines = [str(finding) for finding in caught.value.findings]
    assert lines == [
        "b: the train recordings or static points differ from those of a: draw2; the same samples in all problems",
        "b: the loss is huber, in a squares; the same loss in all problems",
    ]


def test_other_noise_is_refused() -> None:
    """Likelihoods over different noise floors cannot be compared."""
    base = replace(right_problem(), title="a")
    current, position = base.drive.channels
    drive = replace(base.drive, channels=(current, replace(position, noise_std=0.02)))
    with pytest.raises(FrictionOcpError, match=r"b: the noise floor of position is 0\.02, in a 0\.01"):
        compare([base, replace(base, title="b", drive=drive)], execution=HERE)
