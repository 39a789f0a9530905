"""Springs that slip, and the loops of torque over travel that they and the bristles make."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.gms import GeneralizedMaxwellSlip, MaxwellElement
from friction_ocp.friction.maxwell import Play, Spring
from friction_ocp.friction.polyline_hysteresis import PolylineHysteresis
from friction_ocp.friction.presliding import presliding_loop
from friction_ocp.friction.static import Coulomb, Polyline
from friction_ocp.parameters import Directional

ROUNDING = 1e-12
ELEMENTS = (MaxwellElement(400.0, 0.3), MaxwellElement(100.0, 0.5), MaxwellElement(20.0, 0.2))
GMS = GeneralizedMaxwellSlip(ELEMENTS, 0.2, 0.2, 1.0, 0.0)
LOOP = PolylineHysteresis(Polyline(Directional(0.2, 0.3), (0.02, 0.01), (5.0,)), 2e-3)
positive = st.floats(1e-3, 10.0)
signed = st.floats(-10.0, 10.0)


def numbers(torque: object) -> float:
    return float(ca.DM(ca.SX(torque)))


@given(positive, positive, positive, positive, signed, signed)
def test_a_spring_that_slips_has_the_mean_torque_of_its_motion(
    first: float, second: float, forward: float, backward: float, deflection: float, travel: float
) -> None:
    """Mean torque and deflection after a travel are those of many small parts of it."""
    play = Play(Spring(first, forward), Spring(second, backward))
    parts = 2000
    z = min(max(deflection, -backward), forward)
    path = np.clip(z + travel * (np.arange(parts) + 0.5) / parts, -backward, forward)
    mean = np.mean(np.where(path >= 0, first, second) * path)
    resolution = (first + second) * abs(travel) / parts
    assert numbers(play.mean_torque(ca.SX(deflection), ca.SX(travel))) == pytest.approx(mean, abs=resolution + 1e-12)
    after = min(max(z + travel, -backward), forward)
    assert numbers(play.after(ca.SX(deflection), ca.SX(travel))) == pytest.approx(after, abs=ROUNDING * 20)


@given(positive, positive, signed)
def test_its_slope_is_finite_and_not_negative(stiffness: float, reach: float, deflection: float) -> None:
    """The mean torque never falls with the travel, and is differentiable at rest and where slip begins."""
    play, travel = Play(Spring(stiffness, reach), Spring(stiffness, reach)), ca.SX.sym("travel")
    torque = play.mean_torque(ca.SX(deflection), travel)
    slope = ca.Function("slope", [travel], [ca.jacobian(torque, travel)])
    held = min(max(deflection, -reach), reach)
    values = np.asarray(slope(np.array([[0.0, reach - held, -reach - held, 1e-9, -1e-9, 30.0, -30.0]])))
    assert np.all(np.isfinite(values)) and np.all(values >= -ROUNDING * stiffness)


def test_a_maxwell_law_holds_its_springs_to_masings_rule() -> None:
    """After a turn the loop is the first loading, twice as large both ways."""
    loop = presliding_loop(FrictionElement(GMS), 2e-3, 1e-4)
    back = loop.travel[0] - loop.travel[:400]
    stiffness, shares = np.array([400.0, 100.0, 20.0]), np.array([0.3, 0.5, 0.2])
    first_loading = np.minimum(stiffness[:, None] * 0.5 * back, 0.2 * shares[:, None]).sum(axis=0)
    mean_of_a_step = 1e-5 * 520.0
    assert loop.torque[:400] == pytest.approx(loop.torque[0] - 2.0 * first_loading, abs=mean_of_a_step)


def test_the_area_of_a_loop_is_the_energy_of_slip() -> None:
    """A spring that slips takes four times its level times the travel beyond its reach out of a cycle."""
    loop = presliding_loop(FrictionElement(GMS), 2e-3, 1e-4)
    beyond = np.maximum(2e-3 - 0.2 * np.array([0.3, 0.5, 0.2]) / np.array([400.0, 100.0, 20.0]), 0.0)
    assert loop.area == pytest.approx(float(np.sum(4.0 * 0.2 * np.array([0.3, 0.5, 0.2]) * beyond)), rel=1e-2)


def test_a_polyline_reverses_over_its_width() -> None:
    """Between one direction and the other the dry part turns over the travel `width`, at the levels of both."""
    loop = presliding_loop(FrictionElement(LOOP), 4e-3, 1e-6)
    falling = (loop.torque[:400] < 0.2 - 1e-6) & (loop.torque[:400] > -0.3 + 1e-6)
    assert np.ptp(loop.travel[:400][falling]) == pytest.approx(2e-3, abs=2 * 8e-3 / 400)
    assert [loop.torque.min(), loop.torque.max()] == pytest.approx([-0.3, 0.2], rel=1e-6)


def test_a_law_without_springs_has_a_rectangle() -> None:
    """Coulomb friction alone turns at once."""
    loop = presliding_loop(FrictionElement(Coulomb(0.2)), 1e-3, 1e-4)
    assert loop.area == pytest.approx(4.0 * 0.2 * 1e-3, rel=1e-2)


@pytest.mark.parametrize("omega", [3.0, -3.0, 0.02])
@pytest.mark.parametrize("law", [GMS, LOOP])
def test_springs_settle_at_the_steady_torque(law: GeneralizedMaxwellSlip | PolylineHysteresis, omega: float) -> None:
    """After any travel beyond its reach a law has its steady torque, loaded or not, and rests there."""
    element = FrictionElement(law, LoadDependence(0.1, 0.0, 0.002))
    z = element.advance(1.0, ca.SX(omega), ca.SX(omega), ca.SX.zeros(law.bristle_count), 1.5)
    torque, rate = element.bristle_torque(ca.SX(omega), ca.SX(z), 1.5)
    assert numbers(torque) == pytest.approx(float(element.torque(omega, 1.5)), rel=ROUNDING)
    assert np.asarray(ca.DM(rate)).ravel() == pytest.approx(np.zeros(law.bristle_count), abs=1e-9)
