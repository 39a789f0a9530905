"""Laws put together: each gives back the law it was made from, and carries its terms where it should."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.composite import (
    Bend,
    Bristle,
    Bristled,
    StribeckRise,
    added_terms,
    plain_law,
    with_added,
    with_bristle,
)
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.static import CoulombViscous, Polyline, Quadratic, Stribeck
from friction_ocp.parameters import Directional

SPEED = np.linspace(0.0, 9.0, 50)
BASE = CoulombViscous(1.0, 0.2)


@pytest.mark.parametrize(
    ("terms", "whole"),
    [
        ({"stribeck": StribeckRise(0.5, 2.0, 1.3)}, Stribeck(1.0, 1.5, 2.0, 0.2, 1.3)),
        ({"quadratic": 0.03}, Quadratic(1.0, 0.2, 0.03)),
        ({"bend": Bend(-0.15, 4.0)}, Polyline(1.0, (0.2, 0.05), (4.0,))),
        ({"coulomb": 0.1, "viscous": 0.3}, CoulombViscous(1.1, 0.5)),
    ],
    ids=["stribeck", "quadratic", "bend", "plain"],
)
def test_added_terms_make_the_laws_that_have_them(terms: dict[str, object], whole: AbstractFrictionLaw) -> None:
    """Coulomb and viscous friction with a further term is the law of the catalogue that has that term."""
    assert np.allclose(with_added(BASE, **terms).magnitude(SPEED), whole.magnitude(SPEED), rtol=0, atol=1e-14)


def test_what_warms_up_leaves_the_damping_of_bristles_alone() -> None:
    """Levels, stiffness and drag follow their factors, as those of LuGre friction do."""
    lugre = LuGre(1.0, 1.0, 2.0, 50.0, 0.7, 0.2).scaled(2.0, 3.0)
    scaled = with_bristle(BASE, Bristle(50.0, 0.7)).scaled(2.0, 3.0)
    assert isinstance(scaled, Bristled)
    assert (scaled.bristle.sigma0, scaled.bristle.sigma1) == (lugre.sigma0, lugre.sigma1) == (50.0, 0.7)
    assert scaled.magnitude(SPEED) == pytest.approx(lugre.magnitude(SPEED))


def test_terms_come_together_and_come_apart() -> None:
    """Terms added one after another stand side by side, also under a bristle, and the plain law is still there."""
    law = with_added(with_bristle(with_added(BASE, quadratic=0.03), Bristle(50.0)), coulomb=0.1)
    assert plain_law(law) is BASE
    terms = added_terms(law)
    assert terms is not None and (terms.quadratic, terms.coulomb) == (0.03, 0.1)
    assert np.allclose(law.magnitude(SPEED), 1.1 + (0.2 + 0.03 * SPEED) * SPEED, rtol=1e-14)


def test_a_bristle_under_a_static_law_is_lugre() -> None:
    """A Stribeck law under a bristle has level, viscous part and stiffness of the LuGre law of the same numbers."""
    law, lugre = with_bristle(Stribeck(1.0, 1.5, 2.0, 0.2), Bristle(50.0, 0.7)), LuGre(1.0, 1.5, 2.0, 50.0, 0.7, 0.2)
    assert np.allclose(law.level(SPEED), lugre.level(SPEED), rtol=1e-14)
    assert (law.sigma0, law.sigma1, law.sigma2) == (lugre.sigma0, lugre.sigma1, lugre.sigma2)


def test_terms_on_a_bristle_law_are_carried_by_its_bristle() -> None:
    """What is added to LuGre raises the level at which its bristle slips."""
    lugre = LuGre(1.0, 1.5, 2.0, 50.0, 0.7, 0.2)
    law = with_added(lugre, coulomb=Directional(0.3, -0.3)).along("negative")
    assert np.allclose(law.magnitude(SPEED), lugre.magnitude(SPEED) - 0.3, rtol=1e-14)
    assert law.has_bristle


@pytest.mark.parametrize("tail", [0.0, 1e-6, 5e-4, 0.3, 1.0])
def test_a_stribeck_curve_ends_as_its_tail_says(tail: float) -> None:
    """Without a tail like an exponential, with a tail of 1 and an exponent of 2 like the curve of Hess & Soom."""
    speed = np.array([0.0, 0.1, 1.0, 2.0, 7.0])
    fall = (speed / 0.8) ** 1.7
    expected = np.exp(-fall) if tail == 0.0 else (1.0 + tail * fall) ** (-1.0 / tail)
    assert StribeckRise(0.4, 0.8, 1.7, tail).torque_at(speed) == pytest.approx(0.4 * expected, rel=1e-6, abs=1e-12)
    assert StribeckRise(0.4, 0.8, 2.0, 1.0).torque_at(1.6) == pytest.approx(0.4 / 5.0, rel=1e-9)


def test_a_stribeck_curve_without_a_tail_is_an_exponential() -> None:
    """A tail of 0 is no other curve than none, and where it begins the curve depends on it smoothly."""
    tail, speed = ca.SX.sym("tail"), 1.3
    curve = StribeckRise(0.4, 0.8, 1.7, tail).torque_at(speed)
    slope = ca.Function("slope", [tail], [curve, ca.jacobian(curve, tail)])
    value, derivative = (float(item) for item in slope(0.0))
    assert value == pytest.approx(StribeckRise(0.4, 0.8, 1.7).torque_at(speed), rel=1e-12)
    fall = (speed / 0.8) ** 1.7
    assert derivative == pytest.approx(value * 0.5 * fall**2, rel=1e-6)
