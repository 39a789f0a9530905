"""What a joint carries over its twist, from what two models make of the same recording."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.diagnosis.carried import Carried, carried
from friction_ocp.drive.parts import Transmission
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.plots.diagnosis import joint_figure
from friction_ocp.simulation.grid import FloatArray

STIFFNESS, SOFT, PLAY = 800.0, 300.0, 0.01
JOINT = Transmission("motor", "load", ratio=5.0, stiffness=STIFFNESS)
TIME = 1e-3 * np.arange(4000)


def twisted(reach: float) -> FloatArray:
    """Return the twist of a slow swing from one side to the other."""
    return reach * np.sin(2.0 * np.pi * TIME)


def clues(twist: FloatArray | None, torque: FloatArray | None, missing: FloatArray) -> Clues:
    """Return clues of a joint with a twist and the torque that a model makes of it; a rigid one has none."""
    still = {"motor": 0.0 * TIME, "load": 0.0 * TIME}
    joints = [{} if values is None else {"motor-load": values} for values in (twist, torque)]
    lacking = Missing(np.arange(TIME.size), {"motor": missing / 5.0, "load": missing}, still, still, *joints)
    return Clues((Track(TIME, still, still, {}, lacking, lacking),), {}, {"motor": 1.0, "load": 5.0})


def dead_zone(twist: FloatArray) -> FloatArray:
    """Return the torque of a spring behind free play."""
    return STIFFNESS * np.sign(twist) * np.maximum(np.abs(twist) - 0.5 * PLAY, 0.0)


@pytest.mark.parametrize("elastic", [True, False])
def test_a_dead_zone_is_seen_beside_the_spring_that_stood_in_for_it(elastic: bool) -> None:
    """What the motion needs is what the joint carries and what is missing behind it; a rigid joint has no line."""
    twist, left = twisted(0.009), np.full(TIME.size, 0.25)
    before = clues(twist, SOFT * twist, left) if elastic else clues(None, None, left)
    found = carried(before, clues(twist, dead_zone(twist), left), JOINT)
    assert isinstance(found, Carried) and found.component == "motor-load"
    width = float(found.twist[1] - found.twist[0])
    assert found.after == pytest.approx(dead_zone(found.twist), abs=STIFFNESS * width)
    assert found.needed == pytest.approx(found.after + 0.25, abs=1e-12)
    assert np.all((found.lower <= found.needed) & (found.needed <= found.upper))
    assert found.before is None if not elastic else found.before == pytest.approx(SOFT * found.twist, abs=SOFT * width)


def test_where_the_model_before_never_twists_as_far_it_has_no_line() -> None:
    """Its mean is no number there, and is not drawn."""
    twist, near = twisted(0.009), twisted(0.0035)
    found = carried(clues(near, SOFT * near, 0.0 * TIME), clues(twist, dead_zone(twist), 0.0 * TIME), JOINT)
    assert found is not None and found.before is not None
    assert np.array_equal(
        np.isnan(found.before), np.abs(found.twist) - 0.5 * (found.twist[1] - found.twist[0]) > 0.0035
    )
    lines = {"needed": found.needed, "lower": found.lower, "upper": found.upper, "after": found.after}
    drawn = {name: list(map(float, values)) for name, values in {"at": found.twist, **lines}.items()}
    known = [None if np.isnan(value) else float(value) for value in found.before]
    figure = joint_figure({**drawn, "before": known, "component": "motor-load", "unit": "N m", "twist_unit": "rad"})
    labels = [line.get_label() for line in figure.axes[0].get_lines()]
    assert labels[:3] == ["as the motion needs it", "model before", "with what was added"]


def test_a_joint_that_is_rigid_in_both_has_no_card() -> None:
    """Nothing twists it."""
    rigid = clues(None, None, 0.0 * TIME)
    assert carried(rigid, rigid, JOINT) is None
