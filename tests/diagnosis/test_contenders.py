"""Which of the candidates that were refitted a few steps are refitted to their end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from friction_ocp.diagnosis import crew as crew_module
from friction_ocp.diagnosis.contenders import completed_rivals, to_refit
from friction_ocp.diagnosis.crew import Crew, Refit
from friction_ocp.diagnosis.rival import Rival
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.effects.effect import Augmentation, Key

SAMPLES, COST = 1000, 3000.0
"""The noise of the samples makes 500 of the cost."""
DRIVE: Any = None


def completed(
    *tried: tuple[str, float, float], exhausted: bool = False, lost: bool = False, refused: str = ""
) -> list[list[str]]:
    """Return the effects whose refits are completed, turn by turn, from (effect, predicted gain, cost after steps).

    One of them is `refused`: it makes free runs no better.
    """
    screened = [Screened(effect, "motor", gain, 0.0, (), Augmentation(DRIVE, {}, ())) for effect, gain, _ in tried]
    refits = [Refit(item, None, cost) for item, (_, _, cost) in zip(screened, tried, strict=True)]
    rows = SimpleNamespace(channel=np.zeros(SAMPLES), residual=np.ones(SAMPLES))
    current = SimpleNamespace(cost=COST, leads_loosely=lost, linear=SimpleNamespace(rows=rows))
    turns = list[list[str]]()

    def rivals(some: list[Refit], without: Any, asked: dict[Key, float], thorough: int = 0) -> list[Rival]:
        turns.append([refit.key[0] for refit in some])
        stood = [SimpleNamespace(cost=refit.cost, material=refit.key[0] != refused) for refit in some]
        return [
            cast(Any, SimpleNamespace(standing=each, screened=0, key=refit.key))
            for each, refit in zip(stood, some, strict=True)
        ]

    def without(shortlist: list[Screened], unfitted: list[Screened]) -> tuple[None, list[Refit]]:
        return None, refits

    level = SimpleNamespace(levelled=lambda some, *_: some)
    crew = SimpleNamespace(bench=SimpleNamespace(current=current), without=without, rivals=rivals, **vars(level))
    asked = {item.key: np.inf for item in screened}
    known = {item.key: item for item in screened}
    found = completed_rivals(cast(Crew, crew), screened, [], known, asked, lambda: exhausted)
    list(found)
    return turns


def test_a_prediction_beyond_noise_promises_no_more_than_noise() -> None:
    """What explains everything in a few steps is not passed over for what was predicted to explain more than that."""
    turns = completed(("asymmetry", 2600.0, 510.0), ("unbalance", 3100.0, 515.0), ("constant_torque", 2400.0, 505.0))
    assert set(turns[0]) == {"asymmetry", "unbalance", "constant_torque"}


def test_the_best_come_first_and_the_others_if_those_will_not_do() -> None:
    """By what a few steps or the prediction leave; what resembles the best comes with it."""
    turns = completed(("cogging", 2400.0, 2000.0), ("unbalance", 100.0, 700.0), ("warm_up", 50.0, 2900.0))
    assert turns == [["cogging", "unbalance"], ["warm_up"]]
    turns = completed(("stribeck", 2400.0, 600.0), ("cogging", 0.0, 700.0), ("polyline_break", 50.0, 2900.0))
    assert turns == [["stribeck", "cogging", "polyline_break"]]


def test_what_will_not_come_as_far_as_the_best_has_come_waits_until_that_will_not_do() -> None:
    """Neither by a few steps nor by its prediction, even if its end leaves a quarter of what these do."""
    left, promised, near = ("warm_up", 10.0, 1500.0), ("torque_ripple", 2485.0, 1500.0), ("unbalance", 10.0, 515.0)
    best = ("cogging", 2400.0, 502.0)
    assert completed(best, left) == [["cogging"], ["warm_up"]]
    assert completed(best, left, exhausted=True) == [["cogging"]]
    assert completed(best, left, promised, near) == [["cogging", "unbalance", "torque_ripple"], ["warm_up"]]


def test_at_the_limit_of_effort_only_the_best_are_completed() -> None:
    """A search that has taken long enough does not go through what looks worse."""
    tried = (("cogging", 2400.0, 2000.0), ("unbalance", 100.0, 700.0), ("warm_up", 50.0, 2900.0))
    assert completed(*tried, exhausted=True) == [["cogging", "unbalance"]]


def test_what_comes_as_near_after_a_few_steps_is_completed_beside_the_best() -> None:
    """A false promise and the best leave no place for what explains the same as that: it is no less likely."""
    tried = (("sensor_gain", 2400.0, 2000.0), ("sensor_offset", 1400.0, 1600.0), ("asymmetry", 1390.0, 1606.0))
    assert completed(*tried) == [["sensor_gain", "sensor_offset"], ["asymmetry"]]
    further = (*tried, ("warm_up", 50.0, 2900.0))
    assert completed(*further) == [["sensor_gain", "sensor_offset"], ["asymmetry"], ["warm_up"]]


def test_what_is_refused_leaves_the_field_to_what_comes_as_near_as_the_best_of_the_rest() -> None:
    """A better fit that cannot be added does not make the only other one that was completed the answer."""
    tried = (
        ("sensor_eccentricity", 2000.0, 1100.0),
        ("asymmetry", 1400.0, 2000.0),
        ("constant_torque", 1390.0, 2005.0),
    )
    assert completed(*tried) == [["sensor_eccentricity", "asymmetry"], ["constant_torque"]]
    alone = completed(*tried, exhausted=True)
    assert alone == [["sensor_eccentricity", "asymmetry"]]
    both = completed(*tried, exhausted=True, refused="sensor_eccentricity")
    assert both == [["sensor_eccentricity", "asymmetry"], ["constant_torque"]]


def test_what_lost_runs_promise_counts_for_nothing() -> None:
    """Only what a few steps leave tells which refits are worth completing."""
    tried = (("cogging", 2500.0, 2900.0), ("stribeck", 10.0, 700.0), ("unbalance", 10.0, 1300.0))
    assert completed(*tried, lost=True) == [["stribeck", "unbalance"], ["cogging"]]
    assert completed(*tried)[0][0] == "cogging"


def test_what_promises_most_of_lost_runs_is_refitted() -> None:
    """Short segments may not show it at all, beside what chance explains of them."""
    promises = {"position_ripple": 2900.0, "torque_ripple": 2000.0, "structural_mode": 300.0, "cogging": 100.0}
    loosely = {"position_ripple": 3.0, "torque_ripple": 4.0, "structural_mode": 100.0, "cogging": 1.0}
    start: Any = object()
    found = [
        Screened(effect, "motor", gain, 0.0, (start,), Augmentation(DRIVE, {}, ())) for effect, gain in promises.items()
    ]
    rows = SimpleNamespace(channel=np.zeros(SAMPLES), residual=np.ones(SAMPLES))
    current = SimpleNamespace(astray=True, lost=True, leads_loosely=True, linear=SimpleNamespace(rows=rows))

    def fitted_loosely(tried: list[Screened]) -> list[float]:
        return [loosely[item.effect] for item in tried]

    crew: Any = SimpleNamespace(
        bench=SimpleNamespace(current=current), screened_loosely=lambda keys: [], fitted_loosely=fitted_loosely
    )
    chosen, unfitted = to_refit(crew, found, found)
    assert {item.effect for item in chosen} == {"position_ripple", "torque_ripple", "structural_mode"}
    assert not unfitted


def test_the_shape_of_what_segments_have_found_is_tried_whatever_it_promises_where_they_are_far_off() -> None:
    """From where the model stands and from the guesses: parameters that are far off hide what a shape would do."""
    start: Any = object()
    promises = {"torque_saturation": 2900.0, "stribeck": 1.0}
    found = [
        Screened(effect, "motor", gain, 0.0, (start,), Augmentation(DRIVE, {}, ())) for effect, gain in promises.items()
    ]
    current = SimpleNamespace(astray=True, lost=False)
    crew: Any = SimpleNamespace(bench=SimpleNamespace(current=current), screened_unfitted=lambda keys: found)
    for shapes, named in (((), ["torque_saturation"]), ([("stribeck", "motor")], ["torque_saturation", "stribeck"])):
        chosen, unfitted = to_refit(crew, found[:1], found, shapes)
        assert [item.effect for item in chosen] == named
        assert [item.effect for item in unfitted] == named


@pytest.mark.parametrize(("joined", "asked"), [(True, [["b"]]), (False, [])])
def test_what_comes_as_near_begins_again_from_the_node_states_of_the_best(
    joined: bool, asked: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where segments are joined, each of which may stick or slide; what is far behind does not."""
    monkeypatch.setattr(crew_module, "point_document", lambda fitted: fitted)
    monkeypatch.setattr(crew_module, "screened_document", lambda item: item)
    turns = list[list[str]]()

    def run(what: str, tasks: list[Any], begin: float) -> list[Any]:
        turns.append([task.arguments[0] for task in tasks])
        return [None for _ in tasks]

    bench = SimpleNamespace(current=SimpleNamespace(footing=SimpleNamespace(joined=joined)))
    found = [
        cast(Any, SimpleNamespace(key=(name, "motor"), standing=SimpleNamespace(cost=cost), fitted=0, screened=name))
        for name, cost in (("a", 100.0), ("b", 101.0), ("c", 200.0))
    ]
    crew: Any = Crew(cast(Any, bench), cast(Any, None), 1, lambda what, share: None)
    monkeypatch.setattr(Crew, "_run", lambda self, *rest: run(*rest))
    asks = {item.key: 1.0 for item in found}
    assert crew.levelled(found, 110.0, np.zeros(1), asks) == found
    assert turns == asked
