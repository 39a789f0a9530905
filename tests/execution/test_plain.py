"""What a file holds of a value gives the value back, to the last bit."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.execution.plain import plain, restored


@dataclass(frozen=True)
class Thing:
    """Something with parts."""

    name: str
    parts: tuple[Any, ...]


leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
values = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner)
        | st.lists(inner).map(tuple)
        | st.dictionaries(st.text() | st.integers(), inner)
        | st.builds(Thing, st.text(), st.lists(inner).map(tuple))
    ),
    max_leaves=20,
)


@given(values)
def test_every_value_comes_back_through_a_file(value: Any) -> None:
    """Numbers, infinities, text, lists, tuples, mappings and dataclasses."""
    again = restored(json.loads(json.dumps(plain(value), allow_nan=False)), [Thing])
    assert repr(again) == repr(value)


@pytest.mark.parametrize(
    "array",
    [np.array([[0.1, math.inf], [math.nan, -0.0]]), np.arange(6).reshape(2, 3), np.zeros((0, 2)), np.array([True])],
)
def test_arrays_keep_shape_type_and_bits(array: np.ndarray) -> None:
    """Also empty ones and ones that are not finite."""
    again = restored(json.loads(json.dumps(plain(array), allow_nan=False)))
    assert again.dtype == array.dtype and again.shape == array.shape and again.tobytes() == array.tobytes()


def test_what_could_not_come_back_is_refused() -> None:
    """No class that is not named, nothing that is not data."""
    with pytest.raises(TypeError, match="no plain form of"):
        plain(object())
    with pytest.raises(StopIteration):
        restored(plain(Thing("a", ())), [])
