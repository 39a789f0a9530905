"""Friction over one time step: the tangent of a static law, and the exact motion of a bristle at constant speed."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from friction_ocp.friction.bristle import Dahl, LuGre
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.static import Quadratic, Stribeck
from friction_ocp.parameters import Directional

ROUNDING = 1e-12
SOLVER = 1e-8
"""Relative error of the adaptive solver."""


def response_at(
    element: FrictionElement, omega: float, z: float = 0.0, h: float = 1e-3, load: float = 0.0
) -> np.ndarray:
    """Return offset, slope, upper and lower level of the step from speed `omega`."""
    speed = ca.SX.sym("omega")
    response = element.step_response(h, speed, z, load)
    terms = [ca.SX(term) for term in (response.offset, response.slope, response.upper, response.lower)]
    return np.array([float(term) for term in ca.Function("response", [speed], terms)(omega)])


@pytest.mark.parametrize("omega", [0.7, 6.0, -0.7, -6.0])
@pytest.mark.parametrize(
    "law",
    [
        Stribeck(Directional(0.2, 0.25), Directional(0.3, 0.4), 4.0, Directional(0.01, 0.02), 1.3),
        Quadratic(0.2, 0.01, Directional(0.002, 0.003)),
    ],
)
def test_a_static_law_responds_with_its_tangent(law: Stribeck | Quadratic, omega: float) -> None:
    """At the speed itself the response is the law's torque, and its slope is the law's slope."""
    element = FrictionElement(law, LoadDependence(0.1, 0.05, 0.002))
    offset, slope, upper, lower = response_at(element, omega, load=1.5)
    torque = offset + slope * omega + (upper if omega > 0 else -lower)
    assert torque == pytest.approx(float(element.torque(omega, 1.5)), rel=ROUNDING)
    beside = 1e-5
    difference = (element.torque(omega + beside, 1.5) - element.torque(omega - beside, 1.5)) / (2 * beside)
    curvature = 1e-8
    assert slope == pytest.approx(float(difference), rel=curvature, abs=curvature)


BRISTLES = {
    "lugre": LuGre(0.2, Directional(0.3, 0.35), 4.0, Directional(500.0, 400.0), 0.5, Directional(0.01, 0.02)),
    "dahl": Dahl(Directional(0.2, 0.3), 500.0, 0.01),
}


@pytest.mark.parametrize("h", [1e-5, 1e-3, 1.0])
@pytest.mark.parametrize("omega", [3.0, -3.0, 0.02])
@pytest.mark.parametrize("name", BRISTLES)
def test_a_bristle_moves_exactly_at_constant_speed(name: str, omega: float, h: float) -> None:
    """Deflection after the step and mean torque over it agree with the differential equation, however stiff."""
    element, z0, load = FrictionElement(BRISTLES[name], LoadDependence(0.1, 0.0, 0.002)), 1e-5, 1.5

    def rates(_: float, x: np.ndarray) -> list[float]:
        torque, rate = element.bristle_torque(omega, x[0], load)
        return [float(rate), float(torque)]

    exact = solve_ivp(rates, (0.0, h), [z0, 0.0], "LSODA", rtol=1e-11, atol=1e-15).y[:, -1]
    same_side = exact[0] > 0
    offset, slope, upper, lower = response_at(element, omega, z0, h, load)
    if same_side or name == "dahl":
        assert float(element.advance(h, omega, omega, z0, load)) == pytest.approx(exact[0], rel=SOLVER)
        assert offset + slope * omega == pytest.approx(exact[1] / h, rel=1e-6)
    assert upper == 0.0 and lower == 0.0


@pytest.mark.parametrize("name", BRISTLES)
def test_a_bristle_does_not_ring(name: str) -> None:
    """From any deflection a long step leads to the steady one and stays there, without alternating."""
    element, omega = FrictionElement(BRISTLES[name]), 100.0
    z, steady = 1e-3, float(element.torque(omega) - element._viscous(omega, 0.0) * omega) / 500.0
    for _ in range(3):
        z = float(element.advance(1e-2, omega, omega, z, 0.0))
        assert z == pytest.approx(steady, rel=1e-6)


@pytest.mark.parametrize("omega", [0.5, 3.0, 50.0, -3.0])
@pytest.mark.parametrize("name", BRISTLES)
def test_a_steady_bristle_gives_the_steady_torque(name: str, omega: float) -> None:
    """At its steady deflection the bristle rests and its torque is the law's magnitude in that direction."""
    element = FrictionElement(BRISTLES[name])
    law = element.law.along("positive" if omega > 0 else "negative")
    z = np.sign(omega) * law.level(abs(omega)) / law.sigma0
    torque, rate = element.bristle_torque(omega, z)
    assert float(rate) == pytest.approx(0.0, abs=ROUNDING * abs(omega))
    assert float(torque) == pytest.approx(float(element.torque(omega)), rel=ROUNDING)


def test_presliding_is_a_spring() -> None:
    """Far below breakaway a bristle torque is sigma0 times the travel."""
    element = FrictionElement(Dahl(0.2, 500.0))
    z = float(element.advance(1.0, 1e-9, 1e-9, 0.0, 0.0))
    assert float(element.bristle_torque(0.0, z)[0]) == pytest.approx(500.0 * 1e-9, rel=1e-5)
