"""Fingerprints tell contents apart, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.execution.content import fingerprint, toolkit_fingerprint


@dataclass(frozen=True)
class Part:
    """A value with parts."""

    name: str
    values: np.ndarray
    inner: Any = None


PART = Part("a", np.array([1.0, np.nan]), {"x": (1, 2.5), "y": None})


def test_equal_content_has_equal_fingerprints() -> None:
    """Copies, other orders of a mapping, and numpy's numbers make no difference."""
    copy = replace(PART, values=PART.values.copy(), inner={"y": None, "x": (1, 2.5)})
    assert fingerprint(copy) == fingerprint(PART)
    assert fingerprint(np.float64(0.1), np.int64(3)) == fingerprint(0.1, 3)


@pytest.mark.parametrize(
    "other",
    [
        replace(PART, name="b"),
        replace(PART, values=np.array([1.0, 2.0])),
        replace(PART, values=PART.values.astype(np.float32)),
        replace(PART, values=PART.values[:, None]),
        replace(PART, inner={"x": (1, 2.5)}),
        replace(PART, inner={"x": (1, 2.5000000000000004), "y": None}),
        replace(PART, inner={"x": (1, 2.5), "y": False}),
    ],
)
def test_any_change_shows(other: Part) -> None:
    """The last digit, a type, a shape, a missing key."""
    assert fingerprint(other) != fingerprint(PART)


@given(st.lists(st.lists(st.text(max_size=3), max_size=3), min_size=2, max_size=2))
def test_nesting_shows(pair: list[list[str]]) -> None:
    """Lists have the same fingerprint only if they are equal, wherever the commas are."""
    first, second = pair
    assert (fingerprint(first) == fingerprint(second)) == (first == second)


def test_what_it_cannot_read_is_refused() -> None:
    """An object without fields has no content that could be compared."""
    with pytest.raises(TypeError, match="object"):
        fingerprint(object())


def test_the_toolkit_has_one_too() -> None:
    """It is the same whenever it is asked for, and no empty one."""
    assert toolkit_fingerprint() == toolkit_fingerprint() != fingerprint([])
