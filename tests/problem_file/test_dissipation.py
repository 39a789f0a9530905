"""Friction that can give energy back is a warning that states the inequality and the speeds for which it holds."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from problem_workshop import Workshop

from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.element import FrictionElement
from friction_ocp.problem_file.load import load_problem
from friction_ocp.problem_file.rules.dissipation import SPEEDS

ARIES: dict[str, Any] = {
    "law": "lugre",
    "tau_c": {"positive": 200.5827, "negative": 223.9246},
    "tau_s": {"positive": 1541.7090, "negative": 1289.8430},
    "omega_s": {"positive": 0.00069, "negative": 0.00084},
    "sigma0": {"positive": 188.48e6, "negative": 158.0188e6},
    "sigma1": {"positive": 420.6185e3, "negative": 385.1324e3},
    "sigma2": {"positive": 118.5822e2, "negative": 123.6802e2},
    "delta": 0.85,
}
"""Kumar & Banavar 2011, Tables 1 and 2; delta as found there."""
LEIGHTON_QUADRATIC = {"law": "quadratic", "tau_c": 0.1007, "viscous": 0.0047, "quadratic": -1.147e-5}
"""Leighton telescope paper, eq. 14."""


def warnings(workshop: Workshop, friction: dict[str, Any]) -> list[str]:
    """Return what is said about a friction law; that the problem loads shows that nothing of it is an error."""

    def spoil(content: dict[str, Any]) -> None:
        content["drive"]["shafts"][0]["friction"] = friction

    path = workshop.problem(spoil)
    load_problem(path)
    found = [message for message in workshop.messages(path) if "shafts[0].friction" in message]
    return [message for message in found if "torque >= 0" in message or "passive" in message or "share" in message]


def limit_in(message: str) -> float:
    """Return the speed up to which the inequality holds."""
    found = re.search(r"for \|omega\| <= ([0-9.e+-]+) rad/s", message)
    assert found is not None, message
    return float(found[1])


def test_the_numbers_of_the_schmidt_telescope_load_with_their_range(workshop: Workshop) -> None:
    """Both directions violate the passivity condition, one warning each; the ratio is that of its Table 1."""
    found = warnings(workshop, ARIES)
    assert len(found) == 2
    assert all("sigma2 > sigma1 (tau_s - tau_c)/tau_c" in message for message in found)
    stated = re.search(r"sigma2 = ([0-9.e+]+) is not above .* = ([0-9.e+]+);", found[0])
    assert stated is not None
    assert float(stated[2]) / float(stated[1]) == pytest.approx(237, abs=1)


@pytest.mark.parametrize("direction", ["positive", "negative"])
def test_the_range_of_passivity_is_where_no_deflection_gives_energy_back(workshop: Workshop, direction: str) -> None:
    """Up to the stated speed every deflection that can occur dissipates; just above it one does not."""
    numbers = {key: value[direction] if isinstance(value, dict) else value for key, value in ARIES.items()}
    limit = limit_in(warnings(workshop, numbers)[0])
    law = LuGre(**{key: value for key, value in numbers.items() if key != "law"})
    deflection = np.linspace(-1.0, 1.0, 20001) * law.tau_s / law.sigma0

    def least(speed: float) -> float:
        torque, rate = FrictionElement(law).bristle_torque(speed, deflection)
        return float(np.min(torque * speed - law.sigma0 * deflection * rate))

    assert min(least(speed) for speed in np.geomspace(1e-7, 0.99 * limit, 50)) >= 0.0
    assert least(1.01 * limit) < 0.0


def test_a_passive_lugre_law_is_not_mentioned(workshop: Workshop) -> None:
    """Above the limit there is no warning."""
    passive = {"law": "lugre", "tau_c": 1, "tau_s": 1.5, "omega_s": 0.1, "sigma0": 100, "sigma1": 1, "sigma2": 0.6}
    assert warnings(workshop, passive) == []


def test_the_quadratic_of_the_leighton_telescope_has_a_range(workshop: Workshop) -> None:
    """Its torque turns negative at the root of eq. 14, 430 rad/s, and the warning says so."""
    (found,) = warnings(workshop, LEIGHTON_QUADRATIC)
    root = (0.0047 + np.sqrt(0.0047**2 + 4.0 * 0.1007 * 1.147e-5)) / (2.0 * 1.147e-5)
    assert limit_in(found) == pytest.approx(root, rel=1e-3)
    assert root == pytest.approx(430, abs=1)


@pytest.mark.parametrize(
    ("slopes", "falls"), [((0.0039, 0.0001), False), ((-0.0008, -0.001), True), ((0.0039, -0.0009), True)]
)
def test_a_polyline_may_fall_as_far_as_it_stays_positive(
    workshop: Workshop, slopes: tuple[float, float], falls: bool
) -> None:
    """Falling segments (c1h < 0 of eqs. 10, 11) are allowed; where they end below zero stands beside them."""
    polyline = {"tau_c": 0.11, "slopes": list(slopes), "breaks": [104.25]}
    for friction in ({"law": "polyline", **polyline}, {"law": "polyline_hysteresis", "polyline": polyline, "width": 1}):
        found = warnings(workshop, friction)
        assert len(found) == falls
        if falls:
            assert limit_in(found[0]) == pytest.approx(zero_of(slopes), rel=1e-3)


def zero_of(slopes: tuple[float, float]) -> float:
    """Return where 0.11 N m and two segments that meet at 104.25 rad/s reach zero."""
    knee = 0.11 + slopes[0] * 104.25
    return -0.11 / slopes[0] if knee < 0 else 104.25 - knee / slopes[1]


def test_friction_that_pushes_from_standstill_has_no_range(workshop: Workshop) -> None:
    """Where the inequality fails at once, no speed is left."""
    (found,) = warnings(workshop, {"law": "viscous", "viscous": -0.1})
    assert "at no speed" in found or limit_in(found) < 2.0 * SPEEDS[1]


@pytest.mark.parametrize(("shares", "expected"), [((0.3, 0.7), 0), ((0.3, 0.6), 1)])
def test_shares_of_maxwell_elements_sum_to_one(workshop: Workshop, shares: tuple[float, ...], expected: int) -> None:
    """Shares that leave a part of the level out are doubtful."""
    elements = [{"stiffness": 100, "share": share} for share in shares]
    friction = {"law": "gms", "elements": elements, "tau_c": 1, "tau_s": 1.5, "omega_s": 0.1}
    assert len(warnings(workshop, friction)) == expected


def test_a_negative_share_is_refused(workshop: Workshop) -> None:
    """An element cannot push."""
    elements = [{"stiffness": 100, "share": 1.2}, {"stiffness": 100, "share": -0.2}]
    friction = {"law": "gms", "elements": elements, "tau_c": 1, "tau_s": 1.5, "omega_s": 0.1}
    path = workshop.problem(lambda content: content["drive"]["shafts"][0].update(friction=friction))
    assert any("shares are not negative" in message for message in workshop.messages(path))


def test_a_loop_and_a_line_through_zero_exclude_each_other(workshop: Workshop) -> None:
    """The hysteresis replaces the line through zero."""
    polyline = {"tau_c": 0.1, "slopes": [0.01], "omega_zero": 0.1}
    friction = {"law": "polyline_hysteresis", "polyline": polyline, "width": 1e-3}
    path = workshop.problem(lambda content: content["drive"]["shafts"][0].update(friction=friction))
    assert any("exclude each other" in message for message in workshop.messages(path))


def test_a_fitted_lugre_law_is_doubted_at_its_guesses(workshop: Workshop) -> None:
    """A warning about numbers that the fit may change says so."""
    numbers = {"law": "lugre", "tau_c": 1, "tau_s": 1.5, "omega_s": 0.1, "sigma0": 100, "sigma1": 1, "sigma2": 0.4}
    (known,) = warnings(workshop, numbers)
    (fitted,) = warnings(workshop, {**numbers, "sigma1": {"guess": 1, "min": 0, "max": 10}})
    assert "at the guesses" not in known
    assert "= 0.5 at the guesses" in fitted
