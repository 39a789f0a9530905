"""What the end of a diagnosis says of its rounds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.hindsight import MIMICKED, MISSED, doubted, merged, standing
from friction_ocp.diagnosis.rival import Rival
from friction_ocp.diagnosis.select import NOTHING, Choice, Round
from friction_ocp.simulation.losses import Absolute, AbstractLoss, Squares

SAMPLES = 1000
NOISE = 0.5 * SAMPLES


def fitted(objective: float, loss: AbstractLoss = Squares()) -> FittedModel:
    """Return what ends at an objective; that of noise is `NOISE`, unless another loss counts."""
    rows = SimpleNamespace(channel=np.zeros(SAMPLES), residual=np.ones(SAMPLES))
    linear, footing = SimpleNamespace(rows=rows), SimpleNamespace(loss=loss)
    return cast(FittedModel, SimpleNamespace(objective=objective, linear=linear, footing=footing))


def decided(effect: str | None, before: float, after: float = 0.0, screened: tuple[Any, ...] = ()) -> Round:
    """Return a round that adds an effect at the motor, as one of two rivals, or none."""
    if effect is None:
        return Round(screened, NOTHING, fitted(before), cast(Any, None), None)
    best = cast(Rival, SimpleNamespace(key=(effect, "motor"), standing=fitted(after)))
    choice = Choice((best, cast(Rival, SimpleNamespace(key=("warm_up", "motor")))), (0.9, 0.06), 0.04, True, (best,))
    return Round(screened, choice, fitted(before), cast(Any, None), best)


def test_what_leaves_nothing_is_as_sure_as_explanations_are() -> None:
    item = doubted([decided("cogging", NOISE + 400.0, NOISE)], fitted(NOISE + 3.0), False, 0.0)[0]
    assert item.choice.probabilities == pytest.approx((0.9 * (1 - MIMICKED), 0.06 * (1 - MIMICKED)))
    assert sum(item.choice.probabilities) + item.choice.nothing == pytest.approx(1.0)


def test_what_leaves_as_much_as_it_takes_may_well_be_a_stand_in() -> None:
    """The first of two additions takes 300 and the second 50; 100 are left that nothing explains."""
    rounds = [decided("cogging", NOISE + 450.0, NOISE + 150.0), decided("stribeck", NOISE + 150.0, NOISE + 100.0)]
    first, second = doubted(rounds, fitted(NOISE + 100.0), True, 0.0)
    assert first.choice.nothing == pytest.approx(0.04 + 0.96 * 100.0 / 400.0)
    assert second.choice.nothing == pytest.approx(0.04 + 0.96 * 100.0 / 150.0)


def test_what_does_not_carry_over_is_doubted_by_what_is_left_elsewhere() -> None:
    rounds = [decided("cogging", NOISE + 400.0, NOISE), decided(None, NOISE)]
    first, last = doubted(rounds, fitted(NOISE), False, 0.8)
    assert first.choice.nothing == pytest.approx(0.04 + 0.96 * 0.8)
    assert last is rounds[1]


def test_what_leaves_a_gap_and_does_not_carry_over_is_doubted_by_the_larger_share() -> None:
    """By what it leaves where it was fitted, or on recordings that took no part."""
    rounds = [decided("presliding", NOISE + 400.0, NOISE + 100.0)]
    for lost, share in ((1.0, 1.0 - MIMICKED), (0.6, 0.6), (0.1, 0.25)):
        (item,) = doubted(rounds, fitted(NOISE + 100.0), True, lost)
        assert item.choice.nothing == pytest.approx(0.04 + 0.96 * share)


def test_refits_that_explain_nothing_may_have_come_to_rest_on_the_way() -> None:
    """What nothing explains may be in the catalogue after all: by what the refits gained, if they gained anything."""
    gained = [cast(Rival, SimpleNamespace(standing=fitted(NOISE + left))) for left in (100.0, 300.0, 500.0)]
    choice = Choice(tuple(gained), (0.0, 0.0, 0.0), 1.0, False, ())
    before = fitted(NOISE + 400.0)
    (item,) = doubted([Round((), choice, before, cast(Any, None), None)], before, True, 0.0)
    assert item.choice.probabilities == pytest.approx((0.75 * MISSED, 0.25 * MISSED, 0.0))
    assert item.choice.nothing == pytest.approx(1.0 - MISSED)
    (item,) = doubted([decided(None, NOISE + 400.0)], before, True, 0.0)
    assert item.choice is NOTHING


def test_rounds_whose_addition_was_taken_back_do_not_stand() -> None:
    rounds = [decided("torque_ripple", 900.0), decided("compliance", 700.0), decided(None, 500.0)]
    kept, superseded = standing(rounds, [("compliance", "motor")])
    assert kept == [rounds[1], rounds[2]]
    assert superseded == [rounds[0]]


def test_that_nothing_is_missing_does_not_stand_beside_a_wrong_stated_value() -> None:
    seen: tuple[Any, ...] = ("all candidates",)
    found, checked = decided(None, 500.0, screened=seen), decided("inertia_error", 500.0)
    assert [(item.accepted, item.screened) for item in merged([found], [checked])] == [(checked.accepted, seen)]
    assert merged([found], []) == [found]
    other = decided("cogging", 900.0)
    assert merged([other], [checked]) == [other, checked]


def test_no_addition_is_given_up_altogether() -> None:
    """What closes nothing elsewhere was still found where the model was fitted."""
    item = doubted([decided("cogging", NOISE + 400.0, NOISE)], fitted(NOISE), False, 1.0)[0]
    assert item.choice.probabilities[0] == pytest.approx(0.9 * MIMICKED)


def test_noise_costs_what_its_loss_makes_of_it() -> None:
    """Under the absolute loss noise alone is more than half a unit a sample, and yet nothing that is left."""
    each = float(np.sqrt(2.0 / np.pi))
    ended = fitted(each * SAMPLES, Absolute(1e-6))
    item = doubted([decided("cogging", each * SAMPLES + 400.0, each * SAMPLES)], ended, True, 0.0)[0]
    assert item.choice.nothing == pytest.approx(0.04 + 0.96 * MIMICKED, abs=0.02)
