"""What lies beyond the sampling of a log: numbers of a mode above half its rate, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import aries
import numpy as np
import pytest

from friction_ocp import load_problem
from friction_ocp.estimation.identifiability import Verdict, beyond_the_log, named_in_trades
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.sampling_limit import beyond_sampling

PROBLEMS = Path(__file__).parents[2] / "problems"
BOTH = np.array([True, True])


def model_of(name: str, inertia: float = aries.INERTIA) -> Model:
    """Return a problem of the Schmidt telescope with another inertia."""
    problem = load_problem(PROBLEMS / "aries" / f"{name}.yaml")
    (axis,) = problem.drive.shafts
    return prepare(replace(problem, drive=replace(problem.drive, shafts=(replace(axis, inertia=inertia),))))


def bristle(direction: int = 0) -> np.ndarray:
    """Return sigma0 and sigma1 of the plant."""
    return np.array([aries.NUMBERS[name][direction] for name in ("sigma0", "sigma1")])


@pytest.mark.parametrize(
    ("name", "inertia", "beyond"),
    [("coarse_log", 1000.0, True), ("coarse_log", 1e4, False), ("presliding_east_west", 1000.0, False)],
    ids=["69 Hz at 100 Hz", "22 Hz at 100 Hz", "69 Hz at 1 kHz"],
)
def test_a_mode_above_half_the_rate_hides_what_shapes_it(name: str, inertia: float, beyond: bool) -> None:
    """The frequency sqrt(sigma0 / J) / 2 pi of the presliding axis decides, and only those asked for are judged."""
    model = model_of(name, inertia)
    assert beyond_sampling(model, bristle(), BOTH).tolist() == [beyond, beyond]
    assert not beyond_sampling(model, bristle(), ~BOTH).any()


def test_slow_modes_and_dry_friction_stay_traded() -> None:
    """A 6 Hz mode in a log of 100 Hz is seen, and friction that holds at rest is no fast mode."""
    model = prepare(load_problem(PROBLEMS / "lto" / "inertia_prior.yaml"))
    assert not beyond_sampling(model, model.space.guess, np.ones(model.space.guess.size, dtype=bool)).any()


def test_both_ends_of_a_trade_are_judged() -> None:
    """A parameter that is named by a traded one is beyond the log with it, though its own error is small."""
    space = model_of("coarse_log").space
    judged = (Verdict("ok"), Verdict("traded", (space.names[0],)))
    assert named_in_trades(space, judged).tolist() == [True, True]
    words = beyond_the_log(space, judged, BOTH)
    assert words == (Verdict("not_identifiable", (space.names[1],)), Verdict("not_identifiable", (space.names[0],)))
    assert beyond_the_log(space, judged, ~BOTH) == judged
