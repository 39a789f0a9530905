"""The starts of a fit: random ones, the nested model, and what is released from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import axis, measured_axis, problem, still_recording

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.fit import fit
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.parameter_space import nested_space
from friction_ocp.estimation.release import RELEASES, SHARES, released
from friction_ocp.friction.static import CoulombViscous, Polyline, Stribeck
from friction_ocp.parameters import Free

STRIBECK = Stribeck(
    tau_c=Free(0.1, 0.0, 1.0),
    tau_s=Free(0.2, 0.0, 1.0),
    omega_s=Free(3.0, 0.01, 1e3),
    viscous=Free(1e-3, 0.0, 0.1),
)


@pytest.fixture(scope="module")
def stribeck() -> Model:
    """A model whose Stribeck part is released from a nested one."""
    return prepare(problem(axis(STRIBECK), still_recording()))


def test_the_nested_model_has_no_stribeck_part(stribeck: Model) -> None:
    """Breakaway equals the Coulomb friction there, and the Stribeck speed is not fitted."""
    simple = nested_space(stribeck.problem, stribeck.space)
    assert set(simple.names) == {"motor.friction.tau_c", "motor.friction.viscous"}
    numbers = dict(zip(simple.leaf_names, simple.numbers(np.array([0.3, 2e-3]), "run"), strict=True))
    assert numbers["motor.friction.tau_s"] == pytest.approx(numbers["motor.friction.tau_c"])


def test_released_starts_keep_the_friction_far_above_the_stribeck_speed(stribeck: Model) -> None:
    """A small Stribeck speed leaves the Coulomb friction as the nested model has it, give or take the share."""
    simple = nested_space(stribeck.problem, stribeck.space)
    starts = released(stribeck, simple, np.array([0.3, 2e-3]))
    assert len(starts) == len(RELEASES) * len(SHARES)
    names = stribeck.space.names
    for start in starts[: len(SHARES)]:
        values = dict(zip(names, start, strict=True))
        assert values["motor.friction.tau_c"] == pytest.approx(0.3)
        assert values["motor.friction.tau_s"] > values["motor.friction.tau_c"]


def test_a_guess_far_from_all_released_starts_is_one_more(stribeck: Model) -> None:
    """Near them the starts do not depend on the guess; a Stribeck speed that they would never come to is followed."""
    simple = nested_space(stribeck.problem, stribeck.space)
    omega_s = stribeck.space.names.index("motor.friction.omega_s")
    counts: list[int] = []
    for place in (0.5, 1e-3):
        guess = stribeck.space.guess.copy()
        guess[omega_s] = place * stribeck.speeds["motor"].typical
        moved = replace(stribeck, space=replace(stribeck.space, lower=0.0 * guess).moved(guess))
        starts = released(moved, simple, np.array([0.3, 2e-3]))
        counts.append(sum(start[omega_s] == pytest.approx(guess[omega_s]) for start in starts))
    assert counts == [0, 1]


def test_released_breaks_lie_inside_the_speeds_of_the_recording() -> None:
    """The break of a polyline starts at several places below twice the typical speed."""
    law = Polyline(Free(0.1, 0.0, 1.0), (Free(1e-3), Free(1e-4)), (Free(500.0, 0.0, 1e3),))
    model = prepare(problem(axis(law), still_recording()))
    simple = nested_space(model.problem, model.space)
    assert "motor.friction.breaks.0" not in simple.names
    starts = released(model, simple, simple.guess)
    breaks = [start[model.space.names.index("motor.friction.breaks.0")] for start in starts[1:]]
    assert max(breaks) <= 2.0 * model.speed_scale[0]
    assert len(set(breaks)) == len(RELEASES)


def test_more_starts_never_end_worse() -> None:
    """The best of three starts is at least as good as the fit from the guess alone."""
    law = CoulombViscous(Free(0.05, 0.0, 1.0), Free(5e-3, 0.0, 0.1))
    made = problem(axis(law), measured_axis(3), fit="simulation")
    one = fit(prepare(made)).solution
    three = fit(prepare(replace(made, estimation=replace(made.estimation, starts=3)))).solution
    assert three.objective <= one.objective * (1.0 + 1e-9)


def test_both_solvers_find_the_same_answer() -> None:
    """Ipopt and the structured solver agree on the parameters of a drifting axis to a tenth of a standard error."""
    law = CoulombViscous(Free(0.05, 0.0, 1.0), Free(5e-3, 0.0, 0.1))
    made = problem(axis(law), measured_axis(4), fit="simulation")
    ours = identify(made)
    reference = identify(replace(made, estimation=replace(made.estimation, solver="ipopt")))
    assert reference.solver.name == "ipopt"
    for item in ours.parameters:
        assert reference.values[item.name] == pytest.approx(item.value, abs=0.1 * item.std_error)
