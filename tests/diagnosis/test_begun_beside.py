"""Fits that begin again from where another model sticks and slides."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_ocp.diagnosis import refit
from friction_ocp.diagnosis.refit import begun_beside, with_nodes_of


def fitted(objective: float, joined: bool = True, states: int = 2, behind: tuple[str, ...] = ()) -> Any:
    point = SimpleNamespace(nodes=(np.zeros((3, states)),))
    foot = SimpleNamespace(joined=joined)
    drive = SimpleNamespace(
        state_names=("motor.theta", "motor.lagged"), mechanism=SimpleNamespace(following_names=behind)
    )
    return SimpleNamespace(
        model=SimpleNamespace(drive=drive),
        theta=None,
        footing=foot,
        objective=objective,
        linear=SimpleNamespace(point=point),
    )


@pytest.mark.parametrize(
    ("end", "joined", "states", "taken"),
    [(90.0, True, 2, True), (100.0, True, 2, False), (90.0, False, 2, False), (90.0, True, 3, False)],
)
def test_the_better_end_counts(
    end: float, joined: bool, states: int, taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of segments that are joined, whose states are of the same kind."""
    known, again = fitted(100.0, joined), fitted(end)
    monkeypatch.setattr(refit, "polished", lambda *_: again)
    found = begun_beside(known, [np.ones((3, states))])
    assert found is (again if taken else known)


@pytest.mark.parametrize(("behind", "wanted"), [((), [1.0, 1.0]), (("motor.lagged",), [1.0, 0.0])])
def test_what_a_motor_makes_of_its_command_stays_its_own(behind: tuple[str, ...], wanted: list[float]) -> None:
    """Behind one with an offset a current that lags is off by that; nothing of the other model is changed."""
    others = [np.ones((3, 2))]
    found = with_nodes_of(fitted(100.0, behind=behind), others)
    assert found is not None
    np.testing.assert_array_equal(found[0], np.tile(wanted, (3, 1)))
    assert np.all(others[0] == 1.0)
