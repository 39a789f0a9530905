"""Springs that slip, and the loops of torque over travel that they and the bristles make."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.friction.composite import Bristle, BristleSprings, with_bristle
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.gms import GeneralizedMaxwellSlip, MaxwellElement
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.maxwell import Play, Spring
from friction_ocp.friction.polyline_hysteresis import PolylineHysteresis
from friction_ocp.friction.presliding import presliding_loop
from friction_ocp.friction.static import Coulomb, Polyline
from friction_ocp.parameters import Directional

ROUNDING = 1e-12
ELEMENTS = (MaxwellElement(400.0, 0.3), MaxwellElement(100.0, 0.5), MaxwellElement(20.0, 0.2))
GMS = GeneralizedMaxwellSlip(ELEMENTS, 0.2, 0.2, 1.0, 0.0)
LOOP = PolylineHysteresis(Polyline(Directional(0.2, 0.3), (0.02, 0.01), (5.0,)), 2e-3)
SHARES = np.array([0.3, 0.5, 0.2])
DECADE = 100.0 * np.array([0.1, 1.0, 10.0]) ** 0.5
BESIDE = with_bristle(Coulomb(0.2), Bristle(1e3, 0.0, BristleSprings(0.5, 0.6, 0.4, stiffness=100.0)))
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
    stiffness = np.array([400.0, 100.0, 20.0])
    first_loading = np.minimum(stiffness[:, None] * 0.5 * back, 0.2 * SHARES[:, None]).sum(axis=0)
    mean_of_a_step = 1e-5 * 520.0
    assert loop.torque[:400] == pytest.approx(loop.torque[0] - 2.0 * first_loading, abs=mean_of_a_step)


def test_the_area_of_a_loop_is_the_energy_of_slip() -> None:
    """A spring that slips takes four times its level times the travel beyond its reach out of a cycle."""
    loop = presliding_loop(FrictionElement(GMS), 2e-3, 1e-4)
    beyond = np.maximum(2e-3 - 0.2 * SHARES / np.array([400.0, 100.0, 20.0]), 0.0)
    assert loop.area == pytest.approx(float(np.sum(4.0 * 0.2 * SHARES * beyond)), rel=1e-2)


def test_springs_beside_a_bristle_share_its_level() -> None:
    """Half the level slips as springs half a decade apart, the other half relaxes over the reach of the bristle."""
    loop = presliding_loop(FrictionElement(BESIDE), 2e-2, 1e-4)
    back = loop.travel[0] - loop.travel[:400]
    springs = np.minimum(0.5 * SHARES * DECADE * back[:, None], SHARES * 0.2)
    bristle = 0.2 * (1.0 - np.exp(-back * 1e3 / 0.2))
    assert loop.torque[:400] == pytest.approx(0.2 - springs.sum(axis=1) - bristle, rel=1e-9)


def test_springs_that_carry_all_are_a_maxwell_law() -> None:
    """Beside a bristle that carries nothing they respond to a step as the elements of such a law do."""
    springs = BristleSprings(1.0, 0.6, 0.4, stiffness=100.0)
    beside = FrictionElement(with_bristle(Coulomb(0.2), Bristle(1e3, 0.0, springs)))
    elements = tuple(MaxwellElement(float(share * k), float(share)) for share, k in zip(SHARES, DECADE, strict=True))
    maxwell = FrictionElement(GeneralizedMaxwellSlip(elements, 0.2, 0.2, 1.0, 0.0))
    omega, rng = ca.SX.sym("omega"), np.random.default_rng(0)
    z = rng.uniform(-3e-3, 3e-3, 3)
    responses = [
        item.step_response(1e-3, omega, ca.SX(deflections), 0.0)
        for item, deflections in ((beside, [1e-4, *z]), (maxwell, z))
    ]
    told = ca.Function("told", [omega], [ca.vertcat(*(part for it in responses for part in (it.offset, it.slope)))])
    for speed in rng.uniform(-5.0, 5.0, 20):
        offset, slope, offset_maxwell, slope_maxwell = np.asarray(told(speed)).ravel()
        assert offset + slope * speed == pytest.approx(offset_maxwell + slope_maxwell * speed, rel=1e-9)
        assert slope == pytest.approx(slope_maxwell, rel=1e-9, abs=1e-9)
        now = ca.SX(speed)
        after = [item.advance(1e-3, now, now, ca.SX(at), 0.0) for item, at in ((beside, [0.0, *z]), (maxwell, z))]
        assert np.asarray(ca.DM(after[0]))[1:] == pytest.approx(np.asarray(ca.DM(after[1])), rel=1e-9)


def test_a_bristle_without_anything_in_its_springs_is_alone() -> None:
    """Springs that carry nothing change nothing."""
    idle = with_bristle(Coulomb(0.2), Bristle(1e3, 0.3, BristleSprings(0.0, 0.6, 0.4, stiffness=100.0)))
    alone = with_bristle(Coulomb(0.2), Bristle(1e3, 0.3))
    loops = [presliding_loop(FrictionElement(law), 1e-3, 1e-4) for law in (idle, alone)]
    assert loops[0].torque == pytest.approx(loops[1].torque, rel=ROUNDING)


def test_a_polyline_reverses_over_its_width() -> None:
    """Between one direction and the other the dry part turns over the travel `width`, at the levels of both."""
    loop = presliding_loop(FrictionElement(LOOP), 4e-3, 1e-6)
    falling = (loop.torque[:400] < 0.2 - 1e-6) & (loop.torque[:400] > -0.3 + 1e-6)
    assert np.ptp(loop.travel[:400][falling]) == pytest.approx(2e-3, abs=2 * 8e-3 / 400)
    assert [loop.torque.min(), loop.torque.max()] == pytest.approx([-0.3, 0.2], rel=1e-6)


def test_a_law_without_springs_has_a_rectangle() -> None:
    """Coulomb friction alone turns at once."""
    loop = presliding_loop(FrictionElement(Coulomb(0.2)), 1e-3, 1e-4)
    assert loop.area == pytest.approx(4.0 * 0.2 * 1e-3, rel=ROUNDING)


@pytest.mark.parametrize("omega", [3.0, -3.0, 0.02])
@pytest.mark.parametrize("law", [GMS, LOOP, BESIDE], ids=["gms", "loop", "beside a bristle"])
def test_springs_settle_at_the_steady_torque(law: AbstractFrictionLaw, omega: float) -> None:
    """After any travel beyond its reach a law has its steady torque, loaded or not, and rests there."""
    element = FrictionElement(law, LoadDependence(0.1, 0.0, 0.002))
    z = element.advance(1.0, ca.SX(omega), ca.SX(omega), ca.SX.zeros(len(law.deflections)), 1.5)
    torque, rate = element.bristle_torque(ca.SX(omega), ca.SX(z), 1.5)
    assert numbers(torque) == pytest.approx(float(element.torque(omega, 1.5)), rel=ROUNDING)
    assert np.asarray(ca.DM(rate)).ravel() == pytest.approx(np.zeros(len(law.deflections)), abs=1e-9)
