"""What the search makes of an addition that may stand in for something else."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from friction_ocp.diagnosis import reexamine, search, stand_ins
from friction_ocp.diagnosis.search import Search
from friction_ocp.diagnosis.select import Choice, Round
from friction_ocp.effects.effect import Key

HELD, RIVAL, PLACE = ("asymmetry", "motor"), ("constant_torque", "motor"), ("asymmetry", "load")


def free_runs(excess: float, lost: bool = False, drowned: bool = False) -> Any:
    return SimpleNamespace(excess=lambda: excess, lost=lost, drowned=drowned)


@pytest.mark.parametrize(
    ("noise", "taken", "before", "after", "helps"),
    [
        (True, 0.89, free_runs(100.0), free_runs(98.0), False),
        (True, 0.99, free_runs(100.0), free_runs(98.0), False),
        (True, 0.99, free_runs(100.0), free_runs(40.0), True),
        (True, 0.99, free_runs(100.0), free_runs(98.0, drowned=True), True),
        (True, 0.99, free_runs(100.0, lost=True), free_runs(98.0), True),
        (True, 0.99, free_runs(0.0), free_runs(0.05), True),
        (False, 0.2, free_runs(100.0), free_runs(10.0), False),
        (False, 0.5, free_runs(100.0), free_runs(85.0), False),
        (False, 0.5, free_runs(100.0), free_runs(65.0), True),
        (False, 0.95, free_runs(100.0), free_runs(98.0), True),
    ],
)
def test_an_addition_has_to_help_free_runs_too(
    monkeypatch: pytest.MonkeyPatch, noise: bool, taken: float, before: Any, after: Any, helps: bool
) -> None:
    """What helps from sample to sample alone is taken back, unless free runs can say nothing or noise moves them.

    Where noise is left, and alone sets free runs as far apart, they can say nothing either.
    """
    model = SimpleNamespace(problem=SimpleNamespace(estimation=SimpleNamespace(seed=0)))
    foot = SimpleNamespace(predicted=False)
    base = SimpleNamespace(cost=100.0)
    current = SimpleNamespace(cost=100.0 - 40.0 * taken, model=model, footing=foot)
    power = SimpleNamespace(significant=lambda level: not noise)
    monkeypatch.setattr(stand_ins, "innovations", lambda fitted: power)
    monkeypatch.setattr(stand_ins, "samples", lambda fitted: 120)
    monkeypatch.setattr(stand_ins, "comes_closer", lambda one, other, seed: other.excess() < one.excess())
    pair = cast(Any, base), cast(Any, current)
    assert stand_ins.helps(*pair, 0.01, lambda: (before, after), lambda: False) == helps
    assert stand_ins.helps(*pair, 0.01, lambda: (before, after), lambda: True) == (helps or noise)


@pytest.mark.parametrize(("taken", "helps"), [(0.89, False), (0.99, True)])
def test_what_takes_almost_all_of_more_than_the_noise_stands(
    monkeypatch: pytest.MonkeyPatch, taken: float, helps: bool
) -> None:
    """Free runs that come no nearer say that torque noise, or something else, is missing beside it."""
    base, current = (SimpleNamespace(cost=cost, footing=SimpleNamespace(predicted=False)) for cost in (100.0, 0.0))
    current.cost = 100.0 - 60.0 * taken
    monkeypatch.setattr(stand_ins, "innovations", lambda fitted: SimpleNamespace(significant=lambda level: False))
    monkeypatch.setattr(stand_ins, "samples", lambda fitted: 80)
    runs = free_runs(100.0), free_runs(98.0)
    assert stand_ins.helps(cast(Any, base), cast(Any, current), 0.01, lambda: runs, lambda: False) == helps


def rival(key: Key, cost: float, determined: int) -> Any:
    standing = SimpleNamespace(cost=cost, determined=determined, size=cost)
    return SimpleNamespace(key=key, standing=standing, fitted=SimpleNamespace(cost=cost))


def decided(*rivals: Any) -> Round:
    """Return the round that the first of some rivals has won; 100 was left before."""
    choice = Choice(rivals, (1.0,) + (0.0,) * (len(rivals) - 1), 0.0, True, rivals[:1])
    return Round((), choice, cast(Any, SimpleNamespace(cost=100.0)), cast(Any, None), rivals[0])


def test_what_took_half_with_fewer_parameters_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a constant torque lacked of an asymmetry, what was found later may explain; not what nearly all lacks."""
    monkeypatch.setattr(reexamine, "may_grow", lambda drive, key, clues: False)
    monkeypatch.setattr(reexamine, "with_additions", lambda base, keys: None)
    monkeypatch.setattr(reexamine, "clues_of", lambda base: None)
    bench: Any = SimpleNamespace(base=None)
    near = [rival(PLACE, 20.0, 9), rival(("unbalance", "load"), 25.0, 9)]
    simpler, poor = rival(RIVAL, 30.0, 8), rival(("sensor_offset", "current"), 80.0, 8)
    item = decided(rival(HELD, 19.0, 9), *near, rival(("presliding", "motor"), 28.0, 9), simpler, poor)
    tried = reexamine._others(bench, item, [HELD, ("torque_saturation", "motor")])
    assert tried == [*near, simpler]


@pytest.mark.parametrize(("further", "followed"), [(5.0, True), (35.0, False), (None, False)])
def test_other_effects_are_followed_where_the_only_addition_leads_nowhere(
    monkeypatch: pytest.MonkeyPatch, further: float | None, followed: bool
) -> None:
    """They take its place where, with a further one, they leave less for certain than it does alone."""
    other = rival(RIVAL, 60.0, 8)
    first = decided(rival(HELD, 40.0, 9), rival(PLACE, 45.0, 9), other)
    added = None if further is None else rival(("structural_mode", "load"), further, 10)
    looked = list[list[Key]]()

    def look(bench: Any, keys: list[Key], meant: Any) -> Round:
        looked.append(keys)
        return Round((), Choice((), (), 1.0, False, ()), bench, cast(Any, None), added)

    monkeypatch.setattr(search, "required", lambda base, current: 10.0)
    bench = SimpleNamespace(base=None, current=SimpleNamespace(cost=40.0, astray=False), at=lambda fitted: fitted)
    looking: Any = SimpleNamespace(
        rounds=[first],
        bench=bench,
        accepted=[HELD],
        meant=None,
        _round=look,
        _on_steps=bench.at,
        allowance=SimpleNamespace(exhausted=lambda: False),
    )
    done = Search._from_rival(looking)
    assert looked == [[RIVAL]]
    assert (done is not None) == followed
    assert looking.accepted == ([RIVAL] if followed else [HELD])
    held = looking.rounds[0].accepted
    assert held is not None and held.key == (RIVAL if followed else HELD)
