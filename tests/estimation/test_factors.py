"""Roots of inverse covariances, of regular ones and of those that rounding has left without a factor."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.estimation.factors import inverse_roots

REGULAR = np.array([[4.0, 1.0], [1.0, 9.0]])


def _grown(rate: float, span: float) -> np.ndarray:
    """Return the covariance that white noise leaves in angle and speed of a motion that grows by exp(rate t)."""
    time = np.linspace(0.0, span, 2001)
    reach = np.stack([np.sinh(rate * time) / rate, np.cosh(rate * time)])
    return reach @ reach.T * (time[1] - time[0])


def test_regular_covariances_are_whitened():
    (root,) = inverse_roots(REGULAR[None])
    assert root @ REGULAR @ root.T == pytest.approx(np.eye(2))


def test_a_motion_that_has_grown_beyond_rounding_is_held_and_the_others_stay_as_they_are():
    grown = _grown(800.0, 0.05)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(grown)
    regular, held = inverse_roots(np.stack([REGULAR, grown]))
    assert regular @ REGULAR @ regular.T == pytest.approx(np.eye(2))
    along = np.sqrt(np.diag(grown))
    assert np.linalg.norm(held @ along) == pytest.approx(1.0, rel=1e-3)
    across = along * np.array([1.0, -1.0])
    assert 1e4 < np.linalg.norm(held @ across) < np.inf


def test_missing_numbers_stay_missing():
    regular, missing = inverse_roots(np.stack([REGULAR, np.full((2, 2), np.nan)]))
    assert np.all(np.isfinite(regular))
    assert np.all(np.isnan(missing))
