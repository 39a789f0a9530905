"""What stands of several additions where more than noise is left beside them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from friction_ocp.diagnosis import reexamine
from friction_ocp.diagnosis.bench import Bench
from friction_ocp.diagnosis.reexamine import without_small
from friction_ocp.effects.effect import Key

SAMPLES = 1000
NOISE = 0.5 * SAMPLES
STAND_IN, OTHER, SMALL = ("asymmetry", "motor"), ("sensor_offset", "position"), ("position_ripple", "motor")
LARGE, LAST, HALF = ("stribeck", "motor"), ("cogging", "motor"), ("warm_up", "motor")
COSTS: dict[tuple[Key, ...], float] = {
    (): 10_000.0,
    (STAND_IN,): 6000.0,
    (OTHER,): 8000.0,
    (SMALL,): 9900.0,
    (STAND_IN, OTHER): 1500.0,
    (STAND_IN, SMALL): 5500.0,
    (OTHER, SMALL): 7000.0,
    (STAND_IN, OTHER, SMALL): 1000.0,
    (LARGE,): 900.0,
    (LAST,): 9500.0,
    (HALF,): 9500.0,
    (LARGE, LAST): 60.0,
    (LARGE, HALF): 450.0,
}
"""What is left beside additions, noise included."""


def fitted(keys: tuple[Key, ...]) -> Any:
    rows = SimpleNamespace(channel=np.zeros(SAMPLES), residual=np.ones(SAMPLES))
    return SimpleNamespace(cost=NOISE + COSTS[keys], holds=True, keys=keys, linear=SimpleNamespace(rows=rows))


def kept(monkeypatch: pytest.MonkeyPatch, *keys: Key) -> list[Key]:
    """Return what stands of additions; a drive is what was added to it."""

    def with_additions(base: Any, some: list[Key], forms: Any) -> tuple[Key, ...]:
        return tuple(some)

    def without_addition(current: Any, drive: tuple[Key, ...]) -> Any:
        return fitted(drive)

    monkeypatch.setattr(reexamine, "with_additions", with_additions)
    monkeypatch.setattr(reexamine, "without_addition", without_addition)
    bench = cast(Bench, SimpleNamespace(base=fitted(()), current=fitted(keys)))
    current, accepted = without_small(bench, [], list(keys))
    assert cast(Any, current).keys == tuple(accepted)
    return accepted


def test_beside_something_unknown_a_small_part_of_the_gap_is_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """A third of what was left then, a twentieth of all: what the shape of stand-ins leaves."""
    assert kept(monkeypatch, STAND_IN, OTHER, SMALL) == [STAND_IN, OTHER]


def test_what_takes_a_large_part_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of the two takes more than a tenth of all beside the other."""
    assert kept(monkeypatch, STAND_IN, OTHER) == [STAND_IN, OTHER]


def test_what_takes_almost_all_that_a_large_one_leaves_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Be it less than a tenth of the whole gap, and a little more than noise left beside both."""
    assert kept(monkeypatch, LARGE, LAST) == [LARGE, LAST]
    assert kept(monkeypatch, LARGE, HALF) == [LARGE]


def test_what_is_alone_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """A single addition is judged by what it does to the whole gap, elsewhere."""
    assert kept(monkeypatch, SMALL) == [SMALL]
