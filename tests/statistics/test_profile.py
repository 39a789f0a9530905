"""Profiles: parabolas where the model is nearly linear, open sides where nothing is excluded, and honest scales."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import HERE, CoulombViscous, Free, coloured_problem, right_problem, with_law

from friction_ocp.errors import FrictionOcpError
from friction_ocp.statistics.profile import Profiles, profile

PARABOLIC = 0.05
"""Relative: intervals of a model that is nearly linear within them."""


@pytest.fixture(scope="module")
def right() -> Profiles:
    """The profiles of a right model."""
    return profile(right_problem(), execution=HERE)


def test_a_right_model_has_the_intervals_of_its_hessian(right: Profiles) -> None:
    """Its threshold is that of chi2, its scale one, and a profile meets the threshold where the parabola does."""
    assert right.threshold == pytest.approx(3.8414588)
    assert right.warnings == ()
    for item in right.items:
        assert (item.verdict, item.ends, item.scale) == ("finite", ("threshold", "threshold"), 1.0)
        low, high = item.interval
        assert low is not None and high is not None
        assert low < item.parameter.value < high
        wald = item.parameter.interval95
        assert high - low == pytest.approx(wald[1] - wald[0], rel=PARABOLIC)


def test_a_profile_rises_from_the_estimate(right: Profiles) -> None:
    """Values rise, the ratio is least and zero at the estimate, and each point holds its own value."""
    for k, item in enumerate(right.items):
        assert np.all(np.diff(item.values) > 0)
        assert item.ratios.min() == pytest.approx(0.0, abs=1e-2)
        assert item.values[item.ratios.argmin()] == pytest.approx(item.parameter.value, rel=1e-3)
        assert item.thetas[:, k] == pytest.approx(item.values)
        assert all(item.converged)


def test_misfit_scales_the_likelihood_as_it_does_the_standard_error() -> None:
    """Residuals that wander inflate the ratio; divided by its scale, the interval is that of the sandwich."""
    found = profile(coloured_problem(), execution=HERE)
    assert found.estimate.uncertainty.kind == "sandwich"
    assert found.threshold > 3.8414588
    for item in found.items:
        assert item.verdict == "finite"
        low, high = item.interval
        wald = item.parameter.interval95
        assert high - low == pytest.approx(wald[1] - wald[0], rel=3 * PARABOLIC)
        # as if residuals were white, the interval would be narrower or wider by the root of the scale
        assert abs(np.log(item.scale)) > 0.2


@pytest.mark.slow
def test_a_parameter_at_its_bound_is_one_sided() -> None:
    """Viscous friction that may not be as small as it is lies on its bound and is excluded above only.

    The misfit lasts as long as a run: one run alone tells little of how far it moves the parameter.
    """
    law = CoulombViscous(Free(0.07, 0.0, 2.0), Free(3e-3, 2e-3, 0.03))
    (item,) = profile(with_law(law, *range(1, 9)), ["motor.friction.viscous"], HERE).items
    assert item.parameter.verdict.word == "at_bound"
    assert (item.verdict, item.ends) == ("one_sided", ("bound", "threshold"))
    assert item.interval[0] is None
    assert item.interval[1] == pytest.approx(2e-3, rel=0.05)


def test_a_parameter_that_nothing_depends_on_is_flat() -> None:
    """A law's parts that act alike in this run: the offset of the angle takes whatever the start takes."""
    base = right_problem()
    current, position = base.drive.channels
    drive = replace(base.drive, channels=(current, replace(position, offset=Free(0.0, -5.0, 5.0))))
    (item,) = profile(replace(base, drive=drive), ["position.offset"], HERE).items
    assert item.verdict == "flat"
    assert item.interval == (None, None)
    assert item.ratios.max() < 1.0


def test_a_name_that_is_not_fitted_is_refused() -> None:
    """The names that are fitted are listed."""
    with pytest.raises(FrictionOcpError, match=r"'motor\.mass' is not fitted; fitted are motor\.inertia"):
        profile(right_problem(), ["motor.mass"], HERE)
