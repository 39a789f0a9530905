"""Fits that begin again from where another model sticks and slides."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_ocp.diagnosis import refit
from friction_ocp.diagnosis.refit import begun_beside


def fitted(objective: float, joined: bool = True, states: int = 2) -> Any:
    point = SimpleNamespace(nodes=(np.zeros((3, states)),))
    foot = SimpleNamespace(joined=joined)
    return SimpleNamespace(
        model=None, theta=None, footing=foot, objective=objective, linear=SimpleNamespace(point=point)
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
