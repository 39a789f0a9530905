"""The fitted parameters as one vector: ties, scopes, values set by recording, directions, nested models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from axes import axis, problem, still_recording, two_masses

from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.parameter_space import ParameterSpace, nested_space, parameter_space
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.friction.static import CoulombViscous, Polyline, Quadratic, Stribeck
from friction_ocp.parameters import Directional, Free, Tie


def leaf_names(drive: Drive) -> tuple[str, ...]:
    """Return the paths of all numbers of a drive."""
    return tuple(leaf.path for leaf in drive_leaves(drive))


def space_of(made: Problem) -> ParameterSpace:
    """Return the parameter space of a problem."""
    return parameter_space(made, leaf_names(made.drive))


def numbers(space: ParameterSpace, theta: list[float] | np.ndarray, recording: str = "run") -> dict[str, float]:
    """Return all numbers of the drive by their paths."""
    values = space.numbers(np.asarray(theta, dtype=float), recording)
    return dict(zip(space.leaf_names, values.tolist(), strict=True))


def test_what_has_a_guess_is_fitted_and_the_rest_is_known() -> None:
    """Names follow the parts; guesses, bounds and priors follow the names."""
    law = CoulombViscous(0.1, Free(0.002, 0.0, 0.01, prior_std=1e-4, prior_mean=0.003))
    space = space_of(problem(axis(law, inertia=Free(0.005, 0.001, 0.01))))
    assert space.names == ("motor.inertia", "motor.friction.viscous")
    assert space.guess.tolist() == [0.005, 0.002]
    assert (space.lower.tolist(), space.upper.tolist()) == ([0.001, 0.0], [0.01, 0.01])
    assert (space.prior_mean.tolist(), space.prior_std.tolist()) == ([0.005, 0.003], [np.inf, 1e-4])
    found = numbers(space, [0.006, 0.004])
    assert (found["motor.inertia"], found["motor.friction.viscous"]) == (0.006, 0.004)
    assert found["motor.friction.tau_c"] == 0.1


def test_a_tie_follows_what_it_is_made_of() -> None:
    """A tied number is computed from fitted, tied and known ones, and its slope by the chain rule."""
    law = CoulombViscous(Tie("motor.inertia * 20"), Tie("motor.friction.tau_c / drive.torque_constant"))
    space = space_of(problem(axis(law, inertia=Free(0.005))))
    found = numbers(space, [0.01])
    assert space.names == ("motor.inertia",)
    assert found["motor.friction.tau_c"] == pytest.approx(0.2)
    assert found["motor.friction.viscous"] == pytest.approx(0.2 / 0.35)
    _, slope = space.numbers_and_slope(np.array([0.01]), "run")
    by_path = dict(zip((space.leaf_names[k] for k in space.active), slope[:, 0], strict=True))
    expected = {"motor.inertia": 1.0, "motor.friction.tau_c": 20.0, "motor.friction.viscous": 20.0 / 0.35}
    assert by_path == pytest.approx(expected)


def test_a_parameter_of_one_recording_has_a_value_in_each() -> None:
    """`scope: recording` makes one parameter a training recording, named path@recording."""
    law = CoulombViscous(Free(0.1, scope="recording"), Free(0.01))
    made = problem(axis(law), still_recording("cold"), still_recording("warm"))
    made = replace(made, validation=(RecordingUse(still_recording("held_out")),))
    space = space_of(made)
    assert space.names == ("motor.friction.tau_c@cold", "motor.friction.tau_c@warm", "motor.friction.viscous")
    taus = [numbers(space, [1, 2, 3], name)["motor.friction.tau_c"] for name in ("cold", "warm", "held_out")]
    assert taus == [1.0, 2.0, 0.1]
    assert {numbers(space, [1, 2, 3], name)["motor.friction.viscous"] for name in ("cold", "warm", "held_out")} == {3.0}


def test_a_value_set_beside_a_recording_holds_there_alone() -> None:
    """`set` replaces a known number, and takes a parameter of recordings out of the fit where it is known."""
    law = CoulombViscous(Free(0.1, scope="recording"), 0.01)
    known = RecordingUse(still_recording("known"), {"motor.friction.tau_c": 0.2, "drive.torque_constant": 0.5})
    space = space_of(problem(axis(law), still_recording("open"), known))
    assert space.names == ("motor.friction.tau_c@open",)
    found = {name: numbers(space, [0.7], name) for name in ("open", "known")}
    assert [found[name]["motor.friction.tau_c"] for name in found] == [0.7, 0.2]
    assert [found[name]["drive.torque_constant"] for name in found] == [0.35, 0.5]


def test_a_directional_parameter_has_two_paths() -> None:
    """Each direction is known or fitted on its own."""
    law = CoulombViscous(Directional(Free(0.1), 0.2), Directional(Free(0.3), Free(0.4)))
    space = space_of(problem(axis(law)))
    stem = "motor.friction."
    assert space.names == (f"{stem}tau_c.positive", f"{stem}viscous.positive", f"{stem}viscous.negative")
    assert numbers(space, [1, 3, 4])[f"{stem}tau_c.negative"] == 0.2


def test_constraints_are_margins_with_their_slopes() -> None:
    """`a >= b` is the margin a - b, which must not be negative."""
    law = CoulombViscous(Free(0.1), Free(0.01))
    space = space_of(replace(problem(axis(law)), constraints=("motor.friction.tau_c >= 2 * motor.friction.viscous",)))
    assert space.constraints is not None
    margins, slopes = space.constraints([0.5, 0.2])
    assert np.asarray(margins).ravel() == pytest.approx([0.1])
    assert np.asarray(slopes) == pytest.approx(np.array([[1.0, -2.0]]))


def test_nothing_to_fit_is_an_error_of_the_fit_alone() -> None:
    """A problem without any guess has an empty space, can be simulated, and is told by identify what a guess is."""
    known = problem(axis())
    assert space_of(known).names == ()
    with pytest.raises(FrictionOcpError, match=r"nothing to fit; a parameter with \{guess: ...\} is fitted"):
        identify(known)


def test_a_moved_start_leaves_priors_and_bounds() -> None:
    """Multi-starts move only the start."""
    space = space_of(problem(axis(inertia=Free(0.005, 0.001, 0.01, prior_std=1e-4))))
    moved = space.moved(np.array([0.008]))
    assert moved.guess.tolist() == [0.008]
    assert (moved.prior_mean, moved.lower, moved.upper) == (space.prior_mean, space.lower, space.upper)


def test_clipping_moves_to_the_nearest_allowed_point() -> None:
    """What lies inside stays."""
    space = space_of(problem(axis(CoulombViscous(Free(0.1, 0.0, 1.0), Free(0.01, 0.0)))))
    assert space.clip(np.array([2.0, 7.0])).tolist() == [1.0, 7.0]
    assert space.clip(np.array([-2.0, -7.0])).tolist() == [0.0, 0.0]


def test_what_rounding_keeps_off_a_bound_is_on_it() -> None:
    """Be there another bound or none: a parameter that can go no further informs of nothing beyond."""
    space = space_of(problem(axis(CoulombViscous(Free(0.1, 0.0, 1.0), Free(0.01, 0.0)))))
    assert [end.tolist() for end in space.ends(np.array([1e-12, 1e-13]))] == [[True, True], [False, False]]
    assert [end.tolist() for end in space.ends(np.array([1.0, 1e-4]))] == [[False, False], [True, False]]


def test_scales_are_typical_sizes() -> None:
    """The guess, a share of the bounds where it is zero, and ten prior deviations where those are smaller."""
    law = CoulombViscous(Free(0.0, -1.0, 1.0), Free(5.0, prior_std=0.01))
    assert space_of(problem(axis(law, inertia=Free(0.005)))).scale == pytest.approx([0.005, 0.1, 0.1])


Law = Callable[[], Stribeck | Polyline | Quadratic]
fitted = Free(0.3)


@pytest.mark.parametrize(
    ("law", "kept", "equal"),
    [
        (lambda: Stribeck(Free(0.1), Free(0.2), Free(2.0), Free(0.01)), ("tau_c", "viscous"), {"tau_s": "tau_c"}),
        (lambda: Quadratic(Free(0.1), Free(0.01), Free(1e-3)), ("tau_c", "viscous"), {"quadratic": 0.0}),
        (
            lambda: Polyline(Free(0.1), (Free(0.02), Free(0.01)), (Free(5.0),)),
            ("tau_c", "slopes.0"),
            {"slopes.1": "slopes.0", "breaks.0": 5.0},
        ),
        (
            lambda: Stribeck(Directional(fitted, Free(0.1)), Directional(fitted, Free(0.2)), 2.0),
            ("tau_c.positive", "tau_c.negative"),
            {"tau_s.positive": "tau_c.positive", "tau_s.negative": "tau_c.negative"},
        ),
    ],
    ids=["stribeck", "quadratic", "polyline", "directional stribeck"],
)
def test_the_nested_model_is_a_point_of_the_full_one(law: Law, kept: tuple[str, ...], equal: dict[str, object]) -> None:
    """It fits fewer parameters; what it leaves out equals another parameter or a number, and nothing else changes."""
    made = problem(axis(law()))
    full = space_of(made)
    simple = nested_space(made, full)
    assert simple.names == tuple(f"motor.friction.{name}" for name in kept)
    theta = 0.5 + np.arange(len(kept))
    found = numbers(simple, theta)
    by_name = dict(zip(kept, theta, strict=True))
    for name, other in equal.items():
        assert found[f"motor.friction.{name}"] == (by_name[other] if isinstance(other, str) else other)
    assert simple.active == full.active
    lifted = np.array([found[name] for name in full.names])
    assert numbers(full, lifted) == pytest.approx(found)


def test_a_plain_law_has_no_nested_model() -> None:
    """Coulomb and viscous friction are the simplest already."""
    made = problem(axis(CoulombViscous(Free(0.1), Free(0.01))))
    space = space_of(made)
    assert nested_space(made, space) is space


def test_paths_of_transmissions_take_part_in_ties() -> None:
    """A hyphen in a path is no minus."""
    drive = two_masses(stiffness=Free(200.0))
    load = replace(drive.shafts[1], inertia=Tie("motor-load.stiffness / 1000"))
    space = space_of(problem(replace(drive, shafts=(drive.shafts[0], load))))
    assert numbers(space, [0.002, 400.0])["load.inertia"] == pytest.approx(0.4)
