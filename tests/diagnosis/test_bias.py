"""Intervals of what stood in for a missing effect, whatever units parameters come in."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from friction_ocp.diagnosis.bias import standard_errors
from friction_ocp.diagnosis.fitted_model import FittedModel

ROWS, BLOCKS = 400, 20


class _Blocks:
    """Neighbouring rows, a block each."""

    def sums(self, values: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
        return values.reshape(BLOCKS, -1, values.shape[1]).sum(axis=1)


def fitted(units: list[float]) -> FittedModel:
    """Return what a fit of a straight line with white errors leaves, its parameters in some units."""
    rng = np.random.default_rng(3)
    slope = np.column_stack([np.ones(ROWS), np.linspace(-1.0, 1.0, ROWS)])
    errors = rng.standard_normal(ROWS)
    errors -= slope @ np.linalg.lstsq(slope, errors, rcond=None)[0]
    rows = SimpleNamespace(jacobian=slope * np.array(units), residual=errors)
    return cast(FittedModel, SimpleNamespace(linear=SimpleNamespace(rows=rows), blocks=_Blocks()))


def test_errors_of_a_stiff_spring_beside_a_light_rotor_do_not_hang_on_their_units() -> None:
    """A stiffness of 1e8 N m/rad beside an inertia of 1e-6 kg m^2: ten orders each way from units of one."""
    expected = standard_errors(fitted([1.0, 1.0]))
    assert expected == pytest.approx([ROWS**-0.5, (3.0 / ROWS) ** 0.5], rel=0.5)
    assert standard_errors(fitted([1e6, 1e-8])) * [1e6, 1e-8] == pytest.approx(expected, rel=1e-6)


def test_what_the_recordings_do_not_tell_is_not_called_known() -> None:
    """Two parameters of which only the sum shows."""
    fit = fitted([1.0, 1.0])
    rows = fit.linear.rows
    rows.jacobian = np.repeat(rows.jacobian[:, :1], 2, axis=1)
    assert np.all(standard_errors(fit) > 1e3)
