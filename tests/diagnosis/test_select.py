"""How rivals are weighed: what tells two of the same residuals apart, and which of them are named."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from friction_ocp.diagnosis.blocks import Blocks
from friction_ocp.diagnosis.rival import Rival, Standing
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.diagnosis.select import Choice, choose, shown, with_first
from friction_ocp.effects.effect import Augmentation

COUNT = 60
BLOCKS = Blocks(np.arange(COUNT), np.repeat(np.arange(3), COUNT // 3))
RESIDUAL = np.random.default_rng(5).standard_normal(600)
DRIVE: Any = None
"""No rival of these tests is simulated."""


def rival(effect: str, component: str, off: dict[str, float], prior: float = 0.0, gain: float = 5.0) -> Rival:
    """Return a rival that gains the same in every block; those that gain the same leave the same residuals."""
    left = RESIDUAL / gain
    rows = SimpleNamespace(residual=left, channel=np.zeros(left.size))
    fitted = cast(Any, SimpleNamespace(linear=SimpleNamespace(rows=rows)))
    size = float(np.linalg.norm(left))
    standing = Standing(cost=1.0, objective=1.0, size=size, determined=3, values={}, prior=prior)
    screened = Screened(effect, component, 1.0, 0.0, (), Augmentation(DRIVE, off, ()))
    return Rival(screened, standing, np.full(COUNT, gain), lambda: fitted)


def chosen(*rivals: Rival) -> Choice:
    return choose(list(rivals), BLOCKS, 3, 0.01, np.random.default_rng(0))


def test_stated_values_tell_equal_explanations_apart() -> None:
    """Of a heavier rotor and a stronger motor, the one that leaves other stated values where they are is right."""
    light = rival("inertia_error", "motor", {"motor.inertia": 1.0})
    strong = rival("parameter_error", "drive", {"drive.torque_constant": 1.0}, prior=9.0)
    choice = chosen(strong, light)
    assert choice.rivals[0] is light
    odds = choice.probabilities[0] / choice.probabilities[1]
    assert odds == pytest.approx(np.exp(9.0))
    assert choice.aliases == (light,)


def test_a_period_that_comes_out_as_once_a_turn_is_that_of_an_unbalance() -> None:
    """What might have had any period and leaves the same residuals is less likely by how exactly that is told."""
    pull = rival("unbalance", "motor", {"motor.gravity.torque": 0.0})
    wave = rival("cogging", "motor", {"motor.cogging.cosine": 0.0})
    wave = replace(wave, standing=replace(wave.standing, exactness=8.0))
    choice = chosen(wave, pull)
    assert choice.rivals[0] is pull
    assert choice.probabilities[0] / choice.probabilities[1] == pytest.approx(np.exp(8.0))


def test_a_gain_outweighs_what_stated_values_cost() -> None:
    """However far stated values have to give way, what explains more than that costs is the likelier cause."""
    strange = rival("presliding", "motor", {"sigma0": 0.0}, prior=900.0, gain=50.0)
    usual = rival("stribeck", "motor", {"tau_s": 0.0}, prior=0.0, gain=5.0)
    choice = chosen(usual, strange)
    assert choice.rivals[0] is strange
    assert sum(choice.probabilities) + choice.nothing == pytest.approx(1.0)


def test_what_has_all_that_another_has_is_not_named_beside_it() -> None:
    """An eccentric disc with a free zero says nothing that the zero alone does not; the other encoder's zero does."""
    here = rival("sensor_offset", "motor_position", {"motor_position.offset": 0.0})
    there = rival("sensor_offset", "load_position", {"load_position.offset": 0.0})
    disc = rival("sensor_eccentricity", "load_position", {"load_position.offset": 0.0, "load_position.wave": 0.0})
    assert shown((here, disc, there)) == (here, there)
    assert shown((disc, here)) == (disc, here)


@pytest.mark.parametrize(("play", "first"), [(0.0, "compliance"), (1e-4, "backlash")])
def test_what_comes_out_as_nothing_is_no_effect(play: float, first: str) -> None:
    """Flanks of a joint without play between them are a spring, however much better the fit of the flanks ended."""
    spring = rival("compliance", "gear", {"gear.stiffness": np.inf}, gain=2.0)
    flanks = rival("backlash", "gear", {"gear.stiffness": np.inf, "gear.backlash": 0.0}, gain=3.0)
    flanks = replace(flanks, standing=replace(flanks.standing, values={"gear.stiffness": 9.0, "gear.backlash": play}))
    assert chosen(spring, flanks).rivals[0].key[0] == first


def test_the_same_effect_elsewhere_stands_back_behind_a_rival() -> None:
    """Where a rival differs, naming one effect at two components that are the same would make three of two answers."""
    arm, motor = rival("constant_torque", "arm", {"a": 0.0}), rival("constant_torque", "motor", {"b": 0.0})
    other = rival("asymmetry", "motor", {"c": 0.0}, gain=4.0)
    assert shown((arm, motor)) == (arm, motor)
    assert shown((arm, motor, other)) == (arm, other)


def test_what_left_the_same_once_is_not_named_for_what_it_leaves_now() -> None:
    """Of two that were the same, one that was fitted again beside a later addition leaves other residuals."""
    arm, motor = rival("constant_torque", "arm", {"a": 0.0}, gain=2.0), rival("constant_torque", "motor", {"b": 0.0})
    other = rival("asymmetry", "motor", {"c": 0.0}, gain=4.0)
    choice = Choice((arm, motor, other), (0.5, 0.3, 0.2), 0.0, True, (arm, other, motor), (arm,))
    assert choice.named == (arm, other, motor)
    assert replace(choice, same=(arm, motor)).named == (arm, other)


def test_another_of_an_alias_set_can_be_accepted() -> None:
    """It takes the place and the probability of the first, and those that leave the same residuals stand with it."""
    one, other = rival("stribeck", "motor", {"a": 0.0}, gain=5.0), rival("cogging", "motor", {"b": 0.0}, gain=2.0)
    alike = rival("unbalance", "motor", {"c": 0.0}, gain=2.0)
    choice = Choice((one, other, alike), (0.5, 0.3, 0.2), 0.0, True, (one, other, alike), (one,))
    moved = with_first(choice, other)
    assert moved.aliases == (other, one, alike)
    assert moved.same == (other, alike)
    assert moved.rivals == (other, one, alike)
    assert moved.probabilities == (0.5, 0.3, 0.2)


def test_a_special_case_comes_before_what_contains_it() -> None:
    """As long as the recordings do not exclude it: more parameters that gain a little are no other effect."""
    zero = rival("sensor_offset", "motor_position", {"motor_position.offset": 0.0}, gain=5.0)
    disc = rival("sensor_eccentricity", "motor_position", {"motor_position.offset": 0.0, "wave": 0.0}, gain=3.0)
    disc = replace(disc, gains=zero.gains + 0.03, standing=replace(disc.standing, values={"wave": 0.1}))
    found = chosen(disc, zero)
    assert found.aliases == (zero, disc) and found.rivals[0] is zero
    assert found.probabilities[0] > found.probabilities[1] > 0.0
    assert chosen(replace(disc, gains=disc.gains + 1.0), zero).aliases[0].key == disc.key


def test_a_wave_that_may_have_any_period_comes_after_an_unbalance() -> None:
    """As long as one turn is not excluded; it is still named beside that, since a magnet may have the same period."""
    pull = rival("unbalance", "motor", {"motor.gravity.torque": 0.0}, gain=5.0)
    wave = rival("cogging", "motor", {"motor.cogging.cosine": 0.0}, gain=3.0)
    found = replace(wave.standing, values={"motor.cogging.cosine": 0.1})
    wave = replace(wave, gains=pull.gains + 0.03, standing=found)
    assert [item.key[0] for item in chosen(wave, pull).named] == ["unbalance", "cogging"]
    assert [item.key[0] for item in chosen(replace(wave, gains=wave.gains + 1.0), pull).named] == ["cogging"]
    elsewhere = rival("unbalance", "load", {"load.gravity.torque": 0.0}, gain=5.0)
    assert chosen(wave, elsewhere).rivals[0].key == wave.key
    beside = replace(pull, standing=replace(pull.standing, determined=wave.standing.determined + 1))
    assert chosen(wave, beside).rivals[0].key == wave.key
